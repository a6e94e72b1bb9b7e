//! On-line estimation of linear parameters.

pub mod gradient;
pub mod least_squares;
pub mod one_link;
pub mod recursive;
pub mod ud;
pub mod uncertainty;

#[cfg(test)]
mod cost;
#[cfg(test)]
mod tests;

pub use one_link::OneLinkEstimator;

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
        if !(T::ZERO.lt(self.memory) && recursive::finite(self.memory)) {
            return Err(SettingsFault::Memory);
        }
        let ten = T::from_f64(10.0);
        if !(T::ZERO.lt(self.bandwidth) && (self.bandwidth * ten).le(update_rate_hz)) {
            return Err(SettingsFault::Bandwidth);
        }
        if !(T::ZERO.le(self.slip_velocity) && recursive::finite(self.slip_velocity)) {
            return Err(SettingsFault::SlipVelocity);
        }
        for (i, (low, high)) in self.lower.iter().zip(&self.upper).enumerate() {
            if !(low.lt(*high) && recursive::finite(*high - *low)) {
                return Err(SettingsFault::Band(i));
            }
        }
        Ok(())
    }
}

/// Result of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Update {
    /// The estimate was updated.
    Used,
    /// The row carried too little information for its noise: nothing was changed.
    Uninformative,
    /// Too soon after a reversal, standstill or the start: the Coulomb column is not valid yet.
    Masked,
    /// Not finite, or beyond the range of any rig: nothing was changed.
    Refused,
    /// Updated, and the residuals show that the parameters have jumped: estimation restarts from the band.
    Changed,
}

/// Published results of an estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report<T, const N: usize> {
    /// Estimates, inside their band.
    pub value: [T; N],
    /// Standard deviations; the band's half-width until they are known.
    pub std: [T; N],
    /// True if the estimate may be used: its standard deviation is known and at most
    /// [`recursive::TRUSTED_SHARE_OF_BAND`] of the band, and it is not pushed against the band's edge.
    pub trusted: [bool; N],
    /// RMS of the filtered residual, N·m.
    pub residual_rms: T,
}
