//! Warnings of the identifications, in full and one of each kind.

use rig_output::worst_first;

use crate::identified_set::IdentifiedSet;

/// Words that tell kinds of warnings apart, without numbers and names of joints.
const WORDS: usize = 6;

/// A warning of a set.
struct Warning<'a> {
    set: &'a str,
    text: &'a str,
    kind: String,
    /// Largest share of a joint's torque that the set's model leaves.
    residual: f64,
}

/// Returns the warnings of the identifications, each with its set.
pub(crate) fn warnings(sets: &[IdentifiedSet]) -> Vec<String> {
    (sets.iter())
        .flat_map(|set| {
            let own = set.found.warnings.iter();
            own.map(|warning| format!("Set {}: {warning}", set.name))
        })
        .collect()
}

/// Returns one warning of each kind: that of the set with the largest residual, and the names of the others.
pub(crate) fn brief_warnings(sets: &[IdentifiedSet]) -> Vec<String> {
    let all = sets.iter().flat_map(|set| {
        let joints: Vec<&str> = set.found.joints.iter().map(|j| j.name.as_str()).collect();
        let shares = set.found.joints.iter().map(|j| j.train_relative_error);
        let residual = shares.filter(|e| e.is_finite()).fold(0.0, f64::max);
        set.found.warnings.iter().map(move |text| Warning {
            set: &set.name,
            text,
            kind: kind(text, &joints),
            residual,
        })
    });
    let kinds = worst_first(all, |w| (w.kind.clone(), w.residual));
    kinds.iter().map(|own| line(own)).collect()
}

/// Writes the first warning of a kind and the other sets that have one of this kind.
fn line(own: &[Warning]) -> String {
    let Some(first) = own.first() else {
        return String::new();
    };
    let mut others: Vec<&str> = Vec::new();
    for other in &own[1..] {
        if other.set != first.set && !others.contains(&other.set) {
            others.push(other.set);
        }
    }
    let rest = match others.as_slice() {
        [] => String::new(),
        [one] => format!(" Set {one} has a warning of this kind, too."),
        _ => format!(
            " Sets {} have warnings of this kind, too.",
            others.join(", ")
        ),
    };
    format!("Set {}: {}{rest}", first.set, first.text)
}

/// Returns the first words of a warning without numbers and names of joints.
fn kind(text: &str, joints: &[&str]) -> String {
    let word = |w: &&str| {
        let bare = w.trim_matches(|c: char| !c.is_alphanumeric() && c != '_');
        !w.contains(|c: char| c.is_ascii_digit()) && !joints.contains(&bare)
    };
    let words: Vec<&str> = text.split_whitespace().filter(word).take(WORDS).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_that_differ_in_joint_and_numbers_are_of_one_kind() {
        let joints = ["upper_arm", "wrist"];
        let of = |text: &str| kind(text, &joints);
        let left = "the model leaves 40 % of the torque unexplained on the data it was fitted to.";
        assert_eq!(
            of(&format!("Joint upper_arm: {left}")),
            of("Joint wrist: the model leaves 31 % of the torque unexplained on the data.")
        );
        assert_ne!(
            of(&format!("Joint wrist: {left}")),
            of(
                "Joint wrist: the residual on the hold-out (0.2 N·m) is 3 times that on the training data."
            )
        );
        let warning = |set, residual| Warning {
            set,
            text: left,
            kind: "left".into(),
            residual,
        };
        let said = line(&[warning("b", 0.4), warning("a", 0.3), warning("b", 0.4)]);
        assert!(
            said.starts_with("Set b: ") && said.ends_with("Set a has a warning of this kind, too.")
        );
    }
}
