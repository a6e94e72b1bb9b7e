//! The way from recordings to an [`Identification`].

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use rig_shared::multibody::{COLUMNS, column};

use super::band::explained_band;
use super::base::{Base, chain_of, expression, transmission_of};
use super::beyond::{Beyond, with_beyond};
use super::cache::RowCache;
use super::covariance::memory_of;
use super::evaluate::{Planned, covariance, torque_residuals};
use super::excitation::{excited, not_excited};
use super::factor::TriangularFactor;
use super::freed::{freed, plain};
use super::further::{self, Outcome, further};
use super::lag::Lag;
use super::linear::{classical, least_squares, spread};
use super::model::{Plan, Tally, each_rows};
use super::problem::Problem;
use super::residual::ResidualReport;
use super::robust::{reweighted, spread_of};
use super::speed::speed_thresholds;
use super::{
    BaseParameter, Details, Estimator, Identification, IdentifyError, JointFigures, ModelKind,
    Options,
};
use crate::effects::Effects;
use crate::prepare::{
    Choice, PrepareError, Recording, Spooled, Survey, Treatment, each_of, surveyed, threads,
};
use crate::report::{format_significant, format_unit};
use crate::robot::{Joint, JointKind, Robot};

/// Kept rows, over all joints of the shortest recording, for each parameter: so many a narrower band must leave.
const ROWS_A_PARAMETER: usize = 10;
/// A mean over T passes half of the power at this over T: sin²(πx)/(πx)² = ½.
const HALF_POWER: f64 = 0.443;
/// Looks at what the description does not state: one finds it, each further one fits it together with all parameters.
const MOST_LOOKS: usize = 8;
/// Share of a joint's range, by judgement, up to which its motion may be a gear that twists: 0.4 degrees of a turn.
const CREEP: f64 = 1e-3;
/// Samples of a lead beyond which it is questioned: drives and buses take a few.
const MOST_LED: f64 = 10.0;
/// Reweighting stops when no parameter moves by more than this share of its standard deviation …
const SETTLED: f64 = 1e-3;
/// … or after this many passes; then a warning says so.
const MOST_PASSES: usize = 30;

/// Identifies `robot` from `training` and checks the result on `holdout`; its effects stand beside these parameters, one row a joint.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be used, a motion that excites nothing, a singular problem.
pub(super) fn identify_beside(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    beside: &[[f64; COLUMNS]],
) -> Result<Identification, IdentifyError> {
    further::check(robot, options)?;
    let mut known = None;
    for _ in 0..=MOST_LOOKS {
        match solve(robot, training, holdout, options, beside, known.as_ref())? {
            Solved::Whole(found) => return Ok(*found),
            Solved::Anew(more) => known = Some(more),
        }
    }
    Err(IdentifyError::Unsettled {
        what: "The search for what the description does not state",
        passes: MOST_LOOKS,
    })
}

/// How far the joint at `place` moves in any recording, in words, where that is but a creep.
fn creep(joint: &Joint, surveys: &[Survey], place: usize) -> Option<String> {
    let travel = surveys
        .iter()
        .map(|survey| survey.joints[place].position)
        .map(|[low, high]| high - low)
        .fold(0.0, f64::max);
    let limits = joint.limits.as_ref().map(|limits| limits.position);
    let range = limits.map_or(f64::INFINITY, |[low, high]| high - low);
    let (range, unit) = match joint.kind {
        JointKind::Revolute => (range.min(TAU), "rad"),
        JointKind::Prismatic => (range, "m"),
    };
    (range.is_finite() && travel < CREEP * range)
        .then(|| format!("{} {unit}", format_significant(travel, 2)))
}

/// An identification, or what it has to begin anew with.
enum Solved {
    Whole(Box<Identification>),
    Anew(Beyond),
}

