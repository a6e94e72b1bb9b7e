//! The page as a whole: its sections in their order, the short facts, the opening and the faults in the data.

use super::{curves, gap, left, limits, steps, treated, words};
use crate::pages::context::Context;
use crate::pages::parts;
use rig_diagnose::outcome::{Diagnosis, Verdict};
use rig_diagnose::values_alike;
use rig_output::{format_p_value, format_significant};
use rig_report::{Block, Column, Document, Fact, Section, Table, Tone};

/// Composes the page of a diagnosis.
pub fn diagnosis(found: &Diagnosis, context: &Context) -> Document {
    let mut sections = vec![opening(found)];
    sections.extend(faults(found));
    sections.extend(parts::warnings(&[&context.warnings]));
    sections.extend(gap::waterfall(found));
    sections.extend(left::sizes(found));
    sections.extend(gap::places(found));
    sections.extend((0..found.steps.len()).map(|k| steps::section(found, k)));
    sections.extend(curves::section(found));
    sections.extend(left::absorbed(found));
    sections.extend(left::by_motion(found));
    sections.extend(left::remainder(found));
    sections.extend(limits::next(found));
    sections.extend(limits::limits(found));
    sections.extend(limits::tried(found));
    sections.extend(treated::section(found));
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: diagnosis of the model", found.robot),
        subtitle: words::meaning(found.verdict).into(),
        summary: summary(found),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn summary(found: &Diagnosis) -> Vec<Fact> {
    let judged = if gap::held_out(found) {
        "on the hold-out"
    } else {
        "on the training data; no hold-out was given"
    };
    let mut facts =
        vec![Fact::new("Verdict", words::verdict(found.verdict)).tone(words::tone(found.verdict))];
    if found.verdict == Verdict::DataFault {
        facts.push(
            Fact::new("Faults in the data", found.data_faults.len().to_string())
                .note("correct them and run the diagnosis again")
                .tone(Tone::Fault),
        );
        return facts;
    }
    if !found.steps.is_empty() {
        let names: Vec<String> = found
            .steps
            .iter()
            .map(|s| {
                format!(
                    "{} ({})",
                    words::title(&s.effect, s.law.as_deref()),
                    s.joint
                )
            })
            .collect();
        facts
            .push(Fact::new("Found", words::several(names.len(), "effect")).note(names.join("; ")));
    }
    if let Some(share) = found.gap_closed {
        let refit = (found.closed_by_effects()).map_or(String::new(), |own| {
            format!(
                "; counted from the given description; the effects close {} % of the gap that remains after the refit",
                parts::percent(own)
            )
        });
        facts.push(
            Fact::new("Gap closed", parts::percent(share))
                .unit("%")
                .note(format!(
                    "of the residual above the noise floor, {judged}{refit}"
                )),
        );
    }
    if let Some(ratio) = gap::left_over(found) {
        facts.push(
            Fact::new("Final residual", format_significant(ratio, 3))
                .unit("× noise floor")
                .note(format!("worst joint, {judged}; 1 means noise only")),
        );
    }
    if let ([floor], [joint]) = (found.noise_floor_rms.as_slice(), found.waterfall.as_slice()) {
        let shown = words::shown(found, &joint.unit);
        facts.push(match floor.is_nan() {
            true => Fact::new("Noise floor", "not known")
                .note("record one motion twice to measure it")
                .tone(Tone::Warning),
            false => Fact::new("Noise floor", shown.number(*floor))
                .unit(shown.unit)
                .note("RMS of the part that no model can predict"),
        });
    }
    if !found.not_testable.is_empty() {
        facts.push(
            Fact::new(
                "Not testable",
                words::several(limits::grouped(&found.not_testable).len(), "effect"),
            )
            .note("these data can neither show nor exclude them"),
        );
    }
    facts
}

fn opening(found: &Diagnosis) -> Section {
    let mut section = Section::new("verdict", "Verdict", "").with(Block::Note {
        kind: words::note(found.verdict),
        text: format!(
            "{}. {}",
            words::verdict(found.verdict),
            words::meaning(found.verdict)
        ),
    });
    if !found.words.is_empty() {
        section = section.with(Block::Text(found.words.join("\n\n")));
    }
    if found.steps.is_empty() {
        return section;
    }
    section.with(Block::Table(Table {
        caption: "Effects in the order in which they were found".into(),
        columns: vec![
            Column::text("Effect"),
            Column::text("Joint"),
            Column::text("Gap closed"),
            Column::number("p", ""),
            Column::text("Is the name certain?"),
        ],
        rows: found
            .steps
            .iter()
            .map(|step| {
                vec![
                    words::title(&step.effect, step.law.as_deref()),
                    step.joint.clone(),
                    step.fall(),
                    format_p_value(step.p_value),
                    match words::rivals(step).len() {
                        0 if left::doubted(found, &step.joint) => "see the unexplained residual".into(),
                        0 if values_alike(found, step).is_some() => {
                            "no: other values in the description explain it as well".into()
                        }
                        0 if found.is_certain(step) => "yes".into(),
                        0 if step.name_probability.is_finite() && found.left.iter().all(|l| l.joint != step.joint || l.explained) => {
                            format!("no: probability {}", format_significant(step.name_probability, 2))
                        }
                        0 => "see the unexplained residual".into(),
                        n => format!("no: {} equally good", words::several(n, "other name")),
                    },
                ]
            })
            .collect(),
        note: "Gap: difference between the residual's RMS and the noise floor. If no floor is known, the column gives the RMS before and after. p: probability that chance alone gives such a reduction, corrected for all tests.".into(),
    }))
}

fn faults(found: &Diagnosis) -> Option<Section> {
    if found.data_faults.is_empty() {
        return None;
    }
    Some(
        Section::new(
            "faults",
            "Faults in the data",
            if found.verdict == Verdict::DataFault {
                "No robot that matches the description can cause a certain fault. A fit of such data gives wrong parameters: correct the recording first. An open fault has another explanation that predicts the data equally well."
            } else if found.data_faults.iter().any(|fault| fault.certain) {
                "No robot that matches the description can cause a certain fault. The recordings were fitted in spite of it, as requested: any number on this page may be wrong. An open fault has another explanation that predicts the data equally well."
            } else {
                "Each of these faults has another explanation that predicts the data equally well, so the recordings were fitted unchanged. Check them: a real fault makes the numbers on this page wrong."
            },
        )
        .with(Block::Table(Table {
            caption: "Faults".into(),
            columns: vec![
                Column::text("Kind"),
                Column::text("Recording"),
                Column::text("Joint"),
                Column::text("Certain"),
                Column::text("Fault and correction"),
            ],
            rows: found
                .data_faults
                .iter()
                .map(|fault| {
                    vec![
                        fault.kind.to_string(),
                        words::or_dash(&fault.recording),
                        words::or_dash(&fault.joint),
                        if fault.certain { "yes" } else { "open" }.into(),
                        fault.text.clone(),
                    ]
                })
                .collect(),
            note: String::new(),
        })),
    )
}
