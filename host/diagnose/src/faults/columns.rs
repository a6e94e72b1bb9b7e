//! Faults that columns show by themselves and against each other, without a model.

use std::ops::Range;

use crate::DiagnoseError;
use crate::faults::names;
use crate::outcome::{About, DataFault, FaultKind};
use rig_data::prepare::{Recording, first_block};
use rig_data::runs::Run;
use rig_data::runs::{JointRun, resolution};
use rig_data::{
    Block, Implausible, JUDGED_ROWS, JointColumns, plausibility, unit_of_steps, velocity_scale,
};
use rig_model::robot::{JointKind, Robot};
use rig_numerics::statistics;

/// Shortest recording, s, with a reversal and its repetition.
const SHORTEST: f64 = 1.0;
/// Least training time in all, s: some stretches give a name and others test it.
const LEAST_TO_LEARN: f64 = 5.0;
/// … and least time to judge by.
const LEAST_TO_JUDGE: f64 = 2.0;
/// Fewest rows for the parameters of one joint.
const FEWEST: usize = 100;
/// Share of the moving time at the torque limit above which too little data remains.
const AT_LIMIT: f64 = 0.2;

/// Least range of a joint that moves, rad or m.
const LEAST_MOTION: f64 = 1e-5;
/// … and as a multiple of the noise that the filter removes.
const ABOVE_NOISE: f64 = 8.0;
/// Least range within a second, in steps of the encoder.
const STEPS: f64 = 3.0;

/// Returns true if a column has no derivative or no size to compare with a model: every joint would look wrong.
pub(crate) fn spoils_the_model(fault: &DataFault) -> bool {
    fault.certain && [FaultKind::Jump, FaultKind::Held, FaultKind::Unsigned].contains(&fault.kind)
}

/// Returns the name of the recording.
pub(crate) fn label(runs: &[&Run]) -> String {
    runs.first()
        .map_or_else(String::new, |run| run.label.clone())
}

/// Returns a fault of the recording.
pub(crate) fn fault(
    runs: &[&Run],
    kind: FaultKind,
    about: About,
    joint: &str,
    text: String,
) -> DataFault {
    DataFault {
        kind,
        about,
        recording: label(runs),
        joint: joint.to_owned(),
        certain: true,
        text,
    }
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
pub(crate) fn too_short(runs: &[&Run]) -> Option<DataFault> {
    let rows: usize = runs.iter().map(|run| run.len()).sum();
    let time: f64 = runs
        .iter()
        .map(|run| run.len() as f64 / run.rate.max(f64::MIN_POSITIVE))
        .sum();
    (rows < FEWEST || time < SHORTEST).then(|| {
        fault(
            runs,
            FaultKind::TooShort,
            About::Recording,
            "",
            format!(
                "The recording holds {rows} rows, {time:.2} s; at least {FEWEST} rows and {SHORTEST} s are needed, half a minute with reversals would be right."
            ),
        )
    })
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

/// Returns a fault if the training data, or those without external loads, hold too little motion for names.
pub(crate) fn too_short_to_learn(runs: &[Run]) -> Option<DataFault> {
    let all: Vec<&Run> = runs.iter().collect();
    let free: Vec<&Run> = runs.iter().filter(|run| run.unburdened).collect();
    let of_free = || too_short_as("recordings with everything taken off", &free);
    too_short_as("training data", &all).or_else(|| (!free.is_empty()).then(of_free).flatten())
}

/// Returns a fault if the hold-out holds too little motion to judge by.
pub(crate) fn too_short_to_judge(runs: &[Run]) -> Option<DataFault> {
    let all: Vec<&Run> = runs.iter().collect();
    let moving: f64 = 0.0 + runs.iter().map(in_motion).sum::<f64>();
    (moving < LEAST_TO_JUDGE).then(|| {
        fault(
            &all,
            FaultKind::TooShort,
            About::Recording,
            "",
            format!(
                "The recordings held back hold {moving:.2} s of motion beyond the noise and the steps of its position; nothing is judged by less than {LEAST_TO_JUDGE} s, and half a minute with reversals would be right."
            ),
        )
    })
}

fn too_short_as(what: &str, runs: &[&Run]) -> Option<DataFault> {
    let time: f64 = (runs.iter())
        .map(|run| run.len() as f64 / run.rate.max(f64::MIN_POSITIVE))
        .sum();
    // The sum of an empty list is −0.
    let moving = 0.0 + runs.iter().map(|run| in_motion(run)).sum::<f64>();
    let (kind, held) = match () {
        () if time < LEAST_TO_LEARN => (FaultKind::TooShort, format!("{time:.2} s in all")),
        () if moving < LEAST_TO_LEARN => (
            FaultKind::NotMoving,
            format!(
                "{moving:.1} s of motion beyond the noise and the steps of its position, in {time:.1} s"
            ),
        ),
        () => return None,
    };
    Some(fault(
        runs,
        kind,
        About::Recording,
        "",
        format!(
            "The {what} hold {held}; names are not learnt from less than {LEAST_TO_LEARN} s, and half a minute with reversals would be right."
        ),
    ))
}

/// Returns a fault of the time unit by its steps.
pub(crate) fn clock(robot: &Robot, runs: &[&Run]) -> Option<DataFault> {
    let steps: Vec<f64> = runs
        .iter()
        .flat_map(|run| run.t.windows(2).map(|w| w[1] - w[0]))
        .collect();
    let block = Block {
        t: vec![0.0, statistics::median(steps)?],
        ..Block::default()
    };
    plausibility(&block, robot).first().map(|found| {
        let Implausible::NotSeconds { step } = found else {
            return fault(
                runs,
                FaultKind::Clock,
                About::Recording,
                "",
                found.to_string(),
            );
        };
        let unit = unit_of_steps(*step);
        fault(
            runs,
            FaultKind::Clock,
            About::Recording,
            "",
            format!("t looks like {unit}: its steps are {step:.4}, where seconds would be right."),
        )
    })
}

/// Returns columns of uneven recordings without a derivative or a size, which resampling would hide.
///
/// # Errors
/// Errors of reading.
pub(crate) fn spoilt_columns(
    robot: &Robot,
    recordings: &[&dyn Recording],
) -> Result<Vec<DataFault>, DiagnoseError> {
    let mut found = Vec::new();
    for recording in recordings {
        let Some(block) = first_block(*recording, JUDGED_ROWS)? else {
            continue;
        };
        let problems = plausibility(&block, robot).into_iter();
        found.extend(problems.filter(Implausible::spoils).filter_map(|problem| {
            let (_, mut fault) = of_column(robot, &problem)?;
            fault.recording = recording.label();
            Some(fault)
        }));
    }
    Ok(found)
}

/// Returns implausible units, one per joint and certainty.
pub(crate) fn units(robot: &Robot, runs: &[&Run]) -> Vec<(usize, DataFault)> {
    let mut found: Vec<(usize, DataFault)> = Vec::new();
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
            let Some((joint, mut fault)) = of_column(robot, &problem) else {
                continue;
            };
            fault.recording = label(runs);
            let known = |(j, own): &(usize, DataFault)| *j == joint && own.certain == fault.certain;
            if !found.iter().any(known) {
                found.push((joint, fault));
            }
        }
    }
    found
}

