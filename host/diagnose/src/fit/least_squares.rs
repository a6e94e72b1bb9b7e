//! Weighted least squares on the rows: columns are added one by one, and candidates are tested beside them.

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use crate::fit::folded::Folded;
use crate::rows::regression::{Column, Rows};
use rig_numerics::optimise::non_negative::nnls;
use rig_numerics::statistics::bins;
use rig_numerics::vector::{axpy, dot, norm_squared};

mod evidence;
mod folds;
mod jackknife;

/// Length of an evidence block, in correlation times of the residual …
const MEMORIES: f64 = 5.0;
/// … and fewest blocks.
const FEWEST_BLOCKS: usize = 12;
/// Least length of a cluster, s. Model mismatch follows the motion, on time scales of seconds, even if the noise is
/// correlated over a shorter time.
const LEAST_CLUSTER: f64 = 1.0;
/// Strata of a coordinate: few, so that a law's mismatch has one sign in each.
const STRATA: usize = 12;
/// Share of a column's length orthogonal to the others below which it is collinear.
const DISTINCT: f64 = 0.02;
/// Rounds of least squares with non-negative coefficients: a law has a few, and a model some of them.
pub(crate) const ROUNDS: usize = 100;
/// Bounds of a coefficient that cannot be negative.
pub(crate) const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];

/// Weighted rows, an orthonormal basis of the columns, and the torque residual.
#[derive(Clone)]
pub(crate) struct Fit<'a> {
    rows: &'a Rows,
    /// Weight of each joint: one over the standard deviation of its residual.
    scale: Vec<f64>,
    /// Weight of each row of a joint, up to 1; None if all rows have the same weight.
    counts: Vec<Option<Arc<Vec<f64>>>>,
    /// Block of each row of a joint (shared by all joints).
    block: Vec<usize>,
    blocks: usize,
    basis: Vec<Vec<f64>>,
    residual: Vec<f64>,
    /// Data shared by all cross-validations, computed on first use.
    folded: OnceLock<Option<Folded>>,
}

/// Inner products of candidate columns with each other and with the residual, orthogonal to the basis.
pub(crate) struct Beside {
    gram: DMatrix<f64>,
    right: DVector<f64>,
}

impl Beside {
    /// Returns the coefficients within their bounds. Those that cannot be negative are estimated so: some elements of a
    /// contact may have no share in it, and the law stands without them. Other bounds are not imposed: None if a
    /// coefficient leaves them, or if all are zero.
    fn solved(&self, bounds: &[[f64; 2]]) -> Option<DVector<f64>> {
        let is_within = |(b, [low, high]): (&f64, &[f64; 2])| b >= low && b <= high;
        let free = self.gram.clone().cholesky()?.solve(&self.right);
        if free.iter().zip(bounds).all(is_within) {
            return Some(free);
        }
        let bounded: Vec<bool> = (bounds.iter())
            .map(|bounds| *bounds == NOT_NEGATIVE)
            .collect();
        let mut inside = vec![true; bounded.len()];
        let beta = nnls(&self.gram, &self.right, &bounded, &mut inside, ROUNDS)?;
        let is_none = beta.iter().all(|b| *b == 0.0);
        (!is_none && beta.iter().zip(bounds).all(is_within)).then_some(beta)
    }
}

impl<'a> Fit<'a> {
    /// Creates a fit without columns. `memory` is the residuals' correlation time, s; `scale` the weight per joint.
    pub(crate) fn new(rows: &'a Rows, scale: Vec<f64>, memory: f64) -> Self {
        let (block, blocks) = blocked(rows, memory);
        let mut fit = Self {
            rows,
            counts: vec![None; scale.len()],
            scale,
            block,
            blocks,
            basis: Vec::new(),
            residual: Vec::new(),
            folded: OnceLock::new(),
        };
        fit.begin();
        fit
    }

