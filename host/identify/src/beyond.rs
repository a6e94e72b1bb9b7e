//! Effects that an identification adds to the description: springs, ripple and a tilted base.

use nalgebra::DMatrix;
use rig_shared::effects::Kind;
use rig_shared::transmission::DriveKind;

use super::IdentifyError;
use super::consistent::consistent;
use super::evidence::Belief;
use super::factor::TriangularFactor;
use super::position::{PositionTorque, effect};
use super::prior::Prior;
use super::problem::{Problem, singular};
use super::terms::{Evidence, PERIODS, Term};
use super::tilt::{Axes, BaseTilt};
use rig_model::robot::{JointKind, Robot};

/// Gain in log evidence above which a term is added: 2·ln B = 10, "very strong" (Kass & Raftery 1995).
const VERY_STRONG: f64 = 5.0;
/// Share of a term's standard deviation below which a change of it is ignored.
const SETTLED: f64 = 0.25;
/// Share of a joint's squared residual that a term must remove, at one joint at least: a twentieth of its RMS. Evidence
/// alone is not enough: it grows with the recording, and friction errors at reversals repeat with every period of the
/// motion. On simulated arms without any term the best candidate removed 1 to 8 % (IRp-6, TX40; 600 to 1400 s). On the
/// LWR4+ the accepted terms removed 15 to 76 %.
const MATERIAL: f64 = 0.1;
/// Share of a joint's RMS torque above which its residual is not attributed to its spring or ripple. With a wrong zero,
/// axis or length in the description, every position-dependent term seems to help.
const MOST_LEFT: f64 = 0.3;
/// Number of candidates of the description's relative uncertainty in the search.
const STEPS: usize = 9;

/// Identified springs, ripple and base tilt.
#[derive(Clone, Debug, Default)]
pub(super) struct Beyond {
    /// Torques that depend on a joint's position.
    pub torques: Vec<PositionTorque>,
    /// Tilt of the base.
    pub tilt: Option<BaseTilt>,
}

impl Beyond {
    pub(super) fn is_empty(&self) -> bool {
        self.torques.is_empty() && self.tilt.is_none()
    }

    /// Returns the terms with their gains in evidence, and their values in the same order.
    fn terms(&self, robot: &Robot) -> (Vec<(Term, f64)>, Vec<f64>) {
        let mut values = Vec::new();
        let mut terms = Vec::new();
        for torque in &self.torques {
            let Some(joint) = robot.joints.iter().position(|j| j.name == torque.joint) else {
                continue;
            };
            let term = Term::Position {
                joint,
                periods: torque.periods,
            };
            terms.push((term, torque.log_evidence));
            values.extend(&torque.values);
        }
        if let Some(tilt) = &self.tilt {
            terms.push((Term::Tilt, tilt.log_evidence));
            values.extend(tilt.angles);
        }
        (terms, values)
    }

    /// Returns one sentence per term.
    pub(super) fn said(&self) -> impl Iterator<Item = String> + '_ {
        let tilt = self.tilt.iter().map(BaseTilt::said);
        tilt.chain(self.torques.iter().map(PositionTorque::said))
    }
}

/// Returns `robot` with these torques and this tilt.
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

/// Returns the terms that the description can state and does not yet; ripple only if all drives are simple.
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

