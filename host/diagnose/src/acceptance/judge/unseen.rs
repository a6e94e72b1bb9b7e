//! Residuals that only the hold-out shows, and those of effects that were dropped.

use crate::acceptance::unexplained::{RemainderCause, Unexplained};
use crate::columns::kinds::is_gear;
use crate::fit::least_squares::Fit;
use crate::outcome::DataFault;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::{Joint, Robot};
use rig_numerics::statistics;

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
) -> Option<Unexplained> {
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
    let here = learnt[j] / own[j];
    let Joint { name, kind, .. } = &robot.joints[j];
    Some(Unexplained {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: (held[j].powi(2) - floors[j].powi(2)).sqrt(),
        ratio: ratio(j),
        places: Vec::new(),
        cause: RemainderCause::OnHoldOut {
            training_ratio: (here > LIKE_THE_FLOOR).then_some(here),
        },
    })
}

/// Returns the joint whose effects improve the training data but not the hold-out. `steps` is the hold-out RMS of each
/// joint before and after all its effects.
pub(crate) fn not_carried_over(
    robot: &Robot,
    steps: &[(usize, [f64; 2])],
    floors: &[f64],
) -> Option<Unexplained> {
    let grown = |(_, [before, after]): &&(usize, [f64; 2])| after / before;
    let worst = steps.iter().max_by(|a, b| grown(a).total_cmp(&grown(b)))?;
    let (joint, [before, after]) = *worst;
    let Joint { name, kind, .. } = &robot.joints[joint];
    (after >= before).then(|| Unexplained {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: (after.powi(2) - floors[joint].powi(2)).max(0.0).sqrt(),
        ratio: after / floors[joint],
        places: Vec::new(),
        cause: RemainderCause::NotCarriedOver,
    })
}

/// Returns the residual that a dropped effect explained, on a joint without accepted effects.
pub(crate) fn taken_by_none(
    robot: &Robot,
    fallen: &[FittedCandidate],
    chosen: &[FittedCandidate],
    floors: &[f64],
) -> Option<Unexplained> {
    let bare =
        |p: &&FittedCandidate| (chosen.iter()).all(|c| c.candidate.joint != p.candidate.joint);
    let gain = |p: &&FittedCandidate| p.evidence.joint_gain;
    let most = (fallen.iter().filter(bare)).max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
    let (joint, left) = (most.candidate.joint, 1.0 - gain(&most));
    let Joint { name, kind, .. } = &robot.joints[joint];
    Some(Unexplained {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: floors[joint] * (1.0 - left * left).max(0.0).sqrt(),
        ratio: 1.0 / left,
        places: Vec::new(),
        cause: RemainderCause::TakenByNone {
            kind: most.candidate.kind,
            gain: gain(&most),
        },
    })
}

/// Returns the residual of the joint with the largest share, if recordings are too short for effects, as `fault` says.
pub(crate) fn too_short_for_names(
    robot: &Robot,
    base: &Fit,
    known: &[f64],
    fault: DataFault,
) -> Option<Unexplained> {
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
    Some(Unexplained {
        joint: name.clone(),
        unit: kind.units().1.to_owned(),
        rms: (rms * rms - floor * floor).max(0.0).sqrt(),
        ratio,
        places: Vec::new(),
        cause: RemainderCause::TooShort {
            fault,
            residual: rms,
            share: share(&joint),
        },
    })
}
