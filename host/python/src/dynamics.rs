//! Dynamics of many samples that lie row by row, as NumPy stores them.
//!
//! The batches of `rig-model` take one column a joint. Rows are transposed in blocks that stay in the cache, so that an
//! array is never copied as a whole. All of it exists for `f64` and for `f32`.

use numpy::ndarray::{ArrayView2, Axis, Slice};
use rig_data::prepare::{each_of, threads};
use rig_model::batch::{
    BatchError, ChainBatch, Derivatives, ModelBatch, Number, RegressorBlock, lower,
};
use rig_shared::multibody::{COLUMNS, Chain};

/// Samples that are transposed at once: three signals of seven joints take 43 KiB.
const ROWS: usize = 256;
/// Fewest samples for which a thread is started: some milliseconds of work for seven joints.
const LEAST: usize = 16 * ROWS;

/// Signals of a block, one column a joint.
type Columns<T> = [Vec<T>];

/// Computes a block: signals in, rows of the output out.
trait Kernel<T> {
    fn compute(&mut self, signals: &[Vec<Vec<T>>], out: &mut [T]) -> Result<(), BatchError>;
}

/// Computes `width` numbers a sample from signals with one row a sample; `kernel` makes the kernel of each thread.
/// `wanted` threads; 0 for all processors. The result does not depend on it.
fn over_rows<T: Number, K: Kernel<T>>(
    signals: &[ArrayView2<'_, T>],
    width: usize,
    wanted: usize,
    kernel: impl Fn() -> K + Sync,
) -> Result<Vec<T>, BatchError> {
    let samples = signals.first().map_or(0, |signal| signal.nrows());
    let mut out = vec![T::ZERO; samples * width];
    if samples == 0 {
        return Ok(out);
    }
    let most = threads(wanted).min(samples.div_ceil(LEAST)).max(1);
    let stretch = samples.div_ceil(ROWS).div_ceil(most) * ROWS;
    let mut parts: Vec<_> = out
        .chunks_mut(stretch * width)
        .map(|part| (part, Ok(())))
        .collect();
    each_of(most, &mut parts, &|k, (part, done)| {
        *done = one_stretch(signals, k * stretch, width, part, &mut kernel());
    });
    let first_error = parts.into_iter().find_map(|(_, done)| done.err());
    first_error.map_or(Ok(out), Err)
}

/// Computes the samples from `start` on that `out` has room for.
fn one_stretch<T: Number>(
    signals: &[ArrayView2<'_, T>],
    start: usize,
    width: usize,
    out: &mut [T],
    kernel: &mut impl Kernel<T>,
) -> Result<(), BatchError> {
    let mut columns: Vec<Vec<Vec<T>>> = signals
        .iter()
        .map(|signal| vec![Vec::with_capacity(ROWS); signal.ncols()])
        .collect();
    for (block, rows) in out.chunks_mut(ROWS * width).enumerate() {
        let first = start + block * ROWS;
        let end = first + rows.len() / width;
        for (columns, signal) in columns.iter_mut().zip(signals) {
            let part = signal.slice_axis(Axis(0), Slice::from(first..end));
            for (column, own) in columns.iter_mut().zip(part.columns()) {
                column.clear();
                column.extend(own);
            }
        }
        kernel
            .compute(&columns, rows)
            .map_err(|error| shifted(error, first))?;
    }
    Ok(())
}

/// Counts the sample of an error from the first of the recording.
fn shifted(error: BatchError, first: usize) -> BatchError {
    match error {
        BatchError::NotPositiveDefinite { sample, joint } => BatchError::NotPositiveDefinite {
            sample: sample + first,
            joint,
        },
        other => other,
    }
}

/// Writes columns of `rows` samples as rows.
fn transpose<T: Copy>(columns: &[T], rows: usize, out: &mut [T]) {
    let width = out.len() / rows;
    for (c, column) in columns.chunks_exact(rows).enumerate() {
        for (row, value) in out.chunks_exact_mut(width).zip(column) {
            row[c] = *value;
        }
    }
}

/// A function of a batch from signals to columns of a fixed number.
struct ByColumns<T, F> {
    function: F,
    columns: usize,
    scratch: Vec<T>,
}

impl<T: Number, F: FnMut(&[Vec<Vec<T>>], &mut [T]) -> Result<(), BatchError>> ByColumns<T, F> {
    /// Returns the columns of the function and the number of samples.
    fn evaluated(&mut self, signals: &[Vec<Vec<T>>]) -> Result<(&[T], usize), BatchError> {
        let rows = samples(signals);
        self.scratch.resize(self.columns * rows, T::ZERO);
        (self.function)(signals, &mut self.scratch)?;
        Ok((&self.scratch, rows))
    }
}

/// Returns the number of samples of a block.
fn samples<T>(signals: &[Vec<Vec<T>>]) -> usize {
    let first: Option<&Columns<T>> = signals.first().map(Vec::as_slice);
    first.and_then(<[_]>::first).map_or(0, Vec::len)
}

impl<T: Number, F: FnMut(&[Vec<Vec<T>>], &mut [T]) -> Result<(), BatchError>> Kernel<T>
    for ByColumns<T, F>
{
    fn compute(&mut self, signals: &[Vec<Vec<T>>], out: &mut [T]) -> Result<(), BatchError> {
        let (columns, rows) = self.evaluated(signals)?;
        transpose(columns, rows, out);
        Ok(())
    }
}

/// Lower triangles, written as full symmetric matrices.
struct Symmetric<T, F> {
    triangle: ByColumns<T, F>,
    size: usize,
}

impl<T: Number, F: FnMut(&[Vec<Vec<T>>], &mut [T]) -> Result<(), BatchError>> Kernel<T>
    for Symmetric<T, F>
{
    fn compute(&mut self, signals: &[Vec<Vec<T>>], out: &mut [T]) -> Result<(), BatchError> {
        let n = self.size;
        let (columns, rows) = self.triangle.evaluated(signals)?;
        for (k, matrix) in out.chunks_exact_mut(n * n).enumerate() {
            fill_symmetric(columns, rows, k, n, matrix);
        }
        Ok(())
    }
}

/// Writes sample `k` of the columns of a lower triangle as a full matrix.
fn fill_symmetric<T: Copy>(columns: &[T], rows: usize, k: usize, n: usize, matrix: &mut [T]) {
    for i in 0..n {
        for j in 0..=i {
            let value = columns[lower(i, j) * rows + k];
            matrix[i * n + j] = value;
            matrix[j * n + i] = value;
        }
    }
}

/// Derivatives by position, velocity and input: three n×n matrices a sample.
struct Matrices<T, F> {
    function: F,
    size: usize,
    columns: [Vec<T>; 3],
}

impl<T: Number, F: FnMut(&[Vec<Vec<T>>], &mut Derivatives<'_, T>) -> Result<(), BatchError>>
    Kernel<T> for Matrices<T, F>
{
    fn compute(&mut self, signals: &[Vec<Vec<T>>], out: &mut [T]) -> Result<(), BatchError> {
        let n = self.size;
        let rows = samples(signals);
        let [position, velocity, input] = &mut self.columns;
        position.resize(n * n * rows, T::ZERO);
        velocity.resize(n * n * rows, T::ZERO);
        input.resize(lower(n, 0) * rows, T::ZERO);
        let mut derivatives = Derivatives {
            position,
            velocity,
            input,
        };
        (self.function)(signals, &mut derivatives)?;
        for (k, sample) in out.chunks_exact_mut(3 * n * n).enumerate() {
            let (full, symmetric) = sample.split_at_mut(2 * n * n);
            let columns = position
                .chunks_exact(rows)
                .chain(velocity.chunks_exact(rows));
            for (entry, column) in full.iter_mut().zip(columns) {
                *entry = column[k];
            }
            fill_symmetric(input, rows, k, n, symmetric);
        }
        Ok(())
    }
}

/// The regressor: 14 columns a joint.
struct Regressor<'a, T> {
    batch: &'a ChainBatch<T>,
    block: RegressorBlock<T>,
}

impl<T: Number> Kernel<T> for Regressor<'_, T> {
    fn compute(&mut self, signals: &[Vec<Vec<T>>], out: &mut [T]) -> Result<(), BatchError> {
        let n = self.batch.joint_count();
        let [q, qd, qdd] = signals else {
            return Ok(());
        };
        self.batch
            .differential_regressor(q, qd, qdd, &mut self.block)?;
        let width = self.batch.link_count() * COLUMNS;
        for joint in 0..n {
            for c in (0..width).filter(|c| !self.batch.is_zero(joint, *c)) {
                let column = self.block.column(joint, c);
                for (sample, value) in out.chunks_exact_mut(n * width).zip(column) {
                    sample[joint * width + c] = *value;
                }
            }
        }
        Ok(())
    }
}

/// Makes a kernel of a function of a batch.
fn by_columns<T, F>(columns: usize, function: F) -> ByColumns<T, F> {
    ByColumns {
        function,
        columns,
        scratch: Vec::new(),
    }
}

/// The dynamics of a robot in numbers of one kind.
pub(crate) struct Dynamics<T> {
    model: ModelBatch<T>,
    batch: ChainBatch<T>,
}

/// A quantity of many samples, and the signals that it is a function of.
#[derive(Clone, Copy)]
pub(crate) enum Quantity {
    /// Torques of a motion: q, qd, qdd.
    Inverse,
    /// Accelerations under torques: q, qd, tau.
    Forward,
    /// Derivatives of the torques of a motion by position, velocity and acceleration: q, qd, qdd.
    InverseDerivatives,
    /// Derivatives of the accelerations by position, velocity and torque: q, qd, tau.
    ForwardDerivatives,
    /// Inertia matrices: q.
    MassMatrix,
    /// Torques that hold the links against gravity: q.
    Gravity,
    /// Regressors: q, qd, qdd.
    Regressor,
}

impl<T: Number> Dynamics<T> {
    /// Prepares the dynamics of a chain.
    ///
    /// # Errors
    /// Another number of rows of parameters than links.
    pub(crate) fn new(
        chain: &Chain<f64>,
        parameters: &[[f64; COLUMNS]],
    ) -> Result<Self, BatchError> {
        Ok(Self {
            model: ModelBatch::new(chain, parameters)?,
            batch: ChainBatch::new(chain),
        })
    }

    /// Returns the shape of a quantity of one sample.
    pub(crate) fn shape(&self, quantity: Quantity) -> Vec<usize> {
        let n = self.batch.joint_count();
        match quantity {
            Quantity::Inverse | Quantity::Forward | Quantity::Gravity => vec![n],
            Quantity::InverseDerivatives | Quantity::ForwardDerivatives => vec![3, n, n],
            Quantity::MassMatrix => vec![n, n],
            Quantity::Regressor => vec![n, self.batch.link_count() * COLUMNS],
        }
    }

    /// Computes a quantity from its signals, one row a sample, on `wanted` threads; 0 for all processors.
    ///
    /// # Errors
    /// Signals of other lengths; an inertia matrix that is not positive definite.
    pub(crate) fn computed(
        &self,
        quantity: Quantity,
        signals: &[ArrayView2<'_, T>],
        wanted: usize,
    ) -> Result<Vec<T>, BatchError> {
        let (model, n) = (&self.model, self.model.joint_count());
        match quantity {
            Quantity::Inverse => torques(n, signals, wanted, |s, out| {
                model.inverse_dynamics(&s[0], &s[1], &s[2], out)
            }),
            Quantity::Forward => torques(n, signals, wanted, |s, out| {
                model.forward_dynamics(&s[0], &s[1], &s[2], out)
            }),
            Quantity::Gravity => torques(n, signals, wanted, |s, out| model.gravity(&s[0], out)),
            Quantity::InverseDerivatives => matrices(n, signals, wanted, |s, out| {
                model.inverse_dynamics_derivatives(&s[0], &s[1], &s[2], out)
            }),
            Quantity::ForwardDerivatives => matrices(n, signals, wanted, |s, out| {
                model.forward_dynamics_derivatives(&s[0], &s[1], &s[2], out)
            }),
            Quantity::MassMatrix => over_rows(signals, n * n, wanted, || Symmetric {
                triangle: by_columns(lower(n, 0), |s: &[Vec<Vec<T>>], out: &mut [T]| {
                    model.inertia_matrix(&s[0], out)
                }),
                size: n,
            }),
            Quantity::Regressor => {
                let batch = &self.batch;
                let width = n * batch.link_count() * COLUMNS;
                over_rows(signals, width, wanted, || Regressor {
                    batch,
                    block: batch.block(ROWS),
                })
            }
        }
    }
}

/// Computes one number a joint and sample.
fn torques<T: Number>(
    n: usize,
    signals: &[ArrayView2<'_, T>],
    wanted: usize,
    function: impl Fn(&[Vec<Vec<T>>], &mut [T]) -> Result<(), BatchError> + Sync,
) -> Result<Vec<T>, BatchError> {
    over_rows(signals, n, wanted, || by_columns(n, &function))
}

/// Computes three matrices a sample.
fn matrices<T: Number>(
    n: usize,
    signals: &[ArrayView2<'_, T>],
    wanted: usize,
    function: impl Fn(&[Vec<Vec<T>>], &mut Derivatives<'_, T>) -> Result<(), BatchError> + Sync,
) -> Result<Vec<T>, BatchError> {
    over_rows(signals, 3 * n * n, wanted, || Matrices {
        function: &function,
        size: n,
        columns: Default::default(),
    })
}
