//! Sentences on what the recordings cannot show, and on the next experiment.

use crate::outcome::NotTestable;
use rig_output::{format_unit, format_value};

/// Reason why an effect is not testable whose torque is collinear with other parameters, a clause.
pub(crate) const COLLINEAR: &str =
    "along this motion its torque is a combination of what the model's other parameters give";

/// Experiment for a collinear effect of which no other one is known.
pub(crate) const RICHER_MOTION: &str = "state the friction, mass and first moments in the description, or record a motion with more positions, speeds and loads";

/// Names the experiment that would show an untestable effect.
pub(crate) fn to_test(lacking: &NotTestable) -> String {
    format!(
        "For {} at joint {}: {}.",
        lacking.effect, lacking.joint, lacking.experiment
    )
}

/// Data that were given, and that did not decide between names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum GivenAlready {
    /// A log with the drive off.
    DriveOff {
        /// Its mean reading and the standard deviation of it.
        zero: [f64; 2],
        /// Their unit, ASCII.
        unit: &'static str,
    },
    /// A recording without external loads.
    PullsOff,
}

/// Says that the requested data were given and were not sufficient, with a space after it.
pub(crate) fn given_already(given: GivenAlready) -> String {
    match given {
        GivenAlready::DriveOff {
            zero: [zero, std],
            unit,
        } => format!(
            "The log given with --drive-off reads {} {}, which does not decide it: record a longer one, of ten times that length for a third of its uncertainty. ",
            format_value(zero, std),
            format_unit(unit)
        ),
        GivenAlready::PullsOff => {
            "The recording given with --pulls-off does not decide it: it has to hold the same motion, for as long as the others. ".to_owned()
        }
    }
}
