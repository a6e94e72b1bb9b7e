//! Short diagnosis of the identified model.

use crate::pages::diagnosis::verdict;
use rig_diagnose::outcome::Diagnosis;
use rig_output::format_p_value;
use rig_report::{Block, Column, Section, Table};

/// Composes the diagnosis on the page of the demonstration.
pub(super) fn section(found: &Diagnosis) -> Section {
    let mut section = Section::new(
        "missing",
        "Diagnosis of the identified model",
        "The diagnosis uses the same recordings and a second run of the excitation. The difference between the runs is noise; a repeatable residual shows that the model lacks an effect. diagnosis.html has all details.",
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
                Column::text("Names that fit equally well"),
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
