//! Checks for links larger than any real one: their values have another unit.

use super::fault::{Fault, Step, written};
use super::joint::Joint;
use super::link_size::{LARGEST_LINK, too_long, too_wide};
use super::right_angle::ROUNDING;
use super::urdf::SpatialInertia;
use rig_output::format_significant;

/// Sine of the angle between axes below which `d` is not a length of the robot, unless the axes are parallel: their
/// common normal lies far away.
const CROSSED: f64 = 0.1;

/// Returns the first joint with a length or inertia that no link has, and the fault with the path from that joint.
///
/// Judges only quantities that do not depend on the frames of nearly parallel axes: the distance of neighbouring axes,
/// the distance of the centre of mass from the axis, and the inertia about the centre of mass.
pub(super) fn oversized(joints: &[Joint]) -> Option<(usize, Fault)> {
    (0..joints.len()).find_map(|k| Some((k, of_joint(joints, k)?)))
}

fn of_joint(joints: &[Joint], k: usize) -> Option<Fault> {
    let joint = &joints[k];
    let length = |key_path: Vec<Step>, what: String, value: f64| {
        (value.abs() > LARGEST_LINK).then(|| Fault {
            key_path,
            what,
            found: format!("{} m", written(value)),
            advice: too_long(value),
        })
    };
    let name = &joint.name;
    let apart = format!("the distance of the axis of joint `{name}` from the one before (a)");
    if let Some(fault) = length(vec![Step::Key("a")], apart, joint.a) {
        return Some(fault);
    }
    // The axes on both sides of this one.
    let crossed = |other: Option<&Joint>| {
        other.is_none_or(|j| {
            let sine = j.alpha.sin().abs();
            !(ROUNDING..CROSSED).contains(&sine)
        })
    };
    let along = format!("the length along the axis of joint `{name}` (d)");
    if crossed(Some(joint))
        && crossed(joints.get(k + 1))
        && let Some(fault) = length(vec![Step::Key("d")], along, joint.d)
    {
        return Some(fault);
    }
    let inertial = joint.inertial.as_ref().filter(|i| i.mass > 0.0)?;
    let [x, y, _] = inertial.first_moment;
    let off = x.hypot(y) / inertial.mass;
    let key_path = |key| vec![Step::Key("inertial"), Step::Key(key)];
    if off > LARGEST_LINK {
        return Some(Fault {
            key_path: key_path("first_moment"),
            what: format!(
                "the distance of the centre of mass of the link of joint `{name}` from its axis"
            ),
            found: format!("{} m", format_significant(off, 4)),
            advice: too_long(off),
        });
    }
    let (_, about_centre) = SpatialInertia::of(inertial).about_centre()?;
    let largest = about_centre.amax();
    Some(Fault {
        key_path: key_path("inertia"),
        what: format!("the inertia of the link of joint `{name}` about its centre of mass"),
        found: format!("{} kg·m²", format_significant(largest, 4)),
        advice: too_wide(largest, inertial.mass)?,
    })
}

#[cfg(test)]
#[path = "unit_check_test.rs"]
mod tests;
