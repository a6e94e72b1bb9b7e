//! `rig diagnose`: finds the effects that the model lacks.

mod printed;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use rig_shared::effects::Kind;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, recordings, refuse_as_rest, refuse_shared, refuse_twice};
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::pictures::{self, forget};
use super::report_arg::{ReportArg, write_report};
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::prepare::Recording;
use rig_data::prepare::Unburdened;
use rig_data::runs::Run;
use rig_data::{EffortNeed, Mapping};
use rig_diagnose::experiment::FILE;
use rig_diagnose::outcome::{Diagnosis, Verdict};
use rig_diagnose::voltage::diagnose_voltage;
use rig_diagnose::{DiagnoseError, Options, clamped, diagnose, sensor_zeros};
use rig_model::robot::Robot;
use rig_output::{can_take, folder, write_whole};

/// File with the description and the effects that were found.
const MODEL: &str = "model.toml";
/// File with the result for programs.
const DIAGNOSIS: &str = "diagnosis.json";
/// File with the result for people.
const REPORT: &str = "report.html";

/// Finds the physical effects that a model lacks: where prediction and recording disagree, which effect explains it,
/// how much that effect reduces the residual on the hold-out, and when only noise remains.
///
/// Record every motion twice: the difference between the two runs is noise, which no model needs to explain. Give
/// another motion with --holdout: a real effect reduces the residual there, too. Slow motion and reversals show
/// friction; several speeds, positions and loads show the other effects. The report lists the effects that these
/// recordings cannot show, and the experiment that would show each of them.
///
/// If the motor voltage of a single joint was recorded (u1, or duty1 with supply) but no torque and no current, the
/// model runs freely under that voltage and its position is compared instead. If the recording also has ref1 and shows
/// its controller (PID with feed-forward, limited by the supply), the loop is closed; model.toml then holds the
/// controller and the supply.
///
/// Give the best known values in the description: the diagnosis refits them and compares them with the values before.
///
/// Writes model.toml (the description with the effects found and the parameters fitted again, for --robot), diagnosis.json
/// and report.html into the folder given with --out, the figures of what was found as pictures of their own (gap-1.svg,
/// effect-1.svg), and next_experiment.toml where a motion would tell more.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Training recording, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Hold-out recording of another motion, not used in any fit; one or more
    #[arg(long, num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Recording made with the drive off, if torque comes from the motor current: it shows the sensor's offset
    #[arg(long)]
    drive_off: Option<PathBuf>,
    /// Training recording made after all external loads (hoses, cables, springs) were removed from the rig: an effect
    /// that is absent there is an external load; may be given several times
    #[arg(long)]
    pulls_off: Vec<PathBuf>,
    /// Recording made with the joints clamped, with motor voltage and current or torque: it shows a dead zone of the
    /// drive without friction and back-EMF; may be given several times
    #[arg(long)]
    clamped: Vec<PathBuf>,
    /// Effect that the rig cannot have, to be left out of the library; may be given several times. The residual that it
    /// explained then remains, or another effect takes its place
    #[arg(long, value_parser = known)]
    without: Vec<String>,
    /// Fit although recordings look wrong (sign, unit, ratio, clock, swapped columns); the faults are printed first
    #[arg(long)]
    even_if_wrong: bool,
    #[command(flatten)]
    columns: MapArg,
    /// Give the verdict as exit status: 0 nothing-missing, 10 explained, 11 parameter-change, 12 remainder, 13 data-fault
    /// (1 and 2 remain errors)
    #[arg(long)]
    exit_code: bool,
    #[command(flatten)]
    report: ReportArg,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
    /// Seed of the random numbers; the same seed gives the same files
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join(DIAGNOSIS)
    }
}

