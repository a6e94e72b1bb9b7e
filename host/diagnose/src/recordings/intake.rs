//! Intake of recordings: reading, data faults, disturbances, one treatment.

use rig_shared::effects::Kind;

use crate::description::described_effects::DescribedEffects;
use crate::faults::{faults, too_short_to_judge, too_short_to_learn};
use crate::fit::collinear::{Alike, alike};
use crate::fit::open_parameters::{Open, open};
use crate::fit::refit::Refit;
use crate::outcome::DataFault;
use crate::recordings::context::{DiagnosisContext, PreparedData, library};
use crate::recordings::disturbance::{Touch, touched};
use crate::recordings::rest_rows::joints_loud_at_rest;
use crate::recordings::sampling::sampling_jitter;
use crate::rows::one_way::{OneWay, one_way};
use crate::{DiagnoseError, Options};
use rig_data::prepare::Recording;
use rig_data::runs::{Run, copies};
use rig_data::sessions::join_sessions;

/// Outcome of the intake.
pub(crate) enum Intake<'a> {
    /// The recordings can be fitted.
    Fit(Box<Material<'a>>),
    /// The recordings have faults.
    Faulty(Vec<DataFault>),
    /// Start again with more described effects fixed, or with limits ignored.
    Restart(Box<DescribedEffects>),
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
    /// Set if the recordings are too short to search for effects.
    pub(crate) nameless: Option<DataFault>,
    /// Segments left out as disturbances.
    pub(crate) touches: Vec<Touch>,
    /// Collinear parameters, which are held.
    pub(crate) alike: Vec<Alike>,
    /// Possible data faults; real ones only if the fit was requested in spite of them.
    pub(crate) faults: Vec<DataFault>,
}

/// The training data and the hold-out, under one treatment.
struct Readings {
    training: PreparedData,
    held_out: Option<PreparedData>,
}

impl Readings {
    /// Reads the recordings and places them in sessions.
    fn of(
        context: &DiagnosisContext,
        training: &[&dyn Recording],
        holdout: &[&dyn Recording],
    ) -> Result<Self, DiagnoseError> {
        let mut training = context.load(training)?;
        let mut held_out = if holdout.is_empty() {
            None
        } else {
            Some(context.load_held(holdout)?)
        };
        join_sessions(&mut training.runs, &[]);
        if let Some(held_out) = &mut held_out {
            join_sessions(&mut held_out.runs, &training.runs);
        }
        Ok(Self { training, held_out })
    }

    /// Forms the rows anew, after the context has changed.
    fn with_new_rows(self, context: &DiagnosisContext) -> Result<Self, DiagnoseError> {
        let rows = |prepared: PreparedData| context.rows(prepared.runs, &prepared.treatment);
        Ok(Self {
            training: rows(self.training)?,
            held_out: self.held_out.map(rows).transpose()?,
        })
    }
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
    let readings = Readings::of(&context, training, holdout)?;
    let faults = wrong(
        stated,
        &readings.training,
        readings.held_out.as_ref(),
        options,
    )?;
    if !options.fits(&faults) {
        return Ok(Intake::Faulty(faults));
    }
    // A short motion allows parameters but no effects: both need blocks outside the fit.
    let nameless = too_short_to_learn(&readings.training.runs);
    let without = allowed(options, nameless.is_some()).without;
    if let Some(more) = held_in_addition(&context, &readings.training.runs, &without) {
        return Ok(Intake::Restart(Box::new(more)));
    }
    let readings = one_way_held(&mut context, readings)?;
    let (readings, open, alike) = undetermined_held(&mut context, readings)?;
    let mut readings = rests_used(&mut context, readings)?;
    let touches = without_touches(&context, &mut readings.training)?;
    if !touches.is_empty() {
        // A joint that something holds stands still under any torque.
        context.rests = None;
        readings = readings.with_new_rows(&context)?;
        readings = rests_used(&mut context, readings)?;
    }
    let Readings {
        training: prepared,
        held_out,
    } = readings;
    Ok(Intake::Fit(Box::new(Material {
        context,
        prepared,
        held_out,
        open,
        nameless,
        touches,
        alike,
        faults,
    })))
}

/// Returns the description with more effects held, or with limits ignored; None if it stays as it is.
fn held_in_addition(
    context: &DiagnosisContext,
    training: &[Run],
    without: &[Kind],
) -> Option<DescribedEffects> {
    let mut more = context.stated.clone();
    let changed = more.lift_limits(training)
        || more.hold_delays(sampling_jitter(training))
        || more.hold_what_is_not_in(&library(context.robot, training, without));
    changed.then_some(more)
}

/// Holds the constant torques of joints that move in one direction only.
fn one_way_held(
    context: &mut DiagnosisContext,
    readings: Readings,
) -> Result<Readings, DiagnoseError> {
    let one_way = one_way(&context.nominal, &readings.training.rows);
    if one_way.is_empty() {
        return Ok(readings);
    }
    let constants: Vec<usize> = one_way.iter().map(OneWay::constant).collect();
    context.anchor.hold(&constants);
    context.one_way = one_way;
    readings.with_new_rows(context)
}

/// Holds the parameters that the training data do not improve, then those that are alike along the motion. Returns
/// both.
fn undetermined_held(
    context: &mut DiagnosisContext,
    mut readings: Readings,
) -> Result<(Readings, Open, Vec<Alike>), DiagnoseError> {
    let open = open(context, &readings.training.rows);
    if !open.held.is_empty() {
        context.anchor.hold(&open.held);
        readings = readings.with_new_rows(context)?;
    }
    let alike = alike(context, &readings.training.rows);
    if !alike.is_empty() {
        let held: Vec<usize> = alike.iter().map(|one| one.parameter).collect();
        context.anchor.hold(&held);
        readings = readings.with_new_rows(context)?;
    }
    Ok((readings, open, alike))
}

/// Uses the rows near standstill of the joints that show more there than dry friction, and leaves the samples near
/// standstill out of the rows of the others.
fn rests_used(
    context: &mut DiagnosisContext,
    mut readings: Readings,
) -> Result<Readings, DiagnoseError> {
    context.rests = Some(Vec::new());
    readings = readings.with_new_rows(context)?;
    let loud = joints_loud_at_rest(context, &readings.training)?;
    if loud.is_empty() {
        return Ok(readings);
    }
    context.rests = Some(loud);
    readings.with_new_rows(context)
}

/// Leaves disturbances out of the training runs, and returns them.
fn without_touches(
    context: &DiagnosisContext,
    prepared: &mut PreparedData,
) -> Result<Vec<Touch>, DiagnoseError> {
    let left: Vec<Vec<f64>> = {
        let refit = Refit::of(context, &prepared.rows)?;
        (0..context.robot.joints.len())
            .map(|j| refit.base.residual(j))
            .collect()
    };
    Ok(touched(&left, prepared))
}

/// Returns the options with the kinds left out of the search: all of them if the recordings are too short (`nameless`).
pub(crate) fn allowed(options: &Options, nameless: bool) -> Options {
    let mut options = options.clone();
    if nameless {
        options.without = Kind::ALL.to_vec();
    }
    options
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
