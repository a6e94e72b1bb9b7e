//! Recordings whose torque is compared with that of a model.

use super::equation::Rows;
use super::plan::Plan;
use super::stream::each_rows;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use rig_data::prepare::{PrepareError, Recording};

/// A recording whose torque is compared with the model's, and the definition of its rows.
#[derive(Clone, Copy)]
pub struct Planned<'a> {
    /// The recording.
    pub recording: &'a dyn Recording,
    /// Definition of its rows.
    pub plan: &'a Plan<'a>,
}

impl<'a> Planned<'a> {
    /// Combines recordings with one plan.
    pub fn all(list: &[&'a dyn Recording], plan: &'a Plan<'a>) -> Vec<Self> {
        list.iter()
            .map(|&recording| Self { recording, plan })
            .collect()
    }

    /// Streams its rows, torque against motion.
    pub(crate) fn each_rows(
        &self,
        take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
    ) -> Result<(), IdentifyError> {
        each_rows(self.recording, self.plan, ModelKind::Differential, take).map(|_| ())
    }
}
