//! The page of the stiffness of the joints and the compliance of the tool point.

use super::context::Context;
use super::parts;
use rig_compliance::{
    Band, Compliance, ComplianceMap, Deflection, DriveLoading, FrequencyResponse, LoadingFindings,
    Periodic, ToolCompliance, Value, response_pose,
};
use rig_output::{capital, format_significant, format_unit};
use rig_report::{
    Axis, Block, Column, Document, Fact, HeatMap, Marker, Plot, Role, Section, Series, Table, Tone,
};

/// Names of the rows of K_p.
const DISPLACEMENTS: [&str; 6] = [
    "dx (m)", "dy (m)", "dz (m)", "rx (rad)", "ry (rad)", "rz (rad)",
];
/// Names of the columns of K_p with their units.
const WRENCH: [(&str, &str); 6] = [
    ("fx", "per N"),
    ("fy", "per N"),
    ("fz", "per N"),
    ("mx", "per N·m"),
    ("my", "per N·m"),
    ("mz", "per N·m"),
];

/// Ratio of the largest to the smallest value of a map from which on its colours are logarithmic. By judgement: on a
/// linear scale a ridge beside a dead centre leaves one colour to all else.
const LOGARITHMIC: f64 = 5.0;

/// Composes the page of the compliance.
pub fn compliance(found: &Compliance, context: &Context) -> Document {
    let mut sections: Vec<Section> = parts::warnings(&[&found.warnings, &context.warnings])
        .into_iter()
        .collect();
    sections.push(drives(found));
    sections.extend(loading(found));
    sections.extend(found.frequency.as_ref().map(frequency));
    for (k, pose) in found.poses.iter().enumerate() {
        sections.push(tool_point(found, pose, k));
    }
    sections.extend(found.map.as_ref().map(|map| chart(found, map)));
    sections.push(limits());
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: stiffness and compliance", found.robot),
        subtitle: "Stiffness of the joints, and what the tool point yields to a force.".into(),
        summary: summary(found, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

/// Formats a value with its standard deviation, if it has one.
fn value(value: &Value) -> String {
    value.text()
}

/// Returns true if a force moves the tool point at a pose by more than rounding.
fn yields(pose: &ToolCompliance) -> bool {
    let arms: f64 = (3..6).map(|r| pose.compliance[r][r]).sum();
    let most = pose
        .principal
        .first()
        .map_or(0.0, |own| own.compliance.value);
    most > 1e-18 * arms
}

fn summary(found: &Compliance, context: &Context) -> Vec<Fact> {
    let mut facts = Vec::new();
    for drive in found.drives.iter().filter(|d| d.source.is_measured()) {
        if let Some(stiffness) = &drive.stiffness {
            facts.push(
                Fact::new(format!("Stiffness of {}", drive.joint), value(stiffness))
                    .unit(format_unit(drive.unit))
                    .note(format!(
                        "± one standard deviation, by {}",
                        drive.source.words()
                    ))
                    .tone(Tone::Good),
            );
        }
    }
    // Without an arm no force moves the tool point; a warning says so.
    let moved = found.poses.first().filter(|pose| yields(pose));
    if let Some(most) = moved.and_then(|p| p.principal.first()) {
        facts.push(
            Fact::new("Largest displacement per force", value(&most.compliance))
                .unit("m/N")
                .note("± one standard deviation; at the first pose, over all directions"),
        );
    }
    facts.push(parts::warning_count(
        found.warnings.len() + context.warnings.len(),
    ));
    facts
}

/// The stiffness of all drives.
fn drives(found: &Compliance) -> Section {
    let rows = found.drives.iter().map(|drive| {
        let interval = drive.stiffness.unwrap_or_default().interval_text();
        vec![
            drive.joint.clone(),
            drive.stiffness.as_ref().map_or("rigid".into(), value),
            interval,
            format_unit(drive.unit),
            drive.source.words().to_owned(),
        ]
    });
    Section::new(
        "stiffness",
        "Stiffness of the joints",
        "Torque per twist between motor and link, on the joint side. For a screw it is that at the motor.",
    )
    .with(Block::Table(Table {
        caption: "Stiffness c of each drive".into(),
        columns: vec![
            Column::text("Joint"),
            Column::number("c ± standard deviation", ""),
            Column::number("95 % interval", ""),
            Column::text("Unit"),
            Column::text("Source"),
        ],
        rows: rows.collect(),
        note: String::new(),
    }))
}

/// Units of stiffness, torque and twist of the drives of a table.
fn units(found: &Compliance, loading: &LoadingFindings) -> [&'static str; 3] {
    let is_linear = |drive: &DriveLoading| found.drives[drive.index].unit == "N/m";
    let linear = loading.drives.iter().filter(|own| is_linear(own)).count();
    match linear {
        0 => ["N·m/rad", "N·m", "rad"],
        count if count == loading.drives.len() => ["N/m", "N", "m"],
        _ => ["N·m/rad or N/m", "N·m or N", "rad or m"],
    }
}

/// Static loading.
fn loading(found: &Compliance) -> Option<Section> {
    let loading = found.loading.as_ref()?;
    let [stiffness, torque, twist] = units(found, loading);
    let optional = |own: &Option<Value>, none: &str| own.as_ref().map_or(none.into(), value);
    let rows = loading.drives.iter().map(|drive| {
        vec![
            drive.joint.clone(),
            drive.by.words().to_owned(),
            optional(&drive.stiffness, "not shown"),
            optional(&drive.hysteresis, "not shown"),
            match (&drive.gap, drive.reverses) {
                (Some(gap), _) => value(gap),
                (None, true) => "none".into(),
                (None, false) => "not shown".into(),
            },
            format!(
                "{} to {}",
                format_significant(drive.load[0], 3),
                format_significant(drive.load[1], 3)
            ),
        ]
    });
    let mut section = Section::new(
        "loading",
        "Static loading",
        "Friction makes loading and unloading run on two parallel lines: half their distance is the hysteresis, and their slope is the stiffness.",
    )
    .with(Block::Table(Table {
        caption: "What static loading shows of each drive".into(),
        columns: vec![
            Column::text("Joint"),
            Column::text("Measurement"),
            Column::number("Stiffness", stiffness),
            Column::number("Hysteresis", torque),
            Column::number("Backlash", twist),
            Column::number("Load", torque),
        ],
        rows: rows.collect(),
        note: "Values ± one standard deviation. Backlash shows only where the torque of the spring changes its sign.".into(),
    }));
    for drive in &loading.drives {
        section
            .blocks
            .extend(drive.missing.as_ref().map(parts::warning));
        let is_linear = found.drives[drive.index].unit == "N/m";
        section
            .blocks
            .extend(curve(drive, is_linear).map(Block::Plot));
    }
    if let Some(text) = loading.assumed() {
        section
            .blocks
            .push(Block::Text(format!("{}.", capital(&text))));
    }
    if let Some(residual) = loading.residual {
        section.blocks.push(Block::Text(format!(
            "The springs leave {} of the displacement of the tool point (RMS). Gauge noise, elasticity of base and links, and movements of the base make it larger.",
            parts::length(residual, "m")
        )));
    }
    Some(section)
}

/// Twist over torque, if there are points.
fn curve(drive: &DriveLoading, is_linear: bool) -> Option<Plot> {
    if drive.points.iter().all(Vec::is_empty) {
        return None;
    }
    let (torque, twist) = match is_linear {
        true => (
            Axis::new("force of the spring", "N"),
            Axis::new("deflection", "m"),
        ),
        false => (
            Axis::new("torque of the spring", "N·m"),
            Axis::new("twist", "rad"),
        ),
    };
    let mut plot = Plot::new(
        format!("{}: twist over torque", drive.joint),
        torque,
        twist,
    )
    .note(match drive.by {
        Deflection::Tool => "Each dot is one window: the deflection of the tool point over the arm of this joint, less what the other joints explain. The line has the slope of the estimated stiffness, without friction.",
        _ => "Each dot is the mean of one window. The line has the slope of the estimated stiffness, without friction.",
    });
    let names = [("growing", Role::Measured), ("falling", Role::After)];
    for ((name, role), points) in names.iter().zip(&drive.points) {
        plot = plot.with(Series::points(
            *name,
            *role,
            points.iter().map(|p| p[0]).collect(),
            points.iter().map(|p| p[1]).collect(),
        ));
    }
    if let Some(stiffness) = &drive.stiffness {
        let half = drive.gap.map_or(0.0, |gap| 0.5 * gap.value);
        let zero = drive.gap_torque.unwrap_or_default();
        let loads = || drive.points.iter().flatten().map(|p| p[0]);
        let low = loads().fold(f64::INFINITY, f64::min);
        let high = loads().fold(f64::NEG_INFINITY, f64::max);
        let at = |f: f64| f / stiffness.value + half * (f - zero).signum();
        let mut x = vec![low];
        if low < zero && high > zero && half > 0.0 {
            let step = 1e-9 * (high - low);
            x.extend([zero - step, zero + step]);
        }
        x.push(high);
        let y = x.iter().map(|f| at(*f)).collect();
        plot = plot.with(Series::line("model", Role::Model, x, y));
    }
    Some(plot)
}

/// The frequency response of one joint.
fn frequency(found: &FrequencyResponse) -> Section {
    let how = match (&found.periodic, found.whole) {
        (Some(periodic), _) => format!(
            "the mean over {} periods of {} s",
            periodic.periods,
            format_significant(periodic.period, 4)
        ),
        (None, true) => "transformed as a whole, from rest to rest".into(),
        (None, false) => "in Hann windows that overlap by half".into(),
    };
    let instrument = match found.by_reference {
        true => "The reference is the instrument, so that noise in the feedback gives no bias.",
        false => {
            "The torque is the instrument: with feedback on the torque the response is biased."
        }
    };
    let lead = format!(
        "Velocity of the motor per torque of joint \"{}\": {} rows at {} Hz, {how}. {instrument}",
        found.joint,
        parts::count(found.rows as u64),
        format_significant(found.rate, 4)
    );
    let used = used_bands(&found.bands);
    let mut section =
        Section::new("frequency", "Frequency response", lead).with(Block::Table(two_masses(found)));
    if let Some(periodic) = &found.periodic {
        section = section.with(Block::Text(distortion(periodic)));
    }
    section
        .with(Block::Plot(magnitude(found, &used)))
        .with(Block::Plot(phase(found, &used)))
        .with(Block::Plot(coherence(found)))
        .with(Block::Text(format!(
            "Mean pose: {}. Squared residual over noise: {} (1 for a response that two masses explain). Variances are scaled by it, standard deviations by its root.",
            response_pose(found),
            format_significant(found.misfit, 3)
        )))
        .with(Block::Details {
            summary: "Torque and velocity over time".into(),
            blocks: vec![Block::Plot(signals(found))],
        })
}

/// Says how large noise and distortion are.
fn distortion(periodic: &Periodic) -> String {
    let percent = |share: f64| format!("{} %", format_significant(100.0 * share, 2));
    let order = |name: &str, share: Option<f64>| {
        share.map_or(String::new(), |share| {
            format!(", {name} {}", percent(share))
        })
    };
    format!(
        "The reference holds {} harmonics. In the mean over the periods, per harmonic and over the velocity at the harmonics of the reference (RMS): noise {}{}{}. The periods differ by noise alone. Distortion by something nonlinear shows at harmonics that the reference leaves out: friction and backlash at odd ones, what depends on the direction at even ones. It does not fall with more periods.",
        parts::count(periodic.harmonics as u64),
        percent(periodic.noise),
        order("odd distortion", periodic.odd),
        order("even distortion", periodic.even)
    )
}

fn two_masses(found: &FrequencyResponse) -> Table {
    let described = |own: Option<f64>| own.map_or("–".into(), |v| format_significant(v, 4));
    let by_description = found
        .stiffness_by_description
        .as_ref()
        .map_or("–".into(), value);
    let link = match found.link_inertia_known {
        true => format!("{} (description)", value(&found.link_inertia)),
        false => value(&found.link_inertia),
    };
    let none = || "–".to_owned();
    let rows = [
        ("Antiresonance", value(&found.antiresonance), none(), "Hz"),
        ("Resonance", value(&found.resonance), none(), "Hz"),
        (
            "Stiffness c",
            value(&found.stiffness),
            by_description,
            "N·m/rad",
        ),
        ("Damping", value(&found.damping), none(), "N·m·s/rad"),
        (
            "Inertia of the links",
            link,
            described(found.described_link_inertia),
            "kg·m²",
        ),
        (
            "Inertia of the motor, joint side",
            value(&found.motor_inertia),
            described(found.described_motor_inertia),
            "kg·m²",
        ),
        (
            "Coulomb friction of the motor",
            value(&found.coulomb),
            none(),
            "N·m",
        ),
        (
            "Coulomb friction of the link",
            value(&found.link_coulomb),
            none(),
            "N·m",
        ),
        (
            "Delay of the position after the torque",
            value(&found.delay),
            none(),
            "s",
        ),
    ];
    Table {
        caption: "The two masses".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::number("Estimate ± standard deviation", ""),
            Column::number("By the description", ""),
            Column::text("Unit"),
        ],
        rows: rows
            .map(|(name, own, other, unit)| vec![name.into(), own, other, unit.into()])
            .into(),
        note: format!(
            "The recorded torque counts as {}. Stiffness by the description: its inertia of the links at this pose, times the square of the antiresonance, less the stiffness of gravity. For a prismatic joint read m for rad, N for N·m and kg for kg·m².",
            match found.held {
                true => "held by the controller from row to row",
                false => "that of the instant of its row",
            }
        ),
    }
}

/// Returns the used bands, with `None` where others lie between them: a line breaks there.
fn used_bands(bands: &[Band]) -> Vec<Option<usize>> {
    let mut list: Vec<Option<usize>> = Vec::new();
    for (k, band) in bands.iter().enumerate() {
        match (band.used, list.last()) {
            (true, _) => list.push(Some(k)),
            (false, Some(Some(_))) => list.push(None),
            (false, _) => {}
        }
    }
    list
}

/// Returns all bands from the first to the last used one: a model has no noise that makes a band useless.
fn whole(used: &[Option<usize>]) -> Vec<Option<usize>> {
    let mut kept = used.iter().flatten();
    let Some(first) = kept.next() else {
        return Vec::new();
    };
    let last = kept.next_back().unwrap_or(first);
    (*first..=*last).map(Some).collect()
}

/// Returns the values of bands, with NaN where a line breaks.
fn pick(used: &[Option<usize>], of: impl Fn(usize) -> f64) -> Vec<f64> {
    used.iter().map(|k| k.map_or(f64::NAN, &of)).collect()
}

/// Marks antiresonance and resonance.
fn marked(plot: Plot, found: &FrequencyResponse) -> Plot {
    plot.mark(Marker::vertical(found.antiresonance.value, "antiresonance"))
        .mark(Marker::vertical(found.resonance.value, "resonance"))
}

fn magnitude(found: &FrequencyResponse, used: &[Option<usize>]) -> Plot {
    let x = pick(used, |k| found.bands[k].frequency);
    let whole = whole(used);
    let plot = Plot::new(
        "Magnitude of the frequency response",
        Axis::log("frequency", "Hz"),
        Axis::log("velocity per torque", "rad/s per N·m"),
    )
    .with(Series::band(
        "95 % band",
        Role::Measured,
        x.clone(),
        pick(used, |k| {
            let band = &found.bands[k];
            (band.magnitude - band.radius).max(0.05 * band.magnitude)
        }),
        pick(used, |k| found.bands[k].magnitude + found.bands[k].radius),
    ))
    .with(Series::points(
        "measured",
        Role::Measured,
        x.clone(),
        pick(used, |k| found.bands[k].magnitude),
    ))
    .with(Series::points(
        "without friction",
        Role::After,
        x,
        pick(used, |k| found.frictionless[k][0]),
    ))
    .with(Series::line(
        "two masses",
        Role::Model,
        pick(&whole, |k| found.bands[k].frequency),
        pick(&whole, |k| found.model[k][0]),
    ))
    .note("Bands with significant coherence. Without friction: the estimated Coulomb friction is subtracted from the torque; the model is compared with that.");
    marked(plot, found)
}

fn phase(found: &FrequencyResponse, used: &[Option<usize>]) -> Plot {
    let x = pick(used, |k| found.bands[k].frequency);
    let whole = whole(used);
    let plot = Plot::new(
        "Phase of the frequency response",
        Axis::log("frequency", "Hz"),
        Axis::new("phase", "°"),
    )
    .with(Series::points(
        "measured",
        Role::Measured,
        x.clone(),
        pick(used, |k| found.bands[k].phase.to_degrees()),
    ))
    .with(Series::points(
        "without friction",
        Role::After,
        x,
        pick(used, |k| found.frictionless[k][1].to_degrees()),
    ))
    .with(Series::line(
        "two masses",
        Role::Model,
        pick(&whole, |k| found.bands[k].frequency),
        pick(&whole, |k| found.model[k][1].to_degrees()),
    ));
    marked(plot, found)
}

fn coherence(found: &FrequencyResponse) -> Plot {
    Plot::new(
        "Coherence",
        Axis::log("frequency", "Hz"),
        Axis::new("coherence", ""),
    )
    .with(Series::line(
        "coherence",
        Role::Measured,
        found.bands.iter().map(|b| b.frequency).collect(),
        found.bands.iter().map(|b| b.coherence).collect(),
    ))
    .note(match found.by_reference {
        true => "The smaller one of reference and torque, and of reference and velocity.",
        false => "Of torque and velocity.",
    })
}

fn signals(found: &FrequencyResponse) -> Plot {
    let [time, torque, velocity] = &found.shown;
    Plot::new(
        "Torque and velocity",
        Axis::new("time", "s"),
        Axis::new("torque, velocity", "N·m, rad/s"),
    )
    .with(Series::line(
        "torque",
        Role::Measured,
        time.clone(),
        torque.clone(),
    ))
    .with(Series::line(
        "velocity",
        Role::After,
        time.clone(),
        velocity.clone(),
    ))
}

/// Returns a row of a matrix as text. Rounding leaves what is zero a little off: beside `all` entries that is 0.
fn entries<'a>(row: &'a [f64], all: &[f64]) -> impl Iterator<Item = String> + use<'a> {
    let most = all.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    row.iter().map(move |v| match v.abs() < 1e-12 * most {
        true => "0".to_owned(),
        false => format_significant(*v, 4),
    })
}

