//! Treatment of the recordings before the comparison, for a report.

use crate::outcome::{Rows, Treated};
use crate::recordings::context::PreparedData;
use crate::result::sentences::treatment::cutoff;
use crate::rows::regression::Rows as Regression;
use rig_data::prepare::PreprocessingPlan;
use rig_model::robot::Robot;

/// Returns the treatment of the training recordings and of the hold-out.
pub(crate) fn treated(
    robot: &Robot,
    training: &PreparedData,
    holdout: Option<&PreparedData>,
) -> Treated {
    let treatment = &training.treatment;
    let rows = &training.rows;
    Treated {
        sample_rate: treatment.sample_rate,
        position_cutoff: treatment.cutoff,
        position_cutoff_why: cutoff(treatment),
        links_cutoff: rows.thinning.links_cutoff(),
        band: band(treatment),
        motion_frequency: treatment.motion_frequency,
        row_rate: treatment.kept_rate(),
        rows: (robot.joints.iter().enumerate())
            .map(|(j, joint)| {
                let speed = treatment.speed_threshold.get(j).copied();
                let of = |rows: &Regression| [rows.used(j), rows.count];
                Rows {
                    joint: joint.name.clone(),
                    least_speed: speed.unwrap_or(0.0),
                    unit: format!("{}/s", joint.kind.units().0),
                    train: of(rows),
                    holdout: holdout.map(|held| of(&held.rows)),
                }
            })
            .collect(),
    }
}

/// Returns the upper end of the rows' band, Hz: the lower one of both filters.
fn band(treatment: &PreprocessingPlan) -> f64 {
    treatment.parallel_edge.min(treatment.cutoff)
}
