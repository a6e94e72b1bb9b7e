//! From checked effects to the result: steps, changed parameters, the written model, and its sentences.

use super::checks::Checked;
use super::naming::Named;
use super::work::Work;
use crate::DiagnoseError;
use crate::columns::kinds::is_friction;
use crate::description::described_effects::Now;
use crate::fit::collinear::Alike;
use crate::fit::open_parameters::Open;
use crate::link_encoder::{Across, across, names_something, tell as tell_across};
use crate::models::parameter_change::{Change, RefitData, change};
use crate::models::simulated_motion::Replay;
use crate::motor_voltage::{contradict, name_something, tell};
use crate::outcome::{Absorbed, Before, DataFault, Described, Diagnosis, Residual, Step, Verdict};
use crate::recordings::disturbance::Touch;
use crate::recordings::encoder_zero::{another_zero, another_zero_held};
use crate::result::finish::finish;
use crate::result::found::{Drawn, Found};
use crate::result::motion::{by_motion, motion_how};
use crate::result::places::place;
use crate::result::remainder::remainder;
use crate::result::remarks::{Remarked, of_intake, of_model, remarks};
use crate::result::steps::{change_step, steps};
use crate::result::treatment::treated;
use crate::result::tried::tried;
use crate::search::chosen::with;
use crate::search::tried_candidate::{TriedCandidate, reconcile};
use rig_model::robot::Robot;

/// What earlier stages hand over for the report alone.
pub(super) struct Notes {
    /// Possible data faults.
    pub(super) faults: Vec<DataFault>,
    /// Segments left out as disturbances.
    pub(super) touches: Vec<Touch>,
    /// Collinear parameters, which are held.
    pub(super) alike: Vec<Alike>,
    /// Described parameters that the training data do not improve, and those that they contradict.
    pub(super) open: Open,
    /// Torque lead of each joint, s.
    pub(super) lead: Vec<f64>,
    /// All trials of the search.
    pub(super) tried: Vec<TriedCandidate>,
}

/// Composes the result and the description with the effects. `replay` simulates the hold-out, or else the training motion.
///
/// # Errors
/// [`DiagnoseError`].
pub(super) fn findings(
    work: &Work,
    mut named: Named,
    checked: Checked,
    replay: &Replay,
    mut notes: Notes,
) -> Result<(Diagnosis, Robot), DiagnoseError> {
    named.joint.solution.values = checked.after.coefficients(&work.data.context.anchor);
    let across = by_link_encoders(work, &named)?;
    let change = changed(work, &named, &checked);
    let steps = all_steps(work, &mut named, &checked, replay, change.as_ref())?;
    let described = described(work, &named);
    let (absorbed_before, absorbed) = absorbed(work, &named, &checked);
    reconcile(&mut notes.tried, named.found(), work.search.trials());
    let changed =
        change.is_some() || contradict(&named.windings) || work.data.stated.changed(&described);
    let judged = &named.judged;
    let first = &judged.chosen[..named.described];
    let mut diagnosis = Diagnosis {
        schema: "rig-diagnosis/1".into(),
        robot: work.data.context.robot.name.clone(),
        verdict: verdict(work, &named, &checked, &across, changed),
        residual: Residual::Torque,
        words: Vec::new(),
        noise_floor_rms: judged.known.clone(),
        noise_floor_from: judged.from.clone(),
        left: checked.sizes.clone(),
        noise_floor_how: String::new(),
        motion_how: motion_how(&replay.told(&judged.chosen, named.described)?),
        treatment: Some(treated(
            work.data.context.robot,
            work.data.prepared,
            work.data.held_out,
        )),
        torque_lead: notes.lead.clone(),
        places: (work.judge)
            .places(work.refit.footing(first)[1], &judged.floors, first)
            .iter()
            .map(place)
            .collect(),
        gap_closed: (!steps.is_empty())
            .then(|| checked.descent.gap_closed(&judged.known, change.is_some()))
            .flatten(),
        described,
        steps,
        absorbed,
        absorbed_before,
        by_motion: named.by_motion.take().map(by_motion),
        not_testable: Vec::new(),
        detectable: Vec::new(),
        next_experiment: None,
        remainder: (judged.left.as_ref().map(remainder)).or_else(|| checked.of_voltage.clone()),
        data_faults: std::mem::take(&mut notes.faults),
        waterfall: (checked.descent).waterfall(
            work.data.context.robot,
            named.found(),
            &judged.known,
        ),
        tried: tried(work.data.context.robot, &notes.tried),
        maps: Vec::new(),
        curves: Vec::new(),
    };
    let mut model = checked.after.model.clone();
    drawn(work, &named, &checked, replay, &model, &mut diagnosis)?;
    told(
        work,
        named,
        &checked,
        across,
        change,
        &notes,
        (&mut diagnosis, &mut model),
    )?;
    Ok((diagnosis, model))
}

