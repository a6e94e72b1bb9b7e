//! `rig diagnose`: what the model lacks.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use rig_shared::effects::Kind;

use super::error::CommandError;
use super::input::{
    Inputs, RobotArg, command_line, recordings, refuse_as_rest, refuse_shared, refuse_twice,
};
use super::overwrite::refuse_folder;
use super::pictures::{self, forget};
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::EffortNeed;
use rig_data::prepare::Recording;
use rig_data::prepare::Unburdened;
use rig_data::runs::Run;
use rig_diagnose::experiment::FILE;
use rig_diagnose::outcome::{DataFault, Diagnosis, Step, Verdict};
use rig_diagnose::voltage::diagnose_voltage;
use rig_diagnose::{DiagnoseError, Options, clamped, diagnose, sensor_zeros};
use rig_model::robot::Robot;
use rig_output::format_significant;
use rig_output::{can_take, folder, write_whole};

/// The description with what was found.
const MODEL: &str = "model.toml";
/// The result for programs.
const DIAGNOSIS: &str = "diagnosis.json";
/// The result for people.
const REPORT: &str = "report.html";

/// Says what the model lacks: where prediction and recording disagree, which physical effect is missing, what it takes
/// away on data held back, and when there is nothing left to find.
///
/// Record every motion twice: what differs between the two runs is noise, and no model needs to explain it. Hold one other
/// motion back with --holdout: an effect that is really there improves that one, too. Slow motion and reversals show
/// friction; several speeds, positions and loads show the rest. What the recordings cannot show is listed, with the
/// experiment that would show it.
///
/// Where one joint's motor voltage was recorded (u1, or duty1 with supply) and neither torque nor current, the model runs
/// freely under that voltage and its position is compared instead. Where the recording has ref1 and shows its controller (PID with
/// feed-forward, within the supply), the loop is closed; model.toml has the controller and the supply.
///
/// The description should be what is believed of the robot: its values are fitted again, and are compared with what they
/// were.
///
/// Writes model.toml (the description with the effects found and the parameters fitted again, for --robot), diagnosis.json
/// and report.html into the folder given with --out, the figures of what was found as pictures of their own (gap-1.svg,
/// effect-1.svg), and next_experiment.toml where a motion would tell more.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Recording to learn from, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Recording to judge by, of another motion, not used in any fit; one or more
    #[arg(long, num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Recording made with the drive off, where torque is measured by the motor's current: what the sensor reads there is its own
    #[arg(long)]
    drive_off: Option<PathBuf>,
    /// Recording to learn from of the rig with everything taken off that could pull on its joints (hoses, cables, springs): what
    /// is gone there comes from outside; may be given several times
    #[arg(long)]
    pulls_off: Vec<PathBuf>,
    /// Recording with the joints clamped, motor voltage beside current or torque: a dead zone of the drive shows there without friction
    /// and back-EMF; may be given several times
    #[arg(long)]
    clamped: Vec<PathBuf>,
    /// Effect to leave out of the library, as one that the rig cannot have; may be given several times. What it explained is then
    /// left, or another name stands in for it
    #[arg(long, value_parser = known)]
    without: Vec<String>,
    /// Fit although recordings look wrong (sign, unit, ratio, clock, swapped columns); what looks wrong is said first
    #[arg(long)]
    even_if_wrong: bool,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder holds
    #[arg(long)]
    force: bool,
    /// Seed of whatever is drawn at random; the same seed gives the same files
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs the command.
///
/// # Errors
/// A sentence naming the file, line or value at fault.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    can_take(&args.out, &[MODEL, DIAGNOSIS, REPORT, FILE])?;
    refuse_folder(&args.out, &[], args.force)?;
    let description = args.robot.describe(ui)?;
    let robot = description.robot;
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
    // Units that look wrong are no reason to stop here: they are a verdict.
    let (training, holdout, workflow) = read(&robot, args)?;
    let special = (args.drive_off.iter().map(|path| ("--drive-off", path)))
        .chain(args.pulls_off.iter().map(|path| ("--pulls-off", path)))
        .chain(args.clamped.iter().map(|path| ("--clamped", path)));
    if let (Some((option, path)), false) = (special.into_iter().next(), training.any_effort()) {
        return Err(CommandError::Sentence(format!(
            "{option} {} says nothing where a joint goes by its voltage alone; leave it out, or record tau1 or i1 in motion too.",
            path.display()
        )));
    }
    let unburdened = Inputs::read(&robot, &args.pulls_off)?;
    let all = [&training, &unburdened, &holdout];
    let warnings: Vec<String> = all.iter().flat_map(|inputs| inputs.warnings()).collect();
    for warning in &warnings {
        ui.remark(warning);
    }
    for inputs in [&training, &holdout] {
        for sentence in inputs.strange_references(&robot)? {
            ui.remark(&format!(
                "{sentence} References tell which recordings repeat one motion, and under voltage what the controller did."
            ));
        }
    }
    let options = Options {
        even_if_wrong: args.even_if_wrong,
        seed: args.seed,
        sensor_zeros: zeros(&robot, args, ui)?,
        clamped: clamps(&robot, args, ui)?,
        no_offsets: description.urdf.is_some(),
        without: (Kind::ALL.iter().copied())
            .filter(|kind| args.without.iter().any(|name| name == kind.about().name))
            .collect(),
        ..Options::default()
    };
    let mut progress = ui.progress("diagnosing", 1000);
    let (listened, free) = (training.listened(), unburdened.listened());
    let free: Vec<Unburdened> = free.iter().map(|recording| Unburdened(recording)).collect();
    let mut learnt = recordings(&listened);
    learnt.extend(free.iter().map(|recording| recording as &dyn Recording));
    let (mut found, model) = workflow(
        &robot,
        &learnt,
        &recordings(&holdout.listened()),
        &options,
        &mut |share| progress.at((1000.0 * share) as u64),
    )?;
    drop(progress);
    for fault in &mut found.data_faults {
        for inputs in all {
            inputs.in_its_names(&fault.recording, &mut fault.text);
        }
    }
    let heard: Vec<String> = all.iter().flat_map(|inputs| inputs.heard()).collect();
    for warning in &heard {
        ui.remark(warning);
    }
    if !args.without.is_empty() {
        let names = args.without.join(", ");
        (found.words).push(format!("Left out of the library, as asked: {names}."));
    }
    let text = model.to_toml()?;
    let context = Context {
        command: command_line(),
        identified: Some((MODEL.into(), text.clone())),
        remarks: Vec::new(),
        warnings: warnings.into_iter().chain(heard).collect(),
    };
    let page = rig_report::render(&pages::diagnosis(&found, &context))?;
    let json = serde_json::to_string_pretty(&found).map_err(|error| {
        CommandError::Sentence(format!("The result cannot be written as JSON: {error}."))
    })?;
    folder(&args.out)?;
    let next = found.next_experiment.as_ref();
    match next.and_then(|n| n.file.as_ref().zip(n.trajectory.as_ref())) {
        Some((name, motion)) => write_whole(&args.out.join(name), motion.as_bytes())?,
        None => forget(&args.out.join(FILE))?,
    }
    write_whole(&args.out.join(MODEL), text.as_bytes())?;
    write_whole(&args.out.join(DIAGNOSIS), (json + "\n").as_bytes())?;
    write_whole(&args.out.join(REPORT), page.as_bytes())?;
    pictures::write(&args.out, &found)?;
    print(ui, &found, &args.out);
    Ok(())
}

