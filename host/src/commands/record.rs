//! `rig record`: a trajectory run on the rig, or the rig at rest, recorded.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{ArgGroup, Args as ClapArgs};
use rig_shared::safety::{Limit, Mode};
use rig_shared::trajectory::Trajectory;
use rig_shared::wire::message::RequestBody;

use super::error::CommandError;
use super::input::described;
use super::overwrite::refuse_file;
use super::ui::Ui;
use crate::data::{Column, RecordingWriter};
use crate::emulated::{EmulatedRig, Nameplate, upload};
use crate::excite::TrajectoryFile;
use crate::link::experiment::{Experiment, run as run_experiment};
use crate::link::serial::DEFAULT_BAUD;
use crate::link::{
    COLUMNS, Converter, EmulatedPort, Event, LossReport, Port, SerialLine, Session,
    SessionSettings, UNITS,
};
use crate::plant::PlantConfig;
use crate::robot::{ONE_LINK_TEMPLATE, Robot};

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
    /// Robot description whose model, friction and limits are sent to the rig first
    #[arg(long)]
    robot: Option<PathBuf>,
    /// Trajectory to run (`rig excite` writes one); without it the rig stays disarmed
    #[arg(long)]
    trajectory: Option<PathBuf>,
    /// How long to record after the trajectory or its drive_off, or in all without one, s
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
    /// Where the link stands at the start, rad: an incremental encoder cannot know
    #[arg(long, allow_negative_numbers = true)]
    home: Option<f32>,
    /// Compensate friction and effects by the description
    #[arg(long, requires = "robot")]
    precompensation: bool,
    /// Seed of the emulated rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Which recording of the emulated rig this is: another one of the same motion differs by noise
    #[arg(long, default_value_t = 1)]
    run: u32,
    /// Replace the recording if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// File to write, .csv or .mcap
    #[arg(long)]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A sentence: the port, the rig's refusal, the file.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    if !(args.seconds >= 0.0 && args.seconds.is_finite()) {
        return Err(CommandError::Sentence(format!(
            "--seconds {} is no time; give 0 or more.",
            args.seconds
        )));
    }
    refuse_file(&args.out, args.force)?;
    let robot = match &args.robot {
        Some(path) => Some(described(path, ui)?.robot),
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
    if let Some(path) = &args.trajectory {
        let file = TrajectoryFile::load(path)?;
        if let Some(robot) = &robot {
            file.fits(robot, path)?;
        }
        experiment.trajectory = Some(single(&file, path, args.home)?);
        experiment.drive_off = file.drive_off;
    }
    let losses = if let Some(name) = &args.port {
        record(
            SerialLine::open(name, args.baud)?,
            &experiment,
            &args.out,
            ui,
        )?
    } else if args.probe {
        record(open_probe()?, &experiment, &args.out, ui)?
    } else {
        let rig = emulated_at(robot, [args.seed, args.run.into()], args.home)?;
        record(EmulatedPort::new(rig), &experiment, &args.out, ui)?
    };
    ui.say(&format!("{}: {losses}", args.out.display()));
    Ok(())
}

/// What a description asks the rig to be told, effects included; what is left out of it is said.
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

/// The emulated rig: a laboratory's, with the nameplate of this description or of the template.
pub(crate) fn emulated(robot: Option<Robot>, seed: u64) -> Result<EmulatedRig, CommandError> {
    emulated_at(robot, [seed, 1], None)
}

