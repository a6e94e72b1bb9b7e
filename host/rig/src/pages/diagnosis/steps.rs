//! One effect that was found: what gave it away, what it is worth, why to believe it.

use super::{gap, parts, words};
use rig_diagnose::outcome::{Diagnosis, Residual, Step};
use rig_diagnose::values_alike;
use rig_output::format_p_value;
use rig_report::{self, Block, Column, NoteKind, Section, Table};

/// What the figure of a step shows.
const PICTURE: &str = "The figure shows the mean residual before this step and after it. Where the dots before lie off zero by more than their bars, the model lacked something. The line is the effect's law, fitted to the data. The dots after should lie on zero.";

/// The parameter of a gear that no description holds.
const SHARE: &str = "share";
const SHARE_MEANS: &str = "times the torque that the twist gives with the description's inertia and load; 1 where these are right; not in model.toml";

/// The section of step `k`, from 0.
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
            "How it shows: {}. Its equation: {}. After {}.\n\nIn descriptions and results it is called {}{}.",
            about.signature,
            about.equation,
            about.source,
            about.name,
            about.law.map_or(String::new(), |law| format!(", law {law}"))
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
            kind: match super::doubted(found, &step.joint) {
                true => NoteKind::Info,
                false => NoteKind::Good,
            },
            text: format!(
                "Why to believe it. {} The probability that chance alone looks like this, corrected for all that was tried: {}.",
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
    rows.extend(step.holdout_rms.map(|rms| residual("held back", rms)));
    // Where the residual is the motion's, that has been said.
    let motion = (step.motion_rms).filter(|_| found.residual == Residual::Torque);
    rows.extend(motion.map(|rms| {
        let unit = words::position_unit(&torque);
        row(
            "Error of the simulated motion",
            rms.map(|v| parts::length(v, unit)),
        )
    }));
    Block::Table(Table {
        caption: "What the step is worth (RMS)".into(),
        columns: vec![
            Column::text("Of what"),
            Column::number("Before", ""),
            Column::number("After", ""),
        ],
        rows,
        note: format!(
            "The step closes its gap to the noise floor by {}, {}.",
            step.fall(),
            if step.holdout_rms.is_some() {
                "on data that took no part in the fit"
            } else {
                "on the training data; no data were held back"
            }
        ),
    })
}

/// How sure the name is.
fn name(found: &Diagnosis, step: &Step) -> Block {
    let runner_up = match (&step.runner_up, step.runner_up_gap_closed) {
        (Some(name), Some(share)) => format!(
            " The next best name, {}, would have closed {} % of this step's gap.",
            words::name(name),
            parts::percent(share)
        ),
        (Some(name), None) => format!(" The next best name was {}.", words::name(name)),
        (None, _) => String::new(),
    };
    let rivals = words::rivals(step);
    if let Some(values) = values_alike(found, step).filter(|_| rivals.is_empty()) {
        return parts::warning(format!(
            "No other effect that is known here explains these data as well, but {values} would.{runner_up}"
        ));
    }
    if rivals.is_empty() {
        return Block::Text(format!(
            "No other effect that is known here explains these data as well.{runner_up}"
        ));
    }
    parts::warning(format!(
        "These data do not settle the name: {} explain{} them as well as {}. The {} is the same either way, so the model can be used; the name cannot be relied on before an experiment separates them.{runner_up}",
        rig_output::listed(&rivals),
        if rivals.len() == 1 { "s" } else { "" },
        words::name(&step.effect),
        match found.residual {
            Residual::Torque => "torque",
            Residual::Position => "motion",
        }
    ))
}
