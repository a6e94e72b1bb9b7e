//! The way from recordings to an [`Identification`].

use nalgebra::{DMatrix, DVector};

use super::base::{Base, Independent, chain_of, column_name, expression, independent_columns, preference};
use super::covariance::{Estimate, Groups, Memory, t_quantile};
use super::factor::TriangularFactor;
use super::model::{Plan, Tally, each_rows};
use super::residual::{Ranges, ResidualReport, ResidualStream};
use super::{
    BaseParameter, Details, Estimator, Identification, IdentifyError, JointFigures, ModelKind,
    NotExcited, Options,
};
use crate::prepare::{Recording, Survey, Treatment};
use crate::robot::{JointKind, Robot};
use rig_shared::multibody::{COLUMNS, column};

/// A base parameter counts as not excited when its column, scaled to length one, differs from a combination of
/// the others by less than this: its value would rest on a thousandth of the torque, which is the order of
/// what filters and sensors distort.
const EXCITED: f64 = 1e-3;

/// Reweighting stops when no parameter moves by more than this share of its standard deviation …
const SETTLED: f64 = 1e-3;
/// … or after this many passes (Huber's iteration converges linearly; twenty have always sufficed).
const MOST_PASSES: usize = 30;

/// Identifies `robot` from `training` and checks the result on `holdout`.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be used, a motion that excites nothing, a singular problem.
pub fn identify(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let chain = chain_of(robot)?;
    let joints = robot.joints.len();
    let base = Base::structural(robot, options.model, options.seed)?;
    let survey = |list: &[&dyn Recording]| {
        list.iter()
            .map(|r| Survey::take(*r, joints))
            .collect::<Result<Vec<_>, _>>()
    };
    let surveys = survey(training)?;
    if surveys.is_empty() {
        return Err(IdentifyError::NoRecording);
    }
    let holdout_surveys = survey(holdout)?;
    if let Some(j) = (0..joints).find(|&j| surveys.iter().all(|s| s.joints[j].torque_rms == 0.0)) {
        return Err(IdentifyError::NoTorque { joint: j + 1 });
    }
    let limits: Vec<Option<f64>> = robot
        .joints
        .iter()
        .map(|j| j.limits.as_ref().and_then(|l| l.torque))
        .collect();
    let treatment = Treatment::decide(&surveys, &options.prepare, &limits)?;
    for s in &holdout_surveys {
        treatment.admits(s)?;
    }
    let (window, window_reason) = choose_window(options, &treatment, &surveys)?;
    let plan = Plan {
        chain: &chain,
        columns: &base.columns,
        treatment: &treatment,
        window,
        stride: (window / 4).max(1),
        loudness: (0..joints)
            .map(|j| surveys.iter().map(|s| s.joints[j].torque_rms).fold(0.0, f64::max))
            .collect(),
    };
    let p = base.len();

    // First fit: everything into one factor an equation.
    let equations = match options.model {
        ModelKind::Differential => joints,
        ModelKind::Integral => 1,
    };
    let mut factors = vec![TriangularFactor::new(p); equations];
    let mut instants = 0u64;
    let mut tally = Tally::default();
    for recording in training {
        let part = each_rows(*recording, &plan, options.model, &mut |rows| {
            for (factor, equation) in factors.iter_mut().zip(&rows.equations) {
                for (i, keep) in equation.keep.iter().enumerate() {
                    if *keep {
                        factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], 1.0);
                    }
                }
            }
            instants += rows.t.len() as u64;
            Ok(())
        })?;
        add(&mut tally, &part);
    }
    if tally.used < 2 * p as u64 {
        return Err(IdentifyError::NothingLeft {
            used: tally.used,
            unknown: p,
            slow: tally.slow.iter().sum(),
            saturated: tally.saturated.iter().sum(),
        });
    }
    let combine = |weights: &[f64]| {
        let mut all = TriangularFactor::new(p);
        for (factor, weight) in factors.iter().zip(weights) {
            all.merge(factor, *weight);
        }
        all
    };
    // Joints of different strength must not hide one another when excitation is judged.
    let by_torque: Vec<f64> = factors
        .iter()
        .map(|f| {
            let rms = (f.right_side_squares() / f.rows().max(1) as f64).sqrt();
            if rms > 0.0 { 1.0 / rms } else { 1.0 }
        })
        .collect();
    let order = data_order(&base);
    let (excitation, _) = combine(&by_torque).system();
    let data = independent_columns(&excitation, &order, EXCITED);

    let mut weights = vec![1.0; equations];
    let mut beta = least_squares(&combine(&weights), &data, &base)?;
    if options.estimator != Estimator::Ols {
        let full = spread(&beta, &data.kept, p);
        for (weight, factor) in weights.iter_mut().zip(&factors) {
            let freedom = factor.rows().saturating_sub(p as u64 / equations as u64).max(1);
            let sigma = (factor.residual_squares(&full) / freedom as f64).sqrt();
            *weight = if sigma > 0.0 { 1.0 / sigma } else { 1.0 };
        }
        beta = least_squares(&combine(&weights), &data, &base)?;
    }
    let mut factor = combine(&weights);
    let mut scales = None;
    let mut passes = 0;
    let mut converged = true;
    if options.estimator == Estimator::Robust {
        let mut scale = spread_of(training, &plan, options, &spread(&beta, &data.kept, p), equations)?;
        converged = false;
        while passes < MOST_PASSES && !converged {
            let (next_factor, next_scale) = reweighted(
                training,
                &plan,
                options,
                &spread(&beta, &data.kept, p),
                &weights,
                &scale,
            )?;
            let next = least_squares(&next_factor, &data, &base)?;
            let (std, _) = classical(&next_factor, &data, &next)?;
            converged = next
                .iter()
                .zip(&beta)
                .zip(&std)
                .all(|((a, b), s)| (a - b).abs() <= SETTLED * s);
            (beta, factor, scale) = (next, next_factor, next_scale);
            passes += 1;
        }
        scales = Some(scale);
    }

    // Second look: residuals of the fitted equations, for the covariance.
    let full = spread(&beta, &data.kept, p);
    let loss = scales.as_ref().map(|s| (options.loss, s.as_slice()));
    let estimate = covariance(training, &plan, options, &factor, &data, &beta, &weights, loss, instants)?;
    let residuals = |recordings: &[&dyn Recording], surveys: &[Survey]| {
        torque_residuals(recordings, surveys, &plan, &full)
    };
    let train = residuals(training, &surveys)?;
    let holdout_residuals = if holdout.is_empty() {
        None
    } else {
        Some(residuals(holdout, &holdout_surveys)?)
    };

    let combination = &data.combination * &base.combination;
    let columns: Vec<usize> = data.kept.iter().map(|&k| base.columns[k]).collect();
    let base_parameters = (0..columns.len())
        .map(|k| BaseParameter {
            expression: expression(&combination, k, columns[k]),
            value: estimate.values[k],
            std: estimate.std[k],
            relative_std_percent: 100.0 * estimate.std[k] / estimate.values[k].abs(),
            unit: super::unit(columns[k], &base.kinds).to_owned(),
            interval: estimate.interval[k],
            classical_relative_std_percent: 100.0 * estimate.classical_std[k] / estimate.values[k].abs(),
        })
        .collect();
    let not_excited = not_excited(&base, &data, &base.kinds);
    let mut warnings = Vec::new();
    if !converged {
        warnings.push(format!("The robust fit had not settled after {MOST_PASSES} passes; its values may still move."));
    }
    if estimate.scaled_condition > 100.0 {
        warnings.push(format!(
            "The condition number of the scaled regressor is {:.0}: the motion tells some parameters apart badly; look at their intervals.",
            estimate.scaled_condition
        ));
    }
    for (j, report) in train.iter().enumerate() {
        let name = &robot.joints[j].name;
        if report.relative_error > 0.3 {
            warnings.push(format!(
                "Joint {name}: the model leaves {:.0} % of the torque unexplained on the data it was fitted to.",
                100.0 * report.relative_error
            ));
        }
        if let Some(held) = holdout_residuals.as_ref().map(|h: &Vec<ResidualReport>| &h[j])
            && held.rms > 1.5 * report.rms
        {
            warnings.push(format!(
                "Joint {name}: the residual on the hold-out ({:.4}) is {:.1} times that on the training data.",
                held.rms,
                held.rms / report.rms
            ));
        }
    }
    if !robot.effects.is_empty() {
        warnings.push("The description's effects beyond the standard model are not part of this fit.".into());
    }
    Ok(Identification {
        schema: "rig-identification/1".into(),
        robot: robot.name.clone(),
        model: options.model,
        estimator: options.estimator,
        rank: columns.len(),
        condition_number: estimate.condition,
        base_parameters,
        joints: robot
            .joints
            .iter()
            .enumerate()
            .map(|(j, joint)| JointFigures {
                name: joint.name.clone(),
                train_residual_rms: train[j].rms,
                holdout_residual_rms: holdout_residuals.as_ref().map(|h| h[j].rms),
                train_relative_error: train[j].relative_error,
                holdout_relative_error: holdout_residuals.as_ref().map(|h| h[j].relative_error),
            })
            .collect(),
        not_excited,
        warnings,
        details: Details {
            masked: tally.masked(options.model),
            training: surveys,
            holdout: holdout_surveys,
            estimate,
            combination,
            columns,
            train,
            holdout_residuals,
            window: (options.model == ModelKind::Integral)
                .then(|| (window as f64 * treatment.dt(), window_reason)),
            treatment,
        },
    })
}

