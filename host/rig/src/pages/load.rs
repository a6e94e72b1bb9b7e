//! The page of an identified load.

use super::context::Context;
use super::{parts, treatment};
use rig_load::{
    ControllerNumbers, LoadIdentification, SensorFindings, TorqueTrace, Trace, Value,
    incomplete_numbers, parameter_symbols,
};
use rig_output::{capital, format_significant, format_unit, format_value};
use rig_report::{Axis, Block, Column, Document, Fact, Plot, Role, Section, Series, Table, Tone};

/// Names of the channels of the wrist sensor.
const CHANNELS: [&str; 6] = ["fx", "fy", "fz", "mx", "my", "mz"];

/// Composes the page of an identified load.
pub fn load(
    found: &LoadIdentification,
    controllers: Option<&ControllerNumbers>,
    context: &Context,
) -> Document {
    let mut sections: Vec<Section> = parts::warnings(&[&found.warnings, &context.warnings])
        .into_iter()
        .collect();
    sections.push(body(found));
    sections.extend(not_shown(found));
    if let Some(sensor) = &found.sensor {
        sections.push(readings(sensor, found.mass_checks.is_empty()));
        sections.push(biases(sensor));
    }
    sections.extend(torques(found));
    sections.extend(agreement(found));
    sections.push(for_controllers(found, controllers));
    sections.extend(treated(found));
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: the load at the flange", found.robot),
        subtitle:
            "Mass, centre of mass and inertia of what the flange carries, in the flange frame."
                .into(),
        summary: summary(found, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn half(value: &Value) -> String {
    format_value(value.value, value.half_interval)
}

fn summary(found: &LoadIdentification, context: &Context) -> Vec<Fact> {
    let fact = |label: &str, value: &Value, unit: &str, shown: bool| {
        let fact = Fact::new(label, half(value)).unit(unit);
        match shown {
            true => {
                fact.note("± half the 95 % interval; the program prints ± one standard deviation")
            }
            false => fact
                .note("± half the 95 % interval; not shown by these data")
                .tone(Tone::Notice),
        }
    };
    let mass = fact("Mass", &found.mass, "kg", found.mass_shown());
    let mut facts = vec![match found.mass_shown() {
        true => mass.tone(Tone::Good),
        false => mass,
    }];
    let shown = found.centre_shown();
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let label = format!("Centre of mass {axis}");
        facts.push(fact(&label, &found.centre[k], "m", shown[k]));
    }
    if !found.inertia_shown {
        facts.push(
            Fact::new("Inertia", "not shown")
                .note("the load turns too little for its size")
                .tone(Tone::Notice),
        );
    }
    facts.push(parts::warning_count(
        found.warnings.len() + context.warnings.len(),
    ));
    facts
}

/// The ten parameters, and the body about its centre of mass.
fn body(found: &LoadIdentification) -> Section {
    let parameters = found.parameters.iter().map(|p| {
        let shown = if p.shown { "yes" } else { "no" };
        vec![
            p.symbol().to_owned(),
            half(&p.value),
            format_significant(p.value.std, 2),
            format_unit(p.unit),
            shown.to_owned(),
        ]
    });
    let names = ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
    let central = names.iter().zip(&found.inertia).map(|(name, value)| {
        vec![
            (*name).to_owned(),
            half(value),
            format_significant(value.std, 2),
        ]
    });
    let principal = found.principal.iter().zip(&found.principal_axes);
    let principal = principal.map(|(moment, axis)| {
        vec![
            half(moment),
            format_significant(moment.std, 2),
            axis.map(|v| format!("{v:.4}")).join(", "),
        ]
    });
    let mut section = Section::new(
        "load",
        "Inertial parameters of the load",
        "The flange frame is the frame of the last joint or that of [flange] (TOML), or the frame of the last link (URDF).",
    )
    .with(Block::Table(Table {
        caption: "The ten inertial parameters, inertia about the origin of the flange frame".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::number("Value ± half the 95 % interval", ""),
            Column::number("Standard deviation", ""),
            Column::text("Unit"),
            Column::text("Shown by the data"),
        ],
        rows: parameters.collect(),
        note: "A parameter is shown if its standard deviation is below half of the size that a load of this mass within 0.1 m of the flange has. m·cx m·cy m·cz are the first moments, mass times centre of mass (mx my mz in load.json); the sensor's moments mx my mz are others.".into(),
    }));
    if found.inertia_shown {
        section = section
            .with(Block::Table(Table {
                caption: "Inertia about the centre of mass, axes of the flange".into(),
                columns: vec![
                    Column::text("Entry"),
                    Column::number("Value ± half the 95 % interval", "kg·m²"),
                    Column::number("Standard deviation", "kg·m²"),
                ],
                rows: central.collect(),
                note: String::new(),
            }))
            .with(Block::Table(Table {
                caption: "Principal moments about the centre of mass".into(),
                columns: vec![
                    Column::number("Moment ± half the 95 % interval", "kg·m²"),
                    Column::number("Standard deviation", "kg·m²"),
                    Column::text("Axis in the flange frame"),
                ],
                rows: principal.collect(),
                note: "The uncertainty is to first order: it holds where the moments differ by more than it.".into(),
            }));
    }
    section
}

