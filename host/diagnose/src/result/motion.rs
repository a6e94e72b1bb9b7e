//! Entries of the result on the simulated motion.

use crate::models::simulated_motion::Simulation;
use crate::outcome::ByMotion;
use crate::result::sentences::motion::{refitted, simulated};

/// Adds its summary to a refit to the simulated motion.
pub(crate) fn by_motion(told: ByMotion) -> ByMotion {
    ByMotion {
        text: refitted(&told),
        ..told
    }
}

/// Returns how the motion was simulated, or why it was not.
pub(crate) fn motion_how(simulation: &Simulation) -> String {
    simulated(simulation)
}
