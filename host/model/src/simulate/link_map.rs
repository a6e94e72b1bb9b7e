//! The links' motion as a function of the coordinates of a simulation.
//!
//! The coordinates x are the n motors' positions θ and one z for each elastic gear ([`super::elastic`]). If all drives
//! that are coupled with each other have stiff gears, their links are at θ. If all have elastic gears, z is the position
//! of the link. If they are mixed, a stiff drive k connects several joints on both sides, Ψ_k(q) = Ψ_k(θ), and z is the
//! position of the gear's output, Ψ_k(q) = s_k·z_k (s: [`Transmission::own_turns`]). The links then follow from Ψ by the
//! inverse of the drives, and no constraint is left that a step could violate:
//!
//! q̇ = L·ẋ with J(q)·q̇ = (J_k(θ)·θ̇ of a stiff, s_k·ż_k of an elastic drive), and torques on q act on x by Lᵀ.

use nalgebra::{DMatrix, DVector};
use rig_shared::transmission::{Transmission, TransmissionError};

use super::model::Model;

/// Links of a chain: which coordinates move them, and where they are.
#[derive(Clone, Debug)]
pub(super) struct LinkMap {
    /// Positions.
    pub q: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Accelerations while those of the coordinates are zero: L̇·ẋ.
    pub convective: Vec<f64>,
    /// By joint: the coordinates that move its link, and its motion per unit of each (rows of L).
    rows: Vec<Vec<(usize, f64)>>,
    /// By joint: coordinate of the link's side of its gear; the joint's own if the gear is stiff.
    at: Vec<usize>,
    /// By joint: true if a drive that is coupled with its own, or its own, has an elastic gear.
    geared: Vec<bool>,
    /// By joint: true if such drives have stiff gears too.
    mixed: Vec<bool>,
    /// By joint: s of its drive.
    turns: Vec<f64>,
    /// Positions of the motors.
    motors: Vec<f64>,
    psi: Vec<f64>,
    /// Motion of the links per motion of the drives' outputs, with mixed drives.
    by_drives: DMatrix<f64>,
}

impl LinkMap {
    /// Returns the map of a model; `at`: by joint the coordinate of the link's side of its gear.
    pub(super) fn of(model: &Model, at: Vec<usize>) -> Self {
        let n = at.len();
        let t = model.motors.as_ref().map(|motors| &motors.transmission);
        let group = coupled(t, n);
        let of_group = |j: usize, elastic: bool| {
            (0..n).any(|k| group[k] == group[j] && (at[k] != k) == elastic)
        };
        let geared: Vec<bool> = (0..n).map(|j| of_group(j, true)).collect();
        let zeros = || vec![0.0; n];
        Self {
            q: zeros(),
            v: zeros(),
            convective: zeros(),
            rows: at.iter().map(|at| vec![(*at, 1.0)]).collect(),
            mixed: (0..n).map(|j| geared[j] && of_group(j, false)).collect(),
            geared,
            turns: (0..n)
                .map(|k| t.and_then(|t| t.own_turns(k)).unwrap_or(1.0))
                .collect(),
            at,
            motors: zeros(),
            psi: zeros(),
            by_drives: DMatrix::identity(n, n),
        }
    }

    /// Returns true if the link of a joint may be elsewhere than its motor.
    pub(super) fn is_separate(&self, joint: usize) -> bool {
        self.geared[joint]
    }

    /// Returns true if the drives that are coupled with that of a joint have both stiff and elastic gears.
    pub(super) fn is_mixed(&self, joint: usize) -> bool {
        self.mixed[joint]
    }

    /// Returns true if there are such drives.
    pub(super) fn any_mixed(&self) -> bool {
        self.mixed.contains(&true)
    }

    /// Returns the turns of the motor of a joint per unit of its gear's twist: its own ratio; 1 for a screw.
    pub(super) fn turns(&self, joint: usize) -> f64 {
        self.turns[joint]
    }

