//! The workflow from recordings to a verdict.

mod follow;
mod pass;

use rig_shared::effects::Kind;

use crate::acceptance::judge::{
    Judge, Judged, besides, left_of_held, not_carried_over, taken_by_none, too_short_for_names,
};
use crate::acceptance::model_check::{Proof, unexplained};
use crate::acceptance::residual_dependence::coordinates;
use crate::acceptance::trial::{Accepted, Trial};
use crate::columns::waves::is_of_the_motor;
use crate::description::described_effects::{DescribedEffects, Now};
pub(crate) use crate::engine::follow::ObserverModels;
use crate::engine::pass::Pass;
use crate::faults::refusal::{faulty, of_preparing};
use crate::faults::spoilt_columns;
use crate::fit::refit::Refit;
use crate::link_encoder::{across, names_something, refutes, tell as tell_across};
use crate::models::bodies::ModelCache;
use crate::models::output_error::by_motion;
use crate::models::parameter_change::change;
use crate::models::rms_path::RmsPath;
use crate::models::simulated_motion::Replay;
use crate::motor_voltage::{
    contradict, left_of_voltage, name_something, settled, tell, windings, zeros,
};
use crate::outcome::{Before, Diagnosis, Residual, Verdict};
use crate::recordings::encoder_zero::{another_zero, another_zero_held};
use crate::recordings::intake::{Intake, Material, intake, without};
use crate::recordings::noise_floor;
use crate::recordings::position_reading::PositionReading;
use crate::recordings::resampling::{Uneven, of_error};
use crate::recordings::torque_lead::{differ, leads, moved};
use crate::result::finish::{Drawn, Found, finish};
use crate::result::remarks::{remarks, weight_of_a_spring};
use crate::result::steps::{change_step, reconcile, steps};
use crate::result::treatment::treated;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::{is_friction, with};
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
        faults,
    } = material;
    let options = &Options {
        without: without(options, nameless.is_some()),
        ..options.clone()
    };
    progress(0.1);
    let lead = {
        let refit = Refit::of(&context, &prepared.rows)?;
        let source = context.source(&prepared, &context.anchor.values(&refit.before.values))?;
        leads(&source, &refit.base, &vec![0.0; robot.joints.len()])?
    };
    let prepared = moved(&context, prepared, &lead)?;
    let first = Pass::over(&context, &prepared, options, progress)?;
    // A missing effect may look like a torque lead, or hide one. A delay may compensate a wrong lead.
    let found: Vec<FittedCandidate> = (first.found.iter())
        .filter(|p| p.candidate.kind != Kind::MeasurementDelay)
        .cloned()
        .collect();
    let beside = with(&first.refit.base, &found, None);
    let better = leads(&first.search.source, &beside, &lead)?;
    let again;
    let (prepared, lead, pass) = if differ(&better, &lead, &prepared.runs) {
        let more: Vec<f64> = better.iter().zip(&lead).map(|(b, l)| b - l).collect();
        let runs = prepared.runs.clone();
        drop((first, beside));
        drop(prepared.rows);
        again = moved(&context, context.rows(runs, &prepared.treatment)?, &more)?;
        let pass = Pass::over(&context, &again, options, progress)?;
        (&again, better, pass)
    } else {
        (&prepared, lead, first)
    };
    let refuted = |c: &_| refutes(&pass.across, c);
    let mut more = stated.clone();
    if more.give_up_tilts(&pass.found)
        || more.hold_what_is_not_refuted(
            &pass.search.source,
            &pass.refit.base,
            &pass.found,
            &refuted,
        )?
    {
        return Ok(Attempt::Hold(Box::new(more)));
    }
    let held_out = held_out
        .map(|held_out| moved(&context, held_out, &lead))
        .transpose()?;
    let Pass {
        refit,
        search,
        found,
        mut tried,
        across: _,
    } = pass;
    progress(0.85);
    let robot = context.robot;
    let coordinates: Vec<_> = (0..robot.joints.len())
        .map(|j| {
            let predicted = &search.source.predicted;
            coordinates(
                &prepared.rows,
                &prepared.runs,
                predicted,
                robot,
                j,
                &waves(&found, j),
            )
        })
        .collect();
    let follower = ObserverModels::new(&context, prepared, &refit, &search);
    let judge = Judge {
        robot,
        follower: &follower,
        search: &search,
        rows: &prepared.rows,
        coordinates: &coordinates,
        pairs: noise_floor::repeats(&prepared.runs),
        position_reading: PositionReading::of(
            &search.source,
            &prepared.rows,
            &prepared.position_filter()?,
        )?,
        base: &refit.base,
        seed: options.seed,
    };
    let values = &search.source.values;
    let fitting = ModelCache::new(&context, &refit, &prepared.runs, values);
    let learnt = Replay::of(&fitting, prepared)?;
    let (windings, silent) = windings(&context, prepared, held_out.as_ref(), options)?;
    let trial = Trial {
        judge: &judge,
        refit: &refit,
        fitting: &fitting,
        replay: &learnt,
    };
    let Accepted {
        mut judged,
        mut fallen,
    } = trial.stand(found.clone(), &mut tried)?;
    let said = settled(
        &zeros(&options.sensor_zeros, &windings, robot.joints.len()),
        &search,
        &refit.base,
        &mut judged.chosen,
    )?;
    // An effect that the voltage renamed no longer counts as described: sort again.
    let mut named: Vec<_> = judged.chosen.drain(..).zip(said).collect();
    named.sort_by_key(|(profile, _)| search.rank_of(&profile.candidate));
    let (chosen, said): (Vec<_>, Vec<_>) = named.into_iter().unzip();
    judged.chosen = chosen;
    let mut source = &search.source;
    let followed;
    if let Some(chosen) = follower.followed(&judged.chosen, &judged.quiet)? {
        judged = judge.as_found(chosen);
        followed = follower.source(&judged.chosen)?;
        source = &followed;
    }
    let described = search.count_described(&judged.chosen);
    let mut joint = refit.joint(source, &judged.chosen, &judge.pairs, &coordinates)?;
    let threads = rig_data::prepare::threads(options.threads);
    let again = by_motion(&fitting, &learnt, source, &judged.chosen, &joint, threads)?;
    let by_motion = again.map(|again| {
        if let Some((standing, effects)) = again.adopted {
            fitting.adopt(&effects, standing);
            judged.chosen = effects;
        }
        again.told
    });
    let replay = match &held_out {
        Some(held_out) => Replay::of(&fitting, held_out)?,
        None => learnt,
    };
    let descent = RmsPath::of(
        &fitting,
        &refit,
        &judged.chosen,
        described,
        prepared,
        held_out.as_ref(),
        &search.source,
        judge.added(&judged.from),
    )?;
    if let (None, Some(held)) = (&judged.left, &descent.holdout) {
        let mut named: Vec<(usize, [f64; 2])> = (judged.chosen[described..].iter())
            .map(|p| (p.candidate.joint, held.whole(p.candidate.joint)))
            .collect();
        named.dedup_by_key(|(joint, _)| *joint);
        judged.left = left_of_held(
            robot,
            &held.last(),
            &descent.train.last(),
            [&judged.floors, &descent.noise_held(&judged.floors)],
            &judged.chosen,
            &|joint| {
                let rows = &held_out
                    .as_ref()
                    .filter(|_| descent.is_held_twice(joint))?
                    .rows;
                Some(besides(&judged.chosen, rows, joint, held.whole(joint)))
            },
        )
        .or_else(|| not_carried_over(robot, &named, &descent.floors(&judged.floors)));
    }
    // With repeated runs, the residual was already compared with the noise.
    if judged.left.is_none() && judge.pairs.is_empty() {
        fallen.extend(search.still_taking(&refit.base, &found)?);
        judged.left = taken_by_none(robot, &fallen, &judged.chosen, &judged.floors);
    }
    let proof = Proof {
        robot,
        fitting: &fitting,
        base: &refit.base,
        prepared,
        held_out: held_out.as_ref(),
        descent: &descent,
    };
    let sizes = proof.left(&judged, described)?;
    if judged.left.is_none() {
        let of = |name: &str| robot.joints.iter().position(|joint| joint.name == name);
        let named = |name: &str| {
            (judged.chosen[described..].iter()).any(|p| Some(p.candidate.joint) == of(name))
        };
        judged.left = unexplained(&sizes, &named);
    }
    if let Some(why) = nameless {
        // No effect was tried, so do not claim that none explains the residual.
        judged.left = too_short_for_names(robot, &refit.base, &judged.known, why);
    }
    let left = judged.left.is_some();
    judged.left = judged.left.or_else(|| left_of_voltage(&windings));
    let Judged {
        chosen,
        floors,
        known,
        ..
    } = &judged;
    let stands = fitting.of(chosen)?;
    joint.solution.values = stands.coefficients(&context.anchor);
    let after = &joint.solution;
    let first = &chosen[..described];
    let before = fitting.of(first)?;
    let across = {
        let nominal = context.anchor.values(&after.values[..refit.free.len()]);
        let of = |prepared| -> Result<_, DiagnoseError> {
            (context.source(prepared, &nominal)?)
                .loaded_by(chosen, &after.values[refit.free.len()..])
        };
        let held = (held_out.as_ref()).map(of).transpose()?;
        across(
            &of(prepared)?,
            &context.anchor,
            after,
            prepared,
            held.as_ref().zip(held_out.as_ref()),
            options,
        )?
    };
    progress(0.95);
    let motion = (described..=chosen.len())
        .map(|count| replay.errors(&chosen[..count]))
        .collect::<Result<Vec<_>, DiagnoseError>>()?;
    let mut steps = steps(
        &search, &refit, &judged, described, &joint, &descent, &motion,
    )?;
    for (step, word) in steps.iter_mut().zip(said.into_iter().skip(described)) {
        word.applied(step);
    }
    let explained = refit.explained(chosen, after);
    let without = &options.without;
    let friction = chosen.iter().any(|p| is_friction(p.candidate.kind));
    let change = change(
        &context,
        &refit,
        &prepared.rows,
        &explained,
        friction,
        left,
        after,
        without,
    );
    if let Some(mut step) = (change.as_ref()).and_then(|c| change_step(robot, c, &descent, known)) {
        let given = replay.errors_of(&stated.moving());
        let last = motion.last().and_then(Option::as_ref);
        let tip = robot.joints.len() - 1;
        step.motion_rms = (given.as_ref().zip(last)).map(|(a, b)| [a, b].map(|e| e.rms(tip)));
        steps.push(step);
    }
    let stood = stated.told(
        (stated.matched(chosen).into_iter())
            .map(|place| {
                place.map(|k| Now {
                    kind: chosen[k].candidate.kind,
                    parameters: joint.parameters(&search.source, chosen, refit.free.len(), k),
                })
            })
            .collect(),
    );
    reconcile(robot, &mut tried, &chosen[described..], search.trials());
    let absorbed = |before: &[f64]| refit.absorbed(&context, before, after);
    let (absorbed_before, absorbed) = if chosen.len() > described {
        let without = before.coefficients(&context.anchor);
        (Before::WithoutEffects, absorbed(&without))
    } else if context.anchor.stated {
        let mut stated = context.anchor.prior_coefficients();
        for (k, value) in stated.iter_mut().enumerate() {
            if context.anchor.is_unstated(k) {
                *value = f64::NAN;
            }
        }
        (Before::Described, absorbed(&stated))
    } else {
        (Before::Described, Vec::new())
    };
    let mut diagnosis = Diagnosis {
        schema: "rig-diagnosis/1".into(),
        robot: robot.name.clone(),
        verdict: verdict(
            &judged,
            chosen.len() > described
                || name_something(&windings)
                || names_something(&across, &|c| stated.states(c)),
            change.is_some() || contradict(&windings) || stated.changed(&stood),
        ),
        residual: Residual::Torque,
        words: Vec::new(),
        noise_floor_rms: known.clone(),
        noise_floor_from: judged.from.clone(),
        left: sizes,
        noise_floor_how: String::new(),
        motion_how: replay.told(chosen, described)?,
        treatment: Some(treated(robot, prepared, held_out.as_ref())),
        torque_lead: lead,
        places: judge.places(
            refit.footing(&chosen[..described])[1],
            floors,
            &chosen[..described],
        ),
        gap_closed: (!steps.is_empty())
            .then(|| descent.gap_closed(known, change.is_some()))
            .flatten(),
        described: stood,
        steps,
        absorbed,
        absorbed_before,
        by_motion,
        not_testable: Vec::new(),
        detectable: Vec::new(),
        next_experiment: None,
        remainder: judged.left.clone(),
        data_faults: faults,
        waterfall: descent.waterfall(robot, &chosen[described..], known),
        tried,
        maps: Vec::new(),
        curves: Vec::new(),
    };
    let mut model = stands.model.clone();
    let drawn = held_out.as_ref().unwrap_or(prepared);
    let found = Found {
        robot,
        nominal: &context.nominal,
        anchor: &context.anchor,
        search: &search,
        rows: &prepared.rows,
        base: &refit.base,
        model: &model,
        chosen,
        described,
        coordinates: &coordinates,
        floors,
        known,
        seed: options.seed,
        sensor_zeros: &options.sensor_zeros,
        one_way: &context.one_way,
        drawn: Drawn {
            runs: &drawn.runs,
            rows: &drawn.rows,
            left: [
                context.remaining(drawn, before.fitted(), first)?,
                context.remaining(drawn, stands.fitted(), chosen)?,
            ],
            motion: replay.drawn(chosen, described)?,
        },
    };
    finish(&found, &mut diagnosis)?;
    diagnosis.words.extend(stands.remarks.iter().cloned());
    model.effects.extend(stated.held().cloned());
    tell(windings, &mut diagnosis, &mut model);
    tell_across(across, &mut diagnosis, &mut model);
    let told = diagnosis.described.iter().map(|d| d.text.clone());
    diagnosis.words.extend(told);
    diagnosis.words.extend(silent);
    diagnosis.words.extend(touches);
    let by_motion = diagnosis.by_motion.as_ref().map(|m| m.text.clone());
    diagnosis.words.extend(by_motion);
    let taken = {
        let [before, after] = [&refit.base, &with(&refit.base, chosen, None)].map(|fit| fit.rms(0));
        1.0 - after / before
    };
    let zero = match (another_zero(&search.source, &refit.base, taken)?, &held_out) {
        (None, Some(held_out)) if left => {
            let residual = context.remaining(held_out, stands.fitted(), chosen)?;
            another_zero_held(&context, held_out, &search.source.values, &residual)?
        }
        (told, _) => told,
    };
    diagnosis.words.extend(stated.lifted.iter().cloned());
    diagnosis.words.extend(zero);
    diagnosis.words.extend(remarks(
        &context,
        prepared,
        held_out.as_ref(),
        &open,
        &options.sensor_zeros,
        after,
    ));
    diagnosis.words.extend(change.map(|c| c.words));
    (diagnosis.words).extend(weight_of_a_spring(&context, chosen, after));
    progress(1.0);
    Ok(Attempt::Done(Box::new((diagnosis, model))))
}

/// Returns the orders per motor turn of the waves among the effects of a joint.
fn waves(found: &[FittedCandidate], joint: usize) -> Vec<f64> {
    let wave = |p: &FittedCandidate| {
        let motor = is_of_the_motor(p.candidate.kind);
        (p.candidate.joint == joint && motor).then_some(p.shapes[0])
    };
    found.iter().filter_map(wave).collect()
}

/// `named` is true if an effect is not in the description.
fn verdict(judged: &Judged, named: bool, changed: bool) -> Verdict {
    if judged.left.is_some() {
        Verdict::Remainder
    } else if named {
        Verdict::Explained
    } else if changed {
        Verdict::ParameterChange
    } else {
        Verdict::NothingMissing
    }
}
