//! `rig friction-map`: friction as a function of speed, from a sweep of constant speeds.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, Use, recordings, refuse_faults};
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::EffortNeed;
use rig_identify::{FrictionMap, FrictionMapOptions, Options, friction_map, identify};
use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;
use rig_output::{can_take, folder, write_whole};

/// Draws friction over speed from a recording of a friction sweep.
///
/// Gravity and inertia are identified from the recordings given with --data. Each stretch of constant speed in the
/// sweep gives one point. The stretches are found in the recorded reference (ref<k>) or, without one, in the position.
/// The sweep may have another sample rate. Stretches that give no point are listed with the reason.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Recording of an excitation, from which gravity and inertia are identified
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Recording of the friction sweep
    #[arg(long)]
    sweep: PathBuf,
    /// Joint, by name or counted from 1
    #[arg(long, default_value = "1")]
    joint: String,
    /// Draw the map although columns look wrong (sign, unit, ratio, clock, swapped); prints the faults
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

/// Finds a joint by its name or number.
fn joint_of(robot: &Robot, given: &str) -> Result<usize, CommandError> {
    let by_number = || {
        let number = given.parse::<usize>().ok()?.checked_sub(1)?;
        (number < robot.joints.len()).then_some(number)
    };
    robot.joint_index(given).or_else(by_number).ok_or_else(|| {
        let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
        CommandError::Sentence(format!(
            "--joint {given} does not exist: the joints of {} are {}, or 1 to {}.",
            robot.name,
            names.join(", "),
            names.len()
        ))
    })
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join("friction-map.json")
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    can_take(&args.out, &["friction-map.json", "report.html"])?;
    refuse_folder(&args.out, &[], args.force)?;
    let robot = args.robot.load(ui)?;
    let joint = joint_of(&robot, &args.joint)?;
    let mapping = args.columns.mapping()?;
    let read = |paths| Inputs::read_mapped(&robot, paths, EffortNeed::Required, &mapping);
    let training = read(&args.data)?;
    let sweep = read(std::slice::from_ref(&args.sweep))?;
    for warning in training.warnings().chain(sweep.warnings()) {
        ui.warn(&warning);
    }
    refuse_faults(
        &robot,
        &[&training, &sweep],
        (Use::Fit, sweep.strange_references(&robot)?),
        args.even_if_wrong,
        ui,
    )?;
    let identification = identify(
        &robot,
        &recordings(&training.listened()),
        &[],
        &Options::default(),
    )?;
    for source in recordings(&sweep.listened()) {
        let drawn = friction_map(
            &robot,
            &identification,
            source,
            joint,
            FrictionMapOptions::default(),
        );
        if drawn.is_err() {
            // Missing rows may be the reason.
            sweep.heard().iter().for_each(|warning| ui.warn(warning));
        }
        let map = drawn?;
        if !map.doubts.is_empty() && !args.even_if_wrong {
            return Err(CommandError::Implausible(format!(
                "{} Nothing was written; give --even-if-wrong to draw the map in spite of this.",
                map.doubts.join(" ")
            )));
        }
        let mut heard = [training.heard(), sweep.heard(), map.doubts.clone()].concat();
        heard.extend([training.outside(), sweep.outside()].concat());
        heard.extend(map.note.clone());
        for warning in &heard {
            ui.warn(warning);
        }
        let warnings = training.warnings().chain(sweep.warnings()).chain(heard);
        write(args, &robot, &map, warnings.collect(), ui)?;
        print(&map, robot.joints[joint].kind, ui);
    }
    args.report.tell(&args.out.join("report.html"), ui);
    Ok(())
}

/// Writes the map as JSON and as a page into a folder.
///
/// # Errors
/// A file cannot be written.
fn write(
    args: &Args,
    robot: &Robot,
    map: &FrictionMap,
    warnings: Vec<String>,
    ui: &Ui,
) -> Result<(), CommandError> {
    let out = &args.out;
    let context = Context {
        command: ui.command_line(),
        warnings,
        ..Context::default()
    };
    folder(out)?;
    let json = serde_json::to_string_pretty(map).map_err(|error| {
        CommandError::Sentence(format!("The map cannot be written as JSON: {error}."))
    })?;
    write_whole(&out.join("friction-map.json"), (json + "\n").as_bytes())?;
    args.report.write(
        &out.join("report.html"),
        &pages::friction_map(robot, map, &context),
    )?;
    Ok(())
}

/// Prints rejected stretches with the reason (a detail), those that gave points, the friction law and the decision.
fn print(map: &FrictionMap, kind: JointKind, ui: &Ui) {
    let (velocity, torque, viscous) = match kind {
        JointKind::Revolute => ("rad/s", "N·m", "N·m·s/rad"),
        JointKind::Prismatic => ("m/s", "N", "N·s/m"),
    };
    let speeds = map.points.iter().map(|p| p.speed.abs());
    let (slow, fast) = speeds.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    for pass in &map.dropped {
        ui.detail(&format!(
            "left out: {} {velocity} at {:.2} s, {}.",
            format_significant(pass.speed, 3),
            pass.start,
            pass.why
        ));
    }
    ui.say(&format!(
        "{} of {} stretches of constant speed, from {}, give points from {} to {} {velocity}.",
        map.points.len(),
        map.points.len() + map.dropped.len(),
        if map.from_reference {
            "the reference"
        } else {
            "the position (no ref column with such stretches was recorded)"
        },
        format_significant(slow, 3),
        format_significant(fast, 3),
    ));
    let fit = map.stribeck.as_ref().unwrap_or(&map.simple);
    let value = |value: f64, k: usize| {
        let half = fit.half_interval.get(k).copied().unwrap_or(f64::NAN);
        rig_output::format_value(value, half)
    };
    ui.answer(&format!(
        "Coulomb {} {torque}, viscous {} {viscous} (± half the 95 % interval).",
        value(fit.coulomb, 0),
        value(fit.viscous, 1)
    ));
    ui.answer(&map.text);
}
