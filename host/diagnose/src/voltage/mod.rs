//! The gap workflow for one joint driven by a known voltage, without measured torque or current.
//!
//! Without torque, the model runs freely from the recorded start of each recording with the recorded voltage. The gap
//! is that of the position, in rad (or m). Identifiable are torque per volt, back-EMF, the drive's inertia and
//! friction, relative to the link's inertia and weight, which must be described. `search` adds one effect at a time by
//! the motion of left-out recordings (Stone 1974). `train_rms`, `holdout_rms`, waterfall and floor refer to the
//! position. Each recording is simulated from its first row to its last without using the measured motion in between
//! (`LONGEST` at most, then it restarts).
//!
//! If references and voltage show the controller, the loop is closed (`law`) and no recorded voltage drives. An effect
//! that makes the hold-out motion worse is rejected.
//!
//! A fit starts with the equation of motion on short pieces (`start`), continues with windows of one second and ends
//! with whole recordings. A free run that leaves the recorded motion has diverged ([`FreeRun`]); its errors are no
//! residual.
//!
//! Leaves out: several joints; effects between motor and link and on the encoder; periodic torques; warming; filters
//! and delays of the controller.

#[cfg(test)]
mod closed_loop_tests;
mod controllers;
mod describe;
mod driven;
mod faults;
mod fit;
mod free_run;
mod halt;
mod law;
mod log;
mod plant;
mod replay;
mod search;
#[cfg(test)]
mod servo;
mod start;
mod stepper;
#[cfg(test)]
mod tests;
mod validation;

use rig_shared::multibody::{COLUMNS, Chain, column, gravity_vector};

use crate::description::described_effects::DescribedEffects;
use crate::faults::refusal::faulty;
use crate::outcome::{Curves, Diagnosis};
pub use crate::voltage::controllers::terms as controller_terms;
use crate::voltage::describe::Told;
pub use crate::voltage::driven::DrivenError;
use crate::voltage::driven::{Followed, Reference, VoltageModel, reference_of};
pub use crate::voltage::free_run::FreeRun;
use crate::voltage::law::Supply;
use crate::voltage::log::{Log, logs};
use crate::voltage::plant::Plant;
pub use crate::voltage::replay::{ReplayError, VoltageReplay, replay_voltage};
use crate::voltage::search::{Model, Search, library};
pub use crate::voltage::validation::{
    DrivenBy, VoltageChecked, VoltageValidation, validate_voltage,
};
use crate::{DiagnoseError, Options};
use rig_data::prepare::Recording;
use rig_model::robot::{JointKind, Robot};

/// Longest stretch of one simulation, s: a joint without weight drifts without bounds.
const LONGEST: f64 = 10.0;
/// Most recordings in the pictures.
const DRAWN: usize = 4;

