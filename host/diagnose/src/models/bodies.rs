//! Description with the found effects; the links of an arm are physically consistent bodies.
//!
//! Freely fitted base parameters of several links need not be physically consistent. Noise dominates the weakly excited
//! ones. The inertia matrix is then not positive definite and nothing can be simulated. So an arm gets the nearest
//! consistent bodies in the metric of the data; held base parameters take part in this fit. The effects' gains are then
//! refitted. A single link is consistent with any base parameters.
//!
//! Leaves out: effects formed anew with the consistent bodies; the cosine by which a tilted arm's gravity torque is too
//! small.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::DMatrix;

use crate::DiagnoseError;
use crate::description::parameter_prior::{Direction, ParameterPrior};
use crate::fit::least_squares::Fit;
use crate::fit::refit::Refit;
use crate::fit::solution::solve;
use crate::models::description::{
    completed, gravity_with, of_identification, redistributed_over, with_gains,
};
use crate::models::remark::ModelRemark;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::noise_floor;
use crate::rows::regression::{Column, combined};
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use rig_data::runs::{JointRun, Run};
use rig_identify::{Combinations, Sizes, as_bodies};
use rig_model::robot::Robot;
use rig_numerics::vector::dot;

/// Relative increase of the residual above which the cost of consistent bodies is reported.
const SAID: f64 = 1e-3;

/// A model that was fitted to the training data.
pub(crate) struct FittedModel {
    /// Base parameters in the form of columns with the description's gravity.
    values: Vec<f64>,
    /// The same in the form of a description.
    described: Vec<f64>,
    /// Gains of the effects' columns.
    gains: Vec<f64>,
    /// Description with base parameters and effects.
    pub(crate) model: Robot,
    /// Remarks on the model.
    pub(crate) remarks: Vec<ModelRemark>,
}

impl FittedModel {
    /// Returns base parameters and gains.
    pub(crate) fn fitted(&self) -> [&[f64]; 2] {
        [&self.values, &self.gains]
    }

    /// Returns the coefficients of the free nominal directions, then of the effects' columns.
    pub(crate) fn coefficients(&self, anchor: &ParameterPrior) -> Vec<f64> {
        let along =
            |direction: &Direction| direction.iter().map(|&(k, f)| f * self.described[k]).sum();
        let free = anchor.free.iter().map(along);
        free.chain(self.gains.iter().copied()).collect()
    }
}

/// Data that models are fitted to. Each fit is cached for judging, simulation, drawing and writing.
pub(crate) struct ModelCache<'a, 'r> {
    /// Robot and data treatment.
    pub(crate) context: &'a DiagnosisContext<'a>,
    refit: &'a Refit<'r>,
    /// The training data.
    runs: &'a [Run],
    /// Base parameters that formed the effects' columns.
    formed_at: &'a [f64],
    /// Fitted models by the columns of their effects.
    known: Mutex<Vec<(Vec<Arc<Vec<Column>>>, Arc<FittedModel>)>>,
}

/// Base parameters in the form of columns and of a description, gains, and the description with its remarks.
type Linked = ([Vec<f64>; 2], Vec<f64>, (Robot, Vec<ModelRemark>));

impl<'a, 'r> ModelCache<'a, 'r> {
    /// Prepares fits to `runs`.
    pub(crate) fn new(
        context: &'a DiagnosisContext<'a>,
        refit: &'a Refit<'r>,
        runs: &'a [Run],
        formed_at: &'a [f64],
    ) -> Self {
        Self {
            context,
            refit,
            runs,
            formed_at,
            known: Mutex::default(),
        }
    }

