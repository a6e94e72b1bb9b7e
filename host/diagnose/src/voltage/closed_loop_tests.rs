#![allow(clippy::unwrap_used, clippy::panic)]
//! Controllers from recordings of a servo by another simulator, and predictions with them.

use std::path::Path;

use crate::voltage::driven::{VoltageModel, reference_of};
use crate::voltage::plant::Plant;
use crate::voltage::reading::logs;
use crate::voltage::servo::Servo;
use crate::voltage::tests::{found, list, robot};
use crate::voltage::validation::validate_voltage;
use crate::voltage::*;
use crate::{Diagnosis, Options};
use rig_data::prepare::InMemory;
use rig_model::robot::{AntiWindup, Robot, VoltageController};

fn law(servo: &Servo, number: usize) -> VoltageController {
    let run = servo.recorded(number, 0.0);
    logs(&[&run]).unwrap()[0].law.unwrap()
}

/// Returns a recording that its controller does not explain; its voltage drives it.
fn open(mut run: InMemory) -> InMemory {
    run.blocks[0].joints[0].reference = None;
    run
}

#[test]
fn a_proportional_controller_has_no_other_terms() {
    let found = law(&Servo::default(), 1);
    println!("{found:?}");
    assert!((found.proportional - 4.0).abs() < 0.04, "{found:?}");
    let others = [
        found.integral,
        found.derivative,
        found.velocity_feedforward,
        found.acceleration_feedforward,
    ];
    assert_eq!(others, [0.0; 4]);
}

#[test]
fn the_terms_of_a_pid_controller_with_feed_forward_are_recovered() {
    for limit in [1.0, 0.45] {
        let gains = [4.0, 8.0, 0.16, 0.2, 0.012];
        let servo = Servo {
            gains,
            limit,
            ..Servo::default()
        };
        for number in [1, 2, 3] {
            let c = law(&servo, number);
            println!("{limit} {number} {c:?}");
            let read = [
                c.proportional,
                c.integral,
                c.derivative,
                c.velocity_feedforward,
                c.acceleration_feedforward,
            ];
            // The derivative's filter of 10 ms adds to the acceleration.
            for ((read, gain), share) in read.iter().zip(gains).zip([0.02, 0.05, 0.05, 0.05, 0.15])
            {
                assert!(
                    (read - gain).abs() < share * gain,
                    "{read} for {gain}: {c:?}"
                );
            }
        }
    }
}

#[test]
fn a_pi_controller_at_its_limit_clamps_its_integral() {
    let servo = Servo {
        gains: [4.0, 8.0, 0.0, 0.0, 0.0],
        limit: 0.5,
        ..Servo::default()
    };
    let found = law(&servo, 2);
    println!("{found:?}");
    assert_eq!(found.anti_windup, AntiWindup::Clamping);
    assert!((found.limit.unwrap() - 0.5).abs() < 1e-6, "{found:?}");
    assert!((found.integral - 8.0).abs() < 0.8, "{found:?}");
}

#[test]
fn a_share_that_stays_where_it_is_largest_is_no_limit() {
    let servo = Servo::default();
    let largest = |run: &InMemory| {
        let block = &run.blocks[0];
        let volts = block.joints[0].voltage.as_ref().unwrap();
        let share = volts
            .iter()
            .zip(&block.extra[0].1)
            .map(|(u, supply)| (u / supply).abs());
        share.fold(0.0, f64::max)
    };
    let run = servo.recorded(0, 0.0);
    assert!(largest(&run) < 0.9);
    assert_eq!(law(&servo, 0).limit, Some(1.0));
}

/// Trains on two gains and judges at one between them: the diagnosis, the model, and hold-out RMS model by model.
fn between_two_gains(with: impl Fn(f64) -> Servo) -> (Diagnosis, Robot, Vec<f64>) {
    let train: Vec<InMemory> = [2.0, 5.0]
        .into_iter()
        .flat_map(|kp| [0, 1, 2].map(|k| with(kp).recorded(k, 0.0)))
        .collect();
    let held = [1, 3].map(|k| with(3.2).recorded(k, 0.0));
    let (diagnosis, model) = found(&list(&train), &list(&held));
    println!("{:?}\n{:?}", diagnosis.words, diagnosis.waterfall);
    let rms = diagnosis.waterfall[0].holdout.clone();
    (diagnosis, model, rms)
}

/// Step of the encoder, rad; the references travel over more than a radian.
const STEP: f64 = std::f64::consts::TAU / 4096.0;

#[test]
fn a_motion_under_a_gain_never_seen_is_predicted() {
    let (diagnosis, model, rms) = between_two_gains(|kp| Servo {
        gains: [kp, 0.0, 0.0, 0.0, 0.0],
        ..Servo::default()
    });
    assert!(diagnosis.steps.is_empty(), "{:?}", diagnosis.steps);
    // An encoder causes an error of 0.29 steps for any prediction.
    assert!(rms[0] < 0.4 * STEP, "{rms:?}");
    let (truth, joint) = (Servo::default(), &model.joints[0]);
    let (drive, friction) = (
        joint.drive.as_ref().unwrap(),
        joint.friction.as_ref().unwrap(),
    );
    let emf = drive.torque_constant * drive.gear_ratio;
    let link = joint.inertial.as_ref().unwrap().inertia[5];
    for (found, truth) in [
        (emf, truth.emf),
        (emf / drive.resistance.unwrap(), truth.gain),
        (link + drive.joint_inertia, truth.inertia),
        (friction.coulomb, truth.coulomb),
    ] {
        assert!((found - truth).abs() < 0.02 * truth, "{found} for {truth}");
    }
    // The supply is a line.
    let controller = joint.voltage_controller.unwrap();
    assert!((controller.supply[0] - 7.4).abs() < 0.02, "{controller:?}");
    assert!((controller.supply[1] + 0.3).abs() < 0.05, "{controller:?}");
}

