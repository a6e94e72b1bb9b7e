//! Columns of a recording, and what each means for a robot.

use std::path::Path;

use super::error::{DataError, Warning};
use super::likely_time::likely_time;
use super::motors::MotorSide;
use super::place::Place;
use super::remark::Remark;
use super::unit::Unit;

/// Whether every joint needs a torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffortNeed {
    /// `tau<k>` or `i<k>` must be there for every joint.
    #[default]
    Required,
    /// It may be missing: only the motion is used, or the torque is computed from the voltage.
    Optional,
}

/// Destination of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Time,
    Position(usize),
    /// Joint and factor.
    Effort(usize, f64),
    /// Joint; position of its motor.
    MotorPosition(usize),
    /// Joint and factor; torque of its motor.
    MotorEffort(usize, f64),
    Velocity(usize),
    Acceleration(usize),
    Reference(usize),
    Voltage(usize),
    /// Joint, column of the supply voltage, and factor.
    Duty(usize, usize, f64),
    Temperature(usize),
    /// Joint; position on the link side of the transmission.
    LinkPosition(usize),
    /// No meaning for the model.
    None,
}

/// Content of a column that belongs to a joint or its motor by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Signal {
    MotorTorque,
    Torque,
    Reference,
    Temperature,
    Duty,
    Acceleration,
    Velocity,
    MotorPosition,
    LinkPosition,
    Position,
    Current,
    Voltage,
}

impl Signal {
    const ALL: [Self; 12] = [
        Self::MotorTorque,
        Self::Torque,
        Self::Reference,
        Self::Temperature,
        Self::Duty,
        Self::Acceleration,
        Self::Velocity,
        Self::MotorPosition,
        Self::LinkPosition,
        Self::Position,
        Self::Current,
        Self::Voltage,
    ];

    /// Returns the name of the column without its number.
    pub(super) fn prefix(self) -> &'static str {
        match self {
            Self::MotorTorque => "taum",
            Self::Torque => "tau",
            Self::Reference => "ref",
            Self::Temperature => "temp",
            Self::Duty => "duty",
            Self::Acceleration => "qdd",
            Self::Velocity => "qd",
            Self::MotorPosition => "qm",
            Self::LinkPosition => "ql",
            Self::Position => "q",
            Self::Current => "i",
            Self::Voltage => "u",
        }
    }

    /// Returns the measured quantity in words.
    fn quantity(self) -> &'static str {
        match self {
            Self::MotorTorque => "motor torque",
            Self::Torque => "torque or force",
            Self::Reference => "reference position",
            Self::Temperature => "temperature",
            Self::Duty => "duty cycle",
            Self::Acceleration => "acceleration",
            Self::Velocity => "velocity",
            Self::MotorPosition | Self::LinkPosition | Self::Position => "position",
            Self::Current => "motor current",
            Self::Voltage => "voltage",
        }
    }

    /// Splits `tau12` into torque and 12; a number has no leading zero except `0` itself.
    pub(super) fn split(name: &str) -> Option<(Self, usize)> {
        Self::ALL.into_iter().find_map(|signal| {
            let digits = name.strip_prefix(signal.prefix())?;
            let plain = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
            let canonical = plain && (digits == "0" || !digits.starts_with('0'));
            canonical
                .then(|| digits.parse().ok())
                .flatten()
                .map(|k| (signal, k))
        })
    }
}

/// One column of the file.
#[derive(Clone, Debug)]
pub(super) struct FileColumn {
    pub name: String,
    /// Name in messages: the name in the file.
    pub label: String,
    /// Value in SI units of one unit of the file.
    pub factor: f64,
    pub role: Role,
    /// Index in [`super::Block::extra`], if it is kept by name.
    pub extra: Option<usize>,
    /// True if every value must be a finite number.
    pub strict: bool,
}

/// Magnitude above which no value in SI units is a measurement, even with a wrong unit: 10⁶ rad, N·m, A or V, times a
/// million for a smaller unit.
const NO_MEASUREMENT: f64 = 1e12;

/// The same for time: nanoseconds since 1970, which have a message of their own, are 1.8·10¹⁸.
const NO_TIME: f64 = 1e21;

impl FileColumn {
    /// Returns the largest magnitude that counts as a measurement.
    pub(super) fn largest(&self) -> f64 {
        match self.role {
            Role::Time => NO_TIME,
            _ => NO_MEASUREMENT,
        }
    }

