//! Recordings with a wrong sign, unit, ratio, clock or saturation.
//!
//! Every robot has positive friction and inertia, and gravity repeats once per turn. The description's values are right
//! within a small factor. A deviation by a factor of units, ratios or senses is a data fault and is named; no effect
//! explains it. A factor below five that no unit has is a change of the robot, which other modules judge.
//!
//! Leaves out: faults in consistent data where the description states nothing (both signs reversed, one factor on
//! everything); a late torque of a slow arm with few harmonics, as many parameters compensate it; intermittent faults;
//! a sign that many parameters compensate in a short motion.

mod alike;
mod candidates;
mod columns;
mod described;
mod factors;
mod finding;
mod fit;
mod gain;
mod gravity;
mod judge;
mod levels;
mod link;
mod magnitude;
mod misfit;
mod model;
pub(crate) mod names;
mod order;
mod physical;
mod place;
pub(crate) mod refusal;
mod residual;
mod rotor;
mod rows;
mod search;
mod senses;
pub(crate) mod sentences;
mod suspicion;
mod trial;
mod undo;
mod wave;

#[cfg(test)]
mod tests;

pub(crate) use columns::moves;

use crate::DiagnoseError;
use crate::faults::finding::{Fault, Finding, Short};
use crate::outcome::{About, DataFault, FaultKind};
use rig_data::Source;
use rig_data::prepare::{Beginning, LowPass, Recording, Resampled};
use rig_data::runs::Run;
use rig_data::runs::runs_of;
use rig_model::robot::Robot;

/// Cut-off of the judged positions, Hz.
const BAND: f64 = 20.0;

/// Returns the faults of each recording; empty if there are none.
///
/// A recording at rest is a fault only if no recording moves: a log with the drive off belongs to the experiments. Only
/// the first 6000 rows of 20 ms are compared with the model.
///
/// # Errors
/// [`DiagnoseError::Model`] if the description's geometry is no chain.
pub fn faults(robot: &Robot, runs: &[Run]) -> Result<Vec<DataFault>, DiagnoseError> {
    let recordings = runs.iter().map(|run| run.recording + 1).max().unwrap_or(0);
    let n = robot.joints.len();
    let moves = |run: &Run| (0..n).any(|j| columns::moves(run, j));
    let any = runs.iter().any(moves);
    let mut found = Vec::new();
    for recording in 0..recordings {
        let own: Vec<&Run> = runs.iter().filter(|r| r.recording == recording).collect();
        if own.is_empty() {
            continue;
        }
        let tell = |fault: Fault| told(robot, columns::label(&own), &fault);
        // The clock determines the length of a recording.
        if let Some(fault) = columns::clock(robot, &own).or_else(|| columns::too_short(&own)) {
            found.push(tell(fault));
        } else if own.iter().any(|run| moves(run)) {
            found.extend(of_one(robot, &own)?.into_iter().map(tell));
        } else if !any {
            found.push(tell(Fault::of_recording(Finding::NoMotion)));
        }
    }
    Ok(found)
}

/// Returns faults in the first `rows` rows of a recording, before a fit: signs, units, ratios, clocks and exchanged
/// columns. Saturation is reported as not certain: a fit excludes such rows.
///
/// # Errors
/// Errors of reading, and [`DiagnoseError::Model`].
pub fn faults_at_start(
    robot: &Robot,
    source: &Source,
    rows: usize,
) -> Result<Vec<DataFault>, DiagnoseError> {
    robot
        .without_followers("The search for faults of the data")
        .map_err(Box::new)?;
    let sampling = source.sampling();
    let rate = 1.0 / sampling.period;
    let Some(low_pass) = LowPass::butterworth(4, f64::min(BAND, 0.2 * rate), rate) else {
        return Ok(Vec::new());
    };
    // Uneven rows must be resampled before differentiation.
    let even = Resampled::new(source, sampling.period);
    let recording: &dyn Recording = if sampling.irregular { &even } else { source };
    let runs = runs_of(&Beginning { recording, rows }, 0, rate, &low_pass)?;
    let own: Vec<&Run> = runs.iter().collect();
    if own.is_empty() || columns::too_short(&own).is_some() {
        return Ok(Vec::new());
    }
    let mut found = faults(robot, &runs)?;
    found.retain(|fault| ![FaultKind::NotMoving, FaultKind::TooShort].contains(&fault.kind));
    // The fit excludes rows at a limit.
    for fault in found
        .iter_mut()
        .filter(|fault| fault.kind == FaultKind::Saturation)
    {
        fault.certain = false;
    }
    Ok(found)
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
        let spoilt = columns::spoilt(robot, *recording)?;
        found.extend((spoilt.iter()).map(|fault| told(robot, recording.label(), fault)));
    }
    Ok(found)
}

