//! Recordings that count as one.

use rig_data::prepare::Recording;

/// Recordings that are identified together: one day, one specimen, one controller gain.
pub struct RecordingSet<'a> {
    /// Name, unique.
    pub name: String,
    /// Its recordings.
    pub recordings: Vec<&'a dyn Recording>,
}
