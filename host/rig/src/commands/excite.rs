//! `rig excite`: designs a motion within the robot's limits that makes its parameters identifiable.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::overwrite::refuse_file;
use super::ui::{LISTED, Ui};
use rig_excite::{
    Criterion, Design, Effort, MultisineOptions, Options, Parameters, PoseOptions, Poses, Scaling,
    StagedKind, StagedOptions, design_measured, multisine, poses, staged,
};
use rig_model::robot::{Robot, joint_place};
use rig_output::format_significant;

/// Optimality criterion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CriterionArg {
    /// Condition number: errors spread evenly over the parameters
    Cond,
    /// Smallest singular value: the least certain combination becomes as certain as possible
    MinSingular,
    /// Determinant of the information: the smallest confidence ellipsoid
    DOptimal,
}

/// Parameters that the criterion includes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ParametersArg {
    /// All that `rig identify` finds: links, drive inertias, friction, offsets
    All,
    /// Only the inertial parameters of the links
    Links,
}

/// Scaling of the regressor's columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ScalingArg {
    /// Each column by the largest size that the limits allow it in any motion
    Sizes,
    /// No scaling: SI units
    None,
}

/// Kind of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum KindArg {
    /// Optimal periodic motion, for identification
    Fourier,
    /// Swept sine, for resonances and frequency response
    Chirp,
    /// Periodic sum of many sines, for frequency response with its noise and distortion; samples only (.csv)
    Multisine,
    /// Steps with rests, for gravity and holding torque
    Staircase,
    /// Slow triangles, for breakaway, presliding and backlash
    Reversals,
    /// Pairs of constant speeds, for the friction map
    Sweep,
}

impl KindArg {
    /// The motions of one joint.
    const STAGED: [Self; 5] = [
        Self::Chirp,
        Self::Multisine,
        Self::Staircase,
        Self::Reversals,
        Self::Sweep,
    ];

    /// Returns the kind of a motion of one joint that a trajectory file describes.
    fn staged(self) -> Option<StagedKind> {
        match self {
            Self::Fourier | Self::Multisine => None,
            Self::Chirp => Some(StagedKind::Chirp),
            Self::Staircase => Some(StagedKind::Staircase),
            Self::Reversals => Some(StagedKind::Reversals),
            Self::Sweep => Some(StagedKind::Sweep),
        }
    }
}

/// Share of each position range that an optimal motion keeps free, half of it at each end.
///
/// A loop with natural frequency ω₀ misses a turning point of a motion at ω by about (ω/ω₀)² of its amplitude. At the default
/// period the fundamental sweeps the range at the velocity limit, ω = velocity/half range, about 1.4 rad/s for an arm of
/// 2.2 rad/s and ±1.6 rad; harmonic k has at most 1/k of the amplitude at that speed, so it misses k times as much. With
/// ω₀ of 2 Hz (12.6 rad/s) this is 1.2 % of the amplitude for the fundamental and 6 % for the fifth harmonic. The 5 % of the
/// range at each end are 10 % of the amplitude.
const MARGIN: f64 = 0.1;
/// Share of the velocity limit that an optimal motion uses; it uses the square of this share of the acceleration limit.
/// A loop with damping 0.7 overshoots a sinusoid by less than 5 %; noise of the measured velocity adds to that.
const SPEED_SHARE: f64 = 0.9;
/// Condition number from which on a motion is reported as poor. Schröer 1993 asks for 100. At 1000, noise of 1 % of the
/// torque is 10 times the torque of the worst combination.
const POOR_CONDITION: f64 = 1e3;

