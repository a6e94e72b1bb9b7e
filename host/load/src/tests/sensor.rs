//! The load by the wrist sensor: accuracy, flaws of sensors that are found, and what the data do not show.

use super::made::{Moving, Points, Sensor, interpolated, parameters, poses, recorded, tool};
use crate::{KnownMass, LoadError, LoadIdentification, LoadOptions, identify_load};
use rand::{RngExt, SeedableRng};
use rig_data::prepare::InMemory;
use rig_model::robot::{IRP6_TEMPLATE, Reads, Robot, TX40, WristSensor};

pub(super) fn irp6() -> Robot {
    let mut robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    robot.wrist_sensor = Some(WristSensor {
        position: [0.0, 0.0, 0.03],
        rotation: [0.0, 0.0, 0.4],
        reads: Some(Reads::Load),
        ..WristSensor::default()
    });
    robot
}

pub(super) fn tx40() -> Robot {
    let mut robot = Robot::from_toml(TX40, "tx40.toml".as_ref()).unwrap();
    robot.wrist_sensor = Some(WristSensor::default());
    robot
}

pub(super) const NO_FLAW: &dyn Fn(f64, [f64; 6]) -> [f64; 6] = &|_, read| read;

/// Errors of mass (share) and centre of mass (m).
fn errors(load: &LoadIdentification, points: &Points) -> [f64; 2] {
    let truth = parameters(points);
    let centre = (0..3)
        .map(|k| (load.centre[k].value - truth[k + 1] / truth[0]).powi(2))
        .sum::<f64>()
        .sqrt();
    [(load.mass.value / truth[0] - 1.0).abs(), centre]
}

/// A sensor of 200 N and 20 N·m with noise of 0.1 % of its range (the class of JR3), on the IRp-6: 30 s of motion beside
/// four poses, with one reading each and with as many readings in all.
#[test]
fn mass_and_centre_are_exact_to_a_per_cent_and_five_millimetres_and_better_than_by_four_poses() {
    let points = tool();
    let sensor = Sensor {
        noise: [0.2, 0.02],
        ..Sensor::default()
    };
    let mut mean = [[0.0f64; 2]; 3];
    for seed in 0..4 {
        let moving = Moving::new(irp6(), 0.8, seed);
        let motion = recorded(&moving, &points, &sensor, [30.0, 100.0], seed, NO_FLAW);
        let load = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
        let found = errors(&load, &points);
        assert!(
            found[0] < 0.01 && found[1] < 0.005,
            "seed {seed}: {found:?}"
        );
        assert!(load.warnings.is_empty(), "{:?}", load.warnings);
        let still = |readings: usize| {
            let four = (0..4 * readings).map(|k| moving.position(7.0 * (k / readings) as f64));
            let still = poses(&moving, &points, &sensor, &four.collect::<Vec<_>>(), seed);
            let load = identify_load(&moving.robot, &[&still], &[], &LoadOptions::default());
            errors(&load.unwrap(), &points)
        };
        for (to, errors) in mean.iter_mut().zip([found, still(1), still(750)]) {
            for (to, error) in to.iter_mut().zip(errors) {
                *to += error / 4.0;
            }
        }
    }
    let [by_motion, by_four, by_many] = mean;
    println!("motion {by_motion:?}, four readings {by_four:?}, 3000 readings {by_many:?}");
    for k in 0..2 {
        assert!(by_four[k] > 3.0 * by_motion[k]);
    }
}

#[test]
fn all_ten_parameters_of_a_lively_motion_are_those_of_the_points() {
    let moving = Moving::new(tx40(), 0.7, 5);
    let points = tool();
    let motion = recorded(
        &moving,
        &points,
        &Sensor::default(),
        [40.0, 200.0],
        1,
        NO_FLAW,
    );
    let load = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
    for (found, truth) in load.parameters.iter().zip(parameters(&points)) {
        let off = (found.value.value - truth) / found.value.std;
        assert!(found.shown, "{found:?}");
        assert!(off.abs() < 4.0, "{found:?}, truth {truth}");
    }
    assert!(load.not_shown.is_empty());
    let sensor = load.sensor.as_ref().unwrap();
    for (found, truth) in sensor.biases[0].bias.iter().zip(Sensor::default().bias) {
        assert!((found - truth).abs() < 0.02, "{found} {truth}");
    }
    assert_eq!(sensor.reads, Reads::Load);
}

/// The 95 % intervals of 200 random loads, each with its own noise, bias and motion.
#[test]
fn intervals_contain_the_truth() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(17);
    let mut inside = [0usize; 10];
    let mut centre_inside = [0usize; 3];
    const LOADS: usize = 200;
    for load in 0..LOADS {
        let mut draw = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let points: Points = (0..6)
            .map(|_| {
                let place = [draw(-0.1, 0.1), draw(-0.1, 0.1), draw(0.0, 0.2)];
                (draw(0.1, 0.6), place)
            })
            .collect();
        let sensor = Sensor {
            noise: [draw(0.05, 0.4), draw(0.005, 0.04)],
            bias: std::array::from_fn(|_| draw(-5.0, 5.0)),
            sign: -1.0,
        };
        let moving = Moving::new(tx40(), 0.7, load as u64);
        let motion = recorded(
            &moving,
            &points,
            &sensor,
            [12.0, 100.0],
            load as u64,
            NO_FLAW,
        );
        let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
        let truth = parameters(&points);
        for (k, parameter) in found.parameters.iter().enumerate() {
            let off = (parameter.value.value - truth[k]).abs();
            inside[k] += usize::from(off <= parameter.value.half_interval);
        }
        for k in 0..3 {
            let off = (found.centre[k].value - truth[k + 1] / truth[0]).abs();
            centre_inside[k] += usize::from(off <= found.centre[k].half_interval);
        }
    }
    println!(
        "of {LOADS} intervals {inside:?} of the parameters and {centre_inside:?} of the centre contain the truth"
    );
    // 95 % ± 1.5 %: three deviations of a binomial of 200.
    for count in inside.into_iter().chain(centre_inside) {
        let share = count as f64 / LOADS as f64;
        assert!(
            (0.90..=0.995).contains(&share),
            "{inside:?} {centre_inside:?}"
        );
    }
}

#[test]
fn loads_are_the_same_by_either_convention_and_a_stated_one_is_checked() {
    let points = tool();
    for (sign, is) in [(1.0, Reads::Robot), (-1.0, Reads::Load)] {
        let sensor = Sensor {
            sign,
            ..Sensor::default()
        };
        for stated in [None, Some(Reads::Robot), Some(Reads::Load)] {
            let mut robot = irp6();
            robot.wrist_sensor.as_mut().unwrap().reads = stated;
            let moving = Moving::new(robot, 0.8, 3);
            let motion = recorded(&moving, &points, &sensor, [20.0, 100.0], 2, NO_FLAW);
            let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default());
            if stated.is_some_and(|stated| stated != is) {
                let text = found.unwrap_err().to_string();
                assert!(text.contains("reads = "), "{text}");
                continue;
            }
            let found = found.unwrap();
            assert!(errors(&found, &points)[0] < 0.01);
            let sensor = found.sensor.as_ref().unwrap();
            assert_eq!(sensor.reads, is);
            assert_eq!(sensor.reads_found.is_none(), stated.is_some());
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        }
    }
}

