//! The short facts of an identification.

use crate::pages::context::Context;
use crate::pages::parts;
use rig_identify::{Identification, JointFigures};
use rig_numerics::statistics::median;
use rig_output::{format_significant, format_value};
use rig_report::{Fact, Tone};

/// Largest number of parameters that get a card each; more share one card.
const CARDS: usize = 6;

/// Returns the facts for the top of the page.
pub(super) fn facts(found: &Identification, context: &Context) -> Vec<Fact> {
    let mut facts = vec![residual(found)];
    facts.push(parts::warning_count(
        found.warnings.len() + context.warnings.len(),
    ));
    facts.push(
        Fact::new(
            "Condition number",
            format_significant(found.condition_number, 2),
        )
        .note(format!(
            "{} with columns scaled to one length",
            format_significant(found.details.estimate.scaled_condition, 2)
        )),
    );
    facts.extend(parameters(found));
    if !found.not_excited.is_empty() {
        facts.push(
            Fact::new("Not excited", found.not_excited.len().to_string())
                .note("combinations that these data alone do not determine")
                .tone(Tone::Warning),
        );
    }
    facts
}

/// The residual on the hold-out; without one, on the training data.
fn residual(found: &Identification) -> Fact {
    let worst = |of: &dyn Fn(&JointFigures) -> Option<f64>| {
        found.joints.iter().filter_map(of).reduce(f64::max)
    };
    let several = if found.joints.len() > 1 {
        ", worst joint"
    } else {
        ""
    };
    let train = worst(&|j| Some(j.train_relative_error));
    match worst(&|j| j.holdout_relative_error) {
        Some(held) => Fact::new("Residual on the hold-out", parts::percent(held))
            .unit("%")
            .note(format!(
                "residual RMS over torque RMS{several}; on the training data {} %",
                train.map_or("–".into(), parts::percent)
            ))
            .tone(if held > 0.3 {
                Tone::Warning
            } else {
                Tone::Plain
            }),
        None => Fact::new(
            "Residual on the training data",
            train.map_or("–".into(), parts::percent),
        )
        .unit("%")
        .note(format!(
            "residual RMS over torque RMS{several}; no hold-out was given"
        ))
        .tone(Tone::Warning),
    }
}

/// A fact for each base parameter; one for all if there are many.
fn parameters(found: &Identification) -> Vec<Fact> {
    if found.base_parameters.len() <= CARDS {
        return (found.base_parameters.iter())
            .map(|b| {
                Fact::new(
                    &b.expression,
                    format_value(b.value, parts::half(b.interval)),
                )
                .unit(parts::unit(&b.unit))
                .note("± half the 95 % interval")
            })
            .collect();
    }
    let relative: Vec<f64> = found
        .base_parameters
        .iter()
        .map(|b| b.relative_std_percent)
        .collect();
    let median = median(relative).unwrap_or(f64::NAN);
    vec![
        Fact::new("Base parameters", found.base_parameters.len().to_string()).note(format!(
            "median relative standard deviation {} %",
            format_significant(median, 2)
        )),
    ]
}
