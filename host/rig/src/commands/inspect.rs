//! `rig inspect`: what is in a log, before anything is done with it.

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::overwrite::refuse_folder;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::contents::{Channel, Contents, Topic, contents};
use rig_output::{can_take, folder, format_short, format_trimmed, write_whole};

/// File with the result for programs.
const JSON: &str = "inspect.json";
/// File with the plots.
const REPORT: &str = "report.html";

/// Number of channels of a topic that are listed on the terminal; the report has all.
const LISTED: usize = 40;

/// Shows what is in a log: topics, channels, rates, gaps, ranges, and which columns they probably are.
///
/// Takes text tables (CSV and the like), MCAP files and folders of rosbag2, also those that other commands refuse: it says
/// what is there and what is missing. It proposes the options --map and --unit for the other commands. With --out it
/// writes report.html with a plot of every channel, and inspect.json.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// The log: a CSV or MCAP file, or a folder of rosbag2
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Robot description, TOML or URDF: columns are proposed in the order of its joints, by their names
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    #[command(flatten)]
    chain: ChainArg,
    #[command(flatten)]
    report: ReportArg,
    /// Folder for report.html and inspect.json
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read, or of a format that is not supported.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    if let Some(out) = &args.out {
        can_take(out, &[JSON, REPORT])?;
        refuse_folder(out, &[], args.force)?;
    } else if args.report.is_markdown() {
        return Err(CommandError::Sentence(
            "--markdown needs a folder for the report; give it with --out.".into(),
        ));
    }
    let robot = match &args.robot {
        Some(path) => Some(described(path, &args.chain, ui)?.robot),
        None => None,
    };
    let mut progress = ui.progress("reading", 1);
    // The second time as `rig identify` reads it.
    let total = 2 * length(&args.file);
    let found = contents(&args.file, robot.as_ref(), &mut |bytes| {
        progress.at_of(bytes, total)
    })?;
    drop(progress);
    let json = as_json(&args.file, &found);
    match ui.is_json() {
        true => ui.print_json(json.trim_end()),
        false => print(&args.file, &found, ui),
    }
    let Some(out) = &args.out else {
        return Ok(());
    };
    folder(out)?;
    let context = Context {
        command: ui.command_line(),
        ..Context::default()
    };
    write_whole(&out.join(JSON), json.as_bytes())?;
    args.report.write(
        &out.join(REPORT),
        &pages::inspect(&args.file, &found, &context),
    )?;
    args.report.tell(&out.join(REPORT), ui);
    Ok(())
}

/// Returns the length of a file, or of the files in a folder, bytes.
fn length(path: &Path) -> u64 {
    let of = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().map(|entry| of(&entry.path())).sum(),
        Err(_) => of(path),
    }
}

fn as_json(path: &Path, found: &Contents) -> String {
    let mut value = serde_json::json!({
        "schema": "rig-inspect/1",
        "file": path.display().to_string(),
    });
    if let (Some(object), Ok(serde_json::Value::Object(own))) =
        (value.as_object_mut(), serde_json::to_value(found))
    {
        object.extend(own);
    }
    format!("{value:#}\n")
}

fn print(path: &Path, found: &Contents, ui: &Ui) {
    ui.answer(&format!(
        "{}: {}, {} bytes, {}",
        path.display(),
        found.format,
        found.bytes,
        match found.topics.len() {
            1 => "1 stream of rows".to_owned(),
            n => format!("{n} topics"),
        }
    ));
    for topic in &found.topics {
        print_topic(topic, ui);
    }
    for fault in &found.faults {
        ui.say(&format!("fault: {fault}"));
    }
    for remark in &found.remarks {
        ui.say(&format!("note: {remark}"));
    }
    let proposal = &found.proposal;
    for doubt in &proposal.doubts {
        ui.say(&format!("doubt: {doubt}"));
    }
    for missing in &proposal.missing {
        ui.say(&format!("missing: {missing}"));
    }
    ui.say("probable columns:");
    for own in &proposal.columns {
        let unit = own
            .unit
            .map_or_else(String::new, |unit| format!(" in {unit}"));
        ui.say(&format!(
            "  {} = {}{unit}: {}",
            own.column,
            own.full_name(),
            own.why
        ));
    }
    if proposal.columns.is_empty() {
        ui.say("  none");
    } else if !proposal.is_plain {
        ui.say(&format!("options: {}", proposal.options.join(" ")));
    }
    match &proposal.refusal {
        Some(why) => ui.say(&format!("refused by `rig identify`: {why}")),
        None if proposal.is_plain && !proposal.columns.is_empty() => {
            ui.say(pages::without_options(found));
        }
        None => {}
    }
}

fn print_topic(topic: &Topic, ui: &Ui) {
    ui.say("");
    let head = match topic.name.as_str() {
        "" => "table".to_owned(),
        name => format!("{name} ({})", topic.of),
    };
    ui.say(&format!(
        "{head}: {} rows, {}",
        topic.rows,
        pages::time_in_words(topic)
    ));
    if let Some(why) = &topic.unreadable {
        ui.say(&format!("  not decoded: {why}"));
    }
    let width = topic
        .channels
        .iter()
        .take(LISTED)
        .map(|c| c.name.chars().count())
        .max();
    for channel in topic.channels.iter().take(LISTED) {
        let name = &channel.name;
        let width = width.unwrap_or(0);
        ui.say(&format!("  {name:width$}  {}", values_in_words(channel)));
    }
    if topic.channels.len() > LISTED {
        let more = topic.channels.len() - LISTED;
        ui.say(&format!(
            "  and {more} more channels; the report and --json list all"
        ));
    }
}

fn values_in_words(channel: &Channel) -> String {
    let (Some(min), Some(max), Some(std)) = (channel.min, channel.max, channel.std) else {
        return "no numbers".to_owned();
    };
    let mut words = match channel.is_constant() {
        true => format!("constant {}", format_short(min)),
        false => format!(
            "{} to {}, standard deviation {}",
            format_short(min),
            format_short(max),
            format_trimmed(std, 3)
        ),
    };
    if let Some(unit) = channel.unit {
        words.push_str(&format!(", in {unit} by its name"));
    }
    if channel.missing > 0 {
        words.push_str(&format!(
            "; no number in {} rows, the first is row {}",
            channel.missing,
            channel.first_missing.unwrap_or(0)
        ));
    }
    words
}
