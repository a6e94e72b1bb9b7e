//! Base parameters of a robot of one link, as parameters of a possible body.

use nalgebra::DVector;
use rig_shared::multibody::column;

use super::combinations::Combinations;
use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;

/// Column of the inertia about the joint.
const IZZ: usize = 9;

/// Distributes the base parameters of one link.
pub(crate) fn one_link(
    robot: &Robot,
    base: &Combinations,
    pi: &mut DVector<f64>,
    remarks: &mut Vec<String>,
) {
    let kind = robot.joints[0].kind;
    for c in [1, 2, column::VISCOUS, column::COULOMB, column::OFFSET] {
        // An unidentified parameter is contained in the value of another column, so it is zero here, not the prior.
        if let Some(value) = identified(base, c) {
            pi[c] = value;
        } else if kind == JointKind::Revolute || c > 2 {
            pi[c] = 0.0;
        }
    }
    match kind {
        JointKind::Prismatic => {
            if let Some(total) = identified(base, column::MASS) {
                slide(total, pi, remarks);
            }
        }
        JointKind::Revolute => {
            if let Some(total) = identified(base, IZZ) {
                lever(total, pi, remarks);
            }
        }
    }
}

/// Returns the identified value named by column `c`.
fn identified(base: &Combinations, c: usize) -> Option<f64> {
    base.columns
        .iter()
        .position(|&x| x == c)
        .map(|k| base.values[k])
}

/// Splits the identified mass `total` of a prismatic joint between link and drive.
fn slide(total: f64, pi: &mut DVector<f64>, remarks: &mut Vec<String>) {
    let prior_drive = pi[column::DRIVE_INERTIA];
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

/// Splits the identified inertia `total` of a revolute joint between link and drive, and gives the link a body.
fn lever(total: f64, pi: &mut DVector<f64>, remarks: &mut Vec<String>) {
    let prior_mass = pi[column::MASS];
    let moment = pi[1].hypot(pi[2]);
    // Izz about the joint is at least (m·c)²/m: for a given mass this bounds the drive's share.
    let least = |mass: f64| {
        if mass > 0.0 {
            moment * moment / mass
        } else {
            0.0
        }
    };
    let drive = drive_share(total, least(prior_mass), pi[column::DRIVE_INERTIA], remarks);
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
    for (c, value) in [(4, yy), (5, -xy), (6, 0.0), (7, xx), (8, 0.0), (IZZ, link)] {
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

/// Returns the drive's share of the inertia `total`: the described one, or less if the link then has no body. `least`
/// is the smallest inertia of a link with the described mass.
fn drive_share(total: f64, least: f64, described: f64, remarks: &mut Vec<String>) -> f64 {
    let mut drive = described;
    if total - drive < least || total - drive <= 0.0 {
        drive = if total - least > 0.0 {
            (total - least).min(drive) * 0.5
        } else {
            0.0
        };
        remarks.push(format!(
            "The drive's inertia of {} kg·m² in the description does not fit the identified {} kg·m²; {} kg·m² were left to it.",
            format_significant(described, 4),
            format_significant(total, 4),
            format_significant(drive, 4)
        ));
    }
    drive
}
