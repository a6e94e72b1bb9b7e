//! What an identification adds to the description beyond values of its parameters.

use rig_shared::effects::Kind;
use rig_shared::transmission::DriveKind;

use super::evidence::Belief;
use super::factor::TriangularFactor;
use super::position::{PositionTorque, effect};
use super::prior::Prior;
use super::problem::Problem;
use super::terms::{Evidence, PERIODS, Term};
use super::tilt::{Axes, BaseTilt};
use super::{Estimator, IdentifyError};
use crate::robot::{JointKind, Robot};

/// Gain in the logarithm of the evidence from which on a term is taken: 2·ln B = 10, "very strong" (Kass & Raftery 1995).
const VERY_STRONG: f64 = 5.0;
/// Candidates of the description's relative uncertainty in the search.
const STEPS: usize = 9;

/// Springs, ripple and a base that is not level.
#[derive(Clone, Debug, Default)]
pub(super) struct Beyond {
    /// Torques that go with a joint's position.
    pub torques: Vec<PositionTorque>,
    /// Gravity.
    pub tilt: Option<BaseTilt>,
}

impl Beyond {
    pub(super) fn is_empty(&self) -> bool {
        self.torques.is_empty() && self.tilt.is_none()
    }

    /// Sentences.
    pub(super) fn said(&self) -> impl Iterator<Item = String> + '_ {
        let tilt = self.tilt.iter().map(BaseTilt::said);
        tilt.chain(self.torques.iter().map(PositionTorque::said))
    }
}

/// `robot` with all that.
pub(super) fn with_beyond(
    robot: &Robot,
    torques: &[PositionTorque],
    tilt: Option<&BaseTilt>,
) -> Robot {
    let mut robot = robot.clone();
    robot
        .effects
        .extend(torques.iter().map(|f| f.effect.clone()));
    if let Some(tilt) = tilt {
        robot.gravity = tilt.gravity;
    }
    robot
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
    if Axes::of(robot.gravity).is_some() {
        all.push(Term::Tilt);
    }
    for (joint, of) in robot.joints.iter().enumerate() {
        if !states(joint, Kind::Spring) {
            all.push(Term::Position {
                joint,
                periods: None,
            });
        }
        let alone = drives.iter().all(|kind| *kind == DriveKind::Simple);
        if alone && of.kind == JointKind::Revolute && !states(joint, Kind::GearEccentricity) {
            all.extend(PERIODS.map(|periods| Term::Position {
                joint,
                periods: Some(periods),
            }));
        }
    }
    all
}

/// What the data show beyond the description. `factors` are those of the fitted equations.
pub(super) fn beyond(
    problem: &Problem,
    factors: &[TriangularFactor],
    prior: &Prior,
) -> Result<Beyond, IdentifyError> {
    // Blocks that stand in for links say nothing of inertia.
    if Estimator::for_robot(problem.robot) != Estimator::Ridge {
        return Ok(Beyond::default());
    }
    let data = Evidence::collect(problem, factors, prior)?;
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
            let pulls = !term.is_spring() || found.standard[tried.centre.len() - 1] > 0.0;
            if pulls && best.as_ref().is_none_or(|b| found.evidence > b.0) {
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
        return Ok(Beyond::default());
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
    let mut result = Beyond::default();
    for (term, log_evidence) in taken.into_iter().zip(gains) {
        let own = at..at + term.columns().len();
        at = own.end;
        let values: Vec<f64> = own.clone().map(|c| found.standard[c]).collect();
        let std: Vec<f64> = own.map(|c| found.variance[c].sqrt()).collect();
        let (joint, periods) = match (term, Axes::of(problem.robot.gravity)) {
            (Term::Position { joint, periods }, _) => (joint, periods),
            (Term::Tilt, Some(axes)) => {
                let [angles, std] = [values, std].map(|v| [v[0], v[1]]);
                result.tilt = Some(BaseTilt::of(&axes, angles, std, log_evidence));
                continue;
            }
            (Term::Tilt, None) => continue,
        };
        // A later term may have left a spring nothing.
        if periods.is_none() && values[0] <= 0.0 {
            continue;
        }
        let motor = [ratios[joint], zero[joint]];
        result.torques.push(PositionTorque {
            joint: problem.robot.joints[joint].name.clone(),
            periods,
            std,
            log_evidence,
            effect: effect(problem.robot, joint, periods, &values, motor),
            values,
        });
    }
    Ok(result)
}
