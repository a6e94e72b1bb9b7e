//! Tests of the observer on known motions.

use super::*;
use core::f64::consts::TAU;

const RATE: f64 = 10_000.0;

fn code(position: f64) -> EncoderCount {
    EncoderCount((position.floor() as i64).rem_euclid(65_536) as u16)
}

#[test]
fn unwraps_both_ways() {
    assert_eq!(difference(EncoderCount(3), EncoderCount(65_530)), 9);
    assert_eq!(difference(EncoderCount(65_530), EncoderCount(3)), -9);
    let config = Config::<f32>::new(100.0, 1e4);
    let mut state = State::default();
    let mut position = 100_i64;
    let moves = [
        30_000_i64, 30_000, 30_000, -32_000, -32_000, -32_000, -32_000, 7, -32_768,
    ];
    step(&config, &mut state, EncoderCount(100), None);
    for m in moves {
        position += m;
        let m = step(
            &config,
            &mut state,
            EncoderCount(position.rem_euclid(65_536) as u16),
            None,
        );
        assert_eq!(m.counts, position);
    }
    let mut motion = Motion::<f32> {
        counts: -1,
        fraction: 0.5,
        ..Motion::default()
    };
    assert!((f64::from(motion.angle_in_turn(4096)) - TAU * (1.0 - 0.5 / 4096.0)).abs() < 1e-6);
    motion.counts = (1 << 45) * 4096 + 1024;
    assert!((f64::from(motion.angle_in_turn(4096)) - TAU / 4.0).abs() < 1e-3);
}

/// Returns amplitude ratio and phase (rad) of velocity and acceleration for q = A·sin 2πft, with `f32` inside.
fn response(bandwidth: f64, f: f64, amplitude: f64) -> [(f64, f64); 2] {
    let config = Config::<f32>::new(bandwidth as f32, RATE as f32);
    let mut state = State::default();
    let w = TAU * f;
    let mut sums = [0.0; 4];
    let periods = (4.0 * f).max(4.0).round();
    let n = (periods / f * RATE).round() as usize;
    for k in 0..2 * n {
        let t = k as f64 / RATE;
        let m = step(&config, &mut state, code(amplitude * (w * t).sin()), None);
        if k >= n {
            let (s, c) = (w * t).sin_cos();
            for (sum, x) in sums.iter_mut().zip([
                f64::from(m.velocity) * c,
                f64::from(m.velocity) * s,
                f64::from(m.acceleration) * -s,
                f64::from(m.acceleration) * c,
            ]) {
                *sum += 2.0 * x / n as f64;
            }
        }
    }
    // v = A·w·cos; its lag is the part along sin. a = −A·w²·sin; its lag is along cos.
    let v = (
        sums[0].hypot(sums[1]) / (amplitude * w),
        sums[1].atan2(sums[0]),
    );
    let a = (
        sums[2].hypot(sums[3]) / (amplitude * w * w),
        sums[3].atan2(sums[2]),
    );
    [v, a]
}

#[test]
fn bandwidth_and_delay_are_as_stated() {
    let [(corner, _), _] = response(100.0, 100.0, 2000.0);
    assert!((corner - 0.5_f64.sqrt()).abs() < 0.03, "{corner}");
    for f in [1.0, 5.0] {
        let [(gain, phase), (a_gain, a_phase)] = response(100.0, f, 60_000.0);
        let config = Config::new(100.0, RATE);
        let w = TAU * f;
        let x = w / config.pole;
        let expected = ((1.0 + 9.0 * x * x) / (1.0 + x * x).powi(3)).sqrt();
        assert!((gain - expected).abs() < 2e-3, "{f}: {gain} {expected}");
        // Lag of (3s+ω)ω²/(s+ω)³: of third order in frequency, 0 s at 1 Hz and 0.14 ms at 5 Hz.
        let lag = (3.0 * x.atan() - (3.0 * x).atan()) / w;
        assert!((phase / w - lag).abs() < 1e-4, "{f}: delay {} s", phase / w);
        assert!(
            (a_gain - (1.0 + x * x).powf(-1.5)).abs() < 0.01,
            "{f}: {a_gain}"
        );
        let delay = a_phase / w;
        assert!(
            (delay - config.acceleration_delay()).abs() < 2e-4,
            "{f}: {delay}"
        );
    }
}

#[test]
fn constant_acceleration_leaves_no_lag() {
    for (bandwidth, acceleration) in [(100.0, 4e5), (50.0, -3e4)] {
        let config = Config::<f32>::new(bandwidth, RATE as f32);
        let mut state = State::default();
        let mut worst = [0.0_f64; 3];
        for k in 0..20_000 {
            let t = f64::from(k) / RATE;
            let q = 0.5 * acceleration * t * t;
            let m = step(&config, &mut state, code(q), None);
            if k > 5000 {
                let first = code(0.0).0 as i64;
                worst[0] =
                    worst[0].max(((m.counts - first) as f64 + f64::from(m.fraction) - q).abs());
                worst[1] = worst[1].max((f64::from(m.velocity) - acceleration * t).abs());
                worst[2] += (f64::from(m.acceleration) - acceleration) / 15_000.0;
            }
        }
        assert!(worst[0] < 1.0, "{worst:?}");
        assert!(worst[1] < 300.0, "{worst:?}");
        assert!(worst[2].abs() < 0.01 * acceleration.abs(), "{worst:?}");
    }
}

