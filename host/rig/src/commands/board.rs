//! `rig board`: health, stored settings, faults and single control ticks of the board.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args as ClapArgs, Subcommand};
use rig_shared::safety::{FaultRecord, SnapshotSample};
use rig_shared::wire::message::{
    Greeting, Health, Refusal, Report, RequestBody, SettingsOrigin, SnapshotPart,
};

use super::error::CommandError;
use super::input::described;
use super::record::{emulated, open_probe, uploaded};
use super::ui::Ui;
use rig_data::{Column, CsvWriter};
use rig_link::experiment::when_calibrated;
use rig_link::serial::DEFAULT_BAUD;
use rig_link::{
    EmulatedPort, LinkError, Port, SerialLine, Session, SessionSettings, describe_fault,
};

/// Longest wait for a health report, which the board sends once a second.
const HEALTH_PATIENCE: Duration = Duration::from_secs(3);
/// Longest wait for all parts of a capture, in addition to the time of the ticks that are still to be captured.
const PART_PATIENCE: Duration = Duration::from_secs(2);

/// Reads health, faults and single control ticks from the rig's board, and changes its stored settings.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Serial port of the rig, such as /dev/ttyACM0 or COM3
    #[arg(long, global = true, conflicts_with_all = ["probe", "emulated"])]
    port: Option<String>,
    /// The board's debug probe instead of its serial port
    #[arg(long, global = true, conflicts_with = "emulated")]
    probe: bool,
    /// The emulated rig instead of hardware; it stores nothing and sends no health report
    #[arg(long, global = true)]
    emulated: bool,
    /// Speed of the serial port, baud
    #[arg(long, global = true, default_value_t = DEFAULT_BAUD)]
    baud: u32,
    /// Seed of the emulated rig
    #[arg(long, global = true, default_value_t = 1)]
    seed: u64,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Prints the board's health: reason of the last start, settings, time that the control tick takes
    Health,
    /// Stores the present settings for the next power-on
    Store,
    /// Fetches a burst of single control ticks (10 kHz) as CSV
    Capture {
        /// Ticks between now and the end of the burst; the board's memory fixes the length of the burst
        #[arg(long, default_value_t = 1000)]
        after: u16,
        /// Replace the file if it exists
        #[arg(long)]
        force: bool,
        /// File to write, .csv
        #[arg(long)]
        out: PathBuf,
    },
    /// Names the latched fault and, with --out, fetches the control ticks around it as CSV
    Fault {
        /// Replace the file if it exists
        #[arg(long)]
        force: bool,
        /// File to write, .csv
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Clears the latched fault after its cause has gone
    Clear,
    /// Switches the bridge off at once
    Disarm,
    /// Sends limits, model, friction and effects of a description, switches precompensation on and stores all
    Upload {
        /// Robot description, such as the model.toml of a diagnosis
        #[arg(long)]
        model: PathBuf,
        /// If the description has effects that cannot be compensated, leave them out and send the rest
        #[arg(long)]
        leave_out: bool,
        /// Do not store: the settings are lost at the next power-on
        #[arg(long)]
        unstored: bool,
    },
}

/// Runs the command.
///
/// # Errors
/// A sentence about the port, a request that the rig refused, or the file.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    // Check the arguments before contacting the rig. clap does not notice that an option before the action
    // conflicts with one after it.
    let places =
        usize::from(args.port.is_some()) + usize::from(args.probe) + usize::from(args.emulated);
    if places != 1 {
        return Err(CommandError::Sentence(
            "Name the connection to the rig with exactly one of --port DEV (such as /dev/ttyACM0), --probe and --emulated."
                .to_owned(),
        ));
    }
    let sent = match &args.action {
        Action::Upload {
            model, leave_out, ..
        } => uploaded(&described(model, ui)?.robot, *leave_out, ui)?,
        Action::Capture { out, force, .. }
        | Action::Fault {
            out: Some(out),
            force,
        } if out.exists() && !force => {
            return Err(CommandError::Exists { path: out.clone() });
        }
        _ => Vec::new(),
    };
    if let Some(name) = &args.port {
        act(SerialLine::open(name, args.baud)?, args, sent, ui)
    } else if args.probe {
        act(open_probe()?, args, sent, ui)
    } else {
        act(
            EmulatedPort::new(emulated(None, args.seed)?),
            args,
            sent,
            ui,
        )
    }
}

