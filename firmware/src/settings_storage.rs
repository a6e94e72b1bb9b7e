//! Settings in the board's memory: two copies, one of which is always whole.
//!
//! ```text
//!  magic u32 · schema u64 · number u32 · length u16 · postcard(Settings) · CRC-32C u32, little-endian
//! ```
//!
//! A new copy is written over the older one, so the newer one survives a supply failure. The number counts up; the
//! whole copy with the higher number holds. `schema` is the fingerprint of the wire types
//! ([`rig_shared::wire::schema()`]) that make up [`Settings`]: another firmware's format is never interpreted.

use crc::{CRC_32_ISCSI, Crc, Table};
use heapless::Vec;
use rig_shared::wire::message::SettingsOrigin;
use rig_shared::wire::schema;

use crate::config::{Config, Settings};
use crate::validation;

/// Largest size of a copy, bytes; a whole number of 64-bit words, the unit of writing flash.
pub const MAX_COPY_BYTES: usize = 1024;

/// "RIG1".
const MAGIC: u32 = u32::from_le_bytes(*b"RIG1");
const HEADER_BYTES: usize = 4 + 8 + 4 + 2;
const CRC_BYTES: usize = 4;

// Postcard writes a type without heap in at most twice its size in memory.
const _: () = assert!(HEADER_BYTES + 2 * size_of::<Settings>() + CRC_BYTES <= MAX_COPY_BYTES);

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);

/// Content of one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // read once, at power on
pub enum StoredCopy {
    /// Erased, never written.
    Empty,
    /// Content that differs from the written one.
    Damaged,
    /// Whole, but in another firmware's format.
    Foreign {
        /// Its number.
        number: u32,
    },
    /// Whole.
    Valid {
        /// Its number.
        number: u32,
        /// Its content.
        settings: Settings,
    },
}

/// Reads a slot; accepts any bytes.
pub fn decode(bytes: &[u8]) -> StoredCopy {
    if bytes.iter().all(|&byte| byte == 0xff) {
        return StoredCopy::Empty;
    }
    decode_copy(bytes).unwrap_or(StoredCopy::Damaged)
}

fn decode_copy(bytes: &[u8]) -> Option<StoredCopy> {
    let (magic, rest) = bytes.split_first_chunk::<4>()?;
    let (fingerprint, rest) = rest.split_first_chunk::<8>()?;
    let (number, rest) = rest.split_first_chunk::<4>()?;
    let (length, rest) = rest.split_first_chunk::<2>()?;
    let length = usize::from(u16::from_le_bytes(*length));
    let body = rest.get(..length)?;
    let checksum = rest.get(length..)?.first_chunk::<CRC_BYTES>()?;
    let intact = u32::from_le_bytes(*magic) == MAGIC
        && CRC.checksum(bytes.get(..HEADER_BYTES + length)?) == u32::from_le_bytes(*checksum);
    if !intact {
        return None;
    }
    let number = u32::from_le_bytes(*number);
    if u64::from_le_bytes(*fingerprint) != schema() {
        return Some(StoredCopy::Foreign { number });
    }
    let (settings, rest_bytes) = postcard::take_from_bytes(body).ok()?;
    rest_bytes
        .is_empty()
        .then_some(StoredCopy::Valid { number, settings })
}

/// Returns the bytes of a copy, padded with erased ones to whole words.
pub fn encode(settings: &Settings, number: u32) -> Option<Vec<u8, MAX_COPY_BYTES>> {
    let mut body = [0; MAX_COPY_BYTES];
    let body = postcard::to_slice(settings, &mut body).ok()?;
    let mut bytes = Vec::new();
    bytes.extend_from_slice(&MAGIC.to_le_bytes()).ok()?;
    bytes.extend_from_slice(&schema().to_le_bytes()).ok()?;
    bytes.extend_from_slice(&number.to_le_bytes()).ok()?;
    bytes
        .extend_from_slice(&u16::try_from(body.len()).ok()?.to_le_bytes())
        .ok()?;
    bytes.extend_from_slice(body).ok()?;
    let checksum = CRC.checksum(&bytes);
    bytes.extend_from_slice(&checksum.to_le_bytes()).ok()?;
    while !bytes.len().is_multiple_of(8) {
        bytes.push(0xff).ok()?;
    }
    Some(bytes)
}

/// Result of reading both slots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selection {
    /// The settings to start with; `None`: the firmware's own.
    pub settings: Option<Settings>,
    /// Reason of this choice.
    pub origin: SettingsOrigin,
    /// The slot to write next, 0 or 1.
    pub slot: usize,
    /// The number to write next.
    pub number: u32,
}

