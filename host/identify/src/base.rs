//! Base (canonical) parameters: the combinations of parameters on which the torque depends.

use nalgebra::DMatrix;
use rig_shared::multibody::{COLUMN_NAMES, COLUMNS, Chain, MAX_JOINTS, column};
use rig_shared::transmission::{
    DriveKind, MOTOR_COLUMN_NAMES, MOTOR_COLUMNS, Transmission, motor_column,
};

use super::grouping::{agree, grouped};
use super::states::States;
use super::{IdentifyError, ModelKind};
use rig_model::robot;
use rig_model::robot::Robot;

/// Remainder of a column of unit length after projection onto the preceding columns, below which it is dependent.
/// Rounding leaves about 1e-14 at random states.
const DEPENDENT: f64 = 1e-10;
/// The same remainder above which a column is independent. A real geometry, whose right angles are exact after reading,
/// has no remainder between the two. One there is an error: a length or angle is zero only by intention.
const INDEPENDENT: f64 = 1e-7;

/// Builds the chain of a robot description.
///
/// # Errors
/// [`IdentifyError::Model`] if the geometry is invalid.
pub fn chain_of(robot: &Robot) -> Result<Chain<f64>, IdentifyError> {
    Chain::new(&robot.geometry(), robot.gravity).map_err(|e| IdentifyError::Model(e.to_string()))
}

/// Builds the drives of a robot description.
///
/// # Errors
/// [`IdentifyError::Model`] if the drives are impossible.
pub fn transmission_of(robot: &Robot) -> Result<Transmission<f64>, IdentifyError> {
    robot
        .transmission()
        .map_err(|e| IdentifyError::Model(e.to_string()))
}

/// Independent columns of a matrix, and the dependent ones as combinations of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Independent {
    /// Kept columns, in ascending order.
    pub kept: Vec<usize>,
    /// Kept × all columns: column j = Σ kept columns · entries of column j. Identity on the kept ones.
    pub combination: DMatrix<f64>,
    /// Smallest remainder of a kept column and largest of a dropped one, each relative to the column.
    pub remainders: (f64, f64),
    /// Remainder of every column relative to its length; 0 for a column of zeros.
    pub remainder: Vec<f64>,
}

/// Visits the columns of `matrix` in `order` and keeps each that is not a combination of the ones kept before, to
/// within `tolerance` of its length: a QR factorisation pivoted by preference (Gautier 1991). Columns shorter than
/// 1e-12 of the longest count as zero.
pub fn independent_columns(matrix: &DMatrix<f64>, order: &[usize], tolerance: f64) -> Independent {
    let all = matrix.ncols();
    let longest = (0..all)
        .map(|c| matrix.column(c).norm())
        .fold(0.0, f64::max);
    let mut basis: Vec<nalgebra::DVector<f64>> = Vec::new();
    let mut visited: Vec<usize> = Vec::new();
    // Coordinates of every column in the orthonormal basis, extended as the basis grows.
    let mut coordinates: Vec<Vec<f64>> = vec![Vec::new(); all];
    let (mut least_kept, mut most_dropped) = (f64::INFINITY, 0.0f64);
    let mut remainder = vec![0.0; all];
    for &c in order {
        let length = matrix.column(c).norm();
        if length <= 1e-12 * longest || length.is_nan() {
            continue;
        }
        let mut rest = matrix.column(c).into_owned() / length;
        // Twice is enough (Kahan): the second pass removes the rounding error of the first.
        for _ in 0..2 {
            for b in &basis {
                let along = b.dot(&rest);
                rest.axpy(-along, b, 1.0);
            }
        }
        let left = rest.norm();
        remainder[c] = left;
        if left > tolerance {
            least_kept = least_kept.min(left);
            basis.push(rest / left);
            visited.push(c);
        } else {
            most_dropped = most_dropped.max(left);
        }
    }
    for c in 0..all {
        coordinates[c] = basis.iter().map(|b| b.dot(&matrix.column(c))).collect();
    }
    let rank = visited.len();
    let triangle = DMatrix::from_fn(rank, rank, |i, j| {
        if i <= j {
            coordinates[visited[j]][i]
        } else {
            0.0
        }
    });
    let mut order_of: Vec<usize> = (0..rank).collect();
    order_of.sort_by_key(|&k| visited[k]);
    let mut combination = DMatrix::zeros(rank, all);
    for c in 0..all {
        let right = nalgebra::DVector::from_column_slice(&coordinates[c]);
        let solution = triangle
            .solve_upper_triangular(&right)
            .unwrap_or_else(|| nalgebra::DVector::zeros(rank));
        for (row, &k) in order_of.iter().enumerate() {
            combination[(row, c)] = solution[k];
        }
    }
    let kept: Vec<usize> = order_of.iter().map(|&k| visited[k]).collect();
    // Set the identity on the kept columns exactly, without rounding errors.
    for (row, &c) in kept.iter().enumerate() {
        combination.column_mut(c).fill(0.0);
        combination[(row, c)] = 1.0;
    }
    Independent {
        kept,
        combination,
        remainders: (least_kept, most_dropped),
        remainder,
    }
}

