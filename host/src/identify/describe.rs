//! The identified robot as a description that other commands load.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::MOTOR_COLUMNS;

use super::Identification;
use crate::robot::{JointKind, Robot};

/// `robot` with the identified values, its dynamics those of the base parameters.
///
/// Only combinations are identified, so their split is a choice: the physically consistent full set where there is
/// one ([`super::StandardSet`]). A robot of one link is otherwise made a body that can exist: positive mass, inertia no
/// smaller than its centre of mass demands, the drive's share as given before. Failing both, the prior description is
/// moved by the smallest step that gives the identified combinations (K⁺·(β − K·π₀)). The second result lists what
/// had to be said.
pub fn identified_robot(robot: &Robot, identification: &Identification) -> (Robot, Vec<String>) {
    let k = &identification.details.combination;
    let values = DVector::from_column_slice(&identification.details.estimate.values);
    let links = robot.joints.len() * COLUMNS;
    let mut described = robot.standard_parameters().concat();
    described.extend(robot.motor_parameters().as_flattened());
    // Without coupled drives there are no columns of motors, and their parameters are all zero.
    described.truncate(k.ncols().max(links));
    let mut pi = DVector::from_vec(described);
    let mut remarks = Vec::new();
    if let Some(set) = &identification.standard_parameters {
        for (entry, value) in pi.iter_mut().zip(set.values()) {
            *entry = value;
        }
        remarks.extend(set.prior.iter().cloned());
    } else if robot.joints.len() == 1 {
        one_link(robot, identification, &mut pi, &mut remarks);
    } else if let Ok(inverse) = pseudo_inverse(k) {
        let step = inverse * (&values - k * &pi);
        pi += step;
        remarks.push("The split of the combinations over the links is the smallest change of the description; single masses and inertias need not be physical.".into());
    }
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

fn pseudo_inverse(k: &DMatrix<f64>) -> Result<DMatrix<f64>, &'static str> {
    k.clone().pseudo_inverse(1e-12)
}

/// Distributes the base parameters of one link.
fn one_link(
    robot: &Robot,
    identification: &Identification,
    pi: &mut DVector<f64>,
    remarks: &mut Vec<String>,
) {
    let details = &identification.details;
    let identified = |c: usize| {
        details
            .columns
            .iter()
            .position(|&x| x == c)
            .map(|k| details.estimate.values[k])
    };
    let prior_drive = pi[column::DRIVE_INERTIA];
    for c in [1, 2, column::VISCOUS, column::COULOMB, column::OFFSET] {
        // What the data did not tell apart is inside the value of another column: zero here, not the prior.
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
                    "The identified mass of {total} kg is not positive: no simulation can use it."
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
            // Izz about the joint is at least (m·c)²/m: with the mass given that bounds the drive's share.
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
                remarks.push(format!("The drive's inertia of {prior_drive} kg*m^2 in the description does not fit the identified {total} kg*m^2; {drive} kg*m^2 were left to it."));
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
                remarks.push(format!("The mass does not follow from this motion; {mass} kg was chosen, twice the smallest that the inertia allows."));
                mass
            };
            // A flat body in the plane of motion: second moments S = m·c·cᵀ + what is left, half each way.
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
                remarks.push(format!("The identified inertia of {total} kg*m^2 is not positive: no simulation can use it."));
            }
        }
    }
}
