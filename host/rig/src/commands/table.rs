//! `rig table`: the parameters of an identification as a table for a paper.

use std::path::{Path, PathBuf};

use clap::{Args as ClapArgs, ValueEnum};
use serde::Deserialize;

use super::error::CommandError;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_output::{format_unit, format_value, of_exponent, write_whole};

/// Schema of the results that are read.
const SCHEMA: &str = "rig-identification/1";

/// Notation of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Notation {
    /// LaTeX: an environment `tabular` with the rules of the package booktabs
    Latex,
    /// Markdown, as GitHub and pandoc read it
    Markdown,
}

/// Writes the parameters of an identification as a table: expression, value ± standard deviation, unit.
///
/// Reads identification.json of `rig identify`. The notation is that of the file's name (.tex or .md), unless --format is
/// given; without --out the table is printed.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Result of `rig identify`: identification.json, or its folder
    #[arg(value_name = "RESULT")]
    result: PathBuf,
    /// Notation [default: by the name of the file; else markdown]
    #[arg(long, value_enum)]
    format: Option<Notation>,
    /// File to write, .tex or .md
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

/// The part of a result that is in the table.
#[derive(Debug, Deserialize)]
struct Found {
    schema: String,
    robot: String,
    base_parameters: Vec<Parameter>,
}

/// One row.
#[derive(Debug, Deserialize)]
struct Parameter {
    expression: String,
    value: f64,
    /// `null` where it is not known.
    std: Option<f64>,
    unit: String,
}

