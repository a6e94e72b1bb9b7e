//! The steps from recordings to an [`Identification`].

use nalgebra::DMatrix;
use rig_shared::multibody::{COLUMNS, column};

use super::check::check;
use super::freed::{freed, plain};
use super::further::{Outcome, further};
use super::own::own;
use super::warnings::Heard;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::estimators::fit::Fit;
use crate::estimators::problem::Problem;
use crate::identification::{BaseParameter, Details, Identification, JointFigures};
use crate::options::{ModelKind, Options};
use crate::rows::cache::RowCache;
use crate::rows::directions::one_way;
use crate::rows::plan::Plan;
use crate::rows::planned::Planned;
use crate::structure::base::Base;
use crate::structure::chain::{chain_of, transmission_of};
use crate::structure::columns::expression;
use crate::structure::excitation::not_excited;
use crate::treatment::band::explained_band;
use crate::treatment::cutoff::{Equations, decided};
use crate::treatment::decimation;
use crate::treatment::speed::speed_thresholds;
use crate::treatment::window::choose_window;
use crate::uncertainty::covariance::memory_of;
use crate::uncertainty::fit_covariance::covariance;
use crate::uncertainty::residual::ResidualReport;
use crate::uncertainty::torque_residuals::torque_residuals;
use crate::unmodelled::beyond::{Beyond, with_beyond};
use crate::unmodelled::lag::Lag;
use crate::unmodelled::look_beyond::{beyond_description, together_with};
use rig_data::prepare::{
    Choice, PrepareError, Recording, Spooled, Survey, Treatment, as_recordings, surveyed,
};
use rig_model::effects::Effects;
use rig_model::robot::Robot;

/// Smallest number of kept rows per parameter, over all joints of the shortest recording, in a narrower band.
const ROWS_A_PARAMETER: usize = 10;
/// Largest number of passes over effects beyond the description: the first finds them, each further one refits jointly.
const MOST_LOOKS: usize = 8;

/// Identifies `robot` from `training`, checks the result on `holdout`. Its effects use these parameters, one row per
/// joint.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be used, a motion that excites nothing, a singular problem.
pub(crate) fn identify_beside(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    beside: &[[f64; COLUMNS]],
) -> Result<Identification, IdentifyError> {
    check(robot, options)?;
    let (mut known, mut prepared) = (None, None);
    for _ in 0..=MOST_LOOKS {
        let known_now = known.as_ref();
        match solve(
            robot,
            training,
            holdout,
            options,
            beside,
            known_now,
            &mut prepared,
        )? {
            Solved::Whole(found) => return Ok(*found),
            Solved::Anew(more) => known = Some(more),
        }
    }
    Err(IdentifyError::Unsettled {
        what: "The search for what the description does not state",
        passes: MOST_LOOKS,
    })
}

