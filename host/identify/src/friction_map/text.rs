//! A map in words, and the reasons why there is none.

use super::law;
use super::law::Decision;
use super::map::{DroppedPass, FrictionPoint};
use crate::error::IdentifyError;
use rig_model::robot::JointKind;
use rig_output::{format_p_value, format_significant};

/// Describes the decision in words.
pub(super) fn text_of(decision: &Decision, points: &[FrictionPoint], kind: JointKind) -> String {
    let (velocity, torque) = match kind {
        JointKind::Revolute => ("rad/s", "N·m"),
        JointKind::Prismatic => ("m/s", "N"),
    };
    let slow = points
        .iter()
        .map(|p| p.speed.abs())
        .fold(f64::INFINITY, f64::min);
    let (Some(b), Some(p)) = (&decision.stribeck, decision.p_value) else {
        return format!(
            "{} stretches are too few to judge a Stribeck term; seven at clearly different speeds are needed.",
            points.len()
        );
    };
    let simple = &decision.simple;
    if decision.warranted {
        return format!(
            "A Stribeck term is warranted (p = {}): friction is {:.4} {torque} above Coulomb friction at standstill and falls with a Stribeck velocity of {:.4} {velocity}; points left out are predicted to {:.4} instead of {:.4} {torque}.",
            format_p_value(p),
            b.breakaway_excess,
            b.stribeck_velocity.unwrap_or(0.0),
            b.leave_one_out_rms,
            simple.leave_one_out_rms
        );
    }
    let tested = format!(
        "These {} points, from {slow:.4} {velocity} on,",
        points.len()
    );
    if b.breakaway_excess < 0.0 && p < 0.05 {
        return format!(
            "{tested} do not warrant a Stribeck term: friction is lower at low speed than Coulomb and viscous friction say (p = {}), which no Stribeck law does; look at the torque's limits and at the motion's clock.",
            format_p_value(p)
        );
    }
    let untold = "a Stribeck velocity below the slowest speed would not show";
    let less = if p >= law::WARRANT {
        format!("(p = {})", format_significant(p, 2))
    } else {
        // The F-test alone accepts the term, so the text names the failed criterion.
        format!(
            "(p = {}, but its size is less certain than it is large, or points left out are predicted no better: {} against {} {torque})",
            format_p_value(p),
            format_significant(b.leave_one_out_rms, 3),
            format_significant(simple.leave_one_out_rms, 3)
        )
    };
    format!(
        "{tested} do not warrant a Stribeck term beside Coulomb and viscous friction {less}; {untold}."
    )
}

/// Returns the error for stretches without different speeds.
pub(super) fn one_speed(joint: &str) -> IdentifyError {
    IdentifyError::FrictionMap(format!(
        "All stretches of joint {joint} have the same speed; a friction map needs several."
    ))
}

pub(super) fn too_few(
    joint: &str,
    points: &[FrictionPoint],
    dropped: &[DroppedPass],
) -> IdentifyError {
    let back = points.iter().filter(|p| p.speed < 0.0).count();
    let why = dropped.first().map_or(String::new(), |first| {
        format!(
            " {} more gave no point, the first of them at {:.4} from {:.2} s on: {}.",
            dropped.len(),
            first.speed,
            first.start,
            first.why
        )
    });
    IdentifyError::FrictionMap(format!(
        "Joint {joint} moves at constant speed in {} stretches ({back} backwards, {} forwards); a friction map needs at least four and both directions.{why}",
        points.len(),
        points.len() - back
    ))
}
