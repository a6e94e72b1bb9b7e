//! Pictures, sentences and limits of a finished search.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::outcome::Diagnosis;
use crate::recordings::noise_floor::repeats;
use crate::result::found::Found;
use crate::result::sentences::effect::why;
use crate::result::sentences::recordings::{self, Untested};
use crate::result::sentences::residual::floor_how;
use crate::result::sentences::verdict::verdict;
use crate::result::{limits, pictures};

/// Fills in the results that the search does not produce.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn finish(found: &Found, diagnosis: &mut Diagnosis) -> Result<(), DiagnoseError> {
    diagnosis.maps = pictures::maps(found);
    diagnosis.curves = pictures::curves(found);
    for (step, profile) in diagnosis.steps.iter_mut().zip(found.found()) {
        step.why = why(found, step, profile);
    }
    let pairs = repeats(found.search.source.runs);
    diagnosis.noise_floor_how = floor_how(found, &pairs);
    diagnosis.not_testable = limits::not_testable(found)?;
    diagnosis.detectable = limits::detectable(found, &diagnosis.not_testable)?;
    diagnosis.next_experiment = limits::next(found, diagnosis, found.model)?;
    let not_tested = recordings::untested(&untested(found, diagnosis, !pairs.is_empty()));
    diagnosis.words = (not_tested.into_iter())
        .chain(verdict(diagnosis, !pairs.is_empty()))
        .collect();
    Ok(())
}

/// Returns what the recordings did not test although a verdict depends on it.
///
/// Friction near standstill is untested if, for some shape, a law as large as the dry friction would not have been
/// detected. Presliding turns all dry friction into such a law.
fn untested<'a>(found: &'a Found, diagnosis: &'a Diagnosis, repeated: bool) -> Untested<'a> {
    let friction = |name: &str| {
        let own = found.model.joints.iter().find(|joint| joint.name == name)?;
        Some(own.friction.as_ref()?.coulomb.abs())
    };
    let named = |joint: &str| {
        let own = |effect: &str, at: &str| at == joint && is_near_rest(effect);
        (diagnosis.steps.iter()).any(|step| own(&step.effect, &step.joint))
            || (diagnosis.described.iter()).any(|stated| own(&stated.effect, &stated.joint))
    };
    let lacking = (diagnosis.not_testable.iter())
        .filter(|lacking| is_near_rest(&lacking.effect))
        .map(|lacking| lacking.joint.as_str());
    let small = (diagnosis.detectable.iter())
        .filter(|size| is_near_rest(&size.effect))
        .filter(|size| {
            let worst = size.size_at_worst.unwrap_or(size.size);
            friction(&size.joint).is_some_and(|coulomb| coulomb > 0.0 && worst > coulomb)
        })
        .map(|size| size.joint.as_str());
    let mut joints: Vec<&str> = lacking.chain(small).filter(|joint| !named(joint)).collect();
    joints.sort_unstable();
    joints.dedup();
    Untested {
        near_standstill: joints,
        one_way: (found.one_way.iter())
            .map(|own| found.robot.joints[own.joint].name.as_str())
            .collect(),
        other_motion: diagnosis.waterfall.iter().all(|w| w.holdout.is_empty()),
        noise: !repeated,
    }
}

/// Returns true if an effect of this name is friction near standstill.
fn is_near_rest(effect: &str) -> bool {
    let stribeck = |kind: Kind| matches!(kind, Kind::Stribeck | Kind::StribeckExponential);
    Kind::from_name(effect, None).is_some_and(|kind| kind.is_presliding() || stribeck(kind))
}
