//! Levels of significance and size that several stages share.

/// Family-wise significance level of an effect.
pub(crate) const SIGNIFICANT: f64 = 0.01;

/// p-value above which an effect is dropped: the 95 % region of its gains contains zero.
pub(crate) const NOTHING: f64 = 0.05;

/// Least RMS share that an effect must remove on folds outside its fit (its gain).
pub(crate) const LEAST_GAIN: f64 = 0.02;

/// Residual-to-noise RMS ratio above which a joint has an unexplained residual. For motions that were not repeated,
/// with slightly different noise, and for joints with backlash, where each law has errors at contact. Model mismatch is
/// extra.
pub(crate) const BEYOND_FLOOR: f64 = 1.12;

/// Least natural frequency of a link on closed contacts, Hz; a lower one shows another elasticity beside them.
pub(crate) const CLOSED_TEETH: f64 = 16.0;