/// Returns the RMS error of the velocity (counts/s), and that of a linear observer of the same bandwidth. The speed
/// wanders by a hundredth, so that edges do not lock to the samples.
fn ripple(speed: f64, bandwidth: f64) -> (f64, f64) {
    let config = Config::<f32>::new(bandwidth as f32, RATE as f32);
    let mut state = State::default();
    let pole = config.pole as f64;
    let (mut p, mut v, mut a) = (0.0, 0.0, 0.0);
    let (mut sum, mut linear) = (0.0, 0.0);
    let seconds = (200.0 / speed).clamp(2.0, 400.0);
    let n = (seconds * RATE) as usize;
    let w = TAU / seconds * 3.0;
    for k in 0..n {
        let t = k as f64 / RATE;
        let q = speed * (t + 0.01 / w * (w * t).sin());
        let truth = speed * (1.0 + 0.01 * (w * t).cos());
        let m = step(&config, &mut state, code(q), None);
        let h = 1.0 / RATE;
        let e = q.floor() + 0.5 - p;
        p += h * (v + 3.0 * pole * e);
        v += h * (a + 3.0 * pole * pole * e);
        a += h * pole.powi(3) * e;
        if k > n / 2 {
            sum += (f64::from(m.velocity) - truth).powi(2);
            linear += (v - truth).powi(2);
        }
    }
    let count = (n / 2) as f64;
    ((sum / count).sqrt(), (linear / count).sqrt())
}

#[test]
fn ripple_at_low_speed() {
    // (counts/s, largest allowed ripple as a share of the speed)
    for (speed, share) in [(1.0, 0.05), (10.0, 0.05), (100.0, 0.05), (1000.0, 0.1)] {
        let (ours, linear) = ripple(speed, 100.0);
        std::println!("{speed} counts/s: ripple {ours:.4}, linear observer {linear:.3} counts/s");
        assert!(ours < share * speed, "{speed}: {ours}");
        assert!(ours < 0.5 * linear, "{speed}: {ours} {linear}");
    }
    for speed in [5e3, 2e4, 4e5] {
        let (ours, linear) = ripple(speed, 100.0);
        std::println!("{speed} counts/s: ripple {ours:.4}, linear observer {linear:.3} counts/s");
        assert!(ours < 1.5 * linear + 1.0, "{speed}: {ours} {linear}");
    }
}

#[test]
fn comes_to_rest_without_limit_cycle() {
    for end in [0.03_f64, 0.5, 0.97] {
        let config = Config::<f32>::new(100.0, RATE as f32);
        let mut state = State::default();
        let mut signs = 0;
        let mut old = 0.0_f32;
        for k in 0..200_000 {
            let t = f64::from(k) / RATE;
            let q = end - 3000.0 * (-t / 0.05).exp();
            let m = step(&config, &mut state, code(q), None);
            if t > 2.0 {
                assert!(
                    f64::from(m.velocity.abs()) <= 1.001 / (t - 1.0),
                    "{t}: {m:?}"
                );
                signs += i32::from(m.velocity * old < 0.0);
                old = m.velocity;
                assert!((-0.001..=1.001).contains(&m.fraction));
            }
        }
        assert!(signs <= 2, "{signs} changes of sign at rest");
    }
}

#[test]
fn dither_on_an_edge_is_no_motion() {
    let config = Config::<f32>::new(100.0, RATE as f32);
    let mut state = State::default();
    let mut sum = 0.0;
    for k in 0..50_000 {
        let q = 0.1 * (TAU * 37.0 * f64::from(k) / RATE).sin();
        let m = step(&config, &mut state, code(q), None);
        if k > 5000 {
            sum += f64::from(m.velocity).powi(2) / 45_000.0;
        }
    }
    // True rms velocity is 16 counts/s; a linear observer of counts shows about 70.
    assert!(sum.sqrt() < 30.0, "{}", sum.sqrt());
}

#[test]
fn coarse_encoder_follows_a_swing() {
    // 2048 counts a turn, ±1 rad at 0.5 Hz: 652 counts/s at most.
    let config = Config::<f32>::new(40.0, RATE as f32);
    let mut state = State::default();
    let (amplitude, w) = (2048.0 / TAU, TAU * 0.5);
    let mut sum = 0.0;
    for k in 0..100_000 {
        let t = f64::from(k) / RATE;
        let m = step(&config, &mut state, code(amplitude * (w * t).sin()), None);
        if k >= 20_000 {
            sum += (f64::from(m.velocity) - amplitude * w * (w * t).cos()).powi(2) / 80_000.0;
        }
    }
    let rms = sum.sqrt();
    std::println!(
        "coarse encoder: rms velocity error {rms:.2} counts/s of {:.0}",
        amplitude * w
    );
    assert!(rms < 0.03 * amplitude * w, "{rms}");
}