/// Designs a motion within the robot's limits that makes its parameters identifiable.
///
/// The limits are in the robot description under [joint.limits], and under [[workspace]] for points of the links. If
/// the description has inertia and friction, the motion also keeps the torque limit. The same seed gives the same file.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Robot description (.toml or .urdf)
    #[arg(long)]
    pub(crate) robot: PathBuf,
    #[command(flatten)]
    pub(crate) chain: ChainArg,
    /// File to write: .toml holds the motion's parameters (for the rig), .csv its samples
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Kind of motion; all but fourier move one joint
    #[arg(long, value_enum, default_value_t = KindArg::Fourier)]
    pub(crate) kind: KindArg,
    /// Criterion that is optimised [default: cond; d-optimal with --load] (fourier)
    #[arg(long, value_enum)]
    pub(crate) criterion: Option<CriterionArg>,
    /// Parameters that the motion should make identifiable [default: all] (fourier)
    #[arg(long, value_enum)]
    pub(crate) parameters: Option<ParametersArg>,
    /// Scaling of the regressor's columns before the criterion is computed [default: sizes] (fourier)
    #[arg(long, value_enum)]
    pub(crate) scaling: Option<ScalingArg>,
    /// Standard deviation of each joint's torque noise, separated by commas, N*m or N [default: the same share of the
    /// torque limit for all joints] (fourier)
    #[arg(long, value_delimiter = ',')]
    pub(crate) torque_noise: Option<Vec<f64>>,
    /// Identify a load at the flange instead of the robot: by the readings of the [wrist_sensor], with unknown biases,
    /// or by the joint torques if the description has no sensor (fourier)
    #[arg(long, conflicts_with = "parameters")]
    pub(crate) load: bool,
    /// Instead of a periodic motion: rest at this number of poses, 3 to 16, which identify mass and centre of mass of
    /// the load by the [wrist_sensor]
    #[arg(long, requires = "load")]
    pub(crate) poses: Option<usize>,
    /// Standard deviations of the forces and of the moments of the [wrist_sensor], separated by a comma, N and N*m
    /// [default: in proportion to its ranges, else 1,0.05] (--load)
    #[arg(
        long,
        value_delimiter = ',',
        requires = "load",
        conflicts_with = "poses"
    )]
    pub(crate) sensor_noise: Option<Vec<f64>>,
    /// Harmonics per joint, 1 to 8 [default: 5] (fourier)
    #[arg(long)]
    pub(crate) harmonics: Option<usize>,
    /// Period of the slowest harmonic, s [default: from the limits, 1 s at least; for multisine 16 periods of the lowest
    /// frequency] (fourier, multisine)
    #[arg(long)]
    pub(crate) period: Option<f64>,
    /// Time from rest to full amplitude, and from there back to rest, s [default: one period; for multisine two periods of
    /// the lowest frequency] (fourier, multisine)
    #[arg(long)]
    pub(crate) ramp: Option<f64>,
    /// Whole periods at full amplitude [default: 5; for multisine 4, after one in which the joint settles] (fourier,
    /// multisine)
    #[arg(long)]
    pub(crate) periods: Option<u16>,
    /// Joint positions at the start, separated by commas, rad or m [default: free for fourier, else mid-range]
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) start: Option<Vec<f64>>,
    /// The joint that moves [default: the first] (all but fourier)
    #[arg(long)]
    pub(crate) joint: Option<String>,
    /// Share of each position range that is kept free for the tracking error of the controller, half of it at each end
    /// [default: 0.1 for fourier; else the motion uses 80 % of the distance from its start to the nearer limit]
    #[arg(long)]
    pub(crate) margin: Option<f64>,
    /// Share of the velocity limits that is used; of the acceleration limits its square is used [default: 0.9 for
    /// fourier; else 0.8 of both]. Begin with a small share if the motion is new to the robot
    #[arg(long)]
    pub(crate) speed_share: Option<f64>,
    /// Amplitude to either side of the start, rad or m [default: from the limits] (all but fourier)
    #[arg(long)]
    pub(crate) amplitude: Option<f64>,
    /// Speed of reversals, or slowest and fastest speed of a sweep separated by a comma, rad/s or m/s [default: 0.8 %
    /// of the limit; 0.4 to 80 %]
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) speed: Option<Vec<f64>>,
    /// Number of speeds, 2 to 16 [default: 12] (sweep)
    #[arg(long)]
    pub(crate) speeds: Option<usize>,
    /// First and last frequency separated by a comma, Hz [default: from the limits] (chirp, multisine)
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) band: Option<Vec<f64>>,
    /// Triangles, two reversals each, at each of three amplitudes [default: 2] (reversals)
    #[arg(long)]
    pub(crate) cycles: Option<u16>,
    /// Random starts of the optimiser: more starts find better motions but take longer [default: 24] (fourier)
    #[arg(long)]
    pub(crate) starts: Option<u32>,
    /// Seed of the random starts, or of the phases [default: 1] (fourier, multisine)
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Sample rate of a .csv, Hz
    #[arg(long, default_value_t = 1000.0)]
    pub(crate) rate: f64,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Design the motion although the limits look like degrees
    #[arg(long)]
    pub(crate) even_if_wrong: bool,
}

