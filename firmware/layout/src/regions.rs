//! Memory regions of the linker script, and how much of them an image takes.

use crate::Image;

/// A region of `memory.x`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    /// Name.
    pub name: String,
    /// First address.
    pub origin: u32,
    /// Bytes.
    pub length: u32,
}

/// Reads the regions of a linker script: lines `NAME : ORIGIN = 0x…, LENGTH = …K`. Other lines are left out.
pub fn regions(script: &str) -> Vec<Region> {
    script.lines().filter_map(region).collect()
}

fn region(line: &str) -> Option<Region> {
    let (name, rest) = line.split_once(':')?;
    let rest = rest.trim().strip_prefix("ORIGIN = 0x")?;
    let (origin, length) = rest.split_once(", LENGTH = ")?;
    Some(Region {
        name: name.trim().to_owned(),
        origin: u32::from_str_radix(origin, 16).ok()?,
        length: 1024 * length.trim().strip_suffix('K')?.parse::<u32>().ok()?,
    })
}

/// How much of a memory an image takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Use {
    /// Name.
    pub name: &'static str,
    /// Bytes taken.
    pub taken: u32,
    /// Bytes there are.
    pub size: u32,
    /// Bytes of these that are kept free.
    pub reserve: u32,
}

impl Use {
    /// Code, data, flash and stack of an image in the regions of `memory.x`.
    pub fn of(image: &Image, regions: &[Region]) -> Vec<Self> {
        let length = |name: &str| {
            let found = regions.iter().find(|region| region.name == name);
            found.map_or(0, |region| region.length)
        };
        let taken = |name: &str| {
            let found = regions.iter().find(|region| region.name == name);
            found.map_or(0, |region| {
                image.allocated(region.origin, region.origin + region.length)
            })
        };
        vec![
            Self {
                name: "CCM SRAM (code of the tick)",
                taken: taken("CODE"),
                size: length("CODE") + length("SPARE"),
                reserve: length("SPARE"),
            },
            Self {
                name: "RAM (data, without the stack)",
                taken: taken("RAM"),
                size: length("RAM"),
                reserve: 0,
            },
            Self {
                name: "flash (program)",
                taken: image.loaded(),
                size: length("FLASH") + length("LOAD"),
                reserve: 0,
            },
        ]
    }
}

impl std::fmt::Display for Use {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let free = self.size.saturating_sub(self.taken);
        write!(
            f,
            "{:<30} {:>6} of {:>6} bytes, {free:>6} free",
            self.name, self.taken, self.size
        )?;
        if self.reserve > 0 {
            write!(f, " ({} of them are the reserve)", self.reserve)?;
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_keeps_4_kib_of_the_code_s_memory_free() {
        let all = regions(crate::MEMORY);
        let of = |name: &str| all.iter().find(|region| region.name == name).unwrap();
        assert_eq!(of("CODE").origin, 0x1000_0000);
        assert_eq!(of("CODE").length + of("SPARE").length, 32 * 1024);
        assert!(of("SPARE").length >= 4096);
        assert_eq!(of("SPARE").origin, of("CODE").origin + of("CODE").length);
        // What is loaded to CODE must fit where it is kept.
        assert!(of("LOAD").length >= of("CODE").length);
        assert_eq!(of("LOAD").origin, of("FLASH").origin + of("FLASH").length);
    }
}
