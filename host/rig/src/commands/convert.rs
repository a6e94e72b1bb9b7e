//! `rig convert`: a recording in another format.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::map_arg::MapArg;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_data::contents::{contents, stand_in};
use rig_data::{Column, EffortNeed, PlainRows, RecordingWriter, Source, write_npz};
use rig_model::robot::Robot;

/// Writes a recording in another format, with the names and units of this program (t, q1, tau1 … in SI).
///
/// Every column of the file is kept, also those without a meaning, unless it is text; a motor current stays a current.
/// The joints of messages are those of --robot, in its order, else those in the file. The format is that of the name:
/// .csv, .mcap (a message a row), .parquet, or .npz for NumPy (arrays t, q, tau … with a column a joint; held in memory).
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// The recording: CSV, MCAP, .parquet, .npz, .mat or a folder of rosbag2
    #[arg(value_name = "IN")]
    file: PathBuf,
    /// File to write: .csv, .mcap, .npz or .parquet
    #[arg(value_name = "OUT", required_unless_present = "out")]
    to: Option<PathBuf>,
    /// The same as OUT
    #[arg(long, value_name = "FILE", conflicts_with = "to")]
    out: Option<PathBuf>,
    /// Robot description, TOML, URDF or MJCF: its joints are read, in its order
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    #[command(flatten)]
    chain: ChainArg,
    #[command(flatten)]
    columns: MapArg,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

impl Args {
    /// Returns the file to write, by either of its names.
    fn out(&self) -> &Path {
        let given = self.out.as_deref().or(self.to.as_deref());
        given.unwrap_or(Path::new(""))
    }
}

/// Columns that are written.
struct Kept {
    columns: Vec<Column>,
    /// True for each column of the file that is one of them.
    is_kept: Vec<bool>,
    rows: u64,
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the file, the line or the column at fault.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let out = args.out();
    let extension = out.extension().map(|e| e.to_string_lossy().to_lowercase());
    let extension = extension.unwrap_or_default();
    if !["csv", "mcap", "npz", "parquet"].contains(&extension.as_str()) {
        return Err(CommandError::Sentence(format!(
            "The format of {} is not known; end its name in .csv, .mcap, .npz or .parquet.",
            out.display()
        )));
    }
    refuse_file(out, args.force)?;
    let robot = match &args.robot {
        Some(path) => described(path, &args.chain, ui)?.robot,
        None => joints_in(&args.file, ui)?,
    };
    let mapping = args.columns.mapping()?;
    let source = Source::open_mapped(&args.file, &robot, EffortNeed::Optional, &mapping)?;
    for warning in source.warnings() {
        ui.warn(&format!("{}: {warning}.", args.file.display()));
    }
    let mut progress = ui.progress("converting", 2 * source.bytes());
    let mut at = |bytes| progress.at(bytes);
    let kept = kept(&source, &robot, ui, &mut at)?;
    let mut at = |bytes| at(source.bytes() + bytes);
    match extension.as_str() {
        "npz" => archive(&source, &kept, out, &mut at)?,
        _ => rows(&source, &kept, out, &mut at)?,
    }
    ui.file(out);
    ui.fact("rows", kept.rows);
    ui.fact("columns", names(&kept));
    ui.answer(&format!(
        "{}: {} rows of {}",
        out.display(),
        kept.rows,
        names(&kept).join(", ")
    ));
    Ok(())
}

/// Returns a robot with the joints that the file states, and prints their order.
fn joints_in(path: &Path, ui: &Ui) -> Result<Robot, CommandError> {
    let mut progress = ui.progress("looking for joints", 1);
    let found = contents(path, None, &mut |bytes| {
        progress.at_of(bytes, 2 * bytes.max(1))
    })?;
    drop(progress);
    let robot = stand_in(&found).ok_or_else(|| {
        CommandError::Sentence(format!(
            "The joints of {} cannot be told; give the description with --robot.",
            path.display()
        ))
    })?;
    if found.topics.iter().any(|topic| !topic.name.is_empty()) {
        let names: Vec<&str> = robot
            .joints
            .iter()
            .map(|joint| joint.name.as_str())
            .collect();
        ui.note(&format!(
            "{}: the joints are {}, in this order; give --robot for that of a description.",
            path.display(),
            names.join(", ")
        ));
    }
    Ok(robot)
}