#[test]
fn exchanged_and_reversed_channels_are_named_and_put_right() {
    let moving = Moving::new(irp6(), 0.8, 4);
    let points = tool();
    let sensor = Sensor::default();
    type Flaw = fn([f64; 6]) -> [f64; 6];
    let flaws: [(&str, Flaw); 6] = [
        ("fx and fy are exchanged", |[a, b, c, d, e, f]| {
            [b, a, c, d, e, f]
        }),
        ("my has the opposite sign", |[a, b, c, d, e, f]| {
            [a, b, c, d, -e, f]
        }),
        ("fz has the opposite sign", |[a, b, c, d, e, f]| {
            [a, b, -c, d, e, f]
        }),
        (
            "mx, my and mz have the opposite sign",
            |[a, b, c, d, e, f]| [a, b, c, -d, -e, -f],
        ),
        (
            "mx, my, mz are recorded in the columns",
            |[a, b, c, d, e, f]| [a, b, c, e, f, d],
        ),
        ("mx and mz are exchanged", |[a, b, c, d, e, f]| {
            [c, b, a, f, e, d]
        }),
    ];
    for (said, flaw) in flaws {
        let motion = recorded(&moving, &points, &sensor, [20.0, 100.0], 2, &|_, read| {
            flaw(read)
        });
        let refused = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default());
        let text = refused.unwrap_err().to_string();
        assert!(text.contains(said), "wanted {said}: {text}");
        let options = LoadOptions {
            even_if_wrong: true,
            ..LoadOptions::default()
        };
        let found = identify_load(&moving.robot, &[&motion], &[], &options).unwrap();
        let off = errors(&found, &points);
        assert!(off[0] < 0.01 && off[1] < 0.005, "{said}: {off:?}");
        // The sensor itself is not turned.
        assert!(
            !found.warnings.iter().any(|w| w.contains("turned by")),
            "{:?}",
            found.warnings
        );
    }
}

/// Three poses with noise are enough for mass and centre of mass, and no unit is suspected of them.
#[test]
fn three_poses_show_mass_and_centre() {
    let points = tool();
    let truth = parameters(&points);
    let mut worst = 0.0f64;
    for seed in 0..20 {
        let moving = Moving::new(irp6(), 0.9, seed);
        let three: Vec<Vec<f64>> = [1.0, 14.0, 29.0].map(|t| moving.position(t)).to_vec();
        let still = poses(&moving, &points, &Sensor::default(), &three, seed);
        let found = identify_load(&moving.robot, &[&still], &[], &LoadOptions::default()).unwrap();
        let mass = &found.parameters[0];
        worst = worst.max((mass.value.value - truth[0]).abs() / mass.value.half_interval);
    }
    // Of twenty 95 % intervals one or two may miss, by little.
    assert!(worst < 3.0, "{worst}");
}

#[test]
fn coarse_readings_are_not_taken_for_saturated_ones() {
    let points = tool();
    for seed in 0..6 {
        let moving = Moving::new(irp6(), 0.6, seed);
        let coarse = |_: f64, read: [f64; 6]| -> [f64; 6] {
            let step = |c: usize| if c < 3 { 0.2 } else { 0.005 };
            std::array::from_fn(|c| (read[c] / step(c)).round() * step(c))
        };
        let sensor = Sensor {
            noise: [0.05, 0.001],
            ..Sensor::default()
        };
        let motion = recorded(&moving, &points, &sensor, [30.0, 200.0], seed, &coarse);
        let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
        assert!(
            !found.warnings.iter().any(|w| w.contains("saturated")),
            "{:?}",
            found.warnings
        );
        assert!(errors(&found, &points)[0] < 0.01);
    }
}

/// An error that stays the same while the robot stands still (a cable) is one error, however many rows a pose has.
#[test]
fn rows_of_one_pose_are_one_reading_and_a_motion_is_no_list_of_poses() {
    let moving = Moving::new(irp6(), 0.8, 12);
    let points = tool();
    let once: Vec<Vec<f64>> = (0..6)
        .map(|k| moving.position(4.7 * f64::from(k)))
        .collect();
    let often: Vec<Vec<f64>> = once.iter().flat_map(|q| vec![q.clone(); 40]).collect();
    let std = |list: &[Vec<f64>], rows: usize| {
        let mut still = poses(&moving, &points, &Sensor::default(), list, 3);
        let block = &mut still.blocks[0];
        for (c, (_, column)) in block.extra.iter_mut().enumerate() {
            let size = if c < 3 { 0.3 } else { 0.03 };
            for (k, value) in column.iter_mut().enumerate() {
                *value += size * (2.0 * (k / rows) as f64 + c as f64).sin();
            }
        }
        let found = identify_load(&moving.robot, &[&still], &[], &LoadOptions::default()).unwrap();
        (found.mass.std, found.warnings.join(" "))
    };
    let [(one, unknown), (forty, told)] = [std(&once, 1), std(&often, 40)];
    assert!(forty > 0.5 * one, "{one} {forty}");
    // The noise of one row a pose is unknown. That of forty tells that something else acts.
    assert!(unknown.contains("does not tell the noise"), "{unknown}");
    assert!(
        told.contains("noise by which the rows of a pose differ"),
        "{told}"
    );
    let motion = recorded(
        &moving,
        &points,
        &Sensor::default(),
        [10.0, 100.0],
        2,
        NO_FLAW,
    );
    let options = LoadOptions {
        poses: true,
        ..LoadOptions::default()
    };
    let text = identify_load(&moving.robot, &[&motion], &[], &options)
        .unwrap_err()
        .to_string();
    assert!(text.contains("moves all the time"), "{text}");
}

/// Poses that no property of the sensor explains: the columns of the positions are looked at, and nothing is written.
#[test]
fn position_columns_that_are_wrong_are_named_at_rest() {
    let points = tool();
    for rows in [1, 20] {
        let moving = Moving::new(tx40(), 0.8, 5);
        let list: Vec<Vec<f64>> = (0..10 * rows)
            .map(|k| moving.position(3.1 * f64::from(k / rows)))
            .collect();
        let still = poses(&moving, &points, &Sensor::default(), &list, 7);
        let said = |change: &dyn Fn(&mut InMemory)| {
            let mut wrong = still.clone();
            change(&mut wrong);
            let found = identify_load(&moving.robot, &[&wrong], &[], &LoadOptions::default());
            found.map_or_else(|e| e.to_string(), |found| found.warnings.join(" "))
        };
        let sound = said(&|_| {});
        assert!(!sound.contains("positions look wrong"), "{sound}");
        let text = said(&|own| own.blocks[0].joints.swap(3, 4));
        assert!(text.contains("q4 and q5 are exchanged"), "{rows}: {text}");
        let text = said(&|own| own.blocks[0].joints[4].q.iter_mut().for_each(|q| *q = -*q));
        assert!(text.contains("q5 has the opposite sign"), "{rows}: {text}");
        let text = said(&|own| own.blocks[0].joints[4].q.iter_mut().for_each(|q| *q += 0.7));
        let rest = text.split("q5 is counted from another zero (−").nth(1);
        let angle: f64 = (rest.and_then(|rest| rest.split(' ').next()))
            .and_then(|angle| angle.parse().ok())
            .unwrap_or(0.0);
        assert!((angle - 0.7).abs() < 0.01, "{rows}: {text}");
    }
}

