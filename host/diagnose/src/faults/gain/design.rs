//! The columns of a torque's model as an orthonormal basis, with sums over the rows from each possible change on.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Squared share of a unit column that must be independent of the others.
const INDEPENDENT: f64 = 1e-8;

/// A model's columns.
#[derive(Clone)]
pub(super) struct Design {
    /// Orthonormal, rows × columns.
    pub(super) basis: DMatrix<f64>,
    /// First row of each block; the torque may change there.
    starts: Vec<usize>,
    /// Inner products of the basis over the rows from each start on.
    inner: Vec<DMatrix<f64>>,
}

/// A torque under a [`Design`].
pub(super) struct Fitted<'a> {
    pub(super) design: &'a Design,
    pub(super) torque: DVector<f64>,
    /// Basis · torque over the rows from each start on.
    along: Vec<DVector<f64>>,
    pub(super) residual: DVector<f64>,
}

/// A factor of the torque from a row on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gain {
    /// First row with it.
    pub(super) row: usize,
    /// Factors that undo it in the earlier and in the later rows.
    pub(super) undo: [f64; 2],
    /// Squares that remain.
    pub(super) squares: f64,
}

impl Gain {
    /// Returns the factor of the later torque over the earlier one.
    pub(super) fn factor(&self) -> f64 {
        self.undo[0] / self.undo[1]
    }

    /// Returns the torque without it.
    pub(super) fn undone(&self, torque: &DVector<f64>) -> DVector<f64> {
        let own = |(k, y): (usize, &f64)| y * self.undo[usize::from(k >= self.row)];
        DVector::from_iterator(torque.len(), torque.iter().enumerate().map(own))
    }
}

impl Design {
    /// Sums over blocks that begin at `starts`, the first at 0.
    pub(super) fn new(basis: DMatrix<f64>, starts: Vec<usize>) -> Self {
        let p = basis.ncols();
        let mut sum = DMatrix::zeros(p, p);
        let mut inner = Vec::with_capacity(starts.len());
        let mut end = basis.nrows();
        for start in starts.iter().rev() {
            let own = basis.rows(*start, end - start);
            sum.gemm_tr(1.0, &own, &own, 1.0);
            inner.push(sum.clone());
            end = *start;
        }
        inner.reverse();
        Self {
            basis,
            starts,
            inner,
        }
    }

    /// Returns the design with the independent directions of further columns.
    pub(super) fn with(&self, columns: &DMatrix<f64>) -> Self {
        let rest = self.beside(columns);
        let norms = rest.column_iter().map(|c| c.norm_squared());
        let eigen = SymmetricEigen::new(rest.tr_mul(&rest));
        let least = INDEPENDENT * norms.fold(f64::MIN_POSITIVE, f64::max);
        let mut basis = self.basis.clone();
        for (value, vector) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *value > least {
                let at = basis.ncols();
                basis = basis.insert_column(at, 0.0);
                // Once more against the basis, as the rest of a near dependent column is rounding.
                let own = self.beside(&DMatrix::from_columns(&[&rest * vector]));
                basis.set_column(at, &own.column(0).normalize());
            }
        }
        Self::new(basis, self.starts.clone())
    }

    /// Returns what the basis leaves of columns.
    pub(super) fn beside(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        columns - &self.basis * self.basis.tr_mul(columns)
    }

    /// Fits a torque.
    pub(super) fn fitted(&self, torque: DVector<f64>) -> Fitted<'_> {
        let mut sum = DVector::zeros(self.basis.ncols());
        let mut along = Vec::with_capacity(self.starts.len());
        let mut end = torque.len();
        for start in self.starts.iter().rev() {
            let count = end - start;
            sum += self
                .basis
                .rows(*start, count)
                .tr_mul(&torque.rows(*start, count));
            along.push(sum.clone());
            end = *start;
        }
        along.reverse();
        let residual = &torque - &self.basis * &along[0];
        Fitted {
            design: self,
            torque,
            along,
            residual,
        }
    }
}

/// Returns the squares that columns take off a residual, by their inner products beside the basis and with the residual,
/// and their number of independent directions.
fn taken(inner: DMatrix<f64>, score: &DVector<f64>) -> (f64, usize) {
    let eigen = SymmetricEigen::new(inner);
    let pairs = eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter());
    pairs
        .filter(|(value, _)| **value > INDEPENDENT)
        .map(|(value, vector)| vector.dot(score).powi(2) / value)
        .fold((0.0, 0), |(sum, rank), own| (sum + own, rank + 1))
}

