//! Covariance of an estimate from a motion that repeats, with the error of the model that comes back in each repetition.
//!
//! The covariance of [`rig_identify`] takes groups of neighbouring rows for independent ones. That holds for noise. An
//! error of the model, such as friction near a reversal, depends on the motion. If the motion repeats, so does the error:
//! n repetitions show it n times and do not average it, and the standard deviation was too small by √n. Here the groups are
//! pieces of the motion, and a piece has its rows of all repetitions.
//!
//! Delete-group jackknife (Shao & Tu 1995, "The Jackknife and Bootstrap", ch. 2; MacKinnon, Nielsen & Webb 2023, "CV₃").

use nalgebra::{DMatrix, DVector};

/// Fewest and most groups, and their shortest length in correlation times of the residual: those of [`rig_identify`].
const GROUPS: [usize; 2] = [8, 64];
const MEMORIES: f64 = 10.0;

/// Sums of the rows of a motion, by place in it.
#[derive(Clone)]
pub(crate) struct MotionGroups {
    /// By group, XᵀX over the base parameters, each row in units of its joint's residual.
    information: Vec<DMatrix<f64>>,
    /// By group, Xᵀe with the residual e.
    score: Vec<DVector<f64>>,
    /// Length of the motion, s.
    length: f64,
}

impl MotionGroups {
    /// Returns empty groups of a motion of `length` (s) over `size` base parameters; `memory` is the correlation time of the
    /// residual, s.
    pub(crate) fn new(size: usize, length: f64, memory: f64) -> Self {
        let groups = (length / (MEMORIES * memory)) as usize;
        let groups = groups.clamp(GROUPS[0], GROUPS[1]);
        Self {
            information: vec![DMatrix::zeros(size, size); groups],
            score: vec![DVector::zeros(size); groups],
            length,
        }
    }

    /// Returns the number of groups.
    pub(crate) fn len(&self) -> usize {
        self.score.len()
    }

    /// Takes a row at `time`, with its residual; `weight` is one over the residual of its joint.
    pub(crate) fn push(&mut self, time: f64, x: &[f64], residual: f64, weight: f64) {
        let place = (time / self.length).rem_euclid(1.0);
        let g = ((place * self.len() as f64) as usize).min(self.len() - 1);
        let x = DVector::from_column_slice(x) * weight;
        self.information[g].ger(1.0, &x, &x, 1.0);
        self.score[g].axpy(weight * residual, &x, 1.0);
    }

    /// Returns the covariance of weighted least squares for values with base parameters = `to_base`·values. `None` if one
    /// group has all information on a value.
    pub(crate) fn covariance(&self, to_base: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let own: Vec<DMatrix<f64>> = (self.information.iter())
            .map(|a| to_base.transpose() * a * to_base)
            .collect();
        let size = to_base.ncols();
        let all = (own.iter()).fold(DMatrix::zeros(size, size), |sum, a| sum + a);
        let scale = all
            .diagonal()
            .map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
        let scale = DMatrix::from_diagonal(&scale);
        let lower = (&scale * &all * &scale).cholesky()?.unpack();
        // Whitened: values = back·z, in which the information of all groups is the identity.
        let back = &scale * lower.transpose().try_inverse()?;
        let identity = DMatrix::<f64>::identity(size, size);
        let mut shifts = Vec::with_capacity(self.len());
        for (information, score) in own.iter().zip(&self.score) {
            let information = back.transpose() * information * &back;
            let score = back.transpose() * (to_base.transpose() * score);
            shifts.push(-(&identity - information).cholesky()?.solve(&score));
        }
        let groups = self.len() as f64;
        let mean = (shifts.iter()).fold(DVector::zeros(size), |sum, s| sum + s) / groups;
        let mut covariance = DMatrix::zeros(size, size);
        for shift in &shifts {
            let away = shift - &mean;
            covariance.ger((groups - 1.0) / groups, &away, &away, 1.0);
        }
        Some(&back * covariance * back.transpose())
    }
}
