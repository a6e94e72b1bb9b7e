//! The results of a fit, put together as an [`Identification`].

use nalgebra::DMatrix;

use super::further::{Further, further};
use super::named::Named;
use super::outcome::Outcome;
use super::own::Own;
use super::own_fit::{OwnFit, beside_varying_friction, own_fits};
use super::torque_agreement::torque_agreement;
use super::torque_scale::torque_scale;
use super::treated::Treated;
use super::warnings::Heard;
use crate::error::IdentifyError;
use crate::estimators::fit::Fit;
use crate::estimators::problem::Problem;
use crate::identification::{Details, Identification, JointFigures};
use crate::options::ModelKind;
use crate::rows::planned::Planned;
use crate::structure::excitation::not_excited;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::residual::ResidualReport;
use crate::unmodelled::beyond::Beyond;
use crate::unmodelled::lag::Lag;
use crate::warning::Warning;
use rig_data::prepare::{PreprocessingPlan, Survey};
use rig_model::effects::Effects;
use rig_model::robot::Robot;
use rig_numerics::autocorrelation::correlation_time;

/// A fit with its residuals.
pub(crate) struct Results<'a> {
    /// Input of the estimators.
    pub problem: &'a Problem<'a>,
    /// The robot as described.
    pub described: &'a Robot,
    /// The least-squares fit.
    pub fit: &'a Fit,
    /// Effects beyond the description.
    pub known: &'a Beyond,
    /// Estimated values of all base columns.
    pub full: &'a [f64],
    /// Residuals of the training recordings by joint.
    pub train: Vec<ResidualReport>,
    /// The same of the hold-out, if given.
    pub holdout: Option<Vec<ResidualReport>>,
    /// Surveys of the hold-out recordings.
    pub holdout_surveys: &'a [Survey],
    /// Treatment of the training recordings.
    pub treated: &'a Treated,
    /// Treatments of the hold-out recordings.
    pub treatments: &'a [PreprocessingPlan],
    /// The hold-out recordings with their rows.
    pub held: &'a [Planned<'a>],
    /// True if effects were subtracted from the rows.
    pub compensated: bool,
}

/// Says which joints' torques are off by a factor: by the described gravity, or by the other joints.
fn torque_factor(
    problem: &Problem,
    described: &Robot,
    fits: &[OwnFit],
) -> Result<Option<Warning>, IdentifyError> {
    let said = |varying: Option<&[OwnFit]>| -> Result<Option<Warning>, IdentifyError> {
        let by_gravity = torque_scale(problem, described, fits, varying)?;
        Ok(by_gravity.or_else(|| torque_agreement(fits, varying, described)))
    };
    // The rows are read once more only if there is something to tell.
    if said(None)?.is_none() {
        return Ok(None);
    }
    said(beside_varying_friction(problem, fits)?.as_deref())
}

