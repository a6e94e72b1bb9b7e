//! Regressors of many samples.

use rig_shared::multibody::{COLUMNS, Chain, MAX_JOINTS, differential_regressor, energy_regressor};

use super::signals::{output, row, samples};
use super::{BLOCK, BatchError};

/// A chain's geometry and gravity, prepared for batches of regressors.
#[derive(Clone, Debug)]
pub struct ChainBatch {
    chain: Chain<f64>,
}

/// The differential regressor of up to [`BLOCK`] samples, column by column.
///
/// Equation `joint` (from 0) of the torques, column `c` of the 14·n parameters: [`Self::column`].
#[derive(Clone, Debug)]
pub struct RegressorBlock {
    width: usize,
    start: usize,
    len: usize,
    data: Vec<f64>,
    zeros: [f64; BLOCK],
}

impl RegressorBlock {
    /// Number of the block's first sample in the recording.
    pub fn start(&self) -> usize {
        self.start
    }

    /// Number of samples, at most [`BLOCK`].
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it holds no sample; never the case in a visit.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// What multiplies parameter `c` in the torque of `joint`, sample by sample.
    ///
    /// # Panics
    /// Where `joint` or `c` is past the end.
    pub fn column(&self, joint: usize, c: usize) -> &[f64] {
        assert!(c < self.width, "column {c} of {}", self.width);
        if Self::is_zero(joint, c) {
            return &self.zeros[..self.len];
        }
        let at = (joint * self.width + c) * BLOCK;
        &self.data[at..at + self.len]
    }

    /// Whether that column is 0 for every motion: a link does not load the joints beyond it, and the drive
    /// inertia, friction and offset of a joint load that joint alone.
    pub fn is_zero(joint: usize, c: usize) -> bool {
        let owner = c / COLUMNS;
        owner < joint
            || (owner > joint && c % COLUMNS >= rig_shared::multibody::column::DRIVE_INERTIA)
    }
}

impl ChainBatch {
    /// Prepares a chain.
    pub fn new(chain: &Chain<f64>) -> Self {
        Self {
            chain: chain.clone(),
        }
    }

    /// Number of joints n.
    pub fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }

    /// An empty block for [`Self::each_differential_block`], to be used again and again.
    pub fn block(&self) -> RegressorBlock {
        let (n, width) = (self.joint_count(), self.chain.parameter_count());
        RegressorBlock {
            width,
            start: 0,
            len: 0,
            data: vec![0.0; n * width * BLOCK],
            zeros: [0.0; BLOCK],
        }
    }

    /// Computes [`differential_regressor`] block by block and calls `visit` with each in the order of time.
    /// `block` comes from [`Self::block`] of the same chain and is overwritten.
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong; what `visit` gives ends the walk.
    pub fn each_differential_block<S: AsRef<[f64]>, E: From<BatchError>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        block: &mut RegressorBlock,
        mut visit: impl FnMut(&RegressorBlock) -> Result<(), E>,
    ) -> Result<(), E> {
        let (n, width) = (self.joint_count(), self.chain.parameter_count());
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        output(n * width, BLOCK, &block.data)?;
        let [mut a, mut b, mut c] = [[0.0; MAX_JOINTS]; 3];
        let mut matrix = vec![0.0; n * width];
        for start in (0..count).step_by(BLOCK) {
            block.start = start;
            block.len = BLOCK.min(count - start);
            for k in 0..block.len {
                row(q, start + k, &mut a);
                row(qd, start + k, &mut b);
                row(qdd, start + k, &mut c);
                differential_regressor(&self.chain, &a[..n], &b[..n], &c[..n], &mut matrix)
                    .map_err(BatchError::from)?;
                for (entry, value) in matrix.iter().enumerate() {
                    block.data[entry * BLOCK + k] = *value;
                }
            }
            visit(block)?;
        }
        Ok(())
    }

    /// [`differential_regressor`] of every sample written out: `out` holds 14·n² columns, column
    /// `joint * 14 * n + c` what multiplies parameter `c` in the torque of `joint`. Zeros are written too.
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong.
    pub fn differential_regressor<S: AsRef<[f64]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        out: &mut [f64],
    ) -> Result<(), BatchError> {
        let (n, width) = (self.joint_count(), self.chain.parameter_count());
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        output(n * width, count, out)?;
        let mut block = self.block();
        self.each_differential_block(q, qd, qdd, &mut block, |block| {
            for entry in 0..n * width {
                let at = entry * count + block.start;
                out[at..at + block.len].copy_from_slice(block.column(entry / width, entry % width));
            }
            Ok(())
        })
    }

    /// [`energy_regressor`] of every sample written out: `out` holds 14·n columns.
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong.
    pub fn energy_regressor<S: AsRef<[f64]>>(
        &self,
        q: &[S],
        qd: &[S],
        out: &mut [f64],
    ) -> Result<(), BatchError> {
        let (n, width) = (self.joint_count(), self.chain.parameter_count());
        let count = samples(n, &[("q", q), ("qd", qd)])?;
        output(width, count, out)?;
        let [mut a, mut b] = [[0.0; MAX_JOINTS]; 2];
        let mut line = vec![0.0; width];
        for k in 0..count {
            row(q, k, &mut a);
            row(qd, k, &mut b);
            energy_regressor(&self.chain, &a[..n], &b[..n], &mut line)?;
            for (c, value) in line.iter().enumerate() {
                out[c * count + k] = *value;
            }
        }
        Ok(())
    }
}