fn add(total: &mut Tally, part: &Tally) {
    total.used += part.used;
    for (list, more) in [
        (&mut total.slow, &part.slow),
        (&mut total.saturated, &part.saturated),
    ] {
        list.resize(list.len().max(more.len()), 0);
        for (a, b) in list.iter_mut().zip(more) {
            *a += b;
        }
    }
}

/// A sixteenth of the period of the fastest motion: many samples, so that the work of noise averages out, yet
/// short enough that speeding up and slowing down fall into different windows. On EMPS, where friction is not
/// quite Coulomb and viscous, longer windows move the offset by up to 13 %, this one by about one.
fn choose_window(
    options: &Options,
    treatment: &Treatment,
    surveys: &[Survey],
) -> Result<(usize, String), IdentifyError> {
    let rate = treatment.sample_rate;
    let shortest = surveys.iter().map(|s| s.longest).min().unwrap_or(0) as f64 / rate;
    let (least, most) = (4.0 / rate, shortest / 20.0);
    let (seconds, reason) = match options.window {
        Some(seconds) => (seconds, format!("{seconds} s, as given.")),
        None => {
            let seconds = (0.0625 / treatment.motion_frequency).clamp(least, most.max(least));
            (
                seconds,
                format!(
                    "{seconds:.4} s, a sixteenth of the period of the fastest motion ({:.3} Hz); windows start every quarter of that.",
                    treatment.motion_frequency
                ),
            )
        }
    };
    if options.model == ModelKind::Integral && !(seconds >= least && seconds <= most) {
        return Err(IdentifyError::Window {
            window: seconds,
            least,
            most,
        });
    }
    Ok(((seconds * rate).round() as usize, reason))
}

