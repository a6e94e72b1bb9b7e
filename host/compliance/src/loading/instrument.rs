//! Linear regression with instruments, for regressors with noise.
//!
//! Least squares with a noisy regressor underestimates its coefficient. The means of the neighbouring windows are
//! instruments: they share the load but not the noise, if the noise of a window does not reach the next (Söderström &
//! Stoica 1989). Covariance with correlated residuals: Newey & West 1987.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

/// Singular value over the largest below which a direction is not determined. Columns have unit length.
const SINGULAR: f64 = 1e-7;
/// Squared component along such directions from which on a coefficient is not determined.
const HIDDEN: f64 = 1e-5;

/// A regression y = X·β + e with instruments Z, rows in order of time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regression {
    x: Vec<Vec<f64>>,
    z: Vec<Vec<f64>>,
    y: Vec<f64>,
    /// Group of each row: it has an offset of its own.
    group: Vec<usize>,
    /// Recording and window of each row. The readings of one window share the noise of its load.
    time: Vec<[usize; 2]>,
}

/// An estimate.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// True for a coefficient that the rows do not determine.
    pub hidden: Vec<bool>,
}

impl Estimate {
    /// Standard deviation of a coefficient.
    pub(crate) fn std(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }
}

impl Regression {
    /// Adds a row. `time`: recording and window.
    pub(crate) fn push(
        &mut self,
        x: Vec<f64>,
        z: Vec<f64>,
        y: f64,
        group: usize,
        time: [usize; 2],
    ) {
        self.x.push(x);
        self.z.push(z);
        self.y.push(y);
        self.group.push(group);
        self.time.push(time);
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.y.len()
    }

    /// What an estimate leaves of each row.
    pub(crate) fn residuals(&self, found: &Estimate) -> Vec<f64> {
        let predicted =
            |x: &[f64]| -> f64 { x.iter().zip(found.values.iter()).map(|(a, b)| a * b).sum() };
        (self.x.iter().zip(&self.y))
            .map(|(x, y)| y - predicted(x))
            .collect()
    }

    /// Root mean square of what an estimate leaves.
    pub(crate) fn residual(&self, found: &Estimate) -> f64 {
        rig_numerics::statistics::rms(&self.residuals(found))
    }

    /// Successive rows of each group.
    pub(crate) fn neighbours(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (1..self.len())
            .filter(|r| self.group[*r] == self.group[r - 1])
            .map(|r| (r - 1, r))
    }

    /// Root mean square of the readings about the mean of their group.
    pub(crate) fn signal(&self) -> f64 {
        let mut groups: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (group, y) in self.group.iter().zip(&self.y) {
            groups.entry(*group).or_default().push(*y);
        }
        let about = |list: &Vec<f64>| {
            rig_numerics::statistics::squares_about(list, rig_numerics::statistics::mean(list))
        };
        (groups.values().map(about).sum::<f64>() / self.len().max(1) as f64).sqrt()
    }

    /// Returns the matrix of the columns and the readings; `None` without rows.
    pub(crate) fn matrices(&self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let count = self.x.first()?.len();
        Some((
            DMatrix::from_fn(self.len(), count, |r, c| self.x[r][c]),
            DVector::from_column_slice(&self.y),
        ))
    }

    /// Change of each coefficient by a residual of RMS 1 that runs along what its column has apart from the others.
    pub(crate) fn along(&self) -> Vec<f64> {
        let Some((mut x, _)) = self.matrices() else {
            return Vec::new();
        };
        let scale: Vec<f64> = (x.column_iter_mut())
            .map(|mut column| {
                let length = Some(column.norm()).filter(|n| *n > 0.0).unwrap_or(1.0);
                column /= length;
                length
            })
            .collect();
        let rows = self.len() as f64;
        match pseudo_inverse(&x.tr_mul(&x)) {
            Some((inverse, _)) => (scale.iter().enumerate())
                .map(|(k, s)| (rows * inverse[(k, k)].max(0.0)).sqrt() / s)
                .collect(),
            None => vec![0.0; scale.len()],
        }
    }

