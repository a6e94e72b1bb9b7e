//! Errors of the serial line from the host: the link goes on, every error is counted, and no request is lost unanswered.

use rig_mcu::line_noise::LineNoise;
use rig_mcu::peripheral::lpuart::LineError;
use rig_shared::safety::Limits;
use rig_shared::wire::encode;
use rig_shared::wire::message::{Request, RequestBody};
use rig_tests::wait;

use crate::faults::off_after;
use crate::{bench, board, health, moving};

/// A command to switch off, once for each of its bytes and each kind of error, while the rig moves. They are more bytes than
/// the ring of the receiver has, so that it is filled more than once between errors of any place.
#[test]
fn a_byte_with_an_error_is_counted_and_stops_nothing() {
    let mut line = moving(34);
    let before = health(&mut line);
    let mut frame = [0; 64];
    let disarm = Request {
        id: 0x8000,
        body: RequestBody::Disarm,
    };
    let length = encode(&disarm, &mut frame).unwrap();
    const ROUNDS: usize = 12;
    let mut errors = 0;
    for _ in 0..ROUNDS {
        for damaged in 0..length - 1 {
            for error in [LineError::Framing, LineError::Noise] {
                board(&mut line).with_chip(|chip| {
                    for (place, byte) in frame[..length].iter().enumerate() {
                        chip.send_byte(*byte, (place == damaged).then_some(error));
                    }
                });
                errors += 1;
                wait(&mut line, 2e-3);
            }
        }
        // The host is heard all the time.
        line.request(RequestBody::KeepAlive).unwrap();
    }
    assert!(errors as usize * length > 1024, "{errors} errors");
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    let after = health(&mut line);
    assert_eq!(after.line_errors - before.line_errors, errors);
    assert_eq!(after.bad_requests - before.bad_requests, errors);
    // As it should have come.
    board(&mut line).with_chip(|chip| chip.send(&frame[..length]));
    assert!(off_after(&mut line, 0.01).is_some());
}

/// A line on which one byte of a hundred is wrong: every request is carried out, after repetitions.
#[test]
fn a_noisy_line_loses_no_request() {
    let mut line = bench(35);
    let (_, own) = rig_firmware::nameplate::one_link();
    let sound = health(&mut line);
    assert_eq!((sound.line_errors, sound.bad_requests), (0, 0));
    line.port_mut().device_mut().noise = Some(LineNoise::new(0.01, 35));
    for k in 0..100 {
        let limits = Limits {
            velocity: own.limits.velocity * (1.0 - 1e-3 * k as f32),
            ..own.limits
        };
        line.request(RequestBody::SetLimits(limits)).unwrap();
    }
    let noise = line.port_mut().device_mut().noise.take().unwrap();
    // Reports that came meanwhile are older.
    wait(&mut line, 0.1);
    let report = health(&mut line);
    println!("{noise:?}: {report:?}");
    assert!(noise.flagged > 10 && noise.unflagged > 10);
    assert_eq!(report.line_errors, noise.flagged);
    assert!(report.bad_requests > 0);
    // The line is as good as new.
    line.request(RequestBody::SetLimits(own.limits)).unwrap();
    assert_eq!(health(&mut line).bad_requests, report.bad_requests);
}