/// Base columns in the order in which they are kept when the data cannot tell all of them apart.
fn data_order(base: &Base) -> Vec<usize> {
    let preferred = preference(&base.kinds);
    let rank = |c: usize| preferred.iter().position(|&x| x == c).unwrap_or(usize::MAX);
    let mut order: Vec<usize> = (0..base.len()).collect();
    order.sort_by_key(|&k| rank(base.columns[k]));
    order
}

fn spread(beta: &[f64], kept: &[usize], p: usize) -> Vec<f64> {
    let mut full = vec![0.0; p];
    for (value, &k) in beta.iter().zip(kept) {
        full[k] = *value;
    }
    full
}

fn kept_columns(factor: &TriangularFactor, data: &Independent) -> (DMatrix<f64>, DVector<f64>) {
    let (r, z) = factor.system();
    (r.select_columns(&data.kept), z)
}

/// Triangular R of the kept columns alone and their solution.
fn least_squares(factor: &TriangularFactor, data: &Independent, base: &Base) -> Result<Vec<f64>, IdentifyError> {
    let (a, z) = kept_columns(factor, data);
    let qr = a.clone().qr();
    let right = qr.q().transpose() * z;
    qr.r()
        .solve_upper_triangular(&right)
        .filter(|x| x.iter().all(|v| v.is_finite()))
        .map(|x| x.as_slice().to_vec())
        .ok_or_else(|| {
            let smallest = (0..a.ncols())
                .min_by(|&i, &j| a.column(i).norm().total_cmp(&a.column(j).norm()))
                .unwrap_or(0);
            IdentifyError::Singular {
                column: column_name(base.columns[data.kept[smallest]]),
            }
        })
}

