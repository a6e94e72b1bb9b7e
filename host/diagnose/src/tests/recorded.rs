//! What recordings do that has nothing to do with the rig: other rates, uneven steps, a coarse encoder, a touch, a piece cut out.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::tests::made::Diagnosed as _;
use rand::{RngExt, SeedableRng};

use crate::acceptance::coordinates::SINCE_START;
use crate::outcome::{Before, Step, Verdict};
use crate::{Diagnosis, Options};
use rig_data::Block;
use rig_model::robot::Robot;
use rig_scenario::{Effect, Intrusion, Made, Noise, Scenario};
use rig_shared::effects::Kind;

const STRIBECK: Effect = Effect::Stribeck {
    ratio: 1.6,
    velocity: 0.1,
};

fn names(found: &Diagnosis) -> Vec<&str> {
    found.steps.iter().map(|s| s.effect.as_str()).collect()
}

fn diagnosed(made: &Made) -> (Diagnosis, Robot) {
    made.diagnosed(&made.robot, &Options::default())
}

/// Every column by itself.
fn each_column(block: &mut Block, change: impl Fn(&[f64]) -> Vec<f64>) {
    for joint in &mut block.joints {
        joint.q = change(&joint.q);
        joint.tau = change(&joint.tau);
        for column in [&mut joint.reference, &mut joint.voltage]
            .into_iter()
            .flatten()
        {
            *column = change(column);
        }
    }
    block.t = change(&block.t);
}

#[test]
fn a_hold_out_at_another_rate_is_judged_at_its_own() {
    let made = Scenario::short([STRIBECK], 31).make().unwrap();
    let (same, _) = diagnosed(&made);
    assert_eq!(names(&same), ["stribeck"], "{:?}", same.words);
    for slower in [2, 5] {
        let mut other = made.clone();
        each_column(&mut other.holdout.blocks[0], |column| {
            column.iter().copied().step_by(slower).collect()
        });
        let (found, _) = diagnosed(&other);
        let (w, all) = (&found.waterfall[0], &same.waterfall[0]);
        println!(
            "1/{slower}: {:?} over {:.4}; {:?} over {:.4}",
            w.holdout, w.holdout_floor, all.holdout, all.floor
        );
        assert_eq!(names(&found), ["stribeck"], "{:?}", found.words);
        assert_eq!(found.verdict, same.verdict, "{:?}", found.words);
        // One row in so many is as much noisier in its band.
        let louder = (slower as f64).sqrt();
        assert!((w.holdout_floor / w.floor - louder).abs() < 1e-3 * louder);
        assert!(w.holdout[2] < 1.3 * w.holdout_floor, "{w:?}");
        // What Stribeck friction adds to the noise is what it adds at the other rate.
        let added =
            |w: &crate::outcome::Waterfall| (w.holdout[1].powi(2) - w.holdout[2].powi(2)).sqrt();
        assert!(
            (added(w) / added(all) - 1.0).abs() < 0.15,
            "{} {}",
            added(w),
            added(all)
        );
        assert!(
            found
                .words
                .iter()
                .any(|word| word.contains("judged at its own rate"))
        );
    }
}

#[test]
fn rows_at_uneven_steps_are_interpolated_and_that_is_said() {
    let mut made = Scenario::short([STRIBECK], 32).make().unwrap();
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    let block = &mut made.train.blocks[0];
    // Rows that come early or late by up to 0.4 of a step, read when they came.
    let exact = block.t.clone();
    let step = exact[1] - exact[0];
    let last = exact.len() - 1;
    let moved: Vec<f64> = (exact.iter().enumerate())
        .map(|(k, t)| match k {
            0 => *t,
            _ if k == last => *t,
            _ => t + 0.8 * step * (rng.random::<f64>() - 0.5),
        })
        .collect();
    let read = |column: &[f64]| -> Vec<f64> {
        (moved.iter().enumerate())
            .map(|(k, t)| {
                let k = if *t < exact[k] { k - 1 } else { k }.min(last - 1);
                let u = (t - exact[k]) / step;
                column[k] + u * (column[k + 1] - column[k])
            })
            .collect()
    };
    each_column(block, read);
    let (found, _) = diagnosed(&made);
    assert!(found.data_faults.is_empty(), "{:?}", found.data_faults);
    assert_eq!(names(&found), ["stribeck"], "{:?}", found.words);
    let said: Vec<&String> = (found.words.iter())
        .filter(|w| w.contains("interpolated"))
        .collect();
    assert!(said.len() == 1 && said[0].starts_with("train"), "{said:?}");
}

