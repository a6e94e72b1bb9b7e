//! Checks of the effects: each table alone, and on the joints of the robot.

use std::collections::HashSet;

use rig_shared::effects::Channel;

use super::effects::{Refusal, RobotEffect, has_other};
use super::fault::Fault;
use super::serial_robot::Robot;

/// Returns the first fault of the effect tables themselves.
pub(super) fn check_tables(tables: &[toml::Value]) -> Result<(), Fault> {
    for (i, table) in tables.iter().enumerate() {
        if let Some(table) = table.as_table() {
            RobotEffect::from_table(table).map_err(|refusal| refusal.at(i))?;
        }
    }
    Ok(())
}

/// Checks that the joints of all effects exist and can have these effects.
pub(super) fn check_effects(robot: &Robot) -> Result<(), Fault> {
    let joints: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    let names = format!("this robot's joints are {}", joints.join(", "));
    let (mut elastic, mut presliding) = (HashSet::new(), HashSet::new());
    for (i, effect) in robot.effects.iter().enumerate() {
        let table = toml::Table::from(effect.clone());
        RobotEffect::from_table(&table).map_err(|refusal| refusal.at(i))?;
        let kind = effect.effect.kind;
        let refuse = |key: &str, found: &Option<String>, advice: &str| {
            Refusal {
                key: Some(key.to_owned()),
                what: format!("the {key}"),
                found: found
                    .as_ref()
                    .map_or_else(|| "missing".into(), |name| format!("`{name}`")),
                advice: advice.to_owned(),
            }
            .at(i)
        };
        let Some(joint) = robot.joint_of(effect) else {
            return Err(refuse("joint", &effect.joint, &names));
        };
        if has_other(kind) {
            let other = effect.other.as_deref().and_then(|n| robot.joint_index(n));
            if other.is_none_or(|other| other == joint) {
                let advice = format!("it must name another joint; {names}");
                return Err(refuse("other", &effect.other, &advice));
            }
        }
        let found = Some(kind.about().name.to_owned());
        if kind.about().channel == Channel::Transmission
            && let Some(own) = robot.followers.first()
        {
            let advice = format!(
                "the robot has follower `{}`, and a gear that gives or has backlash beside followers is no part of the equations; remove the effect or the follower",
                own.name
            );
            return Err(refuse("kind", &found, &advice));
        }
        if kind.about().channel == Channel::Transmission && !elastic.insert(joint) {
            let advice = "the joint has another effect between motor and link; state one of them, backlash with the stiffness of both";
            return Err(refuse("kind", &found, advice));
        }
        if kind.is_presliding() && !presliding.insert(joint) {
            let advice = "the joint has another presliding, and one contact through which its friction acts; state one of them";
            return Err(refuse("kind", &found, advice));
        }
    }
    Ok(())
}
