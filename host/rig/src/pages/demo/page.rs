//! The page as a whole: its sections in their order, the short facts and the short sections.

use super::figures::DemoFigures;
use super::{missing, online, parameters, tracking};
use crate::pages::{friction, parts, residuals};
use rig_model::robot::JointKind;
use rig_output::format_significant;
use rig_report::{Block, Column, Document, Fact, NoteKind, Section, Table, Tone};

/// Composes the page of the demonstration.
pub fn demo(figures: &DemoFigures) -> Document {
    let mut sections: Vec<Section> = Vec::new();
    sections.extend(parts::warnings(&[&figures.warnings]));
    sections.push(parameters::section(figures));
    sections.push(tracking::section(figures));
    sections.push(online::section(figures));
    sections.push(holdout(figures));
    sections.push(friction(figures));
    sections.push(wire(figures));
    sections.extend(figures.diagnosis.as_ref().map(missing::section));
    sections.push(beyond(figures));
    let mut repeat =
        Section::new("repeat", "Command", "").with(Block::Code(figures.command.clone()));
    if !figures.files.is_empty() {
        repeat = repeat.with(Block::Table(Table {
            caption: "Files beside this page".into(),
            columns: vec![Column::text("File"), Column::text("Holds")],
            rows: figures
                .files
                .iter()
                .map(|(name, what)| vec![name.clone(), what.clone()])
                .collect(),
            note: String::new(),
        }));
    }
    sections.push(repeat);
    Document {
        title: "One geared link, identified and precompensated".into(),
        subtitle: format!(
            "No hardware was used. The logic of the firmware drove an emulated rig, {}. Its telemetry, {} s in all, passed through the real wire protocol, and from it this program estimated the dynamics of the link. The rig has effects that the model lacks, so the estimates are tested against a more complex truth.",
            figures.robot.name,
            format_significant(figures.seconds, 3)
        ),
        summary: summary(figures),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), figures.command),
    }
}

fn summary(figures: &DemoFigures) -> Vec<Fact> {
    let total = figures.parameters.len();
    let covered = figures
        .parameters
        .iter()
        .filter(|p| p.differential.covers(p.truth))
        .count();
    let mut facts = vec![
        Fact::new(
            "True values within their 95 % intervals",
            format!("{covered} of {total}"),
        )
        .note("off-line, differential model")
        // One interval of twenty is expected to miss. More than one miss of six is unlikely to be chance.
        .tone(if covered + 1 >= total {
            Tone::Good
        } else {
            Tone::Warning
        }),
    ];
    for t in &figures.tracking {
        if let Some(factor) = tracking::gain(t) {
            facts.push(
                Fact::new(
                    format!("Tracking error, {}", t.motion),
                    tracking::times(factor),
                )
                .note(format!(
                    "RMS {} → {} {} with precompensation",
                    format_significant(t.rms_without, 2),
                    format_significant(t.rms_with, 2),
                    parts::unit(&t.unit)
                ))
                .tone(if factor > 1.0 {
                    Tone::Good
                } else {
                    Tone::Warning
                }),
            );
        }
    }
    for report in &figures.holdout {
        facts.push(
            Fact::new(
                "Torque residual on the hold-out",
                parts::percent(report.relative_error),
            )
            .unit("%")
            .note("residual RMS over torque RMS"),
        );
    }
    facts.push(
        Fact::new("Samples lost on the wire", parts::count(figures.wire.lost))
            .note(format!(
                "of {}",
                parts::count(figures.wire.received + figures.wire.lost)
            ))
            .tone(if figures.wire.lost == 0 {
                Tone::Good
            } else {
                Tone::Warning
            }),
    );
    facts
}

fn holdout(figures: &DemoFigures) -> Section {
    let mut section = Section::new(
        "holdout",
        "Prediction of the hold-out",
        "Torque of a motion not used in the fit, predicted with the identified parameters.",
    );
    for (joint, report) in figures.robot.joints.iter().zip(&figures.holdout) {
        section
            .blocks
            .extend(residuals::torque_plots(joint, report, "hold-out"));
    }
    if figures.holdout.is_empty() {
        section = section.with(parts::warning("There is no hold-out."));
    }
    section
}

fn friction(figures: &DemoFigures) -> Section {
    let section = Section::new(
        "friction",
        "Friction over velocity",
        "Friction on stretches of constant speed; gravity and inertia are subtracted.",
    );
    match &figures.friction {
        Some(map) => {
            let kind = figures
                .robot
                .joints
                .first()
                .map_or(JointKind::Revolute, |j| j.kind);
            Section {
                blocks: friction::friction(kind, map),
                ..section
            }
        }
        None => section.with(parts::warning(figures.friction_text.clone())),
    }
}

fn wire(figures: &DemoFigures) -> Section {
    let kind = if figures.wire.lost == 0 {
        NoteKind::Good
    } else {
        NoteKind::Warning
    };
    Section::new("wire", "Communication between firmware and host", "").with(Block::Note {
        kind,
        text: figures.wire.text.clone(),
    })
}

fn beyond(figures: &DemoFigures) -> Section {
    let section = Section::new(
        "beyond",
        "Effects of the emulated rig that the model lacks",
        "These effects make the test realistic: the rig shares no equation with the fitted model.",
    );
    if figures.beyond_model.is_empty() {
        return section.with(parts::info(
            "No effect beyond the model was switched on in this run.",
        ));
    }
    section.with(Block::List(figures.beyond_model.clone()))
}
