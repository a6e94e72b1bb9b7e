//! Friction against speed, from a recording with stretches of constant speed.
//!
//! Passes are found in the recorded reference of the joint, which has no noise, or else in the measured position. A
//! pass gives one point: its mean speed, its mean friction and the standard deviation of that mean. Noise makes a point
//! less certain but never removes it. Every dropped pass is listed with its reason.
//!
//! The sweep has its own sample rate, band, clipping and time stamps; only the parameters come from the identification.
//! [`FrictionMap::doubts`] tells whether the sweep and the identification are consistent.
//!
//! Limits: no friction that depends on position, load or temperature; all rows of a sweep are held in memory.

use super::check::Check;
use super::law;
use super::map::{FrictionMap, FrictionMapOptions};
use super::sweep::{can_be_loaded, friction_of, reference_of, rows_of, treatment_of};
use super::text::{one_speed, text_of, too_few};
use crate::error::IdentifyError;
use crate::identification::Identification;
use rig_data::prepare::{Recording, Spooled, surveyed};
use rig_model::robot::Robot;

/// Computes the friction map of joint `joint` (from 0) from `recording`, with gravity and inertia of `identification`.
/// The recording may have another sample rate than those of the identification.
///
/// # Errors
/// [`IdentifyError::FrictionMap`] if fewer than four stretches of constant speed are found or all have the same
/// direction; reading errors.
pub fn friction_map(
    robot: &Robot,
    identification: &Identification,
    recording: &dyn Recording,
    joint: usize,
    options: FrictionMapOptions,
) -> Result<FrictionMap, IdentifyError> {
    let described = robot.joints.get(joint).ok_or_else(|| {
        IdentifyError::FrictionMap(format!(
            "The robot has {} joints; there is no joint {}.",
            robot.joints.len(),
            joint + 1
        ))
    })?;
    let spooled = Spooled::new(recording);
    let (surveys, even) = surveyed(&[&spooled], robot.joints.len())?;
    let (Some(survey), Some(even)) = (surveys.first(), even.first()) else {
        return Err(IdentifyError::NoRecording);
    };
    let treatment = treatment_of(robot, &identification.details.treatment, survey, even)?;
    let rows = rows_of(robot, identification, even, joint, &treatment)?;
    let reference = reference_of(recording, joint)?;
    let planned = reference.passes_of_reference(&options);
    let from_reference = both_ways(planned.iter().map(|s| s.speed));
    let stretches = if from_reference {
        planned
    } else {
        rows.position.passes_of_position(&options)
    };
    let (points, dropped) = rows.points(&stretches, &options);
    if !both_ways(points.iter().map(|p| p.speed)) {
        return Err(too_few(&described.name, &points, &dropped));
    }
    let decision = law::decide(&points).ok_or_else(|| one_speed(&described.name))?;
    let check = Check {
        rows: &rows,
        stretches: &stretches,
        options: &options,
        sweep: &survey.label,
        joint: &described.name,
        noise: (identification.details.train.get(joint)).map_or(f64::INFINITY, |own| own.rms),
        number: joint + 1,
        kind: described.kind,
        friction: friction_of(identification, joint),
        loaded: can_be_loaded(robot, joint)?,
        ratio: described.gear_ratio(),
    };
    let doubts = check.doubts(&points, &decision);
    let text = text_of(&decision, &points, described.kind);
    let warranted = decision.warranted;
    Ok(FrictionMap {
        joint: described.name.clone(),
        points,
        dropped,
        from_reference,
        scatter: decision.scatter,
        simple: decision.simple,
        stribeck_left_out_rms: decision.stribeck.as_ref().map(|b| b.leave_one_out_rms),
        stribeck: decision.stribeck.filter(|_| warranted),
        profile: decision.profile,
        p_value: decision.p_value,
        warranted,
        text,
        note: survey.note.clone(),
        doubts,
    })
}

/// Returns true if the speeds suffice for a map: at least four, in both directions.
fn both_ways(speeds: impl Iterator<Item = f64> + Clone) -> bool {
    let back = speeds.clone().filter(|v| *v < 0.0).count();
    let forth = speeds.filter(|v| *v > 0.0).count();
    back + forth >= 4 && back > 0 && forth > 0
}
