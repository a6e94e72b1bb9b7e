//! The page of control laws in a simulated closed loop.

use super::context::Context;
use super::parts;
use rig_control::{Adaptation, Contact, Evaluation, LawKind, Robustness, Tracking};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit};
use rig_report::{
    Axis, Block, Column, Document, Fact, Marker, Plot, Role, Section, Series, Table, Tone,
};

/// Overshoot of a force that counts as good, 1.
const GOOD_OVERSHOOT: f64 = 0.1;

/// Composes the page.
pub fn control(robot: &Robot, found: &Evaluation, context: &Context) -> Document {
    let warned = found.warnings();
    let mut sections: Vec<Section> = parts::warnings(&[&warned]).into_iter().collect();
    if !found.notes.is_empty() {
        let notes = found.notes.iter().map(|note| parts::info(note.as_str()));
        let section = Section::new("assumed", "Assumptions", "");
        sections.push(notes.fold(section, Section::with));
    }
    if !found.tracking.is_empty() {
        sections.push(tracking(robot, &found.tracking));
        sections.push(joints(robot, &found.tracking));
    }
    let learnt = found
        .tracking
        .iter()
        .filter_map(|own| Some((own, own.adaptation.as_ref()?)));
    sections.extend(
        learnt
            .enumerate()
            .map(|(k, (own, learnt))| adaptation(k, own, learnt)),
    );
    if !found.contact.is_empty() {
        sections.push(contact(found));
    }
    sections.push(settings(found));
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: control laws", found.robot),
        subtitle:
            "Laws in a simulated closed loop: errors, forces, and robustness to wrong parameters."
                .into(),
        summary: summary(found, warned.len()),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn short(value: f64) -> String {
    format_significant(value, 3)
}

/// Name of a law with its model, the latter only if there are several.
fn label(law: &str, model: &str, several: bool) -> String {
    match several {
        true => format!("{law}, {model}"),
        false => law.to_owned(),
    }
}

fn several<'a>(mut models: impl Iterator<Item = &'a str>) -> bool {
    let first = models.next();
    models.any(|model| Some(model) != first)
}

/// Role and dashes of the k-th series; a second round of the roles is dashed.
fn drawn(k: usize, series: Series) -> Series {
    match k < Role::ALL.len() {
        true => series,
        false => series.dashed(),
    }
}

fn role(k: usize) -> Role {
    Role::ALL[k % Role::ALL.len()]
}

/// Returns the tone of a result.
fn tone(good: bool) -> Tone {
    match good {
        true => Tone::Good,
        false => Tone::Warning,
    }
}

fn summary(found: &Evaluation, warned: usize) -> Vec<Fact> {
    let mut facts = Vec::new();
    if warned > 0 {
        facts.push(parts::warning_count(warned));
    }
    let best = (found.tracking.iter()).min_by(|a, b| a.tool_rms.total_cmp(&b.tool_rms));
    if let Some(best) = best {
        facts.push(
            Fact::new("Smallest tool error", short(1e3 * best.tool_rms))
                .unit("mm RMS")
                .note(format!("{} with {}", best.law.name(), best.model))
                .tone(tone(best.warnings.is_empty())),
        );
    }
    // The smallest of one law is that law's.
    let several = found.tracking.iter().filter(|_| found.tracking.len() > 1);
    for own in several.take(3) {
        facts.push(
            Fact::new(own.law.name(), short(1e3 * own.tool_rms))
                .unit("mm RMS")
                .note(own.model.clone()),
        );
    }
    for own in found.contact.iter().take(4) {
        let before = own.slide_peak.map_or_else(String::new, |_| {
            let before = short(100.0 * own.overshoot_before_slide);
            format!(", {before} % before the slide")
        });
        let good = own.overshoot <= GOOD_OVERSHOOT && own.warnings.is_empty();
        facts.push(match own.is_steady() {
            true => Fact::new(
                format!("Force overshoot, {}", own.law.name()),
                short(100.0 * own.overshoot),
            )
            .unit("%")
            .note(format!("{}{before}", own.model))
            .tone(tone(good)),
            false => Fact::new(format!("Contact, {}", own.law.name()), "not steady")
                .note(format!("{}: {} bounces", own.model, own.bounces))
                .tone(tone(false)),
        });
    }
    facts
}