/// Returns the verdict; `changed` is true if a nominal parameter differs from the description.
fn verdict(
    work: &Work,
    named: &Named,
    checked: &Checked,
    across: &[Across],
    changed: bool,
) -> Verdict {
    if named.judged.left.is_some() || checked.of_voltage.is_some() {
        Verdict::Remainder
    } else if !named.found().is_empty()
        || name_something(&named.windings)
        || names_something(across, &|c| work.data.stated.states(c))
    {
        Verdict::Explained
    } else if changed {
        Verdict::ParameterChange
    } else {
        Verdict::NothingMissing
    }
}

/// Compares the encoders on the links with the motor encoders, beside the final model.
fn by_link_encoders(work: &Work, named: &Named) -> Result<Vec<Across>, DiagnoseError> {
    let (context, free) = (work.data.context, work.refit.free.len());
    let after = &named.joint.solution;
    let nominal = context.anchor.values(&after.values[..free]);
    let of = |prepared| -> Result<_, DiagnoseError> {
        (context.source(prepared, &nominal)?).loaded_by(&named.judged.chosen, &after.values[free..])
    };
    let held = work.data.held_out.map(of).transpose()?;
    across(
        &of(work.data.prepared)?,
        &context.anchor,
        after,
        work.data.prepared,
        held.as_ref().zip(work.data.held_out),
        work.data.options,
    )
}

/// Returns a change of the nominal parameters against the description, if there is one.
fn changed(work: &Work, named: &Named, checked: &Checked) -> Option<Change> {
    let (chosen, after) = (&named.judged.chosen, &named.joint.solution);
    let refitted = RefitData {
        context: work.data.context,
        rows: &work.data.prepared.rows,
        after,
        beside_friction: chosen.iter().any(|p| is_friction(p.candidate.kind)),
        left: checked.left,
    };
    let known = work.refit.explained(chosen, after);
    change(work.refit, &refitted, &known, &work.data.options.without)
}

/// Returns a step for each effect that is not described, and one for changed nominal parameters.
fn all_steps(
    work: &Work,
    named: &mut Named,
    checked: &Checked,
    replay: &Replay,
    change: Option<&Change>,
) -> Result<Vec<Step>, DiagnoseError> {
    let (robot, judged) = (work.data.context.robot, &named.judged);
    let (descent, motion) = (&checked.descent, &checked.motion);
    let mut list = steps(
        work.search,
        work.refit,
        judged,
        named.described,
        &named.joint,
        descent,
        motion,
    )?;
    let said = std::mem::take(&mut named.said);
    for (step, word) in list.iter_mut().zip(said.into_iter().skip(named.described)) {
        word.applied(step);
    }
    let step = change.and_then(|change| change_step(robot, change, descent, &judged.known));
    if let Some(mut step) = step {
        let given = replay.errors_of(&work.data.stated.moving());
        let last = motion.last().and_then(Option::as_ref);
        let tip = robot.joints.len() - 1;
        step.motion_rms = (given.as_ref().zip(last)).map(|(a, b)| [a, b].map(|e| e.rms(tip)));
        list.push(step);
    }
    Ok(list)
}

/// Returns the fate of each described effect.
fn described(work: &Work, named: &Named) -> Vec<Described> {
    let (chosen, free) = (&named.judged.chosen, work.refit.free.len());
    let now = |k: usize| Now {
        kind: chosen[k].candidate.kind,
        parameters: (named.joint).parameters(&work.search.source, chosen, free, k),
    };
    let places = work.data.stated.matched(chosen).into_iter();
    work.data
        .stated
        .told(places.map(|place| place.map(now)).collect())
}

