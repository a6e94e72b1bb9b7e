//! The project file of `rig run`: its tables are steps, their keys the options of a command.

use std::path::Path;

use clap::{ArgAction, CommandFactory};
use toml_edit::{Document, InlineTable, Item, Table, Value};

use super::super::work::Words;
use crate::commands::error::CommandError;
use strsim::osa_distance;

/// Key of the command of a step.
const COMMAND: &str = "command";

/// Commands with one output file, and the ending of that file. The others write a folder.
const FILE_ENDINGS: [(&str, &str); 9] = [
    ("convert", "npz"),
    ("excite", "toml"),
    ("header", "h"),
    ("init", "toml"),
    ("mjcf", "xml"),
    ("record", "csv"),
    ("simulate", "csv"),
    ("table", "md"),
    ("urdf", "urdf"),
];

/// Options that a step does not have, and what is there instead.
const NOT_IN_A_STEP: [(&str, &str); 2] = [
    (
        "force",
        "`rig run` replaces what it wrote itself; give `rig run --force` to replace other files",
    ),
    (
        "json",
        "the step writes its JSON file, and `rig run --json` prints the summary as JSON",
    ),
];

/// One step: a table of the project file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Step {
    /// Name of the table.
    pub(super) name: String,
    /// Where the table stands: `lab.toml:12: [motion]`.
    pub(super) place: String,
    /// Name of the command.
    pub(super) command: String,
    /// The words of the command behind `rig`: its name, then the options.
    pub(super) words: Vec<String>,
    /// The options, each with its line and every text of its value.
    pub(super) options: Vec<StepOption>,
    /// The file or folder that the step writes.
    pub(super) out: String,
}

/// An option of a step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StepOption {
    /// Name, without the two dashes.
    pub(super) name: String,
    /// Line in the project file.
    pub(super) line: usize,
    /// Values, as words.
    pub(super) values: Vec<String>,
}

/// A project file as text.
struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Source<'_> {
    /// Returns the line of a position in the text, from 1.
    fn line(&self, span: Option<std::ops::Range<usize>>) -> usize {
        let before = span.and_then(|span| self.text.get(..span.start));
        before.unwrap_or_default().matches('\n').count() + 1
    }

    /// Returns an error about a line, and the table in it.
    fn error(&self, line: usize, table: Option<&str>, text: &str) -> CommandError {
        let table = table.map_or_else(String::new, |name| format!("[{name}]: "));
        CommandError::Sentence(format!("{}:{line}: {table}{text}", self.path.display()))
    }
}

/// Reads the steps of a project file. `path` is for messages.
///
/// # Errors
/// Names the line, and the table or the key at fault.
pub(super) fn steps(path: &Path, text: &str) -> Result<Vec<Step>, CommandError> {
    let source = Source { path, text };
    let document = Document::parse(text).map_err(|error| {
        let said: Vec<&str> = error.message().lines().map(str::trim).collect();
        source.error(
            source.line(error.span()),
            None,
            &format!("this is not TOML: {}.", said.join(", ")),
        )
    })?;
    let root = document.as_table();
    let shared: Vec<(&str, &Item)> = root.iter().filter(|(_, item)| item.is_value()).collect();
    let mut used = vec![false; shared.len()];
    let mut steps = Vec::new();
    for (name, item) in root.iter().filter(|(_, item)| !item.is_value()) {
        let line = source.line(root.key(name).and_then(toml_edit::Key::span));
        let Some(table) = item.as_table() else {
            return Err(source.error(
                line,
                Some(name),
                "a step is one table; write [name] with single brackets, and another name for each step.",
            ));
        };
        steps.push(step(&source, name, table, (root, &shared, &mut used))?);
    }
    let unused = shared.iter().zip(&used).find(|(_, used)| !**used);
    if let Some(((key, _), _)) = unused {
        let line = source.line(root.key(key).and_then(toml_edit::Key::span));
        return Err(source.error(
            line,
            None,
            &format!(
                "`{key}` stands before the first table, so it is an option of all steps that have it, and no step's command has it."
            ),
        ));
    }
    if steps.is_empty() {
        return Err(source.error(
            1,
            None,
            "the file has no steps; `rig run --example lab.toml` writes one that has.",
        ));
    }
    Ok(steps)
}

