//! Sentences on the recordings: disturbances, zeros, limits, rates, and what they do not test.

use crate::description::lifted_limit::LiftedLimit;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::disturbance::Touch;
use crate::recordings::encoder_zero::{Against, Shift};
use crate::recordings::noise_floor;
use rig_model::robot::{Joint, Robot};
use rig_output::{format_significant, format_unit, format_value};

/// Says where a disturbance was left out of two runs.
pub(crate) fn touch(robot: &Robot, touch: &Touch) -> String {
    let [from, to] = touch.time;
    let [own, other] = &touch.labels;
    format!(
        "Joint {}: from {from:.1} to {to:.1} s after its start {own} differs from {other}, the same motion, {} times as much as elsewhere. Something touched the joint or held it there, or that piece is damaged; {} of half a second left out of both.",
        robot.joints[touch.joint].name,
        format_significant(touch.times, 2),
        match touch.count {
            1 => "one stretch is".to_owned(),
            n => format!("{n} stretches are"),
        }
    )
}

/// Says that a recording seems to have another zero of its only joint.
pub(crate) fn another_zero(joint: &Joint, shift: &Shift) -> String {
    format!(
        "In {} joint {} seems to stand {} {} off against {}: with a zero of its own {:.0} % less is left. Give all recordings one zero (--home), or look whether something else has changed.",
        shift.label,
        joint.name,
        format_value(-shift.by[0], shift.by[1]),
        joint.kind.units().0,
        match shift.against {
            Against::OtherRecordings => "the other recordings",
            Against::Training => "those to learn from",
        },
        100.0 * shift.gain
    )
}

/// Says that a described torque limit was left out.
pub(crate) fn lifted(lifted: &LiftedLimit) -> String {
    let unit = format_unit(lifted.unit);
    format!(
        "The torque of joint {} goes up to {} {unit}, beyond the {} {unit} that the description gives as its limit, for {} % of the time: that limit was left out, here and in the description that comes out. Correct it, or check the unit, the gear ratio and the torque constant.",
        lifted.joint,
        format_significant(lifted.most, 3),
        format_significant(lifted.limit, 3),
        format_significant(lifted.percent, 2),
    )
}

/// Says that the hold-out has another sample rate than the training data.
pub(crate) fn own_rate(context: &DiagnosisContext, held_out: &PreparedData) -> Option<String> {
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
pub(crate) fn read_off(robot: &Robot, zeros: &[[f64; 2]]) -> Vec<String> {
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
pub(crate) fn no_other_motion(prepared: &PreparedData, held_out: &PreparedData) -> Option<String> {
    let (own, same) = noise_floor::repeated(&prepared.runs, &held_out.runs)?;
    Some(format!(
        "The hold-out {} repeats the motion of {}: it shows what noise a model has learnt, and not whether it holds for another motion; hold back another one.",
        own.label, same.label
    ))
}

/// What the recordings did not test although a verdict depends on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Untested<'a> {
    /// Joints whose friction near standstill was not tested.
    pub(crate) near_standstill: Vec<&'a str>,
    /// Joints that move in one direction only.
    pub(crate) one_way: Vec<&'a str>,
    /// True without a hold-out.
    pub(crate) other_motion: bool,
    /// True without a repeated motion.
    pub(crate) noise: bool,
}

/// Says what was not tested; `None` if everything was.
pub(crate) fn untested(untested: &Untested) -> Option<String> {
    let mut parts = Vec::new();
    if !untested.near_standstill.is_empty() {
        parts.push(format!(
            "friction near standstill at joint {} (no slow reversals among these recordings, or too few; `rig excite --kind reversals`)",
            untested.near_standstill.join(", ")
        ));
    }
    if !untested.one_way.is_empty() {
        parts.push(format!(
            "the other direction of joint {}",
            untested.one_way.join(", ")
        ));
    }
    if untested.other_motion {
        parts.push("another motion (no hold-out)".into());
    }
    if untested.noise {
        parts.push("what is noise (no motion was recorded twice)".into());
    }
    (!parts.is_empty()).then(|| format!("Not tested: {}.", parts.join("; ")))
}
