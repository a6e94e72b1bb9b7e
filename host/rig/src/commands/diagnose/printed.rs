//! Terminal output of `rig diagnose`.

use std::path::Path;

use super::super::report_arg::ReportArg;
use super::super::ui::Ui;
use crate::pages;
use rig_diagnose::outcome::{DataFault, Diagnosis, Step, Verdict};
use rig_output::{format_significant, format_unit};

/// Number of lines that answer the question: the verdict, and the sentence that explains it.
const ANSWER: usize = 2;

/// Prints the result in short, and where the report is, in which form.
pub(super) fn print(ui: &Ui, found: &Diagnosis, (report, form): (&Path, ReportArg)) {
    for fault in &found.data_faults {
        ui.warn(&match fault.recording.as_str() {
            recording if fault.text.contains(recording) => fault.text.clone(),
            recording => format!("{recording}: {}", fault.text),
        });
    }
    if found.verdict == Verdict::DataFault {
        let way_on = match found.data_faults.iter().all(DataFault::leaves_rows) {
            true => " Give --even-if-wrong to fit in spite of this.",
            false => "",
        };
        ui.warn(&format!(
            "nothing was fitted; model.toml is the unchanged description.{way_on}"
        ));
    }
    for line in besides(found) {
        ui.detail(&line);
    }
    let more = found.words.len().saturating_sub(1);
    if more > 0 && !ui.is_verbose() {
        ui.say(&format!(
            "({more} further sentences: the report and --verbose have them)"
        ));
    }
    for (k, line) in summary(found).iter().enumerate() {
        match k < ANSWER {
            true => ui.answer(line),
            false => ui.say(line),
        }
    }
    form.tell(report, ui);
}

/// Further sentences of the diagnosis.
fn besides(found: &Diagnosis) -> Vec<String> {
    let sentences = found.words.iter().skip(1);
    let mut lines: Vec<String> = sentences
        .map(|sentence| format!("  - {sentence}"))
        .collect();
    if !lines.is_empty() {
        lines.insert(0, "also:".into());
    }
    lines
}

/// Lines of the short result, verdict and effects first.
fn summary(found: &Diagnosis) -> Vec<String> {
    let mut lines = vec![format!("verdict: {}", pages::verdict(found.verdict))];
    lines.extend(found.words.first().cloned());
    let of_joint = found.waterfall.len() > 1;
    for (k, step) in found.steps.iter().enumerate() {
        lines.push(effect(k + 1, step, of_joint));
        lines.extend(step.parameters.iter().map(|(name, value)| {
            let unit = match value.unit.as_str() {
                "1" => String::new(),
                unit => format!(" {}", format_unit(unit)),
            };
            format!("    {name} = {}", value.said(&unit))
        }));
    }
    if let Some(share) = found.gap_closed {
        let on = if found.steps.iter().any(|step| step.holdout_rms.is_some()) {
            "on the hold-out"
        } else {
            "on the training data (no hold-out was given)"
        };
        let refit = (found.closed_by_effects()).map_or(String::new(), |own| {
            format!(
                ", counted from the given description; the effects close {} % of the gap that remains after the refit",
                format_significant(100.0 * own, 3)
            )
        });
        lines.push(format!(
            "gap closed: {} %, {on}{refit}",
            format_significant(100.0 * share, 3)
        ));
    }
    if let Some(remainder) = &found.remainder {
        lines.push(format!("remainder: {}", remainder.text));
    }
    if let Some(next) = &found.next_experiment {
        lines.push(match (next.separates.as_slice(), &next.file) {
            // The text of an experiment for one effect is long; the report holds it.
            ([one], Some(file)) => {
                format!("next experiment: {file} would make {one} testable; the report says how")
            }
            _ => format!("next experiment: {}", next.text),
        });
    }
    lines
}

/// Describes one step in a line. `of_joint`: the robot has several joints, each with its own gap.
fn effect(number: usize, step: &Step, of_joint: bool) -> String {
    let law = step
        .law
        .as_ref()
        .map_or(String::new(), |law| format!(" ({law})"));
    let rivals: Vec<&str> = step
        .set
        .iter()
        .filter(|name| **name != step.effect)
        .map(String::as_str)
        .collect();
    let open = if rivals.is_empty() {
        String::new()
    } else {
        format!("; equally probable: {}", rivals.join(", "))
    };
    format!(
        "{number}. {}{law} at joint {}, {}{open}",
        step.effect,
        step.joint,
        match (0.0..=1.0).contains(&step.gap_closed) {
            true => format!(
                "closes {} of the remaining gap{}",
                step.fall(),
                if of_joint { " of that joint" } else { "" }
            ),
            false => format!("residual RMS {}", step.fall()),
        },
    )
}

#[cfg(test)]
mod tests;
