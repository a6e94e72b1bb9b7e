//! `rig load`: the inertial parameters of a load at the flange.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};
use serde::Serialize;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, Use, recordings, refuse_faults, refuse_twice};
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::report_arg::ReportArg;
use super::same_file::{is_copy, is_same};
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::prepare::{Choice, PrepareOptions};
use rig_data::{EffortNeed, WRENCH_TEMPERATURE};
use rig_load::{
    By, ControllerNumbers, FEWEST_ROWS, KnownMass, LoadIdentification, LoadOptions, NotShown,
    Value, controller_numbers, identify_load, incomplete_numbers, parameter_symbols, urdf_link,
};
use rig_model::robot::{Description, LARGEST_GAIN_STD, Load, Original, Reads, Robot, WristSensor};
use rig_output::{can_take, folder, format_significant, format_value, write_whole};

/// Files that the command writes.
const FILES: [&str; 4] = ["load.toml", "load.urdf", "load.json", "report.html"];

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
    /// Recording with the load, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Recording without the load: what is mounted beyond the sensor, or the bare robot, is subtracted
    #[arg(long, num_args = 1..)]
    without: Vec<PathBuf>,
    /// What the load is measured by
    #[arg(long, value_enum, default_value_t = Measured::Sensor)]
    by: Measured,
    /// The recordings are poses at rest; rows on the way between two are left out (assumed for rows far apart in time, and
    /// for fewer than 256)
    #[arg(long)]
    poses: bool,
    /// A known load (load.toml) that is mounted as well, and is subtracted
    #[arg(long, value_name = "FILE", conflicts_with = "without")]
    subtract: Option<PathBuf>,
    /// Mass of the load as weighed, kg: a contradiction to the identified mass tells a wrong unit of the forces, or a wrong
    /// scale of forces or torques. It enters no fit
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// Standard deviation of --mass, kg
    #[arg(long, value_name = "KG", requires = "mass", default_value_t = 0.0)]
    mass_std: f64,
    /// Standard deviation of the gain of a channel of the sensor, relative (0.005 for 0.5 %): it is counted in the standard
    /// deviations of the load [default: gain_std of [wrist_sensor]; without it gains count as exact]
    #[arg(long, value_name = "SHARE")]
    gain_std: Option<f64>,
    /// Origin of the sensor in the flange frame, m
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    sensor_position: Option<Vec<f64>>,
    /// Roll, pitch and yaw of the sensor's axes in the flange frame, rad
    #[arg(long, num_args = 3, value_names = ["R", "P", "Y"])]
    sensor_rotation: Option<Vec<f64>>,
    /// The wrench that the sensor reads: that of the load on the robot (weight, downwards), or that of the robot on it
    #[arg(long, value_enum)]
    reads: Option<ReadsArg>,
    /// Cut-off of the low-pass on the position, Hz [default: from the recording]
    #[arg(long)]
    cutoff: Option<f64>,
    /// Go on with the best explanation if channels look wrong; prints what is wrong
    #[arg(long)]
    even_if_wrong: bool,
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

/// What the load is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Measured {
    /// The wrist sensor
    Sensor,
    /// The joint torques
    Torque,
    /// Both, weighted by their uncertainty
    Both,
}

/// The wrench that the sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ReadsArg {
    /// That of the load on the robot
    Load,
    /// That of the robot on the load
    Robot,
}

/// Says which links are fixed beyond the flange; `None` if there are none.
fn beyond_flange(urdf: &Original) -> Option<String> {
    let beyond = urdf.beyond_tip();
    let last = beyond.last()?;
    Some(format!(
        "The flange frame is that of link {}. Fixed to it, with frames of their own: {}. If the flange of your controller is one of these, give it, for example --tip {last}.",
        urdf.tip(),
        beyond.join(", ")
    ))
}

/// The result with the numbers for controllers, as written to load.json.
#[derive(Serialize)]
struct Written<'a> {
    /// Link whose frame is the flange, if a URDF describes the robot.
    flange: Option<&'a str>,
    #[serde(flatten)]
    found: &'a LoadIdentification,
    /// Absent (null) if the data do not show mass and centre of mass.
    controllers: Option<&'a ControllerNumbers>,
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join("load.json")
    }
}

