//! The columns of one joint over one stretch.

use std::f64::consts::TAU;

use rig_numerics::statistics::{mean, median_of_finite, rms};

use super::link_motion::{MotorMotion, predict};
use super::two_mass::{Gravity, TwoMass};
use crate::error::ComplianceError;
use crate::signals::Signals;

/// Share of the rows at each end, [`MOST`] at most, that show the torque there.
const END: f64 = 0.01;
/// Most rows at each end that show the torque there.
const MOST: usize = 50;
/// Rows at each end that show whether the joint rests there.
const RESTING: usize = 16;
/// Rows on either side that the first velocity takes in.
const HALF: usize = 2;
/// Half the time over which the velocity is taken, over a period of the antiresonance: a sine of this frequency loses 1 % of its
/// velocity by it.
const SPAN: f64 = 0.035;
/// Movement of the reference over that of the joint below which the reference rests.
const STILL: f64 = 1e-2;
/// Speed at the ends over the RMS speed below which the joint rests.
const AT_REST: f64 = 0.05;

/// Columns of one stretch.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) instrument: Vec<f64>,
    pub(super) torque: Vec<f64>,
    /// Position at the next row minus that at this one.
    pub(super) moved: Vec<f64>,
    /// Coulomb friction of the motor over its size: the sign of its velocity until a model predicts what it does at rest.
    pub(super) sign: Vec<f64>,
    /// Coulomb friction of the link over its size; zero until a model predicts the motion of the link.
    pub(super) link_sign: Vec<f64>,
    /// Torque that a gap takes away, over c and the gap; zero until a model with a gap predicts it.
    pub(super) gap: Vec<f64>,
    /// Torque of gravity on the link less its linear part; zero until a model predicts the motion of the link.
    pub(super) gravity: Vec<f64>,
    /// Torque that the motion of the other joints puts on the links.
    pub(super) coupling: Vec<f64>,
    /// The same as computed, smooth: it keeps the line through its ends.
    pushed: Vec<f64>,
    /// Torque as recorded.
    recorded: Vec<f64>,
    /// True if the reference is periodic: the columns have no line through their ends then, but a mean.
    periodic: bool,
    pub(super) velocity: Vec<f64>,
    position: Vec<f64>,
}

impl Columns {
    /// Predicts friction, backlash and gravity by a model of two masses, in steps of another one that hardly differs.
    pub(super) fn predict(
        &mut self,
        model: &TwoMass,
        steps: &TwoMass,
        gravity: &Gravity,
        rate: f64,
    ) {
        let swing = TAU * rate / steps.antiresonance();
        let half = ((SPAN * swing).round() as usize).clamp(1, self.moved.len().max(1));
        let velocity = smoothed(&self.moved, rate, half);
        let motion = MotorMotion {
            position: &self.position,
            first: -mean(&self.position),
            moving: &moving(&velocity),
            velocity: &velocity,
            torque: &self.recorded,
            // Noise of second differences is small where the link follows it.
            pushed: &self.pushed,
            dt: 1.0 / rate,
            smeared: half,
            swing: steps.antiresonance(),
        };
        let found = predict(model, &motion, gravity);
        // The torque has lost the line through its ends, and so must what it balances there.
        let level = |values: &[f64]| level(values, self.periodic);
        self.sign = level(&found.motor_friction);
        self.link_sign = level(&found.link_friction);
        self.gap = level(&found.gap);
        self.gravity = level(&found.gravity);
    }

    /// Takes the torque that the motion of the other joints puts on the links.
    pub(super) fn couple(&mut self, torque: Vec<f64>) {
        self.coupling = level(&torque, self.periodic);
        self.pushed = torque;
    }
}

/// Returns true if the stretch has a reference.
pub(super) fn has_reference(stretch: &Signals, k: usize) -> bool {
    stretch.joints[k].reference.is_some()
}