    /// Returns what column `k` and its instrument have apart from the other columns and their instruments.
    pub(crate) fn apart(&self, k: usize) -> [DVector<f64>; 2] {
        [&self.x, &self.z].map(|list| {
            let count = list.first().map_or(0, Vec::len);
            let mut all = DMatrix::from_fn(list.len(), count, |r, c| list[r][c]);
            for mut column in all.column_iter_mut() {
                let length = column.norm();
                if length > 0.0 {
                    column /= length;
                }
            }
            let own: DVector<f64> = all.column(k).into_owned();
            let others = all.remove_column(k);
            match pseudo_inverse(&others.tr_mul(&others)) {
                Some((inverse, _)) => &own - &others * (inverse * others.tr_mul(&own)),
                None => own,
            }
        })
    }

    /// Returns the estimate; `None` for too few rows or values that are not finite.
    pub(crate) fn solve(&self) -> Option<Estimate> {
        let (rows, count) = (self.len(), self.x.first()?.len());
        if rows <= count {
            return None;
        }
        let x = DMatrix::from_fn(rows, count, |r, c| self.x[r][c]);
        let z = DMatrix::from_fn(rows, count, |r, c| self.z[r][c]);
        let y = DVector::from_column_slice(&self.y);
        // Columns of unit length: offsets, torques and signs have different units.
        let scale: Vec<f64> = (x.column_iter())
            .map(|column| Some(column.norm()).filter(|n| *n > 0.0).unwrap_or(1.0))
            .collect();
        let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(rows, count, |r, c| m[(r, c)] / scale[c]);
        let (x, z) = (scaled(&x), scaled(&z));
        let (inverse, hidden) = pseudo_inverse(&z.tr_mul(&x))?;
        let found = &inverse * z.tr_mul(&y);
        let residuals = &y - &x * &found;
        let meat = self.meat(&z, &residuals);
        let freedom = rows as f64 / (rows - count) as f64;
        let covariance = &inverse * meat * inverse.transpose() * freedom;
        Some(Estimate {
            values: DVector::from_fn(count, |k, _| found[k] / scale[k]),
            covariance: DMatrix::from_fn(count, count, |a, b| {
                covariance[(a, b)] / (scale[a] * scale[b])
            }),
            hidden,
        })
    }

    /// Sum of z·e·eᵀ·zᵀ over neighbouring windows of a recording, with falling weights. The readings of one window count together:
    /// the noise of the force moves all axes of the tool point alike.
    fn meat(&self, z: &DMatrix<f64>, residuals: &DVector<f64>) -> DMatrix<f64> {
        let count = z.ncols();
        let mut windows: BTreeMap<[usize; 2], DVector<f64>> = BTreeMap::new();
        for (r, time) in self.time.iter().enumerate() {
            let own = (windows.entry(*time)).or_insert_with(|| DVector::zeros(count));
            *own += z.row(r).transpose() * residuals[r];
        }
        let scores: Vec<([usize; 2], DVector<f64>)> = windows.into_iter().collect();
        // Newey & West 1994: the lag grows with the fourth root of the rows and more.
        let lags = ((scores.len() as f64).powf(1.0 / 3.0) as usize).max(1);
        let mut meat = DMatrix::zeros(count, count);
        for (k, (time, own)) in scores.iter().enumerate() {
            meat += own * own.transpose();
            for lag in 1..=lags.min(k) {
                let (before, other) = &scores[k - lag];
                if before[0] == time[0] {
                    let cross = own * other.transpose();
                    let weight = 1.0 - lag as f64 / (lags + 1) as f64;
                    meat += weight * (&cross + cross.transpose());
                }
            }
        }
        meat
    }
}

/// Returns the pseudo-inverse, and for each column whether it is not determined.
fn pseudo_inverse(cross: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<bool>)> {
    if !cross.iter().all(|v| v.is_finite()) {
        return None;
    }
    let count = cross.ncols();
    let svd = Svd::of(cross.clone());
    let most = svd.singular_values.max();
    let mut inverse = DMatrix::zeros(count, count);
    let mut lost = vec![0.0; count];
    for (k, value) in svd.singular_values.iter().enumerate() {
        let right = svd.v_t.row(k).transpose();
        if *value > SINGULAR * most {
            inverse += &right * svd.u.column(k).transpose() / *value;
        } else {
            for (sum, v) in lost.iter_mut().zip(right.iter()) {
                *sum += v * v;
            }
        }
    }
    Some((inverse, lost.iter().map(|l| *l > HIDDEN).collect()))
}
