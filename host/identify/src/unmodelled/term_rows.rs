//! Rows with the columns of all candidate terms, and the evidence for the terms.

use nalgebra::DVector;

use super::terms::{PERIODS, TERMS, Term, terms_of};
use super::tilt::{Axes, tilt_torque};
use crate::bodies::evidence::{Belief, Seen};
use crate::bodies::prior::Prior;
use crate::error::{IdentifyError, failed};
use crate::estimators::problem::Problem;
use crate::options::ModelKind;
use crate::rows::factor::TriangularFactor;
use crate::rows::stream::each_rows;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::vector::dot_in_order;

/// Prior standard deviation of the tilt of a base described as level, rad.
const LEVEL: f64 = 0.1;
/// Largest number of instants used, evenly spread over all recordings: with six joints some 10⁵ rows for some 100
/// columns. More would only reduce the uncertainty, which terms of relevant size do not need: it falls with the root of
/// the number of rows.
const ENOUGH: u64 = 20_000;

/// Rows of the training recordings with the columns of all terms, per joint.
pub(crate) struct Evidence {
    parts: Vec<TriangularFactor>,
    /// Per joint, RMS of each term's columns about their mean.
    spread: Vec<[f64; TERMS]>,
    /// Per joint, one over the residual's standard deviation and the root of its correlation time.
    weights: Vec<f64>,
}

impl Evidence {
    /// Collects the rows. `factors` are those of the fitted equations; with the prior they give the masses on which a
    /// tilt acts. The tilt axes are horizontal for the `described` gravity.
    pub(crate) fn collect(
        problem: &Problem,
        factors: &[TriangularFactor],
        prior: &Prior,
        described: [f64; 3],
    ) -> Result<Self, IdentifyError> {
        let joints = problem.robot.joints.len();
        let p = problem.base.len();
        let Noise {
            deviation,
            memory,
            instants,
        } = Noise::of(problem)?;
        let step = instants.div_ceil(ENOUGH).max(1);
        // Rows that are further apart are less correlated, so each counts more.
        let weight_at = |step: u64| -> Vec<f64> {
            let one = |(s, m): (&f64, &f64)| 1.0 / (s * (m / step as f64).max(1.0).sqrt());
            deviation.iter().zip(&memory).map(one).collect()
        };
        let weights = weight_at(1);
        let mut tilt = match Axes::of(described) {
            Some(axes) => {
                let mut all = TriangularFactor::new(p);
                for (factor, weight) in factors.iter().zip(&weights) {
                    all.merge(factor, *weight);
                }
                let belief = Belief::of(prior, &problem.base.combination);
                let found = belief.posterior(&Seen::of(&all), &belief.even(1.0))?;
                let standard = prior.standard(&found.standard);
                Some(tilt_torque(problem.plan.chain, &axes, &standard))
            }
            None => None,
        };
        let mut parts = vec![TriangularFactor::new(p + TERMS); joints];
        let mut sums = vec![[[0.0; 2]; TERMS]; joints];
        let mut row = vec![0.0; p + TERMS];
        problem.each_instant(step, &mut |rows, i, weight| {
            if rows.equations.iter().all(|e| !e.keep[i]) {
                return Ok(());
            }
            let turned = match &mut tilt {
                Some(tilt) => Some(tilt.at(rows.q.iter().map(|q| q[i])).map_err(failed)?),
                None => None,
            };
            for (j, equation) in rows.equations.iter().enumerate() {
                if !equation.keep[i] {
                    continue;
                }
                row[..p].copy_from_slice(&equation.x[i * p..(i + 1) * p]);
                let mut at = p;
                for periods in std::iter::once(None).chain(PERIODS.map(Some)) {
                    at += terms_of(periods, rows.q[j][i], &mut row[at..]);
                }
                for (k, value) in row[at..].iter_mut().enumerate() {
                    *value = turned.map_or(0.0, |torque| torque[k][j]);
                }
                parts[j].push(&row, equation.y[i], weight);
                for (sum, value) in sums[j].iter_mut().zip(&row[p..]) {
                    sum[0] += value;
                    sum[1] += value * value;
                }
            }
            Ok(())
        })?;
        let spread = parts
            .iter()
            .zip(&sums)
            .map(|(part, sums)| {
                let count = part.rows().max(1) as f64;
                sums.map(|[sum, squares]| (squares / count - (sum / count).powi(2)).max(0.0).sqrt())
            })
            .collect();
        Ok(Self {
            parts,
            spread,
            weights: weight_at(step),
        })
    }

