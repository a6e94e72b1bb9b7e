//! Mass, first moment and inertia of a body, moved from frame to frame.

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::robot::joint::Inertial;

/// Mass, first moment and inertia of a rigid body, all about the origin of one frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::robot) struct SpatialInertia {
    pub mass: f64,
    pub first_moment: Vector3<f64>,
    pub inertia: Matrix3<f64>,
}

impl SpatialInertia {
    pub(super) fn zero() -> Self {
        Self {
            mass: 0.0,
            first_moment: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        }
    }

    /// Builds the body from mass, centre of mass and inertia about the centre of mass (Steiner).
    pub(in crate::robot) fn from_centre(
        mass: f64,
        centre: Vector3<f64>,
        about_centre: Matrix3<f64>,
    ) -> Self {
        Self {
            mass,
            first_moment: centre * mass,
            inertia: about_centre + steiner(centre) * mass,
        }
    }

    /// Returns the same body in another frame; `pose` is this frame in that one.
    ///
    /// With c → R·c + p: Σm·S(Rc+p)ᵀS(Rc+p) expands into the four terms below. No division by the mass is needed.
    pub(in crate::robot) fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let (r, p) = (pose.rotation.to_rotation_matrix(), pose.translation.vector);
        let h = r * self.first_moment;
        let product =
            |a: &Vector3<f64>, b: &Vector3<f64>| Matrix3::identity() * a.dot(b) - b * a.transpose();
        Self {
            mass: self.mass,
            first_moment: h + p * self.mass,
            inertia: r * self.inertia * r.transpose()
                + product(&h, &p)
                + product(&p, &h)
                + product(&p, &p) * self.mass,
        }
    }

    pub(in crate::robot) fn plus(&self, other: &Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            inertia: self.inertia + other.inertia,
        }
    }

    pub(super) fn minus(&self, other: &Self) -> Self {
        Self {
            mass: self.mass - other.mass,
            first_moment: self.first_moment - other.first_moment,
            inertia: self.inertia - other.inertia,
        }
    }

    /// Builds the body from a description's values, in the frame of its joint.
    pub(in crate::robot) fn of(inertial: &Inertial) -> Self {
        let [xx, xy, xz, yy, yz, zz] = inertial.inertia;
        Self {
            mass: inertial.mass,
            first_moment: Vector3::from(inertial.first_moment),
            inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        }
    }

    /// Returns the values in the form of a description.
    pub(in crate::robot) fn inertial(&self) -> Inertial {
        let (h, i) = (self.first_moment, self.inertia);
        Inertial {
            mass: self.mass,
            first_moment: [h.x, h.y, h.z],
            inertia: [i.m11, i.m12, i.m13, i.m22, i.m23, i.m33],
        }
    }

    /// Returns the centre of mass and the inertia about it; `None` for a first moment without a mass.
    pub(in crate::robot) fn about_centre(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        if self.mass <= 0.0 {
            return (self.first_moment == Vector3::zeros())
                .then(|| (Vector3::zeros(), self.inertia));
        }
        let centre = self.first_moment / self.mass;
        Some((centre, self.inertia - steiner(centre) * self.mass))
    }
}

/// Returns the inertia of a unit mass at a point, about the origin.
fn steiner(point: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() * point.norm_squared() - point * point.transpose()
}
