//! The flash memory's instruction cache and prefetch, for the estimate of cycles.
//!
//! 32 lines of 32 bytes, least recently used replaced (RM0440 rev 8, section 3.3.5 "Adaptive real-time memory
//! accelerator"). A missing 64-bit word costs all wait states. With the prefetch on, the word after a fetched one is
//! loaded while that one executes: it costs only its remaining time.

use crate::cost::WAIT_STATES;

const LINES: usize = 32;
const LINE: u32 = 32;
const WORD: u32 = 8;

/// The cache's tags.
#[derive(Clone, Debug)]
pub struct Accelerator {
    /// Line number and present words, the most recent first.
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
    /// Returns the cycles lost to fetch the block of `size` bytes at `address`, which takes `cycles` to execute.
    /// `follows`: reached without a branch, so a prefetch had begun.
    pub fn fetch(
        &mut self,
        address: u32,
        size: u32,
        cycles: u64,
        prefetch: bool,
        follows: bool,
    ) -> u64 {
        let last = address + size.max(2) - 1;
        let words = u64::from(last / WORD - address / WORD + 1);
        let hidden = if prefetch { cycles / words } else { 0 };
        let mut ahead = follows;
        let mut lost = 0;
        for line in address / LINE..=last / LINE {
            let from = (address.max(line * LINE) % LINE) / WORD;
            let to = (last.min(line * LINE + LINE - 1) % LINE) / WORD;
            let wanted = ((1_u8 << (to + 1)) - 1) & !((1_u8 << from) - 1);
            let missing = wanted & !self.touch(line, wanted);
            for word in from..=to {
                if missing & 1 << word != 0 {
                    let hidden = if ahead { hidden } else { 0 };
                    lost += WAIT_STATES.saturating_sub(hidden);
                }
                ahead = true;
            }
        }
        lost
    }

    /// Returns the words of `line` that were present. Then the line is the most recent one, with `wanted`.
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

    fn plain(cache: &mut Accelerator, address: u32, size: u32) -> u64 {
        cache.fetch(address, size, 100, false, false)
    }

    /// Four words of three cycles each: the first waits in full, the others for the remaining time.
    #[test]
    fn the_prefetch_hides_what_is_executed_meanwhile() {
        let mut cache = Accelerator::default();
        let lost = cache.fetch(0x0800_0000, 32, 12, true, false);
        assert_eq!(lost, WAIT_STATES + 3 * (WAIT_STATES - 3));
        let lost = cache.fetch(0x0800_0020, 8, 3, true, true);
        assert_eq!(lost, WAIT_STATES - 3);
    }

    #[test]
    fn a_loop_misses_once_and_a_long_run_evicts_it() {
        let mut cache = Accelerator::default();
        assert_eq!(plain(&mut cache, 0x0800_0000, 16), 2 * WAIT_STATES);
        assert_eq!(plain(&mut cache, 0x0800_0000, 16), 0);
        assert_eq!(plain(&mut cache, 0x0800_0010, 16), 2 * WAIT_STATES);
        // After 31 more lines the first is still present; after one more it is not.
        for line in 1..=31 {
            plain(&mut cache, 0x0800_0000 + 32 * line, 2);
        }
        assert_eq!(plain(&mut cache, 0x0800_0000, 32), 0);
        for line in 1..=32 {
            plain(&mut cache, 0x0800_0000 + 32 * line, 2);
        }
        assert_eq!(plain(&mut cache, 0x0800_0000, 32), 4 * WAIT_STATES);
    }

    #[test]
    fn a_block_across_two_lines() {
        let mut cache = Accelerator::default();
        assert_eq!(plain(&mut cache, 0x0800_001C, 8), 2 * WAIT_STATES);
        assert_eq!(plain(&mut cache, 0x0800_0018, 2), 0);
        assert_eq!(plain(&mut cache, 0x0800_0020, 2), 0);
    }
}
