//! The identified robot as a description for other commands.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::MOTOR_COLUMNS;

use super::Identification;
use super::beyond::with_beyond;
use super::prior::described;
use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;

/// Returns `robot` with the identified values and the dynamics of the base parameters, and a list of remarks.
///
/// Only combinations are identified, so their split is a choice. The first choice is the physically consistent full set
/// ([`super::StandardSet`]). Otherwise a robot of one link becomes a possible body: positive mass, inertia at least as
/// large as its centre of mass requires, the drive's share unchanged. Otherwise the prior description changes by the
/// smallest step that gives the identified combinations (K⁺·(β − K·π₀)).
pub fn identified_robot(robot: &Robot, identification: &Identification) -> (Robot, Vec<String>) {
    let details = &identification.details;
    let mut robot = with_beyond(
        robot,
        &identification.position_torques,
        identification.base_tilt.as_ref(),
    );
    robot.identified = Some(details.treatment.band());
    let robot = &robot;
    if let Some(set) = &identification.standard_parameters {
        let mut pi = described(robot, details.combination.ncols());
        for (entry, value) in pi.iter_mut().zip(set.values()) {
            *entry = value;
        }
        return written(robot, &pi, set.prior.to_vec());
    }
    let base = Combinations {
        combination: &details.combination,
        columns: &details.columns,
        values: &details.estimate.values,
    };
    let (result, mut remarks) = redistributed(robot, &base, None);
    if robot.joints.len() > 1 {
        remarks.insert(0, "No physically consistent set of standard parameters was found for these values: the split of the combinations over the links is the smallest change of the description, and single masses and inertias need not be those of a body. Use the combinations, not single parameters.".into());
    }
    (result, remarks)
}

/// Base parameters and their combinations.
pub struct Combinations<'a> {
    /// Base parameters as combinations of standard parameters.
    pub combination: &'a DMatrix<f64>,
    /// Column of the standard regressor that names each parameter.
    pub columns: &'a [usize],
    /// Values, SI.
    pub values: &'a [f64],
}

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
    if robot.joints.len() == 1 {
        one_link(robot, base, &mut pi, &mut remarks);
        return written(robot, &pi, remarks);
    }
    let missing = DVector::from_column_slice(base.values) - k * &pi;
    let scaled = match weights {
        Some(weights) => DMatrix::from_fn(k.nrows(), k.ncols(), |i, c| k[(i, c)] * weights[c]),
        None => k.clone(),
    };
    if let Ok(inverse) = pseudo_inverse(&scaled) {
        let step = inverse * missing;
        pi += match weights {
            Some(weights) => step.component_mul(weights),
            None => step,
        };
        without_negative_masses(robot, k, &mut pi, &mut remarks);
    }
    written(robot, &pi, remarks)
}

/// Returns the description with these standard parameters.
pub(super) fn written(
    robot: &Robot,
    pi: &DVector<f64>,
    mut remarks: Vec<String>,
) -> (Robot, Vec<String>) {
    let links = robot.joints.len() * COLUMNS;
    let (joints, motors) = pi.as_slice().split_at(links);
    let mut motors = motors.to_vec();
    motors.resize(robot.joints.len() * MOTOR_COLUMNS, 0.0);
    let (result, said) = robot.with_parameters(
        joints.as_chunks::<COLUMNS>().0,
        motors.as_chunks::<MOTOR_COLUMNS>().0,
    );
    remarks.extend(said);
    (result, remarks)
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
    let masses: Vec<usize> = (0..robot.joints.len())
        .map(|j| j * COLUMNS + column::MASS)
        .collect();
    let lacking = DVector::from_iterator(masses.len(), masses.iter().map(|&c| -pi[c].min(0.0)));
    if lacking.amax() == 0.0 {
        return;
    }
    let Ok(inverse) = pseudo_inverse(k) else {
        return;
    };
    // Projection onto the directions that the data do not determine; its columns are the masses.
    let seen = inverse * k;
    let free = DMatrix::from_fn(pi.len(), masses.len(), |i, m| {
        f64::from(u8::from(i == masses[m])) - seen[(i, masses[m])]
    });
    let own = free.select_rows(masses.iter());
    let step = own
        .clone()
        .svd(true, true)
        .solve(&lacking, 1e-9)
        .ok()
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

fn pseudo_inverse(k: &DMatrix<f64>) -> Result<DMatrix<f64>, &'static str> {
    k.clone().pseudo_inverse(1e-12)
}

