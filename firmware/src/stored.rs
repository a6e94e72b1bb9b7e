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
use crate::usable;

/// Largest size of a copy, bytes; a whole number of 64-bit words, the unit of writing flash.
pub const IMAGE: usize = 1024;

/// "RIG1".
const MAGIC: u32 = u32::from_le_bytes(*b"RIG1");
const HEAD: usize = 4 + 8 + 4 + 2;
const CHECK: usize = 4;

// Postcard writes a type without heap in at most twice its size in memory.
const _: () = assert!(HEAD + 2 * size_of::<Settings>() + CHECK <= IMAGE);

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);

/// Content of one place.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // read once, at power on
pub enum Copy {
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
    Whole {
        /// Its number.
        number: u32,
        /// Its content.
        settings: Settings,
    },
}

/// Reads a place; accepts any bytes.
pub fn read(bytes: &[u8]) -> Copy {
    if bytes.iter().all(|&byte| byte == 0xff) {
        return Copy::Empty;
    }
    whole(bytes).unwrap_or(Copy::Damaged)
}

fn whole(bytes: &[u8]) -> Option<Copy> {
    let (magic, rest) = bytes.split_first_chunk::<4>()?;
    let (form, rest) = rest.split_first_chunk::<8>()?;
    let (number, rest) = rest.split_first_chunk::<4>()?;
    let (length, rest) = rest.split_first_chunk::<2>()?;
    let length = usize::from(u16::from_le_bytes(*length));
    let body = rest.get(..length)?;
    let check = rest.get(length..)?.first_chunk::<CHECK>()?;
    let right = u32::from_le_bytes(*magic) == MAGIC
        && CRC.checksum(bytes.get(..HEAD + length)?) == u32::from_le_bytes(*check);
    if !right {
        return None;
    }
    let number = u32::from_le_bytes(*number);
    if u64::from_le_bytes(*form) != schema() {
        return Some(Copy::Foreign { number });
    }
    let (settings, left) = postcard::take_from_bytes(body).ok()?;
    left.is_empty().then_some(Copy::Whole { number, settings })
}

/// Returns the bytes of a copy, padded with erased ones to whole words.
pub fn write(settings: &Settings, number: u32) -> Option<Vec<u8, IMAGE>> {
    let mut body = [0; IMAGE];
    let body = postcard::to_slice(settings, &mut body).ok()?;
    let mut bytes = Vec::new();
    bytes.extend_from_slice(&MAGIC.to_le_bytes()).ok()?;
    bytes.extend_from_slice(&schema().to_le_bytes()).ok()?;
    bytes.extend_from_slice(&number.to_le_bytes()).ok()?;
    bytes
        .extend_from_slice(&u16::try_from(body.len()).ok()?.to_le_bytes())
        .ok()?;
    bytes.extend_from_slice(body).ok()?;
    let check = CRC.checksum(&bytes);
    bytes.extend_from_slice(&check.to_le_bytes()).ok()?;
    while !bytes.len().is_multiple_of(8) {
        bytes.push(0xff).ok()?;
    }
    Some(bytes)
}

/// Result of reading both places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The settings to start with; `None`: the firmware's own.
    pub settings: Option<Settings>,
    /// Reason of this choice.
    pub origin: SettingsOrigin,
    /// The place to write next, 0 or 1.
    pub place: usize,
    /// The number to write next.
    pub number: u32,
}

