//! Covariance of a fit from groups of neighbouring rows (delete-group jackknife).

use nalgebra::DMatrix;
use nalgebra::DVector;

/// Number of collected groups; neighbouring groups are merged later if the residual's correlation time is longer.
pub(crate) const FINEST_GROUPS: usize = 64;
/// Smallest number of groups for an interval.
const FEWEST_GROUPS: usize = 8;
/// Minimum length of a group, in correlation times of the residual, so that groups are nearly independent.
const MEMORIES_PER_GROUP: f64 = 10.0;

/// Sums over time segments, in coordinates z in which Σ z·zᵀ over all rows is the identity.
#[derive(Clone, Debug)]
pub(crate) struct Groups {
    information: Vec<DMatrix<f64>>,
    score: Vec<DVector<f64>>,
    total: u64,
}

impl Groups {
    /// Creates empty sums for `total` instants and `size` parameters.
    pub(crate) fn new(size: usize, total: u64) -> Self {
        Self {
            information: vec![DMatrix::zeros(size, size); FINEST_GROUPS],
            score: vec![DVector::zeros(size); FINEST_GROUPS],
            total: total.max(1),
        }
    }

    /// Adds one row: whitened regressor `z` and residual `e` of instant `index`.
    pub(crate) fn push(&mut self, index: u64, z: &DVector<f64>, e: f64) {
        let g = group_of(index, self.total);
        self.information[g].ger(1.0, z, z, 1.0);
        self.score[g].axpy(e, z, 1.0);
    }

    /// Returns the covariance of the whitened parameters by leaving out one group at a time, and the number of groups.
    ///
    /// Delete-group jackknife (Shao & Tu 1995, ch. 2; for clusters MacKinnon, Nielsen & Webb 2023, "CV₃"). It needs no
    /// model of the correlation within a group and corrects for influential groups. With G groups the estimate divided
    /// by its standard deviation follows Student's t with G − 1 degrees of freedom (Bester, Conley & Hansen 2011).
    /// `None` if the recording is too short for independent groups, or if all information on a parameter lies in one
    /// group.
    pub(crate) fn jackknife(&self, memory_rows: f64) -> Option<(DMatrix<f64>, usize)> {
        let most = (self.total as f64 / (MEMORIES_PER_GROUP * memory_rows)).floor() as usize;
        let groups = most.clamp(FEWEST_GROUPS, FINEST_GROUPS);
        let size = self.score[0].len();
        let mut information = vec![DMatrix::zeros(size, size); groups];
        let mut score = vec![DVector::zeros(size); groups];
        for fine in 0..FINEST_GROUPS {
            let g = fine * groups / FINEST_GROUPS;
            information[g] += &self.information[fine];
            score[g] += &self.score[fine];
        }
        let identity = DMatrix::identity(size, size);
        let mut shifts = Vec::with_capacity(groups);
        for (a, u) in information.iter().zip(&score) {
            shifts.push(-(&identity - a).cholesky()?.solve(u));
        }
        let mean = shifts.iter().fold(DVector::zeros(size), |m, s| m + s) / groups as f64;
        let mut covariance = DMatrix::zeros(size, size);
        for shift in &shifts {
            let d = shift - &mean;
            covariance.ger(1.0, &d, &d, 1.0);
        }
        Some((covariance * ((groups - 1) as f64 / groups as f64), groups))
    }
}

/// Returns the group of instant `index` among `total`.
pub(crate) fn group_of(index: u64, total: u64) -> usize {
    ((index as u128 * FINEST_GROUPS as u128 / total.max(1) as u128) as usize).min(FINEST_GROUPS - 1)
}
