//! Warnings of the identifications, in full and one of each kind; friction that changes during a recording.

use rig_identify::{LEAST_STRETCHES, Warning};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_value, worst_first};

use crate::identified_set::IdentifiedSet;
use crate::significance::{FAMILY_LEVEL, holm};

/// A warning of a set.
struct SetWarning<'a> {
    set: &'a str,
    warning: &'a Warning,
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
        let shares = set.found.joints.iter().map(|j| j.train_relative_error);
        let residual = shares.filter(|e| e.is_finite()).fold(0.0, f64::max);
        set.found.warnings.iter().map(move |warning| SetWarning {
            set: &set.name,
            warning,
            residual,
        })
    });
    let kinds = worst_first(all, |w| (w.warning.kind(), w.residual));
    kinds.iter().map(|own| line(own)).collect()
}

/// Writes the first warning of a kind and the other sets that have one of this kind.
fn line(own: &[SetWarning]) -> String {
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
    format!("Set {}: {}{rest}", first.set, first.warning)
}

/// Returns the names of the sets whose joints' torques contradict each other, which one factor at one joint explains.
pub(crate) fn contradicting(sets: &[IdentifiedSet]) -> Vec<&str> {
    let is = |set: &&IdentifiedSet| {
        let mut own = set.found.warnings.iter();
        own.any(|warning| matches!(warning, Warning::TorqueDisagrees(_)))
    };
    sets.iter()
        .filter(is)
        .map(|set| set.name.as_str())
        .collect()
}

/// Returns the sets whose errors come from groups of rows that are not independent, with a sentence: what they differ by
/// cannot be compared with their errors.
pub(crate) fn too_short(sets: &[IdentifiedSet]) -> Vec<(usize, String)> {
    let short = |set: &IdentifiedSet| {
        let mut own = set.found.warnings.iter();
        own.find_map(|warning| match warning {
            Warning::FewStretches { stretches, .. } => Some(*stretches),
            _ => None,
        })
    };
    (sets.iter().enumerate())
        .filter_map(|(k, set)| {
            let stretches = short(set)?;
            // Rows near reversals and at the ends are not used, so a time by the used rows would be too short.
            let longer = (10.0 * LEAST_STRETCHES / stretches).ceil() / 10.0;
            Some((k, format!(
                "{} is too short: its errors come from {} independent stretches instead of {LEAST_STRETCHES} or more, so whether it differs is not decided. Record it at least {longer} times as long, or leave it out.",
                set.name,
                format_significant(stretches, 2),
            )))
        })
        .collect()
}

/// Returns a sentence for each set and joint whose friction changes. `tolerance` is the share of the torque from which on
/// the change matters.
pub(crate) fn drifting(sets: &[IdentifiedSet], robot: &Robot, tolerance: f64) -> Vec<String> {
    let all = || {
        (sets.iter()).flat_map(|set| {
            (set.rows.drifts)
                .iter()
                .map(move |drift| (set.name.as_str(), drift))
        })
    };
    let p: Vec<f64> = all().map(|(_, drift)| drift.p).collect();
    (all().zip(holm(&p)))
        .filter(|(_, p)| *p < FAMILY_LEVEL)
        .map(|((set, drift), _)| {
            let consequence = if drift.share > tolerance {
                "The joint warms up, or the torque constant or the friction changes otherwise. Its values then depend on when they were recorded. Move the joint until its friction stays, or compare later parts of the recordings; \"rig diagnose\" tells what changes."
            } else {
                "Perhaps the joint warms up. It hardly matters for the torque, but may explain small differences between the sets."
            };
            format!(
                "The friction of {} {} by ({}) % during the recordings of {set}, which is {} % of the torque. {consequence}",
                robot.joints[drift.joint].name,
                if drift.change < 0.0 { "falls" } else { "rises" },
                format_value(100.0 * drift.change.abs(), 100.0 * drift.std),
                format_significant(100.0 * drift.share, 2),
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_set_speaks_and_the_others_are_named_once() {
        let warning = Warning::IllConditioned { condition: 300.0 };
        let of = |set, residual| SetWarning {
            set,
            warning: &warning,
            residual,
        };
        let said = line(&[of("b", 0.4), of("a", 0.3), of("b", 0.4)]);
        assert!(
            said.starts_with("Set b: The condition number")
                && said.ends_with("Set a has a warning of this kind, too."),
            "{said}"
        );
    }
}
