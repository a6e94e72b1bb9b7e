#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;
use crate::safety::Limits;
use heapless::Vec;
use std::vec;

fn fourier(periods: u16) -> Trajectory<f64> {
    Trajectory::Fourier(Fourier {
        period_us: 9_999_999,
        periods,
        ramp_us: 2_000_000,
        sine: Vec::from_slice(&[0.5, -0.2, 0.1, 0.05, -0.04]).unwrap(),
        cosine: Vec::from_slice(&[0.3, 0.1, -0.1, 0.02, 0.03]).unwrap(),
    })
}

fn chirp(sweep: Sweep, duration_us: u32) -> Trajectory<f64> {
    Trajectory::Chirp(Chirp {
        start_hz: 0.2,
        end_hz: 8.0,
        sweep,
        duration_us,
        ramp_us: 3_000_000,
        amplitude: 0.5,
        velocity: 3.0,
        acceleration: 40.0,
        again: 0.25,
    })
}

fn staircase() -> Trajectory<f64> {
    Trajectory::Staircase(Staircase {
        levels: Vec::from_slice(&[0.5, 1.0, -0.5]).unwrap(),
        move_us: 800_000,
        dwell_us: 300_000,
    })
}

fn reversals() -> Trajectory<f64> {
    Trajectory::SlowReversals(SlowReversals::new(0.05, 0.2, &[0.1, 0.03], 2).unwrap())
}

fn sweep() -> Trajectory<f64> {
    Trajectory::FrictionSweep(FrictionSweep::new(&[0.1, 1.0, 3.0], 0.8, 0.25, 0.1, 1.0).unwrap())
}

fn all() -> std::vec::Vec<Trajectory<f64>> {
    vec![
        Trajectory::Hold(3_000_000),
        fourier(2),
        chirp(Sweep::Linear, 20_000_000),
        chirp(Sweep::Logarithmic, 20_000_000),
        staircase(),
        reversals(),
        sweep(),
    ]
}

fn limits() -> Limits<f64> {
    Limits {
        position_low: -3.0,
        position_high: 3.0,
        velocity: 6.0,
        acceleration: 60.0,
        ..Limits::default()
    }
}

#[test]
fn derivatives_are_those_of_the_position_and_nothing_jumps() {
    for trajectory in all() {
        let end = trajectory.duration();
        let extremes = trajectory.extremes();
        let h = 2e-5;
        let mut before = trajectory.at(0.0);
        for k in 1..(end / h) as u32 {
            let t = f64::from(k) * h;
            let here = trajectory.at(t);
            // The mean of both ends' slopes equals the chord's, up to h²/12 times the third derivative.
            let chord = (here.position - before.position) / h;
            let slope = 0.5 * (here.velocity + before.velocity);
            assert!(
                (chord - slope).abs() < 1e-5,
                "{trajectory:?} at {t}: {chord} {slope}"
            );
            let chord = (here.velocity - before.velocity) / h;
            let slope = 0.5 * (here.acceleration + before.acceleration);
            assert!(
                (chord - slope).abs() < 1e-2,
                "{trajectory:?} at {t}: {chord} {slope}"
            );
            assert!((here.acceleration - before.acceleration).abs() < 0.2);
            assert!(
                here.position <= extremes.highest + 1e-4 && here.position >= extremes.lowest - 1e-4
            );
            assert!(here.velocity.abs() <= extremes.velocity * 1.0001 + 1e-12);
            assert!(here.acceleration.abs() <= extremes.acceleration * 1.0001 + 1e-12);
            before = here;
        }
        let first = trajectory.at(0.0);
        for rest in [first, before, trajectory.at(end + 1.0)] {
            assert!(
                rest.position.abs() < 1e-5 && rest.velocity.abs() < 1e-3,
                "{trajectory:?}"
            );
        }
    }
}

#[test]
fn extremes_are_reached() {
    for trajectory in [fourier(2), staircase(), reversals(), sweep()] {
        let extremes = trajectory.extremes();
        let steps = (trajectory.duration() * 1e4) as u32;
        let mut seen = Extremes::<f64>::default();
        for k in 0..steps {
            let at = trajectory.at_tick(u64::from(k), 10_000);
            seen.highest = seen.highest.max(at.position);
            seen.lowest = seen.lowest.min(at.position);
            seen.velocity = seen.velocity.max(at.velocity.abs());
            seen.acceleration = seen.acceleration.max(at.acceleration.abs());
        }
        assert!((seen.highest - extremes.highest).abs() < 1e-4);
        assert!((seen.lowest - extremes.lowest).abs() < 1e-4);
        assert!((seen.velocity / extremes.velocity - 1.0).abs() < 1e-3);
        assert!((seen.acceleration / extremes.acceleration - 1.0).abs() < 1e-3);
    }
}