/// The base parameters of a robot: β = K·π, with π the 14 parameters of every joint. If a drive moves several joints,
/// the 3 parameters of every motor follow ([`rig_shared::transmission`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// Columns of the standard regressor (14 per joint, 3 per motor) that represent the base parameters.
    pub columns: Vec<usize>,
    /// K, base parameters × 14n, or × 17n with motor columns.
    pub combination: DMatrix<f64>,
    /// Kinds of the joints, for units and names.
    pub kinds: Vec<robot::JointKind>,
    /// Kinds of the drives, one per joint.
    pub drives: Vec<DriveKind>,
}

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

impl Base {
    /// Finds the base parameters of `robot` from random states of the equations to fit ([`ModelKind`]). Momentum and
    /// torque have the same base parameters. The momentum is the inertia term of the torque with velocities in place of
    /// accelerations. So a combination without torque changes no momentum, and none of the remaining terms either.
    ///
    /// # Errors
    /// [`IdentifyError::Model`] for an impossible geometry, [`IdentifyError::Undecided`] if a column is neither clearly
    /// dependent nor clearly independent.
    pub fn structural(robot: &Robot, model: ModelKind, seed: u64) -> Result<Self, IdentifyError> {
        let kinds: Vec<robot::JointKind> = robot.joints.iter().map(|j| j.kind).collect();
        let matrix = States::of(robot)?.rows(model, seed)?;
        let mut order = preference(&kinds);
        order.extend(order.len()..matrix.ncols());
        let found = independent_columns(&matrix, &order, DEPENDENT);
        if found.remainders.0 < INDEPENDENT {
            let left = |c: &usize| found.remainder[*c];
            let doubtful = found
                .kept
                .iter()
                .copied()
                .min_by(|a, b| left(a).total_cmp(&left(b)))
                .unwrap_or(0);
            let n = kinds.len();
            let joint = match doubtful.checked_sub(n * COLUMNS) {
                None => doubtful / COLUMNS,
                Some(motor) => motor / MOTOR_COLUMNS,
            };
            return Err(IdentifyError::Undecided {
                column: column_name(doubtful, n),
                joint: robot.joints[joint].name.clone(),
                least: found.remainders.0,
                robot: robot.name.clone(),
            });
        }
        let numeric = Self {
            columns: found.kept,
            combination: found.combination,
            kinds,
            drives: robot.drive_kinds(),
        };
        Ok(match grouped(robot) {
            Ok(rules) if agree(&rules, &numeric) => numeric.with_coefficients_of(&rules),
            _ => numeric,
        })
    }

    /// Takes the coefficients of equivalent rules, which have no rounding errors from random states.
    fn with_coefficients_of(self, rules: &Self) -> Self {
        if self.columns == rules.columns {
            return Self {
                combination: rules.combination.clone(),
                ..self
            };
        }
        // The identity over the own columns makes the combination unique.
        let there = rules.combination.select_columns(&self.columns);
        match there.lu().solve(&rules.combination) {
            Some(combination) => Self {
                combination,
                ..self
            },
            None => self,
        }
    }

    /// Keeps the base parameters whose own column satisfies `keep`.
    #[must_use]
    pub fn restricted(self, keep: impl Fn(usize) -> bool) -> Self {
        let rows: Vec<usize> = (0..self.columns.len())
            .filter(|&k| keep(self.columns[k]))
            .collect();
        Self {
            columns: rows.iter().map(|&k| self.columns[k]).collect(),
            combination: self.combination.select_rows(&rows),
            kinds: self.kinds,
            drives: self.drives,
        }
    }

    /// Returns the number of base parameters.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Returns true if the torque depends on no parameter (never for a chain, whose joints have friction).
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Returns the combination of a base parameter in the notation of the literature: `Izz1 + Ia1`.
    pub fn expression(&self, row: usize) -> String {
        expression(&self.combination, row, self.columns[row])
    }

    /// Returns the unit of a base parameter, ASCII.
    pub fn unit(&self, row: usize) -> &'static str {
        self.column_unit(self.columns[row])
    }

    /// Returns the name of a column of the standard regressor, with the number of its joint or motor.
    pub fn column_name(&self, c: usize) -> String {
        column_name(c, self.kinds.len())
    }

    /// Returns the unit of a column, ASCII.
    pub fn column_unit(&self, c: usize) -> &'static str {
        unit(c, &self.kinds, &self.drives)
    }
}

/// Returns the name of a column, with the number of its joint or motor, for a robot with `joints` joints.
pub fn column_name(c: usize, joints: usize) -> String {
    match c.checked_sub(joints * COLUMNS) {
        None => format!("{}{}", COLUMN_NAMES[c % COLUMNS], c / COLUMNS + 1),
        Some(motor) => format!(
            "{}{}",
            MOTOR_COLUMN_NAMES[motor % MOTOR_COLUMNS],
            motor / MOTOR_COLUMNS + 1
        ),
    }
}

/// Returns the number of joints for a number of columns: 14 per joint, or 17 with motor columns (unambiguous for up to
/// [`MAX_JOINTS`] joints).
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

#[cfg(test)]
#[path = "base_test.rs"]
mod tests;
