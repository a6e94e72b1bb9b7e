//! Messages to frames and back.
//!
//! COBS (Cheshire & Baker 1999) removes zeros from the bytes, so that only the end of a frame is a zero. After any
//! disturbance of the line, decoding is in step again after the next zero. CRC-32C (Castagnoli 1993) keeps Hamming
//! distance 6 up to 5243 bits (Koopman 2002, Table 1): it detects any five flipped bits in a message of up to 651
//! bytes.

use core::fmt;
use core::marker::PhantomData;

use crc::{CRC_32_ISCSI, Crc, Digest, Table};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::message::{Report, Request};

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);

/// Bytes of the CRC behind each message, little-endian.
pub const CRC_BYTES: usize = 4;
/// Longest message in postcard form, bytes, in either direction.
pub const MAX_MESSAGE: usize = 1024;
/// Longest content of a frame: message and CRC, bytes.
pub const MAX_PAYLOAD: usize = MAX_MESSAGE + CRC_BYTES;
/// Longest frame on the line with its delimiter, bytes: a buffer of this size holds any message.
pub const MAX_FRAME: usize = cobs::max_encoding_length(MAX_PAYLOAD) + 1;

// Postcard writes a type without heap in at most twice its size in memory. Varints of 16, 32 and 64 bits take 3, 5 and
// 10 bytes. A variant's number or an option takes one byte even if memory hides it in a niche; these types have at most
// one niche per byte of payload. So these lines hold for every value, and for types that others extend.
const _: () = assert!(
    2 * size_of::<Request>() <= MAX_MESSAGE,
    "a Request might not fit: raise MAX_MESSAGE"
);
const _: () = assert!(
    2 * size_of::<Report>() <= MAX_MESSAGE,
    "a Report might not fit: raise MAX_MESSAGE"
);

/// Reason why a message could not be framed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// The buffer is shorter than the frame; [`MAX_FRAME`] bytes are always enough.
    BufferTooSmall,
    /// Postcard cannot write the type (a sequence of unknown length); no message type is like that.
    Unserializable,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BufferTooSmall => "The buffer is too small for the frame.",
            Self::Unserializable => "The type has no postcard form.",
        })
    }
}

impl core::error::Error for EncodeError {}

/// Reason why a frame was discarded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// The delimiter came where the COBS code byte announced data.
    Cobs,
    /// The check sum is wrong, or the frame is too short to have one.
    Crc,
    /// The check sum is right, but the bytes are not exactly one message of the expected type.
    Message,
    /// The frame is longer than any message.
    TooLong,
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cobs => "The frame is truncated or garbled (COBS).",
            Self::Crc => "The frame's check sum does not agree.",
            Self::Message => "The frame is intact, but no message of this protocol.",
            Self::TooLong => "The frame is longer than any message of this protocol.",
        })
    }
}

impl core::error::Error for DecodeError {}

/// Writes `message` as one frame with its delimiter to the front of `frame`; returns its length, bytes.
///
/// # Errors
/// [`EncodeError::BufferTooSmall`] if `frame` is too short; the content of `frame` is then invalid.
pub fn encode<M: Serialize + ?Sized>(message: &M, frame: &mut [u8]) -> Result<usize, EncodeError> {
    let capacity = frame.len();
    let length = {
        let framed = Framed {
            encoder: cobs::CobsEncoder::new(frame),
            digest: CRC.digest(),
        };
        postcard::serialize_with_flavor(message, framed).map_err(|error| match error {
            postcard::Error::SerializeBufferFull => EncodeError::BufferTooSmall,
            _ => EncodeError::Unserializable,
        })?
    };
    // The COBS encoder reserves its last code byte without a bounds check.
    if length >= capacity {
        return Err(EncodeError::BufferTooSmall);
    }
    let delimiter = frame.get_mut(length).ok_or(EncodeError::BufferTooSmall)?;
    *delimiter = 0;
    Ok(length + 1)
}

/// Receiver of postcard's bytes: adds them to the check sum and, stuffed, to the frame.
struct Framed<'a> {
    encoder: cobs::CobsEncoder<'a>,
    digest: Digest<'static, u32, Table<1>>,
}

impl postcard::ser_flavors::Flavor for Framed<'_> {
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        // An empty push would make the encoder reserve a second code byte.
        if bytes.is_empty() {
            return Ok(());
        }
        self.digest.update(bytes);
        self.encoder
            .push(bytes)
            .map_err(|_| postcard::Error::SerializeBufferFull)
    }

    fn finalize(mut self) -> postcard::Result<usize> {
        let crc = self.digest.finalize().to_le_bytes();
        self.encoder
            .push(&crc)
            .map_err(|_| postcard::Error::SerializeBufferFull)?;
        Ok(self.encoder.finalize())
    }
}

/// Counts of a decoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Frames with a correct check sum.
    pub good: u64,
    /// [`DecodeError::Cobs`].
    pub bad_cobs: u64,
    /// [`DecodeError::Crc`].
    pub bad_crc: u64,
    /// [`DecodeError::Message`]; these are also in `good`, because the line transferred them correctly.
    pub bad_message: u64,
    /// [`DecodeError::TooLong`].
    pub too_long: u64,
}

