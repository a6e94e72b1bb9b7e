//! Instrumental variables, IDIM-IV (Janot, Vandanjon & Gautier 2014). The instruments are the model's regressor along
//! the motion of its simulated closed loop, which contains no measurement noise.
//!
//! β = (Zᵀ·X)⁻¹·Zᵀ·y, with Z recomputed from the latest model until it converges. Least squares is biased if position
//! noise, or its feedback through the controller, correlates regressor and residual; this estimator is not. It is
//! solved through the triangular factor of [Z | X | y], so that no condition number is squared.
//!
//! Cragg and Donald's statistic (1993) measures the strength of the instruments: the smallest eigenvalue of the first
//! stage's F matrix. Rows are counted as independent ones, by the residual's correlation time. One regressor with one
//! instrument needs some 10 (Staiger & Stock 1997); Stock & Yogo (2005) tabulate it for few regressors, from 7 to 16.
//!
//! Limits: joint weights are not re-estimated between passes; no refined IV with a noise model (RIV).

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use super::closed::{Source, nearest};
use super::fitted::Fitted;
use super::linear::{spread, triangle};
use super::problem::Problem;
use super::simulated::{Drift, each_simulated};
use crate::bodies::prior::Prior;
use crate::error::{IdentifyError, singular};
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::jackknife::{LeaveOut, PARTS, Refit, joined, part_of};
use crate::uncertainty::parts::Parts;
use crate::warning::{Unsettled, Warning};
use rig_output::format_significant;

/// Largest change of a parameter at convergence, as a share of its standard deviation.
const SETTLED: f64 = 0.02;
/// Largest number of passes; a warning reports it.
const MOST_PASSES: usize = 12;
/// Value of Cragg and Donald's statistic below which instruments are weak.
const WEAK: f64 = 10.0;
/// Distance of reference and motion, as a share of the motion's spread, above which the reference is unreliable.
const OFF: f64 = 0.02;
/// Ratio of the residual to the weighted fit's above which the instruments are the cause, not noise that biases least
/// squares. Noise that removes three quarters of an inertia only doubles the residual.
const SEVERAL: f64 = 2.0;

/// Returns β from the triangular factor of [Z | X | y]: Zᵀ·Z cancels.
fn solve(factor: &TriangularFactor, size: usize) -> Result<Vec<f64>, IdentifyError> {
    let (r, z) = factor.system();
    let a = r.view((0, size), (size, size)).into_owned();
    a.lu()
        .solve(&z.rows(0, size))
        .filter(|x| x.iter().all(|v| v.is_finite()))
        .map(|x| x.as_slice().to_vec())
        .ok_or_else(|| singular("of the instruments"))
}

/// Returns Cragg and Donald's statistic for as many instruments as regressors, from their smallest canonical
/// correlation; `rows` is the number of independent rows.
fn cragg_donald(strength: f64, rows: f64, size: usize) -> f64 {
    let size = size as f64;
    let share = (strength * strength).min(1.0);
    (rows - size).max(0.0) / size * share / (1.0 - share).max(f64::EPSILON)
}

/// Returns the smallest canonical correlation of Z and X.
fn strength(factor: &TriangularFactor, size: usize) -> f64 {
    let (r, _) = factor.system();
    let shared = r.view((0, size), (size, size)).into_owned();
    let own = r.view((0, size), (2 * size, size)).into_owned().qr().r();
    match own.try_inverse() {
        Some(inverse) => Svd::of(shared * inverse).singular_values.min(),
        None => 0.0,
    }
}