fn not_shown(found: &LoadIdentification) -> Option<Section> {
    if found.not_shown.is_empty() {
        return None;
    }
    let items = found.not_shown.iter().map(|missing| {
        let pose = missing.pose.as_ref().map_or_else(String::new, |pose| {
            let list: Vec<String> = pose.iter().map(|q| format!("{q:.3}")).collect();
            format!(
                " A pose that would help most: {} (rad or m by joint).",
                list.join(", ")
            )
        });
        format!(
            "{}: {}{pose}",
            parameter_symbols(&missing.parameters).join(", "),
            missing.experiment
        )
    });
    Some(
        Section::new("not-shown", "Parameters that are not determined", "")
            .with(Block::List(items.collect())),
    )
}

/// Readings over time beside the fit.
fn readings(sensor: &SensorFindings, is_unweighed: bool) -> Section {
    let mut section = Section::new(
        "readings",
        "Readings and fit",
        "What the sensor read, and what the identified load with the estimated bias gives.",
    );
    for trace in &sensor.traces {
        for (kind, unit, first) in [("Force", "N", 0), ("Moment", "N·m", 3)] {
            let still = sensor.prepared.is_none();
            section = section.with(Block::Plot(curves(trace, kind, unit, first, still)));
        }
    }
    section.with(Block::Text(format!(
        "RMS of the residual over {} {}: {} N ({} % of what the forces read beside the bias) and {} N·m ({} % of the moments). {}What is not modelled: cables that pull, contact, elasticity, gain and crosstalk of the sensor.",
        parts::count(sensor.rows),
        match sensor.prepared {
            Some(_) => "rows",
            None => "poses",
        },
        format_significant(sensor.residual[0], 3),
        format_significant(100.0 * sensor.share[0], 2),
        format_significant(sensor.residual[1], 3),
        format_significant(100.0 * sensor.share[1], 2),
        sensor.noise.map_or_else(String::new, |[force, moment]| format!(
            "{} would leave {} N and {} N·m. ",
            match sensor.prepared.is_some() {
                true => "Noise as that of the readings above the band",
                false => "Noise by which the rows of a pose differ",
            },
            format_significant(force, 3),
            format_significant(moment, 3)
        )),
    )))
    .with(Block::Text(format!(
        "Gains of the sensor (deviations are one standard deviation), {}.",
        sensor.gain_error.words()
    )))
    .with(Block::Text(format!("{}.", capital(&sensor.assumed(is_unweighed)))))
}

/// Draws one kind of readings with the fit; poses (`still`) are not joined by lines, because nothing was recorded between.
fn curves(trace: &Trace, kind: &str, unit: &str, first: usize, still: bool) -> Plot {
    const ROLES: [Role; 3] = [Role::Measured, Role::Model, Role::After];
    let mut plot = Plot::new(
        format!("{kind}: {}", trace.recording),
        Axis::new("time", "s"),
        Axis::new(kind.to_lowercase(), unit),
    )
    .note(match still {
        true => "Dots: readings of each pose. Dashes: identified load with bias.",
        false => "Dots: readings. Lines: identified load with bias.",
    });
    for k in 0..3 {
        let channel = CHANNELS[first + k];
        let role = ROLES[k];
        plot = plot
            .with(Series::points(
                channel,
                role,
                trace.time.clone(),
                trace.read[first + k].clone(),
            ))
            .with(fit(
                format!("{channel}, fit"),
                role,
                trace,
                first + k,
                still,
            ));
    }
    plot
}

