//! What a person sees while a command works: progress on a terminal, sentences everywhere.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Speaks to the person at the terminal. Results go to standard output, everything else to standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ui {
    terminal: bool,
}

impl Ui {
    /// Progress bars only where standard error is a terminal.
    pub(crate) fn new() -> Self {
        Self {
            terminal: std::io::stderr().is_terminal(),
        }
    }

    /// A result: one line on standard output.
    pub(crate) fn say(&self, text: &str) {
        if let Err(error) = writeln!(std::io::stdout(), "{text}") {
            // A reader that has seen enough (`rig … | head`) is no failure; a full disk is.
            if error.kind() == std::io::ErrorKind::BrokenPipe {
                std::process::exit(0);
            }
            eprintln!("rig: standard output cannot be written: {error}.");
            std::process::exit(1);
        }
    }

    /// A remark that is no result: one line on standard error.
    pub(crate) fn remark(&self, text: &str) {
        eprintln!("rig: {text}");
    }

    /// A bar for work of `total` steps; invisible off a terminal, and there for the first second.
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
    /// So many steps are done.
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

    /// So many steps more are done.
    pub(crate) fn advance(&mut self, steps: u64) {
        self.at(self.bar.position() + steps);
    }

    /// So many of so many steps are done.
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
