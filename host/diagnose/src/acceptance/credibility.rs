//! Effects that fail the joint fit of all effects.

use std::f64::consts::TAU;

use rig_shared::effects::{GAINS, Kind};

use crate::DiagnoseError;
use crate::acceptance::judge::Judge;
use crate::acceptance::plausibility::Asked;
use crate::columns::kinds::is_gear;
use crate::fit::refit::Refit;
use crate::levels::{NOTHING, SIGNIFICANT};
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::refusal::Refusal;
use crate::search::stepwise::Search;

/// Number of inertia gains of a coupling. They come first; the last gain is friction.
const OF_INERTIA: usize = 2;
/// Largest share of the twist torque that an accepted gear may have. Mass and load of the link give 1 at most; real
/// gears of the emulated rig give 0.7 to 1.1.
const MOST_OF_A_TWIST: f64 = 4.0 / 3.0;
/// Largest amplitude of a joint encoder error, rad. 1.5 times the largest catalogue value (0.6 mm off centre on a ring
/// of 20 mm radius). A larger one belongs to another wave, such as friction under load.
const MOST_OF_AN_ENCODER: f64 = 0.03;
/// Returns the least credible effect beside the others, with the reason; None if all are credible.
///
/// # Errors
/// [`DiagnoseError`] of the fit.
pub(crate) fn unbelieved(
    refit: &Refit,
    search: &Search,
    judge: &Judge,
    chosen: &[FittedCandidate],
) -> Result<Option<(usize, Refusal)>, DiagnoseError> {
    let found = search.count_given(chosen)..chosen.len();
    if found.is_empty() {
        return Ok(None);
    }
    let joint = refit.joint(&search.source, chosen, &judge.pairs, judge.coordinates)?;
    let free = refit.free.len();
    let asked = Asked {
        search,
        joint: &joint,
        free,
        chosen,
    };
    if let Some(implausible) = asked.implausible(found.clone()) {
        return Ok(Some(implausible));
    }
    let nothing = (found.clone())
        .filter(|k| !is_gear(chosen[*k].candidate.kind))
        .map(|k| (k, joint.of_nothing(chosen, free, k, GAINS)))
        .filter(|(_, p)| *p > NOTHING)
        .max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((k, _)) = nothing {
        return Ok(Some((k, Refusal::Nothing)));
    }
    let couples = |k: &usize| chosen[*k].candidate.kind == Kind::InertiaCoupling;
    for k in found.clone().filter(couples) {
        if joint.of_nothing(chosen, free, k, OF_INERTIA) > SIGNIFICANT {
            return Ok(Some((k, Refusal::NoInertia)));
        }
    }
    let reads = |k: &usize| chosen[*k].candidate.kind == Kind::EncoderEccentricityJoint;
    for k in found.clone().filter(reads) {
        let amplitude = joint
            .gains(chosen, free, k)
            .iter()
            .fold(0.0, |a: f64, g| a.hypot(*g));
        if amplitude > MOST_OF_AN_ENCODER {
            return Ok(Some((k, Refusal::FarOffCentre)));
        }
    }
    for k in found.filter(|k| is_gear(chosen[*k].candidate.kind)) {
        let shares = joint.gains(chosen, free, k);
        if shares.iter().any(|share| *share > MOST_OF_A_TWIST) {
            return Ok(Some((k, Refusal::MoreThanTheLink)));
        }
        if resonance(search, &chosen[k])? > 0.5 / judge.rows.period {
            return Ok(Some((k, Refusal::BeyondBand)));
        }
    }
    Ok(None)
}

/// Returns the resonance of the link on its gear with the motor locked, Hz.
fn resonance(search: &Search, gear: &FittedCandidate) -> Result<f64, DiagnoseError> {
    let shapes = gear.candidate.kind.about().shapes;
    let stiffness = (shapes.iter().zip(&gear.shapes)).find(|(shape, _)| shape.name == "stiffness");
    let mass = search.source.mass(gear.candidate.joint, 0)?;
    Ok(stiffness.map_or(0.0, |(_, stiffness)| (stiffness / mass).sqrt() / TAU))
}

#[cfg(test)]
mod tests;
