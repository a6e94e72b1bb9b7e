//! The estimation methods.

use serde::{Deserialize, Serialize};

use rig_model::robot::Robot;

/// The estimation method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Ordinary least squares.
    Ols,
    /// Each joint's rows are divided by the standard deviation of its residual.
    #[default]
    Weighted,
    /// Weighted, with smaller weights for rows with large residuals (iteratively reweighted least squares).
    Robust,
    /// Instrumental variables from the simulated closed loop (IDIM-IV).
    Iv,
    /// Fits the torque of the simulated closed loop to the measured torque (DIDIM).
    OutputError,
    /// Total least squares: allows for noise in the regressor.
    Tls,
    /// Maximum likelihood: residuals are autoregressive and correlated between joints.
    Ml,
    /// Ridge regression towards the description's values.
    Ridge,
    /// Weighted, with the constraint that every link has physically consistent inertial parameters.
    Consistent,
}

impl Estimator {
    /// All estimators, the simple ones first.
    pub const ALL: [Self; 9] = [
        Self::Ols,
        Self::Weighted,
        Self::Robust,
        Self::Iv,
        Self::OutputError,
        Self::Tls,
        Self::Ml,
        Self::Ridge,
        Self::Consistent,
    ];

    /// Returns the default estimator for `robot`. One joint: weighted least squares, which needs no prior. Several
    /// joints: `consistent`, because one motion seldom excites all joints. It takes from the description what the data
    /// do not identify, and its links are physically consistent. The reported values then equal those in the written
    /// files.
    pub fn for_robot(robot: &Robot) -> Self {
        if robot.joints.len() > 1 {
            Self::Consistent
        } else {
            Self::Weighted
        }
    }

    /// Returns true if the description's values enter the estimate.
    pub fn has_prior(self) -> bool {
        matches!(
            self,
            Self::Iv | Self::OutputError | Self::Ridge | Self::Consistent
        )
    }

    /// The name on the command line and in `identification.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ols => "ols",
            Self::Weighted => "weighted",
            Self::Robust => "robust",
            Self::Iv => "iv",
            Self::OutputError => "output-error",
            Self::Tls => "tls",
            Self::Ml => "ml",
            Self::Ridge => "ridge",
            Self::Consistent => "consistent",
        }
    }

    /// The name in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Ols => "ordinary least squares",
            Self::Weighted => "weighted least squares",
            Self::Robust => "robust (reweighted) least squares",
            Self::Iv => "instrumental variables (IDIM-IV)",
            Self::OutputError => "closed-loop output error (DIDIM)",
            Self::Tls => "total least squares",
            Self::Ml => "maximum likelihood with the residual's covariance",
            Self::Ridge => "ridge regression towards the description",
            Self::Consistent => "physically consistent least squares",
        }
    }
}

/// The function that reduces the weight of large residuals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// Huber 1964, k = 1.345 (95 % efficient for normal residuals): influence is bounded.
    #[default]
    Huber,
    /// Tukey's bisquare, c = 4.685 (95 % efficient): outliers have zero weight.
    Bisquare,
}

impl Loss {
    /// Returns the weight of a residual of `u` standard deviations.
    pub fn weight(self, u: f64) -> f64 {
        let u = u.abs();
        match self {
            Self::Huber if u <= 1.345 => 1.0,
            Self::Huber => 1.345 / u,
            Self::Bisquare if u < 4.685 => (1.0 - (u / 4.685).powi(2)).powi(2),
            Self::Bisquare => 0.0,
        }
    }
}
