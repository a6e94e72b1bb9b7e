//! Geometry of a serial chain and its precomputed values.

use core::fmt;

use heapless::Vec;

use super::parameters::{COLUMNS, column};
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
    /// A follower has no joint to follow, no place in the chain, or a ratio or an offset that is no number.
    Follower {
        /// The follower, from 0.
        follower: usize,
        /// `master`, `before`, `ratio`, `offset`, or a geometric parameter.
        parameter: &'static str,
    },
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
            Self::Follower {
                follower,
                parameter,
            } => write!(
                f,
                "Parameter {parameter} of follower {} is not possible.",
                follower + 1
            ),
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
    pub(super) fn new(geometry: &JointGeometry<f64>) -> Self {
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

/// An axis of the chain that a joint's drive turns too: its position is ratio·q + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Follower {
    /// Geometry, as that of a joint in the same place.
    pub geometry: JointGeometry<f64>,
    /// The joint (from 0) that the axis stands before; the number of joints for an axis beyond all of them. Followers in
    /// the same place stand in their order.
    pub before: usize,
    /// The joint (from 0) that it follows.
    pub master: usize,
    /// Position per position of the joint: no unit, rad/m or m/rad.
    pub ratio: f64,
    /// Position at the joint's zero, rad or m.
    pub offset: f64,
}

/// How an axis moves: its position is ratio·q + offset of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisMotion<T> {
    /// Row of its link's parameters.
    pub link: usize,
    /// The joint that it is or follows.
    pub joint: usize,
    /// Position per position of the joint, 1 for a joint: no unit, rad/m or m/rad.
    pub ratio: T,
    /// Position at the joint's zero, rad or m; 0 for a joint.
    pub offset: T,
    /// True if it is no joint.
    pub follows: bool,
}

impl<T: Real> AxisMotion<T> {
    pub(super) fn joint(joint: usize) -> Self {
        Self {
            link: joint,
            joint,
            ratio: T::ONE,
            offset: T::ZERO,
            follows: false,
        }
    }

    pub(super) fn follower(link: usize, follower: &Follower) -> Self {
        Self {
            link,
            joint: follower.master,
            ratio: T::from_f64(follower.ratio),
            offset: T::from_f64(follower.offset),
            follows: true,
        }
    }
}

impl<T> AxisMotion<T> {
    /// Returns the number of columns that its link has: without those of a drive if it follows.
    #[must_use]
    pub fn columns(&self) -> usize {
        if self.follows {
            column::DRIVE_INERTIA
        } else {
            COLUMNS
        }
    }
}

/// A serial chain: the geometry of its joints and gravity, without masses or friction.
///
/// An axis of the chain is a joint, or a [`Follower`] that the drive of a joint turns too. Then n stays the number of joints,
/// that of coordinates and torques; rows of parameters and blocks of 14 columns belong to links, of which there are
/// [`Self::link_count`]: those of the joints first, then those of the followers. Where a function says that links before a
/// joint do not load it, its drive may turn an axis before them that they do load.
#[derive(Clone, Debug)]
pub struct Chain<T> {
    /// Axes from the base outwards: joints and followers.
    pub(super) joints: Vec<Joint<T>, MAX_JOINTS>,
    pub(super) gravity: Vector3<T>,
    /// How each axis follows a joint; empty if every axis is a joint.
    pub(super) axes: Vec<AxisMotion<T>, MAX_JOINTS>,
    /// Number of axes that follow.
    pub(super) followers: usize,
}

