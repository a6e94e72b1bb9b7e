//! Friction that grows with the torque that a joint carries: coefficient · |load| · sgn q̇ (Hamon, Gautier & Garrec 2010).
//!
//! The torque that is carried follows from the fit itself, so the column of such friction is made of the fit before, and
//! the fit is repeated.
//!
//! Leaves out: friction on the link's side of the gear, a term with the square of the load, and that a gear of coupled
//! drives carries the torque of several joints.

use nalgebra::DVector;
use rig_identify::{LeaveOut, Refit, TriangularFactor};
use rig_model::robot::Joint;
use rig_output::{format_significant, format_unit, format_value, listed};
use rig_shared::multibody::{COLUMNS, INERTIAL_PARAMETERS, column};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::estimate::solved;

/// Probability by chance, of all joints together, below which friction is said to grow with the load.
const GROWS: f64 = 1e-3;

/// Friction of a joint that grows with the torque that it carries.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadFriction {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// Friction per torque that the joint carries, 1. With coupled drives or a screw it is not that of a gear, which carries
    /// another torque.
    pub coefficient: f64,
    /// Its standard deviation.
    pub std: f64,
    /// RMS of this friction with the load, N·m or N.
    pub size: f64,
}

/// Says of which joints friction grows with the load; `None` if of none. `mass` is that of the fit without such friction,
/// kg.
pub(crate) fn words(found: &[LoadFriction], joints: &[Joint], mass: f64) -> Option<String> {
    let drives = joints.iter().filter_map(|joint| joint.drive.as_ref());
    // The coefficient of the joint's torque is then not that of a gear.
    let is_coupled = drives
        .into_iter()
        .any(|d| !d.couples.is_empty() || d.screw.is_some());
    let of = |own: &LoadFriction| {
        let joint = &joints[own.joint];
        format!(
            "{} ({}{} {} RMS with the load)",
            joint.name,
            match is_coupled {
                true => String::new(),
                false => format!("coefficient {}, ", format_value(own.coefficient, own.std)),
            },
            format_significant(own.size, 3),
            format_unit(joint.kind.units().1)
        )
    };
    let list: Vec<String> = found.iter().map(of).collect();
    (!list.is_empty()).then(|| {
        format!(
            "Friction grows with the torque that the joint carries: {}. The load was identified beside it; with friction that does not grow the mass would be {} kg.",
            listed(&list),
            format_significant(mass, 4)
        )
    })
}

/// The torque that each joint carries, by a fit, and its direction of motion.
pub(crate) struct Carried<'a> {
    /// Joints whose friction may grow with it.
    pub joints: Vec<usize>,
    /// Columns of the model in each row: those of the robot.
    pub robot: &'a [usize],
    /// Number of links of the robot.
    pub links: usize,
    /// Values of the load, and of the robot's columns, by the fit before.
    pub load: Vec<f64>,
    pub values: Vec<f64>,
}

impl Carried<'_> {
    /// Returns |load| · sgn q̇ of a joint at a row of the model; `row` holds the load's columns first, and `own` those of
    /// the robot.
    pub(crate) fn friction(&self, joint: usize, row: &[f64], own: &[f64]) -> f64 {
        let coulomb = COLUMNS * joint + column::COULOMB;
        let Some(place) = self.robot.iter().position(|c| *c == coulomb) else {
            return 0.0;
        };
        let load = row[..INERTIAL_PARAMETERS].iter().zip(&self.load);
        let mut carried: f64 = load.map(|(x, value)| x * value).sum();
        for ((c, x), value) in self.robot.iter().zip(own).zip(&self.values) {
            let is_of_body = *c < COLUMNS * self.links && c % COLUMNS < INERTIAL_PARAMETERS;
            if is_of_body {
                carried += x * value;
            }
        }
        carried.abs() * own[place]
    }
}

/// Returns the joints whose friction grows with the load by a fit with one column for each of `joints` behind the others.
/// `sizes` holds the RMS of each of these columns with the load.
pub(crate) fn growing(
    segments: &[TriangularFactor],
    joints: &[usize],
    sizes: &[f64],
) -> Vec<LoadFriction> {
    let left_out = LeaveOut::of(segments);
    let columns = left_out.whole.columns();
    let first = columns - joints.len();
    let of = |factor: &TriangularFactor| {
        let (r, z) = factor.system();
        let x: DVector<f64> = solved(&r, &z);
        x.as_slice()[first..].to_vec()
    };
    let refit = Refit {
        whole: of(&left_out.whole),
        without: left_out.without.iter().map(of).collect(),
    };
    let covariance = refit.covariance();
    let freedom = segments.len().saturating_sub(1) as f64;
    let chance = |ratio: f64| {
        StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |d| joints.len() as f64 * d.sf(ratio))
    };
    let found = (joints.iter().zip(sizes)).enumerate();
    found
        .filter_map(|(k, (joint, size))| {
            let (coefficient, std) = (refit.whole[k], covariance[(k, k)].max(0.0).sqrt());
            let is_certain = coefficient > 0.0 && std > 0.0 && chance(coefficient / std) < GROWS;
            is_certain.then_some(LoadFriction {
                joint: *joint,
                coefficient,
                std,
                size: coefficient * size,
            })
        })
        .collect()
}
