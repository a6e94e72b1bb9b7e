//! `rig control`: control laws of an arm in a simulated closed loop.

use std::path::{Path, PathBuf};

use clap::{Args as ClapArgs, ValueEnum};

use super::error::CommandError;
use super::input::{RobotArg, described};
use super::overwrite::{refuse_file, refuse_folder};
use super::pose_arg::positions;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_control::{
    Bench, ContactOptions, ContactTask, ControlError, Evaluation, Failed, LawKind, LawModel, Run,
    Settings, Surface, Trace, default_reference, references, resolution, save, tool_point,
};
use rig_excite::{SampledReference, reference_at};
use rig_model::robot::Robot;
use rig_model::simulate::{Model, controllers};
use rig_output::{can_take, folder, format_significant, format_trimmed, write_whole};
use rig_shared::trajectory::Reference;

/// Simulates control laws on a robot and measures them: tracking error, force, robustness to wrong parameters.
///
/// The laws pid, computed-torque and adaptive (together: all) follow a trajectory. The laws hybrid and impedance (together:
/// contact) press the tool on a compliant surface and slide along it. Without --trajectory the joints move by two sines
/// each; without --tool, --pose, --normal and --press a task that fits the robot is chosen. Everything assumed is printed.
///
/// The robot is simulated as described, with dry friction that sticks, coupled drives and effects. A law reads encoder
/// counts and the velocity of the firmware's observer. Its torque is limited, held between two ticks, and acts one tick late.
///
/// --model gives the law another model than the robot's own, for example identified.toml or the diagnosed model.toml.
///
/// Writes control.json, report.html and one recording a motion (columns t, q, qd, tau and ref) into the folder --out.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Law to simulate; one or more
    #[arg(long, value_enum, num_args = 1.., default_values_t = [Law::All])]
    law: Vec<Law>,
    /// Description that the laws use as their model, each with each law [default: the robot's own]
    #[arg(long, num_args = 1.., value_name = "FILE")]
    model: Vec<PathBuf>,
    /// Trajectory by `rig excite` (.toml or .csv), or a recording whose reference is repeated
    #[arg(long)]
    trajectory: Option<PathBuf>,
    /// Length of the default motion, s [default: 10]
    #[arg(long, conflicts_with = "trajectory")]
    duration: Option<f64>,
    /// Multiply all parameters of the laws' models by this factor; 0.7 is 70 %
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Repeat with parameters that are wrong at random by up to this share, per cent
    #[arg(long, value_name = "PERCENT")]
    wrong: Option<f64>,
    /// Number of such repetitions of each law [default: 20]
    #[arg(long)]
    draws: Option<usize>,
    /// Undamped natural frequency of the position loops, Hz
    #[arg(long, default_value_t = Settings::default().bandwidth)]
    bandwidth: f64,
    /// Damping ratio of the position loops
    #[arg(long, default_value_t = Settings::default().damping)]
    damping: f64,
    /// Control ticks a second, Hz
    #[arg(long, help = format!("Control ticks a second, Hz [default: {}]", Settings::default().rate))]
    rate: Option<f64>,
    /// The torque acts in the tick of its measurement, not one later
    #[arg(long)]
    no_delay: bool,
    /// Encoder step of joints without a described encoder, rad or m at the joint; 0 for exact positions and velocities
    #[arg(long, default_value_t = Settings::default().resolution)]
    resolution: f64,
    /// Share of dry friction that is compensated in motion, 0 to 1
    #[arg(long, default_value_t = Settings::default().friction_gain)]
    friction_gain: f64,
    #[command(flatten)]
    contact: ContactArgs,
    /// Seed of the noise and of the wrong parameters
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    report: ReportArg,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder already holds; recordings of the earlier run are removed
    #[arg(long)]
    force: bool,
}