fn robust(own: Option<&Robustness>, factor: f64) -> Vec<String> {
    match own {
        Some(own) => vec![
            short(factor * own.median),
            short(factor * own.worst),
            format!("{} of {}", own.failed, own.draws),
        ],
        None => Vec::new(),
    }
}

/// Columns of the robustness, if any law has one.
fn robust_columns(own: Option<&Robustness>, unit: &str) -> Vec<Column> {
    own.map_or_else(Vec::new, |own| {
        let share = short(100.0 * own.share);
        vec![
            Column::number(format!("Median, ± {share} %"), unit),
            Column::number(format!("Worst, ± {share} %"), unit),
            Column::text("Failed"),
        ]
    })
}

fn tracking(robot: &Robot, laws: &[Tracking]) -> Section {
    let many = several(laws.iter().map(|own| own.model.as_str()));
    let mut columns = vec![
        Column::text("Law"),
        Column::text("Model"),
        Column::number("Tool error, RMS", "mm"),
        Column::number("Tool error, largest", "mm"),
    ];
    columns.extend(robust_columns(laws[0].robustness.as_ref(), "mm"));
    let rows = laws.iter().map(|own| {
        let mut row = vec![
            own.law.name().to_owned(),
            own.model.clone(),
            short(1e3 * own.tool_rms),
            short(1e3 * own.tool_largest),
        ];
        row.extend(robust(own.robustness.as_ref(), 1e3));
        row
    });
    let mut section = Section::new(
        "tracking",
        "Tracking",
        "The error is the reference minus the true position, not the measured one.",
    )
    .with(Block::Table(Table {
        caption: "Errors of the laws".into(),
        columns,
        rows: rows.collect(),
        note: match &laws[0].robustness {
            Some(_) => "Median and worst are RMS tool errors with random wrong parameters of the law's model. Failed motions were unstable, or the tool did not reach the surface.".into(),
            None => String::new(),
        },
    }));
    for (j, joint) in robot.joints.iter().enumerate() {
        let [unit, _, torque] = parts::units(joint.kind);
        let plot = |title: String, axis: Axis, pick: &dyn Fn(&Tracking) -> Vec<f64>| {
            laws.iter().enumerate().fold(
                Plot::new(title, Axis::new("time", "s"), axis),
                |plot, (k, own)| {
                    let name = label(own.law.name(), &own.model, many);
                    let series = Series::line(name, role(k), own.time.clone(), pick(own));
                    plot.with(drawn(k, series))
                },
            )
        };
        section = section.with(Block::Plot(plot(
            format!("Tracking error of {}", joint.name),
            Axis::new("error", &format!("m{unit}")),
            &|own| own.errors[j].iter().map(|e| 1e3 * e).collect(),
        )));
        section = section.with(Block::Details {
            summary: format!("Torque of {}", joint.name),
            blocks: vec![Block::Plot(plot(
                format!("Torque of {}", joint.name),
                Axis::new("torque", torque),
                &|own| own.torques[j].clone(),
            ))],
        });
    }
    section
}

fn joints(robot: &Robot, laws: &[Tracking]) -> Section {
    let rows = laws.iter().flat_map(|own| {
        own.joints.iter().zip(&robot.joints).map(|(found, joint)| {
            let [unit, _, torque] = parts::units(joint.kind);
            vec![
                own.law.name().to_owned(),
                own.model.clone(),
                found.name.clone(),
                format!("{} m{unit}", short(1e3 * found.rms)),
                format!("{} m{unit}", short(1e3 * found.largest)),
                format!("{} {torque}", short(found.torque)),
                parts::percent(found.saturated),
            ]
        })
    });
    Section::new("joints", "Errors and torques by joint", "").with(Block::Table(Table {
        caption: "Errors and torques of each joint".into(),
        columns: vec![
            Column::text("Law"),
            Column::text("Model"),
            Column::text("Joint"),
            Column::number("Error, RMS", ""),
            Column::number("Error, largest", ""),
            Column::number("Torque, RMS", ""),
            Column::number("At the limit", "%"),
        ],
        rows: rows.collect(),
        note: String::new(),
    }))
}