#[test]
fn twenty_five_minutes_in_single_precision_stay_smooth() {
    let long = 25 * 60 * 1_000_000;
    let hold = SlowReversals::new(0.01, 0.5, &[1.0, 0.5], 3).unwrap();
    for double in [
        fourier(150),
        chirp(Sweep::Linear, long),
        chirp(Sweep::Logarithmic, long),
        Trajectory::SlowReversals(hold),
    ] {
        let single = double.to_f32();
        let double = single.to_f64();
        let ticks = double.duration_micros() / 100;
        assert!(ticks >= 20 * 60 * 10_000 / 2);
        for from in [0, ticks / 3, ticks * 9 / 10] {
            for tick in from..from + 30_000 {
                let (a, b) = (single.at_tick(tick, 10_000), double.at_tick(tick, 10_000));
                assert!(
                    (f64::from(a.position) - b.position).abs() < 1e-6,
                    "{double:?} {tick}"
                );
                assert!(
                    (f64::from(a.velocity) - b.velocity).abs() < 1e-5,
                    "{double:?} {tick}"
                );
                assert!(
                    (f64::from(a.acceleration) - b.acceleration).abs() < 2e-4,
                    "{double:?} {tick}"
                );
            }
        }
    }
}

#[test]
fn a_fourier_series_repeats_exactly_after_any_number_of_periods() {
    let single = fourier(60_000).to_f32();
    let Trajectory::Fourier(motion) = &single else {
        panic!()
    };
    let first = u64::from(motion.ramp_us) + 1_234_567;
    for period in [1_u64, 1_000, 59_000] {
        let later = first + period * u64::from(motion.period_us);
        assert_eq!(
            single.at_tick(first, 1_000_000),
            single.at_tick(later, 1_000_000)
        );
    }
}

#[test]
fn ticks_that_are_no_whole_microseconds_are_not_rounded() {
    let trajectory = fourier(2);
    for tick in 0..60_000_u64 {
        let (a, b) = (
            trajectory.at_tick(tick, 7_001),
            trajectory.at(tick as f64 / 7_001.0),
        );
        assert!((a.position - b.position).abs() < 1e-12);
    }
}

#[test]
fn a_sweep_holds_each_speed_over_the_stated_travel_in_both_directions() {
    let trajectory = sweep();
    for speed in [0.1, 1.0, 3.0] {
        for sign in [1.0, -1.0] {
            let mut travelled = 0.0_f64;
            for k in 0..(trajectory.duration() * 1e4) as u64 {
                let at = trajectory.at_tick(k, 10_000);
                if (at.velocity - sign * speed).abs() < 1e-5 && at.acceleration.abs() < 1e-9 {
                    travelled += speed * 1e-4;
                }
            }
            assert!(travelled >= 0.8 - 1e-3, "{speed} {sign}: {travelled}");
        }
    }
}

#[test]
fn reversals_reach_the_asked_amplitudes_at_the_asked_speed() {
    let Trajectory::SlowReversals(motion) = reversals() else {
        panic!()
    };
    assert!((motion.amplitude(0).unwrap() - 0.1).abs() < 1e-7);
    assert!((motion.amplitude(1).unwrap() - 0.03).abs() < 1e-7);
    let extremes = reversals().extremes();
    assert!((extremes.highest - 0.1).abs() < 1e-7 && (extremes.lowest + 0.1).abs() < 1e-7);
    assert!((extremes.velocity - 0.05).abs() < 1e-12);
    assert_eq!(SlowReversals::new(0.05, 0.2, &[0.001], 2), None);
}

