//! Gravity by the torques of each joint against that of the described masses: a scale of a torque, as of a wrong torque
//! constant.
//!
//! A factor in a joint's torques multiplies all its parameters, so the fit itself is as good with it. Gravity is the part
//! that the description knows: masses are weighed or come from a drawing. For each joint alone, the described gravity
//! torque enters as one column, its factor unknown; inertias, friction and constants stay free. The gravity columns of the
//! base parameters then tell whether the described *pattern* over the poses holds (χ² of what they take beyond the factor).
//! If it does not, the masses are wrong, and nothing is said about the torques. The noise is what the joint's own fit leaves:
//! a wrong factor stays in the residual of the common fit.
//!
//! A wrong mass beyond the joint in the same proportion looks alike. The joints before it carry that mass as well: if their
//! gravity is as described, the torque is wrong.
//!
//! Friction that changes with load or position looks like another gravity where a pose is not passed in both directions
//! alike. A factor is told only if it holds beside such friction as well.

use nalgebra::{DMatrix, DVector};

use super::own_fit::{OwnFit, ROUNDING, directions, is_contradicted};
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::structure::chain::chain_of;
use crate::warning::{TorqueScale, Warning};
use rig_model::robot::{CONTRADICTED, Robot};
use rig_shared::multibody::{COLUMNS, column, inverse_dynamics};

/// Poses at which gravity is looked for.
const POSES: usize = 8;

/// Share of the strongest joint's gravity above which gravity loads a joint: angles of four digits tilt an axis by 1e-5.
const LOADED: f64 = 1e-4;

/// Gravity in the torques of a joint beside inertias, friction and constants.
struct Gravity {
    /// Joint, counted from 0.
    joint: usize,
    /// Columns of the base parameters that weigh.
    columns: DMatrix<f64>,
    torque: DVector<f64>,
    /// Standard deviation of the torque's noise, with its memory.
    std: f64,
}

/// A joint's torque over that of the described gravity.
#[derive(Clone, Copy)]
struct Scale {
    factor: f64,
    std: f64,
}

impl Scale {
    /// Returns true if the torque is not that of the described gravity.
    fn contradicts(&self) -> bool {
        (self.factor - 1.0).abs() > CONTRADICTED * self.std
    }

    /// Returns true if both joints show the same other masses.
    fn is_like(&self, other: &Self) -> bool {
        let apart = (self.factor - other.factor).abs();
        self.contradicts() && apart < CONTRADICTED * self.std.hypot(other.std)
    }
}

/// Says which joints' torques are the described gravity times a factor.
///
/// # Errors
/// [`IdentifyError::Model`]: a chain without a model.
pub(crate) fn torque_scale(
    problem: &Problem,
    described: &Robot,
    fits: &[OwnFit],
    varying: Option<&[OwnFit]>,
) -> Result<Option<Warning>, IdentifyError> {
    let mut found = scales(problem, described, fits)?;
    if let Some(varying) = varying.filter(|_| !found.is_empty()) {
        let beside = scales(problem, described, varying)?;
        found.retain_mut(|own| {
            let like = beside.iter().find(|other| own.is_like(other));
            own.masses_confirmed &= like.is_some_and(|other| other.masses_confirmed);
            like.is_some()
        });
    }
    Ok((!found.is_empty()).then_some(Warning::TorqueScale(found)))
}

