//! Output for the user while a command works: a progress bar on a terminal, and sentences.

use std::cell::RefCell;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::error::CommandError;
use rig_output::{of_exponent, spell_units};

/// Longest list that is printed without `--verbose`: with the answer behind it, it fits a terminal of 24 lines.
pub(crate) const LISTED: usize = 14;

/// Prints messages for the user. Results go to standard output, everything else to standard error.
#[derive(Clone, Debug)]
pub(crate) struct Ui {
    terminal: bool,
    /// True if results are printed as sentences.
    has_results: bool,
    /// True if remarks are printed.
    has_remarks: bool,
    /// True if details of results are printed.
    has_details: bool,
    /// True if the result is printed as JSON.
    is_json: bool,
    /// The words of the command, without the name of the program.
    words: Vec<String>,
    /// What the command said.
    said: Rc<RefCell<Said>>,
}

/// What a command said about its result, for a summary.
#[derive(Debug, Default)]
struct Said {
    /// The lines that answer the question of the command.
    answers: Vec<String>,
    /// What may make the result wrong.
    warnings: Vec<String>,
    /// Numbers and texts of the result by name.
    facts: serde_json::Map<String, serde_json::Value>,
    /// The files that were written.
    files: Vec<String>,
    /// True if the result was printed as JSON.
    has_json: bool,
}

/// What the user wants to be printed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wanted {
    /// Errors alone, and what is asked for as JSON.
    pub(crate) quiet: bool,
    /// Details of results, too.
    pub(crate) verbose: bool,
    /// The result as JSON instead of sentences.
    pub(crate) json: bool,
}

impl Ui {
    /// Creates the output. It shows progress bars only if standard error is a terminal.
    pub(crate) fn new(wanted: Wanted) -> Self {
        Self {
            terminal: !wanted.quiet && std::io::stderr().is_terminal(),
            has_results: !wanted.quiet && !wanted.json,
            has_remarks: !wanted.quiet,
            has_details: wanted.verbose,
            is_json: wanted.json,
            words: std::env::args().skip(1).collect(),
            said: Rc::default(),
        }
    }

    /// Returns true if details of results are printed.
    pub(crate) fn is_verbose(&self) -> bool {
        self.has_details
    }

    /// Returns true if the result is wanted as JSON.
    pub(crate) fn is_json(&self) -> bool {
        self.is_json
    }

    /// Returns the output of a command with these words that is a step of another. Its results are printed if
    /// `has_results`.
    pub(crate) fn of_step(&self, words: &[String], has_results: bool) -> Self {
        Self {
            has_results: self.has_results && has_results,
            is_json: false,
            words: words.to_vec(),
            said: Rc::default(),
            ..self.clone()
        }
    }

    /// Returns the command line that repeats the result, for reports: its words in quotation marks where a shell needs them.
    pub(crate) fn command_line(&self) -> String {
        let words = self.words.iter().map(|word| quoted(word));
        let words: Vec<String> = std::iter::once("rig".to_owned()).chain(words).collect();
        words.join(" ")
    }

    /// Returns the lines that [`Self::answer`] printed or would have printed.
    pub(crate) fn answers(&self) -> Vec<String> {
        self.said.borrow().answers.clone()
    }

    /// Runs a command whose result is `file`. Prints that instead of sentences if JSON is wanted.
    ///
    /// # Errors
    /// Those of the command.
    pub(crate) fn with_json<T>(
        &self,
        file: PathBuf,
        run: impl FnOnce(&Self) -> Result<T, CommandError>,
    ) -> Result<T, CommandError> {
        let done = run(self)?;
        if self.is_json {
            let text = std::fs::read_to_string(&file).map_err(|error| {
                CommandError::Sentence(format!("{} cannot be read: {error}.", file.display()))
            })?;
            self.print_json(text.trim_end());
        }
        Ok(done)
    }

    /// Prints a result as JSON.
    pub(crate) fn print_json(&self, text: &str) {
        self.said.borrow_mut().has_json = true;
        self.print(text);
    }

    /// Prints what the command said as JSON, if it has printed no JSON of its own.
    pub(crate) fn print_summary(&self) {
        let said = self.said.borrow();
        if said.has_json {
            return;
        }
        let mut summary = serde_json::json!({
            "schema": "rig-summary/1",
            "command": self.command_line(),
            "files": said.files,
            "answer": said.answers.iter().map(|line| plain(line)).collect::<Vec<_>>(),
            "warnings": said.warnings.iter().map(|line| plain(line)).collect::<Vec<_>>(),
        });
        if let Some(object) = summary.as_object_mut() {
            object.extend(said.facts.clone());
        }
        drop(said);
        self.print_json(&format!("{summary:#}"));
    }

    /// Adds a file that was written to the summary.
    pub(crate) fn file(&self, path: &Path) {
        (self.said.borrow_mut().files).push(path.display().to_string());
    }

    /// Adds a number or text of the result to the summary.
    pub(crate) fn fact(&self, name: &str, value: impl Into<serde_json::Value>) {
        (self.said.borrow_mut().facts).insert(name.to_owned(), value.into());
    }

    /// Prints a result: one line on standard output.
    pub(crate) fn say(&self, text: &str) {
        if self.has_results {
            self.print(&plain(text));
        }
    }

    /// Prints a detail of a result, if details are asked for: one line on standard output.
    pub(crate) fn detail(&self, text: &str) {
        if self.has_details {
            self.say(text);
        }
    }

