//! Regressors of many samples.

use std::ops::Range;

use rig_shared::multibody::block::{AxisBlock, Frame, LANES, Lane};
use rig_shared::multibody::{COLUMNS, Chain, column};

use super::BatchError;
use super::dispatch::Number;
use super::gears::Gears;
use super::signals::{in_place, lanes, load, output, samples, stretches};

/// Bytes in a cache line.
const LINE: usize = 64;

/// Geometry and gravity of a chain, prepared for batches of regressors.
#[derive(Clone, Debug)]
pub struct ChainBatch<T = f64> {
    frames: Vec<Frame<T>>,
    gravity: [T; 3],
    /// How axes follow joints, if some do.
    gears: Option<Gears<T>>,
}

/// The differential regressor of several samples, column by column: [`Self::column`].
///
/// It has room for the number of samples given to [`ChainBatch::block`], a few or a whole recording, and is reused
/// without a new allocation. More than half of the columns are zero by structure. They can be read but are never
/// written, so the operating system need not assign memory for them.
#[derive(Clone, Debug)]
pub struct RegressorBlock<T = f64> {
    joints: usize,
    /// Joints and followers: the links that have columns.
    links: usize,
    room: usize,
    start: usize,
    len: usize,
    /// Column (joint, c) begins at `first + (joint * 14 * links + c) * stride`.
    data: Vec<T>,
    /// Numbers skipped so that columns begin at a cache line.
    first: usize,
    stride: usize,
    signals: [Vec<Lane<T>>; 3],
    axes: Vec<AxisBlock<T>>,
    /// Signals and regressor of all axes, if some follow; otherwise empty.
    of_axes: [Vec<Lane<T>>; 3],
    regressor_of_axes: Vec<T>,
}

impl<T> RegressorBlock<T> {
    /// Returns the number of the first sample in the recording.
    pub fn start(&self) -> usize {
        self.start
    }

    /// Returns the number of samples that it holds now.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if it holds no sample; never the case in a visit.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the number of samples that it has room for.
    pub fn room(&self) -> usize {
        self.room
    }

    /// Returns the factor of parameter `c` (of 14 a link) in the torque of `joint` (from 0), sample by sample.
    ///
    /// # Panics
    /// If `joint` or `c` is past the end.
    pub fn column(&self, joint: usize, c: usize) -> &[T] {
        let width = self.links * COLUMNS;
        assert!(c < width, "column {c} of {width}");
        let at = self.first + (joint * width + c) * self.stride;
        &self.data[at..at + self.len]
    }
}

impl<T: Number> ChainBatch<T> {
    /// Prepares a chain.
    pub fn new(chain: &Chain<f64>) -> Self {
        Self {
            frames: Frame::of(chain).collect(),
            gravity: chain.gravity().map(T::from_f64),
            gears: Gears::of(chain),
        }
    }

    /// Returns the number of joints n.
    pub fn joint_count(&self) -> usize {
        (self.gears.as_ref()).map_or(self.frames.len(), Gears::joint_count)
    }

    /// Returns the number of links, joints and followers.
    pub fn link_count(&self) -> usize {
        self.frames.len()
    }

    /// Returns true if column `c` of [`RegressorBlock::column`] of `joint` is 0 for every motion. A link does not load the
    /// joints beyond it. Drive inertia, friction and offset of a joint load only that joint.
    pub fn is_zero(&self, joint: usize, c: usize) -> bool {
        if let Some(gears) = &self.gears {
            return gears.is_zero(joint, c);
        }
        let owner = c / COLUMNS;
        owner < joint || (owner > joint && c % COLUMNS >= column::DRIVE_INERTIA)
    }

    /// Returns an empty block with room for `samples`, to be reused with this chain.
    pub fn block(&self, samples: usize) -> RegressorBlock<T> {
        let (n, links) = (self.joint_count(), self.link_count());
        let width = links * COLUMNS;
        // An odd number of stretches: columns a power of two apart would share a few places in the cache.
        let stride = (samples.div_ceil(LANES) | 1) * LANES;
        let line = LINE / size_of::<T>();
        let mut data = vec![T::ZERO; n * width * stride + line - 1];
        let first = data.as_ptr().align_offset(LINE).min(line - 1);
        for joint in 0..n {
            let offset = joint * (width + COLUMNS) + column::OFFSET;
            data[first + offset * stride..][..stride].fill(T::ONE);
        }
        RegressorBlock {
            joints: n,
            links,
            room: samples,
            start: 0,
            len: 0,
            data,
            first,
            stride,
            signals: [lanes(n), lanes(n), lanes(n)],
            axes: vec![AxisBlock::ZERO; links],
            of_axes: [(); 3].map(|()| lanes(if n == links { 0 } else { links })),
            regressor_of_axes: match n == links {
                true => Vec::new(),
                false => vec![T::ZERO; links * width * LANES],
            },
        }
    }