/// Fits by instrumental variables.
pub(crate) fn instrumental(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let (source, words) = Source::of(problem)?;
    let data = problem.data;
    let (p, size) = (problem.base.len(), data.kept.len());
    let tempered = LeaveOut::of(&parts.weighted(&parts.tempered(problem.weights))).whole;
    // Instruments without a simulation do not change between passes.
    let fixed = !matches!(source, Source::Loop(_));
    let mut values = problem.start.to_vec();
    let mut passes = 0;
    loop {
        let full = spread(&values, &data.kept, p);
        let standard = nearest(problem, &tempered, prior, &full)?;
        let (all, drift) = instrumented(problem, parts, &source, &standard)?;
        let kept = all.refit(&|factor| solve(factor, size))?;
        passes += 1;
        let moved = largest_change(&kept, &values);
        values.clone_from(&kept.whole);
        if fixed || moved <= SETTLED || passes == MOST_PASSES {
            let last = LastPass {
                source: &source,
                words: &words,
                passes,
                unsettled: (!fixed && moved > SETTLED).then_some(moved),
                all,
                kept,
                drift,
            };
            return last.fitted(problem, parts);
        }
    }
}

/// Accumulates the rows [Z | X | y] with the instruments of the model `standard`, and the distance of their motion from
/// the measured one.
fn instrumented(
    problem: &Problem,
    parts: &Parts,
    source: &Source,
    standard: &[f64],
) -> Result<(LeaveOut, Drift), IdentifyError> {
    let data = problem.data;
    let (p, size) = (problem.base.len(), data.kept.len());
    let weights: Vec<f64> = problem.recording_weights().collect();
    let mut factors = vec![TriangularFactor::new(2 * size); PARTS];
    let mut index = 0;
    let mut row = vec![0.0; 2 * size];
    // Per joint: squares of simulated minus measured position, and of the measured position about its mean.
    let mut drift = Drift::new(problem.robot.joints.len());
    each_simulated(problem, source, standard, &mut |r, x, z| {
        drift.push(x, z);
        for i in 0..x.t.len() {
            let factor = &mut factors[part_of(index, problem.instants)];
            for (k, (own, other)) in x.equations.iter().zip(&z.equations).enumerate() {
                if own.keep[i] {
                    for (to, &c) in data.kept.iter().enumerate() {
                        row[to] = other.x[i * p + c];
                        row[size + to] = own.x[i * p + c];
                    }
                    factor.push(&row, own.y[i], weights[r] * problem.weights[k]);
                }
            }
            index += 1;
        }
    })?;
    Ok((LeaveOut::of(&joined(factors, parts.count)), drift))
}

/// Returns the largest change of a parameter from `values`, in its standard deviations.
fn largest_change(kept: &Refit, values: &[f64]) -> f64 {
    let covariance = kept.covariance();
    (0..values.len())
        .map(|k| {
            (kept.whole[k] - values[k]).abs() / covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE)
        })
        .fold(0.0, f64::max)
}

/// The last pass of the iteration.
struct LastPass<'a> {
    source: &'a Source,
    /// The source in words.
    words: &'a str,
    passes: usize,
    /// Largest change of a parameter, in its standard deviations, if the iteration did not settle.
    unsettled: Option<f64>,
    /// Rows [Z | X | y].
    all: LeaveOut,
    /// Values of the identified combinations.
    kept: Refit,
    drift: Drift,
}

