//! Residuals that only the hold-out shows, and those of effects that were dropped.

use crate::columns::kinds::is_gear;
use crate::fit::least_squares::Fit;
use crate::outcome::Remainder;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::{Joint, Robot, title_of};
use rig_numerics::statistics;
use rig_output::{format_significant, format_unit};

/// Residual-to-noise RMS ratio on the hold-out above which a residual is unexplained. For the floor of the training
/// data, whose motion is another, and for gears, where each law has errors at contact.
const BEYOND_FLOOR_HELD: f64 = 1.5;
/// The same for a floor from repeated hold-out runs: true models left up to 1.06 in 33 rigs of seed 4150.
const BEYOND_OWN_FLOOR_HELD: f64 = 1.12;
/// Ratio up to which the residual of the training data counts as noise.
const LIKE_THE_FLOOR: f64 = 1.15;

/// Returns the hold-out residual of the worst joint, if the training residual has no dependence on the motion. `floors`
/// are those of training data and hold-out, `chosen` are the effects. For a joint with a hold-out floor of its own,
/// `twice` returns squares from other sources.
pub(crate) fn left_of_held(
    robot: &Robot,
    held: &[f64],
    learnt: &[f64],
    floors: [&[f64]; 2],
    chosen: &[FittedCandidate],
    twice: &dyn Fn(usize) -> Option<f64>,
) -> Option<Remainder> {
    let [own, floors] = floors;
    let ratio = |j: usize| held[j] / floors[j];
    let gear = |j: usize| {
        let there = |p: &FittedCandidate| p.candidate.joint == j && is_gear(p.candidate.kind);
        chosen.iter().any(there)
    };
    let beyond = |j: &usize| match twice(*j).filter(|_| !gear(*j)) {
        Some(besides) => {
            let most = (BEYOND_OWN_FLOOR_HELD * floors[*j]).powi(2) + besides;
            held[*j].powi(2) > most
        }
        None => ratio(*j) > BEYOND_FLOOR_HELD,
    };
    let j = (0..held.len())
        .filter(beyond)
        .max_by(|a, b| ratio(*a).total_cmp(&ratio(*b)))?;
    let Joint { name, kind, .. } = &robot.joints[j];
    Some(Remainder {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: (held[j].powi(2) - floors[j].powi(2)).sqrt(),
        ratio: ratio(j),
        text: {
            let here = learnt[j] / own[j];
            let why = if here > LIKE_THE_FLOOR {
                format!(
                    "the training data at {here:.2} times, where it goes with nothing: what the model is wrong in shows more in the motion held back"
                )
            } else {
                "the training data are not: they show something that the training data hardly do"
                    .to_owned()
            };
            format!(
                "The data held back are left at {} times the noise floor in joint {name}, {why}. Give a recording like them with --data.",
                format_significant(ratio(j), 3)
            )
        },
        places: Vec::new(),
        doubt: false,
    })
}

/// Returns the joint whose effects improve the training data but not the hold-out. `steps` is the hold-out RMS of each
/// joint before and after all its effects.
pub(crate) fn not_carried_over(
    robot: &Robot,
    steps: &[(usize, [f64; 2])],
    floors: &[f64],
) -> Option<Remainder> {
    let grown = |(_, [before, after]): &&(usize, [f64; 2])| after / before;
    let worst = steps.iter().max_by(|a, b| grown(a).total_cmp(&grown(b)))?;
    let (joint, [before, after]) = *worst;
    let Joint { name, kind, .. } = &robot.joints[joint];
    (after >= before).then(|| Remainder {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: (after.powi(2) - floors[joint].powi(2)).max(0.0).sqrt(),
        ratio: after / floors[joint],
        text: format!(
            "Of the data held back the names take nothing off in joint {name}: they explain the training data alone, and are no more than guesses. Record more to learn from.",
        ),
        places: Vec::new(),
        doubt: true,
    })
}

/// Returns the residual that a dropped effect explained, on a joint without accepted effects.
pub(crate) fn taken_by_none(
    robot: &Robot,
    fallen: &[FittedCandidate],
    chosen: &[FittedCandidate],
    floors: &[f64],
) -> Option<Remainder> {
    let bare =
        |p: &&FittedCandidate| (chosen.iter()).all(|c| c.candidate.joint != p.candidate.joint);
    let gain = |p: &&FittedCandidate| p.evidence.joint_gain;
    let most = (fallen.iter().filter(bare)).max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
    let (joint, left) = (most.candidate.joint, 1.0 - gain(&most));
    let Joint { name, kind, .. } = &robot.joints[joint];
    Some(Remainder {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: floors[joint] * (1.0 - left * left).max(0.0).sqrt(),
        ratio: 1.0 / left,
        text: format!(
            "The law of {} takes {:.0} % off what is left of joint {name}, on stretches that it was not fitted to, but not with values that such a rig has: something is missing that has no name here.",
            title_of(most.candidate.kind),
            100.0 * gain(&most)
        ),
        places: Vec::new(),
        doubt: true,
    })
}

/// Returns the residual of the joint with the largest share, if recordings are too short for effects. `why`: how short.
pub(crate) fn too_short_for_names(
    robot: &Robot,
    base: &Fit,
    known: &[f64],
    why: String,
) -> Option<Remainder> {
    let share = |j: &usize| {
        let rows = base.rows();
        base.even_rms(*j) / statistics::rms_of_kept(&rows.torque[*j], &rows.keep[*j])
    };
    let joint = (0..known.len()).max_by(|a, b| share(a).total_cmp(&share(b)))?;
    let rms = base.even_rms(joint);
    let (floor, ratio) = match known[joint] {
        floor if floor > 0.0 => (floor, rms / floor),
        _ => (0.0, f64::NAN),
    };
    let Joint { name, kind, .. } = &robot.joints[joint];
    let unit = kind.units().1;
    Some(Remainder {
        joint: name.clone(),
        unit: unit.to_owned(),
        rms: (rms * rms - floor * floor).max(0.0).sqrt(),
        ratio,
        text: format!(
            "{why} The parameters are fitted; of joint {name} {} {} RMS are left, {} % of its torque, and nobody knows whether an effect is missing.",
            format_significant(rms, 3),
            format_unit(unit),
            format_significant(100.0 * share(&joint), 2)
        ),
        places: Vec::new(),
        doubt: true,
    })
}
