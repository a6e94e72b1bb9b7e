//! Width of the computations on several signals at once.

/// Signals, or sets of shapes, that are computed side by side.
pub(crate) const ABREAST: usize = 4;