/// Noise that is correlated over some rows is noise too.
#[test]
fn the_noise_of_poses_with_several_rows_is_no_disturbance() {
    let points = tool();
    for (rows, correlation) in [(2, 0.0), (5, 0.0), (40, 0.0), (40, 0.5), (200, 0.9)] {
        for seed in 0..20 {
            let moving = Moving::new(irp6(), 0.8, seed);
            let list: Vec<Vec<f64>> = (0..8 * rows)
                .map(|k| moving.position(3.1 * f64::from(k / rows)))
                .collect();
            let silent = Sensor {
                noise: [0.0; 2],
                ..Sensor::default()
            };
            let mut still = poses(&moving, &points, &silent, &list, seed);
            let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
            for (c, (_, column)) in still.blocks[0].extra.iter_mut().enumerate() {
                let size = if c < 3 { 0.2 } else { 0.02 };
                let mut noise = 0.0;
                for value in column {
                    let fresh: f64 = random.sample(rand_distr::StandardNormal);
                    noise = correlation * noise + fresh;
                    *value += size * noise;
                }
            }
            let found = identify_load(&moving.robot, &[&still], &[], &LoadOptions::default());
            let text = found.unwrap().warnings.join(" ");
            assert!(
                !text.contains("A rigid load leaves"),
                "{rows} {seed}: {text}"
            );
        }
    }
}

/// Whether rows are poses follows from their times and positions: a motion is none however few rows it has, and poses are
/// read out of a recording in which the robot stops.
#[test]
fn rest_and_motion_are_told_by_the_rows_and_not_by_their_number() {
    let moving = Moving::new(tx40(), 0.7, 6);
    let points = tool();
    let sensor = Sensor::default();
    let identify = |recording: &InMemory, poses: bool| {
        let options = LoadOptions {
            poses,
            ..LoadOptions::default()
        };
        identify_load(&moving.robot, &[recording], &[], &options)
    };
    for [seconds, rate] in [[5.0, 50.0], [0.39, 100.0], [2.0, 100.0]] {
        let short = recorded(&moving, &points, &sensor, [seconds, rate], 3, NO_FLAW);
        let text = identify(&short, false).unwrap_err().to_string();
        assert!(
            text.contains("moves all the time") && text.contains("at least 256"),
            "{text}"
        );
    }
    let long = recorded(&moving, &points, &sensor, [5.2, 50.0], 3, NO_FLAW);
    assert!(errors(&identify(&long, false).unwrap(), &points)[0] < 0.02);
    let long = recorded(&moving, &points, &sensor, [30.0, 100.0], 3, NO_FLAW);
    let text = identify(&long, true).unwrap_err().to_string();
    assert!(text.contains("leave out --poses"), "{text}");
    // Six stops of 0.6 s at 50 Hz, with 0.2 s of straight way between them.
    let stops: Vec<Vec<f64>> = (0..6)
        .map(|k| moving.position(4.7 * f64::from(k)))
        .collect();
    let mut list = Vec::new();
    for (k, stop) in stops.iter().enumerate() {
        list.extend(vec![stop.clone(); 30]);
        if let Some(next) = stops.get(k + 1) {
            let way = (1..10).map(|n| {
                let share = f64::from(n) / 10.0;
                let joints = stop.iter().zip(next);
                joints
                    .map(|(a, b)| a + share * (b - a))
                    .collect::<Vec<f64>>()
            });
            list.extend(way);
        }
    }
    let mut stopping = poses(&moving, &points, &sensor, &list, 4);
    let times = stopping.blocks[0].t.iter_mut().enumerate();
    times.for_each(|(k, t)| *t = 0.02 * k as f64);
    let found = identify(&stopping, false).unwrap();
    assert_eq!(found.sensor.as_ref().unwrap().rows, 6);
    assert!(errors(&found, &points)[0] < 0.02);
    // Some rows a pose, recorded only while the robot stands, with and without noise of the positions.
    for (rows, step, noise) in [
        (2, 0.01, 0.0),
        (5, 0.01, 1e-5),
        (50, 0.01, 1e-4),
        (10, 0.1, 0.0),
    ] {
        let turn = |k: usize| noise * (7.3 * k as f64).sin();
        let all = (0..6 * rows).map(|k| stops[k / rows].iter().map(|q| q + turn(k)).collect());
        let mut few = poses(&moving, &points, &sensor, &all.collect::<Vec<_>>(), 4);
        let times = few.blocks[0].t.iter_mut().enumerate();
        times.for_each(|(k, t)| *t = 9.0 * (k / rows) as f64 + step * (k % rows) as f64);
        for flag in [false, true] {
            let found = identify(&few, flag).unwrap();
            assert_eq!(found.sensor.as_ref().unwrap().rows, 6, "{rows} rows");
            assert!(errors(&found, &points)[0] < 0.02);
        }
    }
    // One row a pose, written without a clock: no joint makes such steps.
    let mut listed = poses(&moving, &points, &sensor, &stops, 4);
    let times = listed.blocks[0].t.iter_mut().enumerate();
    times.for_each(|(k, t)| *t = 1e-3 * k as f64);
    let found = identify(&listed, false).unwrap();
    assert_eq!(found.sensor.as_ref().unwrap().rows, 6);
}

#[test]
fn a_spike_is_named_by_its_row_and_exchanged_recordings_by_their_weights() {
    let moving = Moving::new(irp6(), 0.8, 3);
    let [heavy, light] = [
        tool(),
        vec![(0.4, [0.0, 0.01, 0.05]), (0.2, [0.03, 0.0, 0.02])],
    ];
    let sensor = Sensor::default();
    let spike = |t: f64, mut read: [f64; 6]| {
        if (t - 12.34).abs() < 1e-6 {
            read[2] = 5e4;
        }
        read
    };
    let motion = recorded(&moving, &heavy, &sensor, [20.0, 100.0], 2, &spike);
    let identify = |with: &InMemory, without: &[&dyn rig_data::prepare::Recording]| {
        identify_load(&moving.robot, &[with], without, &LoadOptions::default())
    };
    let text = identify(&motion, &[]).unwrap_err().to_string();
    // The header line and 1234 rows stand before it.
    assert!(
        text.contains("line 1236: fz is 50000 N") || text.contains("line 1236: fz is 5.000e4 N"),
        "{text}"
    );
    let with = recorded(&moving, &heavy, &sensor, [20.0, 100.0], 4, NO_FLAW);
    let without = recorded(&moving, &light, &sensor, [20.0, 100.0], 5, NO_FLAW);
    assert!(identify(&with, &[&without]).is_ok());
    let text = identify(&without, &[&with]).unwrap_err().to_string();
    assert!(text.contains("look exchanged"), "{text}");
    // A flange that carries nothing: only noise decides which of both masses is the larger one.
    for seed in 0..4 {
        let with = recorded(&moving, &heavy, &sensor, [20.0, 100.0], 10 + seed, NO_FLAW);
        let none = vec![(1e-6, [0.0, 0.0, 0.05])];
        let empty = recorded(&moving, &none, &sensor, [20.0, 100.0], 20 + seed, NO_FLAW);
        let text = identify(&empty, &[&with]).unwrap_err().to_string();
        assert!(text.contains("look exchanged"), "{text}");
    }
    // Small units in all six channels: no joint carries such a load.
    let milli = |_: f64, read: [f64; 6]| read.map(|v| 1e3 * v);
    let motion = recorded(&moving, &heavy, &sensor, [20.0, 100.0], 6, &milli);
    let found = identify(&motion, &[]).unwrap();
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.contains("described limit") && w.contains("mN")),
        "{:?}",
        found.warnings
    );
}

