//! Friction over velocity: the points, the fitted laws and the choice between them.

use super::parts;
use rig_identify::{FrictionFit, FrictionMap};
use rig_model::robot::JointKind;
use rig_output::{format_significant, format_value};
use rig_report::{Axis, Block, Column, Marker, NoteKind, Plot, Role, Series, Style, Table};

/// Friction points with error bars, the fitted laws, the profile over the Stribeck velocity and the decision.
pub(super) fn friction(kind: JointKind, map: &FrictionMap) -> Vec<Block> {
    let decision = Block::Note {
        kind: if map.warranted {
            NoteKind::Good
        } else {
            NoteKind::Info
        },
        text: map.text.clone(),
    };
    let mut blocks = vec![
        decision,
        Block::Plot(over_velocity(kind, map)),
        Block::Table(laws(kind, map)),
    ];
    if map.stribeck.is_some() && map.profile.len() > 1 {
        blocks.push(Block::Details {
            summary: "How the Stribeck velocity was chosen".into(),
            blocks: vec![Block::Plot(profile(kind, map))],
        });
    }
    blocks
}

/// Draws the points and the fitted laws over velocity.
fn over_velocity(kind: JointKind, map: &FrictionMap) -> Plot {
    let [_, velocity, torque] = parts::units(kind);
    let what = parts::effort(kind);
    let mut plot = Plot::new(
        format!("Joint {}: friction {what} over velocity", map.joint),
        Axis::new("velocity", velocity),
        Axis::new(format!("friction {what}"), torque),
    );
    let v = branches(map);
    let at = |fit: &FrictionFit| v.iter().map(|v| law(fit, *v)).collect::<Vec<_>>();
    plot = plot.with(Series::line(
        "Coulomb and viscous",
        Role::Model,
        v.clone(),
        at(&map.simple),
    ));
    if let Some(fit) = &map.stribeck {
        plot =
            plot.with(Series::line("with Stribeck term", Role::After, v.clone(), at(fit)).dashed());
    }
    let found_in = if map.from_reference {
        "found in the reference"
    } else {
        "found in the position"
    };
    let with_stribeck = map.stribeck_left_out_rms.map_or(String::new(), |rms| {
        format!(", {} {torque} with it", format_significant(rms, 2))
    });
    plot.with(Series::new(
        "mean over a stretch ± 1.96 standard deviations",
        Role::Measured,
        Style::ErrorBars {
            half_width: map.points.iter().map(|p| 1.96 * p.std).collect(),
        },
        map.points.iter().map(|p| p.speed).collect(),
        map.points.iter().map(|p| p.friction).collect(),
    ))
    .note(format!(
        "n = {} stretches of constant speed, {found_in}. Leave-one-out RMS error: {} {torque} without a Stribeck term{with_stribeck}.",
        map.points.len(),
        format_significant(map.simple.leave_one_out_rms, 2),
    ))
}

/// Velocities at which the laws are drawn: two branches with a gap at rest, where the laws jump. They are denser at low
/// speed, where the curves bend.
fn branches(map: &FrictionMap) -> Vec<f64> {
    let fastest = map.points.iter().fold(0.0f64, |m, p| m.max(p.speed.abs()));
    let slowest = map
        .points
        .iter()
        .fold(fastest, |m, p| m.min(p.speed.abs()))
        .max(fastest * 1e-4);
    let branch: Vec<f64> = (0..=120)
        .map(|k| 0.2 * slowest * (5.0 * fastest / slowest).powf(f64::from(k) / 120.0))
        .collect();
    branch
        .iter()
        .rev()
        .map(|v| -v)
        .chain([f64::NAN])
        .chain(branch.iter().copied())
        .collect()
}

/// Friction of a law at velocity `v`.
fn law(fit: &FrictionFit, v: f64) -> f64 {
    let dip = fit
        .stribeck_velocity
        .map_or(0.0, |vs| fit.breakaway_excess * (-(v / vs).powi(2)).exp());
    v.signum() * (fit.coulomb + dip) + fit.viscous * v + fit.offset
}

/// Parameters of the fitted laws.
fn laws(kind: JointKind, map: &FrictionMap) -> Table {
    let [_, velocity, torque] = parts::units(kind);
    let mut rows = vec![fit_row("Coulomb and viscous", &map.simple)];
    rows.extend(
        map.stribeck
            .iter()
            .map(|f| fit_row("with Stribeck term", f)),
    );
    Table {
        caption: if map.stribeck.is_some() {
            "Both laws, ± half the 95 % interval"
        } else {
            "The law, ± half the 95 % interval"
        }
        .into(),
        columns: vec![
            Column::text("Law"),
            Column::number("Coulomb", torque),
            Column::number("Viscous", parts::viscous_unit(kind)),
            Column::number("Breakaway above Coulomb", torque),
            Column::number("Stribeck velocity", velocity),
        ],
        rows,
        note: format!(
            "fc·sgn v + fv·v + constant{}. Constant torque in addition to the identified one: {} {torque}. Standard deviation between passes in addition to the noise within a pass: {} {torque}.",
            if map.stribeck.is_some() {
                ", and the same with Δ·exp(−(v/vs)²)·sgn v"
            } else {
                ""
            },
            format_significant(map.stribeck.as_ref().unwrap_or(&map.simple).offset, 2),
            format_significant(map.scatter, 2)
        ),
    }
}

fn fit_row(name: &str, fit: &FrictionFit) -> Vec<String> {
    let value = |v: f64, k: usize| {
        fit.half_interval
            .get(k)
            .map_or("–".into(), |h| format_value(v, *h))
    };
    vec![
        name.into(),
        value(fit.coulomb, 0),
        value(fit.viscous, 1),
        value(fit.breakaway_excess, 2),
        fit.stribeck_velocity
            .map_or("–".into(), |v| format_significant(v, 2)),
    ]
}

/// Draws the sum of squares over the Stribeck velocities that were tried.
fn profile(kind: JointKind, map: &FrictionMap) -> Plot {
    let [_, velocity, _] = parts::units(kind);
    let mut profile = Plot::new(
        "Sum of squares over the Stribeck velocity",
        Axis::log("Stribeck velocity", velocity),
        Axis::new("weighted sum of squares", ""),
    )
    .with(Series::line(
        "with Stribeck term",
        Role::After,
        map.profile.iter().map(|p| p[0]).collect(),
        map.profile.iter().map(|p| p[1]).collect(),
    ))
    .mark(Marker::horizontal(map.simple.squares, "without"))
    .note(format!(
        "n = {}; residuals in standard deviations of the points.",
        map.points.len()
    ));
    profile.height = 220;
    profile
}
