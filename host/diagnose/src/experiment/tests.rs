#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use nalgebra::DVector;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rig_shared::effects::{Effect, Kind};
use rig_shared::safety::Limits;
use rig_shared::trajectory::Trajectory;

use crate::experiment::choice::{DECIDES, best, closest, rate};
use crate::experiment::criterion::{Course, access};
use crate::experiment::place::Place;
use crate::experiment::primitives::of_family;
use crate::experiment::proposal::file_of;
use crate::experiment::*;
use rig_excite::{COASTING, TrajectoryFile};
use rig_model::robot::{EMPS, ONE_LINK_TEMPLATE, Robot, template};

fn robot() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// Approximate values of the template.
const NOMINAL: Nominal = [0.17, 2.94, 0.0, 0.3, 0.4, 0.0];

fn effect(kind: Kind, gains: &[f64], shapes: &[f64]) -> (Effect<f64>, Nominal) {
    (Effect::new(kind, gains, shapes), NOMINAL)
}

fn middle_of_range(kind: Kind) -> (Effect<f64>, Nominal) {
    let of = |list: &[rig_shared::effects::Parameter]| -> Vec<f64> {
        list.iter()
            .map(|p| (p.range[0] * p.range[1]).abs().sqrt())
            .collect()
    };
    let about = kind.about();
    effect(kind, &of(about.gains), &of(about.shapes))
}

fn within_limits(robot: &Robot, file: &TrajectoryFile) {
    for (joint, own) in robot.joints.iter().zip(&file.joints) {
        let limits = joint.limits.as_ref().unwrap();
        let limits = Limits {
            position_low: limits.position[0],
            position_high: limits.position[1],
            velocity: limits.velocity,
            acceleration: limits.acceleration.unwrap_or(f64::MAX),
            ..Limits::default()
        };
        own.trajectory
            .to_f32()
            .to_f64()
            .check(&limits, own.start)
            .unwrap();
    }
}

#[test]
fn what_is_found_for_stribeck_against_presliding_separates_them_as_predicted() {
    let robot = robot();
    let rivals = [
        effect(Kind::Stribeck, &[0.25], &[0.05]),
        effect(Kind::PreslidingDahl, &[0.4], &[0.01]),
    ];
    // Noise for a moderate distance, in which the rival's freedom shows.
    let floor = 0.5;
    let place = Place::of(&robot, 0, NOMINAL, Held::default())
        .unwrap()
        .unwrap();
    let (primitive, predicted) = best(&place, &rivals, floor).unwrap();
    println!(
        "{:?} {:?}: {predicted:.2}",
        primitive.family, primitive.figures
    );
    let course = Course::of(&place, &primitive);
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let mut least = f64::INFINITY;
    for (truth, other) in [(0, 1), (1, 0)] {
        let (truth, other) = (&rivals[truth].0, &rivals[other].0);
        let (standard, own) = access::rows(&course, truth, &NOMINAL, true);
        let nominal = DVector::from_fn(standard.ncols(), |c, _| 0.3 + 0.1 * c as f64);
        let clean = &standard * nominal + own * DVector::from_column_slice(&truth.gains[..1]);
        // One row represents `weight` independent values.
        let weight = primitive.trajectory.duration() * FLOOR_RATE
            / (primitive.trajectory.duration() * FLOOR_RATE)
                .ceil()
                .min(4000.0);
        let sigma = floor / weight.sqrt();
        let mut gain = 0.0;
        const RUNS: usize = 40;
        for _ in 0..RUNS {
            let noise = DVector::from_fn(clean.len(), |_, _| {
                let unit: f64 = StandardNormal.sample(&mut random);
                sigma * unit
            });
            let y = &clean + noise;
            let wrong = access::best(&course, other, &NOMINAL, true, &y);
            let right = access::best(&course, truth, &NOMINAL, true, &y);
            gain += (wrong - right) / (sigma * sigma) / RUNS as f64;
        }
        println!(
            "{:?}: gain {gain:.2}, {:.2} standard deviations",
            truth.kind,
            gain.sqrt()
        );
        least = least.min(gain.max(0.0).sqrt());
    }
    assert!(
        (least / predicted - 1.0).abs() < 0.2,
        "{least} against {predicted}"
    );
    assert!(predicted > DECIDES);
}