/// Moments in N·mm at rest: their noise is larger than the size of a load in N·m, but not than the centre of mass that they
/// would give.
#[test]
fn poses_with_moments_in_another_unit_are_refused() {
    let points = tool();
    for seed in 0..6 {
        let moving = Moving::new(tx40(), 0.8, seed);
        let list: Vec<Vec<f64>> = (0..8)
            .map(|k| moving.position(3.1 * f64::from(k)))
            .collect();
        let mut still = poses(&moving, &points, &Sensor::default(), &list, seed);
        for (_, column) in &mut still.blocks[0].extra[3..] {
            column.iter_mut().for_each(|value| *value *= 1e3);
        }
        let refused = identify_load(&moving.robot, &[&still], &[], &LoadOptions::default());
        let text = refused.unwrap_err().to_string();
        assert!(
            text.contains("N·mm") && text.contains("--unit mx=Nmm"),
            "{text}"
        );
    }
}

/// Rows of single poses follow no motion, so only the range of their positions tells degrees.
#[test]
fn poses_in_degrees_are_named() {
    let moving = Moving::new(tx40(), 0.9, 3);
    let list: Vec<Vec<f64>> = (0..6)
        .map(|k| moving.position(4.7 * f64::from(k)))
        .collect();
    let mut still = poses(&moving, &tool(), &Sensor::default(), &list, 3);
    let of = |made: &InMemory| {
        let found = rig_data::implausible_positions(&made.blocks[0], &moving.robot);
        found.iter().map(|own| own.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(of(&still), [""; 0]);
    for joint in &mut still.blocks[0].joints {
        joint.q.iter_mut().for_each(|q| *q = q.to_degrees());
    }
    let found = of(&still);
    assert!(
        found.iter().any(|text| text.contains("looks like degrees")),
        "{found:?}"
    );
}

#[test]
fn a_turned_sensor_is_found_whatever_the_angle() {
    let points = tool();
    for rotation in [
        [0.0, 0.0, 0.03],
        [0.1, -0.2, 0.9],
        [3.1, 0.2, 0.4],
        [0.0, 1.5, 0.0],
    ] {
        let moving = Moving::new(irp6(), 0.8, 6);
        let mut turned = irp6();
        turned.wrist_sensor.as_mut().unwrap().rotation = rotation;
        let read_by = Moving::new(turned, 0.8, 6);
        let motion = recorded(
            &read_by,
            &points,
            &Sensor::default(),
            [20.0, 100.0],
            2,
            NO_FLAW,
        );
        let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
        let off = errors(&found, &points);
        assert!(off[0] < 0.01 && off[1] < 0.005, "{rotation:?}: {off:?}");
        let sensor = found.sensor.as_ref().unwrap();
        let is = read_by.robot.wrist_sensor.as_ref().unwrap().pose().rotation;
        let [roll, pitch, yaw] = sensor.rotation;
        let told = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        assert!(is.angle_to(&told) < 3e-3, "{} rad", is.angle_to(&told));
        let against = moving.robot.wrist_sensor.as_ref().unwrap().pose().rotation;
        assert!((sensor.turned.unwrap() - is.angle_to(&against)).abs() < 3e-3);
        assert!(
            found.warnings[0].contains("turned by"),
            "{:?}",
            found.warnings
        );
    }
}

#[test]
fn saturated_rows_are_left_out_and_a_saturated_recording_is_refused() {
    let moving = Moving::new(irp6(), 0.8, 7);
    let points = tool();
    let sensor = Sensor::default();
    for (most, fails) in [(24.0, false), (9.0, true)] {
        let cut = move |_: f64, mut read: [f64; 6]| {
            read[0] = read[0].min(most);
            read[2] = read[2].min(most);
            read
        };
        let motion = recorded(&moving, &points, &sensor, [30.0, 100.0], 2, &cut);
        let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default());
        match found {
            Ok(found) => {
                assert!(!fails);
                let said = &found.warnings[0];
                assert!(
                    said.contains("saturated") && said.contains("at 24"),
                    "{said}"
                );
                assert!(errors(&found, &points)[0] < 0.01);
            }
            Err(error) => assert!(fails && error.to_string().contains("saturated"), "{error}"),
        }
    }
}

/// An amplifier ends at 60 % of what the readings would be, far below the described range; with noise before and behind it.
#[test]
fn readings_that_are_cut_within_the_described_range_are_named_and_left_out() {
    let mut robot = irp6();
    let own = robot.wrist_sensor.as_mut().unwrap();
    (own.force_range, own.moment_range) = (Some(200.0), Some(20.0));
    let moving = Moving::new(robot, 0.8, 7);
    let points = tool();
    for noise in [0.0, 0.05, 0.2] {
        for (channel, most) in [(0, 24.0), (0, 12.0), (2, 22.0), (4, 2.0)] {
            let mut random = rand_pcg::Pcg64::seed_from_u64(5);
            let late: Vec<f64> = (0..3001)
                .map(|_| noise * (random.random::<f64>() - 0.5) * 3.46)
                .collect();
            let cut = |t: f64, mut read: [f64; 6]| {
                let size = if channel < 3 { 1.0 } else { 0.1 };
                read[channel] = read[channel].min(most) + size * late[(t * 100.0) as usize];
                read
            };
            let sensor = Sensor {
                noise: [0.2 - 0.9 * noise, 0.02 - 0.09 * noise],
                ..Sensor::default()
            };
            let motion = recorded(&moving, &points, &sensor, [30.0, 100.0], 2, &cut);
            let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default());
            let name = rig_data::WRENCH_COLUMNS[channel];
            let is_named = |text: &str| text.contains(&format!("{name} are cut at about"));
            match found {
                Ok(found) => {
                    let text = found.warnings.join(" ");
                    assert!(is_named(&text), "{name} {most} {noise}: {text}");
                    assert!(errors(&found, &points)[0] < 0.005 && most != 12.0);
                }
                // Most rows are lost.
                Err(error) => assert!(is_named(&error.to_string()) && most == 12.0, "{error}"),
            }
        }
    }
}

/// A contact of 50 ms is told with its time, and nothing else is accused.
#[test]
fn a_hit_is_told_with_its_time() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let hit = |t: f64, mut read: [f64; 6]| {
        if (13.1..13.15).contains(&t) {
            read[0] += 30.0;
            read[4] += 3.0;
        }
        read
    };
    let motion = recorded(&moving, &tool(), &Sensor::default(), [40.0, 100.0], 2, &hit);
    let found = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
    let text = found.warnings.join(" ");
    assert!(
        text.contains("between 12.0 and 14.0 s after the begin"),
        "{text}"
    );
    assert!(!text.contains("may stand for another cause"), "{text}");
    assert!(errors(&found, &tool())[0] < 0.01, "{text}");
}

