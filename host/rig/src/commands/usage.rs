//! Wrong arguments, as one sentence.

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Returns what is wrong with the arguments and what would be right, or `None` if the user asked for help or the version.
/// `words`: the arguments; `program`: what reads them.
pub(super) fn wrong_arguments(
    error: &clap::Error,
    words: &[String],
    program: &Command,
) -> Option<String> {
    if matches!(
        error.kind(),
        ErrorKind::DisplayHelp
            | ErrorKind::DisplayVersion
            | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    ) {
        return None;
    }
    let command = command_of(words, program);
    let mut text = fault(error);
    if let (Some(ContextValue::String(option)), ErrorKind::UnknownArgument) =
        (error.get(ContextKind::InvalidArg), error.kind())
    {
        let owners = owners(program, option.trim_start_matches('-'));
        if !owners.is_empty() {
            text = format!("{text} {option} is an option of {}.", owners.join(", "));
        }
    }
    let help = match command.is_empty() {
        true => "rig --help".to_owned(),
        false => format!("rig {command} --help"),
    };
    Some(format!("{text} `{help}` shows what is possible."))
}

/// Returns what clap says of an error, without usage, as sentences.
pub(super) fn fault(error: &clap::Error) -> String {
    let text = error.to_string();
    let mut said = String::new();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        if line.starts_with("Usage:") || line.starts_with("For more") {
            break;
        }
        let line = (line.strip_prefix("error: ").or(line.strip_prefix("tip: "))).unwrap_or(line);
        let line = line
            .strip_prefix('[')
            .and_then(|own| own.strip_suffix(']'))
            .unwrap_or(line);
        match said.chars().last() {
            None => {}
            Some(':') => said.push(' '),
            Some('.') => said.push(' '),
            Some(_) => said += "; ",
        }
        said += line;
    }
    if !said.ends_with('.') {
        said.push('.');
    }
    said
}

/// Returns the command that the words begin with, and its subcommand; empty for the program itself.
fn command_of(words: &[String], program: &Command) -> String {
    let mut names = Vec::new();
    let mut within = program;
    for word in words {
        // Options may stand before the command.
        if let Some(own) = within.find_subcommand(word) {
            names.push(own.get_name().to_owned());
            within = own;
        }
    }
    names.join(" ")
}

/// Returns the commands that have an option, as `rig control`.
fn owners(program: &Command, option: &str) -> Vec<String> {
    (program.get_subcommands())
        .filter(|own| {
            own.get_arguments()
                .any(|arg| arg.get_long() == Some(option))
        })
        .map(|own| format!("`rig {}`", own.get_name()))
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::commands::Cli;
    use clap::{CommandFactory as _, Parser as _};

    fn said(line: &str) -> String {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let error = Cli::try_parse_from(&words).unwrap_err();
        wrong_arguments(&error, &words, &Cli::command()).unwrap()
    }

    #[test]
    fn an_option_of_another_command_is_named_with_it() {
        assert_eq!(
            said("rig identify --robot a.toml --data b.csv --out c --law pid"),
            "unexpected argument '--law' found. --law is an option of `rig control`. `rig identify --help` shows what is possible."
        );
    }

    #[test]
    fn a_wrong_word_gets_one_line_with_what_would_be_right() {
        for (line, parts) in [
            (
                "rig identify --robot a --dat b --out c",
                &["'--data'", "`rig identify --help`"],
            ),
            (
                "rig identify --robot a --out c",
                &["not provided: --data", "`rig identify --help`"],
            ),
            (
                "rig control --robot a --out c --law pdd",
                &["'pid'", "`rig control --help`"],
            ),
            ("rig identfy", &["'identify'", "`rig --help`"]),
            (
                "rig board --emulated capture",
                &["--out", "`rig board capture --help`"],
            ),
        ] {
            let text = said(line);
            assert!(!text.contains('\n'), "{text}");
            for part in parts {
                assert!(text.contains(part), "{part}: {text}");
            }
        }
    }

    #[test]
    fn help_is_no_error() {
        for line in &["rig --help", "rig load --help", "rig --version"] {
            let error = Cli::try_parse_from(line.split(' ')).unwrap_err();
            assert_eq!(
                wrong_arguments(&error, &[], &Cli::command()),
                None,
                "{line}"
            );
        }
    }
}