/// Finds the effects that the data show beyond the description. `factors` are those of the fitted equations.
pub(super) fn beyond(
    problem: &Problem,
    factors: &[TriangularFactor],
    prior: &Prior,
) -> Result<Beyond, IdentifyError> {
    // Substitute bodies carry no information about inertia.
    if !prior.stated {
        return Ok(Beyond::default());
    }
    let data = Evidence::collect(problem, factors, prior, problem.robot.gravity)?;
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
        let without = belief.judged(&data.joined(&taken), &likely.deviation)?;
        let without = data.left(&taken, &belief.base_values(&without.standard));
        // Screen with fixed deviations, which underestimates the gain of a term; then optimise for the best term.
        let mut best: Option<(f64, Term, Belief)> = None;
        for (term, sizes) in all.iter().filter(|(term, _)| !taken.contains(term)) {
            let tried = belief.with(sizes);
            let terms = [taken.as_slice(), &[*term]].concat();
            let seen = data.joined(&terms);
            let found = tried.judged(&seen, &tried.widened(&likely.deviation))?;
            let pulls = !term.is_spring() || found.standard[tried.centre.len() - 1] > 0.0;
            let left = data.left(&terms, &tried.base_values(&found.standard));
            let share = (without.iter().zip(&left)).map(|(without, with)| 1.0 - with / without);
            let material = share.fold(f64::NEG_INFINITY, f64::max) >= MATERIAL;
            let holds = match term {
                Term::Position { joint, .. } => {
                    left[*joint] <= MOST_LEFT * MOST_LEFT * data.squares(*joint)
                }
                Term::Tilt => true,
            };
            if pulls && material && holds && best.as_ref().is_none_or(|b| found.evidence > b.0) {
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
    let values = &found.standard.as_slice()[standard..];
    let p = problem.base.len();
    let covariance = found.base().view_range(p.., p..).into_owned();
    let list: Vec<(Term, f64)> = taken.into_iter().zip(gains).collect();
    with_values(problem, &list, values, &covariance, problem.robot.gravity)
}

/// Converts terms, each with its gain in evidence, to effects of a description. `values` and their covariance are in
/// the order of the terms; gravity is the described one.
fn with_values(
    problem: &Problem,
    terms: &[(Term, f64)],
    values: &[f64],
    covariance: &DMatrix<f64>,
    gravity: [f64; 3],
) -> Result<Beyond, IdentifyError> {
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
    let mut at = 0;
    let mut result = Beyond::default();
    for &(term, log_evidence) in terms {
        let own = at..at + term.columns().len();
        at = own.end;
        let (joint, periods) = match (term, Axes::of(gravity)) {
            (Term::Position { joint, periods }, _) => (joint, periods),
            (Term::Tilt, Some(axes)) => {
                let angles = [values[own.start], values[own.start + 1]];
                let spread = covariance
                    .fixed_view::<2, 2>(own.start, own.start)
                    .into_owned();
                result.tilt = Some(BaseTilt::of(&axes, angles, &spread, log_evidence));
                continue;
            }
            (Term::Tilt, None) => continue,
        };
        let values = values[own.clone()].to_vec();
        // A later term may have removed the need for the spring.
        if periods.is_none() && values[0] <= 0.0 {
            continue;
        }
        let motor = [ratios[joint], zero[joint]];
        result.torques.push(PositionTorque {
            joint: problem.robot.joints[joint].name.clone(),
            periods,
            std: own.map(|c| covariance[(c, c)].max(0.0).sqrt()).collect(),
            log_evidence,
            effect: effect(problem.robot, joint, periods, &values, motor),
            values,
        });
    }
    Ok(result)
}

/// Joint refit of terms and parameters.
pub(super) struct Together {
    /// The known terms with their standard deviations. Values change only if the change exceeds their own uncertainty.
    pub terms: Beyond,
    /// True if no term changed by more than [`SETTLED`].
    pub settled: bool,
    /// Contribution of the terms' uncertainty to the covariance of all base columns.
    pub beside: DMatrix<f64>,
}

/// Refits the terms `known`, whose torques are subtracted from the rows, together with all parameters. A tilted robot
/// has different base parameters, and the masses on which a tilt acts are known better once the tilt is subtracted:
/// hence the second fit. `described` is the described gravity.
pub(super) fn together(
    problem: &Problem,
    factors: &[TriangularFactor],
    prior: &Prior,
    known: &Beyond,
    described: [f64; 3],
) -> Result<Together, IdentifyError> {
    let data = Evidence::collect(problem, factors, prior, described)?;
    let (terms, before) = known.terms(problem.robot);
    let list: Vec<Term> = terms.iter().map(|(term, _)| *term).collect();
    let mut sizes = Vec::new();
    for term in &list {
        let own = &before[sizes.len()..sizes.len() + term.columns().len()];
        sizes.extend(
            data.sizes(*term)
                .unwrap_or_else(|| own.iter().map(|v| v.abs()).collect()),
        );
    }
    let base = &problem.base.combination;
    let (p, standard) = base.shape();
    let more = sizes.len();
    let mut combination = base.clone().resize(p + more, standard + more, 0.0);
    combination
        .view_range_mut(p.., standard..)
        .fill_with_identity();
    let prior = prior.with_free(&sizes);
    let found = consistent(&data.joined(&list).quadratic(&combination), &prior)?;
    let along = prior.own(&combination) * found.spread;
    let covariance = &along * along.transpose();
    let own = covariance.view_range(p.., p..).into_owned();
    let across = covariance.view_range(..p, p..).into_owned();
    let Some(inverse) = own.clone().cholesky() else {
        return Err(singular("of what the description does not state"));
    };
    let beside = &across * inverse.solve(&across.transpose());
    let steps = &found.parameters[standard..];
    let settled = steps
        .iter()
        .enumerate()
        .all(|(k, step)| step.abs() <= SETTLED * own[(k, k)].sqrt());
    let after: Vec<f64> = if settled {
        before
    } else {
        before.iter().zip(steps).map(|(v, step)| v + step).collect()
    };
    Ok(Together {
        terms: with_values(problem, &terms, &after, &own, described)?,
        settled,
        beside,
    })
}
