//! `rig live`: shows the rig while it runs, on a page of this computer.

use std::f64::consts::FRAC_PI_2;
use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use rig_shared::wire::message::RequestBody;

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::interrupts;
use super::record::{described_or_template, doubt, emulated_at, open, open_probe, uploaded};
use super::ui::Ui;
use rig_excite::TrajectoryFile;
use rig_link::serial::DEFAULT_BAUD;
use rig_link::{EmulatedPort, Paced, Port, SerialLine};
use rig_live::{Addresses, Listeners, Motion, RigSettings, Surroundings};
use rig_plant::emulated::{Nameplate, upload};

/// Shows the rig live on a web page of this computer: plots, arm, start, stop, recordings.
///
/// Without --port and --probe it shows the emulated rig, in real time. The same numbers go to PlotJuggler, Lichtblick
/// and Foxglove with --foxglove and --plotjuggler.
///
/// An armed rig is stopped when no page has been open for 3 s. Stop on the page does not replace an emergency stop.
///
/// Security: the page is served on the loopback address alone, unless --token is given. Then every request needs the
/// token. Requests of other web pages are refused by their Origin, and names that were made to point here by their
/// Host, so that no other page in your browser can arm the rig. The connection is not encrypted.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Serial port of the rig, such as /dev/ttyACM0 or COM3
    #[arg(long, conflicts_with_all = ["probe", "emulated"])]
    port: Option<String>,
    /// The board's debug probe instead of its serial port
    #[arg(long, conflicts_with = "emulated")]
    probe: bool,
    /// The emulated rig instead of hardware (the default)
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
    /// Trajectory to load (.toml by `rig excite`); the page can load another
    #[arg(long)]
    trajectory: Option<PathBuf>,
    /// Position of the link at the start, rad; an incremental encoder cannot measure it. Without it the emulated link
    /// is at -1.5708
    #[arg(long)]
    home: Option<f32>,
    /// Compensate friction and effects with the values of the description
    #[arg(long, requires = "robot")]
    precompensation: bool,
    /// Seed of the emulated rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Address of the page; port 0 takes any free one. Other than loopback only with --token
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// Token that every request must carry, at least 12 letters and digits; open the page with ?token=TEXT once
    #[arg(long, value_name = "TEXT")]
    token: Option<String>,
    /// Serve PlotJuggler, Lichtblick and Foxglove by the Foxglove WebSocket protocol, read-only [without ADDR:
    /// 127.0.0.1:8765]
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    foxglove: Option<SocketAddr>,
    /// Send JSON over UDP to PlotJuggler [without ADDR: 127.0.0.1:9870]
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:9870")]
    plotjuggler: Option<SocketAddr>,
    /// Folder of the recordings live-1.csv, live-2.csv and so on that the page starts
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A sentence about an address, the port, a request that the rig refused, or a file.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    if !args.out.is_dir() {
        return Err(CommandError::Sentence(format!(
            "--out {} is not a folder; recordings of the page are written into one.",
            args.out.display()
        )));
    }
    let robot = match &args.robot {
        Some(path) => {
            let robot = described(path, &args.chain, ui)?.robot;
            robot.without_followers("The rig, which has one link,")?;
            Some(robot)
        }
        None => None,
    };
    let hardware = args.port.is_some() || args.probe;
    let home = args.home.or((!hardware).then_some(-FRAC_PI_2 as f32));
    let mut settings: Vec<RequestBody> = home.map(RequestBody::SetPosition).into_iter().collect();
    if let Some(robot) = &robot {
        settings.extend(if args.precompensation {
            uploaded(robot, true, ui)?
        } else {
            upload::settings(&Nameplate::from_robot(robot)?, false)
        });
    }
    let motion = match &args.trajectory {
        Some(path) => {
            let name = path.display().to_string();
            Some(Motion::new(
                &TrajectoryFile::load(path)?,
                &name,
                robot.as_ref(),
            )?)
        }
        None => None,
    };
    let listeners = Listeners::open(Addresses {
        listen: args.listen,
        token: args.token.clone(),
        foxglove: args.foxglove,
        plotjuggler: args.plotjuggler,
    })?;
    let mut rig = RigSettings {
        source: args
            .port
            .clone()
            .unwrap_or_else(|| "debug probe".to_owned()),
        settings,
        motion,
        robot,
        folder: args.out.clone(),
    };
    if let Some(name) = &args.port {
        show(SerialLine::open(name, args.baud)?, rig, listeners, ui)
    } else if args.probe {
        show(open_probe()?, rig, listeners, ui)
    } else {
        rig.source = "emulated rig".to_owned();
        let robot = described_or_template(rig.robot.clone())?;
        let emulated = emulated_at(&robot, [args.seed, 1], args.home)?;
        doubt(
            &emulated,
            &robot,
            rig.motion.as_ref().map(|one| &one.joint),
            ui,
        )?;
        if args.home.is_none() {
            ui.note("the emulated link hangs, at -1.5708 rad; --home puts it elsewhere.");
        }
        show(Paced::new(EmulatedPort::new(emulated)), rig, listeners, ui)
    }
}

fn show<P: Port>(
    port: P,
    settings: RigSettings,
    listeners: Listeners,
    ui: &Ui,
) -> Result<(), CommandError> {
    let mut session = open(port, settings.robot.as_ref())?;
    interrupts::listen(None)?;
    for line in lines(listeners.addresses(), &settings.source) {
        ui.answer(&line);
    }
    // A view has no end that a script can wait for.
    if ui.is_json() {
        ui.print_summary();
    }
    let losses = listeners.run(&mut session, settings, &Terminal)?;
    ui.say(&format!("{losses}"));
    Ok(())
}

/// Returns what is served where.
fn lines(addresses: &Addresses, source: &str) -> Vec<String> {
    let query = match &addresses.token {
        Some(token) => format!("/?token={token}"),
        None => String::new(),
    };
    let mut lines = vec![format!(
        "{source}: http://{}{query} (Ctrl-C ends)",
        addresses.listen
    )];
    if let Some(address) = addresses.foxglove {
        lines.push(format!("Foxglove WebSocket: ws://{address}{query}"));
    }
    if let Some(address) = addresses.plotjuggler {
        lines.push(format!("JSON over UDP to {address}"));
    }
    lines
}

/// The terminal around the live view.
struct Terminal;

impl Surroundings for Terminal {
    fn ended(&self) -> bool {
        interrupts::asked()
    }

    fn writing(&self, hidden: Option<&Path>) {
        interrupts::writing(hidden);
    }

    fn say(&self, sentence: &str) {
        // Not `Ui::say`, which ends the program if nobody reads any more: the rig may be moving.
        let _unread = writeln!(std::io::stdout(), "{sentence}");
    }
}
