//! `rig identify`: estimates parameters and their uncertainty from recordings and a description.

mod impossible;
mod printed;
mod urdf;

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use clap::{Args as ClapArgs, ValueEnum};

pub use self::impossible::Impossible;
use super::error::CommandError;
use super::input::{Inputs, RobotArg, Use, recordings, refuse_faults, refuse_shared, refuse_twice};
use super::link_numbers::followers_note;
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::report_arg::{ReportArg, write_report};
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::EffortNeed;
use rig_data::prepare::{Choice, PrepareOptions};
use rig_identify::{
    Estimator, Identification, Loss, ModelKind, Options, Warning, identified_robot, identify,
};
use rig_model::robot::{Description, MOST_LEAD, Robot};
use rig_output::{can_take, folder, write_whole};

/// File with the description and the identified values.
const TOML: &str = "identified.toml";
/// The same as URDF.
const URDF: &str = "identified.urdf";
/// File with the result for programs.
const JSON: &str = "identification.json";
/// File with the result for people.
const REPORT: &str = "report.html";

/// Equations that are fitted.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Model {
    /// Torque as a function of acceleration, velocity and position
    Differential,
    /// Integrals over windows of time, without acceleration. For one joint: work equals the change of energy; for
    /// several joints: impulse equals the change of momentum, one equation a joint
    Integral,
}

impl From<Model> for ModelKind {
    fn from(model: Model) -> Self {
        match model {
            Model::Differential => Self::Differential,
            Model::Integral => Self::Integral,
        }
    }
}

/// Estimators.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Fit {
    /// Ordinary least squares
    Ols,
    /// Least squares with each joint's rows weighted by its noise
    Weighted,
    /// Weighted least squares in which outliers count less (Huber)
    Robust,
    /// Instrumental variables from the simulated closed loop (IDIM-IV): unbiased by noise in the motion
    Iv,
    /// Fits the torque of the simulated closed loop to the measured torque (DIDIM); needs [joint.controller] and ref<k>
    OutputError,
    /// Total least squares: allows for noise in the torque and in the motion (estimated from its spectrum)
    Tls,
    /// Maximum likelihood: residuals are autoregressive in time and correlated between joints
    Ml,
    /// Ridge regression towards the description's values
    Ridge,
    /// Weighted and physically consistent: each link is a possible body, friction and drive inertia are not negative
    Consistent,
}

impl From<Fit> for Estimator {
    fn from(fit: Fit) -> Self {
        match fit {
            Fit::Ols => Self::Ols,
            Fit::Weighted => Self::Weighted,
            Fit::Robust => Self::Robust,
            Fit::Iv => Self::Iv,
            Fit::OutputError => Self::OutputError,
            Fit::Tls => Self::Tls,
            Fit::Ml => Self::Ml,
            Fit::Ridge => Self::Ridge,
            Fit::Consistent => Self::Consistent,
        }
    }
}

/// Estimators to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Compare {
    /// weighted, iv and consistent
    Auto,
    /// All estimators that the recordings and the description allow
    All,
    /// No comparison
    None,
}

impl Compare {
    /// Returns the estimators to compare.
    pub fn list(self) -> Vec<Estimator> {
        match self {
            Self::All => Estimator::ALL.to_vec(),
            Self::Auto => vec![Estimator::Weighted, Estimator::Iv, Estimator::Consistent],
            Self::None => Vec::new(),
        }
    }
}

/// Parses a setting: `auto` (chosen from the data) or a number.
pub(super) fn auto<T: std::str::FromStr>(text: &str) -> Result<Choice<T>, String> {
    if text == "auto" {
        return Ok(Choice::Auto);
    }
    text.parse()
        .map(Choice::Fixed)
        .map_err(|_| format!("\"{text}\" is neither a number nor \"auto\""))
}

/// Parses a speed threshold: `auto`, or a finite number of 0 or more.
pub(super) fn speed(text: &str) -> Result<Choice<f64>, String> {
    match auto::<f64>(text)? {
        Choice::Fixed(speed) if !(speed >= 0.0 && speed.is_finite()) => Err(format!(
            "{text} is not a valid speed; 0 keeps all rows, and a number above it leaves out slower rows"
        )),
        choice => Ok(choice),
    }
}

/// Parses a torque lead, within the limits of a robot description.
pub(super) fn lead(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(lead) if lead.abs() <= MOST_LEAD => Ok(lead),
        _ => Err(format!(
            "\"{text}\" is not a valid lead; it must lie between -{MOST_LEAD} and {MOST_LEAD} s"
        )),
    }
}

