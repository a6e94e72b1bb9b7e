//! Dynamics of many samples that lie row by row, as NumPy stores them.
//!
//! The batches of `rig-model` take one column a joint. Rows are transposed in blocks that stay in the cache, so that an
//! array is never copied as a whole.

use numpy::ndarray::{ArrayView2, Axis, Slice};
use rig_data::prepare::{each_of, threads};
use rig_model::batch::{BatchError, ChainBatch, Derivatives, ModelBatch, RegressorBlock, lower};
use rig_shared::multibody::COLUMNS;

/// Samples that are transposed at once: three signals of seven joints take 43 KiB.
const ROWS: usize = 256;
/// Fewest samples for which a thread is started: some milliseconds of work for seven joints.
const LEAST: usize = 16 * ROWS;

/// Signals of a block, one column a joint.
type Columns = [Vec<f64>];

/// Computes a block: signals in, rows of the output out.
trait Kernel {
    fn compute(&mut self, signals: &[Vec<Vec<f64>>], out: &mut [f64]) -> Result<(), BatchError>;
}

/// Computes `width` numbers a sample from signals with one row a sample; `kernel` makes the kernel of each thread.
/// `wanted` threads; 0 for all processors. The result does not depend on it.
fn over_rows<K: Kernel>(
    signals: &[ArrayView2<'_, f64>],
    width: usize,
    wanted: usize,
    kernel: impl Fn() -> K + Sync,
) -> Result<Vec<f64>, BatchError> {
    let samples = signals.first().map_or(0, |signal| signal.nrows());
    let mut out = vec![0.0; samples * width];
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
fn one_stretch(
    signals: &[ArrayView2<'_, f64>],
    start: usize,
    width: usize,
    out: &mut [f64],
    kernel: &mut impl Kernel,
) -> Result<(), BatchError> {
    let mut columns: Vec<Vec<Vec<f64>>> = signals
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
fn transpose(columns: &[f64], rows: usize, out: &mut [f64]) {
    let width = out.len() / rows;
    for (c, column) in columns.chunks_exact(rows).enumerate() {
        for (row, value) in out.chunks_exact_mut(width).zip(column) {
            row[c] = *value;
        }
    }
}

/// A function of a batch from signals to columns of a fixed number.
struct ByColumns<F> {
    function: F,
    columns: usize,
    scratch: Vec<f64>,
}

impl<F: FnMut(&[Vec<Vec<f64>>], &mut [f64]) -> Result<(), BatchError>> ByColumns<F> {
    /// Returns the columns of the function and the number of samples.
    fn evaluated(&mut self, signals: &[Vec<Vec<f64>>]) -> Result<(&[f64], usize), BatchError> {
        let rows = samples(signals);
        self.scratch.resize(self.columns * rows, 0.0);
        (self.function)(signals, &mut self.scratch)?;
        Ok((&self.scratch, rows))
    }
}

/// Returns the number of samples of a block.
fn samples(signals: &[Vec<Vec<f64>>]) -> usize {
    let first: Option<&Columns> = signals.first().map(Vec::as_slice);
    first.and_then(<[_]>::first).map_or(0, Vec::len)
}

impl<F: FnMut(&[Vec<Vec<f64>>], &mut [f64]) -> Result<(), BatchError>> Kernel for ByColumns<F> {
    fn compute(&mut self, signals: &[Vec<Vec<f64>>], out: &mut [f64]) -> Result<(), BatchError> {
        let (columns, rows) = self.evaluated(signals)?;
        transpose(columns, rows, out);
        Ok(())
    }
}

/// Lower triangles, written as full symmetric matrices.
struct Symmetric<F> {
    triangle: ByColumns<F>,
    size: usize,
}

impl<F: FnMut(&[Vec<Vec<f64>>], &mut [f64]) -> Result<(), BatchError>> Kernel for Symmetric<F> {
    fn compute(&mut self, signals: &[Vec<Vec<f64>>], out: &mut [f64]) -> Result<(), BatchError> {
        let n = self.size;
        let (columns, rows) = self.triangle.evaluated(signals)?;
        for (k, matrix) in out.chunks_exact_mut(n * n).enumerate() {
            fill_symmetric(columns, rows, k, n, matrix);
        }
        Ok(())
    }
}

/// Writes sample `k` of the columns of a lower triangle as a full matrix.
fn fill_symmetric(columns: &[f64], rows: usize, k: usize, n: usize, matrix: &mut [f64]) {
    for i in 0..n {
        for j in 0..=i {
            let value = columns[lower(i, j) * rows + k];
            matrix[i * n + j] = value;
            matrix[j * n + i] = value;
        }
    }
}

/// Derivatives by position, velocity and input: three n×n matrices a sample.
struct Matrices<F> {
    function: F,
    size: usize,
    columns: [Vec<f64>; 3],
}

impl<F: FnMut(&[Vec<Vec<f64>>], &mut Derivatives<'_>) -> Result<(), BatchError>> Kernel
    for Matrices<F>
{
    fn compute(&mut self, signals: &[Vec<Vec<f64>>], out: &mut [f64]) -> Result<(), BatchError> {
        let n = self.size;
        let rows = samples(signals);
        let [position, velocity, input] = &mut self.columns;
        position.resize(n * n * rows, 0.0);
        velocity.resize(n * n * rows, 0.0);
        input.resize(lower(n, 0) * rows, 0.0);
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
struct Regressor<'a> {
    batch: &'a ChainBatch,
    block: RegressorBlock,
}

impl Kernel for Regressor<'_> {
    fn compute(&mut self, signals: &[Vec<Vec<f64>>], out: &mut [f64]) -> Result<(), BatchError> {
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
fn by_columns<F>(columns: usize, function: F) -> ByColumns<F> {
    ByColumns {
        function,
        columns,
        scratch: Vec::new(),
    }
}

/// Torques of a motion, one row a sample: `[q, qd, qdd]`.
pub(crate) fn inverse(
    model: &ModelBatch,
    signals: [ArrayView2<'_, f64>; 3],
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    let n = model.joint_count();
    over_rows(&signals, n, wanted, || {
        by_columns(n, |s: &[Vec<Vec<f64>>], out: &mut [f64]| {
            model.inverse_dynamics(&s[0], &s[1], &s[2], out)
        })
    })
}

/// Accelerations under torques, one row a sample: `[q, qd, tau]`.
pub(crate) fn forward(
    model: &ModelBatch,
    signals: [ArrayView2<'_, f64>; 3],
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    let n = model.joint_count();
    over_rows(&signals, n, wanted, || {
        by_columns(n, |s: &[Vec<Vec<f64>>], out: &mut [f64]| {
            model.forward_dynamics(&s[0], &s[1], &s[2], out)
        })
    })
}

/// Derivatives of the torques of a motion by position, velocity and acceleration, 3·n·n numbers a sample:
/// `[q, qd, qdd]`.
pub(crate) fn inverse_derivatives(
    model: &ModelBatch,
    signals: [ArrayView2<'_, f64>; 3],
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    matrices(model, signals, wanted, |s, out| {
        model.inverse_dynamics_derivatives(&s[0], &s[1], &s[2], out)
    })
}

/// Derivatives of the accelerations by position, velocity and torque, 3·n·n numbers a sample: `[q, qd, tau]`.
pub(crate) fn forward_derivatives(
    model: &ModelBatch,
    signals: [ArrayView2<'_, f64>; 3],
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    matrices(model, signals, wanted, |s, out| {
        model.forward_dynamics_derivatives(&s[0], &s[1], &s[2], out)
    })
}

fn matrices(
    model: &ModelBatch,
    signals: [ArrayView2<'_, f64>; 3],
    wanted: usize,
    function: impl Fn(&[Vec<Vec<f64>>], &mut Derivatives<'_>) -> Result<(), BatchError> + Sync,
) -> Result<Vec<f64>, BatchError> {
    let n = model.joint_count();
    over_rows(&signals, 3 * n * n, wanted, || Matrices {
        function: &function,
        size: n,
        columns: Default::default(),
    })
}

/// Torques that hold the links against gravity, one row a sample.
pub(crate) fn gravity(
    model: &ModelBatch,
    q: ArrayView2<'_, f64>,
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    let n = model.joint_count();
    over_rows(&[q], n, wanted, || {
        by_columns(n, |s: &[Vec<Vec<f64>>], out: &mut [f64]| {
            model.gravity(&s[0], out)
        })
    })
}

/// Inertia matrices, n·n numbers a sample.
pub(crate) fn mass_matrix(
    model: &ModelBatch,
    q: ArrayView2<'_, f64>,
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    let n = model.joint_count();
    over_rows(&[q], n * n, wanted, || Symmetric {
        triangle: by_columns(lower(n, 0), |s: &[Vec<Vec<f64>>], out: &mut [f64]| {
            model.inertia_matrix(&s[0], out)
        }),
        size: n,
    })
}

/// Regressors, n·14·n numbers a sample: `[q, qd, qdd]`.
pub(crate) fn regressor(
    batch: &ChainBatch,
    signals: [ArrayView2<'_, f64>; 3],
    wanted: usize,
) -> Result<Vec<f64>, BatchError> {
    let n = batch.joint_count();
    over_rows(&signals, n * batch.link_count() * COLUMNS, wanted, || {
        Regressor {
            batch,
            block: batch.block(ROWS),
        }
    })
}
