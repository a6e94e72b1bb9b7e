//! Terminal output of `rig identify`.

use super::super::ui::{LISTED, Ui};
use rig_identify::{Estimator, Identification, JointFigures, NotExcited, StandardSet};
use rig_model::robot::{JointKind, Robot};
use rig_output::{format_interval, format_value};

/// Share of used rows from which on the figure over all rows is not printed, because it is nearly the same.
const ALL_BUT_A_FEW: f64 = 0.985;

/// Prints the result: details, what the data do not show, the parameters, and last the residuals and the estimator to trust.
pub(super) fn print(ui: &Ui, robot: &Robot, result: &Identification) {
    for warning in &result.warnings {
        ui.warn(&warning.to_string());
    }
    for sentence in &result.procedure {
        ui.detail(sentence);
    }
    if result.estimator != Estimator::Consistent
        && let Some(set) = &result.standard_parameters
    {
        ui.detail(&of_the_files(set));
    }
    for line in not_excited(&result.not_excited) {
        ui.say(&line);
    }
    parameters(ui, result);
    for (joint, described) in result.joints.iter().zip(&robot.joints) {
        ui.answer(&residual(joint, described.kind));
    }
    if let Some(comparison) = &result.comparison {
        ui.say(&comparison.recommendation);
    }
}

/// Prints the base parameters, or their number if there are many.
fn parameters(ui: &Ui, result: &Identification) {
    let found = &result.base_parameters;
    let width = (found.iter().map(|p| p.expression.chars().count())).max();
    let width = width.unwrap_or(0);
    for parameter in found {
        ui.say_of_many(
            found.len(),
            &format!(
                "{:width$}  {} {}  (95 %: {})",
                parameter.expression,
                format_value(parameter.value, parameter.std),
                parameter.unit,
                format_interval(parameter.interval, parameter.value, parameter.std),
            ),
        );
    }
    if found.len() > LISTED && !ui.is_verbose() {
        ui.say(&format!(
            "{} base parameters: the report and --verbose list them",
            found.len()
        ));
    }
}

/// Describes the residual of a joint.
fn residual(joint: &JointFigures, kind: JointKind) -> String {
    let held = (
        joint.holdout_relative_error,
        joint.holdout_rows_share,
        joint.holdout_relative_error_all_rows,
    );
    let holdout = match held {
        (Some(error), ..) if error.is_nan() => ", no usable row in the hold-out".to_owned(),
        (Some(error), Some(share), Some(all)) => {
            format!(", on the hold-out {}", left(error, share, all))
        }
        _ => String::new(),
    };
    if joint.train_residual_rms.is_nan() {
        return format!("{}: no row of its torque was used{holdout}", joint.name);
    }
    format!(
        "{}: residual {:.4} {} rms, {}{holdout}",
        joint.name,
        joint.train_residual_rms,
        kind.units().1.replace('*', "·"),
        left(
            joint.train_relative_error,
            joint.train_rows_share,
            joint.train_relative_error_all_rows
        ),
    )
}

/// Residual in per cent of the torque, over the used rows and over all rows.
fn left(error: f64, share: f64, all: f64) -> String {
    let error = format!("{:.2} % of the torque", 100.0 * error);
    match share {
        // The few rows at reversals do not change the figure.
        ALL_BUT_A_FEW.. => error,
        _ => format!(
            "{error} on {:.0} % of the rows, {:.2} % on all",
            100.0 * share,
            100.0 * all
        ),
    }
}

/// Residual of the parameter set in the written files, which differs from the fitted parameters.
fn of_the_files(set: &StandardSet) -> String {
    let percent = |errors: &[f64]| {
        let list: Vec<String> = errors.iter().map(|e| format!("{:.1}", 100.0 * e)).collect();
        list.join(", ")
    };
    let held = set.holdout_relative_error.as_ref();
    let held = held.map_or(String::new(), |errors| {
        format!(", on the hold-out {} %", percent(errors))
    });
    format!(
        "identified.toml and identified.urdf hold the nearest physically consistent parameters (--estimator consistent fits them); their residual is {} % of the torque{held}.",
        percent(&set.train_relative_error)
    )
}

/// One line for each recommended motion, with all combinations that it would excite.
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
        lines.push("The report says how well these data alone determine each combination.".into());
    }
    lines
}