    /// Prints one of `count` lines of a list. A long list is a detail: the report has it.
    pub(crate) fn say_of_many(&self, count: usize, text: &str) {
        match count > LISTED {
            true => self.detail(text),
            false => self.say(text),
        }
    }

    /// Prints a line of the result that answers the question of the command: a summary of several commands has it too.
    pub(crate) fn answer(&self, text: &str) {
        self.said.borrow_mut().answers.push(text.to_owned());
        self.say(text);
    }

    /// Prints what is asked for by name: one text on standard output.
    pub(crate) fn print(&self, text: &str) {
        if let Err(error) = writeln!(std::io::stdout(), "{text}") {
            // A closed pipe (`rig … | head`) is no failure; a full disk is one.
            if error.kind() == std::io::ErrorKind::BrokenPipe {
                std::process::exit(0);
            }
            eprintln!("rig: error: standard output cannot be written: {error}.");
            std::process::exit(1);
        }
    }

    /// Prints what may make a result wrong: one line on standard error.
    pub(crate) fn warn(&self, text: &str) {
        self.said.borrow_mut().warnings.push(text.to_owned());
        self.remark("warning", text);
    }

    /// Prints what is good to know: one line on standard error.
    pub(crate) fn note(&self, text: &str) {
        self.remark("note", text);
    }

    fn remark(&self, kind: &str, text: &str) {
        if self.has_remarks {
            eprintln!("rig: {kind}: {}", plain(text));
        }
    }

    /// Creates a bar for work of `total` steps. It is hidden during the first second. Without a terminal there is none, and
    /// long work says once how long it will take.
    pub(crate) fn progress(&self, what: &'static str, total: u64) -> Progress {
        let bar = ProgressBar::hidden();
        bar.set_length(total);
        bar.set_message(what);
        Progress {
            bar,
            form: if self.terminal { Form::Bar } else { Form::Note },
            started: self.has_remarks.then(Instant::now),
        }
    }
}

/// Returns a text with numbers as programs read them, because they are copied from a terminal (`−8.5·10⁻⁷` is `-8.5e-7`),
/// and with one spelling of units.
pub fn plain(text: &str) -> String {
    const POWER: &str = "·10";
    let text = spell_units(text).replace('−', "-");
    let mut parts = text.split(POWER);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = (part.char_indices())
            .find(|(_, c)| of_exponent(*c).is_none())
            .map_or(part.len(), |(at, _)| at);
        let exponent: String = part[..end].chars().filter_map(of_exponent).collect();
        match (
            exponent.is_empty(),
            out.ends_with(|c: char| c.is_ascii_digit()),
        ) {
            (true, _) => out += POWER,
            (false, true) => out = format!("{out}e{exponent}"),
            (false, false) => out = format!("{out}·1e{exponent}"),
        }
        out += &part[end..];
    }
    out
}

/// Puts a word in quotation marks if a shell needs them.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// How progress is shown.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// A bar once the work has taken a second.
    Bar,
    /// A note once the work has taken [`LONG`].
    Note,
}

/// Time after which work without a bar says how long it will take.
const LONG: Duration = Duration::from_secs(30);

/// What shows how far the work is.
pub(crate) struct Progress {
    bar: ProgressBar,
    form: Form,
    /// When the work began, until this is shown.
    started: Option<Instant>,
}

impl Progress {
    /// Sets the number of steps that are done.
    pub(crate) fn at(&mut self, done: u64) {
        self.bar.set_position(done);
        let Some(passed) = self.started.map(|started| started.elapsed()) else {
            return;
        };
        match self.form {
            Form::Bar if passed > Duration::from_secs(1) => {
                self.started = None;
                self.bar
                    .set_draw_target(indicatif::ProgressDrawTarget::stderr());
                if let Ok(style) =
                    ProgressStyle::with_template("{msg:>20} [{bar:40}] {percent:>3} % {eta} left")
                {
                    self.bar.set_style(style.progress_chars("=> "));
                }
            }
            Form::Note if passed > LONG => {
                self.started = None;
                let share = done as f64 / self.bar.length().unwrap_or(0).max(1) as f64;
                let left = passed.as_secs_f64() * (1.0 / share.max(1e-9) - 1.0);
                let (what, passed) = (self.bar.message(), passed.as_secs_f64());
                match share < 1.0 {
                    true => eprintln!(
                        "rig: note: {what}: {:.1} % after {passed:.0} s; about {} left.",
                        100.0 * share,
                        in_words(left)
                    ),
                    // The steps were an estimate, and it was too small.
                    false => eprintln!("rig: note: {what}: still at work after {passed:.0} s."),
                }
            }
            _ => {}
        }
    }

    /// Adds to the number of steps that are done.
    pub(crate) fn advance(&mut self, steps: u64) {
        self.at(self.bar.position() + steps);
    }

    /// Sets the number of steps that are done and their total.
    pub(crate) fn at_of(&mut self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.at(done);
    }
}

/// Returns a duration in the unit that people would use.
fn in_words(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_can_be_copied_and_units_have_one_spelling() {
        for (text, printed) in [
            ("error −8.580·10⁻⁷ rad", "error -8.580e-7 rad"),
            ("(1.235 ± 0.012)·10⁻⁵ kg*m^2", "(1.235 ± 0.012)·1e-5 kg·m²"),
            ("3·10¹² of 5·100 N*m", "3e12 of 5·100 N·m"),
            ("kg·m²", "kg·m²"),
        ] {
            assert_eq!(plain(text), printed);
        }
    }
}
