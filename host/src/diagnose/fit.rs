//! Weighted least squares on the rows with columns taken in one by one, and what one more column would explain.

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::rows::{Column, Rows};

/// Blocks that evidence is counted in: long enough that the residual has forgotten, at least so many.
const FEWEST_BLOCKS: usize = 12;
/// Parts for cross-validation.
const FOLDS: usize = 10;
/// A column of which less than this share of its length is left beside the others is one of them in disguise.
const DISTINCT: f64 = 0.02;

/// Rows under weights, an orthonormal basis of the columns taken in, and what is left of the torque.
#[derive(Clone)]
pub(super) struct Fit<'a> {
    rows: &'a Rows,
    /// Per joint, one over the standard deviation of its residual.
    scale: Vec<f64>,
    /// Block of each row of a joint (shared by all joints).
    block: Vec<usize>,
    blocks: usize,
    basis: Vec<Vec<f64>>,
    residual: Vec<f64>,
    /// What every cross-validation shares, once one was asked for.
    folded: OnceLock<Option<Folded>>,
}

/// The columns taken in, fold by fold.
#[derive(Clone)]
struct Folded {
    /// Ranges of the weighted rows that lie in one fold, with it.
    stretches: Vec<(Range<usize>, usize)>,
    /// Inner products of the basis within each fold.
    own: Vec<DMatrix<f64>>,
    /// … with the residual.
    right: Vec<DVector<f64>>,
    /// Squared error of each block, and of each joint, with the basis refitted without the block's fold.
    errors: Errors,
}

/// Squared errors on folds not fitted to.
#[derive(Clone, Debug, PartialEq)]
struct Errors {
    of_block: Vec<f64>,
    of_joint: Vec<f64>,
}

/// Inner products of candidates' columns with themselves and with the residual, what was taken in taken off.
pub(super) struct Beside {
    gram: DMatrix<f64>,
    right: DVector<f64>,
}

/// What candidates' columns would do.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Evidence {
    /// Coefficients of the columns.
    pub(super) gains: Vec<f64>,
    /// Their standard deviations, robust to correlation within blocks.
    pub(super) stds: Vec<f64>,
    /// Share of the residual's squares that they take away.
    pub(super) explained: f64,
    /// Share of the RMS that they take away on folds they were not fitted to.
    pub(super) gain: f64,
    /// The same for the joint that gains most: what one joint lacks is a small share of all joints together.
    pub(super) joint_gain: f64,
    /// The gain over its standard deviation between blocks.
    pub(super) gain_sigmas: f64,
    /// Of all coefficients together being zero; not corrected for anything.
    pub(super) p_value: f64,
    /// Squared error of each block without and with them, on folds not fitted to.
    pub(super) block_errors: Vec<[f64; 2]>,
}

impl<'a> Fit<'a> {
    /// Takes the rows in; `memory` is the time in seconds that residuals are correlated over, `scale` one weight a joint.
    pub(super) fn new(rows: &'a Rows, scale: Vec<f64>, memory: f64) -> Self {
        let length = ((5.0 * memory / rows.period).ceil() as usize)
            .max(1)
            .min((rows.count / FEWEST_BLOCKS).max(1));
        let mut block = Vec::with_capacity(rows.count);
        let mut next = 0;
        for pair in rows.starts.windows(2) {
            let n = pair[1] - pair[0];
            let parts = (n / length).max(1);
            block.extend((0..n).map(|k| next + k * parts / n));
            next += if n == 0 { 0 } else { parts };
        }
        let mut fit = Self {
            rows,
            scale,
            block,
            blocks: next,
            basis: Vec::new(),
            residual: Vec::new(),
            folded: OnceLock::new(),
        };
        let torque: Column = rows.torque.iter().cloned().map(Some).collect();
        fit.residual = fit.weighted(&torque);
        fit
    }

    /// A column as the weighted rows of all joints one after the other; masked rows are zero.
    pub(super) fn weighted(&self, column: &Column) -> Vec<f64> {
        let n = self.rows.count;
        let mut out = vec![0.0; n * self.rows.joints()];
        for (j, values) in column.iter().enumerate() {
            let Some(values) = values else { continue };
            out[j * n..(j + 1) * n].copy_from_slice(&self.weighted_joint(j, values));
        }
        out
    }

