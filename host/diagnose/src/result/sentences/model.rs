//! Sentences on the written model: changed parameters, and remarks on its values.

use crate::models::parameter_change::{ChangeCause, ChangedValue};
use crate::models::payload::{AXES, Load};
use crate::models::remark::ModelRemark;
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit, format_value};

/// Maximum number of parameters reported with values.
const MOST_TOLD: usize = 8;
/// Torque at a joint, as a share of the payload's largest, above which the report names the joint.
const SHOWN: f64 = 0.02;

/// Says what has changed against the description.
pub(crate) fn change(robot: &Robot, cause: &ChangeCause) -> String {
    match cause {
        ChangeCause::Payload => {
            "Inertia and gravity have grown in the ratio of a mass at one place: a payload.".into()
        }
        ChangeCause::PayloadOnLast(load) => payload(robot, load),
        ChangeCause::OneFactor { percent } => format!(
            "All parameters have changed by {percent:.1} % together: the torque constant (or the scale of the torque) is not what the description says."
        ),
        ChangeCause::Single(own) => format!(
            "{} has changed from {} to {}.",
            own.name,
            format_significant(own.described, 4),
            format_value(own.value, own.std)
        ),
        ChangeCause::Several(moved) => several(moved),
        ChangeCause::Together => "The described values together do not fit, but this motion does not tell which of them have changed; record a livelier motion of all joints.".into(),
    }
}

/// Gives mass and place of a payload, and the joints that show them.
fn payload(robot: &Robot, load: &Load) -> String {
    let last = robot.joints.last().map_or("", |joint| joint.name.as_str());
    let at: Vec<String> = (AXES.iter().zip(&load.place))
        .map(|(axis, value)| match value {
            Some(v) => format!("{axis} = {} m", format_value(v.value, v.std)),
            None => format!("{axis} not told by this motion"),
        })
        .collect();
    let most = load.torque.iter().copied().fold(0.0, f64::max);
    let shown: Vec<String> = (robot.joints.iter().zip(&load.torque))
        .filter(|(_, rms)| **rms > SHOWN * most)
        .map(|(joint, rms)| {
            format!(
                "{} {} RMS at joint {}",
                format_significant(*rms, 3),
                format_unit(joint.kind.units().1),
                joint.name
            )
        })
        .collect();
    format!(
        "The description fits but for a payload on the last link: {} kg, its centre of mass at {} in the frame of joint {last}. It makes {}.",
        format_value(load.mass.value, load.mass.std),
        at.join(", "),
        shown.join(", "),
    )
}

/// Lists changed parameters.
fn several(moved: &[ChangedValue]) -> String {
    let told: Vec<String> = (moved.iter().take(MOST_TOLD))
        .map(|own| {
            format!(
                "{} {} where {} is described",
                own.name,
                format_value(own.value, own.std),
                format_significant(own.described, 4)
            )
        })
        .collect();
    format!(
        "Several nominal parameters differ from the description: {}{}.",
        told.join("; "),
        match moved.len().saturating_sub(MOST_TOLD) {
            0 => String::new(),
            more => format!("; and {more} more"),
        }
    )
}

/// Says what is to be known of the written model.
pub(crate) fn remark(robot: &Robot, remark: &ModelRemark) -> String {
    let name = |joint: usize| &robot.joints[joint].name;
    match remark {
        ModelRemark::OfIdentification(words) => words.clone(),
        ModelRemark::UnevenGear { kind, joint, times } => format!(
            "The data show {times:.2} times the torque that the {} of joint {} gives with the description's inertia and load; the description holds it once.",
            kind.about().title,
            name(*joint)
        ),
        ModelRemark::OutOfRange {
            parameter,
            effect,
            joint,
            value,
            kept,
            unit,
        } => format!(
            "{parameter} of {effect} at joint {} came out as {} {}, which cannot be; {} stands in the description.",
            name(*joint),
            format_significant(*value, 3),
            format_unit(unit),
            format_significant(*kept, 3),
        ),
        ModelRemark::NoBodies { error } => format!(
            "The links of model.toml are not made bodies that can exist ({error}); it may not be fit for simulation."
        ),
        ModelRemark::CostOfBodies { joint, percent } => format!(
            "Links are taken as bodies that can exist; of the training data that leaves up to {} % more than a fit that is free of it (joint {}).",
            format_significant(*percent, 2),
            name(*joint)
        ),
    }
}
