//! Places and orientations of MJCF elements.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

use super::elements::{Reader, Xml};
use crate::robot::error::RobotError;

impl<'a> Reader<'a> {
    /// Reads `pos` and the orientation of an element.
    pub(super) fn pose(&self, node: Xml<'a>) -> Result<Isometry3<f64>, RobotError> {
        let pos = self.array::<3>(node, "pos")?.unwrap_or_default();
        Ok(Isometry3::from_parts(
            Translation3::from(Vector3::from(pos)),
            self.orientation(node)?,
        ))
    }

    /// Reads the orientation in any of its forms.
    fn orientation(&self, node: Xml<'a>) -> Result<UnitQuaternion<f64>, RobotError> {
        let null = |name: &str| {
            self.error(
                node,
                format!("`{name}` has no direction; give a vector that is not 0"),
            )
        };
        if let Some([w, x, y, z]) = self.array::<4>(node, "quat")? {
            let quaternion = nalgebra::Quaternion::new(w, x, y, z);
            return UnitQuaternion::try_new(quaternion, 1e-12).ok_or_else(|| null("quat"));
        }
        if let Some([x, y, z, angle]) = self.array::<4>(node, "axisangle")? {
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-12);
            let axis = axis.ok_or_else(|| null("axisangle"))?;
            return Ok(UnitQuaternion::from_axis_angle(&axis, self.angle(angle)));
        }
        if let Some(angles) = self.array::<3>(node, "euler")? {
            return Ok(self.euler(angles));
        }
        if let Some([a, b, c, d, e, f]) = self.array::<6>(node, "xyaxes")? {
            let x = Vector3::new(a, b, c).try_normalize(1e-12);
            let x = x.ok_or_else(|| null("xyaxes"))?;
            let y = Vector3::new(d, e, f);
            let y = (y - x * x.dot(&y)).try_normalize(1e-12);
            let y = y.ok_or_else(|| null("xyaxes"))?;
            let columns = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            let rotation = Rotation3::from_matrix_unchecked(columns);
            return Ok(UnitQuaternion::from_rotation_matrix(&rotation));
        }
        if let Some(z) = self.array::<3>(node, "zaxis")? {
            let z = Vector3::from(z)
                .try_normalize(1e-12)
                .ok_or_else(|| null("zaxis"))?;
            let turned = UnitQuaternion::rotation_between(&Vector3::z(), &z);
            // Opposite to z, every axis across is as short a way; MuJoCo turns about x.
            let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            return Ok(turned.unwrap_or(half));
        }
        Ok(UnitQuaternion::identity())
    }

    /// Turns Euler angles into an orientation. Lower-case axes turn with the body, capital ones do not.
    fn euler(&self, angles: [f64; 3]) -> UnitQuaternion<f64> {
        let mut orientation = UnitQuaternion::identity();
        for (axis, angle) in self.order.chars().zip(angles) {
            let about = match axis.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let turn = UnitQuaternion::from_axis_angle(&about, self.angle(angle));
            orientation = match axis.is_ascii_lowercase() {
                true => orientation * turn,
                false => turn * orientation,
            };
        }
        orientation
    }
}
