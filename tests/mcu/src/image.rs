//! The firmware's image: loaded data, symbols, and use of flash and RAM.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind};
use thiserror::Error;

use crate::map;

/// Reason why an image cannot be used.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The file cannot be read.
    #[error("{path} cannot be read ({source}): give the firmware's ELF file.")]
    Read {
        /// File.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not an ELF file, or a broken one.
    #[error("{path} is not an ELF file for the chip ({source}): give the firmware's ELF file.")]
    Format {
        /// File.
        path: PathBuf,
        /// Why.
        source: object::Error,
    },
    /// A segment outside the flash memory.
    #[error(
        "{path} loads {size} bytes to {address:#010x}, which is not flash memory of the chip: it was linked for another one."
    )]
    Place {
        /// File.
        path: PathBuf,
        /// Where.
        address: u64,
        /// How many.
        size: usize,
    },
}

/// A function of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Symbol.
    pub name: String,
    /// First instruction.
    pub address: u32,
    /// Bytes.
    pub size: u32,
}

/// A loaded image.
#[derive(Clone, Debug)]
pub struct Image {
    /// Contents of the flash memory from its start; erased where no data are loaded.
    pub flash: Vec<u8>,
    /// Bytes of flash that are loaded.
    pub flash_used: usize,
    /// Bytes of RAM for statics.
    pub ram_used: usize,
    /// Bytes of the CCM SRAM for code.
    pub code_used: usize,
    functions: Vec<Function>,
    symbols: BTreeMap<String, (u32, u32)>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// [`ImageError`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let data = std::fs::read(path).map_err(|source| ImageError::Read {
            path: path.to_owned(),
            source,
        })?;
        let format = |source| ImageError::Format {
            path: path.to_owned(),
            source,
        };
        let header = FileHeader32::<Endianness>::parse(&*data).map_err(format)?;
        let endian = header.endian().map_err(format)?;
        let mut flash = vec![0xFF; (map::FLASH.end - map::FLASH.start) as usize];
        let mut flash_used = 0;
        for segment in header.program_headers(endian, &*data).map_err(format)? {
            let bytes = segment.data(endian, &*data).unwrap_or_default();
            if segment.p_type(endian) != PT_LOAD || bytes.is_empty() {
                continue;
            }
            let address = segment.p_paddr(endian);
            let from = address.wrapping_sub(map::FLASH.start) as usize;
            let Some(place) = flash.get_mut(from..from.saturating_add(bytes.len())) else {
                return Err(ImageError::Place {
                    path: path.to_owned(),
                    address: address.into(),
                    size: bytes.len(),
                });
            };
            place.copy_from_slice(bytes);
            flash_used += bytes.len();
        }
        let file = ElfFile32::<Endianness>::parse(&*data).map_err(format)?;
        let (mut ram_used, mut code_used) = (0, 0);
        for section in file.sections() {
            let allocated = match section.flags() {
                SectionFlags::Elf { sh_flags, .. } => {
                    sh_flags & u64::from(object::elf::SHF_ALLOC) != 0
                }
                _ => false,
            };
            if allocated && map::RAM.contains(&(section.address() as u32)) {
                ram_used += section.size() as usize;
            }
            if allocated && map::CCM.contains(&(section.address() as u32)) {
                code_used += section.size() as usize;
            }
        }
        let mut functions = Vec::new();
        let mut symbols = BTreeMap::new();
        for symbol in file.symbols() {
            let Ok(name) = symbol.name() else { continue };
            let (address, size) = (symbol.address() as u32, symbol.size() as u32);
            if symbol.kind() == SymbolKind::Text && !name.starts_with('$') {
                functions.push(Function {
                    name: name.to_owned(),
                    address: address & !1,
                    size,
                });
            }
            symbols.insert(name.to_owned(), (address, size));
        }
        functions.sort_by_key(|f| (f.address, core::cmp::Reverse(f.size)));
        Ok(Self {
            flash,
            flash_used,
            ram_used,
            code_used,
            functions,
            symbols,
        })
    }

    /// Returns the first instruction of the function whose symbol has this end. Compilers add their own prefix.
    pub fn function_ending(&self, name: &str) -> Option<u32> {
        let found = self.functions.iter().find(|f| f.name.ends_with(name));
        found.map(|function| function.address)
    }

    /// Returns the function that contains an address.
    pub fn function_at(&self, address: u32) -> Option<&Function> {
        let after = self.functions.partition_point(|f| f.address <= address);
        self.functions
            .get(..after)?
            .iter()
            .rev()
            .take(8)
            .find(|f| address < f.address + f.size.max(2))
    }

    /// Returns address and size of the only symbol that contains `part`. Compilers add their own prefix and suffix.
    pub fn symbol_with(&self, part: &str) -> Option<(u32, u32)> {
        let mut found = self.symbols.iter().filter(|(name, _)| name.contains(part));
        let one = found.next().map(|(_, place)| *place);
        one.filter(|_| found.next().is_none())
    }

    /// Returns address and size of a symbol.
    pub fn symbol(&self, name: &str) -> Option<(u32, u32)> {
        self.symbols.get(name).copied()
    }
}
