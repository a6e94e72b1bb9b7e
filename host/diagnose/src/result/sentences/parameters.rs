//! Sentences on the nominal parameters: those that the motion does not show, and those against the description.

use rig_shared::multibody::{COLUMNS, column};

use crate::description::parameter_prior::ParameterPrior;
use crate::fit::collinear::Alike;
use crate::fit::solution::Solution;
use crate::recordings::context::DiagnosisContext;
use crate::rows::one_way::OneWay;
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit, format_value, listed};

/// Standard deviations above which a constant torque differs from zero.
const MOVED: f64 = 3.0;

/// Names a parameter that is collinear with others along the training motion.
pub(crate) fn alike(context: &DiagnosisContext, alike: &Alike) -> String {
    let name = |k: usize| context.nominal.base.expression(k);
    let own = name(alike.parameter);
    let value = context.anchor.prior[alike.parameter];
    if alike.with.is_empty() {
        return format!(
            "The training motion does not show {own}: it stays at {value}, as described or as none is stated."
        );
    }
    let others: Vec<String> = alike.with.iter().map(|k| name(*k)).collect();
    format!(
        "The training motion does not tell {own} from {}: {own} stays at {value}, as described or as none is stated, and {} the combination with it. A motion in both directions, at several speeds, would tell them apart.",
        others.join(", "),
        if others.len() == 1 {
            "that has"
        } else {
            "those have"
        }
    )
}

/// Names the joints that move in one direction only, with the sum of dry friction and constant torque.
pub(crate) fn one_way(
    list: &[OneWay],
    robot: &Robot,
    anchor: &ParameterPrior,
    last: &Solution,
) -> Vec<String> {
    (list.iter())
        .map(|own| {
            let joint = &robot.joints[own.joint];
            let held = anchor.prior[own.constant()];
            let value = (anchor.free.iter())
                .position(|d| matches!(d.as_slice(), [(k, _)] if *k == own.friction()))
                .map_or(String::new(), |k| {
                    format!(
                        " = {} {}",
                        format_value(last.values[k] + own.direction() * held, last.std(k)),
                        format_unit(joint.kind.units().1)
                    )
                });
            format!(
                "Joint {} moves in one direction only. These data tell dry friction and a constant torque as one number, {}{value}. model.toml has the constant as described, {}, and the rest as coulomb. Rows about rests are left out. Move the joint in both directions to tell them apart.",
                joint.name,
                own.named(0.0),
                format_significant(held, 4)
            )
        })
        .collect()
}

/// Lists described friction that the recordings contradict.
pub(crate) fn contradicted(context: &DiagnosisContext, list: &[(usize, f64)]) -> Vec<String> {
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
pub(crate) fn held(context: &DiagnosisContext, open: &[usize]) -> Option<String> {
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

/// Lists significant constant torques that were fitted because the format of the description has none.
pub(crate) fn offsets(context: &DiagnosisContext, after: &Solution) -> Option<String> {
    let base = &context.nominal.base.columns;
    let found: Vec<String> = (context.anchor.free.iter().enumerate())
        .filter(|(k, _)| context.anchor.is_unstated(*k))
        .filter(|(k, _)| after.values[*k].abs() > MOVED * after.std(*k))
        .filter_map(|(k, direction)| {
            let (b, _) = direction.first()?;
            let joint = context.robot.joints.get(base[*b] / COLUMNS)?;
            if base[*b] % COLUMNS != column::OFFSET {
                return None;
            }
            Some(format!(
                "{} {} at joint {}",
                format_value(after.values[k], after.std(k)),
                format_unit(joint.kind.units().1),
                joint.name
            ))
        })
        .collect();
    (!found.is_empty()).then(|| {
        format!(
            "The description has no place for a constant torque, so one was fitted beside each joint's friction, and stands in model.toml as its offset: {}.",
            listed(&found)
        )
    })
}

/// Warns of names in `[uncertainty]` that are no base parameters; `None` without any.
pub(crate) fn unknown_uncertainty(names: &[&str]) -> Option<String> {
    Some(format!(
        "[uncertainty] of the description has {}, which this robot does not have as a base parameter: it was not used. If the joints, the geometry or the drives were changed by hand, remove the table or identify again (`rig identify`).",
        first_of(names, "names")?
    ))
}

/// Warns of base parameters that `[uncertainty]` leaves out; `None` without any.
pub(crate) fn exact(names: &[&str]) -> Option<String> {
    Some(format!(
        "[uncertainty] of the description has nothing for {}: the described value counts as exact, so a small difference is told as a change.",
        first_of(names, "base parameters")?
    ))
}

/// Returns the first of some names and the number of the others, which are `what`; `None` without any.
fn first_of(names: &[&str], what: &str) -> Option<String> {
    let (first, others) = names.split_first()?;
    Some(match others.len() {
        0 => format!("`{first}`"),
        count => format!("`{first}` and {count} more {what}"),
    })
}

/// Warns that a spring may have taken part of a link's weight: the fitted first moment `now` and its standard deviation
/// `std` are far below the described one, kg·m.
pub(crate) fn light_link(now: f64, std: f64, described: f64) -> String {
    format!(
        "Beside the spring the first moment (gravity) comes out as {}, where {} is described: a spring that stiffens looks like a straight one and a lighter link. Weigh the link, or record without the spring, before you believe either.",
        format_value(now, std),
        format_significant(described, 3)
    )
}
