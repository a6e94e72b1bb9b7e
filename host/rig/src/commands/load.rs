//! `rig load`: the inertial parameters of a load at the flange.

mod request;

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use serde::Serialize;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, Use, refuse_faults};
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::report_arg::{ReportArg, write_report};
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_load::{
    By, ControllerNumbers, LoadIdentification, NotShown, Value, controller_numbers,
    incomplete_numbers, parameter_symbols, urdf_link,
};
use rig_model::robot::{Description, Original, Robot};
use rig_output::{can_take, folder, format_significant, format_value, write_whole};
use rig_report::Document;

pub use request::{LoadRequest, Measured, ReadsArg};

/// Files that the command writes.
const FILES: [&str; 4] = ["load.toml", "load.urdf", JSON, REPORT];
/// The result for other programs.
const JSON: &str = "load.json";
/// The report.
const REPORT: &str = "report.html";

/// Identifies a load at the flange: mass, centre of mass and inertia, with standard deviations.
///
/// By the wrist sensor (columns fx fy fz in N and mx my mz in N·m, in the axes of the sensor): record poses at rest, or a
/// motion, which also shows the inertia. `rig excite --load` designs both. The pose of the sensor is [wrist_sensor] in
/// the description, or --sensor-position and --sensor-rotation. Bias, drift and rotation of the sensor are estimated.
/// Exchanged, reversed, dead or saturated channels are named.
///
/// By joint torques: record the same motion with the load (--data) and without it (--without). Without --without the
/// description must be an identified one (`rig identify`).
///
/// All results are in the flange frame: the frame of the last joint or that of [flange] (TOML), or of the link that the
/// chain ends at (URDF; --tip names it). Writes load.toml, load.urdf, load.json and report.html into the folder given with --out.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    #[command(flatten)]
    request: LoadRequest,
    #[command(flatten)]
    columns: MapArg,
    #[command(flatten)]
    report: ReportArg,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
}

/// The result with the numbers for controllers, as written to load.json.
#[derive(Serialize)]
struct Written<'a> {
    /// Link whose frame is the flange, if a URDF describes the robot.
    flange: Option<&'a str>,
    #[serde(flatten)]
    found: &'a LoadIdentification,
    /// Absent (null) if the data do not show mass and centre of mass.
    controllers: Option<ControllerNumbers>,
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join(JSON)
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let request = &args.request;
    can_take(&args.out, &FILES)?;
    refuse_folder(&args.out, &[], args.force)?;
    request.check()?;
    let Description {
        mut robot, urdf, ..
    } = args.robot.describe(ui)?;
    let inputs = request.open(&mut robot, args.columns.mapping()?)?;
    let warnings: Vec<String> = inputs.iter().flat_map(Inputs::warnings).collect();
    for warning in &warnings {
        ui.warn(warning);
    }
    let found = request.identify((&robot, urdf.as_ref()), &inputs, |both| {
        let purpose = (Use::Compare, Vec::new());
        refuse_faults(&robot, both, purpose, request.even_if_wrong, ui)
    })?;
    let context = Context {
        command: ui.command_line(),
        warnings,
        ..Context::default()
    };
    let flange = urdf.as_ref().map(Original::tip);
    write_files(&args.out, &found, flange)?;
    (args.report).write_and_show(&args.out.join(REPORT), &page(&found, &context), ui)?;
    told(&robot, &found, ui);
    if let Some(link) = flange {
        ui.answer(&format!("flange frame: that of link {link}"));
    }
    args.report.tell(&args.out.join(REPORT), ui);
    Ok(())
}

/// Prints warnings, notes and the load.
fn told(robot: &Robot, found: &LoadIdentification, ui: &Ui) {
    for warning in &found.warnings {
        ui.warn(warning);
    }
    let sensor = found.sensor.as_ref();
    if let Some(note) = sensor.and_then(|own| own.reads_found.as_ref()) {
        ui.note(note);
    }
    for line in lines(robot, found, controller_numbers(found).as_ref()) {
        ui.answer(&line);
    }
}

/// Returns the text of load.json. `flange`: link whose frame it is.
///
/// # Errors
/// A number that JSON cannot hold.
pub fn load_json(found: &LoadIdentification, flange: Option<&str>) -> Result<String, CommandError> {
    let written = Written {
        flange,
        found,
        controllers: controller_numbers(found),
    };
    let json = serde_json::to_string_pretty(&written).map_err(|error| {
        CommandError::Sentence(format!("The load cannot be written as JSON: {error}."))
    })?;
    Ok(json + "\n")
}