    /// Computes the [`differential_regressor`](rig_shared::multibody::differential_regressor) in pieces of at most the
    /// room of `block`, and calls `visit` with each piece in the order of time. `block` comes from [`Self::block`] of
    /// the same chain and is overwritten.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong; an error of `visit` ends the loop.
    pub fn each_differential_block<S: AsRef<[T]>, E: From<BatchError>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        block: &mut RegressorBlock<T>,
        mut visit: impl FnMut(&RegressorBlock<T>) -> Result<(), E>,
    ) -> Result<(), E> {
        let count = self.fitting(q, qd, qdd, block)?;
        if count > 0 && block.room == 0 {
            return Err(BatchError::SmallBlock {
                room: 0,
                samples: count,
            }
            .into());
        }
        for start in (0..count).step_by(block.room.max(1)) {
            self.fill(q, qd, qdd, start..count.min(start + block.room), block);
            visit(block)?;
        }
        Ok(())
    }

    /// Computes the [`differential_regressor`](rig_shared::multibody::differential_regressor) of every sample and
    /// stores it in `block`, which comes from [`Self::block`] of the same chain.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong, or `block` has no room for all samples.
    pub fn differential_regressor<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        block: &mut RegressorBlock<T>,
    ) -> Result<(), BatchError> {
        let samples = self.fitting(q, qd, qdd, block)?;
        if samples > block.room {
            return Err(BatchError::SmallBlock {
                room: block.room,
                samples,
            });
        }
        self.fill(q, qd, qdd, 0..samples, block);
        Ok(())
    }

    /// Checks lengths and returns the number of samples.
    fn fitting<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        block: &RegressorBlock<T>,
    ) -> Result<usize, BatchError> {
        let expected = self.joint_count();
        if block.joints != expected || block.links != self.link_count() {
            return Err(BatchError::WrongBlock {
                expected,
                found: block.joints,
            });
        }
        samples(expected, &[("q", q), ("qd", qd), ("qdd", qdd)])
    }

    /// Computes the samples `range` into the block, which has room for them.
    fn fill<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        range: Range<usize>,
        block: &mut RegressorBlock<T>,
    ) {
        let start = range.start;
        (block.start, block.len) = (start, range.len());
        for part in stretches(range) {
            let [a, b, c] = &mut block.signals;
            load(q, &part, a);
            load(qd, &part, b);
            load(qdd, &part, c);
            if let Some(gears) = &self.gears {
                self.fill_geared(gears, part.start - start, block);
                continue;
            }
            T::differential_regressor(
                &self.frames,
                self.gravity,
                a,
                b,
                c,
                &mut block.axes,
                &mut block.data[block.first..],
                block.stride,
                // The padding of a short stretch goes to the unused end of the columns.
                part.start - start,
            );
        }
    }

    /// Computes a block's samples, whose signals are loaded, from `at` on.
    fn fill_geared(&self, gears: &Gears<T>, at: usize, block: &mut RegressorBlock<T>) {
        let [a, b, c] = &mut block.of_axes;
        gears.spread(&block.signals[0], true, a);
        gears.spread(&block.signals[1], false, b);
        gears.spread(&block.signals[2], false, c);
        let wide = &mut block.regressor_of_axes;
        let (frames, axes) = (&self.frames, &mut block.axes);
        T::differential_regressor(frames, self.gravity, a, b, c, axes, wide, LANES, 0);
        gears.project_regressor(wide, &mut block.data[block.first..], block.stride, at);
    }

    /// Computes the [`energy_regressor`](rig_shared::multibody::energy_regressor) of every sample: `out` holds 14
    /// columns a link.
    ///
    /// # Errors
    /// [`BatchError`] if a length is wrong.
    pub fn energy_regressor<S: AsRef<[T]>>(
        &self,
        q: &[S],
        qd: &[S],
        out: &mut [T],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let width = self.link_count() * COLUMNS;
        let count = samples(n, &[("q", q), ("qd", qd)])?;
        output(width, count, out)?;
        if count == 0 {
            return Ok(());
        }
        if let Some(gears) = &self.gears {
            let axes = Self {
                gears: None,
                ..self.clone()
            };
            let mut wide = vec![T::ZERO; out.len()];
            axes.energy_regressor(&gears.positions(q), &gears.rates(qd), &mut wide)?;
            gears.arrange(&wide, count, out);
            return Ok(());
        }
        for (c, column) in out.chunks_exact_mut(count).enumerate() {
            if c % COLUMNS > column::DRIVE_INERTIA {
                column.fill(T::ZERO);
            }
        }
        let (mut a, mut b) = (lanes(n), lanes(n));
        for range in stretches(0..count) {
            load(q, &range, &mut a);
            load(qd, &range, &mut b);
            in_place(&range, count, [&mut *out], |[out], stride, at| {
                let (frames, gravity) = (&self.frames, self.gravity);
                T::energy_regressor(frames, gravity, &a, &b, out, stride, at);
            });
        }
        Ok(())
    }
}
