//! Signs by friction, inertia and gravity.

use nalgebra::DVector;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::DiagnoseError;
use crate::faults::described::Described;
use crate::faults::finding::Fault;
use crate::faults::fit::{Fit, Measured};
use crate::faults::judge::Judge;
use crate::faults::misfit::{Misfit, Sense};
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;
use rig_data::reference_scale;
use rig_numerics::statistics;

/// Least distance of a sign from zero, standard deviations.
const CLEAR: f64 = 4.0;

impl Judge<'_> {
    /// Returns the joint's mean own inertia over its motion, as weights of the parameters.
    pub(crate) fn inertia(&self, j: usize) -> Result<DVector<f64>, DiagnoseError> {
        let mut still = self.rows.thinned(200);
        for column in still.qd.iter_mut().chain(&mut still.qdd) {
            column.fill(0.0);
        }
        let without = still.regressors(&self.form)?;
        still.qdd[j].fill(1.0);
        let with = still.regressors(&self.form)?;
        let difference = &with[j] - &without[j];
        Ok(DVector::from_fn(self.form.width(), |c, _| {
            difference.column(c).mean()
        }))
    }

    /// Returns the friction power, W, its share of the variation of torque and speed, and the joint's own inertia.
    pub(crate) fn senses(
        &self,
        j: usize,
        fit: &Fit,
    ) -> Result<(Measured, f64, Measured), DiagnoseError> {
        let qd = &self.rows.qd[j];
        let count = qd.len().max(1) as f64;
        let squares = statistics::mean_square(qd);
        let mut friction = DVector::zeros(self.form.width());
        friction[j * COLUMNS + column::VISCOUS] = squares;
        friction[j * COLUMNS + column::COULOMB] = qd.iter().map(|v| v.abs()).sum::<f64>() / count;
        // A coupled motor's dry friction takes power from all its joints; its column in this joint's torque stands for
        // all of it. Its viscous part is in the joints' own, but for an exchange between them, of either sign.
        let motors = self.robot.joints.len() * COLUMNS..self.form.width();
        for c in motors.skip(motor_column::COULOMB).step_by(MOTOR_COLUMNS) {
            let power = (self.matrices.iter().zip(&self.rows.qd))
                .flat_map(|(own, qd)| qd.iter().enumerate().map(move |(k, v)| own[(k, c)] * v))
                .sum::<f64>();
            friction[c] = power / count;
        }
        let loss = fit.functional(&friction);
        let varied = (statistics::squares_about_mean(&self.rows.tau[j]) / count).sqrt();
        let share = loss.value / (varied * squares.sqrt()).max(f64::MIN_POSITIVE);
        Ok((loss, share, fit.functional(&self.inertia(j)?)))
    }

    /// Suspects opposite senses of torque and motion if friction drives and inertia is negative.
    pub(crate) fn sign(
        &self,
        j: usize,
        described: Option<&Described>,
    ) -> Result<Option<Suspicion>, DiagnoseError> {
        let Some(fit) = self.fits[j].as_ref() else {
            return Ok(None);
        };
        let (loss, share, inertia) = self.senses(j, fit)?;
        let (l, i) = (loss.sigmas(), inertia.sigmas());
        // The motion may hide one of them; the other must then be clearer.
        let both = l < -1.5 && i < -1.5 && (l + i) / core::f64::consts::SQRT_2 < -CLEAR;
        let by_friction = l < -CLEAR && share < -0.1 && i < 3.0;
        let by_inertia = i < -1.5 * CLEAR && share < -0.02 && l < 3.0;
        if !(both || by_friction || by_inertia) || fit.unexplained() > 0.5 {
            return Ok(None);
        }
        let (torque, position) = (Undo::Torque(Some(j), -1.0), Undo::Position(Some(j), -1.0));
        let (undo, sense) = match self.scales(&self.rows, j, described).0 {
            // The reference is evidence without a description.
            _ if self.reference_against(j) => (position, Sense::Reference),
            Some(gravity) if gravity.value > 0.0 => (position, Sense::GravityRight),
            Some(_) => (torque, Sense::GravityWrong),
            None => (torque, Sense::Open),
        };
        let found = Misfit::Opposed {
            loss: loss.value,
            inertia: inertia.value,
            sense,
        };
        let fault = Fault::of_joint(j, found);
        Ok(Some(Suspicion::new(fault, undo)))
    }

    /// Returns true if the joint's reference runs against its position.
    pub(crate) fn reference_against(&self, j: usize) -> bool {
        let longest = self.runs.iter().max_by_key(|run| run.len());
        let joint = longest.and_then(|run| run.joints.get(j));
        let scale = joint.and_then(|own| reference_scale(&own.q_raw, own.reference.as_ref()?));
        scale.is_some_and(|s| s < 0.0)
    }
}