impl Args {
    /// Refuses options that this kind of motion does not use.
    fn refuse_unused(&self) -> Result<(), CommandError> {
        use KindArg::{Chirp, Fourier, Multisine, Reversals, Sweep};
        let periodic = &[Fourier, Multisine][..];
        let options = [
            ("--criterion", self.criterion.is_some(), &[Fourier][..]),
            ("--parameters", self.parameters.is_some(), &[Fourier]),
            ("--scaling", self.scaling.is_some(), &[Fourier]),
            ("--torque-noise", self.torque_noise.is_some(), &[Fourier]),
            ("--harmonics", self.harmonics.is_some(), &[Fourier]),
            ("--period", self.period.is_some(), periodic),
            ("--ramp", self.ramp.is_some(), periodic),
            ("--periods", self.periods.is_some(), periodic),
            ("--starts", self.starts.is_some(), &[Fourier]),
            ("--seed", self.seed.is_some(), periodic),
            ("--load", self.load, &[Fourier]),
            ("--joint", self.joint.is_some(), &KindArg::STAGED),
            ("--amplitude", self.amplitude.is_some(), &KindArg::STAGED),
            ("--speed", self.speed.is_some(), &[Reversals, Sweep]),
            ("--speeds", self.speeds.is_some(), &[Sweep]),
            ("--band", self.band.is_some(), &[Chirp, Multisine]),
            ("--cycles", self.cycles.is_some(), &[Reversals]),
        ];
        // All before --seed, which also draws poses.
        if let (Some(count), Some((option, ..))) =
            (self.poses, options[..9].iter().find(|(_, given, _)| *given))
        {
            return Err(CommandError::Sentence(format!(
                "{option} belongs to a periodic motion, but --poses {count} asks for poses at rest; leave one of them out."
            )));
        }
        let Some((option, _, kinds)) =
            (options.iter()).find(|(_, given, kinds)| *given && !kinds.contains(&self.kind))
        else {
            return Ok(());
        };
        let name = |kind: &KindArg| {
            (kind.to_possible_value()).map_or(String::new(), |value| value.get_name().to_owned())
        };
        let names: Vec<String> = kinds.iter().map(name).collect();
        Err(CommandError::Sentence(match (*option, &self.joint) {
            ("--joint", Some(joint)) => format!(
                "--joint {joint} names the one joint that moves, but --kind fourier moves all of them; give --kind {}, or leave --joint out.",
                names.join(", ")
            ),
            _ if kinds.contains(&Fourier) => format!(
                "{option} belongs to --kind {}; the size of a {} follows from the limits and its own options, so leave the option out or give that kind.",
                names.join(", "),
                name(&self.kind)
            ),
            _ => format!(
                "{option} belongs to --kind {}; leave it out, or give that kind.",
                names.join(", ")
            ),
        }))
    }

    /// Refuses options on noise that the rows of this robot do not have.
    fn refuse_other_noise(&self, robot: &Robot) -> Result<(), CommandError> {
        let sensor = self.load && robot.wrist_sensor.is_some();
        let unused = match (&self.torque_noise, &self.sensor_noise) {
            (Some(_), _) if sensor => {
                "--torque-noise has no effect: the load is identified by the [wrist_sensor]; give --sensor-noise instead, or leave it out."
            }
            (_, Some(_)) if !sensor => {
                "--sensor-noise has no effect: the description has no [wrist_sensor], so the load is identified by the joint torques; give --torque-noise instead, or leave it out."
            }
            _ => return Ok(()),
        };
        Err(CommandError::Sentence(unused.to_owned()))
    }

