//! Marginal likelihood of a linear model with Gaussian priors.
//!
//! Bishop 2006, Pattern Recognition and Machine Learning, eq. 3.86; noise of variance 1, priors of mean zero. By hand
//! on rows of inner products: thousands of models share them.

use rig_numerics::vector::dot;

use super::products::Products;

/// Log marginal likelihood and coefficients.
pub(crate) struct Posterior {
    /// Log marginal likelihood over that of noise alone.
    pub(crate) log: f64,
    /// Means of the coefficients.
    pub(crate) means: Vec<f64>,
    /// Lower Cholesky factor of 1 + P½·XᵀX·P½, by rows, with the prior covariance P.
    factor: Vec<Vec<f64>>,
    /// Prior standard deviations.
    roots: Vec<f64>,
    /// Forward solution of the factor with P½·Xᵀy.
    forward: Vec<f64>,
    columns: Vec<usize>,
}

/// Cholesky factor by rows; None if the matrix is not positive definite.
fn factor(mut matrix: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    for i in 0..matrix.len() {
        let (done, rest) = matrix.split_at_mut(i);
        let row = &mut rest[0];
        for j in 0..i {
            row[j] = (row[j] - dot(&row[..j], &done[j][..j])) / done[j][j];
        }
        let left = row[i] - dot(&row[..i], &row[..i]);
        if !(left > 0.0) {
            return None;
        }
        row[i] = left.sqrt();
    }
    Some(matrix)
}

fn forward(factor: &[Vec<f64>], mut right: Vec<f64>) -> Vec<f64> {
    for i in 0..right.len() {
        right[i] = (right[i] - dot(&factor[i][..i], &right[..i])) / factor[i][i];
    }
    right
}

fn backward(factor: &[Vec<f64>], mut right: Vec<f64>) -> Vec<f64> {
    for i in (0..right.len()).rev() {
        right[i] /= factor[i][i];
        let x = right[i];
        for (r, c) in right[..i].iter_mut().zip(&factor[i]) {
            *r -= c * x;
        }
    }
    right
}

impl Posterior {
    /// Returns the posterior of a model with these columns and prior variances. None if rounding makes it singular.
    pub(crate) fn of(products: &Products, columns: Vec<usize>, variances: &[f64]) -> Option<Self> {
        let roots: Vec<f64> = variances.iter().map(|v| v.sqrt()).collect();
        let matrix = (columns.iter().enumerate())
            .map(|(i, a)| {
                (columns[..=i].iter().enumerate())
                    .map(|(j, b)| {
                        let one = if i == j { 1.0 } else { 0.0 };
                        one + roots[i] * roots[j] * products.of(*a, *b)
                    })
                    .collect()
            })
            .collect();
        let factor = factor(matrix)?;
        let right = (columns.iter().zip(&roots))
            .map(|(c, root)| root * products.torque(*c))
            .collect();
        let forward = forward(&factor, right);
        let log = 0.5 * dot(&forward, &forward) - log_of_diagonal(&factor);
        let means = (backward(&factor, forward.clone()).iter().zip(&roots))
            .map(|(x, root)| x * root)
            .collect();
        Some(Self {
            log,
            means,
            factor,
            roots,
            forward,
            columns,
        })
    }

    /// Returns the posterior variance of a coefficient.
    pub(crate) fn variance(&self, place: usize) -> f64 {
        let n = self.factor.len();
        let mut column = vec![0.0; n - place];
        column[0] = 1.0 / self.factor[place][place];
        for k in place + 1..n {
            let row = &self.factor[k];
            let done = k - place;
            column[done] = -dot(&row[place..k], &column[..done]) / row[k];
        }
        self.roots[place].powi(2) * dot(&column, &column)
    }

    /// Returns the gain in log marginal likelihood by more columns with these prior variances, and their coefficients.
    /// `with` is the inner product of one of them with a column (0: the torque), `among` that of two of them.
    pub(crate) fn beside(
        &self,
        with: impl Fn(usize, usize) -> f64,
        among: impl Fn(usize, usize) -> f64,
        variances: &[f64],
    ) -> Option<(f64, Vec<f64>)> {
        let roots: Vec<f64> = variances.iter().map(|v| v.sqrt()).collect();
        let along: Vec<Vec<f64>> = (0..roots.len())
            .map(|i| self.along(|column| with(i, column)))
            .collect();
        let matrix = (0..roots.len())
            .map(|i| {
                (0..=i)
                    .map(|j| {
                        let one = if i == j { 1.0 } else { 0.0 };
                        one + roots[i] * roots[j] * (among(i, j) - dot(&along[i], &along[j]))
                    })
                    .collect()
            })
            .collect();
        let own = factor(matrix)?;
        let right = (0..roots.len())
            .map(|i| roots[i] * (with(i, 0) - dot(&along[i], &self.forward)))
            .collect();
        let solved = forward(&own, right);
        let log = 0.5 * dot(&solved, &solved) - log_of_diagonal(&own);
        let means = (backward(&own, solved).iter().zip(&roots))
            .map(|(x, root)| x * root)
            .collect();
        Some((log, means))
    }

    /// Returns the squares that the model would explain of a signal, from its inner products with the columns.
    pub(crate) fn explained(&self, with: impl Fn(usize) -> f64) -> f64 {
        let along = self.along(with);
        dot(&along, &along)
    }

    fn along(&self, with: impl Fn(usize) -> f64) -> Vec<f64> {
        let right = (self.columns.iter().zip(&self.roots))
            .map(|(column, root)| root * with(*column))
            .collect();
        forward(&self.factor, right)
    }
}

fn log_of_diagonal(factor: &[Vec<f64>]) -> f64 {
    factor.iter().enumerate().map(|(i, row)| row[i].ln()).sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// The likelihood by the covariance of the torque, without any matrix identity.
    #[test]
    fn the_marginal_likelihood_is_that_of_the_covariance_of_the_torque() {
        use nalgebra::{DMatrix, DVector};
        let n = 30;
        let wave = |w: f64| {
            (0..n)
                .map(|k| (w * k as f64 + 0.3).sin())
                .collect::<Vec<f64>>()
        };
        let columns = [wave(0.2), wave(0.5), wave(1.1)];
        let torque: Vec<f64> = (0..n).map(|k| (0.21 * k as f64).cos() * 2.0).collect();
        let mut products = Products::new(torque.clone());
        let numbers: Vec<usize> = columns.iter().map(|c| products.push(c.clone())).collect();
        let variances = [2.0, 0.3, 5.0];
        let whole = |count: usize| {
            let mut covariance = DMatrix::<f64>::identity(n, n);
            for (c, v) in columns.iter().zip(variances).take(count) {
                let c = DVector::from_column_slice(c);
                covariance += v * &c * c.transpose();
            }
            let y = DVector::from_column_slice(&torque);
            let cholesky = covariance.cholesky().unwrap();
            -0.5 * y.dot(&cholesky.solve(&y)) - cholesky.l().diagonal().map(f64::ln).sum()
        };
        let two = Posterior::of(&products, numbers[..2].to_vec(), &variances[..2]).unwrap();
        assert!((two.log - (whole(2) - whole(0))).abs() < 1e-9);
        let with = |_: usize, c: usize| products.of(numbers[2], c);
        let among = |_: usize, _: usize| products.of(numbers[2], numbers[2]);
        let (more, _) = two.beside(with, among, &variances[2..]).unwrap();
        assert!((more - (whole(3) - whole(2))).abs() < 1e-9);
    }
}
