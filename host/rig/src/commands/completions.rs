//! `rig completions`: the words that a shell completes.

use clap::Args as ClapArgs;
use clap_complete::{Shell, generate};

use super::ui::Ui;

/// Prints a script with which a shell completes commands and options: `rig completions bash > rig.bash`.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the script.
pub(crate) fn run(args: &Args, command: &mut clap::Command, ui: &Ui) {
    let mut script = Vec::new();
    generate(args.shell, command, "rig", &mut script);
    let script = String::from_utf8_lossy(&script);
    ui.fact("script", script.trim_end());
    if !ui.is_json() {
        ui.print(script.trim_end());
    }
}
