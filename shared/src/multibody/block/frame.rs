//! Joints prepared for blocks.

use super::super::chain::{Chain, JointKind};
use super::super::spatial::Vector3;
use super::lane::{LANES, Lane};
use crate::lanes::{Element, MulAdd, sin_cos};
use core::marker::PhantomData;

/// A joint of the chain with the values that are the same for all samples.
#[derive(Clone, Copy, Debug)]
pub struct Frame<T> {
    pub(super) prismatic: bool,
    pub(super) twist: Twist,
    pub(super) sin_alpha: T,
    pub(super) cos_alpha: T,
    pub(super) a: T,
    pub(super) theta: T,
    pub(super) d: T,
    pub(super) sin_theta: T,
    pub(super) cos_theta: T,
}

/// Kinds of twist α with loop bodies of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Twist {
    /// α = 0: parallel axes.
    None,
    /// α = π/2.
    Quarter,
    /// α = −π/2.
    MinusQuarter,
    /// Any other.
    General,
}

impl<T: Element> Frame<T> {
    /// Returns the joints of a chain, base first.
    pub fn of(chain: &Chain<f64>) -> impl Iterator<Item = Self> {
        chain.joints.iter().map(|joint| Self {
            prismatic: joint.kind == JointKind::Prismatic,
            twist: match (joint.sin_alpha, joint.cos_alpha) {
                (0.0, 1.0) => Twist::None,
                (1.0, 0.0) => Twist::Quarter,
                (-1.0, 0.0) => Twist::MinusQuarter,
                _ => Twist::General,
            },
            sin_alpha: T::from_f64(joint.sin_alpha),
            cos_alpha: T::from_f64(joint.cos_alpha),
            a: T::from_f64(joint.a),
            theta: T::from_f64(joint.theta),
            d: T::from_f64(joint.d),
            sin_theta: T::from_f64(joint.sin_theta),
            cos_theta: T::from_f64(joint.cos_theta),
        })
    }

    /// Computes sine and cosine of the angle about z.
    #[inline(always)]
    pub(super) fn angle<F: MulAdd<T>>(&self, q: &Lane<T>, sin: &mut Lane<T>, cos: &mut Lane<T>) {
        if self.prismatic {
            sin.fill(self.sin_theta);
            cos.fill(self.cos_theta);
            return;
        }
        // An integer, because a maximum of floats is no vector operation if NaN may occur.
        let mut out_of_range = T::Bits::default();
        for k in 0..LANES {
            let angle = self.theta + q[k];
            out_of_range = out_of_range | T::mask(angle.abs() > T::ANGLE_LIMIT);
            (sin[k], cos[k]) = sin_cos::<T, F>(angle);
        }
        if out_of_range != T::Bits::default() {
            large_angles(self.theta, q, sin, cos);
        }
    }
}

/// The same for large angles.
#[cold]
#[inline(never)]
fn large_angles<T: Element>(theta: T, q: &Lane<T>, sin: &mut Lane<T>, cos: &mut Lane<T>) {
    for k in 0..LANES {
        let (s, c) = libm::sincos((theta + q[k]).to_f64());
        (sin[k], cos[k]) = (T::from_f64(s), T::from_f64(c));
    }
}

/// The constant part of a joint's pose; the compiler knows its kind of twist and its zeros.
///
/// Between frames i − 1 and i lies the frame that is turned by α only. In it the origin of frame i has the coordinates
/// (a, 0, d) for any twist, so offsets are applied there.
#[derive(Clone, Copy)]
pub(super) struct LinkTransform<T, F, const TWIST: u8, const A: bool, const D: bool> {
    arithmetic: PhantomData<F>,
    pub(super) sin_alpha: T,
    pub(super) cos_alpha: T,
    pub(super) a: T,
    pub(super) d: T,
}

pub(super) const NONE: u8 = 0;
pub(super) const QUARTER: u8 = 1;
pub(super) const MINUS_QUARTER: u8 = 2;
pub(super) const GENERAL: u8 = 3;

