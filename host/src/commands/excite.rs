//! `rig excite`: a motion that tells the robot's parameters apart, within its limits.

use std::path::PathBuf;

use clap::ValueEnum;

use super::error::CommandError;
use super::input::described;
use super::ui::Ui;
use crate::excite::{Criterion, Design, Options, Parameters, Scaling, StagedKind, design, staged};
use crate::robot::Robot;

/// What is optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CriterionArg {
    /// Condition number: errors spread evenly over the parameters
    Cond,
    /// Smallest singular value: the worst combination known as well as possible
    MinSingular,
    /// Determinant of the information: the smallest confidence ellipsoid
    DOptimal,
}

/// Which parameters count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ParametersArg {
    /// All that `rig identify` finds: links, drive inertias, friction, offsets
    All,
    /// Inertial parameters of the links alone
    Links,
}

/// By what the columns of the regressor are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ScalingArg {
    /// By what the limits would let any motion do for the column alone
    Sizes,
    /// By nothing: SI units as they are
    None,
}

/// Kind of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum KindArg {
    /// Optimal periodic motion, for identification
    Fourier,
    /// Swept sine, for resonances and frequency response
    Chirp,
    /// Steps with rests, for gravity and holding torque
    Staircase,
    /// Slow triangles, for breakaway, presliding and backlash
    Reversals,
    /// Pairs of constant speeds, for the friction map
    Sweep,
}

impl KindArg {
    /// The motion of one joint that it is; none for the optimal one of all joints.
    fn staged(self) -> Option<StagedKind> {
        match self {
            Self::Fourier => None,
            Self::Chirp => Some(StagedKind::Chirp),
            Self::Staircase => Some(StagedKind::Staircase),
            Self::Reversals => Some(StagedKind::Reversals),
            Self::Sweep => Some(StagedKind::Sweep),
        }
    }
}

/// Designs a motion within the robot's limits that tells its parameters apart.
///
/// The limits stand in the robot description under [joint.limits], and [[workspace]] for points of the links. The
/// torque limit is kept by the inertia and friction written there, where they are. The same seed gives the same file.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Robot description (.toml or .urdf)
    #[arg(long)]
    pub(crate) robot: PathBuf,
    /// File to write: .toml holds the motion's parameters (for the rig), .csv its samples
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Kind of motion; all but fourier move one joint
    #[arg(long, value_enum, default_value_t = KindArg::Fourier)]
    pub(crate) kind: KindArg,
    /// What is optimised [default: cond] (fourier)
    #[arg(long, value_enum)]
    pub(crate) criterion: Option<CriterionArg>,
    /// Which parameters the motion is to tell apart [default: all] (fourier)
    #[arg(long, value_enum)]
    pub(crate) parameters: Option<ParametersArg>,
    /// By what the columns of the regressor are divided before it is judged [default: sizes] (fourier)
    #[arg(long, value_enum)]
    pub(crate) scaling: Option<ScalingArg>,
    /// Standard deviation of each joint's torque, comma between them, N*m or N [default: taken as a share of its
    /// torque limit that is the same for all joints] (fourier)
    #[arg(long, value_delimiter = ',')]
    pub(crate) torque_noise: Option<Vec<f64>>,
    /// Harmonics per joint, 1 to 8 [default: 5] (fourier)
    #[arg(long)]
    pub(crate) harmonics: Option<usize>,
    /// Period of the slowest harmonic, s [default: from the limits] (fourier)
    #[arg(long)]
    pub(crate) period: Option<f64>,
    /// Rise from rest to full amplitude and fall back to rest, each, s [default: one period] (fourier)
    #[arg(long)]
    pub(crate) ramp: Option<f64>,
    /// Whole periods at full amplitude [default: 5] (fourier)
    #[arg(long)]
    pub(crate) periods: Option<u16>,
    /// Joint positions at the beginning, comma between them, rad or m [default: free for fourier, else mid-range]
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) start: Option<Vec<f64>>,
    /// The joint that moves [default: the first] (all but fourier)
    #[arg(long)]
    pub(crate) joint: Option<String>,
    /// Random starts of the optimiser: more find better motions and take longer [default: 24] (fourier)
    #[arg(long)]
    pub(crate) starts: Option<u32>,
    /// Seed of the random starts [default: 1] (fourier)
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Samples a second in a .csv, Hz
    #[arg(long, default_value_t = 1000.0)]
    pub(crate) rate: f64,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

