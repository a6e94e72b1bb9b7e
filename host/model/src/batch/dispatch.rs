//! The kernels, compiled for the vector instructions of the machine and selected at run time.
//!
//! Users build for the oldest processor of their kind. A kernel compiled for AVX2 and FMA runs about twice as fast
//! where both exist, and one for AVX-512 is faster again. FMA adds unrounded products ([`MulAdd`]), so these
//! versions differ from the portable one by rounding (tested). Results are identical on one kind of machine, but not between
//! kinds. Other processors use the portable version; on 64-bit Arm it already uses vectors.

use multiversion::{multiversion, target::match_target};
use rig_shared::lanes::{MulAdd, Rounded};
use rig_shared::multibody::block::{
    self, AxisBlock, Body, CompositeBlock, DerivativeBlock, Frame, JointBlock, Lane, NotPositive,
    Section,
};

/// Adds products without rounding them, on processors with such an instruction.
#[derive(Clone, Copy)]
struct Fused;

impl MulAdd for Fused {
    const FUSED: bool = true;

    #[inline(always)]
    fn mul_add(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

/// Makes a function that selects the best version for the machine, and the portable version for tests.
macro_rules! versions {
    ($(#[$doc:meta])* $name:ident, $portable:ident <$arithmetic:ident> ($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$doc])*
        #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
        pub(super) fn $name($($argument: $type),*) $(-> $result)? {
            #[inline(always)]
            fn of<$arithmetic: MulAdd>($($argument: $type),*) $(-> $result)? $body

            match_target! {
                "x86_64+avx512f+avx512dq+avx512vl+avx2+fma" => of::<Fused>($($argument),*),
                "x86_64+avx2+fma" => of::<Fused>($($argument),*),
                _ => of::<Rounded>($($argument),*),
            }
        }

        #[cfg(test)]
        pub(super) fn $portable($($argument: $type),*) $(-> $result)? {
            type $arithmetic = Rounded;
            $body
        }
    };
}

versions! {
    /// [`block::inverse_dynamics`].
    inverse_dynamics, inverse_dynamics_portable<F>(
        frames: &[Frame], gravity: [f64; 3], bodies: &[Body], q: &[Lane], qd: &[Lane], qdd: Option<&[Lane]>,
        work: &mut [JointBlock], tau: &mut [Lane],
    ) {
        block::inverse_dynamics::<F>(frames, gravity, bodies, q, qd, qdd, work, tau);
    }
}

versions! {
    /// [`block::inertia_matrix`]: column c is `LANES` entries of `out` from `c * stride + at` on.
    inertia_matrix, inertia_matrix_portable<F>(
        frames: &[Frame], bodies: &[Body], q: &[Lane], work: &mut [JointBlock],
        composite: &mut CompositeBlock, out: &mut [f64], stride: usize, at: usize,
    ) {
        block::inertia_matrix::<F>(frames, bodies, q, work, composite, &mut Section::new(out, stride, at));
    }
}

versions! {
    /// [`block::forward_dynamics`].
    forward_dynamics, forward_dynamics_portable<F>(
        frames: &[Frame], gravity: [f64; 3], bodies: &[Body], q: &[Lane], qd: &[Lane], tau: &[Lane],
        work: &mut [JointBlock], composite: &mut CompositeBlock, matrix: &mut [Lane], qdd: &mut [Lane],
    ) -> Result<(), NotPositive> {
        block::forward_dynamics::<F>(frames, gravity, bodies, q, qd, tau, work, composite, matrix, qdd)
    }
}

versions! {
    /// [`block::differential_regressor`]: column c is `LANES` entries of `out` from `c * stride + at` on.
    differential_regressor, differential_regressor_portable<F>(
        frames: &[Frame], gravity: [f64; 3], q: &[Lane], qd: &[Lane], qdd: &[Lane], axes: &mut [AxisBlock],
        out: &mut [f64], stride: usize, at: usize,
    ) {
        let out = &mut Section::new(out, stride, at);
        block::differential_regressor::<F>(frames, gravity, q, qd, qdd, axes, out);
    }
}

versions! {
    /// [`block::energy_regressor`]: column c is `LANES` entries of `out` from `c * stride + at` on.
    energy_regressor, energy_regressor_portable<F>(
        frames: &[Frame], gravity: [f64; 3], q: &[Lane], qd: &[Lane], out: &mut [f64], stride: usize, at: usize,
    ) {
        block::energy_regressor::<F>(frames, gravity, q, qd, &mut Section::new(out, stride, at));
    }
}

versions! {
    /// [`block::inverse_dynamics_derivatives`]: column c is `LANES` entries of an output from `c * stride + at` on.
    inverse_dynamics_derivatives, inverse_dynamics_derivatives_portable<F>(
        frames: &[Frame], gravity: [f64; 3], bodies: &[Body], signals: [&[Lane]; 3], work: &mut [DerivativeBlock],
        outs: [&mut [f64]; 3], stride: usize, at: usize,
    ) {
        let [position, velocity, inertia] = &mut outs.map(|out| Section::new(out, stride, at));
        block::inverse_dynamics_derivatives::<F>(frames, gravity, bodies, signals, work, position, velocity, inertia);
    }
}

versions! {
    /// [`block::forward_dynamics_derivatives`]: column c is `LANES` entries of an output from `c * stride + at` on.
    forward_dynamics_derivatives, forward_dynamics_derivatives_portable<F>(
        frames: &[Frame], gravity: [f64; 3], bodies: &[Body], signals: [&[Lane]; 3], joints: &mut [JointBlock],
        composite: &mut CompositeBlock, work: &mut [DerivativeBlock], buffer: &mut [Lane], outs: [&mut [f64]; 3],
        stride: usize, at: usize,
    ) -> Result<(), NotPositive> {
        let [position, velocity, torque] = &mut outs.map(|out| Section::new(out, stride, at));
        block::forward_dynamics_derivatives::<F>(
            frames, gravity, bodies, signals, joints, composite, work, buffer, position, velocity, torque,
        )
    }
}
