//! Rows of a trial that no reversal of friction reaches.

use super::trial_rows::kept;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use crate::rows::differential::RESPONSE;
use crate::rows::equation::Rows;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use rig_data::prepare::{PreprocessingPlan, Recording};

/// Returns `treatment` with the margin around slow rows that its low-pass spreads them over.
pub(crate) fn with_margin(treatment: PreprocessingPlan) -> PreprocessingPlan {
    let response = (RESPONSE * treatment.decimation) as f64 * treatment.dt();
    PreprocessingPlan {
        reversal_margin: treatment.reversal_margin.max(response),
        ..treatment
    }
}

/// The rows of a recording that are used, by their time.
pub(crate) struct ClearRows {
    /// s, rising.
    t: Vec<f64>,
    /// Per row, one flag a joint.
    used: Vec<Vec<bool>>,
}

impl ClearRows {
    /// Returns the rows of `recording` that `plan` uses.
    ///
    /// # Errors
    /// [`IdentifyError`]: a recording that cannot be read.
    pub(crate) fn of(recording: &dyn Recording, plan: &Plan) -> Result<Self, IdentifyError> {
        let (mut t, mut used) = (Vec::new(), Vec::new());
        each_rows(recording, plan, ModelKind::Differential, &mut |rows| {
            for (i, time) in rows.t.iter().enumerate() {
                t.push(*time);
                used.push(
                    (0..rows.equations.len())
                        .map(|j| kept(rows, j, i))
                        .collect(),
                );
            }
            Ok(())
        })?;
        Ok(Self { t, used })
    }

    /// Returns true if the row is used in the equation of `joint`.
    pub(crate) fn has(&self, rows: &Rows, joint: usize, row: usize) -> bool {
        let place = self.t.binary_search_by(|t| t.total_cmp(&rows.t[row]));
        place.is_ok_and(|k| self.used[k][joint])
    }

    /// Returns the number of used rows of all joints.
    pub(crate) fn count(&self) -> usize {
        self.used.iter().flatten().filter(|used| **used).count()
    }
}
