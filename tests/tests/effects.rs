//! Effects beyond the standard model, hidden in the plant and told to the rig over the wire.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_link::LinkError;
use rig_plant::PlantConfig;
use rig_plant::effect::cogging::Cogging;
use rig_plant::effect::dead_time::DeadTime;
use rig_plant::effect::gear_eccentricity::GearEccentricity;
use rig_plant::emulated::EmulatedRig;
use rig_shared::effects::{Effect, Kind};
use rig_shared::safety::Mode;
use rig_shared::trajectory::{Chirp, FrictionSweep, SlowReversals, Sweep, Trajectory};
use rig_shared::wire::message::{Refusal, RequestBody};
use rig_tests::{
    Line, calibrated, cogging_of, connect, driven, excitation, nameplate, periodic, truth_of,
};

/// A rig with this plant, calibrated, told where it hangs and what its model is, friction precompensated.
fn told(plant: &PlantConfig, seed: u64) -> Line {
    let nameplate = nameplate(plant);
    let mut line = connect(&nameplate, plant.clone(), seed);
    calibrated(&mut line);
    line.request(RequestBody::SetPosition(plant.initial_position as f32))
        .unwrap();
    let mut precompensation = nameplate.settings.precompensation;
    precompensation.enabled = true;
    for body in truth_of(plant) {
        line.request(body).unwrap();
    }
    line.request(RequestBody::SetPrecompensation(precompensation))
        .unwrap();
    line
}

fn set(effects: &[Effect<f32>]) -> Vec<RequestBody> {
    vec![RequestBody::SetEffects(effects.iter().copied().collect())]
}

fn reversals() -> Trajectory<f32> {
    Trajectory::SlowReversals(SlowReversals::new(0.05_f32, 0.1, &[0.2, 0.1], 2).unwrap())
}

/// RMS tracking error without and with the effects, mrad.
fn tracking(plant: &PlantConfig, seed: u64, effects: &[Effect<f32>]) -> [f64; 2] {
    let mut line = told(plant, seed);
    [&[], effects].map(|effects| {
        let run = driven(&mut line, set(effects), reversals(), 0.2);
        assert!(run.faults.is_empty(), "{:?}", run.faults);
        1e3 * run.tracking_rms(0.0, f64::MAX)
    })
}

#[test]
fn hidden_cogging_and_eccentricity_are_compensated_once_they_are_named() {
    for seed in 1..=3 {
        let bare = PlantConfig::laboratory(seed);
        let cogging = Cogging {
            amplitude: 0.006,
            order: 12.0,
            phase: 0.7,
        };
        let mut plant = bare.clone();
        plant.motor.cogging = Some(cogging);
        let [before, after] = tracking(&plant, seed, &[cogging_of(&plant)]);
        println!("seed {seed}, cogging: {before:.3} mrad without, {after:.3} with");
        assert!(after < before / 2.0, "{before} to {after} mrad");

        let mut plant = bare;
        plant.mechanism.eccentricity = Some(GearEccentricity {
            amplitude: 0.4,
            order: 2.0,
            phase: -1.1,
        });
        let named = periodic(0.4, 2.0, -1.1);
        let [before, after] = tracking(&plant, seed, &[named]);
        println!("seed {seed}, eccentricity: {before:.3} mrad without, {after:.3} with");
        assert!(after < before / 2.0, "{before} to {after} mrad");
    }
}

#[test]
fn the_on_line_estimator_does_not_see_what_effects_explain() {
    let seed = 5;
    let mut plant = PlantConfig::laboratory(seed);
    plant.mechanism.eccentricity = Some(GearEccentricity {
        amplitude: 0.4,
        order: 2.0,
        phase: -1.1,
    });
    let mut line = told(&plant, seed);
    let mut rms = |effects: &[Effect<f32>]| {
        let run = driven(&mut line, set(effects), excitation(5, 5, 4), 0.3);
        assert!(run.faults.is_empty(), "{:?}", run.faults);
        let estimate = run.estimate();
        assert_eq!(estimate.trusted, [true; 6]);
        f64::from(estimate.residual_rms)
    };
    let (without, with) = (rms(&[]), rms(&[periodic(0.4, 2.0, -1.1)]));
    println!("residual {without:.4} N·m without, {with:.4} with");
    assert!(with < without / 3.0, "{without} to {with} N·m");
}

#[test]
fn what_cannot_be_compensated_is_refused_by_name_and_changes_nothing() {
    let plant = PlantConfig::laboratory(1);
    let mut line = told(&plant, 1);
    let good = periodic(0.1, 2.0, 0.0);
    line.request(set(&[good]).remove(0)).unwrap();
    let before = *line.port().device().state().settings();
    let play = Effect::new(Kind::Backlash, &[], &[0.01, 5e3, 5.0, 0.5]);
    let error = line.request(set(&[good, play]).remove(0)).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("(the effect `backlash`): it acts between motor and link"),
        "{error}"
    );
    assert!(matches!(
        error,
        LinkError::Refused {
            refusal: Refusal::NotCompensable(Kind::Backlash),
            ..
        }
    ));
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut effect = good;
        effect.gains[0] = wrong;
        assert!(matches!(
            line.request(set(&[effect]).remove(0)),
            Err(LinkError::Refused {
                refusal: Refusal::BadValue,
                ..
            })
        ));
    }
    assert_eq!(*line.port().device().state().settings(), before);
}

