//! Destination of a block's results.

use super::lane::{LANES, Lane};

/// Columns of results, in which a block writes its own samples.
pub(super) trait Columns {
    /// Returns the block's samples in a column.
    fn lane(&mut self, column: usize) -> &mut [f64; LANES];

    /// Returns the block's samples in two columns, the first before the second.
    fn two(&mut self, first: usize, second: usize) -> [&mut [f64; LANES]; 2];
}

impl Columns for [Lane] {
    #[inline(always)]
    fn lane(&mut self, column: usize) -> &mut [f64; LANES] {
        &mut self[column].0
    }

    #[inline(always)]
    fn two(&mut self, first: usize, second: usize) -> [&mut [f64; LANES]; 2] {
        let (before, after) = self.split_at_mut(second);
        [&mut before[first].0, &mut after[0].0]
    }
}

/// The samples of a block within columns of many samples, stored one after the other.
#[derive(Debug)]
pub struct Section<'a> {
    data: &'a mut [f64],
    stride: usize,
    at: usize,
}

impl<'a> Section<'a> {
    /// Column c begins at `data[c * stride]`; the block's samples are its [`LANES`] entries from `at` on.
    #[inline(always)]
    pub fn new(data: &'a mut [f64], stride: usize, at: usize) -> Self {
        Self { data, stride, at }
    }

    /// Returns the block's samples in `N` columns from `first` on.
    #[inline(always)]
    pub(super) fn lanes<const N: usize>(&mut self, first: usize) -> [&mut [f64; LANES]; N] {
        let (stride, at) = (self.stride, self.at);
        let mut rest = &mut self.data[first * stride..];
        core::array::from_fn(|_| {
            let (column, others) = core::mem::take(&mut rest).split_at_mut(stride);
            rest = others;
            block(column, at)
        })
    }
}

impl Columns for Section<'_> {
    #[inline(always)]
    fn lane(&mut self, column: usize) -> &mut [f64; LANES] {
        block(self.data, column * self.stride + self.at)
    }

    #[inline(always)]
    fn two(&mut self, first: usize, second: usize) -> [&mut [f64; LANES]; 2] {
        let (before, after) = self.data.split_at_mut(second * self.stride);
        [
            block(before, first * self.stride + self.at),
            block(after, self.at),
        ]
    }
}

/// Returns the [`LANES`] entries from `at` on.
#[inline(always)]
fn block(data: &mut [f64], at: usize) -> &mut [f64; LANES] {
    &mut data[at..at + LANES].as_chunks_mut().0[0]
}
