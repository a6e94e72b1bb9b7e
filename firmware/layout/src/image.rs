//! The parts of a 32-bit little-endian ELF file that matter here (ELF for the Arm architecture, IHI 0044).

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

use crate::branch::{branch, branch_16, opaque_16, opaque_32};

/// How the linker calls a jump too far for a branch; the name of the target follows.
const JUMP: &str = "__Thumbv7ABSLongThunk_";

/// Why an image cannot be read.
#[derive(Debug)]
pub enum ImageError {
    /// The file cannot be read.
    Read(PathBuf, std::io::Error),
    /// The file is none, or ends too early.
    Format(PathBuf),
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read(path, error) => write!(
                f,
                "{} cannot be read ({error}): name the firmware's ELF file, which firmware/build makes.",
                path.display()
            ),
            Self::Format(path) => write!(
                f,
                "{} is not a whole 32-bit little-endian ELF file: name the one that firmware/build makes.",
                path.display()
            ),
        }
    }
}

impl std::error::Error for ImageError {}

/// A function of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its symbols, one at least.
    pub names: Vec<String>,
    /// Bytes.
    pub size: u32,
}

impl Function {
    /// The first of its symbols.
    pub fn name(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }

    /// Returns true if this is a jump that the linker put between flash and the CCM SRAM.
    pub fn is_jump(&self) -> bool {
        self.jump().is_some()
    }

    fn jump(&self) -> Option<&str> {
        self.names.iter().find_map(|name| name.strip_prefix(JUMP))
    }
}

/// A section that takes memory of the chip.
#[derive(Clone, Copy, Debug)]
struct Section {
    address: u32,
    /// Place in the file.
    place: usize,
    size: u32,
    executable: bool,
}

/// A linked image.
#[derive(Clone, Debug)]
pub struct Image {
    bytes: Vec<u8>,
    sections: Vec<Section>,
    functions: BTreeMap<u32, Function>,
    /// Where data begins (true) among code and code again (false): mapping symbols.
    data: BTreeMap<u32, bool>,
    segments: Vec<Segment>,
}

/// Bytes that are loaded to the chip.
#[derive(Clone, Copy, Debug)]
struct Segment {
    /// Address in flash.
    address: u32,
    /// Place in the file.
    place: usize,
    size: u32,
}

fn half(bytes: &[u8], at: usize) -> Option<u16> {
    let found = bytes.get(at..)?.first_chunk()?;
    Some(u16::from_le_bytes(*found))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let found = bytes.get(at..)?.first_chunk()?;
    Some(u32::from_le_bytes(*found))
}

/// Word `field` of each entry of a table.
struct Table {
    from: usize,
    size: usize,
    count: usize,
}

