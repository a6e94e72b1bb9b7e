//! Entry to exceptions, return from them, and faults.

use super::error::EmulationError;
use super::state::{Emulation, Running};
use crate::chip::Chip;
use crate::cpu::{Cpu, Register};
use crate::map;
use crate::nvic::HARD_FAULT;

/// Exception entry and return on a Cortex-M4 without wait states (ARM DDI 0439B, section 3.9.1).
const ENTRY: u64 = 12;
const RETURN: u64 = 10;

impl<C: Cpu<Chip>> Emulation<C> {
    pub(super) fn fault(
        &mut self,
        status: u32,
        address: u32,
        what: String,
    ) -> Result<(), EmulationError> {
        self.note_fault(what)?;
        let masks = self.cpu.masks();
        let in_fault = self.cpu.bus().nvic.running() == Some(HARD_FAULT);
        if in_fault || masks.faultmask {
            self.lock_up();
            return Ok(());
        }
        let mut chip = self.cpu.bus();
        chip.nvic.fault(status, address);
        chip.nvic.pend(HARD_FAULT);
        Ok(())
    }

    /// Records a fault; returns an error if none was expected.
    fn note_fault(&mut self, what: String) -> Result<(), EmulationError> {
        let pc = self.cpu.get(Register::Pc);
        self.faults.push((pc, what.clone()));
        if self.faults_expected {
            return Ok(());
        }
        Err(EmulationError::Fault {
            what,
            pc,
            function: self.name(pc),
        })
    }

    pub(super) fn lock_up(&mut self) {
        self.locked = true;
        self.cpu.bus().lock_up();
    }

    pub(super) fn enter(&mut self, exception: u16) -> Result<(), EmulationError> {
        let control = self.cpu.get(Register::Control);
        if control & 3 != 0 {
            return Err(EmulationError::Processor(
                "the process stack and unprivileged mode are not modelled".to_owned(),
            ));
        }
        let float = control & 4 != 0;
        let sp = self.cpu.get(Register::Sp);
        let size = if float { 104 } else { 32 };
        let frame = sp.wrapping_sub(size) & !7;
        let padded = frame != sp.wrapping_sub(size);
        let xpsr = (self.cpu.get(Register::Xpsr) & !(1 << 9)) | u32::from(padded) << 9 | 1 << 24;
        let mut words: Vec<u32> = [0, 1, 2, 3, 12]
            .map(|n| self.cpu.get(Register::General(n)))
            .to_vec();
        words.extend([self.cpu.get(Register::Lr), self.cpu.get(Register::Pc), xpsr]);
        if float {
            words.extend((0..16).map(|n| self.cpu.get(Register::Single(n))));
            words.extend([self.cpu.get(Register::Fpscr), 0]);
        }
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        if !map::RAM.contains(&frame) || !self.cpu.store(frame, &bytes) {
            // A fault while stacking for a fault locks the processor up (B1.5.15).
            self.note_fault(format!(
                "no room for exception {exception}'s frame at {frame:#010x}"
            ))?;
            self.lock_up();
            return Ok(());
        }
        let nested = self.cpu.bus().nvic.depth() > 0;
        let link = if nested { 0xFFFF_FFF1 } else { 0xFFFF_FFF9 } & !(u32::from(float) << 4);
        let vectors = self.cpu.bus().nvic.vectors();
        let handler = self.word(vectors + 4 * u32::from(exception));
        self.cpu.set(Register::Sp, frame);
        self.cpu.set(Register::Lr, link);
        self.cpu.set(Register::Control, control & !4);
        self.cpu.set(
            Register::Xpsr,
            (xpsr & 0xF80F_0000) | u32::from(exception) | 1 << 24,
        );
        self.cpu.set(Register::Pc, handler);
        if let Some(silenced) = self.silenced.filter(|s| s.exception == exception) {
            let mut byte = [0];
            self.cpu.load(silenced.address, &mut byte);
            let left = byte[0] & !silenced.bits;
            self.cpu.store(silenced.address, &[left]);
        }
        let mut chip = self.cpu.bus();
        chip.event = true;
        self.running.push(Running {
            exception,
            instructions: chip.work.instructions,
            cycles: chip.work.cycles,
            nested_instructions: 0,
            nested_cycles: 0,
        });
        chip.spend(ENTRY);
        chip.nvic.enter(exception);
        Ok(())
    }

    pub(super) fn leave(&mut self, link: u32) -> Result<(), EmulationError> {
        let Some(running) = self.running.pop() else {
            return Err(EmulationError::Processor(format!(
                "a branch to {link:#010x} outside any exception"
            )));
        };
        if link & 0xF != 1 && link & 0xF != 9 {
            return Err(EmulationError::Processor(format!(
                "exception return {link:#010x} to the process stack is not modelled"
            )));
        }
        let float = link & 0x10 == 0;
        let frame = self.cpu.get(Register::Sp);
        let size = if float { 26 } else { 8 };
        let mut bytes = vec![0; 4 * size];
        self.cpu.load(frame, &mut bytes);
        let words: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|c| c.iter().rev().fold(0, |w, b| w << 8 | u32::from(*b)))
            .collect();
        let word = |k: usize| words.get(k).copied().unwrap_or(0);
        for (k, n) in [0, 1, 2, 3, 12].into_iter().enumerate() {
            self.cpu.set(Register::General(n), word(k));
        }
        self.cpu.set(Register::Lr, word(5));
        let xpsr = word(7);
        let padding = 4 * (xpsr >> 9 & 1);
        if float {
            for n in 0..16 {
                self.cpu.set(Register::Single(n), word(8 + usize::from(n)));
            }
            self.cpu.set(Register::Fpscr, word(24));
        }
        let control = self.cpu.get(Register::Control) & !4 | u32::from(float) << 2;
        self.cpu.set(Register::Xpsr, xpsr & !(1 << 9));
        self.cpu.set(Register::Control, control);
        self.cpu
            .set(Register::Sp, frame + 4 * size as u32 + padding);
        self.cpu.set(Register::Pc, word(6));
        let mut chip = self.cpu.bus();
        chip.event = true;
        chip.spend(RETURN);
        chip.nvic.leave();
        let instructions = chip.work.instructions - running.instructions;
        let cycles = chip.work.cycles - running.cycles;
        drop(chip);
        if running.exception == HARD_FAULT || self.cpu.masks().faultmask {
            self.cpu.set(Register::Faultmask, 0);
        }
        let (own_instructions, own_cycles) = (
            instructions - running.nested_instructions,
            cycles - running.nested_cycles,
        );
        if let Some(cost) = self.costs.get_mut(usize::from(running.exception)) {
            cost.count += 1;
            cost.instructions += own_instructions;
            cost.cycles += own_cycles;
            cost.worst_instructions = cost.worst_instructions.max(own_instructions);
            cost.worst_cycles = cost.worst_cycles.max(own_cycles);
        }
        if let Some(outer) = self.running.last_mut() {
            outer.nested_instructions += instructions;
            outer.nested_cycles += cycles;
        }
        Ok(())
    }
}
