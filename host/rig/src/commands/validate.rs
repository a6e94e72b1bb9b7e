//! `rig validate`: compares a description with recordings that were not used to make it.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use serde::Serialize;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, Use, recordings, refuse_faults};
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::{EffortNeed, Mapping};
use rig_diagnose::voltage::{DrivenBy, FreeRun, controller_terms, validate_voltage};
use rig_model::robot::Robot;
use rig_output::format_significant;
use rig_output::{can_take, folder, write_whole};
use rig_report::{self, Document};
use rig_validate::{Motion, Options, Validation, validate};

/// Predicts torque and simulates motion on data not used before.
///
/// If the description has a [joint.controller] for every joint, the simulated closed loop follows the recorded
/// references. Otherwise the recorded torque drives the model, and a controller corrects the deviation from the
/// recorded motion, as in `rig diagnose`.
///
/// If the motor voltage of a single joint was recorded (u1, or duty1 with supply) but no torque and no current, the
/// model runs freely under voltage instead: in the closed loop of the controller that the recording shows, with the
/// supply of the description, or under the recorded voltage. RMS and mean absolute error of the position are printed.
///
/// Writes validation.json and report.html into the folder given with --out.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Recording to compare with, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Compare although columns of the recordings look wrong (sign, unit, ratio, clock, swapped); prints the faults
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
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join("validation.json")
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    can_take(&args.out, &["validation.json", "report.html"])?;
    refuse_folder(&args.out, &[], args.force)?;
    let robot = args.robot.load(ui)?;
    let (inputs, voltage) = opened(&robot, &args.data, &args.columns.mapping()?)?;
    for warning in inputs.warnings() {
        ui.warn(&warning);
    }
    if voltage {
        for sentence in inputs.strange_references(&robot)? {
            ui.warn(&format!(
                "{sentence} These references were used to identify the controller that moved the joint."
            ));
        }
        refuse_faults(
            &robot,
            &[&inputs],
            (Use::Compare, Vec::new()),
            args.even_if_wrong,
            ui,
        )?;
        return under_voltage(args, ui, &robot, &inputs);
    }
    refuse_faults(
        &robot,
        &[&inputs],
        (Use::Compare, Vec::new()),
        args.even_if_wrong,
        ui,
    )?;
    if let Some(fuller) = args.robot.fuller() {
        ui.warn(&fuller);
    }
    let mut progress = ui.progress("validating", 1000);
    let mut validation = validate(
        &robot,
        &recordings(&inputs.listened()),
        &Options::default(),
        &mut |share| {
            progress.at((1000.0 * share) as u64);
        },
    )?;
    drop(progress);
    validation.warnings.extend(inputs.heard());
    let context = Context {
        command: ui.command_line(),
        warnings: inputs.warnings().collect(),
        ..Context::default()
    };
    write(
        args,
        &validation,
        &pages::validation(&robot, &validation, &context),
    )?;
    say(args, ui, &summary(&validation), &validation.warnings);
    Ok(())
}

/// Opens the recordings. Returns true with them if the robot has one joint and only its motor voltage was recorded.
fn opened(
    robot: &Robot,
    paths: &[PathBuf],
    mapping: &Mapping,
) -> Result<(Inputs, bool), CommandError> {
    let read = |need| Inputs::read_mapped(robot, paths, need, mapping);
    if robot.joints.len() != 1 {
        return Ok((read(EffortNeed::Required)?, false));
    }
    let inputs = read(EffortNeed::Optional)?;
    if inputs.all_effort() {
        return Ok((inputs, false));
    }
    match !inputs.any_effort() && inputs.any_voltage() {
        true => Ok((inputs, true)),
        // This call fails with an error that names the missing column and the file.
        false => Ok((read(EffortNeed::Required)?, false)),
    }
}

/// Prints the warnings, the answer and the path of the report.
fn say(args: &Args, ui: &Ui, answer: &[String], warnings: &[String]) {
    for warning in warnings {
        ui.warn(warning);
    }
    for line in answer {
        ui.answer(line);
    }
    args.report.tell(&args.out.join("report.html"), ui);
}

