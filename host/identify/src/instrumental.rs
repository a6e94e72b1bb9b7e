//! Instrumental variables, IDIM-IV (Janot, Vandanjon & Gautier 2014): instruments are the model's own regressor
//! along the motion of its simulated closed loop, which knows nothing of the measurement's noise.
//!
//! β = (Zᵀ·X)⁻¹·Zᵀ·y, Z formed anew from the model just identified until it settles. Least squares is biased where
//! the noise of the position, or feedback of it through the controller, makes regressor and residual correlated;
//! this is not. Solved through the triangular factor of [Z | X | y], so that no condition number is squared.
//!
//! How strong the instruments are is asked with Cragg and Donald's statistic (1993), rows counted as what they are worth when
//! the residual remembers its past: the smallest eigenvalue of the first stage's F matrix. One regressor with one instrument
//! needs some 10 (Staiger & Stock 1997); Stock & Yogo (2005) tabulate it for few regressors, from 7 to 16.
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
use rig_output::format_significant;

/// Settled when no parameter moves by more than this share of its standard deviation …
const SETTLED: f64 = 0.02;
/// … or after this many passes; then a warning says so.
const MOST_PASSES: usize = 12;
/// Cragg and Donald's statistic below which instruments are weak.
const WEAK: f64 = 10.0;
/// A reference farther off the motion than this share of the motion's spread is a guess at what the arm does.
const OFF: f64 = 0.02;
/// A residual of so many times the weighted fit's comes from the instruments, not from noise that biases least squares: noise
/// that takes three quarters of an inertia away doubles it.
const SEVERAL: f64 = 2.0;

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

/// Cragg and Donald's statistic of as many instruments as regressors, from their smallest canonical correlation; `rows` are
/// independent ones.
fn cragg_donald(strength: f64, rows: f64, size: usize) -> f64 {
    let size = size as f64;
    let share = (strength * strength).min(1.0);
    (rows - size).max(0.0) / size * share / (1.0 - share).max(f64::EPSILON)
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
            let memory = parts.memory.iter().copied().fold(1.0, f64::max);
            let statistic = cragg_donald(strength, parts.rows as f64 / memory, size);
            let mut said = vec![format!(
                "Instruments from {words}; {passes} pass{}, smallest canonical correlation with the regressor {strength:.3}, Cragg and Donald's statistic {}.",
                if passes == 1 { "" } else { "es" },
                format_significant(statistic, 3)
            )];
            said.push(drift.words(problem));
            let full = spread(&kept.whole, &data.kept, p);
            let doubtful = if statistic < WEAK {
                Some(format!(
                    "the instruments are weak (Cragg and Donald's statistic is {}, and some {WEAK} are needed), so that the estimate by instrumental variables scatters and is pulled towards least squares",
                    format_significant(statistic, 2)
                ))
            } else if let Some((joint, times)) = much_more(problem, parts, &full) {
                Some(format!(
                    "the estimate by instrumental variables leaves {times:.1} times the residual of the weighted fit at joint {joint}, more than noise in the motion could hide from least squares"
                ))
            } else {
                match source {
                    Source::Loop(_) => None,
                    Source::Reference => drift.farthest(problem).filter(|(_, off)| *off > OFF).map(
                        |(joint, off)| {
                            format!(
                                "the recorded reference, which is the instrument, is {:.1} % of the motion's spread off the motion of joint {joint}",
                                100.0 * off
                            )
                        },
                    ),
                    Source::Smoothed(_) => Some(
                        "the instruments are the measured motion smoothed, in which noise of low frequency still is"
                            .to_owned(),
                    ),
                }
            };
            warnings.extend(doubtful.as_ref().map(|why| {
                format!("Do not trust the estimate by instrumental variables over the weighted fit: {why}.")
            }));
            return fitted(
                problem, &all.whole, kept, &measured, said, warnings, doubtful,
            );
        }
    }
}

/// The joint at which values of the base columns leave most of the weighted fit's residual, and how many times as much, where
/// that is [`SEVERAL`].
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

    /// RMS distance joint by joint, as a share of the motion's spread.
    fn shares<'a>(&'a self, problem: &'a Problem) -> impl Iterator<Item = (&'a str, f64)> {
        let joints = self.sums.iter().zip(&problem.robot.joints);
        joints.map(|([n, sum, squares, off], joint)| {
            let n = n.max(1.0);
            let spread = (squares / n - (sum / n).powi(2)).max(f64::MIN_POSITIVE);
            (joint.name.as_str(), (off / n / spread).sqrt())
        })
    }

    /// The joint that is farthest off.
    fn farthest<'a>(&'a self, problem: &'a Problem) -> Option<(&'a str, f64)> {
        self.shares(problem).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    pub(super) fn words(&self, problem: &Problem) -> String {
        let shares: Vec<String> = self
            .shares(problem)
            .map(|(joint, share)| format!("{joint} {:.2} %", 100.0 * share))
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