/// A 6 × 6 matrix as a table.
fn matrix(
    caption: &str,
    rows: [&str; 6],
    columns: [(&str, &str); 6],
    values: &[[f64; 6]; 6],
    note: String,
) -> Table {
    let mut heads = vec![Column::text("")];
    heads.extend(columns.map(|(name, unit)| Column::number(name, unit)));
    Table {
        caption: caption.into(),
        columns: heads,
        rows: (rows.iter().zip(values))
            .map(|(name, row)| {
                let mut cells = vec![(*name).to_owned()];
                cells.extend(entries(row, values.as_flattened()));
                cells
            })
            .collect(),
        note,
    }
}

/// The compliance of the tool point at one pose.
fn tool_point(found: &Compliance, pose: &ToolCompliance, k: usize) -> Section {
    let list: Vec<String> = pose.pose.iter().map(|q| fixed(*q, 4)).collect();
    let [x, y, z] = pose.position.map(|v| fixed(v, 4));
    let lead = format!(
        "Joints at {}; tool point at {x}, {y}, {z} m in the base frame. All axes are those of the base.",
        list.join(", ")
    );
    let worst = (pose.compliance.iter().flatten())
        .zip(pose.compliance_std.iter().flatten())
        .filter(|(v, _)| **v != 0.0)
        .map(|(v, s)| s / v.abs())
        .fold(0.0, f64::max);
    let spread = match worst > 0.0 {
        true => format!(
            "Standard deviations of the entries are in compliance.json; those of the diagonal are at most {} %.",
            parts::percent(
                (0..6)
                    .filter(|r| pose.compliance[*r][*r] > 0.0)
                    .map(|r| pose.compliance_std[r][r] / pose.compliance[r][r])
                    .fold(0.0, f64::max)
            )
        ),
        false => "The stiffness was given without a standard deviation.".to_owned(),
    };
    let title = match found.poses.len() {
        1 => "Compliance of the tool point".to_owned(),
        _ => format!("Compliance of the tool point, pose {}", k + 1),
    };
    let mut section = Section::new(format!("pose-{}", k + 1), title, lead)
        .with(Block::Table(matrix(
            "Compliance matrix K_p: displacement per wrench",
            DISPLACEMENTS,
            WRENCH,
            &pose.compliance,
            spread,
        )))
        .with(Block::Table(principal(found, pose)));
    section = match &pose.stiffness {
        Some(stiffness) => section.with(Block::Table(matrix(
            "Stiffness matrix K_p⁻¹: wrench per displacement",
            ["fx (N)", "fy (N)", "fz (N)", "mx (N·m)", "my (N·m)", "mz (N·m)"],
            [("dx", "per m"), ("dy", "per m"), ("dz", "per m"), ("rx", "per rad"), ("ry", "per rad"), ("rz", "per rad")],
            stiffness,
            String::new(),
        ))),
        None => section.with(parts::info(format!(
            "K_p has rank {}, so K_p⁻¹ does not exist: held motors do not yield in {} of six directions at this pose.",
            pose.rank,
            6 - pose.rank
        ))),
    };
    if let Some(block) = &pose.translational_stiffness {
        section = section.with(Block::Table(Table {
            caption: "Inverse of the translational block of K_p: force per displacement, tool free to turn".into(),
            columns: vec![
                Column::text(""),
                Column::number("dx", "per m"),
                Column::number("dy", "per m"),
                Column::number("dz", "per m"),
            ],
            rows: (["fx (N)", "fy (N)", "fz (N)"].iter().zip(block))
                .map(|(name, row)| {
                    let mut cells = vec![(*name).to_owned()];
                    cells.extend(entries(row, block.as_flattened()));
                    cells
                })
                .collect(),
            note: String::new(),
        }));
    }
    section
}

