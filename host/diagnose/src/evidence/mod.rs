//! Diagnosis by one criterion: the evidence of models.
//!
//! The torque of a joint is a sum of the nominal model, effects of the library, a discrepancy that depends on the
//! motion, and autoregressive noise. All gains have Gaussian priors, so that the marginal likelihood of a set of
//! effects is in closed form; the spreads of the discrepancy maximise it. Models that differ in their effects, laws,
//! shapes, or in coordinates along which an unknown torque is allowed, are compared by the marginal likelihood times
//! their prior odds. An effect is named if the best model contains it; what an unknown torque explains is the remainder.
//!
//! `rig diagnose` does not use it yet; the developer's bench judges both.
//!
//! Left out: effects of several joints together, the hold-out, changed values of the description, voltages and link
//! encoders.

pub(crate) mod discrepancy;
mod joint;
mod model;
mod noise;
mod posterior;
mod products;
mod search;

use std::sync::Arc;

use rig_data::prepare::Recording;
use rig_model::robot::Robot;

use self::joint::JointColumns;
use self::model::Model;
use self::search::Odds;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::description::described_effects::DescribedEffects;
use crate::engine::first_lead;
use crate::fit::refit::Refit;
use crate::models::observer_models::ObserverModels;
use crate::recordings::context::{DiagnosisContext, PreparedData, library};
use crate::recordings::intake::{Intake, intake};
use crate::recordings::torque_lead::moved;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;
use crate::{DiagnoseError, Options};

/// Searches of a joint: the second one with the effects of the first in the predictions and out of the noise.
const PASSES: usize = 2;
/// Log odds from which a name is certain: 100 to 1.
const CERTAIN: f64 = 4.6;
/// Log odds within which two names are equal: 10 to 1.
const EQUAL: f64 = 2.3;

/// An effect in the best model.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Joint.
    pub joint: usize,
    /// Name of the effect.
    pub name: &'static str,
    /// All names that explain the recordings as well, this one first.
    pub set: Vec<&'static str>,
    /// Gains and shapes by name, in the units of the effect's `About`.
    pub parameters: Vec<(&'static str, f64)>,
    /// Log odds of the best model against the one without the effect, also with another coordinate open in its place.
    pub log_odds: f64,
    /// Root of the mean square of its torque over the noise.
    pub over_noise: f64,
}

/// A torque that no effect of the library explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Joint.
    pub joint: usize,
    /// Coordinate on which it depends.
    pub along: &'static str,
    /// Root of its mean square over the noise.
    pub over_noise: f64,
}

/// Result of a diagnosis by evidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finding {
    /// Named effects.
    pub found: Vec<Found>,
    /// Effects in the best model that are not certain.
    pub doubtful: Vec<Found>,
    /// Unknown torques.
    pub unknown: Vec<Unknown>,
}

/// Finds the model with the largest evidence, joint by joint.
///
/// # Errors
/// [`DiagnoseError`]: as [`crate::diagnose`]; [`DiagnoseError::Model`] also for recordings with faults.
pub fn find(
    robot: &Robot,
    training: &[&dyn Recording],
    options: &Options,
) -> Result<Finding, DiagnoseError> {
    let stated = DescribedEffects::of(robot);
    let material = match intake(&stated, training, &[], options)? {
        Intake::Fit(material) => *material,
        Intake::Restart(_) | Intake::Faulty(_) => {
            return Err(DiagnoseError::Model(
                "the recordings have faults, or contradict the description; use the workflow."
                    .into(),
            ));
        }
    };
    let context = material.context;
    let lead = first_lead(&context, &material.prepared)?;
    let prepared = moved(&context, material.prepared, &lead)?;
    let refit = Refit::of(&context, &prepared.rows)?;
    let mut finding = Finding::default();
    for joint in 0..robot.joints.len() {
        find_at((&context, &prepared, &refit), options, joint, &mut finding)?;
    }
    Ok(finding)
}

