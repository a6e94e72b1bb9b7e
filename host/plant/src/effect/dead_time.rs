//! Dead time of the half-bridges: while both switches are open, the current determines the voltage.
//!
//! Not modelled: the ripple within one PWM period; the error is its mean over the period.

/// Mean voltage error opposite to the current (Holtz 1992: dead time · PWM frequency · supply, plus device drops).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadTime {
    /// Full error, V.
    pub voltage: f64,
    /// Current below which the ripple crosses zero within the period and the error decreases, A.
    pub fade_current: f64,
}

impl DeadTime {
    /// Voltage loss at `current`, V, with the sign of the current.
    #[inline]
    pub fn drop(&self, current: f64) -> f64 {
        self.voltage * (current / self.fade_current).clamp(-1.0, 1.0)
    }
}
