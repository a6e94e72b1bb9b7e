//! A planar arm of two links by its closed equations of motion (Spong, Hutchinson and Vidyasagar 2006, section 7.3), against a URDF
//! that may say anything of friction: what the project makes of it, with no line of its multibody code in the data.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

use crate::description::described_effects::DescribedEffects;
use crate::recordings::context::DiagnosisContext;
use crate::{Options, diagnose};
use rig_data::prepare::{InMemory, Recording};
use rig_data::{Block, JointColumns};
use rig_identify::{self, identify};
use rig_model::robot::{Origin, Quantity, Robot, Worth, worth};

/// Hz, and s.
const RATE: f64 = 250.0;
const SECONDS: f64 = 24.0;
/// m, kg, m, kg·m² about the centre of mass.
const LENGTH: f64 = 0.4;
const MASS: [f64; 2] = [3.0, 1.5];
const CENTRE: [f64; 2] = [0.2, 0.15];
const INERTIA: [f64; 2] = [0.05, 0.02];
/// N·m·s/rad and N·m.
const VISCOUS: [f64; 2] = [1.2, 0.4];
const COULOMB: [f64; 2] = [1.5, 0.5];

/// The arm as a URDF with `<dynamics>` of these dampings and frictions, none where there are none.
pub(crate) fn urdf(dynamics: Option<[[f64; 2]; 2]>) -> Robot {
    let link = |k: usize| {
        format!(
            "<link name='l{k}'><inertial><origin xyz='{} 0 0'/><mass value='{}'/><inertia ixx='0.001' iyy='{2}' izz='{2}' ixy='0' ixz='0' iyz='0'/></inertial></link>",
            CENTRE[k], MASS[k], INERTIA[k]
        )
    };
    let joint = |k: usize, parent: &str, x: f64| {
        let dynamics = dynamics.map_or(String::new(), |[damping, friction]| {
            format!(
                "<dynamics damping='{}' friction='{}'/>",
                damping[k], friction[k]
            )
        });
        // Positive lifts.
        format!(
            "<joint name='j{k}' type='revolute'><parent link='{parent}'/><child link='l{k}'/><origin xyz='{x} 0 0'/><axis xyz='0 -1 0'/><limit lower='-3' upper='3' velocity='6' effort='60'/>{dynamics}</joint>"
        )
    };
    let text = format!(
        "<?xml version='1.0'?><robot name='planar'><link name='base'/>{}{}{}{}</robot>",
        link(0),
        joint(0, "base", 0.0),
        link(1),
        joint(1, "l0", LENGTH)
    );
    Robot::from_urdf(&text, Path::new("planar.urdf")).unwrap()
}

/// Torque of the closed equations.
fn torque(q: [f64; 2], v: [f64; 2], a: [f64; 2]) -> [f64; 2] {
    let g = 9.81;
    let lever = MASS[1] * LENGTH * CENTRE[1];
    let far = MASS[1] * CENTRE[1].powi(2) + INERTIA[1];
    let near = MASS[0] * CENTRE[0].powi(2) + INERTIA[0] + MASS[1] * LENGTH.powi(2);
    let (s, c) = q[1].sin_cos();
    let across = far + lever * c;
    let pull = [
        (MASS[0] * CENTRE[0] + MASS[1] * LENGTH) * g * q[0].cos(),
        MASS[1] * CENTRE[1] * g * (q[0] + q[1]).cos(),
    ];
    let friction = |k: usize| VISCOUS[k] * v[k] + COULOMB[k] * v[k].signum();
    [
        (near + far + 2.0 * lever * c) * a[0] + across * a[1]
            - lever * s * (2.0 * v[0] * v[1] + v[1] * v[1])
            + pull[0]
            + pull[1]
            + friction(0),
        across * a[0] + far * a[1] + lever * s * v[0] * v[0] + pull[1] + friction(1),
    ]
}

