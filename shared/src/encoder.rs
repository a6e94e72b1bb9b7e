//! Encoder unwrapping, velocity and acceleration.
//!
//! A tracking observer of type 3 (position, velocity, acceleration), critically damped: no steady lag at constant
//! acceleration. Its gains are those of the fading-memory polynomial filter of second degree
//! (Morrison 1969, "Introduction to Sequential Smoothing and Prediction", ch. 13; Brookner 1998, "Tracking and
//! Kalman Filtering Made Easy", sec. 1.2.10), which is critically damped for any interval T between
//! measurements: with θ = e^{−ωT}, position gain 1 − θ³, velocity gain 1.5(1−θ)²(1+θ)/T, acceleration gain (1−θ)³/T².
//!
//! What makes it right at low speed: a measurement is an *edge*, not a sample. Where a count has just changed, the
//! position is known to a fraction of a count; where it has not, nothing was measured but that the link stays
//! within its count. So the filter is updated at edges, with the interval since the last one, and between edges it
//! predicts under two bounds that are certain: the position stays in its count, and since T samples without
//! an edge mean less than one count in T, |v| ≤ 1/T counts a sample. A linear observer fed with counts instead
//! answers each edge with a velocity pulse of some ω counts/s, and with a dead zone it has a limit
//! cycle (a type-3 loop is only conditionally stable). At standstill the bound takes the velocity to zero as 1/t.
//!
//! At speeds above one count a sample this is the linear observer, as s → with pole ω:
//! v̂/v = ω²(3s+ω)/(s+ω)³ (group delay zero at low frequency, peak +2.3 dB, −3 dB at 1.643·ω/2π: the stated bandwidth),
//! â/a = ω³/(s+ω)³ (group delay 3/ω). Below one edge in some 0.7/ω the edges themselves limit
//! the bandwidth.
//!
//! Measured ripple of the velocity (rms, 100 Hz of bandwidth at 10 kHz; test `ripple_at_low_speed`), counts/s, and that of a
//! linear observer of the same bandwidth: at 1 count/s 0.0005 (17), at 10 0.007 (54), at 100 0.19 (112), at 1000 8.9 (21),
//! at 5000 43 (52), at 20 000 91 (95), at 400 000 24 (26).
//!
//! Position is an integer of counts plus a fraction, velocity and acceleration are per sample inside, so `f32`
//! resolves the same after any number of turns.
//!
//! Leaves out: unequal edge spacing and eccentricity of the encoder, missed counts.

use crate::scalar::Real;
use crate::units::EncoderCount;

/// −3 dB frequency of v̂/v over ω: y = x² solves (1+y)³ = 2(1+9y).
const VELOCITY_CORNER_OVER_POLE: f64 = 1.643_4;
/// Smallest θ: however long the interval, the filter remembers some edges, so that a single one, itself
/// only known to a sample in time, does not set the velocity alone.
const SMALLEST_MEMORY: f64 = 0.5;
/// Longest interval counted, samples: beyond it the velocity bound no longer shrinks.
const LONGEST_INTERVAL: u32 = 1 << 24;

/// Signed movement between two readings of the wrapping 16-bit counter.
///
/// Right as long as the encoder moves less than 2¹⁵ counts between them.
#[inline]
pub const fn difference(new: EncoderCount, old: EncoderCount) -> i16 {
    new.0.wrapping_sub(old.0) as i16
}

/// Constants of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T> {
    /// e^{−ω/rate}.
    decay: T,
    /// Samples per second.
    rate: T,
    /// ω, rad/s.
    pole: T,
}

impl<T: Real> Config<T> {
    /// `bandwidth_hz`: −3 dB frequency from true to estimated velocity; `sample_rate_hz`: calls of [`step`] a second,
    /// at least ten times the bandwidth.
    pub fn new(bandwidth_hz: T, sample_rate_hz: T) -> Self {
        let pole = bandwidth_hz * T::from_f64(core::f64::consts::TAU / VELOCITY_CORNER_OVER_POLE);
        Self {
            decay: (-pole / sample_rate_hz).exp(),
            rate: sample_rate_hz,
            pole,
        }
    }

    /// Group delay of the acceleration at low frequency, s. That of position and velocity is zero.
    pub fn acceleration_delay(&self) -> T {
        T::from_f64(3.0) / self.pole
    }
}

/// Memory of the observer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    started: bool,
    code: EncoderCount,
    counts: i64,
    /// Estimated position above `counts`, counts.
    lead: T,
    /// Counts per sample.
    velocity: T,
    /// Counts per sample².
    acceleration: T,
    /// Samples since the last edge.
    since_edge: u32,
    /// θ for that interval.
    theta: T,
}

/// Estimated motion in counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion<T> {
    /// Unwrapped position: what the counter says, counts.
    pub counts: i64,
    /// What the observer adds to it, counts (0 to 1 at low speed).
    pub fraction: T,
    /// Velocity, counts/s.
    pub velocity: T,
    /// Acceleration, counts/s².
    pub acceleration: T,
}

impl<T: Real> Motion<T> {
    /// Position within one turn (rad, 0 ≤ q < 2π up to the fraction), exact after any number of turns.
    /// `counts_per_turn` below 1 is taken as 1.
    #[inline]
    pub fn angle_in_turn(&self, counts_per_turn: i32) -> T {
        let turn = i64::from(counts_per_turn.max(1));
        let within = self.counts.rem_euclid(turn);
        let radians = core::f64::consts::TAU / turn as f64;
        T::from_f64(within as f64 * radians) + self.fraction * T::from_f64(radians)
    }
}

