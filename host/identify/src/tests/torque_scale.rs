//! A wrong torque constant against the described masses, with torques of a two-link arm by its textbook equations.

use super::*;
use rig_model::robot::Inertial;

/// Distance of the second axis, m; mass and first moments of the links, kg and kg·m; moments of inertia, kg·m².
const A: f64 = 0.5;
const M2: f64 = 2.0;
const MX: [f64; 2] = [1.1, 0.6];
const I: [f64; 2] = [0.5, 0.25];
const G: f64 = 9.81;

/// The arm in the vertical plane, described with these masses.
fn arm() -> Robot {
    let link = |name: &str, [alpha, a]: [f64; 2], [mass, mx, izz]: [f64; 3]| {
        let mut own = Joint::new(name, JointKind::Revolute, [alpha, a, 0.0, 0.0]);
        own.inertial = Some(Inertial {
            mass,
            first_moment: [mx, 0.0, 0.0],
            inertia: [0.01, 0.0, 0.0, izz, 0.0, izz],
        });
        own
    };
    Robot::new(
        "arm",
        vec![
            link(
                "first",
                [std::f64::consts::FRAC_PI_2, 0.0],
                [3.0, MX[0], I[0]],
            ),
            link("second", [0.0, A], [M2, MX[1], I[1]]),
        ],
    )
}

/// Torques by Lagrange's equations of the double pendulum, friction, and noise; the torque of joint k is read `scale[k]`
/// times too large.
fn recorded(scale: [f64; 2]) -> InMemory {
    with_friction(scale, |_, _, _| 0.0)
}

/// The same with more friction of joint k at a position, a speed and a torque.
fn with_friction(scale: [f64; 2], more: impl Fn(usize, [f64; 2], f64) -> f64) -> InMemory {
    let mut g = rand_pcg::Pcg64::seed_from_u64(31);
    let mut normal = move || (0..12).map(|_| g.random::<f64>()).sum::<f64>() - 6.0;
    let waves = [
        [(0.9, 1.1, 0.3), (0.5, 2.7, 1.1), (0.3, 4.9, 0.2)],
        [(1.0, 1.7, 2.0), (0.5, 3.1, 0.4), (0.3, 5.7, 1.5)],
    ];
    let mut block = Block {
        joints: vec![JointColumns::default(); 2],
        first_line: 2,
        ..Default::default()
    };
    for k in 0..15_000 {
        let t = k as f64 / 500.0;
        let [q, v, a] = [0, 1, 2].map(|order| {
            [0, 1].map(|j| {
                let sum = waves[j].iter().map(|(size, w, phase)| match order {
                    0 => size * (w * t + phase).sin(),
                    1 => size * w * (w * t + phase).cos(),
                    _ => -size * w * w * (w * t + phase).sin(),
                });
                sum.sum::<f64>()
            })
        });
        let (s, c) = q[1].sin_cos();
        let outer = G * MX[1] * (q[0] + q[1]).cos();
        let second = I[1] * (a[0] + a[1]) + A * MX[1] * (a[0] * c + v[0] * v[0] * s) + outer;
        let first = (I[0] + M2 * A * A) * a[0]
            + I[1] * (a[0] + a[1])
            + A * MX[1] * ((2.0 * a[0] + a[1]) * c - (2.0 * v[0] * v[1] + v[1] * v[1]) * s)
            + G * (MX[0] + M2 * A) * q[0].cos()
            + outer;
        block.t.push(t);
        for (j, torque) in [first, second].into_iter().enumerate() {
            let friction = 0.4 * v[j].signum() + 0.2 * v[j] + more(j, [q[j], v[j]], torque);
            let read = scale[j] * (torque + friction) + 0.1 * normal();
            block.joints[j].q.push(q[j] + 1e-5 * normal());
            block.joints[j].tau.push(read);
        }
    }
    InMemory {
        label: "arm".into(),
        blocks: vec![block],
    }
}

/// What is said of the torques of an arm as described.
fn said(robot: &Robot, scale: [f64; 2]) -> (Vec<TorqueScale>, String) {
    said_of(robot, &recorded(scale))
}

fn said_of(robot: &Robot, recording: &InMemory) -> (Vec<TorqueScale>, String) {
    let found = identify(robot, &[recording], &[], &Options::default()).unwrap();
    let own = found.warnings.iter().find_map(|warning| match warning {
        Warning::TorqueScale(list) => Some((list.clone(), warning.to_string())),
        _ => None,
    });
    own.unwrap_or_default()
}