#[test]
fn a_bias_that_jumps_or_drifts_is_told_and_does_not_bend_the_load() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let points = tool();
    let sensor = Sensor::default();
    let jump = |t: f64, mut read: [f64; 6]| {
        if t > 17.3 {
            read[2] += 4.0;
            read[3] -= 0.2;
        }
        read
    };
    let drift = |t: f64, mut read: [f64; 6]| {
        read[0] += 0.1 * t;
        read[5] += 0.01 * t;
        read
    };
    let options = LoadOptions::default();
    let jumped = recorded(&moving, &points, &sensor, [40.0, 100.0], 2, &jump);
    let found = identify_load(&moving.robot, &[&jumped], &[], &options).unwrap();
    let bias = &found.sensor.as_ref().unwrap().biases[0];
    let [(time, after)] = bias.jumps[..] else {
        panic!("{bias:?}")
    };
    assert!((time - 17.3).abs() < 2.5, "{time}");
    assert!((after[2] - bias.bias[2] - 4.0).abs() < 0.1, "{bias:?}");
    assert!(errors(&found, &points)[0] < 0.01);
    assert!(found.warnings.iter().any(|w| w.contains("jumps")));
    // Two jumps: one back, and one further.
    for second in [-4.0, 6.0] {
        let twice = |t: f64, mut read: [f64; 6]| {
            read[2] += if t > 11.3 { 4.0 } else { 0.0 };
            read[2] += if t > 27.6 { second } else { 0.0 };
            read
        };
        let jumped = recorded(&moving, &points, &sensor, [40.0, 100.0], 3, &twice);
        let found = identify_load(&moving.robot, &[&jumped], &[], &options).unwrap();
        let bias = &found.sensor.as_ref().unwrap().biases[0];
        let [(first, between), (last, after)] = bias.jumps[..] else {
            panic!("{:?}", found.warnings)
        };
        assert!((first - 11.3).abs() < 2.5 && (last - 27.6).abs() < 2.5);
        assert!((between[2] - bias.bias[2] - 4.0).abs() < 0.1, "{bias:?}");
        assert!((after[2] - between[2] - second).abs() < 0.1, "{bias:?}");
        assert!(errors(&found, &points)[0] < 0.01);
    }
    let drifted = recorded(&moving, &points, &sensor, [40.0, 100.0], 2, &drift);
    let found = identify_load(&moving.robot, &[&drifted], &[], &options).unwrap();
    let bias = &found.sensor.as_ref().unwrap().biases[0];
    assert!(bias.jumps.is_empty());
    let drift = bias.drift.unwrap();
    assert!(
        (drift[0] - 4.0).abs() < 0.1 && (drift[5] - 0.4).abs() < 0.02,
        "{drift:?}"
    );
    assert!(errors(&found, &points)[0] < 0.01);
    // Neither is told where neither is.
    for seed in 0..20 {
        let sound = recorded(&moving, &points, &sensor, [40.0, 100.0], seed, NO_FLAW);
        let found = identify_load(&moving.robot, &[&sound], &[], &options).unwrap();
        assert!(found.sensor.as_ref().unwrap().biases[0].jumps.is_empty());
    }
}

#[test]
fn what_poses_cannot_show_is_named_with_a_pose_that_would() {
    let moving = Moving::new(irp6(), 0.8, 9);
    let points = tool();
    let sensor = Sensor {
        noise: [0.02, 0.002],
        ..Sensor::default()
    };
    let all: Vec<Vec<f64>> = (0..6)
        .map(|k| moving.position(5.3 * f64::from(k)))
        .collect();
    let found = |list: &[Vec<f64>]| {
        let still = poses(&moving, &points, &sensor, list, 3);
        identify_load(&moving.robot, &[&still], &[], &LoadOptions::default())
    };
    let six = found(&all).unwrap();
    assert!(errors(&six, &points)[1] < 0.005);
    // Poses at rest show no inertia.
    let [inertia] = six.not_shown.as_slice() else {
        panic!("{:?}", six.not_shown)
    };
    assert_eq!(
        inertia.parameters,
        ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]
    );
    assert!(!six.inertia_shown && six.body.mass > 0.0);
    assert!(six.parameters[..4].iter().all(|p| p.shown));
    let numbers = crate::controller_numbers(&six).unwrap();
    assert!(numbers.universal_robots.ends_with("[0, 0, 0, 0, 0, 0])"));
    // Two poses leave a direction of the centre of mass open; the named pose closes it.
    let two = found(&all[..2]).unwrap();
    let missing = &two.not_shown[0];
    assert!(
        missing.parameters.iter().all(|p| p.starts_with('m')),
        "{missing:?}"
    );
    // No controller gets a centre of mass that nothing supports, and the URDF says so.
    assert!(crate::controller_numbers(&two).is_none());
    assert!(two.centre_shown().contains(&false));
    let unknown = format!("do not show {}", missing.parameters.join(", "));
    assert!(crate::urdf_link(&two).contains(&unknown));
    let mut three = all[..2].to_vec();
    three.push(missing.pose.clone().unwrap());
    let three = found(&three).unwrap();
    assert!(
        three.parameters[..4].iter().all(|p| p.shown),
        "{:?}",
        three.parameters
    );
    // The same pose again and again is one pose.
    let one = vec![all[0].clone(); 5];
    assert!(matches!(found(&one), Err(LoadError::TooFew { .. })));
}

/// What is mounted beyond the sensor is subtracted: by a recording without the load, or by its known parameters.
#[test]
fn what_is_mounted_beyond_the_sensor_is_subtracted() {
    let moving = Moving::new(irp6(), 0.8, 10);
    let gripper: Points = vec![
        (0.5, [0.0, 0.02, 0.05]),
        (0.3, [0.03, 0.0, 0.08]),
        (0.2, [-0.02, -0.01, 0.1]),
    ];
    let part = tool();
    let both: Points = gripper.iter().chain(&part).copied().collect();
    let with = recorded(
        &moving,
        &both,
        &Sensor::default(),
        [30.0, 100.0],
        2,
        NO_FLAW,
    );
    let empty = Sensor {
        bias: [0.5, 0.4, -3.0, 0.0, 0.2, 0.1],
        ..Sensor::default()
    };
    let without = recorded(&moving, &gripper, &empty, [30.0, 100.0], 5, NO_FLAW);
    let robot = &moving.robot;
    let found = identify_load(robot, &[&with], &[&without], &LoadOptions::default()).unwrap();
    let off = errors(&found, &part);
    assert!(off[0] < 0.01 && off[1] < 0.005, "{off:?}");
    let options = LoadOptions {
        tool: Some(rig_model::robot::Load::of(parameters(&gripper))),
        ..LoadOptions::default()
    };
    let found = identify_load(robot, &[&with], &[], &options).unwrap();
    let off = errors(&found, &part);
    assert!(off[0] < 0.01 && off[1] < 0.005, "{off:?}");
    assert!(found.inertia_shown);
    // An inertia that was assumed for the tool leaves that of the part unknown.
    let mut options = options;
    options.tool.as_mut().unwrap().inertia_known = false;
    let found = identify_load(robot, &[&with], &[], &options).unwrap();
    assert!(!found.inertia_shown && !found.body.inertia_known);
    let off = errors(&found, &part);
    assert!(off[0] < 0.01 && off[1] < 0.005, "{off:?}");
    let (centre, inertia) = found.body.about_centre().unwrap();
    let truth = parameters(&part);
    for k in 0..3 {
        assert!(
            (centre[k] - truth[k + 1] / truth[0]).abs() < 0.005,
            "{centre}"
        );
        // A sphere of radius 0.1 m.
        assert!(
            (inertia[(k, k)] / (0.004 * truth[0]) - 1.0).abs() < 0.05,
            "{inertia}"
        );
    }
}

