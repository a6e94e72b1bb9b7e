//! `rig record`: records the rig at rest or while it runs a trajectory.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args as ClapArgs};
use rig_shared::safety::{FaultRecord, Limit, Mode};
use rig_shared::wire::message::{RequestBody, StateSample};

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::interrupts;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_data::{Column, RecordingWriter};
use rig_excite::{JointTrajectory, TrajectoryFile};
use rig_link::experiment::{Experiment, run as run_experiment};
use rig_link::serial::DEFAULT_BAUD;
use rig_link::{
    COLUMNS, Converter, EmulatedPort, Event, LearningLog, LossReport, Port, SerialLine, Session,
    SessionSettings, UNITS, describe_fault,
};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
use rig_plant::PlantConfig;
use rig_plant::emulated::{
    EmulatedRig, Nameplate, check_hardware, hardware_of, other_link, shortfalls, upload,
};

/// Records the rig's telemetry, at rest or while it runs a trajectory.
#[derive(Debug, ClapArgs)]
#[command(group = ArgGroup::new("where").required(true).args(["port", "probe", "emulated"]))]
pub(crate) struct Args {
    /// Serial port of the rig, such as /dev/ttyACM0 or COM3
    #[arg(long)]
    port: Option<String>,
    /// The board's debug probe instead of its serial port
    #[arg(long)]
    probe: bool,
    /// The emulated rig instead of hardware
    #[arg(long)]
    emulated: bool,
    /// Speed of the serial port, baud
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
    /// Robot description; its model, friction and limits are sent to the rig first
    #[arg(long)]
    robot: Option<PathBuf>,
    #[command(flatten)]
    chain: ChainArg,
    /// Trajectory to run (.toml by `rig excite`); without it the rig stays disarmed
    #[arg(long)]
    trajectory: Option<PathBuf>,
    /// Recording time after the trajectory (and its drive_off), or in total without a trajectory, s
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
    /// Position of the link at the start, rad; an incremental encoder cannot measure it
    #[arg(long)]
    home: Option<f32>,
    /// Compensate friction and effects with the values of the description
    #[arg(long, requires = "robot")]
    precompensation: bool,
    /// Seed of the emulated rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of the recording of the emulated rig: another number gives the same motion with other noise
    #[arg(long, default_value_t = 1)]
    run: u32,
    /// Replace the recording if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// File to write, .csv, .mcap or .parquet
    #[arg(long)]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A sentence about the port, a request that the rig refused, or the file.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    if !(args.seconds >= 0.0 && args.seconds.is_finite()) {
        return Err(CommandError::Sentence(format!(
            "--seconds {} is not a valid time; give 0 or more.",
            args.seconds
        )));
    }
    refuse_file(&args.out, args.force)?;
    let robot = match &args.robot {
        Some(path) => {
            let robot = described(path, &args.chain, ui)?.robot;
            robot.without_followers("The rig, which has one link,")?;
            Some(robot)
        }
        None => None,
    };
    let mut settings: Vec<RequestBody> = args
        .home
        .map(RequestBody::SetPosition)
        .into_iter()
        .collect();
    if let Some(robot) = &robot {
        settings.extend(if args.precompensation {
            uploaded(robot, true, ui)?
        } else {
            upload::settings(&Nameplate::from_robot(robot)?, false)
        });
    }
    let mut experiment = Experiment {
        settings,
        rest: args.seconds,
        ..Experiment::default()
    };
    let mut motion = None;
    if let Some(path) = &args.trajectory {
        let file = TrajectoryFile::load(path)?;
        if let Some(robot) = &robot {
            file.fits(robot, path)?;
        }
        let joint = single(&file, path, args.home)?;
        experiment.trajectory = Some(joint.trajectory.to_f32());
        experiment.drive_off = file.drive_off;
        motion = Some(joint.clone());
    }
    let losses = if let Some(name) = &args.port {
        record(
            open(SerialLine::open(name, args.baud)?, robot.as_ref())?,
            &experiment,
            &args.out,
            ON_BOARD,
            ui,
        )?
    } else if args.probe {
        let session = open(open_probe()?, robot.as_ref())?;
        record(session, &experiment, &args.out, ON_BOARD, ui)?
    } else {
        let robot = described_or_template(robot)?;
        let rig = emulated_at(&robot, [args.seed, args.run.into()], args.home)?;
        doubt(&rig, &robot, motion.as_ref(), ui)?;
        let session = open(EmulatedPort::new(rig), Some(&robot))?;
        record(session, &experiment, &args.out, "", ui)?
    };
    ui.answer(&format!("{}: {losses}", args.out.display()));
    Ok(())
}

