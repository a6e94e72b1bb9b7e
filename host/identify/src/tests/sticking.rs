//! Arms that stick at their reversals: what is left there is neither noise of the position nor a lead of the torque.

use super::bias::{Drive, driven, shipped};
use super::*;

/// The noise of the position is white, so its spectrum shows where the motion ends. Controllers act at every step, so the
/// torque has no lead. Constant torques are zero.
#[test]
fn stays_at_reversals_change_neither_the_cut_off_nor_the_instant() {
    let drive = Drive {
        pace: 0.5,
        position: 1e-5,
        torque: 1e-3,
        held: false,
    };
    for (file, seeds) in [("edda.toml", 2), ("irp6.toml", 4)] {
        for seed in 0..seeds {
            let (robot, recording) = driven(shipped(file), seed, &drive);
            let options = Options {
                compare: Vec::new(),
                ..Default::default()
            };
            let found = identify(&robot, &[&recording], &[], &options).unwrap();
            let treatment = &found.details.treatment;
            let lower = treatment
                .spectral_cutoff
                .is_some_and(|s| treatment.cutoff < s);
            assert!(!lower, "{file} {seed}: {:?}", treatment.spectral_cutoff);
            assert!(
                treatment.cutoff > 5.0 * treatment.motion_frequency,
                "{file} {seed}"
            );
            for warning in &found.warnings {
                let lead = matches!(warning, Warning::TorqueLead { .. });
                assert!(!lead, "{file} {seed}: {warning}");
            }
            let constants =
                (found.base_parameters.iter()).filter(|b| b.expression.starts_with("off"));
            for own in constants {
                assert!(
                    own.value.abs() < 4.0 * own.std,
                    "{file} {seed}: {}",
                    own.expression
                );
            }
        }
    }
}
