//! Parts that several pages share.

pub(super) use rig_output::format_unit as unit;

use super::context::Context;
use rig_model::robot::JointKind;
use rig_output::format_significant;
use rig_report::{Block, Fact, NoteKind, Section, Tone};

/// Returns "torque" or "force".
pub(super) fn effort(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "torque",
        JointKind::Prismatic => "force",
    }
}

/// Units of position, velocity and torque.
pub(super) fn units(kind: JointKind) -> [&'static str; 3] {
    match kind {
        JointKind::Revolute => ["rad", "rad/s", "N·m"],
        JointKind::Prismatic => ["m", "m/s", "N"],
    }
}

/// Unit of viscous friction.
pub(super) fn viscous_unit(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "N·m·s/rad",
        JointKind::Prismatic => "N·s/m",
    }
}

/// Formats a whole number with thin spaces between thousands.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(c);
    }
    text
}

/// Formats a share in per cent, with two digits below 10 % and three above.
pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    format_significant(value, if value.abs() < 10.0 { 2 } else { 3 })
}

/// Half the width of an interval.
pub(super) fn half(interval: [f64; 2]) -> f64 {
    0.5 * (interval[1] - interval[0])
}

/// Formats a small length or angle with a suitable unit prefix.
pub(super) fn length(value: f64, unit: &str) -> String {
    let (scale, prefix) = if value < 1e-6 {
        (1e9, "n")
    } else if value < 1e-3 {
        (1e6, "µ")
    } else if value < 1.0 {
        (1e3, "m")
    } else {
        (1.0, "")
    };
    format!("{} {prefix}{unit}", format_significant(scale * value, 3))
}

pub(super) fn warning(text: impl Into<String>) -> Block {
    Block::Note {
        kind: NoteKind::Warning,
        text: text.into(),
    }
}

pub(super) fn info(text: impl Into<String>) -> Block {
    Block::Note {
        kind: NoteKind::Info,
        text: text.into(),
    }
}

/// Returns the section of all warnings; none if there are no warnings.
pub(super) fn warnings(groups: &[&[String]]) -> Option<Section> {
    let blocks: Vec<Block> = groups.iter().copied().flatten().map(warning).collect();
    (!blocks.is_empty()).then(|| Section {
        id: "warnings".into(),
        title: "Read this first".into(),
        lead: String::new(),
        blocks,
    })
}

/// Returns the fact of the number of warnings.
pub(super) fn warning_count(warnings: usize) -> Fact {
    if warnings == 0 {
        Fact::new("Warnings", "none").tone(Tone::Good)
    } else {
        Fact::new("Warnings", warnings.to_string())
            .note("at the top of the page")
            .tone(Tone::Warning)
    }
}

/// The command that repeats the result, and the description that was written.
pub(super) fn repeat(context: &Context) -> Section {
    let mut section =
        Section::new("repeat", "How to repeat this", "").with(Block::Code(context.command.clone()));
    if let Some((name, text)) = &context.identified {
        if !context.remarks.is_empty() {
            section = section.with(Block::List(context.remarks.clone()));
        }
        section = section.with(Block::Details {
            summary: format!("The identified description, {name}"),
            blocks: vec![Block::Code(text.clone())],
        });
    }
    section
}