/// The name of an effect.
fn known(name: &str) -> Result<String, String> {
    let names: BTreeSet<&str> = Kind::ALL.iter().map(|kind| kind.about().name).collect();
    if names.contains(name) {
        return Ok(name.to_owned());
    }
    let names: Vec<&str> = names.into_iter().collect();
    Err(format!(
        "no effect has that name; there are {}",
        names.join(", ")
    ))
}

/// One of the two ways from recordings to a verdict.
type Workflow = fn(
    &Robot,
    &[&dyn Recording],
    &[&dyn Recording],
    &Options,
    &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DiagnoseError>;

/// The recordings, and how they are diagnosed: one joint without torque or current goes by its voltage.
fn read(robot: &Robot, args: &Args) -> Result<(Inputs, Inputs, Workflow), CommandError> {
    if robot.joints.len() == 1 {
        let all = |paths| Inputs::read_with(robot, paths, EffortNeed::Optional);
        let (training, holdout) = (all(&args.data)?, all(&args.holdout)?);
        if !training.any_effort() && !holdout.any_effort() {
            return Ok((training, holdout, diagnose_voltage));
        }
    }
    let training = Inputs::read(robot, &args.data)?;
    let holdout = Inputs::read(robot, &args.holdout)?;
    Ok((training, holdout, diagnose))
}

/// What the sensors read with the drive off, where that was recorded.
fn zeros(robot: &Robot, args: &Args, ui: &Ui) -> Result<Vec<[f64; 2]>, CommandError> {
    let Some(path) = &args.drive_off else {
        return Ok(Vec::new());
    };
    let log = Inputs::read(robot, std::slice::from_ref(path))?;
    let zeros = (recordings(&log.listened()).into_iter())
        .map(sensor_zeros)
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    for warning in log.warnings().chain(log.heard()) {
        ui.remark(&warning);
    }
    Ok(zeros)
}

/// What was recorded with the joints clamped.
fn clamps(robot: &Robot, args: &Args, ui: &Ui) -> Result<Vec<Run>, CommandError> {
    let logs = Inputs::read(robot, &args.clamped)?;
    let runs = (recordings(&logs.listened()).into_iter())
        .map(clamped)
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    for warning in logs.warnings().chain(logs.heard()) {
        ui.remark(&warning);
    }
    Ok(runs)
}

/// The result at a glance.
fn print(ui: &Ui, found: &Diagnosis, out: &Path) {
    let lines = summary(found);
    for fault in &found.data_faults {
        ui.remark(&match fault.recording.as_str() {
            recording if fault.text.contains(recording) => fault.text.clone(),
            recording => format!("{recording}: {}", fault.text),
        });
    }
    for line in lines {
        ui.say(&line);
    }
    if found.verdict == Verdict::DataFault {
        let way_on = match found.data_faults.iter().all(DataFault::leaves_rows) {
            true => " --even-if-wrong fits all the same.",
            false => "",
        };
        ui.remark(&format!(
            "nothing was fitted; model.toml is the description as it was given.{way_on}"
        ));
    }
    ui.say(&format!("report: {}", out.join(REPORT).display()));
}

/// First what was asked for, then everything else that the diagnosis has to say.
fn summary(found: &Diagnosis) -> Vec<String> {
    let mut lines = vec![format!("verdict: {}", pages::verdict(found.verdict))];
    let (first, besides) = found.words.split_at(found.words.len().min(1));
    lines.extend(first.iter().cloned());
    let of_joint = found.waterfall.len() > 1;
    for (k, step) in found.steps.iter().enumerate() {
        lines.push(effect(k + 1, step, of_joint));
        lines.extend(step.parameters.iter().map(|(name, value)| {
            let unit = match value.unit.as_str() {
                "1" => String::new(),
                unit => format!(" {}", rig_output::format_unit(unit)),
            };
            format!("    {name} = {}", value.said(&unit))
        }));
    }
    if let Some(share) = found.gap_closed {
        let on = if found.steps.iter().any(|step| step.holdout_rms.is_some()) {
            "on the hold-out"
        } else {
            "on the training data; none were held back"
        };
        let refit = (found.closed_by_effects()).map_or(String::new(), |own| {
            format!(
                ", from the description as it stands; of what fitting it again leaves, the effects close {} %",
                format_significant(100.0 * own, 3)
            )
        });
        lines.push(format!(
            "gap closed: {} %, {on}{refit}",
            format_significant(100.0 * share, 3)
        ));
    }
    if let Some(remainder) = &found.remainder {
        lines.push(format!("left: {}", remainder.text));
    }
    if let Some(next) = &found.next_experiment {
        lines.push(match (next.separates.as_slice(), &next.file) {
            // Nothing is open for it: whoever wants to know has the report.
            ([one], Some(file)) => {
                format!("next: {file} would make {one} testable; the report says how")
            }
            _ => format!("next: {}", next.text),
        });
    }
    if !besides.is_empty() {
        lines.push("besides:".into());
        lines.extend(besides.iter().map(|sentence| format!("  - {sentence}")));
    }
    lines
}

/// `of_joint` where there are several joints, each with a gap of its own.
fn effect(number: usize, step: &Step, of_joint: bool) -> String {
    let law = step
        .law
        .as_ref()
        .map_or(String::new(), |law| format!(" ({law})"));
    let rivals: Vec<&str> = step
        .set
        .iter()
        .filter(|name| **name != step.effect)
        .map(String::as_str)
        .collect();
    let open = if rivals.is_empty() {
        String::new()
    } else {
        format!("; these data support as well: {}", rivals.join(", "))
    };
    format!(
        "{number}. {}{law} at joint {}, {}{open}",
        step.effect,
        step.joint,
        match (0.0..=1.0).contains(&step.gap_closed) {
            true => format!(
                "{} of the gap {}before it",
                step.fall(),
                if of_joint { "of that joint " } else { "" }
            ),
            false => format!("residual {} RMS", step.fall()),
        },
    )
}

#[cfg(test)]
mod tests;
