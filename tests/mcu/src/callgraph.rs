//! Which functions a function of the image can reach, by disassembly.
//!
//! Direct calls and branches are followed, tail calls included. Calls through registers cannot be: they are
//! listed, so that a test can insist that there are none.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::cost::length;
use crate::image::Image;

/// What can be reached.
#[derive(Clone, Debug, Default)]
pub struct Reach {
    /// Reached functions with the function that reached each first.
    pub functions: BTreeMap<String, String>,
    /// Calls and jumps through registers: function and address.
    pub indirect: Vec<(String, u32)>,
    /// Permanently undefined instructions (an abort): function and address.
    pub aborts: Vec<(String, u32)>,
    /// Branches that end nowhere known: function, address, target.
    pub strange: Vec<(String, u32, u32)>,
}

impl Reach {
    /// How a function was reached, from the root on.
    pub fn path(&self, function: &str) -> Vec<String> {
        let mut path = vec![function.to_owned()];
        while let Some(from) = path.last().and_then(|last| self.functions.get(last)) {
            if path.contains(from) {
                break;
            }
            path.push(from.clone());
        }
        path.reverse();
        path
    }
}

/// Everything that the function called `root` can reach; none where there is no such function.
pub fn reach(image: &Image, root: &str) -> Option<Reach> {
    let start = image.functions().iter().find(|f| f.name == root)?;
    let mut reach = Reach::default();
    let mut seen = BTreeSet::from([start.address]);
    let mut queue = VecDeque::from([start.clone()]);
    reach.functions.insert(start.name.clone(), start.name.clone());
    while let Some(function) = queue.pop_front() {
        for (address, jump) in jumps(image, function.address, function.size) {
            match jump {
                Jump::Indirect => reach.indirect.push((function.name.clone(), address)),
                Jump::Abort => reach.aborts.push((function.name.clone(), address)),
                Jump::To(target) => {
                    let inside = target.wrapping_sub(function.address) < function.size.max(1);
                    if inside {
                        continue;
                    }
                    let Some(next) = image.function_at(target) else {
                        reach
                            .strange
                            .push((function.name.clone(), address, target));
                        continue;
                    };
                    if seen.insert(next.address) {
                        reach
                            .functions
                            .entry(next.name.clone())
                            .or_insert_with(|| function.name.clone());
                        queue.push_back(next.clone());
                    }
                }
            }
        }
    }
    Some(reach)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Jump {
    To(u32),
    Indirect,
    Abort,
}

/// Branches of the code of a function.
fn jumps(image: &Image, start: u32, size: u32) -> Vec<(u32, Jump)> {
    let mut found = Vec::new();
    let mut at = start;
    while at < start + size {
        if let Some(end) = image.data_until(at) {
            at = end;
            continue;
        }
        let Some(&[a, b]) = image.code(at, 2) else { break };
        let first = u16::from_le_bytes([a, b]);
        let bytes = length(first) as u32;
        let second = match image.code(at + 2, 2) {
            Some(&[c, d]) if bytes == 4 => u16::from_le_bytes([c, d]),
            _ => 0,
        };
        if let Some(jump) = decode(at, first, second) {
            found.push((at, jump));
        }
        at += bytes;
    }
    found
}

/// Encodings: ARMv7-M ARM, A7.7.12 (B), A7.7.18 (BL), A7.7.19 (BLX), A7.7.20 (BX), A7.7.21 (CBZ), A7.7.194 (UDF).
fn decode(at: u32, a: u16, b: u16) -> Option<Jump> {
    let pc = at.wrapping_add(4);
    let to = |offset: i32| Some(Jump::To(pc.wrapping_add_signed(offset)));
    if length(a) == 2 {
        return match a >> 8 {
            0xDE => Some(Jump::Abort),
            0xD0..=0xDD => to(i32::from(a as u8 as i8) * 2),
            0xE0..=0xE7 => to(i32::from((a << 5) as i16 >> 5) * 2),
            0x47 => {
                let register = a >> 3 & 0xF;
                (register != 14 || a & 0x80 != 0).then_some(Jump::Indirect)
            }
            _ if a & 0xF500 == 0xB100 => {
                let offset = (a >> 3 & 0x1F) << 1 | (a >> 9 & 1) << 6;
                to(offset.into())
            }
            // MOV PC, Rm.
            0x46 if a & 0x87 == 0x87 => Some(Jump::Indirect),
            _ => None,
        };
    }
    if a & 0xF800 != 0xF000 || b & 0x8000 == 0 {
        // LDR PC, [Rn, ...] with any base but SP.
        let loads_pc = a & 0xFF70 == 0xF850 && b >> 12 == 0xF && a & 0xF != 0xD;
        return loads_pc.then_some(Jump::Indirect);
    }
    let s = u32::from(a >> 10 & 1);
    let (j1, j2) = (u32::from(b >> 13 & 1), u32::from(b >> 11 & 1));
    let low = u32::from(b & 0x7FF) << 1;
    if b & 0x1000 != 0 {
        // BL and B.W: I1 = not (J1 xor S), I2 likewise.
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let high = u32::from(a & 0x3FF) << 12;
        let raw = s << 24 | i1 << 23 | i2 << 22 | high | low;
        return to(sign(raw, 24));
    }
    if a & 0xFFF0 == 0xF7F0 && b & 0xF000 == 0xA000 {
        return Some(Jump::Abort);
    }
    if b & 0x4000 == 0 && a >> 7 & 7 != 7 {
        // B.W with a condition.
        let raw = s << 20 | j2 << 19 | j1 << 18 | u32::from(a & 0x3F) << 12 | low;
        return to(sign(raw, 20));
    }
    None
}

/// Extends the sign at `bit`.
fn sign(raw: u32, bit: u32) -> i32 {
    let shift = 31 - bit;
    (raw << shift).cast_signed() >> shift
}

#[cfg(test)]
mod test {
    use super::*;

    /// Offsets by the encoding's definition, worked out by hand.
    #[test]
    fn branches_are_decoded() {
        assert_eq!(decode(0x100, 0xE7FE, 0), Some(Jump::To(0x100)), "b .");
        assert_eq!(decode(0x100, 0xD001, 0), Some(Jump::To(0x106)), "beq");
        assert_eq!(decode(0x100, 0xF000, 0xF801), Some(Jump::To(0x106)), "bl +2");
        assert_eq!(decode(0x100, 0xF7FF, 0xFFFE), Some(Jump::To(0x100)), "bl .");
        assert_eq!(decode(0x100, 0xF000, 0xB801), Some(Jump::To(0x106)), "b.w +2");
        assert_eq!(decode(0x100, 0xF43F, 0xAFFE), Some(Jump::To(0x100)), "beq.w .");
        assert_eq!(decode(0x100, 0xB108, 0), Some(Jump::To(0x106)), "cbz r0, +2");
        assert_eq!(decode(0x100, 0x4770, 0), None, "bx lr");
        assert_eq!(decode(0x100, 0x4798, 0), Some(Jump::Indirect), "blx r3");
        assert_eq!(decode(0x100, 0xDEFE, 0), Some(Jump::Abort), "udf");
        assert_eq!(decode(0x100, 0xFB90, 0xF0F1), None, "sdiv");
    }
}
