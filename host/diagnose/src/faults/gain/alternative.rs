//! What else may change within a recording: a load, friction, or either slowly.

use nalgebra::{DMatrix, DVector};

use super::design::{Design, Fitted};
use crate::faults::rows::Form;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::MOTOR_COLUMNS;

/// Time constants of slow changes, shares of the recording; the first is a straight line in effect.
const SLOW: [f64; 4] = [10.0, 0.5, 0.2, 0.08];

/// Columns that something else changes.
pub(super) struct Alternative {
    /// Columns of norm one.
    columns: DMatrix<f64>,
    /// True if they may change at once.
    at_once: bool,
    /// True if they may change slowly.
    slowly: bool,
}

/// A fitted alternative.
pub(super) struct Change {
    /// Squares that remain.
    pub(super) squares: f64,
    /// Number of its unknowns.
    pub(super) unknowns: usize,
    /// Its columns.
    pub(super) columns: DMatrix<f64>,
}

impl Alternative {
    fn of(columns: DMatrix<f64>, at_once: bool, slowly: bool) -> Option<Self> {
        let columns: Vec<DVector<f64>> = (columns.column_iter())
            .filter(|c| c.norm() > 0.0)
            .map(|c| c.normalize())
            .collect();
        (!columns.is_empty()).then(|| Self {
            columns: DMatrix::from_columns(&columns),
            at_once,
            slowly,
        })
    }

    /// Returns the alternatives at joint `j`, by the regressor of its torque and the fitted parameters of `kept` columns.
    ///
    /// A load on any link from the joint on, as a mass at a place or with any inertia; friction, one by one or by one
    /// factor; the gain itself, slowly.
    pub(super) fn all(
        (form, j): (&Form, usize),
        matrix: &DMatrix<f64>,
        (kept, values): (&[usize], &DVector<f64>),
    ) -> Vec<Self> {
        let n = form.joints();
        let mut friction: Vec<usize> = [column::VISCOUS, column::COULOMB, column::OFFSET]
            .map(|c| j * COLUMNS + c)
            .into();
        let motors = n * COLUMNS + j * MOTOR_COLUMNS;
        friction.extend((motors..motors + MOTOR_COLUMNS).filter(|c| *c < matrix.ncols()));
        let share = |own: &dyn Fn(usize) -> bool| {
            let mut torque = DVector::zeros(matrix.nrows());
            for (c, value) in kept.iter().zip(values.iter()).filter(|(c, _)| own(**c)) {
                torque.axpy(*value, &matrix.column(*c), 1.0);
            }
            DMatrix::from_columns(&[torque])
        };
        let mut all = vec![
            Self::of(matrix.select_columns(&friction), true, true),
            Self::of(share(&|c| friction.contains(&c)), true, true),
            Self::of(share(&|_| true), false, true),
        ];
        for link in j..n {
            for last in [column::INERTIA, column::DRIVE_INERTIA] {
                let own: Vec<usize> = (0..last).map(|c| link * COLUMNS + c).collect();
                all.push(Self::of(matrix.select_columns(&own), true, false));
            }
        }
        all.into_iter().flatten().collect()
    }

    /// Returns the alternative at its best place, by `cost` of squares and unknowns.
    fn best(
        &self,
        fitted: &Fitted,
        share: f64,
        cost: &dyn Fn(f64, usize) -> f64,
    ) -> Option<Change> {
        let mut best: Option<(f64, Change)> = None;
        let mut offer = |taken: f64, unknowns: usize, columns: &dyn Fn() -> DMatrix<f64>| {
            let squares = (fitted.squares() - taken).max(f64::MIN_POSITIVE);
            let own = cost(squares, unknowns);
            if best.as_ref().is_none_or(|(least, _)| own < *least) {
                let columns = columns();
                let change = Change {
                    squares,
                    unknowns,
                    columns,
                };
                best = Some((own, change));
            }
        };
        if self.at_once {
            let along = fitted.design.basis.tr_mul(&self.columns);
            for k in fitted.changes(share) {
                let (taken, rank) = fitted.taken_from(k, &along);
                offer(taken, rank + 1, &|| {
                    let mut own = self.columns.clone();
                    own.rows_mut(0, fitted.start(k)).fill(0.0);
                    own
                });
            }
        }
        if self.slowly {
            let rows = self.columns.nrows();
            for constant in SLOW.map(|share| share * rows as f64) {
                let mut own = self.columns.clone();
                for (k, mut row) in own.row_iter_mut().enumerate() {
                    row *= (-(k as f64) / constant).exp();
                }
                let (taken, rank) = fitted.taken_by(&own);
                offer(taken, rank + 1, &|| own.clone());
            }
        }
        best.map(|(_, change)| change)
    }

    /// Returns the best of several alternatives.
    pub(super) fn best_of(
        all: &[Self],
        fitted: &Fitted,
        share: f64,
        cost: &dyn Fn(f64, usize) -> f64,
    ) -> Option<Change> {
        let at = |c: &Change| cost(c.squares, c.unknowns);
        all.iter()
            .filter_map(|own| own.best(fitted, share, cost))
            .min_by(|a, b| at(a).total_cmp(&at(b)))
    }
}

impl Change {
    /// Returns the design with it.
    pub(super) fn added(&self, design: &Design) -> Design {
        design.with(&self.columns)
    }
}
