//! The page of a run: what each step of a project answered, and where its files are.

use super::parts;
use rig_report::{Block, Document, Link, Section};

/// A step of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunStep {
    /// Name in the project file.
    pub name: String,
    /// The command line.
    pub command: String,
    /// The short answer, in lines.
    pub answer: Vec<String>,
    /// Written files, the report first; relative to the page.
    pub files: Vec<String>,
}

/// Number of files of a step that are visible at once; further ones unfold.
const VISIBLE: usize = 4;

/// Composes the page. `project`: name of the project file. `command`: what repeats the run.
pub fn run(project: &str, steps: &[RunStep], command: &str) -> Document {
    let sections = steps.iter().enumerate().map(|(k, step)| {
        let mut section = Section::new(format!("step-{}", k + 1), step.name.clone(), String::new());
        if !step.answer.is_empty() {
            section = section.with(Block::List(step.answer.clone()));
        }
        let links = |files: &[String]| {
            let link = |file: &String| Link {
                text: file.clone(),
                address: file.clone(),
            };
            Block::Links(files.iter().map(link).collect())
        };
        let (first, rest) = step.files.split_at(step.files.len().min(VISIBLE));
        if !first.is_empty() {
            section = section.with(links(first));
        }
        if !rest.is_empty() {
            section = section.with(Block::Details {
                summary: format!("{} more files", rest.len()),
                blocks: vec![links(rest)],
            });
        }
        section.with(Block::Code(step.command.clone()))
    });
    Document {
        title: format!("{project}: results"),
        subtitle: format!(
            "{} steps, in the order in which they ran",
            parts::count(steps.len() as u64)
        ),
        summary: Vec::new(),
        sections: sections.collect(),
        footer: format!("rig {} · {command}", env!("CARGO_PKG_VERSION")),
    }
}