#[test]
fn so_it_is_under_a_pid_controller_with_feed_forward() {
    let (_, _, rms) = between_two_gains(|kp| Servo {
        gains: [kp, 1.5 * kp, 0.03 * kp, 0.04 * kp, 0.0],
        ..Servo::default()
    });
    // The servo's derivative filter, which the model lacks, adds a little.
    assert!(rms.iter().all(|rms| *rms < 0.6 * STEP), "{rms:?}");
    // An effect that compensates it is negligible.
    assert!(rms[0] - rms[rms.len() - 1] < 0.1 * STEP, "{rms:?}");
}

#[test]
fn a_model_is_read_back_and_validates_as_it_was_diagnosed() {
    let servo = Servo {
        gains: [4.0, 6.0, 0.0, 0.0, 0.0],
        ..Servo::default()
    };
    let train = [0, 1, 2, 3].map(|k| servo.recorded(k, 0.0));
    let held = [servo.recorded(4, 0.0)];
    let (diagnosis, model) = found(&list(&train), &list(&held));
    let text = model.to_toml().unwrap();
    let again = Robot::from_toml(&text, Path::new("model.toml")).unwrap();
    assert_eq!(again, model);
    let validation = validate_voltage(&again, &list(&held)).unwrap();
    let rms = validation.motion.rms().unwrap();
    let last = *diagnosis.waterfall[0].holdout.last().unwrap();
    println!("{rms} {last}");
    // The recordings at hand determine the steps of the simulation.
    assert!((rms - last).abs() < 0.1 * last, "{rms} {last}");
}

#[test]
fn a_simulation_of_the_model_reproduces_the_recording() {
    let servo = Servo {
        gains: [4.0, 6.0, 0.0, 0.05, 0.0],
        ..Servo::default()
    };
    let train = [0, 1, 2, 3].map(|k| servo.recorded(k, 0.0));
    let (_, model) = found(&list(&train), &[]);
    let run = servo.recorded(4, 0.0);
    let reference = reference_of(&run).unwrap().unwrap();
    let states = VoltageModel::of(&model)
        .unwrap()
        .replay("horn", &reference)
        .unwrap();
    let joint = &run.blocks[0].joints[0];
    let errors: Vec<f64> = (states.iter().zip(&joint.q))
        .map(|(s, q)| s.position - q)
        .collect();
    let rms = FreeRun::followed(&errors).rms().unwrap();
    println!("{rms}");
    assert!(rms < 5.0e-3, "{rms}");
    let volts = joint.voltage.as_ref().unwrap();
    let off: Vec<f64> = (states.iter().zip(volts))
        .map(|(s, u)| s.voltage - u)
        .collect();
    assert!(FreeRun::followed(&off).rms().unwrap() < 0.2);
}

/// A pendulum that its controller holds upright falls under the recorded voltage with any model.
#[test]
fn a_free_run_that_diverges_is_said_to_and_has_no_residual() {
    let servo = Servo {
        gains: [8.0, 0.0, 0.1, 0.0, 0.0],
        ..Servo::default()
    };
    let up = std::f64::consts::PI;
    let runs = [0, 1, 2].map(|k| open(servo.recorded(k, up)));
    let (diagnosis, model) = found(&list(&runs[..2]), &list(&runs[2..]));
    println!("{:?}\n{:?}", diagnosis.words, diagnosis.remainder);
    let left = diagnosis.remainder.unwrap();
    assert!(left.ratio.is_nan() && left.rms.is_nan());
    assert!(
        left.text.contains("The free run diverges in motion 2 at "),
        "{}",
        left.text
    );
    assert!(
        diagnosis.waterfall[0]
            .holdout
            .iter()
            .all(|rms| rms.is_nan() || *rms < 1.0)
    );
    let checked = validate_voltage(&model, &list(&runs[2..])).unwrap();
    assert!(
        matches!(checked.motion, FreeRun::Diverged { .. }),
        "{:?}",
        checked.motion
    );
    assert!(
        checked.warnings[0].contains("diverges"),
        "{:?}",
        checked.warnings
    );
}

#[test]
fn a_start_on_short_pieces_stands_a_coarse_encoder() {
    let servo = Servo {
        counts: 512.0,
        gains: [3.0, 0.0, 0.0, 0.0, 0.0],
        ..Servo::default()
    };
    let runs = [0, 1, 2, 3].map(|k| servo.recorded(k, 0.0));
    let plant = Plant::of(&robot()).unwrap();
    let found = start::start(&plant, &logs(&list(&runs)).unwrap(), false).unwrap();
    println!("{found:?}");
    let truth = [
        servo.inertia - plant.inertia,
        servo.gain,
        servo.emf,
        servo.coulomb,
    ];
    for (found, truth) in found.iter().zip(truth) {
        assert!((found - truth).abs() < 0.05 * truth, "{found} for {truth}");
    }
}

#[test]
fn no_unknown_of_the_start_is_negative() {
    // A described link heavier than the true one would make the drive's inertia negative.
    let mut heavy = robot();
    heavy.joints[0].inertial.as_mut().unwrap().inertia[5] = 0.02;
    let runs = [0, 1, 2].map(|k| Servo::default().recorded(k, 0.0));
    let (_, model) =
        diagnose_voltage(&heavy, &list(&runs), &[], &Options::default(), &mut |_| ()).unwrap();
    let drive = model.joints[0].drive.as_ref().unwrap();
    assert!(
        drive.rotor_inertia >= 0.0 && drive.joint_inertia >= 0.0,
        "{drive:?}"
    );
}
