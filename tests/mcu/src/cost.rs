//! Cost of a block of Thumb-2 code: instructions exactly, cycles by class.
//!
//! Cycles are those of the Cortex-M4 Technical Reference Manual (ARM DDI 0439B, table 3-1 and table 7-1), with the
//! worst value of each range: loads 2, but 1 right behind another load or store, with which they pipeline (section
//! 3.3.2); division 12, multiply with accumulate 2, load and store multiple 1+N, a taken branch refills the pipeline in
//! 3 (P = 1 to 3), VDIV and VSQRT 14, VMLA and VFMA 3, VLDM 1+N. Literals of code in flash pay the wait states each
//! time, as if there were no data cache; those of code in the CCM SRAM have no wait (RM0440 rev 8, section 2.4). Left
//! out: contention of DMA and processor for the bus, and of a literal's load and the next fetch for the CCM SRAM.

use crate::cpu::Block;
use crate::map;

/// Wait states of the flash at 170 MHz, boost range (RM0440 rev 8, table 29).
pub const WAIT_STATES: u64 = 4;
/// Cycles to refill the pipeline after a taken branch.
pub const REFILL: u64 = 3;

/// Returns the length in bytes of the instruction that begins with `first`.
pub fn length(first: u16) -> usize {
    if first >> 11 >= 0b11101 { 4 } else { 2 }
}

/// Returns the costs of the block `code` at `address`.
pub fn of_block(address: u32, code: &[u8]) -> Block {
    let mut block = Block {
        address,
        size: code.len() as u16,
        ..Block::default()
    };
    // A literal is in the same memory as the code that loads it.
    let literal = if map::FLASH.contains(&address) {
        2 + WAIT_STATES
    } else {
        2
    };
    let mut at = 0;
    let mut pipelined = false;
    while let Some(&[a, b]) = code.get(at..at + 2) {
        let first = u16::from_le_bytes([a, b]);
        let wide = length(first) == 4;
        let second = match code.get(at + 2..at + 4) {
            Some(&[c, d]) if wide => u16::from_le_bytes([c, d]),
            _ => 0,
        };
        let (cycles, float) = if wide {
            wide_cycles(first, second, literal)
        } else {
            (narrow_cycles(first, literal), false)
        };
        let single = is_single_access(first);
        let cycles = if single && pipelined {
            cycles.max(2) - 1
        } else {
            cycles
        };
        pipelined = single;
        block.instructions += 1;
        block.cycles += cycles as u16;
        block.float |= float;
        block.event |= first == 0xBF40;
        at += length(first);
    }
    block
}

/// Returns true if it loads or stores at most one word, but not a literal: such neighbours pipeline.
fn is_single_access(first: u16) -> bool {
    match first >> 12 {
        5..=9 => true,
        0xE => first & 0xFF20 == 0xED00 && first & 0x1F != 0x1F,
        0xF => first & 0xFE00 == 0xF800 && first & 0x1F != 0x1F,
        _ => false,
    }
}

fn narrow_cycles(op: u16, literal: u64) -> u64 {
    let registers = u64::from((op & 0xFF).count_ones());
    match op >> 12 {
        // LDR literal.
        4 if op & 0x0800 != 0 => literal,
        // Load and store with register offset: STR 1, LDR 2.
        5 if (op >> 9) & 7 < 3 => 1,
        5 => 2,
        // Immediate offset, SP-relative.
        6..=9 => 1 + u64::from(op >> 11 & 1),
        0xB => match op >> 8 & 0xF {
            // PUSH, POP.
            4 | 5 | 0xC | 0xD => 1 + registers + u64::from(op >> 8 & 1),
            // CPS.
            6 => 2,
            _ => 1,
        },
        0xC => 1 + registers,
        _ => 1,
    }
}

/// Returns the cycles, and true for a floating-point instruction.
fn wide_cycles(a: u16, b: u16, literal: u64) -> (u64, bool) {
    let op1 = a >> 11 & 3;
    let op2 = a >> 4 & 0x7F;
    // Coprocessor space with coprocessors 10 and 11: floating point.
    if a & 0xEC00 == 0xEC00 && matches!(b >> 8 & 0xF, 0xA | 0xB) {
        return (float_cycles(a, b, literal), true);
    }
    let cycles = match op1 {
        1 => match op2 {
            // LDM, STM, PUSH, POP (wide).
            _ if op2 & 0x64 == 0 => 1 + u64::from(b.count_ones()),
            // LDRD, STRD, TBB, TBH, exclusive.
            _ if op2 & 0x64 == 4 => {
                if a & 0xFFF0 == 0xE8D0 && b & 0xFFE0 == 0xF000 {
                    2
                } else if op2 & 0x60 == 0x40 || op2 & 0x12 != 0 {
                    3
                } else {
                    2
                }
            }
            _ => 1,
        },
        // Branches and system: MSR, MRS, barriers.
        2 if b & 0x8000 != 0 => {
            if a & 0xFFE0 == 0xF380 || a & 0xFFE0 == 0xF3E0 {
                2
            } else if a & 0xFFF0 == 0xF3B0 {
                3
            } else {
                1
            }
        }
        3 => {
            if a & 0xFFF0 == 0xFB90 || a & 0xFFF0 == 0xFBB0 {
                // SDIV, UDIV.
                12
            } else if a & 0xFF00 == 0xFB00 {
                // MUL 1, MLA and MLS 2, long ones 1 each.
                if b & 0xF000 == 0xF000 || a & 0x0080 != 0 {
                    1
                } else {
                    2
                }
            } else if a & 0xFE10 == 0xF810 {
                // Loads; by literal where the base is PC.
                if a & 0xF == 0xF { literal } else { 2 }
            } else {
                1
            }
        }
        _ => 1,
    };
    (cycles, false)
}

