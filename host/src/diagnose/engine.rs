//! The workflow from recordings to a verdict.

mod even;
mod follow;
mod pass;
mod steps;
mod unbelieved;

use rig_shared::effects::Kind;

use self::even::{Uneven, borrowed};
pub(super) use self::follow::Follower;
use self::pass::Pass;
use self::steps::{change_step, reconcile, refuse, refuse_guesses, steps};
use self::unbelieved::{contradicted, unbelieved};
use super::across::{across, names_something, refutes, tell as tell_across};
use super::bench::{Bench, Loaded, library};
use super::bodies::Fitting;
use super::change::change;
use super::descent::Descent;
use super::described::by_description;
use super::fault::{faulty, of_preparing};
use super::finish::{Drawn, Found, finish};
use super::floor;
use super::judge::{Judge, Judged, left_of_held, not_carried_over, taken_by_none};
use super::lead::{differ, leads, moved, slack};
use super::locate::coordinates;
use super::motion::Replay;
use super::outcome::{Diagnosis, Residual, Verdict};
use super::profile::Profile;
use super::refit::{Refit, open};
use super::rounding::rounding;
use super::runs::{Run, copies, in_sessions};
use super::sanity::{faults, too_short_to_judge, too_short_to_learn};
use super::search::with;
use super::sentences::offsets;
use super::stated::{Now, Stated};
use super::touched::touched;
use super::waves::is_of_the_motor;
use super::winding::{contradict, left_of_voltage, name_something, settled, tell, windings, zeros};
use super::zeros::{another_zero, another_zero_held};
use super::{DiagnoseError, Options};
use crate::prepare::Recording;
use crate::report::{format_unit, format_value};
use crate::robot::Robot;

