//! The figures of a diagnosis that a text of one's own wants, each with the name of its file.

use super::gap;
use crate::diagnose::outcome::Diagnosis;
use crate::report::Plot;

/// What the names of the files begin with, in the order in which [`pictures`] gives them; a number from 1 and `.svg` follow.
pub const NAMES: [&str; 2] = ["gap", "effect"];

/// Letters for which there is room below the axis of a picture of its own.
const ROOM: usize = 92;

/// The fall of the gap at each joint in which something was found, and the residual map of each effect that has one, its middle where
/// the bins crowd there.
pub fn pictures(found: &Diagnosis) -> Vec<(String, Plot)> {
    let [gap, effect] = NAMES;
    let joints = (found.waterfall.iter())
        .filter(|w| found.steps.iter().any(|step| step.joint == w.joint))
        .enumerate()
        .map(|(k, w)| (format!("{gap}-{}.svg", k + 1), gap::bars(found, w, ROOM)));
    let effects = (0..found.steps.len()).filter_map(|k| {
        let map = found.maps.iter().find(|m| m.step == Some(k))?;
        let mut plot = gap::maps(found, map).pop()?;
        // Nothing stands beside it to share a scale with.
        plot.reach = None;
        Some((format!("{effect}-{}.svg", k + 1), plot))
    });
    joints.chain(effects).collect()
}
