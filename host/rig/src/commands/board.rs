//! `rig board`: health, stored settings, faults and single control ticks of the board.

mod health;
mod ticks;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args as ClapArgs, Subcommand};
use rig_shared::wire::message::{Refusal, Report, RequestBody};

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::record::{emulated, open, open_probe, uploaded};
use super::ui::Ui;
use rig_link::experiment::when_calibrated;
use rig_link::serial::DEFAULT_BAUD;
use rig_link::{EmulatedPort, LinkError, Port, SerialLine, Session, describe_fault};

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
    let (mut robot, mut sent) = (None, Vec::new());
    match &args.action {
        Action::Upload {
            model, leave_out, ..
        } => {
            let described = described(model, &ChainArg::default(), ui)?.robot;
            described.without_followers("The board's compensation")?;
            sent = uploaded(&described, *leave_out, ui)?;
            robot = Some(described);
        }
        Action::Capture { out, force, .. }
        | Action::Fault {
            out: Some(out),
            force,
        } if out.exists() && !force => {
            return Err(CommandError::Exists { path: out.clone() });
        }
        _ => {}
    }
    if let Some(name) = &args.port {
        let port = SerialLine::open(name, args.baud)?;
        act(open(port, robot.as_ref())?, args, sent, ui)
    } else if args.probe {
        act(open(open_probe()?, robot.as_ref())?, args, sent, ui)
    } else {
        let port = EmulatedPort::new(emulated(robot, args.seed)?);
        act(open(port, None)?, args, sent, ui)
    }
}

fn act<P: Port>(
    mut session: Session<P>,
    args: &Args,
    sent: Vec<RequestBody>,
    ui: &Ui,
) -> Result<(), CommandError> {
    match &args.action {
        Action::Health => {
            let health = health::fetch(&mut session)?;
            ui.answer(&health::describe(session.greeting(), &health));
        }
        Action::Store => {
            when_calibrated(&mut session, RequestBody::Store)?;
            ui.answer(
                "The present settings are stored; the rig starts with them at the next power-on.",
            );
        }
        Action::Capture { after, out, .. } => capture(&mut session, *after, out, ui)?,
        Action::Fault { out, .. } => fault(&mut session, out.as_deref(), ui)?,
        Action::Clear => {
            session.request(RequestBody::ClearFault)?;
            ui.answer("No fault is latched. After a fault of the encoder, tell the rig the position of the link (--home).");
        }
        Action::Disarm => {
            session.request(RequestBody::Disarm)?;
            ui.answer("The bridge is off.");
        }
        Action::Upload {
            model, unstored, ..
        } => {
            let kept = upload(&mut session, sent, model, *unstored)?;
            ui.answer(&format!("{}: sent to the rig {kept}.", model.display()));
        }
    }
    Ok(())
}

/// Fetches the control ticks up to `after` ticks from now, and writes them to `out`.
fn capture<P: Port>(
    session: &mut Session<P>,
    after: u16,
    out: &Path,
    ui: &Ui,
) -> Result<(), CommandError> {
    session.request(RequestBody::Capture(after))?;
    session.request(RequestBody::GetCapture)?;
    let rate = f64::from(session.greeting().control_rate_hz);
    let time = Duration::from_secs_f64(f64::from(after) / rate);
    let burst = ticks::fetch(session, time, |report| match report {
        Report::Capture(part) => Some(part),
        _ => None,
    })?;
    ticks::write(session.greeting(), &burst.ticks, out)?;
    ui.file(out);
    ui.answer(&format!(
        "{}: {} control ticks",
        out.display(),
        burst.ticks.len()
    ));
    Ok(())
}

/// Names the latched fault, and writes the control ticks around it to `out`.
fn fault<P: Port>(
    session: &mut Session<P>,
    out: Option<&Path>,
    ui: &Ui,
) -> Result<(), CommandError> {
    session.request(RequestBody::GetSnapshot)?;
    let kept = ticks::fetch(session, Duration::ZERO, |report| match report {
        Report::Snapshot(part) => Some(part),
        _ => None,
    })?;
    let Some(record) = kept.fault else {
        ui.answer("No fault is latched.");
        return Ok(());
    };
    ui.answer(&format!(
        "{} docs/firmware.md describes each fault; `rig board clear` clears it.",
        describe_fault(&record, f64::from(session.greeting().control_rate_hz)),
    ));
    if let Some(out) = out {
        ticks::write(session.greeting(), &kept.ticks, out)?;
        ui.file(out);
        ui.answer(&format!(
            "{}: {} control ticks around it",
            out.display(),
            kept.ticks.len()
        ));
    }
    Ok(())
}

/// Sends the settings of a description, and stores them unless `unstored`. Returns how long the rig keeps them, in
/// words.
fn upload<P: Port>(
    session: &mut Session<P>,
    sent: Vec<RequestBody>,
    model: &Path,
    unstored: bool,
) -> Result<&'static str, CommandError> {
    when_calibrated(session, RequestBody::Disarm)?;
    for body in sent {
        when_calibrated(session, body)?;
    }
    if unstored {
        return Ok("until the next power-on");
    }
    match when_calibrated(session, RequestBody::Store) {
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
    Ok("and stored")
}
