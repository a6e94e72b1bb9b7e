//! Settings of the on-line estimator, and their check.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::link::PARAMETER_COUNT;
use crate::scalar::Real;

/// Kind of recursive estimator.
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
    /// Kind of estimator.
    pub kind: EstimatorKind,
    /// Time after which the weight of old data is 1/e, s.
    pub memory: T,
    /// Bandwidth of the filter in front of the regressor, Hz.
    pub bandwidth: T,
    /// Speed below which friction may be in presliding, so that sgn q̇ does not describe it, rad/s.
    pub slip_velocity: T,
    /// Smallest plausible value of each parameter.
    pub lower: [T; PARAMETER_COUNT],
    /// Largest plausible value of each parameter.
    pub upper: [T; PARAMETER_COUNT],
}

/// Setting that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingsFault {
    /// The memory is not a positive number of seconds.
    Memory,
    /// The bandwidth is not positive or above a tenth of the update rate.
    Bandwidth,
    /// The slip velocity is negative or not a number.
    SlipVelocity,
    /// The band of this parameter is empty, reversed or not finite.
    Band(usize),
}

impl<T: Real<Mask = bool>> EstimatorSettings<T> {
    /// Returns default settings for a band: least squares, a memory of 60 s, 30 Hz of bandwidth (well above the motion
    /// of a link, well below a current loop), and a slip velocity of 0.05 rad/s (the joint then leaves a presliding
    /// range of some 10⁻³ rad within the filter's memory).
    pub fn for_band(lower: [T; PARAMETER_COUNT], upper: [T; PARAMETER_COUNT]) -> Self {
        Self {
            kind: EstimatorKind::LeastSquares,
            memory: T::from_f64(60.0),
            bandwidth: T::from_f64(30.0),
            slip_velocity: T::from_f64(0.05),
            lower,
            upper,
        }
    }

    /// Checks that the settings can run at this update rate, Hz.
    pub fn check(&self, update_rate_hz: T) -> Result<(), SettingsFault> {
        if !(T::ZERO.lt(self.memory) && finite(self.memory)) {
            return Err(SettingsFault::Memory);
        }
        let ten = T::from_f64(10.0);
        if !(T::ZERO.lt(self.bandwidth) && (self.bandwidth * ten).le(update_rate_hz)) {
            return Err(SettingsFault::Bandwidth);
        }
        if !(T::ZERO.le(self.slip_velocity) && finite(self.slip_velocity)) {
            return Err(SettingsFault::SlipVelocity);
        }
        for (i, (low, high)) in self.lower.iter().zip(&self.upper).enumerate() {
            if !(low.lt(*high) && finite(*high - *low)) {
                return Err(SettingsFault::Band(i));
            }
        }
        Ok(())
    }
}

/// Returns true if a value is neither infinite nor NaN.
#[inline(always)]
pub(super) fn finite<T: Real<Mask = bool>>(value: T) -> bool {
    // ∞·0 and NaN·0 are NaN, and no comparison with NaN is true.
    (value * T::ZERO).le(T::ZERO)
}
