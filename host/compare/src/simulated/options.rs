//! Settings of a simulated comparison.

/// Settings of a simulated comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulateOptions {
    /// Seed of motions and noise.
    pub seed: u64,
    /// Sample rate, Hz.
    pub rate: f64,
    /// Harmonics of the motions.
    pub harmonics: usize,
    /// Whole periods at full amplitude.
    pub periods: u16,
    /// Starts of the design.
    pub starts: u32,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            rate: 500.0,
            harmonics: 3,
            periods: 3,
            starts: 2,
        }
    }
}