    /// Standard deviations of force and moment.
    ///
    /// # Errors
    /// `--sensor-noise` has not exactly two numbers.
    fn sensor_noise(&self) -> Result<Option<[f64; 2]>, CommandError> {
        match self.sensor_noise.as_deref() {
            None => Ok(None),
            Some(&[force, moment]) => Ok(Some([force, moment])),
            Some(other) => Err(CommandError::Sentence(format!(
                "--sensor-noise has {} numbers; give two, that of the forces in N and that of the moments in N·m, such as 0.5,0.02.",
                other.len()
            ))),
        }
    }

    /// Options of a motion of one joint.
    ///
    /// # Errors
    /// `--band` has not exactly two numbers.
    fn staged_options(&self) -> Result<StagedOptions, CommandError> {
        let band = match self.band.as_deref() {
            None => None,
            // A frequency of half the rate has two rows a period.
            Some(&[_, high]) if high >= 0.5 * self.rate => {
                return Err(CommandError::Sentence(format!(
                    "--band up to {high} Hz needs more than {} rows a second, and --rate is {}; give a lower frequency or a higher --rate.",
                    2.0 * high,
                    self.rate
                )));
            }
            Some(&[low, high]) => Some([low, high]),
            Some(other) => {
                return Err(CommandError::Sentence(format!(
                    "--band has {} numbers; give two, the first and the last frequency in Hz, such as 0.5,20.",
                    other.len()
                )));
            }
        };
        Ok(StagedOptions {
            joint: self.joint.clone(),
            start: self.start.clone(),
            margin: self.margin,
            speed_share: self.speed_share,
            amplitude: self.amplitude,
            speeds: self.speed.clone(),
            count: self.speeds,
            band,
            cycles: self.cycles,
        })
    }
}

/// Condition number beyond which the worst combination of parameters is smaller than the rounding of single precision:
/// 1/2⁻²³. The rig and many loggers store torques in single precision.
const TELLS_NOTHING: f64 = 1.0 / f32::EPSILON as f64;
/// Advice against a large condition number.
const MORE_MOTION: &str = "give a longer --period, more range or more --harmonics";

/// Note about checks that were not made; printed with each motion.
const NOT_LOOKED_AT: &str = "Not checked: self-collision, collisions with the table and other objects, cables. The limits hold for the reference only; the robot may go beyond it (--margin and --speed-share leave room for that). Watch a first run at low speed, for example with --speed-share 0.2, and keep the emergency stop at hand.";

/// Runs the command.
///
/// # Errors
/// An unsuitable description or option, no motion within the limits, or a file that cannot be written.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    args.refuse_unused()?;
    refuse_file(&args.out, args.force)?;
    let robot = described(&args.robot, &args.chain, ui)?.robot;
    if !args.even_if_wrong && !robot.limits_in_degrees().is_empty() {
        return Err(CommandError::Implausible(
            "A motion sized by limits that look like degrees may break the robot, so none was designed; correct the limits, or give --even-if-wrong if they are right.".to_owned(),
        ));
    }
    args.refuse_other_noise(&robot)?;
    design(args, &robot, ui).map_err(|error| located(error, &args.robot, &robot))
}

/// Names the line of a TOML description at which the value stands that leaves no motion.
fn located(error: CommandError, path: &Path, robot: &Robot) -> CommandError {
    let CommandError::Excite(error) = error else {
        return error;
    };
    let place = || {
        let (joint, keys) = error.described_value()?;
        let is_toml = path.extension().is_some_and(|end| end == "toml");
        let text = is_toml.then(|| std::fs::read_to_string(path).ok())??;
        Some(joint_place(&text, robot.joint_index(joint)?, keys))
    };
    match place() {
        Some(place) => CommandError::Described {
            path: path.into(),
            place,
            error: Box::new(error),
        },
        None => CommandError::Excite(error),
    }
}

