//! Space vectors, motions, wrenches and inertias for the recursions over a chain.
//!
//! Motions and wrenches refer to the origin of their frame (Featherstone 2008, ch. 2). They are pairs of three-vectors,
//! so that no 6×6 transform is multiplied out.

use core::ops::{Add, AddAssign, Neg, Sub};

use crate::scalar::Real;

/// A vector of three components in some frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vector3<T>(pub(super) [T; 3]);

impl<T: Real> Vector3<T> {
    pub(super) const ZERO: Self = Self([T::ZERO; 3]);

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> T {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        x * a + y * b + z * c
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([y * c - z * b, z * a - x * c, x * b - y * a])
    }

    /// Returns self × (0, 0, `height`), without the products with 0.
    #[inline(always)]
    pub(super) fn cross_z(self, height: T) -> Self {
        let [x, y, _] = self.0;
        Self([y * height, -(x * height), T::ZERO])
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: T) -> Self {
        let [x, y, z] = self.0;
        Self([x * factor, y * factor, z * factor])
    }

    #[inline(always)]
    pub(super) fn z(self) -> T {
        let [_, _, z] = self.0;
        z
    }

    /// Returns the vector with `height` added along z.
    #[inline(always)]
    pub(super) fn plus_z(self, height: T) -> Self {
        let [x, y, z] = self.0;
        Self([x, y, z + height])
    }
}

impl<T: Real> Add for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([x + a, y + b, z + c])
    }
}

impl<T: Real> AddAssign for Vector3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> Sub for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([x - a, y - b, z - c])
    }
}

impl<T: Real> Neg for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let [x, y, z] = self.0;
        Self([-x, -y, -z])
    }
}

/// A symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Symmetric3<T> {
    pub(super) xx: T,
    pub(super) xy: T,
    pub(super) xz: T,
    pub(super) yy: T,
    pub(super) yz: T,
    pub(super) zz: T,
}

impl<T: Real> Symmetric3<T> {
    pub(super) const ZERO: Self = Self {
        xx: T::ZERO,
        xy: T::ZERO,
        xz: T::ZERO,
        yy: T::ZERO,
        yz: T::ZERO,
        zz: T::ZERO,
    };

    /// Returns its rows, which equal its columns.
    #[inline(always)]
    pub(super) fn rows(self) -> [Vector3<T>; 3] {
        [
            Vector3([self.xx, self.xy, self.xz]),
            Vector3([self.xy, self.yy, self.yz]),
            Vector3([self.xz, self.yz, self.zz]),
        ]
    }

    /// Returns the matrix minus a·bᵀ, which must be symmetric.
    #[inline(always)]
    pub(super) fn minus_outer(self, a: Vector3<T>, b: Vector3<T>) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (a.0, b.0);
        Self {
            xx: self.xx - ax * bx,
            xy: self.xy - ax * by,
            xz: self.xz - ax * bz,
            yy: self.yy - ay * by,
            yz: self.yz - ay * bz,
            zz: self.zz - az * bz,
        }
    }

    #[inline(always)]
    pub(super) fn times(self, v: Vector3<T>) -> Vector3<T> {
        Vector3([
            Vector3([self.xx, self.xy, self.xz]).dot(v),
            Vector3([self.xy, self.yy, self.yz]).dot(v),
            Vector3([self.xz, self.yz, self.zz]).dot(v),
        ])
    }

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
        }
    }

    /// Returns 2(a·b)·1 − (a·bᵀ + b·aᵀ): the mixed term of the parallel-axis theorem.
    #[inline(always)]
    fn mixed(a: Vector3<T>, b: Vector3<T>) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (a.0, b.0);
        let (x, y, z) = (ax * bx, ay * by, az * bz);
        Self {
            xx: y + z + (y + z),
            xy: -(ax * by + ay * bx),
            xz: -(ax * bz + az * bx),
            yy: x + z + (x + z),
            yz: -(ay * bz + az * by),
            zz: x + y + (x + y),
        }
    }
}

/// Velocity or acceleration of a rigid body: rotation, and motion of the body's point at the frame's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion<T> {
    pub(super) angular: Vector3<T>,
    pub(super) linear: Vector3<T>,
}

impl<T: Real> Motion<T> {
    pub(super) const ZERO: Self = Self {
        angular: Vector3::ZERO,
        linear: Vector3::ZERO,
    };

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: T) -> Self {
        Self {
            angular: self.angular.scaled(factor),
            linear: self.linear.scaled(factor),
        }
    }

    /// Returns self × other: the rate of a motion fixed in a frame moving with `self` (Featherstone 2008, eq. 2.31).
    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            angular: self.angular.cross(other.angular),
            linear: self.angular.cross(other.linear) + self.linear.cross(other.angular),
        }
    }

    /// Returns self ×* wrench: the same for a wrench or momentum (Featherstone 2008, eq. 2.32).
    #[inline(always)]
    pub(super) fn cross_wrench(self, wrench: Wrench<T>) -> Wrench<T> {
        Wrench {
            force: self.angular.cross(wrench.force),
            moment: self.angular.cross(wrench.moment) + self.linear.cross(wrench.force),
        }
    }

    /// Returns the power of a wrench along this motion.
    #[inline(always)]
    pub(super) fn dot(self, wrench: Wrench<T>) -> T {
        self.angular.dot(wrench.moment) + self.linear.dot(wrench.force)
    }
}

