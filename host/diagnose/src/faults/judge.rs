//! One recording, compared with a simple model of each torque.

use nalgebra::DMatrix;

use crate::DiagnoseError;
use crate::faults::finding::Fault;
use crate::faults::fit::Fit;
use crate::faults::rows::{Form, Rows};
use rig_data::Implausible;
use rig_data::runs::Run;
use rig_identify::preference;
use rig_model::robot::{JointKind, Robot};

/// One recording, compared with models of the robot.
pub(crate) struct Judge<'a> {
    pub(crate) robot: &'a Robot,
    pub(crate) runs: &'a [&'a Run],
    /// What columns show without a model.
    pub(crate) units: &'a [Fault],
    pub(crate) form: Form,
    pub(crate) rows: Rows,
    pub(crate) order: Vec<usize>,
    pub(crate) matrices: Vec<DMatrix<f64>>,
    pub(crate) fits: Vec<Option<Fit>>,
}

impl<'a> Judge<'a> {
    /// Compares the rows of one recording.
    pub(crate) fn new(
        robot: &'a Robot,
        runs: &'a [&'a Run],
        units: &'a [Fault],
    ) -> Result<Self, DiagnoseError> {
        Self::of_rows(robot, runs, units, Rows::of(runs, robot.joints.len()))
    }

    /// Compares other rows of the same recording.
    pub(crate) fn of_rows(
        robot: &'a Robot,
        runs: &'a [&'a Run],
        units: &'a [Fault],
        rows: Rows,
    ) -> Result<Self, DiagnoseError> {
        let form = Form::of(robot)?;
        let kinds: Vec<JointKind> = robot.joints.iter().map(|j| j.kind).collect();
        let mut order = preference(&kinds);
        order.extend(order.len()..form.width());
        let matrices = rows.regressors(&form)?;
        let fits = matrices
            .iter()
            .zip(&rows.tau)
            .map(|(x, y)| Fit::of(x, y, &order))
            .collect();
        Ok(Self {
            robot,
            runs,
            units,
            form,
            rows,
            order,
            matrices,
            fits,
        })
    }

    /// Returns the fault that shows degrees in joint `j`'s position by its limits.
    pub(crate) fn shown_by_limits(&self, j: usize) -> Option<&Fault> {
        let degrees = |own: &Fault| {
            let column = own.finding.column();
            own.is_certain() && matches!(column, Some(Implausible::Degrees { .. }))
        };
        (self.units.iter()).find(|own| own.joint == Some(j) && degrees(own))
    }
}
