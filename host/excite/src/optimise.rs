//! Minimisation with exact gradients: BFGS inside an augmented Lagrangian.
//!
//! The constraints c ≤ 0 enter as μ/2·max(0, c + λ/μ)² with multipliers λ that are updated between the rounds
//! (Rockafellar 1973; Nocedal & Wright 2006, ch. 17). The line search finds the weak Wolfe conditions by bisection.
//! With them BFGS also descends at kinks of the criterion, such as a double smallest singular value (Lewis & Overton
//! 2013).

use nalgebra::{DMatrix, DVector};

use super::criterion::Smoothing;

/// Constants of sufficient decrease and of sufficient slope increase (Nocedal & Wright 2006, sec. 3.1).
const ARMIJO: f64 = 1e-4;
const WOLFE: f64 = 0.9;
/// Largest number of halvings and doublings of a step before the direction is abandoned.
const BISECTIONS: usize = 30;

/// Settings between two updates of the multipliers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    /// Weight of the penalty: constraints are relative to their limits and the criterion is a logarithm, so multipliers
    /// are of the order of one.
    pub weight: f64,
    /// Smoothing of the extreme singular values.
    pub smoothing: Smoothing,
    /// Largest number of BFGS steps.
    pub steps: usize,
}

/// The function to minimise.
pub(super) trait Objective {
    /// Returns the criterion plus the penalties at `x` and fills the gradient. Not finite if undefined.
    fn value(&mut self, x: &DVector<f64>, gradient: &mut DVector<f64>) -> f64;
    /// Updates the multipliers at `x` for the next round.
    fn update(&mut self, x: &DVector<f64>, next: &Round);
}

/// Minimises from `x`, calling `done` after each round.
pub(super) fn minimise(
    objective: &mut impl Objective,
    mut x: DVector<f64>,
    rounds: &[Round],
    mut done: impl FnMut(),
) -> DVector<f64> {
    for round in rounds {
        objective.update(&x, round);
        x = bfgs(objective, x, round.steps);
        done();
    }
    x
}

fn bfgs(objective: &mut impl Objective, mut x: DVector<f64>, iterations: usize) -> DVector<f64> {
    let size = x.len();
    let mut gradient = DVector::zeros(size);
    let mut value = objective.value(&x, &mut gradient);
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
        let mut step = if fresh {
            (0.1 / direction.amax()).min(1.0)
        } else {
            1.0
        };
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut found = None;
        for _ in 0..BISECTIONS {
            let trial = &x + step * &direction;
            let trial_value = objective.value(&trial, &mut trial_gradient);
            let enough = value + ARMIJO * step * slope;
            if trial_value.is_nan() || trial_value > enough {
                high = step;
            } else if trial_gradient.dot(&direction) < WOLFE * slope {
                low = step;
                found = Some((trial, trial_value, trial_gradient.clone()));
            } else {
                found = Some((trial, trial_value, trial_gradient.clone()));
                break;
            }
            step = if high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * low
            };
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley on the disc of radius 1 about the origin.
    struct Valley {
        weight: f64,
        multiplier: f64,
    }

    impl Valley {
        fn constraint(x: &DVector<f64>) -> f64 {
            x.norm_squared() - 1.0
        }
    }

    impl Objective for Valley {
        fn value(&mut self, x: &DVector<f64>, gradient: &mut DVector<f64>) -> f64 {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            let active = (Self::constraint(x) + self.multiplier / self.weight).max(0.0);
            gradient[0] = -2.0 * a - 400.0 * x[0] * b;
            gradient[1] = 200.0 * b;
            *gradient += 2.0 * self.weight * active * x;
            a * a + 100.0 * b * b + 0.5 * self.weight * active * active
        }
        fn update(&mut self, x: &DVector<f64>, next: &Round) {
            if self.weight > 0.0 {
                self.multiplier = (self.weight * Self::constraint(x) + self.multiplier).max(0.0);
            }
            self.weight = next.weight;
        }
    }

    #[test]
    fn finds_the_constrained_minimum() {
        let mut valley = Valley {
            weight: 0.0,
            multiplier: 0.0,
        };
        let rounds = [1e1, 1e2, 1e3, 1e3, 3e3, 3e3].map(|weight| Round {
            weight,
            smoothing: Smoothing(1),
            steps: 200,
        });
        let x = minimise(
            &mut valley,
            DVector::from_vec(vec![-0.5, 0.8]),
            &rounds,
            || (),
        );
        // On the circle with the angle as the only unknown, by a dense search.
        let best = (0..2_000_000)
            .map(|k| f64::from(k) * 1e-6)
            .map(|angle| (angle.cos(), angle.sin()))
            .min_by(|(a, b), (c, d)| {
                let f = |x: f64, y: f64| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
                f(*a, *b).total_cmp(&f(*c, *d))
            })
            .unwrap_or_default();
        assert!(
            (x[0] - best.0).abs() < 1e-4 && (x[1] - best.1).abs() < 1e-4,
            "{x} {best:?}"
        );
    }
}
