//! Limits of the data, effects that were tried, and the next experiment.

use super::words;
use crate::pages::parts;
use rig_diagnose::outcome::{Diagnosis, NotTestable, Residual, Tried};
use rig_output::{capital, format_p_value, format_significant};
use rig_report::{self, Block, Column, Section, Table};

/// Number of rows above which a table is folded.
const LONG: usize = 12;

/// The next experiment.
pub(super) fn next(found: &Diagnosis) -> Option<Section> {
    let next = found.next_experiment.as_ref()?;
    let names: Vec<String> = next
        .separates
        .iter()
        .map(|name| words::name(name))
        .collect();
    let mut items = Vec::new();
    match names.as_slice() {
        [] => {}
        [one] => items.push(format!("It makes {one} testable.")),
        _ => items.push(format!("It separates {}.", rig_output::listed(&names))),
    }
    if let Some(separation) = next.separation {
        items.push(format!(
            "The predictions of the rival effects would differ by {} standard deviations of the noise.",
            format_significant(separation, 2)
        ));
    }
    if let Some(duration) = next.duration {
        items.push(format!("It takes {} s.", format_significant(duration, 2)));
    }
    let mut section = Section::new(
        "next",
        "Next experiment",
        "The experiment that adds the most information to these data.",
    )
    .with(parts::info(format!(
        "{}. {}",
        capital(&next.kind.to_string()),
        next.text
    )));
    if !items.is_empty() {
        section = section.with(Block::List(items));
    }
    Some(match &next.file {
        Some(file) => section.with(Block::Text(format!("{file} is in the folder of this page."))),
        // The text of the experiment says how to record it.
        None if names.len() < 2 => section,
        None => section.with(Block::Text(
            "This experiment must be done by hand: no motion that the rig can run by itself replaces it.".into(),
        )),
    })
}

/// Groups effects that cannot be tested: one entry for all joints with the same reason.
pub(super) fn grouped(list: &[NotTestable]) -> Vec<(&NotTestable, Vec<String>)> {
    let mut groups: Vec<(&NotTestable, Vec<String>)> = Vec::new();
    for item in list {
        let same = groups.iter_mut().find(|(first, _)| {
            (&first.effect, &first.why, &first.experiment)
                == (&item.effect, &item.why, &item.experiment)
        });
        match same {
            Some((_, joints)) => joints.push(item.joint.clone()),
            None => groups.push((item, vec![item.joint.clone()])),
        }
    }
    groups
}

/// Effects that these data cannot show.
pub(super) fn limits(found: &Diagnosis) -> Option<Section> {
    if found.not_testable.is_empty() && found.detectable.is_empty() {
        return None;
    }
    let mut section = Section::new(
        "limits",
        "Limits of detection",
        "An effect that was not found may still be present. These data cannot show some effects at all, and show others only above a certain size.",
    );
    if !found.not_testable.is_empty() {
        section = section.with(Block::Table(Table {
            caption: "Not testable".into(),
            columns: vec![
                Column::text("Effect"),
                Column::text("Joint"),
                Column::text("What the data lack"),
                Column::text("Experiment that would show it"),
            ],
            rows: grouped(&found.not_testable)
                .into_iter()
                .map(|(item, joints)| {
                    vec![
                        words::name(&item.effect),
                        words::or_dash(&joints.join(", ")),
                        item.why.clone(),
                        item.experiment.clone(),
                    ]
                })
                .collect(),
            note: String::new(),
        }));
    }
    if found.detectable.is_empty() {
        return Some(section);
    }
    let table = Table {
        caption: "Tested and not found: the smallest size that would have been found".into(),
        columns: vec![
            Column::text("Effect"),
            Column::text("Joint"),
            Column::text("Size of"),
            Column::number("Smallest", ""),
            Column::number("Worst case", ""),
            Column::text("Unit"),
        ],
        rows: found
            .detectable
            .iter()
            .map(|d| {
                vec![
                    words::name(&d.effect),
                    words::or_dash(&d.joint),
                    d.parameter.clone(),
                    size(d.size),
                    d.size_at_worst.map_or_else(|| "–".to_owned(), size),
                    parts::unit(&d.unit),
                ]
            })
            .collect(),
        note: "A smaller effect may be present without being found. If a law has a speed, a period or a time as parameter, the smallest size is the median over its values, and the worst case is the value that this motion shows least; at \"not seen\" nothing up to the joint's largest torque would show.".into(),
    };
    Some(section.with(folded(
        "The smallest sizes that would have been found",
        table,
    )))
}

/// Returns the text of a smallest size.
fn size(value: f64) -> String {
    match value.is_finite() {
        true => format_significant(value, 2),
        false => "not seen".to_owned(),
    }
}

/// Folds a long table behind a summary line.
fn folded(summary: &str, table: Table) -> Block {
    if table.rows.len() <= LONG {
        return Block::Table(table);
    }
    Block::Details {
        summary: format!("{summary} ({} rows)", table.rows.len()),
        blocks: vec![Block::Table(table)],
    }
}

/// All effects that were tried, with the reason why they were refused.
pub(super) fn tried(found: &Diagnosis) -> Option<Section> {
    if found.tried.is_empty() {
        return None;
    }
    let mut section = Section::new(
        "tried",
        "Effects that were tried",
        "In every round each effect of the catalogue was added to the model in turn, fitted to most of the training data and judged on the rest. The best effect is accepted if chance cannot explain its gain. The tables give the reason why the others were refused.",
    );
    let rounds = found.tried.iter().map(|t| t.step).max().unwrap_or(0);
    for round in 0..=rounds {
        let mut list: Vec<&Tried> = found.tried.iter().filter(|t| t.step == round).collect();
        if list.is_empty() {
            continue;
        }
        list.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let taken = list.iter().any(|t| t.refused.is_empty());
        // The test for positions compares pieces of recordings and gives no such figure.
        let sigmas = found.residual == Residual::Torque;
        let mut columns = vec![
            Column::text("Effect"),
            Column::text("Joint"),
            Column::number("Reduction", "%"),
        ];
        if sigmas {
            columns.push(Column::number("Gain over its std", ""));
        }
        columns.extend([Column::number("p", ""), Column::text("Outcome")]);
        let row = |t: &&Tried| {
            let mut row = vec![
                words::name(&t.effect),
                words::or_dash(&t.joint),
                parts::percent(t.gain),
            ];
            if sigmas {
                row.push(format_significant(t.gain_sigmas, 2));
            }
            row.push(format_p_value(t.p_value));
            row.push(if t.refused.is_empty() {
                "accepted".into()
            } else {
                format!("refused: {}", t.refused)
            });
            row
        };
        let table = Table {
            caption: format!(
                "Round {}{}, largest reduction first",
                round + 1,
                if taken { "" } else { ": no effect was accepted" }
            ),
            columns,
            rows: list.iter().map(row).collect(),
            note: "Reduction: share by which the effect reduces the residual's RMS on stretches that it was not fitted to; a negative value means a larger residual.".into(),
        };
        section
            .blocks
            .push(folded(&format!("Round {}", round + 1), table));
    }
    Some(section)
}
