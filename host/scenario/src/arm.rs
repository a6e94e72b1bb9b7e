//! Recordings of an arm with several joints, one of them faulty.
//!
//! The mechanics of the arm are the rigid-body mechanics of the library with four steps per control period. The hidden
//! faults have their own equations. This file has controller, current loop, sensors and disturbances. Equal arms give
//! equal recordings.
//!
//! Not modelled: elasticity and backlash of the gears, sampling jitter.

use std::f64::consts::TAU;
use std::path::Path;

use super::dice::Dice;
use super::error::ScenarioError;
use super::fault::{Fault, Hidden};
use super::written::write_all;
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_model::robot::{Drive, EDDA_TEMPLATE, Joint, JointFriction, Robot, TX40};
use rig_model::simulate::{Model, SimulateError, Stepper};

/// Control rate, Hz; every second control period is recorded.
const RATE: f64 = 1000.0;
/// Integration steps per control period.
const STEPS: usize = 4;
/// Natural frequency of the position loops, Hz, and their damping ratio.
const LOOP: [f64; 2] = [6.0, 0.9];
/// Cut-off of the first-order filter on the differentiated encoder reading, Hz.
const SPEED_FILTER: f64 = 80.0;
/// Time constant of the current loop, s.
const CURRENT_LOOP: f64 = 4e-4;
/// Counts of the encoder per motor turn, behind a gear and on a direct drive.
const COUNTS: [f64; 2] = [8192.0, 1_048_576.0];
/// Coulomb friction, viscous friction per rad/s and drive inertia, each divided by the torque limit.
pub(super) const OF_LIMIT: [f64; 3] = [0.03, 0.015, 3e-3];
/// Noise RMS and step of the torque reading, and disturbance torque RMS, each divided by the torque limit.
const NOISE: [f64; 3] = [3e-3, 5e-4, 1.5e-3];
/// Correlation time of the disturbance torque, s.
const SURROUNDINGS: f64 = 0.05;
/// Share of a recording at full speed; the rest is at a sixth of that speed.
const FAST: f64 = 0.6;

/// Kind of arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arm {
    /// Two direct drives in a horizontal plane.
    Planar,
    /// Two geared joints in a vertical plane.
    Upright,
    /// Six geared joints, each with its own drive.
    Six,
}

/// Settings of the recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmScenario {
    /// Kind of arm.
    pub arm: Arm,
    /// Faulty joint, counted from 0, and its fault.
    pub fault: Option<(usize, Fault)>,
    /// Seed of motion and noise.
    pub seed: u64,
    /// Length of the training and of the hold-out recording, s.
    pub seconds: [f64; 2],
}

/// An arm's recordings.
#[derive(Clone, Debug)]
pub struct ArmRecordings {
    /// Description that the user has.
    pub robot: Robot,
    /// Training recording and its repeat.
    pub train: [InMemory; 2],
    /// Hold-out recording of another motion.
    pub holdout: InMemory,
}

impl ArmRecordings {
    /// Writes `robot.toml`, `train.csv`, `repeat.csv` and `holdout.csv` into a folder that exists.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ScenarioError> {
        let [train, repeat] = &self.train;
        let recordings = [
            ("train.csv", Some(train)),
            ("repeat.csv", Some(repeat)),
            ("holdout.csv", Some(&self.holdout)),
        ];
        write_all(folder, &self.robot, &recordings)
    }
}

/// Description of the arm without a fault.
fn described(arm: Arm) -> Result<Robot, ScenarioError> {
    let text = match arm {
        Arm::Planar | Arm::Upright => EDDA_TEMPLATE,
        Arm::Six => TX40,
    };
    let failed = |e: &dyn std::fmt::Display| ScenarioError(e.to_string());
    let mut robot = Robot::from_toml(text, Path::new("arm.toml")).map_err(|e| failed(&e))?;
    if arm == Arm::Upright {
        robot.gravity = [-9.81, 0.0, 0.0];
    }
    for joint in &mut robot.joints {
        let limit = limit(joint);
        let [coulomb, viscous, inertia] = OF_LIMIT.map(|share| share * limit);
        joint.friction = Some(JointFriction {
            coulomb,
            viscous,
            offset: 0.0,
        });
        let ratio = match (arm, &joint.drive) {
            (Arm::Planar, _) | (_, None) => 1.0,
            (Arm::Upright, Some(_)) => 60.0,
            (Arm::Six, Some(drive)) => drive.gear_ratio.abs(),
        };
        joint.drive = Some(Drive {
            gear_ratio: ratio,
            rotor_inertia: inertia / (ratio * ratio),
            torque_constant: 0.1,
            encoder_counts_per_rev: Some(COUNTS[usize::from(ratio == 1.0)]),
            ..Drive::default()
        });
        joint.controller = None;
    }
    Ok(robot)
}

