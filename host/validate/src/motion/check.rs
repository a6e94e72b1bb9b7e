//! Comparison of the simulated with the measured motion.

use super::difference::{Change, Sums};
use super::simulation::{Outcome, STEP_SHARE, Simulation, Subject};
use super::stretch::{FEWEST_ROWS, FIRST_ROWS};
use crate::{Motion, MotionCheck, MotionSeries, ValidateError};
use rig_model::robot::Joint;

/// Largest number of points of a curve for plots.
const SERIES_POINTS: usize = 4000;

/// Simulates a recording and compares; `progress` receives the completed share.
pub(crate) fn check(
    subject: &Subject<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<Motion, ValidateError> {
    let simulation = match Simulation::prepare(subject)? {
        Ok(simulation) => simulation,
        Err(why) => return Ok(Motion::NotSimulated { why }),
    };
    let outcome = match simulation.refine(subject.options.substeps, progress) {
        Ok(outcome) => outcome,
        Err(why) => return Ok(Motion::NotSimulated { why }),
    };
    let remarks = remarks(subject, &simulation, &outcome);
    let joints = outcome
        .errors
        .joints
        .iter()
        .zip(&subject.robot.joints)
        .zip(&outcome.change)
        .enumerate()
        .map(|(j, ((e, joint), change))| {
            let series = series(j, &simulation, &outcome.motions);
            let saturated = outcome.motions.iter().map(|m| m.saturated[j] as u64).sum();
            joint_check(joint, e, change, saturated, series)
        })
        .collect();
    Ok(Motion::Simulated {
        joints,
        samples: simulation.samples as u64,
        of: subject.survey.rows,
        stretches: simulation.gathered.stretches.len(),
        substeps: outcome.substeps,
        uncontrolled: simulation.uncontrolled,
        remarks,
    })
}

/// Returns the comparison of one joint.
fn joint_check(
    joint: &Joint,
    e: &Sums,
    change: &Change,
    saturated: u64,
    series: MotionSeries,
) -> MotionCheck {
    let (position_unit, torque_unit) = joint.kind.units();
    MotionCheck {
        joint: joint.name.clone(),
        position_unit: position_unit.to_owned(),
        torque_unit: torque_unit.to_owned(),
        position_rms_error: e.position_rms(),
        position_max_error: e.position_max,
        position_relative_error: e.position_rms() / e.spread(),
        tracking_rms: e.rms(e.tracking),
        tracking_relative_error: e.position_rms() / e.rms(e.tracking),
        torque_rms_error: e.torque_rms(),
        torque_max_error: e.torque_max,
        torque_relative_error: e.torque_rms() / e.rms(e.torque_squares),
        saturated,
        position_step_change: change.position,
        torque_step_change: change.torque,
        series,
    }
}

/// Returns sentences on start, step and omissions of a simulation.
fn remarks(subject: &Subject<'_>, simulation: &Simulation<'_>, outcome: &Outcome) -> Vec<String> {
    let substeps = outcome.substeps;
    let step = simulation.period / f64::from(substeps);
    let mut remarks = vec![
        match &simulation.replay {
            Some(replay) => format!(
                "{} Every stretch starts from its own first position and velocity.",
                replay.how
            ),
            None => format!(
                "Every stretch starts from its own first position and velocity (a parabola through its first {FIRST_ROWS} rows, or the recorded velocity). After that only {} the simulation.",
                if simulation.gathered.added.is_empty() {
                    "the reference drives"
                } else {
                    "the reference and the added torque drive"
                }
            ),
        },
        if outcome.settled {
            format!(
                "Step {:.4} ms ({substeps} a sample); halving it changes the motion by less than {:.0} % of the errors shown.",
                1e3 * step,
                100.0 * STEP_SHARE
            )
        } else {
            format!(
                "Step {:.4} ms ({substeps} a sample); halving it still changes the motion by more than {:.0} % of the errors shown: compare the columns.",
                1e3 * step,
                100.0 * STEP_SHARE
            )
        },
    ];
    if simulation.replay.is_none() {
        remarks.extend(simulation.gathered.added.iter().cloned());
    }
    remarks.extend(subject.model.effects.unsimulated());
    if simulation.gathered.short > 0 {
        remarks.push(format!(
            "{} stretches between gaps in time are shorter than {FEWEST_ROWS} rows and were not simulated.",
            simulation.gathered.short
        ));
    }
    let samples = simulation.samples;
    if (samples as u64) < subject.survey.rows && samples >= subject.options.most_samples {
        remarks.push(format!(
            "Only the first {samples} of {} samples ({:.1} s) were simulated, to bound memory.",
            subject.survey.rows,
            samples as f64 * simulation.period
        ));
    }
    remarks
}

/// Returns the curves of joint `j` for plots.
fn series(
    j: usize,
    simulation: &Simulation<'_>,
    motions: &[rig_model::simulate::Motion],
) -> MotionSeries {
    let every = simulation.samples.div_ceil(SERIES_POINTS).max(1);
    let mut series = MotionSeries::default();
    for (stretch, motion) in simulation.gathered.stretches.iter().zip(motions) {
        for k in (0..stretch.t.len()).step_by(every) {
            series.t.push(stretch.t[k]);
            series.reference.push(stretch.reference[j][k]);
            series.measured.push(stretch.q[j][k]);
            series.simulated.push(motion.q[j][k]);
            series.torque_measured.push(stretch.tau[j][k]);
            series.torque_simulated.push(motion.tau[j][k]);
        }
    }
    series
}
