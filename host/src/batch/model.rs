//! Torques, accelerations and inertia matrices of many samples.

use rig_shared::multibody::{
    COLUMNS, Chain, MAX_JOINTS, MultibodyError, forward_dynamics, gravity_vector, inertia_matrix,
    inverse_dynamics,
};

use super::BatchError;
use super::signals::{output, row, samples};

/// A chain with its parameters, prepared for batches.
#[derive(Clone, Debug)]
pub struct ModelBatch {
    chain: Chain<f64>,
    parameters: Vec<[f64; COLUMNS]>,
}

impl ModelBatch {
    /// Prepares a chain with one row of parameters a joint, in the order of
    /// [`COLUMN_NAMES`](rig_shared::multibody::COLUMN_NAMES).
    ///
    /// # Errors
    /// [`BatchError::Multibody`] where the number of rows is not that of the joints.
    pub fn new(chain: &Chain<f64>, parameters: &[[f64; COLUMNS]]) -> Result<Self, BatchError> {
        if parameters.len() != chain.joint_count() {
            return Err(MultibodyError::WrongLength {
                argument: "parameters",
                expected: chain.joint_count(),
                found: parameters.len(),
            }
            .into());
        }
        Ok(Self {
            chain: chain.clone(),
            parameters: parameters.to_vec(),
        })
    }

    /// Number of joints n.
    pub fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }

    /// Torques that move the chain by `q`, `qd`, `qdd`, drives, friction and offsets included:
    /// [`inverse_dynamics`] of every sample. `tau` holds n columns.
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong.
    pub fn inverse_dynamics<S: AsRef<[f64]>>(
        &self,
        q: &[S],
        qd: &[S],
        qdd: &[S],
        tau: &mut [f64],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q), ("qd", qd), ("qdd", qdd)])?;
        output(n, count, tau)?;
        let [mut a, mut b, mut c, mut d] = [[0.0; MAX_JOINTS]; 4];
        for k in 0..count {
            row(q, k, &mut a);
            row(qd, k, &mut b);
            row(qdd, k, &mut c);
            let (chain, p) = (&self.chain, &self.parameters);
            inverse_dynamics(chain, p, &a[..n], &b[..n], &c[..n], &mut d[..n])?;
            scatter(&d[..n], k, count, tau);
        }
        Ok(())
    }

    /// Torques that hold the links still against gravity, without drives, friction and offsets:
    /// [`gravity_vector`] of every sample. `out` holds n columns.
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong.
    pub fn gravity<S: AsRef<[f64]>>(&self, q: &[S], out: &mut [f64]) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q)])?;
        output(n, count, out)?;
        let [mut a, mut d] = [[0.0; MAX_JOINTS]; 2];
        for k in 0..count {
            row(q, k, &mut a);
            gravity_vector(&self.chain, &self.parameters, &a[..n], &mut d[..n])?;
            scatter(&d[..n], k, count, out);
        }
        Ok(())
    }

    /// Inertia matrices, drive inertias on the diagonal included: [`inertia_matrix`] of every sample. `out` holds
    /// n² columns, column `i * n + j` the entry (i, j).
    ///
    /// # Errors
    /// [`BatchError`] where a length is wrong.
    pub fn inertia_matrix<S: AsRef<[f64]>>(
        &self,
        q: &[S],
        out: &mut [f64],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q)])?;
        output(n * n, count, out)?;
        let (mut a, mut d) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS * MAX_JOINTS]);
        for k in 0..count {
            row(q, k, &mut a);
            inertia_matrix(&self.chain, &self.parameters, &a[..n], &mut d[..n * n])?;
            scatter(&d[..n * n], k, count, out);
        }
        Ok(())
    }

    /// Accelerations under the torques `tau`: [`forward_dynamics`] of every sample. `qdd` holds n columns.
    ///
    /// # Errors
    /// [`BatchError::NotPositiveDefinite`] with the first sample where it happens; others where a length is wrong.
    pub fn forward_dynamics<S: AsRef<[f64]>>(
        &self,
        q: &[S],
        qd: &[S],
        tau: &[S],
        qdd: &mut [f64],
    ) -> Result<(), BatchError> {
        let n = self.joint_count();
        let count = samples(n, &[("q", q), ("qd", qd), ("tau", tau)])?;
        output(n, count, qdd)?;
        let [mut a, mut b, mut c, mut d] = [[0.0; MAX_JOINTS]; 4];
        for k in 0..count {
            row(q, k, &mut a);
            row(qd, k, &mut b);
            row(tau, k, &mut c);
            let (chain, p) = (&self.chain, &self.parameters);
            forward_dynamics(chain, p, &a[..n], &b[..n], &c[..n], &mut d[..n]).map_err(
                |e| match e {
                    MultibodyError::NotPositiveDefinite { joint } => {
                        BatchError::NotPositiveDefinite { sample: k, joint }
                    }
                    other => other.into(),
                },
            )?;
            scatter(&d[..n], k, count, qdd);
        }
        Ok(())
    }
}

/// Writes row `k` of a matrix of columns.
fn scatter(row: &[f64], k: usize, samples: usize, out: &mut [f64]) {
    for (c, value) in row.iter().enumerate() {
        out[c * samples + k] = *value;
    }
}
