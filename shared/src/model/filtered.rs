//! The filtered differential model: the differential model behind a low-pass filter, without q̈.
//!
//! The same filter F(s) on both sides of τ = row·θ does not change θ. It turns the column q̈ into s·F applied to q̇,
//! which the filter's state gives (state-variable filter; Hsu, Bodson, Sastry & Paden 1987, "Adaptive identification
//! and control for manipulators without using joint accelerations"; Slotine & Li 1991, sec. 9.2). F(s) = (ω/(s+ω))³ has
//! three equal real poles, the best conditioned in `f32`.
//!
//! Discretisation: the bilinear rule s = (2/T)(z−1)/(z+1) for every section, every column and the torque. The identity
//! s·y = ω·(u − y) of a section then holds exactly in discrete time, so q̈ needs no difference quotient. The only error
//! is frequency warping: q̈ of a motion at f is (tan x)/x too large, x = πfT. At T = 1 ms that is 3·10⁻⁵ at 3 Hz and
//! 3·10⁻³ at 30 Hz.
//!
//! Absolute position is used only in sine and cosine. Reduce it to one turn, so that precision does not degrade with
//! the turns.
//!
//! Validity: in presliding sgn q̇ does not describe friction, and the filter has a memory. A row is valid once the
//! speed has stayed above the slip velocity, with one sign, for the filter's memory. A valid row need not be
//! informative.
//!
//! Leaves out: delay between torque and velocity measurement (it acts as an error of the J column).

use super::Row;
use crate::scalar::Real;

/// −3 dB frequency of (1/(s+1))³: √(2^⅓ − 1), rad/s.
const CORNER_OF_TRIPLE_POLE: f64 = 0.509_824_528_533_959_4;
/// ω·t after which the step response of the triple pole is within e⁻ˣ(1+x+x²/2) = 0.28 % of its final value.
const MEMORY_TIMES_POLE: f64 = 10.0;

/// Constants of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T> {
    /// ω, rad/s (pre-warping not applied).
    pole: T,
    /// Feedback of a bilinear section.
    feedback: T,
    /// Feed-in of a bilinear section, for the sum of new and old input.
    feed: T,
    /// Speed below which the Coulomb column is not valid, rad/s.
    slip_velocity: T,
    /// Samples of memory.
    memory: T,
}

impl<T: Real> Config<T> {
    /// `bandwidth_hz`: −3 dB frequency of F. `rate_hz`: sample rate, at least ten times the bandwidth. `slip_velocity`:
    /// speed (rad/s) below which friction may be in presliding.
    pub fn new(bandwidth_hz: T, rate_hz: T, slip_velocity: T) -> Self {
        let pole = bandwidth_hz * T::from_f64(core::f64::consts::TAU / CORNER_OF_TRIPLE_POLE);
        let half = pole / (rate_hz + rate_hz);
        Self {
            pole,
            feedback: (T::ONE - half) / (T::ONE + half),
            feed: half / (T::ONE + half),
            slip_velocity,
            memory: T::from_f64(MEMORY_TIMES_POLE) * rate_hz / pole,
        }
    }

    /// Returns the filter's memory in samples: a row is valid this many samples after a reversal or the start.
    pub fn memory_samples(&self) -> T {
        self.memory
    }
}

/// One bilinear section ω/(s+ω).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Section<T> {
    input: T,
    output: T,
}

impl<T: Real> Section<T> {
    #[inline(always)]
    fn settled(value: T) -> Self {
        Self {
            input: value,
            output: value,
        }
    }
    #[inline(always)]
    fn step(&mut self, config: &Config<T>, input: T) -> T {
        // Written as a correction, so that rounding in `f32` does not shift the gain at standstill.
        self.output += config.feed * ((input - self.output) + (self.input - self.output));
        self.input = input;
        self.output
    }
}

/// Three sections.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cascade<T>([Section<T>; 3]);

impl<T: Real> Cascade<T> {
    fn settled(value: T) -> Self {
        Self([Section::settled(value); 3])
    }
    #[inline(always)]
    fn step(&mut self, config: &Config<T>, input: T) -> T {
        let [a, b, c] = &mut self.0;
        let first = a.step(config, input);
        let second = b.step(config, first);
        c.step(config, second)
    }
}

/// State of the filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    started: bool,
    velocity: Cascade<T>,
    acceleration: [Section<T>; 2],
    cos: Cascade<T>,
    sin: Cascade<T>,
    sign: Cascade<T>,
    torque: Cascade<T>,
    previous_sign: T,
    /// Samples since the motion was last slow or reversed.
    steady: T,
}

/// A filtered row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filtered<T: Real> {
    /// Filtered regressor.
    pub row: Row<T>,
    /// Torque through the same filter, N·m.
    pub torque: T,
    /// True if the speed is above the slip velocity in this sample.
    pub fast: T::Mask,
    /// True if the Coulomb column is valid and the filter's start is forgotten.
    pub valid: T::Mask,
}

