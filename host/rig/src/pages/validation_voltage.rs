//! The page of a validation under voltage.

use super::context::Context;
use super::parts;
use rig_diagnose::voltage::FreeRun;
use rig_diagnose::voltage::{DrivenBy, VoltageChecked, VoltageValidation};
use rig_report::{Axis, Block, Column, Document, Fact, Plot, Role, Section, Series, Table, Tone};

/// Composes the page of a validation under voltage.
pub fn validation_voltage(found: &VoltageValidation, context: &Context) -> Document {
    let mut sections: Vec<Section> = parts::warnings(&[&context.warnings, &found.warnings])
        .into_iter()
        .collect();
    sections.push(overview(found));
    for (k, checked) in found.recordings.iter().enumerate() {
        sections.push(motion(found, checked, k));
    }
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: validation", found.robot),
        subtitle: "Motion predicted by the description under voltage for these recordings; no parameter was changed.".into(),
        summary: summary(found),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

/// Formats RMS, mean absolute and largest error of a run; dashes if it diverged.
fn errors(run: &FreeRun, unit: &str) -> [String; 3] {
    match run {
        FreeRun::Followed {
            rms,
            mean_absolute,
            max,
        } => [*rms, *mean_absolute, *max].map(|error| parts::length(error, unit)),
        FreeRun::Diverged { .. } => [const { String::new() }; 3].map(|_| "–".to_owned()),
    }
}

fn summary(found: &VoltageValidation) -> Vec<Fact> {
    let fact = match &found.motion {
        FreeRun::Followed { .. } => {
            let [rms, mean, _] = errors(&found.motion, &found.position_unit);
            vec![
                Fact::new("Position error, RMS", rms).note("free run over all recordings"),
                Fact::new("Position error, mean absolute", mean)
                    .note("free run over all recordings"),
            ]
        }
        FreeRun::Diverged { .. } => vec![
            Fact::new("Free run", "diverges")
                .note("the warnings say where and why")
                .tone(Tone::Warning),
        ],
    };
    let closed = (found.recordings.iter())
        .filter(|checked| matches!(checked.driven, DrivenBy::Controller { .. }))
        .count();
    let all = found.recordings.len();
    let loops = Fact::new("Closed loop", format!("{closed} of {all}"))
        .note("recordings whose controller was identified; the recorded voltage drives the others");
    fact.into_iter().chain([loops]).collect()
}

fn overview(found: &VoltageValidation) -> Section {
    let rows = (found.recordings.iter())
        .map(|checked| {
            let [rms, mean, max] = errors(&checked.motion, &found.position_unit);
            let driven = match &checked.driven {
                DrivenBy::Controller { .. } => "controller",
                DrivenBy::RecordedVoltage => "recorded voltage",
            };
            vec![checked.recording.clone(), driven.to_owned(), rms, mean, max]
        })
        .collect();
    Section::new(
        "overview",
        "Overview",
        "Each recording is simulated from its first state for 10 s at most, without using the measured motion. In the closed loop, the controller identified from the recording follows the recorded reference.",
    )
    .with(Block::Table(Table {
        caption: "Simulated less measured position".into(),
        columns: vec![
            Column::text("Recording"),
            Column::text("Driven by"),
            Column::number("RMS", ""),
            Column::number("mean absolute", ""),
            Column::number("largest", ""),
        ],
        rows,
        note: "A dash: the free run diverged; a warning says where and why.".into(),
    }))
}

fn motion(found: &VoltageValidation, checked: &VoltageChecked, k: usize) -> Section {
    let name = &checked.recording;
    let until = checked.simulated.len();
    let plot = Plot::new(
        format!("Joint {}: position, measured and simulated", found.joint),
        Axis::new("time", "s"),
        Axis::new("position", &found.position_unit),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        checked.t.clone(),
        checked.measured.clone(),
    ))
    .with(
        Series::line(
            "simulated",
            Role::Model,
            checked.t[..until].to_vec(),
            checked.simulated.clone(),
        )
        .dashed(),
    )
    .note(format!("n = {}.", parts::count(checked.rows as u64)));
    Section::new(format!("motion-{}", k + 1), format!("Motion: {name}"), "").with(Block::Plot(plot))
}