    /// Returns the model of these effects.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if its parameters are not identifiable.
    pub(crate) fn of(&self, chosen: &[FittedCandidate]) -> Result<Arc<FittedModel>, DiagnoseError> {
        let same = |known: &[Arc<Vec<Column>>]| {
            known.len() == chosen.len()
                && (known.iter().zip(chosen)).all(|(k, p)| Arc::ptr_eq(k, &p.columns))
        };
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, standing)) = known().iter().find(|(k, _)| same(k)) {
            return Ok(standing.clone());
        }
        let standing = Arc::new(self.fitted(chosen)?);
        let key = chosen.iter().map(|p| p.columns.clone()).collect();
        known().push((key, standing.clone()));
        Ok(standing)
    }

    /// Stores `prune` as the model of these effects.
    pub(crate) fn adopt(&self, chosen: &[FittedCandidate], standing: FittedModel) {
        let key = chosen.iter().map(|p| p.columns.clone()).collect();
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(0, (key, Arc::new(standing)));
    }

    /// Returns the RMS residual of this model on other recordings, joint by joint.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn unseen(
        &self,
        chosen: &[FittedCandidate],
        others: &PreparedData,
    ) -> Result<Vec<f64>, DiagnoseError> {
        self.context
            .unseen(others, self.of(chosen)?.fitted(), chosen)
    }

    fn fitted(&self, chosen: &[FittedCandidate]) -> Result<FittedModel, DiagnoseError> {
        let coefficients = self.refit.solution(chosen)?.values;
        if self.context.robot.joints.len() == 1 {
            return Ok(self.alone(&coefficients, chosen));
        }
        let DiagnosisContext { robot, anchor, .. } = self.context;
        let (free, gains) = coefficients.split_at(anchor.free.len());
        let values = anchor.values(free);
        let mut upright = values.clone();
        self.turned(chosen, gains, &mut upright);
        let ([values, described], gains, links) =
            self.embodied(&coefficients, [values, upright], chosen);
        let gravity = self.turned(chosen, &gains, &mut values.clone());
        let (model, remarks) = completed(links, robot, gravity, &with_gains(chosen, &gains));
        Ok(FittedModel {
            values,
            described,
            gains,
            model,
            remarks,
        })
    }

    /// Builds the model of one joint from coefficients of free directions and effects' columns.
    pub(crate) fn alone(&self, coefficients: &[f64], chosen: &[FittedCandidate]) -> FittedModel {
        let DiagnosisContext {
            robot,
            nominal,
            anchor,
            ..
        } = self.context;
        let (free, gains) = coefficients.split_at(anchor.free.len());
        let values = anchor.values(free);
        let mut upright = values.clone();
        let gravity = self.turned(chosen, gains, &mut upright);
        let links = redistributed_over(robot, nominal, &upright);
        let (model, remarks) = completed(links, robot, gravity, &with_gains(chosen, gains));
        FittedModel {
            described: values.clone(),
            values,
            gains: gains.to_vec(),
            model,
            remarks,
        }
    }

    /// Returns gravity turned by the effects, and adapts `values` to it.
    fn turned(&self, chosen: &[FittedCandidate], gains: &[f64], values: &mut [f64]) -> [f64; 3] {
        let effects = with_gains(chosen, gains);
        let DiagnosisContext { robot, nominal, .. } = self.context;
        gravity_with(robot, nominal, self.formed_at, &effects, values)
    }

    /// Fits the nearest bodies to the base parameters of a free fit, and refits the gains.
    fn embodied(
        &self,
        coefficients: &[f64],
        [values, upright]: [Vec<f64>; 2],
        chosen: &[FittedCandidate],
    ) -> Linked {
        let DiagnosisContext { robot, nominal, .. } = self.context;
        let effects: Vec<(&Column, bool)> = (chosen.iter())
            .flat_map(|p| p.columns.iter().map(|c| (c, p.followed.is_none())))
            .collect();
        let fitted: Vec<&Column> = (effects.iter())
            .filter(|(_, fitted)| *fitted)
            .map(|(column, _)| *column)
            .collect();
        let (fit, mut information) = measure(self.refit, chosen, &fitted);
        // Ratio of the moments in the form of columns to those of the description.
        let taken: Vec<f64> = (values.iter().zip(&upright))
            .map(|(as_taken, value)| if *value == 0.0 { 1.0 } else { as_taken / value })
            .collect();
        for (k, mut row) in information.row_iter_mut().enumerate() {
            row *= taken[k];
        }
        for (k, mut column) in information.column_iter_mut().enumerate() {
            column *= taken[k];
        }
        let base = Combinations {
            combination: &nominal.base.combination,
            columns: &nominal.base.columns,
            values: &upright,
        };
        let mut gains = coefficients[self.refit.free.len()..].to_vec();
        let bodies = match as_bodies(robot, &base, information, sizes(self.runs)) {
            Ok(bodies) => bodies,
            Err(error) => {
                let (model, mut remarks) = redistributed_over(robot, nominal, &upright);
                remarks.push(ModelRemark::NoBodies {
                    error: error.to_string(),
                });
                return ([values, upright], gains, (model, remarks));
            }
        };
        // Torque change caused by the bodies, and the part that effects compensate.
        let n = robot.joints.len();
        let free = (self.refit.free.iter()).chain(effects.iter().map(|(c, _)| *c));
        let mut rest = fit;
        rest.subtract(&combined(n, free.zip(coefficients.iter().copied())));
        let before: Vec<f64> = (0..n).map(|j| rest.rms(j)).collect();
        let near: Vec<f64> = (bodies.values.iter().zip(&taken))
            .map(|(v, t)| v * t)
            .collect();
        let moved = near.iter().zip(&values).map(|(b, f)| b - f);
        let nominal = rest.rows().nominal.iter().zip(moved);
        rest.subtract(&combined(n, nominal));
        refit_gains(&mut rest, chosen, &mut gains);
        let mut remarks = of_identification(bodies.remarks);
        let more = (0..n).map(|j| (j, rest.rms(j) / before[j].max(f64::MIN_POSITIVE) - 1.0));
        let most = more.max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((j, share)) = most.filter(|(_, share)| *share > SAID) {
            remarks.push(ModelRemark::CostOfBodies {
                joint: j,
                percent: 100.0 * share,
            });
        }
        ([near, bodies.values], gains, (bodies.robot, remarks))
    }
}

