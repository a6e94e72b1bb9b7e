//! Faults that columns show by themselves and against each other, without a model.

use std::ops::Range;

use crate::DiagnoseError;
use crate::faults::finding::{Fault, Finding, Short};
use crate::faults::names;
use crate::outcome::{About, FaultKind};
use rig_data::prepare::{Recording, longest_part};
use rig_data::runs::Run;
use rig_data::runs::{JointRun, resolution};
use rig_data::{Block, Implausible, JUDGED_ROWS, JointColumns, plausibility, velocity_scale};
use rig_model::robot::Robot;
use rig_numerics::statistics;

/// Shortest recording, s, with a reversal and its repetition.
pub(crate) const SHORTEST: f64 = 1.0;
/// Least training time in all, s: some stretches give a name and others test it.
pub(crate) const LEAST_TO_LEARN: f64 = 5.0;
/// … and least time to judge by.
pub(crate) const LEAST_TO_JUDGE: f64 = 2.0;
/// Fewest rows for the parameters of one joint.
pub(crate) const FEWEST: usize = 100;
/// Share of the moving time at the torque limit above which too little data remains.
const AT_LIMIT: f64 = 0.2;

/// Least range of a joint that moves, rad or m.
const LEAST_MOTION: f64 = 1e-5;
/// … and as a multiple of the noise that the filter removes.
const ABOVE_NOISE: f64 = 8.0;
/// Least range within a second, in steps of the encoder.
const STEPS: f64 = 3.0;

/// Returns true if a column has no derivative or no size to compare with a model: every joint would look wrong.
pub(crate) fn spoils_the_model(fault: &Fault) -> bool {
    let spoilt = [
        FaultKind::Jump,
        FaultKind::Held,
        FaultKind::Unsigned,
        FaultKind::Clock,
    ];
    fault.is_certain() && spoilt.contains(&fault.finding.kind())
}

/// Returns the name of the recording.
pub(crate) fn label(runs: &[&Run]) -> String {
    runs.first()
        .map_or_else(String::new, |run| run.label.clone())
}

fn span(values: &[f64]) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    (values.iter()).fold(ends, |(low, high), v| (low.min(*v), high.max(*v)))
}

/// Returns the range of filtered positions, and the noise that the filter removes.
fn motion(run: &Run, joint: usize) -> (f64, f64) {
    let Some(own) = run.joints.get(joint) else {
        return (0.0, 0.0);
    };
    let (low, high) = span(&own.q);
    let noise = own.q.iter().zip(&own.q_raw);
    let noise = noise.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / own.q.len().max(1) as f64;
    ((high - low).max(0.0), noise.sqrt())
}

/// Returns true if a joint moves by more than its noise and a hundredth of a millirad.
pub(crate) fn moves(run: &Run, joint: usize) -> bool {
    let (range, noise) = motion(run, joint);
    range > LEAST_MOTION && range > ABOVE_NOISE * noise
}

/// Returns a fault if the recording is too short to judge.
pub(crate) fn too_short(runs: &[&Run]) -> Option<Fault> {
    let rows: usize = runs.iter().map(|run| run.len()).sum();
    let time = duration(runs);
    let found = Short::Recording { rows, time };
    (rows < FEWEST || time < SHORTEST).then(|| Fault::of_recording(Finding::Short(found)))
}

/// Returns the seconds of all runs.
fn duration(runs: &[&Run]) -> f64 {
    let own = |run: &&Run| run.len() as f64 / run.rate.max(f64::MIN_POSITIVE);
    runs.iter().map(own).sum()
}