/// Reads one table. `shared`: the root, its options for all steps, and which of them some step uses.
fn step(
    source: &Source,
    name: &str,
    table: &Table,
    (root, shared, used): (&Table, &[(&str, &Item)], &mut [bool]),
) -> Result<Step, CommandError> {
    let top = source.line(root.key(name).and_then(toml_edit::Key::span));
    let wrong = |line, text: &str| source.error(line, Some(name), text);
    let described = command(source, name, table, top)?;
    let mut all: Vec<(&str, usize, &Item)> = Vec::new();
    for (k, (key, item)) in shared.iter().enumerate() {
        if argument(&described, key).is_some() {
            used[k] = true;
            let line = source.line(root.key(key).and_then(toml_edit::Key::span));
            if !table.contains_key(key) {
                all.push((key, line, item));
            }
        }
    }
    for (key, item) in table.iter().filter(|(key, _)| *key != COMMAND) {
        let line = source.line(table.key(key).and_then(toml_edit::Key::span));
        all.push((key, line, item));
    }
    let mut step = Step {
        name: name.to_owned(),
        place: format!("{}:{top}: [{name}]", source.path.display()),
        command: described.get_name().to_owned(),
        words: vec![described.get_name().to_owned()],
        options: Vec::new(),
        out: default_out(described.get_name(), name),
    };
    for (key, line, item) in all {
        if let Some((_, why)) = NOT_IN_A_STEP.iter().find(|(own, _)| *own == key) {
            return Err(wrong(line, &format!("a step has no `{key}`: {why}.")));
        }
        let Some(argument) = argument(&described, key) else {
            return Err(wrong(line, &unknown(&described, key)));
        };
        let value = item.clone().into_value();
        let value = value.map_err(|_| "it is a list of tables".to_owned());
        let (words, values) = value
            .and_then(|value| option(argument, &value))
            .map_err(|why| wrong(line, &format!("`{key}` cannot be used: {why}.")))?;
        if key == "out" {
            step.out = values.first().cloned().unwrap_or_default();
        } else {
            step.words.extend(words);
        }
        step.options.push(StepOption {
            name: key.to_owned(),
            line,
            values,
        });
    }
    step.words.push(format!("--out={}", step.out));
    Ok(step)
}

/// Returns the command of a table whose name is in line `top`.
fn command(
    source: &Source,
    name: &str,
    table: &Table,
    top: usize,
) -> Result<clap::Command, CommandError> {
    let wrong = |line, text: &str| source.error(line, Some(name), text);
    if !name
        .chars()
        .all(|c| c.is_alphanumeric() || "-_".contains(c))
    {
        return Err(wrong(
            top,
            "the name of a step is also that of its files; use letters, digits, - and _.",
        ));
    }
    let words = Words::command();
    let names = || {
        let names: Vec<&str> = (words.get_subcommands())
            .map(clap::Command::get_name)
            .collect();
        names.join(", ")
    };
    let Some(command) = table.get(COMMAND).and_then(Item::as_str) else {
        let text = format!(
            "the table has no `{COMMAND}`; write {COMMAND} = \"identify\", or one of {}.",
            names()
        );
        return Err(wrong(top, &text));
    };
    words.find_subcommand(command).cloned().ok_or_else(|| {
        let line = source.line(table.key(COMMAND).and_then(toml_edit::Key::span));
        let text = format!(
            "`{command}` is no command for a step; take one of {}.",
            names()
        );
        wrong(line, &text)
    })
}

/// Returns the output of a step that names none.
fn default_out(command: &str, name: &str) -> String {
    match FILE_ENDINGS.iter().find(|(own, _)| *own == command) {
        Some((_, ending)) => format!("{name}.{ending}"),
        None => name.to_owned(),
    }
}

/// Returns the option of a command, or its argument without dashes.
fn argument<'a>(command: &'a clap::Command, key: &str) -> Option<&'a clap::Arg> {
    (command.get_arguments()).find(|own| match own.is_positional() {
        true => own.get_id() == key,
        false => own.get_long() == Some(key),
    })
}

/// The sentence about a key that is no option.
fn unknown(command: &clap::Command, key: &str) -> String {
    let name = command.get_name();
    let names: Vec<String> = (command.get_arguments())
        .map(|own| own.get_long().unwrap_or(own.get_id().as_str()).to_owned())
        .filter(|own| NOT_IN_A_STEP.iter().all(|(not, _)| not != own))
        .collect();
    let near = (names.iter())
        .map(|own| (osa_distance(own, key), own))
        .min()
        .filter(|(distance, own)| 2 * distance <= own.chars().count());
    match near {
        Some((_, near)) => {
            format!("`rig {name}` has no option `{key}`; did you mean `{near}`?")
        }
        None => format!(
            "`rig {name}` has no option `{key}`; it has {}.",
            names.join(", ")
        ),
    }
}

