//! What the missing effects had done to the parameters, and what is left without a name.

use super::{gap, parts, words};
use rig_diagnose::outcome::{Absorbed, Before, Diagnosis, FloorFrom, Remainder};
use rig_output::{format_significant, format_value};
use rig_report::{Block, Column, Section, Table};

/// From so many standard deviations on a parameter counts as having been wrong.
const LYING: f64 = 3.0;

/// Nominal parameters that had been lying.
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
                "Parameters that had been lying",
                "What a model lacks does not all stay in the residual: part of it bends the parameters that are there, because the fit uses them to make up for it. These are the parameters of the standard model, fitted without the effects and with them.",
            ],
            format!(
                "{lying} of {} {has} moved by more than {LYING:.0} standard deviations; their old values stood in for what was missing. The new ones belong to the model with the effects, and are no values of a model without them.",
                list.len()
            ),
            ["Without the effects", "With them ± std"],
        ),
        Before::Described => (
            [
                "The description's values and those of the data",
                "No effect was found that could have bent them: these are the parameters of the standard model, as the description states them and as the training data have them.",
            ],
            format!(
                "{lying} of {} {has} moved by more than {LYING:.0} standard deviations from the description.",
                list.len()
            ),
            ["As described", "Identified ± std"],
        ),
    };
    Some(
        Section::new("absorbed", title, intro)
            .with(Block::Text(if lying == 0 {
                format!("None has moved by more than {LYING:.0} standard deviations.")
            } else {
                moved
            }))
            .with(Block::Table(Table {
                caption: "Before and after, the largest change first".into(),
                columns: vec![
                    Column::text("Parameter"),
                    Column::number(heads[0], ""),
                    Column::number(heads[1], ""),
                    Column::text("Unit"),
                    Column::number("Moved by", "std"),
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

/// What the written model leaves of each joint's torque.
pub(super) fn sizes(found: &Diagnosis) -> Option<Section> {
    let first = found.left.first()?;
    let number = |x: f64| match x.is_nan() {
        true => "not known".to_owned(),
        false => format_significant(x, 3),
    };
    Some(
        Section::new(
            "sizes",
            "What the written model leaves",
            "RMS of the torque residual of model.toml, beside the recorded torque and a noise floor that no model made. A joint is explained where its residual is noise, or where the effects close nearly all of the gap above the floor.",
        )
        .with(Block::Table(Table {
            caption: match first.on_holdout {
                true => "On the hold-out".into(),
                false => "On blocks of the training data, left out of the fit in turn".into(),
            },
            columns: vec![
                Column::text("Joint"),
                Column::number("Without the effects", ""),
                Column::number("Written model", ""),
                Column::number("Noise floor", ""),
                Column::text("Unit"),
                Column::text("Floor from"),
                Column::number("Torque RMS", ""),
                Column::number("Residual of torque", "%"),
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

/// The parameters by torque and by simulated motion.
pub(super) fn by_motion(found: &Diagnosis) -> Option<Section> {
    let by_motion = found.by_motion.as_ref()?;
    Some(
        Section::new(
            "by-motion",
            "The same parameters, fitted to the motion",
            "Two ways to the same numbers: the torque that the measured motion asks for, and the motion that the measured torque makes in a simulation. Noise of the position spoils the one and not the other. Where the model is right both agree within a few of their deviations.",
        )
        .with(Block::Text(by_motion.text.clone()))
        .with(Block::Table(Table {
            caption: "By torque and by simulated motion".into(),
            columns: vec![
                Column::text("Parameter"),
                Column::number("By the torque ± std", ""),
                Column::number("By the motion ± std", ""),
                Column::text("Unit"),
                Column::number("Apart by", "std"),
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

/// What no known effect explains; without it, what the residual looks like at the end.
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
                "What is left",
                "The mean residual at the end. Dots that lie on zero within their bars hide nothing; dots that do not would be something that the model still lacks.",
            )
        });
    };
    let shown = words::shown(found, &remainder.unit);
    let mut section = Section::new(
        "left",
        "What is left without a name",
        "No effect that is known here explains this part of the gap. It is described instead of being given the name that fits least badly.",
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
            "What the remainder depends on",
            &remainder.places,
        ));
    }
    section.blocks.extend(maps);
    Some(section)
}

/// The remainder of a joint in numbers.
fn unnamed(remainder: &Remainder, shown: &words::Shown) -> String {
    format!(
        "Joint {}: {} RMS without a name{}.",
        remainder.joint,
        shown.value(remainder.rms),
        match remainder.ratio.is_nan() {
            true => "; no noise floor is known".into(),
            false => format!(
                "; with noise, {} is {} times the noise floor",
                match remainder.of_a_voltage() {
                    true => "what is left of the voltage",
                    false => "the whole residual",
                },
                format_significant(remainder.ratio, 3)
            ),
        }
    )
}
