//! Levels of the residual that several searches for faults share.

/// Residual share of the torque's variance above which other units or times are tried.
pub(crate) const POOR: f64 = 0.1;
/// The same where few parameters or a known description cannot compensate a fault.
pub(crate) const POOR_ALONE: f64 = 0.01;
/// Residual share below which an explanation is good.
pub(crate) const GOOD: f64 = 0.2;
/// Ratio of residuals below which a trial is believed, for factors that no unit has and for a reversed position, which
/// any model may prefer by chance.
pub(crate) const MUCH_BETTER: f64 = 0.2;
/// Share of a torque's variance that rounding leaves, the least scale of data without noise.
pub(crate) const EXACT: f64 = 1e-6;
/// Rows of one trial.
pub(crate) const TRIAL: usize = 500;
/// Least fall of the log residual variance, summed over joints, for a fault: one joint's variance halves.
pub(crate) const WORTH: f64 = core::f64::consts::LN_2;
/// Least log odds of a fault, as its prior odds are one to a thousand.
pub(crate) const ODDS: f64 = 6.9;