/// Designs the motion or the poses, and writes them.
fn design(args: &Args, robot: &Robot, ui: &Ui) -> Result<(), CommandError> {
    if let Some(count) = args.poses {
        return at_rest(args, count, robot, ui);
    }
    if args.kind == KindArg::Multisine {
        return many_sines(args, robot, ui);
    }
    let Some(kind) = args.kind.staged() else {
        return optimal(args, robot, ui);
    };
    let (file, notes) = staged(robot, kind, &args.staged_options()?)?;
    file.save(&args.out, robot, args.rate)?;
    for note in notes {
        ui.note(&note);
    }
    ui.say(NOT_LOOKED_AT);
    ui.file(&args.out);
    ui.fact("duration", file.duration());
    ui.answer(&format!(
        "{}: the motion, {} of {:.1} s.",
        args.out.display(),
        kind.name(),
        file.duration()
    ));
    Ok(())
}

/// Designs a multisine.
fn many_sines(args: &Args, robot: &Robot, ui: &Ui) -> Result<(), CommandError> {
    let extension = args.out.extension().and_then(|e| e.to_str());
    if !extension.is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
        return Err(CommandError::Sentence(format!(
            "--out {} is no .csv, and a multisine has more sines than a .toml trajectory can hold; give a .csv, which holds its samples.",
            args.out.display()
        )));
    }
    let found = multisine(
        robot,
        &MultisineOptions {
            staged: args.staged_options()?,
            period: args.period,
            periods: args.periods,
            ramp: args.ramp,
            seed: args.seed.unwrap_or(1),
            rate: args.rate,
        },
    )?;
    found.reference.save(&args.out, robot)?;
    for note in &found.notes {
        ui.note(note);
    }
    let [position, velocity, acceleration] = found.shares.map(|share| 100.0 * share);
    ui.detail(&format!(
        "{} odd harmonics from {} to {} Hz; crest factor {:.2} of the position, {:.2} of the velocity, {:.2} of the acceleration.",
        found.harmonics,
        format_significant(found.band[0], 4),
        format_significant(found.band[1], 4),
        found.crest[0],
        found.crest[1],
        found.crest[2]
    ));
    ui.say(&format!(
        "It uses {position:.0} % of the distance to the position limit, {velocity:.0} % of the velocity limit and {acceleration:.0} % of the acceleration limit."
    ));
    ui.say(NOT_LOOKED_AT);
    ui.file(&args.out);
    ui.fact("duration", found.duration());
    ui.answer(&format!(
        "{}: the motion, {} periods of {} s with rise and fall, {:.1} s.",
        args.out.display(),
        found.periods,
        found.period,
        found.duration()
    ));
    Ok(())
}

/// Designs poses at rest.
fn at_rest(args: &Args, count: usize, robot: &Robot, ui: &Ui) -> Result<(), CommandError> {
    let options = PoseOptions {
        count,
        start: args.start.clone(),
        margin: args.margin.unwrap_or(MARGIN),
        speed_share: args.speed_share.unwrap_or(SPEED_SHARE),
        seed: args.seed.unwrap_or(1),
    };
    let found = poses(robot, &options)?;
    for note in &found.notes {
        ui.note(note);
    }
    found.file.save(&args.out, robot, args.rate)?;
    for line in poses_one_by_one(&found) {
        ui.detail(&line);
    }
    for line in summary_of_poses(&found) {
        ui.say(&line);
    }
    ui.say(NOT_LOOKED_AT);
    ui.file(&args.out);
    ui.fact("duration", found.file.duration());
    ui.answer(&format!(
        "{}: the motion, {:.1} s, with a rest of {:.1} s at each pose.",
        args.out.display(),
        found.file.duration(),
        found.dwell
    ));
    Ok(())
}

