//! The wire format: postcard messages in COBS frames with a CRC.
//!
//! ```text
//!  message ──postcard──► bytes ++ CRC-32C ──COBS──► no zero byte ++ 0x00 ──► line
//! ```
//!
//! * [`message`]: the messages; [`mod@schema`]: how both ends check that they agree on them;
//! * [`frame`]: messages to bytes and back, over a line that may lose, flip or add bytes;
//! * [`batch`]: the rig collects its telemetry, [`loss`]: the host finds exactly which samples are missing;
//! * [`answer_log`]: a repeated request is carried out only once.
//!
//! Nothing here allocates, and no sequence of bytes makes it panic.

pub mod answer_log;
pub mod batch;
pub mod frame;
pub mod loss;
pub mod message;
pub mod schema;

#[cfg(test)]
mod golden;

pub use answer_log::AnswerLog;
pub use batch::Batcher;
pub use frame::{
    DecodeError, Decoder, EncodeError, FrameCounts, MAX_FRAME, MAX_MESSAGE, MAX_PAYLOAD,
    MessageDecoder, encode,
};
pub use loss::{BatchRefusal, EndMismatch, Gap, LossCounts, Reassembly};
pub use schema::{PROTOCOL_VERSION, schema, version_of_greeting};