    /// Returns, per joint, the residual squares for these values of the base columns and of `terms`.
    pub(crate) fn left(&self, terms: &[Term], values: &DVector<f64>) -> Vec<f64> {
        let p = self.parts.first().map_or(0, TriangularFactor::columns) - TERMS;
        let of = |(j, part): (usize, &TriangularFactor)| {
            let mut all = vec![0.0; p + TERMS];
            all[..p].copy_from_slice(&values.as_slice()[..p]);
            let mut at = p;
            for term in terms {
                for c in term.columns() {
                    all[p + c] = if term.at(j) { values[at] } else { 0.0 };
                    at += 1;
                }
            }
            part.residual_squares(&all)
        };
        self.parts.iter().enumerate().map(of).collect()
    }

    /// Returns the squares of a joint's torque.
    pub(crate) fn squares(&self, joint: usize) -> f64 {
        self.parts[joint].right_side_squares()
    }

    /// Joins all joints' rows with their weights; the columns of `terms` follow those of the base.
    pub(crate) fn joined(&self, terms: &[Term]) -> Seen {
        let p = self.parts.first().map_or(0, TriangularFactor::columns) - TERMS;
        let more: usize = terms.iter().map(|t| t.columns().len()).sum();
        let width = p + TERMS + 1;
        let mut all = TriangularFactor::new(p + more);
        let mut row = vec![0.0; p + more];
        for (j, part) in self.parts.iter().enumerate() {
            let r = part.triangle();
            for i in 0..width {
                for (c, to) in row[..p].iter_mut().enumerate() {
                    *to = r[c * width + i];
                }
                let mut at = p;
                for term in terms {
                    for c in term.columns() {
                        let own = term.at(j);
                        row[at] = if own { r[(p + c) * width + i] } else { 0.0 };
                        at += 1;
                    }
                }
                all.push(&row, r[(width - 1) * width + i], self.weights[j]);
            }
        }
        Seen::of(&all)
    }

    /// Returns a term's values that would make all of the joint's torque, or the prior tilt; none for a still joint.
    pub(crate) fn sizes(&self, term: Term) -> Option<Vec<f64>> {
        let Term::Position { joint, .. } = term else {
            return Some(vec![LEVEL; term.columns().len()]);
        };
        let part = &self.parts[joint];
        let torque = 1.0 / unit(part.right_side_squares(), part.rows());
        let spread = &self.spread[joint][term.columns()];
        spread
            .iter()
            .map(|s| (*s > 1e-3 * spread.iter().fold(0.0, |m, s| s.max(m))).then(|| torque / s))
            .collect()
    }
}

/// Residual of the weighted fit.
struct Noise {
    /// Per joint, standard deviation; one if there is no residual.
    deviation: Vec<f64>,
    /// Per joint, correlation time in rows.
    memory: Vec<f64>,
    /// Instants of all recordings.
    instants: u64,
}

impl Noise {
    fn of(problem: &Problem) -> Result<Self, IdentifyError> {
        let joints = problem.robot.joints.len();
        let beta = problem.start_full();
        let p = beta.len();
        let mut memories = vec![Autocorrelation::default(); joints];
        let mut left = vec![0.0; joints];
        let mut instants = 0;
        for recording in problem.training {
            let differential = ModelKind::Differential;
            each_rows(*recording, problem.plan, differential, &mut |rows| {
                instants += rows.t.len() as u64;
                for (j, equation) in rows.equations.iter().enumerate() {
                    for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                        let e =
                            equation.y[i] - dot_in_order(&equation.x[i * p..(i + 1) * p], &beta);
                        memories[j].push(e);
                        left[j] += e * e;
                    }
                }
                Ok(())
            })?;
        }
        Ok(Self {
            deviation: (left.iter().zip(&memories))
                .map(|(squares, memory)| 1.0 / unit(*squares, memory.seen()))
                .collect(),
            memory: memories
                .iter()
                .map(Autocorrelation::correlation_time)
                .collect(),
            instants,
        })
    }
}

/// Returns one over the RMS for a sum of `squares` over `rows` rows.
fn unit(squares: f64, rows: u64) -> f64 {
    let rms = (squares / rows.max(1) as f64).sqrt();
    if rms > 0.0 { 1.0 / rms } else { 1.0 }
}
