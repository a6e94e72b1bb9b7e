//! Winding, inverter and current sensor, from the recorded voltage of a motor.
//!
//! u = R·(i − i₀) + L·di/dt + k·ω·(1 − b·i²) + c·dω/dt + volts · sgn(i). i is the current, from the torque and the
//! described torque constant. ω is the motor's speed and i₀ the sensor's reading without a current (Krause, Wasynczuk &
//! Sudhoff 2002, ch. 2; the last term, which fades at low current: Holtz 1992). L and c include, to first order,
//! different sampling instants of voltage, current and position. The equation has no torque: friction, load and gear do
//! not affect it. So its current zero separates a sensor error from a torque.
//!
//! Leaves out: a resistance that rises with temperature; ripple within a pulse; drives that move several joints; the
//! voltage drop of brushes, which looks like a dead zone.

mod equation;
mod left;
mod settle;
#[cfg(test)]
mod tests;

use rig_shared::effects::{Effect, Kind, Parameter, SHAPES};

use crate::acceptance::residual_dependence::locate;
use crate::columns::candidate::Candidate;
use crate::fit::least_squares::Fit;
use crate::fit::solution::{Solution, jackknifed, solve};
use crate::fit::systematic_uncertainty::inflated;
use crate::levels::SIGNIFICANT;
use crate::motor_voltage::equation::{ACROSS, CONSTANT, CURRENT, Equation, FADES, SPEED};
use crate::motor_voltage::left::{Rest, of_the_voltage};
use crate::outcome::{
    Absorbed, Detectable, Diagnosis, Fate, Map, Place, Remainder, Step, Tried, Value,
};
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::noise_floor;
use crate::result::limits::smallest;
use crate::result::pictures::map;
use crate::search::fitted_candidate::FittedCandidate;
use crate::statistics::closed;
use crate::{DiagnoseError, Options};
use rig_model::robot::{Robot, RobotEffect};
use rig_output::{format_significant, format_value};

pub(crate) use crate::motor_voltage::settle::{Word, settled, zeros};

/// Share of the voltage's squares in the residual above which the winding's equation does not fit.
const EXPLAINED: f64 = 0.1;
/// Least RMS reduction of the voltage residual by a dead zone.
const LEAST_SHARE: f64 = 0.1;
/// Relative difference of back-EMF and torque constant that is reported: magnets and load change them by less.
const CONSTANT_OFF: f64 = 0.05;
/// … and that of the resistance: copper gains 0.39 % a kelvin.
const RESISTANCE_OFF: f64 = 0.25;
/// … in standard deviations.
const SURE: f64 = 5.0;

/// Results from the voltage of one joint's motor.
pub(crate) struct Winding {
    /// From 0.
    joint: usize,
    /// Sensor reading without a current, as a torque at the joint, and its standard deviation, N·m or N.
    offset: [f64; 2],
    /// A sentence if the back-EMF contradicts the torque constant.
    constant: Option<String>,
    remarks: Vec<String>,
    tried: Tried,
    detectable: Option<Detectable>,
    dead_zone: Option<DeadZone>,
    left: Option<Remainder>,
}

struct DeadZone {
    /// True if the description states it.
    described: bool,
    volts: f64,
    step: Step,
    places: Vec<Place>,
    absorbed: Vec<Absorbed>,
    map: Map,
}

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
    let (mut found, mut silent) = (Vec::new(), Vec::new());
    for joint in 0..context.robot.joints.len() {
        let Some(training) = Equation::of(context.robot, joint, prepared, &options.clamped)? else {
            let name = &context.robot.joints[joint].name;
            if (options.clamped.iter()).any(|run| run.joints[joint].voltage.is_some()) {
                silent.push(format!(
                    "The motor voltage of joint {name} with the joints clamped is not used: it takes that of all other recordings beside it, and a drive of its own."
                ));
            }
            continue;
        };
        let held = match held_out {
            Some(held_out) => Equation::of(context.robot, joint, held_out, &[])?,
            None => None,
        };
        match winding(context, joint, prepared, &training, held.as_ref(), options) {
            Ok(winding) => found.push(winding),
            Err(why) => silent.push(format!(
                "Nothing is concluded from the motor voltage of joint {}: {why}.",
                context.robot.joints[joint].name
            )),
        }
    }
    Ok((found, silent))
}

