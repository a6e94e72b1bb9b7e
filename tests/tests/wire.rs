//! What a recording says of itself on a bad line, and that no bytes do harm.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::ops::ControlFlow;
use std::time::Duration;

use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rig_link::{
    Device, Disturbance, EmulatedPort, Event, LinkError, Lossy, RecordSettings, Session,
    SessionSettings, record,
};
use rig_shared::safety::{LimitSet, Mode};
use rig_shared::wire::message::{Greeting, Refusal, Report, Request, RequestBody, StateSample};
use rig_shared::wire::{
    AnswerLog, Batcher, DecodeError, MAX_FRAME, MessageDecoder, PROTOCOL_VERSION, encode, schema,
};

const DECIMATION: u16 = 10;

/// The sample that belongs to a tick: every field depends on it, so that no wrong one passes.
fn sample_at(tick: u64) -> StateSample {
    let x = tick as f32;
    StateSample {
        position_sum: (tick as i64).wrapping_sub(700_000).wrapping_mul(131),
        velocity: (x * 1e-3).sin(),
        current: (x * 2e-3).cos(),
        voltage: x * 0.5,
        reference: -x,
        torque_command: x.sqrt(),
        limits: LimitSet(tick as u8),
        mode: Mode::Running,
    }
}

/// The rig's half of the conversation, with the wire code that the rig uses, and samples that can be checked.
struct Responder {
    decoder: MessageDecoder<Request>,
    batcher: Batcher,
    answer_log: AnswerLog,
    tick: u64,
    windows_per_slice: u64,
    /// Every so many batches finds the transmit queue full; 0: never.
    queue_full_every: u32,
    protocol: u16,
    schema: u64,
    armed: u32,
    starts: u32,
}

impl Responder {
    fn new() -> Self {
        Self {
            decoder: MessageDecoder::default(),
            batcher: Batcher::new(),
            answer_log: AnswerLog::new(),
            tick: 123_450,
            windows_per_slice: 64,
            queue_full_every: 0,
            protocol: PROTOCOL_VERSION,
            schema: schema(),
            armed: 0,
            starts: 0,
        }
    }

    fn greeting(&self) -> Report {
        Report::Greeting(Greeting {
            protocol: self.protocol,
            schema: self.schema,
            firmware: heapless_text("test"),
            control_rate_hz: 10_000,
            telemetry_decimation: DECIMATION,
            estimator_decimation: 20,
            counts_per_motor_turn: 8192,
            gear_ratio: 50.0,
            torque_constant: 0.05,
        })
    }

    fn answer(&mut self, request: &Request, out: &mut Vec<u8>) {
        if request.body == RequestBody::Hello {
            self.answer_log.clear();
        } else if let Some(again) = self.answer_log.stored_answer(request.id) {
            return say(&Report::Acknowledge(again), out);
        }
        let mut result = Ok(());
        let mut after = Vec::new();
        match request.body {
            RequestBody::Hello => after.push(self.greeting()),
            RequestBody::StartStream => {
                self.starts += 1;
                self.batcher.start(self.tick, DECIMATION);
            }
            RequestBody::StopStream => {
                after.extend(self.batcher.close().map(Report::Batch));
                after.push(Report::StreamEnd(self.batcher.end()));
            }
            RequestBody::Arm => self.armed += 1,
            RequestBody::Start => result = Err(Refusal::NoTrajectory),
            _ => {}
        }
        let acknowledge = self.answer_log.record(request.id, result);
        say(&Report::Acknowledge(acknowledge), out);
        for report in &after {
            say(report, out);
        }
    }
}

fn heapless_text<T: for<'a> TryFrom<&'a str>>(text: &str) -> T {
    T::try_from(text).ok().unwrap()
}

fn say(report: &Report, out: &mut Vec<u8>) {
    let mut frame = [0; MAX_FRAME];
    let length = encode(report, &mut frame).unwrap();
    out.extend_from_slice(&frame[..length]);
}

impl Device for Responder {
    fn exchange(&mut self, from_host: &[u8], to_host: &mut Vec<u8>) {
        let mut requests = Vec::new();
        self.decoder
            .feed(from_host, |request: Result<Request, DecodeError>| {
                requests.extend(request)
            });
        for request in &requests {
            self.answer(request, to_host);
        }
        for _ in 0..self.windows_per_slice {
            if let Some(batch) = self.batcher.push(sample_at(self.tick)) {
                if self.queue_full_every > 0 && batch.sequence % self.queue_full_every == 3 {
                    self.batcher.refused(&batch);
                } else {
                    say(&Report::Batch(batch), to_host);
                }
            }
            self.tick += u64::from(DECIMATION);
        }
    }
}

