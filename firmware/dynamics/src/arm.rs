//! Inverse and forward dynamics of an arm with coupled drives and screws.

use rig_shared::multibody::{
    COLUMNS, Chain, ChainError, MultibodyError, articulated_forward_dynamics, bias_torque,
    inertia_matrix, inverse_dynamics, solve_positive_definite,
};
use rig_shared::scalar::Real;
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission, TransmissionError};

use crate::irp6::{self, JOINTS};

/// Why dynamics could not be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The geometry is no chain.
    Chain(ChainError),
    /// The inertia matrix is not positive definite.
    Multibody(MultibodyError),
    /// The drives are singular.
    Drives(TransmissionError),
}

impl From<ChainError> for Fault {
    fn from(error: ChainError) -> Self {
        Self::Chain(error)
    }
}

impl From<MultibodyError> for Fault {
    fn from(error: MultibodyError) -> Self {
        Self::Multibody(error)
    }
}

impl From<TransmissionError> for Fault {
    fn from(error: TransmissionError) -> Self {
        Self::Drives(error)
    }
}

/// The robot as numbers of type `T`.
pub struct Arm<T> {
    chain: Chain<T>,
    transmission: Transmission<T>,
    /// Links and joints, one row a joint.
    parameters: [[T; COLUMNS]; JOINTS],
    /// Motors, one row a motor.
    motors: [[T; MOTOR_COLUMNS]; JOINTS],
}

impl<T: Real> Arm<T> {
    /// Returns the IRp-6.
    ///
    /// # Errors
    /// [`Fault`], if the numbers describe no robot.
    pub fn irp6() -> Result<Self, Fault> {
        Ok(Self {
            chain: Chain::new(&irp6::GEOMETRY, irp6::GRAVITY)?,
            transmission: Transmission::new(&irp6::DRIVES)?,
            parameters: irp6::PARAMETERS.map(|row| row.map(T::from_f64)),
            motors: irp6::MOTORS.map(|row| row.map(T::from_f64)),
        })
    }

    /// Adds the torques of the motors' inertia and friction to those of the joints.
    fn add_motors(
        &self,
        q: &[T; JOINTS],
        qd: &[T; JOINTS],
        qdd: &[T; JOINTS],
        tau: &mut [T; JOINTS],
    ) -> Result<(), Fault> {
        const WIDTH: usize = JOINTS * MOTOR_COLUMNS;
        let mut columns = [T::ZERO; JOINTS * WIDTH];
        self.transmission.motor_columns(q, qd, qdd, &mut columns)?;
        for (torque, row) in tau.iter_mut().zip(columns.as_chunks::<WIDTH>().0) {
            for (column, value) in row.iter().zip(self.motors.as_flattened()) {
                *torque += *column * *value;
            }
        }
        Ok(())
    }

    /// Computes the torques of the motors, N·m on their side, for a motion of the joints: Newton and Euler, inertia and
    /// friction of the motors, J⁻ᵀ.
    ///
    /// # Errors
    /// [`Fault::Drives`] where the drives are singular.
    pub fn motor_torque(
        &self,
        q: &[T; JOINTS],
        qd: &[T; JOINTS],
        qdd: &[T; JOINTS],
    ) -> Result<[T; JOINTS], Fault> {
        let mut tau = [T::ZERO; JOINTS];
        inverse_dynamics(&self.chain, &self.parameters, q, qd, qdd, &mut tau)?;
        self.add_motors(q, qd, qdd, &mut tau)?;
        let mut motor = [T::ZERO; JOINTS];
        self.transmission.motor_torque(q, &tau, &mut motor)?;
        Ok(motor)
    }

    /// Computes the accelerations of the joints under torques of the motors: Jᵀ, bias, composite bodies, Cholesky.
    ///
    /// # Errors
    /// [`Fault::Multibody`] if the inertia matrix is not positive definite.
    pub fn acceleration(
        &self,
        q: &[T; JOINTS],
        qd: &[T; JOINTS],
        motor: &[T; JOINTS],
    ) -> Result<[T; JOINTS], Fault> {
        let mut bias = [T::ZERO; JOINTS];
        bias_torque(&self.chain, &self.parameters, q, qd, &mut bias)?;
        self.add_motors(q, qd, &[T::ZERO; JOINTS], &mut bias)?;
        let mut net = [T::ZERO; JOINTS];
        self.transmission.joint_torque(q, motor, &mut net)?;
        for (torque, own) in net.iter_mut().zip(bias) {
            *torque -= own;
        }
        let mut inertia = [T::ZERO; JOINTS * JOINTS];
        inertia_matrix(&self.chain, &self.parameters, q, &mut inertia)?;
        self.transmission
            .add_motor_inertia(&self.motors, q, &mut inertia)?;
        solve_positive_definite(&mut inertia, &mut net)?;
        Ok(net)
    }

    /// Computes the torques of the joints without the coupled motors, N·m.
    ///
    /// # Errors
    /// None for these lengths.
    pub fn joint_torque(
        &self,
        q: &[T; JOINTS],
        qd: &[T; JOINTS],
        qdd: &[T; JOINTS],
    ) -> Result<[T; JOINTS], Fault> {
        let mut tau = [T::ZERO; JOINTS];
        inverse_dynamics(&self.chain, &self.parameters, q, qd, qdd, &mut tau)?;
        Ok(tau)
    }

    /// Computes the accelerations of the joints under torques of the joints, without the coupled motors, by articulated
    /// bodies.
    ///
    /// # Errors
    /// [`Fault::Multibody`] if the free links have no inertia.
    pub fn articulated(
        &self,
        q: &[T; JOINTS],
        qd: &[T; JOINTS],
        tau: &[T; JOINTS],
    ) -> Result<[T; JOINTS], Fault> {
        let mut qdd = [T::ZERO; JOINTS];
        articulated_forward_dynamics(&self.chain, &self.parameters, q, qd, tau, &mut qdd)?;
        Ok(qdd)
    }
}