/// Finds what the model lacks. The second result is the description with the effects and the parameters identified
/// anew.
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
    let mut stated = Stated::of(robot);
    // What the sensors read with the drive off gives a constant its name, and so does what is gone with all that pulled on the
    // rig: then it is searched for.
    let unburdened = training.iter().filter(|r| r.unburdened()).count();
    stated.pulls_told = (1..training.len()).contains(&unburdened);
    let told = !options.sensor_zeros.is_empty() || stated.pulls_told;
    stated.no_offsets = options.no_offsets && !told;
    let mut uneven = Uneven::default();
    loop {
        // Each time around more of the description's effects are held, or another recording is brought to an even step.
        let [training, holdout] = [training, holdout].map(|recordings| uneven.even(recordings));
        let [training, holdout] = [&training, &holdout].map(|recordings| borrowed(recordings));
        match attempt(robot, &stated, &training, &holdout, options, progress) {
            Ok(Attempt::Done(mut result)) => {
                result.0.words.extend(uneven.told());
                return Ok(*result);
            }
            Ok(Attempt::Hold(more)) => stated = more,
            Err(DiagnoseError::Prepare(error)) if uneven.takes(&error) => {}
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

/// What came of one way to treat the description's effects.
enum Attempt {
    Done(Box<(Diagnosis, Robot)>),
    /// The same with more of them held.
    Hold(Stated),
}

fn attempt(
    robot: &Robot,
    stated: &Stated,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<Attempt, DiagnoseError> {
    let mut bench = Bench::of(stated, training)?;
    let mut loaded = bench.load(training)?;
    let mut sealed = if holdout.is_empty() {
        None
    } else {
        Some(bench.load_held(holdout)?)
    };
    in_sessions(&mut loaded.runs, &[]);
    if let Some(sealed) = &mut sealed {
        in_sessions(&mut sealed.runs, &loaded.runs);
    }
    {
        let all: Vec<&Run> = (loaded.runs.iter())
            .chain(sealed.iter().flat_map(|sealed| &sealed.runs))
            .collect();
        if let Some((a, b)) = copies(&all) {
            let [label, again] = [a, b].map(|k| all[k].label.clone());
            return Err(DiagnoseError::Copy { label, again });
        }
    }
    let mut wrong = faults(&stated.robot, &loaded.runs)?;
    if wrong.is_empty() {
        wrong.extend(too_short_to_learn(&loaded.runs));
    }
    if let (true, Some(sealed)) = (wrong.is_empty(), &sealed) {
        wrong = faults(&stated.robot, &sealed.runs)?;
        if wrong.is_empty() {
            wrong.extend(too_short_to_judge(&sealed.runs));
        }
    }
    if !wrong.is_empty() {
        let fault = (faulty(robot, wrong), robot.clone());
        return Ok(Attempt::Done(Box::new(fault)));
    }
    let mut more = stated.clone();
    if more.hold_delays(slack(&loaded.runs)) {
        return Ok(Attempt::Hold(more));
    }
    if more.hold_what_is_not_in(&library(bench.robot, &loaded.runs, &options.without)) {
        return Ok(Attempt::Hold(more));
    }
    let open = open(&bench, &loaded.rows);
    if !open.is_empty() {
        bench.anchor.hold(&open);
        let rows = |loaded: Loaded| bench.rows(loaded.runs, &loaded.treatment);
        loaded = rows(loaded)?;
        sealed = sealed.map(rows).transpose()?;
    }
    let bench = bench;
    progress(0.1);
    let touches = {
        let refit = Refit::of(&bench, &loaded.rows)?;
        let left: Vec<Vec<f64>> = (0..robot.joints.len())
            .map(|j| refit.base.residual(j))
            .collect();
        drop(refit);
        touched(robot, &left, &mut loaded)
    };
    if !touches.is_empty() {
        loaded = bench.rows(loaded.runs, &loaded.treatment)?;
    }
    let lead = {
        let refit = Refit::of(&bench, &loaded.rows)?;
        let source = bench.source(&loaded, &bench.anchor.values(&refit.before.values))?;
        leads(&source, &refit.base, &vec![0.0; robot.joints.len()])?
    };
    let loaded = moved(&bench, loaded, &lead)?;
    let first = Pass::over(&bench, &loaded, options, progress)?;
    // What was missing may have looked like a lead, or hidden one; a delay found beside a wrong lead is its other half.
    let found: Vec<Profile> = (first.found.iter())
        .filter(|p| p.candidate.kind != Kind::MeasurementDelay)
        .cloned()
        .collect();
    let beside = with(&first.refit.base, &found, None);
    let better = leads(&first.search.source, &beside, &lead)?;
    let again;
    let (loaded, lead, pass) = if differ(&better, &lead, &loaded.runs) {
        let more: Vec<f64> = better.iter().zip(&lead).map(|(b, l)| b - l).collect();
        let runs = loaded.runs.clone();
        drop((first, beside));
        drop(loaded.rows);
        again = moved(&bench, bench.rows(runs, &loaded.treatment)?, &more)?;
        let pass = Pass::over(&bench, &again, options, progress)?;
        (&again, better, pass)
    } else {
        (&loaded, lead, first)
    };
    let refuted = |c: &_| refutes(&pass.across, c);
    if more.hold_what_is_not_refuted(
        &pass.search.source,
        &pass.refit.base,
        &pass.found,
        &refuted,
    )? {
        return Ok(Attempt::Hold(more));
    }
    let sealed = sealed
        .map(|sealed| moved(&bench, sealed, &lead))
        .transpose()?;
    let Pass {
        refit,
        search,
        found,
        mut tried,
        across: _,
    } = pass;
    progress(0.85);
    let robot = bench.robot;
    let coordinates: Vec<_> = (0..robot.joints.len())
        .map(|j| {
            let predicted = &search.source.predicted;
            coordinates(
                &loaded.rows,
                &loaded.runs,
                predicted,
                robot,
                j,
                &waves(&found, j),
            )
        })
        .collect();
    let follower = Follower::new(&bench, loaded, &refit, &search);
    let judge = Judge {
        robot,
        follower: &follower,
        search: &search,
        rows: &loaded.rows,
        coordinates: &coordinates,
        pairs: floor::repeats(&loaded.runs),
        rounding: rounding(&search.source, &loaded.rows, &loaded.position_filter()?)?,
        base: &refit.base,
        seed: options.seed,
    };
    let values = &search.source.values;
    let fitting = Fitting::new(&bench, &refit, &loaded.runs, values);
    let trial = Replay::of(&fitting, loaded)?;
    let (windings, silent) = windings(&bench, loaded, sealed.as_ref(), options)?;
    let judged = judge.judged(found.clone())?;
    refuse_guesses(robot, &mut tried, &judged);
    let mut judged = by_description(&judge, &refit, &bench.anchor, judged)?;
    refuse_guesses(robot, &mut tried, &judged);
    let mut fallen = Vec::new();
    let mut without = |judged: Judged, k: usize, why: &str| -> Result<Judged, DiagnoseError> {
        let mut stand = judged.chosen;
        let gone = stand.remove(k);
        refuse(robot, &mut tried, &gone, why);
        if gone.takes_much(search.trials()) {
            fallen.push(gone);
        }
        let judged = judge.judged(search.possible(&refit.base, stand)?)?;
        refuse_guesses(robot, &mut tried, &judged);
        Ok(judged)
    };
    // A name that makes the simulated motion worse stands in for something else.
    while let Some(k) = trial.spoiling(&judged.chosen, search.count_given(&judged.chosen))? {
        let why = "explains torque, but the simulated motion gets worse with it";
        judged = without(judged, k, why)?;
    }
    while let Some((k, why)) = unbelieved(&refit, &search, &judge, &judged.chosen)? {
        judged = without(judged, k, why)?;
    }
    // The hold-out finds no name; one that it contradicts does not stand.
    if let Some(sealed) = &sealed {
        while let Some(k) = contradicted(&fitting, &search, &judged.chosen, sealed)? {
            let why = "explains the training data, and leaves more of the recordings held back than there is without it";
            judged = without(judged, k, why)?;
        }
    }
    let said = settled(
        &zeros(&options.sensor_zeros, &windings, robot.joints.len()),
        &search,
        &refit.base,
        &mut judged.chosen,
    )?;
    // What the voltage has given another name is the description's no longer.
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
    let replay = match &sealed {
        Some(sealed) => Replay::of(&fitting, sealed)?,
        None => trial,
    };
    let descent = Descent::of(
        &fitting,
        &refit,
        &judged.chosen,
        described,
        loaded,
        sealed.as_ref(),
        &search.source,
    )?;
    if let (None, Some(held)) = (&judged.left, &descent.holdout) {
        let mut named: Vec<(usize, [f64; 2])> = (judged.chosen[described..].iter())
            .map(|p| (p.candidate.joint, held.whole(p.candidate.joint)))
            .collect();
        named.dedup_by_key(|(joint, _)| *joint);
        judged.left = left_of_held(robot, &held.last(), &descent.noise_held(&judged.floors))
            .or_else(|| not_carried_over(robot, &named, &descent.floors(&judged.floors)));
    }
    // Where a motion was repeated, what is left has been held against the noise.
    if judged.left.is_none() && judge.pairs.is_empty() {
        fallen.extend(search.still_taking(&refit.base, &found)?);
        judged.left = taken_by_none(robot, &fallen, &judged.chosen, &judged.floors);
    }
    let left = judged.left.is_some();
    judged.left = judged.left.or_else(|| left_of_voltage(&windings));
    let Judged { chosen, floors, .. } = &judged;
    let mut joint = refit.joint(source, chosen, &judge.pairs, &coordinates)?;
    let stands = fitting.of(chosen)?;
    joint.solution.values = stands.coefficients(&bench.anchor);
    let after = &joint.solution;
    let first = &chosen[..described];
    let before = fitting.of(first)?;
    let across = {
        let nominal = bench.anchor.values(&after.values[..refit.free.len()]);
        let of = |loaded| -> Result<_, DiagnoseError> {
            (bench.source(loaded, &nominal)?).loaded_by(chosen, &after.values[refit.free.len()..])
        };
        let held = (sealed.as_ref()).map(of).transpose()?;
        across(
            &of(loaded)?,
            &bench.anchor,
            after,
            loaded,
            held.as_ref().zip(sealed.as_ref()),
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
    let change = change(&bench, &refit, &explained, left, after, &options.without);
    if let Some(mut step) = (change.as_ref()).and_then(|c| change_step(robot, c, &descent, floors))
    {
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
    reconcile(robot, &mut tried, &chosen[described..]);
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
        noise_floor_rms: floors.clone(),
        noise_floor_how: String::new(),
        motion_how: replay.told(chosen, described)?,
        torque_lead: lead,
        places: judge.places(
            refit.footing(&chosen[..described])[1],
            floors,
            &chosen[..described],
        ),
        gap_closed: (!steps.is_empty()).then(|| descent.gap_closed(floors, change.is_some())),
        described: stood,
        steps,
        absorbed: refit.absorbed(&bench, &before.coefficients(&bench.anchor), after),
        not_testable: Vec::new(),
        detectable: Vec::new(),
        next_experiment: None,
        remainder: judged.left.clone(),
        data_faults: Vec::new(),
        waterfall: descent.waterfall(robot, &chosen[described..], floors),
        tried,
        maps: Vec::new(),
        curves: Vec::new(),
    };
    let mut model = stands.model.clone();
    let drawn = sealed.as_ref().unwrap_or(loaded);
    let found = Found {
        robot,
        nominal: &bench.nominal,
        anchor: &bench.anchor,
        search: &search,
        rows: &loaded.rows,
        base: &refit.base,
        model: &model,
        chosen,
        described,
        coordinates: &coordinates,
        floors,
        seed: options.seed,
        sensor_zeros: &options.sensor_zeros,
        drawn: Drawn {
            runs: &drawn.runs,
            rows: &drawn.rows,
            left: [
                bench.remaining(drawn, before.fitted(), first)?,
                bench.remaining(drawn, stands.fitted(), chosen)?,
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
    {
        let [before, after] = [&refit.base, &with(&refit.base, chosen, None)].map(|fit| fit.rms(0));
        let told = another_zero(robot, &search.source, &refit.base, 1.0 - after / before)?;
        let held = match (&told, &sealed) {
            (None, Some(sealed)) if left => {
                let residual = bench.remaining(sealed, stands.fitted(), chosen)?;
                another_zero_held(&bench, sealed, &search.source.values, &residual)?
            }
            _ => None,
        };
        diagnosis.words.extend(told.or(held));
    }
    diagnosis
        .words
        .extend(sealed.as_ref().and_then(|sealed| own_rate(&bench, sealed)));
    diagnosis
        .words
        .extend(read_off(robot, &options.sensor_zeros));
    diagnosis.words.extend(offsets(&bench, after));
    diagnosis.words.extend(held(&bench, &open));
    diagnosis
        .words
        .extend((sealed.as_ref()).and_then(|sealed| no_other_motion(loaded, sealed)));
    diagnosis.words.extend(change.map(|c| c.words));
    progress(1.0);
    Ok(Attempt::Done(Box::new((diagnosis, model))))
}

/// That a hold-out is judged at another rate than that of the recordings learnt from.
fn own_rate(bench: &Bench, sealed: &Loaded) -> Option<String> {
    let [learnt, held] = [bench.rate(), sealed.treatment.sample_rate];
    let label = &sealed.runs.first()?.label;
    (learnt != held).then(|| {
        format!(
            "{label} is judged at its own rate, {held:.1} Hz where {learnt:.1} Hz were learnt from{}.",
            match learnt > held {
                true => format!("; its noise floor is taken as {:.2} times that of the others", (learnt / held).sqrt()),
                false => String::new(),
            }
        )
    })
}

/// Orders over the motor's turn of the waves among effects of a joint.
fn waves(found: &[Profile], joint: usize) -> Vec<f64> {
    let wave = |p: &Profile| {
        let motor = is_of_the_motor(p.candidate.kind);
        (p.candidate.joint == joint && motor).then_some(p.shapes[0])
    };
    found.iter().filter_map(wave).collect()
}

/// What the sensors read with the drive off.
fn read_off(robot: &Robot, zeros: &[[f64; 2]]) -> Vec<String> {
    (robot.joints.iter().zip(zeros))
        .map(|(joint, [value, std])| {
            format!(
                "With the drive off the sensor of joint {} reads {} {}.",
                joint.name,
                format_value(*value, *std),
                format_unit(joint.kind.units().1)
            )
        })
        .collect()
}

/// A hold-out that is the training motion once more.
fn no_other_motion(loaded: &Loaded, sealed: &Loaded) -> Option<String> {
    let (own, same) = floor::repeated(&loaded.runs, &sealed.runs)?;
    Some(format!(
        "The hold-out {} repeats the motion of {}: it shows what noise a model has learnt, and not whether it holds for another motion; hold back another one.",
        own.label, same.label
    ))
}

/// What was left as the description has it.
fn held(bench: &Bench, open: &[usize]) -> Option<String> {
    let names: Vec<String> = (open.iter().map(|&k| bench.nominal.base.expression(k))).collect();
    (!names.is_empty()).then(|| {
        format!(
            "The training motion tells less of {} than the description, so {} as described as far as bodies can be so: {}.",
            if names.len() == 1 {
                "one base parameter"
            } else {
                "some base parameters"
            },
            if names.len() == 1 {
                "it stays"
            } else {
                "they stay"
            },
            names.join(", ")
        )
    })
}

/// `named`: whether there is an effect that the description does not state.
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
