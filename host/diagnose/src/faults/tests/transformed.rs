//! Arm columns in another order, from another zero, by another factor, or about a reversed axis.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use crate::faults::tests::windows::sound_arms;
use crate::faults::tests::*;
use crate::tests::planar;

/// Returns kind and text of the only certain fault.
fn certain(robot: &Robot, runs: &[Run]) -> (&'static str, String) {
    let found = faults(robot, runs).unwrap();
    let mut certain = found.into_iter().filter(|fault| fault.certain);
    let Some(fault) = certain.next() else {
        panic!("nothing is certain");
    };
    println!("{}", fault.text);
    assert_eq!(certain.next(), None);
    (fault.kind.as_str(), fault.text)
}

/// Rotates columns of the first three joints: positions, torques, or both.
pub(crate) fn rotated(runs: &[Run], positions: bool, torques: bool) -> Vec<Run> {
    injured(runs, |run| {
        let sound = run.joints.clone();
        for (to, from) in [(0, 1), (1, 2), (2, 0)] {
            if positions {
                run.joints[to].q_raw.clone_from(&sound[from].q_raw);
            }
            if torques {
                run.joints[to].tau.clone_from(&sound[from].tau);
            }
        }
    })
}

#[test]
fn joints_in_cyclic_order_are_put_in_order() {
    let folder = tempfile::tempdir().unwrap();
    for (robot, runs) in &sound_arms(folder.path()) {
        for (positions, torques, words) in [
            (true, false, "stands in q3, q1 and q2"),
            (false, true, "stands in tau3, tau1 and tau2"),
            (
                true,
                true,
                "joints 1, 2 and 3 stands in the columns of joints 3, 1 and 2",
            ),
        ] {
            let (kind, text) = certain(robot, &rotated(runs, positions, torques));
            assert_eq!(kind, "swap", "{text}");
            assert!(text.contains(words), "{words}: {text}");
        }
    }
}

/// An arm of two joints by closed equations of motion, with its URDF.
fn planar() -> (Robot, Vec<Run>) {
    let robot = planar::urdf(None);
    let made = planar::recorded(3, 1, [0.05, 1e-5]);
    let low_pass = LowPass::butterworth(4, 20.0, 250.0).unwrap();
    let runs = runs_of(&made, 0, 250.0, &low_pass).unwrap();
    assert_eq!(faults(&robot, &runs).unwrap(), []);
    (robot, runs)
}

#[test]
fn the_zero_of_a_joint_is_found_where_gravity_shows_it() {
    let (robot, runs) = planar();
    for j in [0, 1] {
        for angle in [FRAC_PI_4, FRAC_PI_2, -FRAC_PI_2, 2.5] {
            let turned = injured(&runs, |run| {
                run.joints[j].q_raw.iter_mut().for_each(|q| *q += angle);
            });
            let (kind, text) = certain(&robot, &turned);
            // For the first joint it may be the base too, which the text says.
            assert!(kind == "zero" || j == 0 && kind == "gravity", "{text}");
            let back = (-angle).to_degrees().round();
            let near = [back - 1.0, back, back + 1.0];
            let name = &robot.joints[j].name;
            let words = near.map(|d| format!("zero of joint {name} turned by {d:.0} degrees"));
            assert!(words.iter().any(|words| text.contains(words)), "{text}");
        }
    }
}

#[test]
fn factors_of_positions_are_found_whatever_their_name() {
    let (robot, runs) = planar();
    for j in [0, 1] {
        for (factor, words) in [
            (1.0 / TAU, "it looks like turns"),
            (0.5, "it is half what it should be"),
            (0.3, "times as large"),
            (-0.5, "reverse it"),
        ] {
            let (_, text) = certain(&robot, &q(&runs, j, factor));
            let own = format!("q{} fits its torque", j + 1);
            assert!(
                text.contains(&own) && text.contains(words),
                "{words}: {text}"
            );
        }
    }
    let turns = injured(&runs, |run| {
        for joint in &mut run.joints {
            times(&mut joint.q_raw, 1.0 / TAU);
        }
    });
    let (kind, text) = certain(&robot, &turns);
    assert_eq!(kind, "unit", "{text}");
    assert!(text.contains("they look like turns"), "{text}");
}

#[test]
fn an_axis_that_points_the_other_way_is_one_fault() {
    let (robot, runs) = planar();
    for j in [0, 1] {
        let reversed = injured(&runs, |run| {
            times(&mut run.joints[j].q_raw, -1.0);
            times(&mut run.joints[j].tau, -1.0);
        });
        let (kind, text) = certain(&robot, &reversed);
        let words = "both counted the other way round";
        assert!(kind == "sign" && text.contains(words), "{text}");
    }
}