/// Records `samples` over a line with `disturbance`; checks every sample, and that samples and gaps together
/// are the whole stream, tick by tick. Gives the samples lost.
fn check_recording(
    samples: u64,
    disturbance: Disturbance,
    queue_full_every: u32,
    seed: u64,
) -> u64 {
    let responder = Responder {
        queue_full_every,
        ..Responder::new()
    };
    let patient = SessionSettings {
        attempts: 60,
        timeout: Duration::from_millis(20),
        ..SessionSettings::default()
    };
    let line = Lossy::new(EmulatedPort::new(responder), disturbance, seed);
    let mut session = Session::open(line, patient).unwrap();
    let mut next_tick = None;
    let mut first_tick_seen = None;
    let (mut received, mut missing, mut gaps) = (0, 0, 0);
    let settings = RecordSettings {
        samples: Some(samples),
        at_start: vec![RequestBody::Arm],
        ..RecordSettings::default()
    };
    let report = record(&mut session, &settings, |event| {
        let (first_tick, count) = match event {
            Event::Samples {
                first_tick,
                samples,
            } => {
                for (k, sample) in samples.iter().enumerate() {
                    assert_eq!(
                        *sample,
                        sample_at(first_tick + k as u64 * u64::from(DECIMATION))
                    );
                }
                received += samples.len() as u64;
                (first_tick, samples.len() as u64)
            }
            Event::Gap {
                first_tick,
                missing: count,
            } => {
                missing += count;
                gaps += 1;
                (first_tick, count)
            }
            other => panic!("nobody sent {other:?}"),
        };
        // Samples and gaps follow each other without a hole and without an overlap.
        assert_eq!(first_tick, *next_tick.get_or_insert(first_tick));
        first_tick_seen.get_or_insert(first_tick);
        next_tick = Some(first_tick + count * u64::from(DECIMATION));
        ControlFlow::Continue(())
    })
    .unwrap();
    let device = session.port().inner().device();
    let truth = device.batcher.end();
    assert_eq!(first_tick_seen, Some(truth.first_tick));
    assert_eq!(received + missing, truth.samples + truth.dropped);
    assert_eq!(
        (
            report.received,
            report.lost,
            report.gaps,
            report.sent,
            report.dropped_by_rig
        ),
        (received, missing, gaps, truth.samples, truth.dropped)
    );
    assert_eq!(report.lost_on_line + report.dropped_by_rig, report.lost);
    assert!(report.taken >= samples);
    assert_eq!(
        (device.armed, device.starts),
        (1, 1),
        "requests are carried out once"
    );
    report.lost
}

#[test]
fn a_good_line_loses_nothing() {
    assert_eq!(check_recording(100_000, Disturbance::default(), 0, 1), 0);
}

#[test]
fn a_full_transmit_queue_is_told_apart_from_the_line() {
    // Batch 3 of every 50 is dropped by the rig.
    assert!(check_recording(100_000, Disturbance::default(), 50, 1) >= 2000);
}

#[test]
fn a_bad_line_loses_exactly_what_the_recording_says() {
    let lines = [
        Disturbance {
            flip: 1e-3,
            ..Disturbance::default()
        },
        Disturbance {
            drop_byte: 1e-3,
            ..Disturbance::default()
        },
        Disturbance {
            drop_chunk: 0.1,
            ..Disturbance::default()
        },
        Disturbance {
            repeat_chunk: 0.2,
            ..Disturbance::default()
        },
        Disturbance {
            flip: 1e-3,
            drop_byte: 5e-4,
            drop_chunk: 0.05,
            repeat_chunk: 0.05,
        },
    ];
    for (kind, disturbance) in lines.into_iter().enumerate() {
        let mut lost = 0;
        for seed in 0..6 {
            lost += check_recording(100_000, disturbance, 97, seed * 31 + kind as u64);
        }
        println!("{disturbance:?}: {lost} of 600000 samples lost, all of them named");
        assert!(
            lost > 1000,
            "this line must lose something for the test to mean anything"
        );
    }
}