/// Writes the files of a result without its report.
fn write_files(
    out: &Path,
    found: &LoadIdentification,
    flange: Option<&str>,
) -> Result<(), CommandError> {
    folder(out)?;
    write_whole(&out.join(JSON), load_json(found, flange)?.as_bytes())?;
    write_whole(&out.join("load.toml"), found.body.to_toml()?.as_bytes())?;
    write_whole(&out.join("load.urdf"), urdf_link(found).as_bytes())?;
    Ok(())
}

/// Returns the report of a result.
fn page(found: &LoadIdentification, context: &Context) -> Document {
    pages::load(found, controller_numbers(found).as_ref(), context)
}

/// Writes all files of a result into a folder that holds none yet, unless `force`. `command`: the call that repeats it.
///
/// # Errors
/// A file cannot be written.
pub fn write_load(
    out: &Path,
    found: &LoadIdentification,
    flange: Option<&str>,
    (command, warnings): (String, Vec<String>),
    force: bool,
) -> Result<(), CommandError> {
    refuse_folder(out, &[], force)?;
    write_files(out, found, flange)?;
    let context = Context {
        command,
        warnings,
        ..Context::default()
    };
    write_report(&out.join(REPORT), &page(found, &context), false)
}

/// Returns the printed answer.
fn lines(
    robot: &Robot,
    found: &LoadIdentification,
    numbers: Option<&ControllerNumbers>,
) -> Vec<String> {
    let value = |v: &Value| format_value(v.value, v.std);
    let marked = |v: &Value, shown: bool| {
        let mark = if shown { "" } else { " (not shown)" };
        format!("{}{mark}", value(v))
    };
    let centre = found.centre.iter().zip(found.centre_shown());
    let centre: Vec<String> = centre.map(|(v, shown)| marked(v, shown)).collect();
    let mut lines = vec![
        format!("mass {} kg", marked(&found.mass, found.mass_shown())),
        format!("centre of mass {} m in the flange frame", centre.join(", ")),
    ];
    if found.inertia_shown {
        let [xx, xy, xz, yy, yz, zz] = found.inertia.each_ref().map(value);
        lines.push(format!(
            "inertia about the centre of mass Ixx {xx}, Ixy {xy}, Ixz {xz}, Iyy {yy}, Iyz {yz}, Izz {zz} kg·m²"
        ));
    }
    lines.push(
        "(± is one standard deviation here, and half the 95 % interval in the report)".to_owned(),
    );
    if let Some(sensor) = &found.sensor {
        lines.push(format!(
            "unexplained: {} N and {} N·m RMS",
            format_significant(sensor.residual[0], 3),
            format_significant(sensor.residual[1], 3)
        ));
        lines.push(sensor.gain_error.words());
        lines.push(sensor.assumed(found.mass_checks.is_empty()));
    }
    lines.extend(found.mass_checks.iter().map(|check| {
        let whose = match check.by {
            By::Torque => "torques",
            By::Sensor | By::Both => "sensor",
        };
        format!(
            "mass by the {whose} over the known mass: {}",
            format_value(check.factor, check.std)
        )
    }));
    for missing in &found.not_shown {
        let mut line = format!(
            "not shown by these data: {}. {}",
            parameter_symbols(&missing.parameters).join(" "),
            missing.experiment
        );
        if let Some(pose) = &missing.pose {
            let joints = robot.joints.iter().zip(pose);
            let list: Vec<String> = joints
                .map(|(joint, q)| format!("{} {q:.3} {}", joint.name, joint.kind.units().0))
                .collect();
            line.push_str(&format!(" A pose that would help: {}.", list.join(", ")));
        }
        lines.push(line);
    }
    let has_moment = |missing: &NotShown| {
        missing
            .parameters
            .iter()
            .any(|p| p.starts_with('m') && *p != "m")
    };
    if found.not_shown.iter().any(has_moment) {
        lines.push("(m·cx m·cy m·cz: first moments, mass times centre of mass)".to_owned());
    }
    lines.extend(for_controllers(found, numbers));
    lines
}

/// Returns the printed numbers for controllers.
fn for_controllers(found: &LoadIdentification, numbers: Option<&ControllerNumbers>) -> Vec<String> {
    let Some(numbers) = numbers else {
        let none = "numbers for controllers: none that are complete, because these data do not show the mass and the whole centre of mass";
        return std::iter::once(none.to_owned())
            .chain(incomplete_numbers(found))
            .collect();
    };
    let zero = match found.inertia_shown {
        true => "",
        false => " (inertia not shown, given as zero)",
    };
    let lines = numbers.labelled();
    let lines = lines.map(|(maker, units, own)| format!("{maker} ({units}): {own}{zero}"));
    lines.into()
}
