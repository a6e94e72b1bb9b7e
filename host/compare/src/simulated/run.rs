//! One robot: motions, recordings, four identifications, and their comparison.

use nalgebra::{DMatrix, DVector};
use rig_data::prepare::{Choice, InMemory, PrepareOptions};
use rig_identify::{
    Base, Estimator, Identification, ModelKind, Options, TriangularFactor, described, identify,
};
use rig_model::robot::{JointKind, Robot};

use super::online::{Online, PLACES, online};
use super::options::SimulateOptions;
use super::prepared::prepare;
use super::recorded::{POSITION_NOISE, TORQUE_NOISE, recorded};
use super::result::{
    Holdout, SimulatedEstimate, SimulatedRobot, SimulatedValue, SimulationError, TrueParameter,
};
use crate::rows::each_row;

/// Seed of the hold-out motion, less that of the training motion.
const HOLDOUT_SEED: u64 = 1000;
/// Window of the integral model of several joints, as periods of the cut-off of the position. The noise of the velocity enters
/// a window by its two ends, so a longer window has less of it: at two thirds of a period 93 % of the off-line intervals of the
/// IRp-6 held the truth (seeds 1 to 9).
const WINDOW: f64 = 1.0;

/// Simulates `robot` on a designed motion and on another one as hold-out, identifies it off-line and on-line by both
/// models, and compares all with the description, which is the truth here. `progress` receives the finished share.
///
/// # Errors
/// [`SimulationError`].
pub fn simulated(
    robot: &Robot,
    options: &SimulateOptions,
    mut progress: impl FnMut(f64),
) -> Result<SimulatedRobot, SimulationError> {
    let base = Base::structural(robot, ModelKind::Differential, 1)?;
    refuse_too_many(robot, &base)?;
    let training = recorded(robot, options, options.seed, "training", &mut |share| {
        progress(0.4 * share);
    })?;
    let other = options.seed + HOLDOUT_SEED;
    let holdout = recorded(robot, options, other, "hold-out", &mut |share| {
        progress(0.4 + 0.4 * share);
    })?;
    let prepare = prepare(robot, &training)?;
    let found = [ModelKind::Differential, ModelKind::Integral].map(|model| {
        offline(
            robot,
            &training.recording,
            &holdout.recording,
            &prepare,
            model,
        )
    });
    let [differential, integral] = found;
    let (differential, integral) = (differential?, integral?);
    progress(0.9);
    let truth = described(robot, base.combination.ncols());
    let judge = Judge {
        base: &base,
        truth: &base.combination * &truth,
        training: factors(robot, &base, &training.recording, &differential)?,
        holdout: factors(robot, &base, &holdout.recording, &differential)?,
    };
    let mut notes = vec![format!(
        "Simulated noise: {} % of each joint's RMS torque, and {POSITION_NOISE} rad or m on the position; the position is then rounded to the encoder's counts.",
        100.0 * TORQUE_NOISE
    )];
    notes.extend(training.notes);
    let mut estimates = Vec::new();
    let mut bases = Vec::new();
    for found in [&differential, &integral] {
        let values = full(&base, found);
        estimates.push(judge.offline(found, &truth, &values));
        bases.push(values);
    }
    for found in [&differential, &integral] {
        let run = online(robot, &base, &training.recording, found)?;
        let (estimate, values) = judge.online(found.model, &run);
        estimates.push(estimate);
        bases.push(values);
    }
    progress(1.0);
    Ok(SimulatedRobot {
        schema: "rig-compare-simulated/1",
        robot: robot.name.clone(),
        seed: options.seed,
        seconds: training.seconds,
        rate: options.rate,
        cutoff: differential.details.treatment.cutoff,
        rows_per_second: differential.details.treatment.kept_rate(),
        window: integral.details.window.as_ref().map_or(0.0, |w| w.0),
        min_speed: differential.details.treatment.speed_threshold[..].to_vec(),
        condition_number: training.condition_number,
        parameters: true_parameters(&base, &judge),
        holdout: judge.joints(robot, &differential, &bases),
        estimates,
        notes,
    })
}

/// Refuses more parameters than the on-line estimator has places for.
fn refuse_too_many(robot: &Robot, base: &Base) -> Result<(), SimulationError> {
    if base.len() <= PLACES {
        return Ok(());
    }
    Err(SimulationError::TooManyParameters {
        robot: robot.name.clone(),
        parameters: base.len(),
        most: PLACES,
    })
}

/// Returns the parameters of the description.
fn true_parameters(base: &Base, judge: &Judge) -> Vec<TrueParameter> {
    let of = |k: usize| TrueParameter {
        expression: base.expression(k),
        unit: base.unit(k).to_owned(),
        truth: judge.truth[k],
    };
    (0..base.len()).map(of).collect()
}

/// Identifies the recording off-line.
fn offline(
    robot: &Robot,
    training: &InMemory,
    holdout: &InMemory,
    prepare: &PrepareOptions,
    model: ModelKind,
) -> Result<Identification, rig_identify::IdentifyError> {
    let several = robot.joints.len() > 1;
    let window = match (model, prepare.cutoff) {
        (ModelKind::Integral, Choice::Fixed(cutoff)) if several => Some(WINDOW / cutoff),
        _ => None,
    };
    let options = Options {
        model,
        estimator: Estimator::Weighted,
        prepare: prepare.clone(),
        window,
        ..Options::default()
    };
    identify(robot, &[training], &[holdout], &options)
}