/// Finds the model of one joint.
fn find_at(
    (context, prepared, refit): (&DiagnosisContext, &PreparedData, &Refit),
    options: &Options,
    joint: usize,
    finding: &mut Finding,
) -> Result<(), DiagnoseError> {
    let mut coefficients = refit.before.values[..refit.free.len()].to_vec();
    let mut library: Vec<Candidate> = (library(context.robot, &prepared.runs, &options.without))
        .into_iter()
        .filter(|c| c.joint == joint)
        .collect();
    let threads = rig_data::prepare::threads(options.threads);
    let mut chosen: Vec<FittedCandidate> = Vec::new();
    let mut gains: Vec<f64> = Vec::new();
    let mut left = None;
    let mut by_motion = None;
    // The effects found change the predicted load and the contact, on which columns of other effects depend.
    for pass in 1.. {
        let source = context.source(prepared, &context.anchor.values(&coefficients))?;
        let source =
            source
                .loaded_by(&chosen, &gains)?
                .following(&prepared.rows, &chosen, &gains)?;
        let search = Search::new(source, library.clone(), Vec::new(), threads);
        let mut columns = JointColumns::of(context, prepared, search, joint, left)?;
        let mut start = Vec::new();
        for own in &chosen {
            start.extend(columns.add_fitted(own)?);
        }
        let model = columns.best(&start)?;
        let gear = columns.gear(&model);
        // A later search may drop the gear of an earlier one.
        if pass >= PASSES + usize::from(gear.is_some())
            || model.effects.is_empty() && columns.averaging.repeats()
        {
            return told(&mut columns, &model, by_motion, finding);
        }
        for (direction, value) in columns.directions.iter().zip(&model.nominal) {
            coefficients[*direction] = *value;
        }
        left = Some(columns.residual(&model));
        let mut kept = columns.fitted_candidates(&model)?;
        if let Some(gear) = gear
            && by_motion.is_none()
        {
            by_motion = Some(columns.odds(&model, EQUAL)?.swap_remove(gear))
                .filter(|(log_odds, _)| *log_odds > CERTAIN);
            if by_motion.is_some() {
                // In what a gear leaves without feedback of the torque the search finds other effects.
                kept = vec![kept.swap_remove(gear)];
                library.retain(|own| !is_gear(own.kind));
            }
        }
        if by_motion.is_some() {
            kept = followed((context, prepared, refit), &columns, kept)?;
        }
        let of_each: Vec<Vec<f64>>;
        (chosen, of_each) = kept.into_iter().unzip();
        gains = of_each.concat();
    }
    Ok(())
}

/// Returns effects and their gains with the link behind a gear as an observer estimates it.
fn followed(
    (context, prepared, refit): (&DiagnosisContext, &PreparedData, &Refit),
    columns: &JointColumns,
    effects: Vec<(FittedCandidate, Vec<f64>)>,
) -> Result<Vec<(FittedCandidate, Vec<f64>)>, DiagnoseError> {
    let (mut chosen, gains): (Vec<FittedCandidate>, Vec<_>) = effects.into_iter().unzip();
    // An observer has to predict better than the motor's motion alone.
    let driven = (context.source(prepared, &columns.search.source.values)?)
        .loaded_by(&chosen, &gains.concat())?;
    for own in chosen.iter_mut().filter(|own| is_gear(own.candidate.kind)) {
        own.columns = Arc::new(driven.columns(&own.candidate, &own.shapes)?);
    }
    let noise = vec![columns.noise.deviation; context.robot.joints.len()];
    let observers = ObserverModels::new(context, prepared, refit, &columns.search);
    let chosen = observers.followed(&chosen, &noise)?.unwrap_or(chosen);
    // The torque of a gear that an observer predicts is known.
    let gain = |(own, gains): (FittedCandidate, Vec<f64>)| match own.followed {
        Some(_) => (own, vec![1.0]),
        None => (own, gains),
    };
    Ok(chosen.into_iter().zip(gains).map(gain).collect())
}

/// Adds the effects and unknown torques of a model to the finding. `by_motion` are the odds of a gear that an observer
/// follows: those without feedback of the torque, because an observer makes almost any gear fit.
fn told(
    columns: &mut JointColumns,
    model: &Model,
    by_motion: Option<Odds>,
    finding: &mut Finding,
) -> Result<(), DiagnoseError> {
    let mut odds = columns.odds(model, EQUAL)?;
    if let Some((gear, known)) = columns.gear(model).zip(by_motion) {
        odds[gear] = known;
    }
    for ((effect, gains), (log_odds, set)) in model.effects.iter().zip(&model.gains).zip(odds) {
        let entry = &columns.entries[*effect];
        let about = entry.candidate.kind.about();
        let own = columns.search.source.gains(&entry.candidate);
        let gains_by_name = own.iter().map(|g| g.name).zip(gains.iter().copied());
        let shapes = about.shapes.iter().map(|s| s.name).zip(entry.shapes);
        let list = if log_odds > CERTAIN {
            &mut finding.found
        } else {
            &mut finding.doubtful
        };
        list.push(Found {
            joint: columns.joint,
            name: about.name,
            set: [vec![about.name], set].concat(),
            parameters: gains_by_name.chain(shapes).collect(),
            log_odds,
            over_noise: columns.size(*effect, gains),
        });
    }
    for family in &model.open {
        finding.unknown.push(Unknown {
            joint: columns.joint,
            along: columns.families[*family].along.words(),
            over_noise: columns.size_of_family(*family, &model.weights[*family]),
        });
    }
    if let Some(left) = columns.left(model) {
        finding.unknown.push(Unknown {
            joint: columns.joint,
            along: "no coordinate that is tried",
            over_noise: left,
        });
    }
    Ok(())
}