fn float_cycles(a: u16, b: u16, by_literal: u64) -> u64 {
    if a & 0xFE00 == 0xEC00 {
        // VLDM, VSTM, VPUSH, VPOP 1+N; VLDR and VSTR 2; VMOV of a pair 2.
        let p = a >> 8 & 1;
        let w = a >> 5 & 1;
        if a & 0xFFE0 == 0xEC40 {
            return 2;
        }
        let words = u64::from(b & 0xFF);
        return if p == 1 && w == 0 {
            let literal = a & 0x1F == 0x1D || a & 0x001F == 0x1F;
            if literal { by_literal } else { 2 }
        } else {
            1 + words
        };
    }
    if a & 0xFF00 != 0xEE00 || b & 0x10 != 0 {
        // VMOV between core and float, VMRS, VMSR.
        return 1;
    }
    let opc1 = a >> 4 & 0xB;
    match opc1 {
        // VMLA, VMLS, VNMLA, VNMLS.
        0 | 1 => 3,
        // VDIV.
        8 => 14,
        // VFNMA, VFNMS, VFMA, VFMS.
        9 | 0xA => 3,
        // Others take one cycle, except VSQRT.
        0xB if a & 0xF == 1 && b & 0xC0 == 0xC0 => 14,
        _ => 1,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    fn cycles(code: &[u16]) -> (u16, u16) {
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        let block = of_block(0x0800_0000, &bytes);
        (block.instructions, block.cycles)
    }

    /// Encodings from the ARMv7-M Architecture Reference Manual (DDI 0403E), worked out by hand.
    #[test]
    fn classes_of_instructions() {
        assert_eq!(cycles(&[0x1840]), (1, 1), "adds r0, r0, r1");
        assert_eq!(cycles(&[0x6808]), (1, 2), "ldr r0, [r1]");
        assert_eq!(cycles(&[0x6808, 0x6848]), (2, 3), "two loads in a row");
        assert_eq!(cycles(&[0x6008]), (1, 1), "str r0, [r1]");
        assert_eq!(cycles(&[0x4801]), (1, 6), "ldr r0, [pc, #4]");
        assert_eq!(cycles(&[0xB510]), (1, 3), "push {{r4, lr}}");
        assert_eq!(cycles(&[0xE92D, 0x41F0]), (1, 7), "push.w {{r4-r8, lr}}");
        assert_eq!(cycles(&[0xFB90, 0xF0F1]), (1, 12), "sdiv r0, r0, r1");
        assert_eq!(cycles(&[0xFB00, 0xF001]), (1, 1), "mul r0, r0, r1");
        assert_eq!(cycles(&[0xFB00, 0x2001]), (1, 2), "mla r0, r0, r1, r2");
        assert_eq!(cycles(&[0xEE30, 0x0A20]), (1, 1), "vadd.f32 s0, s0, s1");
        assert_eq!(cycles(&[0xEE80, 0x0A20]), (1, 14), "vdiv.f32 s0, s0, s1");
        assert_eq!(cycles(&[0xEEB1, 0x0AC0]), (1, 14), "vsqrt.f32 s0, s0");
        assert_eq!(cycles(&[0xEEA0, 0x0A20]), (1, 3), "vfma.f32 s0, s0, s1");
        assert_eq!(cycles(&[0xED90, 0x0A00]), (1, 2), "vldr s0, [r0]");
        assert_eq!(cycles(&[0xED2D, 0x8B10]), (1, 17), "vpush {{d8-d15}}");
        assert_eq!(cycles(&[0xBF40, 0x1840]), (2, 2), "sev; adds");
    }

    /// `ldr r0, [pc, #4]`, `ldr.w r0, [pc, #4]` and `vldr s0, [pc, #4]` wait only in flash.
    #[test]
    fn literals_wait_in_flash_alone() {
        for code in [
            &[0x01, 0x48][..],
            &[0xDF, 0xF8, 4, 0],
            &[0x9F, 0xED, 1, 0x0A],
        ] {
            assert_eq!(
                u64::from(of_block(map::FLASH.start, code).cycles),
                2 + WAIT_STATES
            );
            assert_eq!(of_block(map::CCM.start, code).cycles, 2);
        }
    }

    #[test]
    fn sev_and_float_are_seen() {
        let sev = of_block(0, &[0x40, 0xBF]);
        assert!(sev.event && !sev.float);
        let add = of_block(0, &[0x30, 0xEE, 0x20, 0x0A]);
        assert!(add.float && !add.event);
    }
}