fn limit(joint: &Joint) -> f64 {
    let stated = joint.limits.as_ref().and_then(|l| l.torque);
    stated.unwrap_or(100.0)
}

/// Torque limits of an arm's joints, N·m.
pub(super) fn limits_of(arm: Arm) -> Result<Vec<f64>, ScenarioError> {
    Ok(described(arm)?.joints.iter().map(limit).collect())
}

impl ArmScenario {
    /// Returns the standard scenario: 60 s of training recorded twice and 40 s of hold-out.
    pub fn new(arm: Arm, fault: Option<(usize, Fault)>, seed: u64) -> Self {
        Self {
            arm,
            fault,
            seed,
            seconds: [60.0, 40.0],
        }
    }

    /// Runs the arm.
    ///
    /// # Errors
    /// [`ScenarioError`] if the arm does not have the faulty joint, or if the control loop is unstable.
    pub fn make(&self) -> Result<ArmRecordings, ScenarioError> {
        let robot = described(self.arm)?;
        let joints = robot.joints.len();
        if let Some((joint, fault)) = self.fault
            && (joint >= joints
                || joint == 0
                    && matches!(fault, Fault::InertiaCoupling(_) | Fault::ViscousCoupling(_)))
        {
            return Err(ScenarioError(format!(
                "{fault:?} cannot be hidden in joint {joint} of {joints}, counted from 0"
            )));
        }
        let [train, later] = self.seconds;
        let motion = reference(&robot, train, self.seed, 1);
        let other = reference(&robot, later, self.seed, 2);
        let run = |label: &str, motion: &[Vec<f64>], run: u64| {
            let failed = |e: SimulateError| ScenarioError(e.to_string());
            let block = self.run(&robot, motion, run).map_err(failed)?;
            Ok::<InMemory, ScenarioError>(InMemory {
                label: label.into(),
                blocks: vec![block],
            })
        };
        Ok(ArmRecordings {
            train: [run("train", &motion, 0)?, run("repeat", &motion, 1)?],
            holdout: run("holdout", &other, 2)?,
            robot,
        })
    }

    /// Mechanics of the arm with its fault.
    fn mechanics(&self, robot: &Robot) -> Result<Model, SimulateError> {
        let mut robot = robot.clone();
        if let Some((_, Fault::GravityTilt([x, y]))) = self.fault {
            let turn = nalgebra::Rotation3::from_euler_angles(x, y, 0.0);
            robot.gravity = (turn.inverse() * nalgebra::Vector3::from(robot.gravity)).into();
        }
        let mut model = Model::from_robot(&robot)?;
        if let Some((joint, Fault::Payload([mass, at @ ..]))) = self.fault {
            let row = &mut model.parameters[joint];
            row[0] += mass;
            let squares: f64 = at.iter().map(|x| x * x).sum();
            let mut place = 4;
            for a in 0..3 {
                row[1 + a] += mass * at[a];
                for b in a..3 {
                    let whole = if a == b { squares } else { 0.0 };
                    row[place] += mass * (whole - at[a] * at[b]);
                    place += 1;
                }
            }
        }
        Ok(model)
    }