#[test]
fn the_check_names_the_limit_and_the_time() {
    for trajectory in all() {
        assert!(trajectory.check(&limits(), 0.0).is_ok(), "{trajectory:?}");
    }
    let staircase = staircase();
    match staircase.check(&limits(), 2.2) {
        Err(TrajectoryError::PositionHigh { time, value, limit }) => {
            // The second step, from 0.5 to 1.0, begins at 1.1 s and ends at 1.9 s.
            assert!(time > 1.1 && time <= 1.9 && value > 3.0 && limit == 3.0);
        }
        other => panic!("{other:?}"),
    }
    assert!(matches!(
        staircase.check(&limits(), -2.6),
        Err(TrajectoryError::PositionLow { .. })
    ));
    let slow = Limits {
        velocity: 1.0,
        ..limits()
    };
    assert!(
        matches!(sweep().check(&slow, 0.0), Err(TrajectoryError::Velocity { value, .. }) if value > 1.0)
    );
    let gentle = Limits {
        acceleration: 1.0,
        ..limits()
    };
    let error = fourier(1).check(&gentle, 0.0).unwrap_err();
    assert!(matches!(error, TrajectoryError::Acceleration { .. }));
    assert!(std::format!("{error}").contains("rad/s^2"));
    let mut broken = fourier(1);
    if let Trajectory::Fourier(motion) = &mut broken {
        motion.sine[2] = f64::NAN;
    }
    assert_eq!(
        broken.check(&limits(), 0.0),
        Err(TrajectoryError::BadValue("sine"))
    );
}

#[test]
fn a_chirp_keeps_its_limits_all_the_way() {
    for kind in [Sweep::Linear, Sweep::Logarithmic] {
        let extremes = chirp(kind, 60_000_000).extremes();
        assert!(
            extremes.highest <= 0.5
                && extremes.velocity <= 3.0 * 1.02
                && extremes.acceleration <= 40.0 * 1.02
        );
        assert!(
            extremes.velocity > 2.0 && extremes.acceleration > 25.0,
            "it must come near them: {extremes:?}"
        );
    }
}

#[test]
fn crosses_the_wire_unchanged() {
    for trajectory in all() {
        let single = trajectory.to_f32();
        let mut buffer = [0_u8; 256];
        let bytes = postcard::to_slice(&single, &mut buffer).unwrap();
        assert_eq!(
            postcard::from_bytes::<Trajectory<f32>>(bytes).unwrap(),
            single
        );
    }
}

#[test]
fn hostile_values_neither_panic_nor_run_for_ever() {
    let hostile = [
        Trajectory::Fourier(Fourier {
            period_us: 0,
            periods: u16::MAX,
            ramp_us: 0,
            sine: Vec::new(),
            cosine: Vec::from_slice(&[f32::NAN]).unwrap(),
        }),
        Trajectory::SlowReversals(SlowReversals {
            speed: f32::INFINITY,
            half_turn_us: u32::MAX,
            quarter_us: Vec::from_slice(&[u32::MAX, 0]).unwrap(),
            cycles: u16::MAX,
        }),
        Trajectory::FrictionSweep(FrictionSweep {
            half_span: -1.0,
            cruise_us: Vec::from_slice(&[u32::MAX]).unwrap(),
            ramp_us: u32::MAX,
            dwell_us: 0,
            lead_us: 0,
        }),
        Trajectory::Staircase(Staircase {
            levels: Vec::from_slice(&[f32::NAN]).unwrap(),
            move_us: 0,
            dwell_us: u32::MAX,
        }),
        Trajectory::Chirp(Chirp {
            start_hz: -1.0,
            end_hz: 0.0,
            sweep: Sweep::Logarithmic,
            duration_us: 5,
            ramp_us: u32::MAX,
            amplitude: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
            again: 0.0,
        }),
    ];
    // The ratio of these frequencies overflows any scalar.
    let boundless = Trajectory::Chirp(Chirp {
        start_hz: 1e-30,
        end_hz: 1e30,
        sweep: Sweep::Logarithmic,
        duration_us: 1_000_000,
        ramp_us: 1000,
        amplitude: 0.1,
        velocity: 1.0,
        acceleration: 1.0,
        again: 0.0,
    });
    let limits = Limits {
        position_low: -3.0_f32,
        position_high: 3.0,
        velocity: 6.0,
        acceleration: 60.0,
        ..Limits::default()
    };
    assert!(boundless.check(&limits, 0.0).is_err());
    for trajectory in hostile {
        assert!(
            matches!(
                trajectory.check(&limits, 0.0),
                Err(TrajectoryError::BadValue(_))
            ),
            "{trajectory:?}"
        );
        for tick in [0, 1, 77_777, u64::MAX / 2, u64::MAX] {
            for rate in [0, 1, 10_000, u32::MAX] {
                let _ = trajectory.at_tick(tick, rate);
            }
        }
        let _ = (
            trajectory.at(f32::NAN),
            trajectory.at(-1.0),
            trajectory.at(f32::MAX),
        );
    }
}
