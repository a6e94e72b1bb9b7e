//! Instrumental variables, IDIM-IV (Janot, Vandanjon & Gautier 2014): instruments are the model's own regressor
//! along the motion of its simulated closed loop, which knows nothing of the measurement's noise.
//!
//! β = (Zᵀ·X)⁻¹·Zᵀ·y, Z formed anew from the model just identified until it settles. Least squares is biased where
//! the noise of the position, or feedback of it through the controller, makes regressor and residual correlated;
//! this is not. Solved through the triangular factor of [Z | X | y], so that no condition number is squared.
//!
//! Leaves out: re-estimation of the joints' weights between passes; refined IV with a noise model (RIV).

use nalgebra::{DMatrix, DVector};

use super::IdentifyError;
use super::closed::{LoopMotion, ReferenceMotion, Source, model_of, nearest};
use super::factor::TriangularFactor;
use super::least::triangle;
use super::linear::spread;
use super::model::Rows;
use super::parts::{LeaveOut, PARTS, Parts, Refit, joined, part_of};
use super::prior::Prior;
use super::problem::{Fitted, Problem, singular};
use super::twin::{Companion, Twin, each_pair};

/// Settled when no parameter moves by more than this share of its standard deviation …
const SETTLED: f64 = 0.02;
/// … or after this many passes; then a warning says so.
const MOST_PASSES: usize = 12;
/// Least canonical correlation of instruments and regressor that does not call for a warning.
const WEAK: f64 = 0.3;

/// Rows along the simulated motion beside the measured ones, as told by `source` and the model `standard`.
pub(super) fn each_simulated(
    problem: &Problem,
    source: &Source,
    standard: &[f64],
    take: &mut dyn FnMut(usize, &Rows, &Rows),
) -> Result<(), IdentifyError> {
    match source {
        Source::Loop(controllers) => {
            let model = model_of(problem.robot, problem.plan.chain, standard)?;
            let make = |r: usize| {
                let period = 1.0 / problem.surveys[r].sample_rate;
                Ok(
                    Box::new(LoopMotion::new(problem.robot, controllers, &model, period)?)
                        as Box<dyn Companion>,
                )
            };
            each_pair(problem, &Twin::Made(&make), take)
        }
        Source::Reference => {
            let make = |_: usize| Ok(Box::new(ReferenceMotion) as Box<dyn Companion>);
            each_pair(problem, &Twin::Made(&make), take)
        }
        Source::Smoothed(low_pass) => each_pair(problem, &Twin::Smoothed(low_pass.clone()), take),
    }
}

/// β from the triangular factor of [Z | X | y]: Zᵀ·Z cancels.
fn solve(factor: &TriangularFactor, size: usize) -> Result<Vec<f64>, IdentifyError> {
    let (r, z) = factor.system();
    let a = r.view((0, size), (size, size)).into_owned();
    a.lu()
        .solve(&z.rows(0, size))
        .filter(|x| x.iter().all(|v| v.is_finite()))
        .map(|x| x.as_slice().to_vec())
        .ok_or_else(|| singular("of the instruments"))
}

/// Smallest canonical correlation of Z and X.
fn strength(factor: &TriangularFactor, size: usize) -> f64 {
    let (r, _) = factor.system();
    let shared = r.view((0, size), (size, size)).into_owned();
    let own = r.view((0, size), (2 * size, size)).into_owned().qr().r();
    match own.try_inverse() {
        Some(inverse) => (shared * inverse).singular_values().min(),
        None => 0.0,
    }
}

/// Fits by instrumental variables.
pub(super) fn instrumental(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let (source, words) = Source::of(problem)?;
    let data = problem.data;
    let (p, size) = (problem.base.len(), data.kept.len());
    let measured = LeaveOut::of(&parts.weighted(problem.weights));
    let tempered = LeaveOut::of(&parts.weighted(&problem.tempered(parts))).whole;
    let weights: Vec<f64> = problem.recording_weights().collect();
    let mut values = problem.start.to_vec();
    let mut passes = 0;
    loop {
        let full = spread(&values, &data.kept, p);
        let standard = nearest(problem, &tempered, prior, &full)?;
        let mut factors = vec![TriangularFactor::new(2 * size); PARTS];
        let mut index = 0;
        let mut row = vec![0.0; 2 * size];
        // Per joint: squares of simulated less measured position, and of the measured about its mean.
        let mut drift = Drift::new(problem.robot.joints.len());
        each_simulated(problem, &source, &standard, &mut |r, x, z| {
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
        let all = LeaveOut::of(&joined(factors, parts.count));
        let kept = all.refit(&|factor| solve(factor, size))?;
        passes += 1;
        let covariance = kept.covariance();
        let moved = (0..size)
            .map(|k| {
                (kept.whole[k] - values[k]).abs() / covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE)
            })
            .fold(0.0, f64::max);
        values.clone_from(&kept.whole);
        // Instruments that do not come from a simulation do not change from pass to pass.
        let fixed = !matches!(source, Source::Loop(_));
        if fixed || moved <= SETTLED || passes == MOST_PASSES {
            let strength = strength(&all.whole, size);
            let mut warnings = Vec::new();
            if !fixed && moved > SETTLED {
                warnings.push(format!(
                    "Instrumental variables had not settled after {MOST_PASSES} passes: a parameter still moves by {moved:.2} of its standard deviation."
                ));
            }
            if strength < WEAK {
                warnings.push(format!(
                    "The instruments are weak (smallest canonical correlation with the regressor {strength:.2}): the estimate by instrumental variables scatters and is pulled towards least squares."
                ));
            }
            let mut said = vec![format!(
                "Instruments from {words}; {passes} pass{}, smallest canonical correlation with the regressor {strength:.3}.",
                if passes == 1 { "" } else { "es" }
            )];
            said.push(drift.words(problem));
            let doubtful = strength < WEAK || matches!(source, Source::Smoothed(_));
            return fitted(
                problem, &all.whole, kept, &measured, said, warnings, doubtful,
            );
        }
    }
}

/// Distance of the simulated from the measured motion.
pub(super) struct Drift {
    sums: Vec<[f64; 4]>,
}

impl Drift {
    pub(super) fn new(joints: usize) -> Self {
        Self {
            sums: vec![[0.0; 4]; joints],
        }
    }

    pub(super) fn push(&mut self, measured: &Rows, simulated: &Rows) {
        for (sum, (a, b)) in self
            .sums
            .iter_mut()
            .zip(measured.q.iter().zip(&simulated.q))
        {
            for (x, y) in a.iter().zip(b) {
                sum[0] += 1.0;
                sum[1] += x;
                sum[2] += x * x;
                sum[3] += (x - y).powi(2);
            }
        }
    }

    pub(super) fn words(&self, problem: &Problem) -> String {
        let shares: Vec<String> = self
            .sums
            .iter()
            .zip(&problem.robot.joints)
            .map(|([n, sum, squares, off], joint)| {
                let n = n.max(1.0);
                let spread = (squares / n - (sum / n).powi(2)).max(f64::MIN_POSITIVE);
                format!("{} {:.2} %", joint.name, 100.0 * (off / n / spread).sqrt())
            })
            .collect();
        format!(
            "RMS distance of that motion from the measured one, as a share of the motion's spread: {}.",
            shares.join(", ")
        )
    }
}

fn fitted(
    problem: &Problem,
    factor: &TriangularFactor,
    kept: Refit,
    measured: &LeaveOut,
    said: Vec<String>,
    warnings: Vec<String>,
    doubtful: bool,
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
