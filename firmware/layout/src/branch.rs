//! Branches in machine code of the Armv7-M.

/// What of 16 bits leads nobody knows where, or traps (Armv7-M ARM, A5.2).
pub(crate) fn opaque_16(instruction: u16) -> Option<&'static str> {
    const LR: u16 = 14;
    let register = instruction >> 3 & 15;
    match instruction {
        _ if instruction & 0xff87 == 0x4780 => Some("calls through a register"),
        // BX, whose register is that of the return where it is none of a jump.
        _ if instruction & 0xff87 == 0x4700 && register != LR => Some("jumps through a register"),
        // MOV and ADD to the program counter.
        _ if matches!(instruction & 0xff87, 0x4687 | 0x4487) => Some("writes the program counter"),
        _ if instruction & 0xff00 == 0xde00 => Some("traps by UDF"),
        _ if instruction & 0xff00 == 0xdf00 => Some("traps by SVC"),
        _ if instruction & 0xff00 == 0xbe00 => Some("traps by BKPT"),
        _ => None,
    }
}

/// The same of 32 bits (A5.3): loads of the program counter other than the return from the stack, UDF.
pub(crate) fn opaque_32(first: u16, second: u16) -> Option<&'static str> {
    match (first, second) {
        // LDR pc: from a literal or [Rn, ...], but not pop {pc}, which is LDR pc, [sp], #4.
        _ if first & 0xff70 == 0xf850
            && second >> 12 == 15
            && (first, second) != (0xf85d, 0xfb04) =>
        {
            Some("loads the program counter")
        }
        _ if first & 0xfff0 == 0xf7f0 && second & 0xf000 == 0xa000 => Some("traps by UDF"),
        _ => None,
    }
}

/// Offset of a 16-bit branch with or without condition (Armv7-M ARM, A7.7.12).
pub(crate) fn branch_16(instruction: u16) -> Option<i32> {
    match instruction >> 12 {
        // Conditions 14 and 15 are UDF and SVC.
        0xd if instruction >> 8 & 15 < 14 => Some(i32::from(instruction as u8 as i8) << 1),
        0xe if instruction & 0x0800 == 0 => Some(i32::from((instruction << 5).cast_signed() >> 4)),
        _ => None,
    }
}

/// Offset of a 32-bit branch with or without link or condition (Armv7-M ARM, A7.7.12 and A7.7.18).
pub(crate) fn branch(first: u16, second: u16) -> Option<i32> {
    if first >> 11 != 0b11110 || second & 0x8000 == 0 {
        return None;
    }
    let (first, second) = (i32::from(first), i32::from(second));
    let (sign, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let low = (second & 0x7ff) << 1;
    match second & 0x5000 {
        // BL, B.
        0x5000 | 0x1000 => {
            let (i1, i2) = (1 ^ j1 ^ sign, 1 ^ j2 ^ sign);
            Some((i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | low) - (sign << 24))
        }
        // B with a condition; what looks like conditions 14 and 15 is something else.
        0 if first >> 7 & 7 != 7 => {
            Some((j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | low) - (sign << 20))
        }
        _ => None,
    }
}