impl Args {
    /// Refuses what this kind of motion would leave unused.
    fn refuse_unused(&self) -> Result<(), CommandError> {
        let of_fourier = [
            ("--criterion", self.criterion.is_some()),
            ("--parameters", self.parameters.is_some()),
            ("--scaling", self.scaling.is_some()),
            ("--torque-noise", self.torque_noise.is_some()),
            ("--harmonics", self.harmonics.is_some()),
            ("--period", self.period.is_some()),
            ("--ramp", self.ramp.is_some()),
            ("--periods", self.periods.is_some()),
            ("--starts", self.starts.is_some()),
            ("--seed", self.seed.is_some()),
        ];
        let unused = of_fourier.iter().find(|(_, given)| *given);
        match (self.kind.staged(), &self.joint, unused) {
            (None, Some(joint), _) => Err(CommandError::Sentence(format!(
                "--joint {joint} names the one joint that moves, but --kind fourier moves all of them; give --kind chirp, staircase, reversals or sweep, or leave --joint out."
            ))),
            (Some(kind), _, Some((option, _))) => Err(CommandError::Sentence(format!(
                "{option} belongs to --kind fourier, but a {} is sized by the limits alone; leave it out, or give --kind fourier.",
                kind.name()
            ))),
            _ => Ok(()),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// A description or options that do not serve, no motion within the limits, a file that cannot be written.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    args.refuse_unused()?;
    if args.out.exists() && !args.force {
        return Err(CommandError::Exists {
            path: args.out.clone(),
        });
    }
    let robot = described(&args.robot, ui)?.robot;
    let Some(kind) = args.kind.staged() else {
        return optimal(args, &robot, ui);
    };
    let (file, notes) = staged(&robot, kind, args.joint.as_deref(), args.start.as_deref())?;
    file.save(&args.out, &robot, args.rate)?;
    for note in notes {
        ui.remark(&note);
    }
    ui.say(&format!(
        "{}: the motion, {} of {:.1} s.",
        args.out.display(),
        kind.name(),
        file.duration()
    ));
    Ok(())
}

fn optimal(args: &Args, robot: &Robot, ui: &Ui) -> Result<(), CommandError> {
    let default = Options::default();
    let options = Options {
        criterion: match args.criterion {
            None => default.criterion,
            Some(CriterionArg::Cond) => Criterion::ConditionNumber,
            Some(CriterionArg::MinSingular) => Criterion::SmallestSingularValue,
            Some(CriterionArg::DOptimal) => Criterion::Determinant,
        },
        parameters: match args.parameters {
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
        harmonics: args.harmonics.unwrap_or(default.harmonics),
        period: args.period,
        periods: args.periods.unwrap_or(default.periods),
        ramp: args.ramp,
        start: args.start.clone(),
        starts: args.starts.unwrap_or(default.starts),
        seed: args.seed.unwrap_or(default.seed),
        threads: None,
    };
    let mut progress = ui.progress("designing the motion", 1);
    let found = design(robot, &options, |done, total| progress.at_of(done, total))?;
    drop(progress);
    found.file.save(&args.out, robot, args.rate)?;
    for note in &found.notes {
        ui.remark(note);
    }
    for line in summary(&found, robot) {
        ui.say(&line);
    }
    ui.say(&format!(
        "{}: the motion, {:.1} s from rest to rest. Try it with `rig simulate --robot {} --trajectory {} --out run.csv`, or run it on the robot and record.",
        args.out.display(),
        found.file.duration(),
        args.robot.display(),
        args.out.display()
    ));
    Ok(())
}

/// What the design achieves, line by line.
fn summary(found: &Design, robot: &Robot) -> Vec<String> {
    let values = &found.values;
    let mut lines = vec![
        format!(
            "For the {} base parameters {}:",
            found.base_parameters.len(),
            found.base_parameters.join(", ")
        ),
        format!(
            "condition number {:.3} with columns scaled by their sizes ({:.3} in SI units), smallest singular value {:.3}, mean {:.3}.",
            values.condition_number,
            values.si_condition_number,
            values.smallest_singular_value,
            values.mean_singular_value
        ),
    ];
    for (joint, reach) in robot.joints.iter().zip(&found.reach) {
        let torque = reach
            .torque
            .map_or(String::new(), |t| format!(", torque {t:.3}"));
        lines.push(format!(
            "Joint \"{}\" stays within position {:.3} to {:.3}, velocity {:.3}, acceleration {:.3}{torque} (SI units).",
            joint.name, reach.position[0], reach.position[1], reach.velocity, reach.acceleration
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
