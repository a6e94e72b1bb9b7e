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
use crate::recordings::intake::{Intake, Material, intake, without};
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

/// Finds effects that the model lacks. The second result is the description with the effects and the refitted
/// parameters.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(
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
    // A constant gets a name if sensor readings with the drive off were given, or if some recordings have all external
    // loads removed. Then it is searched for.
    let unburdened = training.iter().filter(|r| r.unburdened()).count();
    stated.pulls_told = (1..training.len()).contains(&unburdened);
    let told = !options.sensor_zeros.is_empty() || stated.pulls_told;
    stated.no_offsets = options.no_offsets && !told;
    let given = [training, holdout].concat();
    let mut uneven = Uneven::default();
    let mut spoilt = Vec::new();
    loop {
        // Each pass holds more described effects, ignores more limits, or resamples another recording to an even step.
        let [training, holdout] = [training, holdout].map(|recordings| uneven.even(recordings));
        let [training, holdout] = [&training, &holdout].map(|recordings| as_recordings(recordings));
        match attempt(robot, &stated, &training, &holdout, options, progress) {
            Ok(Attempt::Done(mut result)) => {
                result.0.words.extend(uneven.told());
                result.0.data_faults.splice(0..0, spoilt);
                return Ok(*result);
            }
            Ok(Attempt::Hold(more)) => stated = *more,
            Err(DiagnoseError::Prepare(error)) if uneven.takes(&error) => {
                // Interpolated rows no longer show columns without derivative: check before.
                let found = spoilt_columns(robot, &of_error(&error, &given))?;
                if !options.fits(&found) {
                    return Ok((faulty(robot, found), robot.clone()));
                }
                spoilt.extend(found);
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
    /// Start again with more effects held, or with limits ignored.
    Hold(Box<DescribedEffects>),
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
        Intake::Hold(more) => return Ok(Attempt::Hold(more)),
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
    let options = &Options {
        without: without(options, nameless.is_some()),
        ..options.clone()
    };
    progress(0.1);
    let lead = first_lead(&context, &prepared)?;
    let prepared = moved(&context, prepared, &lead)?;
    let first = Pass::over(&context, &prepared, options, progress)?;
    let better = lead_beside(&first, &lead)?;
    let again;
    let (prepared, lead, pass) = if differ(&better, &lead, &prepared.runs) {
        let more: Vec<f64> = better.iter().zip(&lead).map(|(b, l)| b - l).collect();
        let runs = prepared.runs.clone();
        drop(first);
        drop(prepared.rows);
        again = moved(&context, context.rows(runs, &prepared.treatment)?, &more)?;
        let pass = Pass::over(&context, &again, options, progress)?;
        (&again, better, pass)
    } else {
        (&prepared, lead, first)
    };
    if let Some(more) = more_held(stated, &pass)? {
        return Ok(Attempt::Hold(Box::new(more)));
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

/// Returns the torque lead of each joint beside the nominal model, s.
fn first_lead(
    context: &DiagnosisContext,
    prepared: &PreparedData,
) -> Result<Vec<f64>, DiagnoseError> {
    let refit = Refit::of(context, &prepared.rows)?;
    let source = context.source(prepared, &context.anchor.values(&refit.before.values))?;
    leads(&source, &refit.base, &vec![0.0; context.robot.joints.len()])
}

/// Returns the torque lead of each joint beside the effects found, s. A missing effect may look like a torque lead, or hide
/// one. A delay may compensate a wrong lead.
fn lead_beside(pass: &Pass, lead: &[f64]) -> Result<Vec<f64>, DiagnoseError> {
    let found: Vec<FittedCandidate> = (pass.found.iter())
        .filter(|p| p.candidate.kind != Kind::MeasurementDelay)
        .cloned()
        .collect();
    let beside = with(&pass.refit.base, &found, None);
    leads(&pass.search.source, &beside, lead)
}

/// Returns the described effects with more of them held or given up, if the search requires it.
fn more_held(
    stated: &DescribedEffects,
    pass: &Pass,
) -> Result<Option<DescribedEffects>, DiagnoseError> {
    let refuted = |c: &_| refutes(&pass.across, c);
    let mut more = stated.clone();
    let changed = more.give_up_tilts(&pass.found)
        || more.hold_what_is_not_refuted(
            &pass.search.source,
            &pass.refit.base,
            &pass.found,
            &refuted,
        )?;
    Ok(changed.then_some(more))
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
