//! Pictures, sentences and limits of a finished search.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::outcome::Diagnosis;
use crate::recordings::noise_floor::repeats;
use crate::result::found::Found;
use crate::result::{limits, pictures, sentences};

/// Fills in the results that the search does not produce.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn finish(found: &Found, diagnosis: &mut Diagnosis) -> Result<(), DiagnoseError> {
    diagnosis.maps = pictures::maps(found);
    diagnosis.curves = pictures::curves(found);
    for (step, profile) in diagnosis.steps.iter_mut().zip(found.found()) {
        step.why = sentences::why(found, step, profile);
    }
    let pairs = repeats(found.search.source.runs);
    diagnosis.noise_floor_how = sentences::floor_how(found, &pairs);
    diagnosis.not_testable = limits::not_testable(found)?;
    diagnosis.detectable = limits::detectable(found, &diagnosis.not_testable)?;
    diagnosis.next_experiment = limits::next(found, diagnosis, found.model)?;
    diagnosis.words = untested(found, diagnosis, !pairs.is_empty())
        .into_iter()
        .chain(sentences::verdict(diagnosis, !pairs.is_empty()))
        .collect();
    Ok(())
}

/// Returns a sentence on what the recordings did not test although a verdict depends on it; `None` if they tested all.
///
/// Friction near standstill is untested if, for some shape, a law as large as the dry friction would not have been
/// detected. Presliding turns all dry friction into such a law.
fn untested(found: &Found, diagnosis: &Diagnosis, repeated: bool) -> Option<String> {
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
    let mut parts = Vec::new();
    if !joints.is_empty() {
        parts.push(format!(
            "friction near standstill at joint {} (no slow reversals among these recordings, or too few; `rig excite --kind reversals`)",
            joints.join(", ")
        ));
    }
    if !found.one_way.is_empty() {
        let names: Vec<&str> = (found.one_way.iter())
            .map(|own| found.robot.joints[own.joint].name.as_str())
            .collect();
        parts.push(format!("the other direction of joint {}", names.join(", ")));
    }
    if diagnosis.waterfall.iter().all(|w| w.holdout.is_empty()) {
        parts.push("another motion (no hold-out)".into());
    }
    if !repeated {
        parts.push("what is noise (no motion was recorded twice)".into());
    }
    (!parts.is_empty()).then(|| format!("Not tested: {}.", parts.join("; ")))
}

/// Returns true if an effect of this name is friction near standstill.
fn is_near_rest(effect: &str) -> bool {
    let stribeck = |kind: Kind| matches!(kind, Kind::Stribeck | Kind::StribeckExponential);
    Kind::named(effect, None).is_some_and(|kind| kind.is_presliding() || stribeck(kind))
}
