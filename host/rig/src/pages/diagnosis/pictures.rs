//! Figures of a diagnosis for use in other texts, each with the name of its file.

use super::gap;
use rig_diagnose::outcome::Diagnosis;
use rig_report::Plot;

/// First parts of the file names, in the order of [`pictures`]; a number from 1 and `.svg` follow.
pub const NAMES: [&str; 3] = ["gap", "effect", "left"];

/// Number of letters that fit below the axis of a separate picture.
const ROOM: usize = 92;

/// Returns the residual of each model at each joint with an effect or a remainder (at all joints if there is none), the
/// residual map of each effect that has one, and the maps of the remainder. Of a map with crowded bins it returns the
/// middle range.
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