/// Returns an implausible position or torque of a joint as a fault; `None` for other columns.
fn of_column(robot: &Robot, problem: &Implausible) -> Option<(usize, DataFault)> {
    let (joint, about) = match problem {
        Implausible::HeldPosition { joints, .. } => (joints[0], About::Motion),
        Implausible::HeldEffort { joints, .. } => (joints[0], About::Torque),
        Implausible::Degrees { joint, .. }
        | Implausible::Position { joint, .. }
        | Implausible::Jump { joint, .. }
        | Implausible::Unsigned {
            column: "q", joint, ..
        }
        | Implausible::Velocity { joint, .. }
        | Implausible::VelocityScale { joint, .. } => (*joint, About::Motion),
        Implausible::EffortTooLarge { joint, .. }
        | Implausible::EffortTooSmall { joint, .. }
        | Implausible::Unsigned { joint, .. }
        | Implausible::Spike { joint, .. }
        | Implausible::NoEffort { joint } => (*joint, About::Torque),
        Implausible::NotSeconds { .. }
        | Implausible::ReferenceScale { .. }
        | Implausible::NoRate { .. }
        | Implausible::RateSpike { .. } => return None,
    };
    let joint = joint.saturating_sub(1);
    let kind = match problem {
        Implausible::Jump { .. } | Implausible::Spike { .. } => FaultKind::Jump,
        Implausible::HeldPosition { .. } | Implausible::HeldEffort { .. } => FaultKind::Held,
        Implausible::Unsigned { .. } => FaultKind::Unsigned,
        _ => FaultKind::Unit,
    };
    let fault = DataFault {
        kind,
        about,
        recording: String::new(),
        joint: robot.joints.get(joint)?.name.clone(),
        certain: !problem.is_doubt(),
        text: format!("{problem}."),
    };
    Some((joint, fault))
}

/// Returns a fault if a measured velocity is not the rate of the position.
pub(crate) fn velocity(robot: &Robot, runs: &[&Run], k: usize) -> Option<DataFault> {
    let joint = robot.joints.get(k)?;
    let run = runs.iter().max_by_key(|run| run.len())?;
    let own = run.joints.get(k)?;
    let factor = velocity_scale(&run.t, &own.q_raw, own.measured_velocity.as_ref()?)?;
    // A filter or another joint's share may change a part of it; units and ratios change more.
    if (0.5..2.0).contains(&factor) {
        return None;
    }
    let n = k + 1;
    let unit = match joint.kind {
        JointKind::Revolute => "rad/s",
        JointKind::Prismatic => "m/s",
    };
    if (-2.0..-0.5).contains(&factor) {
        return Some(fault(
            runs,
            FaultKind::Sign,
            About::Motion,
            &joint.name,
            format!(
                "qd{n} has the opposite sign of the change of q{n} over time; reverse one of them."
            ),
        ));
    }
    let of_velocity = names::of_velocity(joint, factor).map(|name| {
        (
            FaultKind::Unit,
            format!("qd{n} looks like {}; give it in {unit}", name.text),
        )
    });
    let of_position = || {
        let name = names::of_position(joint, 1.0 / factor)?;
        Some((name.kind(), format!("of q{n}, {}", name.text)))
    };
    let (kind, what) = of_velocity.or_else(of_position).unwrap_or_else(|| {
        let unnamed = format!(
            "give it in {unit}, and check the gear ratio, the counts of the encoder and the clock"
        );
        (FaultKind::Ratio, unnamed)
    });
    Some(fault(
        runs,
        kind,
        About::Motion,
        &joint.name,
        format!(
            "qd{n} is {:.4} times the change of q{n} over time; {what}.",
            1.0 / factor
        ),
    ))
}

/// Returns a fault if a torque stays at its limit while the joint moves.
pub(crate) fn at_limit(robot: &Robot, runs: &[&Run], k: usize) -> Option<DataFault> {
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
    (share > AT_LIMIT).then(|| {
        fault(
            runs,
            FaultKind::Saturation,
            About::Torque,
            &joint.name,
            format!(
                "tau{} stands at its limit of {limit} for {:.0} % of the time in motion; record a motion that needs less.",
                k + 1,
                100.0 * share
            ),
        )
    })
}
