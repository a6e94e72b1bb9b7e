//! The workflow from recordings to a verdict.

mod checks;
mod findings;
mod naming;
mod pass;
mod work;

use rig_shared::effects::Kind;

use self::checks::Checked;
use self::findings::{Notes, findings};
use self::naming::Named;
use self::pass::Pass;
use self::work::{Data, Work};
use crate::acceptance::coordinates::coordinates;
use crate::acceptance::judge::Judge;
use crate::columns::waves::is_of_the_motor;
use crate::description::described_effects::DescribedEffects;
use crate::faults::refusal::{faulty, of_preparing};
use crate::faults::spoilt_columns;
use crate::fit::refit::Refit;
use crate::link_encoder::refutes;
use crate::models::bodies::ModelCache;
use crate::models::observer_models::ObserverModels;
use crate::models::simulated_motion::Replay;
use crate::outcome::{DataFault, Diagnosis};
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::intake::{Intake, Material, allowed, intake};
use crate::recordings::noise_floor;
use crate::recordings::position_reading::PositionReading;
use crate::recordings::resampling::{Uneven, of_error};
use crate::recordings::torque_lead::{differ, leads, moved};
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;
use crate::{DiagnoseError, Options};
use rig_data::prepare::{Recording, as_recordings};
use rig_model::robot::Robot;