/// The fit of a channel: a line, or one dash a pose.
fn fit(name: String, role: Role, trace: &Trace, channel: usize, still: bool) -> Series {
    let (time, values) = (&trace.time, &trace.predicted[channel]);
    if !still {
        return Series::line(name, role, time.clone(), values.clone());
    }
    let steps = time.windows(2).map(|two| (two[1] - two[0]).abs());
    let step = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    let half = if step.is_finite() { 0.3 * step } else { 0.3 };
    let x = time.iter().flat_map(|t| [t - half, t + half, f64::NAN]);
    let y = values.iter().flat_map(|v| [*v, *v, f64::NAN]);
    Series::line(name, role, x.collect(), y.collect())
}

/// Bias of the sensor by recording.
fn biases(sensor: &SensorFindings) -> Section {
    let row = |name: String, values: &[f64; 6]| {
        let mut cells = vec![name];
        cells.extend(values.iter().map(|v| format_significant(*v, 4)));
        cells
    };
    let mut rows = Vec::new();
    for bias in &sensor.biases {
        let name = match bias.temperature {
            Some(at) => format!("{} at temp {}", bias.recording, format_significant(at, 4)),
            None => bias.recording.clone(),
        };
        rows.push(row(name, &bias.bias));
        if let Some(drift) = &bias.drift {
            rows.push(row("change from begin to end".into(), drift));
        }
        for (time, after) in &bias.jumps {
            rows.push(row(format!("after a jump near {time:.1} s"), after));
        }
    }
    if let Some(warming) = &sensor.warming {
        rows.push(row("per unit of temp".into(), warming));
    }
    let mut columns = vec![Column::text("Recording")];
    columns.extend(
        CHANNELS
            .iter()
            .enumerate()
            .map(|(k, name)| Column::number(*name, if k < 3 { "N" } else { "N·m" })),
    );
    let [roll, pitch, yaw] = sensor.rotation.map(|v| format!("{v:.4}"));
    Section::new("bias", "Bias and axes of the sensor", "")
        .with(Block::Table(Table {
            caption: "Bias, as read without a load".into(),
            columns,
            rows,
            note: String::new(),
        }))
        .with(Block::Text(format!(
            "Axes of the sensor in the flange frame: roll {roll}, pitch {pitch}, yaw {yaw} rad.{}",
            setting(sensor)
        )))
}

/// Says what else differs from the description, or was not in it.
fn setting(sensor: &SensorFindings) -> String {
    let vector = |v: [f64; 3]| v.map(|v| format!("{v:.4}")).join(", ");
    let parts = [
        (sensor.position).map(|at| format!(" Origin of the sensor: [{}] m.", vector(at))),
        (sensor.gravity).map(|g| format!(" Gravity in the base frame: [{}] m/s².", vector(g))),
        (sensor.delay).map(|delay| {
            let ms = format_significant(1e3 * delay, 3);
            format!(" Delay of the readings against the positions: {ms} ms.")
        }),
        (sensor.reads_found.as_ref()).map(|found| format!(" {found}")),
    ];
    parts.into_iter().flatten().collect()
}

fn torques(found: &LoadIdentification) -> Option<Section> {
    let torque = found.torque.as_ref()?;
    let rms = |value: &Option<f64>, none: &str| {
        value.map_or(none.to_owned(), |rms| format_significant(rms, 3))
    };
    let friction = |joint: usize| {
        let own = torque.load_friction.iter().find(|own| own.joint == joint);
        own.map_or("not shown".to_owned(), |own| {
            format_value(own.coefficient, own.std)
        })
    };
    let rows = torque.joints.iter().enumerate();
    let source = match torque.with_unloaded {
        true => "The recordings without the load gave the parameters of the robot.",
        false => {
            "The description gave the torque of the robot without the load. Its own uncertainty is not in the standard deviations."
        }
    };
    let mut section = Section::new("torques", "Joint torques", source).with(Block::Table(Table {
        caption: "Residual of the torques, and friction that grows with the load".into(),
        columns: vec![
            Column::text("Joint"),
            Column::number("RMS", "N·m or N"),
            Column::number("Noise alone would leave", "N·m or N"),
            Column::number("Friction per torque carried", ""),
        ],
        rows: rows
            .map(|(k, name)| {
                vec![
                    name.clone(),
                    rms(&torque.residual[k], "not used"),
                    rms(&torque.noise[k], "not known"),
                    friction(k),
                ]
            })
            .collect(),
        note: "Noise: that of the torque above the band of the fit, as if it were white. Friction per torque carried: ± one standard deviation; \"not shown\" where the data show no such friction.".into(),
    }));
    for trace in &torque.traces {
        section = section.with(Block::Plot(torque_curves(trace, &torque.joints)));
    }
    Some(section)
}