/// Returns the seconds of a run in which some joint moves: a filtered position spans more than its noise and its
/// encoder steps.
fn in_motion(run: &Run) -> f64 {
    let window = (run.rate.round() as usize).max(1);
    let still = |own: &JointRun, floor: f64, rows: Range<usize>| {
        let (low, high) = span(&own.q[rows]);
        high - low <= floor
    };
    let floors: Vec<f64> = (0..run.joints.len())
        .map(|j| {
            let steps = STEPS * resolution(std::slice::from_ref(run), j);
            LEAST_MOTION.max(ABOVE_NOISE * motion(run, j).1).max(steps)
        })
        .collect();
    let windows = (0..run.len()).step_by(window).filter_map(|from| {
        let rows = from..(from + window).min(run.len());
        let own = || run.joints.iter().zip(&floors);
        let moves = own().any(|(own, floor)| !still(own, *floor, rows.clone()));
        moves.then_some(rows.len() as f64)
    });
    windows.sum::<f64>() / run.rate.max(f64::MIN_POSITIVE)
}

/// Returns how the training data, or those without external loads, hold too little motion for names, and the recording.
pub(crate) fn too_short_to_learn(runs: &[Run]) -> Option<(Short, String)> {
    let all: Vec<&Run> = runs.iter().collect();
    let free: Vec<&Run> = runs.iter().filter(|run| run.unburdened).collect();
    let of_free = || too_short_as(true, &free);
    too_short_as(false, &all).or_else(|| (!free.is_empty()).then(of_free).flatten())
}

/// Returns how the hold-out holds too little motion to judge by, and the recording.
pub(crate) fn too_short_to_judge(runs: &[Run]) -> Option<(Short, String)> {
    let all: Vec<&Run> = runs.iter().collect();
    let moving: f64 = 0.0 + runs.iter().map(in_motion).sum::<f64>();
    (moving < LEAST_TO_JUDGE).then(|| (Short::Holdout { moving }, label(&all)))
}

fn too_short_as(unburdened: bool, runs: &[&Run]) -> Option<(Short, String)> {
    let time = duration(runs);
    // The sum of an empty list is −0.
    let moving = 0.0 + runs.iter().map(|run| in_motion(run)).sum::<f64>();
    let long = time >= LEAST_TO_LEARN;
    if long && moving >= LEAST_TO_LEARN {
        return None;
    }
    let found = Short::Training {
        unburdened,
        time,
        moving: long.then_some(moving),
    };
    Some((found, label(runs)))
}

/// Returns a fault of the time unit by its steps.
pub(crate) fn clock(robot: &Robot, runs: &[&Run]) -> Option<Fault> {
    let steps: Vec<f64> = runs
        .iter()
        .flat_map(|run| run.t.windows(2).map(|w| w[1] - w[0]))
        .collect();
    let block = Block {
        t: vec![0.0, statistics::median(steps)?],
        ..Block::default()
    };
    let found = plausibility(&block, robot).into_iter().next()?;
    Some(Fault::of_recording(Finding::Clock(found)))
}

/// Returns columns of an uneven recording without a derivative or a size, which resampling would hide.
///
/// # Errors
/// Errors of reading.
pub(crate) fn spoilt(
    robot: &Robot,
    recording: &dyn Recording,
) -> Result<Vec<Fault>, DiagnoseError> {
    let problems = plausibility(&longest_part(recording, JUDGED_ROWS)?.rows(), robot);
    let spoilt = problems.into_iter().filter(Implausible::spoils);
    Ok(spoilt.filter_map(|found| of_column(robot, found)).collect())
}

/// Returns implausible units, one per joint and certainty.
pub(crate) fn units(robot: &Robot, runs: &[&Run]) -> Vec<Fault> {
    let mut found: Vec<Fault> = Vec::new();
    for run in runs {
        let block = Block {
            t: run.t.clone(),
            joints: run
                .joints
                .iter()
                .map(|joint| JointColumns {
                    q: joint.q_raw.clone(),
                    tau: joint.recorded().into_owned(),
                    ..JointColumns::default()
                })
                .collect(),
            ..Block::default()
        };
        for problem in plausibility(&block, robot) {
            let Some(fault) = of_column(robot, problem) else {
                continue;
            };
            let certain = fault.is_certain();
            if certain && fault.joint.is_none() {
                return vec![fault];
            }
            let known = |own: &Fault| own.joint == fault.joint && own.is_certain() == certain;
            if !found.iter().any(known) {
                found.push(fault);
            }
        }
    }
    found
}

