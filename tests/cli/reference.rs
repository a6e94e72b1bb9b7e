//! The reference of commands in `docs/` is the help of the program.

use std::fmt::Write as _;

use clap::{Arg, Command, CommandFactory};
use rig::commands::Cli;

use crate::documented::made_page;

/// Head of the page.
const HEAD: &str = "# Which commands and options are there?

<!-- Made from the help of the program: RIG_WRITE_DOCS=1 cargo test -p rig --test cli the_reference -->

This page is the help of the program, as `--help` prints it behind each command. `rig man` writes the same as pages for `man`.
Four options stand behind every command: `--help`; `--quiet`, which prints errors alone and what `--json` asks for;
`--verbose`, which prints details of the result, too; and `--json`, which prints the result as JSON
([formats.md](formats.md#results)). The answer is the last thing that is printed. The exit status is 0 only if
the work was done, 1 after an error and 2 after wrong arguments; a command with statuses of its own names them below.

";

/// Makes text of a help safe for Markdown, outside of its code.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for (k, part) in text.split('`').enumerate() {
        if k % 2 == 1 {
            let _ = write!(out, "`{part}`");
        } else {
            out += &(part.replace('<', "&lt;"))
                .replace('*', "\\*")
                .replace('_', "\\_");
        }
    }
    out
}

/// Returns the name of an argument with its value, as a user types it.
fn typed(arg: &Arg) -> String {
    let value = || {
        let names: Vec<String> = match arg.get_value_names() {
            Some(names) => names.iter().map(|n| format!("<{n}>")).collect(),
            None => vec![format!("<{}>", arg.get_id().as_str().to_uppercase())],
        };
        names.join(" ")
    };
    match arg.get_long() {
        None => value(),
        Some(long) if arg.get_action().takes_values() => format!("--{long} {}", value()),
        Some(long) => format!("--{long}"),
    }
}

/// Returns the entry of one argument.
fn entry(arg: &Arg) -> String {
    let mut out = format!("* `{}`", typed(arg));
    if arg.is_required_set() {
        out += " (required)";
    }
    if let Some(help) = arg.get_long_help().or(arg.get_help()) {
        let help = help.to_string().replace("\n\n", "\n\n  ");
        let _ = write!(out, ": {}", escaped(&help));
    }
    if arg.get_action().takes_values() {
        let defaults: Vec<String> = (arg.get_default_values().iter())
            .map(|v| format!("`{}`", v.to_string_lossy()))
            .collect();
        if !defaults.is_empty() {
            let _ = write!(out, ". Default: {}", defaults.join(", "));
        }
        for value in arg.get_possible_values() {
            if !value.is_hide_set() {
                let _ = write!(out, "\n  * `{}`", value.get_name());
                if let Some(help) = value.get_help() {
                    let _ = write!(out, ": {}", escaped(&help.to_string()));
                }
            }
        }
    }
    out + "\n"
}

/// Adds the section of a command and those of its subcommands.
fn section(command: &mut Command, path: &str, page: &mut String) {
    let level = "#".repeat(1 + path.split(' ').count().min(3));
    let _ = writeln!(page, "{level} `{path}`\n");
    if let Some(about) = command.get_long_about().or(command.get_about()) {
        let _ = writeln!(page, "{}\n", escaped(&about.to_string()));
    }
    let usage = command.render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    let _ = writeln!(page, "```text\n{usage}\n```\n");
    let own: Vec<&Arg> = (command.get_arguments())
        .filter(|a| {
            let everywhere = ["help", "version", "quiet", "verbose", "json"];
            !a.is_hide_set() && !everywhere.contains(&a.get_id().as_str())
        })
        .collect();
    for arg in &own {
        *page += &entry(arg);
    }
    if !own.is_empty() {
        *page += "\n";
    }
    if let Some(after) = command.get_after_long_help().or(command.get_after_help()) {
        let examples = after
            .to_string()
            .replace("Examples:\n", "")
            .replace("\n  ", "\n");
        let _ = writeln!(page, "```sh\n{}\n```\n", examples.trim());
    }
    for below in command.get_subcommands_mut() {
        if below.get_name() != "help" && !below.is_hide_set() {
            let path = format!("{path} {}", below.get_name());
            section(below, &path, page);
        }
    }
}

#[test]
fn the_reference_is_the_help_of_the_program() {
    let mut program = Cli::command();
    program.build();
    let mut page = HEAD.to_owned();
    section(&mut program, "rig", &mut page);
    let page = format!("{}\n", page.trim_end());
    made_page("docs/reference.md", &page, "the_reference");
}
