//! Rigid bodies on the link: masses and their positions, summed with the parallel-axis theorem.

/// One rigid body fixed to the link, in the plane of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// kg.
    pub mass: f64,
    /// Distance of its centre of mass from the joint axis, m.
    pub distance: f64,
    /// Angle of its centre of mass from the link's x axis, rad.
    pub angle: f64,
    /// Moment of inertia about its own centre of mass, along the joint axis, kg·m².
    pub inertia: f64,
}

/// Inertia and first moment of a set of bodies at the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Load {
    /// kg·m² about the joint axis.
    pub(crate) inertia: f64,
    /// Mass times centre of mass along the link's x and y, kg·m.
    pub(crate) first_moment: [f64; 2],
}

impl Load {
    pub(crate) fn add(self, body: &Body) -> Self {
        let (s, c) = body.angle.sin_cos();
        let moment = body.mass * body.distance;
        Self {
            inertia: self.inertia + body.inertia + moment * body.distance,
            first_moment: [
                self.first_moment[0] + moment * c,
                self.first_moment[1] + moment * s,
            ],
        }
    }

    /// Returns the coefficients (gc, gs) of the gravity torque gc·cos q + gs·sin q that a drive must hold. The joint
    /// turns about the base's −y (modified Denavit–Hartenberg with α = π/2). The link's x axis is (cos q, 0, sin q),
    /// its y axis (−sin q, 0, cos q), and U = −g·(mx·x + my·y).
    pub(crate) fn gravity(&self, [gx, _, gz]: [f64; 3]) -> (f64, f64) {
        let [mx, my] = self.first_moment;
        (my * gx - mx * gz, mx * gx + my * gz)
    }
}