#[test]
fn readings_that_no_load_gives_are_refused() {
    let moving = Moving::new(irp6(), 0.8, 11);
    let points = tool();
    let refused = |flaw: &dyn Fn(f64, [f64; 6]) -> [f64; 6]| {
        let motion = recorded(&moving, &points, &Sensor::default(), [20.0, 100.0], 2, flaw);
        identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default())
            .unwrap_err()
            .to_string()
    };
    let text = refused(&|_, [a, b, c, d, e, f]| [a, b, c, 1e3 * d, 1e3 * e, 1e3 * f]);
    assert!(text.contains("N·mm"), "{text}");
    let mut ranged = Moving::new(irp6(), 0.8, 11);
    ranged.robot.wrist_sensor.as_mut().unwrap().moment_range = Some(20.0);
    let millimetres: &dyn Fn(f64, [f64; 6]) -> [f64; 6] =
        &|_, [a, b, c, d, e, f]| [a, b, c, 1e3 * d, 1e3 * e, 1e3 * f];
    let motion = recorded(
        &ranged,
        &points,
        &Sensor::default(),
        [20.0, 100.0],
        2,
        millimetres,
    );
    let text = identify_load(&ranged.robot, &[&motion], &[], &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(text.contains("looks like N·mm"), "{text}");
    let text = refused(&|_, [a, b, c, d, _, f]| [a, b, c, d, 0.0, f]);
    assert!(text.contains("my of made 2 is 0"), "{text}");
    // A position of the sensor in millimetres is no unit of the moments, neither in motion nor at rest.
    let mut far = Moving::new(irp6(), 0.8, 11);
    let at = &mut far.robot.wrist_sensor.as_mut().unwrap().position;
    *at = [1.5, 0.0, 4.0];
    let rest: Vec<Vec<f64>> = [1.0, 14.0, 29.0].map(|t| moving.position(t)).to_vec();
    for recording in [
        recorded(
            &moving,
            &points,
            &Sensor::default(),
            [20.0, 100.0],
            2,
            &|_, r| r,
        ),
        poses(&moving, &points, &Sensor::default(), &rest, 2),
    ] {
        let text = identify_load(&far.robot, &[&recording], &[], &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("look like mm: these would be [0.0015, 0, 0.004] m")
                && !text.contains("moments"),
            "{text}"
        );
    }
    // A sensor that nothing hangs on.
    let nothing: Points = vec![(1e-9, [0.0; 3])];
    let motion = recorded(
        &moving,
        &nothing,
        &Sensor::default(),
        [20.0, 100.0],
        2,
        NO_FLAW,
    );
    let text = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(text.contains("do not show the mass"), "{text}");
}

/// Gravity of a base that is turned by `angle` about a level axis.
fn leaning(robot: &Robot, angle: f64) -> Robot {
    let axis = nalgebra::Vector3::new(0.6, -0.8, 0.0);
    let turn = nalgebra::Rotation3::from_scaled_axis(axis * angle);
    let gravity = turn * nalgebra::Vector3::from(robot.gravity);
    Robot {
        gravity: gravity.into(),
        ..robot.clone()
    }
}

#[test]
fn a_leaning_base_is_no_turned_sensor_and_both_are_told_together() {
    let points = tool();
    for (robot, angle) in [(irp6(), 0.015), (irp6(), 0.05), (tx40(), 0.15)] {
        let truth = leaning(&robot, angle);
        let moving = Moving::new(truth.clone(), 0.7, 3);
        let motion = recorded(
            &moving,
            &points,
            &Sensor::default(),
            [30.0, 100.0],
            4,
            NO_FLAW,
        );
        let list: Vec<Vec<f64>> = (0..12)
            .map(|k| moving.position(3.1 * f64::from(k)))
            .collect();
        let still = poses(&moving, &points, &Sensor::default(), &list, 5);
        let turned = nalgebra::Rotation3::from_euler_angles(0.02, -0.06, 0.04);
        let flaw = |_: f64, read: [f64; 6]| {
            let [fx, fy, fz, mx, my, mz] = read;
            let f = turned * nalgebra::Vector3::new(fx, fy, fz);
            let m = turned * nalgebra::Vector3::new(mx, my, mz);
            [f.x, f.y, f.z, m.x, m.y, m.z]
        };
        let both = recorded(
            &moving,
            &points,
            &Sensor::default(),
            [30.0, 100.0],
            6,
            &flaw,
        );
        for (recording, is_turned) in [(&motion, false), (&still, false), (&both, true)] {
            let load = identify_load(&robot, &[recording], &[], &LoadOptions::default()).unwrap();
            let sensor = load.sensor.as_ref().unwrap();
            let gravity = sensor.gravity.expect("a base that leans");
            for (found, true_) in gravity.iter().zip(truth.gravity) {
                assert!(
                    (found - true_).abs() < 0.05,
                    "{gravity:?} {:?}",
                    truth.gravity
                );
            }
            assert_eq!(sensor.turned.is_some(), is_turned, "{:?}", load.warnings);
            if let Some(found) = sensor.turned {
                assert!((found - turned.angle()).abs() < 0.005, "{found}");
            }
            assert!(sensor.delay.is_none() && sensor.position.is_none());
            let [mass, centre] = errors(&load, &points);
            assert!(mass < 0.01 && centre < 0.005, "{mass} {centre}");
            assert!(
                load.warnings
                    .iter()
                    .any(|w| w.contains("The base leans by"))
            );
        }
    }
}

/// For a robot at a wall the fit begins a quarter turn off, and may end at the opposite gravity, with which the readings at rest
/// agree by the opposite sign.
#[test]
fn gravity_a_quarter_turn_off_is_found_with_the_sign_of_the_sensor() {
    let points = tool();
    let moving = Moving::new(tx40(), 0.9, 3);
    let list: Vec<Vec<f64>> = (0..8)
        .map(|k| moving.position(3.1 * f64::from(k) + 5.0))
        .collect();
    let still = poses(&moving, &points, &Sensor::default(), &list, 5);
    let found = |gravity: [f64; 3], reads: Option<Reads>| {
        let mut robot = moving.robot.clone();
        robot.gravity = gravity;
        if let Some(sensor) = &mut robot.wrist_sensor {
            sensor.reads = reads;
        }
        identify_load(&robot, &[&still], &[], &LoadOptions::default()).unwrap()
    };
    let near = found([0.855, 0.0, -9.7727], None);
    let reads = near.sensor.as_ref().unwrap().reads;
    for (gravity, stated) in [
        ([9.81, 0.0, 0.0], None),
        ([-9.81, 0.0, 0.0], Some(reads)),
        ([0.0, -9.81, 0.0], Some(reads)),
    ] {
        let far = found(gravity, stated);
        let sensor = far.sensor.as_ref().unwrap();
        assert_eq!(sensor.reads, reads);
        assert!(sensor.gravity.is_some_and(|g| g[2] < -9.8), "{sensor:?}");
        let either = far
            .warnings
            .iter()
            .any(|w| w.contains("with the other sign"));
        assert_eq!(either, stated.is_none(), "{:?}", far.warnings);
        for (near, far) in near.parameters.iter().zip(&far.parameters) {
            let off = (near.value.value - far.value.value).abs() / near.value.std;
            assert!(off < 0.05, "{near:?} {far:?}");
        }
    }
}