impl Table {
    fn field(&self, bytes: &[u8], index: usize, field: usize) -> Option<u32> {
        word(bytes, self.from + index * self.size + 4 * field)
    }
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// [`ImageError`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path).map_err(|error| ImageError::Read(path.into(), error))?;
        Self::parse(bytes).ok_or_else(|| ImageError::Format(path.into()))
    }

    fn parse(bytes: Vec<u8>) -> Option<Self> {
        // 32 bits, little-endian.
        if bytes.get(..6)? != b"\x7fELF\x01\x01" {
            return None;
        }
        let mut image = Self {
            sections: Vec::new(),
            functions: BTreeMap::new(),
            data: BTreeMap::new(),
            segments: Vec::new(),
            bytes: Vec::new(),
        };
        let segments = Table {
            from: word(&bytes, 28)? as usize,
            size: half(&bytes, 42)?.into(),
            count: half(&bytes, 44)?.into(),
        };
        for index in 0..segments.count {
            let field = |field| segments.field(&bytes, index, field);
            // PT_LOAD: place in the file, physical address, bytes in the file.
            if field(0)? == 1 && field(4)? > 0 {
                image.segments.push(Segment {
                    address: field(3)?,
                    place: field(1)? as usize,
                    size: field(4)?,
                });
            }
        }
        let table = Table {
            from: word(&bytes, 32)? as usize,
            size: half(&bytes, 46)?.into(),
            count: half(&bytes, 48)?.into(),
        };
        for index in 0..table.count {
            let field = |field| table.field(&bytes, index, field);
            let (kind, flags) = (field(1)?, field(2)?);
            if flags & 2 != 0 {
                image.sections.push(Section {
                    address: field(3)?,
                    place: field(4)? as usize,
                    size: field(5)?,
                    executable: kind == 1 && flags & 4 != 0,
                });
            }
            if kind == 2 {
                let names = table.field(&bytes, field(6)? as usize, 4)? as usize;
                image.read_symbols(&bytes, field(4)? as usize, field(5)? as usize, names)?;
            }
        }
        image.bytes = bytes;
        Some(image)
    }

    fn read_symbols(&mut self, bytes: &[u8], at: usize, size: usize, names: usize) -> Option<()> {
        for at in (at..at + size).step_by(16) {
            let text = bytes.get(names + word(bytes, at)? as usize..)?;
            let end = text.iter().position(|&byte| byte == 0)?;
            let name = String::from_utf8_lossy(&text[..end]).into_owned();
            let (value, length) = (word(bytes, at + 4)?, word(bytes, at + 8)?);
            if name.starts_with("$t") || name.starts_with("$d") {
                self.data.insert(value, name.starts_with("$d"));
            } else if *bytes.get(at + 12)? & 15 == 2 {
                let function = self.functions.entry(value & !1).or_insert(Function {
                    names: Vec::new(),
                    size: length,
                });
                function.size = function.size.max(length);
                function.names.push(name);
            }
        }
        Some(())
    }

    /// All functions with their addresses.
    pub fn functions(&self) -> impl Iterator<Item = (u32, &Function)> {
        self.functions.iter().map(|(&at, function)| (at, function))
    }

    /// The function that begins at an address.
    pub fn function(&self, address: u32) -> Option<&Function> {
        self.functions.get(&address)
    }

    /// The function of exactly this name.
    pub fn named(&self, name: &str) -> Option<u32> {
        let mut all = self.functions();
        let found = all.find(|(_, function)| function.names.iter().any(|n| n == name));
        found.map(|(address, _)| address)
    }

    /// The first function with this in its name.
    pub fn containing(&self, part: &str) -> Option<u32> {
        let mut all = self.functions();
        let found = all.find(|(_, function)| function.names.iter().any(|n| n.contains(part)));
        found.map(|(address, _)| address)
    }

    /// Bytes that sections take of the addresses from `from` up to `to`.
    pub fn allocated(&self, from: u32, to: u32) -> u32 {
        let inside = (self.sections.iter()).filter(|s| (from..to).contains(&s.address));
        inside.map(|section| section.size).sum()
    }

    /// Bytes that are loaded to flash.
    pub fn loaded(&self) -> u32 {
        self.segments.iter().map(|segment| segment.size).sum()
    }

    /// Contents of the flash memory from address `start` on, with erased bytes between what is loaded; `None` if something
    /// is loaded below `start` or more than `room` bytes above it.
    pub fn flash(&self, start: u32, room: u32) -> Option<Vec<u8>> {
        let mut flash = Vec::new();
        for segment in &self.segments {
            let from = segment.address.checked_sub(start)?;
            let to = from.checked_add(segment.size).filter(|to| *to <= room)?;
            let content = self.bytes.get(segment.place..)?;
            let content = content.get(..segment.size as usize)?;
            if flash.len() < to as usize {
                flash.resize(to as usize, 0xFF);
            }
            flash
                .get_mut(from as usize..to as usize)?
                .copy_from_slice(content);
        }
        Some(flash)
    }

    /// The half word of code at an address.
    fn at(&self, address: u32) -> Option<u16> {
        let section = self.sections.iter().find(|section| {
            section.executable
                && (section.address..section.address + section.size).contains(&address)
        })?;
        half(
            &self.bytes,
            section.place + (address - section.address) as usize,
        )
    }

    /// The function that an address belongs to.
    fn owner(&self, address: u32) -> Option<u32> {
        Some(*self.functions.range(..=address).next_back()?.0)
    }

    /// Functions that one branches to, and what in it cannot be seen through, or traps.
    pub fn branches(&self, from: u32) -> (BTreeSet<u32>, Option<&'static str>) {
        let (mut targets, mut opaque) = (BTreeSet::new(), None);
        let Some(function) = self.functions.get(&from) else {
            return (targets, Some("is no function"));
        };
        // The linker's own jump between flash and the RAM that the tick runs from: its name tells where to.
        if let Some(target) = function.jump() {
            targets.extend(self.named(target));
            let lost = targets.is_empty().then_some("jumps nobody knows where to");
            return (targets, lost);
        }
        let end = from + function.size;
        let mut at = from;
        while at < end {
            let before = self.data.range(..=at).next_back();
            if before.is_some_and(|(_, &data)| data) {
                at += 2;
                continue;
            }
            let Some(first) = self.at(at) else {
                return (targets, Some("has no code in the file"));
            };
            // Below 0b11101 an instruction is of 16 bits (Armv7-M ARM, A5.1).
            let (found, offset, size) = if first >> 11 < 0b11101 {
                (opaque_16(first), branch_16(first), 2)
            } else {
                let second = self.at(at + 2).unwrap_or_default();
                (opaque_32(first, second), branch(first, second), 4)
            };
            opaque = opaque.or(found);
            if let Some(offset) = offset {
                let target = (at + 4).wrapping_add_signed(offset);
                if !(from..end).contains(&target) {
                    targets.extend(self.owner(target));
                }
            }
            at += size;
        }
        (targets, opaque)
    }
}
