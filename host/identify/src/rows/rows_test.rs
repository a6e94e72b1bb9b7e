//! Rows compared with a simple second implementation, and motor columns in both models.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use rig_shared::multibody::{COLUMNS, column, differential_regressor, inverse_dynamics};
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission};

use super::cache::RowCache;
use super::differential::Differential;
use super::plan::Plan;
use super::tally::Tally;
use crate::{Base, ModelKind, Options, chain_of, grouped, identify, transmission_of};
use rig_data::prepare::{
    Choice, InMemory, Motion, PrepareOptions, PreprocessingPlan, Survey, each_motion,
};
use rig_data::{Block, JointColumns};
use rig_model::robot::{EDDA_TEMPLATE, IRP6_TEMPLATE, Robot, TX40};

const RATE: f64 = 500.0;

fn robot(text: &str) -> Robot {
    let mut robot = Robot::from_toml(text, Path::new("robot.toml")).unwrap();
    for joint in &mut robot.joints {
        // The simulated torques are not those of the real arm.
        if let Some(limits) = &mut joint.limits {
            limits.torque = None;
        }
    }
    robot
}

/// Synthetic parameters, all different: of the links, and of the motors.
fn parameters(n: usize) -> (Vec<[f64; COLUMNS]>, Vec<[f64; MOTOR_COLUMNS]>) {
    let links = (0..n)
        .map(|j| {
            let mass = 6.0 / (1 + j) as f64;
            let mut p = [0.0; COLUMNS];
            p[column::MASS] = mass;
            for k in 0..3 {
                p[column::FIRST_MOMENT + k] = mass * (0.05 + 0.02 * k as f64 - 0.01 * j as f64);
            }
            for (k, value) in [0.05, 0.004, -0.003, 0.06, 0.002, 0.04].iter().enumerate() {
                p[column::INERTIA + k] = mass * value;
            }
            p[column::DRIVE_INERTIA] = 0.08 + 0.01 * j as f64;
            p[column::VISCOUS] = 0.9 + 0.1 * j as f64;
            p[column::COULOMB] = 1.1 - 0.1 * j as f64;
            p[column::OFFSET] = 0.2 - 0.1 * j as f64;
            p
        })
        .collect();
    let motors = (0..n)
        .map(|k| [0.05 + 0.01 * k as f64, 0.3 + 0.05 * k as f64, 0.4])
        .collect();
    (links, motors)
}

/// Four sines per joint about the middle of its range, torque by Newton and Euler and the motors' columns; `gap` rows
/// are missing in the middle.
fn recording(robot: &Robot, seconds: f64, gap: usize) -> InMemory {
    recording_at(RATE, robot, seconds, gap)
}

/// The same at another rate, Hz.
fn recording_at(rate: f64, robot: &Robot, seconds: f64, gap: usize) -> InMemory {
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let transmission = transmission_of(robot).unwrap();
    let (links, motors) = parameters(n);
    let rows = (seconds * rate) as usize;
    let empty = |from: usize| Block {
        joints: vec![JointColumns::default(); n],
        first_line: from as u64 + 2,
        ..Default::default()
    };
    let mut blocks = vec![empty(0)];
    let [mut q, mut qd, mut qdd, mut tau] = [(); 4].map(|()| vec![0.0; n]);
    let mut columns = vec![0.0; n * n * MOTOR_COLUMNS];
    for k in 0..rows {
        if gap > 0 && (rows / 2..rows / 2 + gap).contains(&k) {
            continue;
        }
        if gap > 0 && k == rows / 2 + gap {
            blocks.push(empty(k));
        }
        let t = k as f64 / rate;
        for j in 0..n {
            let range = robot.joints[j]
                .limits
                .as_ref()
                .map(|l| l.position)
                .unwrap_or([-1.5, 1.5]);
            let range: [f64; 2] = range;
            let size = 0.35 * (range[1] - range[0]).min(3.0) / 2.0;
            (q[j], qd[j], qdd[j]) = (0.5 * (range[0] + range[1]), 0.0, 0.0);
            for (m, share) in [0.9, 0.5, 0.35, 0.25].iter().enumerate() {
                let w = 0.8 + 0.41 * j as f64 + 1.7 * m as f64;
                let (s, c) = (w * t + (1 + j * j * m) as f64).sin_cos();
                q[j] += size * share * s;
                qd[j] += size * share * w * c;
                qdd[j] -= size * share * w * w * s;
            }
        }
        inverse_dynamics(&chain, &links, &q, &qd, &qdd, &mut tau).unwrap();
        add_motors(
            &transmission,
            &links,
            &motors,
            &q,
            &qd,
            &qdd,
            &mut tau,
            &mut columns,
        );
        let block = blocks.last_mut().unwrap();
        block.t.push(t);
        for (j, joint) in block.joints.iter_mut().enumerate() {
            joint.q.push(q[j]);
            joint.tau.push(tau[j]);
        }
    }
    InMemory {
        label: robot.name.clone(),
        blocks,
    }
}

