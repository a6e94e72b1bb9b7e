//! Torques, accelerations and inertia matrices of many samples.

use rig_shared::multibody::block::{
    Body, CompositeBlock, DerivativeBlock, Frame, JointBlock, NotPositive, derivative_buffers,
    lower,
};
use rig_shared::multibody::{COLUMNS, Chain, MultibodyError, column, solve_positive_definite};

use std::ops::Range;

use super::BatchError;
use super::dispatch::Number;
use super::gears::Gears;
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
    /// How axes follow joints, if some do.
    gears: Option<Gears<T>>,
}

impl<T: Number> ModelBatch<T> {
    /// Prepares a chain with one row of parameters a link (joints, then followers), in the order of
    /// [`COLUMN_NAMES`](rig_shared::multibody::COLUMN_NAMES).
    ///
    /// # Errors
    /// [`BatchError::Multibody`] if the number of rows differs from the number of links.
    pub fn new(chain: &Chain<f64>, parameters: &[[f64; COLUMNS]]) -> Result<Self, BatchError> {
        let n = chain.link_count();
        if parameters.len() != n {
            return Err(MultibodyError::WrongLength {
                argument: "parameters",
                expected: n,
                found: parameters.len(),
            }
            .into());
        }
        let gears = Gears::of(chain);
        let of_axes = gears.as_ref().map(|gears| gears.rows(parameters));
        let parameters = of_axes.as_deref().unwrap_or(parameters);
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
            gears,
        })
    }

    /// Returns the model in which every axis is a joint.
    fn of_axes(&self) -> Self {
        Self {
            gears: None,
            ..self.clone()
        }
    }

    /// Returns the number of joints n.
    pub fn joint_count(&self) -> usize {
        (self.gears.as_ref()).map_or(self.frames.len(), Gears::joint_count)
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
        if let Some(gears) = &self.gears {
            let (q, qd, qdd) = (gears.positions(q), gears.rates(qd), gears.rates(qdd));
            let mut wide = vec![T::ZERO; q.len() * count];
            self.of_axes().inverse_dynamics(&q, &qd, &qdd, &mut wide)?;
            gears.project(&wide, count, tau);
            return Ok(());
        }
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
        if let Some(gears) = &self.gears {
            let q = gears.positions(q);
            let mut wide = vec![T::ZERO; q.len() * count];
            self.of_axes().gravity(&q, &mut wide)?;
            gears.project(&wide, count, out);
            return Ok(());
        }
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
        if let Some(gears) = &self.gears {
            let q = gears.positions(q);
            let mut wide = vec![T::ZERO; lower(q.len(), 0) * count];
            self.of_axes().inertia_matrix(&q, &mut wide)?;
            gears.project_lower(&wide, count, out);
            return Ok(());
        }
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
        if self.gears.is_some() {
            return self.accelerations(q, qd, tau, qdd);
        }
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
        if let Some(gears) = &self.gears {
            let (q, qd, qdd) = (gears.positions(q), gears.rates(qd), gears.rates(qdd));
            let all = q.len();
            let [mut a, mut b] = [(); 2].map(|()| vec![T::ZERO; all * all * count]);
            let mut c = vec![T::ZERO; lower(all, 0) * count];
            let wide = &mut Derivatives {
                position: &mut a,
                velocity: &mut b,
                input: &mut c,
            };
            (self.of_axes()).inverse_dynamics_derivatives(&q, &qd, &qdd, wide)?;
            // A column by the position of a joint is the sum of those by the axes that it moves.
            gears.project_square(&a, count, out.position);
            gears.project_square(&b, count, out.velocity);
            gears.project_lower(&c, count, out.input);
            return Ok(());
        }
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
        if self.gears.is_some() {
            return self.acceleration_derivatives(q, qd, tau, out);
        }
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

    /// Computes accelerations from torques at rest acceleration and inertia matrices, sample by sample: for chains with
    /// followers, whose matrices are projected.
    fn accelerations<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        tau: &[S],
        qdd: &mut [T],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = qdd.len() / n;
        let still = vec![vec![T::ZERO; count]; n];
        let plain = |signals: &[S]| -> Vec<Vec<T>> {
            signals.iter().map(|own| own.as_ref().to_vec()).collect()
        };
        self.inverse_dynamics(&plain(q), &plain(qd), &still, qdd)?;
        let mut triangle = vec![T::ZERO; lower(n, 0) * count];
        self.inertia_matrix(q, &mut triangle)?;
        let (mut matrix, mut x) = (vec![T::ZERO; n * n], vec![T::ZERO; n]);
        for sample in 0..count {
            square(&triangle, count, sample, &mut matrix);
            for (j, x) in x.iter_mut().enumerate() {
                *x = tau[j].as_ref()[sample] - qdd[j * count + sample];
            }
            solve_positive_definite(&mut matrix, &mut x).map_err(|e| not_definite(sample, e))?;
            for (j, x) in x.iter().enumerate() {
                qdd[j * count + sample] = *x;
            }
        }
        Ok(())
    }

    /// Computes derivatives of accelerations from those of torques: ∂q̈ = −A⁻¹·∂τ at that acceleration.
    fn acceleration_derivatives<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        tau: &[S],
        out: &mut Derivatives<'_, T>,
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = out.position.len() / (n * n);
        let mut qdd = vec![T::ZERO; n * count];
        self.accelerations(q, qd, tau, &mut qdd)?;
        let plain = |signals: &[S]| -> Vec<Vec<T>> {
            signals.iter().map(|own| own.as_ref().to_vec()).collect()
        };
        let qdd: Vec<Vec<T>> = qdd.chunks(count.max(1)).map(<[T]>::to_vec).collect();
        self.inverse_dynamics_derivatives(&plain(q), &plain(qd), &qdd, out)?;
        let [mut matrix, mut inverse] = [(); 2].map(|()| vec![T::ZERO; n * n]);
        let mut x = vec![T::ZERO; n];
        for sample in 0..count {
            let triangle = &*out.input;
            inverse.fill(T::ZERO);
            for (j, column) in inverse.chunks_exact_mut(n).enumerate() {
                square(triangle, count, sample, &mut matrix);
                column[j] = T::ONE;
                solve_positive_definite(&mut matrix, column)
                    .map_err(|e| not_definite(sample, e))?;
            }
            for of in [&mut *out.position, &mut *out.velocity] {
                for by in 0..n {
                    for (i, x) in x.iter_mut().enumerate() {
                        *x = T::ZERO;
                        for k in 0..n {
                            *x -= inverse[k * n + i] * of[(k * n + by) * count + sample];
                        }
                    }
                    for (i, x) in x.iter().enumerate() {
                        of[(i * n + by) * count + sample] = *x;
                    }
                }
            }
            for i in 0..n {
                for j in 0..=i {
                    out.input[lower(i, j) * count + sample] = inverse[j * n + i];
                }
            }
        }
        Ok(())
    }
}

/// Copies the matrix of a sample from the columns of its lower triangle.
fn square<T: Number>(triangle: &[T], samples: usize, sample: usize, out: &mut [T]) {
    let n = out.len().isqrt();
    for i in 0..n {
        for j in 0..n {
            out[i * n + j] = triangle[lower(i.max(j), i.min(j)) * samples + sample];
        }
    }
}

fn not_definite(sample: usize, found: MultibodyError) -> BatchError {
    match found {
        MultibodyError::NotPositiveDefinite { joint } => {
            BatchError::NotPositiveDefinite { sample, joint }
        }
        other => other.into(),
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
