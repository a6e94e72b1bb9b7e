//! One example of every message and its exact bytes on the line.
//!
//! If one of these fails, the format has changed: rigs in the field would no longer be understood. If that is intended,
//! raise [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION), put the new bytes here (the failing test prints them) and
//! describe the change in `docs/formats.md`.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::format;
use std::string::String;
use std::vec::Vec;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::message::*;
use super::{MAX_FRAME, MessageDecoder, encode};
use crate::control::{ControlKind, Gains};
use crate::effects::{Effect, Kind};
use crate::estimation::{EstimatorKind, EstimatorSettings, Learning, RowCounts};
use crate::friction::Friction;
use crate::link::LinkParameters;
use crate::precompensation::PrecompensationSettings;
use crate::safety::{Fault, FaultRecord, LimitSet, Limits, Mode, SnapshotSample};
use crate::trajectory::Trajectory;

fn requests() -> Vec<(&'static str, RequestBody, &'static str)> {
    std::vec![
        ("Hello", RequestBody::Hello, "03820205dab6698300"),
        ("KeepAlive", RequestBody::KeepAlive, "08820201d935027100"),
        ("Arm", RequestBody::Arm, "088202022dc6526200"),
        ("Disarm", RequestBody::Disarm, "088202032e45399000"),
        ("Start", RequestBody::Start, "08820204c521f34400"),
        ("Stop", RequestBody::Stop, "08820205c6a298b600"),
        ("ClearFault", RequestBody::ClearFault, "088202063251c8a500"),
        (
            "SetTrajectory",
            RequestBody::SetTrajectory(Trajectory::Hold(1_500_000)),
            "0482020708e0c65b27831de500"
        ),
        (
            "SetGains",
            RequestBody::SetGains(Gains {
                proportional: 40.0,
                derivative: 2.5,
                adaptation: 0.5,
                current_bandwidth: 800.0
            }),
            "0482020801032042010320400101023f01074844257bf2b600"
        ),
        (
            "SetControl",
            RequestBody::SetControl(ControlKind::Adaptive),
            "09820209024cd8428500"
        ),
        (
            "SetModel",
            RequestBody::SetModel(LinkParameters {
                inertia: 0.12,
                gravity_cos: 2.9,
                gravity_sin: -0.1,
                viscous: 0.3,
                coulomb: 0.4,
                offset: 0.01
            }),
            "2082020a8fc2f53d9a993940cdccccbd9a99993ecdcccc3e0ad7233c1401307300"
        ),
        (
            "SetFriction",
            RequestBody::SetFriction(Friction {
                coulomb: 0.4,
                viscous: 0.3,
                breakaway_excess: 0.2,
                stribeck_velocity: 0.05,
                coulomb_asymmetry: 0.01,
                viscous_asymmetry: -0.02,
                load_coefficient: 0.03
            }),
            "2482020bcdcccc3e9a99993ecdcc4c3ecdcc4c3d0ad7233c0ad7a3bc8fc2f53c4e153bfd00"
        ),
        (
            "SetPrecompensation",
            RequestBody::SetPrecompensation(PrecompensationSettings {
                enabled: true,
                gain: 0.95,
                gain_at_rest: 0.7,
                velocity_threshold: 0.02
            }),
            "1582020c013333733f3333333f0ad7a33cb820be2800"
        ),
        (
            "SetLimits",
            RequestBody::SetLimits(Limits {
                position_low: -3.0,
                position_high: 3.0,
                velocity: 6.0,
                acceleration: 60.0,
                torque: 8.0,
                continuous_current: 3.0,
                peak_current: 9.0
            }),
            "0482020d010340c0010340400103c0400103704201010241010340400107104110f68af900"
        ),
        (
            "SetEstimator",
            RequestBody::SetEstimator(EstimatorSettings {
                kind: EstimatorKind::Gradient,
                memory: 20.0,
                bandwidth: 15.0,
                slip_velocity: 0.05,
                lower: [0.0, -9.0, -9.0, 0.0, 0.0, -1.0],
                upper: [1.0, 9.0, 9.0, 2.0, 2.0, 1.0]
            }),
            "0582020e010103a04101077041cdcc4c3d01010101010310c1010310c10101010101010101010380bf0103803f010310410103104101010240010102400107803f52677e3800"
        ),
        (
            "StartStream",
            RequestBody::StartStream,
            "0882020ffe8a7add00"
        ),
        ("StopStream", RequestBody::StopStream, "08820210b571379300"),
        (
            "GetSnapshot",
            RequestBody::GetSnapshot,
            "08820211b6f25c6100"
        ),
        (
            "SetPosition",
            RequestBody::SetPosition(-1.5),
            "048202120107c0bf5151085200"
        ),
        ("Store", RequestBody::Store, "088202134182678000"),
        (
            "Capture",
            RequestBody::Capture(300),
            "0a820214ac02484d04bc00"
        ),
        ("GetCapture", RequestBody::GetCapture, "08820215a965c6a600"),
        (
            "SetEffects",
            RequestBody::SetEffects(
                core::iter::once(Effect {
                    kind: Kind::Stribeck,
                    gains: [0.25, 0.0, 0.0, 0.0],
                    shapes: [0.05, 0.0, 0.0, 0.0]
                })
                .collect()
            ),
            "0582021601010103803e010101010101010101010105cdcc4c3d010101010101010101010105e814ec7600"
        ),
    ]
}

