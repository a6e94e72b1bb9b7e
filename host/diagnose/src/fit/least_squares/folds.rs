//! Cross-validation: squared errors on folds outside the fit.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::fit::folded::{Errors, Folded};
use crate::fit::least_squares::Fit;
use rig_numerics::vector::{axpy, dot};

/// Number of folds.
const FOLDS: usize = 10;

impl Fit<'_> {
    /// Returns squared errors without and with the columns. Each fold is predicted by a fit to the others.
    pub(crate) fn cross_validated(&self, columns: &[Vec<f64>]) -> Option<(&Errors, Errors)> {
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

    /// Returns, per joint, the cross-validated RMS over the RMS of the fit; 1 if the folds do not determine it.
    pub(crate) fn left_out_in_turn(&self) -> Vec<f64> {
        let n = self.rows.count;
        let of_joint = |j: usize| {
            let inside = dot(
                &self.residual[j * n..(j + 1) * n],
                &self.residual[j * n..(j + 1) * n],
            );
            let folded = self.folded.get_or_init(|| self.folded()).as_ref()?;
            let times = (folded.errors.of_joint[j] / inside).sqrt();
            times.is_finite().then(|| times.max(1.0))
        };
        (0..self.rows.joints())
            .map(|j| of_joint(j).unwrap_or(1.0))
            .collect()
    }

    /// Computes the part that does not depend on the candidate.
    fn folded(&self) -> Option<Folded> {
        let p = self.basis.len();
        let folds = FOLDS.min(self.blocks.max(2));
        let fold_of = |b: usize| b * folds / self.blocks.max(1);
        // Ranges of rows in one fold, so that sums use slices.
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

    /// Returns the squared errors of `columns` on each fold by a fit to the others, from inner products by folds.
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

    /// Returns the ranges of the weighted rows within one fold, with the fold.
    pub(crate) fn stretches(&self, fold_of: &dyn Fn(usize) -> usize) -> Vec<(Range<usize>, usize)> {
        let n = self.rows.count;
        let mut list: Vec<(Range<usize>, usize)> = Vec::new();
        for j in 0..self.rows.joints() {
            for (row, &b) in self.block.iter().enumerate() {
                let (at, fold) = (j * n + row, fold_of(b));
                match list.last_mut() {
                    // A range stays within a joint.
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
