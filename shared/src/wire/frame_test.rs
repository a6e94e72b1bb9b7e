#![allow(clippy::unwrap_used, clippy::panic)]

use std::vec;
use std::vec::Vec;

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType};
use proptest::prelude::*;
use serde::Serialize;

use super::super::message::*;
use super::super::schema::version_of_greeting;
use super::*;
use crate::safety::{LimitSet, Mode, SnapshotSample};

/// Returns the bytes of the longest varint of `bits` bits.
fn varint(bits: usize) -> usize {
    bits.div_ceil(7)
}

/// Returns an upper bound of a type's postcard size, with sequences up to `sequence` entries and texts up to 24 bytes.
fn bound(named: &NamedType, sequence: usize) -> usize {
    let each = |types: &[&NamedType]| types.iter().map(|one| bound(one, sequence)).sum::<usize>();
    match named.ty {
        DataModelType::Bool | DataModelType::I8 | DataModelType::U8 => 1,
        DataModelType::I16 | DataModelType::U16 => varint(16),
        DataModelType::I32 | DataModelType::U32 => varint(32),
        DataModelType::I64 | DataModelType::U64 | DataModelType::Usize | DataModelType::Isize => {
            varint(64)
        }
        DataModelType::F32 => 4,
        DataModelType::F64 => 8,
        DataModelType::String => 1 + 24,
        DataModelType::Option(inner) => 1 + bound(inner, sequence),
        DataModelType::Unit | DataModelType::UnitStruct => 0,
        DataModelType::NewtypeStruct(inner) => bound(inner, sequence),
        DataModelType::Seq(inner) => varint(64) + sequence * bound(inner, sequence),
        DataModelType::Tuple(types) | DataModelType::TupleStruct(types) => each(types),
        DataModelType::Struct(fields) => fields.iter().map(|field| bound(field.ty, sequence)).sum(),
        DataModelType::Enum(variants) => {
            let widest = variants.iter().map(|variant| match variant.ty {
                DataModelVariant::UnitVariant => 0,
                DataModelVariant::NewtypeVariant(inner) => bound(inner, sequence),
                DataModelVariant::TupleVariant(types) => each(types),
                DataModelVariant::StructVariant(fields) => {
                    fields.iter().map(|field| bound(field.ty, sequence)).sum()
                }
            });
            varint(32) + widest.max().unwrap_or(0)
        }
        other => panic!("no bound for {other:?}"),
    }
}

#[test]
fn no_message_is_longer_than_the_buffers() {
    // 16: the longest sequence of any message type, that of a friction sweep.
    let longest = 16
        .max(BATCH)
        .max(SNAPSHOT_PART)
        .max(crate::trajectory::SPEEDS);
    assert!(bound(Request::SCHEMA, longest) <= MAX_MESSAGE);
    assert!(bound(Report::SCHEMA, longest) <= MAX_MESSAGE);
}

fn fullest_batch() -> Report {
    let sample = StateSample {
        position_sum: i64::MIN,
        velocity: f32::MAX,
        current: f32::MIN,
        voltage: 1.0,
        reference: 1.0,
        torque_command: 1.0,
        limits: LimitSet(255),
        mode: Mode::Fault,
    };
    Report::Batch(Batch {
        sequence: u32::MAX,
        first_tick: u64::MAX,
        samples: heapless::Vec::from_slice(&[sample; BATCH]).unwrap(),
    })
}

fn fullest_snapshot() -> Report {
    let sample = SnapshotSample {
        tick: u64::MAX,
        position: i64::MIN,
        current: 1.0,
        duty: 1.0,
        supply: 1.0,
        reference: 1.0,
    };
    Report::Snapshot(SnapshotPart {
        first: u16::MAX,
        total: u16::MAX,
        samples: heapless::Vec::from_slice(&[sample; SNAPSHOT_PART]).unwrap(),
    })
}

#[test]
fn fullest_messages_fit_and_come_back() {
    for report in [fullest_batch(), fullest_snapshot()] {
        let mut frame = [0; MAX_FRAME];
        let length = encode(&report, &mut frame).unwrap();
        let mut decoder = MessageDecoder::<Report>::default();
        let mut back = None;
        decoder.feed(&frame[..length], |message| back = Some(message));
        assert_eq!(back, Some(Ok(report)));
    }
}

/// Bytes as a message, to reach every length of content.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

fn payloads(decoder: &mut Decoder<MAX_PAYLOAD>, bytes: &[u8]) -> Vec<Result<Vec<u8>, DecodeError>> {
    let mut out = Vec::new();
    for byte in bytes {
        if let Some(payload) = decoder.push(*byte) {
            out.push(payload.map(<[u8]>::to_vec));
        }
    }
    out
}