fn principal(found: &Compliance, pose: &ToolCompliance) -> Table {
    let mut columns = vec![
        Column::text("Direction in the base axes"),
        Column::number("Displacement per force", "m/N"),
    ];
    columns.extend(
        found
            .drives
            .iter()
            .map(|d| Column::number(d.joint.clone(), "%")),
    );
    Table {
        caption:
            "Principal directions of the translational compliance, and the share of each joint"
                .into(),
        columns,
        rows: (pose.principal.iter())
            .map(|own| {
                let arms: f64 = (0..3).map(|r| pose.compliance[r + 3][r + 3]).sum();
                let most = pose.principal[0].compliance.value.max(1e-18 * arms);
                let yields = own.compliance.value > 1e-12 * most;
                let mut cells = vec![
                    own.direction.map(|v| fixed(v, 3)).join(", "),
                    match yields {
                        true => value(&own.compliance),
                        false => "0".to_owned(),
                    },
                ];
                cells.extend(own.shares.iter().map(|s| match yields {
                    true => fixed(100.0 * s, 1),
                    false => "–".to_owned(),
                }));
                cells
            })
            .collect(),
        note: String::new(),
    }
}

/// Formats with fixed decimals; what rounds to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.trim_start_matches(['-', '0', '.']).is_empty() {
        true => text.trim_start_matches('-').to_owned(),
        false => text,
    }
}

