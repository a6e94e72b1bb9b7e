//! The page of a diagnosis: the verdict first, then what it rests on.

mod curves;
mod gap;
mod left;
mod limits;
mod pictures;
mod steps;
#[cfg(test)]
mod tests;
mod treated;
mod words;

use super::{Context, parts};
pub use pictures::{NAMES as PICTURE_NAMES, pictures};
pub use words::verdict;

use rig_diagnose::outcome::{Diagnosis, Remainder, Verdict};
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
        title: format!("{}: what the model lacks", found.robot),
        subtitle: words::meaning(found.verdict).into(),
        summary: summary(found),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

/// Whether figures on a hold-out stand beside those on the training recordings.
fn held_out(found: &Diagnosis) -> bool {
    found.waterfall.iter().any(|w| !w.holdout.is_empty())
}

/// RMS of the last model over the noise floor, worst joint; on the hold-out where there is one.
fn left_over(found: &Diagnosis) -> Option<f64> {
    found
        .waterfall
        .iter()
        .filter_map(|w| {
            let rms = w.holdout.last().or(w.train.last())?;
            // A run that diverged has no residual.
            (w.floor > 0.0 && !rms.is_nan()).then(|| rms / w.judged_floor())
        })
        .reduce(f64::max)
}

fn summary(found: &Diagnosis) -> Vec<Fact> {
    let judged = if held_out(found) {
        "on data held back"
    } else {
        "on the training data; no data were held back"
    };
    let mut facts =
        vec![Fact::new("Verdict", words::verdict(found.verdict)).tone(words::tone(found.verdict))];
    if found.verdict == Verdict::DataFault {
        facts.push(
            Fact::new("Faults in the data", found.data_faults.len().to_string())
                .note("mend them and run the diagnosis again")
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
                "; counted from the description as it stands, the effects close {} % of what fitting it again leaves",
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
    if let Some(ratio) = left_over(found) {
        facts.push(
            Fact::new("Left at the end", format_significant(ratio, 3))
                .unit("× noise floor")
                .note(format!("worst joint, {judged}; 1 is nothing but noise")),
        );
    }
    if let ([floor], [joint]) = (found.noise_floor_rms.as_slice(), found.waterfall.as_slice()) {
        let shown = words::shown(found, &joint.unit);
        facts.push(match floor.is_nan() {
            true => Fact::new("Noise floor", "not known")
                .note("record one motion twice to have it")
                .tone(Tone::Warning),
            false => Fact::new("Noise floor", shown.number(*floor))
                .unit(shown.unit)
                .note("RMS of what no model can predict"),
        });
    }
    if !found.not_testable.is_empty() {
        facts.push(
            Fact::new(
                "Not testable",
                words::several(limits::grouped(&found.not_testable).len(), "effect"),
            )
            .note("these data cannot exclude them"),
        );
    }
    facts
}

fn opening(found: &Diagnosis) -> Section {
    let mut section = Section::new("verdict", "The verdict", "").with(Block::Note {
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
        caption: "What was found, in this order".into(),
        columns: vec![
            Column::text("Effect"),
            Column::text("Joint"),
            Column::text("Gap closed"),
            Column::number("p", ""),
            Column::text("Certain of the name?"),
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
                        0 if doubted(found, &step.joint) => "see what is left".into(),
                        0 if values_alike(found, step).is_some() => {
                            "no: values of the description as good".into()
                        }
                        0 if found.is_certain(step) => "yes".into(),
                        0 if step.name_probability.is_finite() && found.left.iter().all(|l| l.joint != step.joint || l.explained) => {
                            format!("no: probability {}", format_significant(step.name_probability, 2))
                        }
                        0 => "see what is left".into(),
                        n => format!("no: {} as good", words::several(n, "other name")),
                    },
                ]
            })
            .collect(),
        note: "Gap: what the residual's RMS lies above the noise floor; where no floor is known, the RMS before and after. p: how often chance alone would look like this, corrected for all that was tried.".into(),
    }))
}

/// Whether what is left of a joint leaves it open that one of its names stands in for something else.
fn doubted(found: &Diagnosis, joint: &str) -> bool {
    let speaks = |left: &Remainder| left.joint == joint && left.doubt && !left.of_a_voltage();
    found.remainder.as_ref().is_some_and(speaks)
}

fn faults(found: &Diagnosis) -> Option<Section> {
    if found.data_faults.is_empty() {
        return None;
    }
    Some(
        Section::new(
            "faults",
            "What is wrong with the data",
            if found.verdict == Verdict::DataFault {
                "A certain fault cannot come from any robot that the description fits. A fit of such data would only bend parameters: mend the recording first. An open fault has another explanation that predicts the data as well."
            } else if found.data_faults.iter().any(|fault| fault.certain) {
                "A certain fault cannot come from any robot that the description fits. The recordings were fitted all the same, as asked for: any number on this page may be bent by it. An open fault has another explanation that predicts the data as well."
            } else {
                "Each of these has another explanation that predicts the data as well, so the recordings were fitted as they are. Check them: a fault would bend the numbers on this page."
            },
        )
        .with(Block::Table(Table {
            caption: "Faults".into(),
            columns: vec![
                Column::text("Kind"),
                Column::text("Recording"),
                Column::text("Joint"),
                Column::text("Certain"),
                Column::text("What is wrong, and what would be right"),
            ],
            rows: found
                .data_faults
                .iter()
                .map(|fault| {
                    vec![
                        fault.kind.clone(),
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
