//! Remarks beside the verdict: treatment of recordings, parameters held as described, recordings that are too similar.

use rig_shared::effects::Kind;

use crate::fit::open_parameters::Open;
use crate::fit::solution::Solution;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::noise_floor;
use crate::result::sentences::offsets;
use crate::rows::one_way::told;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit, format_value};

/// Ratio of the fitted to the described first moment below which a link is too light beside a spring.
const LIGHT: f64 = 0.5;
/// Standard deviations by which the fitted first moment must differ from the described one for that remark.
const CLEAR: f64 = 5.0;

/// Warns that a spring took part of a link's weight: a stiffening spring is like a linear one with less weight.
pub(crate) fn weight_of_a_spring(
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
    light.then(|| {
        format!(
            "Beside the spring the first moment (gravity) comes out as {}, where {} is described: a spring that stiffens looks like a straight one and a lighter link. Weigh the link, or record without the spring, before you believe either.",
            format_value(now, last.std(weight)),
            format_significant(described, 3)
        )
    })
}

/// Returns sentences on the recordings, the described parameters that are held or contradicted (`open`), the sensor
/// readings with the drive off, and the constants of the last model.
pub(crate) fn remarks(
    context: &DiagnosisContext,
    prepared: &PreparedData,
    held_out: Option<&PreparedData>,
    open: &Open,
    sensor_zeros: &[[f64; 2]],
    last: &Solution,
) -> Vec<String> {
    let mut words = Vec::new();
    words.extend(held_out.and_then(|held_out| own_rate(context, held_out)));
    words.extend(read_off(context.robot, sensor_zeros));
    words.extend(offsets(context, last));
    words.extend(contradicted(context, &open.contradicted));
    words.extend(held(context, &open.held));
    words.extend(told(&context.one_way, context.robot, &context.anchor, last));
    words.extend(held_out.and_then(|held_out| no_other_motion(prepared, held_out)));
    words
}

/// Says that the hold-out has another sample rate than the training data.
fn own_rate(context: &DiagnosisContext, held_out: &PreparedData) -> Option<String> {
    let [learnt, held] = [context.rate(), held_out.treatment.sample_rate];
    let label = &held_out.runs.first()?.label;
    (learnt != held).then(|| {
        format!(
            "{label} is judged at its own rate, {held:.1} Hz where {learnt:.1} Hz were learnt from{}.",
            match learnt > held {
                true => format!("; its noise floor is taken as {:.2} times that of the others", (learnt / held).sqrt()),
                false => String::new(),
            }
        )
    })
}

/// Returns the sensor readings with the drive off.
fn read_off(robot: &Robot, zeros: &[[f64; 2]]) -> Vec<String> {
    (robot.joints.iter().zip(zeros))
        .map(|(joint, [value, std])| {
            format!(
                "With the drive off the sensor of joint {} reads {} {}.",
                joint.name,
                format_value(*value, *std),
                format_unit(joint.kind.units().1)
            )
        })
        .collect()
}

/// Says that the hold-out repeats the training motion.
fn no_other_motion(prepared: &PreparedData, held_out: &PreparedData) -> Option<String> {
    let (own, same) = noise_floor::repeated(&prepared.runs, &held_out.runs)?;
    Some(format!(
        "The hold-out {} repeats the motion of {}: it shows what noise a model has learnt, and not whether it holds for another motion; hold back another one.",
        own.label, same.label
    ))
}

/// Lists described friction that the recordings contradict.
fn contradicted(context: &DiagnosisContext, list: &[(usize, f64)]) -> Vec<String> {
    (list.iter())
        .map(|&(k, times)| {
            format!(
                "The recordings contradict the described {} = {} {} by {} standard deviations of the description's worth and theirs: it is not held to that.",
                context.nominal.base.expression(k),
                format_significant(context.anchor.prior[k], 3),
                format_unit(context.nominal.base.unit(k)),
                format_significant(times, 2)
            )
        })
        .collect()
}

/// Lists parameters that stay as described.
fn held(context: &DiagnosisContext, open: &[usize]) -> Option<String> {
    let names: Vec<String> = (open.iter().map(|&k| context.nominal.base.expression(k))).collect();
    (!names.is_empty()).then(|| {
        format!(
            "The training motion tells less of {} than the description, so {} as described as far as bodies can be so: {}.",
            if names.len() == 1 {
                "one base parameter"
            } else {
                "some base parameters"
            },
            if names.len() == 1 {
                "it stays"
            } else {
                "they stay"
            },
            names.join(", ")
        )
    })
}
