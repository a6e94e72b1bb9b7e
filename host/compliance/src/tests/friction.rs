//! Coulomb friction of the motor, which stops it near the antiresonance.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_model::robot::{EDDA_TEMPLATE, Robot};

use crate::{ComplianceOptions, FrequencyResponse, identify_compliance};

/// Rows per second.
const RATE: f64 = 1000.0;
/// Steps of the simulation per row.
const STEPS: usize = 40;
/// Length of the chirp, s.
const LENGTH: f64 = 12.3;
/// Rest at either end of the chirp, s.
const REST: f64 = 0.5;
/// N·m/rad.
const STIFFNESS: f64 = 3000.0;

/// A chirp from 2 to 60 Hz, bounded in position, velocity and acceleration.
fn reference(t: f64) -> f64 {
    let at = (t - REST).clamp(0.0, LENGTH);
    let octaves = 30f64.ln();
    let grown = (octaves * at / LENGTH).exp();
    let phase = TAU * 2.0 * LENGTH / octaves * (grown - 1.0);
    let omega = TAU * 2.0 * grown;
    let edge = (at.min(LENGTH - at) / 0.25).clamp(0.0, 1.0);
    let size = 1.92f64.min(6.4 / omega).min(64.0 / (omega * omega));
    edge * edge * (3.0 - 2.0 * edge) * size * phase.sin()
}

/// The elbow of the EDDA behind a spring, under a position loop.
#[derive(Clone, Copy, Debug)]
struct Elbow {
    /// Coulomb friction of motor and link, N·m.
    coulomb: [f64; 2],
    /// Viscous friction of the link, N·m·s/rad.
    link_viscous: f64,
    /// True if the controller holds the torque from row to row.
    held: bool,
}

impl Elbow {
    fn with_friction(coulomb: [f64; 2]) -> Self {
        Self {
            coulomb,
            link_viscous: 0.0,
            held: false,
        }
    }

    /// Records the elbow by steps of 25 µs. It shares no code with the estimator.
    fn record(&self) -> JointColumns {
        let (link, motor, damping, viscous) = (0.2434, 0.04, 2.0, 0.12);
        let braked = |free: f64, most: f64| free - most.min(free.abs()) * free.signum();
        let step = 1.0 / (RATE * STEPS as f64);
        let [of_motor, of_link] = self.coulomb;
        let ([mut q, mut v], [mut ql, mut vl]) = ([0.0f64; 2], [0.0f64; 2]);
        let (mut joint, mut torque) = (JointColumns::default(), 0.0);
        for k in 0..((LENGTH + 2.0 * REST) * RATE) as usize * STEPS {
            let wanted = reference(k as f64 * step);
            if !self.held || k.is_multiple_of(STEPS) {
                torque = 400.0 * (wanted - q) - 8.0 * v;
            }
            if k.is_multiple_of(STEPS) {
                joint.q.push(q);
                joint.tau.push(torque);
                joint.reference.get_or_insert_default().push(wanted);
            }
            let spring = STIFFNESS * (q - ql) + damping * (v - vl);
            let free = v + step * (torque - spring - viscous * v) / motor;
            let driven = vl + step * (spring - self.link_viscous * vl) / link;
            v = braked(free, of_motor * step / motor);
            vl = braked(driven, of_link * step / link);
            q += step * v;
            ql += step * vl;
        }
        joint
    }
}

/// Adds noise of 1 µrad and 0.05 N·m, and identifies the spring.
fn identified(quiet: &JointColumns, seed: u64) -> FrequencyResponse {
    let robot = Robot::from_toml(EDDA_TEMPLATE, "edda.toml".as_ref()).unwrap();
    let options = ComplianceOptions {
        joint: 1,
        ..ComplianceOptions::default()
    };
    let mut dice = Pcg64Mcg::seed_from_u64(seed);
    let mut noisy = |list: &[f64], std: f64| -> Vec<f64> {
        let mut drawn = || -> f64 { StandardNormal.sample(&mut dice) };
        list.iter().map(|own| own + std * drawn()).collect()
    };
    let own = JointColumns {
        q: noisy(&quiet.q, 1e-6),
        tau: noisy(&quiet.tau, 0.05),
        reference: quiet.reference.clone(),
        ..JointColumns::default()
    };
    let still = vec![0.0; own.q.len()];
    let shoulder = JointColumns {
        q: still.clone(),
        tau: still.clone(),
        reference: Some(still),
        ..JointColumns::default()
    };
    let block = Block {
        t: (0..own.q.len()).map(|row| row as f64 / RATE).collect(),
        joints: vec![shoulder, own],
        first_line: 2,
        ..Block::default()
    };
    let run = InMemory {
        label: "elbow.csv".into(),
        blocks: vec![block],
    };
    let found = identify_compliance(&robot, &[], &[&run], &options).unwrap();
    found.frequency.unwrap()
}

/// The spring came out 0.8 % too stiff, five standard deviations: the damping of the predicted link was late by half a step, which
/// the antiresonance enlarges, and the velocity before a reversal was a mean over rows that curve. With friction of the link, a
/// torque that the controller does not hold was taken as held, and the spring came out 1.8 % too stiff.
#[test]
fn friction_that_stops_the_motor_does_not_stiffen_the_spring() {
    for (friction, seeds) in [([0.8, 0.0], 8), ([0.4, 0.4], 2)] {
        let quiet = Elbow::with_friction(friction).record();
        let (mut covered, mut sum) = (0, 0.0);
        for seed in 0..seeds {
            let found = identified(&quiet, seed);
            let [low, high] = found.stiffness.interval();
            covered += usize::from(low <= STIFFNESS && STIFFNESS <= high);
            sum += found.stiffness.value / seeds as f64;
        }
        println!("friction {friction:?}: {covered} of {seeds} intervals cover; mean {sum:.2}");
        assert!(covered >= seeds as usize - 1, "{covered} of {seeds}");
        // The means have a standard deviation of 0.06 and 0.2 %.
        let most = if seeds == 8 { 0.0025 } else { 0.006 };
        assert!((sum / STIFFNESS - 1.0).abs() < most, "{sum}");
    }
}

/// With dry and viscous friction of the link the torque was taken as held, 1.7 % too stiff. With more friction of the motor the
/// fits ended in a local minimum without damping, 1 to 4 % too soft.
#[test]
fn friction_of_motor_and_link_hides_neither_the_hold_nor_the_damping() {
    for (coulomb, link_viscous, held) in [
        ([0.4, 0.4], 0.05, false),
        ([0.5, 0.3], 0.0, false),
        ([0.5, 0.3], 0.0, true),
    ] {
        let case = Elbow {
            coulomb,
            link_viscous,
            held,
        };
        let found = identified(&case.record(), 0);
        println!("{case:?}: {:?} {:?}", found.stiffness, found.damping);
        assert_eq!(found.held, held, "{case:?}");
        let off = (found.stiffness.value - STIFFNESS) / found.stiffness.std;
        assert!(off.abs() < 2.5, "{case:?}: {:?}", found.stiffness);
        assert!(
            (found.damping.value - 2.0).abs() < 0.3,
            "{:?}",
            found.damping
        );
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }
}