#[test]
fn the_choice_beats_the_other_motions_and_fits_the_limits_and_the_rig() {
    let robot = robot();
    let rivals = [
        effect(Kind::Stribeck, &[0.25], &[0.05]),
        effect(Kind::PreslidingDahl, &[0.4], &[0.01]),
    ];
    let began = std::time::Instant::now();
    let found = next(&robot, 0, &rivals, Held::default(), 0.05)
        .unwrap()
        .unwrap();
    println!("{:?}: {}", began.elapsed(), found.experiment.text);
    let file = found.trajectory.unwrap();
    within_limits(&robot, &file);
    let text = file.to_toml(&robot);
    assert_eq!(
        TrajectoryFile::from_toml(&text, Path::new(FILE)).unwrap(),
        file
    );
    assert_eq!(found.experiment.separates, ["stribeck", "presliding"]);
    let apart = found.experiment.separation.unwrap();
    let chosen = apart / found.experiment.duration.unwrap().sqrt();
    let place = Place::of(&robot, 0, NOMINAL, Held::default())
        .unwrap()
        .unwrap();
    let mut least = f64::INFINITY;
    for family in Family::MOVING {
        for primitive in of_family(&place, family, Hands::None) {
            let other = closest(&Course::of(&place, &primitive), &rivals, true, 0.05);
            let other = (primitive, other);
            assert!(rate(&other) <= chosen * (1.0 + 1e-9), "{family:?}");
            least = least.min(rate(&other));
        }
    }
    println!("{chosen:.3} a root second, the worst motion {least:.3}");
    assert!(least < 0.3 * chosen);
}

#[test]
fn motions_of_every_family_respect_limits_and_torque() {
    for name in ["one-link", "emps", "edda", "irp6"] {
        let robot = Robot::from_toml(template(name).unwrap(), Path::new(name)).unwrap();
        let mut count = 0;
        for joint in 0..robot.joints.len() {
            let nominal = if name == "one-link" {
                NOMINAL
            } else {
                [0.0; 6]
            };
            let place = Place::of(&robot, joint, nominal, Held::default())
                .unwrap()
                .unwrap();
            for family in Family::MOVING {
                for primitive in of_family(&place, family, Hands::None) {
                    within_limits(&robot, &file_of(&robot, joint, &place.stand, &primitive));
                    count += 1;
                }
            }
        }
        println!("{name}: {count} motions");
        assert!(count > 10 * robot.joints.len());
    }
    // A link too heavy for its motor gets no motion.
    let mut weak = robot();
    weak.joints[0].limits.as_mut().unwrap().torque = Some(0.5);
    let place = Place::of(&weak, 0, NOMINAL, Held::default())
        .unwrap()
        .unwrap();
    assert!(
        Family::MOVING
            .iter()
            .all(|f| of_family(&place, *f, Hands::None).is_empty())
    );
}

#[test]
fn hands_are_asked_for_only_where_no_motion_decides() {
    let rivals = [
        effect(Kind::LoadFriction, &[0.1], &[]),
        effect(Kind::Cogging, &[0.1, 0.0], &[12.0]),
    ];
    let easy = next(&robot(), 0, &rivals, Held::default(), 0.05)
        .unwrap()
        .unwrap();
    println!("{} {}", easy.experiment.kind, easy.experiment.text);
    assert!(!easy.experiment.kind.to_string().contains("payload"));
    // With noise above every motion's separation, a payload decides.
    let rivals = [
        effect(Kind::Cogging, &[0.02, 0.0], &[12.0]),
        effect(Kind::TorqueRipple, &[0.007, 0.0], &[12.0]),
    ];
    let found = next(&robot(), 0, &rivals, Held::default(), 5.0)
        .unwrap()
        .unwrap();
    println!("{} {}", found.experiment.kind, found.experiment.text);
    assert!(found.experiment.kind.to_string().contains("payload-swap"));
}

#[test]
fn every_confused_pair_of_the_registry_has_an_answer() {
    let robot = robot();
    let began = std::time::Instant::now();
    let mut seen: Vec<[&str; 2]> = Vec::new();
    for kind in Kind::ALL {
        let about = kind.about();
        for confusion in about.confused {
            let other = Kind::from_name(confusion.with, None)
                .unwrap_or_else(|| panic!("{}", confusion.with));
            let mut pair = [about.name, confusion.with];
            pair.sort_unstable();
            if seen.contains(&pair) {
                continue;
            }
            seen.push(pair);
            let rivals = [middle_of_range(*kind), middle_of_range(other)];
            let found = next(&robot, 0, &rivals, Held::default(), 0.05)
                .unwrap()
                .unwrap();
            let e = &found.experiment;
            println!(
                "{} / {}: {} {:?} {:?} s: {}",
                pair[0], pair[1], e.kind, e.separation, e.duration, e.text
            );
            assert!(e.text.len() > 40 && !e.text.contains('{'));
            assert_eq!(e.file.is_some(), found.trajectory.is_some());
            if confusion.exact {
                // No motion is promised to separate them.
                assert_eq!(e.separation, None);
            }
            if let Some(file) = &found.trajectory {
                within_limits(&robot, file);
            }
        }
    }
    println!("{} pairs in {:?}", seen.len(), began.elapsed());
    assert!(seen.len() > 15);
}

