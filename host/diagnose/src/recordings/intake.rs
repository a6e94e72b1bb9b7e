//! Intake of recordings: reading, data faults, disturbances, one treatment.

use rig_shared::effects::Kind;

use crate::description::described_effects::Stated;
use crate::faults::{faults, too_short_to_judge, too_short_to_learn};
use crate::fit::collinear::alike;
use crate::fit::refit::{Open, Refit, open};
use crate::outcome::DataFault;
use crate::recordings::context::{Bench, Loaded, library};
use crate::recordings::disturbance::touched;
use crate::recordings::torque_lead::slack;
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
    Hold(Box<Stated>),
}

/// Recordings that can be fitted.
pub(crate) struct Material<'a> {
    /// Robot and treatment.
    pub(crate) bench: Bench<'a>,
    /// The training data.
    pub(crate) loaded: Loaded,
    /// The hold-out.
    pub(crate) sealed: Option<Loaded>,
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
    stated: &'a Stated,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
) -> Result<Intake<'a>, DiagnoseError> {
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
    let faults = wrong(stated, &loaded, sealed.as_ref(), options)?;
    if !options.fits(&faults) {
        return Ok(Intake::Faulty(faults));
    }
    // A short motion allows parameters but no effects: both need blocks outside the fit.
    let nameless = too_short_to_learn(&loaded.runs).map(|fault| fault.text);
    let without = without(options, nameless.is_some());
    let mut more = stated.clone();
    if more.lift_limits(&loaded.runs)
        || more.hold_delays(slack(&loaded.runs))
        || more.hold_what_is_not_in(&library(bench.robot, &loaded.runs, &without))
    {
        return Ok(Intake::Hold(Box::new(more)));
    }
    let one_way = one_way(&bench.nominal, &loaded.rows);
    if !one_way.is_empty() {
        let constants: Vec<usize> = one_way.iter().map(OneWay::constant).collect();
        bench.anchor.hold(&constants);
        bench.one_way = one_way;
        let rows = |loaded: Loaded| bench.rows(loaded.runs, &loaded.treatment);
        loaded = rows(loaded)?;
        sealed = sealed.map(rows).transpose()?;
    }
    let open = open(&bench, &loaded.rows);
    if !open.held.is_empty() {
        bench.anchor.hold(&open.held);
        let rows = |loaded: Loaded| bench.rows(loaded.runs, &loaded.treatment);
        loaded = rows(loaded)?;
        sealed = sealed.map(rows).transpose()?;
    }
    let alike = alike(&bench, &loaded.rows);
    if !alike.is_empty() {
        let held: Vec<usize> = alike.iter().map(|one| one.parameter).collect();
        bench.anchor.hold(&held);
        let rows = |loaded: Loaded| bench.rows(loaded.runs, &loaded.treatment);
        loaded = rows(loaded)?;
        sealed = sealed.map(rows).transpose()?;
    }
    if bench.look_about_rests(&loaded)? {
        let rows = |loaded: Loaded| bench.rows(loaded.runs, &loaded.treatment);
        loaded = rows(loaded)?;
        sealed = sealed.map(rows).transpose()?;
    }
    let left: Vec<Vec<f64>> = {
        let refit = Refit::of(&bench, &loaded.rows)?;
        (0..bench.robot.joints.len())
            .map(|j| refit.base.residual(j))
            .collect()
    };
    let mut touches = touched(bench.robot, &left, &mut loaded);
    if !touches.is_empty() {
        loaded = bench.rows(loaded.runs, &loaded.treatment)?;
    }
    touches.extend(alike.iter().map(|one| one.said(&bench)));
    Ok(Intake::Fit(Box::new(Material {
        bench,
        loaded,
        sealed,
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
    stated: &Stated,
    loaded: &Loaded,
    sealed: Option<&Loaded>,
    options: &Options,
) -> Result<Vec<DataFault>, DiagnoseError> {
    let all: Vec<&Run> = (loaded.runs.iter())
        .chain(sealed.iter().flat_map(|sealed| &sealed.runs))
        .collect();
    if let Some((a, b)) = copies(&all) {
        let [label, again] = [a, b].map(|k| all[k].label.clone());
        return Err(DiagnoseError::Copy { label, again });
    }
    let mut wrong = faults(&stated.robot, &loaded.runs)?;
    if let (true, Some(sealed)) = (options.fits(&wrong), sealed) {
        let held = faults(&stated.robot, &sealed.runs)?;
        let short = too_short_to_judge(&sealed.runs).filter(|_| options.fits(&held));
        wrong.extend(held.into_iter().chain(short));
    }
    Ok(wrong)
}
