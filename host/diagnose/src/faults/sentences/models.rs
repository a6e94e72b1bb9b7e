//! Faults that models show, in words.

use core::f64::consts::{PI, TAU};

use super::names;
use crate::faults::gravity::OTHER_WAY;
use crate::faults::misfit::{Misfit, Needs, Reversal, Sense};
use crate::faults::names::Name;
use crate::faults::undo::Columns;
use rig_model::robot::{Joint, JointKind, Robot};
use rig_output::{
    format_short, format_significant, format_trimmed, format_unit, format_value, listed,
};

/// Relative difference below which two factors are the same.
const SAME: f64 = 0.1;

/// Returns sentences on a fault of the joint `j` (from 0), or of several.
pub(super) fn of(robot: &Robot, j: usize, found: &Misfit) -> String {
    let (n, joint) = (j + 1, &robot.joints[j]);
    match *found {
        Misfit::Clipped {
            level,
            excess,
            percent,
        } => clipped(robot, j, [level, excess, percent]),
        Misfit::Shifted { shift, left } => shifted(n, shift, left),
        Misfit::Scaled {
            factor,
            reversed,
            ref name,
            left,
        } => format!(
            "q{n} fits its torque {} times as large (the model then {}): {}.",
            format_trimmed(factor, 4),
            leaves(left, ""),
            mend_scaled(factor, reversed, name.as_ref())
        ),
        Misfit::AllScaled { factor, left } => all_scaled(factor, left),
        Misfit::ThroughGears {
            torque,
            twice,
            left,
        } => through_gears(robot, torque, twice, left),
        Misfit::Zero { angle, left } => zero(joint, n, angle, left),
        Misfit::Reversed {
            torque,
            other,
            left,
        } => reversed(n, torque, other, left),
        Misfit::AxisReversed { left } => format!(
            "q{n} and tau{n} are both counted the other way round, so the axis of joint {} points the other way than the description says: with both reversed the model {}; reverse the joint's axis in the description, or both columns.",
            joint.name,
            leaves(left, "")
        ),
        Misfit::Order {
            which,
            ref order,
            twin,
            left,
        } => in_order(robot, which, order, twin, left),
        Misfit::Opposed {
            loss,
            inertia,
            sense,
        } => opposed(n, [loss, inertia], sense),
        Misfit::GravityTurned { angle, left } => gravity_turned(angle, left),
        Misfit::LevelAxis { strength, stated } => level_axis(joint, [strength, stated]),
        Misfit::StrongestElsewhere { at, stated, off } => elsewhere(joint, [at, stated], off),
        Misfit::GravityReversed { times, held } => gravity_reversed(n, times, held),
        Misfit::Thousandfold {
            ref joints,
            factors,
            large,
        } => thousandfold(robot, joints, factors, large),
        Misfit::TorqueTimes {
            factor,
            needs,
            ref name,
        } => torque_times(n, factor, needs, name.as_ref()),
        Misfit::InertiaTimes { times } => inertia_times(times),
        Misfit::Alike {
            factor,
            weight,
            viscous,
            dry,
        } => alike(n, [factor, weight, viscous, dry]),
        Misfit::HeavyRotor { rotor, whole } => heavy_rotor(joint, [rotor, whole]),
        Misfit::GainChanged {
            between,
            factor,
            left,
        } => gain_changed(n, between, factor, left),
        Misfit::Magnitude { percent } => format!(
            "tau{n} is never negative though the joint turns both ways: it is a magnitude whose sign was lost (by the motion it should be negative for about {percent:.0} % of the time). Record the signed torque or current; a register of load or current that is read as unsigned has the sign in its highest bit or in the two's complement."
        ),
    }
}

/// Returns a clause on how much better a fit is without a fault, at the joints `beside`.
fn leaves(left: [f64; 2], beside: &str) -> String {
    let [recorded, without] = left.map(|share| 100.0 * share);
    format!("leaves {without:.1} % of the torque's variance{beside}, as recorded {recorded:.1} %")
}

