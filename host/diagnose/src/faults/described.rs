//! Torques by the description's values, and what the recording makes of them.

use nalgebra::DMatrix;
use rig_shared::multibody::column;
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::DiagnoseError;
use crate::faults::fit::{Fit, Measured};
use crate::faults::judge::Judge;
use crate::faults::rows::{Rows, model_error};
use rig_identify::chain_of;
use rig_model::batch::ModelBatch;
use rig_model::robot::Joint;

/// Share of a torque's variance above which gravity or inertia alone shows a factor: errors of the model leave less.
const SHOWN: f64 = 0.05;

/// Measured over described gravity and inertia, if identifiable.
pub(crate) type Scales = (Option<Measured>, Option<Measured>);

/// Described torques of rows, joint by joint, without friction.
pub(crate) struct Described {
    pub(crate) weight: Vec<Vec<f64>>,
    /// Weight and all other torques of links and rotors.
    pub(crate) all: Vec<Vec<f64>>,
    /// The motors' columns, see [`Rows::of_motors`].
    pub(crate) motors: Vec<DMatrix<f64>>,
}

/// Returns the friction columns of a joint: its own offset, dry and viscous friction, then those of motors that move it
/// together with others.
pub(crate) fn friction(qd: &[f64], motors: Option<&DMatrix<f64>>) -> DMatrix<f64> {
    let of_motors: Vec<(&DMatrix<f64>, usize)> = motors
        .iter()
        .flat_map(|own| {
            (0..own.ncols())
                .filter(|c| c % MOTOR_COLUMNS != motor_column::INERTIA)
                .map(move |c| (*own, c))
        })
        .collect();
    DMatrix::from_fn(qd.len(), 3 + of_motors.len(), |k, c| match c {
        0 => 1.0,
        1 if qd[k] == 0.0 => 0.0,
        1 => qd[k].signum(),
        2 => qd[k],
        _ => {
            let (own, column) = of_motors[c - 3];
            own[(k, column)]
        }
    })
}

/// Returns the columns of [`friction`], then the described weight and the described inertial torque, so that their
/// coefficients are shares of the described.
pub(crate) fn columns(data: &Rows, j: usize, described: &Described) -> DMatrix<f64> {
    let (weight, all) = (&described.weight[j], &described.all[j]);
    let lost = friction(&data.qd[j], described.motors.get(j));
    let first = lost.ncols();
    DMatrix::from_fn(data.len(), first + 2, |k, c| match c.checked_sub(first) {
        None => lost[(k, c)],
        Some(0) => weight[k],
        Some(_) => all[k] - weight[k],
    })
}

impl Judge<'_> {
    /// Returns measured gravity and inertia over the described ones, if they are described and the motion shows them.
    pub(crate) fn scales(&self, data: &Rows, j: usize, described: Option<&Described>) -> Scales {
        self.scales_above(data, j, described, SHOWN)
    }

    /// Returns the same for torques that are more than a share `least` of the joint's torque, in variance.
    pub(crate) fn scales_above(
        &self,
        data: &Rows,
        j: usize,
        described: Option<&Described>,
        least: f64,
    ) -> Scales {
        let Some(described) = described.filter(|_| self.states_from(j)) else {
            return (None, None);
        };
        let x = columns(data, j, described);
        let (tau, first) = (&data.tau[j], x.ncols() - 2);
        let Some(fit) = Fit::of(&x, tau, &(0..first + 2).collect::<Vec<_>>()) else {
            return (None, None);
        };
        let shown = |c: usize| -> Option<Measured> {
            let order: Vec<usize> = (0..first + 2).filter(|o| *o != c).collect();
            let without = Fit::of(&x, tau, &order)?.unexplained();
            fit.parameter(c)
                .filter(|m| m.sigmas().abs() > 5.0 && without - fit.unexplained() > least)
        };
        // A description that explains little of the torque gives no scale.
        let whole = fit.unexplained() < 0.2;
        (
            shown(first).filter(|_| whole),
            shown(first + 1).filter(|_| whole),
        )
    }

    /// Returns true if the description states all links from joint `j` outwards, which its torque moves.
    pub(crate) fn states_from(&self, j: usize) -> bool {
        let stated = |joint: &Joint| joint.inertial.as_ref().is_some_and(|i| i.mass > 0.0);
        self.robot.joints[j..].iter().all(stated)
    }

    /// Returns true if the description states inertia of joint `j`'s drive; a URDF never does.
    pub(crate) fn states_drive(&self, j: usize) -> bool {
        let drive = self.robot.joints[j].drive.as_ref();
        drive.is_some_and(|own| own.rotor_inertia > 0.0 || own.joint_inertia > 0.0)
    }

    /// Returns the described torques of these rows; `None` without rows, or if joint `j`'s torque is not described.
    pub(crate) fn stated(&self, data: &Rows, j: usize) -> Result<Option<Described>, DiagnoseError> {
        if data.len() == 0 || !self.states_from(j) {
            return Ok(None);
        }
        self.described(data).map(Some)
    }

    /// Returns the described torques of these rows.
    pub(crate) fn described(&self, data: &Rows) -> Result<Described, DiagnoseError> {
        self.described_under(data, self.robot.gravity)
    }

    /// Returns the described torques under another gravity, m/s² in frame 0.
    pub(crate) fn described_under(
        &self,
        data: &Rows,
        gravity: [f64; 3],
    ) -> Result<Described, DiagnoseError> {
        let (n, rows) = (self.robot.joints.len(), data.len());
        let mut parameters = self.robot.standard_parameters();
        for row in &mut parameters {
            row[column::VISCOUS..].fill(0.0);
        }
        let mut turned = self.robot.clone();
        turned.gravity = gravity;
        let chain = chain_of(&turned).map_err(model_error)?;
        let model = ModelBatch::new(&chain, &parameters).map_err(model_error)?;
        let (mut weight, mut all) = (vec![0.0; n * rows], vec![0.0; n * rows]);
        model.gravity(&data.q, &mut weight).map_err(model_error)?;
        model
            .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut all)
            .map_err(model_error)?;
        let split = |list: &[f64]| -> Vec<Vec<f64>> {
            (0..n)
                .map(|j| list[j * rows..(j + 1) * rows].to_vec())
                .collect()
        };
        let (weight, mut all) = (split(&weight), split(&all));
        let rotors = self.robot.motor_parameters();
        let motors = data.of_motors(&self.form)?;
        for (own, columns) in all.iter_mut().zip(&motors) {
            for (motor, rotor) in rotors.iter().enumerate() {
                let column = columns.column(motor * MOTOR_COLUMNS + motor_column::INERTIA);
                let inertia = rotor[motor_column::INERTIA];
                // A rotor that is not described adds nothing, even if its column is no number.
                if inertia != 0.0 {
                    for (to, y) in own.iter_mut().zip(column.iter()) {
                        *to += y * inertia;
                    }
                }
            }
        }
        Ok(Described {
            weight,
            all,
            motors,
        })
    }
}