#[test]
fn a_torque_constant_that_is_off_is_told_by_the_described_masses() {
    let robot = arm();
    assert_eq!(said(&robot, [1.0, 1.0]).0, []);
    for factor in [1.12, 0.87] {
        let (found, text) = said(&robot, [1.0, factor]);
        let [own] = &found[..] else {
            panic!("{found:?}");
        };
        assert_eq!(own.joint, "second");
        assert!(
            (own.factor - factor).abs() < 4.0 * own.std && own.std < 0.02,
            "{own:?}"
        );
        // The first joint carries the second link, and shows its described weight.
        assert!(
            own.masses_confirmed && text.contains("gear ratio"),
            "{text}"
        );
    }
    // Both alike: nothing tells the scale from heavier links.
    let (found, text) = said(&robot, [1.12, 1.12]);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found.iter().all(|own| !own.masses_confirmed)
            && text.contains("either the described masses are off"),
        "{text}"
    );
}

#[test]
fn wrong_masses_are_no_wrong_torque_constant() {
    // The whole second link is 12 % heavier than described: joint 2 alone cannot tell, joint 1 does not say otherwise.
    let mut robot = arm();
    let body = robot.joints[1].inertial.as_mut().unwrap();
    body.mass /= 1.12;
    body.first_moment[0] /= 1.12;
    let (found, text) = said(&robot, [1.0, 1.0]);
    assert!(found.iter().all(|own| !own.masses_confirmed), "{text}");
    // The centre of mass lies elsewhere, so no factor makes the described gravity right.
    let mut robot = arm();
    robot.joints[1].inertial.as_mut().unwrap().first_moment = [0.5, 0.2, 0.0];
    let (found, text) = said(&robot, [1.0, 1.0]);
    assert_eq!(found, [], "{text}");
}

/// Without described masses the joints still share the outer link: either factor makes them agree.
#[test]
fn a_torque_constant_of_one_joint_contradicts_the_other_joint() {
    let mut robot = arm();
    for joint in &mut robot.joints {
        joint.inertial = None;
    }
    let found = |scale: [f64; 2]| {
        let recording = recorded(scale);
        let found = identify(&robot, &[&recording], &[], &Options::default()).unwrap();
        let own = found.warnings.iter().find_map(|warning| match warning {
            Warning::TorqueDisagrees(list) => Some((list.clone(), warning.to_string())),
            _ => None,
        });
        own.unwrap_or_default()
    };
    // Alike, a factor in both is that of all masses.
    for alike in [[1.0, 1.0], [1.12, 1.12]] {
        assert_eq!(found(alike).0, []);
    }
    let (list, text) = found([1.0, 1.12]);
    let [first, second] = &list[..] else {
        panic!("{list:?}");
    };
    for (own, name, factor) in [(first, "first", 1.0 / 1.12), (second, "second", 1.12)] {
        assert_eq!(own.joint, name);
        assert!(
            (own.factor - factor).abs() < 4.0 * own.std && own.std < 0.02,
            "{own:?}"
        );
    }
    assert!(text.contains("do not tell which"), "{text}");
}

/// Friction that changes with the position or grows with the load, beside links that are lighter than described: no torque
/// constant is accused.
#[test]
fn friction_that_changes_is_no_torque_constant() {
    type Friction = fn(usize, [f64; 2], f64) -> f64;
    let cases: [(&str, Friction); 4] = [
        ("beyond a position", |j, [q, v], _| {
            if j == 0 && q > 0.3 { v.signum() } else { 0.0 }
        }),
        ("with the position", |j, [q, v], _| {
            if j == 0 {
                0.8 * (2.0 * q).cos() * v.signum()
            } else {
                0.0
            }
        }),
        ("with the load", |j, [_, v], torque| {
            if j == 1 {
                0.15 * torque.abs() * v.signum()
            } else {
                0.0
            }
        }),
        ("with load and speed", |j, [_, v], torque| {
            if j == 1 {
                torque.abs() * (0.06 * v.signum() + 0.05 * v)
            } else {
                0.0
            }
        }),
    ];
    for (name, friction) in cases {
        let recording = with_friction([1.0; 2], friction);
        for share in [1.0, 0.9] {
            let mut robot = arm();
            let body = robot.joints[1].inertial.as_mut().unwrap();
            body.mass /= share;
            body.first_moment[0] /= share;
            let (found, text) = said_of(&robot, &recording);
            assert!(
                found.iter().all(|own| !own.masses_confirmed),
                "{name}, {share}: {text}"
            );
            let whole = identify(&robot, &[&recording], &[], &Options::default()).unwrap();
            let accused = |warning: &Warning| matches!(warning, Warning::TorqueDisagrees(_));
            assert!(!whole.warnings.iter().any(accused), "{name}, {share}");
        }
    }
}
