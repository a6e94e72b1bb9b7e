//! Any bytes at all into both decoders, and every message that bytes can mean there and back.
//!
//! Run with a nightly compiler and `cargo install cargo-fuzz`:
//! `cargo +nightly fuzz run --fuzz-dir tests/fuzz decode -- -max_total_time=60`
#![no_main]

use libfuzzer_sys::fuzz_target;
use rig_shared::wire::frame::parse;
use rig_shared::wire::message::{Report, Request};
use rig_shared::wire::{MAX_FRAME, MessageDecoder, encode, version_of_greeting};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// As they come from the line: each end of a frame is counted once.
fn line<M: Serialize + DeserializeOwned>(bytes: &[u8]) {
    let mut decoder = MessageDecoder::<M>::default();
    let mut ended = 0_u64;
    decoder.feed(bytes, |_| ended += 1);
    let counts = decoder.counts();
    assert_eq!(counts.good + counts.bad(), ended);
}

/// The bytes as the content of an intact frame: whatever message they mean is the same there and back.
/// (Compared as bytes, since a NaN differs from itself.)
fn content<M: Serialize + DeserializeOwned>(bytes: &[u8], noise: &[u8]) {
    let Ok(message) = parse::<M>(bytes) else { return };
    let mut frame = [0; MAX_FRAME];
    let length = encode(&message, &mut frame).expect("every message fits the longest frame");
    let frame = &frame[..length];
    assert_eq!(frame.iter().position(|byte| *byte == 0), Some(length - 1));

    let mut decoder = MessageDecoder::<M>::default();
    decoder.feed(noise, |_| {});
    decoder.feed(&[0], |_| {});
    let mut back = None;
    decoder.feed(frame, |message: Result<M, _>| back = message.ok());
    let mut again = [0; MAX_FRAME];
    let back = back.expect("a good frame after a delimiter is read");
    let length = encode(&back, &mut again).expect("every message fits the longest frame");
    assert_eq!(&again[..length], frame);
}

fuzz_target!(|bytes: &[u8]| {
    line::<Request>(bytes);
    line::<Report>(bytes);
    content::<Request>(bytes, bytes);
    content::<Report>(bytes, bytes);
    let _any_answer_will_do = version_of_greeting(bytes);
});