/// Refuses options and files that do not fit together.
fn check(args: &Args) -> Result<(), CommandError> {
    can_take(&args.out, &FILES)?;
    refuse_folder(&args.out, &[], args.force)?;
    refuse_twice(&args.data, "give every recording once")?;
    refuse_twice(&args.without, "give every recording once")?;
    refuse_both(&args.data, &args.without)?;
    if args.poses && args.by != Measured::Sensor {
        return Err(CommandError::Sentence(
            "--poses is for the wrist sensor alone: joint torques at rest are hidden by friction. Leave it out, or use --by sensor."
                .to_owned(),
        ));
    }
    Ok(())
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    check(args)?;
    let Description {
        mut robot, urdf, ..
    } = args.robot.describe(ui)?;
    sensor(args, &mut robot)?;
    let need = match args.by {
        Measured::Sensor => EffortNeed::Optional,
        Measured::Torque | Measured::Both => EffortNeed::Required,
    };
    let mapping = match args.by {
        Measured::Torque => args.columns.mapping()?,
        Measured::Sensor | Measured::Both => {
            let mapping = args.columns.mapping()?;
            mapping.with_wrench().with_numbers(WRENCH_TEMPERATURE)
        }
    };
    let read = |paths| Inputs::read_mapped(&robot, paths, need, &mapping);
    let (with, without) = (read(&args.data)?, read(&args.without)?);
    for warning in with.warnings().chain(without.warnings()) {
        ui.warn(&warning);
    }
    match args.by {
        Measured::Sensor => {
            let least = if args.poses { usize::MAX } else { FEWEST_ROWS };
            with.refuse_units(&robot, least)?;
            without.refuse_units(&robot, least)?;
        }
        Measured::Torque | Measured::Both => refuse_faults(
            &robot,
            &[&with, &without],
            (Use::Compare, Vec::new()),
            args.even_if_wrong,
            ui,
        )?,
    }
    let options = options(args)?;
    let mut found = identify_load(
        &robot,
        &recordings(&with.listened()),
        &recordings(&without.listened()),
        &options,
    )?;
    found.warnings.extend(urdf.as_ref().and_then(beyond_flange));
    let are_poses = found
        .sensor
        .as_ref()
        .is_some_and(|own| own.prepared.is_none());
    for inputs in [&with, &without] {
        // Time passes from one pose to the next.
        found.warnings.extend(match are_poses {
            true => inputs.heard_but(&|warning| warning.is_of_time()),
            false => inputs.heard(),
        });
    }
    let numbers = controller_numbers(&found);
    let context = Context {
        command: ui.command_line(),
        warnings: with.warnings().chain(without.warnings()).collect(),
        ..Context::default()
    };
    let flange = urdf.as_ref().map(Original::tip);
    write(args, &found, (flange, numbers.as_ref()), (&context, ui))?;
    told(&robot, &found, numbers.as_ref(), ui);
    if let Some(link) = flange {
        ui.answer(&format!("flange frame: that of link {link}"));
    }
    args.report.tell(&args.out.join("report.html"), ui);
    Ok(())
}

/// Prints warnings, notes and the load.
fn told(robot: &Robot, found: &LoadIdentification, numbers: Option<&ControllerNumbers>, ui: &Ui) {
    for warning in &found.warnings {
        ui.warn(warning);
    }
    let sensor = found.sensor.as_ref();
    if let Some(note) = sensor.and_then(|own| own.reads_found.as_ref()) {
        ui.note(note);
    }
    for line in lines(robot, found, numbers) {
        ui.answer(&line);
    }
}

/// Refuses a recording that is given both with and without the load, by one name or as a copy.
fn refuse_both(with: &[PathBuf], without: &[PathBuf]) -> Result<(), CommandError> {
    let wants = "give a recording with the load, and another one without it";
    for path in without {
        if with.iter().any(|own| is_same(own, path)) {
            return Err(CommandError::Sentence(format!(
                "{} is given both as --data and as --without; {wants}.",
                path.display()
            )));
        }
        if let Some(own) = with.iter().find(|own| is_copy(own, path)) {
            return Err(CommandError::Sentence(format!(
                "{} (--without) has the same bytes as {} (--data); {wants}.",
                path.display(),
                own.display()
            )));
        }
    }
    Ok(())
}