/// The map over two joints.
fn chart(found: &Compliance, map: &ComplianceMap) -> Section {
    let [a, b] = map.joints;
    let held: Vec<String> = (found.drives.iter().enumerate())
        .filter(|(k, _)| *k != a && *k != b)
        .map(|(k, drive)| format!("{} {:.3}", drive.joint, map.pose[k]))
        .collect();
    let point = |q: &[f64]| [q[a], q[b]];
    let lead = format!(
        "Largest displacement per force, over all directions of the force: {} m/N at the stiffest pose, {} m/N at the most compliant one.",
        format_significant(map.range[0], 3),
        format_significant(map.range[1], 3)
    );
    Section::new("map", "Compliance over the workspace", lead).with(Block::HeatMap(HeatMap {
        title: "Largest displacement per force".into(),
        x: Axis::new(map.names[0].clone(), map.units[0]),
        y: Axis::new(map.names[1].clone(), map.units[1]),
        value: match map.range[1] > LOGARITHMIC * map.range[0] {
            true => Axis::log("", "µm/N"),
            false => Axis::new("", "µm/N"),
        },
        columns: map.x.clone(),
        rows: map.y.clone(),
        values: (map.values.iter())
            .map(|row| {
                row.iter()
                    .map(|v| v.map_or(f64::NAN, |v| 1e6 * v))
                    .collect()
            })
            .collect(),
        marks: vec![
            (point(&map.stiffest), "stiffest".into()),
            (point(&map.most_compliant), "most compliant".into()),
        ],
        note: match held.is_empty() {
            true => "Blank where the drives do not reach or are near a dead centre.".into(),
            false => format!(
                "Other joints: {}. Blank where the drives do not reach or are near a dead centre.",
                held.join(", ")
            ),
        },
        height: HeatMap::HEIGHT,
    }))
}

/// What the model leaves out.
fn limits() -> Section {
    Section::new("limits", "Not modelled", "").with(Block::List(vec![
        "Elasticity of links, bearings, base and tool: a measured displacement contains it, K_p does not.".into(),
        "The position loop: the motors count as held.".into(),
        "Geometric stiffness: the torque of a preloaded arm changes as it moves. It matters where gravity or the force is large against stiffness over arm.".into(),
        "Stiffness that depends on load or amplitude.".into(),
    ]))
}
