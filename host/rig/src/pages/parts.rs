//! Parts that several pages share.

pub(super) use rig_output::format_unit as unit;

use super::context::Context;
use rig_model::robot::JointKind;
use rig_output::format_significant;
use rig_report::{Axis, Block, Fact, NoteKind, Plot, Role, Section, Series, Style, Tone};

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

/// Number of letters that fit below the axis of a figure in a narrow window.
pub(super) const ROOM: usize = 48;

/// Draws bars of all joints side by side. Where the names of the joints do not fit below the axis, they are numbers there,
/// and the caption has the names.
pub(super) fn joint_bars(
    title: &str,
    joints: &[&str],
    y: Axis,
    bars: Vec<(&str, Role, Vec<f64>)>,
    note: &str,
) -> Plot {
    let longest = joints.iter().map(|n| n.chars().count()).max();
    let (names, caption) = if longest.unwrap_or(0) * joints.len() <= ROOM {
        (
            joints.iter().map(|n| (*n).to_owned()).collect(),
            String::new(),
        )
    } else {
        let numbered = joints.iter().enumerate();
        let list: Vec<String> = numbered.map(|(k, n)| format!("{} {n}", k + 1)).collect();
        let numbers = (1..=joints.len()).map(|k| k.to_string()).collect();
        (numbers, format!(" Joints: {}.", list.join(", ")))
    };
    let places: Vec<f64> = (0..joints.len()).map(|k| k as f64).collect();
    let mut plot = Plot::new(title.to_owned(), Axis::categories("joint", names), y);
    for (name, role, values) in bars {
        plot = plot.with(Series::new(name, role, Style::Bars, places.clone(), values));
    }
    plot.height = 240;
    plot.note(format!("{note}{caption}"))
}

/// Returns the blocks about one joint of `joints`: folded if there are several.
pub(super) fn of_joint(name: &str, joints: usize, what: &str, blocks: Vec<Block>) -> Vec<Block> {
    if joints == 1 || blocks.is_empty() {
        return blocks;
    }
    vec![Block::Details {
        summary: format!("Joint {name}: {what}"),
        blocks,
    }]
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
        title: "Warnings".into(),
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

/// Returns what the names of parameters mean, folded.
pub(super) fn names_of_parameters() -> Block {
    Block::Details {
        summary: "What the names mean".into(),
        blocks: vec![Block::List(
            [
                "m2: mass of link 2; mx2, my2, mz2: that mass times the coordinates of its centre",
                "Ixx2 … Izz2: inertia of link 2 about the axes of its frame",
                "Ia2: inertia of the drive of joint 2, seen at the joint; Iam2 at the motor",
                "fv2, fc2: viscous and Coulomb friction of joint 2; off2: a constant torque at it; fvm2, fcm2, offm2: at the motor",
                "A sum such as Izz1 + Ia1 is one parameter: no motion tells its parts apart.",
            ]
            .map(str::to_owned)
            .to_vec(),
        )],
    }
}

/// The command that repeats the result, and the description that was written.
pub(super) fn repeat(context: &Context) -> Section {
    let mut section =
        Section::new("repeat", "Command", "").with(Block::Code(context.command.clone()));
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