fn clipped(robot: &Robot, j: usize, [level, excess, percent]: [f64; 3]) -> String {
    let unit = format_unit(robot.joints[j].kind.units().1);
    format!(
        "tau{} is cut at {} {unit} for {percent:.0} % of the time, where the motion needs {} {unit} more on average; record without the limit, or a motion that needs less.",
        j + 1,
        format_short(level),
        format_significant(excess, 2),
    )
}

/// Formats an angle with the resolution of a fit of gravity.
fn hundredths(angle: f64) -> String {
    format_significant((100.0 * angle).round() / 100.0, 3)
}

fn gain_changed(n: usize, [from, to]: [f64; 2], [factor, std]: [f64; 2], left: [f64; 2]) -> String {
    format!(
        "tau{n} is {} times as large after the change at t = {from:.2} … {to:.2} s as before (with its gain undone, the model {}); no load, no friction and no drift that changes there explains as much. Values of the whole recording belong to neither part: look for a range of the current sensor, a torque constant or a unit that was switched, divide the later torque by this factor or multiply the earlier one by it, or cut the recording there.",
        format_value(factor, std),
        leaves(left, "")
    )
}

fn shifted(n: usize, shift: f64, left: [f64; 2]) -> String {
    let (word, mend) = match shift > 0.0 {
        true => ("behind", "earlier"),
        false => ("ahead of", "later"),
    };
    let [recorded, without] = left.map(|share| 100.0 * share);
    format!(
        "tau{n} is {:.2} s {word} q{n}: moved that much {mend}, the model leaves {without:.1} % of its variance, as recorded {recorded:.1} %; give both by one clock.",
        shift.abs()
    )
}

/// Returns the correction of a scaled position, a clause.
fn mend_scaled(factor: f64, reversed: bool, named: Option<&Name>) -> String {
    let what = match named {
        Some(named) if reversed => &format!("reverse it; {}", names::name(named)),
        None if (factor + 1.0).abs() < SAME => "reverse it",
        None if reversed => "reverse it, and check its factor",
        Some(named) => &names::name(named),
        None => {
            "check the gear ratio, the counts of the encoder and the unit (turns for rad ask for 6.28)"
        }
    };
    what.to_owned()
}

fn all_scaled(factor: f64, left: [f64; 2]) -> String {
    let what = match factor {
        f if f == TAU => "they look like turns; give them in rad",
        f if f < 1.0 => "they look like degrees; give them in rad",
        _ => "they have been turned from degrees to rad twice",
    };
    format!(
        "All positions fit the torques {} times as large (the description then {}): {what}.",
        format_trimmed(factor, 4),
        leaves(left, "")
    )
}

fn through_gears(robot: &Robot, torque: bool, twice: bool, left: [f64; 2]) -> String {
    let ratios: Vec<String> = (robot.joints.iter())
        .map(|joint| format_trimmed(joint.gear_ratio().abs(), 4))
        .collect();
    let ratios = listed(&ratios);
    let [count, found] = [
        robot.joints.len().to_string(),
        leaves(left, " at the joints that show it"),
    ];
    match (torque, twice) {
        (true, false) => format!(
            "The torques are those of the motors, before their gears ({ratios} to 1): multiplied by the ratios, the description {found}. Give torques at the joints, or name the columns taum1 to taum{count}."
        ),
        (true, true) => format!(
            "The gear ratios ({ratios}) have been applied twice to the torques: divided by them, the description {found}. Give torques at the joints."
        ),
        (false, false) => format!(
            "The positions are those of the motors ({ratios} turns for one of the joint): divided by the ratios, the description {found}. Give positions of the joints, or name the columns qm1 to qm{count}."
        ),
        (false, true) => format!(
            "The positions have been divided by the gear ratios ({ratios}) twice: multiplied by them, the description {found}. Give positions of the joints."
        ),
    }
}

fn zero(joint: &Joint, n: usize, angle: f64, left: [f64; 2]) -> String {
    format!(
        "Gravity fits with the zero of joint {} turned by {:.0} degrees (q{n} {} {} rad): the description then {}. Count q{n} from the description's zero, or turn the joint's origin in the description (`theta`, in a URDF the `rpy`).",
        joint.name,
        angle.to_degrees(),
        if angle < 0.0 { "−" } else { "+" },
        format_significant(angle.abs(), 3),
        leaves(left, " at the joints that show it")
    )
}

