//! Input signals, one column of samples a joint, and output of results.

use std::ops::Range;

use rig_shared::lanes::Element;
use rig_shared::multibody::block::{LANES, Lane};

use super::BatchError;

/// Checks that every signal has one column a joint, all of the same length, and returns that length.
pub(super) fn samples<T, S: AsRef<[T]>>(
    joints: usize,
    signals: &[(&'static str, &[S])],
) -> Result<usize, BatchError> {
    let mut samples = None;
    for (argument, columns) in signals {
        if columns.len() != joints {
            return Err(BatchError::WrongColumns {
                argument,
                expected: joints,
                found: columns.len(),
            });
        }
        for (joint, column) in columns.iter().enumerate() {
            let found = column.as_ref().len();
            let expected = *samples.get_or_insert(found);
            if found != expected {
                return Err(BatchError::WrongSamples {
                    argument,
                    joint,
                    expected,
                    found,
                });
            }
        }
    }
    Ok(samples.unwrap_or(0))
}

/// Checks that `out` holds `columns` columns of `samples`.
pub(super) fn output<T>(columns: usize, samples: usize, out: &[T]) -> Result<(), BatchError> {
    if out.len() == columns * samples {
        Ok(())
    } else {
        Err(BatchError::WrongOutput {
            columns,
            samples,
            found: out.len(),
        })
    }
}

/// Cuts `range` into stretches of [`LANES`] samples; the last one may be shorter.
pub(super) fn stretches(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range
        .step_by(LANES)
        .map(move |start| start..end.min(start + LANES))
}

/// Loads samples `range` (at most [`LANES`]) of every column. A shorter stretch is padded with its last sample.
pub(super) fn load<T: Element, S: AsRef<[T]>>(
    columns: &[S],
    range: &Range<usize>,
    lanes: &mut [Lane<T>],
) {
    for (lane, column) in lanes.iter_mut().zip(columns) {
        let part = &column.as_ref()[range.clone()];
        if let Ok(full) = part.try_into() {
            lane.0 = full;
        } else {
            lane.fill(part.last().copied().unwrap_or(T::ZERO));
            lane[..part.len()].copy_from_slice(part);
        }
    }
}

/// Writes lanes to columns of `samples` samples, at `range`.
pub(super) fn store<'a, T: Element>(
    lanes: impl Iterator<Item = &'a [T; LANES]>,
    range: &Range<usize>,
    samples: usize,
    out: &mut [T],
) {
    for (column, lane) in out.chunks_exact_mut(samples).zip(lanes) {
        column[range.clone()].copy_from_slice(&lane[..range.len()]);
    }
}

/// Lets `compute(columns, stride, at)` write [`LANES`] entries of every column of `samples` samples of each output, at
/// `range`. A shorter range is written to temporary columns and copied.
pub(super) fn in_place<T: Element, const N: usize, R>(
    range: &Range<usize>,
    samples: usize,
    outs: [&mut [T]; N],
    compute: impl FnOnce([&mut [T]; N], usize, usize) -> R,
) -> R {
    if range.len() == LANES {
        return compute(outs, samples, range.start);
    }
    let mut short = outs
        .each_ref()
        .map(|out| vec![T::ZERO; out.len() / samples * LANES]);
    let done = compute(short.each_mut().map(Vec::as_mut_slice), LANES, 0);
    for (out, short) in outs.into_iter().zip(&short) {
        store(short.as_chunks().0.iter(), range, samples, out);
    }
    done
}

/// Returns one lane a joint, all zero.
pub(super) fn lanes<T: Element>(count: usize) -> Vec<Lane<T>> {
    vec![Lane::ZERO; count]
}
