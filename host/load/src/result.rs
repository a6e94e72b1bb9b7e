//! The identified load.

use nalgebra::{Matrix3, SVector, Vector3};
use rig_data::prepare::PreprocessingPlan;
use rig_identify::{t_quantile, unit};
use rig_model::robot::{JointKind, Load};
use rig_shared::multibody::{COLUMN_NAMES, INERTIAL_PARAMETERS};
use serde::Serialize;

use crate::central::{central, central_slopes};
use crate::estimate::Estimate;
use crate::findings::SensorFindings;
use crate::known_mass::MassCheck;
use crate::load_friction::LoadFriction;
use crate::options::By;
use crate::torque::TorqueTrace;

/// A value with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Value {
    /// The value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Half of the 95 % interval (Student's t).
    pub half_interval: f64,
}

/// A parameter of the load in the flange frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadParameter {
    /// m mx my mz Ixx Ixy Ixz Iyy Iyz Izz.
    pub name: &'static str,
    /// Unit, ASCII.
    pub unit: &'static str,
    /// Value and uncertainty.
    #[serde(flatten)]
    pub value: Value,
    /// True if the data show it: its standard deviation is below half of its plausible size.
    pub shown: bool,
}

impl LoadParameter {
    /// Returns the symbol of the parameter for readers.
    pub fn symbol(&self) -> &'static str {
        symbol(self.name)
    }
}

/// Returns the symbols of parameters for readers, by their names.
pub fn parameter_symbols(names: &[&'static str]) -> Vec<&'static str> {
    names.iter().map(|name| symbol(name)).collect()
}

/// Returns the symbol of a parameter for readers: the names of the first moments are those of the sensor's moments, too.
pub(crate) fn symbol(name: &'static str) -> &'static str {
    match name {
        "mx" => "m·cx",
        "my" => "m·cy",
        "mz" => "m·cz",
        _ => name,
    }
}

/// What the joint torques tell beside the load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueFindings {
    /// Joints.
    pub joints: Vec<String>,
    /// Per joint, RMS of the torque residual with the load, N·m or N; `None` if none of its torques was used.
    pub residual: Vec<Option<f64>>,
    /// Per joint, RMS that the noise of its torque leaves in the band of the fit, N·m or N, inferred from the torque above
    /// the band; `None` if the band leaves nothing above it.
    pub noise: Vec<Option<f64>>,
    /// Friction that grows with the torque that a joint carries, where the data show it.
    pub load_friction: Vec<LoadFriction>,
    /// True if recordings without the load gave the parameters of the robot; false if its description did.
    pub with_unloaded: bool,
    /// Preparation of the recordings.
    pub prepared: PreprocessingPlan,
    /// Torques over time, of the recordings with the load.
    #[serde(skip)]
    pub traces: Vec<TorqueTrace>,
}

/// Comparison of the load by sensor and by torque.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// Probability that both differ by chance as much as they do (F test over the directions that both show).
    pub chance: f64,
    /// Number of these directions.
    pub directions: usize,
    /// The ten parameters by the sensor.
    pub by_sensor: [f64; INERTIAL_PARAMETERS],
    /// Their standard deviations.
    pub by_sensor_std: [f64; INERTIAL_PARAMETERS],
    /// The ten parameters by the joint torques.
    pub by_torque: [f64; INERTIAL_PARAMETERS],
    /// Their standard deviations.
    pub by_torque_std: [f64; INERTIAL_PARAMETERS],
}

/// The identified load.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadIdentification {
    /// `rig-load/1`.
    pub schema: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// What the load was measured by.
    pub by: By,
    /// The ten parameters in the flange frame, inertia about its origin.
    pub parameters: Vec<LoadParameter>,
    /// Covariance of the parameters, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Mass, kg.
    pub mass: Value,
    /// Centre of mass in the flange frame, m.
    pub centre: [Value; 3],
    /// Ixx Ixy Ixz Iyy Iyz Izz about the centre of mass, axes of the flange, kg·m².
    pub inertia: [Value; 6],
    /// True if the data show all six entries of the inertia.
    pub inertia_shown: bool,
    /// Principal moments about the centre of mass, smallest first, kg·m².
    pub principal_moments: [f64; 3],
    /// The same with their uncertainty, to first order.
    pub principal: [Value; 3],
    /// Principal axes in the flange frame, one unit vector each, right-handed.
    pub principal_axes: [[f64; 3]; 3],
    /// The load as a body that can exist: the parameters, or the nearest body if no body has them. What the data do not
    /// show is that of a sphere about the centre of mass.
    pub body: Load,
    /// True if the parameters themselves are those of a body.
    pub consistent: bool,
    /// Degrees of freedom of the standard deviations.
    pub degrees_of_freedom: usize,
    /// Findings of the wrist sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<SensorFindings>,
    /// Findings of the joint torques.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<TorqueFindings>,
    /// Comparison of both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub agreement: Option<Agreement>,
    /// Comparison of the masses by sensor and by torques with a known one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mass_checks: Vec<MassCheck>,
    /// What the data do not show, and what would.
    pub not_shown: Vec<NotShown>,
    /// Warnings, the most important first.
    pub warnings: Vec<String>,
}

impl LoadIdentification {
    /// Returns true if the data show the mass.
    pub fn mass_shown(&self) -> bool {
        self.parameters.first().is_some_and(|p| p.shown)
    }

    /// Returns for x, y and z of the centre of mass if the data show it: mass and first moment.
    pub fn centre_shown(&self) -> [bool; 3] {
        let mass = self.mass_shown();
        std::array::from_fn(|k| mass && self.parameters.get(1 + k).is_some_and(|p| p.shown))
    }
}