impl Results<'_> {
    /// Computes the further results and puts all of them together. `own` is the fit of an estimator beyond least
    /// squares.
    ///
    /// # Errors
    /// [`IdentifyError`]: reading errors, a singular problem, an impossible effect.
    pub(crate) fn identification(
        self,
        estimate: Estimate,
        own: Option<Own>,
    ) -> Result<Identification, IdentifyError> {
        let problem = self.problem;
        let (robot, options, data) = (problem.robot, problem.options, problem.data);
        let described = self.described;
        let remembered: Vec<f64> = (self.train.iter())
            .map(|r| correlation_time(&r.autocorrelation, r.rows))
            .collect();
        let lag = Lag::of(problem, &remembered)?;
        let named = Named::of(problem, &estimate);
        let mut not_excited = not_excited(problem.base, data);
        let outcome = Outcome {
            estimate: &estimate,
            full: self.full,
            factors: &self.fit.factors,
            memory: match options.model {
                ModelKind::Differential => remembered,
                ModelKind::Integral => vec![estimate.memory_rows],
            },
            parameters: &named.parameters,
            measured: self.measured(),
        };
        let mut beyond = further(problem, own, &outcome, self.held)?;
        not_excited.append(&mut beyond.hardly_excited);
        let mut warnings = std::mem::take(&mut beyond.warnings);
        warnings.extend(self.warnings(&estimate, lag));
        // A base that leans changes gravity itself.
        if self.known.tilt.is_none() {
            let fits = own_fits(problem, outcome.factors)?;
            warnings.extend(torque_factor(problem, described, &fits)?);
        }
        let stated =
            Effects::of(self.described).map_err(|e| IdentifyError::Model(e.to_string()))?;
        let [taken, left] = stated.uncompensated();
        warnings.extend(left.map(Warning::EffectsLeftOut));
        let procedure = taken
            .into_iter()
            .chain(self.known.said())
            .chain(std::mem::take(&mut beyond.procedure))
            .collect();
        let Further {
            essential,
            standard,
            comparison,
            free,
            ..
        } = beyond;
        let mut found = Identification {
            schema: "rig-identification/1".into(),
            robot: robot.name.clone(),
            model: options.model,
            estimator: options.estimator,
            rank: named.columns.len(),
            condition_number: estimate.condition,
            joints: self.joints(),
            position_torques: self.known.torques.clone(),
            base_tilt: self.known.tilt.clone(),
            not_excited,
            warnings,
            essential,
            standard_parameters: standard,
            comparison,
            procedure,
            details: self.details(estimate, free, named.combination, named.columns),
            base_parameters: named.parameters,
        };
        let below_zero = found.below_zero(described);
        found.warnings.extend(below_zero);
        Ok(found)
    }

    /// Returns the RMS torques of training data and hold-out per joint, if effects were subtracted from the rows.
    fn measured(&self) -> Option<[Vec<f64>; 2]> {
        self.compensated.then(|| {
            let rms = |of: &[ResidualReport]| of.iter().map(|r| r.torque_rms).collect();
            [
                rms(&self.train),
                rms(self.holdout.as_deref().unwrap_or_default()),
            ]
        })
    }

    /// Returns the warnings about recordings and fit.
    fn warnings(&self, estimate: &Estimate, lag: Option<Lag>) -> Vec<Warning> {
        let heard = Heard {
            robot: self.problem.robot,
            options: self.problem.options,
            surveys: self.problem.surveys,
            holdout_surveys: self.holdout_surveys,
            treatment: &self.treated.treatment,
            treatments: self.treatments,
            stride: self.problem.plan.stride,
            lag,
            converged: self.fit.converged,
            instants: self.fit.instants,
            estimate,
            train: &self.train,
            holdout: self.holdout.as_deref(),
        };
        heard.warnings()
    }

    /// Returns the residual figures by joint.
    fn joints(&self) -> Vec<JointFigures> {
        let joints = self.problem.robot.joints.iter().enumerate();
        joints
            .map(|(j, joint)| {
                let held = self.holdout.as_ref().map(|h| &h[j]);
                JointFigures::of(&joint.name, &self.train[j], held)
            })
            .collect()
    }

    /// Returns the content of the report beyond the results.
    fn details(
        self,
        estimate: Estimate,
        free: Vec<[f64; 3]>,
        combination: DMatrix<f64>,
        columns: Vec<usize>,
    ) -> Details {
        let Treated {
            treatment,
            window,
            window_reason,
        } = self.treated;
        let integral = self.problem.options.model == ModelKind::Integral;
        Details {
            masked: self.fit.tally.masked(),
            training: self.problem.surveys.to_vec(),
            holdout: self.holdout_surveys.to_vec(),
            estimate,
            free,
            combination,
            links: self.problem.robot.link_count(),
            columns,
            train: self.train,
            holdout_residuals: self.holdout,
            window: integral.then(|| (*window as f64 * treatment.dt(), window_reason.clone())),
            treatment: treatment.clone(),
        }
    }
}
