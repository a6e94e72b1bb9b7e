//! What the difference means for the torque: each set's parameters on each set's motion.

use nalgebra::DVector;

use crate::basis::Basis;
use crate::identified_set::IdentifiedSet;
use crate::result::TorqueMatrix;

/// Returns the residuals of each set's parameters, and of the pooled ones, on each set's motion. What a set does not
/// show is taken from the pooled values.
pub(crate) fn torque_matrix(
    sets: &[IdentifiedSet],
    basis: &Basis,
    pooled: &DVector<f64>,
    joints: Vec<String>,
) -> TorqueMatrix {
    let mut parameters: Vec<Vec<f64>> = (sets.iter().enumerate())
        .map(|(s, set)| {
            let away = &set.values - &basis.of_set[s] * pooled;
            let own = pooled + &basis.from_set[s] * away;
            (&basis.to_base * own).as_slice().to_vec()
        })
        .collect();
    parameters.push((&basis.to_base * pooled).as_slice().to_vec());
    let (mut residual, mut torque, mut added) = (Vec::new(), Vec::new(), Vec::new());
    for j in 0..joints.len() {
        let (mut rms, mut whole, mut more) = (Vec::new(), Vec::new(), Vec::new());
        for (motion, set) in sets.iter().enumerate() {
            let factor = &set.rows.factors[j];
            let rows = factor.rows() as f64;
            let of = |x: &[f64]| factor.residual_squares(x) / rows;
            let squares: Vec<f64> = parameters.iter().map(|x| of(x)).collect();
            let total = (factor.right_side_squares() / rows).sqrt();
            let own = squares[motion];
            more.push(
                (squares.iter())
                    .map(|s| (s - own).max(0.0).sqrt() / total)
                    .collect(),
            );
            rms.push(squares.iter().map(|s| s.sqrt()).collect());
            whole.push(total);
        }
        residual.push(rms);
        torque.push(whole);
        added.push(more);
    }
    TorqueMatrix {
        joints,
        residual,
        torque,
        added,
    }
}
