//! Results of the link encoder in the report.

use rig_shared::effects::{Effect, Kind};

use crate::columns::kinds::is_gear;
use crate::fit::least_squares::Fit;
use crate::fit::systematic_uncertainty::inflated;
use crate::link_encoder::{
    Across, Found, Gear, Law, Laws, Named, SCALE_OFF, SURE, Solved, Term, TransmissionAnalysis,
};
use crate::outcome::{Described, Diagnosis, Fate, Map};
use rig_model::robot::{JointKind, Robot, RobotEffect};
use rig_output::{format_significant, format_unit, format_value};

impl TransmissionAnalysis<'_, '_> {
    /// Returns the reason to believe a law, one sentence.
    pub(crate) fn why(
        &self,
        found: &Found,
        train: [f64; 2],
        unseen: Option<[f64; 2]>,
        floor: f64,
    ) -> String {
        let [before, after] = unseen.unwrap_or(train).map(|x| self.length(x));
        let how = match found.law {
            Law::Twist => "goes with the torque on the gear",
            Law::Play(_) => {
                "changes from one value to another with the sign of the torque on the gear"
            }
            Law::Wave(_) => "repeats with the motor's angle",
        };
        format!(
            "What the encoder on the link reads apart from the joint's own {how}: beside everything else the law takes it from {before} to {after} RMS {}, at a floor of {}. No friction of the motor can do that.",
            if unseen.is_some() {
                "on the hold-out"
            } else {
                "on the training data"
            },
            self.length(floor)
        )
    }

    /// Returns sentences on the joint, whether or not a law was found.
    pub(crate) fn words(
        &self,
        base: &Fit,
        last: &Fit,
        laws: &Laws,
        solved: &Solved,
        gear: Option<&Gear>,
        floor: f64,
    ) -> Vec<String> {
        let equation = self.training;
        let joint = &self.source.robot.joints[self.joint];
        let (p, f) = joint.kind.units();
        let mut words = Vec::new();
        words.push(match gear {
            None => format!(
                "The encoder on the link of joint {} shows neither twist nor play of the transmission: beside constant, scale and instant it reads {} RMS apart from the joint's own, at a floor of {}. What the torque shows at reversals is friction.",
                joint.name,
                self.length(last.rms(0)),
                self.length(floor)
            ),
            Some(gear) => {
                let shapes = gear.kind.about().shapes;
                let value = |k: usize, unit: &str| {
                    let std = inflated(gear.kind, &shapes[k], gear.shapes[k], gear.stds[k], 0.0);
                    let value = if std.is_finite() {
                        format_value(gear.shapes[k], std)
                    } else {
                        format!("more than {}", format_significant(gear.shapes[k], 2))
                    };
                    format!("{value} {unit}")
                };
                let per = format_unit(&format!("{f}/{p}"));
                let what = match gear.kind {
                    Kind::Backlash => format!(
                        "a play of {} behind a stiffness of {}",
                        value(0, p),
                        value(1, &per)
                    ),
                    _ => format!("a stiffness of {} without play", value(0, &per)),
                };
                format!(
                    "The encoder on the link of joint {} shows {what}: what it reads apart from the joint's own falls from {} to {} RMS, at a floor of {}.{}",
                    joint.name,
                    self.length(base.rms(0)),
                    self.length(last.rms(0)),
                    self.length(floor),
                    match (gear.kind, gear.gives) {
                        (Kind::Backlash, Some(_)) =>
                            " Closed teeth are stiffer than that: something gives beside them, and the stiffness is that of both.",
                        _ => "",
                    }
                )
            }
        });
        let at = equation.constants;
        let (scale, std) = (solved.solution.values[at], solved.solution.std(at));
        if scale.abs() > SCALE_OFF.max(SURE * std) {
            words.push(format!(
                "By it the joint moves {} times as far as q{} says; check gear ratio and counts.",
                format_significant(1.0 / (1.0 + scale), 5),
                self.joint + 1
            ));
        }
        for found in &laws.found {
            if let Law::Wave(k) = found.law
                && equation.waves[k].kind == Kind::EncoderEccentricityJoint
            {
                let part = |side| {
                    solved
                        .of(equation, &|t| *t == Term::Wave(k, side))
                        .map_or(0.0, |[value, _]| value)
                };
                words.push(format!(
                    "What the two encoders of joint {} read apart has a wave of {}, {} to a turn of the joint: one of them, or the gear's last stage, is off its axis; nothing tells which.",
                    joint.name,
                    self.length(part(0).hypot(part(1))),
                    equation.waves[k].order
                ));
            }
        }
        words
    }

    /// Formats a small length or angle.
    fn length(&self, x: f64) -> String {
        let unit = match self.source.robot.joints[self.joint].kind {
            JointKind::Revolute => "mrad",
            JointKind::Prismatic => "mm",
        };
        format!("{} {unit}", format_significant(1e3 * x, 3))
    }
}

/// Adds the results of the link encoders to a result and to its description.
pub(crate) fn tell(across: Vec<Across>, diagnosis: &mut Diagnosis, model: &mut Robot) {
    for own in across {
        let name = model.joints[own.joint].name.clone();
        diagnosis.tried.extend(own.tried);
        diagnosis.detectable.extend(own.detectable);
        diagnosis.words.extend(own.words);
        if let Some((kind, shapes)) = own.gear
            && own.named.iter().any(|n| n.kind == kind)
        {
            replace(model, own.joint, Effect::new(kind, &[], &shapes), &|kind| {
                is_gear(kind)
            });
        }
        let mut shown = false;
        for found in own.named {
            shown |= one(found, &name, own.joint, diagnosis, model);
        }
        if shown {
            diagnosis.places.extend(own.places);
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
    let Named { kind, step, map } = found;
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
        known.text = format!(
            "The description's {} of joint {name} stays, fitted again to what the encoder on the link reads.",
            known.effect
        );
        return false;
    }
    let by_torque = |s: &crate::outcome::Step| s.joint == name && s.effect == step.effect;
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