/// Adds the motors' torque and subtracts the drive inertia that they replace.
fn add_motors(
    transmission: &Transmission<f64>,
    links: &[[f64; COLUMNS]],
    motors: &[[f64; MOTOR_COLUMNS]],
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
    columns: &mut [f64],
) {
    let n = q.len();
    transmission.motor_columns(q, qd, qdd, columns).unwrap();
    for i in 0..n {
        if !transmission.has_joint_inertia(i) {
            tau[i] -= links[i][column::DRIVE_INERTIA] * qdd[i];
        }
        let row = &columns[i * n * MOTOR_COLUMNS..(i + 1) * n * MOTOR_COLUMNS];
        tau[i] += row
            .iter()
            .zip(motors.as_flattened())
            .map(|(a, b)| a * b)
            .sum::<f64>();
    }
}

/// Computes the rows by their definition: every column at the full rate, each filtered forward and backward, from the
/// row where the position filter has settled.
fn plain_rows(motion: &Motion, plan: &Plan) -> Vec<(Vec<Vec<f64>>, Vec<f64>)> {
    let n = motion.joints.len();
    let rows = motion.t.len();
    let low_pass = plan.treatment.parallel_low_pass().unwrap();
    let mut columns = vec![vec![vec![0.0; rows]; plan.columns.len()]; n];
    let mut standard = vec![0.0; n * n * COLUMNS];
    let mut motors = vec![0.0; n * n * MOTOR_COLUMNS];
    for k in 0..rows {
        let state = |of: fn(&rig_data::prepare::JointMotion) -> &[f64]| {
            motion.joints.iter().map(|j| of(j)[k]).collect::<Vec<f64>>()
        };
        let (q, qd, qdd) = (state(|j| &j.q), state(|j| &j.qd), state(|j| &j.qdd));
        differential_regressor(plan.chain, &q, &qd, &qdd, &mut standard).unwrap();
        plan.transmission
            .motor_columns(&q, &qd, &qdd, &mut motors)
            .unwrap();
        for (j, lists) in columns.iter_mut().enumerate() {
            for (list, &c) in lists.iter_mut().zip(plan.columns) {
                list[k] = match c.checked_sub(n * COLUMNS) {
                    Some(m) => motors[j * n * MOTOR_COLUMNS + m],
                    None => standard[j * n * COLUMNS + c],
                };
            }
        }
    }
    let picked = |list: &[f64]| {
        let (from, to) = motion.sound;
        let filtered = low_pass.zero_phase_even(&list[from..to]);
        (motion.usable.0..motion.usable.1)
            .filter(|k| {
                (motion.offset + *k as u64).is_multiple_of(plan.treatment.decimation as u64)
            })
            .map(|k| filtered[k - from])
            .collect::<Vec<f64>>()
    };
    columns
        .iter()
        .zip(&motion.joints)
        .map(|(lists, joint)| {
            (
                lists.iter().map(|l| picked(l)).collect(),
                picked(&joint.tau),
            )
        })
        .collect()
}

