//! What the image's control tick may call: nothing that can panic, and nothing that cannot be seen here.
//!
//! Reads the machine code that will be flashed: from the converter's interrupt along every branch that leaves a
//! function. Needs the image: build it with `firmware/build` and name it in `RIG_FIRMWARE_ELF`.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};

/// The converter's interrupt.
const ROOT: &str = "ADC1_2";

fn half(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap())
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// How the linker calls a jump too far for a branch; the name of the target follows.
const JUMP: &str = "__Thumbv7ABSLongThunk_";

struct Function {
    name: String,
    size: u32,
}

/// The parts of a 32-bit little-endian ELF file that matter here (ELF for the Arm architecture, IHI 0044).
struct Image {
    bytes: Vec<u8>,
    /// Address, place in the file, size.
    code: Vec<(u32, usize, u32)>,
    functions: BTreeMap<u32, Function>,
    /// Where data begins (true) among code and code again (false): mapping symbols.
    data: BTreeMap<u32, bool>,
}

impl Image {
    fn read(path: &str) -> Self {
        let bytes = std::fs::read(path).unwrap();
        assert_eq!(&bytes[..5], b"\x7fELF\x01", "{path} is no 32-bit ELF file");
        let table = word(&bytes, 32) as usize;
        let (size, count) = (half(&bytes, 46) as usize, half(&bytes, 48) as usize);
        let section = |index: usize, field: usize| word(&bytes, table + index * size + 4 * field);
        let mut image = Self {
            code: Vec::new(),
            functions: BTreeMap::new(),
            data: BTreeMap::new(),
            bytes: bytes.clone(),
        };
        for index in 0..count {
            // Contents, executable.
            if section(index, 1) == 1 && section(index, 2) & 4 != 0 {
                let place = (
                    section(index, 3),
                    section(index, 4) as usize,
                    section(index, 5),
                );
                image.code.push(place);
            }
            if section(index, 1) == 2 {
                let names = section(section(index, 6) as usize, 4) as usize;
                for entry in 0..section(index, 5) as usize / 16 {
                    let at = section(index, 4) as usize + 16 * entry;
                    let text = &bytes[names + word(&bytes, at) as usize..];
                    let end = text.iter().position(|&byte| byte == 0).unwrap();
                    let name = String::from_utf8_lossy(&text[..end]).into_owned();
                    let (value, length) = (word(&bytes, at + 4), word(&bytes, at + 8));
                    if name.starts_with("$t") || name.starts_with("$d") {
                        image.data.insert(value, name.starts_with("$d"));
                    } else if bytes[at + 12] & 15 == 2 {
                        let function = Function { name, size: length };
                        image.functions.insert(value & !1, function);
                    }
                }
            }
        }
        image
    }

    fn at(&self, address: u32) -> u16 {
        let inside =
            |&&(from, _, size): &&(u32, usize, u32)| (from..from + size).contains(&address);
        let (from, place, _) = self.code.iter().find(inside).unwrap();
        half(&self.bytes, place + (address - from) as usize)
    }

    /// The function of exactly this name.
    fn named(&self, name: &str) -> Option<u32> {
        let mut all = self.functions.iter();
        let found = all.find(|(_, function)| function.name == name);
        found.map(|(&address, _)| address)
    }

    /// The function that an address belongs to.
    fn owner(&self, address: u32) -> u32 {
        *self.functions.range(..=address).next_back().unwrap().0
    }