/// Returns the requests that send a description to the rig, effects included. Prints the effects that were left out.
pub(crate) fn uploaded(
    robot: &Robot,
    leave_out: bool,
    ui: &Ui,
) -> Result<Vec<RequestBody>, CommandError> {
    let upload = upload::requests(robot, leave_out)?;
    for sentence in &upload.left_out {
        ui.say(&format!("Left out: {sentence}."));
    }
    Ok(upload.requests)
}

/// Creates an emulated laboratory rig with the drive, encoder and nameplate of this description or of the template.
pub(crate) fn emulated(robot: Option<Robot>, seed: u64) -> Result<EmulatedRig, CommandError> {
    emulated_at(&described_or_template(robot)?, [seed, 1], None)
}

pub(crate) fn described_or_template(robot: Option<Robot>) -> Result<Robot, CommandError> {
    match robot {
        Some(robot) => Ok(robot),
        None => Ok(Robot::from_toml(
            ONE_LINK_TEMPLATE,
            Path::new("one-link.toml"),
        )?),
    }
}

/// As [`emulated`], for recording `run` (from 1). A link with `home` away from the hanging position is held.
pub(crate) fn emulated_at(
    described: &Robot,
    [seed, run]: [u64; 2],
    home: Option<f32>,
) -> Result<EmulatedRig, CommandError> {
    let nameplate = Nameplate::from_robot(described)?;
    let mut plant = PlantConfig::laboratory_with(&hardware_of(described)?, seed);
    let hangs = plant.initial_position;
    let home = home.map_or(hangs, f64::from);
    if (home - hangs).abs() > HANGS {
        // The user takes the hanging position for −90°. The true one differs by hangs + 90°, and the rig has one zero:
        // the same offset applies to `home`.
        let stands = home + (hangs + FRAC_PI_2);
        (plant.initial_position, plant.sensors.encoder.zero) = (stands, stands);
        plant.held = true;
    }
    let noise = seed ^ (run.wrapping_sub(1) << u32::BITS);
    EmulatedRig::new(&nameplate, plant, noise).map_err(|fault| {
        CommandError::Sentence(format!(
            "The estimator's settings cannot be used: {fault:?}."
        ))
    })
}

/// Prints remarks if the described link differs from the emulated one or the motor is too weak for the motion.
///
/// # Errors
/// Values that the description lacks.
pub(crate) fn doubt(
    rig: &EmulatedRig,
    robot: &Robot,
    motion: Option<&JointTrajectory>,
    ui: &Ui,
) -> Result<(), CommandError> {
    let nameplate = Nameplate::from_robot(robot)?;
    let plant = rig.plant().config();
    if let Some(sentence) = other_link(plant, &nameplate, robot) {
        ui.warn(&sentence);
    }
    let Some(motion) = motion else { return Ok(()) };
    let short = shortfalls(plant, &nameplate, &motion.trajectory, motion.start);
    if !short.is_empty() {
        ui.warn(&format!(
            "The described drive is too weak to move the link of the emulated rig like this. {} Design a slower or smaller motion from this description (`rig excite --speed-share`), or describe another drive.",
            short.join(" ")
        ));
    }
    Ok(())
}

/// Opens the connection to a rig, and compares its hardware with that of a description.
///
/// # Errors
/// A sentence about the port, or about the value that differs.
pub(crate) fn open<P: Port>(port: P, robot: Option<&Robot>) -> Result<Session<P>, CommandError> {
    let session = Session::open(port, SessionSettings::default())?;
    if let Some(robot) = robot {
        check_hardware(robot, session.greeting())?;
    }
    Ok(session)
}

/// Opens the connection to the rig through the debug probe.
#[cfg(feature = "probe")]
pub(crate) fn open_probe() -> Result<rig_link::ProbeLine, CommandError> {
    Ok(rig_link::ProbeLine::open()?)
}

