//! Recordings that cannot be what they say: sign, unit, ratio, clock, saturation.
//!
//! Friction and inertia are positive in every robot, gravity's period is one turn, and the description's own values are
//! right within a small factor. What breaks these by a factor that units, ratios or senses have is a fault of the data
//! and is named; nothing is explained by it. A factor below five that no unit has is a change of the robot, and for
//! others to judge.
//!
//! Leaves out: faults that leave the data consistent in themselves where the description states nothing (both signs
//! reversed, one factor on everything); a late torque of a slow arm whose motion has few harmonics, which the
//! model's many parameters take up; a fault that comes and goes within a recording; a sign that a short motion does not
//! show beyond what its many parameters take up.

mod alike;
mod candidates;
mod columns;
mod fit;
mod gravity;
mod link;
mod magnitude;
mod model;
pub(super) mod names;
pub(super) mod nnls;
mod order;
mod physical;
mod place;
mod rotor;
mod rows;
mod senses;
mod trial;
mod undo;
mod wave;

#[cfg(test)]
mod tests;

pub(super) use columns::{moves, spoilt_columns, too_short_to_judge, too_short_to_learn};

use super::DiagnoseError;
use super::outcome::{About, DataFault};
use rig_data::Source;
use rig_data::prepare::{Beginning, LowPass, Recording, Resampled};
use rig_data::runs::Run;
use rig_data::runs::runs_of;
use rig_model::robot::Robot;

/// Cut-off of the positions that are judged, Hz.
const BAND: f64 = 20.0;

/// What is wrong with each recording; empty where all is well.
///
/// A recording at rest is a fault only where no recording moves: a log with the drive off belongs to the experiments.
/// Of long recordings the first 6000 rows of 20 ms are judged against the model.
///
/// # Errors
/// [`DiagnoseError::Model`] where the description's geometry is no chain.
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
        // By its clock a recording is as long as it says.
        if let Some(fault) = columns::clock(robot, &own).or_else(|| columns::too_short(&own)) {
            found.push(fault);
            continue;
        }
        if !own.iter().any(|run| moves(run)) {
            if !any {
                found.push(columns::fault(
                    &own,
                    "not-moving",
                    About::Recording,
                    "",
                    "No joint moves by more than the noise of its encoder; record a motion, or check that the position column is alive.".to_owned(),
                ));
            }
            continue;
        }
        found.extend(of_one(robot, &own)?);
    }
    Ok(found)
}

/// What is wrong with the beginning of a recording, its first `rows` rows, before it is fitted: signs, units, ratios, clocks
/// and columns in each other's place. Saturation is said and no reason to stop: a fit leaves such rows out.
///
/// # Errors
/// What reading gives, and [`DiagnoseError::Model`].
pub fn faults_at_start(
    robot: &Robot,
    source: &Source,
    rows: usize,
) -> Result<Vec<DataFault>, DiagnoseError> {
    let sampling = source.sampling();
    let rate = 1.0 / sampling.period;
    let Some(low_pass) = LowPass::butterworth(4, f64::min(BAND, 0.2 * rate), rate) else {
        return Ok(Vec::new());
    };
    // Uneven rows have no derivative before they are brought to an even step.
    let even = Resampled::new(source, sampling.period);
    let recording: &dyn Recording = if sampling.irregular { &even } else { source };
    let runs = runs_of(&Beginning { recording, rows }, 0, rate, &low_pass)?;
    let own: Vec<&Run> = runs.iter().collect();
    if own.is_empty() || columns::too_short(&own).is_some() {
        return Ok(Vec::new());
    }
    let mut found = faults(robot, &runs)?;
    found.retain(|fault| !["not-moving", "too-short"].contains(&fault.kind.as_str()));
    // The fit leaves rows at a limit out.
    for fault in found.iter_mut().filter(|fault| fault.kind == "saturation") {
        fault.certain = false;
    }
    Ok(found)
}

fn of_one(robot: &Robot, runs: &[&Run]) -> Result<Vec<DataFault>, DiagnoseError> {
    let n = robot.joints.len();
    let units = columns::units(robot, runs);
    if units
        .iter()
        .any(|(_, fault)| columns::spoils_the_model(fault))
    {
        return Ok(units.into_iter().map(|(_, fault)| fault).collect());
    }
    let torque = runs
        .iter()
        .all(|run| run.joints.len() == n && run.joints.iter().all(|j| j.tau.len() == j.q.len()));
    let mut judged = if torque {
        model::Judge::new(robot, runs)?.faults()?
    } else {
        Vec::new()
    };
    let (doubts, units): (Vec<_>, Vec<_>) =
        units.into_iter().partition(|(_, fault)| !fault.certain);
    if !units.is_empty() {
        // What a wrong unit of one joint does to the others is its consequence, as is what a wrong position makes of the
        // torque.
        let own = |f: &DataFault| units.iter().find(|(_, fault)| fault.joint == f.joint);
        let of_torque = |f: &DataFault| f.about == About::Torque;
        judged.retain(|f| own(f).is_some_and(|(_, unit)| of_torque(unit) || !of_torque(f)));
    }
    // The model says more closely what the limits only notice.
    let mut found: Vec<DataFault> = units
        .into_iter()
        .map(|(_, fault)| fault)
        .filter(|fault| judged.iter().all(|f| f.joint != fault.joint))
        .collect();
    found.extend(judged);
    found.extend(doubts.into_iter().map(|(_, fault)| fault));
    for j in 0..n {
        // A wrong position belongs to no measured velocity either; that says nothing new.
        if found.iter().all(|f| f.joint != robot.joints[j].name) {
            found.extend(columns::velocity(robot, runs, j));
        }
        if found.iter().all(|f| f.joint != robot.joints[j].name) {
            found.extend(link::fault(robot, runs, j));
        }
        found.extend(columns::at_limit(robot, runs, j));
    }
    Ok(found)
}