fn winding(
    context: &DiagnosisContext,
    joint: usize,
    prepared: &PreparedData,
    training: &Equation,
    held: Option<&Equation>,
    options: &Options,
) -> Result<Winding, String> {
    let rows = &training.rows;
    let columns: Vec<_> = rows.nominal.iter().collect();
    let first = Fit::new(rows, vec![1.0], 0.1).taking(columns.iter().copied());
    let weight = 1.0 / first.rms(0).max(f64::MIN_POSITIVE);
    let plain = Fit::new(
        rows,
        vec![weight],
        noise_floor::memory(rows, &[first.residual(0)]),
    );
    let base = plain.clone().taking(columns.iter().copied());
    let lacking = || "the motion does not tell resistance and back-EMF apart".to_owned();
    let before = solve(&plain, &columns, &[]).ok_or_else(lacking)?;
    let left = (base.rms(0) / plain.rms(0)).powi(2);
    if left > EXPLAINED {
        return Err(format!(
            "resistance and back-EMF leave {} % of its squares unexplained",
            format_significant(100.0 * left, 2)
        ));
    }
    for (place, name) in [(CURRENT, "resistance"), (SPEED, "back-EMF")] {
        if before.values[place] <= 0.0 {
            return Err(format!("by it the {name} would not be positive"));
        }
    }
    let robot = context.robot;
    let own = &robot.joints[joint];
    let candidate = Candidate::on(Kind::DriveDeadzone, joint);
    let trials = robot.joints.len() * FADES.len();
    let dead = |k: usize| std::slice::from_ref(&training.dead_zones[k]);
    let likeliest = (0..FADES.len())
        .filter_map(|k| {
            let evidence = base.evidence(&base.distinct(dead(k))?, &[[0.0, f64::INFINITY]])?;
            Some((k, evidence))
        })
        .max_by(|a, b| a.1.explained.total_cmp(&b.1.explained));
    let fade = likeliest.as_ref().map_or(0, |(k, _)| *k);
    let profile = likeliest.map(|(k, evidence)| FittedCandidate {
        candidate,
        shapes: [0.0; SHAPES],
        columns: std::sync::Arc::new(dead(k).to_vec()),
        evidence,
        at_bound: None,
        followed: None,
        otherwise: None,
        accepted_by_observer: false,
        near_collinear: false,
    });
    let left_out = options.without.contains(&Kind::DriveDeadzone);
    let refused = match &profile {
        _ if left_out => Some("it was left out".to_owned()),
        Some(profile) => profile.refused(trials).or_else(|| too_small(profile)),
        None => Some("it takes no voltage along the current".to_owned()),
    };
    let about = Kind::DriveDeadzone.about();
    let evidence = profile.as_ref().map(|p| &p.evidence);
    let tried = Tried {
        effect: about.name.to_owned(),
        joint: own.name.clone(),
        step: 0,
        gain: evidence.map_or(0.0, |e| e.gain),
        gain_sigmas: evidence.map_or(0.0, |e| e.gain_sigmas),
        p_value: evidence.map_or(1.0, |e| e.corrected(trials)),
        refused: refused.clone().unwrap_or_default(),
    };
    let all: Vec<_> = columns.iter().copied().chain(dead(fade)).collect();
    let stands = refused.is_none();
    let mut last = base.clone();
    if stands {
        last.push(&training.dead_zones[fade]);
    }
    let pairs = noise_floor::repeats(&prepared.runs);
    let after = match stands {
        true => {
            let plain = plain.clustered(noise_floor::memory(rows, &[last.residual(0)]), &pairs);
            jackknifed(&plain, &[], &all, &training.fading(fade)).ok_or_else(lacking)?
        }
        false => before.clone(),
    };
    let detectable = (!stands)
        .then(|| base.distinct(dead(fade))?.first().cloned())
        .flatten()
        .and_then(|column| smallest(&base, &column, 1, trials))
        .map(|size| Detectable {
            effect: about.name.to_owned(),
            joint: own.name.clone(),
            parameter: about.gains[0].name.to_owned(),
            size,
            size_at_worst: None,
            unit: about.gains[0].unit.to_owned(),
        });
    let repeated = noise_floor::from_repeats(rows, &pairs, &last.residual(0), None, 0)
        .map(|repeated| repeated.noise);
    let coordinates = training.coordinates();
    let places_of = |fit: &Fit, floor: f64| {
        let blocks = fit.block_of_rows();
        let residual = fit.residual(0);
        let places = locate(
            rows,
            &coordinates,
            &residual,
            None,
            blocks,
            0,
            &own.name,
            floor,
            options.seed,
        );
        places.into_iter().filter(|p| p.p_value < SIGNIFICANT)
    };
    // A dead zone too small for a name still explains its part.
    let mut known = last.clone();
    if !stands && !left_out {
        known.push(&training.dead_zones[fade]);
    }
    let left = Rest {
        joint: &own.name,
        voltage: plain.rms(0),
        rms: [base.rms(0), known.rms(0)],
        floor: repeated,
    }
    .remainder(|| places_of(&known, repeated.unwrap_or(0.0)).next());
    let dead_zone = profile.filter(|_| stands).map(|profile| {
        let floor = repeated.unwrap_or_else(|| last.rms(0));
        let unseen = held.map(|held| {
            [(&before, None), (&after, Some(fade))]
                .map(|(solution, k)| held.rms(&solution.values, k))
        });
        let train = [base.rms(0), last.rms(0)];
        let at = before.values.len();
        let volts = after.values[at];
        DeadZone {
            described: context.stated.holds(Kind::DriveDeadzone, joint),
            volts,
            step: Step {
                effect: about.name.to_owned(),
                law: None,
                joint: own.name.clone(),
                set: vec![about.name.to_owned()],
                parameters: std::iter::once((
                    about.gains[0].name.to_owned(),
                    value(&after, at, &about.gains[0]),
                ))
                .collect(),
                p_value: profile.corrected(trials),
                name_probability: f64::NAN,
                runner_up: None,
                runner_up_gap_closed: None,
                rms_unit: "V".to_owned(),
                train_rms: train,
                holdout_rms: unseen,
                motion_rms: None,
                gap_closed: closed(unseen.unwrap_or(train), floor),
                why: why(&before, &after, FADES[fade], floor),
            },
            places: (places_of(&base, floor).take(1))
                .map(of_the_voltage)
                .collect(),
            absorbed: absorbed(&own.name, &before, &after),
            map: Map {
                joint: own.name.clone(),
                residual_unit: "V".to_owned(),
                ..map(rows, &coordinates[ACROSS], [&base, &last], 0)
            },
        }
    });
    let scale = training.torque_per_ampere / after.values[CURRENT];
    Ok(Winding {
        joint,
        // The constant in u is −R·i₀.
        offset: [
            -scale * after.values[CONSTANT],
            scale.abs() * after.std(CONSTANT),
        ],
        // If the equation does not hold, its coefficients are wrong.
        constant: constant_off(robot, joint, &after).filter(|_| left.is_none()),
        remarks: (resistance_off(robot, joint, &after).filter(|_| left.is_none()))
            .into_iter()
            .collect(),
        tried,
        detectable,
        dead_zone,
        left,
    })
}

