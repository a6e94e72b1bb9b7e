//! The definition of the rows of a model.

use rig_shared::multibody::{COLUMNS, Chain, column};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMNS, Transmission};

use super::cache::RowCache;
use super::one_way::OneWay;
use rig_data::prepare::PreprocessingPlan;

/// The definition of the rows.
pub struct Plan<'a> {
    /// Geometry.
    pub chain: &'a Chain<f64>,
    /// Drives.
    pub transmission: &'a Transmission<f64>,
    /// Wanted columns (of the base parameters): 14 per link, followed by 3 per motor.
    pub columns: &'a [usize],
    /// Treatment of the recordings.
    pub treatment: &'a PreprocessingPlan,
    /// Length of a window of the integral model, rows at the full rate.
    pub window: usize,
    /// Distance between the starts of neighbouring windows, rows at the full rate.
    pub stride: usize,
    /// Per joint, scale of its torque in the energy balance (its RMS), N·m or N.
    pub loudness: Vec<f64>,
    /// Joints that move in one direction only.
    pub one_way: Vec<OneWay>,
    /// Rows computed so far.
    pub cache: RowCache,
}

/// The origin of a regressor column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Belongs {
    /// Column of [`Chain`]'s regressors, 14 per link.
    Joint(usize),
    /// Column of [`Transmission`]'s: motor, and index among its three.
    Motor(usize, usize),
    /// Zero for these drives.
    Nothing,
}

impl Plan<'_> {
    /// Returns the origin of column `c`.
    pub(crate) fn belongs(&self, c: usize) -> Belongs {
        let standard = self.chain.parameter_count();
        if let Some(motor) = c.checked_sub(standard) {
            let (k, which) = (motor / MOTOR_COLUMNS, motor % MOTOR_COLUMNS);
            return match self.transmission.kind(k) {
                Some(DriveKind::Coupled | DriveKind::Varying) => Belongs::Motor(k, which),
                _ => Belongs::Nothing,
            };
        }
        // The joint has no drive inertia if a motor column holds it.
        let drive = c % COLUMNS == column::DRIVE_INERTIA;
        if drive && !self.transmission.has_joint_inertia(c / COLUMNS) {
            Belongs::Nothing
        } else {
            Belongs::Joint(c)
        }
    }
}