/// Runs the command; returns the exit status.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<u8, CommandError> {
    can_take(&args.out, &[MODEL, DIAGNOSIS, REPORT, FILE])?;
    refuse_folder(&args.out, &[], args.force)?;
    let description = args.robot.describe(ui)?;
    let robot = description.robot;
    refuse_repeated(args)?;
    // Wrong units do not stop the command: they give a verdict.
    let mapping = args.columns.mapping()?;
    let (training, holdout, workflow) = read(&robot, args, &mapping)?;
    refuse_without_effort(args, &training)?;
    let logs = Logs {
        unburdened: Inputs::read_mapped(&robot, &args.pulls_off, EffortNeed::Required, &mapping)?,
        training,
        holdout,
    };
    let mut warnings = logs.warnings();
    for warning in &warnings {
        ui.warn(warning);
    }
    for inputs in [&logs.training, &logs.holdout] {
        for sentence in inputs.strange_references(&robot)? {
            ui.warn(&format!(
                "{sentence} References are used to find recordings that repeat one motion and, under voltage, to identify the controller."
            ));
        }
    }
    let options = options(&robot, args, description.urdf.is_some(), ui)?;
    let (mut found, model) = logs.diagnosed(&robot, workflow, &options, ui)?;
    let heard = logs.heard();
    for warning in &heard {
        ui.warn(warning);
    }
    warnings.extend(heard);
    if !args.without.is_empty() {
        let names = args.without.join(", ");
        (found.words).push(format!("Left out of the library, as asked: {names}."));
    }
    write_diagnosis(
        &args.out,
        &found,
        &model,
        ui.command_line(),
        warnings,
        args.report.is_markdown(),
    )?;
    printed::print(ui, &found, (&args.out.join(REPORT), args.report));
    Ok(if args.exit_code {
        status(found.verdict)
    } else {
        0
    })
}

/// Returns the exit status of a verdict.
fn status(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::NothingMissing => 0,
        Verdict::Explained => 10,
        Verdict::ParameterChange => 11,
        Verdict::Remainder => 12,
        Verdict::DataFault => 13,
    }
}

/// Refuses recordings that are given twice or for two uses.
fn refuse_repeated(args: &Args) -> Result<(), CommandError> {
    let learnt: Vec<PathBuf> = args.data.iter().chain(&args.pulls_off).cloned().collect();
    refuse_twice(&learnt, "give it once")?;
    refuse_shared(&learnt, &args.holdout)?;
    let moved: Vec<PathBuf> = learnt.iter().chain(&args.holdout).cloned().collect();
    if let Some(path) = &args.drive_off {
        refuse_as_rest(["--drive-off", "the drive off"], path, &moved)?;
    }
    refuse_twice(&args.clamped, "give it once")?;
    for path in &args.clamped {
        refuse_as_rest(["--clamped", "the joints clamped"], path, &moved)?;
    }
    Ok(())
}

/// Refuses recordings for a special use if the training recordings hold only the motor voltage.
fn refuse_without_effort(args: &Args, training: &Inputs) -> Result<(), CommandError> {
    let special = (args.drive_off.iter().map(|path| ("--drive-off", path)))
        .chain(args.pulls_off.iter().map(|path| ("--pulls-off", path)))
        .chain(args.clamped.iter().map(|path| ("--clamped", path)));
    if let (Some((option, path)), false) = (special.into_iter().next(), training.any_effort()) {
        return Err(CommandError::Sentence(format!(
            "{option} {} cannot be used if only the motor voltage of the joint was recorded; leave it out, or also record tau1 or i1 during the motion.",
            path.display()
        )));
    }
    Ok(())
}

/// Options of the diagnosis. `from_urdf`: the robot was read from a URDF file.
fn options(robot: &Robot, args: &Args, from_urdf: bool, ui: &Ui) -> Result<Options, CommandError> {
    Ok(Options {
        even_if_wrong: args.even_if_wrong,
        seed: args.seed,
        sensor_zeros: zeros(robot, args, ui)?,
        clamped: clamps(robot, args, ui)?,
        no_offsets: from_urdf,
        without: (Kind::ALL.iter().copied())
            .filter(|kind| args.without.iter().any(|name| name == kind.about().name))
            .collect(),
        ..Options::default()
    })
}

/// The recordings of motions, by their use.
struct Logs {
    training: Inputs,
    /// Training recordings made without external loads.
    unburdened: Inputs,
    holdout: Inputs,
}

impl Logs {
    fn all(&self) -> [&Inputs; 3] {
        [&self.training, &self.unburdened, &self.holdout]
    }

    /// Warnings from the headers.
    fn warnings(&self) -> Vec<String> {
        (self.all().iter())
            .flat_map(|inputs| inputs.warnings())
            .collect()
    }

    /// Warnings about the rows that were read.
    fn heard(&self) -> Vec<String> {
        (self.all().iter())
            .flat_map(|inputs| inputs.heard())
            .collect()
    }

    /// Runs the diagnosis; its faults name columns as the files do.
    fn diagnosed(
        &self,
        robot: &Robot,
        workflow: Workflow,
        options: &Options,
        ui: &Ui,
    ) -> Result<(Diagnosis, Robot), CommandError> {
        let mut progress = ui.progress("diagnosing", 1000);
        let (listened, free) = (self.training.listened(), self.unburdened.listened());
        let free: Vec<Unburdened> = free.iter().map(|recording| Unburdened(recording)).collect();
        let mut learnt = recordings(&listened);
        learnt.extend(free.iter().map(|recording| recording as &dyn Recording));
        let (mut found, model) = workflow(
            robot,
            &learnt,
            &recordings(&self.holdout.listened()),
            options,
            &mut |share| progress.at((1000.0 * share) as u64),
        )?;
        for fault in &mut found.data_faults {
            for inputs in self.all() {
                inputs.in_its_names(&fault.recording, &mut fault.text);
            }
        }
        Ok((found, model))
    }
}