/// A motion of five harmonics, its torque with noise of `noise` N·m and its position with noise of `apart` rad.
pub(crate) fn recorded(motion: u64, seed: u64, [noise, apart]: [f64; 2]) -> InMemory {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(motion);
    let turn = std::f64::consts::TAU;
    let waves: Vec<[f64; 4]> = (0..10)
        .map(|k| {
            let f = turn * 0.125 * (1 + k % 5) as f64;
            [
                0.25 + 0.35 * rng.random::<f64>(),
                f,
                turn * rng.random::<f64>(),
                (k / 5) as f64,
            ]
        })
        .collect();
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1000 + seed);
    let mut t = Vec::new();
    let mut joints = vec![JointColumns::default(); 2];
    for k in 0..(RATE * SECONDS) as usize {
        let now = k as f64 / RATE;
        t.push(now);
        let mut state = [[0.0; 2]; 3];
        for [size, f, phase, joint] in &waves {
            let (s, c) = (f * now + phase).sin_cos();
            let j = *joint as usize;
            state[0][j] += size * s;
            state[1][j] += size * f * c;
            state[2][j] -= size * f * f * s;
        }
        let tau = torque(state[0], state[1], state[2]);
        for (j, joint) in joints.iter_mut().enumerate() {
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            joint.q.push(state[0][j] + apart * normal());
            joint.tau.push(tau[j] + noise * normal());
        }
    }
    InMemory {
        label: format!("motion {motion}, {seed}"),
        blocks: vec![Block {
            t,
            joints,
            first_line: 2,
            ..Default::default()
        }],
    }
}

/// What exporters write: nothing, zeros, a token, the right values, ten times these.
fn written() -> [Option<[[f64; 2]; 2]>; 5] {
    let times = |factor: f64| Some([VISCOUS, COULOMB].map(|list| list.map(|x| factor * x)));
    [
        None,
        Some([[0.0; 2]; 2]),
        Some([[0.003; 2], [0.0; 2]]),
        times(1.0),
        times(10.0),
    ]
}

#[test]
fn friction_is_identified_alike_whatever_a_urdf_says_of_it() {
    // Four samples a second's worth of data: the motion tells viscous friction less well than 0.003 would be within.
    let noise = [2.0, 1e-5];
    let (training, holdout) = (recorded(1, 1, noise), recorded(2, 2, noise));
    for dynamics in written() {
        let robot = urdf(dynamics);
        let found = identify(
            &robot,
            &[&training as &dyn Recording],
            &[&holdout as &dyn Recording],
            &rig_identify::Options {
                estimator: rig_identify::Estimator::Consistent,
                ..Default::default()
            },
        )
        .unwrap();
        for (k, (viscous, coulomb)) in VISCOUS.iter().zip(&COULOMB).enumerate() {
            for (name, truth) in [("fv", viscous), ("fc", coulomb)] {
                let name = format!("{name}{}", k + 1);
                let own = found
                    .base_parameters
                    .iter()
                    .find(|p| p.expression == name)
                    .unwrap();
                println!("{dynamics:?} {name} {} ± {}", own.value, own.std);
                assert!(
                    (own.value - truth).abs() < 4.0 * own.std,
                    "{dynamics:?} {name} {} ± {}",
                    own.value,
                    own.std
                );
                assert!(
                    found.not_excited.iter().all(|n| n.combination != name),
                    "{dynamics:?} {name}: {:?}",
                    found.not_excited
                );
            }
        }
    }
}