/// The surface and the task on it.
#[derive(Debug, ClapArgs)]
struct ContactArgs {
    #[arg(long, help = format!("Stiffness of the surface, N/m [default: {}]", Surface::default().stiffness))]
    stiffness: Option<f64>,
    #[arg(long, help = format!("Damping of the surface, N·s/m [default: {}]", Surface::default().damping))]
    surface_damping: Option<f64>,
    #[arg(long, help = format!("Coefficient of friction between tool and surface [default: {}]", Surface::default().friction))]
    surface_friction: Option<f64>,
    #[arg(long, help = format!("Distance of the tool from the surface at the start, m [default: {}]", Surface::default().gap))]
    gap: Option<f64>,
    /// Wanted force, N [default: 20, or a quarter of what the torque limits allow]
    #[arg(long, value_name = "N")]
    press: Option<f64>,
    /// Length of the slide along the surface, m [default: 0.05]
    #[arg(long)]
    slide: Option<f64>,
    /// Stiffness of the impedance, N/m [default: that of a fifth of the bandwidth]
    #[arg(long)]
    impedance: Option<f64>,
    /// Standard deviation of the noise of the measured force, N [default: 0]
    #[arg(long)]
    noise_force: Option<f64>,
    /// Tool point in the flange frame, m
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    tool: Option<Vec<f64>>,
    /// Joint positions at the start, base first, separated by commas or spaces, rad or m
    #[arg(long, value_name = "Q1,Q2,…", allow_hyphen_values = true)]
    pose: Vec<String>,
    /// Direction into the surface, in the base frame
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    normal: Option<Vec<f64>>,
}

impl ContactArgs {
    /// Returns the given start pose.
    fn start(&self) -> Result<Option<Vec<f64>>, CommandError> {
        let all: Result<Vec<_>, _> = self.pose.iter().map(|text| positions(text)).collect();
        Ok(Some(all?.concat()).filter(|pose| !pose.is_empty()))
    }
}

/// A law, or several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Law {
    /// Independent PID of the motors, with gravity and friction compensation
    Pid,
    /// Computed torque
    ComputedTorque,
    /// Slotine and Li's adaptive law in base parameters
    Adaptive,
    /// pid, computed-torque and adaptive
    All,
    /// Force along the normal of a surface, motion along it
    Hybrid,
    /// The tool as a mass with spring and damper
    Impedance,
    /// hybrid and impedance
    Contact,
}

impl Law {
    fn kinds(self) -> &'static [LawKind] {
        match self {
            Self::Pid => &[LawKind::Pid],
            Self::ComputedTorque => &[LawKind::ComputedTorque],
            Self::Adaptive => &[LawKind::Adaptive],
            Self::All => &[LawKind::Pid, LawKind::ComputedTorque, LawKind::Adaptive],
            Self::Hybrid => &[LawKind::Hybrid],
            Self::Impedance => &[LawKind::Impedance],
            Self::Contact => &[LawKind::Hybrid, LawKind::Impedance],
        }
    }
}

/// Recordings that the command writes with one model; with several, the model's number follows the law.
const MOTIONS: [&str; 5] = [
    "pid.csv",
    "computed-torque.csv",
    "adaptive.csv",
    "hybrid.csv",
    "impedance.csv",
];

