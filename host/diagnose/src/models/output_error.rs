//! Refit of all parameters of one joint to the simulated motion: closed-loop output error of the positions (Gautier,
//! Janot and Vandanjon 2013), by Gauss-Newton.
//!
//! With a correct model, torque and motion give the same values. Position noise is in the torque's regressors but in no
//! simulated motion. Effects that the controller suppresses are in no motion, so it identifies waves less well. The
//! torque's values stay unless the motion improves significantly and the torque is no worse away from dwells and
//! reversals. Near these a simulated joint sticks and turns back at its own time, and filters blur the torque.
//!
//! Leaves out: robots of several joints; gears, whose link is observed from the torque; whole numbers.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::DiagnoseError;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_gear;
use crate::fit::refit::{Joint, named, wald};
use crate::levels::NOTHING;
use crate::models::bodies::{FittedModel, ModelCache};
use crate::models::simulated_motion::{Errors, Replay};
use crate::outcome::{ByMotion, Twice};
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::batch::each_by;
use rig_numerics::optimise::gauss_newton::{Settings, gauss_newton};
use rig_numerics::statistics;

/// Settings of the refit.
const SETTINGS: Settings = Settings {
    passes: 4,
    settled: 0.5,
    damped: 5,
};
/// Relative increase of the torque RMS up to which the motion's values are adopted …
const TORQUE_WORSE: f64 = 0.005;
/// … and share of the motion's RMS below which `BLURRED` replaces it, to allow for the filters' blur.
const FAR_BETTER: f64 = 0.5;
const BLURRED: f64 = 0.05;
/// Standard deviations above which two values of a parameter are reported as different.
pub(crate) const APART: f64 = 4.0;

/// Fitted values: coefficients of nominal directions and effects' columns, then shapes.
struct Values {
    coefficients: usize,
    /// Effect and place of each shape.
    shapes: Vec<(usize, usize)>,
}

/// Fitted values with their standard deviations.
struct Estimate {
    values: Vec<f64>,
    stds: Vec<f64>,
}

impl Values {
    /// Returns the fitted values, and their estimate by torque. None if one of them is not identifiable.
    fn by_torque(joint: &Joint, chosen: &[FittedCandidate]) -> Option<(Self, Estimate)> {
        let coefficients = joint.solution.values.len();
        let known = joint.shapes(chosen);
        let by_torque: Vec<[f64; 2]> = (0..coefficients)
            .map(|k| [joint.solution.values[k], joint.solution.std(k)])
            .chain(known.iter().map(|(_, value)| *value))
            .collect();
        let stds: Vec<f64> = by_torque.iter().map(|[_, std]| *std).collect();
        if stds.iter().any(|std| !(std.is_finite() && *std > 0.0)) {
            return None;
        }
        let values = Self {
            coefficients,
            shapes: known.iter().map(|(place, _)| *place).collect(),
        };
        let start = by_torque.iter().map(|[value, _]| *value).collect();
        Some((
            values,
            Estimate {
                values: start,
                stds,
            },
        ))
    }

    /// Returns the effects with the shapes among `values`.
    fn effects(&self, chosen: &[FittedCandidate], values: &[f64]) -> Vec<FittedCandidate> {
        let mut effects = chosen.to_vec();
        for ((k, place), value) in self.shapes.iter().zip(&values[self.coefficients..]) {
            effects[*k].shapes[*place] = *value;
        }
        effects
    }

    /// Returns true if the values are within their physical bounds.
    fn possible(&self, chosen: &[FittedCandidate], free: usize, values: &[f64]) -> bool {
        let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
        let mut gains = values[free..self.coefficients].iter();
        let gains_can = chosen.iter().all(|p| {
            let bounds = p.candidate.kind.about().gains.iter();
            let own = gains.by_ref().take(p.columns.len());
            own.zip(bounds).all(|(g, about)| within(*g, about.bounds))
        });
        let mut shapes = self.shapes.iter().zip(&values[self.coefficients..]);
        gains_can
            && shapes.all(|((k, place), value)| {
                within(
                    *value,
                    chosen[*k].candidate.kind.about().shapes[*place].bounds,
                )
            })
    }
}

/// Result of the refit.
pub(crate) struct Again {
    /// Entry of the result, still without its text.
    pub(crate) told: ByMotion,
    /// Model and effects to adopt, if any.
    pub(crate) adopted: Option<(FittedModel, Vec<FittedCandidate>)>,
    /// p-values of each effect's gains being zero by the motion (Wald 1943); `None` if the motion is too short to say.
    of_nothing: Vec<Option<f64>>,
}

impl Again {
    /// Returns the effect from `first` on whose adopted gains are most likely zero; `None` if no 95 % region contains it.
    pub(crate) fn most_likely_nothing(&self, first: usize) -> Option<usize> {
        self.adopted.as_ref()?;
        most_likely_zero(&self.of_nothing, first)
    }
}