fn reversed(n: usize, torque: bool, other: Reversal, left: [f64; 2]) -> String {
    let [column, beside] = match torque {
        true => ["tau", "q"],
        false => ["q", "tau"],
    };
    let or = match other {
        Reversal::AgainstReference => format!(", against which ref{n} runs as well,"),
        Reversal::OrOther => format!(" (or {beside}{n})"),
        Reversal::Alone => String::new(),
    };
    format!(
        "{column}{n}{or} is counted the other way round: reversed, the model {}; reverse it.",
        leaves(left, "")
    )
}

fn in_order(robot: &Robot, which: Columns, order: &[usize], twin: bool, left: [f64; 2]) -> String {
    let moved: Vec<usize> = (0..order.len()).filter(|j| order[*j] != *j).collect();
    let stand: Vec<usize> = moved.iter().map(|j| order[*j]).collect();
    let names = |column: &str, joints: &[usize]| {
        let all: Vec<String> = (joints.iter().map(|j| format!("{column}{}", j + 1))).collect();
        listed(&all)
    };
    let (column, other) = match which {
        Columns::Torques => ("tau", "q"),
        Columns::Positions | Columns::Joints => ("q", "tau"),
    };
    let or = match twin {
        true => format!(" (or {})", names(other, &moved)),
        false => String::new(),
    };
    let compared = format!("the model {}", leaves(left, ""));
    let joint = |j: usize| format!("joint {} ({})", j + 1, robot.joints[j].name);
    match (which, moved.as_slice()) {
        (Columns::Joints, [a, b]) => format!(
            "The columns of {} and {} stand in each other's place, all of them: exchanged, {compared}; number them in the order of the description.",
            joint(*a),
            joint(*b)
        ),
        (Columns::Joints, _) => format!(
            "The joints stand in another order than in the description: what belongs to joints {} stands in the columns of joints {}. In the right order {compared}; number them in the order of the description.",
            names("", &moved),
            names("", &stand)
        ),
        (_, [_, _]) => format!(
            "{}{or} stand in each other's columns: swapped, {compared}; give each its own.",
            names(column, &moved)
        ),
        _ => format!(
            "{}{or} stand in another order than the joints: what belongs there stands in {}. In the right order {compared}; give each its own.",
            names(column, &moved),
            names(column, &stand)
        ),
    }
}

fn opposed(n: usize, [loss, inertia]: [f64; 2], sense: Sense) -> String {
    let which = match sense {
        Sense::Reference => format!("ref{n} runs against q{n} as well, so reverse q{n}"),
        Sense::GravityRight => format!("gravity has the right sense, so reverse q{n}"),
        Sense::GravityWrong => format!(
            "gravity has the wrong sense too, so reverse tau{n} (where a current was recorded: i{n}, or the sign of gear_ratio)"
        ),
        Sense::Open => "reverse one of them".to_owned(),
    };
    format!(
        "tau{n} and q{n} are counted in opposite senses, so one has the wrong sign: as recorded friction gives {} W and the inertia is {}, where friction takes and inertia is positive; {which}.",
        format_significant(-loss, 2),
        format_significant(inertia, 2)
    )
}

fn gravity_turned(angle: f64, left: [f64; 2]) -> String {
    let [recorded, without] = left.map(|share| 100.0 * share);
    let (points, asked) = match angle > OTHER_WAY {
        true => (
            "the other way",
            "does the arm hang upside down, or are all joints counted the other way round",
        ),
        false => ("elsewhere", "is the arm mounted on a wall or a slope"),
    };
    format!(
        "Gravity points {points} than the description says, by {angle:.0} degrees: turned by that the description leaves {without:.1} % of the torque's variance at the joints that carry weight, as it stands {recorded:.1} %; {asked}? Turn the arm by a fixed joint at the root of the URDF (`rpy` of its origin), or state `gravity` in the TOML."
    )
}

fn level_axis(joint: &Joint, torques: [f64; 2]) -> String {
    let [strength, stated] = torques.map(|x| format_significant(x, 3));
    format!(
        "Gravity acts on joint {} by up to {strength} N·m, as on an axis that lies level; by the description its axis stands upright and gravity does {stated} N·m at most: is its `alpha` right (in a URDF its `axis` and the `rpy` of its origin), and `gravity`?",
        joint.name
    )
}