/// Reports that the program was built without the debug probe.
#[cfg(not(feature = "probe"))]
pub(crate) fn open_probe() -> Result<Box<dyn Port>, CommandError> {
    Err(CommandError::Sentence(
        "This program was built without the debug probe; build it with `cargo build --release --features probe`, or use the board's serial port with --port.".to_owned(),
    ))
}

/// Returns the motion of the rig's only joint, after a check that it starts at the position of the link.
fn single<'a>(
    file: &'a TrajectoryFile,
    path: &Path,
    home: Option<f32>,
) -> Result<&'a JointTrajectory, CommandError> {
    let joint = file.only_joint(path)?;
    let stands = f64::from(home.unwrap_or(0.0));
    if (joint.start - stands).abs() > START_TOLERANCE {
        let (file, start) = (path.display(), joint.start);
        return Err(CommandError::Sentence(match home {
            None => format!(
                "{file} starts at {start:.4} rad, but without --home the link is taken to be at 0 rad. Give --home {start:.4} if it is there; otherwise give its position, and design the motion with `rig excite --start` from there."
            ),
            Some(_) if stands.abs() > core::f64::consts::TAU => format!(
                "{file} starts at {start:.4} rad, but --home is {stands} rad. It looks like degrees: {stands} degrees are {:.4} rad.",
                stands.to_radians()
            ),
            Some(_) => format!(
                "{file} starts at {start:.4} rad, but the link is at {stands:.4} rad (--home); move the link to the start, or design the motion with `rig excite --start {stands:.4}`."
            ),
        }));
    }
    Ok(joint)
}

/// Largest distance from the hanging position at which a `home` still means that the link hangs, rad.
const HANGS: f64 = 0.2;

/// Largest distance between the link and the start of a motion, rad: about the accuracy of a spirit level. The rig
/// checks its limits from the true position of the link.
const START_TOLERANCE: f64 = 0.02;

/// Advice about a fault on a board. The emulated rig ends with the recording and gets no such advice.
const ON_BOARD: &str =
    " `rig board fault` fetches the control ticks around it; `rig board clear` clears it.";

/// Metadata of a recording: firmware, and the numbers of modes and limits.
fn metadata(firmware: &str) -> BTreeMap<String, String> {
    let modes = names(&[
        Mode::Calibrating,
        Mode::Disarmed,
        Mode::Holding,
        Mode::Running,
        Mode::Stopping,
        Mode::Fault,
    ]);
    let limits = Limit::ALL
        .map(|limit| format!("{} {}", limit as u8, limit.name()))
        .join(", ");
    BTreeMap::from([
        ("firmware".to_string(), firmware.to_string()),
        ("modes".to_string(), modes),
        ("limits".to_string(), limits),
    ])
}

