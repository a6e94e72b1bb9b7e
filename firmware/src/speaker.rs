//! The rig's end of the conversation in one piece: bytes in, requests carried out, reports out.
//!
//! For whoever has all the time between two ticks, as the emulated rig has. On a board its three parts
//! run apart: requests are decoded and [examined](crate::examined) in a task, served by the
//! [`Clerk`] in the tick, and made into frames by the [`Desk`] in another task.

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

/// What the conversation remembers.
#[derive(Default)]
pub struct Speaker {
    decoder: MessageDecoder<Request>,
    clerk: Clerk,
    capture: Capture,
    desk: Desk,
}

impl Speaker {
    /// Nothing said yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes in bytes from the host: carries out what they ask for and answers. Settings are not kept: a
    /// request to store them is answered with [`Refusal::NoStorage`].
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
            // A damaged frame was counted by the decoder; the host, unanswered, will repeat its request.
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

    /// Sends what a control tick gave.
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
