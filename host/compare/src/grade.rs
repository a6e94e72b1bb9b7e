//! The grade of a comparison.

use crate::result::{Causes, Comparison, Grade, JointTest, PooledParameter, TorqueMatrix};
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
    /// Sets that are too short for errors: place among the sets, and a sentence.
    pub short: &'a [(usize, String)],
    /// Torque residuals.
    pub torque: &'a TorqueMatrix,
    /// Tested causes.
    pub causes: Option<&'a Causes>,
    /// Share of the torque that matters.
    pub tolerance: f64,
}

/// Returns true if the test of all parameters, or of any one, says that the sets differ.
fn differ(joint: &JointTest, parameters: &[PooledParameter]) -> bool {
    let mut tests = parameters.iter().filter_map(|own| own.test);
    joint.differs || tests.any(|test| test.differs)
}

impl Comparison {
    /// Returns true if a test of the parameters says that the sets differ. Where errors are not known that decides nothing.
    pub fn tests_differ(&self) -> bool {
        let joint = self.joint_test.as_ref();
        joint.is_some_and(|joint| differ(joint, &self.parameters))
    }
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
    let differ = differ(joint, of.parameters);
    let unknown = differ && !decided_without_short(of);
    let mut reasons = tests(of, joint, &differing, unknown);
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
    if differ
        && !unknown
        && let Some(causes) = of.causes
    {
        reasons.push(causes.sentence.clone());
        reasons.extend(causes.corrected.iter().map(|own| own.sentence.clone()));
    }
    reasons.extend_from_slice(of.drifting);
    let grade = match (differ, matters) {
        _ if unknown => Grade::Undecided,
        // The errors of such a set are so large that its parameters agree with any others. All sets may share a wrong gear
        // ratio of the description.
        (false, _) if (1..of.names.len()).contains(&of.contradicting.len()) => Grade::Undecided,
        (false, false) => Grade::Agree,
        (false, true) => Grade::Undecided,
        (true, false) => Grade::DifferWithoutEffect,
        (true, true) => Grade::DifferAndMatter,
    };
    if grade != Grade::Agree {
        reasons.extend(of.short.iter().map(|(_, why)| why.clone()));
    }
    if grade == Grade::Undecided && !of.contradicting.is_empty() {
        reasons.push(format!(
            "The torques of the joints of {} contradict each other (see the warnings), which makes the errors of its parameters large: correct the torques, or leave out the set.",
            of.contradicting.join(" and of ")
        ));
    } else if grade == Grade::Undecided && of.drifting.is_empty() && of.short.is_empty() {
        reasons.push("The errors of the parameters are too large to tell whether the sets differ: longer or livelier recordings would decide it.".into());
    }
    (grade, reasons)
}

/// Says what the tests of the parameters give; `unknown`: whether not all of their errors are known.
fn tests(of: &Graded, joint: &JointTest, differing: &[&str], unknown: bool) -> Vec<String> {
    let tested = of.parameters.iter().filter(|p| p.test.is_some()).count();
    vec![
        format!(
            "{} of {tested} tested parameters differ by more than their {}errors (level {} after Holm's correction){}",
            differing.len(),
            if unknown { "computed " } else { "" },
            TEST_LEVEL,
            match differing.is_empty() {
                true => ".".to_owned(),
                false => format!(": {}.", differing.join(", ")),
            }
        ),
        format!(
            "All parameters together: χ² {:.1} with {} degrees of freedom, p {}; {} (level {}).",
            joint.chi2,
            joint.degrees_of_freedom,
            written(joint.p),
            match (unknown, joint.differs) {
                (true, _) => "this decides nothing, as not all of these errors are known",
                (false, true) => "the sets differ",
                (false, false) => "the sets do not differ significantly",
            },
            TEST_LEVEL
        ),
    ]
}

/// Returns false if a difference may be that of sets whose errors are not known: no others are left to compare, or the
/// others do not differ.
fn decided_without_short(of: &Graded) -> bool {
    match of.short {
        [] => true,
        [(set, _)] => (of.without.get(*set)).is_some_and(|others| others.differs),
        _ => false,
    }
}

/// Names the one set without which the others do not differ.
fn outlier(of: &Graded) -> Option<String> {
    let mut alone = (of.without.iter().zip(of.names)).filter(|(test, _)| test.p >= FAMILY_LEVEL);
    let (test, name) = alone.next()?;
    if alone.next().is_some() {
        return None;
    }
    Some(format!(
        "Without {name} the other sets do not differ: χ² {:.1} with {} degrees of freedom, p {}. Compare them without it for pooled values to trust.",
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sets, or three, that differ by a test; `others`: whether all but the last differ, too.
    fn graded(short: &[(usize, String)], others: &[bool]) -> (Grade, Vec<String>) {
        let test = |differs: bool| JointTest {
            chi2: if differs { 90.0 } else { 3.0 },
            degrees_of_freedom: 4,
            p: if differs { 1e-9 } else { 0.5 },
            differs,
        };
        let without: Vec<JointTest> = others.iter().map(|own| test(*own)).collect();
        let names = ["long", "longer", "short"].map(str::to_owned);
        let added = vec![vec![vec![0.5; 4]; 3]];
        grade(&Graded {
            names: &names,
            parameters: &[],
            joint: Some(&test(true)),
            without: &without,
            drifting: &[],
            contradicting: &[],
            short,
            torque: &TorqueMatrix {
                joints: vec!["link".into()],
                residual: added.clone(),
                torque: vec![vec![1.0; 3]],
                added,
            },
            causes: None,
            tolerance: 0.05,
        })
    }

    #[test]
    fn a_set_without_known_errors_decides_nothing_and_hides_nothing() {
        let short = [(2, "short is too short.".to_owned())];
        let (grade, reasons) = graded(&short, &[]);
        assert_eq!(grade, Grade::Undecided);
        assert!(reasons.contains(&short[0].1), "{reasons:?}");
        let says = |reasons: &[String], what: &str| reasons.iter().any(|own| own.contains(what));
        assert!(!says(&reasons, "the sets differ"), "{reasons:?}");
        assert!(says(&graded(&[], &[]).1, "the sets differ"));
        assert_eq!(graded(&short, &[true, true, false]).0, Grade::Undecided);
        assert_eq!(
            graded(&short, &[true, true, true]).0,
            Grade::DifferAndMatter
        );
        assert_eq!(graded(&[], &[]).0, Grade::DifferAndMatter);
    }
}
