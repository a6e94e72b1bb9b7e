//! `rig run`: the steps of a project file, one after the other.

mod project;
mod state;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args as ClapArgs, Parser};

use self::project::{Step, steps};
use self::state::{Done, State, inputs, snapshot, written};
use super::error::CommandError;
use super::interrupts;
use super::overwrite::refuse_file;
use super::pictures::forget;
use super::ui::Ui;
use super::usage::fault;
use super::work::{Words, Work};
use crate::pages::{self, RunStep};
use rig_output::write_whole;

/// A project file for the emulated rig.
const EXAMPLE: &str = include_str!("run/example.toml");

/// Runs the steps of a project file: design, record, identify, diagnose, validate, compare.
///
/// Each table of the file is a step: `command` names the command, the other keys are its options, with their names. Keys
/// before the first table are options of every step that has them. Paths are relative to the file. The output of a step
/// is the folder with its name, or the file with its name and the ending that the command needs, unless `out` says
/// otherwise.
///
/// Prints the answers of the steps; with --verbose all that they print.
///
/// Steps whose options, inputs and outputs are unchanged are skipped. The first step that fails ends the run. The page
/// beside the project file (lab.html for lab.toml) has the answers and links; lab.run.json has what the next run compares.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// The project file
    #[arg(value_name = "FILE", default_value = "lab.toml")]
    file: PathBuf,
    /// Write a project file for the emulated rig instead of running one
    #[arg(long, conflicts_with = "again")]
    example: bool,
    /// Run all steps, also those that are unchanged
    #[arg(long)]
    again: bool,
    /// Replace files that the run did not write, or that were changed since
    #[arg(long)]
    force: bool,
}

/// A run of a project.
struct Run<'a> {
    args: &'a Args,
    ui: &'a Ui,
    /// File with what the steps did.
    state_file: PathBuf,
    state: State,
}

/// A step with its parsed options.
struct Ready {
    step: Step,
    work: Work,
}

/// Runs the command; returns the highest exit status of the steps that `exit-code` asks for.
///
/// # Errors
/// A sentence that names the line and the table at fault.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<u8, CommandError> {
    if args.example {
        refuse_file(&args.file, args.force)?;
        write_whole(&args.file, EXAMPLE.as_bytes())?;
        ui.file(&args.file);
        ui.answer(&format!(
            "{}: the steps for the emulated rig; run them with `rig run {}`.",
            args.file.display(),
            args.file.display()
        ));
        return Ok(0);
    }
    let text = std::fs::read_to_string(&args.file).map_err(|error| {
        CommandError::Sentence(format!(
            "{} cannot be read: {error}; `rig run --example {}` writes a project file to start from.",
            args.file.display(),
            args.file.display()
        ))
    })?;
    let steps = steps(&args.file, &text)?;
    refuse_order(&steps, &args.file)?;
    let ready = steps
        .into_iter()
        .map(parsed)
        .collect::<Result<Vec<_>, _>>()?;
    let name = PathBuf::from(args.file.file_name().unwrap_or(args.file.as_os_str()));
    // The steps find their files as the project file names them.
    if let Some(folder) = args.file.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::env::set_current_dir(folder).map_err(|error| {
            CommandError::Sentence(format!(
                "The folder {} cannot be entered: {error}.",
                folder.display()
            ))
        })?;
        ui.say(&format!(
            "Paths below are relative to {}.",
            folder.display()
        ));
    }
    let state_file = name.with_extension("run.json");
    let is_first = !state_file.exists();
    let page = name.with_extension("html");
    if is_first {
        refuse_file(&page, args.force)?;
    }
    let state = State::load(&state_file)?;
    ui.with_json(state_file.clone(), |ui| {
        let mut run = Run {
            args,
            ui,
            state_file,
            state,
        };
        run.all(&ready, &name, &page)
    })
}

/// Parses the options of a step as the command line does.
fn parsed(step: Step) -> Result<Ready, CommandError> {
    let words = std::iter::once("rig").chain(step.words.iter().map(String::as_str));
    match Words::try_parse_from(words) {
        Ok(Words { work }) => Ok(Ready { step, work }),
        Err(error) => {
            let said = fault(&error);
            let at_fault = (step.options.iter())
                .filter(|option| said.contains(&format!("'--{} ", option.name)))
                .map(|option| format!(" (line {})", option.line));
            let lines: String = at_fault.take(1).collect();
            Err(CommandError::Sentence(format!(
                "{}: {said}{lines}",
                step.place
            )))
        }
    }
}

/// Refuses two steps with one output, and a step that reads what a later one writes.
fn refuse_order(steps: &[Step], file: &Path) -> Result<(), CommandError> {
    for (k, step) in steps.iter().enumerate() {
        for later in &steps[k + 1..] {
            if Path::new(&later.out) == Path::new(&step.out) {
                return Err(CommandError::Sentence(format!(
                    "{}: it writes {}, as [{}] does; name another place with `out`.",
                    later.place, later.out, step.name
                )));
            }
            let reads = (step.options.iter()).find(|option| {
                let texts = option.values.iter().flat_map(|text| text.split(['=', ',']));
                let mut paths = texts.map(Path::new);
                // The name of a joint may be that of a step.
                let is_file = option.values.iter().any(|text| text.contains(['.', '/']));
                option.name != "out" && is_file && paths.any(|path| path.starts_with(&later.out))
            });
            if let Some(option) = reads {
                return Err(CommandError::Sentence(format!(
                    "{}:{}: [{}]: `{}` names what the later step [{}] writes; move that table before this one.",
                    file.display(),
                    option.line,
                    step.name,
                    option.name,
                    later.name
                )));
            }
        }
    }
    Ok(())
}