fn adaptation(k: usize, own: &Tracking, learnt: &Adaptation) -> Section {
    let rows = learnt.parameters.iter().map(|p| {
        vec![
            p.expression.clone(),
            short(p.truth),
            short(p.start),
            short(p.end),
            format_unit(p.unit),
            parts::percent(p.excited),
        ]
    });
    let [error, torque] = &learnt.course;
    let plot = |title: &str, axis: Axis, values: Vec<f64>, name: &str| {
        Plot::new(title, Axis::new("time", "s"), axis).with(Series::line(
            name,
            Role::Model,
            learnt.time.clone(),
            values,
        ))
    };
    Section::new(
        format!("adaptation-{}", k + 1),
        format!("Adaptation, {}", own.model),
        format!(
            "The motion excites {} of {} directions of the base parameters: an error of one parameter size there makes at least 1 % of the motion's torque. The law reduces the torque error in these directions: their error went from {} to {} parameter sizes, the torque error of the model from {} to {} % of the limits. Errors in the other directions make less torque than that, and hardly change.",
            learnt.excited,
            learnt.count,
            short(learnt.error[0]),
            short(learnt.error[1]),
            short(100.0 * learnt.torque_error[0]),
            short(100.0 * learnt.torque_error[1])
        ),
    )
    .with(Block::Plot(plot(
        "Torque that the parameter errors make along the motion",
        Axis::new("torque error, RMS", "% of the limits"),
        torque.iter().map(|v| 100.0 * v).collect(),
        "all parameters",
    )))
    .with(Block::Plot(plot(
        "Error of the parameters in the excited directions",
        Axis::new("error", "sizes of parameters"),
        error.clone(),
        "excited directions",
    )))
    .with(Block::Table(Table {
        caption: "Base parameters".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::number("True", ""),
            Column::number("Start", ""),
            Column::number("End", ""),
            Column::text("Unit"),
            Column::number("In excited directions", "%"),
        ],
        rows: rows.collect(),
        note: "In excited directions: share of the parameter that lies there. It does not say that the value converges. A single parameter converges only if its share is 100 % and the error in all excited directions falls to zero; weakly excited directions fall slowly.".into(),
    }))
}

/// Returns the measures of a force until the slide.
fn contact_row(own: &Contact) -> Vec<String> {
    let some = |value: Option<f64>| value.map_or("–".to_owned(), short);
    vec![
        short(1e3 * own.impact_speed),
        some(own.rise),
        short(100.0 * own.overshoot_before_slide),
        some(own.settling),
        short(own.steady_error),
        own.bounces.to_string(),
    ]
}

/// Returns the tables of forces: until the slide, during it, and with wrong parameters.
fn force_tables(laws: &[Contact]) -> Vec<Block> {
    let law = || vec![Column::text("Law"), Column::text("Model")];
    let name = |own: &Contact| vec![own.law.name().to_owned(), own.model.clone()];
    let table = |caption: &str, columns: Vec<Column>, rows: Vec<Vec<String>>, note: &str| {
        Block::Table(Table {
            caption: caption.into(),
            columns: law().into_iter().chain(columns).collect(),
            rows: (laws.iter().zip(rows))
                .map(|(own, row)| name(own).into_iter().chain(row).collect())
                .collect(),
            note: note.into(),
        })
    };
    let mut tables = vec![table(
        "Forces before the slide",
        vec![
            Column::number("Impact speed", "mm/s"),
            Column::number("Rise", "s"),
            Column::number("Overshoot", "%"),
            Column::number("Settling", "s"),
            Column::number("Steady error", "N"),
            Column::number("Bounces", ""),
        ],
        laws.iter().map(contact_row).collect(),
        "Rise: 10 to 90 %. Settling: from contact until the force stays within 5 %. Bounces are those of the whole motion.",
    )];
    if laws.iter().any(|own| own.slide_peak.is_some()) {
        let some = |value: Option<f64>| value.map_or("–".to_owned(), short);
        let row = |own: &Contact| {
            vec![
                some(own.slide_peak),
                some(own.slide_peak.map(|_| 100.0 * own.overshoot)),
                some(own.slide_force),
                some(own.slide_error.map(|v| 1e3 * v)),
            ]
        };
        tables.push(table(
            "Forces during the slide",
            vec![
                Column::number("Largest force", "N"),
                Column::number("Overshoot, whole contact", "%"),
                Column::number("Force error, RMS", "N"),
                Column::number("Path error, RMS", "mm"),
            ],
            laws.iter().map(row).collect(),
            "From the start of the slide to the end of the motion.",
        ));
    }
    let columns = robust_columns(laws[0].robustness.as_ref(), "%");
    if !columns.is_empty() {
        let rows = laws
            .iter()
            .map(|own| robust(own.robustness.as_ref(), 100.0));
        tables.push(table(
            "Overshoot with wrong parameters",
            columns,
            rows.collect(),
            "Overshoot of the whole contact, slide included.",
        ));
    }
    tables
}