#[test]
fn what_the_steps_of_a_coarse_encoder_leave_is_no_remainder() {
    let coarse = |hidden: Option<Effect>, seed| {
        let scenario = Scenario {
            noise: Noise {
                // 10 000 a turn of the joint.
                counts: 200.0,
                ..Noise::MEDIUM
            },
            ..Scenario::short(hidden, seed)
        };
        diagnosed(&scenario.make().unwrap()).0
    };
    for seed in 33..36 {
        let found = coarse(None, seed);
        println!(
            "{:?} over {:.4}",
            found.waterfall[0].holdout, found.noise_floor_rms[0]
        );
        assert_eq!(names(&found), [""; 0]);
        assert_ne!(found.verdict, Verdict::Remainder, "{:?}", found.remainder);
    }
    let strong = Effect::Stribeck {
        ratio: 2.2,
        velocity: 0.3,
    };
    let found = coarse(Some(strong), 36);
    assert_eq!(names(&found), ["stribeck"], "{:?}", found.words);
}

/// Above 0.75 rad/s half a wave passes between two samples: what they make of it there bent the amplitude by an eighth.
#[test]
fn a_wave_that_outruns_the_samples_keeps_its_amplitude() {
    let hidden = Effect::Cogging {
        amplitude: 0.21,
        order: 84.0,
        phase: 2.8,
    };
    let made = Scenario::short([hidden], 2800).make().unwrap();
    let (found, _) = diagnosed(&made);
    assert_eq!(names(&found), ["cogging"], "{:?}", found.words);
    let part = |name: &str| found.steps[0].parameters[name].value;
    let amplitude = part("cosine").hypot(part("sine"));
    println!("{amplitude}");
    assert!((amplitude / 0.21 - 1.0).abs() < 0.05, "{amplitude}");
}

#[test]
fn a_touch_in_one_of_two_runs_is_left_out_and_said() {
    let touched = Scenario {
        intrusion: Some(Intrusion {
            torque: 6.0,
            interval: [12.0, 12.6],
        }),
        ..Scenario::short([STRIBECK], 37)
    };
    let calm = Scenario {
        intrusion: None,
        ..touched.clone()
    };
    let [found, same] = [&touched, &calm].map(|s| diagnosed(&s.make().unwrap()).0);
    println!("{:?}", found.words);
    assert_eq!(names(&found), ["stribeck"]);
    assert_eq!(found.verdict, same.verdict);
    let [floor, without] = [&found, &same].map(|d| d.noise_floor_rms[0]);
    assert!((floor / without - 1.0).abs() < 0.05, "{floor} {without}");
    let said = |d: &Diagnosis| {
        d.words
            .iter()
            .filter(|w| w.contains("touched the joint"))
            .count()
    };
    assert_eq!([said(&found), said(&same)], [1, 0]);
    let word = found
        .words
        .iter()
        .find(|w| w.contains("touched the joint"))
        .unwrap();
    assert!(
        word.contains("train differs from repeat") && word.contains(": from 1"),
        "{word}"
    );
}