impl FrameCounts {
    /// Returns the number of frames that the line has damaged.
    pub fn bad(&self) -> u64 {
        self.bad_cobs
            .saturating_add(self.bad_crc)
            .saturating_add(self.too_long)
    }
}

/// Decodes a stream of bytes to the contents of frames. `N`: longest content with CRC, bytes.
#[derive(Debug)]
pub struct Decoder<const N: usize> {
    state: cobs::DecoderState,
    payload: [u8; N],
    length: usize,
    overflow: bool,
    counts: FrameCounts,
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Decoder<N> {
    /// Returns a decoder that waits for the start of a frame.
    pub fn new() -> Self {
        Self {
            state: cobs::DecoderState::Idle,
            payload: [0; N],
            length: 0,
            overflow: false,
            counts: FrameCounts::default(),
        }
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// Takes one byte. Returns `Some` at the end of a frame: its content without CRC, or why it was discarded.
    ///
    /// Delimiters in a row are no frames and return `None`.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], DecodeError>> {
        match self.state.feed(byte) {
            Ok(cobs::DecodeResult::NoData) => None,
            Ok(cobs::DecodeResult::DataStart) => {
                self.restart();
                None
            }
            Ok(cobs::DecodeResult::DataContinue(data)) => {
                match self.payload.get_mut(self.length) {
                    Some(place) => {
                        *place = data;
                        self.length += 1;
                    }
                    None => self.overflow = true,
                }
                None
            }
            Ok(cobs::DecodeResult::DataComplete) => Some(self.check()),
            Err(_) => {
                let error = if self.overflow {
                    DecodeError::TooLong
                } else {
                    DecodeError::Cobs
                };
                Some(Err(self.reject(error)))
            }
        }
    }

    /// Takes one byte. Returns `Some` at the end of a frame: its message, or the reason why it was discarded.
    pub fn push_message<M: DeserializeOwned>(
        &mut self,
        byte: u8,
    ) -> Option<Result<M, DecodeError>> {
        let message = match self.push(byte)? {
            Ok(payload) => parse(payload),
            Err(error) => return Some(Err(error)),
        };
        if message.is_err() {
            self.counts.bad_message = self.counts.bad_message.saturating_add(1);
        }
        Some(message)
    }

    /// Takes `bytes`; passes each message, or the reason why a frame was discarded, to `on_message`.
    pub fn feed<M: DeserializeOwned>(
        &mut self,
        bytes: &[u8],
        mut on_message: impl FnMut(Result<M, DecodeError>),
    ) {
        for byte in bytes {
            if let Some(message) = self.push_message(*byte) {
                on_message(message);
            }
        }
    }

    fn restart(&mut self) {
        self.length = 0;
        self.overflow = false;
    }

    fn reject(&mut self, error: DecodeError) -> DecodeError {
        self.restart();
        let count = match error {
            DecodeError::Cobs => &mut self.counts.bad_cobs,
            DecodeError::Crc => &mut self.counts.bad_crc,
            DecodeError::Message => &mut self.counts.bad_message,
            DecodeError::TooLong => &mut self.counts.too_long,
        };
        *count = count.saturating_add(1);
        error
    }

    fn check(&mut self) -> Result<&[u8], DecodeError> {
        if self.overflow {
            return Err(self.reject(DecodeError::TooLong));
        }
        let split = self
            .payload
            .get(..self.length)
            .and_then(|content| content.split_last_chunk::<CRC_BYTES>());
        let length = match split {
            Some((message, crc)) if CRC.checksum(message) == u32::from_le_bytes(*crc) => {
                message.len()
            }
            _ => return Err(self.reject(DecodeError::Crc)),
        };
        self.restart();
        self.counts.good = self.counts.good.saturating_add(1);
        Ok(self.payload.get(..length).unwrap_or_default())
    }
}

/// Reads a frame's content as one message.
///
/// # Errors
/// [`DecodeError::Message`] if it is no message, or if bytes remain.
pub fn parse<M: DeserializeOwned>(payload: &[u8]) -> Result<M, DecodeError> {
    match postcard::take_from_bytes::<M>(payload) {
        Ok((message, [])) => Ok(message),
        _ => Err(DecodeError::Message),
    }
}

/// A decoder for one message type, with room for the longest message.
#[derive(Debug)]
pub struct MessageDecoder<M> {
    decoder: Decoder<MAX_PAYLOAD>,
    message: PhantomData<fn() -> M>,
}

impl<M: DeserializeOwned> Default for MessageDecoder<M> {
    fn default() -> Self {
        Self {
            decoder: Decoder::new(),
            message: PhantomData,
        }
    }
}

impl<M: DeserializeOwned> MessageDecoder<M> {
    /// Takes one byte; see [`Decoder::push_message`].
    pub fn push(&mut self, byte: u8) -> Option<Result<M, DecodeError>> {
        self.decoder.push_message(byte)
    }

    /// Takes `bytes`; see [`Decoder::feed`].
    pub fn feed(&mut self, bytes: &[u8], on_message: impl FnMut(Result<M, DecodeError>)) {
        self.decoder.feed(bytes, on_message);
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> FrameCounts {
        self.decoder.counts()
    }
}

#[cfg(test)]
#[path = "frame_test.rs"]
mod test;
