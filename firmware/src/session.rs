//! The rig's whole side of the session with the host: bytes in, requests executed, reports out.
//!
//! For programs without a time limit between two ticks, such as the emulated rig. On a board its three parts run
//! separately: a task decodes and [prechecks](crate::prechecked_request) requests, the [`TickSession`] serves them in
//! the tick, and the [`ReportSender`] encodes the answers as frames in another task.

use rig_shared::wire::MessageDecoder;
use rig_shared::wire::message::{Refusal, Request};

use crate::capture::Capture;
use crate::config::Config;
use crate::event::Event;
use crate::prechecked_request::precheck;
use crate::report_sender::ReportSender;
pub use crate::report_sender::Transmit;
use crate::state::State;
use crate::step::Output;
use crate::tick_session::TickSession;

/// State of the session.
#[derive(Default)]
pub struct Session {
    decoder: MessageDecoder<Request>,
    tick_session: TickSession,
    capture: Capture,
    report_sender: ReportSender,
}

impl Session {
    /// Returns the state at power on.
    pub fn new() -> Self {
        Self::default()
    }

    /// Receives bytes from the host, carries out the requests and answers. Settings are not kept: a request to store
    /// them is answered with [`Refusal::NoStorage`].
    pub fn receive(
        &mut self,
        config: &Config,
        state: &mut State,
        bytes: &[u8],
        transmit: &mut impl Transmit,
    ) {
        let Self {
            decoder,
            tick_session,
            capture,
            report_sender,
        } = self;
        let mut events = |event: Event| {
            report_sender.send_event(config, &event, transmit);
            true
        };
        for &byte in bytes {
            // The decoder has counted a damaged frame. The host gets no answer and repeats its request.
            if let Some(Ok(request)) = decoder.push(byte)
                && tick_session
                    .serve(
                        config,
                        state,
                        capture,
                        &precheck(config, request),
                        &mut events,
                    )
                    .is_some()
            {
                tick_session.finish_store(state, Err(Refusal::NoStorage), &mut events);
            }
        }
    }

    /// Sends the output of a control tick.
    pub fn publish(
        &mut self,
        config: &Config,
        state: &State,
        output: &Output,
        transmit: &mut impl Transmit,
    ) {
        let Self {
            tick_session,
            capture,
            report_sender,
            ..
        } = self;
        tick_session.report(state, capture, output, &mut |event: Event| {
            report_sender.send_event(config, &event, transmit);
            true
        });
    }
}
