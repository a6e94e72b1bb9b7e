//! Checks an image of the firmware against `firmware/fast_code.list`, says how much memory is left, and writes the image as
//! the bytes of the flash memory beside it (`.bin`), for the drive of the ST-LINK.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use rig_layout::{Image, LIST, MEMORY, Placement, ROOT, Use, entries, regions};

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Returns true if every entry of the list has its function.
fn run() -> Result<bool, Box<dyn Error>> {
    let path = std::env::args_os()
        .nth(1)
        .ok_or("rig-layout: name the firmware's ELF file, which firmware/build makes.")?;
    let image = Image::read(path.as_ref())?;
    let regions = regions(MEMORY);
    let [flash, load] = ["FLASH", "LOAD"].map(|name| regions.iter().find(|r| r.name == name));
    let (flash, load) = (flash.zip(load)).ok_or("memory.x has no regions FLASH and LOAD.")?;
    let room = load.origin + load.length - flash.origin;
    let bytes = (image.flash(flash.origin, room))
        .ok_or("the image has parts outside the regions FLASH and LOAD of memory.x.")?;
    std::fs::write(Path::new(&path).with_extension("bin"), bytes)?;
    let code = (regions.iter().find(|region| region.name == "CODE"))
        .ok_or("memory.x has no region CODE: the tick's code has no place.")?;
    let placement = Placement::of(&image, &entries(LIST)?, code, ROOT);
    for part in Use::of(&image, &regions) {
        println!("{part}");
    }
    for (name, size) in &placement.spilled {
        println!(
            "in flash for want of room in CODE: {name}, {size} bytes. The tick is slower there; tests/mcu/budget.toml says whether too slow."
        );
    }
    for (name, size) in &placement.unlisted {
        println!(
            "in flash because firmware/fast_code.list does not name it, though the tick calls it: {name}, {size} bytes."
        );
    }
    for entry in &placement.without_function {
        eprintln!(
            "firmware/fast_code.list:{}: no function of the image is called \"{}\": it was renamed, is no longer used, or the compiler inlined it. Correct the entry, or put #[inline(never)] on the function.",
            entry.line, entry.path
        );
    }
    Ok(placement.without_function.is_empty())
}
