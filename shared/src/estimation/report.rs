//! What an estimator tells: the result of a sample, and its estimates.

/// Result of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Update {
    /// The estimate was updated.
    Used,
    /// The row carried too little information for its noise: nothing was changed.
    Uninformative,
    /// Slower than the slip velocity: the Coulomb column is not valid.
    Slow,
    /// Too soon after a reversal, standstill or the start: the Coulomb column is not valid yet.
    Masked,
    /// Not finite, or beyond the range of any rig: nothing was changed.
    Invalid,
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
    /// [`TRUSTED_SHARE_OF_BAND`](super::recursive::TRUSTED_SHARE_OF_BAND) of the band, and it is not pushed against the band's edge.
    pub trusted: [bool; N],
    /// RMS of the filtered residual, N·m.
    pub residual_rms: T,
}
