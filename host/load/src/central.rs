//! Mass, centre of mass and inertia about it, from the ten parameters.

use nalgebra::SVector;
use rig_shared::multibody::INERTIAL_PARAMETERS;

use crate::estimate::{Estimate, Parameters, Square};

/// Mass, centre of mass and inertia about it.
type Central = SVector<f64, INERTIAL_PARAMETERS>;

/// Returns mass, centre of mass and Ixx Ixy Ixz Iyy Iyz Izz about it.
pub(crate) fn central(p: &Parameters) -> Central {
    let mass = p[0];
    let [x, y, z] = [p[1] / mass, p[2] / mass, p[3] / mass];
    Central::from([
        mass,
        x,
        y,
        z,
        p[4] - mass * (y * y + z * z),
        p[5] + mass * x * y,
        p[6] + mass * x * z,
        p[7] - mass * (x * x + z * z),
        p[8] + mass * y * z,
        p[9] - mass * (x * x + y * y),
    ])
}

/// Returns the derivatives of mass, centre of mass and inertia about it by the ten parameters, by differences of a thousandth
/// of the plausible sizes.
pub(crate) fn central_slopes(found: &Estimate) -> Square {
    let mut slopes = Square::zeros();
    for k in 0..INERTIAL_PARAMETERS {
        let step = 1e-3 * found.sizes[k];
        let moved = |by: f64| {
            let mut p = found.values;
            p[k] += by;
            central(&p)
        };
        let slope = (moved(step) - moved(-step)) / (2.0 * step);
        slopes.column_mut(k).copy_from(&slope);
    }
    slopes
}
