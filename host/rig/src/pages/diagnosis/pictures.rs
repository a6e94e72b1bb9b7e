//! The figures of a diagnosis that a text of one's own wants, each with the name of its file.

use super::gap;
use rig_diagnose::outcome::Diagnosis;
use rig_report::Plot;

/// What the names of the files begin with, in the order in which [`pictures`] gives them; a number from 1 and `.svg` follow.
pub const NAMES: [&str; 3] = ["gap", "effect", "left"];

/// Letters for which there is room below the axis of a picture of its own.
const ROOM: usize = 92;

/// The fall of the gap at each joint in which something was found or left (at all where nothing was), the residual map of each effect
/// that has one, and that of what is left, each map's middle where its bins crowd there.
pub fn pictures(found: &Diagnosis) -> Vec<(String, Plot)> {
    let [gap, effect, left] = NAMES;
    let named = |kind: &str, k: usize| format!("{kind}-{}.svg", k + 1);
    let remains = |joint: &str| found.remainder.as_ref().is_some_and(|r| r.joint == joint);
    let speaks = |joint: &str| remains(joint) || found.steps.iter().any(|s| s.joint == joint);
    let none = !found.waterfall.iter().any(|w| speaks(&w.joint));
    let joints = (found.waterfall.iter())
        .filter(|w| none || speaks(&w.joint))
        .enumerate()
        .map(|(k, w)| (named(gap, k), gap::bars(found, w, ROOM)));
    let effects = (0..found.steps.len()).filter_map(|k| {
        let map = found.maps.iter().find(|m| m.step == Some(k))?;
        Some((named(effect, k), gap::maps(map).pop()?))
    });
    let rest = (found.maps.iter())
        .filter(|m| m.step.is_none() && remains(&m.joint))
        .filter_map(|m| gap::maps(m).pop())
        .enumerate()
        .map(|(k, plot)| (named(left, k), plot));
    joints.chain(effects).chain(rest).collect()
}
