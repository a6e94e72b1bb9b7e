//! Destination of a block's results.

use super::lane::{LANES, Lane};

/// Columns of results, in which a block writes its own samples.
pub(super) trait Columns<T> {
    /// Returns the block's samples in a column.
    fn lane(&mut self, column: usize) -> &mut [T; LANES];

    /// Returns the block's samples in two columns, the first before the second.
    fn two(&mut self, first: usize, second: usize) -> [&mut [T; LANES]; 2];
}

impl<T> Columns<T> for [Lane<T>] {
    #[inline(always)]
    fn lane(&mut self, column: usize) -> &mut [T; LANES] {
        &mut self[column].0
    }

    #[inline(always)]
    fn two(&mut self, first: usize, second: usize) -> [&mut [T; LANES]; 2] {
        let (before, after) = self.split_at_mut(second);
        [&mut before[first].0, &mut after[0].0]
    }
}

/// The samples of a block within columns of many samples, stored one after the other.
#[derive(Debug)]
pub struct Section<'a, T> {
    data: &'a mut [T],
    stride: usize,
    at: usize,
}

impl<'a, T> Section<'a, T> {
    /// Column c begins at `data[c * stride]`; the block's samples are its [`LANES`] entries from `at` on.
    #[inline(always)]
    pub fn new(data: &'a mut [T], stride: usize, at: usize) -> Self {
        Self { data, stride, at }
    }

    /// Returns the block's samples in `N` columns from `first` on.
    #[inline(always)]
    pub(super) fn lanes<const N: usize>(&mut self, first: usize) -> [&mut [T; LANES]; N] {
        let (stride, at) = (self.stride, self.at);
        let mut rest = &mut self.data[first * stride..];
        core::array::from_fn(|_| {
            let (column, others) = core::mem::take(&mut rest).split_at_mut(stride);
            rest = others;
            block(column, at)
        })
    }
}

impl<T> Columns<T> for Section<'_, T> {
    #[inline(always)]
    fn lane(&mut self, column: usize) -> &mut [T; LANES] {
        block(self.data, column * self.stride + self.at)
    }

    #[inline(always)]
    fn two(&mut self, first: usize, second: usize) -> [&mut [T; LANES]; 2] {
        let (before, after) = self.data.split_at_mut(second * self.stride);
        [
            block(before, first * self.stride + self.at),
            block(after, self.at),
        ]
    }
}

/// Returns the [`LANES`] entries from `at` on.
#[inline(always)]
fn block<T>(data: &mut [T], at: usize) -> &mut [T; LANES] {
    &mut data[at..at + LANES].as_chunks_mut().0[0]
}
