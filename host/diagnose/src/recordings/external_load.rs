//! External loads on a joint: hoses, cables, springs. Without them their torque is gone, and the rig's own stays.
//!
//! Leaves out: the weight of removed parts, which may look like a spring; partly removed loads, whose rest looks like
//! the rig's own.

use rig_shared::effects::Kind;

use rig_data::runs::Run;
use rig_numerics::statistics;

/// Length of stretches whose means give the uncertainty of a mean, s.
const STRETCH: f64 = 1.0;

/// Returns true if an effect is absent during a run.
pub(crate) fn is_gone(kind: Kind, run: &Run) -> bool {
    run.unburdened && kind.is_external()
}

/// Returns true if some runs have external loads and some have none.
pub(crate) fn told_apart(runs: &[Run]) -> bool {
    runs.iter().any(|run| run.unburdened) && runs.iter().any(|run| !run.unburdened)
}

/// Returns the mean residual of a joint without external loads minus that with them, and its standard deviation. `None`
/// if either has too few rows. Rows are `period` s apart and begin at each run's entry of `starts`, which ends one past
/// the last. `keep` marks the used rows.
pub(crate) fn step(
    residual: &[f64],
    keep: &[bool],
    starts: &[usize],
    period: f64,
    runs: &[Run],
) -> Option<[f64; 2]> {
    let length = ((STRETCH / period).ceil() as usize).max(1);
    let means = |unburdened: bool| -> Vec<f64> {
        let own = (starts.windows(2).zip(runs)).filter(|(_, run)| run.unburdened == unburdened);
        own.flat_map(|(pair, _)| (pair[0]..pair[1]).step_by(length).map(|k| (k, pair[1])))
            .filter_map(|(first, end)| {
                let rows = (first..(first + length).min(end)).filter(|k| keep[*k]);
                let (count, sum) = rows.fold((0, 0.0), |(n, s), k| (n + 1, s + residual[k]));
                (2 * count > length).then(|| sum / count as f64)
            })
            .collect()
    };
    let of = |unburdened: bool| statistics::mean_and_variance(&means(unburdened));
    let ([free, a], [pulled, b]) = (of(true)?, of(false)?);
    Some([free - pulled, (a + b).sqrt()])
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use crate::experiment::{ExperimentKind, FILE};
    use crate::outcome::Verdict;
    use crate::tests::made::Diagnosed as _;
    use crate::{Diagnosis, Options};
    use rig_excite::TrajectoryFile;
    use rig_scenario::{Effect, Made, Scenario};

    /// Diagnoses a rig with and without external loads on the proposed motion.
    fn separated(effects: &[Effect], seed: u64) -> (Diagnosis, Diagnosis, Made) {
        let scenario = Scenario::short(effects.iter().copied(), seed);
        let mut made: Made = scenario.make().unwrap();
        let options = Options::default();
        let (before, _) = made.diagnosed(&made.robot, &options);
        let next = before.next_experiment.clone().unwrap();
        assert_eq!((next.kind, next.hands), (ExperimentKind::PullsOff, true));
        let file = TrajectoryFile::from_toml(&next.trajectory.unwrap(), Path::new(FILE)).unwrap();
        let free = scenario.unburdened().proposed(&made, &file).unwrap();
        made.unburdened.push(free);
        let (after, _) = made.diagnosed(&made.robot, &options);
        (before, after, made)
    }

    fn sets(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
        (diagnosis.steps.iter()).map(|s| s.set.clone()).collect()
    }

    /// The loaded rig cannot separate friction that differs with the direction from an external torque.
    #[test]
    fn a_torque_from_outside_is_told_from_the_rig_s_own_once_it_is_taken_off() {
        let torque = Effect::TorqueOffset { torque: 0.12 };
        let friction = Effect::AsymmetricCoulomb { difference: 0.25 };
        for (hidden, name, seed) in [
            (torque, "torque_offset", 41),
            (friction, "asymmetric_coulomb", 42),
        ] {
            let (before, after, _) = separated(&[hidden], seed);
            let both = ["torque_offset", "asymmetric_coulomb"];
            let set = &sets(&before)[0];
            assert!(both.iter().all(|n| set.iter().any(|s| s == n)), "{set:?}");
            assert_eq!(sets(&after), [[name]], "{name}");
        }
        // With loads they are one constant; half of it disappears without them.
        let (before, after, _) = separated(&[torque, friction], 43);
        assert_eq!(before.steps.len(), 1);
        let mut names: Vec<_> = after.steps.iter().map(|s| s.effect.as_str()).collect();
        names.sort_unstable();
        assert_eq!(names, ["asymmetric_coulomb", "torque_offset"]);
        let outside = (after.steps.iter()).find(|s| s.effect == "torque_offset");
        let value = outside.unwrap().parameters["offset"].value.abs();
        assert!((value - 0.12).abs() < 0.012, "{value}");
    }

    /// An identification describes the constant as the joint's own, whatever its cause.
    #[test]
    fn a_stated_constant_is_not_held_where_the_recordings_tell_what_of_it_comes_from_outside() {
        let torque = Effect::TorqueOffset { torque: 0.12 };
        let (_, after, made) = separated(&[torque], 44);
        let mut robot = made.robot.clone();
        let value = after.steps[0].parameters["offset"].value;
        robot.joints[0].friction.as_mut().unwrap().offset = value;
        let (diagnosis, model) = made.diagnosed(&robot, &Options::default());
        assert_eq!(sets(&diagnosis), [["torque_offset"]]);
        let left = model.joints[0].friction.as_ref().unwrap().offset;
        assert!(left.abs() < 0.2 * value.abs(), "{left} of {value}");
    }

    /// A torque that appears only without loads shows exchanged recordings.
    #[test]
    fn recordings_in_each_other_s_place_are_a_remainder_that_says_so() {
        let (.., made) = separated(&[Effect::TorqueOffset { torque: 0.12 }], 45);
        let swapped = Made {
            train: made.unburdened[0].clone(),
            repeat: None,
            unburdened: vec![made.train.clone()],
            ..made
        };
        let (diagnosis, _) = swapped.diagnosed(&swapped.robot, &Options::default());
        assert_eq!(diagnosis.verdict, Verdict::Remainder);
        let text = diagnosis.remainder.unwrap().text;
        assert!(text.contains("in each other's place"), "{text}");
    }
}
