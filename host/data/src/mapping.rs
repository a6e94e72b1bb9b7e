//! Which channels of a file are the columns of a recording, and their units.

use std::path::Path;

use serde::Deserialize;

use super::block::WRENCH_COLUMNS;
use super::clock::Clock;
use super::columns::{Signal, shown};
use super::error::DataError;
use super::header::Header;
use super::joint_names::is_in_joint;
use super::remark::Remark;
use super::time_names::{is_header_stamp, is_time};
use super::unit::Unit;

/// Columns of a recording that its user names, with their units. Empty by default: then the names of the file count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mapping {
    /// Column and channel.
    columns: Vec<(String, String)>,
    /// Column, or its name without number for all joints, and unit.
    units: Vec<(String, Unit)>,
    /// True if the axes of a wrist sensor are wanted from a topic of their own.
    pub(super) wants_wrench: bool,
    /// Clock of messages with header stamps.
    pub(super) clock: Clock,
    /// Columns of no joint that must have a finite number in every row.
    numbers: Vec<String>,
}

/// A mapping as it stands in a file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Written {
    clock: Option<String>,
    columns: toml::Table,
    units: toml::Table,
}

impl Mapping {
    /// Adds what a file says: TOML with the tables `[columns]` (column = "channel") and `[units]` (column = "unit").
    ///
    /// # Errors
    /// [`DataError::Mapping`] with the line or the entry at fault.
    pub fn add_file(&mut self, path: &Path) -> Result<(), DataError> {
        let wrong = |message: String| DataError::Mapping {
            message: format!("{}: {message}", path.display()),
        };
        let text = std::fs::read_to_string(path).map_err(|source| DataError::Read {
            path: path.into(),
            source,
        })?;
        let written: Written = toml::from_str(&text).map_err(|e| {
            let line = e.span().map(|span| {
                let before = text.get(..span.start).unwrap_or_default();
                format!("line {}: ", before.matches('\n').count() + 1)
            });
            wrong(format!(
                "{}{}; a mapping has the tables [columns] and [units], and before them clock = \"log\" or \"stamp\"",
                line.unwrap_or_default(),
                e.message()
            ))
        })?;
        if let Some(clock) = &written.clock {
            self.set_clock(clock).map_err(wrong)?;
        }
        for (table, is_unit) in [(&written.columns, false), (&written.units, true)] {
            for (column, value) in table {
                let Some(value) = value.as_str() else {
                    return Err(wrong(format!(
                        "`{column}` must be text in quotation marks, and it is {value}"
                    )));
                };
                let entry = format!("{column}={value}");
                let added = match is_unit {
                    true => self.add_unit(&entry),
                    false => self.add_column(&entry),
                };
                added.map_err(wrong)?;
            }
        }
        Ok(())
    }

    /// Sets the clock of messages as the option `--clock` has it: `stamp` or `log`.
    ///
    /// # Errors
    /// What is wrong, one clause.
    pub fn set_clock(&mut self, name: &str) -> Result<(), String> {
        self.clock = Clock::named(name)?;
        Ok(())
    }

    /// Adds a column as the option `--map` has it: `q1=joint_states/position/elbow`.
    ///
    /// # Errors
    /// What is wrong, one clause.
    pub fn add_column(&mut self, entry: &str) -> Result<(), String> {
        let (column, channel) = parts(entry, "q1=joint_states/position/elbow")?;
        if kind(&column).is_none() {
            return Err(format!(
                "`{column}` is no column; columns are t, q1, tau1, i1, qd1, ref1 and so on (docs/formats.md lists them)"
            ));
        }
        if self.columns.iter().any(|(own, _)| *own == column) {
            return Err(format!("column `{column}` is mapped twice"));
        }
        if let Some((other, _)) = self.columns.iter().find(|(_, own)| *own == channel) {
            return Err(format!(
                "channel `{channel}` is mapped to `{other}` and to `{column}`"
            ));
        }
        self.columns.push((column, channel));
        Ok(())
    }

