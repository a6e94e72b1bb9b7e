//! Base parameters distributed over the links of a description.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;
use rig_shared::multibody::{COLUMNS, column};

use super::combinations::Combinations;
use super::one_link::one_link;
use super::written::written;
use crate::bodies::prior::described;
use rig_model::robot::Robot;

/// Returns `robot` with these base parameters, and a list of remarks. One link becomes a possible body. Several links
/// take the smallest change of the description, weighted by `weights` (one per standard parameter, above 0; none for
/// equal weights).
pub fn redistributed(
    robot: &Robot,
    base: &Combinations,
    weights: Option<&DVector<f64>>,
) -> (Robot, Vec<String>) {
    let k = base.combination;
    let mut pi = described(robot, k.ncols());
    let mut remarks = Vec::new();
    if robot.link_count() == 1 {
        one_link(robot, base, &mut pi, &mut remarks);
        return written(robot, &pi, remarks);
    }
    let missing = DVector::from_column_slice(base.values) - k * &pi;
    let scaled = match weights {
        Some(weights) => DMatrix::from_fn(k.nrows(), k.ncols(), |i, c| k[(i, c)] * weights[c]),
        None => k.clone(),
    };
    let step = Svd::of(scaled).solve(&missing, UNDETERMINED);
    pi += match weights {
        Some(weights) => step.component_mul(weights),
        None => step,
    };
    without_negative_masses(robot, k, &mut pi, &mut remarks);
    written(robot, &pi, remarks)
}

/// Raises negative masses, which no description can hold, to zero along directions that change no identified
/// combination. (The mass of a revolute link is no combination of its own; the preceding links absorb it.) If there is
/// no such direction, the links keep their described values and a remark reports it.
fn without_negative_masses(
    robot: &Robot,
    k: &DMatrix<f64>,
    pi: &mut DVector<f64>,
    remarks: &mut Vec<String>,
) {
    let masses: Vec<usize> = (0..robot.link_count())
        .map(|j| j * COLUMNS + column::MASS)
        .collect();
    let lacking = DVector::from_iterator(masses.len(), masses.iter().map(|&c| -pi[c].min(0.0)));
    if lacking.amax() == 0.0 {
        return;
    }
    let inverse = Svd::of(k.clone()).pseudo_inverse(UNDETERMINED);
    // Projection onto the directions that the data do not determine; its columns are the masses.
    let seen = inverse * k;
    let free = DMatrix::from_fn(pi.len(), masses.len(), |i, m| {
        f64::from(u8::from(i == masses[m])) - seen[(i, masses[m])]
    });
    let own = free.select_rows(masses.iter());
    let step = Some(Svd::of(own.clone()).solve(&lacking, 1e-9))
        .filter(|y| (&own * y - &lacking).amax() <= 1e-9 * lacking.amax());
    if let Some(y) = step {
        *pi += free * y;
        for &c in &masses {
            // Clear negative rounding errors.
            if pi[c] < 0.0 && pi[c] > -1e-9 * (1.0 + lacking.amax()) {
                pi[c] = 0.0;
            }
        }
        remarks.push("Masses that came out below zero were raised to zero by shifting mass between links in a way that changes no identified combination.".into());
    }
    if masses.iter().any(|&c| pi[c] < 0.0) {
        let prior = robot.standard_parameters();
        for (j, row) in prior.iter().enumerate() {
            for c in column::MASS..column::DRIVE_INERTIA {
                pi[j * COLUMNS + c] = row[c];
            }
        }
        remarks.push("An identified mass is below zero, which no description can hold: identified.toml keeps the masses, moments and inertias that the links had before, so its dynamics are NOT those identified; these stand in identification.json.".into());
    }
}

/// Singular value of the combinations up to which a direction is not determined.
const UNDETERMINED: f64 = 1e-12;
