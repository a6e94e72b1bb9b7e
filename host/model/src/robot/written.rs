//! Writes a description as TOML, each line with its unit.

use rig_output::{comment_toml, toml_document, toml_tables};
use toml_edit::{DocumentMut, Item, Table, value};

use super::check_effects::check_effects;
use super::effects::{RobotEffect, unit_of};
use super::error::RobotError;
use super::joint::JointKind;
use super::serial_robot::Robot;

/// Tables of numbers by joint, written on one line.
const BY_JOINT: [&str; 2] = ["couples", "angle"];

/// Keys, by table, that are left out where they have the value that an absent key means.
const LEFT_OUT: [(&str, &[&str]); 3] = [
    (
        "drive",
        &[
            "gear_ratio",
            "zero",
            "joint_inertia",
            "coulomb",
            "viscous",
            "torque_constant",
        ],
    ),
    (
        "voltage_controller",
        &[
            "integral",
            "derivative",
            "velocity_feedforward",
            "acceleration_feedforward",
            "bias",
            "anti_windup",
        ],
    ),
    ("identified", &["torque_lead"]),
];

/// Comment above the table of uncertainties.
const ABOUT_UNCERTAINTY: &str = "
# Standard deviations of the base parameters along independent directions, SI: two of them have the sum of the products of
# their lists as covariance. Remove the table if you change the values above.
";

pub(super) fn write(robot: &Robot) -> Result<String, RobotError> {
    let refused = |message| RobotError::Write {
        robot: robot.name.clone(),
        message,
    };
    check_effects(robot).map_err(|fault| {
        refused(format!(
            "{} is {}, but {}",
            fault.what, fault.found, fault.advice
        ))
    })?;
    let mut document = toml_document(robot, &BY_JOINT).map_err(|e| refused(e.to_string()))?;
    leave_out(&mut document);
    comment_toml(&mut document, &comments(JointKind::Revolute));
    if let Some(Item::Table(table)) = document.get_mut("uncertainty") {
        table.decor_mut().set_prefix(ABOUT_UNCERTAINTY);
    }
    for (table, joint) in toml_tables(&mut document, "joint").zip(&robot.joints) {
        leave_out(table);
        if let Item::Table(comments) = &comments(joint.kind)["joint"] {
            comment_toml(table, comments);
        }
    }
    for (table, own) in toml_tables(&mut document, "follower").zip(&robot.followers) {
        if let Item::Table(comments) = &comments(own.kind)["follower"] {
            comment_toml(table, comments);
        }
    }
    for (table, effect) in toml_tables(&mut document, "effect").zip(&robot.effects) {
        comment_toml(table, &comments_on(robot, effect));
    }
    Ok(document.to_string())
}

/// Removes the keys of [`LEFT_OUT`] from the tables in a table.
fn leave_out(table: &mut Table) {
    for (name, keys) in LEFT_OUT {
        if let Some(Item::Table(below)) = table.get_mut(name) {
            let turned_by_ratio = !below.contains_key("screw");
            below.retain(|key, item| {
                let absent = item.as_float() == Some(0.0) || item.as_str() == Some("none");
                let needed = key == "gear_ratio" && turned_by_ratio;
                !keys.contains(&key) || !absent || needed
            });
        }
    }
}

/// Returns the comments by table and key, with the units of a joint of that kind.
pub(super) fn comments(kind: JointKind) -> DocumentMut {
    let (angle, force) = kind.units();
    let text = include_str!("comments.toml");
    let text = text.replace("{angle}", angle).replace("{force}", force);
    text.parse().unwrap_or_default()
}

/// Returns the comments on the table of an effect.
fn comments_on(robot: &Robot, effect: &RobotEffect) -> Table {
    let about = effect.effect.kind.about();
    let kind = robot
        .joint_of(effect)
        .map_or(JointKind::Revolute, |j| robot.joints[j].kind);
    let mut comments = Table::from_iter([
        ("kind", about.title),
        ("law", about.source),
        ("joint", "on which it acts"),
        ("other", "whose motion it depends on"),
    ]);
    for (p, _) in effect.values() {
        comments.insert(
            p.name,
            value(format!("{}, {}", unit_of(p, kind), p.meaning)),
        );
    }
    comments
}