/// A motion from arming to its end, tick by tick.
fn run(line: &mut Line, trajectory: Trajectory<f32>, mut look: impl FnMut(&EmulatedRig)) {
    for body in [
        RequestBody::SetTrajectory(trajectory),
        RequestBody::Arm,
        RequestBody::Start,
    ] {
        line.request(body).unwrap();
    }
    while line.port().device().state().mode == Mode::Running {
        // Well within the rig's patience with a silent host.
        if line.port().device().state().tick.is_multiple_of(2000) {
            line.request(RequestBody::KeepAlive).unwrap();
        }
        let device = line.port_mut().device_mut();
        device.tick();
        look(device);
    }
    line.request(RequestBody::Disarm).unwrap();
}

/// Standard deviation of the torque that the current gives from the ordered one, N·m, in a motion whose current changes its sign
/// often.
fn torque_error(plant: &PlantConfig, seed: u64, effects: &[Effect<f32>]) -> f64 {
    let chirp = Chirp {
        start_hz: 4.0,
        end_hz: 8.0,
        sweep: Sweep::Linear,
        duration_us: 3_000_000,
        ramp_us: 500_000,
        amplitude: 0.1,
        velocity: 0.5,
        acceleration: 15.0,
        again: 0.0,
    };
    let per_ampere = f64::from(nameplate(plant).config.drive.joint_torque(1.0));
    let mut line = told(plant, seed);
    let run = driven(&mut line, set(effects), Trajectory::Chirp(chirp), 0.1);
    assert!(run.faults.is_empty(), "{:?}", run.faults);
    let n = run.rows.len() as f64;
    let errors = run
        .rows
        .iter()
        .map(|row| per_ampere * row.i1 - row.tau_cmd1);
    let mean = errors.clone().sum::<f64>() / n;
    (errors.map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Voltage that the half-bridges lose: the winding gives what it is told to as if nothing were lost. The tracking error is no
/// measure of it: the loss damps the small motions that friction makes, and without it they are larger.
#[test]
fn a_lost_voltage_is_made_up_for_once_it_is_named() {
    for seed in 1..=3 {
        let mut plant = PlantConfig::laboratory(seed);
        let lossless = torque_error(&plant, seed, &[]);
        plant.bridge.dead_time = Some(DeadTime {
            voltage: 0.8,
            fade_current: 0.05,
        });
        let before = torque_error(&plant, seed, &[]);
        let named = Effect::new(Kind::DriveDeadzone, &[0.8], &[]);
        let after = torque_error(&plant, seed, &[named]);
        println!(
            "seed {seed}, lost voltage: {before:.4} N·m without, {after:.4} with, {lossless:.4} where nothing is lost"
        );
        assert!(
            after - lossless < 0.2 * (before - lossless),
            "{before} to {after} N·m"
        );
    }
}

/// A compliant contact: friction builds up over a way, which the plant's four elements and the effect's divide alike.
#[test]
fn presliding_friction_is_built_up_once_it_is_named() {
    for seed in 1..=3 {
        let mut plant = PlantConfig::laboratory(seed);
        let ratio = plant.mechanism.ratio;
        let stroke = 0.03;
        plant.motor.friction.presliding.stroke = stroke * ratio;
        plant.mechanism.friction.presliding.stroke = stroke;
        let coulomb = plant.equivalent().coulomb as f32;
        let named = Effect::new(
            Kind::PreslidingMaxwell,
            &[0.25 * coulomb; 4],
            &[stroke as f32],
        );
        let [before, after] = tracking(&plant, seed, &[named]);
        println!("seed {seed}, presliding: {before:.3} mrad without, {after:.3} with");
        assert!(after < before, "{before} to {after} mrad");
    }
}

/// Cosine and sine of the drive's torque over the order of the motor's angle, N·m, while the link goes at `speed`.
fn in_the_drive(line: &mut Line, effects: &[Effect<f32>], speed: f32, order: f64) -> [f64; 2] {
    let span = 1.2;
    let sweep = FrictionSweep::new(&[speed], span, 0.15, 0.05, 1.0).unwrap();
    for body in set(effects) {
        line.request(body).unwrap();
    }
    let (mut sums, mut count) = ([0.0; 2], 0);
    run(line, Trajectory::FrictionSweep(sweep), |device| {
        let reference = f64::from(device.state().reference.velocity);
        if reference.abs() > 0.999 * f64::from(speed) {
            let truth = device.plant().truth();
            let (sine, cosine) = (order * truth.motor_position).sin_cos();
            sums[0] += truth.drive_torque * cosine;
            sums[1] += truth.drive_torque * sine;
            count += 1;
        }
    });
    sums.map(|sum| 2.0 * sum / f64::from(count))
}

/// The torque that the winding gives in the end, with current loop, sampling and delay, against the cogging that it is for.
#[test]
fn cogging_is_made_up_for_at_speed() {
    let mut plant = PlantConfig::laboratory(4);
    let order = 12.0;
    plant.motor.cogging = Some(Cogging {
        amplitude: 0.006,
        order,
        phase: 0.7,
    });
    let named = cogging_of(&plant);
    let wanted = [f64::from(named.gains[0]), f64::from(named.gains[1])];
    let mut line = told(&plant, 4);
    for speed in [0.5, 1.0, 2.0, 4.0, 5.9] {
        let without = in_the_drive(&mut line, &[], speed, order);
        let with = in_the_drive(&mut line, &[named], speed, order);
        let left = |found: [f64; 2]| {
            let length = |[x, y]: [f64; 2]| x.hypot(y);
            length([wanted[0] - found[0], wanted[1] - found[1]]) / length(wanted)
        };
        println!(
            "{speed} rad/s: {:.3} of the cogging is left without, {:.3} with",
            left(without),
            left(with)
        );
        assert!(left(with) < 0.25, "{speed} rad/s: {}", left(with));
    }
}
