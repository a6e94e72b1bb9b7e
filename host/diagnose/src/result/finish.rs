//! Pictures, sentences and limits of a finished search.

use crate::DiagnoseError;
use crate::acceptance::coordinates::Coordinate;
use crate::description::parameter_prior::ParameterPrior;
use crate::fit::least_squares::Fit;
use crate::models::simulated_motion::Positions;
use crate::outcome::Diagnosis;
use crate::recordings::noise_floor::repeats;
use crate::result::{limits, pictures, sentences};
use crate::rows::nominal::Nominal;
use crate::rows::one_way::OneWay;
use crate::rows::regression::Rows;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;
use rig_data::runs::Run;
use rig_model::robot::Robot;

/// Results of the search.
pub(crate) struct Found<'a, 'r> {
    /// Robot as given.
    pub(crate) robot: &'a Robot,
    /// Base parameters of the robot.
    pub(crate) nominal: &'a Nominal,
    /// Free base parameters.
    pub(crate) anchor: &'a ParameterPrior,
    /// Candidate library with the training data.
    pub(crate) search: &'a Search<'r>,
    /// Training data minus the torque of held parameters.
    pub(crate) rows: &'a Rows,
    /// Nominal model fitted to them.
    pub(crate) base: &'a Fit<'r>,
    /// Description with the found effects.
    pub(crate) model: &'a Robot,
    /// All effects, those of the description first.
    pub(crate) chosen: &'a [FittedCandidate],
    /// Number of effects from the description.
    pub(crate) described: usize,
    /// Coordinates of the training data, joint by joint.
    pub(crate) coordinates: &'a [Vec<Coordinate>],
    /// Noise floor, joint by joint.
    pub(crate) floors: &'a [f64],
    /// … obtained without a model; NaN if unknown.
    pub(crate) known: &'a [f64],
    /// Seed of the bootstrap.
    pub(crate) seed: u64,
    /// Sensor readings with the drive off, if recorded.
    pub(crate) sensor_zeros: &'a [[f64; 2]],
    /// Joints that move in one direction only.
    pub(crate) one_way: &'a [OneWay],
    /// Recordings to draw.
    pub(crate) drawn: Drawn<'a>,
}

impl<'a> Found<'a, '_> {
    /// Returns the effects that the description does not state.
    pub(crate) fn found(&self) -> &'a [FittedCandidate] {
        &self.chosen[self.described..]
    }
}

/// Recordings and the models' torque residuals, joint by joint over the rows.
pub(crate) struct Drawn<'a> {
    /// In the order of the rows.
    pub(crate) runs: &'a [Run],
    /// Rows of the recordings.
    pub(crate) rows: &'a Rows,
    /// Residuals of the refitted description and of the model with all effects.
    pub(crate) left: [Vec<Vec<f64>>; 2],
    /// Simulated positions of the same models, run by run; empty if not simulated.
    pub(crate) motion: [Vec<Positions>; 2],
}

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
