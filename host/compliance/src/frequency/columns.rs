//! The columns of one joint over one stretch.

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
    /// Sign of the motor's velocity by the measured velocity alone; near 0 where noise decides it.
    moving: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    position: Vec<f64>,
}

impl Columns {
    /// Predicts friction, backlash and gravity by a model of two masses.
    pub(super) fn predict(&mut self, model: &TwoMass, gravity: &Gravity, rate: f64) {
        let motion = MotorMotion {
            position: &self.position,
            first: -mean(&self.position),
            velocity: &self.velocity,
            torque: &self.torque,
            moving: &self.moving,
            dt: 1.0 / rate,
        };
        let found = predict(model, &motion, gravity);
        (self.sign, self.link_sign) = (found.motor_friction, found.link_friction);
        (self.gap, self.gravity) = (found.gap, found.gravity);
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
    let velocity = smoothed(&moved, stretch.rate());
    let scale = 2.0 * noise(&velocity).max(1e-3 * rms(&velocity));
    let instrument = match (&joint.reference, by_reference) {
        (Some(reference), true) => &reference[..n],
        _ => &joint.tau[..n],
    };
    let level = |values: &[f64]| match periodic {
        true => without_mean(values),
        false => without_line(values),
    };
    let instrument = level(instrument);
    let still = rms(&instrument) < STILL * rms(&without_line(&joint.q[..n]));
    if by_reference && still {
        return Err(ComplianceError::Recording(format!(
            "{}: the reference of joint \"{name}\" (ref{}) does not move, so nothing known excites the joint; record a chirp, or give --instrument torque if the torque was commanded without feedback.",
            stretch.label,
            k + 1
        )));
    }
    let moving: Vec<f64> = velocity.iter().map(|v| (v / scale).tanh()).collect();
    Ok(Columns {
        instrument,
        torque: level(&joint.tau[..n]),
        sign: moving.clone(),
        link_sign: vec![0.0; n],
        gap: vec![0.0; n],
        gravity: vec![0.0; n],
        moving,
        position: joint.q[..n].iter().map(|q| q - joint.q[0]).collect(),
        velocity,
        moved,
    })
}

/// Returns the velocity at the rows, a mean over five differences centred on the row.
fn smoothed(moved: &[f64], rate: f64) -> Vec<f64> {
    let n = moved.len();
    (0..n)
        .map(|k| {
            // The difference k spans rows k and k + 1; row k lies between differences k − 1 and k.
            let (low, high) = (k.saturating_sub(2), (k + 2).min(n));
            mean(&moved[low..high]) * rate
        })
        .collect()
}

/// Noise of a velocity that changes slowly, from its second differences.
fn noise(velocity: &[f64]) -> f64 {
    let second: Vec<f64> = (velocity.windows(3))
        .map(|w| (w[0] - 2.0 * w[1] + w[2]).abs())
        .collect();
    // Median of the magnitude over 0.6745 is the standard deviation; the second difference of white noise has √6 of it.
    median_of_finite(second).unwrap_or(0.0) / (0.6745 * 6f64.sqrt())
}

fn without_mean(values: &[f64]) -> Vec<f64> {
    let middle = mean(values);
    values.iter().map(|v| v - middle).collect()
}

/// Subtracts the line through the two ends: what holds the joint at rest.
fn without_line(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let end = ((END * n as f64) as usize).clamp(1, MOST);
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