/// Parameters that the data do not show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotShown {
    /// Names of the parameters.
    pub parameters: Vec<&'static str>,
    /// What to record, a sentence.
    pub experiment: String,
    /// A pose that would help most, rad or m a joint, if poses help.
    pub pose: Option<Vec<f64>>,
}

/// The numbers of a load.
pub(crate) struct Numbers {
    pub parameters: Vec<LoadParameter>,
    pub covariance: Vec<Vec<f64>>,
    pub mass: Value,
    pub centre: [Value; 3],
    pub inertia: [Value; 6],
    pub inertia_shown: bool,
    pub principal_moments: [f64; 3],
    pub principal: [Value; 3],
    pub principal_axes: [[f64; 3]; 3],
}

/// Returns the numbers of an estimate.
pub(crate) fn numbers(found: &Estimate) -> Numbers {
    let quantile = t_quantile(found.degrees_of_freedom as f64);
    let value = |value: f64, std: f64| Value {
        value,
        std,
        half_interval: quantile * std,
    };
    let shown = found.shown();
    let all = found.covariance + found.beyond;
    let std = found.std();
    let parameters = (0..INERTIAL_PARAMETERS).map(|k| LoadParameter {
        name: COLUMN_NAMES[k],
        // The unit of a body's parameter is the same at every joint.
        unit: unit(k, &[JointKind::Revolute], &[]),
        value: value(found.values[k], std[k]),
        shown: shown[k],
    });
    let middle = central(&found.values);
    let slopes = central_slopes(found);
    let spread = slopes * all * slopes.transpose();
    let of = |k: usize| value(middle[k], spread[(k, k)].max(0.0).sqrt());
    let [xx, xy, xz, yy, yz, zz] = [4, 5, 6, 7, 8, 9].map(|k| middle[k]);
    let (principal_moments, principal_axes) =
        principal(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    Numbers {
        parameters: parameters.collect(),
        covariance: (0..INERTIAL_PARAMETERS)
            .map(|r| (0..INERTIAL_PARAMETERS).map(|c| all[(r, c)]).collect())
            .collect(),
        mass: of(0),
        centre: [of(1), of(2), of(3)],
        inertia: std::array::from_fn(|k| of(4 + k)),
        inertia_shown: shown[4..].iter().all(|s| *s),
        principal_moments,
        principal: std::array::from_fn(|k| {
            let slopes = moment_slopes(&principal_axes[k]);
            let variance = (slopes.transpose() * spread.fixed_view::<6, 6>(4, 4) * slopes)[0];
            value(principal_moments[k], variance.max(0.0).sqrt())
        }),
        principal_axes,
    }
}

/// Returns the derivatives of the moment of inertia about an axis by Ixx Ixy Ixz Iyy Iyz Izz. An axis that turns changes a
/// principal moment to second order only.
fn moment_slopes([x, y, z]: &[f64; 3]) -> SVector<f64, 6> {
    SVector::from([x * x, 2.0 * x * y, 2.0 * x * z, y * y, 2.0 * y * z, z * z])
}

/// Returns the principal moments, smallest first, and the axes, right-handed.
pub(crate) fn principal(inertia: &Matrix3<f64>) -> ([f64; 3], [[f64; 3]; 3]) {
    let eigen = inertia.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let mut axes: [Vector3<f64>; 3] = order.map(|k| {
        let axis = eigen.eigenvectors.column(k).into_owned();
        // The largest component is positive: the same data give the same axes.
        if axis[axis.iamax()] < 0.0 {
            -axis
        } else {
            axis
        }
    });
    axes[2] = axes[0].cross(&axes[1]);
    (order.map(|k| eigen.eigenvalues[k]), axes.map(Into::into))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::estimate::{Parameters, Square};

    /// The standard deviation of a principal moment is that of the moments of loads that are drawn from the covariance.
    #[test]
    fn principal_moments_spread_as_their_standard_deviations_say() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let sizes = crate::estimate::sizes_of(2.0);
        let root = Square::from_fn(|r, c| {
            let own = if r == c { 1.0 } else { 0.4 * draw() };
            3e-3 * sizes[r] * own
        });
        let found = Estimate {
            values: Parameters::from([
                2.0, 0.06, -0.02, 0.2, 0.03, 0.001, -0.006, 0.028, 0.002, 0.009,
            ]),
            covariance: root * root.transpose(),
            beyond: Square::zeros(),
            information: Square::zeros(),
            sizes,
            degrees_of_freedom: 19,
        };
        let stated = numbers(&found).principal;
        let mut sums = [[0.0; 2]; 3];
        let count = 20_000;
        for _ in 0..count {
            let off = root * Parameters::from_fn(|_, _| draw());
            let [xx, xy, xz, yy, yz, zz] = {
                let own = central(&(found.values + off));
                [4, 5, 6, 7, 8, 9].map(|k| own[k])
            };
            let (moments, _) = principal(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
            for (sum, (moment, own)) in sums.iter_mut().zip(moments.iter().zip(&stated)) {
                sum[0] += moment - own.value;
                sum[1] += (moment - own.value).powi(2);
            }
        }
        for ([sum, squares], own) in sums.iter().zip(&stated) {
            let n = f64::from(count);
            let std = (squares / n - (sum / n).powi(2)).sqrt();
            assert!((own.std / std - 1.0).abs() < 0.05, "{} {std}", own.std);
        }
    }
}
