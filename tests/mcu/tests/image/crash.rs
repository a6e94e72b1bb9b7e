//! What the next start tells of a failure of the program, kind by kind.

use rig_mcu::cpu::{Cpu, Register};
use rig_mcu::map;
use rig_mcu::peripheral::rcc::Cause;
use rig_shared::wire::message::{Crash, CrashKind, FILE_BYTES, ResetCause};
use rig_tests::wait;

use crate::faults::off_after;
use crate::{BoardSession, board, health, moving};

/// Asserts that a record names an instruction of the image: the one that the failure interrupted.
pub(crate) fn assert_interrupted_code(line: &mut BoardSession, crash: &Crash) {
    let image = board(line).image();
    assert!(image.function_at(crash.pc).is_some(), "{crash:x?}");
    assert!(crash.lr != 0, "{crash:x?}");
}

/// Bytes of the image.
fn bytes(line: &mut BoardSession, address: u32, size: u32) -> Vec<u8> {
    (address..address + size)
        .map(|at| board(line).word(at & !3).to_le_bytes()[at as usize & 3])
        .collect()
}

/// A place in the sources that the image itself holds for one of its panics: its address, file and line
/// (`core::panic::Location`: start and length of the name, line, column).
fn place_of_a_panic(line: &mut BoardSession) -> (u32, String, u32) {
    let [start, end] = [map::FLASH.start, map::FLASH.start + 0x4_0000];
    for at in (start..end - 16).step_by(4) {
        let [name, size, row, column] = [0, 4, 8, 12].map(|k| board(line).word(at + k));
        let plausible = (start..end).contains(&name)
            && (FILE_BYTES as u32 + 2..200).contains(&size)
            && (1..10_000).contains(&row)
            && (1..200).contains(&column);
        if plausible && let Ok(text) = String::from_utf8(bytes(line, name, size)) {
            let file = text.trim_end_matches('\0');
            if file.is_ascii() && file.ends_with(".rs") {
                return (at, file.to_owned(), row);
            }
        }
    }
    panic!("the image has no place of a panic");
}

/// A panic, met by the program at any place: the bridge goes off at once and stays so, and the next start tells file and
/// line.
#[test]
fn a_panic_switches_off_and_its_file_and_line_are_told() {
    let mut line = moving(42);
    let (place, file, row) = place_of_a_panic(&mut line);
    let emulated = board(&mut line);
    // Takes nothing but the place, whatever the compiler has made of its arguments.
    let panic = ["panic_const_div_by_zero", "panic_bounds_check"]
        .iter()
        .find_map(|name| emulated.image().function_ending(name))
        .unwrap();
    for register in 0..4 {
        emulated.cpu().set(Register::General(register), place);
    }
    emulated.cpu().set(Register::Pc, panic);
    assert!(off_after(&mut line, 1e-4).is_some());
    board(&mut line).run_for(0.1).unwrap();
    let emulated = board(&mut line);
    assert!(matches!(emulated.resets[..], [(_, Cause::Software)]));
    assert!(emulated.with_board(|b| b.enable_edges.len() == 2 && !b.bridge().enabled));
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Software);
    let crash = report.crash.unwrap();
    println!("{file}:{row} told as {}:{}", crash.file(), crash.line);
    assert_eq!((crash.kind, crash.line), (CrashKind::Panic, row));
    assert_eq!(crash.file(), &file[file.len() - FILE_BYTES..]);
    // The next start has a reason of its own.
    board(&mut line).reset(Cause::Pin);
    wait(&mut line, 0.1);
    assert_eq!(health(&mut line).crash, None);
}

/// An instruction that the processor cannot carry out: the next start tells where it was and what it wanted.
#[test]
fn a_processor_fault_is_recorded_with_its_place() {
    let mut line = moving(45);
    let emulated = board(&mut line);
    emulated.faults_expected = true;
    // No memory there.
    let nowhere = 0x0A00_0100;
    emulated.cpu().set(Register::Lr, 0x0800_0201);
    emulated.cpu().set(Register::Pc, nowhere);
    assert!(off_after(&mut line, 1e-4).is_some());
    wait(&mut line, 0.1);
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Software);
    let crash = report.crash.unwrap();
    println!("{crash:x?}");
    assert_eq!(crash.kind, CrashKind::ProcessorFault);
    assert_eq!((crash.pc & !1, crash.lr), (nowhere, 0x0800_0201));
    assert!(crash.status != 0 && crash.address == nowhere, "{crash:x?}");
}

/// An exception that the program does not use: its number and the place that it interrupted.
#[test]
fn an_unexpected_exception_is_recorded_with_its_number_and_place() {
    const PEND_SV: u16 = 14;
    let mut line = moving(47);
    board(&mut line).with_chip(|chip| chip.nvic.pend(PEND_SV));
    assert!(off_after(&mut line, 1e-4).is_some());
    wait(&mut line, 0.1);
    let crash = health(&mut line).crash.unwrap();
    println!("{crash:x?}");
    let expected = (CrashKind::UnexpectedException, u32::from(PEND_SV));
    assert_eq!((crash.kind, crash.line), expected);
    assert_interrupted_code(&mut line, &crash);
}