/// Force and moment about the frame's origin; likewise linear and angular momentum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wrench<T> {
    pub(super) force: Vector3<T>,
    pub(super) moment: Vector3<T>,
}

impl<T: Real> Wrench<T> {
    pub(super) const ZERO: Self = Self {
        force: Vector3::ZERO,
        moment: Vector3::ZERO,
    };

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            force: self.force + other.force,
            moment: self.moment + other.moment,
        }
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: T) -> Self {
        Self {
            force: self.force.scaled(factor),
            moment: self.moment.scaled(factor),
        }
    }
}

/// Mass, first moment and inertia about the frame's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertia<T> {
    pub(super) mass: T,
    pub(super) first_moment: Vector3<T>,
    pub(super) inertia: Symmetric3<T>,
}

impl<T: Real> Inertia<T> {
    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            inertia: self.inertia.plus(other.inertia),
        }
    }

    /// Returns the momentum of the body at a velocity (or the inertial wrench at an acceleration from rest).
    #[inline(always)]
    pub(super) fn times(self, motion: Motion<T>) -> Wrench<T> {
        Wrench {
            force: motion.linear.scaled(self.mass) + motion.angular.cross(self.first_moment),
            moment: self.inertia.times(motion.angular) + self.first_moment.cross(motion.linear),
        }
    }
}

/// Pose of frame i in frame i − 1 at some joint position.
///
/// The rotation is RotX(α)·RotZ(θ). The two factors are applied one after the other: eight products instead of nine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform<T> {
    pub(super) sin_alpha: T,
    pub(super) cos_alpha: T,
    pub(super) sin_theta: T,
    pub(super) cos_theta: T,
    /// Origin of frame i in frame i − 1.
    pub(super) origin: Vector3<T>,
}

impl<T: Real> Transform<T> {
    /// The identity transform.
    pub(super) const IDENTITY: Self = Self {
        sin_alpha: T::ZERO,
        cos_alpha: T::ONE,
        sin_theta: T::ZERO,
        cos_theta: T::ONE,
        origin: Vector3::ZERO,
    };

    /// Transforms a direction from frame i − 1 to frame i.
    #[inline(always)]
    pub(super) fn direction_to_child(&self, v: Vector3<T>) -> Vector3<T> {
        let [x, y, z] = v.0;
        let turned = self.cos_alpha * y + self.sin_alpha * z;
        Vector3([
            self.cos_theta * x + self.sin_theta * turned,
            self.cos_theta * turned - self.sin_theta * x,
            self.cos_alpha * z - self.sin_alpha * y,
        ])
    }

    /// Transforms a direction from frame i to frame i − 1.
    #[inline(always)]
    pub(super) fn direction_to_parent(&self, v: Vector3<T>) -> Vector3<T> {
        let [x, y, z] = v.0;
        let turned = self.sin_theta * x + self.cos_theta * y;
        Vector3([
            self.cos_theta * x - self.sin_theta * y,
            self.cos_alpha * turned - self.sin_alpha * z,
            self.sin_alpha * turned + self.cos_alpha * z,
        ])
    }

    /// Transforms a motion of frame i − 1 to the origin and the axes of frame i.
    #[inline(always)]
    pub(super) fn motion_to_child(&self, motion: Motion<T>) -> Motion<T> {
        Motion {
            angular: self.direction_to_child(motion.angular),
            linear: self.direction_to_child(motion.linear + motion.angular.cross(self.origin)),
        }
    }

    /// Transforms a wrench of frame i to the origin and the axes of frame i − 1.
    #[inline(always)]
    pub(super) fn wrench_to_parent(&self, wrench: Wrench<T>) -> Wrench<T> {
        let force = self.direction_to_parent(wrench.force);
        Wrench {
            force,
            moment: self.direction_to_parent(wrench.moment) + self.origin.cross(force),
        }
    }

    /// Transforms a symmetric tensor from frame i to frame i − 1.
    #[inline(always)]
    pub(super) fn symmetric_to_parent(&self, s: Symmetric3<T>) -> Symmetric3<T> {
        // R·S·Rᵀ: rotates the rows of S, then the columns of the result.
        let [x, y, z] = s.rows().map(|row| self.direction_to_parent(row));
        let ([ax, bx, cx], [ay, by, cy], [az, bz, cz]) = (x.0, y.0, z.0);
        let Vector3([xx, _, _]) = self.direction_to_parent(Vector3([ax, ay, az]));
        let Vector3([xy, yy, _]) = self.direction_to_parent(Vector3([bx, by, bz]));
        let Vector3([xz, yz, zz]) = self.direction_to_parent(Vector3([cx, cy, cz]));
        Symmetric3 {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
        }
    }

    /// Transforms an inertia of frame i to the origin and the axes of frame i − 1.
    #[inline(always)]
    pub(super) fn inertia_to_parent(&self, body: Inertia<T>) -> Inertia<T> {
        let rotated = self.symmetric_to_parent(body.inertia);
        let moment = self.direction_to_parent(body.first_moment);
        let shift = self.origin.scaled(body.mass);
        // Parallel axes with r = p + s: the mixed term of p with m·c + m·p/2.
        let half = T::from_f64(0.5);
        Inertia {
            mass: body.mass,
            first_moment: moment + shift,
            inertia: rotated.plus(Symmetric3::mixed(self.origin, moment + shift.scaled(half))),
        }
    }
}
