//! Residual shares of the torques: by the description with friction of its own, or by fitted parameters.

use nalgebra::DMatrix;

use crate::DiagnoseError;
use crate::faults::described::{Described, friction};
use crate::faults::fit::Fit;
use crate::faults::judge::Judge;
use crate::faults::rows::Rows;
use rig_numerics::statistics::squares_about_mean;

impl Judge<'_> {
    /// Returns the residual share of each torque's variance: by the description, which has few free numbers, if it
    /// states every link; else by one set of parameters for all joints.
    pub(crate) fn left(&self, rows: &Rows, free_drives: bool) -> Result<Vec<f64>, DiagnoseError> {
        if self.states_from(0) {
            self.left_of_description(rows, self.robot.gravity, free_drives)
        } else {
            self.left_of_parameters(rows)
        }
    }

    fn left_of_parameters(&self, rows: &Rows) -> Result<Vec<f64>, DiagnoseError> {
        let (n, count) = (rows.tau.len(), rows.len());
        let matrices = rows.regressors(&self.form)?;
        // A still torque has no variance to explain.
        let size: Vec<f64> = (rows.tau.iter())
            .map(|tau| squares_about_mean(tau).sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let width = matrices.first().map_or(0, DMatrix::ncols);
        let whole = DMatrix::from_fn(n * count, width, |k, c| {
            matrices[k / count][(k % count, c)] / size[k / count]
        });
        let torque: Vec<f64> = (rows.tau.iter().zip(&size))
            .flat_map(|(tau, size)| tau.iter().map(move |v| v / size))
            .collect();
        let Some(fit) = Fit::of(&whole, &torque, &self.order) else {
            return Ok(vec![1.0; n]);
        };
        let own = |j: usize| fit.residual.rows(j * count, count).norm_squared();
        Ok((0..n).map(own).collect())
    }

    /// Returns the residual share of each torque's variance by the description under another gravity, m/s² in frame 0.
    /// `free_drives`: a drive whose inertia is not described may have any.
    pub(crate) fn left_of_description(
        &self,
        rows: &Rows,
        gravity: [f64; 3],
        free_drives: bool,
    ) -> Result<Vec<f64>, DiagnoseError> {
        let n = self.robot.joints.len();
        let Described { all, motors, .. } = self.described_under(rows, gravity)?;
        let share = |j: usize| {
            let friction = friction(&rows.qd[j], motors.get(j));
            let rest: Vec<f64> = (rows.tau[j].iter().zip(&all[j]))
                .map(|(tau, own)| tau - own)
                .collect();
            let total = squares_about_mean(&rows.tau[j]).max(f64::MIN_POSITIVE);
            let drive = (free_drives && !self.states_drive(j)).then(|| rows.qdd[j].as_slice());
            squares_left(&friction, drive, &rest) / total
        };
        Ok((0..n).map(share).collect())
    }
}

/// Returns the residual squares of a torque by friction, and by the inertia of a drive with acceleration `drive`.
fn squares_left(friction: &DMatrix<f64>, drive: Option<&[f64]>, torque: &[f64]) -> f64 {
    let count = friction.ncols();
    let fit = |x: &DMatrix<f64>| Fit::of(x, torque, &(0..x.ncols()).collect::<Vec<_>>());
    let with = drive.and_then(|acceleration| {
        let mut x = friction.clone().insert_column(count, 0.0);
        x.column_mut(count).copy_from_slice(acceleration);
        // No drive has negative inertia.
        fit(&x).filter(|fit| {
            fit.parameter(count)
                .is_some_and(|inertia| inertia.value > 0.0)
        })
    });
    with.or_else(|| fit(friction)).map_or_else(
        || squares_about_mean(torque),
        |fit| fit.residual.norm_squared(),
    )
}
