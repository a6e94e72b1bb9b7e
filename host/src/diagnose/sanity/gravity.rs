//! The direction of gravity that all torques together show, for an arm that hangs or stands otherwise than described.

use nalgebra::{DVector, Matrix3, Vector3};

use super::super::DiagnoseError;
use super::super::outcome::{About, DataFault};
use super::columns::fault;
use super::fit::{Fit, about_mean};
use super::model::Judge;
use super::rows::Rows;
use super::senses::friction;

/// Gravity that stands off by less is left to the search for a base that is not level, degrees.
const LEAST: f64 = 45.0;
/// From this angle on it is said to point the other way, degrees.
const OTHER_WAY: f64 = 135.0;
/// Directions in which gravity acts on the joints with less than this share of the strongest, squared, are not determined.
const DETERMINED: f64 = 1e-3;
/// Gravity that comes out weaker or stronger than described by more than this is something else.
const STRENGTH: f64 = 2.0;

impl Judge<'_> {
    /// Gravity as strong as described along the direction that the torques show (in frame 0), where that is far from the described
    /// one. Every joint has a constant torque and friction of its own; masses and inertias are those of the description.
    pub(super) fn gravity_shown(&self, rows: &Rows) -> Result<Option<[f64; 3]>, DiagnoseError> {
        let stated = Vector3::from(self.robot.gravity);
        let here = self.described(rows)?;
        let mut along = Vec::new();
        for axis in 0..3 {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            along.push(self.described_under(rows, unit)?.weight);
        }
        let mut normal = Matrix3::<f64>::zeros();
        let mut right = Vector3::<f64>::zeros();
        for (j, tau) in rows.tau.iter().enumerate() {
            let total = about_mean(tau.iter().copied());
            if total <= 0.0 {
                continue;
            }
            let lost = friction(&rows.qd[j], here.motors.get(j));
            let order: Vec<usize> = (0..lost.ncols()).collect();
            let freed = |column: &[f64]| {
                Fit::of(&lost, column, &order)
                    .map_or_else(|| DVector::from_column_slice(column), |fit| fit.residual)
            };
            let held: Vec<f64> = (tau.iter().zip(&here.all[j]).zip(&here.weight[j]))
                .map(|((tau, all), weight)| tau - (all - weight))
                .collect();
            let held = freed(&held);
            let columns: Vec<DVector<f64>> = along.iter().map(|axis| freed(&axis[j])).collect();
            for (r, one) in columns.iter().enumerate() {
                right[r] += one.dot(&held) / total;
                for (c, other) in columns.iter().enumerate() {
                    normal[(r, c)] += one.dot(other) / total;
                }
            }
        }
        let Ok(inverse) = normal.pseudo_inverse(DETERMINED * normal.norm()) else {
            return Ok(None);
        };
        // Of an arm whose axes are parallel gravity along them does not show.
        let (shown, seen) = (inverse * right, inverse * normal * stated);
        let strength = shown.norm() / seen.norm();
        let far = shown.angle(&seen).to_degrees() > LEAST;
        let alike =
            (1.0 / STRENGTH..STRENGTH).contains(&strength) && seen.norm() > 0.5 * stated.norm();
        Ok((far && alike).then(|| (shown * (stated.norm() / shown.norm())).into()))
    }

    /// Gravity of another direction as a fault; shares of the torques' variance that are left, as recorded and with it.
    pub(super) fn gravity_said(&self, gravity: [f64; 3], left: [f64; 2]) -> DataFault {
        let stated = Vector3::from(self.robot.gravity);
        let angle = stated.angle(&Vector3::from(gravity)).to_degrees();
        let [recorded, without] = left.map(|share| 100.0 * share);
        let (points, asked) = if angle > OTHER_WAY {
            (
                "the other way",
                "does the arm hang upside down, or are all joints counted the other way round",
            )
        } else {
            ("elsewhere", "is the arm mounted on a wall or a slope")
        };
        fault(
            self.runs,
            "gravity",
            About::Recording,
            "",
            format!(
                "Gravity points {points} than the description says, by {angle:.0} degrees: turned by that the description leaves {without:.1} % of the torque's variance at the joints that carry weight, as it stands {recorded:.1} %; {asked}? Turn the arm by a fixed joint at the root of the URDF (`rpy` of its origin), or state `gravity` in the TOML."
            ),
        )
    }
}
