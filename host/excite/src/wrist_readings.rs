//! Readings of a simulated wrist sensor.

use rand_pcg::Pcg64;

use crate::ExciteError;
use crate::error::wrong;
use crate::random::drawn;
use rig_data::{Column, WRENCH_COLUMNS};
use rig_model::robot::{Load, Robot, WristSensor};
use rig_model::simulate::{LinkMotion, LoadWrench};

/// What a robot carries at its flange, and the errors of its wrist sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// The load; none if the flange is free.
    pub load: Option<Load>,
    /// Standard deviation of the white normal noise of each force, N.
    pub force_noise: f64,
    /// The same of each moment, N·m.
    pub moment_noise: f64,
    /// Constant part of the readings, fx fy fz, N, mx my mz, N·m.
    pub bias: [f64; 6],
}

impl Carried {
    /// Rejects noise that is no standard deviation, and a bias that is no number.
    pub(super) fn check(&self) -> Result<(), ExciteError> {
        for (name, value) in [
            ("force noise", self.force_noise),
            ("moment noise", self.moment_noise),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                let right = "it is a standard deviation: 0 or more".into();
                return Err(wrong(name, value.to_string(), right));
            }
        }
        match self.bias.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(wrong(
                "sensor bias",
                value.to_string(),
                "it must be a number in N or N·m".into(),
            )),
            None => Ok(()),
        }
    }
}

/// The sensor of a robot that carries a load, with its readings so far.
pub(super) struct WristReadings<'a> {
    sensor: &'a WristSensor,
    wrench: LoadWrench<'a>,
    /// Readings per axis.
    pub rows: [Vec<f64>; 6],
}

impl<'a> WristReadings<'a> {
    /// Creates the readings; none if the robot has no sensor.
    ///
    /// # Errors
    /// [`ExciteError::Option`] if the load has a first moment, but no mass.
    pub(super) fn of(robot: &'a Robot, carried: &Carried) -> Result<Option<Self>, ExciteError> {
        let nothing = Load::of([0.0; 10]);
        let load = carried.load.as_ref().unwrap_or(&nothing);
        if load.centred().is_none() {
            return Err(wrong(
                "mass of the load",
                load.mass.to_string(),
                "its first moment is not 0, so it has no centre of mass; give its mass".into(),
            ));
        }
        let sensor = robot.wrist_sensor.as_ref();
        let parts = sensor.zip(LoadWrench::new(robot, load));
        Ok(parts.map(|(sensor, wrench)| Self {
            sensor,
            wrench,
            rows: Default::default(),
        }))
    }

    /// Adds the true wrench at an instant.
    pub(super) fn push(&mut self, links: &LinkMotion) {
        for (list, value) in self.rows.iter_mut().zip(self.wrench.at(links)) {
            list.push(value);
        }
    }

    /// Adds bias and noise, then clips each reading at the sensor's range. Returns a note on clipped rows, if any.
    pub(super) fn disturb(&mut self, carried: &Carried, random: &mut Pcg64) -> Option<String> {
        let count = self.rows[0].len();
        let mut clipped = vec![false; count];
        for (axis, list) in self.rows.iter_mut().enumerate() {
            let (deviation, range) = match axis {
                0..3 => (carried.force_noise, self.sensor.force_range),
                _ => (carried.moment_noise, self.sensor.moment_range),
            };
            let range = range.unwrap_or(f64::INFINITY);
            for (value, clipped) in list.iter_mut().zip(&mut clipped) {
                let read = *value + carried.bias[axis] + drawn(random, deviation);
                *value = read.clamp(-range, range);
                *clipped |= *value != read;
            }
        }
        let rows = clipped.iter().filter(|clipped| **clipped).count();
        (rows > 0).then(|| {
            format!(
                "The wrist sensor reached its range in {rows} of {count} rows; the readings there are clipped, as those of a real sensor."
            )
        })
    }
}

/// Returns the columns of the sensor.
pub(super) fn wrench_columns() -> impl Iterator<Item = Column> {
    let unit = |axis: usize| if axis < 3 { "N" } else { "N*m" };
    (WRENCH_COLUMNS.iter().enumerate()).map(move |(axis, name)| Column::new(name, unit(axis)))
}
