//! Minimisation with exact gradients: BFGS inside an augmented Lagrangian.
//!
//! The constraints c ≤ 0 enter as μ/2·max(0, c + λ/μ)² with multipliers λ that are updated between the rounds
//! (Rockafellar 1973; Nocedal & Wright 2006, ch. 17).

use nalgebra::DVector;
use rig_numerics::optimise::bfgs::bfgs;

use super::criterion::Smoothing;

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
        x = bfgs(
            &mut |x, gradient| objective.value(x, gradient),
            x,
            round.steps,
        );
        done();
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
