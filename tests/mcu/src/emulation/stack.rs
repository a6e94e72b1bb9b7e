//! Use of the stack.

use super::state::Emulation;
use crate::chip::Chip;
use crate::cpu::{Cpu, Register};
use crate::map;

/// Content of untouched RAM, to find the deepest use of the stack.
pub(super) const PAINT: u8 = 0xA5;
/// Stack paint of `cortex-m-rt` (its feature `paint-stack`), which the image itself reads.
const PAINTED: u8 = 0xCC;

impl<C: Cpu<Chip>> Emulation<C> {
    /// Returns the lowest allowed end of the stack, and its beginning.
    fn stack_range(&mut self) -> (u32, u32) {
        let top = self.word(map::FLASH.start);
        let bottom = ["__euninit", "__ebss", "_stack_end"]
            .iter()
            .filter_map(|name| self.image.symbol(name))
            .map(|(address, _)| address)
            .filter(|address| *address < top)
            .max()
            .unwrap_or(map::RAM.start);
        (bottom, top)
    }

    /// Returns the bytes of the stack used since the start or [`forget_stack`](Self::forget_stack), and the bytes
    /// available before the statics.
    pub fn stack(&mut self) -> (u32, u32) {
        let (bottom, top) = self.stack_range();
        let mut bytes = vec![0; (top - bottom) as usize];
        self.cpu.load(bottom, &mut bytes);
        let painted = |byte: &&u8| matches!(**byte, PAINT | PAINTED);
        let untouched = bytes.iter().take_while(painted).count();
        (top - bottom - untouched as u32, top - bottom)
    }

    /// Forgets the deepest use of the stack: paints the stack below its present end again.
    pub fn forget_stack(&mut self) {
        let (bottom, _) = self.stack_range();
        let now = self.cpu.get(Register::Sp);
        self.cpu
            .store(bottom, &vec![PAINTED; now.saturating_sub(bottom) as usize]);
    }
}
