//! What a factor between a column and what it should hold is called.

use crate::robot::{Joint, JointKind};

/// A factor and what makes it.
type Named = (f64, String);

/// Turns of the motor per turn of the joint, where the description states a ratio that tells.
fn ratio(joint: &Joint) -> Option<f64> {
    let ratio = joint.drive.as_ref()?.gear_ratio.abs();
    (ratio > 1.5 || (ratio > 0.0 && ratio < 0.67)).then_some(ratio)
}

/// Whether a torque that is recorded `factor` times too large may be one that the joint's ratio was left out of or applied
/// twice to.
pub(super) fn is_ratio(joint: &Joint, factor: f64) -> bool {
    let apart = |r: f64| (factor.abs() / r).ln().abs() <= 1.6f64.ln();
    ratio(joint).is_some_and(|r| apart(r) || apart(1.0 / r))
}

/// Names of a factor within `tolerance` of it, the nearest first, joined; none where there is none.
fn of(factor: f64, tolerance: f64, list: &[Named]) -> Option<String> {
    let apart = |f: &f64| (factor.abs() / f).ln().abs();
    let mut near: Vec<&Named> = list
        .iter()
        .filter(|(f, _)| apart(f) <= tolerance.ln())
        .collect();
    near.sort_by(|(a, _), (b, _)| apart(a).total_cmp(&apart(b)));
    let near: Vec<&str> = near.iter().map(|(_, name)| name.as_str()).collect();
    (!near.is_empty()).then(|| near.join(", or "))
}

/// A torque that is recorded `factor` times too large.
pub(super) fn of_torque(joint: &Joint, factor: f64) -> Option<String> {
    let (small, large) = match joint.kind {
        JointKind::Revolute => ("mN·m (N·mm)", "kN·m"),
        JointKind::Prismatic => ("mN", "kN"),
    };
    let mut list = vec![
        (
            1000.0,
            format!("as {small} for the joint's unit or mA for A would be"),
        ),
        (1e-3, format!("as {large} or A for mA would be")),
        (57.296, "as a constant per degree would make it".to_owned()),
        (
            1.0 / 57.296,
            "as a constant per degree would make it".to_owned(),
        ),
        (
            9.549,
            "as a motor constant per rpm (or kgf·cm for N·m) would make it".to_owned(),
        ),
        (
            1.0 / 9.549,
            "as a motor constant per rpm would make it".to_owned(),
        ),
    ];
    if let Some(n) = ratio(joint) {
        list.push((
            1.0 / n,
            format!("as the motor's torque is before its gear ({n} to 1)"),
        ));
        list.push((
            n,
            format!("as if the gear ratio ({n}) had been applied twice"),
        ));
    }
    // A fitted scale is uncertain by what the description's own values are.
    of(factor, 1.6, &list)
}

/// A position that has to be multiplied by `factor`.
pub(super) fn of_position(joint: &Joint, factor: f64) -> Option<String> {
    let mut list = match joint.kind {
        JointKind::Revolute => vec![
            (
                1.0 / 57.296,
                "it looks like degrees; give it in rad".to_owned(),
            ),
            (
                57.296,
                "it has been turned from degrees to rad twice".to_owned(),
            ),
            (
                core::f64::consts::TAU,
                "it looks like turns; give it in rad".to_owned(),
            ),
        ],
        JointKind::Prismatic => vec![
            (1e-3, "it looks like millimetres; give it in m".to_owned()),
            (1000.0, "it has been turned from mm to m twice".to_owned()),
        ],
    };
    for (factor, word) in [(0.5, "twice"), (2.0, "half")] {
        list.push((
            factor,
            format!(
                "it is {word} what it should be; check the gear ratio and the counts of the encoder"
            ),
        ));
    }
    if let Some(n) = ratio(joint) {
        list.push((
            1.0 / n,
            format!("it looks like the angle of the motor; divide it by the gear ratio {n}"),
        ));
        list.push((
            n,
            format!("it has been divided by the gear ratio {n} twice"),
        ));
    }
    // Gravity's period or the velocity tell the factor closely.
    of(factor, 1.12, &list)
}

/// A measured velocity that has to be multiplied by `factor`.
pub(super) fn of_velocity(joint: &Joint, factor: f64) -> Option<String> {
    let mut list = match joint.kind {
        JointKind::Revolute => vec![
            (
                core::f64::consts::PI / 30.0,
                "revolutions per minute".to_owned(),
            ),
            (1.0 / 57.296, "degrees per second".to_owned()),
            (core::f64::consts::TAU, "turns per second".to_owned()),
        ],
        JointKind::Prismatic => vec![(1e-3, "millimetres per second".to_owned())],
    };
    if let Some(n) = ratio(joint) {
        list.push((1.0 / n, "the speed of the motor".to_owned()));
        list.push((
            core::f64::consts::PI / (30.0 * n),
            "revolutions per minute of the motor".to_owned(),
        ));
    }
    of(factor, 1.12, &list)
}

/// A clock that advances `factor` times as fast as it should.
pub(super) fn of_clock(factor: f64) -> &'static str {
    let seconds = [
        (1e6, "microseconds; give it in s"),
        (1000.0, "milliseconds; give it in s"),
        (1.0 / 60.0, "minutes; give it in s"),
        (1e-3, "thousands of seconds; give it in s"),
    ];
    seconds
        .iter()
        .find(|(f, _)| (factor / f).ln().abs() <= 0.47)
        .map_or("something else than seconds; give it in s", |(_, name)| {
            name
        })
}