/// The torque of a joint over time beside the fit.
fn torque_curves(trace: &TorqueTrace, joints: &[String]) -> Plot {
    let joint = joints.get(trace.joint).map_or("", String::as_str);
    Plot::new(
        format!("Torque of {joint}: {}", trace.recording),
        Axis::new("time", "s"),
        Axis::new("torque", "N·m or N"),
    )
    .note("Dots: torque as recorded, in the band of the fit. Line: robot with the identified load.")
    .with(Series::points(
        "recorded",
        Role::Measured,
        trace.time.clone(),
        trace.read.clone(),
    ))
    .with(Series::line(
        "fit",
        Role::Model,
        trace.time.clone(),
        trace.predicted.clone(),
    ))
}

fn agreement(found: &LoadIdentification) -> Option<Section> {
    let both = found.agreement.as_ref()?;
    let rows = found.parameters.iter().enumerate().map(|(k, p)| {
        vec![
            p.symbol().to_owned(),
            format_value(both.by_sensor[k], both.by_sensor_std[k]),
            format_value(both.by_torque[k], both.by_torque_std[k]),
            format_unit(p.unit),
        ]
    });
    Some(
        Section::new("agreement", "Sensor and torques", "").with(Block::Table(Table {
            caption: "The load by each, ± one standard deviation".into(),
            columns: vec![
                Column::text("Parameter"),
                Column::number("By the sensor", ""),
                Column::number("By the torques", ""),
                Column::text("Unit"),
            ],
            rows: rows.collect(),
            note: format!(
                "Probability that they differ by chance as much: {} (F test over {} directions that both show).",
                format_significant(both.chance, 2),
                both.directions
            ),
        })),
    )
}

/// Filter and rows behind the load.
fn treated(found: &LoadIdentification) -> Option<Section> {
    let mut section = Section::new("rows", "Filter and rows", "");
    if let Some(sensor) = &found.sensor {
        let mut text = format!(
            "Sensor: {} {} were used",
            parts::count(sensor.rows),
            match sensor.prepared {
                Some(_) => "rows",
                None => "poses",
            }
        );
        text += &match sensor.saturated {
            0 => ".".to_owned(),
            cut => format!(
                ", and {} were left out because a channel was saturated.",
                parts::count(cut)
            ),
        };
        if sensor.prepared.is_none() {
            text += " Poses at rest are not filtered.";
        }
        section = section.with(Block::Text(text));
    }
    if let Some(plan) = found.sensor.as_ref().and_then(|s| s.prepared.as_ref()) {
        section = section.with(Block::List(treatment::sentences_of_motion(plan)));
    }
    if let Some(torque) = &found.torque {
        section = section
            .with(Block::Text("Joint torques:".into()))
            .with(Block::List(treatment::sentences(&torque.prepared)));
    }
    (!section.blocks.is_empty()).then_some(section)
}

fn for_controllers(found: &LoadIdentification, numbers: Option<&ControllerNumbers>) -> Section {
    let Some(numbers) = numbers else {
        let section = Section::new(
            "controllers",
            "Settings for robot controllers",
            "These data do not show the mass and the whole centre of mass, so there are no complete numbers for a controller.",
        );
        let shown =
            incomplete_numbers(found).map(|text| Block::Text(format!("{}.", capital(&text))));
        return shown.into_iter().fold(section, Section::with);
    };
    let lead = match found.inertia_shown {
        true => "The flange frame of the description must be that of the controller.",
        false => {
            "The flange frame of the description must be that of the controller. The inertia is not shown by the data and is given as zero."
        }
    };
    let section = Section::new("controllers", "Settings for robot controllers", lead);
    (numbers.labelled().into_iter()).fold(section, |section, (maker, units, own)| {
        section
            .with(Block::Text(format!("{maker} ({units}):")))
            .with(Block::Code(own.to_owned()))
    })
}
