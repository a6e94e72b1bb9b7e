//! The kernels, compiled for the vector instructions of the machine and selected at run time.
//!
//! Users build for the oldest processor of their kind. A kernel compiled for AVX2 and FMA runs about twice as fast
//! where both exist, and one for AVX-512 is faster again. FMA adds unrounded products ([`MulAdd`]), so these
//! versions differ from the portable one by rounding (tested). Results are identical on one kind of machine, but not between
//! kinds. Other processors use the portable version; on 64-bit Arm it already uses vectors.
//!
//! All versions of a kernel are compiled here, for `f32` and `f64`, and not where a batch is used.

use multiversion::{multiversion, target::match_target};
use rig_shared::lanes::{Element, MulAdd, Rounded};
use rig_shared::multibody::block::{
    self, AxisBlock, Body, CompositeBlock, DerivativeBlock, Frame, JointBlock, Lane, NotPositive,
    Section,
};

/// A number for which the batches are compiled: `f32` or `f64`.
pub trait Number: Element + Kernels<Self> + Send + Sync {}

impl Number for f32 {}

impl Number for f64 {}

/// Adds products without rounding them, on processors with such an instruction.
#[derive(Clone, Copy)]
struct Fused;

/// Makes the versions of the kernels for one number, in a module. Each function selects the best for the machine.
macro_rules! versions {
    ($module:ident, $number:ty, $($name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        mod $module {
            use super::*;

            type T = $number;

            impl MulAdd<T> for Fused {
                const FUSED: bool = true;

                #[inline(always)]
                fn mul_add(a: T, b: T, c: T) -> T {
                    a.mul_add(b, c)
                }
            }

            impl Kernels<T> for T {
                $(
                    fn $name($($argument: $type),*) -> $result {
                        $name($($argument),*)
                    }
                )*
            }

            $(
                #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
                fn $name($($argument: $type),*) -> $result {
                    match_target! {
                        "x86_64+avx512f+avx512dq+avx512vl+avx2+fma" => inlined::$name::<T, Fused>($($argument),*),
                        "x86_64+avx2+fma" => inlined::$name::<T, Fused>($($argument),*),
                        _ => inlined::$name::<T, Rounded>($($argument),*),
                    }
                }
            )*
        }
    };
}

/// Makes the trait of the kernels, their versions, and the portable ones for tests.
macro_rules! kernels {
    ($($(#[$doc:meta])* fn $name:ident<T, F>($($argument:ident: $type:ty),* $(,)?) -> $result:ty $body:block)*) => {
        /// The kernels over blocks of numbers.
        pub trait Kernels<T: Element> {
            $(
                $(#[$doc])*
                fn $name($($argument: $type),*) -> $result;
            )*
        }

        mod inlined {
            use super::*;

            $(
                #[inline(always)]
                pub(super) fn $name<T: Element, F: MulAdd<T>>($($argument: $type),*) -> $result $body
            )*
        }

        #[cfg(test)]
        pub(super) mod portable {
            use super::*;

            $(
                pub(in crate::batch) fn $name<T: Element>($($argument: $type),*) -> $result {
                    inlined::$name::<T, Rounded>($($argument),*)
                }
            )*
        }

        versions!(single, f32, $($name($($argument: $type),*) -> $result;)*);
        versions!(double, f64, $($name($($argument: $type),*) -> $result;)*);
    };
}

kernels! {
    /// [`block::inverse_dynamics`].
    fn inverse_dynamics<T, F>(
        frames: &[Frame<T>], gravity: [T; 3], bodies: &[Body<T>], q: &[Lane<T>], qd: &[Lane<T>],
        qdd: Option<&[Lane<T>]>, work: &mut [JointBlock<T>], tau: &mut [Lane<T>],
    ) -> () {
        block::inverse_dynamics::<T, F>(frames, gravity, bodies, q, qd, qdd, work, tau);
    }

    /// [`block::inertia_matrix`]: column c is `LANES` entries of `out` from `c * stride + at` on.
    fn inertia_matrix<T, F>(
        frames: &[Frame<T>], bodies: &[Body<T>], q: &[Lane<T>], work: &mut [JointBlock<T>],
        composite: &mut CompositeBlock<T>, out: &mut [T], stride: usize, at: usize,
    ) -> () {
        let out = &mut Section::new(out, stride, at);
        block::inertia_matrix::<T, F>(frames, bodies, q, work, composite, out);
    }

    /// [`block::forward_dynamics`].
    fn forward_dynamics<T, F>(
        frames: &[Frame<T>], gravity: [T; 3], bodies: &[Body<T>], q: &[Lane<T>], qd: &[Lane<T>], tau: &[Lane<T>],
        work: &mut [JointBlock<T>], composite: &mut CompositeBlock<T>, matrix: &mut [Lane<T>], qdd: &mut [Lane<T>],
    ) -> Result<(), NotPositive> {
        block::forward_dynamics::<T, F>(frames, gravity, bodies, q, qd, tau, work, composite, matrix, qdd)
    }

    /// [`block::differential_regressor`]: column c is `LANES` entries of `out` from `c * stride + at` on.
    fn differential_regressor<T, F>(
        frames: &[Frame<T>], gravity: [T; 3], q: &[Lane<T>], qd: &[Lane<T>], qdd: &[Lane<T>],
        axes: &mut [AxisBlock<T>], out: &mut [T], stride: usize, at: usize,
    ) -> () {
        let out = &mut Section::new(out, stride, at);
        block::differential_regressor::<T, F>(frames, gravity, q, qd, qdd, axes, out);
    }

    /// [`block::energy_regressor`]: column c is `LANES` entries of `out` from `c * stride + at` on.
    fn energy_regressor<T, F>(
        frames: &[Frame<T>], gravity: [T; 3], q: &[Lane<T>], qd: &[Lane<T>], out: &mut [T], stride: usize, at: usize,
    ) -> () {
        block::energy_regressor::<T, F>(frames, gravity, q, qd, &mut Section::new(out, stride, at));
    }

    /// [`block::inverse_dynamics_derivatives`]: column c is `LANES` entries of an output from `c * stride + at` on.
    fn inverse_dynamics_derivatives<T, F>(
        frames: &[Frame<T>], gravity: [T; 3], bodies: &[Body<T>], signals: [&[Lane<T>]; 3],
        work: &mut [DerivativeBlock<T>], outs: [&mut [T]; 3], stride: usize, at: usize,
    ) -> () {
        let [position, velocity, inertia] = &mut outs.map(|out| Section::new(out, stride, at));
        block::inverse_dynamics_derivatives::<T, F>(
            frames, gravity, bodies, signals, work, position, velocity, inertia,
        );
    }

    /// [`block::forward_dynamics_derivatives`]: column c is `LANES` entries of an output from `c * stride + at` on.
    fn forward_dynamics_derivatives<T, F>(
        frames: &[Frame<T>], gravity: [T; 3], bodies: &[Body<T>], signals: [&[Lane<T>]; 3],
        joints: &mut [JointBlock<T>], composite: &mut CompositeBlock<T>, work: &mut [DerivativeBlock<T>],
        buffer: &mut [Lane<T>], outs: [&mut [T]; 3], stride: usize, at: usize,
    ) -> Result<(), NotPositive> {
        let [position, velocity, torque] = &mut outs.map(|out| Section::new(out, stride, at));
        block::forward_dynamics_derivatives::<T, F>(
            frames, gravity, bodies, signals, joints, composite, work, buffer, position, velocity, torque,
        )
    }
}
