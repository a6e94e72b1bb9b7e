//! Data common to all starts of a design, and the regressor's rows.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;
use rig_shared::lanes::Lanes;
use rig_shared::multibody::{COLUMNS, Chain, INERTIAL_PARAMETERS, differential_regressor};
use rig_shared::transmission::MOTOR_COLUMNS;

use crate::bounds::Bounds;
use crate::criterion::Values;
use crate::drives::{Combined, Drives};
use crate::lanes::LANES;
use crate::schedule::{JointMotion, Schedule};
use crate::workspace::Plane;
use crate::wrist_chain::{AXES, WristChain};
use crate::{Criterion, ExciteError};
use rig_model::simulate::SimulateError;

/// Data common to all starts.
pub(super) struct Frame {
    pub lanes: Chain<Lanes<LANES>>,
    pub plain: Chain<f64>,
    /// Regressor columns of the identified parameters, in ascending order. Of a wrist sensor: the load's parameters from 0.
    pub columns: Vec<usize>,
    /// Size by which each of these columns is divided.
    pub sizes: Vec<f64>,
    /// Factor of the rows of each joint, or of each axis of the wrist sensor.
    pub weights: Vec<f64>,
    /// The wrist sensor, if its readings are the rows; its biases are unknown. Otherwise the joint torques are.
    pub wrist: Option<WristChain>,
    /// Prior parameters, if the description has all of them.
    pub parameters: Option<Vec<[f64; COLUMNS]>>,
    /// Drives that are coupled or have a varying ratio.
    pub drives: Option<Box<Drives>>,
    pub bounds: Vec<Bounds>,
    /// Ranges of cranks.
    pub combined: Vec<Combined>,
    /// Planes that bound points of the links.
    pub planes: Vec<Plane>,
    pub schedule: Schedule,
    /// Start positions of the joints, unless free.
    pub fixed: Option<Vec<f64>>,
    pub criterion: Criterion,
}

/// Returns the columns of the motors, n × 3n; empty if there are none.
fn motors_at(
    drives: Option<&Drives>,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> Result<Vec<f64>, ExciteError> {
    let Some(drives) = drives else {
        return Ok(Vec::new());
    };
    let mut out = vec![0.0; q.len() * q.len() * MOTOR_COLUMNS];
    drives
        .plain
        .motor_columns(q, qd, qdd, &mut out)
        .map_err(SimulateError::from)?;
    Ok(out)
}

/// Returns the entry of base column `c` in the row of joint `j`; the motors' columns follow the `width` of the links.
fn entry(own: &[f64], motors: &[f64], [n, width]: [usize; 2], j: usize, c: usize) -> f64 {
    match c.checked_sub(width) {
        Some(m) => motors[j * n * MOTOR_COLUMNS + m],
        None => own[j * width + c],
    }
}

impl Frame {
    /// Returns the number of readings at an instant: the joints' torques, or the axes of the wrist sensor.
    pub(super) fn readings(&self) -> usize {
        match self.wrist {
            Some(_) => AXES,
            None => self.bounds.len(),
        }
    }

    /// Returns the regressor of the identified parameters at an instant, one row a reading, without weights.
    pub(super) fn regressor(&self, state: [&[f64]; 3]) -> Result<DMatrix<f64>, ExciteError> {
        let columns = &self.columns;
        if let Some(wrist) = &self.wrist {
            let rows = wrist.rows(state)?;
            return Ok(DMatrix::from_fn(AXES, columns.len(), |axis, c| {
                rows[axis * INERTIAL_PARAMETERS + columns[c]]
            }));
        }
        let [q, qd, qdd] = state;
        let n = q.len();
        let width = self.plain.parameter_count();
        let mut own = vec![0.0; n * width];
        differential_regressor(&self.plain, q, qd, qdd, &mut own)?;
        let motors = motors_at(self.drives.as_deref(), q, qd, qdd)?;
        Ok(DMatrix::from_fn(n, columns.len(), |j, c| {
            entry(&own, &motors, [n, width], j, columns[c])
        }))
    }
}

/// Subtracts from the rows of each reading (every `readings`-th row) their mean: what is left of them if the reading has
/// a constant bias that is unknown. The information of the parameters is then that of the remaining rows.
pub(super) fn subtract_means(rows: &mut DMatrix<f64>, readings: usize) {
    let instants = (rows.nrows() / readings).max(1) as f64;
    for mut column in rows.column_iter_mut() {
        for reading in 0..readings {
            let own = || (reading..column.len()).step_by(readings);
            let mean = own().map(|row| column[row]).sum::<f64>() / instants;
            own().for_each(|row| column[row] -= mean);
        }
    }
}

/// Returns the singular values of a motion's regressor over one period at `samples` instants.
pub(super) fn values_of(
    frame: &Frame,
    motions: &[JointMotion],
    samples: usize,
) -> Result<Values, ExciteError> {
    let n = motions.len();
    let (p, readings) = (frame.columns.len(), frame.readings());
    let trajectories: Vec<_> = motions
        .iter()
        .map(|m| frame.schedule.trajectory(&m.coefficients))
        .collect();
    let mut plain = DMatrix::zeros(samples * readings, p);
    let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for s in 0..samples {
        let micros = f64::from(frame.schedule.ramp_us)
            + f64::from(frame.schedule.period_us) * s as f64 / samples as f64;
        for j in 0..n {
            let at = trajectories[j].at(micros * 1e-6);
            q[j] = motions[j].base + at.position;
            qd[j] = at.velocity;
            qdd[j] = at.acceleration;
        }
        let rows = frame.regressor([&q, &qd, &qdd])?;
        plain.rows_mut(s * readings, readings).copy_from(&rows);
    }
    if frame.wrist.is_some() {
        subtract_means(&mut plain, readings);
    }
    let scaled = DMatrix::from_fn(plain.nrows(), p, |row, c| {
        plain[(row, c)] * frame.weights[row % readings] / frame.sizes[c]
    });
    let condition = |s: &DVector<f64>| s.max() / s.min();
    let singular_values = |m: DMatrix<f64>| Svd::of(m).singular_values;
    let singular = singular_values(scaled);
    let root = (samples as f64).sqrt();
    let logs: f64 = singular.iter().map(|s| (s / root).ln()).sum();
    Ok(Values {
        condition_number: condition(&singular),
        smallest_singular_value: singular.min() / root,
        mean_singular_value: (logs / p as f64).exp(),
        si_condition_number: condition(&singular_values(plain)),
    })
}