/// Writes the result as JSON and as a page into a folder.
fn write<T: Serialize>(args: &Args, found: &T, page: &Document) -> Result<(), CommandError> {
    let out = &args.out;
    folder(out)?;
    let json = serde_json::to_string_pretty(found).map_err(|error| {
        CommandError::Sentence(format!("The result cannot be written as JSON: {error}."))
    })?;
    write_whole(&out.join("validation.json"), (json + "\n").as_bytes())?;
    args.report.write(&out.join("report.html"), page)
}

/// Validates a joint whose motor voltage was recorded without torque or current.
fn under_voltage(args: &Args, ui: &Ui, robot: &Robot, inputs: &Inputs) -> Result<(), CommandError> {
    let mut found = validate_voltage(robot, &recordings(&inputs.listened()))?;
    found.warnings.extend(inputs.heard());
    let context = Context {
        command: ui.command_line(),
        warnings: inputs.warnings().collect(),
        ..Context::default()
    };
    write(args, &found, &pages::validation_voltage(&found, &context))?;
    let each = found.recordings.iter().map(|checked| {
        let moved = moved(&checked.motion, Some(&checked.driven), &found.position_unit);
        format!("{}, {}: {moved}", checked.recording, found.joint)
    });
    let all = moved(&found.motion, None, &found.position_unit);
    let all = format!("all recordings, {}: {all}", found.joint);
    let answer: Vec<String> = each.chain([all]).collect();
    say(args, ui, &answer, &found.warnings);
    Ok(())
}

/// Describes the error of a free run and its input.
fn moved(run: &FreeRun, driven: Option<&DrivenBy>, unit: &str) -> String {
    let how = match driven {
        Some(DrivenBy::Controller { controller }) => format!(
            " in the closed loop of the controller that the recording shows ({})",
            controller_terms(controller, unit)
        ),
        Some(DrivenBy::RecordedVoltage) => " under the recorded voltage".to_owned(),
        None => String::new(),
    };
    match run {
        FreeRun::Followed {
            rms, mean_absolute, ..
        } => format!(
            "simulated position{how}: error {} {unit} rms, {} {unit} mean absolute",
            format_significant(*rms, 4),
            format_significant(*mean_absolute, 4)
        ),
        FreeRun::Diverged { time, .. } => {
            format!("simulated position{how}: diverges at {time:.2} s; a remark says why")
        }
    }
}

/// Short result: for each joint and recording one line on the torque and one on the motion.
fn summary(validation: &Validation) -> Vec<String> {
    let mut lines = Vec::new();
    for checked in &validation.recordings {
        for torque in &checked.torque {
            if torque.residual.rows == 0 {
                // A remark says why.
                continue;
            }
            lines.push(format!(
                "{}, {}: torque error {} {} rms, {:.2} % of the torque",
                checked.recording,
                torque.joint,
                format_significant(torque.residual.rms, 4),
                torque.unit,
                100.0 * torque.residual.relative_error
            ));
        }
        match &checked.motion {
            // A remark says why.
            Motion::NotSimulated { .. } => {}
            Motion::Simulated {
                joints,
                uncontrolled,
                ..
            } => lines.extend(joints.iter().map(|joint| {
                format!(
                    "{}, {}: position simulated {}: error {} {} rms, {:.2} % of the tracking error of {} {}; torque error {} {} rms",
                    checked.recording,
                    joint.joint,
                    if uncontrolled.is_empty() {
                        "in closed loop"
                    } else {
                        "under the recorded torque"
                    },
                    format_significant(joint.position_rms_error, 4),
                    joint.position_unit,
                    100.0 * joint.tracking_relative_error,
                    format_significant(joint.tracking_rms, 4),
                    joint.position_unit,
                    format_significant(joint.torque_rms_error, 4),
                    joint.torque_unit
                )
            })),
        }
    }
    lines
}
