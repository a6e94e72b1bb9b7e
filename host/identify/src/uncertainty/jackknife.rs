//! Fits with one segment of the data left out at a time (delete-group jackknife, Shao & Tu 1995, ch. 2).

use nalgebra::{DMatrix, DVector};

use crate::error::IdentifyError;
use crate::rows::factor::TriangularFactor;

/// Number of segments of the training data.
pub(crate) const PARTS: usize = 16;
/// Minimum length of a segment, in correlation times of the residual; shorter neighbours are joined.
const MEMORIES_PER_PART: f64 = 10.0;
/// Smallest number of segments after joining.
const FEWEST_PARTS: usize = 8;

/// Returns the segment of instant `index` among `total`.
pub(crate) fn part_of(index: u64, total: u64) -> usize {
    ((u128::from(index) * PARTS as u128 / u128::from(total.max(1))) as usize).min(PARTS - 1)
}

/// Returns the number of segments that are independent enough.
pub(crate) fn part_count(instants: u64, memory_rows: f64) -> usize {
    if instants as f64 >= PARTS as f64 * MEMORIES_PER_PART * memory_rows {
        PARTS
    } else {
        FEWEST_PARTS
    }
}

/// Joins neighbours to `count` segments, one factor each.
pub(crate) fn joined(parts: Vec<TriangularFactor>, count: usize) -> Vec<TriangularFactor> {
    let each = parts.len().div_ceil(count.max(1)).max(1);
    parts
        .chunks(each)
        .map(|chunk| {
            let mut whole = chunk[0].clone();
            for other in &chunk[1..] {
                whole.merge(other, 1.0);
            }
            whole
        })
        .collect()
}

/// Factor of all segments, and of all but each one.
pub struct LeaveOut {
    /// All segments.
    pub whole: TriangularFactor,
    /// All but the segment of this index.
    pub without: Vec<TriangularFactor>,
}

impl LeaveOut {
    /// Merges from both ends: three merges per segment.
    pub fn of(parts: &[TriangularFactor]) -> Self {
        let columns = parts.first().map_or(0, TriangularFactor::columns);
        let empty = TriangularFactor::new(columns);
        let mut before = vec![empty.clone()];
        for part in parts {
            let mut next = before[before.len() - 1].clone();
            next.merge(part, 1.0);
            before.push(next);
        }
        let mut after = empty;
        let mut without = Vec::with_capacity(parts.len());
        for (k, part) in parts.iter().enumerate().rev() {
            let mut rest = before[k].clone();
            rest.merge(&after, 1.0);
            without.push(rest);
            after.merge(part, 1.0);
        }
        without.reverse();
        Self {
            whole: before[parts.len()].clone(),
            without,
        }
    }

    /// Repeats a fit on all segments and on each remainder.
    pub fn refit(
        &self,
        fit: &dyn Fn(&TriangularFactor) -> Result<Vec<f64>, IdentifyError>,
    ) -> Result<Refit, IdentifyError> {
        Ok(Refit {
            whole: fit(&self.whole)?,
            without: self.without.iter().map(fit).collect::<Result<_, _>>()?,
        })
    }
}

/// Values from all data and with each segment left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Refit {
    /// From all data.
    pub whole: Vec<f64>,
    /// Without one segment.
    pub without: Vec<Vec<f64>>,
}

impl Refit {
    /// Applies a function to every set of values.
    pub fn map(&self, of: &dyn Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            whole: of(&self.whole),
            without: self.without.iter().map(|v| of(v)).collect(),
        }
    }

    /// Returns the delete-group jackknife covariance.
    pub fn covariance(&self) -> DMatrix<f64> {
        let (size, groups) = (self.whole.len(), self.without.len() as f64);
        let mut mean = DVector::zeros(size);
        for v in &self.without {
            mean += DVector::from_column_slice(v) / groups;
        }
        let mut covariance = DMatrix::zeros(size, size);
        for v in &self.without {
            let d = DVector::from_column_slice(v) - &mean;
            covariance.ger(1.0, &d, &d, 1.0);
        }
        covariance * ((groups - 1.0) / groups)
    }
}
