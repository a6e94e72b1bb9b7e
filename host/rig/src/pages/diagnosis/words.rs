//! Names and sentences for a reader.

use rig_shared::effects::{About, Kind};

use super::parts;
use rig_diagnose::outcome::{Diagnosis, Residual, Step, Verdict};
use rig_output::format_significant;
use rig_report::{NoteKind, Tone};

/// A verdict in a word or two.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMissing => "Nothing missing",
        Verdict::Explained => "Explained",
        Verdict::ParameterChange => "A parameter has changed",
        Verdict::Remainder => "Something is left",
        Verdict::DataFault => "The data are at fault",
    }
}

/// What the verdict means.
pub(super) fn meaning(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMissing => {
            "These data show nothing that the model as it is lacks. No effect had to be added."
        }
        Verdict::Explained => {
            "The model lacked something, and the effects named here explain it: on data that took no part in the fit the residual is noise, or nearly all of the gap above the noise floor is closed."
        }
        Verdict::ParameterChange => {
            "The equations hold; a value in the description does not, or does no longer."
        }
        Verdict::Remainder => {
            "Something stays open: no effect that is known here explains it, so it is described and not named."
        }
        Verdict::DataFault => "A recording cannot be what it says it is. Nothing was fitted to it.",
    }
}

pub(super) fn tone(verdict: Verdict) -> Tone {
    match verdict {
        Verdict::NothingMissing | Verdict::Explained => Tone::Good,
        Verdict::ParameterChange => Tone::Notice,
        Verdict::Remainder => Tone::Warning,
        Verdict::DataFault => Tone::Fault,
    }
}

pub(super) fn note(verdict: Verdict) -> NoteKind {
    match verdict {
        Verdict::Explained => NoteKind::Good,
        // That nothing was seen confirms nothing.
        Verdict::NothingMissing | Verdict::ParameterChange => NoteKind::Info,
        Verdict::Remainder => NoteKind::Warning,
        Verdict::DataFault => NoteKind::Fault,
    }
}

/// What is known of an effect; none where the name is no effect of the catalogue.
pub(super) fn about(effect: &str, law: Option<&str>) -> Option<&'static About> {
    Kind::named(effect, law).map(Kind::about)
}

/// An effect as a heading has it: its title, or its name without underscores.
pub(super) fn title(effect: &str, law: Option<&str>) -> String {
    capital(&about(effect, law).map_or_else(|| name(effect), |about| about.title.into()))
}

/// A text with its first letter in upper case.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// An effect's name as print has it; its law does not matter.
pub(super) fn name(effect: &str) -> String {
    effect.replace('_', " ")
}

/// Names that these data support as well as the step's own.
pub(super) fn rivals(step: &Step) -> Vec<String> {
    step.set
        .iter()
        .filter(|rival| **rival != step.effect)
        .map(|rival| name(rival))
        .collect()
}

/// `1 effect`, `2 effects`.
pub(super) fn several(n: usize, what: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n} {what}{plural}")
}

/// A text for a table cell.
pub(super) fn or_dash(text: &str) -> String {
    if text.is_empty() { "–" } else { text }.into()
}

/// Unit of the position that belongs to a unit of a residual.
pub(super) fn position_unit(torque: &str) -> &'static str {
    match torque {
        "N" | "m" => "m",
        _ => "rad",
    }
}

/// How residuals are printed: torques as they are, positions in thousandths.
pub(super) struct Shown {
    /// Of a printed number to the number itself.
    scale: f64,
    /// As printed.
    pub(super) unit: String,
    /// What the residual is of, for captions.
    pub(super) what: &'static str,
}

impl Shown {
    /// A value, three digits.
    pub(super) fn number(&self, value: f64) -> String {
        format_significant(self.scale * value, 3)
    }

    /// A value with its unit.
    pub(super) fn value(&self, value: f64) -> String {
        format!("{} {}", self.number(value), self.unit)
    }

    /// Values for a plot.
    pub(super) fn scaled(&self, values: &[f64]) -> Vec<f64> {
        values.iter().map(|v| self.scale * v).collect()
    }
}

/// How residuals in `unit` are printed.
pub(super) fn shown(found: &Diagnosis, unit: &str) -> Shown {
    match found.residual {
        Residual::Torque => Shown {
            scale: 1.0,
            unit: parts::unit(unit),
            what: "torque residual",
        },
        Residual::Position => Shown {
            scale: 1e3,
            unit: format!("m{}", parts::unit(unit)),
            what: "simulated position's error",
        },
    }
}
