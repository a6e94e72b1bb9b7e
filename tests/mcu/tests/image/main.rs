//! The firmware's own image on the emulated board, as `firmware/build` makes it.
//!
//! The image is taken from RIG_FIRMWARE_ELF or, without it, from where the build puts it.
#![allow(clippy::unwrap_used, clippy::panic)]

mod boot;
mod budget;
mod circle;
mod crash;
mod debugger;
mod dynamics;
mod faults;
mod first_access;
mod hardware;
mod identification;
mod ill;
mod line;
mod requests;
mod self_test;
mod stop_switch;
mod storage;
mod tick_watch;
mod wires;

use std::path::PathBuf;
use std::time::Duration;

use rig_link::{EmulatedPort, Session, SessionSettings};
use rig_mcu::image::Image;
use rig_mcu::rig::{EmulatedBoard, Line, power_on};
use rig_plant::PlantConfig;
use rig_shared::safety::SnapshotSample;
use rig_shared::wire::message::{Health, Report, RequestBody};
use rig_tests::{calibrated, excitation, snapshot, wait};

/// A session with the emulated board.
type BoardSession = Session<EmulatedPort<Line>>;

/// The image under test.
fn image() -> Image {
    image_of("RIG_FIRMWARE_ELF", "rig-firmware")
}

/// An image: that of the environment variable, or `name` from where the build puts it.
fn image_of(variable: &str, name: &str) -> Image {
    let path = path_of(variable, name);
    Image::read(&path).unwrap_or_else(|error| panic!("{error} Build it with firmware/build first."))
}

fn path_of(variable: &str, name: &str) -> PathBuf {
    std::env::var_os(variable).map_or_else(
        || {
            let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
                || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../target"),
                PathBuf::from,
            );
            target.join("thumbv7em-none-eabihf/chip").join(name)
        },
        PathBuf::from,
    )
}

/// A laboratory rig whose torque constant the firmware knows: no motion of the rig could show an error in it.
fn plant(seed: u64) -> PlantConfig {
    let mut plant = PlantConfig::laboratory(seed);
    let (config, _) = rig_firmware::nameplate::one_link();
    plant.motor.torque_constant = f64::from(config.drive.torque_constant);
    plant
}

/// A board that has just been powered up.
fn powered(seed: u64) -> EmulatedBoard {
    power_on(image(), plant(seed), seed).unwrap()
}

/// Greets a board.
fn greeted(board: EmulatedBoard) -> BoardSession {
    let line = Line {
        board,
        heard: None,
        noise: None,
    };
    let mut port = EmulatedPort::new(line);
    // The port listens once the firmware has set it up.
    port.device_mut().board.run_for(0.05).unwrap();
    Session::open(port, SessionSettings::default()).unwrap()
}

/// A board, calibrated, told where its link hangs.
fn bench(seed: u64) -> BoardSession {
    let mut line = greeted(powered(seed));
    calibrated(&mut line);
    place(&mut line);
    line
}

/// Tells the rig where its link hangs.
fn place(line: &mut BoardSession) {
    let at = board(line).with_board(|board| board.plant().truth().position);
    line.request(RequestBody::SetPosition(at as f32)).unwrap();
}

/// The board behind a session.
fn board(line: &mut BoardSession) -> &mut EmulatedBoard {
    &mut line.port_mut().device_mut().board
}

/// A board in the middle of an excitation.
fn moving(seed: u64) -> BoardSession {
    let mut line = bench(seed);
    line.request(RequestBody::SetTrajectory(excitation(seed, 5, 2)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 1.6);
    assert!(board(&mut line).with_board(|board| board.bridge().enabled));
    line
}

/// Waits until the link hangs still: a moving one is not armed.
fn hang_still(line: &mut BoardSession) {
    for _ in 0..100 {
        let velocity = board(line).with_board(|board| board.plant().truth().velocity);
        if velocity.abs() < 0.05 {
            return;
        }
        wait(line, 0.1);
    }
    panic!("the link still moves");
}

/// Waits for a report.
fn awaited<T>(line: &mut BoardSession, wanted: impl Fn(&Report) -> Option<T>) -> T {
    for _ in 0..5000 {
        let report = line.next_report(Duration::from_secs(3)).unwrap();
        if let Some(found) = report.as_ref().and_then(&wanted) {
            return found;
        }
    }
    panic!("the report never came");
}

/// The next health report.
fn health(line: &mut BoardSession) -> Health {
    awaited(line, |report| match report {
        Report::Health(health) => Some(*health),
        _ => None,
    })
}

/// The burst over the wire.
fn captured(line: &mut BoardSession) -> Vec<SnapshotSample> {
    line.request(RequestBody::GetCapture).unwrap();
    let (mut ticks, mut total) = (Vec::new(), usize::MAX);
    while ticks.len() < total {
        let report = line.next_report(Duration::from_millis(500)).unwrap();
        if let Report::Capture(part) = report.unwrap() {
            assert_eq!(usize::from(part.first), ticks.len());
            total = usize::from(part.total);
            ticks.extend(part.samples);
        }
    }
    ticks
}
