//! Settings of a comparison.

/// Settings of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareOptions {
    /// How each set is identified. Terms beyond the description are never searched, so that all sets have one model.
    pub identify: rig_identify::Options,
    /// Share of a joint's torque RMS above which a difference of the parameters matters.
    pub tolerance: f64,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self {
            identify: rig_identify::Options::default(),
            tolerance: 0.05,
        }
    }
}
