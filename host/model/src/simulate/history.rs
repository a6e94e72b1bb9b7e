//! What happened before a simulation.

use rig_shared::effects::Memory;

/// History before a simulation begins; empty by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Since {
    /// Time for which the joints have been running, s.
    pub time: f64,
    /// Hidden state of each effect of the model; empty if there is none.
    pub memory: Vec<Memory<f64>>,
}
