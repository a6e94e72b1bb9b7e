//! Validation: what a description predicts for recordings that it was not fitted to. Nothing is refitted.
//!
//! Two checks a recording. *Torque*: the model's torque for the measured motion against the measured torque,
//! prepared and evaluated as [`rig_identify`] evaluates its hold-out, so that both figures can be compared.
//! *Motion*: the closed loop of model and controller, driven by the recorded reference from the recording's
//! first state, against the measured position and torque; here errors of the model add up over time. Where the description has
//! no controller for a joint, the motion of another one would say more of that than of the model: there the recorded torques
//! drive the model, and a controller answers what it departs from the recorded motion by, as [`replay`]
//! simulates, which a warning says.
//!
//! A recording may say that the drive applied more than its controller asked for. Column `added<k>`: torque or
//! force on joint k beside the controller's, N·m or N. Column `pulses`: added to the output of the first joint's
//! controller, in its unit, and so multiplied by the description's `torque_gain`. Both are part of `tau<k>`, the
//! whole torque of the drive: measured and simulated torque are compared as wholes, and the description's torque
//! limit acts on the whole. (For the pulses of EMPS this was measured: `u1` less what the controller's law gives for
//! `ref1` and `q1` is the column `pulses`, and the torque balance has no room for a further force.)
//!
//! Effects beyond the standard model: their torque along the measured motion is taken off the measured torque, their
//! errors of a sensor off its readings; the simulated motion has them all. Payloads are masses of the model.
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
//! Leaves out: in the torque check, what acts between motor and link or on the voltage (a warning says so); uncertainty
//! of the description's parameters; measured inputs other than reference and added torque.

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
    /// Steps of the simulation within one sample; doubled until halving the step no longer matters where absent.
    pub substeps: Option<u32>,
    /// Most samples of one recording whose motion is simulated; memory grows with it.
    pub most_samples: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            prepare: PrepareOptions::default(),
            substeps: None,
            // Ten minutes at 1 kHz; about 50 MB a joint.
            most_samples: 600_000,
        }
    }
}

/// Why a description cannot be validated.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// No recording.
    #[error("No recording was given; name at least one.")]
    NoRecording,
    /// Nothing to predict with.
    #[error(
        "The description of {robot} states neither inertia nor friction, so it predicts no torque; `rig identify` writes a description that does."
    )]
    NothingKnown {
        /// Name of the robot.
        robot: String,
    },
    /// Reading or preparing has failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The torque could not be predicted.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The model could not be built.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

/// Torque of one joint, predicted and measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueCheck {
    /// Name of the joint.
    pub joint: String,
    /// `N*m` or `N`
    pub unit: String,
    /// What is left, and what it looks like.
    #[serde(flatten)]
    pub residual: ResidualReport,
}

/// Motion of one joint, simulated and measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionCheck {
    /// Name of the joint.
    pub joint: String,
    /// `rad` or `m`
    pub position_unit: String,
    /// `N*m` or `N`
    pub torque_unit: String,
    /// RMS of simulated less measured position.
    pub position_rms_error: f64,
    /// Largest such difference.
    pub position_max_error: f64,
    /// RMS error over the RMS of the measured position about its mean.
    pub position_relative_error: f64,
    /// RMS of the measured tracking error, reference less position.
    pub tracking_rms: f64,
    /// RMS error over the RMS of the tracking error: a controller hides what a model gets wrong in the position,
    /// not in this.
    pub tracking_relative_error: f64,
    /// RMS of simulated less measured torque.
    pub torque_rms_error: f64,
    /// Largest such difference.
    pub torque_max_error: f64,
    /// RMS error over the RMS of the measured torque.
    pub torque_relative_error: f64,
    /// Samples at which the torque limit cut the simulated controller's wish.
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
    /// s
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

/// Simulated motion, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Motion {
    /// Simulated and compared.
    Simulated {
        /// One a joint.
        joints: Vec<MotionCheck>,
        /// Samples simulated.
        samples: u64,
        /// Samples of the recording.
        of: u64,
        /// Stretches without a gap in time, each from its own first state.
        stretches: usize,
        /// Steps within one sample.
        substeps: u32,
        /// Joints that the description has no controller for; where there are any, no closed loop was simulated, but what the
        /// recorded torques make of the model.
        uncontrolled: Vec<String>,
        /// Sentences: what drives the simulation, initial state, step, added torque, what was left out.
        remarks: Vec<String>,
    },
    /// Not simulated.
    NotSimulated {
        /// A sentence.
        why: String,
    },
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// Name of the recording.
    pub recording: String,
    /// Rows.
    pub rows: u64,
    /// Hz
    pub sample_rate: f64,
    /// One a joint.
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
    /// One a recording.
    pub recordings: Vec<Checked>,
    /// Sentences.
    pub warnings: Vec<String>,
    /// What of the description was taken off the recordings, a sentence; none without such effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken_off: Option<String>,
    /// What was done to the recordings for the torque check.
    #[serde(skip)]
    pub treatment: Treatment,
}

/// Share of the torque unexplained above which a warning says so; [`rig_identify`] uses the same.
const UNEXPLAINED: f64 = 0.3;

/// Checks what `robot` predicts against `recordings`. `progress` is told the share that is done.
///
/// # Errors
/// [`ValidateError`]: nothing to check or to check with, recordings that cannot be prepared. A motion that cannot
/// be simulated is no error but a [`Motion::NotSimulated`] that says why.
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
    // Those of coupled drives follow the joints'.
    let motors = model
        .motors
        .as_ref()
        .map_or(&[][..], |m| m.parameters.as_flattened());
    // Parameters that are zero add nothing to the torque: their columns are not formed.
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

/// Joints of a recording whose torque the description does not explain, or of which no row is left to check.
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

/// What is not given is as it was when the description was identified, where it says so: a model is judged in the band that
/// it was fitted in, and its error is that of `identify` on the same recording. Else it is chosen from the recordings.
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

/// What the description itself gives reason to say.
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