/// Returns one factor a joint of the rows of a recording.
fn factors(
    robot: &Robot,
    base: &Base,
    recording: &InMemory,
    found: &Identification,
) -> Result<Vec<TriangularFactor>, rig_identify::IdentifyError> {
    let p = base.len();
    let mut all = vec![TriangularFactor::new(p); robot.joints.len()];
    let differential = ModelKind::Differential;
    each_row(
        robot,
        base,
        &[recording],
        found,
        differential,
        &mut |_, rows| {
            for (factor, equation) in all.iter_mut().zip(&rows.equations) {
                for k in (0..rows.t.len()).filter(|&k| equation.keep[k]) {
                    factor.push(&equation.x[k * p..(k + 1) * p], equation.y[k], 1.0);
                }
            }
        },
    )?;
    Ok(all)
}

fn name(model: ModelKind) -> &'static str {
    match model {
        ModelKind::Differential => "differential",
        ModelKind::Integral => "integral",
    }
}

/// Returns the values of all base parameters; zero for those that the motion does not show.
fn full(base: &Base, found: &Identification) -> DVector<f64> {
    let mut values = DVector::zeros(base.len());
    for (c, value) in (found.details.columns.iter()).zip(&found.details.estimate.values) {
        if let Some(k) = base.columns.iter().position(|b| b == c) {
            values[k] = *value;
        }
    }
    values
}

/// What the estimates are judged by.
struct Judge<'a> {
    base: &'a Base,
    truth: DVector<f64>,
    training: Vec<TriangularFactor>,
    holdout: Vec<TriangularFactor>,
}

impl Judge<'_> {
    fn offline(
        &self,
        found: &Identification,
        standard: &DVector<f64>,
        values: &DVector<f64>,
    ) -> SimulatedEstimate {
        let details = &found.details;
        let truth = &details.combination * standard;
        let own = |k: usize| {
            let i = details
                .columns
                .iter()
                .position(|c| *c == self.base.columns[k])?;
            Some(SimulatedValue {
                value: details.estimate.values[i],
                std: Some(details.estimate.std[i]),
                covers: Some(details.estimate.covers(i, truth[i])),
            })
        };
        SimulatedEstimate {
            way: "off-line",
            model: name(found.model),
            values: (0..self.base.len()).map(own).collect(),
            convergence: [Vec::new(), Vec::new()],
            torque_error: self.torque_error(values),
        }
    }

    fn online(&self, model: ModelKind, run: &Online) -> (SimulatedEstimate, DVector<f64>) {
        let last = run.values.last().cloned().unwrap_or_default();
        let values = DVector::from_vec(last);
        // Many residuals: the normal quantile.
        let quantile = 1.96;
        let own = |k: usize| {
            let std = run.std[k];
            Some(SimulatedValue {
                value: values[k],
                std,
                covers: std.map(|std| (values[k] - self.truth[k]).abs() <= quantile * std),
            })
        };
        let errors = (run.values.iter())
            .map(|v| self.torque_error(&DVector::from_column_slice(v)))
            .collect();
        let estimate = SimulatedEstimate {
            way: "on-line",
            model: name(model),
            values: (0..self.base.len()).map(own).collect(),
            convergence: [run.t.clone(), errors],
            torque_error: self.torque_error(&values),
        };
        (estimate, values)
    }

    /// Returns the RMS torque error of parameters on the training motion, as a share of the torque, over all joints.
    fn torque_error(&self, values: &DVector<f64>) -> f64 {
        let off = values - &self.truth;
        let shares = self.training.iter().map(|factor| {
            let (r, _): (DMatrix<f64>, _) = factor.system();
            (r * &off).norm_squared() / factor.right_side_squares().max(f64::MIN_POSITIVE)
        });
        let list: Vec<f64> = shares.collect();
        (list.iter().sum::<f64>() / list.len().max(1) as f64).sqrt()
    }

    /// Returns the joints on the hold-out with the residuals of all estimates.
    fn joints(
        &self,
        robot: &Robot,
        found: &Identification,
        estimates: &[DVector<f64>],
    ) -> Vec<Holdout> {
        let series = found
            .details
            .holdout_residuals
            .as_deref()
            .unwrap_or_default();
        (robot.joints.iter().zip(&self.holdout).enumerate())
            .map(|(j, (joint, factor))| {
                let all = factor.right_side_squares().max(f64::MIN_POSITIVE);
                let share = |x: &DVector<f64>| (factor.residual_squares(x.as_slice()) / all).sqrt();
                let curves = series.get(j).map(|r| r.series.clone()).unwrap_or_default();
                Holdout {
                    joint: joint.name.clone(),
                    unit: match joint.kind {
                        JointKind::Revolute => "N·m",
                        JointKind::Prismatic => "N",
                    },
                    used: curves.used.iter().filter(|used| **used).count() as f64
                        / curves.used.len().max(1) as f64,
                    torque_rms: (all / factor.rows().max(1) as f64).sqrt(),
                    relative_error: estimates.iter().map(share).collect(),
                    relative_error_of_truth: share(&self.truth),
                    series: [curves.t, curves.measured, curves.predicted],
                }
            })
            .collect()
    }
}