#[test]
fn a_constant_that_changes_between_two_runs_is_said_and_is_no_noise() {
    let mut made = Scenario::short([], 39).make().unwrap();
    let (same, _) = diagnosed(&made);
    assert_eq!(same.verdict, Verdict::NothingMissing, "{:?}", same.words);
    let repeat = made.repeat.as_mut().unwrap();
    for tau in repeat.blocks.iter_mut().flat_map(|b| &mut b.joints[0].tau) {
        *tau += 0.1;
    }
    let (found, _) = diagnosed(&made);
    assert!(names(&found).is_empty(), "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::Remainder, "{:?}", found.words);
    let left = found.remainder.unwrap();
    println!("{left:?}");
    assert!((left.rms / 0.05 - 1.0).abs() < 0.1, "{left:?}");
    assert!(
        left.text
            .contains("more are left on average in repeat than in train")
    );
}

/// A quarter of the emulated rig's friction is the link's, and its gear carries that as well. Without it a twelfth of the noise and
/// more stayed, beside the right name.
#[test]
fn a_gear_carries_the_links_friction_beside_its_load() {
    let made = Scenario::short([Effect::LoadFriction { ratio: 0.14 }], 42)
        .make()
        .unwrap();
    let (found, _) = diagnosed(&made);
    assert_eq!(names(&found), ["load_friction"], "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.words);
    let parameters = &found.steps[0].parameters;
    let [coefficient, share] = ["coefficient", "link_friction"].map(|name| parameters[name].value);
    assert!((coefficient / 0.14 - 1.0).abs() < 0.03, "{coefficient}");
    assert!((share - 0.25).abs() < 0.05, "{share}");
}

/// Over a motion both are one constant; friction under load is carried by the one and not by the other.
#[test]
fn friction_under_load_tells_a_constant_on_the_link_from_one_of_the_sensor() {
    let load = Effect::LoadFriction { ratio: 0.14 };
    let sides = [
        (Effect::TorqueOffset { torque: 0.3 }, true),
        (Effect::CurrentOffset { current: 0.12 }, false),
    ];
    for (constant, acts_on_link) in sides {
        let made = Scenario::short([constant, load], 43).make().unwrap();
        let (found, _) = diagnosed(&made);
        assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.words);
        let mut steps = found.steps.iter();
        let constant = steps.find(|s| s.effect != "load_friction").unwrap();
        let side = |name: &str| match name {
            "torque_offset" => Some(true),
            "current_offset" | "asymmetric_coulomb" => Some(false),
            _ => None,
        };
        assert_eq!(
            side(&constant.effect),
            Some(acts_on_link),
            "{:?}",
            found.words
        );
        let mut sides = constant.set.iter().filter_map(|name| side(name));
        assert!(sides.all(|side| side == acts_on_link), "{:?}", constant.set);
        assert_eq!(found.steps.len(), 2, "{:?}", found.words);
    }
}

/// Over most motions a constant and a tilt are nearly one function: what the second takes off beside the first is little, and no model
/// without it would leave that.
#[test]
fn a_constant_and_a_tilt_together_are_both_named() {
    let hidden = [
        Effect::AsymmetricCoulomb { difference: -0.12 },
        Effect::GravityTilt { angle: 0.04 },
    ];
    let made = Scenario::short(hidden, 44).make().unwrap();
    let (found, _) = diagnosed(&made);
    assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.words);
    assert_eq!(names(&found).len(), 2, "{:?}", found.words);
    for hidden in hidden {
        let named = |step: &Step| step.set.iter().any(|name| name == hidden.name());
        assert!(found.steps.iter().any(named), "{:?}", found.words);
    }
}

/// A payload changes gravity as a spring would; inertia says which of them it is.
#[test]
fn a_constant_beside_a_payload_is_no_spring() {
    let hidden = [
        Effect::TorqueOffset { torque: -0.11 },
        Effect::Payload {
            mass: 0.2,
            distance: 0.33,
        },
    ];
    let made = Scenario::short(hidden, 45).make().unwrap();
    let (found, _) = diagnosed(&made);
    let named = names(&found);
    assert!(named.contains(&"payload"), "{named:?}");
    assert!(!named.contains(&"spring") && named.len() == 2, "{named:?}");
}

