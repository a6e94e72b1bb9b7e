//! The rows of a recording with all columns of its file, in SI units: for conversion to another format.

use super::columns::Signal;
use super::csv_header::ROW_NUMBER;
use super::error::DataError;
use super::source::{Rows, Source};
use super::written_rows::Column;
use rig_model::robot::{JointKind, Robot};

/// A recording as rows of all its columns.
pub struct PlainRows<'a> {
    source: &'a Source,
    rows: Rows,
    /// Place of each column in the file, the time first.
    order: Vec<usize>,
    values: Vec<f64>,
    row: Vec<f64>,
    previous: Option<f64>,
}

impl<'a> PlainRows<'a> {
    /// Opens the rows of a recording. Nothing is computed: a motor current stays a current.
    ///
    /// # Errors
    /// [`DataError`]: a file that cannot be read.
    pub fn open(source: &'a Source) -> Result<Self, DataError> {
        let count = source.layout.columns.len();
        let time = source.layout.time;
        let is_number = |k: &usize| source.layout.columns[*k].name == ROW_NUMBER;
        let others = (0..count).filter(|k| *k != time && !is_number(k));
        Ok(Self {
            source,
            rows: source.rows()?,
            order: std::iter::once(time).chain(others).collect(),
            values: vec![0.0; count],
            row: Vec::new(),
            previous: None,
        })
    }

    /// Returns the columns, the time first, with their units in SI. A column that has no meaning for the model has no unit.
    pub fn columns(&self, robot: &Robot) -> Vec<Column> {
        let of = |k: &usize| {
            let name = self.source.layout.columns[*k].name.as_str();
            Column::new(name, unit(name, robot))
        };
        self.order.iter().map(of).collect()
    }

    /// Returns the next row with its place in the file; text in a column without a meaning is NaN. `None` at the end.
    ///
    /// # Errors
    /// [`DataError`]: a row that is no measurement, or a time that does not grow.
    pub fn next_row(&mut self) -> Result<Option<(u64, &[f64])>, DataError> {
        let layout = &self.source.layout;
        let Some(place) = self.rows.next_row(layout, &mut self.values)? else {
            return Ok(None);
        };
        self.row.clear();
        self.row.extend(self.order.iter().map(|k| self.values[*k]));
        let now = self.row.first().copied();
        self.rows
            .check_growth(self.source.path(), place, self.previous, now.unwrap_or(0.0))?;
        self.previous = now;
        Ok(Some((place, &self.row)))
    }

    /// Returns the number of bytes read so far.
    pub fn bytes_read(&self) -> u64 {
        self.rows.bytes_read()
    }

    /// Returns what the rows so far showed, one clause each.
    pub fn remarks(&self) -> Vec<String> {
        self.rows
            .remarks()
            .iter()
            .map(ToString::to_string)
            .collect()
    }
}

/// Returns the unit of a column in SI, ASCII; empty for one without a meaning.
fn unit(name: &str, robot: &Robot) -> &'static str {
    let moment = |axis: &str| ["mx", "my", "mz"].contains(&axis);
    let Some((signal, joint)) = Signal::split(name) else {
        return match name {
            "t" => "s",
            "supply" => "V",
            "fx" | "fy" | "fz" => "N",
            "dx" | "dy" | "dz" => "m",
            axis if moment(axis) => "N*m",
            _ => "",
        };
    };
    let kind = robot.joints.get(joint.wrapping_sub(1)).map(|j| j.kind);
    let is_linear = kind == Some(JointKind::Prismatic);
    let of = |rotation, straight| if is_linear { straight } else { rotation };
    match signal {
        Signal::Position | Signal::LinkPosition | Signal::Reference => of("rad", "m"),
        Signal::Velocity => of("rad/s", "m/s"),
        Signal::Acceleration => of("rad/s^2", "m/s^2"),
        Signal::Torque => of("N*m", "N"),
        Signal::MotorPosition => "rad",
        Signal::MotorTorque => "N*m",
        Signal::Current => "A",
        Signal::Voltage => "V",
        Signal::Temperature => "degC",
        Signal::Duty => "1",
    }
}
