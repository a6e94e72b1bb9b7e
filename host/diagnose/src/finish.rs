//! What follows from a finished search: pictures, sentences, limits.

use super::anchor::Anchor;
use super::fit::Fit;
use super::floor::repeats;
use super::locate::Coordinate;
use super::motion::Positions;
use super::one_way::OneWay;
use super::outcome::Diagnosis;
use super::profile::Profile;
use super::rows::{Nominal, Rows};
use super::search::Search;
use super::{DiagnoseError, limits, pictures, sentences};
use rig_data::runs::Run;
use rig_model::robot::Robot;

/// What the search has left behind.
pub(super) struct Found<'a, 'r> {
    /// As it was given.
    pub(super) robot: &'a Robot,
    /// Its base parameters.
    pub(super) nominal: &'a Nominal,
    /// Which of them were free.
    pub(super) anchor: &'a Anchor,
    /// The library with the training data.
    pub(super) search: &'a Search<'r>,
    /// The training data, less what held parameters give.
    pub(super) rows: &'a Rows,
    /// The nominal model on them.
    pub(super) base: &'a Fit<'r>,
    /// The description with what was found.
    pub(super) model: &'a Robot,
    /// The effects, those of the description first.
    pub(super) chosen: &'a [Profile],
    /// How many of them are the description's.
    pub(super) described: usize,
    /// Coordinates of the training data, joint by joint.
    pub(super) coordinates: &'a [Vec<Coordinate>],
    /// Noise floor, joint by joint.
    pub(super) floors: &'a [f64],
    /// … that no model made; NaN where none is known.
    pub(super) known: &'a [f64],
    /// Of the bootstrap.
    pub(super) seed: u64,
    /// What the sensors read with the drive off, where that was recorded.
    pub(super) sensor_zeros: &'a [[f64; 2]],
    /// Joints that move in one direction only.
    pub(super) one_way: &'a [OneWay],
    /// Recordings to draw.
    pub(super) drawn: Drawn<'a>,
}

impl<'a> Found<'a, '_> {
    /// The effects that the description does not state.
    pub(super) fn found(&self) -> &'a [Profile] {
        &self.chosen[self.described..]
    }
}

/// Recordings with what the models leave of their torque, joint by joint over the rows.
pub(super) struct Drawn<'a> {
    /// In the order of the rows.
    pub(super) runs: &'a [Run],
    /// Where the rows are.
    pub(super) rows: &'a Rows,
    /// Left by the refitted description and by the model with all effects.
    pub(super) left: [Vec<Vec<f64>>; 2],
    /// Positions that the same models give when simulated, run by run; empty where they are not.
    pub(super) motion: [Vec<Positions>; 2],
}

/// Fills what the search itself does not.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(super) fn finish(found: &Found, diagnosis: &mut Diagnosis) -> Result<(), DiagnoseError> {
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

/// What the recordings did not test although it decides what a verdict is worth, a sentence; none where they did.
///
/// Friction near standstill is not tested where a law of it as large as the joint's dry friction would not have shown at some of its
/// shapes: presliding turns all of the dry friction into one.
fn untested(found: &Found, diagnosis: &Diagnosis, repeated: bool) -> Option<String> {
    let near_rest = ["presliding", "stribeck"];
    let friction = |name: &str| {
        let own = found.model.joints.iter().find(|joint| joint.name == name)?;
        Some(own.friction.as_ref()?.coulomb.abs())
    };
    let named = |joint: &str| {
        let own = |effect: &str, at: &str| at == joint && near_rest.contains(&effect);
        (diagnosis.steps.iter()).any(|step| own(&step.effect, &step.joint))
            || (diagnosis.described.iter()).any(|stated| own(&stated.effect, &stated.joint))
    };
    let lacking = (diagnosis.not_testable.iter())
        .filter(|lacking| near_rest.contains(&lacking.effect.as_str()))
        .map(|lacking| lacking.joint.as_str());
    let small = (diagnosis.detectable.iter())
        .filter(|size| near_rest.contains(&size.effect.as_str()))
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