/// Standard deviations of the textbook, σ²·(XᵀX)⁻¹, and the inverse of the triangular factor.
fn classical(factor: &TriangularFactor, data: &Independent, beta: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), IdentifyError> {
    let (a, _) = kept_columns(factor, data);
    let r = a.qr().r();
    let inverse = r.try_inverse().ok_or(IdentifyError::Singular {
        column: "unknown".into(),
    })?;
    let full = spread(beta, &data.kept, factor.columns());
    let freedom = factor.rows().saturating_sub(beta.len() as u64).max(1);
    let sigma = (factor.residual_squares(&full) / freedom as f64).sqrt();
    let std = (0..beta.len()).map(|k| sigma * inverse.row(k).norm()).collect();
    Ok((std, inverse))
}

/// Absolute residuals in logarithmic bins of 1 %: the median of any number of them in constant memory.
#[derive(Clone)]
struct Median {
    counts: Vec<u64>,
    total: u64,
}

impl Median {
    const LEAST: f64 = 1e-15;
    fn new() -> Self {
        Self {
            counts: vec![0; 7000],
            total: 0,
        }
    }
    fn push(&mut self, e: f64) {
        let bin = ((e.abs().max(Self::LEAST) / Self::LEAST).ln() / 0.01) as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += 1;
        self.total += 1;
    }
    /// Standard deviation by the median of absolute residuals, which outliers do not move.
    fn sigma(&self) -> f64 {
        let mut sum = 0;
        for (bin, count) in self.counts.iter().enumerate() {
            sum += count;
            if 2 * sum >= self.total {
                return 1.4826 * Self::LEAST * ((bin as f64 + 0.5) * 0.01).exp();
            }
        }
        0.0
    }
}

fn spread_of(
    training: &[&dyn Recording],
    plan: &Plan,
    options: &Options,
    full: &[f64],
    equations: usize,
) -> Result<Vec<f64>, IdentifyError> {
    let mut medians = vec![Median::new(); equations];
    let p = full.len();
    for recording in training {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for (median, equation) in medians.iter_mut().zip(&rows.equations) {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    median.push(equation.y[i] - product(&equation.x[i * p..(i + 1) * p], full));
                }
            }
            Ok(())
        })?;
    }
    Ok(medians.iter().map(Median::sigma).collect())
}

fn product(x: &[f64], beta: &[f64]) -> f64 {
    x.iter().zip(beta).map(|(x, b)| x * b).sum()
}

