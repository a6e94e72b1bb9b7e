//! Settings of a validation.

use rig_data::prepare::PrepareOptions;

/// Settings of a validation.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Filters, decimation, masks of the torque check.
    pub prepare: PrepareOptions,
    /// Simulation steps per sample; if absent, doubled until halving the step no longer matters.
    pub substeps: Option<u32>,
    /// Largest number of simulated samples per recording; memory grows with it.
    pub most_samples: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            prepare: PrepareOptions::default(),
            substeps: None,
            // Ten minutes at 1 kHz; about 50 MB per joint.
            most_samples: 600_000,
        }
    }
}