/// Identifies the parameters of a robot from recordings.
///
/// Writes identified.toml (the description with the identified values), identification.json and report.html into the
/// folder given with --out. Writes identified.urdf, too, if a full set of parameters was found: a copy of the given
/// URDF with new values, or a new file for a TOML description.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Training recording, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Hold-out recording, not used in the fit; one or more
    #[arg(long, num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Equations that are fitted
    #[arg(long, value_enum, default_value = "differential")]
    model: Model,
    /// Estimator [default: weighted; for several joints consistent]
    #[arg(long, value_enum)]
    estimator: Option<Fit>,
    /// Estimators to compare by cross-validation (each predicts stretches of time left out of its fit); recommends one
    #[arg(long, value_enum, default_value = "auto")]
    compare: Compare,
    /// Weight of each --data, in the order of the recordings; 1 if not given
    #[arg(long)]
    weight: Vec<f64>,
    /// Relative uncertainty of the description's inertial values (0.1 = 10 %). It is used by iv, output-error, ridge
    /// and consistent, and for the links in the written files if there are several joints [default: ridge: the value
    /// that makes the data most likely; else 2]
    #[arg(long)]
    prior_uncertainty: Option<f64>,
    /// Fit the description only: do not look for springs, torque ripple or a tilted base
    #[arg(long)]
    as_described: bool,
    /// Cut-off of the zero-phase low-pass on the position, Hz, or "auto": chosen from the data
    #[arg(long, default_value = "auto", value_parser = auto::<f64>)]
    cutoff: Choice<f64>,
    /// Keep every n-th row after the parallel low-pass, or "auto"
    #[arg(long, default_value = "auto", value_parser = auto::<usize>)]
    decimation: Choice<usize>,
    /// Leave out rows slower than this, rad/s or m/s, where the sign of friction is uncertain; 0 keeps all, or "auto"
    #[arg(long, default_value = "auto", value_parser = speed)]
    min_speed: Choice<f64>,
    /// Length of the windows of the integral model, s [default: chosen from the motion]
    #[arg(long)]
    window: Option<f64>,
    /// Torque lead: time by which a recorded torque acts later, s (half a sample for a command held until the next one)
    #[arg(long, default_value_t = 0.0, value_parser = lead)]
    torque_lead: f64,
    /// Use the recorded qd<k> (and qdd<k>) instead of deriving them from the filtered position
    #[arg(long)]
    measured_derivatives: bool,
    /// Seed of the random states from which the base parameters are computed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fit although columns of the recordings look wrong (sign, unit, ratio, clock, swapped); prints the faults
    #[arg(long)]
    even_if_wrong: bool,
    #[command(flatten)]
    columns: MapArg,
    #[command(flatten)]
    report: ReportArg,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
}

impl Args {
    fn options(&self, robot: &Robot) -> Options {
        Options {
            model: self.model.into(),
            estimator: self
                .estimator
                .map_or_else(|| Estimator::for_robot(robot), Into::into),
            loss: Loss::default(),
            prepare: PrepareOptions {
                cutoff: self.cutoff,
                decimation: self.decimation,
                speed_threshold: self.min_speed,
                torque_lead: self.torque_lead,
                measured_derivatives: self.measured_derivatives,
                ..PrepareOptions::default()
            },
            window: self.window,
            seed: self.seed,
            recording_weights: self.weight.clone(),
            prior_uncertainty: self.prior_uncertainty,
            compare: self.compare.list(),
            look_beyond: !self.as_described,
        }
    }
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join(JSON)
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    can_take(&args.out, &[TOML, URDF, JSON, REPORT])?;
    refuse_folder(&args.out, &[], args.force)?;
    let description = args.robot.describe(ui)?;
    let robot = &description.robot;
    let mapping = args.columns.mapping()?;
    let read = |paths| Inputs::read_mapped(robot, paths, EffortNeed::Required, &mapping);
    let (training, holdout) = (read(&args.data)?, read(&args.holdout)?);
    let warnings: Vec<String> = training.warnings().chain(holdout.warnings()).collect();
    for warning in &warnings {
        ui.warn(warning);
    }
    refuse_repeated(args)?;
    let wrong = strange_columns(robot, args, [&training, &holdout], ui)?;
    refuse_faults(
        robot,
        &[&training, &holdout],
        (Use::Fit, wrong),
        args.even_if_wrong,
        ui,
    )?;
    let found = identified(robot, args, [&training, &holdout], ui)?;
    folder(&args.out)?;
    let said = write_identification(
        &args.out,
        &description,
        &found,
        ui.command_line(),
        warnings,
        args.report.is_markdown(),
    )?;
    remarks_of_urdf(&said, ui);
    if let Some(note) = followers_note(&description.robot) {
        ui.note(&note);
    }
    printed::print(ui, robot, &found);
    args.report.tell(&args.out.join(REPORT), ui);
    Ok(())
}

