//! Regressors of a robot with its drives at given and at random states; the rank at random states shows what is
//! identifiable. They have 14 columns per link and, if a drive moves several joints, 3 per motor.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rig_shared::multibody::{
    COLUMNS, Chain, column, differential_regressor, energy_regressor, friction_power_regressor,
    momentum_loss_regressor, momentum_regressor,
};
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission};

use super::chain::{chain_of, transmission_of};
use crate::error::IdentifyError;
use crate::options::ModelKind;
use crate::rows::motor_momentum::MotorMomentum;
use rig_model::robot::Robot;

/// A robot whose regressors are evaluated.
pub(crate) struct States {
    chain: Chain<f64>,
    transmission: Transmission<f64>,
    /// Centre of the random states (the middle of the joint ranges), and their distance from it.
    middle: Vec<f64>,
    reach: f64,
}

fn failed(e: impl std::fmt::Display) -> IdentifyError {
    IdentifyError::Model(e.to_string())
}

impl States {
    pub(crate) fn of(robot: &Robot) -> Result<Self, IdentifyError> {
        let transmission = transmission_of(robot)?;
        let n = robot.joints.len();
        let (middle, reach) = if transmission.is_constant() {
            (vec![0.0; n], 3.0)
        } else {
            // A screw has no length outside its range; its ratio varies enough within this distance, rad or m.
            (robot.middle_position(), 0.3)
        };
        Ok(Self {
            chain: chain_of(robot)?,
            transmission,
            middle,
            reach,
        })
    }

    fn joints(&self) -> usize {
        self.middle.len()
    }

    /// Returns the numbers of the links' columns and of the motors'.
    fn widths(&self) -> [usize; 2] {
        let motors = if self.transmission.is_simple() {
            0
        } else {
            self.joints() * MOTOR_COLUMNS
        };
        [self.chain.parameter_count(), motors]
    }

    /// Joins the links' and the motors' columns, each joint × its own; zero for replaced link columns.
    fn joined(&self, links: &[f64], motors: &[f64]) -> DMatrix<f64> {
        let [width, more] = self.widths();
        DMatrix::from_fn(self.joints(), width + more, |j, c| {
            match c.checked_sub(width) {
                Some(c) => motors[j * more + c],
                None if self.stated(c) => links[j * width + c],
                None => 0.0,
            }
        })
    }

    /// Returns true if no motor column replaces the links' column `c`.
    fn stated(&self, c: usize) -> bool {
        c % COLUMNS != column::DRIVE_INERTIA || self.transmission.has_joint_inertia(c / COLUMNS)
    }

    /// Returns the regressor of the torque.
    pub(crate) fn torque(
        &self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
    ) -> Result<DMatrix<f64>, IdentifyError> {
        let n = self.joints();
        let mut links = vec![0.0; n * self.chain.parameter_count()];
        let mut motors = vec![0.0; n * n * MOTOR_COLUMNS];
        differential_regressor(&self.chain, q, qd, qdd, &mut links).map_err(failed)?;
        self.transmission
            .motor_columns(q, qd, qdd, &mut motors)
            .map_err(failed)?;
        Ok(self.joined(&links, &motors))
    }

    /// Returns the regressors of the momentum and of the torque that does not change it.
    pub(crate) fn momentum(
        &self,
        q: &[f64],
        qd: &[f64],
    ) -> Result<[DMatrix<f64>; 2], IdentifyError> {
        let n = self.joints();
        let mut momentum = vec![0.0; n * self.chain.parameter_count()];
        let mut loss = momentum.clone();
        let mut motors = MotorMomentum::new(n);
        momentum_regressor(&self.chain, q, qd, &mut momentum).map_err(failed)?;
        momentum_loss_regressor(&self.chain, q, qd, &mut loss).map_err(failed)?;
        motors.at(&self.transmission, q, qd).map_err(failed)?;
        Ok([
            self.joined(&momentum, &motors.momentum),
            self.joined(&loss, &motors.loss),
        ])
    }

    /// Returns three times as many rows at random states as columns: a chance dependence has probability zero.
    pub(crate) fn rows(&self, model: ModelKind, seed: u64) -> Result<DMatrix<f64>, IdentifyError> {
        let n = self.joints();
        let width: usize = self.widths().iter().sum();
        let mut generator = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut symmetric = |scale: f64| scale * (2.0 * generator.random::<f64>() - 1.0);
        let mut state = || {
            let q: Vec<f64> = self
                .middle
                .iter()
                .map(|m| m + symmetric(self.reach))
                .collect();
            let qd: Vec<f64> = (0..n).map(|_| symmetric(2.0)).collect();
            let qdd: Vec<f64> = (0..n).map(|_| symmetric(5.0)).collect();
            (q, qd, qdd)
        };
        let instants = (3 * width).div_ceil(n);
        let mut matrix = DMatrix::zeros(instants * n, width);
        for k in 0..instants {
            let rows = match model {
                ModelKind::Differential => {
                    let (q, qd, qdd) = state();
                    self.torque(&q, &qd, &qdd)?
                }
                ModelKind::Integral if n > 1 => {
                    let [(start, qd_start, _), (end, qd_end, _)] = [state(), state()];
                    let [before, _] = self.momentum(&start, &qd_start)?;
                    let [mut rows, _] = self.momentum(&end, &qd_end)?;
                    rows -= before;
                    // The loss acts along the whole path, not at its ends: a few states of it.
                    for _ in 0..3 {
                        let (q, qd, _) = state();
                        let [_, loss] = self.momentum(&q, &qd)?;
                        rows += loss;
                    }
                    rows
                }
                ModelKind::Integral => {
                    let [(start, qd_start, _), (end, qd_end, _)] = [state(), state()];
                    let mut row = self.energy(&end, &qd_end)? - self.energy(&start, &qd_start)?;
                    for _ in 0..n + 3 {
                        let (q, qd, _) = state();
                        row += self.power(&q, &qd)?;
                    }
                    // The work of a constant torque is proportional to the distance between the ends.
                    row[column::OFFSET] = end[0] - start[0];
                    row
                }
            };
            matrix.rows_mut(k * n, n).copy_from(&rows);
        }
        Ok(matrix)
    }

    /// Returns the row of the energy of one joint.
    fn energy(&self, q: &[f64], qd: &[f64]) -> Result<DMatrix<f64>, IdentifyError> {
        let mut links = vec![0.0; self.chain.parameter_count()];
        let mut motors = [0.0; MOTOR_COLUMNS];
        energy_regressor(&self.chain, q, qd, &mut links).map_err(failed)?;
        self.transmission
            .motor_energy_columns(q, qd, &mut motors)
            .map_err(failed)?;
        Ok(self.joined(&links, &motors))
    }

    /// Returns the row of the friction power of one joint.
    fn power(&self, q: &[f64], qd: &[f64]) -> Result<DMatrix<f64>, IdentifyError> {
        let mut links = vec![0.0; self.chain.parameter_count()];
        let mut motors = [0.0; MOTOR_COLUMNS];
        friction_power_regressor(&self.chain, qd, &mut links).map_err(failed)?;
        self.transmission
            .motor_power_columns(q, qd, &mut motors)
            .map_err(failed)?;
        Ok(self.joined(&links, &motors))
    }
}
