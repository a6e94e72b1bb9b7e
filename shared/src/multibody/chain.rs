//! Geometry of a serial chain and its precomputed values.

use core::fmt;

use heapless::Vec;

use super::parameters::COLUMNS;
use super::spatial::{Motion, Transform, Vector3, Wrench};
use crate::scalar::Real;

/// Longest chain, in joints. It sets the size of the stack buffers of every recursion.
pub const MAX_JOINTS: usize = 16;

/// Kind of motion of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about z of its frame; positions in rad.
    Revolute,
    /// Slides along z of its frame; positions in m.
    Prismatic,
}

/// Pose of frame i in frame i − 1 by modified Denavit–Hartenberg parameters:
/// RotX(α)·TransX(a)·RotZ(θ + q if revolute)·TransZ(d + q if prismatic)
/// (Craig 1986, eq. 3.6; Khalil & Dombre 2002, eq. 3.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointGeometry<T = f64> {
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Rotation about x of frame i − 1, rad.
    pub alpha: T,
    /// Translation along x of frame i − 1, m.
    pub a: T,
    /// Rotation about z of frame i, rad; the offset of q if revolute.
    pub theta: T,
    /// Translation along z of frame i, m; the offset of q if prismatic.
    pub d: T,
}

/// Reason why a chain could not be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChainError {
    /// The list of joints is empty.
    NoJoints,
    /// There are more than [`MAX_JOINTS`] joints.
    TooManyJoints {
        /// Number of joints given.
        found: usize,
    },
    /// A geometric parameter is infinite or NaN.
    GeometryNotFinite {
        /// The joint, from 0 at the base.
        joint: usize,
        /// `alpha`, `a`, `theta` or `d`.
        parameter: &'static str,
    },
    /// A component of gravity is infinite or NaN.
    GravityNotFinite,
}

impl fmt::Display for ChainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoJoints => write!(f, "The chain has no joints; it needs at least one."),
            Self::TooManyJoints { found } => write!(
                f,
                "The chain has {found} joints; at most {MAX_JOINTS} are supported."
            ),
            Self::GeometryNotFinite { joint, parameter } => write!(
                f,
                "Parameter {parameter} of joint {} is not a finite number.",
                joint + 1
            ),
            Self::GravityNotFinite => write!(f, "Gravity must be three finite numbers."),
        }
    }
}

impl core::error::Error for ChainError {}

/// Reason why a quantity of a chain could not be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MultibodyError {
    /// The length of a slice does not match the chain.
    WrongLength {
        /// Name of the argument.
        argument: &'static str,
        /// Length it must have.
        expected: usize,
        /// Length it has.
        found: usize,
    },
    /// The inertia matrix is not positive definite (in some lane): no real bodies have these parameters.
    NotPositiveDefinite {
        /// The joint at which the factorisation failed, from 0 at the base.
        joint: usize,
    },
}

impl fmt::Display for MultibodyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WrongLength {
                argument,
                expected,
                found,
            } => write!(f, "{argument} has length {found}; it must be {expected}."),
            Self::NotPositiveDefinite { joint } => write!(
                f,
                "The inertia matrix is not positive definite at joint {}; the inertial parameters \
                 describe no body that can exist.",
                joint + 1
            ),
        }
    }
}

impl core::error::Error for MultibodyError {}

/// Checks that `argument` has the expected length.
#[inline(always)]
pub(super) fn check(
    argument: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), MultibodyError> {
    if expected == found {
        Ok(())
    } else {
        Err(MultibodyError::WrongLength {
            argument,
            expected,
            found,
        })
    }
}

/// One joint with the sines and cosines of its constant angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint<T> {
    pub(super) kind: JointKind,
    pub(super) sin_alpha: T,
    pub(super) cos_alpha: T,
    /// Sine of the constant θ; used if prismatic.
    pub(super) sin_theta: T,
    /// Cosine of the constant θ; used if prismatic.
    pub(super) cos_theta: T,
    pub(super) a: T,
    pub(super) theta: T,
    pub(super) d: T,
}

impl<T: Real> Joint<T> {
    fn new(geometry: &JointGeometry<f64>) -> Self {
        let (sin_alpha, cos_alpha) = exact_quarters(geometry.alpha);
        let (sin_theta, cos_theta) = exact_quarters(geometry.theta);
        Self {
            kind: geometry.kind,
            sin_alpha: T::from_f64(sin_alpha),
            cos_alpha: T::from_f64(cos_alpha),
            sin_theta: T::from_f64(sin_theta),
            cos_theta: T::from_f64(cos_theta),
            a: T::from_f64(geometry.a),
            theta: T::from_f64(geometry.theta),
            d: T::from_f64(geometry.d),
        }
    }

    /// Returns the pose of frame i in frame i − 1 at joint position `q`.
    #[inline(always)]
    pub(super) fn transform(&self, q: T) -> Transform<T> {
        let (sin_theta, cos_theta, height) = match self.kind {
            JointKind::Revolute => {
                let (sin, cos) = (self.theta + q).sin_cos();
                (sin, cos, self.d)
            }
            JointKind::Prismatic => (self.sin_theta, self.cos_theta, self.d + q),
        };
        Transform {
            sin_alpha: self.sin_alpha,
            cos_alpha: self.cos_alpha,
            sin_theta,
            cos_theta,
            origin: Vector3([self.a, -(self.sin_alpha * height), self.cos_alpha * height]),
        }
    }