/// Returns the columns of joint `k`. Those of a `periodic` reference keep the line through their ends.
///
/// # Errors
/// [`ComplianceError::Recording`]: no torque, a joint or a reference that does not move.
pub(super) fn columns_of(
    stretch: &Signals,
    k: usize,
    name: &str,
    by_reference: bool,
    periodic: bool,
) -> Result<Columns, ComplianceError> {
    let joint = &stretch.joints[k];
    let n = stretch.len() - 1;
    if joint.tau.is_empty() {
        return Err(ComplianceError::Recording(format!(
            "{} has no torque of joint \"{name}\" (tau{} or i{}); a frequency response needs it.",
            stretch.label,
            k + 1,
            k + 1
        )));
    }
    let moved: Vec<f64> = joint.q.windows(2).map(|w| w[1] - w[0]).collect();
    if moved.iter().all(|d| *d == 0.0) {
        return Err(ComplianceError::Recording(format!(
            "{}: joint \"{name}\" does not move, so the recording shows nothing of its stiffness; is another joint excited (--joint)?",
            stretch.label
        )));
    }
    let velocity = smoothed(&moved, stretch.rate(), HALF);
    let instrument = match (&joint.reference, by_reference) {
        (Some(reference), true) => &reference[..n],
        _ => &joint.tau[..n],
    };
    // A reference has no noise: its ends are exact.
    let instrument = match by_reference && !periodic {
        true => without_line(instrument, 1),
        false => level(instrument, periodic),
    };
    let still = rms(&instrument) < STILL * rms(&level(&joint.q[..n], false));
    if by_reference && still {
        return Err(ComplianceError::Recording(format!(
            "{}: the reference of joint \"{name}\" (ref{}) does not move, so nothing known excites the joint; record a chirp, or give --instrument torque if the torque was commanded without feedback.",
            stretch.label,
            k + 1
        )));
    }
    Ok(Columns {
        instrument,
        torque: level(&joint.tau[..n], periodic),
        sign: moving(&velocity),
        recorded: joint.tau[..n].to_vec(),
        periodic,
        link_sign: vec![0.0; n],
        gap: vec![0.0; n],
        gravity: vec![0.0; n],
        coupling: vec![0.0; n],
        pushed: vec![0.0; n],
        position: joint.q[..n].iter().map(|q| q - joint.q[0]).collect(),
        velocity,
        moved,
    })
}

/// Returns the velocity at the rows: the difference of the positions `half` rows before and after.
fn smoothed(moved: &[f64], rate: f64, half: usize) -> Vec<f64> {
    let n = moved.len();
    (0..n)
        .map(|k| {
            // The difference k spans rows k and k + 1; row k lies between differences k − 1 and k.
            let (low, high) = (k.saturating_sub(half), (k + half).min(n));
            mean(&moved[low..high]) * rate
        })
        .collect()
}

/// Returns the sign of a velocity by itself: near 0 where noise decides it.
fn moving(velocity: &[f64]) -> Vec<f64> {
    let scale = 2.0 * noise(velocity).max(1e-3 * rms(velocity));
    velocity.iter().map(|v| (v / scale).tanh()).collect()
}

/// Noise of a velocity that changes slowly, from its second differences.
fn noise(velocity: &[f64]) -> f64 {
    let second: Vec<f64> = (velocity.windows(3))
        .map(|w| (w[0] - 2.0 * w[1] + w[2]).abs())
        .collect();
    // Median of the magnitude over 0.6745 is the standard deviation; the second difference of white noise has √6 of it.
    median_of_finite(second).unwrap_or(0.0) / (0.6745 * 6f64.sqrt())
}

/// Returns values less their mean if they are periodic, else less the line through their ends.
fn level(values: &[f64], periodic: bool) -> Vec<f64> {
    match periodic {
        true => without_mean(values),
        false => without_line(
            values,
            ((END * values.len() as f64) as usize).clamp(1, MOST),
        ),
    }
}

fn without_mean(values: &[f64]) -> Vec<f64> {
    let middle = mean(values);
    values.iter().map(|v| v - middle).collect()
}

/// Subtracts the line through the means of `end` rows at both ends: what holds the joint at rest.
fn without_line(values: &[f64], end: usize) -> Vec<f64> {
    let n = values.len();
    let (first, last) = (mean(&values[..end]), mean(&values[n - end..]));
    let slope = (last - first) / (n - 1).max(1) as f64;
    (values.iter().enumerate())
        .map(|(k, v)| v - first - slope * k as f64)
        .collect()
}

/// Returns true if the joint rests at both ends.
pub(super) fn rests(velocity: &[f64]) -> bool {
    let n = velocity.len();
    let end = RESTING.min(n);
    let all = rms(velocity);
    mean(&velocity[..end]).abs() < AT_REST * all && mean(&velocity[n - end..]).abs() < AT_REST * all
}
