//! Inverses of the small matrices of a step.

use super::error::SimulateError;

/// Inverts a symmetric positive definite matrix by Cholesky; the factor replaces the input.
pub(super) fn invert(a: &mut [f64], inverse: &mut [f64], n: usize) -> Result<(), SimulateError> {
    for j in 0..n {
        let pivot = a[j * n + j] - (0..j).map(|k| a[j * n + k] * a[j * n + k]).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return Err(SimulateError::NotPositiveDefinite { joint: j + 1 });
        }
        let root = pivot.sqrt();
        a[j * n + j] = root;
        for i in j + 1..n {
            let rest: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            a[i * n + j] = (a[i * n + j] - rest) / root;
        }
    }
    for c in 0..n {
        for i in 0..n {
            let rest: f64 = (0..i).map(|k| a[i * n + k] * inverse[k * n + c]).sum();
            inverse[i * n + c] = (f64::from(u8::from(i == c)) - rest) / a[i * n + i];
        }
        for i in (0..n).rev() {
            let rest: f64 = (i + 1..n).map(|k| a[k * n + i] * inverse[k * n + c]).sum();
            inverse[i * n + c] = (inverse[i * n + c] - rest) / a[i * n + i];
        }
    }
    Ok(())
}

/// Inverts a matrix whose symmetric part is positive definite, by elimination with pivoting. Overwrites `a`.
pub(super) fn invert_any(
    a: &mut [f64],
    inverse: &mut [f64],
    n: usize,
) -> Result<(), SimulateError> {
    let mut symmetric: Vec<f64> = (0..n * n)
        .map(|k| 0.5 * (a[k] + a[k % n * n + k / n]))
        .collect();
    invert(&mut symmetric, inverse, n)?;
    inverse.fill(0.0);
    for i in 0..n {
        inverse[i * n + i] = 1.0;
    }
    for c in 0..n {
        let pivot = (c..n)
            .max_by(|x, y| a[x * n + c].abs().total_cmp(&a[y * n + c].abs()))
            .unwrap_or(c);
        for k in 0..n {
            a.swap(c * n + k, pivot * n + k);
            inverse.swap(c * n + k, pivot * n + k);
        }
        let scale = 1.0 / a[c * n + c];
        for k in 0..n {
            a[c * n + k] *= scale;
            inverse[c * n + k] *= scale;
        }
        for i in (0..n).filter(|i| *i != c) {
            let factor = a[i * n + c];
            for k in 0..n {
                a[i * n + k] -= factor * a[c * n + k];
                inverse[i * n + k] -= factor * inverse[c * n + k];
            }
        }
    }
    Ok(())
}