impl Fitted<'_> {
    /// Returns the squares of the residual.
    pub(super) fn squares(&self) -> f64 {
        self.residual.norm_squared()
    }

    /// Returns the rows before which something may change: at least a share of the rows lies on either side.
    pub(super) fn changes(&self, share: f64) -> impl Iterator<Item = usize> + '_ {
        let edge = (share * self.torque.len() as f64) as usize;
        let last = self.torque.len() - edge;
        let starts = &self.design.starts;
        (0..starts.len()).filter(move |k| (edge..=last).contains(&starts[*k]))
    }

    /// Returns the first row of block `k`.
    pub(super) fn start(&self, k: usize) -> usize {
        self.design.starts[k]
    }

    /// Returns the squares that `columns`, of norm one, take off if they act from block `k` on, and their directions.
    pub(super) fn taken_from(&self, k: usize, along: &DMatrix<f64>) -> (f64, usize) {
        let own = &self.design.inner[k] * along;
        let inner = along.tr_mul(&own) - own.tr_mul(&own);
        let score = along.tr_mul(&self.along[k]) - own.tr_mul(&self.along[0]);
        taken(inner, &score)
    }

    /// Returns the squares that `columns` take off, and their directions.
    pub(super) fn taken_by(&self, columns: &DMatrix<f64>) -> (f64, usize) {
        let rest = self.design.beside(columns);
        taken(rest.tr_mul(&rest), &rest.tr_mul(&self.residual))
    }

    /// Returns the best factor of the torque from each possible row on, the best first.
    ///
    /// With the earlier torque t₁ and the later t₂, each zero in the other's rows, and the projection P beside the
    /// basis, |P(a·t₁ + b·t₂)|² is least along an eigenvector of the 2 × 2 matrix of their products. The norm
    /// a²·e₁ + b²·e₂ = e₁ + e₂, e₁ and e₂ the squares of the errors in both parts, keeps the size of the errors, so
    /// that no factor wins by making the part with larger errors small. It treats both parts alike.
    pub(super) fn gain(&self, share: f64, errors: &DVector<f64>) -> Option<Gain> {
        self.changes(share)
            .filter_map(|k| self.gain_at(self.start(k), &self.along[k], errors))
            .min_by(|a, b| a.squares.total_cmp(&b.squares))
    }

    /// Returns the rows around that of `gain` with the squares that the best factor from there on leaves.
    pub(super) fn around(&self, gain: &Gain, errors: &DVector<f64>) -> Vec<Gain> {
        let starts = &self.design.starts;
        let at = starts.partition_point(|s| *s < gain.row);
        let [from, to] = [at.saturating_sub(2), (at + 2).min(starts.len() - 1)];
        let mut along = self.along[to].clone();
        let mut all = Vec::new();
        for row in (starts[from].max(1)..starts[to]).rev() {
            along += self.design.basis.row(row).transpose() * self.torque[row];
            all.extend(self.gain_at(row, &along, errors));
        }
        all.reverse();
        all
    }

    fn gain_at(&self, row: usize, later: &DVector<f64>, errors: &DVector<f64>) -> Option<Gain> {
        let earlier = &self.along[0] - later;
        let square = |of: &DVector<f64>| {
            let first = of.rows(0, row).norm_squared();
            [first, of.norm_squared() - first]
        };
        let [c1, c2] = square(&self.torque);
        let [e1, e2] = square(errors);
        let [s1, s2] = [e1, e2].map(|e| ((e1 + e2) / e).sqrt());
        if !(s1.is_finite() && s2.is_finite()) {
            return None;
        }
        let cross = -earlier.dot(later) * s1 * s2;
        let m1 = (c1 - earlier.norm_squared()) * s1 * s1;
        let m2 = (c2 - later.norm_squared()) * s2 * s2;
        let eigen = SymmetricEigen::new(nalgebra::Matrix2::new(m1, cross, cross, m2));
        let least = eigen.eigenvalues.imin();
        let vector = eigen.eigenvectors.column(least);
        let undo = [vector[0] * s1, vector[1] * s2];
        let undo = undo.map(|u| u * undo[0].signum());
        Some(Gain {
            row,
            undo,
            squares: eigen.eigenvalues[least],
        })
    }
}