#[test]
fn exact_pairs_ask_for_another_channel_or_another_load() {
    let robot = robot();
    let pair = |a: Kind, b: Kind| {
        next(
            &robot,
            0,
            &[middle_of_range(a), middle_of_range(b)],
            Held::default(),
            0.05,
        )
        .unwrap()
        .unwrap()
    };
    let off = pair(Kind::CurrentOffset, Kind::AsymmetricCoulomb);
    assert_eq!(off.experiment.kind.to_string(), "drive-off-log");
    assert!(off.experiment.text.contains("i1") && off.trajectory.is_none());
    let taken = pair(Kind::TorqueOffset, Kind::AsymmetricCoulomb);
    assert_eq!(taken.experiment.kind, ExperimentKind::PullsOff);
    // Torque along a motion does not separate them either.
    let place = Place::of(&robot, 0, NOMINAL, Held::default())
        .unwrap()
        .unwrap();
    let rivals = [
        effect(Kind::TorqueOffset, &[0.2], &[]),
        effect(Kind::AsymmetricCoulomb, &[0.2], &[]),
    ];
    assert!(best(&place, &rivals, 0.05).is_none_or(|(_, apart)| apart < 1e-3));
}

/// One experiment for all names: a motion separates a third effect from collinear partners, with the partners' remedy.
#[test]
fn exact_partners_and_what_a_motion_tells_from_them_share_an_experiment() {
    let constants = [
        effect(Kind::AsymmetricCoulomb, &[0.2], &[]),
        effect(Kind::TorqueOffset, &[0.2], &[]),
    ];
    let with = |third| {
        next(
            &robot(),
            0,
            &[constants[0], constants[1], third],
            Held::default(),
            0.05,
        )
        .unwrap()
        .unwrap()
    };
    let found = with(effect(Kind::Spring, &[0.5, 0.2], &[]));
    let e = &found.experiment;
    println!("{} {:?}: {}", e.kind, e.separation, e.text);
    assert_eq!((e.kind, e.hands), (ExperimentKind::PullsOff, true));
    assert!(e.separation.unwrap() > DECIDES && found.trajectory.is_some());
    assert!(e.text.contains("--pulls-off"), "{}", e.text);
    // What the rig can do alone comes first.
    let found = with(effect(Kind::CurrentOffset, &[0.2], &[]));
    assert_eq!(found.experiment.kind, ExperimentKind::DriveOffLog);
    assert!(!found.experiment.hands);
}

/// If nothing decides, the remedy is for the closest pair, for any order of the rivals.
#[test]
fn what_is_looked_up_is_the_closest_pair() {
    let rivals = [
        effect(Kind::Stribeck, &[2.0], &[0.05]),
        effect(Kind::LoadFriction, &[0.3], &[]),
        effect(Kind::ViscousWarmupTime, &[0.02], &[300.0]),
    ];
    let asked = |order: [usize; 3]| {
        let list = order.map(|k| rivals[k]);
        next(&robot(), 0, &list, Held::default(), 1e3)
            .unwrap()
            .unwrap()
            .experiment
    };
    let first = asked([0, 1, 2]);
    for order in [[1, 0, 2], [2, 1, 0], [0, 2, 1]] {
        assert_eq!(asked(order).text, first.text);
    }
}

#[test]
fn one_effect_needs_no_experiment_and_a_slide_without_values_has_one() {
    assert_eq!(
        next(
            &robot(),
            0,
            &[middle_of_range(Kind::Stribeck)],
            Held::default(),
            0.05
        )
        .unwrap(),
        None
    );
    let emps = Robot::from_toml(EMPS, Path::new("emps.toml")).unwrap();
    let nominal = [95.0, 0.0, 0.0, 203.0, 20.0, -3.0];
    let rivals = [
        (Effect::new(Kind::Stribeck, &[5.0], &[0.005]), nominal),
        (Effect::new(Kind::PreslidingDahl, &[20.0], &[1e-4]), nominal),
    ];
    let found = next(&emps, 0, &rivals, Held::default(), 2.0)
        .unwrap()
        .unwrap();
    println!("{}", found.experiment.text);
    within_limits(&emps, &found.trajectory.unwrap());
    assert!(found.experiment.separation.unwrap() > DECIDES);
}

