//! Names and sentences for the page of a diagnosis.

use rig_shared::effects::{About, Kind};

use crate::pages::parts;
use rig_diagnose::outcome::{Diagnosis, Residual, Step, Verdict};
use rig_output::{capital, format_significant};
use rig_report::{NoteKind, Tone};

/// A verdict in a few words.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMissing => "Nothing missing",
        Verdict::Explained => "Explained",
        Verdict::ParameterChange => "A parameter has changed",
        Verdict::Remainder => "Unexplained residual",
        Verdict::DataFault => "The data are at fault",
    }
}

/// The meaning of the verdict.
pub(super) fn meaning(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMissing => {
            "These data show no effect that the model lacks. No effect was added."
        }
        Verdict::Explained => {
            "The model lacked effects, and the effects named here explain the residual: on data not used in the fit the residual is noise, or nearly all of the gap above the noise floor is closed."
        }
        Verdict::ParameterChange => {
            "The equations are right, but a value in the description is wrong or has changed."
        }
        Verdict::Remainder => {
            "No effect of the catalogue explains a part of the residual, so this part is described without a name."
        }
        Verdict::DataFault => {
            "A recording contradicts the description of its columns or of the robot. Nothing was fitted to it."
        }
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
        // An effect that was not seen may still be present.
        Verdict::NothingMissing | Verdict::ParameterChange => NoteKind::Info,
        Verdict::Remainder => NoteKind::Warning,
        Verdict::DataFault => NoteKind::Fault,
    }
}

/// Entry of an effect in the catalogue; none if the catalogue has no such name.
pub(super) fn about(effect: &str, law: Option<&str>) -> Option<&'static About> {
    Kind::from_name(effect, law).map(Kind::about)
}

/// An effect for a heading: its title, or its name without underscores.
pub(super) fn title(effect: &str, law: Option<&str>) -> String {
    capital(&about(effect, law).map_or_else(|| name(effect), |about| about.title.into()))
}

/// An effect's name without underscores.
pub(super) fn name(effect: &str) -> String {
    effect.replace('_', " ")
}

/// Names that these data support equally well, except the step's own name.
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

/// Unit of the position for a residual of the given unit.
pub(super) fn position_unit(torque: &str) -> &'static str {
    match torque {
        "N" | "m" => "m",
        _ => "rad",
    }
}

/// Format of residuals: torques in their unit, positions in thousandths of it.
pub(super) struct Shown {
    /// Factor from the value to the printed number.
    scale: f64,
    /// Printed unit.
    pub(super) unit: String,
    /// Quantity of the residual, for captions.
    pub(super) what: &'static str,
}

impl Shown {
    /// Formats a value with three digits.
    pub(super) fn number(&self, value: f64) -> String {
        format_significant(self.scale * value, 3)
    }

    /// Formats a value with its unit.
    pub(super) fn value(&self, value: f64) -> String {
        format!("{} {}", self.number(value), self.unit)
    }

    /// Scales values for a plot.
    pub(super) fn scaled(&self, values: &[f64]) -> Vec<f64> {
        values.iter().map(|v| self.scale * v).collect()
    }
}

/// Returns the format of residuals in `unit`.
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
            what: "error of the simulated position",
        },
    }
}