/// Refuses recordings that are given twice or for two uses, and weights without a recording.
fn refuse_repeated(args: &Args) -> Result<(), CommandError> {
    refuse_shared(&args.data, &args.holdout)?;
    refuse_twice(
        &args.data,
        "give it once, and use --weight if it should count more",
    )?;
    if args.weight.len() > args.data.len() {
        return Err(CommandError::Sentence(format!(
            "--weight is given {} times but --data {} times; give one weight at most for each recording, in the same order.",
            args.weight.len(),
            args.data.len()
        )));
    }
    Ok(())
}

/// Returns sentences about references and rates that cannot be right and are used. Prints those about references that
/// are not used.
fn strange_columns(
    robot: &Robot,
    args: &Args,
    [training, holdout]: [&Inputs; 2],
    ui: &Ui,
) -> Result<Vec<String>, CommandError> {
    let mut wrong = Vec::new();
    let strange = training.strange_references(robot)?;
    if matches!(args.estimator, Some(Fit::OutputError)) {
        wrong.extend(strange);
    } else {
        for sentence in strange {
            ui.note(&format!(
                "{sentence} They are not used: --estimator iv and the comparison use the smoothed position instead; only output-error needs references."
            ));
        }
    }
    if args.measured_derivatives {
        for inputs in [training, holdout] {
            wrong.extend(inputs.strange_rates(robot)?);
        }
    }
    Ok(wrong)
}

/// Identifies the parameters, and refuses values that no robot can have.
fn identified(
    robot: &Robot,
    args: &Args,
    [training, holdout]: [&Inputs; 2],
    ui: &Ui,
) -> Result<Identification, CommandError> {
    // Three passes over the training data, two over the hold-out: see `identify`.
    let progress =
        RefCell::new(ui.progress("identifying", 3 * training.bytes() + 2 * holdout.bytes()));
    let mut found = identify(
        robot,
        &recordings(&training.watched(&progress)),
        &recordings(&holdout.watched(&progress)),
        &args.options(robot),
    )?;
    drop(progress);
    for inputs in [training, holdout] {
        let told = inputs.heard().into_iter().chain(inputs.outside());
        found.warnings.extend(told.map(Warning::from));
    }
    let Impossible { refused, doubtful } = Impossible::of(robot, &found);
    if !args.even_if_wrong && !refused.is_empty() {
        return Err(CommandError::Implausible(format!(
            "{} Nothing was written; give --even-if-wrong to write the files in spite of this.",
            refused.join(" ")
        )));
    }
    let first = refused.into_iter().chain(doubtful);
    (found.warnings).splice(0..0, first.map(Warning::from));
    Ok(found)
}

/// Writes identified.toml, identification.json, report.html and, with a full set of parameters, identified.urdf into
/// the folder `out`. Returns the remarks on the written URDF. `command`: what repeats the result, for the report.
/// `warnings`: from the recordings. `markdown`: the report as Markdown, too.
///
/// # Errors
/// Values that cannot be written as a description, or a file that cannot be written.
pub fn write_identification(
    out: &Path,
    description: &Description,
    found: &Identification,
    command: String,
    warnings: Vec<String>,
    markdown: bool,
) -> Result<Vec<String>, CommandError> {
    let robot = &description.robot;
    let (identified, mut remarks) = identified_robot(robot, found);
    let text = identified.to_toml()?;
    let urdf = match urdf::of(description, found, &identified) {
        Some(Ok(urdf)) => Some(urdf),
        Some(Err(error)) => {
            remarks.push(format!("No {URDF} was written: {error}"));
            None
        }
        None => None,
    };
    let (urdf, said) = urdf.map_or((None, Vec::new()), |urdf| (Some(urdf.text), urdf.remarks));
    remarks.extend(said.iter().map(|sentence| format!("{URDF}: {sentence}")));
    let context = Context {
        command,
        identified: Some((TOML.into(), text.clone())),
        remarks,
        warnings,
    };
    let page = pages::identification(robot, found, &context);
    let json = serde_json::to_string_pretty(found).map_err(|error| {
        CommandError::Sentence(format!("The result cannot be written as JSON: {error}."))
    })?;
    write_whole(&out.join(TOML), text.as_bytes())?;
    if let Some(urdf) = urdf {
        write_whole(&out.join(URDF), urdf.as_bytes())?;
    }
    write_whole(&out.join(JSON), (json + "\n").as_bytes())?;
    write_report(&out.join(REPORT), &page, markdown)?;
    Ok(said)
}

/// Says what the identified URDF cannot hold: one remark, or how many there are.
fn remarks_of_urdf(remarks: &[String], ui: &Ui) {
    if remarks.len() > 1 && !ui.is_verbose() {
        ui.say(&format!(
            "{URDF}: {} remarks on what it cannot hold: the report and --verbose list them",
            remarks.len()
        ));
        return;
    }
    for sentence in remarks {
        ui.say(&format!("{URDF}: {sentence}"));
    }
}
