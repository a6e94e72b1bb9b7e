//! Power on, determinism, standstill.

use core::f64::consts::TAU;
use std::time::Duration;

use rig_link::{EmulatedPort, Session, SessionSettings};
use rig_mcu::cpu::Memory;
use rig_mcu::map;
use rig_mcu::rig::{EmulatedBoard, Line};
use rig_shared::wire::message::{Report, RequestBody, ResetCause, SettingsOrigin};
use rig_tests::{calibrated, excitation, wait};

use crate::{
    BoardSession, awaited, bench, board, captured, greeted, health, image, path_of, place, powered,
};

#[test]
fn it_boots_samples_at_ten_kilohertz_and_moves_nothing() {
    let mut board = powered(1);
    board.run_for(0.1).unwrap();
    let (before, _) = board.with_chip(|chip| (chip.triggers, chip.adc.missed));
    board.run_for(1.0).unwrap();
    let (after, missed) = board.with_chip(|chip| (chip.triggers, chip.adc.missed));
    assert_eq!(after - before, 10_000, "triggers in a second");
    assert_eq!(missed, 0);
    assert_eq!(board.with_board(|b| b.enable_edges.clone()), []);
    let baud = board.with_chip(|chip| chip.lpuart.baud()).unwrap();
    assert!((baud / 921_600.0 - 1.0).abs() < 0.01, "{baud} bit/s");
    assert_eq!(board.resets, []);
    let mut line = greeted(board);
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Power);
    assert_eq!(report.settings, SettingsOrigin::Defaults);
    assert!(report.crystal);
    assert!(
        report.boost,
        "170 MHz at the core voltage for 150 MHz (PWR_CR5.R1MODE)"
    );
    assert_eq!(report.crash, None);
}

