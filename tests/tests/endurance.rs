//! On-line estimates through what a long day brings: an hour of standstill, a payload, a wrapping encoder.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::time::Duration;

use rig_link::Device;
use rig_plant::{Body, PlantConfig};
use rig_shared::link::PARAMETER_NAMES;
use rig_shared::safety::Mode;
use rig_shared::wire::encode;
use rig_shared::wire::message::{Estimate, Report, Request, RequestBody};
use rig_tests::{bench, calibrated, connect, driven, excitation, nameplate};

/// Half an hour, in ticks of 10 kHz.
const HALF_HOUR: u64 = 18_000_000;
/// Ticks between two signs of life: a quarter of a second.
const SIGN_OF_LIFE: u64 = 2_500;

/// A frame that says that the host is there.
fn sign_of_life(id: u16) -> ([u8; 64], usize) {
    let mut frame = [0; 64];
    let body = RequestBody::KeepAlive;
    let length = encode(&Request { id, body }, &mut frame).unwrap();
    (frame, length)
}

/// What a published estimate may never be: not finite, or outside its band.
fn check_band(estimate: &Estimate, lower: &[f32; 6], upper: &[f32; 6]) {
    for k in 0..6 {
        let (value, std) = (estimate.value[k], estimate.std[k]);
        assert!(
            (lower[k]..=upper[k]).contains(&value) && std.is_finite() && std >= 0.0,
            "{} {value} ± {std} at tick {}",
            PARAMETER_NAMES[k],
            estimate.tick
        );
    }
}

#[test]
fn an_hour_of_standstill_moves_nothing() {
    // Two steps of integration to a tick instead of ten: nothing moves, and the hour is over sooner.
    let plant = PlantConfig {
        substeps: 2,
        ..PlantConfig::laboratory(1)
    };
    let mut line = connect(&nameplate(&plant), plant.clone(), 1);
    calibrated(&mut line);
    line.request(RequestBody::SetPosition(plant.initial_position as f32))
        .unwrap();
    driven(&mut line, vec![], excitation(2, 5, 4), 0.5);
    let before = driven(&mut line, vec![], excitation(3, 5, 4), 0.5).estimate();
    assert_eq!(before.trusted, [true; 6]);
    let band = nameplate(&plant).settings.estimator;

    line.request(RequestBody::Arm).unwrap();
    let rig = line.port_mut().device_mut();
    let mut scratch = Vec::new();
    let mut after = before;
    let mut reports = 0_u64;
    let mut farthest = [0.0_f32; 6];
    for (half, mode) in [(0, Mode::Holding), (1, Mode::Disarmed)] {
        if half == 1 {
            let mut frame = [0; 64];
            let body = RequestBody::Disarm;
            let length = encode(&Request { id: 0x7FFF, body }, &mut frame).unwrap();
            rig.exchange(&frame[..length], &mut scratch);
        }
        for tick in 0..HALF_HOUR {
            if tick % SIGN_OF_LIFE == 0 {
                scratch.clear();
                let id = 0x8000 + (tick / SIGN_OF_LIFE) as u16;
                let (frame, length) = sign_of_life(id);
                rig.exchange(&frame[..length], &mut scratch);
            }
            let output = rig.tick();
            assert_eq!(output.fault, None);
            if let Some(estimate) = output.estimate {
                check_band(&estimate, &band.lower, &band.upper);
                assert_eq!(estimate.trusted, before.trusted, "{estimate:?}");
                for k in 0..6 {
                    let moved = (estimate.value[k] - before.value[k]).abs() / before.std[k];
                    farthest[k] = farthest[k].max(moved);
                    let wider = estimate.std[k] / before.std[k];
                    assert!((0.5..=2.0).contains(&wider), "std × {wider}: {estimate:?}");
                }
                reports += 1;
                after = estimate;
            }
        }
        assert_eq!(rig.state().mode, mode);
    }
    let truth = plant.equivalent().to_array();
    let mut text =
        String::from("parameter  before      after       std         truth      farthest\n");
    let mut fair = reports > 70_000;
    for k in 0..6 {
        text += &format!(
            "{:<9} {:>10.6} {:>10.6} {:>10.6} {:>10.6} {:>8.3} std\n",
            PARAMETER_NAMES[k],
            before.value[k],
            after.value[k],
            after.std[k],
            truth[k],
            farthest[k]
        );
        let miss = (f64::from(after.value[k]) - truth[k]).abs();
        fair &= farthest[k] <= 1.0 && miss <= 4.0 * f64::from(after.std[k]);
    }
    println!("{text}");
    assert!(fair, "{reports} reports\n{text}");
}