impl<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>
    LinkTransform<T, F, TWIST, A, D>
{
    #[inline(always)]
    pub(super) fn new(frame: &Frame<T>) -> Self {
        Self {
            arithmetic: PhantomData,
            sin_alpha: frame.sin_alpha,
            cos_alpha: frame.cos_alpha,
            a: frame.a,
            d: frame.d,
        }
    }

    /// Transforms a direction from frame i − 1 to the turned frame.
    #[inline(always)]
    pub(super) fn rotate(&self, v: Vector3<T>) -> Vector3<T> {
        let [x, y, z] = v.0;
        let (s, c) = (self.sin_alpha, self.cos_alpha);
        match TWIST {
            NONE => v,
            QUARTER => Vector3([x, z, -y]),
            MINUS_QUARTER => Vector3([x, -z, y]),
            _ => Vector3([x, F::mul_add(c, y, s * z), F::mul_add(c, z, -(s * y))]),
        }
    }

    /// Transforms a direction from the turned frame to frame i − 1.
    #[inline(always)]
    pub(super) fn rotate_back(&self, v: Vector3<T>) -> Vector3<T> {
        let [x, y, z] = v.0;
        let (s, c) = (self.sin_alpha, self.cos_alpha);
        match TWIST {
            NONE => v,
            QUARTER => Vector3([x, -z, y]),
            MINUS_QUARTER => Vector3([x, z, -y]),
            _ => Vector3([x, F::mul_add(c, y, -(s * z)), F::mul_add(c, z, s * y)]),
        }
    }

    /// Returns `v` plus the acceleration of the origin of frame i relative to that of frame i − 1 at angular velocity
    /// `w` and acceleration `e`, all in the turned frame: ė × p + w × (w × p) with p = (a, 0, d).
    #[inline(always)]
    pub(super) fn shift_acceleration(
        &self,
        v: Vector3<T>,
        w: Vector3<T>,
        e: Vector3<T>,
    ) -> Vector3<T> {
        let ([mut x, mut y, mut z], [wx, wy, wz], [ex, ey, ez]) = (v.0, w.0, e.0);
        if A {
            x = F::mul_add(-self.a, F::mul_add(wy, wy, wz * wz), x);
            y = F::mul_add(self.a, F::mul_add(wx, wy, ez), y);
            z = F::mul_add(self.a, F::mul_add(wx, wz, -ey), z);
        }
        if D {
            x = F::mul_add(self.d, F::mul_add(wx, wz, ey), x);
            y = F::mul_add(self.d, F::mul_add(wy, wz, -ex), y);
            z = F::mul_add(-self.d, F::mul_add(wx, wx, wy * wy), z);
        }
        Vector3([x, y, z])
    }

    /// Returns `v` plus the velocity of the origin of frame i against frame i − 1's at angular velocity `w`: w × p.
    #[inline(always)]
    pub(super) fn shift_velocity(&self, v: Vector3<T>, w: Vector3<T>) -> Vector3<T> {
        let ([mut x, mut y, mut z], [wx, wy, wz]) = (v.0, w.0);
        if A {
            y = F::mul_add(self.a, wz, y);
            z = F::mul_add(-self.a, wy, z);
        }
        if D {
            x = F::mul_add(self.d, wy, x);
            y = F::mul_add(-self.d, wx, y);
        }
        Vector3([x, y, z])
    }

    /// Transforms a wrench after the turn about z to frame i − 1.
    #[inline(always)]
    pub(super) fn wrench_back(
        &self,
        s: T,
        c: T,
        force: Vector3<T>,
        moment: Vector3<T>,
    ) -> (Vector3<T>, Vector3<T>) {
        let f = rotate_z_back::<T, F>(s, c, force);
        let m = self.shift_moment(rotate_z_back::<T, F>(s, c, moment), f);
        (self.rotate_back(f), self.rotate_back(m))
    }

    /// Returns `m` plus p × f with p = (a, 0, d).
    #[inline(always)]
    pub(super) fn shift_moment(&self, m: Vector3<T>, f: Vector3<T>) -> Vector3<T> {
        let ([mut x, mut y, mut z], [fx, fy, fz]) = (m.0, f.0);
        if A {
            y = F::mul_add(-self.a, fz, y);
            z = F::mul_add(self.a, fy, z);
        }
        if D {
            x = F::mul_add(-self.d, fy, x);
            y = F::mul_add(self.d, fx, y);
        }
        Vector3([x, y, z])
    }
}