/// Processes one sample: position (rad, best reduced to one turn), velocity (rad/s), joint torque (N·m).
///
/// At the first sample the filter starts as if its inputs had always been the same. The row becomes valid when that
/// assumption is forgotten. Cost: one sine and cosine, 17 sections of five operations.
#[inline]
pub fn step<T: Real>(config: &Config<T>, state: &mut State<T>, q: T, qd: T, tau: T) -> Filtered<T> {
    let (sin, cos) = q.sin_cos();
    let sign = qd.sgn();
    if !state.started {
        *state = State {
            started: true,
            velocity: Cascade::settled(qd),
            acceleration: [Section::settled(T::ZERO); 2],
            cos: Cascade::settled(cos),
            sin: Cascade::settled(sin),
            sign: Cascade::settled(sign),
            torque: Cascade::settled(tau),
            previous_sign: sign,
            steady: T::ZERO,
        };
    }
    let [first, second, third] = &mut state.velocity.0;
    let velocity_1 = first.step(config, qd);
    let acceleration_1 = config.pole * (qd - velocity_1);
    let velocity_2 = second.step(config, velocity_1);
    let velocity = third.step(config, velocity_2);
    let [a, b] = &mut state.acceleration;
    let acceleration_2 = a.step(config, acceleration_1);
    let acceleration = b.step(config, acceleration_2);

    let fast = config.slip_velocity.lt(qd.abs());
    let same = T::ZERO.lt(sign * state.previous_sign);
    state.previous_sign = sign;
    // Stops counting once valid: a count in `f32` would end at 2²⁴.
    let counted = (state.steady + T::ONE).min(config.memory + T::ONE);
    state.steady = T::select(fast & same, counted, T::ZERO);

    Filtered {
        row: [
            acceleration,
            state.cos.step(config, cos),
            state.sin.step(config, sin),
            velocity,
            state.sign.step(config, sign),
            T::ONE,
        ],
        torque: state.torque.step(config, tau),
        fast,
        valid: config.memory.lt(state.steady),
    }
}

#[cfg(test)]
mod tests {
    use super::super::integral::tests::{TRUTH, drive, simulate};
    use super::*;

    fn dot(row: &Row<f64>) -> f64 {
        row.iter().zip(TRUTH).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn identity_holds_on_simulated_motion() {
        let config = Config::new(30.0, 1000.0, 0.05);
        let mut state = State::default();
        let (mut worst, mut valid, mut largest) = (0.0_f64, 0, 0.0_f64);
        for [q, qd, tau] in simulate(1e-3, 12_000, drive) {
            let out = step(&config, &mut state, q, qd, tau);
            if out.valid {
                worst = worst.max((dot(&out.row) - out.torque).abs());
                largest = largest.max(out.torque.abs());
                valid += 1;
            }
        }
        assert!(valid > 6000, "{valid}");
        // The filter's memory after friction jumps at reversals: 0.3 % of 2·fc.
        assert!(worst < 3e-3 && largest > 2.0, "{worst} of {largest}");
    }

    #[test]
    fn acceleration_column_is_the_filtered_derivative() {
        // q̇ = sin 2πft: the column must be F(j2πf)·q̈, with F of the bilinear rule, in gain and phase.
        for f in [0.5_f64, 3.0, 30.0] {
            let config = Config::<f64>::new(30.0, 1000.0, 0.0);
            let mut state = State::default();
            let w = core::f64::consts::TAU * f;
            let (mut re, mut im, mut vre, mut vim) = (0.0, 0.0, 0.0, 0.0);
            for k in 0..12_000 {
                let t = 1e-3 * f64::from(k);
                let out = step(&config, &mut state, 0.0, (w * t).sin(), 0.0);
                if k >= 2000 {
                    let (s, c) = (w * t).sin_cos();
                    re += out.row[0] * c / 5000.0;
                    im += out.row[0] * s / 5000.0;
                    vre += out.row[3] * c / 5000.0;
                    vim += out.row[3] * s / 5000.0;
                }
            }
            let gain = (re.hypot(im)) / (vre.hypot(vim));
            let x = core::f64::consts::PI * f * 1e-3;
            assert!((gain / w - x.tan() / x).abs() < 1e-6, "{f}: {gain}");
            let phase = re.atan2(im) - vre.atan2(vim);
            assert!((phase.sin() - 1.0).abs() < 1e-9, "{f}: {phase}");
            if f == 30.0 {
                let level = vre.hypot(vim);
                assert!((level - 0.5_f64.sqrt()).abs() < 0.01, "bandwidth: {level}");
            }
        }
    }

    #[test]
    fn single_precision_agrees_after_hours_of_turning() {
        let c64 = Config::<f64>::new(30.0, 1000.0, 0.05);
        let c32 = Config::<f32>::new(30.0, 1000.0, 0.05);
        let (mut s64, mut s32) = (State::default(), State::default());
        let tau = core::f64::consts::TAU;
        let mut worst = [0.0_f64; 6];
        for k in 0..2_000_000_u32 {
            let t = 1e-3 * f64::from(k);
            let q = (3.0 * t + 0.5 * (2.0 * t).sin()) % tau;
            let qd = 3.0 + (2.0 * t).cos();
            let a = step(&c64, &mut s64, q, qd, 1.0);
            let b = step(&c32, &mut s32, q as f32, qd as f32, 1.0);
            assert_eq!(a.valid, b.valid);
            for i in 0..6 {
                worst[i] = worst[i].max((a.row[i] - f64::from(b.row[i])).abs());
            }
        }
        assert!(worst[0] < 5e-4, "{worst:?}");
        assert!(worst[1..].iter().all(|e| *e < 3e-6), "{worst:?}");
    }

    #[test]
    fn reversal_masks_for_the_memory() {
        let config = Config::<f64>::new(30.0, 1000.0, 0.01);
        let mut state = State::default();
        let mut since = 0.0;
        for k in 0..5000 {
            let qd = if (k / 1000) % 2 == 0 { 1.0 } else { -1.0 };
            since = if k % 1000 == 0 { 0.0 } else { since + 1.0 };
            let out = step(&config, &mut state, 0.0, qd, 0.0);
            if out.valid {
                assert!(since >= config.memory_samples() - 1.0, "{since}");
                assert!((out.row[4] - qd).abs() < 0.006, "{k} {}", out.row[4]);
            } else {
                assert!(since < config.memory_samples() + 2.0, "{since}");
            }
        }
    }
}