/// Chooses the newest copy that is whole and usable on this rig.
pub fn select(config: &Config, copies: [StoredCopy; 2]) -> Selection {
    let number = |copy: &StoredCopy| match copy {
        StoredCopy::Empty | StoredCopy::Damaged => None,
        StoredCopy::Foreign { number } | StoredCopy::Valid { number, .. } => Some(*number),
    };
    let [first, second] = copies.each_ref().map(number);
    // None is below every number. No board stores four thousand million times.
    let newer = usize::from(second > first);
    let highest = first.max(second);
    let usable_settings = |copy: &StoredCopy| match copy {
        StoredCopy::Valid { settings, .. } => {
            validation::settings(config, settings).then_some(*settings)
        }
        _ => None,
    };
    let [newest, older] = [&copies[newer], &copies[1 - newer]];
    let damaged = copies.contains(&StoredCopy::Damaged);
    let (newest, older) = (usable_settings(newest), usable_settings(older));
    let (settings, origin) = match (newest, older) {
        (Some(settings), _) if damaged => (Some(settings), SettingsOrigin::OlderCopy),
        (Some(settings), _) => (Some(settings), SettingsOrigin::Stored),
        (None, Some(settings)) => (Some(settings), SettingsOrigin::OlderCopy),
        (None, None) if highest.is_some() => (None, SettingsOrigin::Unusable),
        (None, None) if damaged => (None, SettingsOrigin::Damaged),
        (None, None) => (None, SettingsOrigin::Defaults),
    };
    Selection {
        settings,
        origin,
        // Never the copy in force, but the unusable one, the empty one, or the older one.
        slot: match (newest, older) {
            (None, Some(_)) => newer,
            _ if highest.is_none() => 0,
            _ => 1 - newer,
        },
        number: highest.map_or(0, |number| number.wrapping_add(1)),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::nameplate;

    fn settings(torque: f32) -> Settings {
        let (_, mut settings) = nameplate::one_link();
        settings.limits.torque = torque;
        settings
    }

    /// Two slots of flash, written as the board does. Returns the settings that it would start with.
    struct Slots([[u8; MAX_COPY_BYTES]; 2]);

    impl Slots {
        fn select(&self) -> Selection {
            select(
                &nameplate::one_link().0,
                [decode(&self.0[0]), decode(&self.0[1])],
            )
        }

        fn store(&mut self, settings: &Settings, words: usize) {
            let selection = self.select();
            let bytes = encode(settings, selection.number).unwrap();
            let slot = &mut self.0[selection.slot];
            *slot = [0xff; MAX_COPY_BYTES];
            let length = bytes.len().min(8 * words);
            slot[..length].copy_from_slice(&bytes[..length]);
        }
    }

    #[test]
    fn an_empty_board_starts_with_its_own_and_then_with_the_last_stored() {
        let mut slots = Slots([[0xff; MAX_COPY_BYTES]; 2]);
        assert_eq!(slots.select().origin, SettingsOrigin::Defaults);
        for k in 0..5 {
            let torque = 1.0 + k as f32;
            slots.store(&settings(torque), usize::MAX / 8);
            let selection = slots.select();
            assert_eq!(selection.origin, SettingsOrigin::Stored);
            assert_eq!(selection.settings, Some(settings(torque)));
        }
    }

    #[test]
    fn a_supply_that_fails_at_any_word_leaves_the_settings_before() {
        let words_per_copy = encode(&settings(1.0), 0).unwrap().len() / 8;
        for words in 0..words_per_copy {
            let mut slots = Slots([[0xff; MAX_COPY_BYTES]; 2]);
            slots.store(&settings(1.0), usize::MAX / 8);
            slots.store(&settings(2.0), usize::MAX / 8);
            slots.store(&settings(3.0), words);
            let selection = slots.select();
            assert_eq!(selection.settings, Some(settings(2.0)), "{words}");
            // The next store repairs the damaged slot, not the whole one.
            slots.store(&settings(4.0), usize::MAX / 8);
            let selection = slots.select();
            assert_eq!(selection.settings, Some(settings(4.0)), "{words}");
            assert_eq!(selection.origin, SettingsOrigin::Stored);
        }
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let bytes = encode(&settings(1.0), 7).unwrap();
        for bit in 0..8 * bytes.len() {
            let mut slot = bytes.clone();
            slot[bit / 8] ^= 1 << (bit % 8);
            // Only padding follows the check sum.
            let copy = decode(&slot);
            let padding =
                matches!(copy, StoredCopy::Valid { number: 7, .. }) && bit / 8 + 8 > bytes.len();
            assert!(copy == StoredCopy::Damaged || padding, "{bit}");
        }
    }

    #[test]
    fn both_copies_damaged_fall_back_and_say_so() {
        let mut slots = Slots([[0xff; MAX_COPY_BYTES]; 2]);
        slots.store(&settings(1.0), usize::MAX / 8);
        slots.store(&settings(2.0), usize::MAX / 8);
        slots.0[0][40] ^= 1;
        let selection = slots.select();
        assert_eq!(selection.origin, SettingsOrigin::OlderCopy);
        assert_eq!(selection.settings, Some(settings(2.0)));
        slots.0[1][40] ^= 1;
        let selection = slots.select();
        assert_eq!(
            (selection.settings, selection.origin),
            (None, SettingsOrigin::Damaged)
        );
    }

    /// Flashed with another firmware, stored by that one, flashed back: the copy stored before still holds.
    #[test]
    fn a_newer_copy_of_another_firmware_does_not_hide_an_older_one() {
        let mut slots = Slots([[0xff; MAX_COPY_BYTES]; 2]);
        slots.store(&settings(1.0), usize::MAX / 8);
        slots.store(&settings(2.0), usize::MAX / 8);
        let newer = &mut slots.0[1];
        newer[4] ^= 1;
        let length = HEADER_BYTES + usize::from(u16::from_le_bytes([newer[16], newer[17]]));
        let checksum = CRC.checksum(&newer[..length]);
        newer[length..length + CRC_BYTES].copy_from_slice(&checksum.to_le_bytes());
        assert!(matches!(decode(newer), StoredCopy::Foreign { number: 1 }));
        let selection = slots.select();
        assert_eq!(selection.settings, Some(settings(1.0)));
        assert_eq!(selection.origin, SettingsOrigin::OlderCopy);
        // Over the copy that this firmware cannot use.
        assert_eq!((selection.slot, selection.number), (1, 2));
    }

    #[test]
    fn whole_settings_that_no_rig_may_run_with_are_not_used() {
        let mut slots = Slots([[0xff; MAX_COPY_BYTES]; 2]);
        slots.store(&settings(-1.0), usize::MAX / 8);
        let selection = slots.select();
        assert_eq!(
            (selection.settings, selection.origin),
            (None, SettingsOrigin::Unusable)
        );
    }
}
