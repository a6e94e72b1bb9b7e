//! Torques of a whole arm in another unit.

use crate::faults::tests::windows::sound_arms;
use crate::faults::tests::*;

#[test]
fn torques_that_are_all_a_thousand_times_too_large_or_small_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for (mut robot, runs) in sound_arms(folder.path()) {
        // A limit or friction would show it earlier.
        for joint in &mut robot.joints {
            joint.limits = None;
            joint.friction = None;
        }
        assert_eq!(faults(&robot, &runs).unwrap(), []);
        for (factor, words) in [(1000.0, "as mN·m for N·m"), (1e-3, "as kN·m for N·m")] {
            let other = injured(&runs, |run| {
                run.joints
                    .iter_mut()
                    .for_each(|j| times(&mut j.tau, factor));
            });
            let found = faults(&robot, &other).unwrap();
            assert_eq!(found.len(), 1, "{found:?}");
            println!("{}", found[0].text);
            assert_eq!(
                (found[0].kind.as_str(), found[0].about),
                ("unit", About::Torque)
            );
            assert!(found[0].text.contains(words), "{}", found[0].text);
        }
    }
}