/// The heat of friction warms the emulated rig, so that another motion warms it otherwise: by the time alone the data held back are
/// explained worse than without any warming.
#[test]
fn friction_that_its_own_heat_warms_goes_by_that_and_not_by_the_time() {
    let warming = Effect::ViscousWarmup {
        fall: 0.56,
        time_constant: 15.8,
    };
    let made = Scenario {
        seconds: [90.0, 60.0],
        ..Scenario::short([warming], 4000)
    }
    .make()
    .unwrap();
    let (found, _) = diagnosed(&made);
    assert_eq!(names(&found), ["viscous_warmup"], "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.words);
    let step = &found.steps[0];
    assert_eq!(step.law.as_deref(), Some("heat"));
    let time_constant = step.parameters["time_constant"].value;
    assert!((time_constant / 15.8 - 1.0).abs() < 0.3, "{time_constant}");
}

/// Friction that falls has no mean of its own over both directions: by direction it is most of what is left.
#[test]
fn friction_that_drifts_is_said_to_go_with_time_before_all_else() {
    let warming = Effect::ViscousWarmup {
        fall: 0.5,
        time_constant: 15.0,
    };
    let made = Scenario {
        seconds: [60.0, 20.0],
        ..Scenario::short([warming], 41)
    }
    .make()
    .unwrap();
    let options = Options {
        without: vec![
            Kind::ViscousWarmupTime,
            Kind::ViscousWarmupTemperature,
            Kind::ViscousWarmupHeat,
            Kind::Backlash,
            Kind::JointElasticity,
        ],
        ..Options::default()
    };
    let (found, _) = made.diagnosed(&made.robot, &options);
    for place in &found.places {
        println!("{place:?}");
    }
    assert_eq!(found.places[0].coordinate, SINCE_START);
    assert!(found.places[0].share > 0.3, "{:?}", found.places[0]);
}

#[test]
fn a_piece_cut_out_of_a_recording_is_a_copy() {
    let made = Scenario::short([], 38).make().unwrap();
    let cut = |from: usize, to: usize, every: usize, late: f64| {
        let mut cut = made.clone();
        cut.holdout = made.train.clone();
        cut.holdout.label = "cut".into();
        each_column(&mut cut.holdout.blocks[0], |column| {
            (column[from..to].iter().step_by(every).copied()).collect()
        });
        for t in &mut cut.holdout.blocks[0].t {
            *t += late;
        }
        cut.with_recordings(|training, held| {
            crate::diagnose(
                &made.robot,
                training,
                held,
                &Options::default(),
                &mut |_| (),
            )
        })
    };
    let rows = made.train.blocks[0].t.len();
    for (from, to, every, late) in [
        (100, rows, 1, 0.0),
        (rows / 3, rows / 2, 1, 0.0),
        (0, rows - 500, 1, 7.5),
        // Every n-th sample, whichever is the first.
        (0, rows, 5, 0.0),
        (rows / 3 + 1, rows, 4, 7.5),
    ] {
        let said = cut(from, to, every, late).unwrap_err().to_string();
        assert!(said.contains("cut holds samples of train"), "{said}");
    }
    made.diagnosed(&made.robot, &Options::default());
}

/// A link twice as heavy as described is no torque constant of twice the value: friction is as it was.
#[test]
fn one_factor_is_said_only_where_all_follow_it() {
    let made = Scenario::short([], 39).make().unwrap();
    let said = |robot: &Robot| {
        let (found, _) = made.diagnosed(robot, &Options::default());
        assert_eq!(found.verdict, Verdict::ParameterChange, "{:?}", found.words);
        // Against the description, as no effect could have bent a parameter.
        assert_eq!(found.absorbed_before, Before::Described);
        let most = &found.absorbed[0];
        assert!(most.sigmas > 10.0, "{most:?}");
        assert!((most.before / most.after - 1.0).abs() > 0.1, "{most:?}");
        let words = found.words.join(" ");
        println!("{words}");
        words
    };
    let mut heavy = made.robot.clone();
    let body = heavy.joints[0].inertial.as_mut().unwrap();
    body.mass *= 2.0;
    for own in body.inertia.iter_mut().chain(&mut body.first_moment) {
        *own *= 2.0;
    }
    if let Some(drive) = &mut heavy.joints[0].drive {
        drive.rotor_inertia *= 2.0;
    }
    assert!(!said(&heavy).contains("have changed by"));
}

/// An incremental encoder is told its zero by eye: the recording that got another one is named, and by how much.
#[test]
fn a_recording_with_another_zero_is_named() {
    let made = Scenario::short([], 40).make().unwrap();
    let word = |made: &Made| -> Option<String> {
        let (found, _) = diagnosed(made);
        (found.words.into_iter()).find(|word| word.contains("seems to stand"))
    };
    assert_eq!(word(&made), None);
    let moved = |block: &mut Block, by: f64| {
        let joint = &mut block.joints[0];
        let reference = joint.reference.as_mut().unwrap();
        joint.q.iter_mut().chain(reference).for_each(|q| *q += by);
    };
    // Another motion to learn from, and the one held back.
    let mut other = made.clone();
    other.further = vec![Scenario::short([], 40).make().unwrap().holdout];
    other.further[0].label = "slow".into();
    other.holdout = Scenario {
        seconds: [25.0, 5.0],
        ..Scenario::short([], 40)
    }
    .make()
    .unwrap()
    .train;
    other.holdout.label = "held".into();
    other.repeat = None;
    moved(&mut other.further[0].blocks[0], 0.08);
    let told = word(&other).unwrap();
    println!("{told}");
    assert!(
        told.starts_with("In slow joint link seems to stand −0.08"),
        "{told}"
    );
    let held = |by: f64| {
        let mut held = made.clone();
        moved(&mut held.holdout.blocks[0], by);
        held
    };
    let told = word(&held(0.1)).unwrap();
    println!("{told}");
    assert!(
        told.starts_with("In holdout joint link seems to stand −0.1"),
        "{told}"
    );
    // A quarter turn is no zero that was read by eye.
    let (found, _) = diagnosed(&held(1.6));
    let [fault] = &found.data_faults[..] else {
        panic!("{:?}", found.data_faults)
    };
    println!("{}", fault.text);
    assert_eq!(fault.kind.as_str(), "gravity");
    assert!(fault.recording == "holdout" && fault.text.contains("turned by about"));
}