/// Returns the first parameter that is not finite.
fn not_finite(geometry: &JointGeometry<f64>) -> Option<&'static str> {
    [
        ("alpha", geometry.alpha),
        ("a", geometry.a),
        ("theta", geometry.theta),
        ("d", geometry.d),
    ]
    .into_iter()
    .find_map(|(parameter, value)| (!value.is_finite()).then_some(parameter))
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
            if let Some(parameter) = not_finite(geometry) {
                return Err(ChainError::GeometryNotFinite {
                    joint: index,
                    parameter,
                });
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
            axes: Vec::new(),
            followers: 0,
        })
    }

    /// Builds a chain in which some drives turn several axes. Without followers it is [`Self::new`].
    ///
    /// # Errors
    /// [`ChainError`] as [`Self::new`]; joints and followers together are at most [`MAX_JOINTS`]. A follower needs a
    /// joint to follow, a place in the chain, a ratio other than 0 and finite numbers.
    pub fn with_followers(
        joints: &[JointGeometry<f64>],
        followers: &[Follower],
        gravity: [f64; 3],
    ) -> Result<Self, ChainError> {
        let mut chain = Self::new(joints, gravity)?;
        for (index, follower) in followers.iter().enumerate() {
            let wrong = [
                ("master", follower.master >= joints.len()),
                ("before", follower.before > joints.len()),
                (
                    "ratio",
                    !follower.ratio.is_finite() || follower.ratio == 0.0,
                ),
                ("offset", !follower.offset.is_finite()),
            ]
            .into_iter()
            .find_map(|(parameter, wrong)| wrong.then_some(parameter));
            if let Some(parameter) = wrong.or_else(|| not_finite(&follower.geometry)) {
                return Err(ChainError::Follower {
                    follower: index,
                    parameter,
                });
            }
        }
        if !followers.is_empty() {
            chain.insert(joints, followers)?;
        }
        Ok(chain)
    }

    /// Puts the followers between the joints.
    fn insert(
        &mut self,
        joints: &[JointGeometry<f64>],
        followers: &[Follower],
    ) -> Result<(), ChainError> {
        let found = joints.len() + followers.len();
        let mut list = Vec::new();
        for place in 0..=joints.len() {
            let mut push = |geometry: &JointGeometry<f64>, axis: AxisMotion<T>| {
                list.push(Joint::new(geometry))
                    .and_then(|()| self.axes.push(axis).map_err(|_| Joint::new(geometry)))
                    .map_err(|_| ChainError::TooManyJoints { found })
            };
            for (k, own) in followers.iter().enumerate() {
                if own.before == place {
                    push(&own.geometry, AxisMotion::follower(joints.len() + k, own))?;
                }
            }
            if let Some(joint) = joints.get(place) {
                push(joint, AxisMotion::joint(place))?;
            }
        }
        self.joints = list;
        self.followers = followers.len();
        Ok(())
    }

    /// The same chain under another gravity, m/s² in the base frame (a tilted base, lane by lane if need be).
    #[must_use]
    pub fn with_gravity(&self, gravity: [T; 3]) -> Self {
        Self {
            joints: self.joints.clone(),
            gravity: Vector3(gravity),
            axes: self.axes.clone(),
            followers: self.followers,
        }
    }

    /// Gravitational acceleration in the base frame, m/s².
    pub fn gravity(&self) -> [T; 3] {
        self.gravity.0
    }

    /// Number of joints n: of coordinates, each with a drive.
    #[inline(always)]
    pub fn joint_count(&self) -> usize {
        self.joints.len() - self.followers
    }

    /// Number of links, joints and followers: of rows of parameters.
    #[inline(always)]
    pub fn link_count(&self) -> usize {
        self.joints.len()
    }

    /// Number of parameters of the whole chain, 14 for each link.
    #[inline(always)]
    pub fn parameter_count(&self) -> usize {
        COLUMNS * self.joints.len()
    }

    /// How the axis of link `index` (from 0; followers after the joints) moves; `None` past the end.
    pub fn kind(&self, index: usize) -> Option<JointKind> {
        let axis = self.axis_of_link(index);
        self.joints.get(axis).map(|joint| joint.kind)
    }

    /// Returns true if some axis follows a joint.
    #[inline(always)]
    pub fn has_followers(&self) -> bool {
        self.followers > 0
    }

    /// Returns the chain of all axes, each as a joint of its own.
    #[must_use]
    pub fn unfolded(&self) -> Self {
        Self {
            joints: self.joints.clone(),
            gravity: self.gravity,
            axes: Vec::new(),
            followers: 0,
        }
    }

    /// Returns for each axis, from the base outwards: its link, and the joint and ratio that it moves with.
    pub fn axis_motions(&self) -> impl Iterator<Item = AxisMotion<T>> + '_ {
        (0..self.joints.len()).map(|index| {
            let axis = self.axes.get(index).copied();
            axis.unwrap_or_else(|| AxisMotion::joint(index))
        })
    }

    /// Returns the axis, from the base outwards, that moves link `link`.
    pub(super) fn axis_of_link(&self, link: usize) -> usize {
        let found = self.axes.iter().position(|axis| axis.link == link);
        found.unwrap_or(link)
    }

    /// Returns the link beyond all axes: the last joint's, or that of a follower behind it.
    pub fn last_link(&self) -> usize {
        let last = self.joints.len() - 1;
        self.axes.last().map_or(last, |axis| axis.link)
    }
}