/// The same in one of its recordings (counted from 1), its link held where it is said to stand, if that is not where it hangs.
fn emulated_at(
    robot: Option<Robot>,
    [seed, run]: [u64; 2],
    home: Option<f32>,
) -> Result<EmulatedRig, CommandError> {
    let described = match robot {
        Some(robot) => robot,
        None => Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml"))?,
    };
    let nameplate = Nameplate::from_robot(&described)?;
    let mut plant = PlantConfig::laboratory(seed);
    let hangs = plant.initial_position;
    let home = home.map_or(hangs, f64::from);
    if (home - hangs).abs() > HANGS {
        // Who says straight down of where it hangs is off by as much wherever else he brings it: the rig has one zero.
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

/// The rig behind the debug probe.
#[cfg(feature = "probe")]
pub(crate) fn open_probe() -> Result<crate::link::ProbeLine, CommandError> {
    Ok(crate::link::ProbeLine::open()?)
}

/// A program without this ability says so.
#[cfg(not(feature = "probe"))]
pub(crate) fn open_probe() -> Result<Box<dyn Port>, CommandError> {
    Err(CommandError::Sentence(
        "This program was built without the debug probe; build it with `cargo build --release --features probe`, or use the board's serial port with --port.".to_owned(),
    ))
}

/// The motion of the rig's one joint, if it starts where the link stands.
fn single(
    file: &TrajectoryFile,
    path: &Path,
    home: Option<f32>,
) -> Result<Trajectory<f32>, CommandError> {
    let [joint] = file.joints.as_slice() else {
        return Err(CommandError::Sentence(format!(
            "{} moves {} joints, but the rig has one; design it with `rig excite` from the rig's description.",
            path.display(),
            file.joints.len()
        )));
    };
    let stands = f64::from(home.unwrap_or(0.0));
    if (joint.start - stands).abs() > START_TOLERANCE {
        return Err(CommandError::Sentence(format!(
            "{} starts at {:.4} rad, but the link stands at {stands:.4} rad (--home); bring the link there, or design the motion with `rig excite --start {stands:.4}`.",
            path.display(),
            joint.start
        )));
    }
    Ok(joint.trajectory.to_f32())
}

/// A link that is said to stand within this of where it hangs does hang, rad.
const HANGS: f64 = 0.2;

/// How far from its start a motion may begin, rad: about what a spirit level leaves. The rig checks its
/// limits from where the link really stands.
const START_TOLERANCE: f64 = 0.02;

fn record<P: Port>(
    port: P,
    experiment: &Experiment,
    out: &Path,
    ui: &Ui,
) -> Result<LossReport, CommandError> {
    let mut session = Session::open(port, SessionSettings::default())?;
    let greeting = session.greeting().clone();
    let converter = Converter::new(&greeting);
    let columns: Vec<Column> = COLUMNS
        .iter()
        .zip(UNITS)
        .map(|(name, unit)| Column::new(name, unit))
        .collect();
    let metadata = BTreeMap::from([
        ("firmware".to_string(), greeting.firmware.to_string()),
        (
            "modes".to_string(),
            names(&[
                Mode::Calibrating,
                Mode::Disarmed,
                Mode::Holding,
                Mode::Running,
                Mode::Stopping,
                Mode::Fault,
            ]),
        ),
        (
            "limits".to_string(),
            Limit::ALL
                .map(|limit| format!("{} {}", limit as u8, limit.name()))
                .join(", "),
        ),
    ]);
    let mut writer = RecordingWriter::create(out, &columns, &metadata)?;
    let total = experiment.samples(1.0 / converter.period());
    let mut progress = ui.progress("recording", total);
    let mut failed = None;
    let mut fault = None;
    let mut mode = Mode::Disarmed;
    let mut done = 0;
    listen_to_interrupts()?;
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
                done += samples.len() as u64;
                mode = samples.last().map_or(mode, |sample| sample.mode);
                progress.at(done);
            }
            Event::Fault(record) => fault = Some(*record),
            _ => {}
        }
        if PRESSED.load(Ordering::Relaxed) {
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
        Err(error) if done == 0 => return Err(error.into()),
        Err(error) => {
            writer.finish()?;
            return Err(CommandError::Sentence(format!(
                "{error} {} holds the {done} samples that came before; how many were lost is not known.",
                out.display()
            )));
        }
    };
    writer.finish()?;
    if let Some(record) = fault {
        return Err(CommandError::Sentence(format!(
            "The rig has stopped with the fault {:?} ({}) at tick {}; {} holds what was recorded until the end. `rig board fault` fetches the ticks around it, `rig board clear` forgets it.",
            record.fault,
            record.value,
            record.tick,
            out.display()
        )));
    }
    if mode == Mode::Fault {
        return Err(CommandError::Sentence(format!(
            "The rig has a fault latched that was not announced while {} was recorded: `rig board fault` says which, `rig board clear` forgets it.",
            out.display()
        )));
    }
    if PRESSED.load(Ordering::Relaxed) {
        return Err(CommandError::Sentence(format!(
            "Broken off: the motion was stopped and the bridge switched off; {} holds the {done} samples until then.",
            out.display()
        )));
    }
    Ok(losses)
}

/// Whether Ctrl-C has been pressed since the recording began.
static PRESSED: AtomicBool = AtomicBool::new(false);

/// Listens to Ctrl-C from now on: the link is then brought to rest before the program ends. Pressed again it ends at once,
/// and the rig stops by itself when it no longer hears anything.
fn listen_to_interrupts() -> Result<(), CommandError> {
    // A process has one handler; the program as a library records more than once.
    static LISTENING: OnceLock<Result<(), String>> = OnceLock::new();
    let listening = LISTENING.get_or_init(|| {
        ctrlc::set_handler(|| {
            if PRESSED.swap(true, Ordering::Relaxed) {
                // As a shell says that SIGINT ended it.
                std::process::exit(130);
            }
        })
        .map_err(|error| error.to_string())
    });
    PRESSED.store(false, Ordering::Relaxed);
    (listening.clone())
        .map_err(|error| CommandError::Sentence(format!("Ctrl-C cannot be caught: {error}.")))
}

fn names(modes: &[Mode]) -> String {
    let list: Vec<String> = modes
        .iter()
        .enumerate()
        .map(|(k, mode)| format!("{k} {}", mode.name()))
        .collect();
    list.join(", ")
}