/// Records an experiment to a file. `more` is added to the sentence about a fault.
fn record<P: Port>(
    mut session: Session<P>,
    experiment: &Experiment,
    out: &Path,
    more: &str,
    ui: &Ui,
) -> Result<LossReport, CommandError> {
    let greeting = session.greeting().clone();
    let converter = Converter::new(&greeting);
    let columns: Vec<Column> = COLUMNS
        .iter()
        .zip(UNITS)
        .map(|(name, unit)| Column::new(name, unit))
        .collect();
    let mut writer = RecordingWriter::create(out, &columns, &metadata(&greeting.firmware))?;
    let total = experiment.samples(1.0 / converter.period());
    let mut progress = ui.progress("recording", total);
    let mut failed = None;
    let mut ending = Ending::default();
    interrupts::listen(Some(writer.temporary()))?;
    let recorded = run_experiment(&mut session, experiment, |event| {
        match event {
            Event::Samples {
                first_tick,
                samples,
            } => {
                for (k, sample) in samples.iter().enumerate() {
                    if let Err(error) =
                        writer.push_row(&converter.row(first_tick, k, sample).values())
                    {
                        failed = Some(error);
                        return ControlFlow::Break(());
                    }
                }
                ending.done += samples.len() as u64;
                ending.unsettled += count_unsettled(samples);
                ending.mode = samples.last().map_or(ending.mode, |sample| sample.mode);
                progress.at(ending.done);
            }
            Event::Estimate(estimate) => ending.learning.add(estimate),
            Event::Fault(record) => ending.fault = Some(*record),
            _ => {}
        }
        if interrupts::asked() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    if let Some(error) = failed {
        return Err(error.into());
    }
    let losses = match recorded {
        Ok(losses) => losses,
        Err(error) if ending.done == 0 => return Err(error.into()),
        Err(error) => {
            writer.finish()?;
            return Err(CommandError::Sentence(format!(
                "{error} {} holds the {} samples received before that; the number of lost samples is not known.",
                out.display(),
                ending.done
            )));
        }
    };
    writer.finish()?;
    if let Some(sentence) = ending.unsettled_sentence() {
        ui.warn(&sentence);
    }
    if let Some(sentence) = ending.learning.sentence() {
        ui.note(&sentence);
    }
    ending.judge(out, more, f64::from(greeting.control_rate_hz))?;
    Ok(losses)
}

/// How a recording ended.
struct Ending {
    fault: Option<FaultRecord>,
    mode: Mode,
    /// Number of samples received.
    done: u64,
    /// Samples with a current that was read before its amplifier had settled.
    unsettled: u64,
    learning: LearningLog,
}

impl Default for Ending {
    fn default() -> Self {
        Self {
            fault: None,
            mode: Mode::Disarmed,
            done: 0,
            unsettled: 0,
            learning: LearningLog::default(),
        }
    }
}

/// Returns the number of samples with a mark for a current that had not settled.
fn count_unsettled(samples: &[StateSample]) -> u64 {
    let marked = |sample: &&StateSample| sample.limits.has(Limit::Unsettled);
    samples.iter().filter(marked).count() as u64
}

impl Ending {
    /// Returns a sentence about currents that had not settled, if there were any.
    fn unsettled_sentence(&self) -> Option<String> {
        (self.unsettled > 0).then(|| {
            format!(
                "In {} of {} samples ({:.1} %) the current was read before its amplifier had settled after an edge of the bridge, so it may be wrong there. These samples have bit {} in column `limits`; the rig's own estimate and `rig identify` leave them out. A slower motion or a higher supply voltage avoids them.",
                self.unsettled,
                self.done,
                100.0 * self.unsettled as f64 / self.done.max(1) as f64,
                Limit::Unsettled as u8,
            )
        })
    }

    /// # Errors
    /// A sentence if a fault or the user ended the recording.
    fn judge(&self, out: &Path, more: &str, control_rate: f64) -> Result<(), CommandError> {
        let out = out.display();
        if let Some(record) = &self.fault {
            return Err(CommandError::Sentence(format!(
                "The rig has stopped. {} {out} holds the samples recorded until then.{more}",
                describe_fault(record, control_rate)
            )));
        }
        if self.mode == Mode::Fault {
            return Err(CommandError::Sentence(format!(
                "The rig has a latched fault, but sent no report of it while {out} was recorded: `rig board fault` names the fault, `rig board clear` clears it."
            )));
        }
        if interrupts::asked() {
            return Err(CommandError::Sentence(format!(
                "Interrupted: the motion was stopped and the bridge switched off; {out} holds the {} samples recorded until then.",
                self.done
            )));
        }
        Ok(())
    }
}

fn names(modes: &[Mode]) -> String {
    let list: Vec<String> = modes
        .iter()
        .enumerate()
        .map(|(k, mode)| format!("{k} {}", mode.name()))
        .collect();
    list.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn currents_that_had_not_settled_are_told_with_their_number() {
        let mut unsettled = StateSample::default();
        unsettled.limits.set(Limit::Unsettled, true);
        let mut late = StateSample::default();
        late.limits.set(Limit::LateTick, true);
        let samples = [unsettled, late, StateSample::default(), unsettled];
        let ending = Ending {
            done: 400,
            unsettled: count_unsettled(&samples),
            ..Ending::default()
        };
        let sentence = ending.unsettled_sentence().unwrap_or_default();
        assert!(
            sentence.starts_with("In 2 of 400 samples (0.5 %)"),
            "{sentence}"
        );
        assert_eq!(Ending::default().unsettled_sentence(), None);
    }
}
