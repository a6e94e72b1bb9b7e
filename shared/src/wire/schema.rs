//! Version and fingerprint with which rig and host check that they use the same protocol.

use postcard_schema::key::Key;

use super::message::{BATCH, PARAMETERS, Report, Request, SNAPSHOT_PART};
use crate::compensation::EFFECTS;
use crate::trajectory::{AMPLITUDES, HARMONICS, LEVELS, SPEEDS};

/// Version of the protocol: framing, and the meaning of each message.
///
/// Raise it if a frame or an exchange changes its meaning. A change of a type alone need not raise it, because
/// [`schema`] changes by itself. By convention it is raised too if a released rig would misunderstand.
pub const PROTOCOL_VERSION: u16 = 4;

/// Fingerprint of every message type: names and types of all fields and variants, and all capacities.
///
/// FNV-1a over the postcard schemas of [`Request`] and [`Report`] (`postcard_schema::key`), then over the capacities,
/// which the schemas leave out. Two programs with the same fingerprint decode each other's messages. It protects
/// against mistakes, not against intent.
pub const fn schema() -> u64 {
    const FINGERPRINT: u64 = {
        let request = u64::from_le_bytes(Key::for_path::<Request>("request").to_bytes());
        let report = u64::from_le_bytes(Key::for_path::<Report>("report").to_bytes());
        let mut hash = fold(FNV_BASIS, request);
        hash = fold(hash, report);
        hash = fold(hash, BATCH as u64);
        hash = fold(hash, SNAPSHOT_PART as u64);
        hash = fold(hash, PARAMETERS as u64);
        hash = fold(hash, HARMONICS as u64);
        hash = fold(hash, AMPLITUDES as u64);
        hash = fold(hash, LEVELS as u64);
        hash = fold(hash, SPEEDS as u64);
        fold(hash, EFFECTS as u64)
    };
    FINGERPRINT
}

/// FNV-1a, 64 bit: offset basis (Fowler, Noll, Vo; RFC 9923).
const FNV_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
/// FNV-1a, 64 bit: prime.
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;

const fn fold(mut hash: u64, word: u64) -> u64 {
    let mut shift = 0;
    while shift < 64 {
        hash = (hash ^ ((word >> shift) & 0xff)).wrapping_mul(FNV_PRIME);
        shift += 8;
    }
    hash
}

/// Protocol version and schema of a greeting whose remaining fields may be unknown here.
///
/// `payload` is a frame's content ([`Decoder::push`](super::Decoder::push)). A greeting is variant 0 of every
/// [`Report`] and begins with these two in every version, so that both ends can still refuse each other by name.
/// Returns `None` if the payload is not a greeting.
pub fn version_of_greeting(payload: &[u8]) -> Option<(u16, u64)> {
    let (head, _rest) = postcard::take_from_bytes::<(u32, u16, u64)>(payload).ok()?;
    let (variant, protocol, schema) = head;
    (variant == 0).then_some((protocol, schema))
}
