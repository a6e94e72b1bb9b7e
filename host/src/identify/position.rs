//! Torque that goes with the position of a joint and that the description does not state: the spring of a cable or hose,
//! and ripple of two to six periods a turn, as eccentric gears and the spokes of torque sensors have it.
//!
//! A motion of one frequency ω shows J·q̈ + c·q as (c − Jω²)·q: the data alone cannot tell a spring from an inertia, but the
//! description's inertia can. Without the spring the fit bends masses, inertias and friction until they pull like one,
//! and fails at another speed. A term is taken where it makes data and description together so much more likely as is
//! called very strong (Kass & Raftery 1995), and as many times more as there are terms to choose from; one after the
//! other, the likeliest first. Before the data a term is as likely as not to make all of the joint's torque.
//!
//! Leaves out: hysteresis of the cable, stiffness that grows with the stretch, ripple with the load or of other orders
//! (`rig diagnose` looks for these).

use rig_shared::effects::{Effect, GAINS, Kind, SHAPES};
use rig_shared::transmission::DriveKind;
use serde::Serialize;

use super::covariance::Memory;
use super::evidence::{Belief, Seen};
use super::factor::TriangularFactor;
use super::linear::product;
use super::model::each_rows;
use super::prior::Prior;
use super::problem::Problem;
use super::{Estimator, IdentifyError, ModelKind};
use crate::robot::{JointKind, Robot, RobotEffect};

/// Gain in the logarithm of the evidence from which on a term is taken: 2·ln B = 10, "very strong".
const VERY_STRONG: f64 = 5.0;
/// Periods of ripple that are looked for in one turn of the joint. One is gravity's.
const PERIODS: std::ops::RangeInclusive<usize> = 2..=6;
/// Columns of a joint: its position, then cosine and sine of each ripple.
const TERMS: usize = 1 + 2 * (*PERIODS.end() + 1 - *PERIODS.start());
/// Candidates of the description's relative uncertainty in the search.
const STEPS: usize = 9;

/// Torque that goes with a joint's position.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionTorque {
    /// Name of the joint.
    pub joint: String,
    /// Periods in one turn of the joint; none for a spring.
    pub periods: Option<usize>,
    /// Stiffness, N·m/rad or N/m; or amplitudes over the joint's own angle of cosine and sine, N·m.
    pub values: Vec<f64>,
    /// Standard deviations of the values.
    pub std: Vec<f64>,
    /// Logarithm of how many times more likely the data are with it.
    pub log_evidence: f64,
    /// As a description states it.
    pub effect: RobotEffect,
}

impl PositionTorque {
    /// N·m or N at the joint's position `q`.
    pub fn torque(&self, q: f64) -> f64 {
        let mut terms = [0.0; 2];
        terms_of(self.periods, q, &mut terms);
        product(&terms, &self.values)
    }

    /// One sentence.
    pub(super) fn said(&self) -> String {
        let what = match self.periods {
            None => format!(
                "like a spring of {:.4} ± {:.4} (N*m/rad or N/m), as a cable or hose pulls",
                self.values[0], self.std[0]
            ),
            Some(periods) => format!(
                "with {periods} periods a turn and {:.4} ± {:.4} N*m, as eccentric gears and the spokes of a torque sensor have it",
                self.values[0].hypot(self.values[1]),
                self.std[0].hypot(self.std[1])
            ),
        };
        format!(
            "Joint {}: a part of the torque goes with its position, {what}; data and description are e^{:.0} times as likely with it. It was taken off the torque before the fit, and identified.toml states it. Errors are relative to the torque as measured.",
            self.joint, self.log_evidence
        )
    }
}

