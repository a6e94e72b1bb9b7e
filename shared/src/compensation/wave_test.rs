//! Tests of the waves against the formulas of their effects.
#![allow(clippy::unwrap_used)]

use core::f64::consts::TAU;
use std::vec::Vec;

use proptest::prelude::*;

use crate::compensation::{Compensation, EFFECTS, Inputs, Output, PositionError, Role, State};
use crate::effects::{Effect, Instant, Kind, Memory};
use crate::precompensation::PrecompensationSettings;

const RATIO: f64 = 50.0;
const PERIOD: f64 = 1e-4;
/// As in the firmware: every fourth tick has time.
const EVERY: u32 = 4;

/// A rig whose link follows exactly. Its effects are called at every tick.
struct Rig {
    compensation: Compensation<f64>,
    state: State<f64>,
    effects: Vec<Effect<f64>>,
    position: f64,
    tick: u32,
    torque_delay: f64,
}

impl Rig {
    fn new(effects: &[Effect<f64>], torque_delay: f64) -> Self {
        let mut given = [None; EFFECTS];
        for (place, effect) in given.iter_mut().zip(effects) {
            *place = Some(*effect);
        }
        Self {
            compensation: Compensation::new(&given).unwrap(),
            state: State::default(),
            effects: effects.to_vec(),
            position: 0.3,
            tick: 0,
            torque_delay,
        }
    }

    fn inputs(&self, velocity: f64) -> Inputs<f64> {
        let motor = RATIO * self.position;
        Inputs {
            position: self.position,
            velocity,
            gear_ratio: RATIO,
            motor_angle: motor,
            angle_in_turn: motor.rem_euclid(TAU),
            position_known: true,
            busy: self.tick % EVERY != 1,
            rotates_waves: self.tick % 2 == 1,
            drive_torque: 2.0,
            period: PERIOD,
            torque_delay: self.torque_delay,
            delay_ticks: (self.torque_delay / PERIOD) as u8,
            delay_fraction: (self.torque_delay / PERIOD).fract(),
            ..Inputs::default()
        }
    }

    fn step(&mut self, velocity: f64) -> (Output<f64>, PositionError<f64>) {
        self.position += velocity * PERIOD;
        self.tick += 1;
        let inputs = self.inputs(velocity);
        let settings = PrecompensationSettings {
            enabled: false,
            gain: 0.0,
            gain_at_rest: 0.0,
            velocity_threshold: 0.01,
        };
        let reading = self.compensation.turn(&mut self.state, &inputs);
        let torque = self
            .compensation
            .torque(&settings, &mut self.state, &inputs);
        (torque, reading)
    }

    /// Returns torque and reading error by the formulas, `torque_delay` later.
    fn truth(&self, velocity: f64, torque_delay: f64) -> [f64; 2] {
        let position = self.position + torque_delay * velocity;
        let at = Instant {
            position,
            motor_angle: RATIO * position,
            drive_torque: 2.0,
            ..Instant::default()
        };
        let mut sums = [0.0; 2];
        for effect in &self.effects {
            let has_position_waves = Role::of(effect.kind) == Some(Role::Position);
            sums[usize::from(has_position_waves)] += effect.torque(&mut Memory::default(), &at);
        }
        sums
    }
}

fn wave(kind: Kind, order: f64) -> Effect<f64> {
    Effect::new(kind, &[0.8, -0.6], &[order])
}

fn periodic() -> impl Iterator<Item = Kind> {
    let kinds = Kind::ALL.iter().copied();
    kinds.filter(|kind| kind.periodic().is_some() && Role::of(*kind).is_some())
}

