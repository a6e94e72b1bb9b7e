//! The section of one effect: signature, parameters, reduction of the residual, evidence.

use super::{gap, left, words};
use crate::pages::parts;
use rig_diagnose::outcome::{Diagnosis, Residual, Step};
use rig_diagnose::values_alike;
use rig_output::format_p_value;
use rig_report::{self, Block, Column, NoteKind, Section, Table};

/// Explanation of the figure of a step.
const PICTURE: &str = "The figure shows the mean residual before this step and after it. Where the points before the step differ from zero by more than their bars, the model lacks an effect. The line is the law of the effect, fitted to the data. The points after the step should lie on zero.";

/// A parameter of a gear that is not written into descriptions.
const SHARE: &str = "share";
const SHARE_MEANS: &str = "factor of the torque that follows from the gear's twist with the described inertia and load; 1 if these are right; not in model.toml";

/// Composes the section of step `k`, counted from 0.
pub(super) fn section(found: &Diagnosis, k: usize) -> Section {
    let step = &found.steps[k];
    let law = step.law.as_deref();
    let maps: Vec<_> = found.maps.iter().filter(|m| m.step == Some(k)).collect();
    let mut section = Section::new(
        format!("step-{}", k + 1),
        format!(
            "Step {}: {} at joint {}",
            k + 1,
            words::title(&step.effect, law),
            step.joint
        ),
        if maps.is_empty() { "" } else { PICTURE },
    );
    if let Some(about) = words::about(&step.effect, law) {
        section = section.with(Block::Text(format!(
            "Signature: {}. Equation: {}. Source: {}.\n\nName in descriptions and results: {}{}.",
            about.signature,
            about.equation,
            about.source,
            about.name,
            about
                .law
                .map_or(String::new(), |law| format!(", law {law}"))
        )));
    }
    section
        .blocks
        .extend(maps.iter().flat_map(|m| gap::maps(m)).map(Block::Plot));
    if !step.parameters.is_empty() {
        section = section.with(parameters(step));
    }
    section
        .with(worth(found, step))
        .with(Block::Note {
            kind: match left::doubted(found, &step.joint) {
                true => NoteKind::Info,
                false => NoteKind::Good,
            },
            text: format!(
                "Evidence. {} Probability that chance alone gives such a reduction, corrected for all tests: {}.",
                step.why,
                format_p_value(step.p_value)
            ),
        })
        .with(name(found, step))
}

fn parameters(step: &Step) -> Block {
    let about = words::about(&step.effect, step.law.as_deref());
    Block::Table(Table {
        caption: "Parameters of the effect, ± one standard deviation".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::text("Meaning"),
            Column::number("Value ± std", ""),
            Column::text("Unit"),
        ],
        rows: step
            .parameters
            .iter()
            .map(|(name, value)| {
                let meaning = about.and_then(|about| {
                    about
                        .gains
                        .iter()
                        .chain(about.shapes)
                        .find(|p| p.name == name)
                        .map(|p| p.meaning)
                });
                vec![
                    name.clone(),
                    words::or_dash(meaning.unwrap_or(if name == SHARE { SHARE_MEANS } else { "" })),
                    value.said(""),
                    parts::unit(&value.unit),
                ]
            })
            .collect(),
        note: String::new(),
    })
}

fn worth(found: &Diagnosis, step: &Step) -> Block {
    let torque = found
        .waterfall
        .iter()
        .find(|w| w.joint == step.joint)
        .map_or(String::new(), |w| w.unit.clone());
    let row = |what: &str, values: [String; 2]| {
        let [before, after] = values;
        vec![what.to_owned(), before, after]
    };
    let shown = words::shown(found, &step.rms_unit);
    let what = match found.residual {
        _ if step.rms_unit == "V" => "Voltage residual",
        Residual::Torque => "Torque residual",
        Residual::Position => "Error of the simulated position",
    };
    let residual =
        |on: &str, rms: [f64; 2]| row(&format!("{what}, {on}"), rms.map(|v| shown.value(v)));
    let mut rows = vec![residual("training", step.train_rms)];
    rows.extend(step.holdout_rms.map(|rms| residual("hold-out", rms)));
    // If the residual is one of the position, its row is there already.
    let motion = (step.motion_rms).filter(|_| found.residual == Residual::Torque);
    rows.extend(motion.map(|rms| {
        let unit = words::position_unit(&torque);
        row(
            "Error of the simulated motion",
            rms.map(|v| parts::length(v, unit)),
        )
    }));
    Block::Table(Table {
        caption: "Residual before and after the step (RMS)".into(),
        columns: vec![
            Column::text("Quantity"),
            Column::number("Before", ""),
            Column::number("After", ""),
        ],
        rows,
        note: format!(
            "Gap to the noise floor closed by the step: {}, {}.",
            step.fall(),
            if step.holdout_rms.is_some() {
                "on data not used in the fit"
            } else {
                "on the training data; no hold-out was given"
            }
        ),
    })
}

/// States how certain the name is.
fn name(found: &Diagnosis, step: &Step) -> Block {
    let runner_up = match (&step.runner_up, step.runner_up_gap_closed) {
        (Some(name), Some(share)) => format!(
            " The second-best name, {}, would close {} % of this step's gap.",
            words::name(name),
            parts::percent(share)
        ),
        (Some(name), None) => format!(" The second-best name is {}.", words::name(name)),
        (None, _) => String::new(),
    };
    let rivals = words::rivals(step);
    if let Some(values) = values_alike(found, step).filter(|_| rivals.is_empty()) {
        return parts::warning(format!(
            "No other effect of the catalogue explains these data as well, but {values} would.{runner_up}"
        ));
    }
    if rivals.is_empty() {
        return Block::Text(format!(
            "No other effect of the catalogue explains these data as well.{runner_up}"
        ));
    }
    parts::warning(format!(
        "These data do not decide the name: {} explain{} them as well as {}. The predicted {} is the same, so the model can be used; do not rely on the name until an experiment separates them.{runner_up}",
        rig_output::listed(&rivals),
        if rivals.len() == 1 { "s" } else { "" },
        words::name(&step.effect),
        match found.residual {
            Residual::Torque => "torque",
            Residual::Position => "motion",
        }
    ))
}
