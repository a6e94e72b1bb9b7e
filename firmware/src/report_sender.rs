//! Part of the session outside the control tick, without a deadline: events in, frames out.

use heapless::{String, Vec};
use rig_shared::safety::SnapshotSample;
use rig_shared::wire::message::{Batch, Greeting, Report, SNAPSHOT_PART, SnapshotPart};
use rig_shared::wire::{Batcher, MAX_FRAME, PROTOCOL_VERSION, encode, schema};

use crate::config::Config;
use crate::event::{BoardStart, Event, FollowUp, RecordedTick};

/// Destination of frames.
pub trait Transmit {
    /// Queues a whole frame, or returns false if there is no room.
    fn frame(&mut self, bytes: &[u8]) -> bool;
}

impl<F: FnMut(&[u8]) -> bool> Transmit for F {
    fn frame(&mut self, bytes: &[u8]) -> bool {
        self(bytes)
    }
}

/// Kept ticks that wait until they fill a part.
#[derive(Clone, Debug, Default)]
struct Part {
    first: u16,
    samples: Vec<SnapshotSample, SNAPSHOT_PART>,
}

impl Part {
    /// Adds a tick; returns a part if it is full or the last.
    fn push(&mut self, recorded: &RecordedTick) -> Option<SnapshotPart> {
        if recorded.index == 0 || self.samples.is_full() {
            self.samples.clear();
        }
        if self.samples.is_empty() {
            self.first = recorded.index;
        }
        let nothing = recorded.total == 0;
        let last = nothing || recorded.index + 1 == recorded.total;
        if !nothing {
            self.samples.push(recorded.sample).ok()?;
        }
        (last || self.samples.is_full()).then(|| SnapshotPart {
            first: self.first,
            total: recorded.total,
            samples: core::mem::take(&mut self.samples),
        })
    }
}

/// Encodes events as reports and sends their frames.
#[derive(Default)]
pub struct ReportSender {
    batcher: Batcher,
    snapshot: Part,
    capture: Part,
    /// Present on a board.
    board: Option<BoardStart>,
}

impl ReportSender {
    /// Returns the state at power on.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the state at power on of a board, which sends health reports.
    pub fn for_board(start: BoardStart) -> Self {
        Self {
            board: Some(start),
            ..Self::default()
        }
    }

    /// Sends the content of an event to the host.
    pub fn send_event(&mut self, config: &Config, event: &Event, transmit: &mut impl Transmit) {
        match event {
            Event::Answer(acknowledge, follow_up) => {
                send(&Report::Acknowledge(*acknowledge), transmit);
                self.send_follow_up(config, follow_up, transmit);
            }
            Event::Sample {
                sample,
                missed_windows,
            } => {
                for _ in 0..*missed_windows {
                    self.batcher.skip();
                }
                if let Some(batch) = self.batcher.push(*sample) {
                    self.send_batch(batch, transmit);
                }
            }
            Event::Estimate(estimate) => {
                send(&Report::Estimate(*estimate), transmit);
            }
            Event::Fault(record) => {
                send(&Report::Fault(*record), transmit);
            }
            Event::Snapshot(recorded) => {
                if let Some(part) = self.snapshot.push(recorded) {
                    send(&Report::Snapshot(part), transmit);
                }
            }
            Event::Capture(recorded) => {
                if let Some(part) = self.capture.push(recorded) {
                    send(&Report::Capture(part), transmit);
                }
            }
            Event::Health(measured) => {
                if let Some(start) = &self.board {
                    send(&Report::Health(start.health(measured)), transmit);
                }
            }
        }
    }

    /// Sends the consequences of an acknowledgement.
    fn send_follow_up(
        &mut self,
        config: &Config,
        follow_up: &FollowUp,
        transmit: &mut impl Transmit,
    ) {
        match follow_up {
            FollowUp::None => {}
            FollowUp::Greeting => {
                send(&Report::Greeting(greeting(config)), transmit);
            }
            FollowUp::StreamStart(first_tick) => self
                .batcher
                .start(*first_tick, config.rates.telemetry_decimation),
            FollowUp::StreamEnd => {
                if let Some(batch) = self.batcher.close() {
                    self.send_batch(batch, transmit);
                }
                send(&Report::StreamEnd(self.batcher.end()), transmit);
            }
            FollowUp::Snapshot(record) => {
                if let Some(record) = record {
                    send(&Report::Fault(*record), transmit);
                }
            }
        }
    }

    fn send_batch(&mut self, batch: Batch, transmit: &mut impl Transmit) {
        let report = Report::Batch(batch);
        if !send(&report, transmit)
            && let Report::Batch(batch) = &report
        {
            self.batcher.refused(batch);
        }
    }
}

/// Frames a report and queues it; returns false if it was not queued.
fn send(report: &Report, transmit: &mut impl Transmit) -> bool {
    let mut frame = [0; MAX_FRAME];
    match encode(report, &mut frame) {
        Ok(length) => frame
            .get(..length)
            .is_some_and(|bytes| transmit.frame(bytes)),
        // The longest report fits (tested with the wire format); one that does not fit counts as refused.
        Err(_) => false,
    }
}

/// Returns what a rig of this configuration says of itself.
pub fn greeting(config: &Config) -> Greeting {
    Greeting {
        protocol: PROTOCOL_VERSION,
        schema: schema(),
        firmware: String::try_from(env!("CARGO_PKG_VERSION")).unwrap_or_default(),
        control_rate_hz: config.rates.control_hz,
        telemetry_decimation: config.rates.telemetry_decimation,
        estimator_decimation: config.rates.estimator_decimation,
        counts_per_motor_turn: config.encoder.counts_per_motor_turn,
        gear_ratio: config.drive.gear_ratio,
        torque_constant: config.drive.torque_constant,
    }
}
