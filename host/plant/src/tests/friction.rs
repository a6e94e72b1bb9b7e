//! Sticking, slipping and presliding.

use super::{Friction, OFF, Plant, PlantConfig, horizontal, run};

/// Returns the duty that holds `torque` N·m at the joint at standstill.
fn duty_for(torque: f64) -> f64 {
    torque / (50.0 * 0.05) * 0.6 / 24.0
}

#[test]
fn sticks_below_breakaway_for_minutes() {
    let config = horizontal(PlantConfig::default());
    let [breakaway, _] = config.breakaway();
    for share in [0.5, 0.9] {
        let mut plant = Plant::new(config.clone(), 1);
        run(&mut plant, 5.0, |_| duty_for(share * breakaway), |_| {});
        let settled = plant.truth();
        run(&mut plant, 120.0, |_| duty_for(share * breakaway), |_| {});
        let creep = plant.truth().position - settled.position;
        assert!(
            creep.abs() < 1.0e-9,
            "{creep:e} rad in two minutes at {share} of breakaway"
        );
        assert!(plant.truth().velocity.abs() < 1.0e-9);
    }
}

#[test]
fn slips_just_above_breakaway_and_not_just_below() {
    let config = horizontal(PlantConfig::default());
    let [breakaway, _] = config.breakaway();
    assert!((1.25..1.40).contains(&(breakaway / config.equivalent().coulomb)));
    let moved = |torque: f64| {
        let mut plant = Plant::new(config.clone(), 1);
        // The ramp is so slow that only the static torque matters. The motor is open: with a voltage, the back-EMF
        // would hold the joint back.
        for k in 0..40_000 {
            plant.faults_mut().external_torque = torque * (f64::from(k) / 30_000.0).min(1.0);
            plant.advance(OFF);
        }
        (plant.truth().position - config.initial_position).abs()
    };
    assert!(moved(0.97 * breakaway) < 1.0e-3);
    assert!(moved(1.03 * breakaway) > 0.02);
}

/// Returns the presliding curve of torque against displacement, driven by a slow cyclic torque.
fn loop_of(period: f64) -> Vec<(f64, f64)> {
    let config = horizontal(PlantConfig::default());
    let amplitude = 0.7 * config.breakaway()[0];
    let mut plant = Plant::new(config.clone(), 1);
    let mut curve = Vec::new();
    let torque = |t: f64| amplitude * (t / period * core::f64::consts::TAU).sin();
    let every = (period / 200.0 / config.tick).round() as usize;
    let mut tick = 0;
    run(
        &mut plant,
        3.0 * period,
        |t| duty_for(torque(t)),
        |t| {
            tick += 1;
            if tick % every == 0 {
                curve.push((t.position - config.initial_position, t.drive_torque));
            }
        },
    );
    curve
}

fn area(points: &[(f64, f64)]) -> f64 {
    points
        .windows(2)
        .map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0))
        .sum()
}

#[test]
fn presliding_loop_closes_and_does_not_know_the_rate() {
    let [slow, fast] = [4.0, 2.0].map(loop_of);
    let last = slow.len() - 1;
    let span = slow.iter().map(|p| p.0).fold(0.0, f64::max);
    assert!(span > 2.0e-5 && span < 1.0e-3, "{span}");
    assert!(
        (slow[last].0 - slow[last - 200].0).abs() < 1.0e-3 * span,
        "the second and third turn agree"
    );
    let [slow, fast] = [area(&slow[last - 200..]), area(&fast[last - 200..])];
    assert!(slow > 1.0e-6, "a loop, not a line: {slow}");
    assert!(
        (fast / slow - 1.0).abs() < 0.02,
        "{fast:e} J and {slow:e} J"
    );
}

#[test]
fn steady_sliding_shows_the_equivalent_parameters() {
    for seed in 0..4 {
        let config = horizontal(PlantConfig::random(seed));
        let expected = config.equivalent();
        for duty in [0.45, 0.75, -0.45, -0.75] {
            let mut plant = Plant::new(config.clone(), 1);
            plant_free(&mut plant);
            run(&mut plant, 0.45, |_| duty, |_| {});
            let truth = plant.truth();
            let predicted = expected.inertia * truth.acceleration
                + expected.viscous * truth.velocity
                + expected.coulomb * truth.velocity.signum()
                + expected.offset;
            assert!(truth.velocity.abs() > 1.0);
            let gap = truth.drive_torque - predicted;
            assert!(gap.abs() < 2.0e-3, "{gap} N·m at {} rad/s", truth.velocity);
        }
    }
}

/// Moves the stops away for a long slide.
fn plant_free(plant: &mut Plant) {
    let mut config = plant.config().clone();
    config.mechanism.end_stops = None;
    *plant = Plant::new(config, 1);
}

#[test]
fn weakening_is_rational_in_speed() {
    let friction = PlantConfig::default().mechanism.friction;
    let scale = crate::friction::Scale {
        coulomb: 1.0,
        load: 0.0,
    };
    for speed in [0.005, 0.025, 0.1] {
        let mut contact = crate::friction::Contact::new(&friction, 1.0e-5);
        let mut torque = 0.0;
        for _ in 0..200_000 {
            torque = contact.advance(speed, speed * 1.0e-5, scale).torque;
        }
        let expected = 0.3 + 0.3 * 0.33 / (1.0 + (speed / 0.025).powi(2));
        assert!((torque - expected).abs() < 1.0e-9, "{torque} {expected}");
    }
}

#[test]
fn a_contact_never_gives_back_more_than_it_took() {
    let friction = Friction {
        asymmetry: 0.2,
        ..PlantConfig::default().mechanism.friction
    };
    let scale = crate::friction::Scale {
        coulomb: 1.0,
        load: 0.0,
    };
    let mut contact = crate::friction::Contact::new(&friction, 1.0e-5);
    let mut work = 0.0;
    for k in 0..400_000 {
        let time = f64::from(k) * 1.0e-5;
        let speed = 0.02 * (31.0 * time).sin() + 0.05 * (7.0 * time).sin() * (2.3 * time).cos();
        let before = contact.stored();
        let torque = contact.advance(speed, speed * 1.0e-5, scale).torque;
        work += torque * speed * 1.0e-5;
        assert!(
            work >= contact.stored() - 1.0e-6,
            "{work} J in, {} J held (before {before})",
            contact.stored()
        );
    }
}

/// A joint dragged slowly through a soft spring sticks and slips; dragged fast it slides.
#[test]
fn sticks_and_slips_behind_a_soft_spring() {
    let dragged = |pull: f64| {
        let config = horizontal(PlantConfig::default());
        let mut plant = Plant::new(config.clone(), 1);
        let (mut slowest, mut fastest) = (f64::INFINITY, 0.0_f64);
        for k in 0..200_000 {
            let ahead = config.initial_position + pull * f64::from(k) * 1.0e-4;
            plant.faults_mut().external_torque = 20.0 * (ahead - plant.truth().position);
            plant.advance(OFF);
            if k > 100_000 {
                slowest = slowest.min(plant.truth().velocity);
                fastest = fastest.max(plant.truth().velocity);
            }
        }
        (slowest / pull, fastest / pull)
    };
    let (slowest, fastest) = dragged(0.005);
    assert!(
        slowest < 0.1 && fastest > 3.0,
        "{slowest} to {fastest} times the pull"
    );
    let (slowest, fastest) = dragged(0.2);
    assert!(
        slowest > 0.95 && fastest < 1.05,
        "{slowest} to {fastest} times the pull"
    );
}
