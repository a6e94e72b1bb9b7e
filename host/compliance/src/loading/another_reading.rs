//! Another reading of recordings whose displacement does not follow the force: exchanged axes, a reversed axis, the axes of a
//! sensor or of the base, angles in degrees.
//!
//! Each reading is a regression of its own, without gaps. One counts if it explains what the recorded reading leaves: its
//! own lack of fit is not told, its residual is less than half, and every stiffness that it shows is positive. Simple
//! readings come first; a later one must leave clearly less. The axes of an undescribed sensor are those of the flange,
//! turned about its z axis by an angle that is searched.
//!
//! Leaves out: several mistakes at once, sensors that are tilted against the flange, and recordings that differ in their axes.

use std::f64::consts::PI;

use rig_model::robot::JointKind;
use rig_output::format_significant;

use super::fit::Lack;
use super::tool::{Judged, judged};
use crate::signals::Signals;
use crate::tool_point::ToolPoint;

/// Residual over that of the recorded reading, below which another reading explains the displacement.
const EXPLAINS: f64 = 0.5;
/// Residual over that of an earlier reading, below which a later one is better.
const BETTER: f64 = 0.7;
/// Steps of the angle of an undescribed sensor: 10°.
const TURNS: usize = 36;
/// Halvings of the step about the best angle, down to 0.3°.
const HALVINGS: usize = 5;

const FORCE: [&str; 3] = ["fx", "fy", "fz"];
const MOMENT: [&str; 3] = ["mx", "my", "mz"];
const DISPLACED: [&str; 3] = ["dx", "dy", "dz"];

/// A reading: words for it and the remedy.
struct Reading {
    words: String,
    remedy: &'static str,
    judged: Judged,
}

/// Returns a sentence about the reading that explains the displacement; `None` if there is none. `lack` is that of the
/// recorded reading.
pub(super) fn another_reading(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
    lack: &Lack,
) -> Option<String> {
    let simple = exchanges(tool, stretches)
        .into_iter()
        .chain(reversals(tool, stretches))
        .chain(degrees(tool, stretches))
        .chain(frames(tool, stretches));
    let mut best = simple.fold(None, |best, found| better(best, found, lack));
    if best.is_none() {
        best = turned(tool, stretches).and_then(|found| better(None, found, lack));
    }
    let best = best.filter(|own| own.judged.lack.told("m").is_none() && own.judged.positive())?;
    let sign = match best.judged.negative > 0 {
        true => " and the opposite sign",
        false => "",
    };
    Some(format!(
        "The displacement of the tool point does not follow the force as it is read: the springs leave {} m (RMS) of {} m. With {}{sign} they leave {} m. {}",
        format_significant(lack.residual, 3),
        format_significant(lack.signal, 3),
        best.words,
        format_significant(best.judged.lack.residual, 3),
        best.remedy
    ))
}

/// Returns the better one of an earlier and a later reading, if it leaves less than half of the recorded one.
fn better(best: Option<Reading>, found: Reading, lack: &Lack) -> Option<Reading> {
    let left = found.judged.lack.residual;
    let bound = match &best {
        Some(own) => BETTER * own.judged.lack.residual,
        None => EXPLAINS * lack.residual,
    };
    if left < bound { Some(found) } else { best }
}

/// Judges changed recordings.
fn changed(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
    change: impl Fn(&Signals) -> Option<Signals>,
) -> Option<Judged> {
    let all = (stretches.iter())
        .map(|s| change(s))
        .collect::<Option<Vec<_>>>()?;
    judged(tool, &all.iter().collect::<Vec<_>>())
}