#[test]
fn a_sensor_that_is_late_or_early_is_no_turned_one() {
    let points = tool();
    let moving = Moving::new(tx40(), 0.7, 8);
    let on_time = recorded(
        &moving,
        &points,
        &Sensor::default(),
        [40.0, 200.0],
        9,
        NO_FLAW,
    );
    for rows in [-5i32, 4, 20, 40] {
        // Readings of another time beside the positions.
        let mut recording = on_time.clone();
        let late = rows.unsigned_abs() as usize;
        let block = &mut recording.blocks[0];
        let cut = |list: &mut Vec<f64>, is_late: bool| match is_late {
            true => list.truncate(list.len() - late),
            false => drop(list.drain(..late)),
        };
        cut(&mut block.t, true);
        block
            .joints
            .iter_mut()
            .for_each(|j| cut(&mut j.q, rows < 0));
        block
            .extra
            .iter_mut()
            .for_each(|(_, list)| cut(list, rows > 0));
        let load =
            identify_load(&moving.robot, &[&recording], &[], &LoadOptions::default()).unwrap();
        let sensor = load.sensor.as_ref().unwrap();
        let delay = sensor.delay.expect("a delay");
        assert!((delay - f64::from(rows) / 200.0).abs() < 1e-3, "{delay}");
        let others = [
            sensor.turned.is_some(),
            sensor.gravity.is_some(),
            sensor.position.is_some(),
        ];
        assert_eq!(others, [false; 3], "{:?}", load.warnings);
        for (found, truth) in load.parameters.iter().zip(parameters(&points)) {
            let off = (found.value.value - truth) / found.value.std;
            assert!(off.abs() < 4.5, "{rows}: {found:?}, truth {truth}");
        }
    }
}

#[test]
fn another_origin_of_the_sensor_is_found_in_a_lively_motion() {
    let points = tool();
    let mut robot = tx40();
    robot.wrist_sensor = Some(WristSensor {
        position: [0.01, -0.02, 0.04],
        rotation: [0.0, 0.0, 0.7],
        ..WristSensor::default()
    });
    let moving = Moving::new(robot, 0.8, 8);
    let motion = recorded(
        &moving,
        &points,
        &Sensor::default(),
        [40.0, 200.0],
        9,
        NO_FLAW,
    );
    let mut described = moving.robot.clone();
    described.wrist_sensor.as_mut().unwrap().position = [0.01, 0.02, 0.0];
    let load = identify_load(&described, &[&motion], &[], &LoadOptions::default()).unwrap();
    let sensor = load.sensor.as_ref().unwrap();
    let position = sensor.position.expect("another origin");
    for (found, truth) in position.iter().zip([0.01, -0.02, 0.04]) {
        assert!((found - truth).abs() < 0.01, "{position:?}");
    }
    assert!(sensor.turned.is_none(), "{:?}", load.warnings);
    let [mass, centre] = errors(&load, &points);
    assert!(mass < 0.01 && centre < 0.01, "{mass} {centre}");
}

/// Noise that is correlated over half a second looks like a slow change to a test that takes rows for independent.
#[test]
fn correlated_noise_turns_no_sensor_and_leans_no_base() {
    let points = tool();
    let mut invented = 0;
    for seed in 0..30 {
        let moving = Moving::new(tx40(), 0.6, seed);
        let state = std::cell::RefCell::new(([0.0; 6], rand_pcg::Pcg64::seed_from_u64(seed)));
        let flaw = |_: f64, read: [f64; 6]| {
            let (wander, random) = &mut *state.borrow_mut();
            std::array::from_fn(|c| {
                let keeps: f64 = (-0.02f64 / 0.5).exp();
                let size = if c < 3 { 0.4 } else { 0.04 };
                let noise = 2.0 * random.random::<f64>() - 1.0;
                let drive = 3f64.sqrt() * size * (1.0 - keeps * keeps).sqrt();
                wander[c] = keeps * wander[c] + drive * noise;
                read[c] + wander[c]
            })
        };
        let motion = recorded(
            &moving,
            &points,
            &Sensor::default(),
            [30.0, 50.0],
            seed,
            &flaw,
        );
        let load = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
        let sensor = load.sensor.as_ref().unwrap();
        let drifts = sensor.biases[0].drift.is_some();
        let found = [
            sensor.turned.is_some(),
            sensor.gravity.is_some(),
            sensor.delay.is_some(),
            sensor.position.is_some(),
            drifts,
        ];
        invented += usize::from(found.contains(&true));
        if found.contains(&true) {
            println!("seed {seed}: {found:?} {:?}", load.warnings);
        }
    }
    assert!(invented <= 1, "{invented} of 30");
}

/// Between two messages of the sensor, the noise is interpolated: little of it is left above the band. A force that no load
/// has is told all the same.
#[test]
fn a_sensor_that_is_slower_than_the_joints_is_not_accused() {
    let points = tool();
    let sensor = Sensor {
        noise: [0.2, 0.02],
        ..Sensor::default()
    };
    let cable = |t: f64, mut read: [f64; 6]| {
        read[0] += 0.5 * (3.1 * t).sin();
        read
    };
    let moving = Moving::new(irp6(), 0.8, 5);
    let load = |timing: [f64; 2], flaw: &dyn Fn(f64, [f64; 6]) -> [f64; 6]| {
        let motion = interpolated(&moving, &points, &sensor, timing, 5, flaw);
        identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap()
    };
    for timing in [
        [1000.0, 0.0005],
        [500.0, 0.0],
        [500.0, 0.0003],
        [333.0, 0.0],
        [100.0, 0.004],
    ] {
        let found = load(timing, NO_FLAW);
        assert!(
            found.warnings.is_empty(),
            "{timing:?}: {:?}",
            found.warnings
        );
        let told = found.sensor.unwrap();
        for kind in 0..2 {
            let ratio = told.residual[kind] / told.noise.unwrap()[kind];
            println!("{timing:?} {kind}: residual {ratio} of the noise");
            assert!((0.85..1.15).contains(&ratio), "{timing:?}: {ratio}");
        }
    }
    let found = load([100.0, 0.004], &cable);
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.contains("Something else acts")),
        "{:?}",
        found.warnings
    );
}

#[test]
fn without_noise_nothing_is_told() {
    let moving = Moving::new(irp6(), 0.8, 3);
    let exact = Sensor {
        noise: [0.0; 2],
        ..Sensor::default()
    };
    let motion = recorded(&moving, &tool(), &exact, [30.0, 100.0], 1, NO_FLAW);
    let load = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
    assert_eq!(load.warnings, [""; 0]);
    let [mass, centre] = errors(&load, &tool());
    assert!(mass < 1e-3 && centre < 1e-4, "{mass} {centre}");
}