/// Describes how well poses identify a load.
fn summary_of_poses(found: &Poses) -> [String; 2] {
    [
        format!(
            "For mass and first moment of a load, with six unknown biases: D-optimal value {:.3} of at most {:.3}, condition number {}.",
            found.value,
            found.best_value,
            number(found.condition_number)
        ),
        format!(
            "Standard deviations for a noise of 1 in the mean reading of each pose: mass {:.4} kg per N; first moment {:.4} kg·m per N·m, in its least certain direction (divided by the load's mass: its centre of mass, in m per N·m).",
            found.mass_deviation, found.first_moment_deviation
        ),
    ]
}

/// Describes each pose in a line.
fn poses_one_by_one(found: &Poses) -> impl Iterator<Item = String> {
    let poses = found.positions.iter().zip(&found.gravity).enumerate();
    poses.map(|(k, (q, [x, y, z]))| {
        let q: Vec<String> = q.iter().map(|q| format!("{q:.3}")).collect();
        format!(
            "Pose {}: gravity along {x:.2}, {y:.2}, {z:.2} of the sensor; joints at {}.",
            k + 1,
            q.join(", ")
        )
    })
}

fn optimal(args: &Args, robot: &Robot, ui: &Ui) -> Result<(), CommandError> {
    let default = Options::default();
    let options = Options {
        criterion: match args.criterion {
            // The condition number does not see that a motion is small.
            None if args.load => Criterion::Determinant,
            None => default.criterion,
            Some(CriterionArg::Cond) => Criterion::ConditionNumber,
            Some(CriterionArg::MinSingular) => Criterion::SmallestSingularValue,
            Some(CriterionArg::DOptimal) => Criterion::Determinant,
        },
        parameters: match args.parameters {
            None if args.load => Parameters::Load,
            None => default.parameters,
            Some(ParametersArg::All) => Parameters::All,
            Some(ParametersArg::Links) => Parameters::Links,
        },
        scaling: match args.scaling {
            None => default.scaling,
            Some(ScalingArg::Sizes) => Scaling::Sizes,
            Some(ScalingArg::None) => Scaling::None,
        },
        torque_noise: args.torque_noise.clone(),
        sensor_noise: args.sensor_noise()?,
        harmonics: args.harmonics.unwrap_or(default.harmonics),
        period: args.period,
        periods: args.periods.unwrap_or(default.periods),
        ramp: args.ramp,
        start: args.start.clone(),
        margin: args.margin.unwrap_or(MARGIN),
        speed_share: args.speed_share.unwrap_or(SPEED_SHARE),
        starts: args.starts.unwrap_or(default.starts),
        seed: args.seed.unwrap_or(default.seed),
        threads: None,
    };
    let mut progress = ui.progress("designing the motion", 1);
    let (found, effort) =
        design_measured(robot, &options, |done, total| progress.at_of(done, total))?;
    drop(progress);
    for note in &found.notes {
        ui.note(note);
    }
    let condition = found.values.condition_number;
    if condition > TELLS_NOTHING {
        return Err(CommandError::Sentence(format!(
            "This motion identifies nothing: its condition number is {}, so one combination of parameters changes the {} that many times less than the others. Nothing was written; {MORE_MOTION}.",
            number(condition),
            if args.load && robot.wrist_sensor.is_some() {
                "readings"
            } else {
                "torque"
            }
        )));
    }
    found.file.save(&args.out, robot, args.rate)?;
    for line in reached(&found, robot) {
        ui.detail(&line);
    }
    ui.say(&speed_up(&effort));
    ui.detail(&format!(
        "Try it with `rig simulate --robot {} --trajectory {} --out run.csv`, or run it on the robot and record.",
        args.robot.display(),
        args.out.display()
    ));
    for line in judged(args, &found, robot, ui) {
        ui.say(&line);
    }
    ui.say(NOT_LOOKED_AT);
    ui.file(&args.out);
    ui.fact("duration", found.file.duration());
    ui.answer(&format!(
        "{}: the motion, {:.1} s from rest to rest.",
        args.out.display(),
        found.file.duration()
    ));
    Ok(())
}