/// One pass of iteratively reweighted least squares, and the spread of the residuals it started from.
fn reweighted(
    training: &[&dyn Recording],
    plan: &Plan,
    options: &Options,
    full: &[f64],
    weights: &[f64],
    scale: &[f64],
) -> Result<(TriangularFactor, Vec<f64>), IdentifyError> {
    let p = full.len();
    let mut factor = TriangularFactor::new(p);
    let mut medians = vec![Median::new(); weights.len()];
    for recording in training {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for (k, equation) in rows.equations.iter().enumerate() {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    let x = &equation.x[i * p..(i + 1) * p];
                    let e = equation.y[i] - product(x, full);
                    medians[k].push(e);
                    let weight = options.loss.weight(e / scale[k].max(f64::MIN_POSITIVE));
                    factor.push(x, equation.y[i], weights[k] * weight.sqrt());
                }
            }
            Ok(())
        })?;
    }
    Ok((factor, medians.iter().map(Median::sigma).collect()))
}

fn covariance(
    training: &[&dyn Recording],
    plan: &Plan,
    options: &Options,
    factor: &TriangularFactor,
    data: &Independent,
    beta: &[f64],
    weights: &[f64],
    loss: Option<(super::Loss, &[f64])>,
    instants: u64,
) -> Result<Estimate, IdentifyError> {
    let (classical_std, inverse) = classical(factor, data, beta)?;
    let full = spread(beta, &data.kept, factor.columns());
    let (p, size) = (full.len(), beta.len());
    let mut groups = Groups::new(size, instants);
    let mut memories = vec![Memory::default(); weights.len()];
    let mut index = 0u64;
    let whiten = inverse.transpose();
    let mut x_kept = DVector::zeros(size);
    let mut z = DVector::zeros(size);
    for recording in training {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for i in 0..rows.t.len() {
                for (k, equation) in rows.equations.iter().enumerate() {
                    if !equation.keep[i] {
                        continue;
                    }
                    let x = &equation.x[i * p..(i + 1) * p];
                    let e = equation.y[i] - product(x, &full);
                    memories[k].push(e);
                    let mut weight = weights[k];
                    if let Some((loss, scale)) = loss {
                        weight *= loss.weight(e / scale[k].max(f64::MIN_POSITIVE)).sqrt();
                    }
                    for (to, &c) in x_kept.iter_mut().zip(&data.kept) {
                        *to = weight * x[c];
                    }
                    z.gemv(1.0, &whiten, &x_kept, 0.0);
                    groups.push(index, &z, weight * e);
                }
                index += 1;
            }
            Ok(())
        })?;
    }
    let memory = memories.iter().map(Memory::length).fold(1.0, f64::max);
    let rows: u64 = memories.iter().map(Memory::seen).sum();
    let (white, count) = groups.jackknife(memory).ok_or_else(|| {
        let seconds = training.len() as f64 * instants as f64 * plan.treatment.decimation as f64 * plan.treatment.dt();
        IdentifyError::TooShortForIntervals {
            rows,
            memory,
            needed: (2.0 * seconds).ceil() as u64,
        }
    })?;
    let covariance = &inverse * white * inverse.transpose();
    let std: Vec<f64> = (0..size).map(|k| covariance[(k, k)].max(0.0).sqrt()).collect();
    let quantile = t_quantile(count - 1);
    let (a, _) = kept_columns(factor, data);
    let condition = |m: DMatrix<f64>| {
        let s = m.singular_values();
        s.max() / s.min()
    };
    let mut scaled = a.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        column /= norm;
    }
    let rows_of = |m: &dyn Fn(usize, usize) -> f64| {
        (0..size).map(|i| (0..size).map(|j| m(i, j)).collect()).collect::<Vec<Vec<f64>>>()
    };
    Ok(Estimate {
        interval: (0..size)
            .map(|k| [beta[k] - quantile * std[k], beta[k] + quantile * std[k]])
            .collect(),
        covariance: rows_of(&|i, j| covariance[(i, j)]),
        correlation: rows_of(&|i, j| covariance[(i, j)] / (std[i] * std[j]).max(f64::MIN_POSITIVE)),
        values: beta.to_vec(),
        classical_std,
        degrees_of_freedom: count - 1,
        rows,
        effective_rows: rows as f64 / memory,
        memory_rows: memory,
        condition: condition(a),
        scaled_condition: condition(scaled),
        std,
    })
}