/// The columns of a term at position `q`; one or two are filled.
fn terms_of(periods: Option<usize>, q: f64, out: &mut [f64]) -> usize {
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

/// `robot` with such torques among its effects.
pub(super) fn with_position_torques(robot: &Robot, found: &[PositionTorque]) -> Robot {
    let mut robot = robot.clone();
    robot.effects.extend(found.iter().map(|f| f.effect.clone()));
    robot
}

/// A term that may be taken.
#[derive(Clone, Copy, PartialEq)]
struct Term {
    joint: usize,
    periods: Option<usize>,
}

impl Term {
    /// Where its columns stand among [`TERMS`].
    fn columns(self) -> std::ops::Range<usize> {
        match self.periods {
            None => 0..1,
            Some(periods) => {
                let first = 1 + 2 * (periods - PERIODS.start());
                first..first + 2
            }
        }
    }

    /// As an effect; the gear's law counts the motor's angle, which is `ratio`·q + `zero`. The preload of a spring is the
    /// joint's offset.
    fn effect(self, robot: &Robot, values: &[f64], [ratio, zero]: [f64; 2]) -> RobotEffect {
        let (mut gains, mut shapes) = ([0.0; GAINS], [0.0; SHAPES]);
        let kind = match self.periods {
            None => {
                gains[0] = values[0];
                Kind::Spring
            }
            Some(periods) => {
                let order = periods as f64 / ratio.abs();
                let (sine, cosine) = (order * zero).sin_cos();
                let (a, b) = (values[0], values[1] * ratio.signum());
                gains[0] = a * cosine - b * sine;
                gains[1] = a * sine + b * cosine;
                shapes[0] = order;
                Kind::GearEccentricity
            }
        };
        RobotEffect {
            joint: Some(robot.joints[self.joint].name.clone()),
            other: None,
            effect: Effect {
                kind,
                gains,
                shapes,
            },
        }
    }
}

/// Rows of the training recordings with the columns of all terms, joint by joint.
struct Evidence {
    parts: Vec<TriangularFactor>,
    /// By joint, RMS of each term's columns about their mean.
    spread: Vec<[f64; TERMS]>,
    /// By joint, one over the residual's standard deviation and the root of what it remembers.
    weights: Vec<f64>,
}

impl Evidence {
    fn collect(problem: &Problem) -> Result<Self, IdentifyError> {
        let joints = problem.robot.joints.len();
        let p = problem.base.len();
        let mut parts = vec![TriangularFactor::new(p + TERMS); joints];
        let mut sums = vec![[[0.0; 2]; TERMS]; joints];
        let mut row = vec![0.0; p + TERMS];
        for (recording, weight) in problem.training.iter().zip(problem.recording_weights()) {
            let differential = ModelKind::Differential;
            each_rows(*recording, problem.plan, differential, &mut |rows| {
                for (j, equation) in rows.equations.iter().enumerate() {
                    for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                        row[..p].copy_from_slice(&equation.x[i * p..(i + 1) * p]);
                        let mut at = p;
                        for periods in std::iter::once(None).chain(PERIODS.map(Some)) {
                            at += terms_of(periods, rows.q[j][i], &mut row[at..]);
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
        let weights = parts
            .iter()
            .map(|f| unit(f.right_side_squares(), f.rows()))
            .collect();
        let mut found = Self {
            parts,
            spread,
            weights,
        };
        // Each joint by its torque first, then by what a fit leaves.
        let beta = found.joined(&[]).least_squares();
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
        for (j, weight) in found.weights.iter_mut().enumerate() {
            *weight = unit(left[j], memories[j].seen()) / memories[j].length().sqrt();
        }
        Ok(found)
    }

    /// All joints' rows at their weights, with the columns of `terms` behind the base's.
    fn joined(&self, terms: &[Term]) -> Seen {
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
                        let own = term.joint == j;
                        row[at] = if own { r[(p + c) * width + i] } else { 0.0 };
                        at += 1;
                    }
                }
                all.push(&row, r[(width - 1) * width + i], self.weights[j]);
            }
        }
        Seen::of(&all)
    }

    /// What a term's values would be if it made all of the joint's torque; none where the joint stands still.
    fn sizes(&self, term: Term) -> Option<Vec<f64>> {
        let part = &self.parts[term.joint];
        let torque = 1.0 / unit(part.right_side_squares(), part.rows());
        let spread = &self.spread[term.joint][term.columns()];
        spread
            .iter()
            .map(|s| (*s > 1e-3 * spread.iter().fold(0.0, |m, s| s.max(m))).then(|| torque / s))
            .collect()
    }
}

/// One over the RMS of what `squares` sum up to over so many rows.
fn unit(squares: f64, rows: u64) -> f64 {
    let rms = (squares / rows.max(1) as f64).sqrt();
    if rms > 0.0 { 1.0 / rms } else { 1.0 }
}

/// Terms that the description does not state already, and can state: ripple of joints that one motor alone turns.
fn candidates(problem: &Problem) -> Vec<Term> {
    let robot = problem.robot;
    let stated = robot.placed_effects();
    let states = |joint: usize, kind: Kind| {
        stated
            .iter()
            .any(|p| p.joint == joint && p.effect.kind == kind)
    };
    let drives = robot.drive_kinds();
    let mut all = Vec::new();
    for (joint, of) in robot.joints.iter().enumerate() {
        if !states(joint, Kind::Spring) {
            all.push(Term {
                joint,
                periods: None,
            });
        }
        let alone = drives.iter().all(|kind| *kind == DriveKind::Simple);
        if alone && of.kind == JointKind::Revolute && !states(joint, Kind::GearEccentricity) {
            all.extend(PERIODS.map(|periods| Term {
                joint,
                periods: Some(periods),
            }));
        }
    }
    all
}

/// The torques with position that the data show.
pub(super) fn position_torques(
    problem: &Problem,
    prior: &Prior,
) -> Result<Vec<PositionTorque>, IdentifyError> {
    // Blocks that stand in for links say nothing of inertia.
    if Estimator::for_robot(problem.robot) != Estimator::Ridge {
        return Ok(Vec::new());
    }
    let data = Evidence::collect(problem)?;
    let all: Vec<(Term, Vec<f64>)> = candidates(problem)
        .into_iter()
        .filter_map(|term| Some((term, data.sizes(term)?)))
        .collect();
    let enough = VERY_STRONG + (all.len().max(1) as f64).ln();
    let mut belief = Belief::of(prior, &problem.base.combination);
    let standard = belief.centre.len();
    let mut likely = belief.most_likely(&data.joined(&[]), STEPS)?;
    let mut taken: Vec<Term> = Vec::new();
    let mut gains = Vec::new();
    loop {
        // A first look with the deviations as they are, which tells less for a term than is in it; then the best anew.
        let mut best: Option<(f64, Term, Belief)> = None;
        for (term, sizes) in all.iter().filter(|(term, _)| !taken.contains(term)) {
            let tried = belief.with(sizes);
            let seen = data.joined(&[taken.as_slice(), &[*term]].concat());
            let found = tried.posterior(&seen, &tried.widened(&likely.deviation))?;
            let pulls_back = term.periods.is_some() || found.standard[tried.centre.len() - 1] > 0.0;
            if pulls_back && best.as_ref().is_none_or(|b| found.evidence > b.0) {
                best = Some((found.evidence, *term, tried));
            }
        }
        let Some((_, term, tried)) = best else { break };
        taken.push(term);
        let with = tried.most_likely(&data.joined(&taken), STEPS)?;
        let gain = with.evidence - likely.evidence;
        if gain <= enough {
            taken.pop();
            break;
        }
        gains.push(gain);
        (belief, likely) = (tried, with);
    }
    if taken.is_empty() {
        return Ok(Vec::new());
    }
    let found = belief.posterior(&data.joined(&taken), &likely.deviation)?;
    let zeros = vec![0.0; problem.robot.joints.len()];
    let mut zero = zeros.clone();
    let failed =
        |e: rig_shared::transmission::TransmissionError| IdentifyError::Model(e.to_string());
    let drives = problem.plan.transmission;
    drives.motor_position(&zeros, &mut zero).map_err(failed)?;
    let mut ratios = zeros.clone();
    let ones = vec![1.0; zeros.len()];
    drives
        .motor_velocity(&zeros, &ones, &mut ratios)
        .map_err(failed)?;
    let mut at = standard;
    let mut result = Vec::new();
    for (term, log_evidence) in taken.into_iter().zip(gains) {
        let own = at..at + term.columns().len();
        at = own.end;
        let values: Vec<f64> = own.clone().map(|c| found.standard[c]).collect();
        // A later term may have left a spring nothing.
        if term.periods.is_none() && values[0] <= 0.0 {
            continue;
        }
        result.push(PositionTorque {
            joint: problem.robot.joints[term.joint].name.clone(),
            periods: term.periods,
            std: own.map(|c| found.variance[c].sqrt()).collect(),
            log_evidence,
            effect: term.effect(
                problem.robot,
                &values,
                [ratios[term.joint], zero[term.joint]],
            ),
            values,
        });
    }
    Ok(result)
}
