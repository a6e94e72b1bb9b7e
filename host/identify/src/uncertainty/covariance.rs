//! Covariance of the estimate for residuals that are correlated in time.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Number of collected groups; neighbouring groups are merged later if the residual's correlation time is longer.
pub(crate) const FINEST_GROUPS: usize = 64;
/// Smallest number of groups for an interval.
const FEWEST_GROUPS: usize = 8;
/// Minimum length of a group, in correlation times of the residual, so that groups are nearly independent.
const MEMORIES_PER_GROUP: f64 = 10.0;
/// Largest lag, in rows, of the residuals' autocorrelation.
pub(crate) const LAGS: usize = 200;

/// Autocovariance of a stream of residuals.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    /// The latest residuals from `next` on, newest first.
    ring: Vec<f64>,
    next: usize,
    seen: u64,
    sums: Vec<f64>,
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            ring: vec![0.0; 8 * LAGS],
            next: 7 * LAGS,
            seen: 0,
            sums: vec![0.0; LAGS + 1],
        }
    }
}

impl Memory {
    /// Adds the next residual.
    pub(crate) fn push(&mut self, e: f64) {
        // Written backwards, so that earlier residuals follow in order; zeros before the first.
        if self.next == 0 {
            self.next = self.ring.len() - LAGS;
            let (start, end) = self.ring.split_at_mut(self.next);
            end.copy_from_slice(&start[..LAGS]);
        }
        self.next -= 1;
        self.ring[self.next] = e;
        let before = &self.ring[self.next..=self.next + LAGS];
        for (sum, past) in self.sums.iter_mut().zip(before) {
            *sum += e * past;
        }
        self.seen += 1;
    }

    /// Returns the autocorrelation at lags 0 … [`LAGS`].
    pub(crate) fn correlation(&self) -> Vec<f64> {
        let zero = self.sums[0].max(f64::MIN_POSITIVE);
        self.sums.iter().map(|s| s / zero).collect()
    }

    /// Returns the correlation time 1 + 2·Σρ in rows, at least one. The sum ends where ρ falls below twice its standard
    /// error (truncation of Geyer's initial sequence, 1992, adapted to the noise of the estimate).
    pub(crate) fn length(&self) -> f64 {
        memory_of(&self.correlation(), self.seen)
    }

    /// Returns the number of residuals so far.
    pub(crate) fn seen(&self) -> u64 {
        self.seen
    }
}

/// Returns [`Memory::length`] for a given autocorrelation (lag 0 first) of `seen` residuals.
pub(crate) fn memory_of(correlation: &[f64], seen: u64) -> f64 {
    let threshold = 2.0 / (seen.max(1) as f64).sqrt();
    let sum: f64 = correlation
        .iter()
        .skip(1)
        .take_while(|r| **r > threshold)
        .sum();
    1.0 + 2.0 * sum
}

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

/// An estimate with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Values of the base parameters.
    pub values: Vec<f64>,
    /// Standard deviations; allow for correlation of the residuals in time.
    pub std: Vec<f64>,
    /// Standard deviations for white residuals, as in the literature: σ²·(XᵀX)⁻¹.
    pub classical_std: Vec<f64>,
    /// Covariance, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Correlation, row by row.
    pub correlation: Vec<Vec<f64>>,
    /// 95 % intervals (Student's t with `degrees_of_freedom`).
    pub interval: Vec<[f64; 2]>,
    /// Number of groups minus one.
    pub degrees_of_freedom: usize,
    /// Rows used.
    pub rows: u64,
    /// Rows divided by the residual's correlation time.
    pub effective_rows: f64,
    /// Correlation time of the residuals in rows: 1 + 2·Σρ.
    pub memory_rows: f64,
    /// Condition number of the unscaled regressor, SI units.
    pub condition: f64,
    /// Condition number with every column scaled to length one.
    pub scaled_condition: f64,
}

impl Estimate {
    /// Builds the estimate from values and their covariance. `regressor` is the fitted upper triangle, `memory_rows`
    /// the correlation time of the residuals.
    pub(crate) fn of(
        values: &[f64],
        covariance: &DMatrix<f64>,
        degrees_of_freedom: usize,
        classical_std: Vec<f64>,
        regressor: &DMatrix<f64>,
        rows: u64,
        memory_rows: f64,
    ) -> Self {
        let size = values.len();
        let std: Vec<f64> = (0..size)
            .map(|k| covariance[(k, k)].max(0.0).sqrt())
            .collect();
        let quantile = t_quantile(degrees_of_freedom);
        let condition = |m: &DMatrix<f64>| {
            let s = m.singular_values();
            s.max() / s.min()
        };
        let mut scaled = regressor.clone();
        for mut column in scaled.column_iter_mut() {
            let norm = column.norm();
            column /= norm;
        }
        let rows_of = |m: &dyn Fn(usize, usize) -> f64| {
            (0..size)
                .map(|i| (0..size).map(|j| m(i, j)).collect())
                .collect::<Vec<Vec<f64>>>()
        };
        Self {
            values: values.to_vec(),
            interval: (0..size)
                .map(|k| [values[k] - quantile * std[k], values[k] + quantile * std[k]])
                .collect(),
            covariance: rows_of(&|i, j| covariance[(i, j)]),
            correlation: rows_of(&|i, j| {
                covariance[(i, j)] / (std[i] * std[j]).max(f64::MIN_POSITIVE)
            }),
            std,
            classical_std,
            degrees_of_freedom,
            rows,
            effective_rows: rows as f64 / memory_rows,
            memory_rows,
            condition: condition(regressor),
            scaled_condition: condition(&scaled),
        }
    }
}

/// A 95 % confidence region of two parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ellipse {
    /// Parameters.
    pub pair: [usize; 2],
    /// Centre.
    pub centre: [f64; 2],
    /// First half axis as a vector, in the units of the parameters.
    pub first: [f64; 2],
    /// Second half axis.
    pub second: [f64; 2],
}

/// Returns Student's t quantile for a two-sided 95 % interval.
pub fn t_quantile(degrees_of_freedom: usize) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1) as f64)
        .map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

impl Estimate {
    /// Returns true if a value lies in the 95 % interval of parameter `k`.
    pub fn covers(&self, k: usize, value: f64) -> bool {
        self.interval
            .get(k)
            .is_some_and(|[low, high]| (*low..=*high).contains(&value))
    }

    /// Returns the joint 95 % region of two parameters, half axes scaled by √(2·F₀.₉₅(2, ν)). `None` for a bad pair.
    pub fn ellipse(&self, a: usize, b: usize) -> Option<Ellipse> {
        let n = self.values.len();
        if a >= n || b >= n || a == b {
            return None;
        }
        let quantile = FisherSnedecor::new(2.0, self.degrees_of_freedom.max(1) as f64)
            .ok()?
            .inverse_cdf(0.95);
        let (sa, sb) = (self.std[a], self.std[b]);
        let rho = self.correlation[a][b];
        let scale = (2.0 * quantile).sqrt();
        // In scaled coordinates the axes lie on the diagonals, with variances 1 ± ρ.
        let (plus, minus) = (
            ((1.0 + rho).max(0.0) / 2.0).sqrt() * scale,
            ((1.0 - rho).max(0.0) / 2.0).sqrt() * scale,
        );
        Some(Ellipse {
            pair: [a, b],
            centre: [self.values[a], self.values[b]],
            first: [plus * sa, plus * sb],
            second: [minus * sa, -minus * sb],
        })
    }
}