fn elsewhere(joint: &Joint, strongest: [f64; 2], off: f64) -> String {
    let theta = joint.theta + off;
    let [at, stated, theta] = [
        strongest[0],
        strongest[1],
        (theta + PI).rem_euclid(TAU) - PI,
    ]
    .map(hundredths);
    format!(
        "Gravity on joint {} is strongest at q1 = {at} rad, where the description has {stated} rad: the joint's zero in this recording (`--home`), or the base, is turned by about {:.0} degrees against the description. With theta near {theta} it fits (in a URDF turn the joint's origin by its `rpy`).",
        joint.name,
        off.to_degrees()
    )
}

fn gravity_reversed(n: usize, times: f64, held: bool) -> String {
    let which = match held {
        true => format!(
            "friction and inertia have the right sense: q{n} and tau{n} are both counted the other way round, or the zero of q{n} is half a turn off"
        ),
        false => format!("reverse tau{n} or q{n}, unless the zero of q{n} is half a turn off"),
    };
    format!("Gravity acts on joint {n} {times:.2} times as the description says; {which}.")
}

fn thousandfold(robot: &Robot, joints: &[usize], factors: [f64; 2], large: bool) -> String {
    let columns: Vec<String> = joints.iter().map(|j| format!("tau{}", j + 1)).collect();
    let Some((last, others)) = columns.split_last() else {
        return String::new();
    };
    let (_, unit) = robot.joints[joints[0]].kind.units();
    let unit = format_unit(unit);
    let what = match large {
        true => format!("as m{unit} for {unit} or mA for A would be"),
        false => format!(
            "as k{unit} for {unit}, A for mA, or masses of the description in g would make it"
        ),
    };
    let [least, most] = factors.map(|x| format_significant(x, 4));
    format!(
        "{} and {last} are {least} to {most} times what the description's gravity and inertia need, {what}; give torques in {unit}, at the joints.",
        others.join(", ")
    )
}

fn inertia_times(times: f64) -> String {
    let clock = times.abs().sqrt();
    format!(
        "Gravity fits the description, but the inertia seen in the motion is {times:.4} times what it states: t looks like {}, {clock:.4} of them a second, unless the inertia described is wrong, the rotor's by the square of the gear ratio among it.",
        names::clock(clock)
    )
}

fn alike(n: usize, factors: [f64; 4]) -> String {
    let [factor, weight, viscous, dry] = factors.map(|x| format_significant(x, 3));
    format!(
        "tau{n} is {factor} times what the description's weight, viscous friction and dry friction need alike ({weight}, {viscous} and {dry} times), which no change of the robot makes; check the gear ratio and the torque constant."
    )
}

fn torque_times(n: usize, factor: f64, needs: Needs, named: Option<&Name>) -> String {
    let needs = match needs {
        Needs::Gravity => "gravity needs",
        Needs::Inertia => "inertia needs",
        Needs::Both => "gravity and inertia need",
    };
    let what = named.map_or_else(
        || "more than a change of the robot makes; check the torque constant, the ratio and the unit (mA for A, or mN·m for N·m, make it a thousand times as large)".to_owned(),
        names::name,
    );
    // On a light last link a tool may weigh many times the link.
    let tool = match factor {
        1.0..100.0 => ", or as a tool or payload that the description does not state would make it",
        _ => "",
    };
    format!(
        "tau{n} is {} times what the description's {needs}, {what}{tool}.",
        format_significant(factor, 4)
    )
}

fn heavy_rotor(joint: &Joint, inertias: [f64; 2]) -> String {
    let unit = match joint.kind {
        JointKind::Revolute => "kg·m²",
        JointKind::Prismatic => "kg",
    };
    let [rotor, whole] = inertias.map(|x| format_significant(x, 3));
    format!(
        "The description makes the rotor of joint {} alone {rotor} {unit} at the joint, by the square of the gear ratio {}; all that moves there was seen to have {whole} {unit}. Check the gear ratio, the rotor's inertia and the torque constant.",
        joint.name,
        joint.gear_ratio()
    )
}