/// Reads the recording once: finds the columns that hold numbers in every row, and names the others.
fn kept(
    source: &Source,
    robot: &Robot,
    ui: &Ui,
    at: &mut dyn FnMut(u64),
) -> Result<Kept, CommandError> {
    let mut rows = PlainRows::open(source)?;
    let columns = rows.columns(robot);
    let mut first_text: Vec<Option<u64>> = vec![None; columns.len()];
    let mut count = 0;
    while let Some((place, row)) = rows.next_row()? {
        for (first, value) in first_text.iter_mut().zip(row) {
            if !value.is_finite() {
                first.get_or_insert(place);
            }
        }
        count += 1;
        if count % 4096 == 0 {
            at(rows.bytes_read());
        }
    }
    for remark in rows.remarks() {
        let of_file = source
            .warnings()
            .iter()
            .any(|own| own.to_string() == remark);
        if !of_file {
            ui.note(&format!("{}: {remark}.", source.path().display()));
        }
    }
    for (column, first) in columns.iter().zip(&first_text) {
        if let Some(place) = first {
            ui.warn(&format!(
                "{}: column `{}` is left out, because it holds no number ({}).",
                source.path().display(),
                column.name,
                source.place(*place)
            ));
        }
    }
    let is_kept: Vec<bool> = first_text.iter().map(Option::is_none).collect();
    let columns = columns.into_iter().zip(&is_kept);
    Ok(Kept {
        columns: columns
            .filter(|(_, kept)| **kept)
            .map(|(column, _)| column)
            .collect(),
        is_kept,
        rows: count,
    })
}

fn names(kept: &Kept) -> Vec<String> {
    kept.columns
        .iter()
        .map(|column| column.name.clone())
        .collect()
}

/// Calls `take` with the kept values of every row.
fn each(
    source: &Source,
    kept: &Kept,
    at: &mut dyn FnMut(u64),
    mut take: impl FnMut(&[f64]) -> Result<(), CommandError>,
) -> Result<(), CommandError> {
    let mut rows = PlainRows::open(source)?;
    let mut own = Vec::with_capacity(kept.columns.len());
    let mut count = 0u64;
    while let Some((_, row)) = rows.next_row()? {
        own.clear();
        own.extend(
            row.iter()
                .zip(&kept.is_kept)
                .filter(|(_, kept)| **kept)
                .map(|(v, _)| *v),
        );
        take(&own)?;
        count += 1;
        if count.is_multiple_of(4096) {
            at(rows.bytes_read());
        }
    }
    Ok(())
}

/// Writes CSV, MCAP or Parquet.
fn rows(
    source: &Source,
    kept: &Kept,
    out: &Path,
    at: &mut dyn FnMut(u64),
) -> Result<(), CommandError> {
    let from = source.path().file_name().unwrap_or_default();
    let about = BTreeMap::from([(
        "converted from".to_owned(),
        from.to_string_lossy().into_owned(),
    )]);
    let mut writer = RecordingWriter::create(out, &kept.columns, &about)?;
    each(source, kept, at, |row| Ok(writer.push_row(row)?))?;
    Ok(writer.finish()?)
}

/// Writes a NumPy archive.
fn archive(
    source: &Source,
    kept: &Kept,
    out: &Path,
    at: &mut dyn FnMut(u64),
) -> Result<(), CommandError> {
    let mut values = vec![Vec::with_capacity(kept.rows as usize); kept.columns.len()];
    each(source, kept, at, |row| {
        for (column, value) in values.iter_mut().zip(row) {
            column.push(*value);
        }
        Ok(())
    })?;
    Ok(write_npz(out, &names(kept), &values)?)
}