fn solve(
    described: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    beside: &[[f64; COLUMNS]],
    added: Option<&Beyond>,
) -> Result<Solved, IdentifyError> {
    let nothing = Beyond::default();
    let known = added.unwrap_or(&nothing);
    let with_known = with_beyond(described, &known.torques, known.tilt.as_ref());
    let robot = &with_known;
    let chain = chain_of(robot)?;
    let transmission = transmission_of(robot)?;
    let joints = robot.joints.len();
    let base = Base::structural(robot, options.model, options.seed)?;
    // What is spooled has no references any more.
    let sources = training;
    let (training, holdout) = (Spooled::all(training), Spooled::all(holdout));
    let (surveys, training) = surveyed(&training, joints)?;
    if surveys.is_empty() {
        return Err(IdentifyError::NoRecording);
    }
    let (holdout_surveys, holdout) = surveyed(&holdout, joints)?;
    let (training, holdout) = (as_recordings(&training), as_recordings(&holdout));
    let (training, holdout) = (training.as_slice(), holdout.as_slice());
    // References do not line up with rows that were interpolated: what needs them then says that they are missing.
    let sources = if surveys.iter().any(|survey| survey.note.is_some()) {
        training
    } else {
        sources
    };
    if let Some(j) = (0..joints).find(|&j| surveys.iter().all(|s| s.joints[j].torque_rms == 0.0)) {
        return Err(IdentifyError::NoTorque {
            joint: j + 1,
            still: surveys.iter().all(|s| s.joints[j].still()),
        });
    }
    let limits: Vec<Option<f64>> = robot
        .joints
        .iter()
        .map(|j| j.limits.as_ref().and_then(|l| l.torque))
        .collect();
    let decided = Treatment::decide(&surveys, &options.prepare, &limits)?;
    let at_own_rate = |treatment: &Treatment| -> Result<Vec<Treatment>, PrepareError> {
        let of = |survey| treatment.at_rate_of(survey);
        holdout_surveys.iter().map(of).collect()
    };
    let effects = Effects::of(robot)
        .map_err(|e| IdentifyError::Model(e.to_string()))?
        .beside(beside);
    let rid = if effects.is_empty() {
        [const { Vec::new() }; 3]
    } else {
        let free = |list, treatments: &[Treatment]| freed(list, &effects, &chain, treatments);
        let fitted = vec![decided.clone(); training.len()];
        [
            free(training, &fitted)?,
            free(holdout, &at_own_rate(&decided)?)?,
            free(sources, &fitted)?,
        ]
    };
    let [known_training, known_holdout, known_sources] = rid.each_ref().map(|l| plain(l));
    let spooled = [Spooled::all(&known_training), Spooled::all(&known_holdout)];
    let [spooled_training, spooled_holdout] = spooled.each_ref().map(|l| plain(l));
    let whole = (!effects.is_empty()).then_some([training, holdout]);
    let (training, holdout, sources) = if effects.is_empty() {
        (training, holdout, sources)
    } else {
        (
            spooled_training.as_slice(),
            spooled_holdout.as_slice(),
            known_sources.as_slice(),
        )
    };
    let loudness: Vec<f64> = (0..joints)
        .map(|j| {
            surveys
                .iter()
                .map(|s| s.joints[j].torque_rms)
                .fold(0.0, f64::max)
        })
        .collect();
    let plan_with = |treatment, window: usize| Plan {
        chain: &chain,
        transmission: &transmission,
        columns: &base.columns,
        treatment,
        window,
        stride: (window / 4).max(1),
        loudness: loudness.clone(),
        cache: RowCache::default(),
    };
    let wide = decided;
    let explained = match options.prepare.decimation {
        // A narrow band smears the rows that a robust fit is to leave out over their neighbours.
        Choice::Auto if options.estimator != Estimator::Robust => {
            explained_band(training, &plan_with(&wide, 1))?
        }
        _ => None,
    };
    let decided = match explained {
        Some(band) => {
            let rows = (ROWS_A_PARAMETER * base.len()).div_ceil(joints) as u64;
            wide.narrowed(band, rows, &surveys, &options.prepare, &limits)?
        }
        None => wide.clone(),
    };
    let (window, window_reason) = choose_window(options, &decided, &surveys)?;
    let mut treatment = decided.clone();
    let mut made = RowCache::default();
    if options.prepare.speed_threshold == Choice::Auto {
        let by_noise = plan_with(&decided, window);
        let (speeds, reason) = speed_thresholds(training, &by_noise)?;
        made = if speeds == decided.speed_threshold {
            by_noise.cache
        } else {
            RowCache::after(by_noise.cache)
        };
        (treatment.speed_threshold, treatment.speed_reason) = (speeds, reason);
    }
    let plan = Plan {
        cache: made,
        ..plan_with(&treatment, window)
    };
    let p = base.len();

    // First fit: everything into one factor an equation.
    let equations = joints;
    let mut factors = vec![TriangularFactor::new(p); equations];
    let mut instants = 0u64;
    let mut tally = Tally::default();
    for (r, recording) in training.iter().enumerate() {
        let weight = options.row_weight(r);
        let part = each_rows(*recording, &plan, options.model, &mut |rows| {
            each_of(threads(treatment.threads), &mut factors, &|k, factor| {
                let Some(equation) = rows.equations.get(k) else {
                    return;
                };
                for (i, keep) in equation.keep.iter().enumerate() {
                    if *keep {
                        factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], weight);
                    }
                }
            });
            instants += rows.t.len() as u64;
            Ok(())
        })?;
        tally.add(&part);
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
    let data = excited(&base, &combine(&by_torque));

    let mut weights = vec![1.0; equations];
    let mut beta = least_squares(&combine(&weights), &data, &base)?;
    let by_noise: Vec<f64> = {
        let full = spread(&beta, &data.kept, p);
        factors
            .iter()
            .map(|factor| {
                let freedom = factor
                    .rows()
                    .saturating_sub(p as u64 / equations as u64)
                    .max(1);
                let sigma = (factor.residual_squares(&full) / freedom as f64).sqrt();
                if sigma > 0.0 { 1.0 / sigma } else { 1.0 }
            })
            .collect()
    };
    let weighted_beta = least_squares(&combine(&by_noise), &data, &base)?;
    if options.estimator != Estimator::Ols {
        weights.clone_from(&by_noise);
        beta.clone_from(&weighted_beta);
    }
    let mut factor = combine(&weights);
    let mut scales = None;
    let mut passes = 0;
    let mut converged = true;
    if options.estimator == Estimator::Robust {
        let mut scale = spread_of(
            training,
            &plan,
            options,
            &spread(&beta, &data.kept, p),
            equations,
        )?;
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

    let problem = Problem {
        robot,
        training,
        sources,
        surveys: &surveys,
        plan: &plan,
        options,
        base: &base,
        data: &data,
        weights: &by_noise,
        start: &weighted_beta,
        instants,
    };
    let (known, beside) = match added {
        None => {
            let found = further::beyond_description(&problem, &factors)?;
            if !found.is_empty() {
                return Ok(Solved::Anew(found));
            }
            (found, None)
        }
        Some(known) => {
            let found = further::together_with(&problem, &factors, known, described.gravity)?;
            if !found.settled {
                return Ok(Solved::Anew(found.terms));
            }
            (found.terms, Some(found.beside))
        }
    };
    let own = further::own(&problem, beside.as_ref())?;
    let (estimate, full) = match &own {
        Some(own) => (own.estimate.clone(), own.fitted.full.whole.clone()),
        // Second look: residuals of the fitted equations, for the covariance.
        None => {
            let loss = scales.as_ref().map(|s| (options.loss, s.as_slice()));
            let estimate = covariance(
                training,
                &plan,
                options,
                &factor,
                &data,
                &beta,
                &weights,
                loss,
                instants,
                beside
                    .map(|full| problem.identified_covariance(&full))
                    .as_ref(),
            )?;
            (estimate, spread(&beta, &data.kept, p))
        }
    };
    let by_position = |j: usize, q: f64| -> f64 {
        let own = known
            .torques
            .iter()
            .filter(|t| t.joint == robot.joints[j].name);
        own.map(|t| t.torque(q)).sum()
    };
    let residuals = |recordings: &[Planned], surveys: &[Survey], whole: Option<&[Planned]>| {
        torque_residuals(recordings, surveys, &full, &by_position, whole)
    };
    let fitted = |list| Planned::all(list, &plan);
    let train = residuals(
        &fitted(training),
        &surveys,
        whole.map(|[training, _]| fitted(training)).as_deref(),
    )?;
    let treatments = at_own_rate(&treatment)?;
    let plans: Vec<Plan> = treatments.iter().map(|t| plan_with(t, window)).collect();
    let held = each_planned(holdout, &plans);
    let holdout_residuals = if holdout.is_empty() {
        None
    } else {
        let whole = whole.map(|[_, holdout]| each_planned(holdout, &plans));
        Some(residuals(&held, &holdout_surveys, whole.as_deref())?)
    };

    let remembered: Vec<f64> = (train.iter())
        .map(|r| memory_of(&r.autocorrelation, r.rows))
        .collect();
    let lag = Lag::of(&problem, &remembered)?;
    let combination = &data.combination * &base.combination;
    let columns: Vec<usize> = data.kept.iter().map(|&k| base.columns[k]).collect();
    let base_parameters: Vec<BaseParameter> = (0..columns.len())
        .map(|k| BaseParameter {
            expression: expression(&combination, k, columns[k]),
            value: estimate.values[k],
            std: estimate.std[k],
            relative_std_percent: 100.0 * estimate.std[k] / estimate.values[k].abs(),
            unit: base.column_unit(columns[k]).to_owned(),
            interval: if options.estimator == Estimator::Consistent
                && not_below_zero(&combination, k, columns[k])
            {
                estimate.interval[k].map(|end| end.max(0.0))
            } else {
                estimate.interval[k]
            },
            classical_relative_std_percent: 100.0 * estimate.classical_std[k]
                / estimate.values[k].abs(),
        })
        .collect();
    let mut not_excited = not_excited(&base, &data);
    let beyond = further(
        &problem,
        own,
        &Outcome {
            estimate: &estimate,
            full: &full,
            factors: &factors,
            memory: match options.model {
                ModelKind::Differential => remembered,
                ModelKind::Integral => vec![estimate.memory_rows],
            },
            parameters: &base_parameters,
            measured: whole.map(|_| {
                let rms = |of: &[ResidualReport]| of.iter().map(|r| r.torque_rms).collect();
                [
                    rms(&train),
                    rms(holdout_residuals.as_deref().unwrap_or_default()),
                ]
            }),
        },
        &held,
    )?;
    not_excited.extend(beyond.hardly_excited);
    let mut warnings = beyond.warnings;
    warnings.extend(
        surveys
            .iter()
            .chain(&holdout_surveys)
            .filter_map(|survey| survey.note.clone()),
    );
    for (survey, own) in holdout_surveys.iter().zip(&treatments) {
        if own.sample_rate != treatment.sample_rate {
            warnings.push(format!(
                "{} is sampled at {} Hz, the training data at {} Hz: its errors are of one row in {} and up to {:.3} Hz, those of the training data up to {:.3} Hz.",
                survey.label, own.sample_rate, treatment.sample_rate, own.decimation, own.parallel_edge, treatment.parallel_edge
            ));
        }
    }
    warnings.extend(lag.map(|lag| lag.said(treatment.dt())));
    let led = treatment.torque_lead / treatment.dt();
    if led.abs() > MOST_LED {
        warnings.push(format!(
            "--torque-lead shifts the torque by {} samples, where a command that is held acts half a sample late: it is given in s.",
            format_significant(led, 3)
        ));
    }
    let row_period = match options.model {
        ModelKind::Differential => treatment.decimation,
        ModelKind::Integral => plan.stride,
    } as f64
        * treatment.dt();
    if !converged {
        warnings.push(format!(
            "The robust fit had not settled after {MOST_PASSES} passes; its values may still move."
        ));
    }
    let groups = instants as f64 / (10.0 * estimate.memory_rows);
    if groups < 8.0 {
        warnings.push(format!(
            "The residuals remember {:.2} s, so the recording holds only {groups:.1} independent stretches; the intervals, formed from eight, may be too narrow. A longer recording would mend that.",
            estimate.memory_rows * row_period
        ));
    }
    if estimate.scaled_condition > 100.0 {
        warnings.push(format!(
            "The condition number of the scaled regressor is {:.0}: the motion tells some parameters apart badly; look at their intervals.",
            estimate.scaled_condition
        ));
    }
    for (j, report) in train.iter().enumerate() {
        let name = &robot.joints[j].name;
        let (length, effort) = robot.joints[j].kind.units();
        if surveys.iter().all(|s| s.joints[j].still()) {
            warnings.push(format!(
                "Joint {name} stands still at {} {} in all training recordings. Its torque was not used, because at rest friction or a brake carries any part of it: its friction, constant torque and drive inertia are those of the description or guesses, and its link counts as one with the link before it. Record a motion of it for more, or make it type=\"fixed\" in the URDF where it never moves.",
                surveys.first().map_or(f64::NAN, |s| s.joints[j].position[0]),
                length
            ));
            continue;
        }
        if let Some(way) = creep(&robot.joints[j], &surveys, j).filter(|_| report.rows > 0) {
            warnings.push(format!(
                "Joint {name} moves by {way} in all training recordings, less than {CREEP} of its range. That may be no more than its drive or gear giving way: friction and inertia of such a motion are not those of one that turns the joint. Record a larger motion of it, or make it fixed in the description.",
            ));
        }
        let unjudged = |which: &str, surveys: &[Survey]| {
            let slowest = format_significant(treatment.speed_threshold[j], 2);
            if surveys
                .iter()
                .all(|s| s.joints[j].only_noise(s.sample_rate))
            {
                return format!(
                    "Joint {name} stands still in the {which} but for the noise of its encoder: no row is faster than {slowest} {length}/s, so nothing is said of its torque there. Record a motion of it for more, or make it type=\"fixed\" in the URDF where it never moves."
                );
            }
            format!(
                "Joint {name}: every row of the {which} was left out (slower than {slowest} {length}/s, or at the torque limit), so nothing is said of its torque there; look at its position for jumps, or give --min-speed."
            )
        };
        if report.rows == 0 {
            warnings.push(unjudged("training data", &surveys));
        }
        if holdout_residuals
            .as_ref()
            .is_some_and(|held| held[j].rows == 0)
        {
            warnings.push(unjudged("hold-out", &holdout_surveys));
        }
        if report.relative_error > 0.3 {
            warnings.push(format!(
                "Joint {name}: the model leaves {:.0} % of the torque unexplained on the data it was fitted to. Look at its zero, axis and lengths in the description, at the order of the columns, and at the robot for what no rigid model has.",
                100.0 * report.relative_error
            ));
        }
        if let Some(held) = holdout_residuals
            .as_ref()
            .map(|h: &Vec<ResidualReport>| &h[j])
            && held.rms > 1.5 * report.rms
        {
            warnings.push(format!(
                "Joint {name}: the residual on the hold-out ({} {}) is {:.1} times that on the training data.",
                format_significant(held.rms, 4),
                format_unit(effort),
                held.rms / report.rms
            ));
        }
    }
    let stated = Effects::of(described).map_err(|e| IdentifyError::Model(e.to_string()))?;
    let [taken, left] = stated.uncompensated();
    warnings.extend(left);
    let procedure = taken
        .into_iter()
        .chain(known.said())
        .chain(beyond.procedure)
        .collect();
    Ok(Solved::Whole(Box::new(Identification {
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
            .map(|(j, joint)| {
                let held = holdout_residuals.as_ref().map(|h| &h[j]);
                JointFigures {
                    name: joint.name.clone(),
                    train_residual_rms: train[j].rms,
                    holdout_residual_rms: held.map(|h| h.rms),
                    train_relative_error: train[j].relative_error,
                    holdout_relative_error: held.map(|h| h.relative_error),
                }
            })
            .collect(),
        position_torques: known.torques.clone(),
        base_tilt: known.tilt.clone(),
        not_excited,
        warnings,
        essential: beyond.essential,
        standard_parameters: beyond.standard,
        comparison: beyond.comparison,
        procedure,
        details: Details {
            masked: tally.masked(),
            training: surveys.clone(),
            holdout: holdout_surveys,
            estimate,
            free: beyond.free,
            combination,
            columns,
            train,
            holdout_residuals,
            window: (options.model == ModelKind::Integral)
                .then(|| (window as f64 * treatment.dt(), window_reason)),
            treatment,
        },
    })))
}

