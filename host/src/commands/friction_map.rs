//! `rig friction-map`: friction over speed, from a sweep of constant speeds.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, command_line, recordings};
use super::ui::Ui;
use crate::files::{folder, write_whole};
use crate::identify::{FrictionMapOptions, Options, friction_map, identify};
use crate::pages::{self, Context};
use crate::report;

/// Draws friction over speed from a recording of a friction sweep.
///
/// Gravity and inertia are taken from an identification on the recordings given with --data; the sweep's
/// stretches of constant speed give one point each.
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
    /// Joint, counted from 1
    #[arg(long, default_value_t = 1)]
    joint: usize,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A sentence naming the file, line or value at fault.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let robot = args.robot.load(ui)?;
    let training = Inputs::open(&robot, &args.data)?;
    let sweep = Inputs::open(&robot, std::slice::from_ref(&args.sweep))?;
    for warning in training.warnings().chain(sweep.warnings()) {
        ui.remark(&warning);
    }
    let Some(joint) = args
        .joint
        .checked_sub(1)
        .filter(|joint| *joint < robot.joints.len())
    else {
        return Err(CommandError::Sentence(format!(
            "--joint {} does not exist: {} has {} joints, counted from 1.",
            args.joint,
            robot.name,
            robot.joints.len()
        )));
    };
    let identification = identify(
        &robot,
        &recordings(&training.listened()),
        &[],
        &Options::default(),
    )?;
    for source in recordings(&sweep.listened()) {
        let map = friction_map(
            &robot,
            &identification,
            source,
            joint,
            FrictionMapOptions::default(),
        )?;
        let heard = [training.heard(), sweep.heard()].concat();
        for warning in &heard {
            ui.remark(warning);
        }
        let context = Context {
            command: command_line(),
            warnings: (training.warnings().chain(sweep.warnings()))
                .chain(heard)
                .collect(),
            ..Context::default()
        };
        folder(&args.out)?;
        let json = serde_json::to_string_pretty(&map).map_err(|error| {
            CommandError::Sentence(format!("The map cannot be written as JSON: {error}."))
        })?;
        write_whole(
            &args.out.join("friction-map.json"),
            (json + "\n").as_bytes(),
        )?;
        report::write(
            &args.out.join("report.html"),
            &pages::friction_map(&robot, &map, &context),
        )?;
        ui.say(&map.text);
    }
    ui.say(&format!(
        "report: {}",
        args.out.join("report.html").display()
    ));
    Ok(())
}
