//! The joint-space inertia matrix over sampled poses.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rig_shared::multibody::inertia_matrix;

use super::finding::Audit;
use crate::robot::error::Place;
use crate::robot::joint::Joint;
use crate::robot::serial_robot::Robot;
use rig_output::format_significant;

/// Number of poses. A light wrist behind a wrong link fails at most of them.
const POSES: usize = 200;
/// Smallest eigenvalue as a share of the largest from which on the matrix counts as positive definite: rounding is 1e-16
/// times the number of sums.
const ROUNDING: f64 = 1e-13;

/// Returns the range that poses of a joint are drawn from.
fn range(joint: &Joint) -> [f64; 2] {
    use std::f64::consts::PI;
    let stated = joint.limits.as_ref().map(|limits| limits.position);
    match stated {
        Some([low, high]) if low.is_finite() && high.is_finite() => [low, high],
        _ => [-PI, PI],
    }
}

/// Draws a pose within the position limits.
pub(super) fn pose(robot: &Robot, rng: &mut Pcg64) -> Vec<f64> {
    let ranges = robot.joints.iter().map(range);
    let drawn = ranges.map(|[low, high]| match low < high {
        true => rng.random_range(low..high),
        false => low,
    });
    drawn.collect()
}

/// Checks that the inertia matrix of a chain is positive definite at poses drawn with `seed`. `places`: where each joint
/// stands.
pub(super) fn inertia_matrices(audit: &mut Audit, robot: &Robot, places: &[Place], seed: u64) {
    let n = robot.joints.len();
    let Ok(chain) = robot.chain() else {
        audit
            .unchecked
            .push("The inertia matrix was not checked: the chain has too many joints.".to_owned());
        return;
    };
    let parameters = robot.standard_parameters();
    let mut rng = Pcg64::seed_from_u64(seed);
    let (mut bad, mut worst): (usize, Option<(f64, usize)>) = (0, None);
    let mut out = vec![0.0; n * n];
    for _ in 0..POSES {
        let q = pose(robot, &mut rng);
        if inertia_matrix(&chain, &parameters, &q, &mut out).is_err() {
            continue;
        }
        let eigen = DMatrix::from_row_slice(n, n, &out).symmetric_eigen();
        let (place, smallest) = eigen.eigenvalues.argmin();
        if smallest <= ROUNDING * eigen.eigenvalues.max() {
            bad += 1;
            if worst.is_none_or(|(value, _)| smallest < value) {
                worst = Some((smallest, eigen.eigenvectors.column(place).iamax()));
            }
        }
    }
    audit.checked(
        "inertia-matrix",
        "poses for a positive definite inertia matrix",
        POSES,
    );
    if let Some((value, joint)) = worst
        && let Some(place) = places.get(joint)
    {
        let name = &robot.joints[joint].name;
        let sentence = format!(
            "at {bad} of {POSES} poses the joint-space inertia matrix is not positive definite (smallest eigenvalue {}), mostly along joint `{name}`: the links that it moves have too little mass or an impossible inertia, and no simulator can move them",
            format_significant(value, 3)
        );
        audit.find("inertia-matrix", name, *place, sentence);
    }
}