    fn weighted_joint(&self, j: usize, values: &[f64]) -> Vec<f64> {
        (values.iter().zip(&self.rows.keep[j]))
            .map(|(value, keep)| if *keep { self.scale[j] * value } else { 0.0 })
            .collect()
    }

    /// What is left of a weighted column beside those taken in.
    pub(super) fn projected(&self, mut column: Vec<f64>) -> Vec<f64> {
        for _ in 0..2 {
            for b in &self.basis {
                let along = dot(b, &column);
                axpy(-along, b, &mut column);
            }
        }
        column
    }

    /// Takes a column in; false (and nothing done) where it is a combination of the others.
    pub(super) fn push(&mut self, column: &Column) -> bool {
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

    /// Takes a known torque off what is to be explained.
    pub(super) fn subtract(&mut self, column: &Column) {
        let known = self.weighted(column);
        axpy(-1.0, &known, &mut self.residual);
    }

    /// RMS of a joint's residual in its own unit, over the rows used.
    pub(super) fn rms(&self, joint: usize) -> f64 {
        let n = self.rows.count;
        let squares = dot_self(&self.residual[joint * n..(joint + 1) * n]);
        (squares / self.rows.used(joint).max(1) as f64).sqrt() / self.scale[joint]
    }

    /// Residual of a joint in its own unit; 0 on masked rows.
    pub(super) fn residual(&self, joint: usize) -> Vec<f64> {
        let n = self.rows.count;
        self.residual[joint * n..(joint + 1) * n]
            .iter()
            .map(|r| r / self.scale[joint])
            .collect()
    }

    /// The weighted residual of all joints.
    pub(super) fn left(&self) -> &[f64] {
        &self.residual
    }

    /// Number of blocks.
    pub(super) fn blocks(&self) -> usize {
        self.blocks
    }

    /// Block of each row of a joint.
    pub(super) fn block_of_rows(&self) -> &[usize] {
        &self.block
    }

    /// Columns of a candidate beside those taken in; none where one of them is no column of its own. Joints on which a column
    /// is zero take no part.
    pub(super) fn beside(&self, columns: &[Column]) -> Option<Beside> {
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
                // As `distinct` has it, by squares.
                if a == b && (left.is_nan() || left <= DISTINCT * DISTINCT * whole || whole == 0.0)
                {
                    return None;
                }
                gram[(a, b)] = left;
                gram[(b, a)] = left;
            }
        }
        let right = DVector::from_iterator(k, weighted.iter().map(|c| with(&self.residual, c)));
        Some(Beside { gram, right })
    }

    /// Share of the residual's squares that such columns explain, with their coefficients. `bounds` are those of the
    /// coefficients: outside them nothing is explained.
    pub(super) fn explained(
        &self,
        columns: &Beside,
        bounds: &[[f64; 2]],
    ) -> Option<(f64, Vec<f64>)> {
        let right = &columns.right;
        let beta = columns.gram.clone().cholesky()?.solve(right);
        let within = beta
            .iter()
            .zip(bounds)
            .all(|(b, [low, high])| b >= low && b <= high);
        if !within {
            return None;
        }
        let share = beta.dot(right) / dot_self(&self.residual);
        share
            .is_finite()
            .then(|| (share, beta.iter().copied().collect()))
    }

    /// Weighted columns of a candidate projected; none where one of them is no column of its own.
    pub(super) fn distinct(&self, columns: &[Column]) -> Option<Vec<Vec<f64>>> {
        let mut own: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
        for column in columns {
            let weighted = self.weighted(column);
            let length = dot_self(&weighted).sqrt();
            let rest = self.projected(weighted);
            let left = dot_self(&rest).sqrt();
            if left.is_nan() || left <= DISTINCT * length || length == 0.0 {
                return None;
            }
            own.push(rest);
        }
        Some(own)
    }

    /// Everything about projected columns.
    pub(super) fn evidence(&self, columns: &[Vec<f64>], bounds: &[[f64; 2]]) -> Option<Evidence> {
        let beside = Beside {
            gram: DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
                dot(&columns[a], &columns[b])
            }),
            right: DVector::from_iterator(
                columns.len(),
                columns.iter().map(|c| dot(c, &self.residual)),
            ),
        };
        let (explained, gains) = self.explained(&beside, bounds)?;
        let (k, blocks) = (columns.len(), self.blocks);
        let n = self.rows.count;
        // Scores of the blocks under the alternative: what is left after the columns.
        let mut rest = self.residual.clone();
        for (column, gain) in columns.iter().zip(&gains) {
            axpy(-gain, column, &mut rest);
        }
        let mut scores = vec![DVector::<f64>::zeros(k); blocks];
        for j in 0..self.rows.joints() {
            for (row, &b) in self.block.iter().enumerate() {
                let at = j * n + row;
                for (c, column) in columns.iter().enumerate() {
                    scores[b][c] += column[at] * rest[at];
                }
            }
        }
        let mut meat = DMatrix::<f64>::zeros(k, k);
        for s in &scores {
            meat += s * s.transpose();
        }
        let g = blocks as f64;
        meat *= g / (g - 1.0).max(1.0);
        let bread = beside.gram.cholesky()?.inverse();
        let covariance = &bread * meat * &bread;
        let stds = (0..k).map(|c| covariance[(c, c)].max(0.0).sqrt()).collect();
        let beta = DVector::from_column_slice(&gains);
        let wald = beta.dot(&covariance.cholesky()?.solve(&beta));
        let freedom = (g - k as f64).max(1.0);
        let statistic = wald / k as f64 * freedom / (g - 1.0).max(1.0);
        let p_value = FisherSnedecor::new(k as f64, freedom)
            .map(|f| f.sf(statistic.max(0.0)))
            .unwrap_or(1.0)
            .max(f64::MIN_POSITIVE);
        let (plain, more) = self.cross_validated(columns)?;
        let block_errors: Vec<[f64; 2]> = (plain.of_block.iter().zip(&more.of_block))
            .map(|(a, b)| [*a, *b])
            .collect();
        let joint_gain = (plain.of_joint.iter().zip(&more.of_joint))
            .filter(|(before, _)| **before > 0.0)
            .map(|(before, after)| 1.0 - (after / before).sqrt())
            .fold(f64::NEG_INFINITY, f64::max);
        let (before, after) = block_errors
            .iter()
            .fold((0.0, 0.0), |(a, b), e| (a + e[0], b + e[1]));
        let gain = 1.0 - (after / before).sqrt();
        let mean = (before - after) / g;
        let spread = block_errors
            .iter()
            .map(|e| (e[0] - e[1] - mean).powi(2))
            .sum::<f64>()
            / (g - 1.0).max(1.0);
        let gain_sigmas = mean / (spread / g).sqrt().max(f64::MIN_POSITIVE);
        Some(Evidence {
            gains,
            stds,
            explained,
            gain,
            joint_gain,
            gain_sigmas,
            p_value,
            block_errors,
        })
    }

    /// Squared errors without and with the columns, everything refitted without each fold.
    fn cross_validated(&self, columns: &[Vec<f64>]) -> Option<(&Errors, Errors)> {
        let folded = self.folded.get_or_init(|| self.folded()).as_ref()?;
        let (p, size) = (self.basis.len(), self.basis.len() + columns.len());
        let mut own: Vec<DMatrix<f64>> = (folded.own.iter())
            .map(|m| m.clone().resize(size, size, 0.0))
            .collect();
        let mut right: Vec<DVector<f64>> = (folded.right.iter())
            .map(|r| r.clone().resize_vertically(size, 0.0))
            .collect();
        let all: Vec<&Vec<f64>> = self.basis.iter().chain(columns).collect();
        for (range, fold) in &folded.stretches {
            for a in p..size {
                let left = &all[a][range.clone()];
                right[*fold][a] += dot(left, &self.residual[range.clone()]);
                for b in 0..=a {
                    own[*fold][(a, b)] += dot(left, &all[b][range.clone()]);
                }
            }
        }
        for matrix in &mut own {
            matrix.fill_upper_triangle_with_lower_triangle();
        }
        let more = self.errors(&all, &folded.stretches, &own, &right)?;
        Some((&folded.errors, more))
    }

    /// What does not depend on the candidate.
    fn folded(&self) -> Option<Folded> {
        let p = self.basis.len();
        let folds = FOLDS.min(self.blocks.max(2));
        let fold_of = |b: usize| b * folds / self.blocks.max(1);
        // Runs of rows of one fold, so that the sums go over slices.
        let stretches = self.stretches(&fold_of);
        let mut own = vec![DMatrix::<f64>::zeros(p, p); folds];
        let mut right = vec![DVector::<f64>::zeros(p); folds];
        for (range, fold) in &stretches {
            for a in 0..p {
                let left = &self.basis[a][range.clone()];
                right[*fold][a] += dot(left, &self.residual[range.clone()]);
                for b in 0..=a {
                    own[*fold][(a, b)] += dot(left, &self.basis[b][range.clone()]);
                }
            }
        }
        for matrix in &mut own {
            matrix.fill_upper_triangle_with_lower_triangle();
        }
        let basis: Vec<&Vec<f64>> = self.basis.iter().collect();
        let errors = self.errors(&basis, &stretches, &own, &right)?;
        Some(Folded {
            stretches,
            own,
            right,
            errors,
        })
    }

    /// Squared errors of `columns`, whose inner products by folds are given, on each fold by a fit to the others.
    fn errors(
        &self,
        columns: &[&Vec<f64>],
        stretches: &[(Range<usize>, usize)],
        own: &[DMatrix<f64>],
        right: &[DVector<f64>],
    ) -> Option<Errors> {
        let (n, size) = (self.rows.count, columns.len());
        let mut total = DMatrix::zeros(size, size);
        let mut total_right = DVector::zeros(size);
        for (matrix, right) in own.iter().zip(right) {
            total += matrix;
            total_right += right;
        }
        let mut coefficients = Vec::with_capacity(own.len());
        for (matrix, right) in own.iter().zip(right) {
            coefficients.push(if size == 0 {
                DVector::zeros(0)
            } else {
                (&total - matrix).cholesky()?.solve(&(&total_right - right))
            });
        }
        let mut errors = Errors {
            of_block: vec![0.0; self.blocks],
            of_joint: vec![0.0; self.rows.joints()],
        };
        let mut left = Vec::new();
        for (range, fold) in stretches {
            left.clear();
            left.extend_from_slice(&self.residual[range.clone()]);
            for (column, c) in columns.iter().zip(coefficients[*fold].iter()) {
                axpy(-c, &column[range.clone()], &mut left);
            }
            for (at, x) in range.clone().zip(&left) {
                errors.of_block[self.block[at % n]] += x * x;
                errors.of_joint[at / n] += x * x;
            }
        }
        Some(errors)
    }

    /// Ranges of the weighted rows that lie in one fold, with it.
    fn stretches(&self, fold_of: &dyn Fn(usize) -> usize) -> Vec<(Range<usize>, usize)> {
        let n = self.rows.count;
        let mut list: Vec<(Range<usize>, usize)> = Vec::new();
        for j in 0..self.rows.joints() {
            for (row, &b) in self.block.iter().enumerate() {
                let (at, fold) = (j * n + row, fold_of(b));
                match list.last_mut() {
                    // A stretch stays within a joint.
                    Some((range, f)) if *f == fold && range.end == at && row > 0 => {
                        range.end = at + 1;
                    }
                    _ => list.push((at..at + 1, fold)),
                }
            }
        }
        list
    }
}

impl Evidence {
    /// p-value corrected for `tried` trials (Bonferroni).
    pub(super) fn corrected(&self, tried: usize) -> f64 {
        (self.p_value * tried as f64).min(1.0)
    }

    /// By how many standard deviations of the blocks' paired differences this leaves less than the other.
    pub(super) fn ahead_of(&self, other: &Self) -> f64 {
        let differences: Vec<f64> = (self.block_errors.iter().zip(&other.block_errors))
            .map(|(a, b)| b[1] - a[1])
            .collect();
        let n = differences.len().max(2) as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let spread = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
        mean / (spread / n).sqrt().max(f64::MIN_POSITIVE)
    }
}

/// Inner product.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Eight sums at a time: the compiler does not reorder one.
    let mut sums = [0.0; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (x, y) in a8.iter().zip(b8) {
        for (s, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *s += x * y;
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum::<f64>()
}

/// Sum of squares.
pub(super) fn dot_self(a: &[f64]) -> f64 {
    dot(a, a)
}

fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}
