//! Link, gear and their effects.

use core::f64::consts::{FRAC_PI_2, TAU};

use super::{OFF, Plant, PlantConfig, drive, frictionless, horizontal, run, shake};
use crate::Body;
use crate::effect::end_stops::EndStops;
use crate::effect::tilt::Tilt;
use crate::effect::transmission::{Backlash, Elasticity};

#[test]
fn default_is_the_documented_rig() {
    let e = PlantConfig::default().equivalent();
    let expected = [0.17, 2.943, 0.0, 0.3, 0.4, 0.0];
    for (got, want) in e.to_array().into_iter().zip(expected) {
        assert!((got - want).abs() < 1.0e-12, "{got} {want}");
    }
    let hanging = e.about(-FRAC_PI_2);
    assert!(hanging.gravity_cos.abs() < 1.0e-12 && (hanging.gravity_sin - 2.943).abs() < 1.0e-12);
}

#[test]
fn small_swings_have_the_pendulum_s_period() {
    let mut config = frictionless(PlantConfig::default());
    config.initial_position = -FRAC_PI_2 + 0.02;
    let e = config.equivalent();
    let mut plant = Plant::new(config, 1);
    let mut crossings = Vec::new();
    let mut last = plant.truth();
    for _ in 0..100_000 {
        plant.advance(OFF);
        let now = plant.truth();
        let (a, b) = (last.position + FRAC_PI_2, now.position + FRAC_PI_2);
        if a < 0.0 && b >= 0.0 {
            crossings.push(last.time + (now.time - last.time) * a / (a - b));
        }
        last = now;
    }
    let turns = crossings.len() - 1;
    let period = (crossings[turns] - crossings[0]) / turns as f64;
    // Second term of the pendulum's amplitude series.
    let theory = TAU * (e.inertia / e.gravity_cos).sqrt() * (1.0 + 0.02_f64.powi(2) / 16.0);
    assert!((period / theory - 1.0).abs() < 1.0e-6, "{period} {theory}");
}

#[test]
fn halving_the_step_converges() {
    let end = |substeps| {
        let mut config = PlantConfig {
            substeps,
            ..PlantConfig::default()
        };
        config.mechanism.elasticity = Some(Elasticity {
            stiffness: 3000.0,
            hardening: 0.0,
            damping: 2.0,
        });
        let mut plant = Plant::new(config, 1);
        run(&mut plant, 1.0, shake, |_| {});
        plant.truth().position
    };
    let [coarse, middle, fine] = [5, 10, 80].map(end);
    assert!((middle - fine).abs() < 1.0e-5, "{}", middle - fine);
    assert!(
        (middle - fine).abs() < (coarse - fine).abs(),
        "{} {}",
        middle - fine,
        coarse - fine
    );
}

#[test]
fn smooth_motion_converges_with_the_square_of_the_step() {
    let end = |substeps| {
        let mut plant = Plant::new(
            PlantConfig {
                substeps,
                ..frictionless(PlantConfig::default())
            },
            1,
        );
        run(&mut plant, 1.0, shake, |_| {});
        plant.truth().position
    };
    let [coarse, middle, fine] = [1, 2, 16].map(end);
    let ratio = (coarse - fine) / (middle - fine);
    assert!((3.8..4.3).contains(&ratio), "{ratio}");
}

#[test]
fn elastic_joint_rings_at_its_resonance() {
    let mut config = frictionless(horizontal(PlantConfig::default()));
    config.mechanism.elasticity = Some(Elasticity {
        stiffness: 1000.0,
        hardening: 0.0,
        damping: 0.0,
    });
    let mut plant = Plant::new(config, 1);
    plant.faults_mut().external_torque = 2.0;
    plant.advance(OFF);
    plant.faults_mut().external_torque = 0.0;
    let mut crossings = Vec::new();
    let mut last = plant.truth();
    for _ in 0..20_000 {
        plant.advance(OFF);
        let now = plant.truth();
        let (a, b) = (last.transmitted_torque, now.transmitted_torque);
        if a < 0.0 && b >= 0.0 {
            crossings.push(last.time + (now.time - last.time) * a / (a - b));
        }
        last = now;
    }
    let turns = crossings.len() - 1;
    let frequency = TAU * turns as f64 / (crossings[turns] - crossings[0]);
    let theory = (1000.0_f64 * (1.0 / 0.05 + 1.0 / 0.12)).sqrt();
    assert!(
        (frequency / theory - 1.0).abs() < 1.0e-3,
        "{frequency} {theory}"
    );
}

