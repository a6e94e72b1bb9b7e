//! Results of the motor voltages in the report.

use rig_shared::effects::{Effect, Kind};

use crate::motor_voltage::winding::{DeadZone, Winding};
use crate::outcome::{Diagnosis, Fate, Map};
use rig_model::robot::{Robot, RobotEffect};
use rig_output::{format_significant, format_value};

/// Adds the results of the voltages to a result and to its description.
pub(crate) fn tell(windings: Vec<Winding>, diagnosis: &mut Diagnosis, model: &mut Robot) {
    for winding in windings {
        diagnosis.tried.push(winding.tried);
        diagnosis.detectable.extend(winding.detectable);
        if let Some(dead) = winding.dead_zone {
            tell_dead_zone(dead, winding.joint, diagnosis, model);
        }
        // The remainder already is the one farthest above its floor, or a torque's.
        let other = winding
            .left
            .filter(|left| diagnosis.remainder.as_ref() != Some(left));
        diagnosis.words.extend(other.map(|left| left.text));
        diagnosis.words.extend(winding.constant);
        diagnosis.words.extend(winding.remarks);
    }
}

/// Adds a dead zone to a result and to its description.
fn tell_dead_zone(dead: DeadZone, joint: usize, diagnosis: &mut Diagnosis, model: &mut Robot) {
    let held = if dead.step.holdout_rms.is_some() {
        "on the hold-out"
    } else {
        "on the training data"
    };
    let [before, after] = dead.step.holdout_rms.unwrap_or(dead.step.train_rms);
    diagnosis.words.push(format!(
        "The inverter of joint {} loses {} V with the sign of the current: what resistance and back-EMF leave of the motor's voltage falls from {} to {} V RMS {held}.",
        dead.step.joint,
        format_value(
            dead.volts,
            dead.step.parameters.values().next().map_or(0.0, |v| v.std)
        ),
        format_significant(before, 3),
        format_significant(after, 3)
    ));
    let name = &model.joints[joint].name;
    // The description's own value is no longer held.
    let placed = model.placed_effects();
    let mut stated = placed
        .iter()
        .map(|p| p.joint == joint && p.effect.kind == Kind::DriveDeadzone);
    model.effects.retain(|_| stated.next() != Some(true));
    model.effects.push(RobotEffect {
        joint: Some(name.clone()),
        other: None,
        effect: Effect::new(Kind::DriveDeadzone, &[dead.volts], &[]),
    });
    let known = diagnosis
        .described
        .iter_mut()
        .find(|d| d.joint == *name && d.effect == dead.step.effect);
    if let Some(known) = known {
        known.fate = Fate::FittedAgain;
        known.parameters = dead.step.parameters;
        known.text = format!(
            "The description's {} of joint {name} stays, fitted again to the motor's voltage.",
            known.effect
        );
    } else {
        diagnosis.places.extend(dead.places);
        diagnosis.places.sort_by(|a, b| b.share.total_cmp(&a.share));
        diagnosis.absorbed.extend(dead.absorbed);
        diagnosis
            .absorbed
            .sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        diagnosis.maps.push(Map {
            step: Some(diagnosis.steps.len()),
            ..dead.map
        });
        if diagnosis.steps.is_empty() {
            diagnosis.gap_closed = Some(dead.step.gap_closed);
        }
        diagnosis.steps.push(dead.step);
    }
}