/// Returns the parameters that a missing effect had biased, and against what they are compared.
fn absorbed(work: &Work, named: &Named, checked: &Checked) -> (Before, Vec<Absorbed>) {
    let anchor = &work.data.context.anchor;
    let of = |before: &[f64]| {
        work.refit
            .absorbed(work.data.context, before, &named.joint.solution)
    };
    if !named.found().is_empty() {
        return (
            Before::WithoutEffects,
            of(&checked.before.coefficients(anchor)),
        );
    }
    if !anchor.stated {
        return (Before::Described, Vec::new());
    }
    let mut stated = anchor.prior_coefficients();
    for (k, value) in stated.iter_mut().enumerate() {
        if anchor.is_unstated(k) {
            *value = f64::NAN;
        }
    }
    (Before::Described, of(&stated))
}

/// Adds pictures, sentences and limits.
fn drawn(
    work: &Work,
    named: &Named,
    checked: &Checked,
    replay: &Replay,
    model: &Robot,
    diagnosis: &mut Diagnosis,
) -> Result<(), DiagnoseError> {
    let (context, judged) = (work.data.context, &named.judged);
    let drawn = work.data.held_out.unwrap_or(work.data.prepared);
    let first = &judged.chosen[..named.described];
    let found = Found {
        robot: context.robot,
        nominal: &context.nominal,
        anchor: &context.anchor,
        search: work.search,
        rows: &work.data.prepared.rows,
        base: &work.refit.base,
        model,
        chosen: &judged.chosen,
        described: named.described,
        coordinates: work.judge.coordinates,
        floors: &judged.floors,
        known: &judged.known,
        seed: work.data.options.seed,
        sensor_zeros: &work.data.options.sensor_zeros,
        one_way: &context.one_way,
        drawn: Drawn {
            runs: &drawn.runs,
            rows: &drawn.rows,
            left: [
                context.remaining(drawn, checked.before.fitted(), first)?,
                context.remaining(drawn, checked.after.fitted(), &judged.chosen)?,
            ],
            motion: replay.drawn(&judged.chosen, named.described)?,
        },
    };
    finish(&found, diagnosis)
}

/// Adds the findings by other sensors, to the result and to the model, and the remaining sentences.
fn told(
    work: &Work,
    named: Named,
    checked: &Checked,
    across: Vec<Across>,
    change: Option<Change>,
    notes: &Notes,
    (diagnosis, model): (&mut Diagnosis, &mut Robot),
) -> Result<(), DiagnoseError> {
    let chosen = &named.judged.chosen;
    let after = &named.joint.solution;
    let remarked = of_model(work.data.context.robot, &checked.after.remarks);
    diagnosis.words.extend(remarked);
    model.effects.extend(work.data.stated.held().cloned());
    tell(named.windings, diagnosis, model);
    tell_across(across, diagnosis, model);
    let described = diagnosis.described.iter().map(|d| d.text.clone());
    diagnosis.words.extend(described);
    diagnosis.words.extend(named.silent);
    let intake = of_intake(work.data.context, &notes.touches, &notes.alike);
    diagnosis.words.extend(intake);
    let by_motion = diagnosis.by_motion.as_ref().map(|m| m.text.clone());
    diagnosis.words.extend(by_motion);
    let base = &work.refit.base;
    let taken = {
        let [before, after] = [base, &with(base, chosen, None)].map(|fit| fit.rms(0));
        1.0 - after / before
    };
    let source = &work.search.source;
    let zero = match (another_zero(source, base, taken)?, work.data.held_out) {
        (None, Some(held_out)) if checked.left => {
            let residual = work
                .data
                .context
                .remaining(held_out, checked.after.fitted(), chosen)?;
            another_zero_held(work.data.context, held_out, &source.values, &residual)?
        }
        (told, _) => told,
    };
    diagnosis.words.extend(remarks(&Remarked {
        context: work.data.context,
        prepared: work.data.prepared,
        held_out: work.data.held_out,
        limits: &work.data.stated.lifted,
        zero,
        sensor_zeros: &work.data.options.sensor_zeros,
        open: &notes.open,
        change,
        chosen,
        last: after,
    }));
    Ok(())
}
