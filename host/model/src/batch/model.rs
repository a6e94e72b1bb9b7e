//! Torques, accelerations and inertia matrices of many samples.

use rig_shared::multibody::block::{
    Body, CompositeBlock, DerivativeBlock, Frame, JointBlock, NotPositive, derivative_buffers,
    lower,
};
use rig_shared::multibody::{COLUMNS, Chain, MultibodyError, column};

use std::ops::Range;

use super::BatchError;
use super::dispatch::Number;
use super::signals::{in_place, lanes, load, output, samples, store, stretches};

/// Derivatives of a result with n entries: the outputs of a batch.
#[derive(Debug)]
pub struct Derivatives<'a, T = f64> {
    /// By position: n² columns; column i·n + j is that of entry i by q_j.
    pub position: &'a mut [T],
    /// By velocity, likewise.
    pub velocity: &'a mut [T],
    /// By acceleration or torque: the n(n + 1)/2 columns of the lower triangle of a symmetric matrix. Column
    /// [`lower(i, j)`](lower) is the entry (i, j) with j ≤ i.
    pub input: &'a mut [T],
}

impl<T> Derivatives<'_, T> {
    /// Checks the lengths for `n` joints.
    fn check(&self, n: usize, samples: usize) -> Result<(), BatchError> {
        output(n * n, samples, self.position)?;
        output(n * n, samples, self.velocity)?;
        output(lower(n, 0), samples, self.input)
    }
}

/// A chain with its parameters, prepared for batches of `f64` or `f32`.
#[derive(Clone, Debug)]
pub struct ModelBatch<T = f64> {
    frames: Vec<Frame<T>>,
    gravity: [T; 3],
    bodies: Vec<Body<T>>,
    /// The same bodies without drives, friction and offsets.
    links: Vec<Body<T>>,
}

impl<T: Number> ModelBatch<T> {
    /// Prepares a chain with one row of parameters a joint, in the order of
    /// [`COLUMN_NAMES`](rig_shared::multibody::COLUMN_NAMES).
    ///
    /// # Errors
    /// [`BatchError::Multibody`] if the number of rows differs from the number of joints.
    pub fn new(chain: &Chain<f64>, parameters: &[[f64; COLUMNS]]) -> Result<Self, BatchError> {
        let n = chain.joint_count();
        if parameters.len() != n {
            return Err(MultibodyError::WrongLength {
                argument: "parameters",
                expected: n,
                found: parameters.len(),
            }
            .into());
        }
        let mut bodies = vec![Body::NOTHING; n];
        Body::gather(chain, parameters, &mut bodies);
        let mut bare = parameters.to_vec();
        for row in &mut bare {
            row[column::DRIVE_INERTIA..].fill(0.0);
        }
        let mut links = vec![Body::NOTHING; n];
        Body::gather(chain, &bare, &mut links);
        Ok(Self {
            frames: Frame::of(chain).collect(),
            gravity: chain.gravity().map(T::from_f64),
            bodies,
            links,
        })
    }

    /// Returns the number of joints n.
    pub fn joint_count(&self) -> usize {
        self.frames.len()
    }

