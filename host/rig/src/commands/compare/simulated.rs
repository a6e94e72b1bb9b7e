//! `rig compare --simulated`: robots simulated from their descriptions, and identified in four ways.

use std::path::{Path, PathBuf};

use super::super::chain_arg::ChainArg;
use super::super::error::CommandError;
use super::super::input::described;
use super::super::overwrite::refuse_folder;
use super::super::report_arg::ReportArg;
use super::super::ui::Ui;
use crate::pages::{self, Context};
use rig_compare::{SimulateOptions, SimulatedRobot, simulated};
use rig_model::robot::{EDDA_TEMPLATE, IRP6_TEMPLATE, ONE_LINK_TEMPLATE, Robot};
use rig_output::{can_take, folder, format_significant, write_whole};

/// Files that the command writes.
const FILES: [&str; 2] = ["compare.json", "report.html"];
/// Steps of the progress bar for each robot.
const STEPS: u64 = 1000;
/// The robots that are simulated without --robot.
const DEFAULT: [(&str, &str); 3] = [
    ("one-link", ONE_LINK_TEMPLATE),
    ("irp6", IRP6_TEMPLATE),
    ("edda", EDDA_TEMPLATE),
];

/// What is simulated, and where the results go.
pub(super) struct Simulated<'a> {
    /// Descriptions; none for the three robots of `rig init`.
    pub robots: &'a [PathBuf],
    /// Chain of a URDF.
    pub chain: &'a ChainArg,
    /// Seed of motions and noise.
    pub seed: u64,
    /// Folder for the results.
    pub out: &'a Path,
    /// Form of the reports.
    pub report: ReportArg,
    /// Replace results.
    pub force: bool,
}

impl Simulated<'_> {
    /// Loads the robots, each with the name of its folder.
    fn robots(&self, ui: &Ui) -> Result<Vec<(String, Robot)>, CommandError> {
        if self.robots.is_empty() {
            let load = |(name, text): (&str, &str)| {
                let path = PathBuf::from(format!("{name}.toml"));
                Ok((name.to_owned(), Robot::from_toml(text, &path)?))
            };
            return DEFAULT.into_iter().map(load).collect();
        }
        let mut all: Vec<(String, Robot)> = Vec::new();
        for path in self.robots {
            let robot = described(path, self.chain, ui)?.robot;
            let name = path
                .file_stem()
                .map_or_else(String::new, |s| s.to_string_lossy().into());
            if all.iter().any(|(other, _)| *other == name) {
                return Err(CommandError::Sentence(format!(
                    "Two descriptions are named {name}, which is also the name of the folder of their report; rename one of them."
                )));
            }
            all.push((name, robot));
        }
        Ok(all)
    }

    /// Runs the comparison and writes the reports.
    ///
    /// # Errors
    /// A sentence that names the wrong file or value.
    pub(super) fn run(&self, ui: &Ui) -> Result<(), CommandError> {
        can_take(self.out, &FILES)?;
        refuse_folder(self.out, &[], self.force)?;
        let robots = self.robots(ui)?;
        for (name, _) in &robots {
            refuse_folder(&self.out.join(name), &[], self.force)?;
        }
        let options = SimulateOptions {
            seed: self.seed,
            ..SimulateOptions::default()
        };
        let total = STEPS * robots.len() as u64;
        let mut bar = ui.progress("simulating", total);
        let mut all = Vec::with_capacity(robots.len());
        for (k, (name, robot)) in robots.into_iter().enumerate() {
            let found = simulated(&robot, &options, |share| {
                bar.at(k as u64 * STEPS + (share * STEPS as f64) as u64);
            })?;
            all.push((name, found));
        }
        drop(bar);
        self.write(&all, ui)?;
        for (name, found) in &all {
            for line in lines(name, found) {
                ui.answer(&line);
            }
        }
        self.report.tell(&self.out.join(FILES[1]), ui);
        Ok(())
    }

    fn write(&self, all: &[(String, SimulatedRobot)], ui: &Ui) -> Result<(), CommandError> {
        let context = Context {
            command: ui.command_line(),
            ..Context::default()
        };
        folder(self.out)?;
        for (name, found) in all {
            let own = self.out.join(name);
            folder(&own)?;
            let json = serde_json::to_string_pretty(found).map_err(|error| {
                CommandError::Sentence(format!(
                    "The comparison cannot be written as JSON: {error}."
                ))
            })?;
            write_whole(&own.join(FILES[0]), (json + "\n").as_bytes())?;
            self.report.write(
                &own.join(FILES[1]),
                &pages::simulated_robot(found, &context),
            )?;
        }
        self.report.write_and_show(
            &self.out.join(FILES[1]),
            &pages::simulated_overview(all, &context),
            ui,
        )?;
        Ok(())
    }
}

/// Returns the printed answer for a robot; `name` is that of its folder.
fn lines(name: &str, found: &SimulatedRobot) -> Vec<String> {
    let mut lines = vec![format!(
        "{name}: {} base parameters, motion of {:.1} s, position cut off at {} Hz, {} rows/s.",
        found.parameters.len(),
        found.seconds,
        format_significant(found.cutoff, 3),
        format_significant(found.rows_per_second, 3)
    )];
    for (k, e) in found.estimates.iter().enumerate() {
        let known = || e.values.iter().flatten().filter_map(|v| v.covers);
        let residuals: Vec<String> = (found.holdout.iter())
            .map(|h| format_significant(100.0 * h.relative_error[k], 2))
            .collect();
        let intervals = match known().count() {
            0 => "too few residuals for intervals".to_owned(),
            all => format!(
                "{} of {all} intervals hold the truth",
                known().filter(|covers| *covers).count()
            ),
        };
        lines.push(format!(
            "  {} {}: torque error {} %, {intervals}, hold-out residual {} % of the torque",
            e.way,
            e.model,
            format_significant(100.0 * e.torque_error, 2),
            residuals.join(" ")
        ));
    }
    let noise: Vec<String> = (found.holdout.iter())
        .map(|h| format_significant(100.0 * h.relative_error_of_truth, 2))
        .collect();
    lines.push(format!(
        "  the true parameters leave {} % on the hold-out",
        noise.join(" ")
    ));
    lines
}
