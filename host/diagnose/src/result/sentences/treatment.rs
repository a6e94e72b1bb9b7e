//! Sentences on the treatment of the recordings.

use rig_data::prepare::PreprocessingPlan;

/// Gives the reason for the cut-off of the position.
pub(crate) fn cutoff(treatment: &PreprocessingPlan) -> String {
    match treatment.spectral_cutoff {
        Some(spectral) => format!(
            "{:.3} Hz: up to there the torque goes with the acceleration. The spectrum of the position alone gives {spectral:.3} Hz; its noise is not white (time stamps with jitter, a coarse encoder, or a position that was filtered before it was recorded).",
            treatment.cutoff
        ),
        None => treatment.cutoff_reason.clone(),
    }
}