/// Finds the missing effects of a voltage-driven joint. The second result is the description with the effects and the
/// newly identified parameters.
///
/// # Errors
/// [`DiagnoseError`]: no recording, no voltage, more than one joint, a link without inertia, a motion that excites
/// nothing.
pub fn diagnose_voltage(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DiagnoseError> {
    if training.is_empty() {
        return Err(DiagnoseError::NoRecording);
    }
    let mut stated = DescribedEffects::of(robot);
    let plant = plant(&stated.robot)?;
    let mut train = logs(training)?;
    let mut held_out = logs(holdout)?;
    let supply = Supply::of(&train);
    supply.give(&mut train);
    supply.give(&mut held_out);
    let wrong = faults::faults(robot, &plant, &[training, holdout], &[&train, &held_out])?;
    if !options.fits(&wrong) {
        return Ok((faulty(robot, wrong), robot.clone()));
    }
    let search = |plant, logs| Search {
        plant,
        logs,
        library: library(&options.without, train.iter().any(|log| log.law.is_some())),
        threads: rig_data::prepare::threads(options.threads),
    };
    let plant = search(&plant, &train).in_fine_steps();
    let bench = search(&plant, &train);
    let nominal = nominal(&bench, &mut stated)?;
    progress(0.2);
    let mut rounds = Vec::new();
    let mut unseen = Vec::new();
    let models = bench.run(&nominal, &mut |round, before, trials| {
        unseen.push(before);
        rounds.push(trials.to_vec());
        progress(0.2 + 0.7 * (1.0 - 0.6_f64.powi(round as i32 + 1)));
    });
    let judge = search(&plant, &held_out);
    let holdout: Vec<FreeRun> = if held_out.is_empty() {
        Vec::new()
    } else {
        models.iter().map(|m| judge.freely(m)).collect()
    };
    let drawn = if held_out.is_empty() { &bench } else { &judge };
    let found = Told {
        curves: curves(&robot.joints[0].name, drawn, &models),
        stated: &stated,
        floor: floor(&train),
        train: models.iter().map(|m| bench.freely(m)).collect(),
        holdout,
        controllers: controllers::shown(&train),
        deviations: models.iter().map(|m| bench.deviations(m)).collect(),
        models,
        rounds,
        unseen,
        driven: driven(&train, &held_out),
    };
    let mut result = (found.diagnosis(), found.robot(&plant));
    result.0.data_faults = wrong;
    progress(1.0);
    Ok(result)
}

/// Fits the model of the description's structure, with the description's effects.
fn nominal(bench: &Search<'_>, stated: &mut DescribedEffects) -> Result<Model, DiagnoseError> {
    let parts = stated.driven(&bench.library);
    let nominal = bench.nominal().ok_or_else(|| {
        DiagnoseError::Model(
            "the voltage does not move this joint as a motor's would; check the sign of the voltage, or record a livelier motion.".into(),
        )
    })?;
    let whole = bench.with_described(nominal, &parts, &stated.robot);
    whole.ok_or_else(|| {
        DiagnoseError::Model(
            "with its effects the description cannot be simulated under these voltages; look at the values of its [[effect]] tables.".into(),
        )
    })
}

/// Returns the motion of the recordings that effects change most, without effects and with all.
fn curves(joint: &str, search: &Search<'_>, models: &[Model]) -> Vec<Curves> {
    let (Some(first), Some(last)) = (models.first(), models.last()) else {
        return Vec::new();
    };
    let mut list: Vec<(f64, Curves)> = (0..search.logs.len())
        .map(|k| {
            let log = &search.logs[k];
            let [without, with] = [first, last].map(|m| search.simulated(m, k));
            let change = (without.iter().zip(&with)).map(|(a, b)| (a - b).powi(2));
            let curves = Curves {
                joint: joint.to_owned(),
                recording: log.label.clone(),
                t: log.t.clone(),
                torque: Default::default(),
                motion: [
                    log.q.clone(),
                    without.clone(),
                    if models.len() > 1 {
                        with.clone()
                    } else {
                        Vec::new()
                    },
                ],
            };
            (change.sum(), curves)
        })
        .collect();
    list.sort_by(|a, b| b.0.total_cmp(&a.0));
    list.truncate(DRAWN);
    list.into_iter().map(|(_, curves)| curves).collect()
}

/// Returns the voltage that drives the model, in words.
fn driven(train: &[Log], held_out: &[Log]) -> String {
    let all = train.len() + held_out.len();
    let closed = train
        .iter()
        .chain(held_out)
        .filter(|log| log.law.is_some())
        .count();
    let law = "given by the controller that each recording shows, within the supply";
    match closed {
        0 => "as it was recorded".into(),
        _ if closed == all => law.into(),
        _ => format!("{law} in {closed} of {all} recordings and as it was recorded in the others"),
    }
}

/// Returns the described values of the joint.
fn plant(robot: &Robot) -> Result<Plant, DiagnoseError> {
    let [joint] = robot.joints.as_slice() else {
        return Err(DiagnoseError::Model(format!(
            "without torque or current only a robot of one joint is diagnosed, and this one has {}; record the current as well.",
            robot.joints.len()
        )));
    };
    let wrong = |error: &dyn std::fmt::Display| DiagnoseError::Model(error.to_string());
    let chain = Chain::new(&robot.geometry(), robot.gravity).map_err(|e| wrong(&e))?;
    let mut row = [0.0; COLUMNS];
    if let Some(inertial) = &joint.inertial {
        row[column::MASS] = inertial.mass;
        row[column::FIRST_MOMENT..column::INERTIA].copy_from_slice(&inertial.first_moment);
        row[column::INERTIA..column::DRIVE_INERTIA].copy_from_slice(&inertial.inertia);
    }
    let inertia = match joint.kind {
        JointKind::Revolute => row[column::INERTIA + 5],
        JointKind::Prismatic => row[column::MASS],
    };
    if !(inertia > 0.0) {
        return Err(DiagnoseError::Model(
            "without torque or current the link's own inertia is the scale of everything else; state it in [joint.inertial].".into(),
        ));
    }
    let weight = |row: [f64; COLUMNS]| -> Result<[f64; 3], DiagnoseError> {
        let mut at = [0.0; 3];
        let angles = [0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI];
        for (to, q) in at.iter_mut().zip(angles) {
            let mut torque = [0.0];
            gravity_vector(&chain, &[row], &[q], &mut torque).map_err(|e| wrong(&e))?;
            *to = torque[0];
        }
        let constant = 0.5 * (at[0] + at[2]);
        Ok([at[0] - constant, at[1] - constant, constant])
    };
    let mut unit = [0.0; COLUMNS];
    unit[column::FIRST_MOMENT] = 1.0;
    Ok(Plant {
        inertia,
        gravity: weight(row)?,
        per_moment: weight(unit)?,
        ratio: joint.drive.as_ref().map_or(1.0, |drive| drive.gear_ratio),
        halvings: 0,
    })
}

/// Returns the noise floor from the encoder's steps: the smallest step over √12.
fn floor(logs: &[Log]) -> f64 {
    let steps = logs.iter().flat_map(|log| log.q.windows(2));
    let largest = (logs.iter().flat_map(|log| &log.q)).fold(0.0_f64, |m, q| m.max(q.abs()));
    let least = steps
        .map(|pair| (pair[1] - pair[0]).abs())
        // Smaller steps are rounding of the file.
        .filter(|step| *step > 1.0e-6 * largest)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        least / 12.0_f64.sqrt()
    } else {
        0.0
    }
}
