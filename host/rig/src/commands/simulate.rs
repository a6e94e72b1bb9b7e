//! `rig simulate`: simulates the robot on a trajectory and writes a recording.

use std::path::PathBuf;

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::overwrite::refuse_file;
use super::same_file::is_same;
use super::ui::Ui;
use rig_diagnose::voltage::replay_voltage;
use rig_excite::{Carried, Noise, SampledReference, load_reference, reference_at, replay_carrying};
use rig_model::robot::{Load, Robot};
use rig_output::format_trimmed;

/// Sample rate of a trajectory by its parameters, Hz.
const RATE: f64 = 1000.0;

/// Simulates the robot following a trajectory, with its own friction, drives and controller.
///
/// Writes a recording with the column t and the columns q, qd, tau and ref for each joint. The other commands read it
/// like a recording of the real robot. The same seed gives the same file. The controllers act at every step of the
/// simulation, 0.25 ms at most, independently of the rate of the recording.
///
/// If the description has a single joint with a [joint.voltage_controller], as `rig diagnose` writes it for recordings
/// of a motor voltage, that controller closes the loop. The recording then has the columns t, q1, qd1, u1, supply and
/// ref1.
///
/// If the description has a [wrist_sensor], the recording also has the columns fx, fy, fz, mx, my and mz: the wrench
/// between the robot and the load of --load, in the sensor's axes about its origin. `reads` in the description gives
/// its sense; without `reads` it is the load's wrench on the robot, whose force at rest is the weight, downwards.
/// Readings beyond `force_range` and `moment_range` are clipped. Without --load they are bias and noise.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Robot description (.toml or .urdf) with inertia and friction
    #[arg(long)]
    pub(crate) robot: PathBuf,
    #[command(flatten)]
    pub(crate) chain: ChainArg,
    /// Trajectory written by `rig excite` (.toml or .csv), or a recording whose reference is repeated
    #[arg(long)]
    pub(crate) trajectory: PathBuf,
    /// Recording to write (.csv, .mcap or .parquet)
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Sample rate, Hz; samples of another rate are interpolated [default: 1000 for a .toml trajectory, else that of the file]
    #[arg(long)]
    pub(crate) rate: Option<f64>,
    /// Standard deviation of the noise on positions, rad or m
    #[arg(long, default_value_t = 0.0)]
    pub(crate) noise_position: f64,
    /// Standard deviation of the noise on velocities, rad/s or m/s
    #[arg(long, default_value_t = 0.0)]
    pub(crate) noise_velocity: f64,
    /// Standard deviation of the noise on torques, N·m or N
    #[arg(long, default_value_t = 0.0)]
    pub(crate) noise_torque: f64,
    /// Round the positions to the described encoders (encoder_counts_per_rev), after the noise
    #[arg(long)]
    pub(crate) quantised: bool,
    /// Load at the flange (.toml with mass, first_moment and inertia in the flange frame)
    #[arg(long)]
    pub(crate) load: Option<PathBuf>,
    /// Standard deviation of the noise on the wrist sensor's forces, N
    #[arg(long, default_value_t = 0.0)]
    pub(crate) noise_force: f64,
    /// Standard deviation of the noise on the wrist sensor's moments, N·m
    #[arg(long, default_value_t = 0.0)]
    pub(crate) noise_moment: f64,
    /// Constant part of the wrist sensor's readings, N and N·m [default: 0]
    #[arg(
        long,
        num_args = 6,
        value_names = ["FX", "FY", "FZ", "MX", "MY", "MZ"]
    )]
    pub(crate) sensor_bias: Option<Vec<f64>>,
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
    let robot = described(&args.robot, &args.chain, ui)?.robot;
    if is_same(&args.out, &args.trajectory) {
        return Err(CommandError::Sentence(format!(
            "--out {} is the trajectory itself; give another file.",
            args.out.display()
        )));
    }
    for (option, deviation) in [
        ("position", args.noise_position),
        ("velocity", args.noise_velocity),
        ("torque", args.noise_torque),
        ("force", args.noise_force),
        ("moment", args.noise_moment),
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
    let carried = carried(args, &robot, ui)?;
    let reference = args.reference(&robot, ui)?;
    let noise = Noise {
        position: args.noise_position,
        velocity: args.noise_velocity,
        torque: args.noise_torque,
    };
    let mut progress = ui.progress("simulating", 1);
    let tell = |done, total| progress.at_of(done, total);
    let mut done = replay_carrying(&robot, &carried, &reference, noise, args.seed, tell)?;
    drop(progress);
    if args.quantised {
        for note in done.quantise(&robot, None) {
            ui.note(&note);
        }
    }
    done.save(&args.out, &robot)?;
    for note in &done.notes {
        ui.note(note);
    }
    let rows = done.motion.q.first().map_or(0, Vec::len);
    ui.file(&args.out);
    ui.fact("samples", rows);
    ui.answer(&format!(
        "{}: {rows} samples, {:.1} s.",
        args.out.display(),
        rows as f64 * done.period
    ));
    Ok(())
}