#[test]
fn a_payload_taken_up_in_motion_is_found() {
    let mut text =
        String::from("rig  parameter  before      after       std         truth   trusted\n");
    let mut wrong = Vec::new();
    for seed in 0..4 {
        let (mut line, plant) = bench(seed);
        let payload = Body {
            mass: 0.4,
            distance: 0.3,
            angle: 0.0,
            inertia: 1.0e-3,
        };
        let mut loaded = plant.clone();
        loaded.mechanism.bodies.push(payload);
        let truth = loaded.equivalent().to_array();
        let band = nameplate(&plant).settings.estimator;
        line.request(RequestBody::SetTrajectory(excitation(seed, 5, 22)))
            .unwrap();
        line.request(RequestBody::Arm).unwrap();
        line.request(RequestBody::Start).unwrap();
        // Estimates come at 20 Hz.
        let (change, patience) = (30.0, 30.0);
        let (mut before, mut last) = (None, None);
        for count in 0..20 * 100 {
            if count == (20.0 * change) as u32 {
                before = last;
                let faults = line.port_mut().device_mut().plant_mut().faults_mut();
                faults.payload = Some(payload);
            }
            let estimate = loop {
                match line
                    .next_report(Duration::from_millis(500))
                    .unwrap()
                    .unwrap()
                {
                    Report::Estimate(estimate) => break estimate,
                    Report::Fault(fault) => panic!("seed {seed}: {fault:?}"),
                    _ => {}
                }
            };
            check_band(&estimate, &band.lower, &band.upper);
            if f64::from(count) >= 20.0 * (change + patience) {
                for k in 0..6 {
                    let z = (f64::from(estimate.value[k]) - truth[k]) / f64::from(estimate.std[k]);
                    if estimate.trusted[k] && z.abs() > 4.0 {
                        wrong.push(format!(
                            "{seed}: {} {z:.1} std off, {:.2} s after the change",
                            PARAMETER_NAMES[k],
                            f64::from(count) / 20.0 - change
                        ));
                    }
                }
            }
            last = Some(estimate);
        }
        assert_eq!(line.port().device().state().mode, Mode::Running);
        let (before, last) = (before.unwrap(), last.unwrap());
        for k in 0..6 {
            text += &format!(
                "{seed:>3}  {:<9} {:>10.6} {:>10.6} {:>10.6} {:>10.6} {}\n",
                PARAMETER_NAMES[k],
                before.value[k],
                last.value[k],
                last.std[k],
                truth[k],
                last.trusted[k]
            );
        }
        if last.trusted != [true; 6] {
            wrong.push(format!(
                "{seed}: not trusted in the end: {:?}",
                last.trusted
            ));
        }
    }
    println!("{text}");
    let shown = wrong.len().min(20);
    assert!(
        wrong.is_empty(),
        "\n{text}{} times:\n{}",
        wrong.len(),
        wrong[..shown].join("\n")
    );
}

#[test]
fn a_wrapping_counter_loses_no_count() {
    let mut plant = PlantConfig::laboratory(3);
    let encoder = &mut plant.sensors.encoder;
    let per_radian = encoder.counts_per_turn * plant.mechanism.ratio / std::f64::consts::TAU;
    // Six counts below the wrap at power on.
    encoder.zero = plant.initial_position - 65_530.5 / per_radian;
    let encoder = *encoder;
    let mut line = connect(&nameplate(&plant), plant.clone(), 3);
    calibrated(&mut line);
    line.request(RequestBody::SetPosition(plant.initial_position as f32))
        .unwrap();
    let motion = excitation(7, 5, 30);
    let seconds = motion.duration_micros() / 1_000_000;
    line.request(RequestBody::SetTrajectory(motion)).unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();

    let rig = line.port_mut().device_mut();
    let ratio = plant.mechanism.ratio;
    let mut scratch = Vec::new();
    let (mut window, mut sum) = (0, 0_i64);
    let (mut turn, mut wraps) = (None, 0);
    let mut origin = None;
    let mut windows = 0;
    for tick in 0..10_000 * seconds {
        if tick % SIGN_OF_LIFE == 0 {
            // Takes ten ticks, a whole telemetry window, that are not seen here.
            scratch.clear();
            let (frame, length) = sign_of_life(0x8000 + (tick / SIGN_OF_LIFE) as u16);
            rig.exchange(&frame[..length], &mut scratch);
        }
        let output = rig.tick();
        assert_eq!(output.fault, None);
        let shaft = rig.plant().truth().motor_position - encoder.zero * ratio;
        let count = (shaft / std::f64::consts::TAU * encoder.counts_per_turn).floor() as i64;
        let now = count.div_euclid(1 << 16);
        wraps += u32::from(turn.is_some_and(|before| before != now));
        turn = Some(now);
        (window, sum) = (window + 1, sum + count);
        if let Some((_, sample)) = output.state {
            if window == 10 {
                let origin = *origin.get_or_insert(sum - sample.position_sum);
                let off = sum - origin - sample.position_sum;
                assert!(
                    off.abs() <= 10,
                    "{off} tenths of a count off at tick {tick}"
                );
                windows += 1;
            }
            (window, sum) = (0, 0);
        }
    }
    // The origin itself: where the link was told to stand.
    let zero = origin.unwrap() as f64 / 10.0;
    let told = 65_530.5 - plant.initial_position * per_radian;
    println!(
        "{wraps} wraps, {windows} windows, origin {:.1} counts from what was told",
        zero - told
    );
    assert!((zero - told).abs() < 50.0, "{zero} {told}");
    assert!(wraps >= 50 && windows > 90 * seconds, "{wraps} {windows}");
}