#[test]
fn no_drag_stands_in_for_friction_that_a_urdf_does_not_state() {
    let noise = [0.3, 1e-5];
    let training = [recorded(1, 1, noise), recorded(1, 2, noise)];
    let holdout = recorded(2, 3, noise);
    for dynamics in written() {
        let robot = urdf(dynamics);
        let training: Vec<&dyn Recording> = training.iter().map(|r| r as &dyn Recording).collect();
        let options = Options {
            no_offsets: true,
            ..Options::default()
        };
        let (found, model) =
            diagnose(&robot, &training, &[&holdout], &options, &mut |_| ()).unwrap();
        let named: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
        assert!(named.is_empty(), "{dynamics:?}: {named:?}");
        for (joint, (viscous, coulomb)) in model.joints.iter().zip(VISCOUS.iter().zip(&COULOMB)) {
            let friction = joint.friction.as_ref().unwrap();
            assert!(
                (friction.viscous / viscous - 1.0).abs() < 0.05,
                "{dynamics:?} {friction:?}"
            );
            assert!(
                (friction.coulomb / coulomb - 1.0).abs() < 0.05,
                "{dynamics:?} {friction:?}"
            );
        }
        let treatment = found.treatment.unwrap();
        assert!(
            treatment.band <= treatment.position_cutoff
                && treatment.band > treatment.motion_frequency
        );
        for rows in &treatment.rows {
            let [used, all] = rows.train;
            assert!(used > all / 2 && used <= all && rows.holdout.is_some());
        }
    }
}

#[test]
fn friction_that_the_user_stated_and_the_data_refute_is_dropped_and_said() {
    let noise = [0.3, 1e-5];
    let training = recorded(1, 1, noise);
    let mut robot = urdf(Some([[0.003; 2], COULOMB]));
    robot.origin = Origin::Own;
    let (found, _) = diagnose(
        &robot,
        &[&training as &dyn Recording],
        &[],
        &Options::default(),
        &mut |_| (),
    )
    .unwrap();
    let said = |name: &str| {
        found
            .words
            .iter()
            .any(|w| w.contains("contradict") && w.contains(name))
    };
    assert!(
        said("fv1 =") && said("fv2 =") && !said("fc1 ="),
        "{:?}",
        found.words
    );
    assert!(found.steps.iter().all(|s| s.effect != "quadratic_drag"));
}

#[test]
fn the_exact_description_leaves_the_noise_whatever_filter_the_position_needs() {
    let robot = {
        let mut robot = urdf(Some([VISCOUS, COULOMB]));
        robot.origin = Origin::Own;
        robot
    };
    let stated = DescribedEffects::of(&robot);
    // The noisier the position the lower its filter's cut-off; the torque has none, so that what is left is the filters' making
    // and the acceleration's noise.
    for apart in [1e-6, 1e-5, 1e-4, 1e-3] {
        let quiet = recorded(1, 1, [0.0, apart]);
        let context = DiagnosisContext::of(&stated, &[&quiet as &dyn Recording]).unwrap();
        let prepared = context.load(&[&quiet as &dyn Recording]).unwrap();
        let left = context.frozen(&prepared).unwrap();
        let whole: Vec<f64> = (0..2)
            .map(|j| {
                rig_numerics::statistics::rms_of_kept(
                    &prepared.rows.torque[j],
                    &prepared.rows.keep[j],
                )
            })
            .collect();
        println!(
            "{apart:e}: cut-off {:.1} Hz, band {:.1} Hz, motion {:.2} Hz: left {left:?} of {whole:?}",
            prepared.treatment.cutoff,
            prepared.treatment.parallel_edge,
            prepared.treatment.motion_frequency
        );
    }
}

#[test]
fn the_table_of_worth_knows_a_urdf_from_a_description_of_ones_own() {
    use Quantity::{DriveInertia, Friction, Inertial, Offset};
    assert_eq!(worth(Friction, Origin::Urdf, 0.0), Worth::Unknown);
    assert!(matches!(worth(Friction, Origin::Urdf, 0.003), Worth::Factor(f) if f >= 10.0));
    assert!(matches!(
        worth(Friction, Origin::Own, 0.003),
        Worth::Share(_)
    ));
    assert!(matches!(worth(Friction, Origin::Own, 0.0), Worth::Share(_)));
    assert_eq!(worth(Offset, Origin::Own, 0.1), Worth::Unknown);
    assert_eq!(worth(DriveInertia, Origin::Urdf, 0.0), Worth::Unknown);
    for origin in [Origin::Own, Origin::Urdf] {
        assert_eq!(
            worth(Inertial, origin, 1.0),
            worth(DriveInertia, Origin::Own, 1.0)
        );
    }
}
