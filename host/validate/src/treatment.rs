//! Treatment of the recordings for the torque check.

use crate::{Options, ValidateError};
use rig_data::prepare::{Choice, PreprocessingPlan, Recording, Survey};
use rig_identify::treatment_for;
use rig_model::robot::Robot;

/// Decides the treatment. Settings that are not given are those of the description's identification, if it states them:
/// the error is then that of `identify` on the same recording. Otherwise they are chosen from the recordings.
pub(crate) fn treatment(
    robot: &Robot,
    recordings: &[&dyn Recording],
    surveys: Vec<Survey>,
    options: &Options,
) -> Result<(Vec<Survey>, PreprocessingPlan, Option<String>), ValidateError> {
    let chosen = |surveys, note| {
        let (surveys, treatment) = treatment_for(robot, recordings, surveys, &options.prepare)?;
        Ok((surveys, treatment, note))
    };
    let Some(band) = &robot.identified else {
        return chosen(surveys, None);
    };
    let mut prepare = options.prepare.clone();
    let stated = "as the description was identified.";
    if prepare.cutoff == Choice::Auto {
        prepare.cutoff = Choice::Fixed(band.cutoff);
    }
    if let (Choice::Auto, Some(first)) = (prepare.decimation, surveys.first()) {
        let rows = (first.sample_rate / band.rate).round().max(1.0);
        prepare.decimation = Choice::Fixed(rows as usize);
    }
    if prepare.torque_lead == 0.0 {
        prepare.torque_lead = band.torque_lead;
    }
    let Ok(mut treatment) = PreprocessingPlan::decide(&surveys, &prepare, &robot.torque_limits())
    else {
        let note = format!(
            "These recordings cannot be judged in the band that the description was identified in (cut-off {} Hz, {} rows per second), so one was chosen from them: the errors are not those of the identification's hold-out.",
            band.cutoff, band.rate
        );
        return chosen(surveys, Some(note));
    };
    if options.prepare.cutoff == Choice::Auto {
        treatment.cutoff_reason = format!("{} Hz, {stated}", band.cutoff);
    }
    if options.prepare.decimation == Choice::Auto {
        treatment.decimation_reason = format!("One row in {}, {stated}", treatment.decimation);
    }
    if prepare.speed_threshold == Choice::Auto {
        treatment.speed_threshold.clone_from(&band.min_speed);
        treatment.speed_reason = format!("By joint, {stated}");
    }
    Ok((surveys, treatment, None))
}
