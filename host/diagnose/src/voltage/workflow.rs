//! Diagnosis of a voltage-driven joint, from recordings to the result.

use crate::description::described_effects::DescribedEffects;
use crate::faults::refusal::faulty;
use crate::outcome::{About, Curves, DataFault, Diagnosis};
use crate::voltage::controllers;
use crate::voltage::controllers::Driven;
use crate::voltage::describe::Told;
use crate::voltage::faults::faults;
use crate::voltage::free_run::FreeRun;
use crate::voltage::law::Supply;
use crate::voltage::log::{Log, floor};
use crate::voltage::plant::{Plant, Unfit};
use crate::voltage::reading::logs;
use crate::voltage::search::{Model, Search, library};
use crate::voltage::sentences;
use crate::{DiagnoseError, Options};
use rig_data::prepare::Recording;
use rig_model::robot::Robot;

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
    robot
        .without_followers("The diagnosis by motor voltage")
        .map_err(Box::new)?;
    if training.is_empty() {
        return Err(DiagnoseError::NoRecording);
    }
    let mut stated = DescribedEffects::of(robot);
    let plant = Plant::of(&stated.robot)?;
    let mut train = logs(training)?;
    let mut held_out = logs(holdout)?;
    let supply = Supply::of(&train);
    supply.give(&mut train);
    supply.give(&mut held_out);
    let wrong: Vec<DataFault> = faults(robot, &plant, &[training, holdout], &[&train, &held_out])?
        .into_iter()
        .map(|(wrong, recording)| DataFault {
            kind: wrong.kind(),
            about: About::Recording,
            recording,
            joint: robot.joints[0].name.clone(),
            certain: true,
            of_description: false,
            column: None,
            text: sentences::fault(&wrong),
        })
        .collect();
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
    let nominal = bench.nominal().ok_or(Unfit::NotDriven)?;
    let whole = bench.with_described(nominal, &parts, &stated.robot);
    Ok(whole.ok_or(Unfit::NotSimulated)?)
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

/// Returns the number of recordings whose controller drives the model.
fn driven(train: &[Log], held_out: &[Log]) -> Driven {
    let all = || train.iter().chain(held_out);
    Driven {
        closed: all().filter(|log| log.law.is_some()).count(),
        all: all().count(),
    }
}