fn reports() -> Vec<(&'static str, Report, &'static str)> {
    std::vec![
        (
            "Greeting",
            Report::Greeting(Greeting {
                protocol: 1,
                schema: 0x0123_4567_89ab_cdef,
                firmware: heapless::String::try_from("0.1.0").unwrap(),
                control_rate_hz: 10_000,
                telemetry_decimation: 10,
                estimator_decimation: 20,
                counts_per_motor_turn: 8192,
                gear_ratio: 50.0,
                torque_constant: 0.05
            }),
            "011701ef9bafcdf8acd1910105302e312e30904e0a148040010b4842cdcc4c3dd2bf6f7700"
        ),
        (
            "Acknowledge",
            Report::Acknowledge(Acknowledge {
                id: 300,
                result: Ok(())
            }),
            "0401ac020519c78b7e00"
        ),
        (
            "Acknowledge, refused",
            Report::Acknowledge(Acknowledge {
                id: 301,
                result: Err(Refusal::NoTrajectory)
            }),
            "0a01ad020104e561923300"
        ),
        (
            "Batch",
            Report::Batch(Batch {
                sequence: 7,
                first_tick: 1_000_560,
                samples: core::iter::repeat_n(
                    StateSample {
                        position_sum: -1234,
                        velocity: 0.5,
                        current: -1.25,
                        voltage: 12.0,
                        reference: 0.75,
                        torque_command: 3.5,
                        limits: LimitSet(5),
                        mode: Mode::Running
                    },
                    2
                )
                .collect()
            }),
            "090207f0883d02a3130101023f0103a0bf010340410103403f010760400503a3130101023f0103a0bf010340410103403f01096040050398450ac600"
        ),
        (
            "Estimate",
            Report::Estimate(Estimate {
                tick: 4000,
                value: [0.12, 2.9, -0.1, 0.3, 0.4, 0.01],
                std: [0.001, 0.02, 0.02, 0.003, 0.004, 0.0005],
                trusted: [true, true, false, true, false, true],
                residual_rms: 0.05,
                rows: RowCounts {
                    used: 1500,
                    masked: 300,
                    uninformative: 7
                },
                learning: Learning::TooSlow
            }),
            "3603a01f8fc2f53d9a993940cdccccbd9a99993ecdcccc3e0ad7233c6f12833a0ad7a33c0ad7a33ca69b443b6f12833b6f12033a010102011001cdcc4c3ddc0bac0207033e5b721e00"
        ),
        (
            "Fault",
            Report::Fault(FaultRecord {
                fault: Fault::Overload,
                tick: 99,
                value: 12.5
            }),
            "04040a63010748416ee38d1000"
        ),
        (
            "Snapshot",
            Report::Snapshot(SnapshotPart {
                first: 8,
                total: 64,
                samples: core::iter::once(SnapshotSample {
                    tick: 91,
                    position: -77,
                    current: 8.5,
                    duty: -0.25,
                    supply: 23.5,
                    reference: 0.125
                })
                .collect()
            }),
            "08050840015b990101030841010380be0103bc410101063e9252dd2000"
        ),
        (
            "StreamEnd",
            Report::StreamEnd(StreamEnd {
                batches: 11,
                samples: 85,
                dropped: 16,
                first_tick: 1_000_000
            }),
            "0c060b5510c0843d6827e16500"
        ),
        (
            "Acknowledge, not stored",
            Report::Acknowledge(Acknowledge {
                id: 302,
                result: Err(Refusal::StorageFailed)
            }),
            "0a01ae020107281be04200"
        ),
        (
            "Acknowledge, out of bounds",
            Report::Acknowledge(Acknowledge {
                id: 7,
                result: Err(Refusal::OutOfBounds {
                    quantity: Bounded::Gravity,
                    value: 16.0,
                    bound: 10.0
                })
            }),
            "060107010a05010380410107204177f715ad00"
        ),
        (
            "Acknowledge, not compensable",
            Report::Acknowledge(Acknowledge {
                id: 303,
                result: Err(Refusal::NotCompensable(Kind::Stribeck))
            }),
            "0601af020108020a03332700"
        ),
        (
            "Capture",
            Report::Capture(SnapshotPart {
                first: 2040,
                total: 2048,
                samples: core::iter::once(SnapshotSample {
                    tick: 91,
                    position: -77,
                    current: 8.5,
                    duty: -0.25,
                    supply: 23.5,
                    reference: 0.125
                })
                .collect()
            }),
            "0a07f80f8010015b990101030841010380be0103bc410101063ee3b84a6400"
        ),
        (
            "Health",
            Report::Health(Health {
                tick: 10_000,
                reset: ResetCause::Watchdog,
                settings: SettingsOrigin::Damaged,
                clock_hz: 170_000_000,
                crystal: true,
                boost: true,
                tick_cycles_max: 5000,
                tick_cycles_mean: 3000,
                stack_free: 20_000,
                bad_requests: 1,
                line_errors: 2,
                dropped: 8,
                stop_switch: StopSwitchState::Closed,
                crash: Some(Crash {
                    kind: CrashKind::ProcessorFault,
                    pc: 0x0800_1234,
                    lr: 0x0800_0101,
                    status: 0x8200,
                    address: 0x4000_0000,
                    line: 0,
                    file: *b"rmware/src/board/link.rs\0\0\0\0",
                    silent: 2,
                }),
            }),
            "2908904e030380fd875101018827b817a09c01010208010101b4a4804081828040808402808080800419726d776172652f7372632f626f6172642f6c696e6b2e72730101010602bcc1494c00"
        ),
    ]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn check<M: Serialize + DeserializeOwned + PartialEq + core::fmt::Debug>(
    name: &str,
    message: &M,
    expected: &str,
) -> bool {
    let mut frame = [0; MAX_FRAME];
    let length = encode(message, &mut frame).unwrap();
    let bytes = hex(&frame[..length]);
    let mut back = Vec::new();
    MessageDecoder::<M>::default().feed(&frame[..length], |message| back.push(message));
    assert_eq!(back.len(), 1, "{name}");
    assert_eq!(back[0].as_ref(), Ok(message), "{name}");
    if bytes != expected {
        std::println!("{name}: {bytes}");
    }
    bytes == expected
}

/// A new variant must fail to compile here, so that it gets its example.
fn request_number(body: &RequestBody) -> usize {
    match body {
        RequestBody::Hello => 0,
        RequestBody::KeepAlive => 1,
        RequestBody::Arm => 2,
        RequestBody::Disarm => 3,
        RequestBody::Start => 4,
        RequestBody::Stop => 5,
        RequestBody::ClearFault => 6,
        RequestBody::SetTrajectory(_) => 7,
        RequestBody::SetGains(_) => 8,
        RequestBody::SetControl(_) => 9,
        RequestBody::SetModel(_) => 10,
        RequestBody::SetFriction(_) => 11,
        RequestBody::SetPrecompensation(_) => 12,
        RequestBody::SetLimits(_) => 13,
        RequestBody::SetEstimator(_) => 14,
        RequestBody::StartStream => 15,
        RequestBody::StopStream => 16,
        RequestBody::GetSnapshot => 17,
        RequestBody::SetPosition(_) => 18,
        RequestBody::Store => 19,
        RequestBody::Capture(_) => 20,
        RequestBody::GetCapture => 21,
        RequestBody::SetEffects(_) => 22,
    }
}

fn report_number(report: &Report) -> usize {
    match report {
        Report::Greeting(_) => 0,
        Report::Acknowledge(_) => 1,
        Report::Batch(_) => 2,
        Report::Estimate(_) => 3,
        Report::Fault(_) => 4,
        Report::Snapshot(_) => 5,
        Report::StreamEnd(_) => 6,
        Report::Capture(_) => 7,
        Report::Health(_) => 8,
    }
}

#[test]
fn every_request_has_its_bytes() {
    let mut right = true;
    let mut seen = [false; 23];
    for (name, body, expected) in requests() {
        seen[request_number(&body)] = true;
        right &= check(name, &Request { id: 258, body }, expected);
    }
    assert_eq!(seen, [true; 23]);
    assert!(right, "the format has changed: see the head of this file");
}

#[test]
fn every_report_has_its_bytes() {
    let mut right = true;
    let mut seen = [false; 9];
    for (name, report, expected) in reports() {
        seen[report_number(&report)] = true;
        right &= check(name, &report, expected);
    }
    assert_eq!(seen, [true; 9]);
    assert!(right, "the format has changed: see the head of this file");
}