/// Puts the sensor of the options into the description.
fn sensor(args: &Args, robot: &mut Robot) -> Result<(), CommandError> {
    let mut sensor = robot.wrist_sensor.clone().unwrap_or_default();
    let three = |name: &str,
                 list: &[f64],
                 most: f64,
                 unit: &str|
     -> Result<[f64; 3], CommandError> {
        match list {
            [a, b, c] if list.iter().all(|v| v.abs() <= most) => Ok([*a, *b, *c]),
            _ => Err(CommandError::Sentence(format!(
                "--{name} {list:?} is not possible: give three numbers of at most {most} {unit}, in {unit}."
            ))),
        }
    };
    if let Some(list) = &args.sensor_position {
        sensor.position = three("sensor-position", list, 1e4, "m")?;
        if let Some(text) = sensor.too_far() {
            return Err(CommandError::Sentence(text));
        }
    }
    if let Some(list) = &args.sensor_rotation {
        sensor.rotation = three("sensor-rotation", list, 7.0, "rad")?;
    }
    if let Some(reads) = args.reads {
        sensor.reads = Some(match reads {
            ReadsArg::Load => Reads::Load,
            ReadsArg::Robot => Reads::Robot,
        });
    }
    if let Some(std) = args.gain_std {
        if !(0.0..=LARGEST_GAIN_STD).contains(&std) {
            return Err(CommandError::Sentence(format!(
                "--gain-std {std} is not possible: give a share of 1 from 0 to {LARGEST_GAIN_STD} (0.005 for 0.5 %)."
            )));
        }
        sensor.gain_std = Some(std);
    }
    if args.by != Measured::Torque || sensor != WristSensor::default() {
        robot.wrist_sensor = Some(sensor);
    }
    Ok(())
}

/// Writes all files of the result. `flange`: link whose frame it is.
///
/// # Errors
/// A file cannot be written.
fn write(
    args: &Args,
    found: &LoadIdentification,
    (flange, controllers): (Option<&str>, Option<&ControllerNumbers>),
    (context, ui): (&Context, &Ui),
) -> Result<(), CommandError> {
    folder(&args.out)?;
    let written = Written {
        flange,
        found,
        controllers,
    };
    let json = serde_json::to_string_pretty(&written).map_err(|error| {
        CommandError::Sentence(format!("The load cannot be written as JSON: {error}."))
    })?;
    write_whole(&args.out.join("load.json"), (json + "\n").as_bytes())?;
    write_whole(
        &args.out.join("load.toml"),
        found.body.to_toml()?.as_bytes(),
    )?;
    write_whole(&args.out.join("load.urdf"), urdf_link(found).as_bytes())?;
    args.report.write_and_show(
        &args.out.join("report.html"),
        &pages::load(found, controllers, context),
        ui,
    )?;
    Ok(())
}

/// Returns the mass that the user knows.
fn known_mass(args: &Args) -> Result<Option<KnownMass>, CommandError> {
    let Some(mass) = args.mass else {
        return Ok(None);
    };
    let std = args.mass_std;
    if !(mass > 0.0 && mass.is_finite() && (0.0..mass).contains(&std)) {
        return Err(CommandError::Sentence(format!(
            "--mass {mass} with --mass-std {std} is not possible: give a mass greater than 0 and a standard deviation below it, in kg."
        )));
    }
    Ok(Some(KnownMass { mass, std }))
}

/// Returns the options of the identification.
fn options(args: &Args) -> Result<LoadOptions, CommandError> {
    Ok(LoadOptions {
        by: match args.by {
            Measured::Sensor => By::Sensor,
            Measured::Torque => By::Torque,
            Measured::Both => By::Both,
        },
        poses: args.poses,
        tool: args.subtract.as_deref().map(Load::read).transpose()?,
        known_mass: known_mass(args)?,
        prepare: PrepareOptions {
            cutoff: args.cutoff.map_or(Choice::Auto, Choice::Fixed),
            ..PrepareOptions::default()
        },
        even_if_wrong: args.even_if_wrong,
    })
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
