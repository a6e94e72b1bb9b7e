//! Conversion of recorded motor positions and torques to the joints, through the robot's drives.

use rig_shared::transmission::{Transmission, TransmissionError};

use rig_model::robot::Robot;

/// Motor-side quantities of a recording, and the drives that convert them to the joints.
#[derive(Clone, Debug)]
pub(super) struct MotorSide {
    transmission: Transmission<f64>,
    /// Start of the search for joint positions.
    start: Vec<f64>,
    /// True if the positions are those of the motors (`qm<k>` for every joint).
    pub positions: bool,
    /// Per joint, true if its torque comes from motor torques (`taum<k>`, `i<k>`).
    pub torques: Vec<bool>,
    /// If the Jacobian is constant: it and its inverse, row-major, and the motors' zeros.
    constant: Option<Constant>,
}

#[derive(Clone, Debug)]
struct Constant {
    jacobian: Vec<f64>,
    inverse: Vec<f64>,
    zero: Vec<f64>,
}

impl MotorSide {
    /// # Errors
    /// Singular drives; never for a description that was loaded.
    pub(super) fn new(
        robot: &Robot,
        positions: bool,
        torques: Vec<bool>,
    ) -> Result<Self, TransmissionError> {
        let transmission = robot.transmission()?;
        let start = robot.middle_position();
        let constant = if transmission.is_constant() {
            Some(Constant::of(&transmission)?)
        } else {
            None
        };
        Ok(Self {
            transmission,
            start,
            positions,
            torques,
            constant,
        })
    }

    /// Starts a pass over the recording at the middle of the joints' range.
    pub(super) fn pass(&self) -> MotorPass {
        let n = self.start.len();
        MotorPass {
            psi: vec![0.0; n],
            tau_motor: vec![0.0; n],
            q: self.start.clone(),
            tau: vec![0.0; n],
        }
    }
}

impl Constant {
    fn of(transmission: &Transmission<f64>) -> Result<Self, TransmissionError> {
        let n = transmission.joint_count();
        let origin = vec![0.0; n];
        let (mut jacobian, mut zero) = (vec![0.0; n * n], vec![0.0; n]);
        transmission.jacobian(&origin, &mut jacobian)?;
        transmission.motor_position(&origin, &mut zero)?;
        let mut inverse = vec![0.0; n * n];
        let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
        for k in 0..n {
            unit.fill(0.0);
            unit[k] = 1.0;
            transmission.joint_velocity(&origin, &unit, &mut column)?;
            for j in 0..n {
                inverse[j * n + k] = column[j];
            }
        }
        Ok(Self {
            jacobian,
            inverse,
            zero,
        })
    }
}

/// Motor values of a row, and the resulting joint values.
#[derive(Clone, Debug)]
pub(super) struct MotorPass {
    /// Motor positions of the row, rad.
    pub psi: Vec<f64>,
    /// Motor torques of the row, N·m.
    pub tau_motor: Vec<f64>,
    /// Joint positions. On entry those of the previous row, as start of the search; set by the caller if the recording
    /// contains them.
    pub q: Vec<f64>,
    /// Joint torques; valid for those that come from motors.
    pub tau: Vec<f64>,
}

impl MotorPass {
    /// Converts the row to the joints.
    ///
    /// # Errors
    /// A motor position that belongs to no joint position.
    pub(super) fn turn(&mut self, side: &MotorSide) -> Result<(), TransmissionError> {
        let n = self.q.len();
        if side.positions {
            match &side.constant {
                Some(c) => {
                    for j in 0..n {
                        let mut sum = 0.0;
                        for k in 0..n {
                            sum += c.inverse[j * n + k] * (self.psi[k] - c.zero[k]);
                        }
                        self.q[j] = sum;
                    }
                }
                None => side.transmission.joint_position(&self.psi, &mut self.q)?,
            }
        }
        if side.torques.contains(&true) {
            match &side.constant {
                Some(c) => {
                    for j in 0..n {
                        let ratio = |k: usize| c.jacobian[k * n + j];
                        self.tau[j] = (0..n).map(|k| ratio(k) * self.tau_motor[k]).sum();
                    }
                }
                None => {
                    side.transmission
                        .joint_torque(&self.q, &self.tau_motor, &mut self.tau)?;
                }
            }
        }
        Ok(())
    }
}
