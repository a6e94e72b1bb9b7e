//! What these data could not say, what was tried, and what to do next.

use super::{parts, words};
use rig_diagnose::outcome::{Diagnosis, NotTestable, Residual, Tried};
use rig_output::{format_p_value, format_significant};
use rig_report::{self, Block, Column, Section, Table};

/// A longer table is folded.
const LONG: usize = 12;

/// What to do next.
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
            "The rivals' predictions would lie {} standard deviations of the noise apart.",
            format_significant(separation, 2)
        ));
    }
    if let Some(duration) = next.duration {
        items.push(format!("It takes {} s.", format_significant(duration, 2)));
    }
    let mut section = Section::new(
        "next",
        "What to do next",
        "The experiment that would tell the most beyond what these data can.",
    )
    .with(parts::info(format!(
        "{}. {}",
        words::capital(&next.kind),
        next.text
    )));
    if !items.is_empty() {
        section = section.with(Block::List(items));
    }
    Some(match &next.file {
        Some(file) => section.with(Block::Text(format!("{file} lies beside this page."))),
        // What only has to be recorded says how by itself.
        None if names.len() < 2 => section,
        None => section.with(Block::Text(
            "This one needs hands: no motion that the rig could run by itself would do.".into(),
        )),
    })
}

/// An effect that cannot be tested, with every joint for which that holds for the same reason.
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

/// What these data could not have shown.
pub(super) fn limits(found: &Diagnosis) -> Option<Section> {
    if found.not_testable.is_empty() && found.detectable.is_empty() {
        return None;
    }
    let mut section = Section::new(
        "limits",
        "What these data cannot show",
        "Not found is not the same as not there. Some effects these data cannot show, or only where they are large; others would have shown from some size on.",
    );
    if !found.not_testable.is_empty() {
        section = section.with(Block::Table(Table {
            caption: "Not testable".into(),
            columns: vec![
                Column::text("Effect"),
                Column::text("Joint"),
                Column::text("What the data lack"),
                Column::text("What would show it"),
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
            Column::number("At its worst", ""),
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
                    format_significant(d.size, 2),
                    d.size_at_worst.map_or_else(|| "–".to_owned(), |size| format_significant(size, 2)),
                    parts::unit(&d.unit),
                ]
            })
            .collect(),
        note: "A smaller one may be there and would have passed unseen. Of a law with a speed, a period or a time of its own the size is the median over these, and the worst is where this motion shows it least.".into(),
    };
    Some(section.with(folded(
        "The smallest sizes that would have been found",
        table,
    )))
}

/// A long table behind a line that unfolds it.
fn folded(summary: &str, table: Table) -> Block {
    if table.rows.len() <= LONG {
        return Block::Table(table);
    }
    Block::Details {
        summary: format!("{summary} ({} rows)", table.rows.len()),
        blocks: vec![Block::Table(table)],
    }
}

/// Everything that was tried and why it was not taken.
pub(super) fn tried(found: &Diagnosis) -> Option<Section> {
    if found.tried.is_empty() {
        return None;
    }
    let mut section = Section::new(
        "tried",
        "What was tried",
        "In every round each effect of the catalogue was added to the model in turn, fitted to most of the training data and judged on the rest. The best is taken if chance cannot explain it; the others are refused, and this is why.",
    );
    let rounds = found.tried.iter().map(|t| t.step).max().unwrap_or(0);
    for round in 0..=rounds {
        let mut list: Vec<&Tried> = found.tried.iter().filter(|t| t.step == round).collect();
        if list.is_empty() {
            continue;
        }
        list.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let taken = list.iter().any(|t| t.refused.is_empty());
        // Positions are compared piece by piece of recordings, by a test that has no such figure.
        let sigmas = found.residual == Residual::Torque;
        let mut columns = vec![
            Column::text("Effect"),
            Column::text("Joint"),
            Column::number("Takes away", "%"),
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
                "taken".into()
            } else {
                format!("refused: {}", t.refused)
            });
            row
        };
        let table = Table {
            caption: format!(
                "Round {}{}, the largest gain first",
                round + 1,
                if taken { "" } else { ": nothing was taken" }
            ),
            columns,
            rows: list.iter().map(row).collect(),
            note: "Takes away: share of the residual's RMS on stretches that the effect was not fitted to; below zero it makes things worse there.".into(),
        };
        section
            .blocks
            .push(folded(&format!("Round {}", round + 1), table));
    }
    Some(section)
}