/// An identification, or the effects with which it starts again.
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
    prepared: &mut Option<(Vec<Survey>, Treatment)>,
) -> Result<Solved, IdentifyError> {
    let nothing = Beyond::default();
    let known = added.unwrap_or(&nothing);
    let with_known = with_beyond(described, &known.torques, known.tilt.as_ref());
    let robot = &with_known;
    let chain = chain_of(robot)?;
    let transmission = transmission_of(robot)?;
    let joints = robot.joints.len();
    let base = Base::structural(robot, options.model, options.seed)?;
    // Spooled recordings contain no references.
    let sources = training;
    let (training, holdout) = (Spooled::all(training), Spooled::all(holdout));
    let (surveys, training) = surveyed(&as_recordings(&training), joints)?;
    if surveys.is_empty() {
        return Err(IdentifyError::NoRecording);
    }
    let (holdout_surveys, holdout) = surveyed(&as_recordings(&holdout), joints)?;
    let (training, holdout) = (as_recordings(&training), as_recordings(&holdout));
    let (training, holdout) = (training.as_slice(), holdout.as_slice());
    // References do not match interpolated rows, so users of references are told that they are missing.
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
    let limits = robot.torque_limits();
    let equations = Equations {
        chain: &chain,
        transmission: &transmission,
        columns: &base.columns,
        complete: described.effects.is_empty(),
    };
    // Recordings and their treatment are the same in every pass.
    let (surveys, decided) = match prepared.take() {
        Some(prepared) => prepared,
        None => decided(equations, training, surveys, &options.prepare, &limits)?,
    };
    *prepared = Some((surveys.clone(), decided.clone()));
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
        one_way: Vec::new(),
        cache: RowCache::default(),
    };
    let wide = decided;
    let bands = match options.prepare.decimation {
        // A narrow band spreads the outliers that a robust fit should exclude over their neighbours.
        Choice::Auto if options.estimator != Estimator::Robust => {
            let rows = (ROWS_A_PARAMETER * base.len()).div_ceil(joints) as u64;
            let narrowed = |band| wide.narrowed(band, rows, &surveys, &options.prepare, &limits);
            let first = match explained_band(training, &plan_with(&wide, 1))? {
                Some(band) => narrowed(band)?,
                None => wide.clone(),
            };
            decimation::candidates(first, &narrowed)?
        }
        _ => vec![wide.clone()],
    };
    let plans: Vec<Plan> = bands.iter().map(|band| plan_with(band, 1)).collect();
    let decided = decimation::best(training, &bands[0], &plans)?;
    let (window, window_reason) = choose_window(options, &decided, &surveys)?;
    let mut treatment = decided.clone();
    let mut made = RowCache::default();
    if options.prepare.speed_threshold == Choice::Auto {
        let by_noise = plan_with(&decided, window);
        let chosen = speed_thresholds(training, &by_noise)?;
        made = if chosen.fitted == decided.speed_threshold {
            by_noise.cache
        } else {
            RowCache::after(by_noise.cache)
        };
        (treatment.speed_threshold, treatment.judged_speed) = (chosen.fitted, chosen.judged);
        treatment.speed_reason = chosen.reason;
    }
    let mut plan = Plan {
        cache: made,
        ..plan_with(&treatment, window)
    };
    plan.one_way = one_way(training, &plan)?;
    let fit = Fit::of(training, &plan, options, &base)?;

    let problem = Problem {
        robot,
        training,
        sources,
        surveys: &surveys,
        plan: &plan,
        options,
        base: &base,
        data: &fit.data,
        weights: &fit.by_noise,
        start: &fit.weighted,
        instants: fit.instants,
    };
    let (known, beside) = match added {
        None => {
            let found = beyond_description(&problem, &fit.factors)?;
            if !found.is_empty() {
                return Ok(Solved::Anew(found));
            }
            (found, None)
        }
        Some(known) => {
            let found = together_with(&problem, &fit.factors, known, described.gravity)?;
            if !found.settled {
                return Ok(Solved::Anew(found.terms));
            }
            (found.terms, Some(found.beside))
        }
    };
    let own = own(&problem, beside.as_ref())?;
    let (estimate, full) = match &own {
        Some(own) => (own.estimate.clone(), own.fitted.full.whole.clone()),
        // Second pass: residuals of the fitted equations, for the covariance.
        None => {
            let loss = (fit.scales.as_ref()).map(|s| (options.loss, s.as_slice()));
            let estimate = covariance(
                training,
                &plan,
                options,
                &fit.factor,
                &fit.data,
                &fit.beta,
                &fit.weights,
                loss,
                fit.instants,
                beside
                    .map(|full| problem.identified_covariance(&full))
                    .as_ref(),
            )?;
            (estimate, fit.full())
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
    let treatments = at_own_rate(&treatment.judging())?;
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
    let combination = &fit.data.combination * &base.combination;
    let columns: Vec<usize> = (fit.data.kept.iter()).map(|&k| base.columns[k]).collect();
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
    let mut not_excited = not_excited(&base, &fit.data);
    let beyond = further(
        &problem,
        own,
        &Outcome {
            estimate: &estimate,
            full: &full,
            factors: &fit.factors,
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
    let heard = Heard {
        robot,
        options,
        surveys: &surveys,
        holdout_surveys: &holdout_surveys,
        treatment: &treatment,
        treatments: &treatments,
        stride: plan.stride,
        lag,
        converged: fit.converged,
        instants: fit.instants,
        estimate: &estimate,
        train: &train,
        holdout: holdout_residuals.as_deref(),
    };
    warnings.extend(heard.warnings());
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
                JointFigures::of(&joint.name, &train[j], held)
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
            masked: fit.tally.masked(),
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

/// Returns true if an identified combination is only friction or only drive inertia, which cannot be negative.
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