/// Returns the constant part of a prismatic joint's pose at position `q`.
#[inline(always)]
pub(super) fn prismatic_transform<T: Element, F: MulAdd<T>>(
    frame: &Frame<T>,
    q: T,
) -> LinkTransform<T, F, GENERAL, true, true> {
    LinkTransform {
        d: frame.d + q,
        ..LinkTransform::new(frame)
    }
}

/// Transforms a direction by the turn about z, forwards.
#[inline(always)]
pub(super) fn rotate_z<T: Element, F: MulAdd<T>>(s: T, c: T, v: Vector3<T>) -> Vector3<T> {
    let [x, y, z] = v.0;
    Vector3([F::mul_add(c, x, s * y), F::mul_add(c, y, -(s * x)), z])
}

/// Transforms a direction by the turn about z, backwards.
#[inline(always)]
pub(super) fn rotate_z_back<T: Element, F: MulAdd<T>>(s: T, c: T, v: Vector3<T>) -> Vector3<T> {
    let [x, y, z] = v.0;
    Vector3([F::mul_add(c, x, -(s * y)), F::mul_add(c, y, s * x), z])
}

/// Runs an expression with a function that returns the [`LinkTransform`] of a joint at a lane. The expression has one
/// copy for each kind of revolute joint (twist and zeros known to the compiler), and one for prismatic joints at
/// position `q`.
macro_rules! at_each_lane {
    ($number:ty, $arithmetic:ty, $frame:expr, $q:expr, $transform:ident => $body:expr) => {{
        let frame: &$crate::multibody::block::Frame<_> = $frame;
        if frame.prismatic {
            let q: &$crate::multibody::block::Lane<_> = $q;
            let $transform = |k: usize| $crate::multibody::block::frame::prismatic_transform::<$number, $arithmetic>(frame, q[k]);
            $body
        } else {
            $crate::multibody::block::frame::with_link_transform!($number, $arithmetic, frame, transform => {
                let $transform = |_: usize| transform;
                $body
            })
        }
    }};
}
pub(super) use at_each_lane;

/// Runs an expression with the [`LinkTransform`] of a revolute joint; the compiler knows its kind of twist and its
/// zeros.
macro_rules! with_link_transform {
    ($number:ty, $arithmetic:ty, $frame:expr, $transform:ident => $body:expr) => {{
        use $crate::multibody::block::frame::{
            GENERAL, LinkTransform, MINUS_QUARTER, NONE, QUARTER, Twist,
        };
        let frame: &$crate::multibody::block::Frame<_> = $frame;
        macro_rules! run {
            ($twist:ident, $a:literal, $d:literal) => {{
                let $transform = LinkTransform::<$number, $arithmetic, $twist, $a, $d>::new(frame);
                $body
            }};
        }
        match (frame.twist, frame.a != T::ZERO, frame.d != T::ZERO) {
            (Twist::None, false, false) => run!(NONE, false, false),
            (Twist::None, false, true) => run!(NONE, false, true),
            (Twist::None, true, false) => run!(NONE, true, false),
            (Twist::None, true, true) => run!(NONE, true, true),
            (Twist::Quarter, false, false) => run!(QUARTER, false, false),
            (Twist::Quarter, false, true) => run!(QUARTER, false, true),
            (Twist::Quarter, true, false) => run!(QUARTER, true, false),
            (Twist::Quarter, true, true) => run!(QUARTER, true, true),
            (Twist::MinusQuarter, false, false) => run!(MINUS_QUARTER, false, false),
            (Twist::MinusQuarter, false, true) => run!(MINUS_QUARTER, false, true),
            (Twist::MinusQuarter, true, false) => run!(MINUS_QUARTER, true, false),
            (Twist::MinusQuarter, true, true) => run!(MINUS_QUARTER, true, true),
            (Twist::General, _, _) => run!(GENERAL, true, true),
        }
    }};
}
pub(super) use with_link_transform;
