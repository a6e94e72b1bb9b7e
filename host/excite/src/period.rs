//! The period of a motion, and the times that follow from it.

use core::f64::consts::TAU;

use rig_shared::trajectory::HARMONICS;

use crate::bounds::{Bounds, Room, bounds_of};
use crate::error::wrong;
use crate::schedule::Schedule;
use crate::{ExciteError, Options};
use rig_model::robot::{Joint, JointKind, JointLimits, Robot};

/// Shortest chosen period, s. Limits that mean "none" would give a motion of a fraction of a second, too short to
/// settle and to record.
const SHORTEST: f64 = 1.0;
/// Longest period, s: an hour. The trajectory's own times are 32 bits of microseconds.
const LONGEST: f64 = 3600.0;

/// Returns a period whose harmonics can use the limits. The fundamental is slow enough to sweep the position range at
/// the highest velocity. The fastest harmonic is at most where highest velocity and acceleration meet. The longest over
/// the joints, rounded up to 0.1 s, at least 1 s. The highest values are the limits. Without an acceleration limit they
/// are the torque limit's values, with the described inertia and viscous friction.
pub fn default_period(robot: &Robot, harmonics: usize) -> Result<f64, ExciteError> {
    period_within(robot, &bounds_of(robot, Room::ALL, None)?.0, harmonics)
}

fn period_within(robot: &Robot, bounds: &[Bounds], harmonics: usize) -> Result<f64, ExciteError> {
    let mut period = SHORTEST;
    for (joint, bounds) in robot.joints.iter().zip(bounds) {
        let [driven, by_torque] = bounds.driven;
        let acceleration = bounds.acceleration.map_or(by_torque, |a| a.min(by_torque));
        let within = (acceleration * (bounds.high - bounds.low)).sqrt();
        let velocity = driven.min(bounds.velocity).min(within);
        let to_sweep = TAU * bounds.half() / velocity;
        let needed = to_sweep.max(TAU * harmonics as f64 * velocity / acceleration);
        if needed > LONGEST {
            let of_velocity = velocity == bounds.velocity && needed == to_sweep;
            return Err(slow(joint, bounds, of_velocity, needed));
        }
        period = period.max(needed);
    }
    // Rounding errors must not raise an exact tenth to the next.
    Ok((period * 10.0 - 1e-9).ceil() / 10.0)
}

/// Returns the error of a joint that is too slow, by its velocity limit or by what bounds its acceleration.
fn slow(joint: &Joint, bounds: &Bounds, of_velocity: bool, period: f64) -> ExciteError {
    let turns = joint.kind == JointKind::Revolute;
    // The described limit, and the share of it that is used.
    let described = |used: f64, limit: Option<f64>| {
        let limit = limit.unwrap_or(used);
        (limit, used / limit)
    };
    let limits = joint.limits.as_ref();
    let (limit, (value, share), units) = match (of_velocity, bounds.acceleration, bounds.torque) {
        (false, None, Some(torque)) => ("torque limit", (torque, 1.0), ["N·m", "N"]),
        (false, Some(acceleration), _) => (
            "acceleration limit",
            described(acceleration, limits.and_then(|l| l.acceleration)),
            ["rad/s²", "m/s²"],
        ),
        _ => (
            "velocity limit",
            described(
                bounds.velocity,
                limits.and_then(JointLimits::known_velocity),
            ),
            ["rad/s", "m/s"],
        ),
    };
    ExciteError::Slow {
        joint: joint.name.clone(),
        limit,
        value,
        share,
        unit: units[usize::from(!turns)],
        period,
    }
}

fn micros(name: &'static str, seconds: f64) -> Result<u32, ExciteError> {
    let micros = (seconds * 1e6).round();
    if (1e3..=1e6 * LONGEST).contains(&micros) {
        Ok(micros as u32)
    } else {
        Err(ExciteError::Option {
            name,
            value: seconds.to_string(),
            right: format!("it must be between 0.001 and {LONGEST} s"),
        })
    }
}

/// Returns the times of a motion from the options, with the period from the limits if it is not given.
pub(super) fn schedule_of(
    robot: &Robot,
    bounds: &[Bounds],
    options: &Options,
) -> Result<Schedule, ExciteError> {
    if !(1..=HARMONICS).contains(&options.harmonics) {
        return Err(wrong(
            "number of harmonics",
            options.harmonics.to_string(),
            format!("it must be between 1 and {HARMONICS}"),
        ));
    }
    for (name, count) in [
        ("number of starts", options.starts),
        ("number of periods", u32::from(options.periods)),
    ] {
        if count == 0 {
            return Err(wrong(name, "0".into(), "there must be at least one".into()));
        }
    }
    let period = match options.period {
        Some(period) => period,
        None => period_within(robot, bounds, options.harmonics)?,
    };
    let period_us = micros("period", period)?;
    let ramp_us = micros("ramp", options.ramp.unwrap_or(period))?;
    if ramp_us / 4 > period_us {
        return Err(wrong(
            "ramp",
            format!("{} s", f64::from(ramp_us) * 1e-6),
            format!("it must not be longer than four periods of {period} s"),
        ));
    }
    Ok(Schedule {
        period_us,
        ramp_us,
        periods: options.periods,
        harmonics: options.harmonics,
    })
}
