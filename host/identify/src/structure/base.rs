//! Base (canonical) parameters: the combinations of parameters on which the torque depends.

use nalgebra::DMatrix;
use rig_shared::transmission::DriveKind;

use super::columns::{column_name, expression, unit};
use rig_model::robot;

/// The base parameters of a robot: β = K·π, with π the 14 parameters of every link (joints, then followers). If a drive moves several joints,
/// the 3 parameters of every motor follow ([`rig_shared::transmission`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// Columns of the standard regressor (14 per link, 3 per motor) that represent the base parameters.
    pub columns: Vec<usize>,
    /// K, base parameters × 14 per link, with 3 more per motor.
    pub combination: DMatrix<f64>,
    /// Kinds of the links' axes, for units and names.
    pub kinds: Vec<robot::JointKind>,
    /// The joint that moves each link.
    pub joints: Vec<usize>,
    /// Kinds of the drives, one per joint.
    pub drives: Vec<DriveKind>,
}

impl Base {
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
            joints: self.joints,
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

#[cfg(test)]
#[path = "base_test.rs"]
mod tests;