impl LastPass<'_> {
    /// Returns the estimate with remarks and warnings.
    fn fitted(self, problem: &Problem, parts: &Parts) -> Result<Fitted, IdentifyError> {
        let size = self.kept.whole.len();
        let strength = strength(&self.all.whole, size);
        let memory = parts.memory.iter().copied().fold(1.0, f64::max);
        let statistic = cragg_donald(strength, parts.rows as f64 / memory, size);
        let passes = self.passes;
        let said = vec![
            format!(
                "Instruments from {}; {passes} pass{}, smallest canonical correlation with the regressor {strength:.3}, Cragg and Donald's statistic {}.",
                self.words,
                if passes == 1 { "" } else { "es" },
                format_significant(statistic, 3)
            ),
            self.drift.words(problem),
        ];
        let mut warnings = Vec::new();
        warnings.extend(self.unsettled.map(|moved| Warning::Unsettled {
            by: Unsettled::Instrumental,
            passes: MOST_PASSES,
            moved: Some(moved),
        }));
        let doubtful = self.doubt(problem, parts, statistic);
        warnings.extend(doubtful.clone().map(Warning::Distrusted));
        fitted(
            problem,
            &self.all.whole,
            self.kept,
            &LeaveOut::of(&parts.weighted(problem.weights)),
            said,
            warnings,
            doubtful,
        )
    }

    /// Returns the reason to trust the weighted fit more, a clause; `statistic` is Cragg and Donald's.
    fn doubt(&self, problem: &Problem, parts: &Parts, statistic: f64) -> Option<String> {
        let full = spread(&self.kept.whole, &problem.data.kept, problem.base.len());
        if statistic < WEAK {
            return Some(format!(
                "the instruments are weak (Cragg and Donald's statistic is {}, and some {WEAK} are needed), so that the estimate by instrumental variables scatters and is pulled towards least squares",
                format_significant(statistic, 2)
            ));
        }
        if let Some((joint, times)) = much_more(problem, parts, &full) {
            return Some(format!(
                "the estimate by instrumental variables leaves {times:.1} times the residual of the weighted fit at joint {joint}, more than noise in the motion could hide from least squares"
            ));
        }
        match self.source {
            Source::Loop(_) => None,
            Source::Reference => {
                let (joint, off) = self.drift.farthest(problem).filter(|(_, off)| *off > OFF)?;
                Some(format!(
                    "the recorded reference, which is the instrument, is {:.1} % of the motion's spread off the motion of joint {joint}",
                    100.0 * off
                ))
            }
            Source::Smoothed(_) => Some(
                "the instruments are the measured motion smoothed, in which noise of low frequency still is"
                    .to_owned(),
            ),
        }
    }
}

/// Returns the joint with the largest ratio of its residual to the weighted fit's, and that ratio, if it reaches
/// [`SEVERAL`]. `full` holds the values of the base columns.
fn much_more<'a>(problem: &'a Problem, parts: &Parts, full: &[f64]) -> Option<(&'a str, f64)> {
    let plain = problem.start_full();
    let squares = |k: usize, full: &[f64]| -> f64 {
        let stretches = parts.fitted.iter();
        stretches.map(|part| part[k].residual_squares(full)).sum()
    };
    let joints = problem.robot.joints.iter().enumerate();
    joints
        .map(|(k, joint)| {
            let times = squares(k, full) / squares(k, &plain).max(f64::MIN_POSITIVE);
            (joint.name.as_str(), times.sqrt())
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, times)| *times > SEVERAL)
}

/// Returns the estimate `kept` with its classical standard deviations.
fn fitted(
    problem: &Problem,
    factor: &TriangularFactor,
    kept: Refit,
    measured: &LeaveOut,
    said: Vec<String>,
    warnings: Vec<Warning>,
    doubtful: Option<String>,
) -> Result<Fitted, IdentifyError> {
    let size = kept.whole.len();
    let (r, _) = factor.system();
    // σ²·(ZᵀX)⁻¹·ZᵀZ·(XᵀZ)⁻¹ = σ²·A⁻¹·A⁻ᵀ with A the instruments' part of the factor.
    let a: DMatrix<f64> = r.view((0, size), (size, size)).into_owned();
    let inverse = a
        .try_inverse()
        .ok_or_else(|| singular("of the instruments"))?;
    let mut whole = vec![0.0; size];
    whole.extend(&kept.whole);
    let freedom = factor.rows().saturating_sub(size as u64).max(1);
    let sigma = (factor.residual_squares(&whole) / freedom as f64).sqrt();
    let data = problem.data;
    Ok(Fitted {
        full: kept.map(&|values| spread(values, &data.kept, problem.base.len())),
        classical_std: (0..size)
            .map(|k| sigma * DVector::from_iterator(size, inverse.row(k).iter().copied()).norm())
            .collect(),
        kept,
        standard: None,
        covariance: None,
        regressor: triangle(&measured.whole, data),
        said,
        warnings,
        doubtful,
    })
}