    fn run(&self, robot: &Robot, motion: &[Vec<f64>], run: u64) -> Result<Block, SimulateError> {
        let n = robot.joints.len();
        let model = self.mechanics(robot)?;
        let nominal = Model::from_robot(robot)?;
        let mut hidden = Hidden::new(self.fault, robot, &model);
        let mut stepper = Stepper::new(&model)?;
        let mut dice = Dice::new(self.seed, 100 + run);
        let limits: Vec<f64> = robot.joints.iter().map(limit).collect();
        let step: Vec<f64> = robot.joints.iter().map(encoder_step).collect();
        let offset = |j: usize| match self.fault {
            Some((joint, Fault::JointOffset(error))) if joint == j => error,
            _ => 0.0,
        };
        let mut q: Vec<f64> = (0..n).map(|j| at(motion, 0, j) - offset(j)).collect();
        let mut v = vec![0.0; n];
        let mut last: Vec<f64> = (0..n).map(|j| at(motion, 0, j)).collect();
        let mut speed = vec![0.0; n];
        let mut current = vec![0.0; n];
        nominal.inverse_dynamics(&last, &v, &v, &mut current)?;
        let mut outside = vec![0.0; n];
        let mut mass = vec![0.0; n * n];
        let (mut wish, mut applied) = (vec![0.0; n], vec![0.0; n]);
        let dt = 1.0 / (RATE * STEPS as f64);
        let keep = (-TAU * SPEED_FILTER / RATE).exp();
        let fade = (-1.0 / (SURROUNDINGS * RATE)).exp();
        let lag = 1.0 - (-dt / CURRENT_LOOP).exp();
        let mut block = Block {
            joints: vec![JointColumns::default(); n],
            ..Block::default()
        };
        for k in 0..motion[0].len() {
            let [target, rate, second] = wanted(motion, k);
            nominal.inverse_dynamics(&target, &rate, &second, &mut wish)?;
            nominal.inertia_matrix(&target, &mut mass)?;
            for j in 0..n {
                let read = ((q[j] + offset(j)) / step[j]).round() * step[j];
                speed[j] = keep * speed[j] + (1.0 - keep) * (read - last[j]) * RATE;
                last[j] = read;
                let natural = TAU * LOOP[0];
                wish[j] += mass[j * n + j]
                    * (natural * natural * (target[j] - read)
                        + 2.0 * LOOP[1] * natural * (rate[j] - speed[j]));
                let white = NOISE[0] * limits[j] * dice.normal();
                let code = NOISE[1] * limits[j];
                outside[j] = fade * outside[j]
                    + NOISE[2] * limits[j] * (1.0 - fade * fade).sqrt() * dice.normal();
                if k % 2 == 0 {
                    let column = &mut block.joints[j];
                    column.q.push(read);
                    column
                        .tau
                        .push(((current[j] + white) / code).round() * code);
                    column.reference.get_or_insert_default().push(target[j]);
                }
            }
            if k % 2 == 0 {
                block.t.push(k as f64 / RATE);
            }
            for _ in 0..STEPS {
                for j in 0..n {
                    current[j] += lag * (wish[j] - current[j]);
                    applied[j] = current[j] + outside[j];
                }
                hidden.take(&q, &v, &mut applied)?;
                hidden.before(&v);
                stepper.step(&mut q, &mut v, &applied, &[], dt)?;
                hidden.after(&v, dt);
                if let Some(j) = (0..n).find(|j| !(v[*j].abs() < 1e3)) {
                    return Err(SimulateError::Diverged {
                        joint: robot.joints[j].name.clone(),
                        time: k as f64 / RATE,
                    });
                }
            }
        }
        Ok(block)
    }
}

/// Returns the step of a joint's position reading, rad.
fn encoder_step(joint: &Joint) -> f64 {
    let counts = joint.drive.as_ref().and_then(|d| d.encoder_counts_per_rev);
    TAU / (counts.unwrap_or(COUNTS[0]) * joint.gear_ratio())
}

/// Returns the reference of joint `j` at control period `k`; the last one after the end.
fn at(motion: &[Vec<f64>], k: usize, j: usize) -> f64 {
    motion[j][k.min(motion[j].len() - 1)]
}

/// Returns position, velocity and acceleration of the references of all joints; rad, rad/s, rad/s².
fn wanted(motion: &[Vec<f64>], k: usize) -> [Vec<f64>; 3] {
    let mut wanted = [(); 3].map(|()| Vec::with_capacity(motion.len()));
    let [target, rate, second] = &mut wanted;
    for j in 0..motion.len() {
        let before = at(motion, k.saturating_sub(1), j);
        let (now, after) = (at(motion, k, j), at(motion, k + 1, j));
        target.push(now);
        rate.push(0.5 * (after - before) * RATE);
        second.push((after - 2.0 * now + before) * RATE * RATE);
    }
    wanted
}

/// Returns the reference for each joint: a sum of five sines, first fast, then slow, with rest at both ends of each
/// part. One value per control period.
fn reference(robot: &Robot, seconds: f64, seed: u64, motion: u64) -> Vec<Vec<f64>> {
    let mut dice = Dice::new(seed, motion);
    let samples = (seconds * RATE) as usize;
    (robot.joints.iter())
        .map(|joint| {
            let stated = joint.limits.as_ref().map(|l| l.position);
            let [low, high] = stated.unwrap_or([-2.0, 2.0]);
            let middle = 0.5 * (low + high);
            let reach = (0.35 * (high - low)).min(1.2);
            let waves: Vec<[f64; 3]> = (0..5)
                .map(|k| {
                    let frequency = dice.uniform(0.06, 0.2) * f64::from(k + 1);
                    [
                        dice.uniform(0.5, 1.0) / f64::from(k + 1),
                        frequency,
                        dice.phase(),
                    ]
                })
                .collect();
            let size: f64 = waves.iter().map(|w| w[0]).sum();
            (0..samples)
                .map(|k| {
                    let t = k as f64 / RATE;
                    let split = FAST * seconds;
                    // Each part fades in and out within 1.5 s.
                    let (from, to, pace) = if t < split {
                        (0.0, split, 1.0)
                    } else {
                        (split, seconds, 1.0 / 6.0)
                    };
                    let near = ((t - from).min(to - t) / 1.5).clamp(0.0, 1.0);
                    let fade = near * near * near * (10.0 - near * (15.0 - 6.0 * near));
                    let sum: f64 = waves
                        .iter()
                        .map(|[a, f, p]| a * (TAU * f * pace * t + p).sin())
                        .sum();
                    middle + fade * reach * sum / size
                })
                .collect()
        })
        .collect()
}
