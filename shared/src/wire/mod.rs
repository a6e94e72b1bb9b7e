//! The wire format: postcard messages in COBS frames with a CRC.

pub mod message;