/// Returns a fault if the training data, or those without external loads, hold too little motion for names.
pub(crate) fn too_short_to_learn(runs: &[Run]) -> Option<DataFault> {
    columns::too_short_to_learn(runs).map(told_short)
}

/// Returns a fault if the hold-out holds too little motion to judge by.
pub(crate) fn too_short_to_judge(runs: &[Run]) -> Option<DataFault> {
    columns::too_short_to_judge(runs).map(told_short)
}

/// Returns a fault in words.
fn told(robot: &Robot, recording: String, fault: &Fault) -> DataFault {
    let joint = fault.joint.and_then(|j| robot.joints.get(j));
    DataFault {
        kind: fault.finding.kind(),
        about: fault.finding.about(),
        recording,
        joint: joint.map_or_else(String::new, |joint| joint.name.clone()),
        certain: fault.is_certain(),
        of_description: fault.finding.is_of_description(),
        column: fault.finding.column().cloned(),
        text: sentences::of(robot, fault),
    }
}

fn told_short((found, recording): (Short, String)) -> DataFault {
    DataFault {
        text: sentences::short(&found),
        kind: Finding::Short(found).kind(),
        about: About::Recording,
        recording,
        joint: String::new(),
        certain: true,
        of_description: false,
        column: None,
    }
}

/// Returns the faults of one moving recording.
fn of_one(robot: &Robot, runs: &[&Run]) -> Result<Vec<Fault>, DiagnoseError> {
    let n = robot.joints.len();
    let units = columns::units(robot, runs);
    if units.iter().any(columns::spoils_the_model) {
        return Ok(units);
    }
    let torque = runs
        .iter()
        .all(|run| run.joints.len() == n && run.joints.iter().all(|j| j.tau.len() == j.q.len()));
    let mut judged = Vec::new();
    if torque {
        for round in judge::Judge::new(robot, runs, &units)?.faults()? {
            judged.extend(unsaid(robot, &judged, round));
        }
        // A torque that fits after a certain fault is undone shows no gain as recorded.
        if units.iter().chain(&judged).all(|fault| !fault.is_certain()) {
            judged.extend(gain::changes(robot, runs)?);
        }
    }
    let (mut units, doubts): (Vec<_>, Vec<_>) = units.into_iter().partition(Fault::is_certain);
    // One cause at all joints is the reason of what single columns show.
    let of_all = |f: &&Fault| f.is_certain() && f.finding.is_of_all_gears();
    if let Some(own) = judged.iter().find(of_all) {
        units.retain(|unit| unit.finding.about() != own.finding.about());
    }
    if !units.is_empty() {
        // Drops consequences: faults of other joints from a wrong unit, and torque faults from a wrong position.
        let own = |f: &Fault| units.iter().find(|fault| fault.joint == f.joint);
        let of_torque = |f: &Fault| f.finding.about() == About::Torque;
        judged.retain(|f| own(f).is_some_and(|unit| of_torque(unit) || !of_torque(f)));
    }
    // Faults by the model are more precise than those by plausibility limits.
    let mut found = units;
    found.retain(|fault| judged.iter().all(|f| f.joint != fault.joint));
    found.extend(judged);
    found.extend(doubts);
    for j in 0..n {
        let sound = |found: &[Fault]| !found.iter().any(|f| f.concerns(j));
        // A wrong position also contradicts the measured velocity.
        if sound(&found) {
            found.extend(columns::velocity(robot, runs, j));
        }
        if sound(&found) {
            found.extend(link::fault(robot, runs, j));
        }
        found.extend(columns::at_limit(robot, runs, j));
    }
    Ok(found)
}

/// Returns the faults of `more` that differ in words from all `known`.
fn unsaid(robot: &Robot, known: &[Fault], mut more: Vec<Fault>) -> Vec<Fault> {
    let said = |fault: &Fault| told(robot, String::new(), fault);
    let known: Vec<DataFault> = known.iter().map(said).collect();
    more.retain(|fault| !known.contains(&said(fault)));
    more
}