impl Args {
    /// Returns the motion at the wanted rate.
    fn reference(&self, robot: &Robot, ui: &Ui) -> Result<SampledReference, CommandError> {
        let path = &self.trajectory;
        let Some(rate) = self.rate else {
            return Ok(load_reference(path, robot, RATE)?);
        };
        let (reference, from) = reference_at(path, robot, rate)?;
        if let Some(from) = from {
            ui.note(&format!(
                "{}: the motion is sampled at {} Hz; quintics through its samples give it at the {} Hz of --rate.",
                path.display(),
                format_trimmed(from, 6),
                format_trimmed(rate, 6)
            ));
        }
        Ok(reference)
    }

    /// Returns the first given option of the wrist sensor.
    fn sensor_option(&self) -> Option<&'static str> {
        [
            ("--noise-force", self.noise_force > 0.0),
            ("--noise-moment", self.noise_moment > 0.0),
            ("--sensor-bias", self.sensor_bias.is_some()),
        ]
        .into_iter()
        .find_map(|(option, given)| given.then_some(option))
    }
}

/// Returns the load and the errors of the wrist sensor.
fn carried(args: &Args, robot: &Robot, ui: &Ui) -> Result<Carried, CommandError> {
    let option = args.sensor_option();
    if let (Some(option), None) = (option, &robot.wrist_sensor) {
        return Err(CommandError::Sentence(format!(
            "{option} has no effect: {} has no [wrist_sensor]; write this table into a TOML description (`rig init --from` makes one of a URDF, with the table as a comment to be filled in), or leave the option out.",
            args.robot.display()
        )));
    }
    let load = args.load.as_deref().map(Load::read).transpose()?;
    if let (Some(load), Some(path)) = (&load, &args.load) {
        if let Some(why) = load.implausibility() {
            ui.warn(&format!(
                "The load of {} {why}. It is simulated with the values of the file.",
                path.display()
            ));
        }
        if robot.wrist_sensor.is_none() {
            ui.note(&format!(
                "{} has no [wrist_sensor], so the load changes only the torques.",
                args.robot.display()
            ));
        }
    }
    if robot
        .wrist_sensor
        .as_ref()
        .is_some_and(|sensor| sensor.reads.is_none())
    {
        ui.note("[wrist_sensor] has no `reads`; the readings are the load's wrench on the robot, as with reads = \"load\".");
    }
    let mut bias = [0.0; 6];
    for (own, given) in bias.iter_mut().zip(args.sensor_bias.iter().flatten()) {
        *own = *given;
    }
    Ok(Carried {
        load,
        force_noise: args.noise_force,
        moment_noise: args.noise_moment,
        bias,
    })
}

/// Simulates a joint under motor voltage.
fn under_voltage(args: &Args, ui: &Ui, robot: &Robot) -> Result<(), CommandError> {
    if args.noise_torque > 0.0 {
        return Err(CommandError::Sentence(format!(
            "--noise-torque {} has no effect on joint {}, which is simulated under voltage and has no torque column; leave it out.",
            args.noise_torque, robot.joints[0].name
        )));
    }
    if args.quantised {
        return Err(CommandError::Sentence(format!(
            "--quantised has no effect on joint {}, which is simulated under voltage; leave it out.",
            robot.joints[0].name
        )));
    }
    let of_the_load = args.load.as_ref().map(|_| "--load");
    if let Some(option) = of_the_load.or(args.sensor_option()) {
        return Err(CommandError::Sentence(format!(
            "{option} has no effect on joint {}, which is simulated under voltage, without a load and a wrist sensor; leave it out.",
            robot.joints[0].name
        )));
    }
    if robot.wrist_sensor.is_some() {
        ui.note("The wrist sensor is not simulated: the joint runs under voltage, without a load.");
    }
    let noise = Noise {
        position: args.noise_position,
        velocity: args.noise_velocity,
        torque: 0.0,
    };
    let sampled = (args.trajectory.extension()).is_none_or(|end| !end.eq_ignore_ascii_case("toml"));
    if let (true, Some(rate)) = (sampled, args.rate) {
        return Err(CommandError::Sentence(format!(
            "--rate {rate} has no effect on joint {}: under voltage the samples of {} are followed at their own instants; leave it out.",
            robot.joints[0].name,
            args.trajectory.display()
        )));
    }
    let rate = args.rate.unwrap_or(RATE);
    let done = replay_voltage(robot, &args.trajectory, rate, noise, args.seed)?;
    done.save(&args.out, robot)?;
    for note in &done.notes {
        ui.note(note);
    }
    let length = done
        .t
        .last()
        .zip(done.t.first())
        .map_or(0.0, |(end, begin)| end - begin);
    ui.file(&args.out);
    ui.fact("samples", done.t.len());
    ui.answer(&format!(
        "{}: {} samples, {length:.1} s, under voltage in the closed loop of [joint.voltage_controller].",
        args.out.display(),
        done.t.len()
    ));
    Ok(())
}