/// With described gravity direction and constant, a wide motion separates a tilt from a constant, without turning the
/// base.
#[test]
fn a_tilt_is_told_from_a_constant_by_a_motion_where_neither_is_in_the_standard_model() {
    let rivals = [
        effect(Kind::AsymmetricCoulomb, &[0.1], &[]),
        effect(Kind::GravityTilt, &[0.1, 0.0], &[]),
    ];
    let across = rivals.map(|(e, [inertia, gravity, _, viscous, coulomb, _])| {
        (e, [inertia, 0.0, gravity, viscous, coulomb, 0.0])
    });
    let ask = |held| next(&robot(), 0, &across, held, 0.05).unwrap().unwrap();
    let held = ask(Held {
        gravity: true,
        constant: true,
    });
    println!("{}: {}", held.experiment.kind, held.experiment.text);
    assert!(!held.experiment.hands);
    assert!(held.experiment.separation.unwrap() > DECIDES);
    assert_eq!(
        ask(Held::default()).experiment.kind.to_string(),
        "base-turned"
    );
}

/// A coasting joint loses the energy of friction, and stops where friction holds its weight.
#[test]
fn a_joint_that_coasts_keeps_its_energy_balance_and_its_range() {
    let robot = robot();
    let place = Place::of(&robot, 0, NOMINAL, Held::default())
        .unwrap()
        .unwrap();
    let [inertia, cosine, sine, viscous, coulomb, _] = NOMINAL;
    let mut count = 0;
    for primitive in of_family(&place, Family::CoastDown, Hands::None) {
        let off = primitive.drive_off.unwrap();
        let at = primitive.trajectory.at(off);
        // In the middle of the pass at constant speed.
        assert!(at.acceleration.abs() < 1e-9 && at.velocity > 0.0);
        let period = 1e-4;
        let begin = [primitive.start + at.position, at.velocity];
        let way = place.coast(begin, 1.0, period, (COASTING / period) as usize);
        let energy = |q: f64, v: f64| {
            let (s, c) = q.sin_cos();
            0.5 * inertia * v * v + cosine * s - sine * c
        };
        let lost: f64 = (way.iter())
            .map(|[_, v, _]| (viscous * v * v + coulomb * v.abs()) * period)
            .sum();
        let [end, speed, _] = *way.last().unwrap();
        let balance = energy(begin[0], begin[1]) - energy(end, speed) - lost;
        println!(
            "{:?}: {speed:.3} rad/s at {end:.4}, {lost:.5} J lost, {balance:.1e} left over",
            primitive.figures
        );
        assert!(balance.abs() < 2e-3 * lost, "{balance} of {lost}");
        assert!((way.iter()).all(|[q, ..]| (place.low..=place.high).contains(q)));
        // It stands exactly where friction holds its weight.
        assert_eq!(speed == 0.0, place.weight(end).abs() <= coulomb);
        count += 1;
    }
    assert!(count > 1);
    // It would leave a narrow range, and an arm's controller has no such file.
    let mut narrow = place.clone();
    (narrow.low, narrow.high) = (-1.0, 1.0);
    assert!(of_family(&narrow, Family::CoastDown, Hands::None).is_empty());
    let mut arm = place;
    arm.alone = false;
    assert!(of_family(&arm, Family::CoastDown, Hands::None).is_empty());
}

#[test]
fn a_clamped_joint_is_asked_for_steps_of_the_torque_within_its_limit() {
    let robot = robot();
    let pair = [
        middle_of_range(Kind::DriveDeadzone),
        middle_of_range(Kind::Stribeck),
    ];
    let found = next(&robot, 0, &pair, Held::default(), 0.05)
        .unwrap()
        .unwrap();
    println!("{}", found.experiment.text);
    assert_eq!(found.experiment.kind.to_string(), "locked-rotor-staircase");
    assert!(found.experiment.hands && found.experiment.text.contains("clamp"));
    let file = found.trajectory.unwrap();
    let Trajectory::Staircase(steps) = &file.joints[0].trajectory else {
        panic!("{file:?}");
    };
    let gain = f64::from(
        rig_plant::emulated::Nameplate::from_robot(&robot)
            .unwrap()
            .settings
            .gains
            .proportional,
    );
    let torques: Vec<f64> = steps.levels.iter().map(|level| gain * level).collect();
    let limit = robot.joints[0].limits.as_ref().unwrap().torque.unwrap();
    let highest = torques.iter().copied().fold(0.0, f64::max);
    assert!(
        highest > 0.2 * limit && highest < 0.5 * limit,
        "{torques:?}"
    );
    assert!(torques.contains(&-highest));
    // Without a described gain, slow reversals are proposed.
    let emps = Robot::from_toml(EMPS, Path::new("emps.toml")).unwrap();
    let mut unknown = emps.clone();
    unknown.joints[0].controller = None;
    let asked = |robot: &Robot| {
        let found = next(robot, 0, &pair, Held::default(), 2.0)
            .unwrap()
            .unwrap();
        found.experiment.kind.to_string()
    };
    assert_eq!(asked(&unknown), "nested-reversals");
}
