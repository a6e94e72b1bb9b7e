//! Recordings with the same rows.
//!
//! Each recording is reduced to a sketch: the smallest of the hashes of all runs of [`RUN`] consecutive rows (Broder
//! 1997, "On the resemblance and containment of documents"). Two sketches give the share of runs that both recordings
//! hold. A sketch has the same size for every recording. A row is its positions and torques; time does not count. Runs of
//! every second, third … row are sketched as well, so that a copy with fewer rows is found.
//!
//! Leaves out: a copy whose values were changed by more than single precision, as by rounding to few digits.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use rig_data::Block;
use rig_data::prepare::{PrepareError, Recording};

use crate::error::CompareError;

/// Rows in a run. Measured rows are noisy: that eight rows are equal to the last bit by chance is practically
/// impossible.
const RUN: usize = 8;
/// Largest distance of the rows in a run: that to which a copy may be thinned.
const STRIDES: usize = 10;
/// Hashes in a sketch.
const SIZE: usize = 512;
/// Common hashes in a sketch from which two recordings overlap: they share 1.6 % or more of all their runs.
const COMMON: usize = 8;
/// Rows that are read together.
const ROWS: usize = 4096;

/// Sketch of the runs of a recording with one distance of their rows.
#[derive(Default)]
struct Runs {
    /// The smallest hashes.
    smallest: BTreeSet<u64>,
    /// Number of runs, without those in which all rows are equal.
    count: u64,
}

/// Sketch of a recording.
struct Sketch {
    /// Label of the recording.
    label: String,
    /// Runs of adjacent rows, of every second row and so on.
    strides: Vec<Runs>,
}

/// Refuses recordings that share rows.
///
/// # Errors
/// [`CompareError::SameRows`]; a recording that cannot be read.
pub(crate) fn refuse_same_rows<'a>(
    recordings: impl Iterator<Item = &'a dyn Recording>,
) -> Result<(), CompareError> {
    let mut before: Vec<Sketch> = Vec::new();
    for recording in recordings {
        let own = Sketch::of(recording).map_err(|why| CompareError::Read(why.to_string()))?;
        for other in &before {
            if let Some(share) = own.shared(other) {
                return Err(CompareError::SameRows {
                    first: other.label.clone(),
                    second: own.label,
                    percent: (100.0 * share).round().max(1.0),
                });
            }
        }
        before.push(own);
    }
    Ok(())
}

impl Sketch {
    fn of(recording: &dyn Recording) -> Result<Self, PrepareError> {
        let mut strides: Vec<Runs> = (0..STRIDES).map(|_| Runs::default()).collect();
        let mut rows: Vec<u64> = Vec::new();
        let mut kept = 0;
        recording.each_block(ROWS, &mut |block| {
            rows.extend((0..block.t.len()).map(|k| hash_of_row(&block, k)));
            for last in kept..rows.len() {
                for (k, runs) in strides.iter_mut().enumerate() {
                    if let Some(first) = last.checked_sub((RUN - 1) * (k + 1)) {
                        runs.take(rows[first..=last].iter().step_by(k + 1));
                    }
                }
            }
            rows.drain(..rows.len().saturating_sub((RUN - 1) * STRIDES));
            kept = rows.len();
            Ok(())
        })?;
        Ok(Self {
            label: recording.label(),
            strides,
        })
    }

    /// Returns the estimated share of the shorter recording that both hold, one of them perhaps thinned; none if it is not
    /// clearly above 0.
    fn shared(&self, other: &Self) -> Option<f64> {
        let thinned = |a: &Self, b: &Self| {
            let whole = a.strides.first()?;
            let shares = b.strides.iter().filter_map(|runs| whole.shared(runs));
            shares.reduce(f64::max)
        };
        let shares = [thinned(self, other), thinned(other, self)];
        shares.into_iter().flatten().reduce(f64::max)
    }
}

impl Runs {
    /// Takes a run. At rest, noise-free recordings repeat one row, whatever the motion; such runs do not count.
    fn take<'a>(&mut self, mut run: impl Iterator<Item = &'a u64> + Clone) {
        let mut hasher = DefaultHasher::new();
        run.clone().for_each(|row| row.hash(&mut hasher));
        let first = run.next();
        if run.all(|row| Some(row) == first) {
            return;
        }
        self.count += 1;
        let hash = hasher.finish();
        let is_small = (self.smallest.last()).is_none_or(|largest| hash < *largest);
        if is_small || self.smallest.len() < SIZE {
            self.smallest.insert(hash);
        }
        if self.smallest.len() > SIZE {
            self.smallest.pop_last();
        }
    }

    /// Returns the estimated share of the shorter one that both hold; none if it is not clearly above 0.
    fn shared(&self, other: &Self) -> Option<f64> {
        let all: BTreeSet<u64> = self.smallest.union(&other.smallest).copied().collect();
        let looked = all.len().min(SIZE);
        let common = (all.iter().take(looked))
            .filter(|hash| self.smallest.contains(hash) && other.smallest.contains(hash))
            .count();
        if common < COMMON {
            return None;
        }
        let resemblance = common as f64 / looked as f64;
        let both = resemblance / (1.0 + resemblance) * (self.count + other.count) as f64;
        Some((both / self.count.min(other.count) as f64).min(1.0))
    }
}

/// Returns the hash of positions and torques in row `k`, in single precision: a copy may have been written with fewer
/// digits.
fn hash_of_row(block: &Block, k: usize) -> u64 {
    let mut hasher = DefaultHasher::new();
    for joint in &block.joints {
        for list in [&joint.q, &joint.tau] {
            list.get(k).map(|x| (*x as f32).to_bits()).hash(&mut hasher);
        }
    }
    hasher.finish()
}
