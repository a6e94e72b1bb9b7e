//! Remarks beside the verdict: treatment of recordings, parameters held as described, recordings that are too similar.

use rig_shared::effects::Kind;

use crate::description::lifted_limit::LiftedLimit;
use crate::fit::collinear::Alike;
use crate::fit::open_parameters::Open;
use crate::fit::solution::Solution;
use crate::models::parameter_change::Change;
use crate::models::remark::ModelRemark;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::disturbance::Touch;
use crate::recordings::encoder_zero::Shift;
use crate::result::sentences::model::{change, remark};
use crate::result::sentences::parameters::{
    alike, contradicted, exact, held, light_link, offsets, one_way, unknown_uncertainty,
};
use crate::result::sentences::recordings::{
    another_zero, lifted, no_other_motion, own_rate, read_off, touch,
};
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::Robot;

/// Ratio of the fitted to the described first moment below which a link is too light beside a spring.
const LIGHT: f64 = 0.5;
/// Standard deviations by which the fitted first moment must differ from the described one for that remark.
const CLEAR: f64 = 5.0;

/// Returns sentences on segments left out as disturbances, then on collinear parameters.
pub(crate) fn of_intake(
    context: &DiagnosisContext,
    touches: &[Touch],
    collinear: &[Alike],
) -> Vec<String> {
    let touches = touches.iter().map(|own| touch(context.robot, own));
    let collinear = collinear.iter().map(|own| alike(context, own));
    touches.chain(collinear).collect()
}

/// Returns remarks on the written model.
pub(crate) fn of_model(robot: &Robot, remarks: &[ModelRemark]) -> Vec<String> {
    remarks.iter().map(|own| remark(robot, own)).collect()
}

/// What the last remarks of a result are about.
pub(crate) struct Remarked<'a> {
    /// Robot and treatment.
    pub(crate) context: &'a DiagnosisContext<'a>,
    /// The training data.
    pub(crate) prepared: &'a PreparedData,
    /// The hold-out.
    pub(crate) held_out: Option<&'a PreparedData>,
    /// The ignored torque limits.
    pub(crate) limits: &'a [LiftedLimit],
    /// A recording with another zero.
    pub(crate) zero: Option<Shift>,
    /// Sensor readings with the drive off, with their standard deviations.
    pub(crate) sensor_zeros: &'a [[f64; 2]],
    /// Described parameters that are held or contradicted.
    pub(crate) open: &'a Open,
    /// A change of the nominal parameters.
    pub(crate) change: Option<Change>,
    /// All effects.
    pub(crate) chosen: &'a [FittedCandidate],
    /// Coefficients of the last model.
    pub(crate) last: &'a Solution,
}

/// Returns sentences on the recordings, the described parameters that are held, contradicted or changed, the sensor
/// readings with the drive off, and the constants of the last model.
pub(crate) fn remarks(on: &Remarked) -> Vec<String> {
    let Remarked { context, last, .. } = *on;
    let robot = context.robot;
    let mut words: Vec<String> = on.limits.iter().map(lifted).collect();
    // Zeros are compared on robots of one joint only.
    let zero = on.zero.as_ref().zip(robot.joints.first());
    words.extend(zero.map(|(shift, joint)| another_zero(joint, shift)));
    words.extend(on.held_out.and_then(|held_out| own_rate(context, held_out)));
    words.extend(read_off(robot, on.sensor_zeros));
    words.extend(uncertainty(context));
    words.extend(offsets(context, last));
    words.extend(contradicted(context, &on.open.contradicted));
    words.extend(held(context, &on.open.held));
    words.extend(one_way(&context.one_way, robot, &context.anchor, last));
    words.extend((on.held_out).and_then(|held_out| no_other_motion(on.prepared, held_out)));
    words.extend((on.change.as_ref()).map(|own| change(robot, &own.cause)));
    words.extend(weight_of_a_spring(context, on.chosen, last));
    words
}

/// Warns if `[uncertainty]` of the description and the robot's base parameters do not match, as after a change of the
/// geometry: what does not match counts as exact.
fn uncertainty(context: &DiagnosisContext) -> Vec<String> {
    let stated = &context.robot.uncertainty;
    if stated.is_empty() {
        return Vec::new();
    }
    let base = &context.nominal.base;
    let own: Vec<String> = (0..base.len()).map(|k| base.expression(k)).collect();
    let unknown: Vec<&str> = stated
        .names()
        .filter(|name| !own.iter().any(|o| o == name))
        .collect();
    let missing = own.iter().filter(|name| stated.along(name).is_empty());
    let missing: Vec<&str> = missing.map(String::as_str).collect();
    [unknown_uncertainty(&unknown), exact(&missing)]
        .into_iter()
        .flatten()
        .collect()
}

/// Warns if a spring took part of a link's weight: a stiffening spring is like a linear one with less weight.
fn weight_of_a_spring(
    context: &DiagnosisContext,
    chosen: &[FittedCandidate],
    last: &Solution,
) -> Option<String> {
    let anchor = &context.anchor;
    if !anchor.stated || chosen.iter().all(|p| p.candidate.kind != Kind::Spring) {
        return None;
    }
    let prior = anchor.prior_coefficients();
    let weight = anchor.first_moment(&context.nominal)?;
    let [now, described] = [last.values[weight], prior[weight]];
    let light =
        now.abs() < LIGHT * described.abs() && (described - now).abs() > CLEAR * last.std(weight);
    light.then(|| light_link(now, last.std(weight), described))
}