/// Runs the command.
///
/// # Errors
/// A file that is no identification, or cannot be written.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    if let Some(out) = &args.out {
        refuse_file(out, args.force)?;
    }
    let path = match args.result.is_dir() {
        true => args.result.join("identification.json"),
        false => args.result.clone(),
    };
    let found = read(&path)?;
    let ending = args.out.as_ref().and_then(|out| out.extension());
    let notation = args.format.unwrap_or(match ending {
        Some(ending) if ending.eq_ignore_ascii_case("tex") => Notation::Latex,
        _ => Notation::Markdown,
    });
    let text = match notation {
        Notation::Latex => latex(&found),
        Notation::Markdown => markdown(&found),
    };
    match &args.out {
        None => {
            ui.fact("table", text.trim_end());
            if !ui.is_json() {
                ui.print(text.trim_end());
            }
        }
        Some(out) => {
            write_whole(out, text.as_bytes())?;
            ui.file(out);
            ui.fact("parameters", found.base_parameters.len());
            ui.answer(&format!(
                "{}: {} parameters",
                out.display(),
                found.base_parameters.len()
            ));
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Found, CommandError> {
    let wrong = |why: String| {
        CommandError::Sentence(format!(
            "{}: {why}; give the identification.json of `rig identify`.",
            path.display()
        ))
    };
    let text = std::fs::read_to_string(path)
        .map_err(|error| wrong(format!("it cannot be read ({error})")))?;
    let found: Found = serde_json::from_str(&text)
        .map_err(|error| wrong(format!("it is no result of an identification ({error})")))?;
    match found.schema == SCHEMA {
        true => Ok(found),
        false => Err(wrong(format!(
            "its schema is {}, not {SCHEMA}",
            found.schema
        ))),
    }
}

impl Parameter {
    /// Returns value and standard deviation in as many digits as the latter warrants.
    fn shown(&self) -> String {
        match self.std {
            Some(std) => format_value(self.value, std),
            None => rig_output::format_significant(self.value, 4),
        }
    }
}

fn markdown(found: &Found) -> String {
    let mut text = format!(
        "| parameter of {} | value ± standard deviation | unit |\n| --- | ---: | --- |\n",
        found.robot.replace('|', "\\|")
    );
    for own in &found.base_parameters {
        text.push_str(&format!(
            "| {} | {} | {} |\n",
            own.expression.replace('|', "\\|"),
            own.shown(),
            format_unit(&own.unit)
        ));
    }
    text
}

fn latex(found: &Found) -> String {
    let mut text = format!(
        "% Parameters of {}, written by rig {}. Needs \\usepackage{{booktabs}}.\n\\begin{{tabular}}{{lrl}}\n\\toprule\nparameter & value $\\pm$ standard deviation & unit \\\\\n\\midrule\n",
        found.robot.replace(['\n', '\r'], " "),
        env!("CARGO_PKG_VERSION")
    );
    for own in &found.base_parameters {
        text.push_str(&format!(
            "${}$ & ${}$ & {} \\\\\n",
            mathematics(&own.expression),
            number(&own.shown()),
            unit(&own.unit)
        ));
    }
    text.push_str("\\bottomrule\n\\end{tabular}\n");
    text
}

/// Returns an expression such as `Izz1 + 0.25*m2` in mathematics: `I_{zz1} + 0.25\,m_{2}`.
fn mathematics(expression: &str) -> String {
    let mut text = String::new();
    let mut rest = expression;
    while let Some(first) = rest.chars().next() {
        if first.is_alphabetic() {
            let end = rest
                .find(|c: char| !c.is_alphanumeric())
                .unwrap_or(rest.len());
            let (name, behind) = rest.split_at(end);
            rest = behind;
            text.push_str(&symbol(name));
            continue;
        }
        rest = &rest[first.len_utf8()..];
        match first {
            '*' | '·' => text.push_str("\\,"),
            '−' => text.push('-'),
            '²' => text.push_str("^2"),
            '_' | '%' | '&' | '#' | '$' | '{' | '}' => {
                text.push('\\');
                text.push(first);
            }
            '\\' => text.push_str("\\backslash "),
            other => text.push(other),
        }
    }
    text
}

/// Returns the name of a parameter as a letter with an index: `Izz1` as `I_{zz1}`, `fv2` as `f_{v2}`, `off1` as `\mathrm{off}_{1}`.
fn symbol(name: &str) -> String {
    let digits = name
        .find(|c: char| c.is_ascii_digit())
        .unwrap_or(name.len());
    let (word, number) = name.split_at(digits);
    match word {
        "cos" | "sin" => format!("\\{word} {number}"),
        "off" => format!("\\mathrm{{off}}_{{{number}}}"),
        _ => {
            let first = word.chars().next().map_or(0, char::len_utf8);
            let (letter, index) = word.split_at(first);
            match (index, number) {
                ("", "") => letter.to_owned(),
                _ => format!("{letter}_{{{index}{number}}}"),
            }
        }
    }
}

/// Returns `1.235 ± 0.020` and `(1.2 ± 0.1)·10⁻⁵` in mathematics.
fn number(text: &str) -> String {
    let mut out = String::new();
    let mut is_raised = false;
    for c in text.chars() {
        let raised = of_exponent(c);
        if raised.is_some() != is_raised {
            out.push_str(if is_raised { "}" } else { "^{" });
            is_raised = !is_raised;
        }
        match (raised, c) {
            (Some(digit), _) => out.push(digit),
            (None, '±') => out.push_str("\\pm"),
            (None, '·') => out.push_str("\\cdot "),
            (None, '−') => out.push('-'),
            (None, other) => out.push(other),
        }
    }
    if is_raised {
        out.push('}');
    }
    out
}

/// Returns a unit such as `kg*m^2` as text: `kg\,m$^2$`.
fn unit(ascii: &str) -> String {
    let mut text = String::new();
    let mut rest = ascii.chars().peekable();
    while let Some(c) = rest.next() {
        match c {
            '*' => text.push_str("\\,"),
            '^' => {
                let mut power = String::new();
                while let Some(digit) = rest.next_if(|c| c.is_ascii_digit() || *c == '-') {
                    power.push(digit);
                }
                text.push_str(&format!("$^{{{power}}}$"));
            }
            other => text.push(other),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_and_numbers_are_mathematics() {
        assert_eq!(
            mathematics("Izz1 + Ia1 − 0.25*m2 + 0.1·mx3"),
            "I_{zz1} + I_{a1} - 0.25\\,m_{2} + 0.1\\,m_{x3}"
        );
        assert_eq!(mathematics("off1"), "\\mathrm{off}_{1}");
        assert_eq!(number("1.235 ± 0.020"), "1.235 \\pm 0.020");
        assert_eq!(number("(−1.2 ± 0.1)·10⁻⁵"), "(-1.2 \\pm 0.1)\\cdot 10^{-5}");
        assert_eq!(unit("N*m*s^2/rad"), "N\\,m\\,s$^{2}$/rad");
    }
}