/// Whether an identified combination is friction or drive inertia alone, which cannot lie below zero.
fn not_below_zero(combination: &DMatrix<f64>, row: usize, column: usize) -> bool {
    let alone = combination
        .row(row)
        .iter()
        .filter(|x| x.abs() > 1e-9)
        .count()
        == 1;
    alone
        && matches!(
            column % COLUMNS,
            column::DRIVE_INERTIA | column::VISCOUS | column::COULOMB
        )
}

fn each_planned<'a>(list: &[&'a dyn Recording], plans: &'a [Plan<'a>]) -> Vec<Planned<'a>> {
    let pairs = list.iter().zip(plans);
    pairs
        .map(|(&recording, plan)| Planned { recording, plan })
        .collect()
}

fn as_recordings<'a>(list: &'a [Box<dyn Recording + 'a>]) -> Vec<&'a dyn Recording> {
    list.iter().map(AsRef::as_ref).collect()
}

/// Several joints: what passes the band of the differential model. One: a sixteenth of the period of the fastest motion: many samples, so that the work of noise averages out, yet
/// short enough that speeding up and slowing down fall into different windows. On EMPS, where friction is not
/// quite Coulomb and viscous, a window of 0.4 s moves the offset by 13 %, this one by 1.5 %.
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
            let several = surveys.iter().any(|s| s.joints.len() > 1);
            let wish = if several {
                HALF_POWER / treatment.parallel_edge
            } else {
                0.0625 / treatment.motion_frequency
            };
            let seconds = wish.clamp(least, most.max(least));
            let why = if several {
                format!(
                    "over which a mean passes up to the {:.3} Hz that the differential model's low-pass does",
                    treatment.parallel_edge
                )
            } else {
                format!(
                    "a sixteenth of the period of the fastest motion ({:.3} Hz)",
                    treatment.motion_frequency
                )
            };
            (
                seconds,
                format!("{seconds:.4} s, {why}; windows start every quarter of that."),
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