/// Length of the default motion, s.
const DURATION: f64 = 10.0;
/// Number of motions with wrong parameters.
const DRAWS: usize = 20;
/// Length of the slide, m.
const SLIDE: f64 = 0.05;
/// Largest share of wrong parameters, per cent: beyond it some inertia could vanish.
const MOST_WRONG: f64 = 90.0;

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join("control.json")
    }

    /// Returns the laws, each once.
    fn laws(&self) -> Vec<LawKind> {
        let mut laws: Vec<LawKind> = Vec::new();
        for kind in self.law.iter().flat_map(|law| law.kinds()) {
            if !laws.contains(kind) {
                laws.push(*kind);
            }
        }
        laws
    }

    /// Refuses options that none of the laws uses.
    fn refuse_unused(&self, laws: &[LawKind]) -> Result<(), CommandError> {
        let contact = &self.contact;
        let of_contact = [
            ("--stiffness", contact.stiffness.is_some()),
            ("--surface-damping", contact.surface_damping.is_some()),
            ("--surface-friction", contact.surface_friction.is_some()),
            ("--gap", contact.gap.is_some()),
            ("--press", contact.press.is_some()),
            ("--slide", contact.slide.is_some()),
            ("--noise-force", contact.noise_force.is_some()),
            ("--pose", !contact.pose.is_empty()),
            ("--normal", contact.normal.is_some()),
        ];
        let of_tracking = [
            ("--trajectory", self.trajectory.is_some()),
            ("--duration", self.duration.is_some()),
        ];
        let given = |list: &[(&'static str, bool)]| {
            let mut list = list.iter();
            list.find(|(_, given)| *given).map(|(option, _)| *option)
        };
        if let (Some(draws), None) = (self.draws, self.wrong) {
            return Err(CommandError::Sentence(format!(
                "--draws {draws} belongs to --wrong; leave it out, or give --wrong."
            )));
        }
        let presses = laws.iter().any(|law| law.is_contact());
        let tracks = laws.iter().any(|law| !law.is_contact());
        let (option, of) = match (given(&of_contact), given(&of_tracking)) {
            (Some(option), _) if !presses => (option, "hybrid, impedance or contact"),
            (_, Some(option)) if !tracks => (option, "pid, computed-torque, adaptive or all"),
            _ if contact.impedance.is_some() && !laws.contains(&LawKind::Impedance) => {
                ("--impedance", "impedance or contact")
            }
            _ => return Ok(()),
        };
        Err(CommandError::Sentence(format!(
            "{option} belongs to --law {of}; leave it out, or give such a law."
        )))
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, value, joint or time.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    can_take(&args.out, &["control.json", "report.html"])?;
    refuse_folder(&args.out, &MOTIONS, args.force)?;
    let laws = args.laws();
    args.refuse_unused(&laws)?;
    let settings = settings(args)?;
    let robot = args.robot.load(ui)?;
    let mut notes = Vec::new();
    let models = models(args, &robot, &mut notes, ui)?;
    let truth = Model::from_robot(&robot)?;
    // Refuses a joint without inertia.
    controllers(&robot, &truth, &robot.middle_position())?;
    for name in motion_names(&laws, models.len()) {
        refuse_file(&args.out.join(name), args.force)?;
    }
    notes.extend(assumptions(&robot, &settings));
    let mut evaluation = Evaluation {
        schema: "rig-control/1",
        robot: robot.name.clone(),
        settings,
        task: None,
        tracking: Vec::new(),
        contact: Vec::new(),
        failed: Vec::new(),
        notes,
    };
    evaluation.notes.extend(truth.effects.unsimulated());
    let (pressing, tracking): (Vec<_>, Vec<_>) = laws.into_iter().partition(|law| law.is_contact());
    let mut motions = Vec::new();
    let whole = Whole {
        args,
        robot: &robot,
        truth: &truth,
        models: &models,
    };
    if !tracking.is_empty() {
        whole.track(&tracking, settings, &mut evaluation, &mut motions, ui)?;
    }
    if !pressing.is_empty() {
        whole.press(&pressing, settings, &mut evaluation, &mut motions, ui)?;
    }
    if args.model.iter().any(|own| own == args.robot.path()) {
        let better = evaluation.better_when_wrong(&file_name(args.robot.path()));
        evaluation.notes.extend(better);
    }
    refuse_all_failed(&evaluation)?;
    for note in &evaluation.notes {
        ui.note(note);
    }
    for warning in evaluation.warnings() {
        ui.warn(&warning);
    }
    write(args, &robot, &evaluation, &motions, ui)?;
    for line in lines(&evaluation) {
        ui.answer(&line);
    }
    args.report.tell(&args.out.join("report.html"), ui);
    refuse_failed(&evaluation, &args.out)
}

/// Returns the name of the recording of a law with model `k` of `models`.
fn motion_name(law: LawKind, k: usize, models: usize) -> String {
    match models {
        1 => format!("{}.csv", law.name()),
        _ => format!("{}-{}.csv", law.name(), k + 1),
    }
}

/// Returns the names of all recordings.
fn motion_names(laws: &[LawKind], models: usize) -> Vec<String> {
    let of = |law: &LawKind| {
        let law = *law;
        (0..models).map(move |k| motion_name(law, k, models))
    };
    laws.iter().flat_map(of).collect()
}

/// Removes the recordings that an earlier run left in the folder. Its control.json lists them; the names are this
/// command's.
///
/// # Errors
/// A file cannot be removed.
fn remove_earlier(out: &Path) -> Result<(), CommandError> {
    let Ok(text) = std::fs::read_to_string(out.join("control.json")) else {
        return Ok(());
    };
    let Ok(earlier) = serde_json::from_str::<serde_json::Value>(&text) else {
        return Ok(());
    };
    let runs = ["tracking", "contact"].into_iter();
    let runs = runs.flat_map(|part| earlier[part].as_array().into_iter().flatten());
    for name in runs.filter_map(|run| run["motion"].as_str()) {
        let path = out.join(name);
        if is_motion(name) && path.is_file() {
            std::fs::remove_file(&path).map_err(|error| {
                CommandError::Sentence(format!(
                    "{} of an earlier run cannot be removed: {error}.",
                    path.display()
                ))
            })?;
        }
    }
    Ok(())
}

/// Returns true if this command writes recordings of this name: a law, perhaps with a number.
fn is_motion(name: &str) -> bool {
    MOTIONS.contains(&name)
        || MOTIONS.iter().any(|own| {
            let law = own.trim_end_matches(".csv");
            (name
                .strip_prefix(law)
                .and_then(|rest| rest.strip_prefix('-')))
            .and_then(|rest| rest.strip_suffix(".csv"))
            .is_some_and(|number| number.parse::<usize>().is_ok())
        })
}

/// A motion to be written: file name, motion, reference.
type Motion = (String, Trace, Vec<Vec<Reference<f64>>>);

/// All inputs of the command.
struct Whole<'a> {
    args: &'a Args,
    robot: &'a Robot,
    truth: &'a Model,
    models: &'a [(String, LawModel)],
}

