//! The rig's whole end of the conversation: bytes in, requests carried out, reports out.
//!
//! For programs without a time limit between two ticks, such as the emulated rig. On a board its three parts run
//! separately: a task decodes and [examines](crate::examined) requests, the [`Clerk`] serves them in the tick, and the
//! [`Desk`] makes frames of the answers in another task.

use rig_shared::wire::MessageDecoder;
use rig_shared::wire::message::{Refusal, Request};

use crate::capture::Capture;
use crate::clerk::Clerk;
use crate::config::Config;
use crate::desk::Desk;
pub use crate::desk::Transmit;
use crate::examined::examine;
use crate::note::Note;
use crate::state::State;
use crate::step::Output;

/// State of the conversation.
#[derive(Default)]
pub struct Speaker {
    decoder: MessageDecoder<Request>,
    clerk: Clerk,
    capture: Capture,
    desk: Desk,
}

impl Speaker {
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
            clerk,
            capture,
            desk,
        } = self;
        let mut notes = |note: Note| {
            desk.tell(config, &note, transmit);
            true
        };
        for &byte in bytes {
            // The decoder has counted a damaged frame. The host gets no answer and repeats its request.
            if let Some(Ok(request)) = decoder.push(byte)
                && clerk
                    .serve(
                        config,
                        state,
                        capture,
                        &examine(config, request),
                        &mut notes,
                    )
                    .is_some()
            {
                clerk.stored(state, Err(Refusal::NoStorage), &mut notes);
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
            clerk,
            capture,
            desk,
            ..
        } = self;
        clerk.report(state, capture, output, &mut |note: Note| {
            desk.tell(config, &note, transmit);
            true
        });
    }
}