    /// Functions that one branches to, and what in it this check cannot see through, or traps.
    fn branches(&self, from: u32) -> (BTreeSet<u32>, Option<&'static str>) {
        // The linker's own jump between flash and the RAM that the tick runs from: its name tells where to.
        if let Some(target) = self.functions[&from].name.strip_prefix(JUMP) {
            return (BTreeSet::from([self.named(target).unwrap()]), None);
        }
        let end = from + self.functions[&from].size;
        let (mut targets, mut opaque) = (BTreeSet::new(), None);
        let mut at = from;
        while at < end {
            if self
                .data
                .range(..=at)
                .next_back()
                .is_some_and(|(_, &data)| data)
            {
                at += 2;
                continue;
            }
            let first = self.at(at);
            // Below 0b11101 an instruction is of 16 bits (Armv7-M ARM, A5.1).
            if first >> 11 < 0b11101 {
                opaque = opaque.or(opaque_16(first));
                if let Some(offset) = branch_16(first) {
                    let target = (at + 4).wrapping_add_signed(offset);
                    if !(from..end).contains(&target) {
                        targets.insert(self.owner(target));
                    }
                }
                at += 2;
                continue;
            }
            let second = self.at(at + 2);
            opaque = opaque.or(opaque_32(first, second));
            if let Some(offset) = branch(first, second) {
                let target = (at + 4).wrapping_add_signed(offset);
                if !(from..end).contains(&target) {
                    targets.insert(self.owner(target));
                }
            }
            at += 4;
        }
        (targets, opaque)
    }
}

/// What of 16 bits leads nobody knows where, or traps (Armv7-M ARM, A5.2).
fn opaque_16(instruction: u16) -> Option<&'static str> {
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
fn opaque_32(first: u16, second: u16) -> Option<&'static str> {
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
fn branch_16(instruction: u16) -> Option<i32> {
    match instruction >> 12 {
        // Conditions 14 and 15 are UDF and SVC.
        0xd if instruction >> 8 & 15 < 14 => Some(i32::from(instruction as u8 as i8) << 1),
        0xe if instruction & 0x0800 == 0 => Some(i32::from((instruction << 5).cast_signed() >> 4)),
        _ => None,
    }
}

/// Offset of a 32-bit branch with or without link or condition (Armv7-M ARM, A7.7.12 and A7.7.18).
fn branch(first: u16, second: u16) -> Option<i32> {
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

#[test]
#[ignore = "needs the image for the chip: firmware/build, then RIG_FIRMWARE_ELF"]
fn nothing_that_the_tick_reaches_can_panic() {
    let path = std::env::var("RIG_FIRMWARE_ELF").expect("RIG_FIRMWARE_ELF must name the image");
    let image = Image::read(&path);
    let find = |wanted: &str| {
        image.named(wanted).unwrap_or_else(|| {
            let mut all = image.functions.iter();
            *all.find(|(_, function)| function.name.contains(wanted))
                .unwrap()
                .0
        })
    };
    // The scan must be able to see a panic where there is one: from the start to the panic handler.
    let handler = find("rust_begin_unwind");
    assert!(
        reached(&image, find("main")).contains_key(&handler),
        "the start reaches no panic: the scan is blind"
    );
    let start = reached(&image, find("main"));
    assert!(
        start
            .keys()
            .any(|function| image.branches(*function).1.is_some()),
        "the start calls nothing through a register: the scan is blind"
    );
    let tick = reached(&image, find(ROOT));
    assert!(
        tick.len() > 20,
        "the tick reaches only {} functions",
        tick.len()
    );
    if tick.contains_key(&handler) {
        let (mut way, mut at) = (Vec::new(), handler);
        loop {
            way.push(image.functions[&at].name.as_str());
            match tick[&at] {
                Some(caller) => at = caller,
                None => break,
            }
        }
        panic!("the tick can panic: {}", way.join(" <- "));
    }
    let opaque: Vec<String> = tick
        .keys()
        .filter_map(|function| {
            let what = image.branches(*function).1?;
            Some(format!("{} {what}", image.functions[function].name))
        })
        .collect();
    assert!(
        opaque.is_empty(),
        "this check sees nothing behind it:\n{}",
        opaque.join("\n")
    );
}

/// Every function reached, with the one it was reached from.
fn reached(image: &Image, root: u32) -> BTreeMap<u32, Option<u32>> {
    let mut seen = BTreeMap::from([(root, None)]);
    let mut open = vec![root];
    while let Some(function) = open.pop() {
        for target in image.branches(function).0 {
            if let std::collections::btree_map::Entry::Vacant(entry) = seen.entry(target) {
                entry.insert(Some(function));
                open.push(target);
            }
        }
    }
    seen
}