#[test]
fn every_length_up_to_the_longest_comes_back_and_one_more_is_too_long() {
    // With and without zeros, so that COBS blocks of 254 bytes are full and not full.
    for pattern in [1_usize, 2, 255, 256] {
        let content: Vec<u8> = (0..=MAX_MESSAGE)
            .map(|k| (k % pattern + usize::from(pattern != 256)) as u8)
            .collect();
        for length in 0..=MAX_MESSAGE {
            let mut frame = [0xAA; MAX_FRAME];
            let end = encode(&Raw(&content[..length]), &mut frame).unwrap();
            assert_eq!(
                frame[..end].iter().position(|byte| *byte == 0),
                Some(end - 1)
            );
            let got = payloads(&mut Decoder::new(), &frame[..end]);
            assert_eq!(got, [Ok(content[..length].to_vec())]);
            // The exact length suffices, one byte less is refused.
            assert_eq!(encode(&Raw(&content[..length]), &mut vec![0; end]), Ok(end));
            assert_eq!(
                encode(&Raw(&content[..length]), &mut vec![0; end - 1]),
                Err(EncodeError::BufferTooSmall)
            );
        }
    }
    let content = [7; MAX_MESSAGE + 1];
    let mut frame = [0; MAX_FRAME + 8];
    let end = encode(&Raw(&content), &mut frame).unwrap();
    let mut decoder = Decoder::new();
    assert_eq!(
        payloads(&mut decoder, &frame[..end]),
        [Err(DecodeError::TooLong)]
    );
    let end = encode(&Raw(&[1, 0, 2]), &mut frame).unwrap();
    assert_eq!(payloads(&mut decoder, &frame[..end]), [Ok(vec![1, 0, 2])]);
    assert_eq!((decoder.counts().too_long, decoder.counts().good), (1, 1));
}

#[test]
fn a_truncated_frame_costs_itself_and_no_other() {
    let mut frame = [0; MAX_FRAME];
    let end = encode(&fullest_batch(), &mut frame).unwrap();
    let whole = &frame[..end];
    for cut in 1..end - 1 {
        // The tail is missing, except for the delimiter.
        let mut line = whole[..cut].to_vec();
        line.push(0);
        line.extend_from_slice(whole);
        let mut decoder = MessageDecoder::<Report>::default();
        let mut got = Vec::new();
        decoder.feed(&line, |message| got.push(message));
        assert_eq!(got.len(), 2);
        assert!(got[0].is_err());
        assert_eq!(got[1], Ok(fullest_batch()));
        // The head is missing.
        let mut line = whole[cut..].to_vec();
        line.extend_from_slice(whole);
        got.clear();
        decoder.feed(&line, |message| got.push(message));
        assert_eq!(got.len(), 2);
        assert!(got[0].is_err());
        assert_eq!(got[1], Ok(fullest_batch()));
    }
}

#[test]
fn every_single_and_double_flipped_bit_in_a_content_is_found() {
    let report = Report::StreamEnd(StreamEnd {
        batches: 3,
        samples: 20,
        dropped: 1,
        first_tick: 5,
    });
    let mut message = [0; 64];
    let message = postcard::to_slice(&report, &mut message).unwrap();
    let mut content = message.to_vec();
    content.extend_from_slice(&CRC.checksum(message).to_le_bytes());
    let bits = content.len() * 8;
    let framed = |content: &[u8]| {
        let mut frame = vec![0; MAX_FRAME];
        let end = cobs::encode(content, &mut frame);
        frame.truncate(end);
        frame.push(0);
        frame
    };
    assert_eq!(
        payloads(&mut Decoder::new(), &framed(&content)),
        [Ok(message.to_vec())]
    );
    for first in 0..bits {
        for second in first..bits {
            let mut spoilt = content.clone();
            spoilt[first / 8] ^= 1 << (first % 8);
            if second != first {
                spoilt[second / 8] ^= 1 << (second % 8);
            }
            assert_eq!(
                payloads(&mut Decoder::new(), &framed(&spoilt)),
                [Err(DecodeError::Crc)]
            );
        }
    }
}

#[test]
fn a_frame_with_a_message_and_more_is_no_message() {
    let mut frame = [0; MAX_FRAME];
    let end = encode(&(fullest_batch(), 1_u8), &mut frame).unwrap();
    let mut decoder = MessageDecoder::<Report>::default();
    let mut got = Vec::new();
    decoder.feed(&frame[..end], |message| got.push(message));
    assert_eq!(got, [Err(DecodeError::Message)]);
    let counts = decoder.counts();
    assert_eq!((counts.good, counts.bad_message, counts.bad()), (1, 1, 0));
}

#[test]
fn the_greeting_of_an_unknown_version_still_tells_its_version() {
    // A future greeting: variant 0, protocol, schema, then unknown fields.
    let mut payload = [0; 64];
    let payload = postcard::to_slice(
        &(0_u32, 77_u16, u64::MAX - 1, "later", 3.5_f64),
        &mut payload,
    )
    .unwrap();
    assert_eq!(version_of_greeting(payload), Some((77, u64::MAX - 1)));
    let mut other = [0; 64];
    let other = postcard::to_slice(&(1_u32, 77_u16, 5_u64), &mut other).unwrap();
    assert_eq!(version_of_greeting(other), None);
    assert_eq!(version_of_greeting(&[]), None);
}

proptest! {
    #[test]
    fn any_content_comes_back(content in prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 0..=MAX_MESSAGE)) {
        let mut frame = [0; MAX_FRAME];
        let end = encode(&Raw(&content), &mut frame).unwrap();
        prop_assert_eq!(payloads(&mut Decoder::new(), &frame[..end]), [Ok(content)]);
    }

    #[test]
    fn after_garbage_the_frame_behind_the_next_delimiter_is_read(garbage in prop::collection::vec(any::<u8>(), 0..3000)) {
        let mut frame = [0; MAX_FRAME];
        let end = encode(&fullest_batch(), &mut frame).unwrap();
        let mut line = garbage;
        line.extend_from_slice(&frame[..end]);
        line.extend_from_slice(&frame[..end]);
        let mut last = None;
        MessageDecoder::<Report>::default().feed(&line, |message| last = Some(message));
        prop_assert_eq!(last, Some(Ok(fullest_batch())));
    }
}
