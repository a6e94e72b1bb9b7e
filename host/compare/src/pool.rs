//! Pooled values of all parameters: the multivariate random-effects model.
//!
//! Set s identified y_s = A_s·(φ + b_s) + e_s, with e_s of its full covariance S_s and b_s of the covariance Ψ between
//! sets. φ is estimated by generalised least squares with V_s = S_s + A_s·Ψ·A_sᵀ (Jackson, White and Riley 2013, "A
//! matrix-based method of moments for fitting the multivariate random effects model"). Ψ has as many values as pairs of
//! parameters, and a few sets cannot determine them. So Ψ is diagonal, and its entries are the moment estimates of
//! DerSimonian and Laird (1986) of each parameter.
//!
//! Standard error and interval of a parameter are the larger ones of two. One follows from the errors within the sets. The
//! other is the scatter of the sets about their mean, of each parameter alone (Hartung and Knapp 2001, "A refined method
//! for the meta-analysis of controlled clinical trials", eq. 3); its interval uses Student's t with the effective number of
//! sets (Kish 1965) minus one. With few sets intervals are wide: t is 12.7 for two sets and 3.2 for four.

use nalgebra::{DMatrix, DVector};
use rig_identify::t_quantile;

use crate::basis::Basis;
use crate::error::CompareError;
use crate::identified_set::IdentifiedSet;
use crate::matrices::inverse;
use crate::significance::freedom_of_quantile;
use crate::single::{Single, scatter};

/// Pooled values.
pub(crate) struct Pool {
    /// Values.
    pub values: DVector<f64>,
    /// Covariance of the generalised least squares.
    pub covariance: DMatrix<f64>,
    /// Standard errors.
    pub std: Vec<f64>,
    /// Half the 95 % intervals.
    pub half: Vec<f64>,
    /// Degrees of freedom with which Student's t times the standard error is half the interval.
    pub freedom: Vec<f64>,
}

/// Pools the parameters. `singles` are the values of each in the sets that show it, `between` its variance between sets.
///
/// # Errors
/// [`CompareError::Singular`].
pub(crate) fn pool(
    sets: &[IdentifiedSet],
    basis: &Basis,
    singles: &[Vec<Single>],
    between: &[f64],
) -> Result<Pool, CompareError> {
    let m = basis.len();
    let psi = DMatrix::from_diagonal(&DVector::from_column_slice(between));
    let mut information = DMatrix::zeros(m, m);
    let mut right = DVector::zeros(m);
    let mut gains = Vec::with_capacity(sets.len());
    for (set, a) in sets.iter().zip(&basis.of_set) {
        let v = &set.covariance + a * &psi * a.transpose();
        let singular = || CompareError::Singular(set.name.clone());
        let gain = a.transpose() * inverse(&v).ok_or_else(singular)?;
        information += &gain * a;
        right += &gain * &set.values;
        gains.push(gain);
    }
    let all = || CompareError::Singular("all together".into());
    let covariance = inverse(&information).ok_or_else(all)?;
    let values = &covariance * right;
    let (mut inner, mut inner_freedom) = (vec![0.0; m], vec![0.0; m]);
    for (set, gain) in sets.iter().zip(&gains) {
        let to = &covariance * gain;
        let own = (&to * &set.covariance * to.transpose()).diagonal();
        for k in 0..m {
            inner[k] += own[k];
            inner_freedom[k] += own[k].powi(2) / set.freedom();
        }
    }
    let mut found = Pool {
        values,
        covariance,
        std: Vec::new(),
        half: Vec::new(),
        freedom: Vec::new(),
    };
    for k in 0..m {
        // Welch and Satterthwaite: degrees of freedom of a sum of estimated variances.
        let together = inner[k].powi(2) / inner_freedom[k];
        let by_errors = inner[k].sqrt();
        let scatter = scatter(&singles[k], between[k]);
        let halves = [
            by_errors * t_quantile(together),
            scatter.map_or(0.0, |[std, freedom]| std * t_quantile(freedom)),
        ];
        let half = halves[0].max(halves[1]);
        let std = scatter.map_or(by_errors, |[std, _]| std.max(by_errors));
        let freedom = freedom_of_quantile(half / std);
        found.std.push(std);
        found.half.push(half);
        found.freedom.push(freedom);
    }
    Ok(found)
}
