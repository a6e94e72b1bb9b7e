//! Links larger than any that was built: values in another unit.
//!
//! The bound, 100 m, is by judgement: no link of an arm is so long, nor has its mass so far from its centre. Lengths in
//! millimetres and inertias in g·mm² are beyond it from links of 0.1 m and radii of gyration of 3 mm on.

use super::Joint;
use super::angles::ROUNDING;
use super::check::{Fault, Step, written};
use super::urdf::SpatialInertia;
use rig_output::format_significant;

/// No link is as long, nor its radius of gyration, m.
pub(super) const LARGEST_LINK: f64 = 100.0;
/// Between axes closer to parallel than this (but not parallel), as the sine of the angle, the common normal lies far away and
/// `d` is no length of the robot.
const CROSSED: f64 = 0.1;

/// What no link is large enough for, as the end of a sentence that names the value.
pub(super) fn too_long(length: f64) -> String {
    format!(
        "no link of a robot is {LARGEST_LINK} m long; it must be in m, and were these mm, it would be {}",
        format_significant(length / 1000.0, 4)
    )
}

/// What is wrong with moments of inertia of up to `largest` kg·m² about the centre of a mass of `mass` kg; none where
/// their radius of gyration can be.
pub(super) fn too_wide(largest: f64, mass: f64) -> Option<String> {
    let radius = (largest / mass).sqrt();
    (mass > 0.0 && radius > LARGEST_LINK).then(|| {
        let as_if = |factor: f64| format_significant(largest / factor, 4);
        format!(
            "at a mass of {} kg that is a radius of gyration of {} m, and no link of a robot is {LARGEST_LINK} m long; it must be in kg·m², and were it in kg·mm², it would be {}, in g·mm² {}",
            format_significant(mass, 4),
            format_significant(radius, 4),
            as_if(1e6),
            as_if(1e9)
        )
    })
}

/// The first length or inertia of `joints` that no link has, with the way to it from its joint on, and the joint.
///
/// Judged is what does not depend on where the frames of nearly parallel axes lie: the distance of neighbouring axes, that
/// of the centre of mass from the axis, and the inertia about the centre of mass.
pub(super) fn oversized(joints: &[Joint]) -> Option<(usize, Fault)> {
    (0..joints.len()).find_map(|k| Some((k, of_joint(joints, k)?)))
}

fn of_joint(joints: &[Joint], k: usize) -> Option<Fault> {
    let joint = &joints[k];
    let length = |way: Vec<Step>, what: String, value: f64| {
        (value.abs() > LARGEST_LINK).then(|| Fault {
            way,
            what,
            found: format!("{} m", written(value)),
            right: too_long(value),
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
    let way = |key| vec![Step::Key("inertial"), Step::Key(key)];
    if off > LARGEST_LINK {
        return Some(Fault {
            way: way("first_moment"),
            what: format!(
                "the distance of the centre of mass of the link of joint `{name}` from its axis"
            ),
            found: format!("{} m", format_significant(off, 4)),
            right: too_long(off),
        });
    }
    let (_, about_centre) = SpatialInertia::of(inertial).about_centre()?;
    let largest = about_centre.amax();
    Some(Fault {
        way: way("inertia"),
        what: format!("the inertia of the link of joint `{name}` about its centre of mass"),
        found: format!("{} kg·m²", format_significant(largest, 4)),
        right: too_wide(largest, inertial.mass)?,
    })
}

#[cfg(test)]
#[path = "sizes_test.rs"]
mod tests;