#[test]
fn a_stiff_gear_is_the_rigid_one() {
    let swing = |elasticity| {
        let mut config = PlantConfig::default();
        config.mechanism.elasticity = elasticity;
        let mut plant = Plant::new(config, 1);
        run(&mut plant, 0.5, shake, |_| {});
        plant.truth().position
    };
    let rigid = swing(None);
    let stiff = swing(Some(Elasticity {
        stiffness: 1.0e6,
        hardening: 0.0,
        damping: 50.0,
    }));
    assert!((rigid - stiff).abs() < 2.0e-4, "{rigid} {stiff}");
}

#[test]
fn play_is_as_wide_as_its_gap() {
    let mut config = horizontal(PlantConfig::default());
    config.mechanism.backlash = Some(Backlash {
        gap: 0.01,
        stiffness: 2.0e4,
        damping: 10.0,
    });
    let mut plant = Plant::new(config, 1);
    // Between the motor's breakaway (0.13 N·m) and the link's (0.4 N·m): the rotor moves, the link stays.
    let duty = 0.2 / 2.5 * 0.6 / 24.0;
    let mut ends = [0.0; 2];
    for (k, sign) in [(0, 1.0), (1, -1.0)] {
        run(&mut plant, 3.0, |_| sign * duty, |_| {});
        ends[k] = plant.truth().motor_position / 50.0;
    }
    let gap = ends[0] - ends[1];
    assert!((gap - 0.01).abs() < 5.0e-4, "{gap}");
}

#[test]
fn tilt_turns_the_gravity_torque() {
    let mut config = PlantConfig::default();
    config.mechanism.tilt = Some(Tilt {
        about_x: 0.0,
        about_y: 0.1,
    });
    let e = config.equivalent();
    assert!((e.gravity_cos - 2.943 * 0.1_f64.cos()).abs() < 1.0e-12);
    assert!((e.gravity_sin.abs() - 2.943 * 0.1_f64.sin()).abs() < 1.0e-12);
    config.mechanism.tilt = Some(Tilt {
        about_x: 0.1,
        about_y: 0.0,
    });
    let e = config.equivalent();
    assert!(
        (e.gravity_cos - 2.943 * 0.1_f64.cos()).abs() < 1.0e-12 && e.gravity_sin.abs() < 1.0e-12
    );
}

#[test]
fn payload_and_push_act_as_they_should() {
    let mut plant = Plant::new(frictionless(horizontal(PlantConfig::default())), 1);
    plant.faults_mut().external_torque = 0.5;
    plant.advance(OFF);
    assert!((plant.truth().acceleration - 0.5 / 0.17).abs() < 1.0e-9);
    plant.faults_mut().payload = Some(Body {
        mass: 0.5,
        distance: 0.4,
        angle: 0.0,
        inertia: 0.01,
    });
    plant.advance(OFF);
    assert!((plant.truth().acceleration - 0.5 / 0.26).abs() < 1.0e-9);
}

#[test]
fn end_stops_hold() {
    let mut config = PlantConfig::default();
    config.mechanism.end_stops = Some(EndStops {
        range: [-2.0, -1.0],
        stiffness: 2.0e4,
        damping: 20.0,
    });
    let mut plant = Plant::new(config, 1);
    run(&mut plant, 1.0, |_| 0.3, |t| assert!(t.position < -0.9));
    assert!((plant.truth().position + 1.0).abs() < 2.0e-3);
    plant.advance(drive(0.0));
}
