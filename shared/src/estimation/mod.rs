//! On-line estimation of parameters that enter linearly.

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
    /// Speed below which friction may be in presliding and sgn q̇ is not what it does, rad/s.
    pub slip_velocity: T,
    /// Smallest plausible value of each parameter.
    pub lower: [T; PARAMETER_COUNT],
    /// Largest plausible value of each parameter.
    pub upper: [T; PARAMETER_COUNT],
}

/// What is wrong with settings.
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
    /// Sensible settings for a band: least squares, a memory of 60 s, 30 Hz of bandwidth (well above the motion of a
    /// link, well below a current loop), and a slip velocity of 0.05 rad/s (a presliding range of some
    /// 10⁻³ rad is then left within the filter's memory).
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

    /// Whether the settings can be run at this update rate, Hz.
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

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Update {
    /// The estimate was updated.
    Used,
    /// The row carried no information worth its noise: nothing was changed.
    Uninformative,
    /// Too soon after a reversal, standstill or the start for the Coulomb column to be true.
    Masked,
    /// Not finite, or beyond any rig: nothing was changed.
    Refused,
    /// Updated, and the residuals say that the parameters have jumped: estimation starts over from the band.
    Changed,
}

/// What an estimator publishes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report<T, const N: usize> {
    /// Estimates, inside their band.
    pub value: [T; N],
    /// Standard deviation of each; the band's half-width until one is known.
    pub std: [T; N],
    /// Whether the estimate may be used: standard deviation known and below
    /// [`recursive::TRUSTED_SHARE_OF_BAND`] of the band, and not pushed against its edge.
    pub trusted: [bool; N],
    /// RMS of the filtered residual, N·m.
    pub residual_rms: T,
}
