//! What the identified model lacks, in short.

use super::super::verdict;
use rig_diagnose::outcome::Diagnosis;
use rig_output::format_p_value;
use rig_report::{Block, Column, Section, Table};

/// The diagnosis on the page of the demonstration.
pub(super) fn section(found: &Diagnosis) -> Section {
    let mut section = Section::new(
        "missing",
        "What the identified model lacks",
        "The same recordings with the excitation run a second time: what does not repeat is noise, and what repeats without being predicted is missing in the model. diagnosis.html has the whole of it.",
    )
    .with(Block::List(
        std::iter::once(format!("Verdict: {}.", verdict(found.verdict)))
            .chain(found.words.iter().cloned())
            .collect(),
    ));
    if !found.steps.is_empty() {
        section = section.with(Block::Table(Table {
            caption: "Effects that were found".into(),
            columns: vec![
                Column::text("Effect"),
                Column::text("Names that fit as well"),
                Column::text("Gap closed"),
                Column::number("p", ""),
            ],
            rows: (found.steps.iter())
                .map(|step| {
                    let others: Vec<&str> = (step.set.iter())
                        .filter(|name| **name != step.effect)
                        .map(String::as_str)
                        .collect();
                    vec![
                        step.effect.clone(),
                        others.join(", "),
                        step.fall(),
                        format_p_value(step.p_value),
                    ]
                })
                .collect(),
            note: String::new(),
        }));
    }
    section
}