/// Returns the joints whose torques are the described gravity times a factor.
fn scales(
    problem: &Problem,
    described: &Robot,
    fits: &[OwnFit],
) -> Result<Vec<TorqueScale>, IdentifyError> {
    let columns = gravity_columns(problem, described)?;
    if columns.is_empty() {
        return Ok(Vec::new());
    }
    let weights = |robot: &Robot| {
        let all = stated(problem, robot);
        DVector::from_iterator(columns.len(), columns.iter().map(|c| all[*c]))
    };
    let own = weights(described);
    if own.amax() == 0.0 {
        return Ok(Vec::new());
    }
    let scales: Vec<(Gravity, Scale)> = (fits.iter().enumerate())
        .filter_map(|(joint, fit)| Gravity::of(joint, fit, &columns))
        .filter_map(|gravity| gravity.scale(&own).map(|scale| (gravity, scale)))
        .collect();
    let mut found = Vec::new();
    let loaded = loaded_joints(described)?;
    let contradict = |(gravity, scale): &&(Gravity, Scale)| {
        scale.contradicts() && loaded.get(gravity.joint) == Some(&true)
    };
    for (gravity, scale) in scales.iter().filter(contradict) {
        let heavier = weights(&with_masses(described, gravity.joint, scale.factor));
        let before = || (scales.iter()).filter(|(before, _)| before.joint < gravity.joint);
        let confirm =
            |(before, other): &(Gravity, Scale)| !other.contradicts() && before.refutes(&heavier);
        // A joint before it may show the other masses as well, by their weight or inertia.
        let share = |(before, other): &(Gravity, Scale)| {
            other.contradicts() && !before.refutes(&heavier) || other.is_like(scale)
        };
        let masses_confirmed = before().any(confirm) && !before().any(share);
        found.push(TorqueScale {
            joint: described.joints[gravity.joint].name.clone(),
            factor: scale.factor,
            std: scale.std,
            masses_confirmed,
        });
    }
    Ok(found)
}

/// Returns for each joint: does the described gravity load it? Its own equation shows the same moments by their inertia.
fn loaded_joints(described: &Robot) -> Result<Vec<bool>, IdentifyError> {
    let chain = chain_of(described).map_err(|e| IdentifyError::Model(e.to_string()))?;
    let mut parameters = described.standard_parameters();
    for row in &mut parameters {
        row[column::VISCOUS..].fill(0.0);
    }
    let n = described.joints.len();
    let (mut most, still) = (vec![0.0f64; n], vec![0.0; n]);
    for q in poses(n) {
        let mut torque = vec![0.0; n];
        inverse_dynamics(&chain, &parameters, &q, &still, &still, &mut torque)
            .map_err(|e| IdentifyError::Model(e.to_string()))?;
        for (most, own) in most.iter_mut().zip(torque) {
            *most = most.max(own.abs());
        }
    }
    let strongest = most.iter().copied().fold(0.0, f64::max);
    Ok(most.iter().map(|own| *own > LOADED * strongest).collect())
}

/// Returns poses in general position: no two angles are multiples of each other.
pub(crate) fn poses(n: usize) -> impl Iterator<Item = Vec<f64>> {
    (0..POSES).map(move |pose| {
        (0..n)
            .map(|j| 0.7 + 1.3 * pose as f64 + 0.37 * (j * (pose + 1)) as f64)
            .collect()
    })
}

/// Returns the robot whose links from a joint on are heavier by a factor.
fn with_masses(described: &Robot, joint: usize, factor: f64) -> Robot {
    let mut robot = described.clone();
    for own in robot.joints.iter_mut().skip(joint) {
        if let Some(body) = &mut own.inertial {
            body.mass *= factor;
            body.first_moment = body.first_moment.map(|v| factor * v);
        }
    }
    robot
}

/// Returns the base columns on which the torque at rest depends.
fn gravity_columns(problem: &Problem, described: &Robot) -> Result<Vec<usize>, IdentifyError> {
    let chain = chain_of(described).map_err(|e| IdentifyError::Model(e.to_string()))?;
    let n = described.joints.len();
    let still = vec![0.0; n];
    let mut shown = Vec::new();
    for (k, &c) in problem.base.columns.iter().enumerate() {
        if c >= chain.parameter_count() || !(column::MASS..column::INERTIA).contains(&(c % COLUMNS))
        {
            continue;
        }
        let mut rows = vec![[0.0; COLUMNS]; chain.link_count()];
        rows[c / COLUMNS][c % COLUMNS] = 1.0;
        let mut weighs = false;
        for q in poses(n) {
            let mut torque = vec![0.0; n];
            inverse_dynamics(&chain, &rows, &q, &still, &still, &mut torque)
                .map_err(|e| IdentifyError::Model(e.to_string()))?;
            weighs |= torque.iter().any(|t| t.abs() > ROUNDING);
        }
        if weighs {
            shown.push(k);
        }
    }
    Ok(shown)
}

