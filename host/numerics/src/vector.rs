//! Sums over vectors of rows.

/// Returns the inner product, as eight partial sums, because the compiler does not reorder a single one.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0f64; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (x, y) in a8.iter().zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

/// Returns the inner product, summed element by element. The rounding differs from that of [`dot`].
#[inline]
pub fn dot_in_order(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Returns the sum of squares, summed as [`dot`] does.
#[inline]
pub fn norm_squared(a: &[f64]) -> f64 {
    dot(a, a)
}

/// Adds `factor` times x to y.
#[inline]
pub fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_inner_products_are_the_sum_of_products() {
        let a: Vec<f64> = (1..=11).map(f64::from).collect();
        assert_eq!(dot(&a, &a), 506.0);
        assert_eq!(dot_in_order(&a, &a), 506.0);
        assert_eq!(norm_squared(&a), 506.0);
    }
}
