//! Direction of gravity from all torques together, for an arm or a single link with another mounting than described.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::DiagnoseError;
use crate::faults::described::friction;
use crate::faults::finding::Fault;
use crate::faults::fit::Fit;
use crate::faults::judge::Judge;
use crate::faults::levels::GOOD;
use crate::faults::misfit::Misfit;
use crate::faults::rows::Rows;
use crate::faults::suspicion::Suspicion;
use rig_model::robot::JointKind;
use rig_numerics::statistics::squares_about_mean;

/// Least angle to the described gravity, degrees; less is left to the search for a tilted base.
const LEAST: f64 = 45.0;
/// Angle above which gravity is said to point the other way, degrees.
pub(crate) const OTHER_WAY: f64 = 135.0;
/// Squared share of the strongest direction below which gravity's component is not identifiable.
const DETERMINED: f64 = 1e-3;
/// Largest factor between found and described strength of gravity.
const STRENGTH: f64 = 2.0;

/// Share of the measured gravity below which the described axis is upright.
const UPRIGHT: f64 = 0.3;
/// Standard deviation of gravity's direction, rad, above which it is undecided.
const OPEN: f64 = 0.1;

impl Judge<'_> {
    /// Suspects a wrong zero or axis of a single revolute joint, by the direction of gravity on it. The link's weight
    /// must be as described within a factor; a spring may act too. Reversed gravity is a matter of signs.
    pub(crate) fn single_zero(&self) -> Result<Option<Suspicion>, DiagnoseError> {
        let ([joint], true) = (&self.robot.joints[..], self.states_from(0)) else {
            return Ok(None);
        };
        let moment = joint.inertial.as_ref().map_or([0.0; 3], |i| i.first_moment);
        let gravity = Vector3::from(self.robot.gravity).norm();
        // About the joint's third axis.
        let most = gravity * moment[0].hypot(moment[1]);
        if joint.kind != JointKind::Revolute || most == 0.0 {
            return Ok(None);
        }
        let rows = &self.rows;
        let (q, lost) = (&rows.q[0], friction(&rows.qd[0], None));
        let first = lost.ncols();
        let matrix = DMatrix::from_fn(rows.len(), first + 4, |k, c| match c.checked_sub(first) {
            None => lost[(k, c)],
            Some(0) => rows.qdd[0][k],
            Some(1) => q[k],
            Some(2) => q[k].cos(),
            Some(_) => q[k].sin(),
        });
        let order: Vec<usize> = (0..first + 4).collect();
        let Some(fit) = Fit::of(&matrix, &rows.tau[0], &order) else {
            return Ok(None);
        };
        let [Some(a), Some(b)] = [first + 2, first + 3].map(|wave| fit.parameter(wave)) else {
            return Ok(None);
        };
        let (a, b) = (a.value, b.value);
        let strength = a.hypot(b);
        let mut sideways = DVector::zeros(first + 4);
        (sideways[first + 2], sideways[first + 3]) = (-b / strength, a / strength);
        let across = fit.functional(&sideways).std;
        // One wave is determined by two places.
        let places = Rows {
            q: vec![vec![0.0, FRAC_PI_2]],
            qd: vec![vec![0.0; 2]],
            qdd: vec![vec![0.0; 2]],
            ..Rows::default()
        };
        let weight = self.described(&places)?.weight;
        let [stated_a, stated_b] = [weight[0][0], weight[0][1]];
        let stated = stated_a.hypot(stated_b);
        let strongest = [b.atan2(a), stated_b.atan2(stated_a)];
        let off = (strongest[1] - strongest[0] + PI).rem_euclid(TAU) - PI;
        let shown = fit.unexplained() < GOOD
            && (1.0 / STRENGTH..STRENGTH).contains(&(strength / most))
            && across < OPEN * strength;
        let upright = stated < UPRIGHT * strength;
        let far = (LEAST..OTHER_WAY).contains(&off.abs().to_degrees());
        if !shown || !(upright || far) {
            return Ok(None);
        }
        let found = match upright {
            true => Misfit::LevelAxis { strength, stated },
            false => Misfit::StrongestElsewhere {
                at: strongest[0],
                stated: strongest[1],
                off,
            },
        };
        let fault = Fault::of_joint(0, found);
        // The wave's direction shows it; a trial of masses does not.
        Ok(Some(Suspicion::of_columns(fault)))
    }

    /// Returns gravity of described strength in the direction that the torques show (in frame 0), if that is far from
    /// the described. Every joint has its own constant torque and friction; masses and inertias are the described.
    pub(crate) fn gravity_shown(&self, rows: &Rows) -> Result<Option<[f64; 3]>, DiagnoseError> {
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
            let total = squares_about_mean(tau);
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
        let eigen = normal.symmetric_eigen();
        let least = DETERMINED * normal.norm();
        let kept = eigen
            .eigenvalues
            .map(|e| if e > least { 1.0 / e } else { 0.0 });
        let inverse =
            eigen.eigenvectors * Matrix3::from_diagonal(&kept) * eigen.eigenvectors.transpose();
        // An arm with parallel axes does not show gravity along them.
        let (shown, seen) = (inverse * right, inverse * normal * stated);
        let strength = shown.norm() / seen.norm();
        let far = shown.angle(&seen).to_degrees() > LEAST;
        let alike =
            (1.0 / STRENGTH..STRENGTH).contains(&strength) && seen.norm() > 0.5 * stated.norm();
        Ok((far && alike).then(|| (shown * (stated.norm() / shown.norm())).into()))
    }
}