    /// Adds a unit as the option `--unit` has it: `q1=deg`, or `q=deg` for all joints.
    ///
    /// # Errors
    /// What is wrong, one clause.
    pub fn add_unit(&mut self, entry: &str) -> Result<(), String> {
        let (column, name) = parts(entry, "q1=deg")?;
        let Some(of) = kind(&column).or_else(|| kind(&format!("{column}1"))) else {
            return Err(format!("`{column}` is no column, and no name of columns"));
        };
        let Some(unit) = Unit::named(&name) else {
            return Err(format!("`{name}` is no unit; units are {}", Unit::list()));
        };
        if !of.contains(&unit.of) {
            return Err(format!(
                "`{column}` cannot be in {}, which is a unit of {}",
                unit.name, unit.of
            ));
        }
        if self.units.iter().any(|(own, _)| *own == column) {
            return Err(format!("the unit of `{column}` is given twice"));
        }
        self.units.push((column, unit));
        Ok(())
    }

    /// Wants a finite number in every row of a column that belongs to no joint, if the file has it.
    #[must_use]
    pub fn with_numbers(mut self, column: &str) -> Self {
        self.numbers.push(column.to_owned());
        self
    }

    /// Returns the columns of no joint that must have a finite number in every row.
    pub(super) fn numbers(&self) -> &[String] {
        &self.numbers
    }

    /// Wants the axes of a wrist sensor, also from a topic of their own.
    #[must_use]
    pub fn with_wrench(mut self) -> Self {
        self.wants_wrench = true;
        self
    }

    /// Returns the units that were given, each with its column, or with the name of columns without a number.
    pub fn units(&self) -> impl Iterator<Item = (&str, &'static str)> {
        (self.units.iter()).map(|(column, unit)| (column.as_str(), unit.name))
    }

    /// Returns the columns and their channels.
    pub(super) fn columns(&self) -> &[(String, String)] {
        &self.columns
    }

    /// Returns the unit of a column: its own, or that of all joints.
    fn unit(&self, column: &str) -> Option<Unit> {
        let of = |name: &str| self.units.iter().find(|(own, _)| own == name);
        let all = Signal::split(column).map(|(signal, _)| signal.prefix());
        let found = of(column).or_else(|| of(all?));
        found.map(|(_, unit)| *unit)
    }

    /// Gives the columns of a text file their names.
    ///
    /// # Errors
    /// [`DataError::Mapping`]: a channel that the file does not hold.
    pub(super) fn rename(&self, path: &Path, header: &mut Header) -> Result<(), DataError> {
        for (column, channel) in &self.columns {
            let Some(k) = header.labels.iter().position(|label| label == channel) else {
                return Err(DataError::Mapping {
                    message: format!(
                        "{} has no column `{channel}`, which is to be `{column}`; its columns are {}",
                        path.display(),
                        shown(&header.labels)
                    ),
                });
            };
            if let Some(other) = header.names.iter().position(|name| name == column) {
                header.names[other] = format!("{column} (not mapped)");
            }
            header.names[k].clone_from(column);
        }
        self.rename_time(header);
        self.rename_with_units(header);
        Ok(())
    }

    /// Takes the one column that is named as a time, if none is named `t`.
    fn rename_time(&self, header: &mut Header) {
        if header.names.iter().any(|name| name == "t") {
            return;
        }
        let named = |is_named: fn(&str) -> bool| -> Vec<usize> {
            let all = 0..header.names.len();
            all.filter(|k| is_named(&header.names[*k])).collect()
        };
        let mut times = named(is_time);
        if times.is_empty() {
            times = named(is_header_stamp);
        }
        if let &[k] = times.as_slice() {
            header.names[k] = "t".into();
            header.remarks.push(Remark::TimeColumn {
                label: header.labels[k].clone(),
            });
        }
    }

    /// Removes units from names such as `q1 [deg]`, if they are columns then that the file does not have already.
    fn rename_with_units(&self, header: &mut Header) {
        for k in 0..header.names.len() {
            let Some((bare, unit)) = Unit::split(&header.names[k]) else {
                let unknown = Unit::unknown(&header.names[k]);
                if let Some((_, unit)) = unknown.filter(|(bare, _)| kind(bare).is_some()) {
                    header.remarks.push(Remark::UnknownUnit {
                        label: header.labels[k].clone(),
                        unit: unit.to_owned(),
                    });
                }
                continue;
            };
            let fits = kind(bare).is_some_and(|of| of.contains(&unit.of));
            if fits && header.names.iter().all(|name| name != bare) {
                header.names[k] = bare.to_owned();
            }
        }
    }

