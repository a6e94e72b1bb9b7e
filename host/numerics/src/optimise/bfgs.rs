//! Minimisation with exact gradients: BFGS.
//!
//! The line search finds the weak Wolfe conditions by bisection. With them BFGS also descends at kinks of the function,
//! such as a double smallest singular value (Lewis & Overton 2013).
//!
//! By hand: the solvers at hand ask for the strong Wolfe conditions, which a kink does not have.

use nalgebra::{DMatrix, DVector};

/// Constants of sufficient decrease and of sufficient slope increase (Nocedal & Wright 2006, sec. 3.1).
const ARMIJO: f64 = 1e-4;
const WOLFE: f64 = 0.9;
/// Largest number of halvings and doublings of a step before the direction is abandoned.
const BISECTIONS: usize = 30;

/// Minimises from `x` with at most `iterations` steps. `function` returns the value at a point and fills the gradient; it
/// is not finite where it is undefined. Variables have ranges of the order of one.
pub fn bfgs(
    function: &mut impl FnMut(&DVector<f64>, &mut DVector<f64>) -> f64,
    mut x: DVector<f64>,
    iterations: usize,
) -> DVector<f64> {
    let size = x.len();
    let mut gradient = DVector::zeros(size);
    let mut value = function(&x, &mut gradient);
    let mut inverse = DMatrix::identity(size, size);
    let mut fresh = true;
    let mut trial_gradient = DVector::zeros(size);
    for _ in 0..iterations {
        if !value.is_finite() || gradient.amax() < 1e-7 {
            break;
        }
        let mut direction = -(&inverse * &gradient);
        let mut slope = direction.dot(&gradient);
        if slope >= 0.0 || !slope.is_finite() {
            inverse.fill_with_identity();
            fresh = true;
            direction = -&gradient;
            slope = direction.dot(&gradient);
        }
        // Without curvature information, a step of a tenth of a variable's range is suitable.
        let step = if fresh {
            (0.1 / direction.amax()).min(1.0)
        } else {
            1.0
        };
        let line = Line {
            x: &x,
            value,
            direction: &direction,
            slope,
        };
        let found = line.search(function, step, &mut trial_gradient);
        let Some((next, next_value, next_gradient)) = found else {
            if fresh {
                break;
            }
            // A kink invalidates the curvature: restart with the steepest descent.
            inverse.fill_with_identity();
            fresh = true;
            continue;
        };
        let s = &next - &x;
        let y = &next_gradient - &gradient;
        let curvature = s.dot(&y);
        if curvature > 1e-12 * s.norm() * y.norm() {
            if fresh {
                inverse.fill_with_identity();
                inverse *= curvature / y.norm_squared();
                fresh = false;
            }
            let hy = &inverse * &y;
            let factor = (1.0 + y.dot(&hy) / curvature) / curvature;
            inverse.ger(factor, &s, &s, 1.0);
            inverse.ger(-1.0 / curvature, &hy, &s, 1.0);
            inverse.ger(-1.0 / curvature, &s, &hy, 1.0);
        }
        let still = (value - next_value).abs() < 1e-10 * (1.0 + value.abs());
        (x, value, gradient) = (next, next_value, next_gradient);
        if still {
            break;
        }
    }
    x
}

/// A line from the present point, along which the function falls.
struct Line<'a> {
    x: &'a DVector<f64>,
    /// Value at `x`.
    value: f64,
    direction: &'a DVector<f64>,
    /// Derivative along the direction at `x`.
    slope: f64,
}

impl Line<'_> {
    /// Returns a point with the weak Wolfe conditions, its value and its gradient, from a first `step` on; else the
    /// farthest one with a sufficient decrease, if any. `gradient` is work space.
    fn search(
        &self,
        function: &mut impl FnMut(&DVector<f64>, &mut DVector<f64>) -> f64,
        mut step: f64,
        gradient: &mut DVector<f64>,
    ) -> Option<(DVector<f64>, f64, DVector<f64>)> {
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut found = None;
        for _ in 0..BISECTIONS {
            let trial = self.x + step * self.direction;
            let value = function(&trial, gradient);
            let enough = self.value + ARMIJO * step * self.slope;
            if value.is_nan() || value > enough {
                high = step;
            } else if gradient.dot(self.direction) < WOLFE * self.slope {
                low = step;
                found = Some((trial, value, gradient.clone()));
            } else {
                found = Some((trial, value, gradient.clone()));
                break;
            }
            step = if high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * low
            };
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kink_is_descended_to_its_minimum() {
        // Smooth along x, with a kink at y = 0: the minimum is at (1, 0).
        let mut function = |x: &DVector<f64>, gradient: &mut DVector<f64>| {
            gradient[0] = 2.0 * (x[0] - 1.0);
            gradient[1] = 3.0 * x[1].signum();
            (x[0] - 1.0).powi(2) + 3.0 * x[1].abs()
        };
        let x = bfgs(&mut function, DVector::from_vec(vec![-0.5, 0.8]), 200);
        assert!((x[0] - 1.0).abs() < 1e-3 && x[1].abs() < 1e-3, "{x}");
    }
}
