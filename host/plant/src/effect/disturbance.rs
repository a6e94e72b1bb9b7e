//! A small random torque on the joint, caused by table, cables and air.

/// Ornstein–Uhlenbeck torque: exponential autocorrelation, held over a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Standard deviation, N·m at the joint.
    pub std: f64,
    /// Correlation time, s.
    pub correlation_time: f64,
}

impl Disturbance {
    /// Returns the value one tick later, from a standard normal draw (exact discretisation).
    #[inline]
    pub fn next(&self, last: f64, tick: f64, normal: f64) -> f64 {
        let keep = (-tick / self.correlation_time).exp();
        keep * last + self.std * (1.0 - keep * keep).sqrt() * normal
    }
}