    /// Computes the torques of a motion `q`, `qd`, `qdd`, with drives, friction and offsets:
    /// [`inverse_dynamics`](rig_shared::multibody::inverse_dynamics) of every sample. `tau` holds n columns.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong.
    pub fn inverse_dynamics<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        tau: &mut [T],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        output(n, count, tau)?;
        let [mut a, mut b, mut c, mut d] = [(); 4].map(|()| lanes(n));
        let mut work = vec![JointBlock::ZERO; n];
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            load(qd, &range, &mut b);
            load(qdd, &range, &mut c);
            let (frames, bodies) = (&self.frames, &self.bodies);
            T::inverse_dynamics(
                frames,
                self.gravity,
                bodies,
                &a,
                &b,
                Some(&c),
                &mut work,
                &mut d,
            );
            store(d.iter().map(|lane| &lane.0), &range, count, tau);
        }
        Ok(())
    }

    /// Computes the torques that hold the links against gravity, without drives, friction and offsets:
    /// [`gravity_vector`](rig_shared::multibody::gravity_vector) of every sample. `out` holds n columns.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong.
    pub fn gravity<S: AsRef<[T]>>(&self, q: &[S], out: &mut [T]) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q)])?;
        output(n, count, out)?;
        let (mut a, still, mut d) = (lanes(n), lanes(n), lanes(n));
        let mut work = vec![JointBlock::ZERO; n];
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            let (frames, links) = (&self.frames, &self.links);
            T::inverse_dynamics(
                frames,
                self.gravity,
                links,
                &a,
                &still,
                None,
                &mut work,
                &mut d,
            );
            store(d.iter().map(|lane| &lane.0), &range, count, out);
        }
        Ok(())
    }

    /// Computes the inertia matrices, with drive inertias on the diagonal:
    /// [`inertia_matrix`](rig_shared::multibody::inertia_matrix) of every sample. They are symmetric: `out` holds the
    /// n(n + 1)/2 columns of the lower triangle. Column [`lower(i, j)`](lower) is the entry (i, j) with j ≤ i.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong.
    pub fn inertia_matrix<S: AsRef<[T]>>(&self, q: &[S], out: &mut [T]) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q)])?;
        output(lower(n, 0), count, out)?;
        let mut a = lanes(n);
        let mut work = vec![JointBlock::ZERO; n];
        let mut composite = CompositeBlock::ZERO;
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            let (frames, bodies) = (&self.frames, &self.bodies);
            let (work, composite) = (&mut work, &mut composite);
            in_place(&range, count, [&mut *out], |[out], stride, at| {
                T::inertia_matrix(frames, bodies, &a, work, composite, out, stride, at);
            });
        }
        Ok(())
    }

    /// Computes the accelerations under the torques `tau`:
    /// [`forward_dynamics`](rig_shared::multibody::forward_dynamics) of every sample. `qdd` holds n columns.
    ///
    /// # Errors
    /// [`BatchError::NotPositiveDefinite`] with the first such sample; other errors if a length is wrong.
    pub fn forward_dynamics<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        tau: &[S],
        qdd: &mut [T],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q), ("qd", qd), ("tau", tau)])?;
        output(n, count, qdd)?;
        let [mut a, mut b, mut c, mut d] = [(); 4].map(|()| lanes(n));
        let mut matrix = lanes(lower(n, 0));
        let mut work = vec![JointBlock::ZERO; n];
        let mut composite = CompositeBlock::ZERO;
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            load(qd, &range, &mut b);
            load(tau, &range, &mut c);
            let (frames, bodies) = (&self.frames, &self.bodies);
            T::forward_dynamics(
                frames,
                self.gravity,
                bodies,
                &a,
                &b,
                &c,
                &mut work,
                &mut composite,
                &mut matrix,
                &mut d,
            )
            .map_err(|e| not_positive(&range, e))?;
            store(d.iter().map(|lane| &lane.0), &range, count, qdd);
        }
        Ok(())
    }

    /// Computes the derivatives of the torques of a motion by position, velocity and acceleration (the inertia matrix),
    /// with drives and viscous friction. Coulomb friction counts as constant.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong.
    pub fn inverse_dynamics_derivatives<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        out: &mut Derivatives<'_, T>,
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        out.check(n, count)?;
        let [mut a, mut b, mut c] = [(); 3].map(|()| lanes(n));
        let mut work = vec![DerivativeBlock::ZERO; n];
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            load(qd, &range, &mut b);
            load(qdd, &range, &mut c);
            let (frames, bodies) = (&self.frames, &self.bodies);
            let outs = [&mut *out.position, &mut *out.velocity, &mut *out.input];
            in_place(&range, count, outs, |outs, stride, at| {
                T::inverse_dynamics_derivatives(
                    frames,
                    self.gravity,
                    bodies,
                    [&a, &b, &c],
                    &mut work,
                    outs,
                    stride,
                    at,
                );
            });
        }
        Ok(())
    }

    /// Computes the derivatives of the accelerations under the torques `tau` by position, velocity and torque (the inverse
    /// of the inertia matrix), with drives and viscous friction. Coulomb friction counts as constant.
    ///
    /// # Errors
    /// As [`Self::forward_dynamics`].
    pub fn forward_dynamics_derivatives<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        tau: &[S],
        out: &mut Derivatives<'_, T>,
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q), ("qd", qd), ("tau", tau)])?;
        out.check(n, count)?;
        let [mut a, mut b, mut c] = [(); 3].map(|()| lanes(n));
        let mut joints = vec![JointBlock::ZERO; n];
        let mut composite = CompositeBlock::ZERO;
        let mut work = vec![DerivativeBlock::ZERO; n];
        let mut buffer = lanes(derivative_buffers(n));
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            load(qd, &range, &mut b);
            load(tau, &range, &mut c);
            let (frames, bodies) = (&self.frames, &self.bodies);
            let outs = [&mut *out.position, &mut *out.velocity, &mut *out.input];
            in_place(&range, count, outs, |outs, stride, at| {
                T::forward_dynamics_derivatives(
                    frames,
                    self.gravity,
                    bodies,
                    [&a, &b, &c],
                    &mut joints,
                    &mut composite,
                    &mut work,
                    &mut buffer,
                    outs,
                    stride,
                    at,
                )
            })
            .map_err(|e| not_positive(&range, e))?;
        }
        Ok(())
    }
}

/// Names the sample of an inertia matrix that is not positive definite. The padding of a short stretch repeats its last
/// sample, so it cannot fail first.
fn not_positive(range: &Range<usize>, found: NotPositive) -> BatchError {
    BatchError::NotPositiveDefinite {
        sample: range.start + found.lane,
        joint: found.joint,
    }
}