#[test]
fn rows_are_those_of_the_plain_way() {
    for (text, decimation, gap) in [(TX40, 9, 40), (TX40, 1, 0), (IRP6_TEMPLATE, 4, 3)] {
        let robot = robot(text);
        let made = recording(&robot, 48.0, gap);
        let (chain, transmission) = (chain_of(&robot).unwrap(), transmission_of(&robot).unwrap());
        let base = Base::structural(&robot, ModelKind::Differential, 1).unwrap();
        let n = robot.joints.len();
        assert!(base.columns.iter().any(|c| *c >= n * COLUMNS));
        let survey = Survey::take(&made, n).unwrap();
        let options = PrepareOptions {
            cutoff: Choice::Fixed(60.0),
            decimation: Choice::Fixed(decimation),
            // Several pieces in a stretch.
            piece_rows: 1000,
            ..Default::default()
        };
        let treatment = PreprocessingPlan::decide(&[survey], &options, &vec![None; n]).unwrap();
        let plan = Plan {
            chain: &chain,
            transmission: &transmission,
            columns: &base.columns,
            treatment: &treatment,
            window: 0,
            stride: 1,
            loudness: vec![1.0; n],
            one_way: Vec::new(),
            cache: RowCache::default(),
        };
        let maker = Differential::new(&plan).unwrap();
        let (mut pieces, mut compared) = (0, 0);
        let mut worst = 0.0f64;
        each_motion(&made, &treatment, 0, &mut |motion| {
            let found = maker.rows(motion, &mut Tally::default())?;
            let p = base.len();
            for ((columns, torque), equation) in
                plain_rows(motion, &plan).iter().zip(&found.equations)
            {
                assert_eq!(torque.len(), equation.y.len());
                assert_eq!(torque.len(), equation.keep.len());
                let mut same = |expected: &[f64], found: &dyn Fn(usize) -> f64| {
                    let size = expected.iter().fold(1e-6f64, |m, x| m.max(x.abs()));
                    for (i, e) in expected.iter().enumerate() {
                        worst = worst.max((found(i) - e).abs() / size);
                        compared += 1;
                    }
                };
                same(torque, &|i| equation.y[i]);
                for (c, column) in columns.iter().enumerate() {
                    same(column, &|i| equation.x[i * p + c]);
                }
            }
            pieces += 1;
            Ok(())
        })
        .unwrap();
        println!(
            "{}: {pieces} pieces, {compared} entries, worst {worst:e}",
            robot.name
        );
        assert!(pieces >= 4 && compared > 10_000);
        assert!(worst < 1e-9, "{worst:e}");
    }
}

#[test]
fn threads_change_no_bit() {
    let robot = robot(TX40);
    let made = recording(&robot, 40.0, 25);
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let with = |threads: usize| {
            let options = Options {
                model,
                prepare: PrepareOptions {
                    threads,
                    piece_rows: 2000,
                    ..Default::default()
                },
                ..Default::default()
            };
            let mut found = identify(&robot, &[&made], &[&made], &options).unwrap();
            found.details.treatment.threads = 0;
            // NaN differs from itself, but not as text.
            format!("{found:?}")
        };
        let one = with(1);
        for threads in [2, 5] {
            assert!(with(threads) == one, "{threads} threads, {model:?}");
        }
    }
}