    /// Returns the motion of link i relative to link i − 1 at unit joint velocity, in frame i.
    #[inline(always)]
    pub(super) fn axis(&self) -> Motion<T> {
        let z = Vector3([T::ZERO, T::ZERO, T::ONE]);
        match self.kind {
            JointKind::Revolute => Motion {
                angular: z,
                linear: Vector3::ZERO,
            },
            JointKind::Prismatic => Motion {
                angular: Vector3::ZERO,
                linear: z,
            },
        }
    }

    /// Returns the part of a wrench in frame i that the drive of joint i has to give.
    #[inline(always)]
    pub(super) fn project(&self, wrench: Wrench<T>) -> T {
        match self.kind {
            JointKind::Revolute => wrench.moment.z(),
            JointKind::Prismatic => wrench.force.z(),
        }
    }

    /// Returns the velocity of link i in frame i from that of link i − 1 in frame i − 1.
    #[inline(always)]
    pub(super) fn velocity(&self, transform: &Transform<T>, parent: Motion<T>, qd: T) -> Motion<T> {
        let carried = transform.motion_to_child(parent);
        match self.kind {
            JointKind::Revolute => Motion {
                angular: carried.angular.plus_z(qd),
                linear: carried.linear,
            },
            JointKind::Prismatic => Motion {
                angular: carried.angular,
                linear: carried.linear.plus_z(qd),
            },
        }
    }
}

/// Returns sine and cosine, exact for multiples of a quarter turn.
///
/// The nearest double to π/2 has the cosine 6·10⁻¹⁷. Columns that vanish for parallel and perpendicular axes would then
/// be tiny instead of zero, and rounding would decide which parameters are identifiable.
fn exact_quarters(angle: f64) -> (f64, f64) {
    // 16 roundings: a quarter turn with all digits, after a few divisions or sums.
    const TOLERANCE: f64 = 16.0 * f64::EPSILON;
    let (sin, cos) = libm::sincos(angle);
    if cos.abs() < TOLERANCE {
        (libm::copysign(1.0, sin), 0.0)
    } else if sin.abs() < TOLERANCE {
        (0.0, libm::copysign(1.0, cos))
    } else {
        (sin, cos)
    }
}

/// A serial chain: the geometry of its joints and gravity, without masses or friction.
#[derive(Clone, Debug)]
pub struct Chain<T> {
    pub(super) joints: Vec<Joint<T>, MAX_JOINTS>,
    pub(super) gravity: Vector3<T>,
}

impl<T: Real> Chain<T> {
    /// Builds the chain from its joints, base first, and the gravitational acceleration in the base frame, m/s² (`[0,
    /// 0, -9.81]` if z points up).
    ///
    /// The input is `f64` for any `T`, so that sines and cosines of the constant angles are right to the last digit of
    /// `T`. Angles within rounding of a multiple of a quarter turn count as exactly that.
    ///
    /// # Errors
    /// [`ChainError`] if there are no joints or more than [`MAX_JOINTS`], or a number is not finite.
    pub fn new(joints: &[JointGeometry<f64>], gravity: [f64; 3]) -> Result<Self, ChainError> {
        if joints.is_empty() {
            return Err(ChainError::NoJoints);
        }
        let mut list = Vec::new();
        for (index, geometry) in joints.iter().enumerate() {
            for (parameter, value) in [
                ("alpha", geometry.alpha),
                ("a", geometry.a),
                ("theta", geometry.theta),
                ("d", geometry.d),
            ] {
                if !value.is_finite() {
                    return Err(ChainError::GeometryNotFinite {
                        joint: index,
                        parameter,
                    });
                }
            }
            list.push(Joint::new(geometry))
                .map_err(|_| ChainError::TooManyJoints {
                    found: joints.len(),
                })?;
        }
        if !gravity.iter().all(|g| g.is_finite()) {
            return Err(ChainError::GravityNotFinite);
        }
        Ok(Self {
            joints: list,
            gravity: Vector3(gravity.map(T::from_f64)),
        })
    }

    /// The same chain under another gravity, m/s² in the base frame (a tilted base, lane by lane if need be).
    #[must_use]
    pub fn with_gravity(&self, gravity: [T; 3]) -> Self {
        Self {
            joints: self.joints.clone(),
            gravity: Vector3(gravity),
        }
    }

    /// Gravitational acceleration in the base frame, m/s².
    pub fn gravity(&self) -> [T; 3] {
        self.gravity.0
    }

    /// Number of joints n.
    #[inline(always)]
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Number of parameters of the whole chain, 14·n.
    #[inline(always)]
    pub fn parameter_count(&self) -> usize {
        COLUMNS * self.joints.len()
    }

    /// How joint `index` (from 0) moves; `None` past the end.
    pub fn kind(&self, index: usize) -> Option<JointKind> {
        self.joints.get(index).map(|joint| joint.kind)
    }
}
