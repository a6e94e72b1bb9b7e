//! Bias of the parameters by the missing effects, and the unexplained residual.

use super::{gap, words};
use crate::pages::parts;
use rig_diagnose::outcome::{Absorbed, Before, Diagnosis, FloorFrom, Remainder};
use rig_output::{format_significant, format_value};
use rig_report::{Block, Column, Section, Table};

/// Change in standard deviations from which on a parameter counts as biased.
const LYING: f64 = 3.0;

/// Nominal parameters that the missing effects had biased.
pub(super) fn absorbed(found: &Diagnosis) -> Option<Section> {
    if found.absorbed.is_empty() {
        return None;
    }
    let mut list: Vec<&Absorbed> = found.absorbed.iter().collect();
    list.sort_by(|a, b| b.sigmas.abs().total_cmp(&a.sigmas.abs()));
    let lying = list.iter().filter(|a| a.sigmas.abs() >= LYING).count();
    let has = if lying == 1 { "has" } else { "have" };
    let ([title, intro], moved, heads) = match found.absorbed_before {
        Before::WithoutEffects => (
            [
                "Parameters biased by the missing effects",
                "A missing effect does not only leave a residual: the fit also changes the other parameters to compensate for it. The table gives the parameters of the standard model, fitted without the effects and with them.",
            ],
            format!(
                "{lying} of {} {has} changed by more than {LYING:.0} standard deviations, because the old values compensated for the missing effects. The new values are valid only in the model with the effects.",
                list.len()
            ),
            ["Without the effects", "With them ± std"],
        ),
        Before::Described => (
            [
                "Values of the description and of the data",
                "No effect was found that could have biased the parameters. The table gives the parameters of the standard model, as described and as identified from the training data.",
            ],
            format!(
                "{lying} of {} {has} changed by more than {LYING:.0} standard deviations from the description.",
                list.len()
            ),
            ["As described", "Identified ± std"],
        ),
    };
    Some(
        Section::new("absorbed", title, intro)
            .with(Block::Text(if lying == 0 {
                format!("None has changed by more than {LYING:.0} standard deviations.")
            } else {
                moved
            }))
            .with(Block::Table(Table {
                caption: "Before and after, largest change first".into(),
                columns: vec![
                    Column::text("Parameter"),
                    Column::number(heads[0], ""),
                    Column::number(heads[1], ""),
                    Column::text("Unit"),
                    Column::number("Change", "std"),
                ],
                rows: list
                    .iter()
                    .map(|a| {
                        let std = ((a.after - a.before) / a.sigmas).abs();
                        vec![
                            a.parameter.clone(),
                            format_significant(a.before, 4),
                            format_value(a.after, std),
                            parts::unit(&a.unit),
                            format_significant(a.sigmas, 2),
                        ]
                    })
                    .collect(),
                note: String::new(),
            })),
    )
}

/// Residual of the written model for each joint.
pub(super) fn sizes(found: &Diagnosis) -> Option<Section> {
    let first = found.left.first()?;
    let number = |x: f64| match x.is_nan() {
        true => "not known".to_owned(),
        false => format_significant(x, 3),
    };
    Some(
        Section::new(
            "sizes",
            "Residual of the written model",
            "RMS of the torque residual of model.toml, compared with the recorded torque and with a noise floor that does not depend on a model. A joint is explained if its residual is noise, or if the effects close nearly all of the gap above the floor.",
        )
        .with(Block::Table(Table {
            caption: match first.on_holdout {
                true => "On the hold-out".into(),
                false => "On blocks of the training data, each left out of the fit in turn".into(),
            },
            columns: vec![
                Column::text("Joint"),
                Column::number("Without the effects", ""),
                Column::number("Written model", ""),
                Column::number("Noise floor", ""),
                Column::text("Unit"),
                Column::text("Floor from"),
                Column::number("Torque RMS", ""),
                Column::number("Residual / torque", "%"),
                Column::text("Explained?"),
            ],
            rows: (found.left.iter())
                .map(|left| {
                    vec![
                        left.joint.clone(),
                        number(left.before),
                        number(left.after),
                        number(left.floor),
                        parts::unit(&left.unit),
                        match left.floor_from {
                            FloorFrom::RepeatedRuns => "repeated runs",
                            FloorFrom::TorqueReading => "torque reading alone",
                            FloorFrom::Unknown => "–",
                        }
                        .into(),
                        number(left.torque),
                        format_significant(left.percent_of_torque, 2),
                        if left.explained { "yes" } else { "no" }.into(),
                    ]
                })
                .collect(),
            note: String::new(),
        })),
    )
}