/// Returns the unexplained remainder of the voltages.
pub(crate) fn left_of_voltage(windings: &[Winding]) -> Option<Remainder> {
    let left = windings.iter().filter_map(|w| w.left.clone());
    left.max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

/// Returns the reason why a small voltage step is not an inverter's: other errors of the equation are as large.
fn too_small(profile: &FittedCandidate) -> Option<String> {
    let volts = profile.evidence.gains[0];
    let least = Kind::DriveDeadzone.about().gains[0].range[0];
    let share = profile.evidence.gain;
    (volts < least || share < LEAST_SHARE).then(|| {
        format!(
            "{} V, which take {} % of what is left; at least {least} V and {} % would be a dead zone",
            format_significant(volts, 2),
            format_significant(100.0 * share, 2),
            100.0 * LEAST_SHARE
        )
    })
}

fn value(solution: &Solution, k: usize, volts: &Parameter) -> Value {
    let value = solution.values[k];
    Value {
        value,
        std: inflated(Kind::DriveDeadzone, volts, value, solution.std(k), 0.0),
        unit: volts.unit.to_owned(),
    }
}

/// Returns the changes of resistance and back-EMF by a dead zone.
fn absorbed(joint: &str, before: &Solution, after: &Solution) -> Vec<Absorbed> {
    let moved = |(place, name, unit): (usize, &str, &str)| Absorbed {
        parameter: format!("{name} of the motor of {joint}"),
        unit: unit.to_owned(),
        before: before.values[place],
        after: after.values[place],
        sigmas: (after.values[place] - before.values[place]).abs()
            / after.std(place).max(f64::MIN_POSITIVE),
    };
    [
        (CURRENT, "resistance", "Ohm"),
        (SPEED, "back-EMF", "V*s/rad"),
    ]
    .map(moved)
    .into()
}

/// Returns the reason to believe a dead zone, one sentence.
fn why(before: &Solution, after: &Solution, fade: f64, floor: f64) -> String {
    format!(
        "The voltage follows R·i + L·di/dt + k·ω but for a step where the current changes its sign{}, down to a floor of {} V; without the step the resistance had come out as {} Ω instead of {}.",
        match fade {
            0.0 => String::new(),
            fade => format!(", which fades below {fade} A"),
        },
        format_significant(floor, 3),
        format_significant(before.values[CURRENT], 3),
        format_value(after.values[CURRENT], after.std(CURRENT)),
    )
}

/// In SI units, back-EMF and torque constant of a brushed motor are equal. With phases this depends on the definitions
/// of voltage and current.
fn constant_off(robot: &Robot, joint: usize, after: &Solution) -> Option<String> {
    let own = &robot.joints[joint];
    let drive = own.drive.as_ref().filter(|d| d.pole_pairs == Some(0))?;
    let stated = drive.torque_constant;
    let (seen, std) = (after.values[SPEED].abs(), after.std(SPEED));
    differs(seen, std, stated, CONSTANT_OFF).then(|| {
        format!(
            "The back-EMF of joint {}'s motor is {} V·s/rad, its torque constant in the description {} N·m/A; for a brushed motor they are one number, so torques that were computed from the current are {} times as large as stated.",
            own.name,
            format_value(seen, std),
            format_significant(stated, 3),
            format_significant(seen / stated, 3)
        )
    })
}

fn resistance_off(robot: &Robot, joint: usize, after: &Solution) -> Option<String> {
    let own = &robot.joints[joint];
    let stated = own.drive.as_ref()?.resistance?;
    let (seen, std) = (after.values[CURRENT], after.std(CURRENT));
    differs(seen, std, stated, RESISTANCE_OFF).then(|| {
        format!(
            "The winding of joint {}'s motor has {} Ω by its voltage and {} Ω in the description.",
            own.name,
            format_value(seen, std),
            format_significant(stated, 3)
        )
    })
}

fn differs(seen: f64, std: f64, stated: f64, least: f64) -> bool {
    let off = (seen - stated).abs();
    off > least * stated.abs() && off > SURE * std
}

/// Returns true if any named dead zone is not in the description.
pub(crate) fn name_something(windings: &[Winding]) -> bool {
    let found = |w: &Winding| w.dead_zone.as_ref().is_some_and(|dead| !dead.described);
    windings.iter().any(found)
}

/// Returns true if the voltages contradict the description's values.
pub(crate) fn contradict(windings: &[Winding]) -> bool {
    windings.iter().any(|w| w.constant.is_some())
}

/// Adds the results of the voltages to a result and to its description.
pub(crate) fn tell(windings: Vec<Winding>, diagnosis: &mut Diagnosis, model: &mut Robot) {
    for winding in windings {
        diagnosis.tried.push(winding.tried);
        diagnosis.detectable.extend(winding.detectable);
        if let Some(dead) = winding.dead_zone {
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
            let name = &model.joints[winding.joint].name;
            // The description's own value is no longer held.
            let placed = model.placed_effects();
            let mut stated = placed
                .iter()
                .map(|p| p.joint == winding.joint && p.effect.kind == Kind::DriveDeadzone);
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
        // The remainder already is the one farthest above its floor, or a torque's.
        let other = winding
            .left
            .filter(|left| diagnosis.remainder.as_ref() != Some(left));
        diagnosis.words.extend(other.map(|left| left.text));
        diagnosis.words.extend(winding.constant);
        diagnosis.words.extend(winding.remarks);
    }
}
