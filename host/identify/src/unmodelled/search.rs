//! Search for effects beyond the description, by the evidence of the data.

use rig_shared::effects::Kind;
use rig_shared::transmission::DriveKind;

use super::beyond::{Beyond, with_values};
use super::term_rows::Evidence;
use super::terms::{PERIODS, Term};
use super::tilt::Axes;
use crate::bodies::evidence::Belief;
use crate::bodies::prior::Prior;
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;
use rig_model::robot::JointKind;

/// Gain in log evidence above which a term is added: 2·ln B = 10, "very strong" (Kass & Raftery 1995).
const VERY_STRONG: f64 = 5.0;
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
pub(crate) fn beyond(
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
