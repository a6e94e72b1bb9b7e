//! The page of what is in a log.

use std::path::Path;

use super::context::Context;
use super::parts;
use rig_data::contents::{Channel, Contents, Topic};
use rig_output::{format_significant, format_time, format_trimmed};
use rig_report::{Axis, Block, Column, Document, Fact, Plot, Role, Section, Series, Table, Tone};

/// Height of the plot of a channel, px.
const HEIGHT: u32 = 240;

/// Number of plots of a topic that are visible at once; further ones unfold.
const VISIBLE: usize = 12;

/// Composes the page of what a file holds.
pub fn inspect(path: &Path, found: &Contents, context: &Context) -> Document {
    let name = path.file_name().map_or_else(
        || path.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    );
    let mut sections = vec![columns(found)];
    for (k, topic) in found.topics.iter().enumerate() {
        sections.push(section(k, topic));
    }
    sections.push(parts::repeat(context));
    Document {
        title: format!("{name}: what is in it"),
        subtitle: format!("{}, {} bytes", found.format, parts::count(found.bytes)),
        summary: summary(found),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn summary(found: &Contents) -> Vec<Fact> {
    let rows: u64 = found.topics.iter().map(|topic| topic.rows).sum();
    let channels: usize = found.topics.iter().map(|topic| topic.channels.len()).sum();
    let is_bag = found.topics.iter().any(|topic| !topic.name.is_empty());
    let mut facts = vec![
        Fact::new(if is_bag { "Messages" } else { "Rows" }, parts::count(rows)),
        Fact::new("Channels", parts::count(channels as u64)),
    ];
    let faults = found.faults.len() + found.proposal.missing.len();
    facts.push(match faults {
        0 => Fact::new("Missing or damaged", "nothing").tone(Tone::Good),
        n => Fact::new("Missing or damaged", n.to_string())
            .note("listed below")
            .tone(Tone::Warning),
    });
    facts
}

/// The columns that the channels probably are, and what is missing.
fn columns(found: &Contents) -> Section {
    let proposal = &found.proposal;
    let mut section = Section::new(
        "columns",
        "Probable columns",
        "By the names of the channels and the size of their values. Look at the plots before you rely on them.",
    );
    for fault in found
        .faults
        .iter()
        .chain(&proposal.missing)
        .chain(&proposal.doubts)
    {
        section = section.with(parts::warning(fault.clone()));
    }
    for remark in &found.remarks {
        section = section.with(parts::info(remark.clone()));
    }
    if !proposal.columns.is_empty() {
        section = section.with(Block::Table(Table {
            caption: "Columns of a recording and the channels that they probably are".into(),
            columns: ["Column", "Channel", "Unit in the file", "Why"]
                .map(Column::text)
                .into(),
            rows: (proposal.columns.iter())
                .map(|own| {
                    let unit = own.unit.unwrap_or("SI").to_owned();
                    vec![own.column.clone(), own.full_name(), unit, own.why.clone()]
                })
                .collect(),
            note: String::new(),
        }));
    }
    if !proposal.options.is_empty() {
        section = section
            .with(Block::Text("Options for the other commands:".into()))
            .with(Block::Code(proposal.options.join(" \\\n")));
    }
    match &proposal.refusal {
        Some(why) => section.with(parts::warning(format!("Refused by `rig identify`: {why}"))),
        None if proposal.is_plain && !proposal.columns.is_empty() => {
            section.with(Block::Text(without_options(found).into()))
        }
        None => section,
    }
}

/// Says which commands find the proposed columns without options.
pub fn without_options(found: &Contents) -> &'static str {
    match found.topics.iter().any(|topic| !topic.name.is_empty()) {
        true => {
            "The other commands find these columns without options, if the robot's joints have these names; `rig load` reads those of a wrist sensor."
        }
        false => "The other commands find these columns without options.",
    }
}

/// Says in words where the time of a topic comes from, and how even it is.
pub fn time_in_words(topic: &Topic) -> String {
    let time = &topic.time;
    let unit = time
        .unit
        .map_or_else(String::new, |unit| format!(" {unit}"));
    let mut words = vec![format!("time by {}", time.source)];
    if let (Some(first), Some(last)) = (time.first, time.last) {
        words.push(format!(
            "{} to {}{unit}",
            format_time(first),
            format_time(last)
        ));
    }
    if let (Some(period), Some(rate)) = (time.period, time.rate) {
        let kind = if time.irregular {
            "irregular, about"
        } else {
            "every"
        };
        words.push(format!(
            "{kind} {}{unit} ({} Hz)",
            format_trimmed(period, 4),
            format_trimmed(rate, 4)
        ));
    }
    if let Some(gap) = time.longest_gap {
        words.push(format!(
            "{} gaps, the longest {}{unit} before row {}",
            time.gaps,
            format_trimmed(gap.step, 4),
            gap.row
        ));
    }
    if let Some(step) = time.first_not_growing {
        words.push(format!(
            "time stands still {} times and jumps back {} times, first in row {}",
            time.repeated - time.copies,
            time.backwards,
            step.row
        ));
    }
    if time.copies > 0 {
        words.push(format!(
            "{} rows are exact copies of the row before them and left out by the other commands",
            time.copies
        ));
    }
    if time.missing > 0 {
        words.push(format!("{} rows without a time", time.missing));
    }
    words.join(", ")
}

fn section(k: usize, topic: &Topic) -> Section {
    let title = match topic.name.as_str() {
        "" => "Table".to_owned(),
        name => format!("{name} ({})", topic.of),
    };
    let unit = topic.time.unit.unwrap_or_default();
    let lead = format!(
        "{} rows; {}.",
        parts::count(topic.rows),
        time_in_words(topic)
    );
    let mut section = Section::new(format!("topic-{k}"), title, lead);
    if let Some(why) = &topic.unreadable {
        section = section.with(parts::warning(format!("Not decoded: {why}.")));
    }
    if topic.channels.is_empty() {
        return section;
    }
    section = section.with(Block::Table(table(topic)));
    let plots: Vec<Block> = (topic.channels.iter())
        .filter(|channel| channel.values > 0 && !channel.is_constant())
        .map(|channel| Block::Plot(plot(channel, unit)))
        .collect();
    let mut plots = plots.into_iter();
    for plot in plots.by_ref().take(VISIBLE) {
        section = section.with(plot);
    }
    let rest: Vec<Block> = plots.collect();
    if !rest.is_empty() {
        section = section.with(Block::Details {
            summary: format!("{} more plots", rest.len()),
            blocks: rest,
        });
    }
    section
}

fn table(topic: &Topic) -> Table {
    let number =
        |value: Option<f64>| value.map_or_else(|| "–".into(), |v| format_significant(v, 4));
    Table {
        caption: "Channels".into(),
        columns: vec![
            Column::text("Channel"),
            Column::text("Unit by name"),
            Column::number("Smallest", ""),
            Column::number("Largest", ""),
            Column::number("Mean", ""),
            Column::number("Standard deviation", ""),
            Column::number("Smallest change", ""),
            Column::number("Rows without number", ""),
        ],
        rows: (topic.channels.iter())
            .map(|own| {
                vec![
                    own.name.clone(),
                    own.unit.unwrap_or("–").to_owned(),
                    number(own.min),
                    number(own.max),
                    number(own.mean),
                    number(own.std),
                    number(own.smallest_change),
                    parts::count(own.missing),
                ]
            })
            .collect(),
        note:
            "Smallest change: from row to row, not zero; near the resolution of a quantised sensor."
                .into(),
    }
}

fn plot(channel: &Channel, unit: &str) -> Plot {
    let picture = &channel.picture;
    let mut plot = Plot::new(
        channel.name.clone(),
        Axis::new("time", unit),
        Axis::new(String::new(), channel.unit.unwrap_or_default()),
    );
    plot.height = HEIGHT;
    let is_thin = picture
        .low
        .iter()
        .zip(&picture.high)
        .all(|(low, high)| !(high > low));
    if !is_thin {
        plot = plot.with(Series::band(
            "range within a stretch",
            Role::Other,
            picture.t.clone(),
            picture.low.clone(),
            picture.high.clone(),
        ));
    }
    let middle = picture
        .low
        .iter()
        .zip(&picture.high)
        .map(|(low, high)| 0.5 * (low + high));
    let name = if is_thin {
        "value"
    } else {
        "middle of the range"
    };
    plot.with(Series::line(
        name,
        Role::Measured,
        picture.t.clone(),
        middle.collect(),
    ))
}