/// Residuals of the torque, joint by joint, in the differential form whatever model was fitted: so that models
/// can be compared.
fn torque_residuals(
    recordings: &[&dyn Recording],
    surveys: &[Survey],
    plan: &Plan,
    full: &[f64],
) -> Result<Vec<ResidualReport>, IdentifyError> {
    let total: u64 = surveys
        .iter()
        .map(|s| s.rows / plan.treatment.decimation as u64)
        .sum();
    let joints = surveys.first().map_or(0, |s| s.joints.len());
    let extremes = |j: usize, of: &dyn Fn(&crate::prepare::JointSurvey) -> [f64; 2]| {
        surveys.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], s| {
            let [low, high] = of(&s.joints[j]);
            [l.min(low), h.max(high)]
        })
    };
    let p = full.len();
    // The survey's peak speed is that of raw differences, noise included; the filtered one needs a look.
    let mut speed = vec![0.0f64; joints];
    for recording in recordings {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for (s, qd) in speed.iter_mut().zip(&rows.qd) {
                *s = qd.iter().fold(*s, |m, v| m.max(v.abs()));
            }
            Ok(())
        })?;
    }
    let mut streams: Vec<ResidualStream> = (0..joints)
        .map(|j| {
            ResidualStream::new(
                total,
                Ranges {
                    position: extremes(j, &|s| s.position),
                    speed: speed[j],
                    torque: extremes(j, &|s| s.torque),
                },
            )
        })
        .collect();
    let mut index = 0u64;
    for recording in recordings {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for i in 0..rows.t.len() {
                for (j, (stream, equation)) in streams.iter_mut().zip(&rows.equations).enumerate() {
                    let predicted = product(&equation.x[i * p..(i + 1) * p], full);
                    stream.push(index, rows.t[i], rows.q[j][i], rows.qd[j][i], equation.y[i], predicted, equation.keep[i]);
                }
                index += 1;
            }
            Ok(())
        })?;
    }
    Ok(streams.into_iter().map(ResidualStream::report).collect())
}

fn not_excited(base: &Base, data: &Independent, kinds: &[JointKind]) -> Vec<NotExcited> {
    (0..base.len())
        .filter(|k| !data.kept.contains(k))
        .map(|k| {
            let partners: Vec<String> = data
                .kept
                .iter()
                .enumerate()
                .filter(|(row, _)| data.combination[(*row, k)].abs() > 1e-6)
                .map(|(_, &c)| column_name(base.columns[c]))
                .collect();
            let joint = base.columns[k] / COLUMNS + 1;
            let why = if partners.is_empty() {
                "It has no effect on the torque in these data.".to_owned()
            } else {
                format!(
                    "In these data its torque is, to within {:.2} % of itself, a combination of that of {}; their sum is identified instead.",
                    100.0 * data.remainder[k],
                    partners.join(", ")
                )
            };
            let revolute = kinds[joint - 1] == JointKind::Revolute;
            let motion = match base.columns[k] % COLUMNS {
                column::VISCOUS => format!("Move joint {joint} at several clearly different speeds, in both directions."),
                column::COULOMB => format!("Move joint {joint} slowly in both directions, with reversals."),
                column::OFFSET => format!("Move joint {joint} in both directions and, where it lifts, over a wider range of positions."),
                1..=3 if revolute => format!("Move joint {joint} over a wider range of positions, at best half a turn."),
                _ => format!("Accelerate joint {joint} and its neighbours harder, in different postures."),
            };
            NotExcited {
                combination: base.expression(k),
                why,
                motion,
            }
        })
        .collect()
}
