//! The friction sweep of the experiments on the emulated rig.

use rig_shared::trajectory::FrictionSweep;

/// Speeds of the friction sweep, rad/s: below, at and well above the Stribeck velocity of a servo gear
/// (0.01 to 0.3 rad/s; Armstrong-Hélouvry, Dupont & Canudas de Wit 1994).
const SPEEDS: [f64; 12] = [
    0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.35, 0.6, 1.0, 1.5, 2.0,
];

/// Returns the friction sweep: at each speed, 0.01 to 2 rad/s, at least 0.4 rad in both directions. Returns `None` if
/// it cannot be built from its speeds.
pub fn friction_sweep() -> Option<FrictionSweep<f64>> {
    FrictionSweep::new(&SPEEDS, 0.4, 0.1, 0.3, 1.0)
}
