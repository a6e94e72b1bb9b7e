//! Output for the user while a command works: a progress bar on a terminal, and sentences.

use std::cell::RefCell;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::error::CommandError;

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
    /// The words of the command, without the name of the program.
    words: Vec<String>,
    /// The lines of the result that answer the question of the command.
    answers: Rc<RefCell<Vec<String>>>,
}

impl Ui {
    /// Creates the output. It shows progress bars only if standard error is a terminal.
    pub(crate) fn new() -> Self {
        Self {
            terminal: std::io::stderr().is_terminal(),
            has_results: true,
            has_remarks: true,
            has_details: false,
            words: std::env::args().skip(1).collect(),
            answers: Rc::default(),
        }
    }

    /// Returns an output that prints errors alone, and what is asked for as JSON.
    pub(crate) fn quiet() -> Self {
        Self {
            terminal: false,
            has_results: false,
            has_remarks: false,
            ..Self::new()
        }
    }

    /// Returns an output that prints details of results, too.
    pub(crate) fn verbose() -> Self {
        Self {
            has_details: true,
            ..Self::new()
        }
    }

    /// Returns true if details of results are printed.
    pub(crate) fn is_verbose(&self) -> bool {
        self.has_details
    }

    /// Returns this output without sentences about results.
    fn without_results(&self) -> Self {
        Self {
            has_results: false,
            ..self.clone()
        }
    }

    /// Returns the output of a command with these words that is a step of another. Its results are printed if
    /// `has_results`.
    pub(crate) fn of_step(&self, words: &[String], has_results: bool) -> Self {
        Self {
            has_results: self.has_results && has_results,
            words: words.to_vec(),
            answers: Rc::default(),
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
        self.answers.borrow().clone()
    }

    /// Runs a command. If `file` is one of its results, prints that instead of sentences.
    ///
    /// # Errors
    /// Those of the command.
    pub(crate) fn with_json<T>(
        &self,
        file: Option<PathBuf>,
        run: impl FnOnce(&Self) -> Result<T, CommandError>,
    ) -> Result<T, CommandError> {
        let Some(file) = file else {
            return run(self);
        };
        let done = run(&self.without_results())?;
        let text = std::fs::read_to_string(&file).map_err(|error| {
            CommandError::Sentence(format!("{} cannot be read: {error}.", file.display()))
        })?;
        self.print(text.trim_end());
        Ok(done)
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
        self.answers.borrow_mut().push(text.to_owned());
        self.say(text);
    }

    /// Prints what is asked for as JSON.
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

    /// Creates a bar for work of `total` steps. It is hidden without a terminal and during the first second.
    pub(crate) fn progress(&self, what: &'static str, total: u64) -> Progress {
        if !self.terminal {
            return Progress {
                bar: ProgressBar::hidden(),
                started: None,
            };
        }
        let bar = ProgressBar::hidden();
        bar.set_length(total);
        bar.set_message(what);
        Progress {
            bar,
            started: Some(std::time::Instant::now()),
        }
    }
}

/// Returns a text with minus signs as programs read them: numbers are copied from a terminal.
pub fn plain(text: &str) -> String {
    text.replace('−', "-")
}

/// Puts a word in quotation marks if a shell needs them.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

impl Default for Ui {
    fn default() -> Self {
        Self::new()
    }
}

/// A progress bar that appears once the work has taken a second.
pub(crate) struct Progress {
    bar: ProgressBar,
    /// When the work began, until the bar is shown.
    started: Option<std::time::Instant>,
}

impl Progress {
    /// Sets the number of steps that are done.
    pub(crate) fn at(&mut self, done: u64) {
        if self
            .started
            .is_some_and(|started| started.elapsed() > Duration::from_secs(1))
        {
            self.started = None;
            self.bar
                .set_draw_target(indicatif::ProgressDrawTarget::stderr());
            if let Ok(style) =
                ProgressStyle::with_template("{msg:>20} [{bar:40}] {percent:>3} % {eta} left")
            {
                self.bar.set_style(style.progress_chars("=> "));
            }
        }
        self.bar.set_position(done);
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

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