fn act<P: Port>(port: P, args: &Args, sent: Vec<RequestBody>, ui: &Ui) -> Result<(), CommandError> {
    let mut session = Session::open(port, SessionSettings::default())?;
    match &args.action {
        Action::Health => {
            let health = health(&mut session)?;
            ui.say(&describe(session.greeting(), &health));
        }
        Action::Store => {
            when_calibrated(&mut session, RequestBody::Store)?;
            ui.say(
                "The present settings are stored; the rig starts with them at the next power-on.",
            );
        }
        Action::Capture { after, out, .. } => {
            session.request(RequestBody::Capture(*after))?;
            session.request(RequestBody::GetCapture)?;
            let rate = f64::from(session.greeting().control_rate_hz);
            let wait = PART_PATIENCE + Duration::from_secs_f64(f64::from(*after) / rate);
            let burst = fetch(&mut session, wait, |report| match report {
                Report::Capture(part) => Some(part),
                _ => None,
            })?;
            write(session.greeting(), &burst.ticks, out)?;
            ui.say(&format!(
                "{}: {} control ticks",
                out.display(),
                burst.ticks.len()
            ));
        }
        Action::Fault { out, .. } => {
            session.request(RequestBody::GetSnapshot)?;
            let kept = fetch(&mut session, PART_PATIENCE, |report| match report {
                Report::Snapshot(part) => Some(part),
                _ => None,
            })?;
            let Some(record) = kept.fault else {
                ui.say("No fault is latched.");
                return Ok(());
            };
            ui.say(&format!(
                "{} docs/firmware.md describes each fault; `rig board clear` clears it.",
                describe_fault(&record, f64::from(session.greeting().control_rate_hz)),
            ));
            if let Some(out) = out {
                write(session.greeting(), &kept.ticks, out)?;
                ui.say(&format!(
                    "{}: {} control ticks around it",
                    out.display(),
                    kept.ticks.len()
                ));
            }
        }
        Action::Clear => {
            session.request(RequestBody::ClearFault)?;
            ui.say("No fault is latched. After a fault of the encoder, tell the rig the position of the link (--home).");
        }
        Action::Disarm => {
            session.request(RequestBody::Disarm)?;
            ui.say("The bridge is off.");
        }
        Action::Upload {
            model, unstored, ..
        } => {
            when_calibrated(&mut session, RequestBody::Disarm)?;
            for body in sent {
                when_calibrated(&mut session, body)?;
            }
            let kept = if *unstored {
                "until the next power-on"
            } else {
                match when_calibrated(&mut session, RequestBody::Store) {
                    Err(LinkError::Refused {
                        refusal: Refusal::NoStorage,
                        ..
                    }) => {
                        return Err(CommandError::Sentence(format!(
                            "{} was sent to the rig but not stored, because the rig has no memory for it; give --unstored to send without storing.",
                            model.display()
                        )));
                    }
                    other => other?,
                }
                "and stored"
            };
            ui.say(&format!("{}: sent to the rig {kept}.", model.display()));
        }
    }
    Ok(())
}

fn health<P: Port>(session: &mut Session<P>) -> Result<Health, CommandError> {
    let until = session.port().now() + HEALTH_PATIENCE;
    loop {
        let left = until.saturating_sub(session.port().now());
        match session.next_report(left)? {
            Some(Report::Health(health)) => return Ok(health),
            Some(_) => {}
            None => {
                return Err(CommandError::Sentence(format!(
                    "No health report came in {} s; only a board sends one, the emulated rig has none.",
                    HEALTH_PATIENCE.as_secs()
                )));
            }
        }
    }
}

