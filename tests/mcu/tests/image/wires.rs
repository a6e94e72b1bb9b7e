//! Sensors as unkind as real ones: comparators with delay that see the ripple, edges of the encoder that are lost.

use rig_mcu::time::{NEVER, from_seconds};
use rig_shared::safety::{Fault, FaultRecord};
use rig_shared::wire::message::RequestBody;
use rig_tests::wait;

use crate::faults::snapshot_of_fault;
use crate::{BoardSession, board, moving};

/// Threshold of the comparators, A: 744 codes.
const THRESHOLD: f64 = 744.0 * 3.3 / 4096.0 / 0.1;

/// A mean current through the motor from now on, while the processor stands; true if the outputs are off `after` seconds.
fn is_off(line: &mut BoardSession, current: f64, after: f64) -> bool {
    let begin = board(line).with_chip(|chip| {
        chip.board.faults.short = Some(current);
        chip.held_until = NEVER;
        chip.see_board();
        chip.work.now
    });
    board(line).run_until(begin + from_seconds(after)).unwrap();
    board(line).with_chip(|chip| !chip.timer(1).main_output())
}

/// Filter of the comparators' break input, s: 16 · 8 cycles.
const FILTER: f64 = 128.0 / 170e6;

/// A current beyond the threshold: the outputs go off by the delay of amplifier and comparator and the filter later, not
/// before.
#[test]
fn the_comparators_act_after_their_delay() {
    for (current, seed) in [(8.0, 60), (-8.0, 61)] {
        let mut line = moving(seed);
        board(&mut line).with_board(|b| b.comparator_delay = 0.6e-6);
        assert!(!is_off(&mut line, current, 0.5e-6 + FILTER), "{current} A");
        let on = board(&mut line).with_chip(|chip| chip.work.now);
        board(&mut line)
            .run_until(on + from_seconds(0.2e-6))
            .unwrap();
        assert!(!board(&mut line).with_chip(|chip| chip.timer(1).main_output()));
    }
}

/// A mean current below the threshold whose ripple is beyond it switches the outputs off; one whose ripple stays below does
/// not.
#[test]
fn the_comparators_see_the_ripple_of_the_current() {
    for (share, expected) in [(0.5, true), (1.5, false)] {
        let mut line = moving(62);
        let mut ripple = 0.0;
        for _ in 0..200 {
            ripple = board(&mut line).with_board(|b| b.ripple().extremes()[1]);
            if ripple > 0.1 {
                break;
            }
            wait(&mut line, 0.01);
        }
        assert!(ripple > 0.1, "{ripple} A");
        let mean = THRESHOLD - share * ripple;
        assert_eq!(is_off(&mut line, mean, 5e-6), expected, "{mean} A");
    }
}

/// The encoder loses edges in a motion; the fault within the next 2.4 s, if there is one.
fn fault_after_losing(edges: i64) -> Option<FaultRecord> {
    let mut line = moving(63);
    board(&mut line).with_board(|b| b.faults.lost_edges = edges);
    let fault = (0..8).find_map(|_| {
        wait(&mut line, 0.3);
        line.request(RequestBody::KeepAlive).unwrap();
        snapshot_of_fault(&mut line)
    });
    assert_eq!(board(&mut line).with_board(|b| b.faults.lost_edges), 0);
    fault
}

/// Edges that the encoder loses are found at the next index, with their number. Within its tolerance (four counts, and half of
/// those of a tick) the count is corrected there, and the motion goes on.
#[test]
fn lost_edges_are_found_at_the_index() {
    let record = fault_after_losing(24).unwrap();
    println!("{record:?}");
    assert_eq!(record.fault, Fault::EncoderSignal);
    // The speed changes meanwhile by some counts a tick.
    assert!((record.value.abs() - 24.0).abs() < 4.0, "{record:?}");
    assert_eq!(fault_after_losing(4), None);
}