    /// Sets the units of the columns: those that are given, otherwise those that the names in the file state. The name of
    /// a joint states none.
    ///
    /// # Errors
    /// [`DataError::Mapping`]: a unit for a column that the file does not have.
    pub(super) fn set_units(
        &self,
        path: &Path,
        joints: &[String],
        header: &mut Header,
    ) -> Result<(), DataError> {
        header.units = vec![None; header.names.len()];
        for k in 0..header.names.len() {
            let (name, label) = (&header.names[k], &header.labels[k]);
            let Some(of) = kind(name) else { continue };
            let stem = header.stem(k);
            let stated = Unit::stated(stem).map(|(_, unit)| unit);
            let is_unit = |unit: &Unit| of.contains(&unit.of) && !is_in_joint(stem, joints);
            let stated = stated.filter(|unit| label != name && is_unit(unit));
            if let Some(unit) = header
                .row_units
                .get(k)
                .copied()
                .filter(|_| self.unit(name).is_none())
            {
                if !of.contains(&unit.of) {
                    return Err(DataError::Mapping {
                        message: format!(
                            "{}: the row of units states {} for column `{label}`, which is a unit of {}; correct the row, or give the unit by --unit {name}=UNIT",
                            path.display(),
                            unit.name,
                            unit.of
                        ),
                    });
                }
                header.units[k] = Some(unit);
                if !unit.is_si() {
                    header.remarks.push(Remark::RowUnit {
                        label: label.clone(),
                        unit: unit.name,
                    });
                }
                continue;
            }
            let Some(unit) = self.unit(name).or(stated) else {
                continue;
            };
            header.units[k] = Some(unit);
            if self.unit(name).is_none() && !unit.is_si() {
                header.remarks.push(Remark::StatedUnit {
                    label: label.clone(),
                    unit: unit.name,
                });
            }
        }
        for (column, _) in &self.units {
            let is_of = |name: &String| {
                name == column
                    || Signal::split(name).is_some_and(|(signal, _)| signal.prefix() == column)
            };
            if !header.names.iter().any(is_of) {
                return Err(DataError::Mapping {
                    message: format!(
                        "{} has no column `{column}`, whose unit is given; its columns are {}",
                        path.display(),
                        shown(&header.names)
                    ),
                });
            }
        }
        Ok(())
    }
}

/// Splits `column=value`.
fn parts(entry: &str, example: &str) -> Result<(String, String), String> {
    let parts = entry.split_once('=').map(|(a, b)| (a.trim(), b.trim()));
    match parts {
        Some((column, value)) if !column.is_empty() && !value.is_empty() => {
            Ok((column.to_owned(), value.to_owned()))
        }
        _ => Err(format!("\"{entry}\" is not of the form {example}")),
    }
}

/// Returns the quantities that a column may have; `None` for a name that is no column.
pub(super) fn kind(column: &str) -> Option<&'static [&'static str]> {
    const POSITION: &[&str] = &["angle", "length"];
    if column == "t" {
        return Some(&["time"]);
    }
    if column == "supply" {
        return Some(&["voltage"]);
    }
    if ["dx", "dy", "dz"].contains(&column) {
        return Some(&["length"]);
    }
    if WRENCH_COLUMNS.contains(&column) {
        return Some(&["torque or force"]);
    }
    let (signal, k) = Signal::split(column)?;
    (k > 0).then_some(match signal {
        Signal::Position | Signal::Reference | Signal::LinkPosition => POSITION,
        Signal::MotorPosition => &["angle"],
        Signal::Velocity => &["velocity"],
        Signal::Torque | Signal::MotorTorque => &["torque or force"],
        Signal::Current => &["current"],
        Signal::Voltage => &["voltage"],
        Signal::Temperature => &["temperature"],
        Signal::Acceleration | Signal::Duty => &[],
    })
}