/// Returns the described values of all base columns.
fn stated(problem: &Problem, described: &Robot) -> DVector<f64> {
    let mut standard = described.standard_parameters().as_flattened().to_vec();
    standard.extend(described.motor_parameters().as_flattened());
    standard.resize(problem.base.combination.ncols(), 0.0);
    &problem.base.combination * DVector::from_vec(standard)
}

impl Gravity {
    /// Returns what a joint's own fit leaves of its torque without inertias, friction and constants; `columns` are those that
    /// weigh. `None` without rows.
    fn of(joint: usize, fit: &OwnFit, columns: &[usize]) -> Option<Self> {
        if fit.rows == 0 {
            return None;
        }
        let (r, z) = &fit.system;
        let others: Vec<usize> = (0..r.ncols()).filter(|c| !columns.contains(c)).collect();
        let beside = directions(r.select_columns(&others));
        let columns = r.select_columns(columns);
        Some(Self {
            joint,
            columns: &columns - &beside * beside.tr_mul(&columns),
            torque: z - &beside * beside.tr_mul(z),
            std: fit.std,
        })
    }

    /// Compares the torque with the described gravity; `None` if the data do not show it, or if the described pattern over
    /// the poses does not hold.
    fn scale(&self, stated: &DVector<f64>) -> Option<Scale> {
        let gravity = &self.columns * stated;
        let size = gravity.norm();
        if !(size > CONTRADICTED * self.std) {
            return None;
        }
        let factor = gravity.dot(&self.torque) / (size * size);
        let left = &self.torque - &gravity * factor;
        let along = gravity / size;
        let pattern = directions(&self.columns - &along * along.tr_mul(&self.columns));
        let holds = pattern.ncols() > 0 && !self.contradicted(&pattern, &left);
        holds.then(|| Scale {
            factor,
            std: self.std / size,
        })
    }

    /// Returns true if the torque contradicts a gravity.
    fn refutes(&self, stated: &DVector<f64>) -> bool {
        let left = &self.torque - &self.columns * stated;
        self.contradicted(&directions(self.columns.clone()), &left)
    }

    /// Returns true if a torque along some directions is farther from zero than a value that counts as contradicted.
    fn contradicted(&self, directions: &DMatrix<f64>, torque: &DVector<f64>) -> bool {
        let squares = directions.tr_mul(torque).norm_squared() / (self.std * self.std);
        is_contradicted(squares, directions.ncols())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rig_model::robot::{IRP6_TEMPLATE, ONE_LINK_TEMPLATE, TX40};
    use std::path::Path;

    #[test]
    fn gravity_is_told_only_of_axes_that_it_loads() {
        for (text, upright) in [
            (TX40, Some(0)),
            (IRP6_TEMPLATE, Some(0)),
            (ONE_LINK_TEMPLATE, None),
        ] {
            let mut robot = Robot::from_toml(text, Path::new("r.toml")).unwrap();
            for turned in [false, true] {
                // A wall turns gravity onto the first axis.
                if turned {
                    robot.gravity = [9.81, 0.0, 0.0];
                }
                let loaded = loaded_joints(&robot).unwrap();
                if let Some(joint) = upright {
                    assert_eq!(loaded[joint], turned, "{}", robot.name);
                }
                assert!(loaded.iter().skip(1).take(2).all(|own| *own), "{loaded:?}");
            }
        }
    }
}