/// Describes what the threads saved.
fn speed_up(effort: &Effort) -> String {
    let threads = match effort.threads {
        1 => "one thread".to_owned(),
        count => format!("{count} threads"),
    };
    let kind = if effort.processor {
        "processor time"
    } else {
        "elapsed time, waiting for a processor included,"
    };
    let gain = match (effort.threads, effort.speed_up()) {
        (1, _) => ".".to_owned(),
        (_, gain) if gain > 1.0 => format!(": {gain:.2} times as fast as one thread."),
        _ => ": other programs used the processors, so what the threads saved cannot be told."
            .to_owned(),
    };
    format!(
        "Search: {:.1} s of {kind} by {threads} in {:.1} s{gain}",
        effort.work.as_secs_f64(),
        effort.wall.as_secs_f64(),
    )
}

/// Formats a condition number with its significant digits.
fn number(condition: f64) -> String {
    if condition < 1e6 {
        format!("{condition:.3}")
    } else {
        format_significant(condition, 2)
    }
}

/// Rates a condition number in words.
fn verdict(condition: f64) -> String {
    if condition < 100.0 {
        "good (below 100)".into()
    } else if condition < POOR_CONDITION {
        "usable (100 to 1000)".into()
    } else {
        format!(
            "poor: one combination of parameters shows {} times less than the others and will not be identified; {MORE_MOTION}",
            format_significant(condition, 1)
        )
    }
}

/// Describes how well the designed motion identifies.
fn judged(args: &Args, found: &Design, robot: &Robot, ui: &Ui) -> [String; 2] {
    let values = &found.values;
    let kind = match (args.load, &robot.wrist_sensor) {
        (false, _) => "base parameters",
        (true, Some(_)) => "parameters of a load at the sensor, with six unknown biases:",
        (true, None) => "parameters of a load, by the joint torques:",
    };
    [
        match found.base_parameters.len() {
            count if count > LISTED && !ui.is_verbose() => {
                format!("For the {count} {}:", kind.trim_end_matches(':'))
            }
            count => format!(
                "For the {count} {kind} {}:",
                found.base_parameters.join(", ")
            ),
        },
        format!(
            "condition number {}, {}; smallest singular value {:.3}, mean {:.3}.",
            match args.scaling {
                Some(ScalingArg::None) =>
                    format!("{} in SI units", number(values.condition_number)),
                None | Some(ScalingArg::Sizes) => format!(
                    "{} with columns scaled to their largest sizes ({} in SI units)",
                    number(values.condition_number),
                    number(values.si_condition_number)
                ),
            },
            verdict(values.condition_number),
            values.smallest_singular_value,
            values.mean_singular_value
        ),
    ]
}

/// Describes what the designed motion uses of the limits, line by line.
fn reached(found: &Design, robot: &Robot) -> Vec<String> {
    let mut lines = Vec::new();
    for (joint, reach) in robot.joints.iter().zip(&found.reach) {
        let torque = reach
            .torque
            .map_or(String::new(), |t| format!(", torque {t:.3}"));
        lines.push(format!(
            "Joint \"{}\" stays within position {:.3} to {:.3}, velocity {:.3}, acceleration {:.3}{torque} (SI units).",
            joint.name, reach.position[0], reach.position[1], reach.velocity, reach.acceleration
        ));
    }
    for (joint, reach) in robot.joints.iter().zip(&found.motors) {
        let torque = (reach.torque).map_or(String::new(), |t| format!(", torque {t:.4} N·m"));
        lines.push(format!(
            "The motor of joint \"{}\" stays within angle {:.3} to {:.3} rad, speed {:.3} rad/s{torque} (motor side).",
            joint.name, reach.position[0], reach.position[1], reach.velocity
        ));
    }
    for edge in &found.clearances {
        let [x, y, z] = edge.normal;
        lines.push(format!(
            "The point of joint \"{}\" keeps {:.4} m from the edge of its region (normal {x:.3}, {y:.3}, {z:.3}).",
            edge.joint, edge.distance
        ));
    }
    lines
}
