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

/// The rows of a recording that are used, as stretches of time: memory grows with the reversals, not with the rows.
pub(crate) struct ClearRows {
    /// Per joint, first and last time of each stretch of used rows, s, rising.
    stretches: Vec<Vec<[f64; 2]>>,
    count: usize,
}

impl ClearRows {
    /// Returns the rows of `recording` that `plan` uses.
    ///
    /// # Errors
    /// [`IdentifyError`]: a recording that cannot be read.
    pub(crate) fn of(recording: &dyn Recording, plan: &Plan) -> Result<Self, IdentifyError> {
        let joints = plan.loudness.len();
        let mut clear = Self {
            stretches: vec![Vec::new(); joints],
            count: 0,
        };
        let mut before = vec![false; joints];
        each_rows(recording, plan, ModelKind::Differential, &mut |rows| {
            for (i, &time) in rows.t.iter().enumerate() {
                for (j, before) in before.iter_mut().enumerate() {
                    let used = kept(rows, j, i);
                    if used {
                        clear.add(j, time, *before);
                    }
                    *before = used;
                }
            }
            Ok(())
        })?;
        Ok(clear)
    }

    /// Adds a used row, to the last stretch if the row before it is used as well.
    fn add(&mut self, joint: usize, time: f64, continued: bool) {
        self.count += 1;
        match self.stretches[joint].last_mut() {
            Some(last) if continued => last[1] = time,
            _ => self.stretches[joint].push([time; 2]),
        }
    }

    /// Returns true if the row is used in the equation of `joint`.
    pub(crate) fn has(&self, rows: &Rows, joint: usize, row: usize) -> bool {
        let (own, t) = (&self.stretches[joint], rows.t[row]);
        let begun = own.partition_point(|[first, _]| *first <= t);
        begun > 0 && t <= own[begun - 1][1]
    }

    /// Returns the number of used rows of all joints.
    pub(crate) fn count(&self) -> usize {
        self.count
    }
}
