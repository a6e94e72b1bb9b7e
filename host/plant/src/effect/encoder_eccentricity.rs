//! Eccentric code disc or magnet: a periodic reading error per turn.

/// Reading error amplitude·sin(θ + phase), on the encoder's own shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderEccentricity {
    /// rad of the motor shaft.
    pub amplitude: f64,
    /// rad.
    pub phase: f64,
}

impl EncoderEccentricity {
    /// Error of the reading at shaft angle `angle`, rad.
    #[inline]
    pub fn error(&self, angle: f64) -> f64 {
        self.amplitude * (angle + self.phase).sin()
    }
}
