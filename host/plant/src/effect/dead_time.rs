//! Dead time of the half-bridges: while both switches are open the current picks the voltage.
//!
//! Leaves out: the ripple within one PWM period; the error is its mean over the period.

/// Mean voltage error against the current's sign (Holtz 1992: dead time · PWM frequency · supply, plus
/// device drops).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadTime {
    /// Full error, V.
    pub voltage: f64,
    /// Current below which the ripple crosses zero within the period and the error fades, A.
    pub fade_current: f64,
}

impl DeadTime {
    /// Voltage lost at `current`, V, of the current's sign.
    #[inline]
    pub fn drop(&self, current: f64) -> f64 {
        self.voltage * (current / self.fade_current).clamp(-1.0, 1.0)
    }
}
