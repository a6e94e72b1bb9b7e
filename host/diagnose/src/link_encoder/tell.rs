//! Results of the link encoder in the report.

use rig_shared::effects::{Effect, Kind};

use crate::columns::kinds::is_gear;
use crate::link_encoder::result::{Across, Named};
use crate::link_encoder::sentences;
use crate::outcome::{Described, Diagnosis, Fate, Map, Place, Step, Tried};
use rig_model::robot::{Robot, RobotEffect};

/// Adds the results of the link encoders to a result and to its description.
pub(crate) fn tell(across: Vec<Across>, diagnosis: &mut Diagnosis, model: &mut Robot) {
    for own in across {
        let joint = model.joints[own.joint].clone();
        diagnosis
            .tried
            .extend(own.tried.into_iter().map(|law| Tried {
                refused: law.refused.map_or_else(String::new, sentences::refusal),
                ..law.tried
            }));
        diagnosis.detectable.extend(own.detectable);
        let words = sentences::reading(&joint, own.joint + 1, &own.reading);
        diagnosis.words.extend(words);
        if let Some((kind, shapes)) = own.gear
            && own.named.iter().any(|n| n.kind == kind)
        {
            replace(model, own.joint, Effect::new(kind, &[], &shapes), &|kind| {
                is_gear(kind)
            });
        }
        let mut shown = false;
        for found in own.named {
            let why = sentences::why(&joint, &found);
            let step = Step { why, ..found.step };
            let found = Named { step, ..found };
            shown |= one(found, &joint.name, own.joint, diagnosis, model);
        }
        if shown {
            diagnosis
                .places
                .extend(own.places.into_iter().map(|p| Place {
                    text: sentences::place(&p),
                    ..p
                }));
            diagnosis.places.sort_by(|a, b| b.share.total_cmp(&a.share));
        }
    }
}

/// Adds one name to the result. Returns true if the description does not have the effect.
fn one(
    found: Named,
    name: &str,
    joint: usize,
    diagnosis: &mut Diagnosis,
    model: &mut Robot,
) -> bool {
    let Named {
        kind, step, map, ..
    } = found;
    if kind == Kind::EncoderEccentricityMotor {
        let of = |key: &str| step.parameters.get(key).map_or(0.0, |v| v.value);
        let wave = Effect::new(kind, &[of("cosine"), of("sine")], &[of("order")]);
        let order = of("order");
        replace(model, joint, wave, &|other| other == kind && order == 1.0);
    }
    let is_it = |d: &&mut Described| d.joint == name && d.effect == step.effect;
    if let Some(known) = diagnosis.described.iter_mut().find(is_it) {
        known.fate = Fate::FittedAgain;
        known.parameters = step.parameters;
        known.text = sentences::fitted_again(&known.effect, name);
        return false;
    }
    let by_torque = |s: &Step| s.joint == name && s.effect == step.effect;
    let place = diagnosis.steps.iter().position(by_torque);
    diagnosis.maps.push(Map {
        step: Some(place.unwrap_or(diagnosis.steps.len())),
        ..map
    });
    match place {
        // The torque shows the effect, the link encoder its values.
        Some(k) => {
            let known = &mut diagnosis.steps[k];
            for (key, value) in step.parameters {
                known.parameters.insert(key, value);
            }
            known.set = step.set;
            (known.runner_up, known.runner_up_gap_closed) = (None, None);
            known.p_value = known.p_value.min(step.p_value);
            known.why = format!("{} {}", step.why, known.why);
        }
        None => {
            if diagnosis.steps.is_empty() {
                diagnosis.gap_closed = Some(step.gap_closed);
            }
            diagnosis.steps.push(step);
        }
    }
    true
}

/// Puts an effect into a description instead of its joint's effects that are `like` it.
fn replace(model: &mut Robot, joint: usize, effect: Effect<f64>, like: &dyn Fn(Kind) -> bool) {
    let placed = model.placed_effects();
    let mut others = placed
        .iter()
        .map(|p| !(p.joint == joint && like(p.effect.kind)));
    model.effects.retain(|_| others.next() != Some(false));
    let name = model.joints[joint].name.clone();
    model.effects.push(RobotEffect {
        joint: Some(name),
        other: None,
        effect,
    });
}