    /// Returns the drives of the chain if some are mixed.
    fn drives<'a>(&self, model: &'a Model) -> Option<&'a Transmission<f64>> {
        let motors = model.motors.as_ref().filter(|_| self.any_mixed());
        motors.map(|motors| &motors.transmission)
    }

    /// Computes where the links are at the coordinates `x`, and which coordinates move them. Those of mixed drives are
    /// sought from where they were.
    ///
    /// # Errors
    /// [`TransmissionError`] if no position of the links fits the drives.
    pub(super) fn locate(&mut self, model: &Model, x: &[f64]) -> Result<(), TransmissionError> {
        let n = self.at.len();
        self.motors.copy_from_slice(&x[..n]);
        for j in (0..n).filter(|j| !self.mixed[*j]) {
            self.q[j] = x[self.at[j]];
        }
        let Some(t) = self.drives(model) else {
            return Ok(());
        };
        // Drives that are not mixed stand where their links are.
        let of = |j: usize| match self.mixed[j] {
            true => x[j],
            false => self.q[j],
        };
        let fronts: Vec<f64> = (0..n).map(of).collect();
        t.motor_position(&fronts, &mut self.psi)?;
        for k in (0..n).filter(|k| self.mixed[*k] && self.at[*k] != *k) {
            self.psi[k] = self.turns[k] * x[self.at[k]];
        }
        t.joint_position(&self.psi, &mut self.q)?;
        for j in (0..n).filter(|j| !self.mixed[*j]) {
            self.q[j] = x[self.at[j]];
        }
        self.turn(model)
    }

    /// Computes which coordinates move the links of mixed drives.
    fn turn(&mut self, model: &Model) -> Result<(), TransmissionError> {
        let n = self.at.len();
        self.by_drives = self.inverse(model, &self.q)?;
        let mut stiff = self.jacobian(model, &self.motors)?;
        for k in (0..n).filter(|k| self.at[*k] != *k) {
            stiff.row_mut(k).fill(0.0);
        }
        let by_motors = &self.by_drives * stiff;
        for j in (0..n).filter(|j| self.mixed[*j]) {
            let row = &mut self.rows[j];
            row.clear();
            row.extend((0..n).map(|i| (i, by_motors[(j, i)])));
            let outputs = (0..n).filter(|k| self.at[*k] != *k);
            row.extend(outputs.map(|k| (self.at[k], self.by_drives[(j, k)])));
            row.retain(|(_, share)| *share != 0.0);
        }
        Ok(())
    }

    /// Computes velocities and convective accelerations of the links from the velocities `v` of the coordinates, where
    /// [`Self::locate`] has put the links.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub(super) fn follow(&mut self, model: &Model, v: &[f64]) -> Result<(), TransmissionError> {
        let n = self.at.len();
        for (own, row) in self.v.iter_mut().zip(&self.rows) {
            *own = moved(row, v);
        }
        let Some(t) = self.drives(model) else {
            return Ok(());
        };
        // A stiff drive turns both sides alike, Ψ̈(θ) = Ψ̈(q); the output of an elastic one has no acceleration.
        let still = vec![0.0; n];
        let mut behind = DVector::zeros(n);
        t.motor_acceleration(&self.motors, &v[..n], &still, &mut self.psi)?;
        t.motor_acceleration(&self.q, &self.v, &still, behind.as_mut_slice())?;
        let lag = DVector::from_fn(n, |k, _| {
            let front = if self.at[k] == k { self.psi[k] } else { 0.0 };
            (front - behind[k]) / self.turns[k]
        });
        let convective = &self.by_drives * lag;
        for j in (0..n).filter(|j| self.mixed[*j]) {
            self.convective[j] = convective[j];
        }
        Ok(())
    }

    /// Adds `factor` times the torques on the links to those on the coordinates.
    pub(super) fn add_torques(&self, factor: f64, of_links: &[f64], out: &mut [f64]) {
        for (row, torque) in self.rows.iter().zip(of_links) {
            for (at, share) in row {
                out[*at] += factor * share * torque;
            }
        }
    }

    /// Adds a matrix of the links (n × n) to one of the coordinates.
    pub(super) fn add_matrix(&self, of_links: &[f64], out: &mut [f64], width: usize) {
        let n = self.rows.len();
        for (i, row) in self.rows.iter().enumerate() {
            for (j, other) in self.rows.iter().enumerate() {
                let value = of_links[i * n + j];
                for (r, by) in row {
                    for (c, of) in other {
                        out[r * width + c] += by * value * of;
                    }
                }
            }
        }
    }

    /// Computes the accelerations of the links from those of the coordinates.
    pub(super) fn accelerations(&self, of_coordinates: &[f64], out: &mut [f64]) {
        for ((own, row), convective) in out.iter_mut().zip(&self.rows).zip(&self.convective) {
            *own = convective + moved(row, of_coordinates);
        }
    }

    /// Computes the positions of the drives in the unit of their gears' twist, with the joints at `q`: Ψ_k/s_k where a
    /// coupled drive has an elastic gear, the joint's position elsewhere.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub(super) fn positions(
        &self,
        model: &Model,
        q: &[f64],
    ) -> Result<Vec<f64>, TransmissionError> {
        let mut out = q.to_vec();
        if let Some(motors) = &model.motors {
            let mut psi = vec![0.0; q.len()];
            motors.transmission.motor_position(q, &mut psi)?;
            for k in (0..q.len()).filter(|k| self.geared[*k]) {
                out[k] = psi[k] / self.turns[k];
            }
        }
        Ok(out)
    }

    /// Computes the derivatives of [`Self::positions`] (rows: drives).
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub(super) fn jacobian(
        &self,
        model: &Model,
        q: &[f64],
    ) -> Result<DMatrix<f64>, TransmissionError> {
        let n = q.len();
        let mut out = DMatrix::identity(n, n);
        if let Some(motors) = &model.motors {
            let mut jacobian = vec![0.0; n * n];
            motors.transmission.jacobian(q, &mut jacobian)?;
            for k in (0..n).filter(|k| self.geared[*k]) {
                for j in 0..n {
                    out[(k, j)] = jacobian[k * n + j] / self.turns[k];
                }
            }
        }
        Ok(out)
    }

    /// Computes the inverse of [`Self::jacobian`].
    ///
    /// # Errors
    /// [`TransmissionError::Singular`].
    pub(super) fn inverse(
        &self,
        model: &Model,
        q: &[f64],
    ) -> Result<DMatrix<f64>, TransmissionError> {
        let motor = self.geared.iter().position(|geared| *geared).unwrap_or(0);
        let inverse = self.jacobian(model, q)?.try_inverse();
        inverse.ok_or(TransmissionError::Singular { motor })
    }
}

/// Returns the motion of a link with this row, from that of the coordinates.
fn moved(row: &[(usize, f64)], of_coordinates: &[f64]) -> f64 {
    row.iter()
        .map(|(at, share)| share * of_coordinates[*at])
        .sum()
}

/// Numbers the groups of coupled drives: those of `n` joints with the same number are coupled.
fn coupled(t: Option<&Transmission<f64>>, n: usize) -> Vec<usize> {
    let mut group: Vec<usize> = (0..n).collect();
    for (drive, joint) in (0..n * n).map(|k| (k / n, k % n)) {
        if t.is_some_and(|t| t.turns_with(drive, joint)) {
            let [from, to] = [group[drive], group[joint]];
            for own in group.iter_mut().filter(|own| **own == from) {
                *own = to;
            }
        }
    }
    group
}