#[test]
fn another_version_or_schema_is_refused_by_name() {
    let other = Responder {
        protocol: 900,
        ..Responder::new()
    };
    let error = Session::open(EmulatedPort::new(other), SessionSettings::default())
        .err()
        .unwrap();
    assert!(matches!(
        error,
        LinkError::WrongProtocol {
            rig: 900,
            host: PROTOCOL_VERSION
        }
    ));
    assert!(error.to_string().contains("900"));
    let other = Responder {
        schema: 0xABCD,
        ..Responder::new()
    };
    let error = Session::open(EmulatedPort::new(other), SessionSettings::default())
        .err()
        .unwrap();
    let text = error.to_string();
    assert!(
        text.contains("000000000000abcd") && text.contains(&format!("{:016x}", schema())),
        "{text}"
    );
}

#[test]
fn a_refusal_and_a_dead_line_are_sentences() {
    let mut session = Session::open(
        EmulatedPort::new(Responder::new()),
        SessionSettings::default(),
    )
    .unwrap();
    let error = session.request(RequestBody::Start).err().unwrap();
    assert_eq!(
        error.to_string(),
        "The rig has refused the request Start: no trajectory is loaded; upload one first."
    );
    let dead = |_: &[u8], _: &mut Vec<u8>| {};
    let error = Session::open(EmulatedPort::new(dead), SessionSettings::default())
        .err()
        .unwrap();
    assert!(matches!(error, LinkError::NoAnswer { attempts: 10, .. }));
}

#[test]
fn ten_million_random_bytes_do_no_harm_in_either_direction() {
    let mut rng = Pcg64Mcg::seed_from_u64(10_000_000);
    let mut requests = MessageDecoder::<Request>::default();
    let mut reports = MessageDecoder::<Report>::default();
    let mut ended = [0_u64; 2];
    let mut bytes = vec![0; 1000];
    for round in 0..10_000 {
        rng.fill_bytes(&mut bytes);
        // Uniform bytes rarely make long frames: thin the zeros out in every other round.
        if round % 2 == 1 {
            for byte in bytes.iter_mut().filter(|byte| **byte == 0) {
                *byte = u8::from(rng.random_range(0..20_u32) != 0);
            }
        }
        requests.feed(&bytes, |_| ended[0] += 1);
        reports.feed(&bytes, |_| ended[1] += 1);
    }
    for (counts, ended) in [(requests.counts(), ended[0]), (reports.counts(), ended[1])] {
        assert_eq!(counts.good + counts.bad(), ended, "{counts:?}");
        assert!(
            counts.bad_cobs > 0 && counts.bad_crc > 0 && counts.too_long > 0,
            "{counts:?}"
        );
    }
    // And they hear as well as before.
    let mut line = vec![0];
    say(&Responder::new().greeting(), &mut line);
    let mut last = None;
    reports.feed(&line, |report| last = Some(report));
    assert_eq!(last, Some(Ok(Responder::new().greeting())));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Frames with an intact check sum and any content reach the message decoder, which must stand it.
    #[test]
    fn any_intact_content_is_a_message_or_an_error(content in prop::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(report) = rig_shared::wire::frame::parse::<Report>(&content) {
            let mut frame = Vec::new();
            say(&report, &mut frame);
            let mut back = Vec::new();
            MessageDecoder::<Report>::default().feed(&frame, |report: Result<Report, DecodeError>| {
                let mut again = Vec::new();
                say(&report.unwrap(), &mut again);
                back.push(again);
            });
            prop_assert_eq!(back, [frame]);
        }
        let _no_panic = rig_shared::wire::frame::parse::<Request>(&content);
    }

    #[test]
    fn batches_come_back(tick in any::<u64>(), ticks in prop::collection::vec(any::<u64>(), 1..=8)) {
        let report = Report::Batch(rig_shared::wire::message::Batch {
            sequence: tick as u32,
            first_tick: tick,
            samples: ticks.iter().map(|tick| sample_at(*tick >> 2)).collect(),
        });
        let mut frame = Vec::new();
        say(&report, &mut frame);
        let mut back = Vec::new();
        MessageDecoder::<Report>::default().feed(&frame, |report| back.push(report));
        prop_assert_eq!(back, [Ok(report)]);
    }
}