/// An encoder whose edge k lies at k + offset[k mod 4] counts, timed by a counter at 170 MHz.
struct Lines {
    offset: [f64; 4],
    timed: bool,
    before: f64,
}

impl Lines {
    fn edge(&self, k: i64) -> f64 {
        k as f64 + self.offset[k.rem_euclid(4) as usize]
    }

    fn count(&self, q: f64) -> i64 {
        let near = q.round() as i64;
        if self.edge(near) <= q { near } else { near - 1 }
    }

    /// Returns the reading at `q`, and the age of its last edge if the count has changed. Within a sample the motion is
    /// straight to a ten-thousandth of a count in the tests below.
    fn sample(&mut self, q: f64) -> (EncoderCount, Option<f32>) {
        let before = core::mem::replace(&mut self.before, q);
        let count = self.count(q);
        let edge = if q > before { count } else { count + 1 };
        let age = if count == self.count(before) {
            3.7
        } else {
            (q - self.edge(edge)) / (q - before)
        };
        let ticks = (age * 17_000.0).floor() as f32;
        let code = EncoderCount(count.rem_euclid(65_536) as u16);
        (code, self.timed.then_some(ticks / 17_000.0))
    }
}

/// Returns the RMS error of the velocity (counts/s) along q(t), v(t) after the first half.
fn error(lines: Lines, bandwidth: f64, seconds: f64, motion: impl Fn(f64) -> (f64, f64)) -> f64 {
    let config = Config::<f32>::new(bandwidth as f32, RATE as f32);
    let mut state = State::default();
    let mut lines = lines;
    let (mut sum, n) = (0.0, (seconds * RATE) as usize);
    for k in 0..n {
        let (q, v) = motion(k as f64 / RATE);
        let (code, age) = lines.sample(q);
        let m = step(&config, &mut state, code, age);
        if k >= n / 2 {
            sum += (f64::from(m.velocity) - v).powi(2);
        }
    }
    (sum / (n - n / 2) as f64).sqrt()
}

/// Ten electrical degrees of phase error between the channels, and as much of duty cycle.
const UNEQUAL: [f64; 4] = [0.0, 0.11, 0.11, 0.0];

/// Returns the RMS error without and with the times of the edges, 200 Hz of bandwidth.
fn errors(offset: [f64; 4], seconds: f64, motion: impl Fn(f64) -> (f64, f64)) -> [f64; 2] {
    [false, true].map(|timed| {
        let lines = Lines {
            offset,
            timed,
            before: 0.0,
        };
        error(lines, 200.0, seconds, &motion)
    })
}

/// Constant speed, wandering by a hundredth. Captured times remove the error of the unknown time of an edge. The error
/// of unequal lines stays, and dominates below some 1000 counts/s. At 100 counts/s (an edge in two of the observer's
/// time constants) even equal lines leave the wandering between the edges: 0.04 %.
#[test]
fn times_of_edges_make_the_velocity_smooth() {
    for (scale, most) in [(0.0, [0.25, 0.02]), (0.25, [1.02, 0.2]), (1.0, [1.02, 0.5])] {
        let offset = UNEQUAL.map(|x| scale * x);
        for speed in [100.0, 300.0, 1e3, 2e3, 5e3, 1e4, 2e4, 1e5, 4e5_f64] {
            let seconds = (200.0 / speed).clamp(2.0, 20.0);
            let w = TAU / seconds * 3.0;
            let [without, with] = errors(offset, seconds, |t| {
                let (s, c) = (w * t).sin_cos();
                (speed * (t + 0.01 / w * s), speed * (1.0 + 0.01 * c))
            });
            std::println!(
                "lines unequal by {:.3}, {speed} counts/s: {without:.4} without times, {with:.4} with",
                offset[1]
            );
            let most = most[usize::from(speed >= 5e3)];
            assert!(
                with < most * without,
                "{offset:?} at {speed}: {without} {with}"
            );
        }
    }
}

/// Swings at 0.5 Hz about a point, with reversals of the velocity.
#[test]
fn times_of_edges_help_through_reversals() {
    for (offset, share) in [([0.0; 4], 0.5), (UNEQUAL, 0.9)] {
        for amplitude in [1000.0, 6500.0] {
            let w = TAU * 0.5;
            let [without, with] = errors(offset, 8.0, |t| {
                let (s, c) = (w * t).sin_cos();
                (amplitude * s, amplitude * w * c)
            });
            std::println!(
                "lines unequal by {:.3}, swings of {amplitude} counts: {without:.2} without times, {with:.2} counts/s with",
                offset[1]
            );
            assert!(
                with < share * without,
                "{offset:?} {amplitude}: {without} {with}"
            );
        }
    }
}
