//! Which parameters of a load a robot can show at all, whatever its motion is.
//!
//! The regressor at random states has the directions that some motion shows. The others are its null space: a planar arm
//! turns its load about one axis only, and a horizontal one does not lift it.

use nalgebra::{DMatrix, DVector, SMatrix, SymmetricEigen};
use rand::{RngExt, SeedableRng};
use rig_model::robot::Robot;
use rig_shared::multibody::{
    COLUMNS, Chain, INERTIAL_PARAMETERS, MultibodyError, differential_regressor, wrench_regressor,
};

use crate::estimate::{Square, sizes_of};
use crate::options::By;
use crate::wrench_row::{ENTRIES, about};

/// Random states: with six readings or some torques each they are many more equations than parameters.
const STATES: usize = 60;
/// Eigenvalue of the normal matrix, relative to the largest one, below which a direction is rounding. By judgement: its sums of some
/// hundred products are exact to about 1e-14, and a direction of 1e-10 has 1e-5 of the effect of the clearest one.
const ROUNDING: f64 = 1e-10;
/// Share of a parameter, squared, in directions without effect from which no motion shows it by itself.
const HIDDEN: f64 = 1e-6;

/// What the robot may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Movement {
    /// Move with any speed and acceleration.
    Any,
    /// Stand in any pose.
    Rest,
}

/// Returns for each parameter if some motion or pose of the robot shows it, by the means `by`.
///
/// # Errors
/// [`MultibodyError`].
pub(crate) fn shown_by(
    robot: &Robot,
    chain: &Chain<f64>,
    to_joint: &Square,
    (by, movement): (By, Movement),
) -> Result<[bool; INERTIAL_PARAMETERS], MultibodyError> {
    let joints = robot.joints.len();
    let sensor = robot.flange_pose() * robot.wrist_sensor.clone().unwrap_or_default().pose();
    let mut random = rand_pcg::Pcg64::seed_from_u64(2);
    let mut draw = |most: f64| -> Vec<f64> {
        let value = |_| most * (2.0 * random.random::<f64>() - 1.0);
        (0..joints).map(value).collect()
    };
    let speed = if movement == Movement::Any { 3.0 } else { 0.0 };
    // One matrix a channel, one row a state.
    let mut channels: Vec<Vec<f64>> = vec![Vec::new(); 6 + joints];
    let mut regressor = [0.0; ENTRIES];
    let mut torques = vec![0.0; joints * chain.parameter_count()];
    for _ in 0..STATES {
        let [q, qd, qdd] = [draw(std::f64::consts::PI), draw(speed), draw(3.0 * speed)];
        if by != By::Torque {
            wrench_regressor(chain, &q, &qd, &qdd, &mut regressor)?;
            about(&sensor.translation.vector, &mut regressor);
            let rows = regressor.chunks(INERTIAL_PARAMETERS);
            (channels.iter_mut().zip(rows)).for_each(|(own, row)| own.extend(row));
        }
        if by != By::Sensor {
            differential_regressor(chain, &q, &qd, &qdd, &mut torques)?;
            let of_last = torques.chunks(chain.parameter_count()).map(|row| {
                let first = chain.last_link() * COLUMNS;
                &row[first..first + INERTIAL_PARAMETERS]
            });
            (channels[6..].iter_mut().zip(of_last)).for_each(|(own, row)| own.extend(row));
        }
    }
    Ok(not_hidden(&normal_matrix(&channels, to_joint)))
}

/// Returns the normal matrix of the parameters over their plausible sizes. Each channel has a constant of its own beside
/// them: the bias of a sensor, or friction.
fn normal_matrix(channels: &[Vec<f64>], to_joint: &Square) -> Square {
    let scale = to_joint * Square::from_diagonal(&sizes_of(1.0));
    let mut sum = Square::zeros();
    for values in channels {
        let states = values.len() / INERTIAL_PARAMETERS;
        let rows = DMatrix::from_row_slice(states, INERTIAL_PARAMETERS, values);
        let rows = rows * scale;
        let means: Vec<f64> = rows.column_iter().map(|own| own.mean()).collect();
        let mut centred = rows;
        for (mut column, mean) in centred.column_iter_mut().zip(means) {
            column.add_scalar_mut(-mean);
        }
        sum += SMatrix::from_iterator((centred.transpose() * &centred).iter().copied());
    }
    sum
}

/// Returns for each parameter if it has no part in the null space of a normal matrix.
fn not_hidden(normal: &Square) -> [bool; INERTIAL_PARAMETERS] {
    let eigen = SymmetricEigen::new(*normal);
    let largest = eigen.eigenvalues.max();
    let hidden: Vec<DVector<f64>> = (eigen.eigenvalues.iter().enumerate())
        .filter(|(_, value)| **value <= ROUNDING * largest)
        .map(|(k, _)| DVector::from_column_slice(eigen.eigenvectors.column(k).as_slice()))
        .collect();
    std::array::from_fn(|k| hidden.iter().map(|own| own[k].powi(2)).sum::<f64>() < HIDDEN)
}