/// Returns the index, from `first` on, of the largest p-value above the level of [`NOTHING`].
fn most_likely_zero(p_values: &[Option<f64>], first: usize) -> Option<usize> {
    (p_values.iter().enumerate().skip(first))
        .filter_map(|(k, p)| p.filter(|p| *p > NOTHING).map(|p| (k, p)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(k, _)| k)
}

/// Fits `joint`'s values of the effects `chosen` to the simulated training motion; `None` if that is not possible.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn by_motion(
    fitting: &ModelCache,
    replay: &Replay,
    source: &Source,
    chosen: &[FittedCandidate],
    joint: &Joint,
    threads: usize,
) -> Result<Option<Again>, DiagnoseError> {
    let context = fitting.context;
    let free = context.anchor.free.len();
    if context.robot.joints.len() > 1 || chosen.iter().any(|p| is_gear(p.candidate.kind)) {
        return Ok(None);
    }
    let Some((values, by_torque)) = Values::by_torque(joint, chosen) else {
        return Ok(None);
    };
    let model = |theta: &[f64]| {
        let effects = values.effects(chosen, theta);
        fitting.alone(&theta[..values.coefficients], &effects)
    };
    let departs = |theta: &[f64]| {
        (values.possible(chosen, free, theta))
            .then(|| replay.departures(&model(theta).model))
            .flatten()
    };
    let Some(first) = departs(&by_torque.values) else {
        return Ok(None);
    };
    let (start, stds) = (by_torque.values.clone(), &by_torque.stds);
    let each =
        |n: usize, slope: &(dyn Fn(usize) -> Option<Vec<f64>> + Sync)| each_by(n, threads, slope);
    let Some((nearest, covariance)) = gauss_newton(start, stds, first, &departs, each, SETTINGS)
    else {
        return Ok(None);
    };
    let by_motion = Estimate {
        stds: covariance.diagonal().iter().map(|v| v.sqrt()).collect(),
        values: nearest,
    };
    let standing = model(&by_motion.values);
    let effects = (values.effects(chosen, &by_motion.values).into_iter())
        .map(|p| {
            let columns = source.columns_by(threads, &p.candidate, &p.shapes)?;
            let columns = Arc::new(columns);
            Ok(FittedCandidate { columns, ..p })
        })
        .collect::<Result<Vec<_>, DiagnoseError>>()?;
    let before = model(&by_torque.values);
    let (Some(was), Some(is)) = (
        replay.errors_of(&before.model),
        replay.errors_of(&standing.model),
    ) else {
        return Ok(None);
    };
    let [all_was, clear_was] = torque_left(fitting, replay, &before, chosen)?;
    let [all_is, clear_is] = torque_left(fitting, replay, &standing, &effects)?;
    let adopted = is_better([&was, &is], [clear_was, clear_is]);
    let unit = context.robot.joints[0].kind.units();
    let told = ByMotion {
        unit: unit.0.to_owned(),
        motion_rms: [was.rms(0), is.rms(0)],
        torque_unit: unit.1.to_owned(),
        torque_rms: [all_was, all_is],
        adopted,
        parameters: named(context, source, chosen, &values.shapes)
            .into_iter()
            .enumerate()
            .map(|(k, name)| twice(name, [&by_torque, &by_motion], k))
            .collect(),
        text: String::new(),
    };
    let of_nothing = of_nothing(chosen, free, &by_motion, &covariance);
    Ok(Some(Again {
        told,
        of_nothing,
        adopted: adopted.then_some((standing, effects)),
    }))
}

/// Returns the RMS of the training torque's residual: over all rows, and away from rests and reversals.
fn torque_left(
    fitting: &ModelCache,
    replay: &Replay,
    model: &FittedModel,
    effects: &[FittedCandidate],
) -> Result<[f64; 2], DiagnoseError> {
    let residual = (fitting.context).remaining(replay.judged, model.fitted(), effects)?;
    let rows = &replay.judged.rows;
    let away = rows.away(0);
    let all = statistics::rms_of_kept(&residual[0], &rows.keep[0]);
    let clear = match away.contains(&true) {
        true => statistics::rms_of_kept(&residual[0], &away),
        false => all,
    };
    Ok([all, clear])
}

/// Returns true if the motion improves significantly and the torque is hardly worse. `clear` is the torque's RMS away
/// from rests and reversals. Both are before and after.
fn is_better([was, is]: [&Errors; 2], clear: [f64; 2]) -> bool {
    let worse = match is.rms(0) < FAR_BETTER * was.rms(0) {
        true => BLURRED,
        false => TORQUE_WORSE,
    };
    was.worse_than(is, 0) && clear[1] <= (1.0 + worse) * clear[0]
}

/// Returns the p-value of each effect's gains being zero by the motion. The gains follow the `free` nominal directions.
fn of_nothing(
    chosen: &[FittedCandidate],
    free: usize,
    by_motion: &Estimate,
    covariance: &DMatrix<f64>,
) -> Vec<Option<f64>> {
    let mut at = free;
    (chosen.iter())
        .map(|p| {
            let own = at..at + p.columns.len();
            at = own.end;
            wald(&by_motion.values[own.clone()], covariance, own.start)
        })
        .collect()
}

/// Returns the `k`-th parameter by torque and by motion, for the report. `name` is its name, unit and display factor.
fn twice(
    (parameter, unit, scale): (String, String, f64),
    [torque, motion]: [&Estimate; 2],
    k: usize,
) -> Twice {
    Twice {
        parameter,
        unit,
        torque: scale * torque.values[k],
        torque_std: scale * torque.stds[k],
        motion: scale * motion.values[k],
        motion_std: scale * motion.stds[k],
        sigmas: (motion.values[k] - torque.values[k]).abs() / torque.stds[k].hypot(motion.stds[k]),
    }
}

#[cfg(test)]
mod tests;
