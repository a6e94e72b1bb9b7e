//! Encoder unwrapping, velocity and acceleration.
//!
//! A tracking observer of type 3 (position, velocity, acceleration), critically damped: no steady lag at constant
//! acceleration. Its gains are those of the fading-memory polynomial filter of second degree
//! (Morrison 1969, "Introduction to Sequential Smoothing and Prediction", ch. 13; Brookner 1998, "Tracking and
//! Kalman Filtering Made Easy", sec. 1.2.10), which is critically damped for any interval T between
//! measurements: with θ = e^{−ωT}, position gain 1 − θ³, velocity gain 1.5(1−θ)²(1+θ)/T, acceleration gain (1−θ)³/T².
//!
//! The observer stays accurate at low speed because a measurement is an *edge*, not a sample. At an edge the position
//! is known to a fraction of a count. A sample without an edge shows only that the link stays within its count. So
//! edges update the filter, with the interval since the last one. Between edges the filter predicts under two certain
//! bounds: the position stays in its count, and since T samples without an edge mean less than one count in T, |v| ≤
//! 1/T counts a sample. A linear observer fed with counts instead answers each edge with a velocity pulse of some ω
//! counts/s, and with a dead zone it has a limit cycle (a type-3 loop is only conditionally stable). At standstill the
//! bound takes the velocity to zero as 1/t.
//!
//! Above one count a sample it equals the linear observer with pole ω: v̂/v = ω²(3s+ω)/(s+ω)³ (group delay zero at low
//! frequency, peak +2.3 dB, −3 dB at 1.643·ω/2π: the stated bandwidth), â/a = ω³/(s+ω)³ (group delay 3/ω). Below one
//! edge in some 0.7/ω the edges limit the bandwidth.
//!
//! Measured ripple of the velocity (rms, 100 Hz of bandwidth at 10 kHz; test `ripple_at_low_speed`), counts/s, with
//! that of a linear observer of the same bandwidth in brackets: at 1 count/s 0.0005 (17), at 10 0.007 (54), at 100 0.19
//! (112), at 1000 8.9 (21), at 5000 43 (52), at 20 000 91 (95), at 400 000 24 (26).
//!
//! If a timer has captured the time of an edge, the position is known at that instant instead of anywhere in its
//! sample. Measured ripple with it (200 Hz at 10 kHz, test `times_of_edges_make_the_velocity_smooth`), counts/s, and
//! without in brackets: at 100 counts/s 0.044 (0.19), at 1000 0.0045 (16), at 20 000 0.063 (203), at 400 000 1.3 (72).
//!
//! Position is an integer of counts plus a fraction; velocity and acceleration are per sample. So `f32` has the same
//! resolution after any number of turns.
//!
//! Leaves out: unequal edge spacing and eccentricity of the encoder, missed counts.

use crate::scalar::Real;
use crate::units::EncoderCount;

/// −3 dB frequency of v̂/v over ω: y = x² solves (1+y)³ = 2(1+9y).
const VELOCITY_CORNER_OVER_POLE: f64 = 1.643_4;
/// Smallest θ. For any interval the filter remembers some edges, so that a single edge, whose time is only known to a
/// sample, does not set the velocity alone.
const MIN_THETA: f64 = 0.5;
/// Longest interval that is counted, samples. Beyond it the velocity bound no longer shrinks.
const MAX_INTERVAL: u32 = 1 << 24;

/// Returns the signed movement between two readings of the wrapping 16-bit counter.
///
/// Valid if the encoder moves less than 2¹⁵ counts between them.
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
    /// `bandwidth_hz`: −3 dB frequency from true to estimated velocity; `sample_rate_hz`: calls of [`step`] per second,
    /// at least ten times the bandwidth.
    pub fn new(bandwidth_hz: T, sample_rate_hz: T) -> Self {
        let pole = bandwidth_hz * T::from_f64(core::f64::consts::TAU / VELOCITY_CORNER_OVER_POLE);
        Self {
            decay: (-pole / sample_rate_hz).exp(),
            rate: sample_rate_hz,
            pole,
        }
    }

    /// Returns e^{−ω/rate}: θ of an edge in every sample.
    pub fn decay(&self) -> T {
        self.decay
    }

    /// Returns the group delay of the acceleration at low frequency, s. That of position and velocity is zero.
    pub fn acceleration_delay(&self) -> T {
        T::from_f64(3.0) / self.pole
    }
}

