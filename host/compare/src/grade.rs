//! The grade of a comparison.

use crate::result::{Causes, Grade, JointTest, PooledParameter, TorqueMatrix};
use crate::significance::{FAMILY_LEVEL, TEST_LEVEL};

/// What a grade is given on.
pub(crate) struct Graded<'a> {
    /// Names of the sets.
    pub names: &'a [String],
    /// The parameters.
    pub parameters: &'a [PooledParameter],
    /// Test of all parameters.
    pub joint: Option<&'a JointTest>,
    /// By set, the same test of all other sets.
    pub without: &'a [JointTest],
    /// Sentences on friction that changes during the recordings.
    pub drifting: &'a [String],
    /// Sets whose joints' torques contradict each other.
    pub contradicting: &'a [&'a str],
    /// Torque residuals.
    pub torque: &'a TorqueMatrix,
    /// Tested causes.
    pub causes: Option<&'a Causes>,
    /// Share of the torque that matters.
    pub tolerance: f64,
}

/// Returns the grade and its reasons.
pub(crate) fn grade(of: &Graded) -> (Grade, Vec<String>) {
    let Some(joint) = of.joint else {
        return (
            Grade::NotComparable,
            vec!["No parameter is shown by every set: their motions excite different parameters. Record one motion for all sets.".into()],
        );
    };
    let differing: Vec<&str> = (of.parameters.iter())
        .filter(|p| p.test.is_some_and(|t| t.differs))
        .map(|p| p.expression.as_str())
        .collect();
    let tested = of.parameters.iter().filter(|p| p.test.is_some()).count();
    let mut reasons = vec![
        format!(
            "{} of {tested} tested parameters differ by more than their errors (level {} after Holm's correction){}",
            differing.len(),
            TEST_LEVEL,
            match differing.is_empty() {
                true => ".".to_owned(),
                false => format!(": {}.", differing.join(", ")),
            }
        ),
        format!(
            "All parameters together: χ² {:.1} with {} degrees of freedom, p {}; the sets {} (level {}).",
            joint.chi2,
            joint.degrees_of_freedom,
            written(joint.p),
            if joint.differs {
                "differ"
            } else {
                "do not differ significantly"
            },
            TEST_LEVEL
        ),
    ];
    let differ = joint.differs || !differing.is_empty();
    if differ {
        reasons.extend(outlier(of));
    }
    let worst = of.torque.worst();
    let matters = worst.is_some_and(|(share, ..)| share > of.tolerance);
    if let Some((share, joint, motion, set)) = worst {
        reasons.push(format!(
            "Largest effect on the torque: the parameters of {} on the motion of {} add a residual of {:.2} % of the torque of {} ({} than the tolerance of {} %).",
            of.names[set],
            of.names[motion],
            100.0 * share,
            of.torque.joints[joint],
            if matters { "more" } else { "not more" },
            100.0 * of.tolerance
        ));
    }
    if differ && let Some(causes) = of.causes {
        reasons.push(causes.sentence.clone());
        reasons.extend(causes.corrected.iter().map(|own| own.sentence.clone()));
    }
    reasons.extend_from_slice(of.drifting);
    let grade = match (differ, matters) {
        (false, false) => Grade::Agree,
        (false, true) => Grade::Undecided,
        (true, false) => Grade::DifferWithoutEffect,
        (true, true) => Grade::DifferAndMatter,
    };
    if grade == Grade::Undecided && !of.contradicting.is_empty() {
        reasons.push(format!(
            "The torques of the joints of {} contradict each other (see the warnings), which makes the errors of its parameters large: correct the torques, or leave out the set.",
            of.contradicting.join(" and of ")
        ));
    } else if grade == Grade::Undecided && of.drifting.is_empty() {
        reasons.push("The errors of the parameters are too large to tell whether the sets differ: longer or livelier recordings would decide it.".into());
    }
    (grade, reasons)
}

/// Names the one set without which the others do not differ.
fn outlier(of: &Graded) -> Option<String> {
    let mut alone = (of.without.iter().zip(of.names)).filter(|(test, _)| test.p >= FAMILY_LEVEL);
    let (test, name) = alone.next()?;
    if alone.next().is_some() {
        return None;
    }
    Some(format!(
        "Without {name} the other sets do not differ: χ² {:.1} with {} degrees of freedom, p {}.",
        test.chi2,
        test.degrees_of_freedom,
        written(test.p)
    ))
}

/// Writes a probability with its sign of comparison.
pub(crate) fn written(p: f64) -> String {
    match p < 1e-4 {
        true => "< 0.0001".into(),
        false => format!("= {p:.4}"),
    }
}
