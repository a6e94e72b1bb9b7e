//! Joint uncertainty of the base parameters of an identified description.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, SymmetricEigen};
use serde::{Deserialize, Serialize};

use super::fault::{Fault, Step};

/// Digits that a number of the file keeps. The torque of the parameters together is known to the same digits, because a
/// root of the covariance is rounded and not the covariance itself.
const DIGITS: usize = 6;
/// Largest standard deviation: the torque that it makes has a square that is a number.
const LARGEST: f64 = 1e100;

/// Joint uncertainty of base parameters: per parameter, by its expression, its standard deviations along independent
/// directions, SI. Two parameters have the sum of the products of their lists as covariance; a shorter list ends in zeros.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Uncertainty(BTreeMap<String, Vec<f64>>);

impl Uncertainty {
    /// Creates it from expressions and their covariance, row by row. Empty if a value is not finite.
    pub fn of(expressions: impl IntoIterator<Item = String>, covariance: &[Vec<f64>]) -> Self {
        let n = covariance.len();
        if covariance.iter().flatten().any(|x| !x.is_finite()) {
            return Self::default();
        }
        // In units of the standard deviations: those of different parameters lie orders of magnitude apart.
        let std: Vec<f64> = (0..n).map(|k| covariance[k][k].max(0.0).sqrt()).collect();
        let unit = |k: usize| if std[k] > 0.0 { std[k] } else { 1.0 };
        let scaled = DMatrix::from_fn(n, n, |i, j| covariance[i][j] / (unit(i) * unit(j)));
        let eigen = SymmetricEigen::new(scaled);
        let size = eigen.eigenvalues.map(|e| e.max(0.0).sqrt());
        let root = eigen.eigenvectors * DMatrix::from_diagonal(&size);
        // A rotation of the directions makes the lists triangular, with half of the numbers.
        let lower = root.transpose().qr().r().transpose();
        let list = |k: usize| (0..=k).map(|d| rounded(unit(k) * lower[(k, d)])).collect();
        Self(
            expressions
                .into_iter()
                .take(n)
                .enumerate()
                .map(|(k, name)| (name, list(k)))
                .collect(),
        )
    }

    /// Returns true if no parameter has an uncertainty.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the expressions of the parameters that have one.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Returns the standard deviations of the parameter along the independent directions; empty if it has none.
    pub fn along(&self, expression: &str) -> &[f64] {
        self.0.get(expression).map_or(&[], Vec::as_slice)
    }

    pub(super) fn check(&self) -> Result<(), Fault> {
        let most = self.0.len();
        for (name, list) in &self.0 {
            let fault = |found: String, advice: &str| {
                Err(Fault {
                    key_path: vec![Step::Key("uncertainty"), Step::Name(name.clone())],
                    what: format!("the uncertainty of `{name}`"),
                    found,
                    advice: format!("{advice}; leave out the table if they are not known"),
                })
            };
            if let Some(x) = list.iter().find(|x| !(x.abs() <= LARGEST)) {
                return fault(x.to_string(), "standard deviations must be finite numbers");
            }
            if list.len() > most {
                return fault(
                    format!("{} numbers", list.len()),
                    &format!("{most} parameters have at most {most} independent directions"),
                );
            }
        }
        Ok(())
    }
}

/// Returns the number with [`DIGITS`] digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.*e}", DIGITS - 1).parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums and differences of two parameters with nearly full correlation, from the lists alone.
    #[test]
    fn lists_hold_the_covariance_of_combinations() {
        let covariance = vec![
            vec![4.0, 1.999, 0.2],
            vec![1.999, 1.0, 0.1],
            vec![0.2, 0.1, 9e-2],
        ];
        let names = ["a + b", "c", "d"];
        let found = Uncertainty::of(names.map(String::from), &covariance);
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        for (i, a) in names.iter().enumerate() {
            for (j, b) in names.iter().enumerate() {
                let own = dot(found.along(a), found.along(b));
                assert!((own - covariance[i][j]).abs() < 1e-4, "{a}, {b}: {own}");
            }
        }
        // The well-known direction: a + b − 2 c.
        let [a, c] = [found.along("a + b"), found.along("c")];
        let across: f64 = dot(a, a) - 4.0 * dot(a, c) + 4.0 * dot(c, c);
        assert!((across - 0.004).abs() < 1e-4, "{across}");
        assert!(found.along("unknown").is_empty());
        assert!(Uncertainty::of(["x".to_owned()], &[vec![f64::NAN]]).is_empty());
    }

    /// A value whose square is no number, and more directions than parameters.
    #[test]
    fn impossible_lists_are_refused_by_name() {
        let check = |list: Vec<f64>| Uncertainty(BTreeMap::from([("m1".to_owned(), list)])).check();
        assert!(check(vec![0.1]).is_ok() && check(Vec::new()).is_ok());
        for list in [vec![f64::NAN], vec![1e200], vec![0.1, 0.2]] {
            assert!(check(list).is_err_and(|fault| fault.what.contains("m1")));
        }
    }
}