impl Whole<'_> {
    /// Runs each law with each model, `run` for the law, the model and the name of the recording.
    fn each(
        &self,
        laws: &[LawKind],
        mut run: impl FnMut(LawKind, &LawModel, &str, String) -> Result<(), CommandError>,
    ) -> Result<(), CommandError> {
        for law in laws {
            for (k, (name, model)) in self.models.iter().enumerate() {
                let motion = motion_name(*law, k, self.models.len());
                run(*law, model, name, motion)?;
            }
        }
        Ok(())
    }

    /// Returns the tool point that was given in the flange frame, in the frame of the last joint, m.
    fn tool(&self) -> Result<Option<[f64; 3]>, CommandError> {
        let given = three("tool", self.args.contact.tool.as_deref())?;
        Ok(given.map(|point| self.robot.point_of_flange(point)))
    }

    fn bench<'b>(
        &'b self,
        reference: &'b [Vec<Reference<f64>>],
        tool: [f64; 3],
        settings: Settings,
    ) -> Bench<'b> {
        Bench {
            robot: self.robot,
            truth: self.truth,
            reference,
            tool,
            settings,
            wrong: self
                .args
                .wrong
                .map(|share| (0.01 * share, self.args.draws.unwrap_or(DRAWS))),
        }
    }

    /// Returns the motion at `rate` (Hz), and notes how it was interpolated.
    fn motion(&self, rate: f64, notes: &mut Vec<String>) -> Result<SampledReference, CommandError> {
        let Some(path) = &self.args.trajectory else {
            return Ok(default_reference(
                self.robot,
                rate,
                self.args.duration.unwrap_or(DURATION),
            ));
        };
        let (sampled, from) = reference_at(path, self.robot, rate)?;
        notes.extend(from.map(|from| {
            format!(
                "{}: the reference is sampled at {} Hz; quintics through its samples give position, velocity and acceleration at the {} Hz of the control loop (--rate).",
                path.display(),
                format_trimmed(from, 6),
                format_trimmed(rate, 6)
            )
        }));
        Ok(sampled)
    }

    fn track(
        &self,
        laws: &[LawKind],
        settings: Settings,
        evaluation: &mut Evaluation,
        motions: &mut Vec<Motion>,
        ui: &Ui,
    ) -> Result<(), CommandError> {
        let sampled = self.motion(settings.rate, &mut evaluation.notes)?;
        let reference = references(&sampled)?;
        let tool = match self.tool()? {
            Some(tool) => tool,
            None => tool_point(&LawModel::of(self.robot)?, &mut evaluation.notes)?,
        };
        let bench = self.bench(&reference, tool, settings);
        let mut progress = ui.progress("simulating", (laws.len() * self.models.len()) as u64);
        self.each(laws, |law, model, name, motion| {
            let run = bench.track(law, model, name);
            progress.advance(1);
            let Some(mut run) = finished(run, law, name, &mut evaluation.failed)? else {
                return Ok(());
            };
            run.measures.motion.clone_from(&motion);
            add_notes(&mut evaluation.notes, run.notes);
            evaluation.tracking.push(run.measures);
            motions.push((motion, run.trace, reference.clone()));
            Ok(())
        })
    }

    fn press(
        &self,
        laws: &[LawKind],
        settings: Settings,
        evaluation: &mut Evaluation,
        motions: &mut Vec<Motion>,
        ui: &Ui,
    ) -> Result<(), CommandError> {
        let given = &self.args.contact;
        let usual = Surface::default();
        let options = ContactOptions {
            surface: Surface {
                stiffness: given.stiffness.unwrap_or(usual.stiffness),
                damping: given.surface_damping.unwrap_or(usual.damping),
                friction: given.surface_friction.unwrap_or(usual.friction),
                gap: given.gap.unwrap_or(usual.gap),
            },
            tool: self.tool()?,
            pose: given.start()?,
            normal: three("normal", given.normal.as_deref())?,
            force: given.press,
            slide: given.slide.unwrap_or(SLIDE),
            stiffness: given.impedance,
        };
        // One task for all models: that of the first.
        let Some((_, first)) = self.models.first() else {
            return Ok(());
        };
        let task = ContactTask::choose(first, &options, &settings)?;
        add_notes(&mut evaluation.notes, task.notes.clone());
        let reference = task.joint_reference((task.duration * settings.rate).ceil() as usize);
        let bench = self.bench(&reference, task.tool, settings);
        let mut progress = ui.progress("simulating", (laws.len() * self.models.len()) as u64);
        self.each(laws, |law, model, name, motion| {
            let run = bench.press(law, model, name, &task);
            progress.advance(1);
            let Some(mut run) = finished(run, law, name, &mut evaluation.failed)? else {
                return Ok(());
            };
            run.measures.motion.clone_from(&motion);
            add_notes(&mut evaluation.notes, run.notes);
            evaluation.contact.push(run.measures);
            motions.push((motion, run.trace, reference.clone()));
            Ok(())
        })?;
        evaluation.task = Some(task);
        Ok(())
    }
}