/// Chooses the newest copy that is whole and usable on this rig.
pub fn choose(config: &Config, copies: [Copy; 2]) -> Found {
    let number = |copy: &Copy| match copy {
        Copy::Empty | Copy::Damaged => None,
        Copy::Foreign { number } | Copy::Whole { number, .. } => Some(*number),
    };
    let [first, second] = copies.each_ref().map(number);
    // None is below every number. No board stores four thousand million times.
    let newer = usize::from(second > first);
    let highest = first.max(second);
    let good = |copy: &Copy| match copy {
        Copy::Whole { settings, .. } => usable::settings(config, settings).then_some(*settings),
        _ => None,
    };
    let [newest, older] = [&copies[newer], &copies[1 - newer]];
    let damaged = copies.contains(&Copy::Damaged);
    let (newest, older) = (good(newest), good(older));
    let (settings, origin) = match (newest, older) {
        (Some(settings), _) if damaged => (Some(settings), SettingsOrigin::OlderCopy),
        (Some(settings), _) => (Some(settings), SettingsOrigin::Stored),
        (None, Some(settings)) => (Some(settings), SettingsOrigin::OlderCopy),
        (None, None) if highest.is_some() => (None, SettingsOrigin::Unusable),
        (None, None) if damaged => (None, SettingsOrigin::Damaged),
        (None, None) => (None, SettingsOrigin::Defaults),
    };
    Found {
        settings,
        origin,
        // Never the copy in force, but the unusable one, the empty one, or the older one.
        place: match (newest, older) {
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

    /// Two places of flash, written as the board does. Returns the settings that it would start with.
    struct Places([[u8; IMAGE]; 2]);

    impl Places {
        fn find(&self) -> Found {
            choose(
                &nameplate::one_link().0,
                [read(&self.0[0]), read(&self.0[1])],
            )
        }

        fn store(&mut self, settings: &Settings, words: usize) {
            let found = self.find();
            let bytes = write(settings, found.number).unwrap();
            let place = &mut self.0[found.place];
            *place = [0xff; IMAGE];
            let length = bytes.len().min(8 * words);
            place[..length].copy_from_slice(&bytes[..length]);
        }
    }

    #[test]
    fn an_empty_board_starts_with_its_own_and_then_with_the_last_stored() {
        let mut places = Places([[0xff; IMAGE]; 2]);
        assert_eq!(places.find().origin, SettingsOrigin::Defaults);
        for k in 0..5 {
            let torque = 1.0 + k as f32;
            places.store(&settings(torque), usize::MAX / 8);
            let found = places.find();
            assert_eq!(found.origin, SettingsOrigin::Stored);
            assert_eq!(found.settings, Some(settings(torque)));
        }
    }

    #[test]
    fn a_supply_that_fails_at_any_word_leaves_the_settings_before() {
        let whole = write(&settings(1.0), 0).unwrap().len() / 8;
        for words in 0..whole {
            let mut places = Places([[0xff; IMAGE]; 2]);
            places.store(&settings(1.0), usize::MAX / 8);
            places.store(&settings(2.0), usize::MAX / 8);
            places.store(&settings(3.0), words);
            let found = places.find();
            assert_eq!(found.settings, Some(settings(2.0)), "{words}");
            // The next store repairs the damaged place, not the whole one.
            places.store(&settings(4.0), usize::MAX / 8);
            let found = places.find();
            assert_eq!(found.settings, Some(settings(4.0)), "{words}");
            assert_eq!(found.origin, SettingsOrigin::Stored);
        }
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let bytes = write(&settings(1.0), 7).unwrap();
        for bit in 0..8 * bytes.len() {
            let mut place = bytes.clone();
            place[bit / 8] ^= 1 << (bit % 8);
            // Only padding follows the check sum.
            let found = read(&place);
            let padding =
                matches!(found, Copy::Whole { number: 7, .. }) && bit / 8 + 8 > bytes.len();
            assert!(found == Copy::Damaged || padding, "{bit}");
        }
    }

    #[test]
    fn both_copies_damaged_fall_back_and_say_so() {
        let mut places = Places([[0xff; IMAGE]; 2]);
        places.store(&settings(1.0), usize::MAX / 8);
        places.store(&settings(2.0), usize::MAX / 8);
        places.0[0][40] ^= 1;
        let found = places.find();
        assert_eq!(found.origin, SettingsOrigin::OlderCopy);
        assert_eq!(found.settings, Some(settings(2.0)));
        places.0[1][40] ^= 1;
        let found = places.find();
        assert_eq!(
            (found.settings, found.origin),
            (None, SettingsOrigin::Damaged)
        );
    }

    /// Flashed with another firmware, stored by that one, flashed back: the copy stored before still holds.
    #[test]
    fn a_newer_copy_of_another_firmware_does_not_hide_an_older_one() {
        let mut places = Places([[0xff; IMAGE]; 2]);
        places.store(&settings(1.0), usize::MAX / 8);
        places.store(&settings(2.0), usize::MAX / 8);
        let newer = &mut places.0[1];
        newer[4] ^= 1;
        let length = HEAD + usize::from(u16::from_le_bytes([newer[16], newer[17]]));
        let check = CRC.checksum(&newer[..length]);
        newer[length..length + CHECK].copy_from_slice(&check.to_le_bytes());
        assert!(matches!(read(newer), Copy::Foreign { number: 1 }));
        let found = places.find();
        assert_eq!(found.settings, Some(settings(1.0)));
        assert_eq!(found.origin, SettingsOrigin::OlderCopy);
        // Over the copy that this firmware cannot use.
        assert_eq!((found.place, found.number), (1, 2));
    }

    #[test]
    fn whole_settings_that_no_rig_may_run_with_are_not_used() {
        let mut places = Places([[0xff; IMAGE]; 2]);
        places.store(&settings(-1.0), usize::MAX / 8);
        let found = places.find();
        assert_eq!(
            (found.settings, found.origin),
            (None, SettingsOrigin::Unusable)
        );
    }
}
