//! Predictions of the nominal model for a run.

use rig_shared::multibody::column;

use crate::DiagnoseError;
use crate::rows::motion::motion_of;
use crate::rows::nominal::Nominal;
use rig_data::runs::Run;
use rig_model::robot::Robot;

/// Predictions of the present model for a run at the full rate.
#[derive(Clone, Debug, Default)]
pub(crate) struct Predicted {
    /// Torque, joint by joint.
    pub(crate) torque: Vec<Vec<f64>>,
    /// Torque through the gear: without friction and the drive's own inertia.
    pub(crate) load: Vec<Vec<f64>>,
}

/// Predicts the torque and the gear load of a run with these base parameters.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn predict(
    nominal: &Nominal,
    robot: &Robot,
    values: &[f64],
    run: &Run,
) -> Result<Predicted, DiagnoseError> {
    let n = nominal.joints();
    let mut predicted = Predicted {
        torque: vec![vec![0.0; run.len()]; n],
        load: vec![vec![0.0; run.len()]; n],
    };
    let motion = motion_of(run);
    nominal.columns([&motion[0], &motion[1], &motion[2]], &mut |k, j, column| {
        for (to, y) in predicted.torque[j].iter_mut().zip(column) {
            *to += values[k] * y;
        }
        if !nominal.is_drive(k) {
            for (to, y) in predicted.load[j].iter_mut().zip(column) {
                *to += values[k] * y;
            }
        }
    })?;
    let drives = robot.standard_parameters();
    for j in 0..n {
        // The drive inertia is grouped with the link's; the description gives its own part.
        let own = drives[j][column::DRIVE_INERTIA];
        let grouped = !nominal.has_own_drive_inertia(j);
        if own != 0.0 && grouped {
            for (to, a) in predicted.load[j].iter_mut().zip(&run.joints[j].qdd) {
                *to -= own * a;
            }
        }
    }
    Ok(predicted)
}