#[test]
fn readings_of_another_motion_are_refused() {
    let moving = Moving::new(tx40(), 0.7, 8);
    let mut motion = recorded(
        &moving,
        &tool(),
        &Sensor::default(),
        [30.0, 100.0],
        9,
        NO_FLAW,
    );
    let other = Moving::new(tx40(), 0.7, 21);
    let foreign = recorded(
        &other,
        &tool(),
        &Sensor::default(),
        [30.0, 100.0],
        4,
        NO_FLAW,
    );
    motion.blocks[0].extra = foreign.blocks[0].extra.clone();
    let refused = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default());
    let said = refused.expect_err("refused").to_string();
    println!("{said}");
}

/// Each channel of a sound sensor has a gain of its own that is a third of a per cent off. The noise hides it, and the intervals hold
/// the truth only if they count it.
#[test]
fn intervals_hold_the_truth_beside_gains_that_the_noise_hides() {
    const LOADS: usize = 60;
    const GAIN_STD: f64 = 0.003;
    let mut random = rand_pcg::Pcg64::seed_from_u64(29);
    let normal = |random: &mut rand_pcg::Pcg64| -> f64 {
        (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
    };
    let sensor = Sensor {
        noise: [0.4, 0.04],
        ..Sensor::default()
    };
    let points = tool();
    let truth = parameters(&points);
    // Mass and the three of the centre; gains counted, and taken as exact.
    let mut inside = [[0usize; 4]; 2];
    for load in 0..LOADS {
        let gains: [f64; 6] = std::array::from_fn(|_| 1.0 + GAIN_STD * normal(&mut random));
        let flawed = move |_: f64, read: [f64; 6]| std::array::from_fn(|k| gains[k] * read[k]);
        let moving = Moving::new(tx40(), 0.7, load as u64);
        let motion = recorded(
            &moving,
            &points,
            &sensor,
            [12.0, 100.0],
            load as u64,
            &flawed,
        );
        for (counts, gain_std) in inside.iter_mut().zip([Some(GAIN_STD), None]) {
            let mut robot = moving.robot.clone();
            robot.wrist_sensor.as_mut().unwrap().gain_std = gain_std;
            let found = identify_load(&robot, &[&motion], &[], &LoadOptions::default()).unwrap();
            let off = (found.mass.value - truth[0]).abs();
            counts[0] += usize::from(off <= found.mass.half_interval);
            for k in 0..3 {
                let off = (found.centre[k].value - truth[k + 1] / truth[0]).abs();
                counts[k + 1] += usize::from(off <= found.centre[k].half_interval);
            }
        }
    }
    println!("of {LOADS} intervals {inside:?} contain mass and centre");
    let [counted, exact] = inside.map(|counts| counts.map(|c| c as f64 / LOADS as f64));
    // 95 % less three deviations of a binomial of 60.
    assert!(counted.iter().all(|share| *share >= 0.86), "{inside:?}");
    assert!(exact[0] < 0.8, "{inside:?}");
}

/// The effect that is stated is that of a gain: the mass moves by it where a channel is scaled.
#[test]
fn the_stated_effect_of_gains_is_that_of_a_scaled_channel() {
    let points = tool();
    let sensor = Sensor::default();
    let moving = Moving::new(irp6(), 0.8, 3);
    let mass = |gains: [f64; 6]| {
        let flawed = move |_: f64, read: [f64; 6]| std::array::from_fn(|k| gains[k] * read[k]);
        let motion = recorded(&moving, &points, &sensor, [20.0, 100.0], 3, &flawed);
        identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap()
    };
    let plain = mass([1.0; 6]);
    let stated = plain.sensor.as_ref().unwrap().gain_error;
    assert_eq!(stated.counted, 0.0);
    let mut squares = 0.0;
    for channel in 0..6 {
        let mut gains = [1.0; 6];
        // So small that it is not told from the noise.
        gains[channel] += 1e-3;
        let found = mass(gains);
        squares += ((found.mass.value - plain.mass.value) * stated.example / 1e-3).powi(2);
    }
    assert!(
        (squares.sqrt() / stated.mass - 1.0).abs() < 0.02,
        "{} {stated:?}",
        squares.sqrt()
    );
}

/// No recording shows a factor in all readings; a weighed load does.
#[test]
fn a_known_mass_tells_kgf_at_rest() {
    let points = tool();
    let weighed = |mass: f64| LoadOptions {
        known_mass: Some(KnownMass { mass, std: 0.002 }),
        ..LoadOptions::default()
    };
    let truth = parameters(&points)[0];
    let moving = Moving::new(irp6(), 0.8, 5);
    let list: Vec<Vec<f64>> = (0..10)
        .map(|k| moving.position(3.1 * f64::from(k)))
        .collect();
    let still = poses(&moving, &points, &Sensor::default(), &list, 5);
    let found = identify_load(&moving.robot, &[&still], &[], &weighed(truth)).unwrap();
    assert!(
        found.mass_checks[0].chance > 1e-3,
        "{:?}",
        found.mass_checks
    );
    let contradicts = |w: &String| w.contains("known mass");
    assert!(
        !found.warnings.iter().any(contradicts),
        "{:?}",
        found.warnings
    );
    for (channels, in_newton_metres) in [(3, true), (6, false)] {
        let mut other = still.clone();
        for (_, column) in other.blocks[0].extra.iter_mut().take(channels) {
            column.iter_mut().for_each(|value| *value /= 9.80665);
        }
        let silent = identify_load(&moving.robot, &[&other], &[], &LoadOptions::default()).unwrap();
        assert!((silent.mass.value * 9.80665 / truth - 1.0).abs() < 0.01);
        let refused = identify_load(&moving.robot, &[&other], &[], &weighed(truth));
        let text = refused.unwrap_err().to_string();
        assert!(
            text.contains("forces look like kgf") && text.contains("--unit fx=kgf"),
            "{text}"
        );
        // The centre of mass of the readings' true units is one of the two that it gives.
        let height = parameters(&points)[3] / truth;
        let (_, places) = text.split_once("if the centre of mass is at ").unwrap();
        let [both, forces_alone] = [0, 1].map(|k| {
            let place = places
                .split(" m in the flange frame; with the moments in N·m it is at ")
                .nth(k)
                .unwrap();
            let last = place
                .split(" m")
                .next()
                .unwrap()
                .rsplit(", ")
                .next()
                .unwrap();
            last.parse::<f64>().unwrap()
        });
        let right = if in_newton_metres { forces_alone } else { both };
        assert!((right - height).abs() < 0.005, "{text}");
    }
    // A factor of no unit.
    let mut off = still.clone();
    for (_, column) in &mut off.blocks[0].extra {
        column.iter_mut().for_each(|value| *value *= 1.12);
    }
    let found = identify_load(&moving.robot, &[&off], &[], &weighed(truth)).unwrap();
    let check = found.mass_checks[0];
    assert!((check.factor - 1.12).abs() < 4.0 * check.std, "{check:?}");
    assert!(
        (found.warnings.iter()).any(|w| w.starts_with("The sensor shows 1.1")),
        "{:?}",
        found.warnings
    );
}
