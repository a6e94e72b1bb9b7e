//! Names of joints in the names of channels: `elbow_pos`, `position/elbow`, `elbow.position`.

use super::time_names::words;
use super::unit::Unit;

/// A joint whose name is part of a channel's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NamedJoint {
    /// Its index, from 0.
    pub joint: usize,
    /// The other words of the channel's name, in lower case.
    pub others: Vec<String>,
}

/// Returns the joint whose name has the most words among those that the channel's name contains as whole words, one
/// behind the other.
pub(super) fn joint_in(channel: &str, joints: &[String]) -> Option<NamedJoint> {
    let all = words(channel);
    let found = joints.iter().enumerate().filter_map(|(joint, name)| {
        let own = words(name);
        if own.is_empty() {
            return None;
        }
        let at = all.windows(own.len()).rposition(|w| w == own.as_slice())?;
        Some((joint, at, own.len()))
    });
    // `max_by_key` returns the last of equal ones; the first joint counts.
    let (joint, at, length) = found.rev().max_by_key(|(.., length)| *length)?;
    let (before, rest) = all.split_at_checked(at)?;
    let others = [before, rest.get(length..).unwrap_or_default()].concat();
    Some(NamedJoint { joint, others })
}

/// Returns true if the unit at the end of a channel's name is a part of the name of a joint (`position/wrist_turn`).
pub(super) fn is_in_joint(channel: &str, joints: &[String]) -> bool {
    let of = |name: &str| joint_in(name, joints).map(|own| own.joint);
    let bare = Unit::stated(channel).map(|(bare, _)| bare);
    let whole = of(channel);
    whole.is_some() && bare.is_some_and(|bare| of(bare) != whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_found_as_whole_words_and_their_names_are_no_units() {
        let joints = ["elbow", "wrist_turn", "wrist", "joint_1", "joint_11"].map(str::to_owned);
        let of = |name: &str| joint_in(name, &joints).map(|own| own.joint);
        for (name, joint) in [
            ("elbow_pos", Some(0)),
            ("position/elbow", Some(0)),
            ("elbow.position [deg]", Some(0)),
            ("position/wrist_turn", Some(1)),
            ("wrist_pos", Some(2)),
            ("joint_11_position", Some(4)),
            ("joint1_position", Some(3)),
            ("elbows_pos", None),
        ] {
            assert_eq!(of(name), joint, "{name}");
        }
        assert!(is_in_joint("position/wrist_turn", &joints));
        assert!(is_in_joint("wrist_turn", &joints));
        for name in ["wrist_turn_deg", "elbow_pos_deg", "q1 [deg]", "elbow_rev"] {
            assert!(!is_in_joint(name, &joints), "{name}");
        }
    }
}
