//! What a name says about the quantity of a channel.

use crate::time_names::words;
use crate::unit::Unit;

/// Quantity that a name states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Named {
    Position,
    MotorPosition,
    LinkPosition,
    Velocity,
    Acceleration,
    Effort,
    MotorEffort,
    Current,
    Voltage,
    Temperature,
    Reference,
}

impl Named {
    /// All quantities.
    pub(super) const ALL: [Self; 11] = [
        Self::Position,
        Self::MotorPosition,
        Self::LinkPosition,
        Self::Velocity,
        Self::Acceleration,
        Self::Effort,
        Self::MotorEffort,
        Self::Current,
        Self::Voltage,
        Self::Temperature,
        Self::Reference,
    ];

    /// Returns the column without its number.
    pub(super) fn column(self) -> &'static str {
        match self {
            Self::Position => "q",
            Self::MotorPosition => "qm",
            Self::LinkPosition => "ql",
            Self::Velocity => "qd",
            Self::Acceleration => "qdd",
            Self::Effort => "tau",
            Self::MotorEffort => "taum",
            Self::Current => "i",
            Self::Voltage => "u",
            Self::Temperature => "temp",
            Self::Reference => "ref",
        }
    }
}

/// Words of quantities that are not measured: a channel with one of them is none of the columns below.
const OTHER: [&str; 20] = [
    "error",
    "err",
    "std",
    "cov",
    "covariance",
    "ext",
    "external",
    "diff",
    "delta",
    "status",
    "mode",
    "flag",
    "raw",
    "filtered",
    "tcp",
    "pose",
    "cartesian",
    "limit",
    "min",
    "max",
];

/// Words of a reference.
const WANTED: [&str; 12] = [
    "ref",
    "reference",
    "target",
    "desired",
    "des",
    "cmd",
    "command",
    "commanded",
    "setpoint",
    "goal",
    "demand",
    "nominal",
];

/// Words of each quantity; the first that fits counts.
const QUANTITIES: [(Named, &[&str]); 7] = [
    (
        Named::Acceleration,
        &["qdd", "ddq", "acc", "acceleration", "accelerations"],
    ),
    (
        Named::Velocity,
        &[
            "qd",
            "dq",
            "vel",
            "velocity",
            "velocities",
            "speed",
            "omega",
            "qdot",
        ],
    ),
    (Named::Temperature, &["temp", "temperature", "temperatures"]),
    (
        Named::Current,
        &["i", "iq", "cur", "curr", "current", "currents", "amps"],
    ),
    (Named::Voltage, &["u", "volt", "voltage", "voltages"]),
    (
        Named::Effort,
        &[
            "tau", "trq", "torque", "torques", "effort", "efforts", "moment",
        ],
    ),
    (
        Named::Position,
        &[
            "q",
            "pos",
            "position",
            "positions",
            "angle",
            "angles",
            "theta",
            "phi",
            "encoder",
            "enc",
        ],
    ),
];

/// Returns the quantity that a name states.
pub(super) fn quantity(words: &[String]) -> Option<Named> {
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    if has(&OTHER) {
        return None;
    }
    let found = QUANTITIES
        .iter()
        .find(|(_, list)| has(list))
        .map(|(own, _)| *own)?;
    // `q_d` and `tau_J_d` of some drivers are desired values.
    let wanted = has(&WANTED) || words.iter().skip(1).any(|w| w == "d");
    let motor = has(&["motor", "rotor"]);
    match (found, wanted, motor) {
        (Named::Position, true, _) => Some(Named::Reference),
        (_, true, _) => None,
        (Named::Position, _, true) => Some(Named::MotorPosition),
        (Named::Position, ..) if has(&["link", "output", "load"]) => Some(Named::LinkPosition),
        (Named::Effort, _, true) => Some(Named::MotorEffort),
        (other, ..) => Some(other),
    }
}

/// Returns the axis of a wrench that a name states, as the column.
pub(super) fn wrench(words: &[String]) -> Option<&'static str> {
    const AXES: [(&str, &str, &str); 3] = [("x", "fx", "mx"), ("y", "fy", "my"), ("z", "fz", "mz")];
    let last = words.last()?;
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    for (axis, force, moment) in AXES {
        for column in [force, moment] {
            if words.len() == 1 && last == column {
                return Some(column);
            }
        }
        // `Tx` is the moment in the files of some sensors.
        if words.len() == 1 && *last == format!("t{axis}") {
            return Some(moment);
        }
        if last == axis && has(&["force", "forces", "f"]) {
            return Some(force);
        }
        if last == axis && has(&["torque", "moment", "torques", "moments"]) {
            return Some(moment);
        }
    }
    None
}

/// Returns the unit that a name states: `q1 [deg]`, `position_deg`, and `positionDeg` as the field of a message.
pub(super) fn unit(name: &str) -> Option<Unit> {
    let field = name.rsplit_once('/').map_or(name, |(field, _)| field);
    let words = words(field);
    Unit::stated(name)
        .or_else(|| Unit::stated(field))
        .map(|(_, unit)| unit)
        .or_else(|| last_word(&words))
}

/// Returns the unit that the name of an array in messages states: `position_deg`, `positionDeg`.
pub(super) fn unit_of_array(name: &str) -> Option<Unit> {
    let stated = Unit::stated(name).map(|(_, unit)| unit);
    stated.or_else(|| last_word(&words(name)))
}

/// Returns the unit that the last word of a name states, apart from a number behind it.
fn last_word(words: &[String]) -> Option<Unit> {
    let is_number = |word: &&String| word.bytes().all(|b| b.is_ascii_digit());
    let word = words.iter().rev().find(|word| !is_number(word))?;
    let is_whole = words.len() == 1 || word.len() < 2;
    (!is_whole && words.first() != Some(word))
        .then(|| Unit::named(word))
        .flatten()
}

/// Returns the last whole number in a name.
pub(super) fn number(words: &[String]) -> Option<usize> {
    words.iter().rev().find_map(|word| word.parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_usual_loggers_state_their_quantity() {
        for (name, want) in [
            ("actual_q_0", Some(Named::Position)),
            ("target_q_3", Some(Named::Reference)),
            ("actual_qd_2", Some(Named::Velocity)),
            ("actual_current_5", Some(Named::Current)),
            ("target_moment_1", None),
            ("actual_TCP_force_1", None),
            ("joint_temperatures_0", Some(Named::Temperature)),
            ("tau_J_4", Some(Named::Effort)),
            ("tau_J_d_4", None),
            ("tau_ext_hat_filtered_4", None),
            ("q_d_2", Some(Named::Reference)),
            ("position/elbow_joint", Some(Named::Position)),
            ("MotorTorque2", Some(Named::MotorEffort)),
            ("jointAngle1", Some(Named::Position)),
            ("gripper_state", None),
        ] {
            assert_eq!(quantity(&words(name)), want, "{name}");
        }
        assert_eq!(wrench(&words("wrench/force/x")), Some("fx"));
        assert_eq!(wrench(&words("wrench/torque/z")), Some("mz"));
        assert_eq!(wrench(&words("Fy")), Some("fy"));
        assert_eq!(wrench(&words("torque_2")), None);
    }
}
