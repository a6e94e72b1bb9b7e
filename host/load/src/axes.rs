//! The axes in which the equations of the wrist sensor stand: those of the sensor as it is described, about the origin of
//! the last joint's frame. Each equation is then that of one channel, as long as the sensor is mounted as described.

use nalgebra::{Isometry3, Matrix3, SMatrix, Vector3};
use rig_model::robot::Load;
use rig_shared::multibody::INERTIAL_PARAMETERS;

use crate::estimate::Square;
use crate::wrench_row::ENTRIES;

/// The described axes of the sensor.
#[derive(Clone, Debug)]
pub(crate) struct SensorAxes {
    /// From these axes to those of the last joint.
    to_joint: Matrix3<f64>,
    /// From the ten parameters in these axes to those in the axes of the last joint.
    parameters: Square,
    /// Origin of the sensor in these axes, from that of the last joint's frame, m.
    pub origin: Vector3<f64>,
}

impl SensorAxes {
    /// Builds them from the described pose of the sensor in the frame of the last joint.
    pub(crate) fn of(pose: &Isometry3<f64>) -> Self {
        let rotation = pose.rotation;
        Self {
            to_joint: rotation.to_rotation_matrix().into_inner(),
            parameters: parameters_from(&Isometry3::from_parts(Default::default(), rotation)),
            origin: rotation.inverse() * pose.translation.vector,
        }
    }

    /// Returns a vector of the axes of the last joint in these axes.
    pub(crate) fn seen(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.to_joint.transpose() * vector
    }

    /// Turns a regressor in the axes of the last joint to these axes: its wrench and its parameters.
    pub(crate) fn turn(&self, entries: &mut [f64; ENTRIES]) {
        let own = SMatrix::<f64, 6, INERTIAL_PARAMETERS>::from_row_slice(entries) * self.parameters;
        let mut turned = own;
        for first in [0, 3] {
            let of = self.to_joint.transpose() * own.fixed_rows::<3>(first);
            turned.fixed_rows_mut::<3>(first).copy_from(&of);
        }
        for (k, entry) in entries.iter_mut().enumerate() {
            *entry = turned[(k / INERTIAL_PARAMETERS, k % INERTIAL_PARAMETERS)];
        }
    }
}

/// Returns the matrix that turns the ten parameters in a frame to those in another one, in which the first has this pose.
pub(crate) fn parameters_from(pose: &Isometry3<f64>) -> Square {
    let mut matrix = Square::zeros();
    for k in 0..INERTIAL_PARAMETERS {
        let mut unit = [0.0; INERTIAL_PARAMETERS];
        unit[k] = 1.0;
        let column = Load::of(unit).seen_from(pose).parameters();
        matrix.column_mut(k).copy_from_slice(&column);
    }
    matrix
}
