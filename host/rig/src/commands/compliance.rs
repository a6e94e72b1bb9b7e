//! `rig compliance`: the stiffness of the joints and the compliance of the tool point.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::error::CommandError;
use super::input::{Inputs, RobotArg, recordings, refuse_twice};
use super::map_arg::UnitArg;
use super::overwrite::refuse_folder;
use super::pose_arg::positions;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_compliance::{
    Compliance, ComplianceOptions, DriveStiffness, LoadingFindings, WrenchFrame, elasticity_text,
    identify_compliance,
};
use rig_data::EffortNeed;
use rig_model::robot::Robot;
use rig_output::{can_take, folder, format_unit, write_whole};

/// Files that the command writes.
const FILES: [&str; 3] = ["compliance.json", "compliance.toml", "report.html"];

/// Identifies the stiffness of the joints, and computes the compliance of the tool point.
///
/// The stiffness comes from recordings of slow loading (--static), from a frequency response (--frequency), from
/// --stiffness, or from [[effect]] kind = "joint_elasticity" in the description.
///
/// --static takes slow motions with encoders on the links (columns ql1, ql2, …) and the joint torques, or recordings with
/// the motors held and a force at the tool point that changes slowly, to and fro: fx fy fz (N) and mx my mz (N·m, may be
/// left out), and link encoders or the displacement dx dy dz of the tool point (m, in the axes of the base; one axis is
/// enough). --wrench says where the force is read.
///
/// --frequency takes a chirp or another lively motion of one joint, best from rest to rest (`rig excite --kind chirp`).
///
/// The compliance K_p holds for held motors; only the joints bend. Writes compliance.json, compliance.toml (effects for the
/// description) and report.html into the folder given with --out.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Recordings of slow loading, CSV or MCAP
    #[arg(long = "static", value_name = "DATA", num_args = 1..)]
    load: Vec<PathBuf>,
    /// Recordings of a lively motion of one joint, CSV or MCAP
    #[arg(long, value_name = "DATA", num_args = 1..)]
    frequency: Vec<PathBuf>,
    /// The joint that moves in --frequency [default: the first]
    #[arg(long, requires = "frequency")]
    joint: Option<String>,
    /// Instrument of the frequency response [default: the reference, if it was recorded]
    #[arg(long, value_enum, requires = "frequency")]
    instrument: Option<Instrument>,
    /// Where fx to mz of --static are read [default: by the sensor, if the description has a [wrist_sensor], else base]
    #[arg(long, value_enum, requires = "load")]
    wrench: Option<WrenchArg>,
    /// Stiffness of each joint, base first, separated by commas, N·m/rad or N/m (of a screw: N·m/rad at the motor; inf:
    /// rigid). Measured values replace it
    #[arg(long, value_delimiter = ',')]
    stiffness: Vec<f64>,
    /// Standard deviations of --stiffness, separated by commas
    #[arg(long, value_delimiter = ',', requires = "stiffness")]
    stiffness_std: Vec<f64>,
    /// Tool point in the flange frame, m [default: the origin of that frame]
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    tool: Option<Vec<f64>>,
    /// Joint positions, base first, separated by commas or spaces, rad or m; give it again for more poses [default: the
    /// middle of the ranges]
    #[arg(long, value_name = "Q1,Q2,…", allow_hyphen_values = true)]
    pose: Vec<String>,
    /// The two joints of the map of the compliance, separated by a comma [default: the second and the third, else the first
    /// two]. With an equals sign: the channel of the recordings that is a column, such as fx=ft/wrench/force/x; repeat for
    /// several (`rig inspect` lists channels)
    #[arg(long, value_name = "JOINT,JOINT|COLUMN=CHANNEL")]
    map: Vec<String>,
    #[command(flatten)]
    columns: UnitArg,
    #[command(flatten)]
    report: ReportArg,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
}

/// Instrument of the frequency response.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Instrument {
    /// The reference: unbiased with feedback
    Reference,
    /// The torque itself: for a torque that no feedback computes
    Torque,
}

/// Where a wrench is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum WrenchArg {
    /// On the robot at the tool point, in the axes of the base
    Base,
    /// By the [wrist_sensor]: about its origin, in its axes, in the sense of `reads`
    Sensor,
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join("compliance.json")
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, option or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    can_take(&args.out, &FILES)?;
    refuse_folder(&args.out, &[], args.force)?;
    refuse_twice(&args.load, "give every recording once")?;
    refuse_twice(&args.frequency, "give every recording once")?;
    let robot = args.robot.load(ui)?;
    let options = args.options(&robot)?;
    let (columns, _) = args.maps();
    let mapping = args.columns.mapping_with(&columns)?;
    let read = |paths, need| Inputs::read_mapped(&robot, paths, need, &mapping);
    let load = read(&args.load, EffortNeed::Optional)?;
    let response = read(&args.frequency, EffortNeed::Required)?;
    for warning in load.warnings().chain(response.warnings()) {
        ui.warn(&warning);
    }
    load.refuse_scales(&robot)?;
    // A lively motion is judged as those of all commands are: a clock in milliseconds makes every frequency a thousandth.
    response.refuse_units(&robot, 0)?;
    let mut found = identify_compliance(
        &robot,
        &recordings(&load.listened()),
        &recordings(&response.listened()),
        &options,
    )?;
    found.warnings.extend(load.heard());
    found.warnings.extend(response.heard());
    let context = Context {
        command: ui.command_line(),
        warnings: load.warnings().chain(response.warnings()).collect(),
        ..Context::default()
    };
    write(args, &found, &context, ui)?;
    for warning in &found.warnings {
        ui.warn(warning);
    }
    for line in lines(&robot, &found) {
        ui.answer(&line);
    }
    args.report.tell(&args.out.join("report.html"), ui);
    Ok(())
}