/// State of the observer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    started: bool,
    code: EncoderCount,
    counts: i64,
    /// Estimated position above `counts`, counts.
    fraction: T,
    /// Counts per sample.
    velocity: T,
    /// Counts per sample².
    acceleration: T,
    /// Samples since the last edge.
    since_edge: u32,
    /// θ for the interval since the last edge.
    theta: T,
}

/// Estimated motion in counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion<T> {
    /// Unwrapped position of the counter, counts.
    pub counts: i64,
    /// Fraction that the observer adds, counts (0 to 1 at low speed).
    pub fraction: T,
    /// Velocity, counts/s.
    pub velocity: T,
    /// Acceleration, counts/s².
    pub acceleration: T,
}

impl<T: Real> Motion<T> {
    /// Returns the position within one turn (rad, 0 ≤ q < 2π up to the fraction), exact after any number of turns.
    /// `counts_per_turn` below 1 counts as 1.
    #[inline]
    pub fn angle_in_turn(&self, counts_per_turn: i32) -> T {
        let turn = i64::from(counts_per_turn.max(1));
        let within = self.counts.rem_euclid(turn);
        let radians = core::f64::consts::TAU / turn as f64;
        T::from_f64(within as f64 * radians) + self.fraction * T::from_f64(radians)
    }
}

/// Processes a reading of the counter. The first reading sets [`Motion::counts`] to its own code.
///
/// `age`: samples (0 to about 1) from the last edge to this reading, if a timer has captured the edge; ignored if the
/// count has not changed.
#[inline]
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    code: EncoderCount,
    age: Option<T>,
) -> Motion<T> {
    let half = T::from_f64(0.5);
    if !state.started {
        *state = State {
            started: true,
            code,
            counts: i64::from(code.0),
            fraction: half,
            theta: T::ONE,
            ..State::default()
        };
    }
    let delta = difference(code, state.code);
    state.code = code;
    state.counts = state.counts.wrapping_add(i64::from(delta));
    state.fraction += state.velocity + half * state.acceleration - T::from_f64(f64::from(delta));
    state.velocity += state.acceleration;
    state.since_edge = (state.since_edge + 1).min(MAX_INTERVAL);
    state.theta *= config.decay;
    let interval = T::from_f64(f64::from(state.since_edge));
    if delta == 0 {
        hold_in_count(config, state, T::ONE / interval);
    } else {
        correct(state, delta, interval, age);
    }
    Motion {
        counts: state.counts,
        fraction: state.fraction,
        velocity: state.velocity * config.rate,
        acceleration: state.acceleration * config.rate * config.rate,
    }
}

/// Processes a sample without an edge: the position has stayed in its count, and |v| ≤ `bound` counts a sample.
#[inline(always)]
fn hold_in_count<T: Real<Mask = bool>>(config: &Config<T>, state: &mut State<T>, bound: T) {
    state.fraction = state.fraction.clamp_to(T::ZERO, T::ONE);
    let bounded = state.velocity.clamp_to(-bound, bound);
    if bounded.abs().lt(state.velocity.abs()) {
        state.velocity = bounded;
        state.acceleration *= config.decay;
    }
}

/// Processes an edge since the last sample.
#[inline(always)]
fn correct<T: Real<Mask = bool>>(state: &mut State<T>, delta: i16, interval: T, age: Option<T>) {
    let half = T::from_f64(0.5);
    // Without a captured time, the edge is anywhere in the sample: on average half a sample's movement ago, at most
    // half a count. In either case the next edge was not reached.
    let (age, max_past) = match age {
        Some(age) => (age, T::ONE),
        None => (half, half),
    };
    let past = (age * state.velocity.abs()).min(max_past);
    let measured = if delta > 0 { past } else { T::ONE - past };
    let error = measured - state.fraction;
    let theta = state.theta.max(T::from_f64(MIN_THETA));
    let innovation_share = T::ONE - theta;
    let per_interval = T::ONE / interval;
    let innovation_rate = innovation_share * per_interval;
    state.fraction += (T::ONE - theta * theta * theta) * error;
    state.velocity +=
        T::from_f64(1.5) * innovation_share * innovation_rate * (T::ONE + theta) * error;
    state.acceleration += innovation_share * innovation_rate * innovation_rate * error;
    state.since_edge = 0;
    state.theta = T::ONE;
}

#[cfg(test)]
#[path = "encoder_test.rs"]
mod tests;
