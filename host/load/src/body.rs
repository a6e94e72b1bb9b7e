//! The load as a body that can exist.

use rig_identify::{Divergence, least_eigenvalue};
use rig_shared::multibody::INERTIAL_PARAMETERS;

use crate::estimate::{Estimate, PLAUSIBLE_DISTANCE, Parameters, Square};

/// Weight of the divergence from a sphere, in units of the noise. Small: it decides only what the data do not.
const PULL: f64 = 0.1;
/// Additions to the diagonal of the scaled Hessian, tried in this order: rounding may make it indefinite.
const RIDGES: [f64; 4] = [0.0, 1e-12, 1e-9, 1e-6];
/// Largest number of Newton steps.
const MOST_STEPS: usize = 200;
/// Least scaled eigenvalue of the pseudo-inertia of a body.
const LEAST: f64 = 1e-9;

/// Returns the body nearest to an estimate, by its covariance, with a positive semidefinite pseudo-inertia (Wensing,
/// Kim & Slotine 2018). What the data do not show is that of a sphere of the estimated mass about its centre. `None` if
/// the mass is not positive.
pub(crate) fn body(found: &Estimate) -> Option<Parameters> {
    let shown = found.shown();
    let mass = found.values[0];
    if !(mass > 0.0) {
        return None;
    }
    if shown.iter().all(|s| *s) && least_eigenvalue(found.values.as_slice()) > LEAST {
        return Some(found.values);
    }
    let sphere = sphere(found, &shown);
    let pull = Divergence::new(sphere.as_slice())?;
    let cost = |x: &Parameters| {
        let off = x - found.values;
        Some(0.5 * off.dot(&(found.information * off)) + PULL * pull.value(x.as_slice())?)
    };
    let mut x = sphere;
    for _ in 0..MOST_STEPS {
        let (slope, bend) = pull.derivatives(x.as_slice())?;
        let gradient = found.information * (x - found.values) + slope * PULL;
        let hessian = found.information + bend * PULL;
        // Sizes of the parameters differ by orders of magnitude.
        let scale = Parameters::from_fn(|k, _| 1.0 / hessian[(k, k)].sqrt());
        let scaled = hessian.map_with_location(|r, c, v| v * scale[r] * scale[c]);
        let symmetric = (scaled + scaled.transpose()) * 0.5;
        let right = gradient.component_mul(&scale);
        let step = RIDGES.iter().find_map(|ridge| {
            let cholesky = (symmetric + Square::identity() * *ridge).cholesky()?;
            Some(-cholesky.solve(&right).component_mul(&scale))
        })?;
        let decrement = -gradient.dot(&step);
        let before = cost(&x)?;
        let mut length = 1.0;
        while length > 1e-12 {
            let next = x + step * length;
            if cost(&next).is_some_and(|v| v <= before - 1e-4 * length * decrement) {
                x = next;
                break;
            }
            length *= 0.5;
        }
        if decrement < 1e-12 || length <= 1e-12 {
            break;
        }
    }
    Some(x)
}

/// Returns a sphere of the estimated mass about the centre that the data show.
fn sphere(found: &Estimate, shown: &[bool; INERTIAL_PARAMETERS]) -> Parameters {
    let mass = found.values[0];
    let moment: [f64; 3] = std::array::from_fn(|k| {
        if shown[k + 1] {
            found.values[k + 1]
        } else {
            0.0
        }
    });
    let [x, y, z] = moment.map(|h| h / mass);
    let own = 0.4 * PLAUSIBLE_DISTANCE.powi(2);
    Parameters::from([
        mass,
        moment[0],
        moment[1],
        moment[2],
        mass * (own + y * y + z * z),
        -mass * x * y,
        -mass * x * z,
        mass * (own + x * x + z * z),
        -mass * y * z,
        mass * (own + x * x + y * y),
    ])
}
