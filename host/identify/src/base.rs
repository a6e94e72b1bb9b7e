//! Base (canonical) parameters: the combinations of parameters that the torque depends on.

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

/// A column counts as dependent when, scaled to length one, less than this is left of it after the columns
/// before it are taken away; rounding leaves about 1e-14 of a column at random states.
const DEPENDENT: f64 = 1e-10;
/// … and as independent when more than this is left. Between the two lies nothing for a real geometry, whose right angles
/// are exact once it is read; something there means link lengths or angles that are zero only by intention, and is an
/// error.
const INDEPENDENT: f64 = 1e-7;

/// The chain of a robot description.
///
/// # Errors
/// [`IdentifyError::Model`] where the geometry is not one.
pub fn chain_of(robot: &Robot) -> Result<Chain<f64>, IdentifyError> {
    Chain::new(&robot.geometry(), robot.gravity).map_err(|e| IdentifyError::Model(e.to_string()))
}

/// The drives of a robot description.
///
/// # Errors
/// [`IdentifyError::Model`] where they cannot be.
pub fn transmission_of(robot: &Robot) -> Result<Transmission<f64>, IdentifyError> {
    robot
        .transmission()
        .map_err(|e| IdentifyError::Model(e.to_string()))
}

/// Independent columns of a matrix and how the others follow from them.
#[derive(Clone, Debug, PartialEq)]
pub struct Independent {
    /// Kept columns, in ascending order.
    pub kept: Vec<usize>,
    /// kept × all columns: column j = Σ kept columns · entries of column j. Identity on the kept ones.
    pub combination: DMatrix<f64>,
    /// Smallest remainder of a kept column and largest of a dropped one, both relative to the column.
    pub remainders: (f64, f64),
    /// Remainder of every column relative to its length; 0 for a column of zeros.
    pub remainder: Vec<f64>,
}

/// Visits the columns of `matrix` in `order` and keeps those that are not, to within `tolerance` of their
/// length, combinations of the ones kept before: a QR factorisation pivoted by preference (Gautier 1991).
/// Columns shorter than 1e-12 of the longest count as zero.
pub fn independent_columns(matrix: &DMatrix<f64>, order: &[usize], tolerance: f64) -> Independent {
    let all = matrix.ncols();
    let longest = (0..all)
        .map(|c| matrix.column(c).norm())
        .fold(0.0, f64::max);
    let mut basis: Vec<nalgebra::DVector<f64>> = Vec::new();
    let mut visited: Vec<usize> = Vec::new();
    // Coordinates of every column in the orthonormal basis, filled as the basis grows.
    let mut coordinates: Vec<Vec<f64>> = vec![Vec::new(); all];
    let (mut least_kept, mut most_dropped) = (f64::INFINITY, 0.0f64);
    let mut remainder = vec![0.0; all];
    for &c in order {
        let length = matrix.column(c).norm();
        if length <= 1e-12 * longest || length.is_nan() {
            continue;
        }
        let mut rest = matrix.column(c).into_owned() / length;
        // Twice is enough (Kahan): the second pass removes what rounding left in the first.
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
    // Exactly the identity on the kept columns, whatever rounding says.
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

/// The base parameters of a robot: β = K·π, with π the 14 parameters of every joint and, where a drive moves more than
/// its own joint, the 3 of every motor behind them ([`rig_shared::transmission`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// Columns of the standard regressor (14 a joint, 3 a motor) that stand for the base parameters.
    pub columns: Vec<usize>,
    /// K, base parameters × 14n, or × 17n where there are motor columns.
    pub combination: DMatrix<f64>,
    /// Kinds of the joints, for units and names.
    pub kinds: Vec<robot::JointKind>,
    /// Kinds of the drives, one a joint.
    pub drives: Vec<DriveKind>,
}

/// Order in which columns are preferred as representatives, so that the expressions group as the literature
/// groups them (Khalil & Dombre 2002, ch. 9): of a revolute link `Iyy`, `mz` and `m` go to the link before,
/// of a prismatic link its inertia; drive inertia joins the link's own where it cannot be told from it. What a motor
/// adds comes last.
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
    /// Finds the base parameters of `robot` for a model from random states of it: of the equations that are fitted
    /// ([`ModelKind`]). Momentum and torque have the same ones: a combination that no torque shows changes no momentum (the
    /// momentum is what multiplies the accelerations in the torque, with the velocities in their place) and, the torque being
    /// its change and the rest, none of the rest.
    ///
    /// # Errors
    /// [`IdentifyError::Model`] for an impossible geometry, [`IdentifyError::Undecided`] where a column is
    /// neither clearly dependent nor clearly independent.
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

    /// The same with the coefficients of rules that say the same, which have no rounding of random states in them.
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

    /// The base parameters whose own column satisfies `keep`.
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

    /// Number of base parameters.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether the torque depends on nothing (never for a chain, whose joints have friction).
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The combination a base parameter stands for, as a paper prints it: `Izz1 + Ia1`.
    pub fn expression(&self, row: usize) -> String {
        expression(&self.combination, row, self.columns[row])
    }

    /// Unit of a base parameter, ASCII.
    pub fn unit(&self, row: usize) -> &'static str {
        self.column_unit(self.columns[row])
    }

    /// Name of a column of the standard regressor, with the number of its joint or motor.
    pub fn column_name(&self, c: usize) -> String {
        column_name(c, self.kinds.len())
    }

    /// Unit of a column, ASCII.
    pub fn column_unit(&self, c: usize) -> &'static str {
        unit(c, &self.kinds, &self.drives)
    }
}

/// Name of a column with the number of its joint or motor, for a robot of so many joints.
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

/// Number of joints from the number of columns: 14 a joint, or 17 with the motors' (no number of at most
/// [`MAX_JOINTS`] joints gives both).
fn joints_of(columns: usize) -> usize {
    let without = columns / COLUMNS;
    if columns.is_multiple_of(COLUMNS) && without <= MAX_JOINTS {
        without
    } else {
        columns / (COLUMNS + MOTOR_COLUMNS)
    }
}

/// A row of a combination matrix in words, its own column first.
pub fn expression(combination: &DMatrix<f64>, row: usize, own: usize) -> String {
    let joints = joints_of(combination.ncols());
    let mut text = column_name(own, joints);
    for c in 0..combination.ncols() {
        let k = combination[(row, c)];
        // Rounding of the text only: the values are computed with the coefficients as they are.
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

/// Unit of a column.
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
    // The values of a drive of changing ratio are the motor's own, which always turns.
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
