//! Validation: predictions of a description for recordings that were not used for its fit. Nothing is refitted.
//!
//! Two checks per recording. *Torque*: the model's torque for the measured motion is compared with the measured torque.
//! Preparation and evaluation are those of [`rig_identify`]'s hold-out, so that both figures are comparable. *Motion*:
//! the closed loop of model and controller, driven by the recorded reference from the recording's first state, is
//! compared with the measured position and torque; model errors accumulate over time here. If the description lacks the
//! controller of a joint, a substitute controller would affect the result more than the model. Then the recorded
//! torques drive the model and a controller corrects deviations from the recorded motion ([`replay`]); a warning
//! reports it.
//!
//! A recording may state that the drive applied more than its controller's output. Column `added<k>`: torque or force
//! on joint k beside the controller's, N·m or N. Column `pulses`: added to the output of the first joint's controller,
//! in its unit, and so multiplied by the description's `torque_gain`. Both are part of `tau<k>`, the whole torque of
//! the drive: measured and simulated torque are compared as wholes, and the description's torque limit acts on the
//! whole. (For the pulses of EMPS this was measured: `u1` minus the controller's law for `ref1` and `q1` is the column
//! `pulses`, and the torque balance has no room for a further force.)
//!
//! Effects beyond the standard model: their torque along the measured motion is subtracted from the measured torque,
//! sensor errors from the readings; the simulated motion contains all of them. Payloads are masses of the model.
//!
//! ```no_run
//! use rig_data::Source;
//! use rig_model::robot::Robot;
//! use rig_validate::{Options, validate};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::load("model.toml".as_ref())?;
//! let recording = Source::open("holdout.csv".as_ref(), &robot)?;
//! let found = validate(&robot, &[&recording], &Options::default(), |_| ())?;
//! println!("{}", found.warnings.join("\n"));
//! # Ok(())
//! # }
//! ```
//!
//! Limits: the torque check excludes effects between motor and link or on the voltage (a warning reports it); no
//! uncertainty of the description's parameters; no measured inputs other than reference and added torque.

#[cfg(test)]
mod effects_tests;
mod motion;
pub mod replay;
#[cfg(test)]
mod tests;

use rig_shared::multibody::COLUMNS;
use serde::Serialize;

use rig_data::Compensated;
use rig_data::prepare::{
    Choice, PrepareError, PrepareOptions, Recording, Survey, Treatment, as_recordings, surveyed,
};
use rig_identify::{
    IdentifyError, Plan, Planned, ResidualReport, chain_of, torque_residuals, treatment_for,
};
use rig_model::robot::Robot;
use rig_model::simulate::{Model, SimulateError};
use rig_output::{Finding, one_a_kind};

/// Settings of a validation.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Filters, decimation, masks of the torque check.
    pub prepare: PrepareOptions,
    /// Simulation steps per sample; if absent, doubled until halving the step no longer matters.
    pub substeps: Option<u32>,
    /// Largest number of simulated samples per recording; memory grows with it.
    pub most_samples: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            prepare: PrepareOptions::default(),
            substeps: None,
            // Ten minutes at 1 kHz; about 50 MB per joint.
            most_samples: 600_000,
        }
    }
}

/// Reasons why a description cannot be validated.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// No recording.
    #[error("No recording was given; name at least one.")]
    NoRecording,
    /// The description predicts no torque.
    #[error(
        "The description of {robot} states neither inertia nor friction, so it predicts no torque; `rig identify` writes a description that does."
    )]
    NothingKnown {
        /// Name of the robot.
        robot: String,
    },
    /// Reading or preparing a recording failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The torque could not be predicted.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The model could not be built.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

/// Predicted and measured torque of one joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueCheck {
    /// Name of the joint.
    pub joint: String,
    /// `N*m` or `N`
    pub unit: String,
    /// Residual and its statistics.
    #[serde(flatten)]
    pub residual: ResidualReport,
}

/// Simulated and measured motion of one joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionCheck {
    /// Name of the joint.
    pub joint: String,
    /// `rad` or `m`
    pub position_unit: String,
    /// `N*m` or `N`
    pub torque_unit: String,
    /// RMS of simulated minus measured position.
    pub position_rms_error: f64,
    /// Largest absolute value of this difference.
    pub position_max_error: f64,
    /// RMS error over the RMS of the measured position about its mean.
    pub position_relative_error: f64,
    /// RMS of the measured tracking error, reference minus position.
    pub tracking_rms: f64,
    /// RMS error over the RMS of the tracking error: a controller hides model errors in the position, but not in this
    /// ratio.
    pub tracking_relative_error: f64,
    /// RMS of simulated minus measured torque.
    pub torque_rms_error: f64,
    /// Largest absolute value of this difference.
    pub torque_max_error: f64,
    /// RMS error over the RMS of the measured torque.
    pub torque_relative_error: f64,
    /// Number of samples at which the torque limit acts on the simulated controller.
    pub saturated: u64,
    /// RMS change of the simulated position when the step is halved.
    pub position_step_change: f64,
    /// RMS change of the simulated torque when the step is halved.
    pub torque_step_change: f64,
    /// Curves for a plot.
    #[serde(skip)]
    pub series: MotionSeries,
}

/// Curves for a plot, at most 4000 points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionSeries {
    /// Time, s.
    pub t: Vec<f64>,
    /// Reference position.
    pub reference: Vec<f64>,
    /// Measured position.
    pub measured: Vec<f64>,
    /// Simulated position.
    pub simulated: Vec<f64>,
    /// Measured torque.
    pub torque_measured: Vec<f64>,
    /// Simulated torque.
    pub torque_simulated: Vec<f64>,
}

