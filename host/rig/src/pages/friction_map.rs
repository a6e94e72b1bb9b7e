//! The page of a friction map.

use super::context::Context;
use super::{friction, parts};
use rig_identify::FrictionMap;
use rig_model::robot::{JointKind, Robot};
use rig_output::{format_significant, format_value};
use rig_report::{Block, Column, Document, Fact, Section, Table, Tone};

/// Composes the page of a joint's friction map.
pub fn friction_map(robot: &Robot, map: &FrictionMap, context: &Context) -> Document {
    let kind = robot
        .joint_index(&map.joint)
        .and_then(|j| robot.joints.get(j))
        .map_or(JointKind::Revolute, |j| j.kind);
    let velocity = parts::units(kind)[1];
    let mut sections: Vec<Section> = parts::warnings(&[&context.warnings]).into_iter().collect();
    let mut section = Section::new(
        "map",
        "Friction over velocity",
        "Friction on stretches of constant speed; the identified gravity, inertia and offset are subtracted.",
    );
    section.blocks = friction::friction(kind, map);
    sections.push(section);
    sections.push(points(kind, map));
    sections.extend(dropped(map, velocity));
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: friction of joint {}", robot.name, map.joint),
        subtitle: map.text.clone(),
        summary: summary(kind, map, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn summary(kind: JointKind, map: &FrictionMap, context: &Context) -> Vec<Fact> {
    let [_, _, torque] = parts::units(kind);
    let fit = chosen(map);
    let value = |v: f64, k: usize| {
        fit.half_interval
            .get(k)
            .map_or_else(|| format_significant(v, 3), |h| format_value(v, *h))
    };
    let mut summary = vec![
        Fact::new(
            "Friction law",
            if map.warranted {
                "with Stribeck term"
            } else {
                "Coulomb and viscous"
            },
        )
        .note(format!(
            "{} of {} stretches of constant speed",
            map.points.len(),
            map.points.len() + map.dropped.len()
        )),
        Fact::new("Coulomb", value(fit.coulomb, 0))
            .unit(torque)
            .note("± half the 95 % interval"),
        Fact::new("Viscous", value(fit.viscous, 1))
            .unit(parts::viscous_unit(kind))
            .note("± half the 95 % interval"),
    ];
    if map.warranted {
        summary.push(
            Fact::new("Breakaway above Coulomb", value(fit.breakaway_excess, 2))
                .unit(torque)
                .note("± half the 95 % interval"),
        );
    }
    if !context.warnings.is_empty() {
        summary.push(Fact::new("Warnings", context.warnings.len().to_string()).tone(Tone::Warning));
    }
    summary
}

/// All stretches that gave a point.
fn points(kind: JointKind, map: &FrictionMap) -> Section {
    let [_, velocity, torque] = parts::units(kind);
    Section::new("points", "Stretches of constant speed", "").with(Block::Details {
        summary: format!("All {} stretches", map.points.len()),
        blocks: vec![Block::Table(Table {
            caption: "Stretches of constant speed".into(),
            columns: vec![
                Column::number("Start", "s"),
                Column::number("Duration", "s"),
                Column::number("Velocity", velocity),
                Column::number("Friction ± standard deviation", torque),
            ],
            rows: map
                .points
                .iter()
                .map(|p| {
                    vec![
                        format_significant(p.start, 4),
                        format_significant(p.duration, 3),
                        format_significant(p.speed, 3),
                        format_value(p.friction, p.std),
                    ]
                })
                .collect(),
            note: String::new(),
        })],
    })
}

/// Stretches that gave no point, with the reason.
fn dropped(map: &FrictionMap, velocity: &'static str) -> Option<Section> {
    if map.dropped.is_empty() {
        return None;
    }
    let rows = map.dropped.iter().map(|pass| {
        vec![
            format_significant(pass.start, 4),
            format_significant(pass.duration, 3),
            format_significant(pass.speed, 3),
            pass.why.clone(),
        ]
    });
    let table = Table {
        caption: "Stretches of constant speed that gave no point".into(),
        columns: vec![
            Column::number("Start", "s"),
            Column::number("Duration", "s"),
            Column::number("Velocity", velocity),
            Column::text("Reason"),
        ],
        rows: rows.collect(),
        note: String::new(),
    };
    Some(Section::new("dropped", "Stretches left out", "").with(Block::Table(table)))
}

/// The friction law that the points support.
fn chosen(map: &FrictionMap) -> &rig_identify::FrictionFit {
    match &map.stribeck {
        Some(fit) if map.warranted => fit,
        _ => &map.simple,
    }
}
