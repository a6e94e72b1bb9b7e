//! One equation of the wrist sensor: what it read, and how the load's parameters enter it.

use nalgebra::Vector3;
use rig_shared::multibody::INERTIAL_PARAMETERS;

/// Entries of the regressor of a wrench: six components by ten parameters, row-major.
pub(crate) const ENTRIES: usize = 6 * INERTIAL_PARAMETERS;

/// Parameters that gravity acts on: mass and first moments.
pub(crate) const WEIGHED: usize = 4;
/// Entries of the regressor of a weight, row-major.
pub(crate) const WEIGHT_ENTRIES: usize = 6 * WEIGHED;

/// The regressor and the readings at one instant.
#[derive(Clone, Debug)]
pub(crate) struct WrenchRow {
    /// Time since the begin of the recording, s.
    pub time: f64,
    /// Temperature of the sensor, in the unit of its column; 0 if it was not recorded.
    pub temperature: f64,
    /// Regressor of the wrench of the robot on the load, about the sensor's origin, in the described axes of
    /// the sensor.
    pub regressor: [f64; ENTRIES],
    /// Its derivative by time, 1/s; zero at rest.
    pub rate: [f64; ENTRIES],
    /// What a unit of gravity along each axis of the base, m/s², adds to it.
    pub weights: [[f64; WEIGHT_ENTRIES]; 3],
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

/// Returns the regressor of a weight about a point, for gravity along `direction`, all in the same axes.
pub(crate) fn weight(direction: &Vector3<f64>, point: &Vector3<f64>) -> [f64; WEIGHT_ENTRIES] {
    let mut entries = [0.0; WEIGHT_ENTRIES];
    // The robot bears the weight: f = −m·g, n = −(m·c) × g.
    let of_mass = point.cross(direction);
    for axis in 0..3 {
        entries[axis * WEIGHED] = -direction[axis];
        entries[(3 + axis) * WEIGHED] = of_mass[axis];
    }
    for k in 0..3 {
        let mut unit = Vector3::zeros();
        unit[k] = 1.0;
        let moment = -unit.cross(direction);
        for axis in 0..3 {
            entries[(3 + axis) * WEIGHED + 1 + k] = moment[axis];
        }
    }
    entries
}
