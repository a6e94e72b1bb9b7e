//! Intake of recordings: reading, data faults, disturbances, one treatment.

use rig_shared::effects::Kind;

use crate::description::described_effects::DescribedEffects;
use crate::faults::{faults, too_short_to_judge, too_short_to_learn};
use crate::fit::collinear::alike;
use crate::fit::refit::{Open, Refit, open};
use crate::outcome::DataFault;
use crate::recordings::context::{DiagnosisContext, PreparedData, library};
use crate::recordings::disturbance::touched;
use crate::recordings::torque_lead::sampling_jitter;
use crate::rows::one_way::{OneWay, one_way};
use crate::{DiagnoseError, Options};
use rig_data::past::in_sessions;
use rig_data::prepare::Recording;
use rig_data::runs::{Run, copies};

/// Outcome of the intake.
pub(crate) enum Intake<'a> {
    /// The recordings can be fitted.
    Fit(Box<Material<'a>>),
    /// The recordings have faults.
    Faulty(Vec<DataFault>),
    /// Start again with more described effects held, or with limits ignored.
    Hold(Box<DescribedEffects>),
}

/// Recordings that can be fitted.
pub(crate) struct Material<'a> {
    /// Robot and treatment.
    pub(crate) context: DiagnosisContext<'a>,
    /// The training data.
    pub(crate) prepared: PreparedData,
    /// The hold-out.
    pub(crate) held_out: Option<PreparedData>,
    /// Described parameters that the training data do not improve, and those that they contradict.
    pub(crate) open: Open,
    /// Reason why no effect is searched for (the recordings are too short), a sentence; None otherwise.
    pub(crate) nameless: Option<String>,
    /// Sentences on segments left out as disturbances and on collinear parameters.
    pub(crate) touches: Vec<String>,
    /// Possible data faults; real ones only if the fit was requested in spite of them.
    pub(crate) faults: Vec<DataFault>,
}

/// Reads the recordings.
///
/// # Errors
/// [`DiagnoseError`].
pub(crate) fn intake<'a>(
    stated: &'a DescribedEffects,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
) -> Result<Intake<'a>, DiagnoseError> {
    let mut context = DiagnosisContext::of(stated, training)?;
    let mut prepared = context.load(training)?;
    let mut held_out = if holdout.is_empty() {
        None
    } else {
        Some(context.load_held(holdout)?)
    };
    in_sessions(&mut prepared.runs, &[]);
    if let Some(held_out) = &mut held_out {
        in_sessions(&mut held_out.runs, &prepared.runs);
    }
    let faults = wrong(stated, &prepared, held_out.as_ref(), options)?;
    if !options.fits(&faults) {
        return Ok(Intake::Faulty(faults));
    }
    // A short motion allows parameters but no effects: both need blocks outside the fit.
    let nameless = too_short_to_learn(&prepared.runs).map(|fault| fault.text);
    let without = without(options, nameless.is_some());
    let mut more = stated.clone();
    if more.lift_limits(&prepared.runs)
        || more.hold_delays(sampling_jitter(&prepared.runs))
        || more.hold_what_is_not_in(&library(context.robot, &prepared.runs, &without))
    {
        return Ok(Intake::Hold(Box::new(more)));
    }
    let one_way = one_way(&context.nominal, &prepared.rows);
    if !one_way.is_empty() {
        let constants: Vec<usize> = one_way.iter().map(OneWay::constant).collect();
        context.anchor.hold(&constants);
        context.one_way = one_way;
        let rows = |prepared: PreparedData| context.rows(prepared.runs, &prepared.treatment);
        prepared = rows(prepared)?;
        held_out = held_out.map(rows).transpose()?;
    }
    let open = open(&context, &prepared.rows);
    if !open.held.is_empty() {
        context.anchor.hold(&open.held);
        let rows = |prepared: PreparedData| context.rows(prepared.runs, &prepared.treatment);
        prepared = rows(prepared)?;
        held_out = held_out.map(rows).transpose()?;
    }
    let alike = alike(&context, &prepared.rows);
    if !alike.is_empty() {
        let held: Vec<usize> = alike.iter().map(|one| one.parameter).collect();
        context.anchor.hold(&held);
        let rows = |prepared: PreparedData| context.rows(prepared.runs, &prepared.treatment);
        prepared = rows(prepared)?;
        held_out = held_out.map(rows).transpose()?;
    }
    if context.look_about_rests(&prepared)? {
        let rows = |prepared: PreparedData| context.rows(prepared.runs, &prepared.treatment);
        prepared = rows(prepared)?;
        held_out = held_out.map(rows).transpose()?;
    }
    let left: Vec<Vec<f64>> = {
        let refit = Refit::of(&context, &prepared.rows)?;
        (0..context.robot.joints.len())
            .map(|j| refit.base.residual(j))
            .collect()
    };
    let mut touches = touched(context.robot, &left, &mut prepared);
    if !touches.is_empty() {
        prepared = context.rows(prepared.runs, &prepared.treatment)?;
    }
    touches.extend(alike.iter().map(|one| one.said(&context)));
    Ok(Intake::Fit(Box::new(Material {
        context,
        prepared,
        held_out,
        open,
        nameless,
        touches,
        faults,
    })))
}

/// Returns the kinds left out of the search: all of them if the recordings are too short (`nameless`).
pub(crate) fn without(options: &Options, nameless: bool) -> Vec<Kind> {
    match nameless {
        true => Kind::ALL.to_vec(),
        false => options.without.clone(),
    }
}

/// Returns the data faults of all recordings.
fn wrong(
    stated: &DescribedEffects,
    prepared: &PreparedData,
    held_out: Option<&PreparedData>,
    options: &Options,
) -> Result<Vec<DataFault>, DiagnoseError> {
    let all: Vec<&Run> = (prepared.runs.iter())
        .chain(held_out.iter().flat_map(|held_out| &held_out.runs))
        .collect();
    if let Some((a, b)) = copies(&all) {
        let [label, again] = [a, b].map(|k| all[k].label.clone());
        return Err(DiagnoseError::Copy { label, again });
    }
    let mut wrong = faults(&stated.robot, &prepared.runs)?;
    if let (true, Some(held_out)) = (options.fits(&wrong), held_out) {
        let held = faults(&stated.robot, &held_out.runs)?;
        let short = too_short_to_judge(&held_out.runs).filter(|_| options.fits(&held));
        wrong.extend(held.into_iter().chain(short));
    }
    Ok(wrong)
}
