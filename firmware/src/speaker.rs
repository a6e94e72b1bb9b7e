//! The rig's end of the conversation: bytes in, requests carried out, reports out.

use heapless::String;
use rig_shared::wire::message::{
    Batch, Greeting, Report, Request, RequestBody, SNAPSHOT_PART, SnapshotPart,
};
use rig_shared::wire::{
    Batcher, Ledger, MAX_FRAME, MessageDecoder, PROTOCOL_VERSION, encode, schema,
};

use crate::config::Config;
use crate::request::carry_out;
use crate::state::State;
use crate::step::Output;

/// Takes one frame for the host; false where the transmit queue has no room for it.
pub trait Transmit {
    /// Queues a whole frame or nothing.
    fn frame(&mut self, bytes: &[u8]) -> bool;
}

impl<F: FnMut(&[u8]) -> bool> Transmit for F {
    fn frame(&mut self, bytes: &[u8]) -> bool {
        self(bytes)
    }
}

/// What the conversation remembers.
#[derive(Default)]
pub struct Speaker {
    decoder: MessageDecoder<Request>,
    ledger: Ledger,
    batcher: Batcher,
    /// Next snapshot sample to send, while the snapshot is being sent.
    snapshot: Option<usize>,
}

impl Speaker {
    /// Nothing said yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes in bytes from the host: carries out what they ask for and answers.
    pub fn receive(
        &mut self,
        config: &Config,
        state: &mut State,
        bytes: &[u8],
        transmit: &mut impl Transmit,
    ) {
        for &byte in bytes {
            // A damaged frame was counted by the decoder; the host, unanswered, will repeat its request.
            if let Some(Ok(request)) = self.decoder.push(byte) {
                state.heard = state.tick;
                self.answer(config, state, &request, transmit);
            }
        }
    }

    fn answer(
        &mut self,
        config: &Config,
        state: &mut State,
        request: &Request,
        transmit: &mut impl Transmit,
    ) {
        if request.body == RequestBody::Hello {
            self.ledger.clear();
        }
        if let Some(earlier) = self.ledger.answered(request.id) {
            send(&Report::Acknowledge(earlier), transmit);
            return;
        }
        let result = carry_out(config, state, &request.body);
        let acknowledge = self.ledger.answer(request.id, result);
        let accepted = acknowledge.result.is_ok();
        send(&Report::Acknowledge(acknowledge), transmit);
        if accepted {
            self.converse(config, state, &request.body, transmit);
        }
    }

    /// The requests about the conversation itself, carried out after their acknowledgement.
    fn converse(
        &mut self,
        config: &Config,
        state: &State,
        body: &RequestBody,
        transmit: &mut impl Transmit,
    ) {
        match body {
            RequestBody::Hello => {
                send(&Report::Greeting(greeting(config)), transmit);
            }
            RequestBody::StartStream => {
                self.batcher
                    .start(state.window_start(), config.rates.telemetry_decimation);
            }
            RequestBody::StopStream => {
                if let Some(batch) = self.batcher.close() {
                    self.send_batch(batch, transmit);
                }
                send(&Report::StreamEnd(self.batcher.end()), transmit);
            }
            RequestBody::GetSnapshot => {
                self.snapshot = Some(0);
                if let Some(record) = state.latch.first() {
                    send(&Report::Fault(record), transmit);
                }
            }
            _ => {}
        }
    }

    /// Sends what a control tick gave.
    pub fn publish(&mut self, state: &State, output: &Output, transmit: &mut impl Transmit) {
        if let Some(fault) = output.fault {
            send(&Report::Fault(fault), transmit);
        }
        if let Some(estimate) = output.estimate {
            send(&Report::Estimate(estimate), transmit);
        }
        if let Some((_, sample)) = output.state {
            if let Some(batch) = self.batcher.push(sample) {
                self.send_batch(batch, transmit);
            }
            self.send_snapshot_part(state, transmit);
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

    /// One part of the snapshot per telemetry sample, so that it never crowds out the stream.
    fn send_snapshot_part(&mut self, state: &State, transmit: &mut impl Transmit) {
        let Some(first) = self.snapshot else { return };
        // A ring that still turns would put parts of different times together. Without a fault there is nothing.
        let faulty = state.latch.first().is_some();
        if faulty && !state.snapshot.is_frozen() {
            return;
        }
        let total = if faulty { state.snapshot.len() } else { 0 };
        let samples = (first..total.min(first + SNAPSHOT_PART))
            .filter_map(|k| state.snapshot.get(k).copied())
            .collect();
        let part = SnapshotPart {
            first: first as u16,
            total: total as u16,
            samples,
        };
        if send(&Report::Snapshot(part), transmit) {
            let next = first + SNAPSHOT_PART;
            self.snapshot = (next < total).then_some(next);
        }
    }
}

/// Frames a report and queues it; false where it could not be queued.
fn send(report: &Report, transmit: &mut impl Transmit) -> bool {
    let mut frame = [0; MAX_FRAME];
    match encode(report, &mut frame) {
        Ok(length) => frame
            .get(..length)
            .is_some_and(|bytes| transmit.frame(bytes)),
        // The longest report fits (tested with the wire format); an unsendable one counts as refused.
        Err(_) => false,
    }
}

fn greeting(config: &Config) -> Greeting {
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
