//! Regressors of many samples.

use rig_shared::multibody::block::{AxisBlock, Frame, LANES, Lane};
use rig_shared::multibody::{COLUMNS, Chain, column};

use super::signals::{lanes, load, output, samples, stretches};
use super::{BLOCK, BatchError, dispatch};

/// Samples of a run when a regressor is written out.
const RUN: usize = 4 * BLOCK;

/// A chain's geometry and gravity, prepared for batches of regressors.
#[derive(Clone, Debug)]
pub struct ChainBatch {
    frames: Vec<Frame>,
    gravity: [f64; 3],
}

/// The differential regressor of up to [`BLOCK`] samples, column by column: [`Self::column`].
#[derive(Clone, Debug)]
pub struct RegressorBlock {
    width: usize,
    start: usize,
    len: usize,
    /// Entry (joint, c) from `(joint * width + c) * BLOCK` on; nothing is ever written where it is zero.
    data: Vec<f64>,
    signals: [Vec<Lane>; 3],
    axes: Vec<AxisBlock>,
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

    /// What multiplies parameter `c` (of the 14·n) in the torque of `joint` (from 0), sample by sample.
    ///
    /// # Panics
    /// Where `joint` or `c` is past the end.
    pub fn column(&self, joint: usize, c: usize) -> &[f64] {
        assert!(c < self.width, "column {c} of {}", self.width);
        let at = (joint * self.width + c) * BLOCK;
        &self.data[at..at + self.len]
    }

    /// Whether that column is 0 for every motion: a link does not load the joints beyond it, and the drive
    /// inertia, friction and offset of a joint load that joint alone.
    pub fn is_zero(joint: usize, c: usize) -> bool {
        let owner = c / COLUMNS;
        owner < joint || (owner > joint && c % COLUMNS >= column::DRIVE_INERTIA)
    }
}

impl ChainBatch {
    /// Prepares a chain.
    pub fn new(chain: &Chain<f64>) -> Self {
        Self {
            frames: Frame::of(chain).collect(),
            gravity: chain.gravity(),
        }
    }

    /// Number of joints n.
    pub fn joint_count(&self) -> usize {
        self.frames.len()
    }

    /// An empty block for [`Self::each_differential_block`], to be used again and again.
    pub fn block(&self) -> RegressorBlock {
        let n = self.joint_count();
        let width = n * COLUMNS;
        RegressorBlock {
            width,
            start: 0,
            len: 0,
            data: vec![0.0; n * width * BLOCK],
            signals: [lanes(n), lanes(n), lanes(n)],
            axes: vec![AxisBlock::ZERO; n],
        }
    }

    /// Computes the [`differential_regressor`](rig_shared::multibody::differential_regressor) block by block and calls
    /// `visit` with each in the order of time. `block` comes from [`Self::block`] of the same chain and is overwritten.
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
        let n = self.joint_count();
        let width = n * COLUMNS;
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        output(n * width, BLOCK, &block.data)?;
        for start in (0..count).step_by(BLOCK) {
            block.start = start;
            block.len = BLOCK.min(count - start);
            for range in stretches(start..start + block.len) {
                let [a, b, c] = &mut block.signals;
                load(q, &range, a);
                load(qd, &range, b);
                load(qdd, &range, c);
                dispatch::differential_regressor(
                    &self.frames,
                    self.gravity,
                    a,
                    b,
                    c,
                    &mut block.axes,
                    &mut block.data,
                    width,
                    BLOCK,
                    range.start - start,
                    // What a short stretch is filled up with goes to the unused end of the block.
                    LANES,
                );
            }
            visit(block)?;
        }
        Ok(())
    }

    /// [`differential_regressor`](rig_shared::multibody::differential_regressor) of every sample written out: `out`
    /// holds 14·n² columns, column `joint * 14 * n + c` what multiplies parameter `c` in the torque of `joint`. Zeros
    /// are written too.
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
        let n = self.joint_count();
        let width = n * COLUMNS;
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        output(n * width, count, out)?;
        if count == 0 {
            return Ok(());
        }
        for (entry, column) in out.chunks_exact_mut(count).enumerate() {
            if RegressorBlock::is_zero(entry / width, entry % width) {
                column.fill(0.0);
            }
        }
        let [mut a, mut b, mut c] = [(); 3].map(|()| lanes(n));
        let mut axes = vec![AxisBlock::ZERO; n];
        // Through a buffer that stays in the cache: memory is then written in runs of this many samples, which
        // it takes several times faster than many short ones.
        let run = RUN.min(count.next_multiple_of(LANES));
        let mut buffer = vec![0.0; n * width * run];
        for start in (0..count).step_by(run) {
            let end = count.min(start + run);
            for range in stretches(start..end) {
                load(q, &range, &mut a);
                load(qd, &range, &mut b);
                load(qdd, &range, &mut c);
                dispatch::differential_regressor(
                    &self.frames,
                    self.gravity,
                    &a,
                    &b,
                    &c,
                    &mut axes,
                    &mut buffer,
                    width,
                    run,
                    range.start - start,
                    LANES,
                );
            }
            let columns = out.chunks_exact_mut(count).zip(buffer.chunks_exact(run));
            for (entry, (column, block)) in columns.enumerate() {
                if !RegressorBlock::is_zero(entry / width, entry % width) {
                    column[start..end].copy_from_slice(&block[..end - start]);
                }
            }
        }
        Ok(())
    }

    /// [`energy_regressor`](rig_shared::multibody::energy_regressor) of every sample written out: `out` holds 14·n
    /// columns.
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong.
    pub fn energy_regressor<S: AsRef<[f64]>>(
        &self,
        q: &[S],
        qd: &[S],
        out: &mut [f64],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let width = n * COLUMNS;
        let count = samples(n, &[("q", q), ("qd", qd)])?;
        output(width, count, out)?;
        if count == 0 {
            return Ok(());
        }
        for (c, column) in out.chunks_exact_mut(count).enumerate() {
            if c % COLUMNS > column::DRIVE_INERTIA {
                column.fill(0.0);
            }
        }
        let (mut a, mut b) = (lanes(n), lanes(n));
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            load(qd, &range, &mut b);
            dispatch::energy_regressor(
                &self.frames,
                self.gravity,
                &a,
                &b,
                out,
                count,
                range.start,
                range.len(),
            );
        }
        Ok(())
    }
}