/// Returns the motion of a law. A law that is unstable or gives no torque is noted, so that the others still run.
///
/// # Errors
/// All other errors, which concern all laws.
fn finished<M>(
    run: Result<Run<M>, ControlError>,
    law: LawKind,
    model: &str,
    failed: &mut Vec<Failed>,
) -> Result<Option<Run<M>>, CommandError> {
    match run {
        Ok(run) => Ok(Some(run)),
        Err(error @ (ControlError::Unstable { .. } | ControlError::Law { .. })) => {
            failed.push(Failed {
                law,
                model: model.to_owned(),
                reason: error.to_string(),
            });
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

/// Refuses a run in which no law finished its motion, with the reason of the first.
fn refuse_all_failed(evaluation: &Evaluation) -> Result<(), CommandError> {
    match evaluation.failed.first() {
        Some(first) if evaluation.tracking.is_empty() && evaluation.contact.is_empty() => {
            Err(CommandError::Sentence(first.reason.clone()))
        }
        _ => Ok(()),
    }
}

/// Fails if a law did not finish its motion; the others are reported.
fn refuse_failed(evaluation: &Evaluation, out: &Path) -> Result<(), CommandError> {
    let names: Vec<String> = (evaluation.failed.iter())
        .map(|own| format!("{} with {}", own.law.name(), own.model))
        .collect();
    match names.is_empty() {
        true => Ok(()),
        false => Err(CommandError::Sentence(format!(
            "No motion of {}: the warning above says why. The other laws are in {}.",
            names.join(", "),
            out.display()
        ))),
    }
}

/// Adds the notes that are not there yet.
fn add_notes(notes: &mut Vec<String>, more: Vec<String>) {
    for note in more {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
}

fn settings(args: &Args) -> Result<Settings, CommandError> {
    let settings = Settings {
        bandwidth: args.bandwidth,
        damping: args.damping,
        rate: args.rate.unwrap_or(Settings::default().rate),
        delay: !args.no_delay,
        resolution: args.resolution,
        friction_gain: args.friction_gain,
        force_noise: args.contact.noise_force.unwrap_or(0.0),
        seed: args.seed,
        ..Settings::default()
    };
    settings.check()?;
    for (name, value, most, hint) in [
        ("scale", args.scale, 10.0, "; it is a factor, 0.7 for 70 %"),
        ("duration", args.duration.unwrap_or(DURATION), 3600.0, ""),
    ] {
        if !(value > 0.0 && value <= most) {
            return Err(CommandError::Sentence(format!(
                "--{name} {value} is not possible: it must be above 0 and at most {most}{hint}."
            )));
        }
    }
    if let Some(wrong) = args.wrong
        && !(wrong > 0.0 && wrong <= MOST_WRONG)
    {
        return Err(CommandError::Sentence(format!(
            "--wrong {wrong} is not possible: it must be above 0 and at most {MOST_WRONG} per cent."
        )));
    }
    if let Some(draws) = args.draws.filter(|draws| !(1..=10_000).contains(draws)) {
        return Err(CommandError::Sentence(format!(
            "--draws {draws} is not possible: it must be between 1 and 10000."
        )));
    }
    Ok(settings)
}

/// Returns the name of a file without its folder.
fn file_name(path: &Path) -> String {
    let file = path.file_name().unwrap_or(path.as_os_str());
    file.to_string_lossy().into_owned()
}

/// Returns the models of the laws with their names. Adds sentences about them to `notes`.
fn models(
    args: &Args,
    robot: &Robot,
    notes: &mut Vec<String>,
    ui: &Ui,
) -> Result<Vec<(String, LawModel)>, CommandError> {
    let mut models = Vec::new();
    if args.model.is_empty() {
        models.push((file_name(args.robot.path()), LawModel::of(robot)?));
    }
    for path in &args.model {
        let other = described(path, args.robot.chain(), ui)?.robot;
        let (model, note) = LawModel::of_same(&other, robot, &path.display().to_string())?;
        notes.extend(note);
        models.push((file_name(path), model));
    }
    for (name, model) in &mut models {
        if (args.scale - 1.0).abs() > 0.0 {
            model.scale(args.scale);
            *name = format!("{name} × {}", format_significant(args.scale, 3));
        }
    }
    Ok(models)
}

fn three(name: &str, given: Option<&[f64]>) -> Result<Option<[f64; 3]>, CommandError> {
    match given {
        None => Ok(None),
        Some([a, b, c]) if [a, b, c].iter().all(|v| v.abs() <= 10.0) => Ok(Some([*a, *b, *c])),
        Some(other) => Err(CommandError::Sentence(format!(
            "--{name} {other:?} is not possible: give three numbers of at most 10."
        ))),
    }
}

/// Returns what is assumed of the robot, one sentence each.
fn assumptions(robot: &Robot, settings: &Settings) -> Vec<String> {
    let mut notes = Vec::new();
    let names = |which: &dyn Fn(usize) -> bool| -> String {
        let joints = robot.joints.iter().enumerate().filter(|(j, _)| which(*j));
        joints
            .map(|(_, joint)| joint.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    let step = settings.resolution;
    let undescribed = |j: usize| resolution(robot, j, step) == step;
    let list = names(&undescribed);
    if step > 0.0 && !list.is_empty() {
        notes.push(format!(
            "No encoder is described for {list}: a step of {step} rad or m at the joint is assumed (--resolution)."
        ));
    }
    let unlimited = |j: usize| {
        let limits = robot.joints[j].limits.as_ref();
        limits.and_then(|l| l.torque).is_none()
    };
    let list = names(&unlimited);
    if !list.is_empty() {
        notes.push(format!(
            "No torque limit is described for {list}: the torque is not limited."
        ));
    }
    notes
}

/// Writes all files of the result.
///
/// # Errors
/// A file cannot be written.
fn write(
    args: &Args,
    robot: &Robot,
    evaluation: &Evaluation,
    motions: &[Motion],
    ui: &Ui,
) -> Result<(), CommandError> {
    folder(&args.out)?;
    remove_earlier(&args.out)?;
    let json = serde_json::to_string_pretty(evaluation).map_err(|error| {
        CommandError::Sentence(format!("The result cannot be written as JSON: {error}."))
    })?;
    write_whole(&args.out.join("control.json"), (json + "\n").as_bytes())?;
    for (name, trace, reference) in motions {
        save(&args.out.join(name), robot, trace, reference)?;
    }
    let context = Context {
        command: ui.command_line(),
        ..Context::default()
    };
    args.report.write_and_show(
        &args.out.join("report.html"),
        &pages::control(robot, evaluation, &context),
        ui,
    )?;
    Ok(())
}

/// Returns the printed answer.
fn lines(evaluation: &Evaluation) -> Vec<String> {
    let mut lines = Vec::new();
    let short = |value: f64| format_significant(value, 3);
    let robust = |own: &rig_control::Robustness, factor: f64, unit: &str| {
        format!(
            "; parameters wrong by up to {} %: median {} {unit}, worst {} {unit}, {} of {} failed",
            short(100.0 * own.share),
            short(factor * own.median),
            short(factor * own.worst),
            own.failed,
            own.draws
        )
    };
    for own in &evaluation.tracking {
        let mut line = format!(
            "{} with {}: tool error {} mm RMS, {} mm at most",
            own.law.name(),
            own.model,
            short(1e3 * own.tool_rms),
            short(1e3 * own.tool_largest)
        );
        if let Some(found) = &own.robustness {
            line.push_str(&robust(found, 1e3, "mm"));
        }
        lines.push(line);
        if let Some(learnt) = &own.adaptation {
            lines.push(format!(
                "  the motion excites {} of {} directions of the base parameters; error in these {} -> {} sizes of the parameters; torque error of the model {} -> {} % of the limits",
                learnt.excited,
                learnt.count,
                short(learnt.error[0]),
                short(learnt.error[1]),
                short(100.0 * learnt.torque_error[0]),
                short(100.0 * learnt.torque_error[1])
            ));
        }
    }
    for own in &evaluation.contact {
        let settling = own.settling.map_or("not before the slide".to_owned(), |t| {
            format!("after {} s", short(t))
        });
        let slide = own.slide_peak.map_or_else(String::new, |peak| {
            format!(", at most {} N during the slide", short(peak))
        });
        let before = own.slide_peak.map_or_else(String::new, |_| {
            let before = short(100.0 * own.overshoot_before_slide);
            format!(" ({before} % before the slide)")
        });
        let mut line = format!(
            "{} with {}: {} N, ",
            own.law.name(),
            own.model,
            short(own.force)
        );
        let overshoot = short(100.0 * own.overshoot);
        let steady = short(own.steady_error);
        line += &match own.is_steady() {
            true => format!(
                "overshoot {overshoot} %{before}, settled {settling}, steady error {steady} N{slide}, {} bounces",
                own.bounces
            ),
            false => format!(
                "no steady contact: {} bounces, mean error {steady} N before the slide, overshoot {overshoot} %{before}{slide}",
                own.bounces
            ),
        };
        if let Some(found) = &own.robustness {
            line.push_str(&robust(found, 100.0, "%"));
        }
        lines.push(line);
    }
    lines
}