/// Returns an implausible position or torque of a joint, or miscounted rows, as a fault; `None` for other columns.
fn of_column(robot: &Robot, problem: Implausible) -> Option<Fault> {
    let (joint, about) = match &problem {
        Implausible::HeldPosition { joints, .. } => (joints[0], About::Motion),
        Implausible::HeldEffort { joints, .. } => (joints[0], About::Torque),
        Implausible::Degrees { joint, .. }
        | Implausible::Position { joint, .. }
        | Implausible::Jump { joint, .. }
        | Implausible::Outlier { joint, .. }
        | Implausible::Frozen {
            column: "q", joint, ..
        }
        | Implausible::Unsigned {
            column: "q", joint, ..
        }
        | Implausible::Velocity { joint, .. }
        | Implausible::VelocityScale { joint, .. } => (*joint, About::Motion),
        Implausible::EffortTooLarge { joint, .. }
        | Implausible::EffortTooSmall { joint, .. }
        | Implausible::Unsigned { joint, .. }
        | Implausible::Frozen { joint, .. }
        | Implausible::Spike { joint, .. }
        | Implausible::NoEffort { joint } => (*joint, About::Torque),
        Implausible::LostRows { .. }
        | Implausible::StaleRows { .. }
        | Implausible::RepeatedRows { .. } => {
            return Some(Fault::of_recording(Finding::Clock(problem)));
        }
        Implausible::NotSeconds { .. }
        | Implausible::ReferenceScale { .. }
        | Implausible::NoRate { .. }
        | Implausible::RateMismatch { .. }
        | Implausible::RateSpike { .. } => return None,
    };
    let joint = joint.saturating_sub(1);
    robot.joints.get(joint)?;
    Some(Fault::of_joint(joint, Finding::Column(problem, about)))
}

/// Returns a fault if a measured velocity is not the rate of the position.
pub(crate) fn velocity(robot: &Robot, runs: &[&Run], k: usize) -> Option<Fault> {
    let joint = robot.joints.get(k)?;
    let run = runs.iter().max_by_key(|run| run.len())?;
    let own = run.joints.get(k)?;
    let factor = velocity_scale(&run.t, &own.q_raw, own.measured_velocity.as_ref()?)?;
    // A filter or another joint's share may change a part of it; units and ratios change more.
    if (0.5..2.0).contains(&factor) {
        return None;
    }
    if (-2.0..-0.5).contains(&factor) {
        return Some(Fault::of_joint(k, Finding::VelocityReversed));
    }
    let own = names::of_velocity(joint, factor);
    let of_position = own.is_none();
    let found = Finding::VelocityScaled {
        factor,
        name: own.or_else(|| names::of_position(joint, 1.0 / factor)),
        of_position,
    };
    Some(Fault::of_joint(k, found))
}

/// Returns a fault if a torque stays at its limit while the joint moves.
pub(crate) fn at_limit(robot: &Robot, runs: &[&Run], k: usize) -> Option<Fault> {
    let joint = robot.joints.get(k)?;
    let limit = joint.limits.as_ref()?.torque?;
    let own = || runs.iter().filter_map(|run| run.joints.get(k));
    let fastest = own()
        .flat_map(|j| &j.qd)
        .fold(0.0f64, |most, v| most.max(v.abs()));
    let (mut count, mut at) = (0_usize, 0_usize);
    for joint in own() {
        let rows = joint.qd.iter().zip(joint.recorded().into_owned());
        for (_, tau) in rows.filter(|(qd, _)| qd.abs() > 0.05 * fastest) {
            count += 1;
            at += usize::from((0.98..1.02).contains(&(tau.abs() / limit)));
        }
    }
    let share = at as f64 / count.max(1) as f64;
    (share > AT_LIMIT).then(|| Fault::of_joint(k, Finding::AtLimit { limit, share }))
}