/// Finds effects that the model lacks, on the `training` recordings. The `holdout` chooses none: it is evaluated once,
/// at the end. `progress` receives the share that is done, from 0 to 1; a restart begins anew.
///
/// The second result is the description with the effects and the refitted parameters; the given one if the recordings
/// are faulty.
///
/// # Errors
/// [`DiagnoseError`]: no recording, one that cannot be read or prepared, or a model that cannot be fitted. A fault of
/// the data is a result and no error.
pub fn diagnose(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DiagnoseError> {
    robot.without_followers("The diagnosis").map_err(Box::new)?;
    if training.is_empty() {
        return Err(DiagnoseError::NoRecording);
    }
    let mut stated = DescribedEffects::of(robot);
    // A constant torque is searched for only if the data can tell where it comes from: by sensor readings with the
    // drive off, or because some but not all recordings have the external loads removed.
    let unloaded = training.iter().filter(|r| r.unburdened()).count();
    stated.loads_separable = unloaded > 0 && unloaded < training.len();
    stated.zeros_given = !options.sensor_zeros.is_empty();
    let constants_searched = stated.zeros_given || stated.loads_separable;
    stated.no_offsets = options.no_offsets && !constants_searched;
    let given = [training, holdout].concat();
    let mut uneven = Uneven::default();
    let mut hidden = Vec::new();
    loop {
        // Each attempt keeps more described effects fixed, ignores more limits, or resamples one more recording.
        let [training, holdout] = [training, holdout].map(|recordings| uneven.even(recordings));
        let [training, holdout] = [&training, &holdout].map(|recordings| as_recordings(recordings));
        match attempt(robot, &stated, &training, &holdout, options, progress) {
            Ok(Attempt::Done(mut result)) => {
                result.0.words.extend(uneven.told());
                result.0.data_faults.splice(0..0, hidden);
                return Ok(*result);
            }
            Ok(Attempt::Restart(revised)) => stated = *revised,
            Err(DiagnoseError::Prepare(error)) if uneven.takes(&error) => {
                // Interpolation hides columns that do not change smoothly: look for them before.
                let found = spoilt_columns(robot, &of_error(&error, &given))?;
                if !options.fits(&found) {
                    return Ok((faulty(robot, found), robot.clone()));
                }
                hidden.extend(found);
            }
            Err(DiagnoseError::Prepare(error)) => {
                let Some(fault) = of_preparing(&error) else {
                    return Err(error.into());
                };
                return Ok((faulty(robot, vec![fault]), robot.clone()));
            }
            Err(error) => return Err(error),
        }
    }
}

/// Outcome of one treatment of the description's effects.
enum Attempt {
    Done(Box<(Diagnosis, Robot)>),
    /// Start again with more described effects fixed or given up, or with limits ignored.
    Restart(Box<DescribedEffects>),
}

/// Runs the stages once, with the description's effects treated as `stated` says.
fn attempt(
    robot: &Robot,
    stated: &DescribedEffects,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<Attempt, DiagnoseError> {
    let material = match intake(stated, training, holdout, options)? {
        Intake::Fit(material) => *material,
        Intake::Restart(revised) => return Ok(Attempt::Restart(revised)),
        Intake::Faulty(wrong) => {
            let fault = (faulty(robot, wrong), robot.clone());
            return Ok(Attempt::Done(Box::new(fault)));
        }
    };
    let Material {
        context,
        prepared,
        held_out,
        open,
        nameless,
        touches,
        alike,
        faults,
    } = material;
    let options = &allowed(options, nameless.is_some());
    progress(0.1);
    let lead = first_lead(&context, &prepared)?;
    let prepared = moved(&context, prepared, &lead)?;
    let first = Pass::over(&context, &prepared, options, progress)?;
    let better = lead_beside(&first, &lead)?;
    let again;
    // Beside the effects found, another lead may fit better: shift the torque by the difference and search once more.
    let (prepared, lead, pass) = if differ(&better, &lead, &prepared.runs) {
        let change: Vec<f64> = better.iter().zip(&lead).map(|(b, l)| b - l).collect();
        let runs = prepared.runs.clone();
        drop(first);
        drop(prepared.rows);
        again = moved(&context, context.rows(runs, &prepared.treatment)?, &change)?;
        let pass = Pass::over(&context, &again, options, progress)?;
        (&again, better, pass)
    } else {
        (&prepared, lead, first)
    };
    if let Some(revised) = revised_description(stated, &pass)? {
        return Ok(Attempt::Restart(Box::new(revised)));
    }
    let held_out = held_out
        .map(|held_out| moved(&context, held_out, &lead))
        .transpose()?;
    let data = Data {
        context: &context,
        stated,
        options,
        prepared,
        held_out: held_out.as_ref(),
    };
    let notes = Notes {
        faults,
        touches,
        alike,
        open,
        lead,
        tried: pass.tried,
    };
    progress(0.85);
    let result = judged(
        &data,
        &pass.refit,
        &pass.search,
        pass.found,
        nameless,
        notes,
    )?;
    progress(1.0);
    Ok(Attempt::Done(Box::new(result)))
}

/// Returns the torque lead of each joint, s: the time by which its torque was recorded before it acts. Estimated with
/// the nominal model.
pub(crate) fn first_lead(
    context: &DiagnosisContext,
    prepared: &PreparedData,
) -> Result<Vec<f64>, DiagnoseError> {
    let refit = Refit::of(context, &prepared.rows)?;
    let source = context.source(prepared, &context.anchor.values(&refit.before.values))?;
    leads(&source, &refit.base, &vec![0.0; context.robot.joints.len()])
}

/// Returns the torque lead of each joint, s, estimated with the effects found in the model: a missing effect may look
/// like a lead, or hide one. A delay could compensate a wrong lead, so a delay that was found is left out.
fn lead_beside(pass: &Pass, lead: &[f64]) -> Result<Vec<f64>, DiagnoseError> {
    let found: Vec<FittedCandidate> = (pass.found.iter())
        .filter(|p| p.candidate.kind != Kind::MeasurementDelay)
        .cloned()
        .collect();
    let beside = with(&pass.refit.base, &found, None);
    leads(&pass.search.source, &beside, lead)
}

/// Returns the described effects with more of them fixed or given up, if the search requires it.
fn revised_description(
    stated: &DescribedEffects,
    pass: &Pass,
) -> Result<Option<DescribedEffects>, DiagnoseError> {
    let refuted = |c: &_| refutes(&pass.across, c);
    let mut revised = stated.clone();
    let changed = revised.give_up_tilts(&pass.found)
        || revised.hold_what_is_not_refuted(
            &pass.search.source,
            &pass.refit.base,
            &pass.found,
            &refuted,
        )?;
    Ok(changed.then_some(revised))
}

/// Judges the effects of the search, checks them and composes the result.
fn judged(
    data: &Data,
    refit: &Refit,
    search: &Search,
    found: Vec<FittedCandidate>,
    nameless: Option<DataFault>,
    mut notes: Notes,
) -> Result<(Diagnosis, Robot), DiagnoseError> {
    let (context, prepared) = (data.context, data.prepared);
    let coordinates: Vec<_> = (0..context.robot.joints.len())
        .map(|j| {
            coordinates(
                &prepared.rows,
                &prepared.runs,
                &search.source.predicted,
                context.robot,
                j,
                &waves(&found, j),
            )
        })
        .collect();
    let follower = ObserverModels::new(context, prepared, refit, search);
    let judge = Judge {
        robot: context.robot,
        follower: &follower,
        search,
        rows: &prepared.rows,
        coordinates: &coordinates,
        pairs: noise_floor::repeats(&prepared.runs),
        position_reading: PositionReading::of(
            &search.source,
            &prepared.rows,
            &prepared.position_filter()?,
        )?,
        base: &refit.base,
        seed: data.options.seed,
    };
    let fitting = ModelCache::new(context, refit, &prepared.runs, &search.source.values);
    let learnt = Replay::of(&fitting, prepared)?;
    let work = Work {
        data,
        refit,
        search,
        fitting: &fitting,
        judge: &judge,
    };
    let mut named = Named::of(&work, &learnt, found.clone(), &mut notes.tried)?;
    let held = (data.held_out)
        .map(|held_out| Replay::of(&fitting, held_out))
        .transpose()?;
    let replay = held.as_ref().unwrap_or(&learnt);
    let checked = Checked::of(&work, &mut named, &found, nameless, replay)?;
    findings(&work, named, checked, replay, notes)
}

/// Returns the orders per motor turn of the waves among the effects of a joint.
fn waves(found: &[FittedCandidate], joint: usize) -> Vec<f64> {
    let wave = |p: &FittedCandidate| {
        let motor = is_of_the_motor(p.candidate.kind);
        (p.candidate.joint == joint && motor).then_some(p.shapes[0])
    };
    found.iter().filter_map(wave).collect()
}