    fn begin(&mut self) {
        let torque: Column = self.rows.torque.iter().cloned().map(Some).collect();
        self.residual = self.weighted(&torque);
        self.basis.clear();
        self.folded = OnceLock::new();
    }

    /// Returns a fit without columns, with these row weights (none is 0).
    pub(crate) fn counting(&self, counts: Vec<Option<Arc<Vec<f64>>>>) -> Self {
        let mut fit = Self {
            counts,
            ..self.clone()
        };
        fit.begin();
        fit
    }

    /// Adds columns.
    pub(crate) fn taking<'c>(mut self, columns: impl IntoIterator<Item = &'c Column>) -> Self {
        for column in columns {
            self.push(column);
        }
        self
    }

    /// Returns the fit with blocks for another correlation time of the residual, s.
    pub(crate) fn blocked_anew(&self, memory: f64) -> Self {
        let (block, blocks) = blocked(self.rows, memory);
        Self {
            block,
            blocks,
            folded: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Returns the fit with blocks for a final residual, correlated over `memory` s. Equal times of repeated runs
    /// (`pairs`) share a block, because their model mismatch is the same.
    pub(crate) fn clustered(&self, memory: f64, pairs: &[(usize, usize)]) -> Self {
        let starts = &self.rows.starts;
        let length = |run: usize| starts[run + 1] - starts[run];
        let again = |run: &usize| pairs.iter().any(|(_, second)| second == run);
        let distinct = (0..starts.len().saturating_sub(1)).filter(|run| !again(run));
        let (mut block, blocks) = in_blocks(
            self.rows,
            memory.max(LEAST_CLUSTER / MEMORIES),
            distinct.map(length).sum(),
        );
        for &(first, second) in pairs {
            for k in 0..length(second) {
                let like = k.min(length(first).saturating_sub(1));
                block[starts[second] + k] = block[starts[first] + like];
            }
        }
        // Renumber the blocks, as those of the repeats are unused.
        let mut number = vec![None; blocks];
        let mut next = 0;
        for b in &mut block {
            *b = *number[*b].get_or_insert_with(|| {
                next += 1;
                next - 1
            });
        }
        Self {
            block,
            blocks: next,
            folded: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Returns the fit with strata as blocks: rows that are near in a coordinate instead of in time. `values` has one
    /// value per row; each stratum has as many rows.
    pub(crate) fn stratified(&self, values: &[f64]) -> Self {
        let (place, _) = bins(values, &vec![true; values.len()], STRATA);
        Self {
            block: place.into_iter().flatten().collect(),
            blocks: STRATA,
            folded: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Returns a column as the weighted rows of all joints, one joint after the other. Masked rows are zero.
    pub(crate) fn weighted(&self, column: &Column) -> Vec<f64> {
        let n = self.rows.count;
        let mut out = vec![0.0; n * self.rows.joints()];
        for (j, values) in column.iter().enumerate() {
            let Some(values) = values else { continue };
            out[j * n..(j + 1) * n].copy_from_slice(&self.weighted_joint(j, values));
        }
        out
    }

    fn weighted_joint(&self, j: usize, values: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = (values.iter().zip(&self.rows.keep[j]))
            .map(|(value, keep)| if *keep { self.scale[j] * value } else { 0.0 })
            .collect();
        if let Some(counts) = &self.counts[j] {
            for (x, count) in out.iter_mut().zip(counts.iter()) {
                *x *= count;
            }
        }
        out
    }

    /// Returns the part of a weighted column that is orthogonal to the basis.
    pub(crate) fn projected(&self, mut column: Vec<f64>) -> Vec<f64> {
        for _ in 0..2 {
            for b in &self.basis {
                let along = dot(b, &column);
                axpy(-along, b, &mut column);
            }
        }
        column
    }

    /// Adds a column. Returns false, without a change, if it is a combination of the others.
    pub(crate) fn push(&mut self, column: &Column) -> bool {
        let weighted = self.weighted(column);
        let length = dot(&weighted, &weighted).sqrt();
        let mut rest = self.projected(weighted);
        let left = dot(&rest, &rest).sqrt();
        if left.is_nan() || left <= 1e-9 * length {
            return false;
        }
        for x in &mut rest {
            *x /= left;
        }
        let along = dot(&rest, &self.residual);
        axpy(-along, &rest, &mut self.residual);
        self.basis.push(rest);
        self.folded = OnceLock::new();
        true
    }

    /// Subtracts a known torque.
    pub(crate) fn subtract(&mut self, column: &Column) {
        let known = self.projected(self.weighted(column));
        axpy(-1.0, &known, &mut self.residual);
        self.folded = OnceLock::new();
    }

    /// Returns the weighted RMS of a joint's residual over the used rows, in its own unit.
    pub(crate) fn rms(&self, joint: usize) -> f64 {
        let n = self.rows.count;
        let squares = norm_squared(&self.residual[joint * n..(joint + 1) * n]);
        let used = match &self.counts[joint] {
            None => self.rows.used(joint) as f64,
            Some(counts) => (counts.iter().zip(&self.rows.keep[joint]))
                .filter(|(_, keep)| **keep)
                .map(|(count, _)| count * count)
                .sum(),
        };
        (squares / used.max(f64::MIN_POSITIVE)).sqrt() / self.scale[joint]
    }

    /// Returns the RMS of a joint's residual over the used rows without row weights, in its own unit.
    pub(crate) fn even_rms(&self, joint: usize) -> f64 {
        let squares = norm_squared(&self.residual(joint));
        (squares / self.rows.used(joint).max(1) as f64).sqrt()
    }

    /// Returns the residual of a joint in its own unit; 0 on masked rows.
    pub(crate) fn residual(&self, joint: usize) -> Vec<f64> {
        let n = self.rows.count;
        let mut own: Vec<f64> = self.residual[joint * n..(joint + 1) * n]
            .iter()
            .map(|r| r / self.scale[joint])
            .collect();
        if let Some(counts) = &self.counts[joint] {
            for (r, count) in own.iter_mut().zip(counts.iter()) {
                *r /= count;
            }
        }
        own
    }

    /// Returns the residual with row weights, scaled to the RMS of [`Fit::rms`] over all used rows.
    pub(crate) fn counted(&self, joint: usize) -> Vec<f64> {
        if self.counts[joint].is_none() {
            return self.residual(joint);
        }
        let n = self.rows.count;
        let own = &self.residual[joint * n..(joint + 1) * n];
        let now = (norm_squared(own) / self.rows.used(joint).max(1) as f64).sqrt();
        let by = self.rms(joint) / now.max(f64::MIN_POSITIVE);
        own.iter().map(|r| by * r).collect()
    }

    /// Returns the row weights of a joint; None if all are equal.
    pub(crate) fn counts(&self, joint: usize) -> Option<&[f64]> {
        self.counts[joint].as_deref().map(Vec::as_slice)
    }

    /// Returns the weighted residual of all joints.
    pub(crate) fn left(&self) -> &[f64] {
        &self.residual
    }

    /// Returns the rows.
    pub(crate) fn rows(&self) -> &'a Rows {
        self.rows
    }

    /// Returns the number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        self.blocks
    }

    /// Returns the block of each row of a joint.
    pub(crate) fn block_of_rows(&self) -> &[usize] {
        &self.block
    }

    /// Projects a candidate's columns; None if one of them is collinear with the basis. Joints on which a column is
    /// zero are skipped.
    pub(crate) fn beside(&self, columns: &[Column]) -> Option<Beside> {
        let n = self.rows.count;
        let k = columns.len();
        let weighted: Vec<Vec<(usize, Vec<f64>)>> = (columns.iter())
            .map(|column| {
                (column.iter().enumerate())
                    .filter_map(|(j, values)| Some((j, self.weighted_joint(j, values.as_ref()?))))
                    .collect()
            })
            .collect();
        let with = |rows: &[f64], column: &[(usize, Vec<f64>)]| -> f64 {
            (column.iter())
                .map(|(j, own)| dot(&rows[j * n..(j + 1) * n], own))
                .sum()
        };
        let along: Vec<DVector<f64>> = (weighted.iter())
            .map(|column| {
                DVector::from_iterator(self.basis.len(), self.basis.iter().map(|b| with(b, column)))
            })
            .collect();
        let mut gram = DMatrix::zeros(k, k);
        for a in 0..k {
            for b in 0..=a {
                let whole: f64 = (weighted[a].iter())
                    .flat_map(|(i, x)| weighted[b].iter().map(move |(j, y)| (i == j, x, y)))
                    .filter(|(same, ..)| *same)
                    .map(|(_, x, y)| dot(x, y))
                    .sum();
                let left = whole - along[a].dot(&along[b]);
                if a == b && !is_own(left, whole) {
                    return None;
                }
                gram[(a, b)] = left;
                gram[(b, a)] = left;
            }
        }
        let right = DVector::from_iterator(k, weighted.iter().map(|c| with(&self.residual, c)));
        Some(Beside { gram, right })
    }

    /// Returns the share of the residual's squares that such columns explain, with their coefficients. None if a
    /// coefficient cannot be within its `bounds`, or if all are zero.
    pub(crate) fn explained(
        &self,
        columns: &Beside,
        bounds: &[[f64; 2]],
    ) -> Option<(f64, Vec<f64>)> {
        let beta = columns.solved(bounds)?;
        let share = beta.dot(&columns.right) / norm_squared(&self.residual);
        share
            .is_finite()
            .then(|| (share, beta.iter().copied().collect()))
    }

    /// Returns the weighted inner product of two columns.
    pub(crate) fn product(&self, a: &Column, b: &Column) -> f64 {
        dot(&self.weighted(a), &self.weighted(b))
    }

    /// Returns a candidate's weighted, projected columns; None if one of them is collinear with the basis.
    pub(crate) fn distinct(&self, columns: &[Column]) -> Option<Vec<Vec<f64>>> {
        let mut own: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
        for column in columns {
            let weighted = self.weighted(column);
            let whole = norm_squared(&weighted);
            let rest = self.projected(weighted);
            if !is_own(norm_squared(&rest), whole) {
                return None;
            }
            own.push(rest);
        }
        Some(own)
    }

    /// Returns an orthonormal basis of the columns' parts beside the fit's basis, weighted.
    pub(crate) fn span(&self, columns: &[Column]) -> Vec<Vec<f64>> {
        let mut own: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
        for column in columns {
            let weighted = self.weighted(column);
            let whole = norm_squared(&weighted);
            let mut rest = self.projected(weighted);
            for _ in 0..2 {
                for other in &own {
                    let along = dot(other, &rest);
                    axpy(-along, other, &mut rest);
                }
            }
            let left = norm_squared(&rest);
            if is_own(left, whole) {
                rest.iter_mut().for_each(|x| *x /= left.sqrt());
                own.push(rest);
            }
        }
        own
    }

    /// Returns the covariance of the coefficients of weighted columns from block scores (Liang and Zeger 1986,
    /// Biometrika 73). `inverse` belongs to the columns' inner products; `rest` is their residual.
    pub(crate) fn sandwich(
        &self,
        columns: &[impl AsRef<[f64]>],
        inverse: &DMatrix<f64>,
        rest: &[f64],
    ) -> DMatrix<f64> {
        self.clustered_covariance(columns, inverse, rest, false)
    }

    /// Returns the covariance and its number of clusters. The scores of G blocks have rank G at most. For as many columns
    /// as blocks or more, as in a short recording of an arm, each joint's rows of a block are a cluster of their own.
    fn robust_covariance(
        &self,
        columns: &[Vec<f64>],
        inverse: &DMatrix<f64>,
        rest: &[f64],
    ) -> (DMatrix<f64>, usize) {
        let by_joint = columns.len() >= self.blocks;
        let clusters = match by_joint {
            true => self.blocks * self.rows.joints(),
            false => self.blocks,
        };
        let covariance = self.clustered_covariance(columns, inverse, rest, by_joint);
        (covariance, clusters)
    }

    /// Returns the covariance from the scores of blocks, or from those of the joints in each block.
    fn clustered_covariance(
        &self,
        columns: &[impl AsRef<[f64]>],
        inverse: &DMatrix<f64>,
        rest: &[f64],
        by_joint: bool,
    ) -> DMatrix<f64> {
        let n = self.rows.count.max(1);
        let clusters = match by_joint {
            true => self.blocks * self.rows.joints(),
            false => self.blocks,
        };
        let mut scores = DMatrix::<f64>::zeros(columns.len(), clusters);
        for (c, column) in columns.iter().enumerate() {
            let products = column.as_ref().iter().zip(rest).map(|(x, r)| x * r);
            for (row, (product, b)) in products.zip(self.block.iter().cycle()).enumerate() {
                let first = if by_joint { row / n * self.blocks } else { 0 };
                scores[(c, first + *b)] += product;
            }
        }
        let g = clusters as f64;
        let meat = &scores * scores.transpose() * (g / (g - 1.0).max(1.0));
        inverse * meat * inverse
    }
}

/// Returns the block of each row of a joint and their number, for residuals correlated over `memory` seconds.
fn blocked(rows: &Rows, memory: f64) -> (Vec<usize>, usize) {
    in_blocks(rows, memory, rows.count)
}

/// The same, with the fewest blocks in `distinct` rows.
fn in_blocks(rows: &Rows, memory: f64, distinct: usize) -> (Vec<usize>, usize) {
    let length = ((MEMORIES * memory / rows.period).ceil() as usize)
        .max(1)
        .min((distinct / FEWEST_BLOCKS).max(1));
    let mut block = Vec::with_capacity(rows.count);
    let mut next = 0;
    for pair in rows.starts.windows(2) {
        let n = pair[1] - pair[0];
        let parts = (n / length).max(1);
        block.extend((0..n).map(|k| next + k * parts / n));
        next += if n == 0 { 0 } else { parts };
    }
    (block, next)
}

/// Returns true if a column is not collinear, from its squares beside the others and in all.
fn is_own(left: f64, whole: f64) -> bool {
    whole > 0.0 && left > DISTINCT * DISTINCT * whole
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_share_that_cannot_be_negative_is_zero_and_the_others_stand() {
        let least = [0.0, f64::INFINITY];
        // Two elements of a contact that are alike; the free fit gives 2.9 and -1.2.
        let alike = Beside {
            gram: DMatrix::from_row_slice(2, 2, &[1.0, 0.8, 0.8, 1.0]),
            right: DVector::from_column_slice(&[1.94, 1.12]),
        };
        let [free, held] = [[f64::NEG_INFINITY, f64::INFINITY], least]
            .map(|second| alike.solved(&[least, second]).unwrap());
        assert!(
            (free[0] - 2.9).abs() < 1e-9 && (free[1] + 1.2).abs() < 1e-9,
            "{free}"
        );
        assert_eq!([held[0], held[1]], [1.94, 0.0]);
        // A law whose only share is zero is none, and other bounds refuse.
        let one = |right: f64| Beside {
            gram: DMatrix::from_element(1, 1, 1.0),
            right: DVector::from_element(1, right),
        };
        assert!(one(-0.1).solved(&[least]).is_none());
        assert!(one(0.1).solved(&[[0.3, 3.0]]).is_none());
        assert!(one(0.5).solved(&[[0.3, 3.0]]).is_some());
    }
}