/// Eight effects of each periodic kind, at any speed at which the waves exist. The given torque equals the formula at
/// the time when it acts, and the explained torque equals the formula now.
#[test]
fn every_periodic_effect_is_its_formula_at_any_speed() {
    let torque_delay = 3.7 * PERIOD;
    assert_eq!(periodic().count(), 5);
    for kind in periodic() {
        let effects: Vec<_> = (2..=9).map(|order| wave(kind, f64::from(order))).collect();
        let mut worst = [0.0_f64; 3];
        for speed in [0.0, 0.1, 1.0, -3.0, 6.0] {
            let mut rig = Rig::new(&effects, torque_delay);
            for tick in 0..4000 {
                let (torque, reading) = rig.step(speed);
                if tick < 70 {
                    continue;
                }
                let [ahead, _] = rig.truth(speed, torque_delay);
                let [here, read] = rig.truth(speed, 0.0);
                worst[0] = worst[0].max((torque.feedforward - ahead).abs());
                worst[1] = worst[1].max((reading.error - read).abs());
                worst[2] = worst[2].max((torque.explained - here).abs());
            }
        }
        // Eight waves of amplitude 1. Torque ripple is per drive torque, which is 2.
        let whole = if kind == Kind::TorqueRipple {
            16.0
        } else {
            8.0
        };
        let worst = worst.map(|worst| worst / whole);
        std::println!("{kind:?}: {worst:?} of the amplitude");
        // The explained torque is interpolated between two ticks. Its error is an eighth of the square of the phase
        // between them, 0.27 rad at order 9.
        let most = [0.0025, 0.0025, 0.005];
        assert!(
            worst.iter().zip(most).all(|(worst, most)| *worst < most),
            "{worst:?}"
        );
    }
}

/// A law evaluated every fourth tick and held would be wrong by 1.44 rad at the end, at 6 rad/s and order 12. With
/// eight of them it would be noise.
#[test]
fn fast_waves_are_followed_until_there_are_none() {
    for (order, speed, most) in [
        (12.0, 6.0, 0.01),
        (24.0, 6.0, 0.1),
        (84.0, 1.0, 0.02),
        (84.0, 1.7, 0.1),
    ] {
        let mut rig = Rig::new(&[wave(Kind::Cogging, order); EFFECTS], 0.0);
        let mut worst = 0.0_f64;
        for tick in 0..4000 {
            let (torque, _) = rig.step(speed);
            if tick > 70 {
                worst = worst.max((torque.feedforward - rig.truth(speed, 0.0)[0]).abs() / 8.0);
            }
        }
        std::println!("order {order} at {speed} rad/s: {worst:.5} of the amplitude");
        assert!(worst < most, "{order} {speed} {worst}");
    }
    let mut rig = Rig::new(&[wave(Kind::Cogging, 84.0)], 0.0);
    for _ in 0..100 {
        assert_eq!(rig.step(2.5).0.feedforward, 0.0);
    }
}

/// The slope is the derivative of the position error.
#[test]
fn the_slope_of_the_reading_is_that_of_its_error() {
    for kind in periodic().filter(|kind| Role::of(*kind) == Some(Role::Position)) {
        let mut rig = Rig::new(&[wave(kind, 2.0)], 0.0);
        let (mut before, mut slope) = (0.0, 0.0);
        for tick in 0..1000 {
            let (_, reading) = rig.step(0.5);
            if tick > 10 {
                let mean = 0.5 * (slope + reading.slope);
                let found = (reading.error - before) / (0.5 * PERIOD);
                assert!((found - mean).abs() < 1e-3 * 2.0 * RATIO, "{kind:?}");
            }
            (before, slope) = (reading.error, reading.slope);
        }
    }
}

proptest! {
    /// For any motion, with jumps, a wave stays within its amplitude. It is exact again after its next reset.
    #[test]
    fn jumps_do_no_harm(speeds in prop::collection::vec((-8.0..8.0_f64, 0..30_u32), 1..40)) {
        let effects = [wave(Kind::Cogging, 12.0), wave(Kind::GearEccentricity, 1.0)];
        let mut rig = Rig::new(&effects, 0.0);
        for (speed, ticks) in speeds {
            // A jump by half a turn of the joint.
            rig.position += if ticks % 7 == 0 { 3.0 } else { 0.0 };
            for _ in 0..ticks {
                prop_assert!(rig.step(speed).0.feedforward.abs() < 2.02);
            }
        }
        // The rotation that a jump spoils, and one reset of each wave.
        for _ in 0..12 {
            rig.step(0.0);
        }
        let off = rig.step(0.0).0.feedforward - rig.truth(0.0, 0.0)[0];
        prop_assert!(off.abs() < 1e-9, "{off}");
    }
}