/// Distributes the base parameters of one link.
fn one_link(robot: &Robot, base: &Combinations, pi: &mut DVector<f64>, remarks: &mut Vec<String>) {
    let identified = |c: usize| {
        base.columns
            .iter()
            .position(|&x| x == c)
            .map(|k| base.values[k])
    };
    let prior_drive = pi[column::DRIVE_INERTIA];
    for c in [1, 2, column::VISCOUS, column::COULOMB, column::OFFSET] {
        // An unidentified parameter is contained in the value of another column, so it is zero here, not the prior.
        if let Some(value) = identified(c) {
            pi[c] = value;
        } else if robot.joints[0].kind == JointKind::Revolute || c > 2 {
            pi[c] = 0.0;
        }
    }
    match robot.joints[0].kind {
        JointKind::Prismatic => {
            let Some(total) = identified(column::MASS) else {
                return;
            };
            let drive = if prior_drive < total {
                prior_drive
            } else {
                0.0
            };
            if drive != prior_drive {
                remarks.push(format!("The drive's inertia of {prior_drive} kg in the description exceeds the identified {total} kg and was set to zero."));
            }
            pi[column::DRIVE_INERTIA] = drive;
            pi[column::MASS] = total - drive;
            if total <= 0.0 {
                remarks.push(format!(
                    "The identified mass of {} kg is not positive: no simulation can use it.",
                    format_significant(total, 4)
                ));
            }
        }
        JointKind::Revolute => {
            let Some(total) = identified(9) else {
                return;
            };
            let moment = pi[1].hypot(pi[2]);
            let mut drive = prior_drive;
            let prior_mass = pi[column::MASS];
            // Izz about the joint is at least (m·c)²/m: for a given mass this bounds the drive's share.
            let least = |mass: f64| {
                if mass > 0.0 {
                    moment * moment / mass
                } else {
                    0.0
                }
            };
            if total - drive < least(prior_mass) || total - drive <= 0.0 {
                drive = if total - least(prior_mass) > 0.0 {
                    (total - least(prior_mass)).min(drive) * 0.5
                } else {
                    0.0
                };
                remarks.push(format!(
                    "The drive's inertia of {} kg·m² in the description does not fit the identified {} kg·m²; {} kg·m² were left to it.",
                    format_significant(prior_drive, 4),
                    format_significant(total, 4),
                    format_significant(drive, 4)
                ));
            }
            let link = total - drive;
            let mass = if prior_mass > 0.0 && least(prior_mass) <= link {
                prior_mass
            } else {
                let mass = if moment > 0.0 && link > 0.0 {
                    2.0 * moment * moment / link
                } else {
                    1.0
                };
                remarks.push(format!(
                    "The mass does not follow from this motion; {} kg was chosen, twice the smallest that the inertia allows.",
                    format_significant(mass, 4)
                ));
                mass
            };
            // A flat body in the plane of motion: second moments S = m·c·cᵀ + remainder, half in each direction.
            let rest = (link - least(mass)).max(0.0);
            let (xx, yy, xy) = (
                pi[1] * pi[1] / mass + 0.5 * rest,
                pi[2] * pi[2] / mass + 0.5 * rest,
                pi[1] * pi[2] / mass,
            );
            pi[column::MASS] = mass;
            pi[3] = 0.0;
            for (c, value) in [(4, yy), (5, -xy), (6, 0.0), (7, xx), (8, 0.0), (9, link)] {
                pi[c] = value;
            }
            pi[column::DRIVE_INERTIA] = drive;
            if total <= 0.0 {
                remarks.push(format!(
                    "The identified inertia of {} kg·m² is not positive: no simulation can use it.",
                    format_significant(total, 4)
                ));
            }
        }
    }
}