fn contact(found: &Evaluation) -> Section {
    let laws = &found.contact;
    let many = several(laws.iter().map(|own| own.model.as_str()));
    let mut force = Plot::new(
        "Force on the surface",
        Axis::new("time", "s"),
        Axis::new("force", "N"),
    );
    let mut depth = Plot::new(
        "Tool along the normal",
        Axis::new("time", "s"),
        Axis::new("distance from the start", "mm"),
    );
    let wanted = laws[0].force;
    let ends: Vec<f64> = [laws[0].time.first(), laws[0].time.last()]
        .into_iter()
        .flatten()
        .copied()
        .collect();
    force = force.with(Series::band(
        "wanted ± 10 %",
        Role::Noise,
        ends.clone(),
        vec![0.9 * wanted; ends.len()],
        vec![1.1 * wanted; ends.len()],
    ));
    for (k, own) in laws.iter().enumerate() {
        let line = |values: &[f64], factor: f64| {
            let values = values.iter().map(|v| factor * v).collect();
            let name = label(own.law.name(), &own.model, many);
            drawn(k, Series::line(name, role(k), own.time.clone(), values))
        };
        force = force.with(line(&own.forces, 1.0));
        depth = depth.with(line(&own.positions[0], 1e3));
    }
    let mut lead = String::new();
    if let Some(task) = &found.task {
        if task.slide > 0.0 {
            // Without a label, which would cover the peak of the force.
            force = force.mark(Marker::vertical(task.slide_start, ""));
            force.note = "The vertical line is the start of the slide.".into();
        }
        depth = depth.mark(Marker::horizontal(1e3 * task.surface.gap, "surface"));
        lead = format!(
            "Wanted force {} N. The surface has {} N/m, the tool an inertia of {} kg along the normal. The hybrid law plans its approach at {} mm/s or less; the impedance law enters along a polynomial. The impact speeds in the table are measured.",
            short(task.force),
            short(task.surface.stiffness),
            short(task.inertia[0]),
            short(1e3 * task.approach)
        );
    }
    let section = Section::new("contact", "Contact", lead)
        .with(Block::Plot(force))
        .with(Block::Plot(depth));
    force_tables(laws).into_iter().fold(section, Section::with)
}

fn settings(found: &Evaluation) -> Section {
    let s = &found.settings;
    let delay = match s.delay {
        true => "acts one tick after its measurement",
        false => "acts in the tick of its measurement",
    };
    Section::new("settings", "Control loop", "").with(Block::List(vec![
        format!(
            "{} ticks a second; the torque {delay} and is held in between.",
            short(s.rate)
        ),
        format!(
            "Position loops: {} Hz undamped natural frequency, damping ratio {}.",
            short(s.bandwidth),
            short(s.damping)
        ),
        format!(
            "Dry friction is compensated by {} % in motion and {} % near rest{}.",
            short(100.0 * s.friction_gain),
            short(100.0 * s.friction_gain_at_rest.min(s.friction_gain)),
            match found.contact.iter().any(|own| own.law == LawKind::Hybrid) {
                true => "; by the hybrid law near rest as in motion",
                false => "",
            }
        ),
        format!("Noise of the measured force: {} N.", short(s.force_noise)),
    ]))
}
