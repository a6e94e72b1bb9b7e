//! Torque of the links in fields of gravity beside the described one.

use rig_shared::multibody::{COLUMNS, Chain, MultibodyError, gravity_vector};

/// Torque at all joints in each of several uniform fields, for given inertial values.
pub struct FieldTorque {
    fields: Vec<Chain<f64>>,
    parameters: Vec<[f64; COLUMNS]>,
    q: Vec<f64>,
    torque: Vec<Vec<f64>>,
}

impl FieldTorque {
    /// Builds it for `fields`, accelerations in the base frame, m/s². `parameters` has the standard parameters of each
    /// link, of which those of drives and friction do not count.
    pub fn new(
        chain: &Chain<f64>,
        fields: impl IntoIterator<Item = [f64; 3]>,
        parameters: Vec<[f64; COLUMNS]>,
    ) -> Self {
        let n = chain.joint_count();
        let fields: Vec<Chain<f64>> = (fields.into_iter())
            .map(|field| chain.with_gravity(field))
            .collect();
        Self {
            torque: vec![vec![0.0; n]; fields.len()],
            fields,
            parameters,
            q: vec![0.0; n],
        }
    }

    /// Returns the torque at all joints, N·m or N, in each field with the joints at `q`.
    ///
    /// # Errors
    /// [`MultibodyError::WrongLength`].
    pub fn at(&mut self, q: impl IntoIterator<Item = f64>) -> Result<&[Vec<f64>], MultibodyError> {
        for (to, of) in self.q.iter_mut().zip(q) {
            *to = of;
        }
        for (chain, torque) in self.fields.iter().zip(&mut self.torque) {
            gravity_vector(chain, &self.parameters, &self.q, torque)?;
        }
        Ok(&self.torque)
    }
}