/// Bytes of a conversation of seven seconds: armed, in motion, at rest again.
fn conversation(seed: u64) -> Vec<u8> {
    let line = Line {
        board: powered(seed),
        heard: Some(Vec::new()),
        noise: None,
    };
    let mut port = EmulatedPort::new(line);
    port.device_mut().board.run_for(0.05).unwrap();
    let mut line = Session::open(port, SessionSettings::default()).unwrap();
    calibrated(&mut line);
    line.request(RequestBody::StartStream).unwrap();
    line.request(RequestBody::SetTrajectory(excitation(2, 2, 1)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.3);
    line.request(RequestBody::Start).unwrap();
    // Two ramps of 2 s and a period of 2 s.
    wait(&mut line, 6.5);
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    assert_eq!(board(&mut line).failure(), None);
    line.port_mut().device_mut().heard.take().unwrap()
}

#[test]
fn two_runs_give_the_same_bytes_and_another_rig_gives_others() {
    let first = conversation(2);
    assert!(first.len() > 150_000, "{} bytes", first.len());
    assert!(first == conversation(2));
    assert!(first != conversation(3));
}

/// Half a minute at rest: the cycle counter wraps (25 s).
#[test]
fn half_a_minute_at_rest() {
    at_rest(30.0);
}

#[test]
#[ignore = "takes half an hour of one processor: docs/firmware.md says how to run it"]
fn an_hour_at_rest() {
    at_rest(3600.0);
}

/// At rest under control: telemetry loses nothing, nothing drifts away.
fn at_rest(seconds: f64) {
    let mut line = bench(4);
    line.request(RequestBody::StartStream).unwrap();
    line.request(RequestBody::Arm).unwrap();
    let before = board(&mut line).with_board(|b| b.plant().truth().position);
    wait(&mut line, seconds);
    let after = board(&mut line).with_board(|b| b.plant().truth().position);
    assert!((after - before).abs() < 2e-3, "{before} to {after} rad");
    let report = health(&mut line);
    assert_eq!((report.bad_requests, report.dropped), (0, 0));
    assert!(
        line.next_report(Duration::from_millis(100))
            .unwrap()
            .is_some()
    );
    assert_eq!(line.frames().bad_crc + line.frames().bad_cobs, 0);
    assert_eq!(board(&mut line).resets, []);
    let longest = board(&mut line).with_chip(|chip| chip.iwdg.longest());
    assert!(rig_mcu::time::to_seconds(longest) < 0.1);
}

/// Places in RAM whose value follows `expected` from one look to the next, a second apart: counters of time. They may
/// be a few counts off, for triggers that came before the first interrupt.
fn counters(
    board: &mut EmulatedBoard,
    size: usize,
    expected: impl Fn(&mut EmulatedBoard) -> u64,
) -> Vec<u32> {
    let mut found: Vec<u32> = (map::RAM).step_by(size).collect();
    for _ in 0..3 {
        let now = expected(board);
        found.retain(|address| {
            let mut bytes = [0; 8];
            let known = board.cpu().load(*address, &mut bytes[..size]);
            known && u64::from_le_bytes(bytes).abs_diff(now) <= 8
        });
        board.run_for(1.0).unwrap();
    }
    found
}

/// The control tick's counter, put shortly before 2³¹: the rig works on across it. The clock of the tasks is left
/// alone: they would make up for every period that it jumped over.
#[test]
fn two_to_the_thirty_first_ticks_pass_unnoticed() {
    let mut line = bench(6);
    let emulated = board(&mut line);
    let first = emulated.with_chip(|chip| chip.triggers);
    let ticks = counters(emulated, 8, |board| board.with_chip(|chip| chip.triggers));
    assert!(!ticks.is_empty() && first > 5000, "{ticks:x?}");
    let near = (1_u64 << 31) - 3000;
    for address in &ticks {
        assert!(emulated.cpu().store(*address, &near.to_le_bytes()));
    }
    line.request(RequestBody::StartStream).unwrap();
    line.request(RequestBody::Arm).unwrap();
    let mut passed = Vec::new();
    for _ in 0..150 {
        if let Some(Report::Batch(batch)) = line.next_report(Duration::from_millis(100)).unwrap() {
            passed.push(batch.first_tick);
        }
    }
    assert!(
        passed[0] < 1 << 31 && passed.last().is_some_and(|t| *t > 1 << 31),
        "{passed:?}"
    );
    assert!(
        passed.windows(2).all(|pair| pair[1] - pair[0] == 80),
        "{passed:?}"
    );
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    assert_eq!(board(&mut line).resets, []);
    assert_eq!(health(&mut line).dropped, 0);
}

/// The motor's encoder counts by the telemetry and by the rig's truth, at rest.
fn counts(line: &mut BoardSession) -> [f64; 2] {
    let told = awaited(line, |report| match report {
        Report::Batch(batch) => batch.samples.last().map(|sample| sample.position_sum),
        _ => None,
    });
    let shaft = board(line).with_board(|b| b.plant().truth().motor_position);
    let config = board(line).with_board(|b| b.plant().config().clone());
    let per_turn = config.sensors.encoder.counts_per_turn;
    // A window is ten ticks.
    [told as f64 / 10.0, shaft / TAU * per_turn]
}

/// TIM2 wraps where it starts, and with it the 16 bits that the control tick takes of it: there and back many times.
#[test]
fn a_wrapping_encoder_counter_loses_no_count() {
    let mut emulated = powered(8);
    emulated.with_chip(|chip| {
        chip.readings = Some(Vec::new());
        // Without index nothing puts a lost count right.
        chip.board.faults.index_cut = true;
    });
    let mut line = greeted(emulated);
    calibrated(&mut line);
    place(&mut line);
    line.request(RequestBody::StartStream).unwrap();
    let motion = excitation(8, 5, 1);
    let seconds = motion.duration_micros() as f64 * 1e-6;
    line.request(RequestBody::SetTrajectory(motion)).unwrap();
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.2);
    let before = counts(&mut line);
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, seconds + 0.5);
    let after = counts(&mut line);
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));

    let readings = board(&mut line).with_chip(|chip| chip.readings.take());
    let raw: Vec<u32> = readings
        .unwrap()
        .iter()
        .filter(|reading| reading.address == 0x4000_0024)
        .map(|reading| reading.value)
        .collect();
    let wrapped = |pair: &&[u32]| pair[0].abs_diff(pair[1]) > 1 << 31;
    let wraps = raw.windows(2).filter(wrapped).count();
    let [told, truth] = [0, 1].map(|k| after[k] - before[k]);
    println!("{wraps} wraps; {told:.1} counts told, {truth:.1} turned");
    assert!(wraps >= 5, "{wraps}");
    assert!((told - truth).abs() < 3.0, "{told} {truth}");
}

/// Single control ticks around an instant that the host names, over the wire.
#[test]
fn a_capture_holds_every_tick_in_a_row() {
    let mut line = bench(7);
    line.request(RequestBody::Capture(100)).unwrap();
    wait(&mut line, 0.1);
    let ticks = captured(&mut line);
    assert!(ticks.len() > 400, "{} ticks", ticks.len());
    assert!(
        ticks
            .windows(2)
            .all(|pair| pair[1].tick == pair[0].tick + 1)
    );
}

/// The file for the drive of the ST-LINK, which writes it from the start of the flash on: what the emulated board runs.
#[test]
fn the_bin_file_is_the_flash_that_the_image_loads() {
    let path = path_of("RIG_FIRMWARE_ELF", "rig-firmware").with_extension("bin");
    let bytes = std::fs::read(&path).unwrap();
    let flash = image().flash;
    assert!(bytes.len() > 100_000 && bytes.len() <= 256 * 1024);
    let (loaded, rest) = flash.split_at(bytes.len());
    assert!(loaded == bytes && rest.iter().all(|byte| *byte == 0xFF));
    // Stack and first instruction.
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert!((0x2000_0000..0x2002_0000).contains(&word(0)));
    assert!((0x0800_0000..0x0804_0000).contains(&word(4)) && word(4) & 1 == 1);
}