/// Exchanged axes of the force (its moment alike), and of the displacement.
fn exchanges(tool: &ToolPoint<'_>, stretches: &[&Signals]) -> Vec<Reading> {
    const ORDERS: [[usize; 3]; 5] = [[1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];
    let mut all = Vec::new();
    for (columns, more) in [(FORCE, Some(MOMENT)), (DISPLACED, None)] {
        for order in ORDERS {
            let from = order.map(|k| columns[k]);
            let judged = changed(tool, stretches, |signals| {
                let mut own = signals.exchanged(columns, from)?;
                if let Some(moment) = more {
                    own = own
                        .exchanged(moment, order.map(|k| moment[k]))
                        .unwrap_or(own);
                }
                Some(own)
            });
            let moved: Vec<&str> = (0..3)
                .filter(|k| order[*k] != *k)
                .map(|k| columns[k])
                .collect();
            let words = match moved.as_slice() {
                [a, b] => format!("{a} and {b} exchanged"),
                _ => format!("{} taken as {}", from.join(", "), columns.join(", ")),
            };
            all.extend(judged.map(|judged| Reading {
                words,
                remedy: "Correct the columns of the recordings.",
                judged,
            }));
        }
    }
    all
}

/// One axis of the force or of the displacement with the opposite sign.
fn reversals(tool: &ToolPoint<'_>, stretches: &[&Signals]) -> Vec<Reading> {
    (FORCE.iter().chain(&DISPLACED))
        .filter_map(|column| {
            let judged = changed(tool, stretches, |signals| signals.reversed(column))?;
            Some(Reading {
                words: format!("{column} reversed"),
                remedy: "Correct the sign of this column in the recordings.",
                judged,
            })
        })
        .collect()
}

/// Positions of revolute joints in degrees.
fn degrees(tool: &ToolPoint<'_>, stretches: &[&Signals]) -> Option<Reading> {
    let kinds: Vec<bool> = (tool.robot().joints.iter())
        .map(|joint| joint.kind == JointKind::Revolute)
        .collect();
    let judged = changed(tool, stretches, |signals| Some(signals.in_radians(&kinds)))?;
    Some(Reading {
        words: "the positions q taken as degrees".to_owned(),
        remedy: "Record positions in rad (1° is 0.01745 rad).",
        judged,
    })
}

/// The described frame that was not chosen.
fn frames(tool: &ToolPoint<'_>, stretches: &[&Signals]) -> Vec<Reading> {
    let (other, words, remedy) = match tool.is_sensed() {
        true => (
            Some(tool.clone().in_base_axes()),
            "the force taken in the axes of the base, at the tool point",
            "Give --wrench base.",
        ),
        false => (
            tool.clone().with_sensor().ok(),
            "the force taken as readings of the [wrist_sensor]",
            "Give --wrench sensor.",
        ),
    };
    let judged = other.and_then(|other| judged(&other, stretches));
    (judged.into_iter())
        .map(|judged| Reading {
            words: words.to_owned(),
            remedy,
            judged,
        })
        .collect()
}

/// The axes of the flange, turned about its z axis by the angle that leaves least.
fn turned(tool: &ToolPoint<'_>, stretches: &[&Signals]) -> Option<Reading> {
    let forces: Vec<Signals> = stretches
        .iter()
        .map(|s| s.without_columns(&MOMENT))
        .collect();
    let forces: Vec<&Signals> = forces.iter().collect();
    let at = |angle: f64| {
        let found = judged(&tool.clone().in_flange_axes(angle), &forces)?;
        Some((angle, found))
    };
    let step = 2.0 * PI / TURNS as f64;
    let less =
        |a: &(f64, Judged), b: &(f64, Judged)| a.1.lack.residual.total_cmp(&b.1.lack.residual);
    let mut best = (0..TURNS)
        .filter_map(|k| at(step * k as f64))
        .min_by(less)?;
    let mut step = 0.5 * step;
    for _ in 0..HALVINGS {
        let beside = [best.0 - step, best.0 + step];
        if let Some(better) = (beside.into_iter().filter_map(&at))
            .min_by(less)
            .filter(|own| less(own, &best).is_lt())
        {
            best = better;
        }
        step *= 0.5;
    }
    // Half a turn about z and the opposite sign differ by the sign along z alone; the angle is that of the first.
    let angle = best.0.rem_euclid(2.0 * PI).to_degrees().round() % 360.0;
    let about = match angle == 0.0 {
        true => String::new(),
        false => format!(", turned by {angle} degrees about its z axis"),
    };
    Some(Reading {
        words: format!("the force taken in the axes of the flange{about}"),
        remedy: "So a wrist sensor reads it: describe the [wrist_sensor] (position, rotation, reads), or record the force in the axes of the base.",
        judged: best.1,
    })
}