    /// Returns the quantity that the column measures.
    fn quantity(&self) -> &'static str {
        match self.role {
            Role::Time => "time",
            _ => Signal::split(&self.name).map_or("measurement", |(signal, _)| signal.quantity()),
        }
    }

    /// Returns the error for a value that is no number, or beyond [`FileColumn::largest`].
    pub(super) fn no_measurement(&self, path: &Path, place: Place, value: f64) -> DataError {
        if value.is_finite() {
            return self.out_of_range(path, place, value);
        }
        DataError::NotANumber {
            path: path.into(),
            place,
            column: self.label.clone(),
            found: rig_output::format_short(value),
        }
    }

    /// Returns the error for a value beyond [`FileColumn::largest`].
    pub(super) fn out_of_range(&self, path: &Path, place: Place, value: f64) -> DataError {
        DataError::OutOfRange {
            path: path.into(),
            place,
            column: self.label.clone(),
            value,
            quantity: self.quantity(),
        }
    }
}

/// All columns of the file in order.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub columns: Vec<FileColumn>,
    pub time: usize,
    pub joints: usize,
    /// Time of the first row in the unit of the file, if times are counted from it.
    pub origin: Option<f64>,
    pub extras: usize,
    /// Conversion from motors to joints, if needed.
    pub motors: Option<MotorSide>,
    /// Per joint, the motors whose columns determine its position or torque, if it is converted.
    pub movers: Vec<Vec<usize>>,
    pub warnings: Vec<Warning>,
}

/// Time above which a converted time is counted from the first row, s: 1973 for times since 1970. Doubles in seconds would
/// not resolve what the unit of the file does.
const SINCE_1970: f64 = 1e8;

impl Layout {
    /// Returns the first column whose value is no measurement, if it must be one, with its place and that value.
    pub(super) fn refused(&self, values: &[f64]) -> Option<(usize, &FileColumn, f64)> {
        let all = self.columns.iter().zip(values).enumerate();
        let mut all = all.map(|(k, (column, value))| (k, column, *value));
        // A value that is no number is not below the bound.
        all.find(|(_, column, value)| column.strict && !(value.abs() <= column.largest()))
    }

    /// Refuses values of these columns that are no finite numbers.
    pub(super) fn require_numbers(&mut self, names: &[String]) {
        for column in &mut self.columns {
            column.strict |= names.contains(&column.name);
        }
    }

    /// Takes the unit of times since 1970 from the size of the first one, where nothing states it.
    pub(super) fn guess_unit_of_time(&mut self, raw: &[f64]) {
        let likely = likely_time(raw.get(self.time).copied(), None);
        let (Some(column), Some((name, why))) = (self.columns.get_mut(self.time), likely) else {
            return;
        };
        if let Some(unit) = Unit::named(name) {
            column.factor = unit.factor;
            self.warnings.push(Warning::Reading {
                remark: Remark::LikelyTime {
                    label: column.label.clone(),
                    unit: unit.name,
                    why,
                },
            });
        }
    }

    /// Counts the times from this row, the first one, if they are times since 1970 in another unit than s.
    pub(super) fn count_from(&mut self, raw: &[f64]) {
        let (Some(column), Some(t)) = (self.columns.get(self.time), raw.get(self.time)) else {
            return;
        };
        if column.factor == 1.0 || t.abs() * column.factor < SINCE_1970 {
            return;
        }
        self.origin = Some(*t);
        self.warnings.push(Warning::Reading {
            remark: Remark::CountedTime { what: "since 1970" },
        });
    }

    /// Converts a row to SI units.
    pub(super) fn convert(&self, values: &mut [f64]) {
        for (k, (value, column)) in values.iter_mut().zip(&self.columns).enumerate() {
            let origin = self.origin.filter(|_| k == self.time).unwrap_or(0.0);
            if column.factor != 1.0 || origin != 0.0 {
                *value = (*value - origin) * column.factor;
            }
        }
    }
}

/// Returns the end of a sentence on columns that are not those of the robot.
pub(super) fn proposes(path: &Path) -> String {
    format!(
        "`rig inspect {}` proposes the options that name them (--map, --unit)",
        path.display()
    )
}

/// Lists names of columns for a message, at most twelve.
pub(super) fn shown(names: &[String]) -> String {
    const MOST: usize = 12;
    let list: Vec<String> = names
        .iter()
        .take(MOST)
        .map(|n| format!("`{}`", n.escape_debug()))
        .collect();
    let more = if names.len() > MOST { ", …" } else { "" };
    list.join(", ") + more
}
