//! Limits of joints.

use std::f64::consts::TAU;

use super::finding::Audit;
use crate::robot::error::RobotError;
use crate::robot::urdf::reader::{Reader, child};
use crate::robot::urdf::tree::{Motion, Tree, TreeJoint};
use crate::robot::urdf::values::is_placeholder;
use rig_output::format_significant;

/// Turns to either side of zero above which a limit looks like degrees.
const TURNS: f64 = 2.0;
/// Round effort limits from this value on count as placeholders, N·m or N.
const UNKNOWN_EFFORT: f64 = 1e4;

/// Checks the limits of every joint that moves.
///
/// # Errors
/// A limit is no number.
pub(super) fn limits<'a>(
    audit: &mut Audit,
    reader: &Reader<'a>,
    tree: &Tree<'a>,
) -> Result<(), RobotError> {
    let moving = || (tree.joints.iter()).filter(|joint| joint.motion.is_single());
    audit.checked("limit", "limits of joints", moving().count());
    for joint in moving() {
        for why in faults(reader, joint)? {
            let place = reader.place(child(joint.node, "limit").unwrap_or(joint.node));
            let sentence = format!("joint `{}` {why}", joint.name);
            audit.find("limit", joint.name, place, sentence);
        }
    }
    Ok(())
}

/// Returns the faults of a joint's limits, each as the rest of a sentence about the joint.
fn faults<'a>(reader: &Reader<'a>, joint: &TreeJoint<'a>) -> Result<Vec<String>, RobotError> {
    let number = |value: f64| format_significant(value, 4);
    let endless = joint.motion == Motion::Continuous;
    let Some(node) = child(joint.node, "limit") else {
        let missing = "has no <limit>, which URDF demands of revolute and prismatic joints";
        return Ok(if endless {
            Vec::new()
        } else {
            vec![missing.to_owned()]
        });
    };
    let mut found = Vec::new();
    let unit = joint.motion.unit();
    let (low, high) = (
        reader.optional_number(node, "lower")?.unwrap_or(0.0),
        reader.optional_number(node, "upper")?.unwrap_or(0.0),
    );
    if !endless && low >= high {
        found.push(format!("has a lower limit of {} and an upper limit of {} {unit}, but lower must be below upper", number(low), number(high)));
    }
    let reach = low.abs().max(high.abs());
    if joint.motion == Motion::Revolute && reach > TURNS * TAU {
        found.push(format!("has limits of {} to {} rad, more than {TURNS} turns; were these degrees, they would be {} to {} rad", number(low), number(high), number(low.to_radians()), number(high.to_radians())));
    }
    match reader.optional_number(node, "velocity")? {
        None => found.push(format!(
            "has no velocity limit; add velocity=\"…\" in {unit}/s"
        )),
        Some(v) if v <= 0.0 => found.push(format!(
            "has a velocity limit of {}, which lets it not move",
            number(v)
        )),
        Some(_) => {}
    }
    match reader.optional_number(node, "effort")? {
        None => {
            found.push("has no effort limit; add effort=\"…\" in N·m (N if prismatic)".to_owned())
        }
        Some(e) if e < 0.0 => found.push(format!(
            "has an effort limit of {}, but it must be above zero",
            number(e)
        )),
        Some(0.0) => {
            found.push("has an effort limit of 0, so a simulator gives it no torque".to_owned())
        }
        Some(e) if is_placeholder(e, UNKNOWN_EFFORT) => {
            found.push(format!(
                "has an effort limit of {}, which looks like a placeholder",
                number(e)
            ));
        }
        Some(_) => {}
    }
    Ok(found)
}
