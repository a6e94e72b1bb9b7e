//! The debug probe's way in and out (SEGGER RTT): logs by defmt, and the same frames as on the serial line.
//!
//! Whoever does not look loses nothing but the frames: a full buffer takes no part of a frame, and the tick
//! knows nothing of it.
// The macro that lays out the buffers uses unsafe code of its own.
#![allow(unsafe_code)]

use rtt_target::ChannelMode::NoBlockSkip;
use rtt_target::{DownChannel, UpChannel, rtt_init, set_defmt_channel};

/// What goes out: channel 1 of the board.
pub(crate) type Outgoing = UpChannel;
/// What comes in: channel 0 to the board.
pub(crate) type Incoming = DownChannel;

/// Lays the buffers out and sends the logs through channel 0.
pub(crate) fn open() -> (Outgoing, Incoming) {
    let channels = rtt_init! {
        up: {
            0: { size: 1024, mode: NoBlockSkip, name: "defmt" }
            1: { size: 4096, mode: NoBlockSkip, name: "rig" }
        }
        down: {
            0: { size: 1024, name: "rig" }
        }
    };
    set_defmt_channel(channels.up.0);
    (channels.up.1, channels.down.0)
}