/// The parameters estimated from the torque and from the simulated motion.
pub(super) fn by_motion(found: &Diagnosis) -> Option<Section> {
    let by_motion = found.by_motion.as_ref()?;
    Some(
        Section::new(
            "by-motion",
            "The same parameters, estimated from the motion",
            "The parameters are estimated in two ways: from the torque that the measured motion requires, and from the motion that the measured torque causes in a simulation. Noise of the position affects only the first. If the model is right, both agree within a few standard deviations.",
        )
        .with(Block::Text(by_motion.text.clone()))
        .with(Block::Table(Table {
            caption: "Estimates from torque and from simulated motion".into(),
            columns: vec![
                Column::text("Parameter"),
                Column::number("From the torque ± std", ""),
                Column::number("From the motion ± std", ""),
                Column::text("Unit"),
                Column::number("Difference", "std"),
            ],
            rows: by_motion
                .parameters
                .iter()
                .map(|p| {
                    vec![
                        p.parameter.clone(),
                        format_value(p.torque, p.torque_std),
                        format_value(p.motion, p.motion_std),
                        parts::unit(&p.unit),
                        format_significant(p.sigmas, 2),
                    ]
                })
                .collect(),
            note: String::new(),
        })),
    )
}

/// The unexplained residual; without one, the mean residual of the final model.
pub(super) fn remainder(found: &Diagnosis) -> Option<Section> {
    let maps: Vec<Block> = found
        .maps
        .iter()
        .filter(|m| m.step.is_none())
        .flat_map(gap::maps)
        .map(Block::Plot)
        .collect();
    let Some(remainder) = &found.remainder else {
        return (!maps.is_empty()).then(|| Section {
            blocks: maps,
            ..Section::new(
                "left",
                "Remaining residual",
                "Mean residual of the final model. Points whose bars include zero show only noise; other points show that the model still lacks an effect.",
            )
        });
    };
    let shown = words::shown(found, &remainder.unit);
    let mut section = Section::new(
        "left",
        "Unexplained residual",
        "No effect of the catalogue explains this part of the gap. It is described and gets no name, because even the best-fitting name would be wrong.",
    )
    .with(parts::warning(remainder.text.clone()));
    // A free run that diverged has no residual.
    if !remainder.rms.is_nan() {
        section = section.with(Block::Text(unnamed(remainder, &shown)));
    }
    let texts = gap::texts(&remainder.places, false);
    if !texts.is_empty() {
        section = section.with(Block::List(texts));
    }
    if !remainder.places.is_empty() {
        section = section.with(gap::table(
            "Quantities that the remainder depends on",
            &remainder.places,
        ));
    }
    section.blocks.extend(maps);
    Some(section)
}

/// Returns true if the unexplained residual of a joint makes the name of its effects doubtful.
pub(super) fn doubted(found: &Diagnosis, joint: &str) -> bool {
    let speaks = |left: &Remainder| left.joint == joint && left.doubt && !left.of_a_voltage();
    found.remainder.as_ref().is_some_and(speaks)
}

/// Describes the remainder of a joint in numbers.
fn unnamed(remainder: &Remainder, shown: &words::Shown) -> String {
    format!(
        "Joint {}: {} RMS unexplained{}.",
        remainder.joint,
        shown.value(remainder.rms),
        match remainder.ratio.is_nan() {
            true => "; no noise floor is known".into(),
            false => format!(
                "; including noise, {} is {} times the noise floor",
                match remainder.of_a_voltage() {
                    true => "the voltage residual",
                    false => "the whole residual",
                },
                format_significant(remainder.ratio, 3)
            ),
        }
    )
}
