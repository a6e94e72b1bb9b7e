//! What poses at rest tell of a load.
//!
//! At rest the sensor reads the force m·g + b_f and the moment c·m × g + b_m (or their opposites), with gravity g in its
//! axes, the load's mass m and centre c, and constant biases b. Let g̃ be gravity less its mean over the poses: that is
//! what unknown biases leave. The information of the mass is Σ|g̃|²/σ_f², that of the first moment m·c is
//! Σ(|g̃|²·1 − g̃·g̃ᵀ)/σ_m², and the two are independent.

use nalgebra::{Matrix3, Vector3};

/// Sums over poses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    count: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Sums {
    /// Returns the sums over directions of gravity.
    pub(super) fn of(gravity: impl IntoIterator<Item = Vector3<f64>>) -> Self {
        let zero = Self {
            count: 0.0,
            first: Vector3::zeros(),
            second: Matrix3::zeros(),
        };
        gravity.into_iter().fold(zero, |sums, g| Self {
            count: sums.count + 1.0,
            first: sums.first + g,
            second: sums.second + g * g.transpose(),
        })
    }

    /// Returns the sums with one pose exchanged.
    pub(super) fn exchanged(&self, old: Vector3<f64>, new: Vector3<f64>) -> Self {
        Self {
            count: self.count,
            first: self.first + new - old,
            second: self.second + new * new.transpose() - old * old.transpose(),
        }
    }

    /// Returns Σ g̃·g̃ᵀ.
    fn scatter(&self) -> Matrix3<f64> {
        self.second - self.first * self.first.transpose() / self.count
    }

    /// Returns the information of mass and first moment for noise of one: Σ|g̃|² and Σ(|g̃|²·1 − g̃·g̃ᵀ).
    pub(super) fn information(&self) -> (f64, Matrix3<f64>) {
        let scatter = self.scatter();
        let mass = scatter.trace();
        (mass, Matrix3::identity() * mass - scatter)
    }

    /// Returns the logarithm of its determinant; −∞ if it is singular.
    pub(super) fn log_determinant(&self) -> f64 {
        let (mass, moment) = self.information();
        let determinant = mass * moment.determinant();
        if determinant > 0.0 {
            determinant.ln()
        } else {
            f64::NEG_INFINITY
        }
    }
}

/// Returns the largest possible [`Information::value`]: gravity spread over all directions alike. Σ|g̃|² is at most
/// N·g², and the eigenvalues of the first moment are then 2/3 of it: (1·(2/3)³)^(1/8).
pub(super) fn best_value() -> f64 {
    (8.0_f64 / 27.0).powf(0.125)
}

/// The quality of poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Information {
    /// Square root of the geometric mean of the information's four eigenvalues, per pose, for gravity and noises of one;
    /// at most [`best_value`].
    pub value: f64,
    /// Square root of the ratio of its largest to its smallest eigenvalue.
    pub condition_number: f64,
    /// Standard deviation of the mass per force noise of 1 N in the mean of each pose, kg.
    pub mass: f64,
    /// Largest standard deviation of the first moment in any direction per moment noise of 1 N·m, kg·m.
    pub first_moment: f64,
}

impl Information {
    /// Returns the quality of poses; `strength` is the acceleration of gravity, m/s².
    pub(super) fn of(gravity: &[Vector3<f64>], strength: f64) -> Self {
        let (mass, moment) = Sums::of(gravity.iter().copied()).information();
        let moments = moment.symmetric_eigenvalues();
        let unit = gravity.len() as f64 * strength * strength;
        let all = [mass, moments[0], moments[1], moments[2]];
        let logs: f64 = all.iter().map(|v| (v / unit).ln()).sum();
        let [low, high] = [f64::min, f64::max].map(|f| all.into_iter().fold(mass, f));
        Self {
            value: (logs / 8.0).exp(),
            condition_number: (high / low).sqrt(),
            mass: mass.sqrt().recip(),
            first_moment: moments.min().sqrt().recip(),
        }
    }
}
