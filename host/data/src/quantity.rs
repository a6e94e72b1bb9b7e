//! Quantities of a joint's columns, and their names in the file.

use super::columns::{Layout, Role};

/// Quantity of a joint's column, as in [`super::JointColumns`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Position, rad or m.
    Position,
    /// Torque or force, N·m or N.
    Effort,
    /// Measured velocity, rad/s or m/s.
    Velocity,
    /// Measured acceleration, rad/s² or m/s².
    Acceleration,
    /// Reference position, rad or m.
    Reference,
    /// Motor voltage, V.
    Voltage,
    /// Temperature, °C.
    Temperature,
    /// Position on the link side of the transmission, rad or m.
    LinkPosition,
}

impl Quantity {
    /// Returns the standard name of the column, without the joint's number.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Position => "q",
            Self::Effort => "tau",
            Self::Velocity => "qd",
            Self::Acceleration => "qdd",
            Self::Reference => "ref",
            Self::Voltage => "u",
            Self::Temperature => "temp",
            Self::LinkPosition => "ql",
        }
    }

    /// Returns true if this role is the quantity's own column of the joint or its motor.
    fn is_of(self, role: Role, joint: usize) -> bool {
        let (quantity, k) = match role {
            Role::Position(k) | Role::MotorPosition(k) => (Self::Position, k),
            Role::Effort(k, _) | Role::MotorEffort(k, _) => (Self::Effort, k),
            Role::Velocity(k) => (Self::Velocity, k),
            Role::Acceleration(k) => (Self::Acceleration, k),
            Role::Reference(k) => (Self::Reference, k),
            Role::Voltage(k) | Role::Duty(k, ..) => (Self::Voltage, k),
            Role::Temperature(k) => (Self::Temperature, k),
            Role::LinkPosition(k) => (Self::LinkPosition, k),
            Role::Time | Role::None => return false,
        };
        quantity == self && k == joint
    }
}

impl Layout {
    /// Returns true if a joint's values are computed from columns of its motors.
    fn is_of_motors(&self, joint: usize, quantity: Quantity) -> bool {
        self.motors.as_ref().is_some_and(|m| match quantity {
            Quantity::Position => m.positions,
            Quantity::Effort => m.torques.get(joint) == Some(&true),
            _ => false,
        })
    }

    /// Returns true if a joint's values are converted by a drive: by its ratio or its torque constant.
    pub(super) fn is_turned(&self, joint: usize, quantity: Quantity) -> bool {
        let scaled = |role| matches!(role, Role::Effort(k, factor) if k == joint && factor != 1.0);
        self.is_of_motors(joint, quantity)
            || quantity == Quantity::Effort && self.columns.iter().any(|c| scaled(c.role))
    }

    /// See [`super::Source::column_name`].
    pub(super) fn column_name(&self, joint: usize, quantity: Quantity) -> String {
        let derived = format!("{}{}", quantity.prefix(), joint + 1);
        let label = |k: usize| {
            let column = self.columns.iter().find(|c| quantity.is_of(c.role, k));
            column.map(|c| c.label.clone())
        };
        if !self.is_of_motors(joint, quantity) {
            return label(joint).unwrap_or(derived);
        }
        let motors = self.movers.get(joint).into_iter().flatten();
        let sources: Vec<String> = motors.filter_map(|m| label(*m)).collect();
        match sources.as_slice() {
            [] => derived,
            [one] => one.clone(),
            several => format!("{derived} (from {})", several.join(", ")),
        }
    }
}
