//! `rig man`: the help of all commands as pages for `man`.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use clap_mangen::Man;

use super::error::CommandError;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_output::{folder, write_whole};

/// Writes the help of the program and of each command as pages for `man`: rig.1, rig-identify.1, …
///
/// `man -l FOLDER/rig.1` shows one. In a folder `man1` of the manual's path (`manpath` prints it) `man rig` finds them.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Folder to write the pages into
    #[arg(long)]
    out: PathBuf,
    /// Replace pages that the folder already holds
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// A page exists, or cannot be written.
pub(crate) fn run(args: &Args, program: clap::Command, ui: &Ui) -> Result<(), CommandError> {
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    collect(&program, &mut pages);
    for (name, _) in &pages {
        refuse_file(&args.out.join(name), args.force)?;
    }
    folder(&args.out)?;
    for (name, text) in &pages {
        write_whole(&args.out.join(name), text)?;
    }
    for (name, _) in &pages {
        ui.file(&args.out.join(name));
    }
    ui.answer(&format!(
        "{}: {} pages; `man -l {}` shows the first",
        args.out.display(),
        pages.len(),
        args.out.join("rig.1").display()
    ));
    Ok(())
}

/// Adds the page of a command, and of the commands below it, with their file names.
fn collect(command: &clap::Command, pages: &mut Vec<(String, Vec<u8>)>) {
    let page = Man::new(command.clone());
    let mut text = Vec::new();
    // Writing into memory does not fail.
    let _ = page.render(&mut text);
    pages.push((page.get_filename(), text));
    for below in command.get_subcommands().filter(|c| !c.is_hide_set()) {
        collect(below, pages);
    }
}