/// Returns an option as words for the command line, and the texts of its values.
fn option(argument: &clap::Arg, value: &Value) -> Result<(Vec<String>, Vec<String>), String> {
    let name = argument.get_long();
    if matches!(argument.get_action(), ArgAction::SetTrue) {
        let on = value
            .as_bool()
            .ok_or("it is a switch; write true or false")?;
        let words = name.filter(|_| on).map(|name| format!("--{name}"));
        return Ok((words.into_iter().collect(), vec![on.to_string()]));
    }
    let values = match value {
        Value::Array(list) => list.iter().map(word).collect::<Result<Vec<_>, _>>()?,
        Value::InlineTable(table) => entries(table)?,
        one => vec![word(one)?],
    };
    let Some(name) = name else {
        return Ok((values.clone(), values));
    };
    let fixed = argument
        .get_num_args()
        .filter(|n| n.min_values() == n.max_values() && n.max_values() > 1);
    let words = if fixed.is_some() {
        let name = std::iter::once(format!("--{name}"));
        name.chain(values.iter().cloned()).collect()
    } else if argument.get_value_delimiter().is_some() || is_pose(name, &values) {
        vec![format!("--{name}={}", values.join(","))]
    } else if values.len() > 1 && !matches!(argument.get_action(), ArgAction::Append) {
        return Err(format!(
            "it takes one value, and {} are given",
            values.len()
        ));
    } else {
        (values.iter())
            .map(|value| format!("--{name}={value}"))
            .collect()
    };
    Ok((words, values))
}

/// Returns true for the positions of one pose, not several poses as text.
fn is_pose(name: &str, values: &[String]) -> bool {
    name == "pose" && values.iter().all(|value| value.parse::<f64>().is_ok())
}

/// Returns the entries of a table as KEY=VALUE, and as KEY=VALUE,VALUE where the value is a list.
fn entries(table: &InlineTable) -> Result<Vec<String>, String> {
    (table.iter())
        .map(|(key, value)| {
            let value = match value {
                Value::Array(list) => {
                    let words = list.iter().map(word);
                    words.collect::<Result<Vec<_>, _>>()?.join(",")
                }
                one => word(one)?,
            };
            Ok(format!("{key}={value}"))
        })
        .collect()
}

/// Returns one value as a word.
fn word(value: &Value) -> Result<String, String> {
    match value {
        Value::String(text) => Ok(text.value().clone()),
        Value::Integer(number) => Ok(number.value().to_string()),
        Value::Float(number) => Ok(number.value().to_string()),
        other => Err(format!(
            "{} is neither text in quotation marks nor a number",
            other.to_string().trim()
        )),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use clap::Parser;

    use super::*;

    /// `rig run` gives every step an output and may have to replace it.
    #[test]
    fn every_command_that_can_be_a_step_has_out_and_force() {
        let words = Words::command();
        assert!(words.get_subcommands().count() >= 15);
        for command in words.get_subcommands() {
            for option in ["out", "force"] {
                assert!(
                    argument(command, option).is_some(),
                    "{} {option}",
                    command.get_name()
                );
            }
        }
        for (name, _) in FILE_ENDINGS {
            assert!(words.find_subcommand(name).is_some(), "{name}");
        }
    }

    #[test]
    fn tables_become_the_words_of_the_command() {
        let text = "unit = { q = \"deg\", t = \"ms\" }\n\n[a]\ncommand = \"identify\"\nrobot = \"arm.urdf\"\ndata = [\"1.csv\", \"2.csv\"]\nlock.finger = -0.5\nas-described = true\neven-if-wrong = false\n\n[b]\ncommand = \"excite\"\nrobot = \"arm.urdf\"\nstart = [-1.5, 0]\n\n[c]\ncommand = \"convert\"\nfile = \"1.csv\"\n\n[e]\ncommand = \"control\"\nrobot = \"arm.urdf\"\npose = [-1.5, 0]\n\n[f]\ncommand = \"compliance\"\nrobot = \"arm.urdf\"\npose = [\"-1.5,0\", \"1,2\"]\n\n[d]\ncommand = \"compare\"\nrobot = \"arm.urdf\"\nset = { cold = [\"1.csv\", \"2.csv\"] }\n";
        let found = steps(Path::new("lab.toml"), text).unwrap();
        let words: Vec<String> = found.iter().map(|step| step.words.join(" ")).collect();
        assert_eq!(
            words,
            [
                "identify --unit=q=deg --unit=t=ms --robot=arm.urdf --data=1.csv --data=2.csv --lock=finger=-0.5 --as-described --out=a",
                "excite --robot=arm.urdf --start=-1.5,0 --out=b.toml",
                "convert --unit=q=deg --unit=t=ms 1.csv --out=c.npz",
                "control --robot=arm.urdf --pose=-1.5,0 --out=e",
                "compliance --unit=q=deg --unit=t=ms --robot=arm.urdf --pose=-1.5,0 --pose=1,2 --out=f",
                "compare --unit=q=deg --unit=t=ms --robot=arm.urdf --set=cold=1.csv,2.csv --out=d",
            ]
        );
        for step in found {
            let all = std::iter::once("rig").chain(step.words.iter().map(String::as_str));
            assert!(Words::try_parse_from(all).is_ok(), "{}", step.name);
        }
    }
}
