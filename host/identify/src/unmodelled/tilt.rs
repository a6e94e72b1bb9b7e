//! Base tilt: gravity that deviates from the described direction.
//!
//! Two angles θ about horizontal axes change gravity by g·(θ₁·e₁ + θ₂·e₂), with e₁ and e₂ horizontal. Their effect on
//! each joint is the torque that holds the links in a field along e₁ or e₂. Unlike a spring or a ripple, a tilt shows
//! at all joints, each with its own first moments. It also moves joints with a vertical axis: one degree under 25 N·m
//! of another joint is 0.4 N·m there.
//!
//! Limits: gravity grows slightly when it turns, which masses and gains compensate. If the first joint's axis is
//! horizontal, a tilt about it is collinear with an error of its zero.

use nalgebra::{Matrix2, Unit, Vector2, Vector3};
use rig_shared::multibody::{COLUMNS, Chain};
use serde::Serialize;

use super::field_torque::FieldTorque;
use rig_output::format_value;

/// Gravity identified from the data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseTilt {
    /// Gravity, m/s² in the base frame, with the described magnitude.
    pub gravity: [f64; 3],
    /// Angle to the described gravity, rad.
    pub angle: f64,
    /// Standard deviation of the angle, rad.
    pub std: f64,
    /// Logarithm of the likelihood ratio of the data with and without the tilt.
    pub log_evidence: f64,
    /// Tilt about the two horizontal axes: horizontal components of gravity over its magnitude.
    #[serde(skip)]
    pub(crate) angles: [f64; 2],
}

impl BaseTilt {
    /// Builds the tilt from the horizontal components of gravity over its magnitude, and their covariance.
    pub(crate) fn of(
        axes: &Axes,
        angles: [f64; 2],
        covariance: &Matrix2<f64>,
        log_evidence: f64,
    ) -> Self {
        let along = Vector2::from(angles);
        // The fitted value is the horizontal component over the magnitude: the tangent of the angle.
        let tangent = along.norm();
        let level = axes.level[0] * angles[0] + axes.level[1] * angles[1];
        let turned = (axes.gravity / axes.size + level).normalize() * axes.size;
        let unit = along / tangent.max(f64::MIN_POSITIVE);
        let variance = (unit.transpose() * covariance * unit)[0].max(0.0);
        Self {
            gravity: turned.into(),
            angle: tangent.atan(),
            std: variance.sqrt() / (1.0 + tangent * tangent),
            log_evidence,
            angles,
        }
    }

    /// Returns one sentence.
    pub(crate) fn said(&self) -> String {
        let [x, y, z] = self.gravity;
        format!(
            "Gravity stands {} degrees off the direction that the description states: the base is not level. Data and description are e^{:.0} times as likely so; a joint's zero or a torque sensor's gain that is off by much can look alike. It was fitted with gravity ({x:.4}, {y:.4}, {z:.4}) m/s^2, which identified.toml states; identified.urdf turns the base.",
            format_value(self.angle.to_degrees(), self.std.to_degrees()),
            self.log_evidence
        )
    }
}

/// Described gravity and two horizontal unit vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    gravity: Vector3<f64>,
    size: f64,
    level: [Vector3<f64>; 2],
}

impl Axes {
    /// Returns none if there is no gravity.
    pub(crate) fn of(gravity: [f64; 3]) -> Option<Self> {
        let gravity = Vector3::from(gravity);
        let down = Unit::try_new(gravity, 1e-9)?;
        let least = down.iamin();
        let mut first = Vector3::zeros();
        first[least] = 1.0;
        let first = (first - *down * down[least]).normalize();
        Some(Self {
            gravity,
            size: gravity.norm(),
            level: [first, down.cross(&first)],
        })
    }
}

/// Builds the torque of a tilt of one radian about each axis; `standard` holds the parameters of all links, [`COLUMNS`]
/// each.
pub(crate) fn tilt_torque(chain: &Chain<f64>, axes: &Axes, standard: &[f64]) -> FieldTorque {
    let parameters = standard
        .chunks_exact(COLUMNS)
        .take(chain.link_count())
        .map(|link| std::array::from_fn(|k| link[k]))
        .collect();
    let fields = axes.level.map(|e| (e * axes.size).into());
    FieldTorque::new(chain, fields, parameters)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_tilt_is_the_angle_that_gravity_turns_by() {
        let Some(axes) = Axes::of([0.0, 0.0, -9.81]) else {
            unreachable!("there is gravity");
        };
        let covariance = Matrix2::identity() * 1e-6;
        let tilt = BaseTilt::of(&axes, [0.6_f64.tan(), 0.0], &covariance, 100.0);
        let down = Vector3::new(0.0, 0.0, -1.0);
        let turned = Vector3::from(tilt.gravity).angle(&down);
        assert!((turned - 0.6).abs() < 1e-12 && (tilt.angle - 0.6).abs() < 1e-12);
        let wider = BaseTilt::of(&axes, [0.6_f64.tan() + 1e-3, 0.0], &covariance, 100.0);
        assert!((wider.angle - tilt.angle - tilt.std).abs() < 1e-6);
    }
}
