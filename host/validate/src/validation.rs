//! The validation of a description with recordings.

use crate::motion::{Subject, check};
use crate::torque::{nonzero_parameters, prior_warnings, torque_checks, unexplained};
use crate::treatment::treatment;
use crate::{Checked, Motion, Options, ValidateError, Validation};
use rig_data::prepare::{Recording, as_recordings, surveyed};
use rig_identify::{Plan, chain_of};
use rig_model::robot::Robot;
use rig_model::simulate::Model;
use rig_output::one_a_kind;

/// Compares the predictions of `robot` with `recordings`. `progress` receives the completed share.
///
/// # Errors
/// [`ValidateError`]: no recording, a description without inertia and friction, recordings that cannot be prepared. A
/// motion that cannot be simulated is no error but a [`Motion::NotSimulated`] with the reason.
pub fn validate(
    robot: &Robot,
    recordings: &[&dyn Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<Validation, ValidateError> {
    if recordings.is_empty() {
        return Err(ValidateError::NoRecording);
    }
    let chain = chain_of(robot)?;
    let model = Model::from_robot(robot)?;
    let (columns, values) = nonzero_parameters(&model);
    if columns.is_empty() {
        return Err(ValidateError::NothingKnown {
            robot: robot.name.clone(),
        });
    }
    let joints = robot.joints.len();
    let (surveys, even) = surveyed(recordings, joints)?;
    let interpolated: Vec<String> = surveys.iter().filter_map(|s| s.note.clone()).collect();
    let even = as_recordings(&even);
    let recordings = even.as_slice();
    let (surveys, treatment, note) = treatment(robot, recordings, surveys, options)?;
    let transmission = rig_identify::transmission_of(robot)?;
    let plan = Plan {
        chain: &chain,
        transmission: &transmission,
        columns: &columns,
        treatment: &treatment,
        window: 0,
        stride: 1,
        loudness: vec![1.0; joints],
        one_way: Vec::new(),
        cache: rig_identify::RowCache::default(),
    };
    let mut warnings = prior_warnings(robot, &columns);
    warnings.extend(interpolated);
    warnings.extend(note);
    let [taken, left] = model.effects.uncompensated();
    warnings.extend(left);
    let mut checked = Vec::with_capacity(recordings.len());
    let share = 1.0 / recordings.len() as f64;
    for (k, (recording, survey)) in recordings.iter().zip(&surveys).enumerate() {
        let torque = torque_checks(robot, &model, &plan, &values, *recording, survey)?;
        warnings.extend(one_a_kind(unexplained(&survey.label, &torque)));
        let done = k as f64 * share;
        let subject = Subject {
            robot,
            model: &model,
            recording: *recording,
            survey,
            treatment: &treatment,
            options,
        };
        let motion = check(&subject, &mut |part| progress(done + share * part))?;
        warnings.extend(motion_warning(&survey.label, &motion));
        checked.push(Checked {
            recording: survey.label.clone(),
            rows: survey.rows,
            sample_rate: survey.sample_rate,
            torque,
            motion,
        });
        progress(done + share);
    }
    Ok(Validation {
        schema: "rig-validation/1".into(),
        robot: robot.name.clone(),
        recordings: checked,
        warnings,
        taken_off: taken,
        treatment,
    })
}

/// Returns a warning on a motion that was not simulated, or not in its own closed loop.
fn motion_warning(recording: &str, motion: &Motion) -> Option<String> {
    match motion {
        Motion::NotSimulated { why } => {
            Some(format!("{recording}: the motion was not simulated. {why}"))
        }
        Motion::Simulated {
            uncontrolled,
            remarks,
            ..
        } if !uncontrolled.is_empty() => Some(format!(
            "{recording}: the description has no [joint.controller] for {}, so that no closed loop was simulated. {}",
            uncontrolled.join(", "),
            remarks.first().map_or("", String::as_str)
        )),
        Motion::Simulated { .. } => None,
    }
}