fn describe(greeting: &Greeting, health: &Health) -> String {
    let settings = match health.settings {
        SettingsOrigin::Defaults => "the firmware's defaults; none were ever stored",
        SettingsOrigin::Stored => "as stored",
        SettingsOrigin::OlderCopy => {
            "one of two stored copies; the other is damaged, belongs to another firmware or cannot be used"
        }
        SettingsOrigin::Damaged => "the firmware's defaults; the stored settings are damaged",
        SettingsOrigin::Unusable => {
            "the firmware's defaults; the stored settings belong to another firmware or cannot be used"
        }
    };
    let period = f64::from(health.clock_hz) / f64::from(greeting.control_rate_hz);
    let share = |cycles: u32| 100.0 * f64::from(cycles) / period;
    format!(
        "firmware        {}\n\
         running for     {:.1} s\n\
         started by      {:?}\n\
         started with    {settings}\n\
         clock           {:.3} MHz, {}\n\
         control tick    {:.1} % of its time on average, {:.1} % at most in the last second\n\
         stack           {} bytes never used\n\
         line            {} damaged requests, {} telemetry samples without room",
        greeting.firmware,
        health.tick as f64 / f64::from(greeting.control_rate_hz),
        health.reset,
        f64::from(health.clock_hz) * 1e-6,
        if health.crystal {
            "from the crystal"
        } else {
            "from the chip's internal oscillator: times may be wrong by 1 %"
        },
        share(health.tick_cycles_mean),
        share(health.tick_cycles_max),
        health.stack_free,
        health.bad_requests,
        health.dropped,
    )
}

/// Control ticks stored by the rig, and the fault that they belong to.
#[derive(Default)]
struct Kept {
    ticks: Vec<SnapshotSample>,
    fault: Option<FaultRecord>,
}

/// Fetches the requested control ticks, part by part.
fn fetch<P: Port>(
    session: &mut Session<P>,
    patience: Duration,
    part_of: impl Fn(&Report) -> Option<&SnapshotPart>,
) -> Result<Kept, CommandError> {
    let begin = session.port().now();
    let (mut kept, mut total) = (Kept::default(), usize::MAX);
    while kept.ticks.len() < total {
        let left = (begin + patience).saturating_sub(session.port().now());
        let report = session.next_report(left)?;
        if let Some(Report::Fault(record)) = &report {
            kept.fault = Some(*record);
        }
        let got = kept.ticks.len();
        let Some(report) = report else {
            return Err(CommandError::Sentence(format!(
                "The rig stopped sending after {got} of its stored control ticks; run the command again."
            )));
        };
        let Some(part) = part_of(&report) else {
            continue;
        };
        if usize::from(part.first) != got {
            return Err(CommandError::Sentence(format!(
                "A part of the stored control ticks, after tick {got}, was lost on the line; run the command again."
            )));
        }
        total = usize::from(part.total);
        kept.ticks.extend(part.samples.iter().copied());
    }
    Ok(kept)
}

/// Writes control ticks as CSV, in SI units.
fn write(greeting: &Greeting, ticks: &[SnapshotSample], out: &Path) -> Result<(), CommandError> {
    let rate = f64::from(greeting.control_rate_hz);
    let per_count = core::f64::consts::TAU
        / (f64::from(greeting.counts_per_motor_turn) * f64::from(greeting.gear_ratio));
    let columns = [
        ("t", "s"),
        ("q1", "rad"),
        ("i1", "A"),
        ("duty1", ""),
        ("supply", "V"),
        ("ref1", "rad"),
    ];
    let mut writer = CsvWriter::create(out, &columns.map(|(name, unit)| Column::new(name, unit)))?;
    for sample in ticks {
        writer.push_row(&[
            sample.tick as f64 / rate,
            sample.position as f64 * per_count,
            f64::from(sample.current),
            f64::from(sample.duty),
            f64::from(sample.supply),
            f64::from(sample.reference),
        ])?;
    }
    writer.finish()?;
    Ok(())
}
