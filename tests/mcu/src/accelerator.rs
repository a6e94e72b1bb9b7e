//! The flash memory's instruction cache, for the estimate of cycles.
//!
//! 32 lines of 32 bytes, replaced by least recent use (RM0440 rev 8, section 3.3.5 "Adaptive real-time memory
//! accelerator"). A 64-bit word that is not there costs the wait states in full: what the prefetch may hide
//! is not counted in its favour.

use crate::cost::WAIT_STATES;

const LINES: usize = 32;
const LINE: u32 = 32;
const WORD: u32 = 8;

/// The cache's tags.
#[derive(Clone, Debug)]
pub struct Accelerator {
    /// Line number and words present, the most recent first.
    lines: [(u32, u8); LINES],
}

impl Default for Accelerator {
    fn default() -> Self {
        Self {
            lines: [(u32::MAX, 0); LINES],
        }
    }
}

impl Accelerator {
    /// Cycles lost to fetch `size` bytes from `address` on.
    pub fn fetch(&mut self, address: u32, size: u32) -> u64 {
        let last = address + size.max(2) - 1;
        let mut lost = 0;
        for line in address / LINE..=last / LINE {
            let from = (address.max(line * LINE) % LINE) / WORD;
            let to = (last.min(line * LINE + LINE - 1) % LINE) / WORD;
            let wanted = ((1_u8 << (to + 1)) - 1) & !((1_u8 << from) - 1);
            let missing = wanted & !self.touch(line, wanted);
            lost += u64::from(missing.count_ones()) * WAIT_STATES;
        }
        lost
    }

    /// Words of `line` that were there; it is the most recent one afterwards, with `wanted`.
    fn touch(&mut self, line: u32, wanted: u8) -> u8 {
        let place = self.lines.iter().position(|(tag, _)| *tag == line);
        let place_or_last = place.unwrap_or(LINES - 1);
        let there = place.and_then(|p| self.lines.get(p)).map_or(0, |l| l.1);
        self.lines.copy_within(0..place_or_last, 1);
        self.lines[0] = (line, there | wanted);
        there
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn a_loop_misses_once_and_a_long_run_evicts_it() {
        let mut cache = Accelerator::default();
        assert_eq!(cache.fetch(0x0800_0000, 16), 2 * WAIT_STATES);
        assert_eq!(cache.fetch(0x0800_0000, 16), 0);
        assert_eq!(cache.fetch(0x0800_0010, 16), 2 * WAIT_STATES);
        // 31 further lines: the first is still there; one more and it is gone.
        for line in 1..=31 {
            cache.fetch(0x0800_0000 + 32 * line, 2);
        }
        assert_eq!(cache.fetch(0x0800_0000, 32), 0);
        for line in 1..=32 {
            cache.fetch(0x0800_0000 + 32 * line, 2);
        }
        assert_eq!(cache.fetch(0x0800_0000, 32), 4 * WAIT_STATES);
    }

    #[test]
    fn a_block_across_two_lines() {
        let mut cache = Accelerator::default();
        assert_eq!(cache.fetch(0x0800_001C, 8), 2 * WAIT_STATES);
        assert_eq!(cache.fetch(0x0800_0018, 2), 0);
        assert_eq!(cache.fetch(0x0800_0020, 2), 0);
    }
}
