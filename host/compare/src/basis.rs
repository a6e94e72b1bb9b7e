//! Parameters that all sets are expressed in.
//!
//! A set shows combinations of the base parameters: all of them if its motion is rich, fewer otherwise. The common
//! parameters are the combinations that at least one set shows, in row echelon form, so that they are the base
//! parameters themselves wherever these are shown. Of each set it is known which of them it shows.

use nalgebra::{DMatrix, SymmetricEigen};
use rig_identify::{Base, expression, independent_columns};

use crate::identified_set::IdentifiedSet;
use crate::matrices::pseudo_inverse;

/// Largest part of a parameter, as a share of its own length, that a set which shows it may lack. Lengths are torques:
/// a parameter's length is the RMS of its torque in units of the residual. 0.01: what is lacking then changes the value
/// by about 1 % of the other parameters' torques.
const LACKING: f64 = 0.01;

/// The parameters, and what each set shows of them.
pub(crate) struct Basis {
    /// Parameters × standard parameters.
    pub combination: DMatrix<f64>,
    /// Column of the standard regressor that names each parameter.
    pub columns: Vec<usize>,
    /// Expressions.
    pub names: Vec<String>,
    /// Units, ASCII.
    pub units: Vec<String>,
    /// Base parameters = `to_base` · parameters, the smallest such values in units of torque.
    pub to_base: DMatrix<f64>,
    /// By set: identified values = `of_set` · parameters.
    pub of_set: Vec<DMatrix<f64>>,
    /// By set: parameters = `from_set` · identified values, for those that it shows.
    pub from_set: Vec<DMatrix<f64>>,
    /// By set and parameter: true if the set shows it.
    pub shown: Vec<Vec<bool>>,
}

impl Basis {
    /// Finds the parameters of identified sets.
    pub(crate) fn of(base: &Base, sets: &[IdentifiedSet]) -> Self {
        let p = base.len();
        let length = lengths(sets, p);
        let over = DMatrix::from_diagonal(&length.map(|l| 1.0 / l));
        let scaled: Vec<DMatrix<f64>> = sets.iter().map(|s| &s.of_base * &over).collect();
        let kept = union(&scaled, p);
        let order: Vec<usize> = (0..p).collect();
        let (echelon, pivots) = if kept.nrows() == p {
            (DMatrix::identity(p, p), order)
        } else {
            let found = independent_columns(&kept, &order, LACKING);
            (found.combination, found.kept)
        };
        let m = pivots.len();
        let own = DMatrix::from_fn(m, m, |i, j| if i == j { length[pivots[i]] } else { 0.0 });
        let over_own = own.map(|v| if v == 0.0 { 0.0 } else { 1.0 / v });
        let inverse = pseudo_inverse(&echelon);
        let parameters = &over_own * &echelon * DMatrix::from_diagonal(&length);
        let (mut of_set, mut from_set, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        for t in &scaled {
            let along = t * &inverse;
            let back = pseudo_inverse(&along);
            let seen = &back * &along;
            shown.push((0..m).map(|k| is_shown(&seen, k)).collect());
            of_set.push(along * &own);
            from_set.push(&over_own * back);
        }
        let combination = &parameters * &base.combination;
        let columns: Vec<usize> = pivots.iter().map(|&k| base.columns[k]).collect();
        Self {
            names: (0..m)
                .map(|k| expression(&combination, k, columns[k]))
                .collect(),
            units: pivots.iter().map(|&k| base.unit(k).to_owned()).collect(),
            combination,
            columns,
            to_base: &over * inverse * &own,
            of_set,
            from_set,
            shown,
        }
    }

    /// Returns the number of parameters.
    pub(crate) fn len(&self) -> usize {
        self.columns.len()
    }

    /// Returns the parameters that every set shows.
    pub(crate) fn common(&self) -> Vec<usize> {
        (0..self.len())
            .filter(|&k| self.shown.iter().all(|set| set[k]))
            .collect()
    }
}

/// Returns true if parameter `k` lies in the row space that `seen` projects onto.
fn is_shown(seen: &DMatrix<f64>, k: usize) -> bool {
    let lacking = (0..seen.nrows()).map(|i| (seen[(i, k)] - f64::from(u8::from(i == k))).powi(2));
    lacking.sum::<f64>().sqrt() < LACKING
}

/// Returns the length of each base parameter: root of its mean information over the sets; 1 if no set moves it.
fn lengths(sets: &[IdentifiedSet], p: usize) -> nalgebra::DVector<f64> {
    let mut sum = nalgebra::DVector::zeros(p);
    for set in sets {
        sum += set.information().diagonal();
    }
    sum.map(|square: f64| match square > 0.0 {
        true => square.sqrt(),
        false => 1.0,
    })
}

/// Returns an orthonormal basis, in rows, of what the sets show together.
fn union(scaled: &[DMatrix<f64>], p: usize) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(p, p);
    for t in scaled {
        sum += pseudo_inverse(t) * t;
    }
    let SymmetricEigen {
        eigenvalues,
        eigenvectors,
    } = sum.symmetric_eigen();
    let kept: Vec<usize> = (0..p)
        .filter(|&k| eigenvalues[k] > LACKING * LACKING)
        .collect();
    eigenvectors.select_columns(&kept).transpose()
}
