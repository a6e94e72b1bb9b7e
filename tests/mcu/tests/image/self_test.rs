//! The self-test of the protection at the start: what it finds keeps the rig from being armed.

use rig_link::LinkError;
use rig_mcu::board::BoardFaults;
use rig_shared::wire::message::{Bounded, Refusal, RequestBody, SelfTest};
use rig_tests::{calibrated, wait};

use crate::{bench, board, greeted, hang_still, place, powered};

#[test]
fn a_protection_that_does_not_act_keeps_the_rig_disarmed() {
    type Fault = fn(&mut BoardFaults);
    let cases: [(Fault, Option<SelfTest>); 3] = [
        (|_| {}, None),
        (
            |faults| faults.comparators_dead = true,
            Some(SelfTest::UpperComparator),
        ),
        (
            |faults| faults.second_sense_open = true,
            Some(SelfTest::LowerComparator),
        ),
    ];
    for (inject, expected) in cases {
        let mut emulated = powered(95);
        emulated.with_board(|b| inject(&mut b.faults));
        let mut line = greeted(emulated);
        calibrated(&mut line);
        place(&mut line);
        hang_still(&mut line);
        // The bridge slept all the time.
        assert!(board(&mut line).with_board(|b| b.enable_edges.is_empty()));
        let armed = line.request(RequestBody::Arm);
        match expected {
            None => assert!(armed.is_ok(), "{armed:?}"),
            Some(part) => {
                let Err(LinkError::Refused { refusal, .. }) = armed else {
                    panic!("armed without its {part:?}");
                };
                assert_eq!(refusal, Refusal::SelfTestFailed(part));
            }
        }
    }
}

/// 0.8 A read with the bridge off, as through a shorted half bridge: refused with value and bound.
#[test]
fn a_current_with_the_bridge_off_keeps_the_rig_disarmed() {
    let mut line = bench(96);
    board(&mut line).with_board(|b| b.faults.stuck[0] = Some(2048 + 100));
    wait(&mut line, 0.01);
    let Err(LinkError::Refused { refusal, .. }) = line.request(RequestBody::Arm) else {
        panic!("armed");
    };
    println!("{refusal:?}");
    assert!(matches!(
        refusal,
        Refusal::OutOfBounds {
            quantity: Bounded::IdleCurrent,
            value,
            bound: 0.5,
        } if (value - 0.8).abs() < 0.02
    ));
    board(&mut line).with_board(|b| b.faults.stuck[0] = None);
    wait(&mut line, 0.01);
    line.request(RequestBody::Arm).unwrap();
}