impl Run<'_> {
    /// Runs all steps and writes the page.
    fn all(&mut self, ready: &[Ready], name: &Path, page: &Path) -> Result<u8, CommandError> {
        for own in ready {
            self.one(own)
                .map_err(|error| CommandError::Sentence(format!("{}: {error}", own.step.place)))?;
        }
        let steps: Vec<Step> = ready.iter().map(|own| own.step.clone()).collect();
        self.state.arrange(&steps);
        self.state.save(&self.state_file)?;
        let done = &self.state.steps;
        rig_report::write(
            page,
            &pages::run(
                &name.display().to_string(),
                &page_steps(done),
                &self.ui.command_line(),
            ),
        )?;
        self.summary();
        self.ui.say(&format!("report: {}", page.display()));
        Ok(done.iter().map(|done| done.status).max().unwrap_or(0))
    }

    /// Runs a step unless it is unchanged.
    fn one(&mut self, Ready { step, work }: &Ready) -> Result<(), CommandError> {
        let ui = self.ui.of_step(&step.words, self.ui.is_verbose());
        let command = ui.command_line();
        // A recording is not made again because the program is a newer one.
        let version = (step.command != "record").then_some(env!("CARGO_PKG_VERSION"));
        let read = inputs(step)?;
        let before = self.state.of(&step.name).cloned();
        let edited = before.as_ref().map(|done| done.edited(&step.out));
        let edited = edited.transpose()?.flatten();
        let why = match &before {
            None => None,
            Some(done) => done
                .change(&command, version, &read)
                .or_else(|| edited.map(|path| format!("{path} was changed since")))
                .or_else(|| self.args.again.then(|| "--again".to_owned())),
        };
        if before.is_some() && why.is_none() {
            self.ui.say(&format!("[{}] unchanged", step.name));
            return Ok(());
        }
        if let (Some(path), false) = (edited, self.args.force) {
            return Err(CommandError::Sentence(format!(
                "{path} was changed since this step wrote it; keep it under another name, or give `rig run --force` to replace it."
            )));
        }
        let why = why.map_or_else(String::new, |why| format!(" ({why})"));
        self.ui.say(&format!("[{}] {command}{why}", step.name));
        let owns = before.as_ref().is_some_and(|done| done.owns(&step.out));
        let begin = Instant::now();
        let there = snapshot(&step.out);
        let status = if owns || self.args.force {
            let words = std::iter::once("rig").chain(step.words.iter().map(String::as_str));
            let forced = Words::try_parse_from(words.chain(["--force"]));
            let forced = forced.map_err(|error| CommandError::Sentence(error.to_string()))?;
            forced.work.run(&ui)?
        } else {
            work.run(&ui)?
        };
        // A recording waits for the link to come to rest; the steps after it end at once.
        interrupts::end_at_once();
        let outputs = written(&step.out, &there)?;
        forget_earlier(before.as_ref(), &step.out, &outputs)?;
        self.state.put(Done {
            name: step.name.clone(),
            command,
            version: version.map(str::to_owned),
            inputs: read,
            outputs,
            answer: ui.answers(),
            status,
        });
        self.state.save(&self.state_file)?;
        self.ui.note(&format!(
            "[{}] done in {:.1} s",
            step.name,
            begin.elapsed().as_secs_f64()
        ));
        Ok(())
    }

    /// Prints the answer of each step and where its report is; of a step without an answer, what it wrote.
    fn summary(&self) {
        self.ui.say("");
        let done = &self.state.steps;
        let width = done.iter().map(|own| own.name.chars().count()).max();
        let width = width.unwrap_or(0);
        for own in done {
            let files = own.outputs.keys();
            let reports = files.clone().filter(|path| path.ends_with(".html"));
            let mut lines: Vec<&String> = own.answer.iter().chain(reports).collect();
            if lines.is_empty() {
                lines.extend(files);
            }
            for (k, line) in lines.into_iter().enumerate() {
                let name = if k == 0 { own.name.as_str() } else { "" };
                self.ui.say(&format!("{name:width$}  {line}"));
            }
        }
    }
}

/// Removes files that an earlier run of a step wrote to this place and the new run did not, so that nobody takes them for its
/// results.
fn forget_earlier(
    before: Option<&Done>,
    out: &str,
    outputs: &BTreeMap<String, String>,
) -> Result<(), CommandError> {
    let earlier = before.into_iter().flat_map(|done| done.outputs.keys());
    let old = earlier.filter(|path| !outputs.contains_key(*path));
    for path in old.map(Path::new).filter(|path| path.starts_with(out)) {
        forget(path)?;
    }
    Ok(())
}

/// Returns the steps as the page has them.
fn page_steps(done: &[Done]) -> Vec<RunStep> {
    let page = |done: &Done| {
        let (mut files, others): (Vec<String>, Vec<String>) =
            (done.outputs.keys().cloned()).partition(|path| path.ends_with(".html"));
        files.extend(others);
        RunStep {
            name: done.name.clone(),
            command: done.command.clone(),
            answer: done.answer.clone(),
            files,
        }
    };
    done.iter().map(page).collect()
}
