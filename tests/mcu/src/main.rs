//! Runs the firmware's image on the emulated board, with a pseudo-terminal as its serial port. Every command of the
//! host works with it as with a real rig.

use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use rig_mcu::chip::{CONTROL_EXCEPTION, Chip};
use rig_mcu::emulation::EmulationError;
use rig_mcu::image::{Image, ImageError};
use rig_mcu::rig::{EmulatedBoard, power_on};
use rig_mcu::unicorn::EngineError;
use rig_plant::PlantConfig;
use serialport::{SerialPort, TTYPort};
use thiserror::Error;

/// Runs the firmware's image on an emulated board.
#[derive(Parser)]
#[command(name = "rig-mcu")]
struct Arguments {
    /// The firmware's ELF file; firmware/build makes it and says where it is.
    elf: PathBuf,
    /// Which rig hangs on the board: 0 the one of the documentation, others are drawn at random.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Emulated seconds to run; without end where not given.
    #[arg(long)]
    seconds: Option<f64>,
    /// As fast as the computer can, instead of at the pace of real time.
    #[arg(long)]
    fast: bool,
    /// No serial port: what the board sends is only counted.
    #[arg(long)]
    no_port: bool,
}

#[derive(Debug, Error)]
enum Failure {
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error("The emulated board stopped: {0}.")]
    Emulation(#[from] EmulationError),
    #[error("The pseudo-terminal failed ({0}): run with --no-port to do without.")]
    Port(#[from] serialport::Error),
    #[error("The pseudo-terminal failed ({0}): run with --no-port to do without.")]
    Line(#[from] std::io::Error),
}

/// Emulated time between two readings of the serial port.
const SLICE: Duration = Duration::from_millis(1);

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("rig-mcu: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let image = Image::read(&arguments.elf)?;
    println!(
        "flash {} bytes, statics in RAM {} bytes",
        image.flash_used, image.ram_used
    );
    let plant = match arguments.seed {
        0 => PlantConfig::default(),
        seed => PlantConfig::laboratory(seed),
    };
    let mut board = power_on(image, plant, arguments.seed)?;
    let mut terminal = if arguments.no_port {
        None
    } else {
        // Only the host holds the far end: a second holder would keep the lock that the first host leaves.
        let (mut master, slave) = TTYPort::pair()?;
        master.set_timeout(Duration::from_millis(1))?;
        println!("serial port {}", slave.name().unwrap_or_default());
        Some(master)
    };
    let started = Instant::now();
    let mut time = Duration::ZERO;
    let end = arguments.seconds.map(Duration::from_secs_f64);
    let mut bytes = 0_usize;
    let result = loop {
        if end.is_some_and(|end| time >= end) {
            break Ok(());
        }
        if let Some(master) = &mut terminal {
            listen(master, &mut board)?;
        }
        if let Err(failure) = board.run_for(SLICE.as_secs_f64()) {
            break Err(failure);
        }
        time += SLICE;
        let sent = board.with_chip(Chip::take_sent);
        bytes += sent.len();
        if let Some(master) = &mut terminal {
            tell(master, &sent, arguments.fast);
        }
        if !arguments.fast {
            std::thread::sleep(time.saturating_sub(started.elapsed()));
        }
    };
    summary(&mut board, started.elapsed(), bytes);
    Ok(result?)
}

fn listen(master: &mut TTYPort, board: &mut EmulatedBoard) -> Result<(), Failure> {
    let waiting = master.bytes_to_read()? as usize;
    if waiting > 0 {
        let mut bytes = vec![0; waiting];
        let count = match master.read(&mut bytes) {
            // The far end was closed between two readings. The next reader gets the last data.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
            read => read?,
        };
        bytes.truncate(count);
        board.with_chip(|chip| chip.send(&bytes));
    }
    Ok(())
}

/// Writes to the line. Without a listener the data are lost. If `patient`, waits for a slow listener, because the board
/// has its own time.
fn tell(master: &mut TTYPort, bytes: &[u8], patient: bool) {
    let mut rest = bytes;
    let patience = Instant::now() + Duration::from_millis(if patient { 100 } else { 1 });
    while !rest.is_empty() {
        match master.write(rest) {
            Ok(count) => rest = rest.get(count..).unwrap_or_default(),
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {
                if Instant::now() > patience {
                    return;
                }
            }
            // The far end is not open.
            Err(_) => return,
        }
    }
}

fn summary(board: &mut EmulatedBoard, wall: Duration, bytes: usize) {
    let seconds = board.seconds();
    let work = board.with_chip(|chip| chip.work);
    let cost = board.cost(CONTROL_EXCEPTION);
    let (used, size) = board.stack();
    let mean = |sum: u64| sum as f64 / cost.count.max(1) as f64;
    println!(
        "{seconds:.3} s emulated in {:.2} s; {} instructions, {:.1} million a second",
        wall.as_secs_f64(),
        work.instructions,
        work.instructions as f64 / wall.as_secs_f64() * 1e-6
    );
    println!(
        "control tick: {} times, {:.1} instructions on average, {} at worst; {:.1} and {} cycles (estimated)",
        cost.count,
        mean(cost.instructions),
        cost.worst_instructions,
        mean(cost.cycles),
        cost.worst_cycles
    );
    let share = |part: u64| 100.0 * part as f64 / work.cycles.max(1) as f64;
    println!(
        "of all cycles {:.0} % wait for code from flash, {:.0} % refill the pipeline, {:.0} % wait for peripherals",
        share(work.fetches),
        share(work.refills),
        share(work.bridge)
    );
    println!("stack {used} of {size} bytes; {bytes} bytes sent");
}
