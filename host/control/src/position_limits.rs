//! Limits of the joints' positions: a motion that asks for more is refused, a motion that leaves them is told.

use super::error::ControlError;
use rig_model::robot::Robot;
use rig_shared::trajectory::Reference;

/// Distance beyond a limit that counts as rounding, rad or m.
const ROUNDING: f64 = 1e-9;

/// The range of a joint, or of a combination of joints that one crank drives.
struct Range {
    /// `joint "elbow"`, or the joints of the crank.
    name: String,
    /// Weight of each joint's position.
    weights: Vec<f64>,
    bounds: [f64; 2],
    unit: &'static str,
}

impl Range {
    fn value(&self, q: impl Fn(usize) -> f64) -> f64 {
        let weighted = self.weights.iter().enumerate();
        weighted
            .filter(|(_, weight)| **weight != 0.0)
            .map(|(j, weight)| weight * q(j))
            .sum()
    }

    /// Returns the limit that a value is beyond.
    fn passed(&self, value: f64) -> Option<f64> {
        let [low, high] = self.bounds;
        match value {
            v if v < low - ROUNDING => Some(low),
            v if v > high + ROUNDING => Some(high),
            _ => None,
        }
    }
}

/// A position beyond its limit.
pub(crate) struct Outside {
    name: String,
    value: f64,
    limit: f64,
    unit: &'static str,
}

impl core::fmt::Display for Outside {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            name,
            value,
            limit,
            unit,
        } = self;
        write!(f, "{name} at {value:.3} {unit}, limit {limit:.3} {unit}")
    }
}

/// The position limits of a robot.
pub(crate) struct PositionLimits {
    ranges: Vec<Range>,
}

impl PositionLimits {
    /// Collects the limits of all joints and cranks of a description.
    pub(crate) fn of(robot: &Robot) -> Self {
        let n = robot.joints.len();
        let single = robot.joints.iter().enumerate().filter_map(|(j, joint)| {
            Some(Range {
                name: format!("joint \"{}\"", joint.name),
                weights: (0..n).map(|k| f64::from(u8::from(k == j))).collect(),
                bounds: joint.limits.as_ref()?.position,
                unit: joint.kind.units().0,
            })
        });
        let combined = robot.combined_limits().into_iter();
        let combined = combined.map(|(weights, bounds)| {
            let joints = robot.joints.iter().zip(&weights);
            let names: Vec<String> = joints
                .filter(|(_, weight)| **weight != 0.0)
                .map(|(joint, weight)| match *weight {
                    1.0 => joint.name.clone(),
                    weight => format!("{weight}*{}", joint.name),
                })
                .collect();
            Range {
                name: format!("the sum {} (it turns a crank)", names.join(" + ")),
                weights,
                bounds,
                unit: "rad",
            }
        });
        Self {
            ranges: single.chain(combined).collect(),
        }
    }

    /// Returns the first range that a pose leaves.
    pub(crate) fn outside(&self, q: impl Fn(usize) -> f64) -> Option<Outside> {
        self.ranges.iter().find_map(|range| {
            let value = range.value(&q);
            Some(Outside {
                name: range.name.clone(),
                value,
                limit: range.passed(value)?,
                unit: range.unit,
            })
        })
    }

    /// Refuses a desired motion that leaves a range.
    ///
    /// # Errors
    /// [`ControlError::Unreachable`] with joint, value, limit and time.
    pub(crate) fn check(
        &self,
        reference: &[Vec<Reference<f64>>],
        period: f64,
    ) -> Result<(), ControlError> {
        for k in 0..reference.first().map_or(0, Vec::len) {
            if let Some(outside) = self.outside(|j| reference[j][k].position) {
                return Err(ControlError::Unreachable(format!(
                    "The desired motion is beyond a position limit after {:.3} s: {outside}. Give a motion within the limits.",
                    k as f64 * period
                )));
            }
        }
        Ok(())
    }

    /// Returns a sentence about each range that a motion left. `q` has one series a joint.
    pub(crate) fn left(&self, q: &[Vec<f64>], period: f64) -> Vec<String> {
        let samples = q.first().map_or(0, Vec::len);
        let sentence = |range: &Range| {
            let value = |k: usize| range.value(|j| q[j][k]);
            let first = (0..samples).find(|k| range.passed(value(*k)).is_some())?;
            let beyond = |k: usize| (range.bounds[0] - value(k)).max(value(k) - range.bounds[1]);
            let farthest = (first..samples).max_by(|a, b| beyond(*a).total_cmp(&beyond(*b)))?;
            Some(format!(
                "{} left its limit {:.3} {unit} after {:.3} s and was at {:.3} {unit} after {:.3} s. A real joint would have hit its stop; the simulation has none.",
                range.name,
                range.passed(value(farthest))?,
                first as f64 * period,
                value(farthest),
                farthest as f64 * period,
                unit = range.unit,
            ))
        };
        self.ranges.iter().filter_map(sentence).collect()
    }
}