/// Writes model.toml, diagnosis.json, report.html, the figures and, if there is one, next_experiment.toml into the folder
/// `out`. `command`: what repeats the result, for the report. `warnings`: from the recordings. `markdown`: the report as
/// Markdown, too.
///
/// # Errors
/// Values that cannot be written as a description, or a file that cannot be written.
pub fn write_diagnosis(
    out: &Path,
    found: &Diagnosis,
    model: &Robot,
    command: String,
    warnings: Vec<String>,
    markdown: bool,
) -> Result<(), CommandError> {
    let text = model.to_toml()?;
    let context = Context {
        command,
        identified: Some((MODEL.into(), text.clone())),
        remarks: Vec::new(),
        warnings,
    };
    let page = pages::diagnosis(found, &context);
    let json = serde_json::to_string_pretty(found).map_err(|error| {
        CommandError::Sentence(format!("The result cannot be written as JSON: {error}."))
    })?;
    folder(out)?;
    let next = found.next_experiment.as_ref();
    match next.and_then(|n| n.file.as_ref().zip(n.trajectory.as_ref())) {
        Some((name, motion)) => write_whole(&out.join(name), motion.as_bytes())?,
        None => forget(&out.join(FILE))?,
    }
    write_whole(&out.join(MODEL), text.as_bytes())?;
    write_whole(&out.join(DIAGNOSIS), (json + "\n").as_bytes())?;
    write_report(&out.join(REPORT), &page, markdown)?;
    pictures::write(out, found)
}

/// Parses the name of an effect.
fn known(name: &str) -> Result<String, String> {
    let names: BTreeSet<&str> = Kind::ALL.iter().map(|kind| kind.about().name).collect();
    if names.contains(name) {
        return Ok(name.to_owned());
    }
    let names: Vec<&str> = names.into_iter().collect();
    Err(format!(
        "no effect has that name; the names are {}",
        names.join(", ")
    ))
}

/// A diagnosis by torque or by voltage.
type Workflow = fn(
    &Robot,
    &[&dyn Recording],
    &[&dyn Recording],
    &Options,
    &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DiagnoseError>;

/// Opens the recordings and selects the workflow: a single joint without torque or current is diagnosed by its voltage.
fn read(
    robot: &Robot,
    args: &Args,
    mapping: &Mapping,
) -> Result<(Inputs, Inputs, Workflow), CommandError> {
    if robot.joints.len() == 1 {
        let all = |paths| Inputs::read_mapped(robot, paths, EffortNeed::Optional, mapping);
        let (training, holdout) = (all(&args.data)?, all(&args.holdout)?);
        if !training.any_effort() && !holdout.any_effort() {
            return Ok((training, holdout, diagnose_voltage));
        }
    }
    let all = |paths| Inputs::read_mapped(robot, paths, EffortNeed::Required, mapping);
    let (training, holdout) = (all(&args.data)?, all(&args.holdout)?);
    Ok((training, holdout, diagnose))
}

/// Sensor readings with the drive off, if such a recording was given.
fn zeros(robot: &Robot, args: &Args, ui: &Ui) -> Result<Vec<[f64; 2]>, CommandError> {
    let Some(path) = &args.drive_off else {
        return Ok(Vec::new());
    };
    let mapping = args.columns.mapping()?;
    let path = std::slice::from_ref(path);
    let log = Inputs::read_mapped(robot, path, EffortNeed::Required, &mapping)?;
    let zeros = (recordings(&log.listened()).into_iter())
        .map(sensor_zeros)
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    for warning in log.warnings().chain(log.heard()) {
        ui.warn(&warning);
    }
    Ok(zeros)
}

/// Recordings made with the joints clamped.
fn clamps(robot: &Robot, args: &Args, ui: &Ui) -> Result<Vec<Run>, CommandError> {
    let mapping = args.columns.mapping()?;
    let logs = Inputs::read_mapped(robot, &args.clamped, EffortNeed::Required, &mapping)?;
    let runs = (recordings(&logs.listened()).into_iter())
        .map(clamped)
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    for warning in logs.warnings().chain(logs.heard()) {
        ui.warn(&warning);
    }
    Ok(runs)
}