/// Returns the largest error of the base parameters identified from `made`, in units of `share` of the value plus
/// `least` of a coefficient of one, with its parameter. Asserts that a parameter with `named` in its name exists.
fn worst_error(
    robot: &Robot,
    made: &InMemory,
    model: ModelKind,
    [share, least]: [f64; 2],
    named: &str,
) -> (f64, String) {
    let (links, motors) = parameters(robot.joints.len());
    let truth = [links.as_flattened(), motors.as_flattened()].concat();
    let options = Options {
        model,
        ..Default::default()
    };
    let found = identify(robot, &[made], &[], &options).unwrap();
    assert!(found.not_excited.is_empty(), "{:?}", found.not_excited);
    let names: Vec<&str> = found
        .base_parameters
        .iter()
        .map(|b| b.expression.as_str())
        .collect();
    assert!(names.iter().any(|name| name.contains(named)), "{names:?}");
    let mut worst = (0.0f64, String::new());
    for (k, b) in found.base_parameters.iter().enumerate() {
        let row = found.details.combination.row(k);
        let expected: f64 = row.iter().zip(&truth).map(|(c, v)| c * v).sum();
        let off = (b.value - expected).abs() / (share * expected.abs() + least);
        if off > worst.0 {
            worst = (off, b.expression.clone());
        }
    }
    println!("{} {model:?}: worst {worst:?}", robot.name);
    worst
}

/// The TX40 with an inertia of gear and shaft on its coupled joint 6; it turns with the joint, not with the motor.
fn with_joint_inertia() -> Robot {
    let mut robot = robot(TX40);
    robot.joints[5].drive.as_mut().unwrap().joint_inertia = 0.1;
    robot
}

#[test]
fn parameters_of_coupled_motors_come_back_through_both_models() {
    for robot in [robot(TX40), with_joint_inertia()] {
        let made = recording(&robot, 60.0, 0);
        for model in [ModelKind::Differential, ModelKind::Integral] {
            let (worst, of) = worst_error(&robot, &made, model, [0.01, 1e-3], "fvm6");
            assert!(worst < 1.0, "{} {model:?}: {worst} at {of}", robot.name);
        }
    }
}

#[test]
fn an_inertia_beside_a_coupled_motor_is_a_parameter_where_it_is_stated() {
    for (robot, parameters) in [(robot(TX40), 60), (with_joint_inertia(), 61)] {
        for model in [ModelKind::Differential, ModelKind::Integral] {
            let base = Base::structural(&robot, model, 1).unwrap();
            assert_eq!(base.len(), parameters);
        }
        assert_eq!(grouped(&robot).unwrap().len(), parameters);
    }
}

/// The trapezoidal sum of a momentum's rate is inexact: at 50 Hz this cost 8e-4 of an inertia and 2 % of friction.
#[test]
fn the_integral_model_is_right_at_a_low_rate() {
    let robot = robot(EDDA_TEMPLATE);
    let made = recording_at(50.0, &robot, 60.0, 0);
    let (worst, of) = worst_error(&robot, &made, ModelKind::Integral, [1e-3, 1e-4], "fc2");
    assert!(worst < 1.0, "{worst} at {of}");
}

/// A command is held until the next one and recorded when it begins to act: on average half a sample too early.
#[test]
fn a_torque_recorded_before_it_acts_is_said() {
    let robot = robot(EDDA_TEMPLATE);
    for (lead, said) in [(2, true), (0, false)] {
        let mut made = recording_at(1000.0, &robot, 40.0, 0);
        let every = 4;
        for block in &mut made.blocks {
            let picked = |column: &[f64], from: usize| -> Vec<f64> {
                let rows = column.len() / every - 1;
                (0..rows).map(|k| column[every * k + from]).collect()
            };
            block.t = picked(&block.t, 0);
            for joint in &mut block.joints {
                joint.q = picked(&joint.q, 0);
                joint.tau = picked(&joint.tau, lead);
            }
        }
        let found = identify(&robot, &[&made], &[], &Options::default()).unwrap();
        let warned = (found.warnings.iter()).any(|w| w.to_string().contains("--torque-lead 0.002"));
        assert_eq!(warned, said, "{:?}", found.warnings);
    }
}
