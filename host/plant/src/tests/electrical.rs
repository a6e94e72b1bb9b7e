//! Winding and bridge.

use super::{OFF, Plant, PlantConfig, drive, frictionless, horizontal};

/// A rotor that cannot turn.
fn locked() -> PlantConfig {
    let mut config = horizontal(PlantConfig::default());
    config.motor.rotor_inertia = 1.0e9;
    config
}

#[test]
fn current_steps_as_one_minus_exponential_one_tick_late() {
    let mut plant = Plant::new(locked(), 1);
    plant.advance(drive(0.25));
    assert_eq!(
        plant.truth().current,
        0.0,
        "the command acts from the next sampling instant on"
    );
    for k in 1..60 {
        plant.advance(drive(0.25));
        let expected = 6.0 / 0.6 * (1.0 - (-0.6 / 0.5e-3 * f64::from(k) * 1.0e-4).exp());
        let got = plant.truth().current;
        assert!(
            (got - expected).abs() < 1.0e-4 * expected,
            "tick {k}: {got} for {expected}"
        );
    }
}

#[test]
fn current_runs_down_through_the_diodes_and_stops() {
    let mut plant = Plant::new(locked(), 1);
    for _ in 0..200 {
        plant.advance(drive(-0.25));
    }
    plant.advance(OFF);
    let before = plant.truth();
    let mut ticks = 0;
    while plant.truth().current != 0.0 {
        assert!(plant.truth().current < 0.0, "never through zero");
        plant.advance(OFF);
        ticks += 1;
        assert!(ticks < 100);
    }
    // i falls from −10 A towards (24 + 2·0.8)/0.6 A: zero after L/R·ln(1 + i·R/V), 0.176 ms.
    assert_eq!(ticks, 2);
    let energy = plant.truth().energy;
    assert!(
        energy.supply < before.energy.supply,
        "the supply takes it back"
    );
    let defect = energy.defect_since(&before.energy).abs();
    assert!(defect < 5.0e-3 * before.energy.magnetic, "{defect}");
}

#[test]
fn open_motor_coasts_without_current_and_a_shorted_one_brakes() {
    let speed_after = |command| {
        let mut plant = Plant::new(frictionless(horizontal(PlantConfig::default())), 1);
        for _ in 0..3000 {
            plant.advance(drive(0.2));
        }
        let before = plant.truth().velocity;
        for _ in 0..1000 {
            plant.advance(command);
        }
        (before, plant.truth())
    };
    let (before, open) = speed_after(OFF);
    assert!((open.velocity / before - 1.0).abs() < 0.05);
    assert_eq!(open.current, 0.0);
    assert!(
        (open.voltage - 0.05 * open.motor_velocity).abs() < 1.0e-9,
        "the terminals show the back-EMF"
    );
    let (before, shorted) = speed_after(drive(0.0));
    // J·R/k² = 0.17·0.6/2.5² s = 16 ms.
    assert!(shorted.velocity.abs() < 0.01 * before);
}

#[test]
fn no_load_speed_is_voltage_over_back_emf() {
    let mut plant = Plant::new(frictionless(horizontal(PlantConfig::default())), 1);
    for _ in 0..8000 {
        plant.advance(drive(0.25));
    }
    assert!((plant.truth().motor_velocity - 6.0 / 0.05).abs() < 1.0e-3);
}

#[test]
fn a_soft_supply_sags_with_the_current_it_gives() {
    let mut config = locked();
    config.bridge.supply_resistance = 0.4;
    let mut plant = Plant::new(config, 1);
    for _ in 0..1000 {
        plant.advance(drive(0.5));
    }
    let truth = plant.truth();
    // i = d·V/(R + d²·Rs).
    let current = 12.0 / (0.6 + 0.25 * 0.4);
    assert!((truth.current - current).abs() < 1.0e-6);
    assert!((truth.supply - (24.0 - 0.4 * 0.5 * current)).abs() < 1.0e-6);
}

#[test]
fn a_dead_supply_brakes_through_the_diodes() {
    let mut plant = Plant::new(frictionless(horizontal(PlantConfig::default())), 1);
    for _ in 0..3000 {
        plant.advance(drive(0.25));
    }
    plant.faults_mut().supply = Some(0.0);
    for _ in 0..5000 {
        plant.advance(OFF);
    }
    let emf = 0.05 * plant.truth().motor_velocity;
    assert!(
        emf < 2.0 * 0.8 + 1.0e-2 && emf > 1.0,
        "{emf} V: it brakes down to the diodes' drop only"
    );
}

#[test]
fn winding_warms_by_its_losses() {
    let mut config = locked();
    config.motor.thermal_resistance = 1.0e9;
    let mut plant = Plant::new(config, 1);
    for _ in 0..10_000 {
        plant.advance(drive(0.25));
    }
    let truth = plant.truth();
    assert!(((truth.winding_temperature - 25.0) - truth.energy.joule / 60.0).abs() < 1.0e-6);
}
