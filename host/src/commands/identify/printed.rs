//! What `rig identify` says on the terminal.

use super::super::ui::Ui;
use crate::identify::{Identification, NotExcited};
use crate::report::format_value;

/// The result at a glance.
pub(super) fn print(ui: &Ui, result: &Identification) {
    let width = result
        .base_parameters
        .iter()
        .map(|p| p.expression.chars().count())
        .max()
        .unwrap_or(0);
    for parameter in &result.base_parameters {
        ui.say(&format!(
            "{:width$}  {} {}  (95 %: {:.6} to {:.6})",
            parameter.expression,
            format_value(parameter.value, parameter.std),
            parameter.unit,
            parameter.interval[0],
            parameter.interval[1],
        ));
    }
    for joint in &result.joints {
        let holdout = joint.holdout_relative_error.map_or(String::new(), |error| {
            format!(", {:.2} % on the hold-out", 100.0 * error)
        });
        if joint.train_residual_rms.is_nan() {
            ui.say(&format!(
                "{}: none of its torque was used{holdout}",
                joint.name
            ));
            continue;
        }
        ui.say(&format!(
            "{}: residual {:.4} rms, {:.2} % of the torque{holdout}",
            joint.name,
            joint.train_residual_rms,
            100.0 * joint.train_relative_error,
        ));
    }
    for line in not_excited(&result.not_excited) {
        ui.say(&line);
    }
    for sentence in &result.procedure {
        ui.say(sentence);
    }
    if let Some(comparison) = &result.comparison {
        ui.say(&comparison.recommendation);
    }
    for warning in &result.warnings {
        ui.remark(warning);
    }
}

/// One line for each motion that would show more, with all that it would show.
fn not_excited(list: &[NotExcited]) -> Vec<String> {
    let mut by_motion: Vec<(&str, Vec<&NotExcited>)> = Vec::new();
    for missing in list {
        match by_motion
            .iter_mut()
            .find(|(motion, _)| *motion == missing.motion)
        {
            Some((_, own)) => own.push(missing),
            None => by_motion.push((&missing.motion, vec![missing])),
        }
    }
    let lines = by_motion.iter().map(|(motion, own)| match own.as_slice() {
        [missing] => format!(
            "not excited: {} ({}); {motion}",
            missing.combination, missing.why
        ),
        several => {
            let names: Vec<&str> = several.iter().map(|m| m.combination.as_str()).collect();
            format!("not excited: {}; {motion}", names.join("; "))
        }
    });
    let mut lines: Vec<String> = lines.collect();
    if by_motion.iter().any(|(_, own)| own.len() > 1) {
        lines.push("How well these data alone know each of them stands in the report.".into());
    }
    lines
}
