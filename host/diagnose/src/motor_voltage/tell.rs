//! Results of the motor voltages in the report.

use rig_shared::effects::{Effect, Kind};

use crate::motor_voltage::winding::{DeadZone, Left, Moved, Part, Winding};
use crate::motor_voltage::{analysis, sentences};
use crate::outcome::{Absorbed, Diagnosis, Fate, Map, Place, Remainder, Step, Tried};
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::{DiagnoseError, Options};
use rig_model::robot::{Robot, RobotEffect};

/// Analyses the recorded voltages, joint by joint. Also returns sentences on those without a result.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn windings(
    context: &DiagnosisContext,
    prepared: &PreparedData,
    held_out: Option<&PreparedData>,
    options: &Options,
) -> Result<(Vec<Winding>, Vec<String>), DiagnoseError> {
    let (found, silent) = analysis::windings(context, prepared, held_out, options)?;
    let name = |joint: usize| context.robot.joints[joint].name.as_str();
    let silent = silent.into_iter();
    let silent = silent.map(|(joint, lack)| sentences::lack(name(joint), lack));
    Ok((found, silent.collect()))
}

/// Returns the unexplained remainder of the voltages.
pub(crate) fn left_of_voltage(windings: &[Winding]) -> Option<Remainder> {
    let left = windings.iter().filter_map(|w| w.left.clone());
    left.max_by(|a, b| a.ratio.total_cmp(&b.ratio))
        .map(remainder)
}

fn remainder(left: Left) -> Remainder {
    Remainder {
        text: sentences::left(&left),
        joint: left.joint,
        rms: left.rms,
        unit: "V".to_owned(),
        ratio: left.ratio,
        places: left.place.into_iter().map(of_the_voltage).collect(),
        doubt: true,
    }
}

/// Adds to a place that it concerns the voltage.
fn of_the_voltage(place: Place) -> Place {
    Place {
        text: sentences::place(&place),
        ..place
    }
}

/// Adds the results of the voltages to a result and to its description.
pub(crate) fn tell(windings: Vec<Winding>, diagnosis: &mut Diagnosis, model: &mut Robot) {
    for winding in windings {
        diagnosis.tried.push(Tried {
            refused: (winding.refused.as_ref()).map_or_else(String::new, sentences::refusal),
            ..winding.tried
        });
        diagnosis.detectable.extend(winding.detectable);
        if let Some(dead) = winding.dead_zone {
            tell_dead_zone(dead, winding.joint, diagnosis, model);
        }
        // The remainder already is the one farthest above its floor, or a torque's.
        let left = winding.left.map(remainder);
        let other = left.filter(|left| diagnosis.remainder.as_ref() != Some(left));
        diagnosis.words.extend(other.map(|left| left.text));
        let name = &model.joints[winding.joint].name;
        let constant = (winding.constant).map(|found| sentences::constant(name, found));
        diagnosis.words.extend(constant);
        let resistance = (winding.resistance).map(|found| sentences::resistance(name, found));
        diagnosis.words.extend(resistance);
    }
}

/// Adds a dead zone to a result and to its description.
fn tell_dead_zone(dead: DeadZone, joint: usize, diagnosis: &mut Diagnosis, model: &mut Robot) {
    diagnosis.words.push(sentences::dead_zone(&dead));
    let step = Step {
        why: sentences::why(&dead),
        ..dead.step
    };
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
        .find(|d| d.joint == *name && d.effect == step.effect);
    if let Some(known) = known {
        known.fate = Fate::FittedAgain;
        known.parameters = step.parameters;
        known.text = sentences::fitted_again(&known.effect, name);
    } else {
        (diagnosis.places).extend(dead.places.into_iter().map(of_the_voltage));
        diagnosis.places.sort_by(|a, b| b.share.total_cmp(&a.share));
        let moved = dead.moved.into_iter();
        (diagnosis.absorbed).extend(moved.map(|moved| absorbed(&step.joint, moved)));
        diagnosis
            .absorbed
            .sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        diagnosis.maps.push(Map {
            step: Some(diagnosis.steps.len()),
            ..dead.map
        });
        if diagnosis.steps.is_empty() {
            diagnosis.gap_closed = Some(step.gap_closed);
        }
        diagnosis.steps.push(step);
    }
}

/// Returns a change of resistance or back-EMF by a dead zone.
fn absorbed(joint: &str, moved: Moved) -> Absorbed {
    let [after, std] = moved.after;
    Absorbed {
        parameter: sentences::of_the_motor(moved.part, joint),
        unit: match moved.part {
            Part::Resistance => "Ohm",
            Part::BackEmf => "V*s/rad",
        }
        .to_owned(),
        before: moved.before,
        after,
        sigmas: (after - moved.before).abs() / std.max(f64::MIN_POSITIVE),
    }
}