impl Args {
    /// Divides `--map` into columns of the recordings and joints of the map: a column has an equals sign.
    fn maps(&self) -> (Vec<String>, Vec<String>) {
        let (columns, joints): (Vec<String>, Vec<String>) =
            (self.map.iter().cloned()).partition(|entry| entry.contains('='));
        let joints = (joints.iter())
            .flat_map(|entry| entry.split(','))
            .map(|name| name.trim().to_owned());
        (columns, joints.collect())
    }

    /// Options for the library.
    fn options(&self, robot: &Robot) -> Result<ComplianceOptions, CommandError> {
        let index = |option: &str, name: &str| {
            robot.joint_index(name).ok_or_else(|| {
                let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
                CommandError::Sentence(format!(
                    "{option} {name} is no joint of {}; its joints are {}.",
                    robot.name,
                    names.join(", ")
                ))
            })
        };
        let joint = match &self.joint {
            Some(name) => index("--joint", name)?,
            None => 0,
        };
        let tool = match self.tool.as_deref() {
            None => [0.0; 3],
            Some(&[x, y, z]) if [x, y, z].iter().all(|v| v.abs() <= 10.0) => [x, y, z],
            Some(other) => {
                return Err(CommandError::Sentence(format!(
                    "--tool {other:?} is not possible: give three numbers of at most 10 m."
                )));
            }
        };
        let (_, joints) = self.maps();
        let map = match joints.as_slice() {
            [] if robot.joints.len() > 2 => Some([1, 2]),
            [] if robot.joints.len() == 2 => Some([0, 1]),
            [] => None,
            [a, b] => Some([index("--map", a)?, index("--map", b)?]),
            other => {
                return Err(CommandError::Sentence(format!(
                    "--map {} has {} names; give the two joints of the map, separated by a comma, or a column of the recordings with its channel, such as --map fx=force_x.",
                    other.join(","),
                    other.len()
                )));
            }
        };
        Ok(ComplianceOptions {
            stiffness: self.stiffness.clone(),
            stiffness_std: self.stiffness_std.clone(),
            joint,
            by_reference: self.instrument.map(|i| i == Instrument::Reference),
            wrench: self.wrench.map(|wrench| match wrench {
                WrenchArg::Base => WrenchFrame::Base,
                WrenchArg::Sensor => WrenchFrame::Sensor,
            }),
            tool,
            poses: self
                .pose
                .iter()
                .map(|text| positions(text))
                .collect::<Result<_, _>>()?,
            map,
        })
    }
}

/// Writes all files of the result.
///
/// # Errors
/// A file cannot be written.
fn write(args: &Args, found: &Compliance, context: &Context, ui: &Ui) -> Result<(), CommandError> {
    folder(&args.out)?;
    let json = serde_json::to_string_pretty(found).map_err(|error| {
        CommandError::Sentence(format!(
            "The compliance cannot be written as JSON: {error}."
        ))
    })?;
    write_whole(&args.out.join("compliance.json"), (json + "\n").as_bytes())?;
    write_whole(
        &args.out.join("compliance.toml"),
        elasticity_text(found)?.as_bytes(),
    )?;
    args.report.write_and_show(
        &args.out.join("report.html"),
        &pages::compliance(found, context),
        ui,
    )?;
    Ok(())
}

/// Returns the line of one drive.
fn drive_line(drive: &DriveStiffness) -> String {
    match drive.stiffness {
        None => format!("joint \"{}\": {}", drive.joint, drive.source.words()),
        Some(own) => format!(
            "joint \"{}\": stiffness {} {} ({})",
            drive.joint,
            own.text(),
            format_unit(drive.unit),
            drive.source.words()
        ),
    }
}

/// Returns the printed answer.
fn lines(robot: &Robot, found: &Compliance) -> Vec<String> {
    let mut lines: Vec<String> = found.drives.iter().map(drive_line).collect();
    if let Some(response) = &found.frequency {
        lines.push(format!(
            "joint \"{}\": antiresonance {} Hz, resonance {} Hz",
            response.joint,
            response.antiresonance.text(),
            response.resonance.text()
        ));
    }
    for drive in found.loading.iter().flat_map(|l| &l.drives) {
        if let Some(gap) = &drive.gap {
            lines.push(format!(
                "joint \"{}\": backlash of {} {}, kept apart from the stiffness",
                drive.joint,
                gap.text(),
                // A stiffness in N/m has a twist in m.
                match found.drives[drive.index].unit {
                    "N/m" => "m",
                    _ => "rad",
                }
            ));
        }
        lines.extend(drive.missing.clone());
    }
    lines.extend(found.loading.iter().filter_map(LoadingFindings::assumed));
    for pose in &found.poses {
        let list: Vec<String> = (robot.joints.iter().zip(&pose.pose))
            .map(|(joint, q)| format!("{} {q:.3} {}", joint.name, joint.kind.units().0))
            .collect();
        if let Some(most) = pose.principal.first() {
            lines.push(format!(
                "at {}: largest displacement {} m/N along {}",
                list.join(", "),
                most.compliance.text(),
                most.direction
                    .map(|v| format!("{:.3}", if v.abs() < 5e-4 { 0.0 } else { v }))
                    .join(", ")
            ));
        }
    }
    if lines.iter().any(|line| line.contains(" ± ")) {
        lines.push("±: one standard deviation".to_owned());
    }
    lines
}
