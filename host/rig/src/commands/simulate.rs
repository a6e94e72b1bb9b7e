//! `rig simulate`: simulates the robot on a trajectory and writes a recording.

use std::path::PathBuf;

use super::error::CommandError;
use super::input::{described, real};
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_diagnose::voltage::replay_voltage;
use rig_excite::{Noise, load_reference, replay};
use rig_model::robot::Robot;

/// Simulates the robot following a trajectory, with its own friction, drives and controller.
///
/// Writes a recording with the column t and the columns q, qd, tau and ref for each joint. The other commands read it
/// like a recording of the real robot. The same seed gives the same file. The controllers act at every step of the
/// simulation, 0.25 ms at most, independently of the rate of the recording.
///
/// If the description has a single joint with a [joint.voltage_controller], as `rig diagnose` writes it for recordings
/// of a motor voltage, that controller closes the loop. The recording then has the columns t, q1, qd1, u1, supply and
/// ref1.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Robot description (.toml or .urdf) with inertia and friction
    #[arg(long)]
    pub(crate) robot: PathBuf,
    /// Trajectory written by `rig excite` (.toml or .csv), or a recording whose reference is repeated
    #[arg(long)]
    pub(crate) trajectory: PathBuf,
    /// Recording to write (.csv or .mcap)
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Sample rate for a .toml trajectory, Hz; a .csv has its own rate
    #[arg(long, default_value_t = 1000.0, allow_negative_numbers = true)]
    pub(crate) rate: f64,
    /// Standard deviation of the noise on positions, rad or m
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) noise_position: f64,
    /// Standard deviation of the noise on velocities, rad/s or m/s
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) noise_velocity: f64,
    /// Standard deviation of the noise on torques, N·m or N
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) noise_torque: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

/// Runs the command.
///
/// # Errors
/// A file cannot be read or written, or the model cannot be simulated.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let robot = described(&args.robot, ui)?.robot;
    if real(&args.out) == real(&args.trajectory) {
        return Err(CommandError::Sentence(format!(
            "--out {} is the trajectory itself; give another file.",
            args.out.display()
        )));
    }
    for (option, deviation) in [
        ("position", args.noise_position),
        ("velocity", args.noise_velocity),
        ("torque", args.noise_torque),
    ] {
        if !(deviation >= 0.0 && deviation.is_finite()) {
            return Err(CommandError::Sentence(format!(
                "--noise-{option} {deviation} is not a standard deviation; it must be 0 or a number above it."
            )));
        }
    }
    refuse_file(&args.out, args.force)?;
    if let [joint] = robot.joints.as_slice()
        && joint.voltage_controller.is_some()
        && joint.controller.is_none()
    {
        return under_voltage(args, ui, &robot);
    }
    let reference = load_reference(&args.trajectory, &robot, args.rate)?;
    let noise = Noise {
        position: args.noise_position,
        velocity: args.noise_velocity,
        torque: args.noise_torque,
    };
    let mut progress = ui.progress("simulating", 1);
    let done = replay(&robot, &reference, noise, args.seed, |done, total| {
        progress.at_of(done, total);
    })?;
    drop(progress);
    done.save(&args.out, &robot)?;
    for note in &done.notes {
        ui.remark(note);
    }
    let rows = done.motion.q.first().map_or(0, Vec::len);
    ui.say(&format!(
        "{}: {rows} samples, {:.1} s.",
        args.out.display(),
        rows as f64 * done.period
    ));
    Ok(())
}

/// Simulates a joint under motor voltage.
fn under_voltage(args: &Args, ui: &Ui, robot: &Robot) -> Result<(), CommandError> {
    if args.noise_torque > 0.0 {
        return Err(CommandError::Sentence(format!(
            "--noise-torque {} has no effect on joint {}, which is simulated under voltage and has no torque column; leave it out.",
            args.noise_torque, robot.joints[0].name
        )));
    }
    let noise = Noise {
        position: args.noise_position,
        velocity: args.noise_velocity,
        torque: 0.0,
    };
    let done = replay_voltage(robot, &args.trajectory, args.rate, noise, args.seed)?;
    done.save(&args.out, robot)?;
    for note in &done.notes {
        ui.remark(note);
    }
    let length = done
        .t
        .last()
        .zip(done.t.first())
        .map_or(0.0, |(end, begin)| end - begin);
    ui.say(&format!(
        "{}: {} samples, {length:.1} s, under voltage in the closed loop of [joint.voltage_controller].",
        args.out.display(),
        done.t.len()
    ));
    Ok(())
}