/// Takes in a reading of the counter. The first one defines count zero of [`Motion::counts`] plus its own code.
#[inline]
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    code: EncoderCount,
) -> Motion<T> {
    if !state.started {
        *state = State {
            started: true,
            code,
            counts: i64::from(code.0),
            lead: T::from_f64(0.5),
            theta: T::ONE,
            ..State::default()
        };
    }
    let delta = difference(code, state.code);
    state.code = code;
    step_delta(config, state, delta)
}

/// The same from a signed movement since the last call, for encoders that give one.
#[inline]
pub fn step_delta<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    delta: i16,
) -> Motion<T> {
    let half = T::from_f64(0.5);
    state.counts = state.counts.wrapping_add(i64::from(delta));
    if !state.started {
        state.started = true;
        state.theta = T::ONE;
        state.lead = half;
    }
    state.lead += state.velocity + half * state.acceleration - T::from_f64(f64::from(delta));
    state.velocity += state.acceleration;
    state.since_edge = (state.since_edge + 1).min(LONGEST_INTERVAL);
    state.theta *= config.decay;
    let interval = T::from_f64(f64::from(state.since_edge));
    if delta == 0 {
        wait(config, state, T::ONE / interval);
    } else {
        correct(state, delta, interval);
    }
    Motion {
        counts: state.counts,
        fraction: state.lead,
        velocity: state.velocity * config.rate,
        acceleration: state.acceleration * config.rate * config.rate,
    }
}

/// No edge: the position has stayed in its count, and |v| ≤ `bound` counts a sample.
#[inline(always)]
fn wait<T: Real<Mask = bool>>(config: &Config<T>, state: &mut State<T>, bound: T) {
    state.lead = state.lead.clamp_to(T::ZERO, T::ONE);
    let bounded = state.velocity.clamp_to(-bound, bound);
    if bounded.abs().lt(state.velocity.abs()) {
        state.velocity = bounded;
        state.acceleration *= config.decay;
    }
}

/// An edge was passed since the last sample.
#[inline(always)]
fn correct<T: Real<Mask = bool>>(state: &mut State<T>, delta: i16, interval: T) {
    let half = T::from_f64(0.5);
    // Passed at a moment evenly spread over the sample: on the mean half a sample's movement ago, at
    // most half a count, as the next edge was not reached.
    let past = (half * state.velocity.abs()).min(half);
    let measured = if delta > 0 { past } else { T::ONE - past };
    let error = measured - state.lead;
    let theta = state.theta.max(T::from_f64(SMALLEST_MEMORY));
    let forgot = T::ONE - theta;
    let per_interval = T::ONE / interval;
    let forgot_rate = forgot * per_interval;
    state.lead += (T::ONE - theta * theta * theta) * error;
    state.velocity += T::from_f64(1.5) * forgot * forgot_rate * (T::ONE + theta) * error;
    state.acceleration += forgot * forgot_rate * forgot_rate * error;
    state.since_edge = 0;
    state.theta = T::ONE;
}

#[cfg(test)]
mod tests {
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
        step(&config, &mut state, EncoderCount(100));
        for m in moves {
            position += m;
            let m = step(
                &config,
                &mut state,
                EncoderCount(position.rem_euclid(65_536) as u16),
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

    /// Amplitude ratio and phase (rad) of velocity and acceleration for q = A·sin 2πft, `f32` inside.
    fn response(bandwidth: f64, f: f64, amplitude: f64) -> [(f64, f64); 2] {
        let config = Config::<f32>::new(bandwidth as f32, RATE as f32);
        let mut state = State::default();
        let w = TAU * f;
        let mut sums = [0.0; 4];
        let periods = (4.0 * f).max(4.0).round();
        let n = (periods / f * RATE).round() as usize;
        for k in 0..2 * n {
            let t = k as f64 / RATE;
            let m = step(&config, &mut state, code(amplitude * (w * t).sin()));
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
                let m = step(&config, &mut state, code(q));
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

    /// RMS error of the velocity (counts/s) at constant speed, with the speed wandering by a hundredth so
    /// that edges do not lock to the samples; and that of a linear observer of the same bandwidth.
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
            let m = step(&config, &mut state, code(q));
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
        // (counts/s, largest ripple allowed as a share of the speed)
        for (speed, share) in [(1.0, 0.05), (10.0, 0.05), (100.0, 0.05), (1000.0, 0.1)] {
            let (ours, linear) = ripple(speed, 100.0);
            std::println!(
                "{speed} counts/s: ripple {ours:.4}, linear observer {linear:.3} counts/s"
            );
            assert!(ours < share * speed, "{speed}: {ours}");
            assert!(ours < 0.5 * linear, "{speed}: {ours} {linear}");
        }
        for speed in [5e3, 2e4, 4e5] {
            let (ours, linear) = ripple(speed, 100.0);
            std::println!(
                "{speed} counts/s: ripple {ours:.4}, linear observer {linear:.3} counts/s"
            );
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
                let m = step(&config, &mut state, code(q));
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
            let m = step(&config, &mut state, code(q));
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
            let m = step(&config, &mut state, code(amplitude * (w * t).sin()));
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
}
