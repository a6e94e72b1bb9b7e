//! Gravity that does not stand where the description says: a base that is not level.
//!
//! Two angles θ about level axes turn gravity by g·(θ₁·e₁ + θ₂·e₂), e₁ and e₂ level; what that does to every joint is the
//! torque that holds the links in a field along e₁ or e₂. Unlike a spring or a ripple it shows at all joints at once, each
//! with its own first moments, and moves joints that turn about the vertical: one degree under 25 N·m of another joint is
//! 0.4 N·m there.
//!
//! Leaves out: that gravity keeps its size when it turns, which masses and gains make up for; where the first joint's axis
//! is level, an error of its zero, which does the same as a turn of gravity about it.

use nalgebra::{Matrix2, Unit, Vector2, Vector3};
use rig_shared::multibody::{COLUMNS, Chain, gravity_vector};
use serde::Serialize;

use rig_data::prepare::PrepareError;
use rig_output::format_value;

/// Gravity as the data show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseTilt {
    /// m/s² in the base frame, of the size that the description states.
    pub gravity: [f64; 3],
    /// Between it and the description's, rad.
    pub angle: f64,
    /// Standard deviation of the angle, rad.
    pub std: f64,
    /// Logarithm of how many times more likely the data are with it.
    pub log_evidence: f64,
    /// About the two level axes: what gravity gains sideways, over its size.
    #[serde(skip)]
    pub(super) angles: [f64; 2],
}

impl BaseTilt {
    /// From what gravity gains along the two level axes, over its size, and the covariance of that.
    pub(super) fn of(
        axes: &Axes,
        angles: [f64; 2],
        covariance: &Matrix2<f64>,
        log_evidence: f64,
    ) -> Self {
        let along = Vector2::from(angles);
        // What is fitted is how far gravity's tip moves sideways, over its length: the tangent of the angle.
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

    /// One sentence.
    pub(super) fn said(&self) -> String {
        let [x, y, z] = self.gravity;
        format!(
            "Gravity stands {} degrees off the direction that the description states: the base is not level. Data and description are e^{:.0} times as likely so; a joint's zero or a torque sensor's gain that is off by much can look alike. It was fitted with gravity ({x:.4}, {y:.4}, {z:.4}) m/s^2, which identified.toml states; identified.urdf turns the base.",
            format_value(self.angle.to_degrees(), self.std.to_degrees()),
            self.log_evidence
        )
    }
}

/// Gravity of a description and two unit vectors level with respect to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    gravity: Vector3<f64>,
    size: f64,
    level: [Vector3<f64>; 2],
}

impl Axes {
    /// None where there is no gravity.
    pub(super) fn of(gravity: [f64; 3]) -> Option<Self> {
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

/// Torque of an angle of one radian about each axis, for links of given inertial values.
pub(super) struct TiltColumns {
    fields: [Chain<f64>; 2],
    parameters: Vec<[f64; COLUMNS]>,
    q: Vec<f64>,
    torque: [Vec<f64>; 2],
}

impl TiltColumns {
    /// `standard` are the parameters of all joints, [`COLUMNS`] each.
    pub(super) fn new(chain: &Chain<f64>, axes: &Axes, standard: &[f64]) -> Self {
        let n = chain.joint_count();
        let parameters = standard
            .chunks_exact(COLUMNS)
            .take(n)
            .map(|link| std::array::from_fn(|k| link[k]))
            .collect();
        Self {
            fields: axes
                .level
                .map(|e| chain.with_gravity((e * axes.size).into())),
            parameters,
            q: vec![0.0; n],
            torque: [vec![0.0; n], vec![0.0; n]],
        }
    }

    /// Both angles' torques at all joints at the position of row `i`.
    pub(super) fn at(&mut self, q: &[Vec<f64>], i: usize) -> Result<&[Vec<f64>; 2], PrepareError> {
        for (to, of) in self.q.iter_mut().zip(q) {
            *to = of[i];
        }
        for (chain, torque) in self.fields.iter().zip(&mut self.torque) {
            gravity_vector(chain, &self.parameters, &self.q, torque)
                .map_err(super::model::failed)?;
        }
        Ok(&self.torque)
    }
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
