//! Energy is conserved in every configuration.

use super::{Plant, PlantConfig, run, shake};
use crate::Body;
use crate::effect::cogging::Cogging;
use crate::effect::dead_time::DeadTime;
use crate::effect::disturbance::Disturbance;
use crate::effect::drag::QuadraticDrag;
use crate::effect::friction_warmup::FrictionWarmup;
use crate::effect::gear_eccentricity::GearEccentricity;
use crate::effect::load_friction::LoadFriction;
use crate::effect::position_friction::PositionFriction;
use crate::effect::spring::Spring;
use crate::effect::tilt::Tilt;
use crate::effect::torque_ripple::TorqueRipple;
use crate::effect::torque_saturation::TorqueSaturation;
use crate::effect::transmission::{Backlash, Elasticity};
use crate::effect::winding_temperature::WindingTemperature;

/// Returns the largest energy defect over the run relative to the losses.
fn defect(config: PlantConfig, seconds: f64) -> f64 {
    let mut plant = Plant::new(config, 1);
    let start = plant.truth().energy;
    let mut worst: f64 = 0.0;
    run(&mut plant, seconds, shake, |t| {
        worst = worst.max(t.energy.defect_since(&start).abs())
    });
    let end = plant.truth().energy;
    worst / (end.joule + end.friction)
}

fn everything() -> PlantConfig {
    let mut config = PlantConfig::default();
    config.motor.cogging = Some(Cogging {
        amplitude: 0.004,
        order: 42.0,
        phase: 0.3,
    });
    config.motor.ripple = Some(TorqueRipple {
        amplitude: 0.04,
        order: 42.0,
        phase: 0.1,
    });
    config.motor.saturation = Some(TorqueSaturation { knee: 60.0 });
    config.motor.temperature = Some(WindingTemperature {
        resistance: 0.0039,
        torque_constant: -0.0011,
    });
    config.motor.friction.load = Some(LoadFriction { ratio: 0.05 });
    config.bridge.supply_resistance = 0.2;
    config.bridge.dead_time = Some(DeadTime {
        voltage: 0.5,
        fade_current: 0.2,
    });
    config.mechanism.friction.position = Some(PositionFriction {
        amplitude: 0.2,
        order: 3.0,
        phase: 0.5,
    });
    config.mechanism.friction.drag = Some(QuadraticDrag { coefficient: 0.05 });
    config.mechanism.friction.asymmetry = 0.15;
    config.mechanism.eccentricity = Some(GearEccentricity {
        amplitude: 0.2,
        order: 1.0,
        phase: 1.0,
    });
    config.mechanism.spring = Some(Spring {
        stiffness: 0.3,
        rest: -1.0,
    });
    config.mechanism.tilt = Some(Tilt {
        about_x: 0.05,
        about_y: 0.08,
    });
    config.mechanism.warmup = Some(FrictionWarmup {
        heat_capacity: 20.0,
        thermal_resistance: 3.0,
        viscous_rate: 0.02,
        coulomb_rate: 0.005,
    });
    config.mechanism.disturbance = Some(Disturbance {
        std: 0.03,
        correlation_time: 0.05,
    });
    config.mechanism.torque_offset = Some(0.1);
    config
}

#[test]
fn balances_for_the_rigid_default() {
    let got = defect(PlantConfig::default(), 5.0);
    assert!(got < 1.0e-5, "{got:e}");
}

#[test]
fn balances_with_every_effect_on_and_an_elastic_gear_with_play() {
    let mut config = everything();
    let rigid = defect(config.clone(), 3.0);
    assert!(rigid < 1.0e-3, "{rigid:e}");
    config.mechanism.elasticity = Some(Elasticity {
        stiffness: 3000.0,
        hardening: 1.0e6,
        damping: 2.0,
    });
    let elastic = defect(config.clone(), 3.0);
    assert!(elastic < 1.0e-3, "{elastic:e}");
    config.mechanism.backlash = Some(Backlash {
        gap: 0.01,
        stiffness: 1.0e4,
        damping: 5.0,
    });
    let play = defect(config, 3.0);
    assert!(play < 1.0e-3, "{play:e}");
}

#[test]
fn the_defect_falls_with_the_square_of_the_substep() {
    let mut config = PlantConfig::default();
    config.mechanism.elasticity = Some(Elasticity {
        stiffness: 3000.0,
        hardening: 0.0,
        damping: 2.0,
    });
    let [coarse, fine] = [5, 20].map(|substeps| {
        defect(
            PlantConfig {
                substeps,
                ..config.clone()
            },
            2.0,
        )
    });
    assert!(
        coarse / fine > 8.0,
        "{coarse:e} to {fine:e} over a fourth of the step"
    );
}

/// Compares the energy balance with an independent sum over samples.
#[test]
fn losses_in_the_ledger_are_those_of_the_samples() {
    let mut plant = Plant::new(PlantConfig::default(), 1);
    let [mut joule, mut friction, mut shaft] = [0.0; 3];
    let tick = plant.config().tick;
    let resistance = plant.config().motor.resistance;
    let mut last = plant.truth();
    run(&mut plant, 5.0, shake, |t| {
        joule += 0.5 * tick * resistance * (t.current.powi(2) + last.current.powi(2));
        friction +=
            0.5 * tick * (t.friction_torque * t.velocity + last.friction_torque * last.velocity);
        shaft +=
            0.5 * tick * 0.05 * (t.current * t.motor_velocity + last.current * last.motor_velocity);
        last = *t;
    });
    let energy = plant.truth().energy;
    assert!(
        (energy.joule / joule - 1.0).abs() < 1.0e-3,
        "{} {joule}",
        energy.joule
    );
    assert!(
        (energy.friction / friction - 1.0).abs() < 3.0e-3,
        "{} {friction}",
        energy.friction
    );
    let mechanical = energy.kinetic
        + energy.potential
        + plant.config().equivalent().gravity_cos
        + energy.friction;
    assert!(
        (mechanical / shaft - 1.0).abs() < 1.0e-3,
        "{mechanical} {shaft}"
    );
    assert!(energy.friction > energy.asperities && energy.asperities >= 0.0);
}

#[test]
fn a_payload_brings_its_energy_along() {
    let mut plant = Plant::new(PlantConfig::default(), 1);
    run(&mut plant, 1.0, shake, |_| {});
    let start = plant.truth().energy;
    plant.faults_mut().payload = Some(Body {
        mass: 0.5,
        distance: 0.3,
        angle: 0.0,
        inertia: 0.0,
    });
    run(&mut plant, 1.0, shake, |_| {});
    let end = plant.truth().energy;
    assert!(
        end.defect_since(&start).abs() < 1.0e-5 * end.joule,
        "{}",
        end.defect_since(&start)
    );
    assert!((end.external - start.external).abs() > 1.0e-3);
}
