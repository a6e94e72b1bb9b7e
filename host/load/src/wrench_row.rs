//! One equation of the wrist sensor: what it read, and how the load's parameters enter it.

use nalgebra::Vector3;
use rig_shared::multibody::INERTIAL_PARAMETERS;

/// Entries of the regressor of a wrench: six components by ten parameters, row-major.
pub(crate) const ENTRIES: usize = 6 * INERTIAL_PARAMETERS;

/// The regressor and the readings at one instant.
#[derive(Clone, Debug)]
pub(crate) struct WrenchRow {
    /// Time since the begin of the recording, s.
    pub time: f64,
    /// Temperature of the sensor, °C; 0 if it was not recorded.
    pub temperature: f64,
    /// Regressor of the wrench of the robot on the load, about the sensor's origin, in the axes of the last joint.
    pub regressor: [f64; ENTRIES],
    /// Readings in the axes of the sensor.
    pub readings: [f64; 6],
}

/// Moves the moments of a regressor to another point: n − p × f.
pub(crate) fn about(point: &Vector3<f64>, regressor: &mut [f64; ENTRIES]) {
    for column in 0..INERTIAL_PARAMETERS {
        let at = |row: usize| regressor[row * INERTIAL_PARAMETERS + column];
        let moved = point.cross(&Vector3::new(at(0), at(1), at(2)));
        for axis in 0..3 {
            regressor[(3 + axis) * INERTIAL_PARAMETERS + column] -= moved[axis];
        }
    }
}
