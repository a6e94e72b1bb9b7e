//! Measured curves and the predictions of the models.

use super::words;
use crate::pages::parts;
use rig_diagnose::outcome::{Curves, Diagnosis};
use rig_report::{Axis, Block, Marker, Plot, Role, Section, Series};

/// Torque and motion over time, measured and by both models.
pub(super) fn section(found: &Diagnosis) -> Option<Section> {
    let drawn: Vec<&Curves> = found.curves.iter().filter(|c| !c.t.is_empty()).collect();
    if drawn.is_empty() {
        return None;
    }
    let mut section = Section::new(
        "curves",
        "Measured and predicted, over time",
        "A stretch of a recording, predicted by the refitted model without the effects and with them. First the curves themselves, then the error of each model.",
    );
    if !found.motion_how.is_empty() {
        section = section.with(Block::Text(found.motion_how.clone()));
    }
    let joints = drawn.len();
    for curves in drawn {
        let mut blocks = Vec::new();
        let unit = found
            .waterfall
            .iter()
            .find(|w| w.joint == curves.joint)
            .map_or("", |w| w.unit.as_str());
        if curves.torque.iter().any(|t| !t.is_empty()) {
            blocks.extend(torque(curves, unit).map(Block::Plot));
        }
        if curves.motion.iter().any(|m| !m.is_empty()) {
            blocks.extend(motion(curves, words::position_unit(unit)).map(Block::Plot));
        }
        let what = "torque and motion over time";
        section
            .blocks
            .extend(parts::of_joint(&curves.joint, joints, what, blocks));
    }
    Some(section)
}

const NAMES: [(&str, Role); 3] = [
    ("measured", Role::Measured),
    ("without the effects", Role::Before),
    ("with the effects", Role::After),
];

/// Draws the three curves, and the errors of both models (measured less predicted) times `scale`.
fn pair(curves: &Curves, of: &[Vec<f64>; 3], plots: [Plot; 2], scale: f64) -> [Plot; 2] {
    let [mut whole, mut missed] = plots;
    for (values, (name, role)) in of.iter().zip(NAMES).filter(|(v, _)| !v.is_empty()) {
        let line = Series::line(name, role, curves.t.clone(), values.clone());
        // Dashed, so that the measured curve stays visible below it.
        whole = whole.with(if role == Role::After {
            line.dashed()
        } else {
            line
        });
        if role != Role::Measured {
            let error = of[0]
                .iter()
                .zip(values)
                .map(|(measured, value)| scale * (measured - value))
                .collect();
            missed = missed.with(Series::line(name, role, curves.t.clone(), error));
        }
    }
    let note = format!("{}, n = {}.", curves.recording, curves.t.len());
    whole.height = 280;
    missed.height = 280;
    [
        whole.note(note.clone()),
        missed.mark(Marker::horizontal(0.0, "")).note(note),
    ]
}

fn torque(curves: &Curves, unit: &str) -> [Plot; 2] {
    let what = if unit == "N" { "force" } else { "torque" };
    let unit = parts::unit(unit);
    let time = || Axis::new("time", "s");
    pair(
        curves,
        &curves.torque,
        [
            Plot::new(
                format!("Joint {}: {what}, measured and predicted", curves.joint),
                time(),
                Axis::new(what, &unit),
            ),
            Plot::new(
                format!("Joint {}: {what} error of each model", curves.joint),
                time(),
                Axis::new("measured less predicted", &unit),
            ),
        ],
        1.0,
    )
}

fn motion(curves: &Curves, unit: &str) -> [Plot; 2] {
    let time = || Axis::new("time", "s");
    pair(
        curves,
        &curves.motion,
        [
            Plot::new(
                format!("Joint {}: position, measured and simulated", curves.joint),
                time(),
                Axis::new("position", unit),
            ),
            Plot::new(
                format!("Joint {}: position error of each simulation", curves.joint),
                time(),
                Axis::new("measured less simulated", &format!("m{unit}")),
            ),
        ],
        1e3,
    )
}
