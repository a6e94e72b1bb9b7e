//! `rig demo`: the demonstration without hardware.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::overwrite::{DEMONSTRATION, free_folder, refuse_folder};
use super::pictures;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::demo;
use rig_output::write_whole;

/// Default folder of the demonstration.
const FOLDER: &str = "rig-demo";

/// Runs the whole procedure without hardware: excite, record, identify, diagnose, compensate, report.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct Args {
    /// Folder for recordings, results and the report [default: rig-demo; rig-demo-2 and so on if that holds results]
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArg,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
    /// Seed that selects the emulated rig and its noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Default for Args {
    fn default() -> Self {
        Self {
            out: None,
            report: ReportArg::default(),
            force: false,
            seed: 1,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the fault.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let begin = Instant::now();
    let out = match &args.out {
        Some(out) => {
            refuse_folder(out, &DEMONSTRATION, args.force)?;
            out.clone()
        }
        None if args.force => PathBuf::from(FOLDER),
        None => free_folder(FOLDER, &DEMONSTRATION),
    };
    let mut progress = ui.progress("emulated rig", 1000);
    let demo = demo::run(&out, args.seed, |share| {
        progress.at((1000.0 * share) as u64)
    })?;
    drop(progress);
    let path = out.join("report.html");
    args.report.write(&path, &demo.page(&ui.command_line())?)?;
    let found = out.join("diagnosis.html");
    args.report
        .write(&found, &demo.diagnosis_page(&ui.command_line())?)?;
    let json = serde_json::to_string_pretty(&demo.diagnosis).map_err(|error| {
        CommandError::Sentence(format!("The diagnosis cannot be written as JSON: {error}."))
    })?;
    write_whole(&out.join("diagnosis.json"), (json + "\n").as_bytes())?;
    rig_report::write_svg(&out.join("tracking.svg"), &demo.picture())?;
    pictures::write(&out, &demo.diagnosis)?;
    ui.note(&format!("done in {:.1} s", begin.elapsed().as_secs_f64()));
    ui.detail(&demo.at_rest());
    for line in demo.summary()? {
        ui.answer(&line);
    }
    ui.file(&found);
    ui.fact("diagnosis", serde_json::json!(demo.diagnosis.verdict));
    args.report.tell(&path, ui);
    Ok(())
}
