//! `rig flash`: writes the firmware image to the board.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::ui::Ui;

/// The chip, as probe-rs calls it.
pub(crate) const CHIP: &str = "STM32G474RETx";
/// Image that `firmware/build` makes, relative to the project's folder.
const IMAGE: &str = "target/thumbv7em-none-eabihf/chip/rig-firmware";
/// Program that controls the debug probe.
const TOOL: &str = "probe-rs";
/// Machine number of Arm in an ELF header (`EM_ARM`).
const ARM: [u8; 2] = [40, 0];

/// Flashes the rig's firmware through the board's debug probe.
///
/// Needs the probe-rs tool (`cargo install probe-rs-tools`, or its installer at https://probe.rs). The bridge
/// stays off while flashing and afterwards, until the rig is armed.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Firmware image [default: the image made by firmware/build]
    #[arg(long)]
    elf: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A sentence about a missing image, a missing tool or a missing board.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let elf = args.elf.clone().unwrap_or_else(|| PathBuf::from(IMAGE));
    check(&elf)?;
    call(&["download", "--chip", CHIP, "--verify"], Some(&elf))?;
    // The chip is halted after a download.
    call(&["reset", "--chip", CHIP], None)?;
    ui.fact("image", elf.display().to_string());
    ui.answer(&format!(
        "{} was flashed to the board and runs.",
        elf.display()
    ));
    Ok(())
}

/// Checks that a file can be an image for the chip.
fn check(elf: &Path) -> Result<(), CommandError> {
    let sentence = |text: String| Err(CommandError::Sentence(text));
    let mut head = [0; 20];
    match std::fs::File::open(elf).and_then(|mut file| file.read_exact(&mut head)) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return sentence(format!(
                "The image {} does not exist; build it with firmware/build, or name another one with --elf.",
                elf.display()
            ));
        }
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {}
        Err(error) => {
            return sentence(format!(
                "The image {} cannot be read: {error}; check its permissions.",
                elf.display()
            ));
        }
    }
    if !head.starts_with(b"\x7fELF") || head[18..20] != ARM {
        return sentence(format!(
            "{} is no ELF file for an Arm processor; firmware/build makes one and says where.",
            elf.display()
        ));
    }
    Ok(())
}

/// Runs the tool, which prints its own progress.
fn call(arguments: &[&str], elf: Option<&Path>) -> Result<(), CommandError> {
    let mut command = Command::new(TOOL);
    command.args(arguments).args(elf);
    let status = command.status().map_err(|error| {
        CommandError::Sentence(match error.kind() {
            io::ErrorKind::NotFound => format!(
                "The tool {TOOL}, which connects to the board, is not installed; install it with `cargo install probe-rs-tools --locked`, or see https://probe.rs."
            ),
            _ => format!("The tool {TOOL} cannot be started: {error}; install it again."),
        })
    })?;
    if status.success() {
        return Ok(());
    }
    Err(CommandError::Sentence(format!(
        "`{TOOL} {}` failed ({status}), its messages are above: check that the board is plugged in at its ST-LINK socket and that no other program uses it.",
        arguments.join(" ")
    )))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image");
        let text = |path: &Path| check(path).unwrap_err().to_string();
        assert!(text(&path).contains("build it with firmware/build"));
        std::fs::write(&path, b"\x7fELF").unwrap();
        assert!(text(&path).contains("no ELF file for an Arm processor"));
        // This test program itself is an ELF file on most desktops, but for another processor.
        let mut head = *b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x3e\0";
        std::fs::write(&path, head).unwrap();
        assert!(text(&path).contains("no ELF file for an Arm processor"));
        head[18] = 40;
        std::fs::write(&path, head).unwrap();
        assert!(check(&path).is_ok());
    }
}
