//! Columns beyond the description's parameters, and how likely they make the data.

use super::IdentifyError;
use super::ModelKind;
use super::covariance::Memory;
use super::evidence::{Belief, Seen};
use super::factor::TriangularFactor;
use super::linear::product;
use super::model::each_rows;
use super::prior::Prior;
use super::problem::Problem;
use super::tilt::{Axes, TiltColumns};

/// Periods of ripple that are looked for in one turn of the joint. One is gravity's.
pub(super) const PERIODS: std::ops::RangeInclusive<usize> = 2..=6;
/// Columns of a joint: its position, cosine and sine of each ripple, then a base not level about two axes.
const TERMS: usize = 1 + 2 * (*PERIODS.end() + 1 - *PERIODS.start()) + 2;
/// Angle, rad, within which a base that is called level is believed to be so before the data (standard deviation).
const LEVEL: f64 = 0.1;

/// A term that may be taken.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Term {
    /// Spring or ripple of a joint.
    Position {
        joint: usize,
        periods: Option<usize>,
    },
    /// A base that is not level, of all joints.
    Tilt,
}

impl Term {
    /// Where its columns stand among [`TERMS`].
    pub(super) fn columns(self) -> std::ops::Range<usize> {
        match self {
            Self::Position { periods: None, .. } => 0..1,
            Self::Position {
                periods: Some(periods),
                ..
            } => {
                let first = 1 + 2 * (periods - PERIODS.start());
                first..first + 2
            }
            Self::Tilt => TERMS - 2..TERMS,
        }
    }

    pub(super) fn is_spring(self) -> bool {
        matches!(self, Self::Position { periods: None, .. })
    }

    /// Whether joint `j` has its columns.
    fn at(self, j: usize) -> bool {
        match self {
            Self::Position { joint, .. } => joint == j,
            Self::Tilt => true,
        }
    }
}

/// The columns of a term at position `q`; one or two are filled.
pub(super) fn terms_of(periods: Option<usize>, q: f64, out: &mut [f64]) -> usize {
    match periods {
        None => {
            out[0] = q;
            1
        }
        Some(periods) => {
            let (sine, cosine) = (periods as f64 * q).sin_cos();
            (out[0], out[1]) = (cosine, sine);
            2
        }
    }
}

/// Rows of the training recordings with the columns of all terms, joint by joint.
pub(super) struct Evidence {
    parts: Vec<TriangularFactor>,
    /// By joint, RMS of each term's columns about their mean.
    spread: Vec<[f64; TERMS]>,
    /// By joint, one over the residual's standard deviation and the root of what it remembers.
    weights: Vec<f64>,
}

impl Evidence {
    /// `factors` are those of the fitted equations; they and the prior say what masses a tilt acts on, about axes that are
    /// level where gravity is `described`.
    pub(super) fn collect(
        problem: &Problem,
        factors: &[TriangularFactor],
        prior: &Prior,
        described: [f64; 3],
    ) -> Result<Self, IdentifyError> {
        let joints = problem.robot.joints.len();
        let p = problem.base.len();
        let weights = weights(problem)?;
        let mut tilt = match Axes::of(described) {
            Some(axes) => {
                let mut all = TriangularFactor::new(p);
                for (factor, weight) in factors.iter().zip(&weights) {
                    all.merge(factor, *weight);
                }
                let belief = Belief::of(prior, &problem.base.combination);
                let found = belief.posterior(&Seen::of(&all), &belief.even(1.0))?;
                let standard = prior.standard(&found.standard);
                Some(TiltColumns::new(problem.plan.chain, &axes, &standard))
            }
            None => None,
        };
        let mut parts = vec![TriangularFactor::new(p + TERMS); joints];
        let mut sums = vec![[[0.0; 2]; TERMS]; joints];
        let mut row = vec![0.0; p + TERMS];
        for (recording, weight) in problem.training.iter().zip(problem.recording_weights()) {
            let differential = ModelKind::Differential;
            each_rows(*recording, problem.plan, differential, &mut |rows| {
                for i in 0..rows.t.len() {
                    if !rows.equations.iter().any(|equation| equation.keep[i]) {
                        continue;
                    }
                    let turned = match &mut tilt {
                        Some(tilt) => Some(tilt.at(&rows.q, i)?),
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
                }
                Ok(())
            })?;
        }
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
            weights,
        })
    }

    /// All joints' rows at their weights, with the columns of `terms` behind the base's.
    pub(super) fn joined(&self, terms: &[Term]) -> Seen {
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

    /// What a term's values would be if it made all of the joint's torque, or a level base is taken to be off by; none where the joint stands still.
    pub(super) fn sizes(&self, term: Term) -> Option<Vec<f64>> {
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

/// By joint, one over the standard deviation of what the weighted fit leaves of the torque and the root of what it remembers.
fn weights(problem: &Problem) -> Result<Vec<f64>, IdentifyError> {
    let joints = problem.robot.joints.len();
    let beta = problem.start_full();
    let p = beta.len();
    let mut memories = vec![Memory::default(); joints];
    let mut left = vec![0.0; joints];
    for recording in problem.training {
        let differential = ModelKind::Differential;
        each_rows(*recording, problem.plan, differential, &mut |rows| {
            for (j, equation) in rows.equations.iter().enumerate() {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    let e = equation.y[i] - product(&equation.x[i * p..(i + 1) * p], &beta);
                    memories[j].push(e);
                    left[j] += e * e;
                }
            }
            Ok(())
        })?;
    }
    let one =
        |(squares, memory): (&f64, &Memory)| unit(*squares, memory.seen()) / memory.length().sqrt();
    Ok(left.iter().zip(&memories).map(one).collect())
}

/// One over the RMS of what `squares` sum up to over so many rows.
fn unit(squares: f64, rows: u64) -> f64 {
    let rms = (squares / rows.max(1) as f64).sqrt();
    if rms > 0.0 { 1.0 / rms } else { 1.0 }
}
