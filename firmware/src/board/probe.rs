//! Input and output through the debug probe (SEGGER RTT): defmt logs, and the same frames as on the serial line.
//!
//! Without a reader only these frames are lost: a full buffer takes no part of a frame, and the tick is not affected.
// The macro that creates the buffers contains unsafe code.
#![allow(unsafe_code)]

use rtt_target::ChannelMode::NoBlockSkip;
use rtt_target::{DownChannel, UpChannel, rtt_init, set_defmt_channel};

/// Output: channel 1 of the board.
pub(crate) type Outgoing = UpChannel;
/// Input: channel 0 to the board.
pub(crate) type Incoming = DownChannel;

/// Creates the buffers and sends the logs through channel 0.
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