/// Returns the data scaled by residual RMS, and the information on the base parameters beside `fitted` columns.
fn measure<'r>(
    refit: &Refit<'r>,
    chosen: &[FittedCandidate],
    fitted: &[&Column],
) -> (Fit<'r>, DMatrix<f64>) {
    let left = with(refit.footing(chosen)[1], chosen, None);
    let rows = left.rows();
    let joints = 0..rows.joints();
    let residuals: Vec<Vec<f64>> = joints.clone().map(|j| left.residual(j)).collect();
    let memory = noise_floor::memory(rows, &residuals);
    let scale = joints.map(|j| 1.0 / left.rms(j).max(f64::MIN_POSITIVE));
    let fit = Fit::new(rows, scale.collect(), memory);
    let beside = fit.clone().taking(fitted.iter().copied());
    let columns: Vec<Vec<f64>> = (rows.nominal.iter())
        .map(|column| beside.projected(fit.weighted(column)))
        .collect();
    let rows_in_one = (memory / rows.period).max(1.0);
    let mut information = DMatrix::zeros(columns.len(), columns.len());
    for a in 0..columns.len() {
        for b in 0..=a {
            information[(a, b)] = dot(&columns[a], &columns[b]) / rows_in_one;
            information[(b, a)] = information[(a, b)];
        }
    }
    (fit, information)
}

/// Refits the effects' `gains` to what is left beside them, `rest`, and subtracts the change of their torque.
fn refit_gains(rest: &mut Fit, chosen: &[FittedCandidate], gains: &mut [f64]) {
    let joints = rest.rows().joints();
    let (mut columns, mut bounded, mut places) = (Vec::new(), Vec::new(), Vec::new());
    let mut at = 0;
    for profile in chosen {
        if profile.followed.is_none() {
            columns.extend(profile.columns.iter());
            bounded.extend((0..profile.columns.len()).map(|gain| profile.may_be_zero(gain)));
            places.extend(at..at + profile.columns.len());
        }
        at += profile.columns.len();
    }
    if columns.is_empty() {
        return;
    }
    let torque = |gains: &[f64], sign: f64| {
        let own = columns.iter().copied().zip(&places);
        combined(
            joints,
            own.map(|(column, place)| (column, sign * gains[*place])),
        )
    };
    rest.subtract(&torque(gains, -1.0));
    if let Some(solution) = solve(rest, &columns, &bounded) {
        for (place, value) in places.iter().zip(&solution.values) {
            gains[*place] = *value;
        }
    }
    rest.subtract(&torque(gains, 1.0));
}

/// Returns the RMS torque, speed and acceleration of the joints.
fn sizes(runs: &[Run]) -> Sizes {
    let joints = 0..runs.first().map_or(0, |run| run.joints.len());
    let rms = |of: fn(&JointRun) -> &[f64]| -> Vec<f64> {
        (joints.clone())
            .map(|j| {
                let (mut sum, mut count) = (0.0, 0.0);
                for x in runs.iter().flat_map(|run| of(&run.joints[j])) {
                    sum += x * x;
                    count += 1.0;
                }
                f64::sqrt(sum / f64::max(count, 1.0))
            })
            .collect()
    };
    Sizes {
        torque: rms(|joint| &joint.tau),
        speed: rms(|joint| &joint.qd),
        acceleration: rms(|joint| &joint.qdd),
    }
}