/// Simulated motion, or the reason why it is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Motion {
    /// Simulated and compared.
    Simulated {
        /// One entry per joint.
        joints: Vec<MotionCheck>,
        /// Number of simulated samples.
        samples: u64,
        /// Number of samples of the recording.
        of: u64,
        /// Stretches without a gap in time, each with its own initial state.
        stretches: usize,
        /// Simulation steps per sample.
        substeps: u32,
        /// Joints without a described controller. If there are any, the recorded torques drive the model instead of a
        /// closed loop.
        uncontrolled: Vec<String>,
        /// Sentences: input of the simulation, initial state, step, added torque, omissions.
        remarks: Vec<String>,
    },
    /// Not simulated.
    NotSimulated {
        /// Reason, a sentence.
        why: String,
    },
}

/// Results for one recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// Name of the recording.
    pub recording: String,
    /// Number of rows.
    pub rows: u64,
    /// Sample rate, Hz.
    pub sample_rate: f64,
    /// One entry per joint.
    pub torque: Vec<TorqueCheck>,
    /// The closed loop.
    pub motion: Motion,
}

/// The result; serialises to `validation.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validation {
    /// `rig-validation/1`
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// One entry per recording.
    pub recordings: Vec<Checked>,
    /// Sentences.
    pub warnings: Vec<String>,
    /// Effects of the description that were subtracted from the recordings, a sentence; none without such effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken_off: Option<String>,
    /// Treatment of the recordings for the torque check.
    #[serde(skip)]
    pub treatment: Treatment,
}

/// Share of unexplained torque above which a warning is given; [`rig_identify`] uses the same.
const UNEXPLAINED: f64 = 0.3;

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
    // Parameters of coupled drives follow those of the joints.
    let motors = model
        .motors
        .as_ref()
        .map_or(&[][..], |m| m.parameters.as_flattened());
    // Zero parameters add no torque, so their columns are not computed.
    let (columns, values): (Vec<usize>, Vec<f64>) = model
        .parameters
        .iter()
        .flatten()
        .chain(motors)
        .copied()
        .enumerate()
        .filter(|(_, value)| *value != 0.0)
        .unzip();
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
        let free = Compensated::new(*recording, &model.effects, &chain, &treatment, false)?;
        let compared: &dyn Recording = if model.effects.is_empty() {
            *recording
        } else {
            &free
        };
        let whole = (!model.effects.is_empty()).then(|| Planned::all(&[*recording], &plan));
        let torque: Vec<TorqueCheck> = torque_residuals(
            &Planned::all(&[compared], &plan),
            std::slice::from_ref(survey),
            &values,
            &|_, _| 0.0,
            whole.as_deref(),
        )?
        .into_iter()
        .zip(&robot.joints)
        .map(|(residual, joint)| TorqueCheck {
            joint: joint.name.clone(),
            unit: joint.kind.units().1.to_owned(),
            residual,
        })
        .collect();
        warnings.extend(one_a_kind(unexplained(&survey.label, &torque)));
        let done = k as f64 * share;
        let motion = motion::check(
            robot,
            &model,
            *recording,
            survey,
            &treatment,
            options,
            &mut |part| progress(done + share * part),
        )?;
        match &motion {
            Motion::NotSimulated { why } => warnings.push(format!(
                "{}: the motion was not simulated. {why}",
                survey.label
            )),
            Motion::Simulated {
                uncontrolled,
                remarks,
                ..
            } if !uncontrolled.is_empty() => {
                warnings.push(format!(
                    "{}: the description has no [joint.controller] for {}, so that no closed loop was simulated. {}",
                    survey.label,
                    uncontrolled.join(", "),
                    remarks.first().map_or("", String::as_str)
                ));
            }
            Motion::Simulated { .. } => {}
        }
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

/// Reports the joints whose torque the description does not explain, or that have no usable row.
fn unexplained(recording: &str, torque: &[TorqueCheck]) -> Vec<Finding> {
    let of = |check: &TorqueCheck| {
        let (joint, left) = (&check.joint, 100.0 * check.residual.relative_error);
        if check.residual.rows == 0 {
            Some(Finding {
                kind: "masked",
                size: 0.0,
                sentence: format!(
                    "{recording}, joint {joint}: every row is masked (too slow, or at the torque limit), so its torque was not checked."
                ),
                short: joint.clone(),
            })
        } else if check.residual.relative_error > UNEXPLAINED {
            Some(Finding {
                kind: "unexplained",
                size: left,
                sentence: format!(
                    "{recording}, joint {joint}: the description leaves {left:.0} % of the torque unexplained."
                ),
                short: format!("{joint} ({left:.0} %)"),
            })
        } else {
            None
        }
    };
    torque.iter().filter_map(of).collect()
}

/// Decides the treatment. Settings that are not given are those of the description's identification, if it states them:
/// the error is then that of `identify` on the same recording. Otherwise they are chosen from the recordings.
fn treatment(
    robot: &Robot,
    recordings: &[&dyn Recording],
    surveys: Vec<Survey>,
    options: &Options,
) -> Result<(Vec<Survey>, Treatment, Option<String>), ValidateError> {
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
    let Ok(mut treatment) = Treatment::decide(&surveys, &prepare, &robot.torque_limits()) else {
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

/// Returns warnings about the description itself.
fn prior_warnings(robot: &Robot, columns: &[usize]) -> Vec<String> {
    let mut warnings = Vec::new();
    for (j, joint) in robot.joints.iter().enumerate() {
        if !columns.iter().any(|c| c / COLUMNS == j) {
            warnings.push(format!(
                "The description states neither inertia nor friction for joint {}; they count as zero.",
                joint.name
            ));
        } else if joint.friction.is_none() {
            warnings.push(format!(
                "The description states no friction for joint {}; it counts as zero.",
                joint.name
            ));
        }
    }
    warnings
}
