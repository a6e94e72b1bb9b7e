//! Order, names and units of the standard columns.

use nalgebra::DMatrix;
use rig_shared::multibody::{COLUMN_NAMES, COLUMNS, MAX_JOINTS, column};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMN_NAMES, MOTOR_COLUMNS, motor_column};

use rig_model::robot;

/// Returns the order in which columns are preferred as representatives, so that expressions group as in the literature
/// (Khalil & Dombre 2002, ch. 9). `Iyy`, `mz` and `m` of a revolute link and the inertia of a prismatic link go to the
/// preceding link. Drive inertia joins the link's own if the two are collinear. Motor columns come last.
pub fn preference(kinds: &[robot::JointKind]) -> Vec<usize> {
    let revolute: &[usize] = &[4, 5, 6, 8, 9, 1, 2];
    let prismatic: &[usize] = &[0, 1, 2, 3];
    let of = |joint: usize, list: &[usize]| {
        list.iter()
            .map(move |c| joint * COLUMNS + c)
            .collect::<Vec<_>>()
    };
    let own = |j: usize| match kinds[j] {
        robot::JointKind::Revolute => revolute,
        robot::JointKind::Prismatic => prismatic,
    };
    let mut order: Vec<usize> = Vec::new();
    for j in 0..kinds.len() {
        order.extend(of(j, own(j)));
        order.extend(of(j, &[column::VISCOUS, column::COULOMB, column::OFFSET]));
    }
    for j in 0..kinds.len() {
        order.extend(of(j, &[column::DRIVE_INERTIA]));
    }
    for c in 0..kinds.len() * COLUMNS {
        if !order.contains(&c) {
            order.push(c);
        }
    }
    order
}

/// Returns the name of a column, with the number of its link or motor, for a robot with `links` links.
pub fn column_name(c: usize, links: usize) -> String {
    match c.checked_sub(links * COLUMNS) {
        None => format!("{}{}", COLUMN_NAMES[c % COLUMNS], c / COLUMNS + 1),
        Some(motor) => format!(
            "{}{}",
            MOTOR_COLUMN_NAMES[motor % MOTOR_COLUMNS],
            motor / MOTOR_COLUMNS + 1
        ),
    }
}

/// Returns the number of links for a number of columns: 14 per link, or 17 with motor columns, beside which there are no
/// followers (unambiguous for up to [`MAX_JOINTS`] links).
fn joints_of(columns: usize) -> usize {
    let without = columns / COLUMNS;
    if columns.is_multiple_of(COLUMNS) && without <= MAX_JOINTS {
        without
    } else {
        columns / (COLUMNS + MOTOR_COLUMNS)
    }
}

/// Writes a row of a combination matrix in words, its own column first.
pub fn expression(combination: &DMatrix<f64>, row: usize, own: usize) -> String {
    let joints = joints_of(combination.ncols());
    let mut text = column_name(own, joints);
    for c in 0..combination.ncols() {
        let k = combination[(row, c)];
        // Rounds the text only: the values use the exact coefficients.
        if c == own || k.abs() < 1e-9 {
            continue;
        }
        let sign = if k < 0.0 { '-' } else { '+' };
        let size = k.abs();
        let name = column_name(c, joints);
        if (size - 1.0).abs() < 1e-9 {
            text.push_str(&format!(" {sign} {name}"));
        } else {
            let digits = format!("{size:.6e}").parse::<f64>().unwrap_or(size);
            text.push_str(&format!(" {sign} {digits} {name}"));
        }
    }
    text
}

/// Returns the unit of a column.
pub fn unit(c: usize, kinds: &[robot::JointKind], drives: &[DriveKind]) -> &'static str {
    let (joint, place) = match c.checked_sub(kinds.len() * COLUMNS) {
        None => (c / COLUMNS, c % COLUMNS),
        Some(motor) => {
            let same = match motor % MOTOR_COLUMNS {
                motor_column::INERTIA => column::DRIVE_INERTIA,
                motor_column::VISCOUS => column::VISCOUS,
                _ => column::COULOMB,
            };
            (motor / MOTOR_COLUMNS, same)
        }
    };
    // The values of a drive with a varying ratio belong to the motor, which always turns.
    let at_motor =
        c >= kinds.len() * COLUMNS && matches!(drives.get(joint), Some(DriveKind::Varying));
    let revolute = at_motor || matches!(kinds.get(joint), Some(robot::JointKind::Revolute));
    match (place, revolute) {
        (column::MASS, _) => "kg",
        (1..=3, _) => "kg*m",
        (4..=9, _) => "kg*m^2",
        (column::DRIVE_INERTIA, true) => "kg*m^2",
        (column::DRIVE_INERTIA, false) => "kg",
        (column::VISCOUS, true) => "N*m*s/rad",
        (column::VISCOUS, false) => "N*s/m",
        (_, true) => "N*m",
        (_, false) => "N",
    }
}
