//! On-line estimation of parameters that enter linearly.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::link::PARAMETER_COUNT;

/// Which recursive estimator runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum EstimatorKind {
    /// Recursive least squares in UD form with directional forgetting.
    #[default]
    LeastSquares,
    /// Normalised gradient with an adaptation gain matrix.
    Gradient,
}

/// Settings of the on-line estimator of the one-link model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct EstimatorSettings<T> {
    /// Which estimator.
    pub kind: EstimatorKind,
    /// Time after which old data weigh 1/e, s.
    pub memory: T,
    /// Bandwidth of the filter in front of the regressor, Hz.
    pub bandwidth: T,
    /// Smallest plausible value of each parameter.
    pub lower: [T; PARAMETER_COUNT],
    /// Largest plausible value of each parameter.
    pub upper: [T; PARAMETER_COUNT],
}
