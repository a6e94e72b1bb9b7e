//! The simplex of Nelder and Mead (1965), one evaluation at a time, so that several simplices can run in parallel.
//!
//! By hand: the caller evaluates the points of all simplices side by side, which no solver that calls the function
//! itself allows.

/// Default number of evaluations beyond the corners.
pub const DEFAULT_EVALUATIONS: usize = 120;
/// Relative spread of the corner values at which it ends.
const FLAT: f64 = 1e-4;

/// State of a simplex: the next evaluation.
enum Stage {
    /// The value at corner `k`.
    Corner(usize),
    /// The worst corner reflected through the middle of the others.
    Reflect,
    /// Twice as far; holds the value at the reflection.
    Expand(f64),
    /// Half as far, on the better side of the worst corner and the reflection; holds the value at the reflection.
    Contract(f64),
    /// Corner `k`, moved half-way to the best.
    Shrink(usize),
    Done,
}

/// A simplex that minimises a function.
pub struct Simplex {
    /// Value and place; best first once all are known.
    corners: Vec<(f64, Vec<f64>)>,
    stage: Stage,
    evaluations: usize,
    most_evaluations: usize,
}

impl Simplex {
    /// Creates a simplex at `start`, with each other corner moved along one coordinate by its `step`.
    pub fn new(start: &[f64], steps: &[f64]) -> Self {
        let moved = (steps.iter().enumerate()).map(|(k, step)| {
            let mut x = start.to_vec();
            x[k] += step;
            x
        });
        let places = std::iter::once(start.to_vec()).chain(moved);
        Self {
            corners: places.map(|x| (f64::INFINITY, x)).collect(),
            stage: Stage::Corner(0),
            evaluations: 0,
            most_evaluations: DEFAULT_EVALUATIONS,
        }
    }

    /// Sets the number of evaluations, after which the present move is the last.
    pub fn with_evaluations(self, evaluations: usize) -> Self {
        Self {
            most_evaluations: evaluations,
            ..self
        }
    }

    /// Returns the place of the next evaluation; None at the end.
    pub fn next_point(&self) -> Option<Vec<f64>> {
        match self.stage {
            Stage::Corner(k) | Stage::Shrink(k) => Some(self.corners[k].1.clone()),
            Stage::Reflect => Some(self.along(-1.0)),
            Stage::Expand(_) => Some(self.along(-2.0)),
            Stage::Contract(reflected) => Some(self.contracted(reflected)),
            Stage::Done => None,
        }
    }

    /// Receives the value at that place.
    pub fn report(&mut self, value: f64) {
        self.evaluations += 1;
        let last = self.corners.len() - 1;
        self.stage = match self.stage {
            Stage::Corner(k) | Stage::Shrink(k) => {
                self.corners[k].0 = value;
                if k < last {
                    match self.stage {
                        Stage::Corner(_) => Stage::Corner(k + 1),
                        _ => Stage::Shrink(k + 1),
                    }
                } else {
                    self.sorted()
                }
            }
            Stage::Reflect if value < self.corners[0].0 => Stage::Expand(value),
            Stage::Reflect if value < self.corners[last - 1].0 => {
                self.corners[last] = (value, self.along(-1.0));
                self.sorted()
            }
            Stage::Reflect => Stage::Contract(value),
            Stage::Expand(reflected) => {
                self.corners[last] = if value < reflected {
                    (value, self.along(-2.0))
                } else {
                    (reflected, self.along(-1.0))
                };
                self.sorted()
            }
            Stage::Contract(reflected) => {
                if value < self.corners[last].0.min(reflected) {
                    self.corners[last] = (value, self.contracted(reflected));
                    self.sorted()
                } else {
                    let (best, others) = self.corners.split_at_mut(1);
                    for (_, x) in others {
                        for (x, b) in x.iter_mut().zip(&best[0].1) {
                            *x = 0.5 * (*x + b);
                        }
                    }
                    Stage::Shrink(1)
                }
            }
            Stage::Done => Stage::Done,
        };
    }

    /// Returns the best place after the last move.
    pub fn best(&self) -> &[f64] {
        &self.corners[0].1
    }

    fn sorted(&mut self) -> Stage {
        self.corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (best, worst) = (self.corners[0].0, self.corners[self.corners.len() - 1].0);
        if self.evaluations >= self.most_evaluations || worst - best < FLAT * best.abs() {
            Stage::Done
        } else {
            Stage::Reflect
        }
    }

    fn contracted(&self, reflected: f64) -> Vec<f64> {
        let worst = self.corners[self.corners.len() - 1].0;
        self.along(if reflected < worst { -0.5 } else { 0.5 })
    }

    /// Returns a place on the line from the middle of the others (0) to the worst corner (1).
    fn along(&self, share: f64) -> Vec<f64> {
        let n = self.corners.len() - 1;
        let (others, worst) = self.corners.split_at(n);
        (0..n)
            .map(|k| {
                let middle = others.iter().map(|c| c.1[k]).sum::<f64>() / n as f64;
                middle + share * (worst[0].1[k] - middle)
            })
            .collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_valley_is_followed_to_its_end() {
        // Rosenbrock's function, with its minimum at (1, 1).
        let f = |x: &[f64]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2) + 1.0;
        let mut simplex = Simplex::new(&[-0.2, 0.5], &[0.4, 0.4]);
        let mut best = (f64::INFINITY, Vec::new());
        while let Some(x) = simplex.next_point() {
            let value = f(&x);
            if value < best.0 {
                best = (value, x);
            }
            simplex.report(value);
        }
        assert!(best.0 < 1.0 + 1e-3, "{best:?}");
        assert!((best.1[0] - 1.0).abs() < 0.05, "{best:?}");
    }
}
