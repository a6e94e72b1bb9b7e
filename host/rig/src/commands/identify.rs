//! `rig identify`: recordings and a description in, parameters with their uncertainty out.

mod printed;

use std::cell::RefCell;
use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};
use rig_shared::multibody::{COLUMNS, column};

use super::error::CommandError;
use super::input::{
    Inputs, RobotArg, command_line, recordings, refuse_faults, refuse_shared, refuse_twice,
};
use super::overwrite::refuse_folder;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_data::prepare::{Choice, PrepareOptions};
use rig_identify::{
    Estimator, Identification, Loss, ModelKind, Options, identified_robot, identify,
};
use rig_model::robot::{MOST_LEAD, Robot};
use rig_output::{can_take, folder, write_whole};
use rig_output::{format_significant, format_unit, listed};

/// Which equations are fitted.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Model {
    /// Torque against acceleration, velocity and position
    Differential,
    /// Over windows, without acceleration: of one joint work against change of energy, of several impulse against change of
    /// momentum, one equation a joint
    Integral,
}

impl From<Model> for ModelKind {
    fn from(model: Model) -> Self {
        match model {
            Model::Differential => Self::Differential,
            Model::Integral => Self::Integral,
        }
    }
}

/// How they are fitted.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Fit {
    /// Ordinary least squares
    Ols,
    /// Each joint's rows weighted by its noise
    Weighted,
    /// Weighted, and outliers count less (Huber)
    Robust,
    /// Instrumental variables from the simulated closed loop (IDIM-IV): unbiased by noise in the motion
    Iv,
    /// Torque of the simulated closed loop against the measured one (DIDIM); needs [joint.controller] and ref<k>
    OutputError,
    /// Total least squares: noise in the motion, measured by its spectrum, and in the torque
    Tls,
    /// Maximum likelihood: residuals autoregressive in time and correlated between joints
    Ml,
    /// Ridge regression towards the description's values
    Ridge,
    /// Weighted, every link a body that can exist, friction and drive inertia not negative
    Consistent,
}

impl From<Fit> for Estimator {
    fn from(fit: Fit) -> Self {
        match fit {
            Fit::Ols => Self::Ols,
            Fit::Weighted => Self::Weighted,
            Fit::Robust => Self::Robust,
            Fit::Iv => Self::Iv,
            Fit::OutputError => Self::OutputError,
            Fit::Tls => Self::Tls,
            Fit::Ml => Self::Ml,
            Fit::Ridge => Self::Ridge,
            Fit::Consistent => Self::Consistent,
        }
    }
}

/// Whether estimators are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Compare {
    /// weighted, iv and consistent, where the recordings are small enough for a second or two
    Auto,
    /// All that recordings and description allow
    All,
    /// None
    None,
}

/// Bytes of recordings up to which a comparison takes a few seconds.
const COMPARED_BYTES: u64 = 32 << 20;
/// Half-widths of a 95 % interval by which friction has to lie below zero: five standard deviations. A few seconds of a motion
/// leave friction and the rest of a joint hard to tell apart, and of many joints one may then come out below zero by chance.
const CLEARLY: f64 = 2.5;
/// Standard deviations of half a 95 % interval, about.
const WIDTH: f64 = 2.0;
/// Coefficients of a base parameter below this are rounding.
const ROUNDING: f64 = 1e-9;

impl Compare {
    fn list(self, bytes: u64) -> Vec<Estimator> {
        match self {
            Self::All => Estimator::ALL.to_vec(),
            Self::Auto if bytes <= COMPARED_BYTES => {
                vec![Estimator::Weighted, Estimator::Iv, Estimator::Consistent]
            }
            Self::Auto | Self::None => Vec::new(),
        }
    }
}

/// A setting that is `auto` (chosen from the data) or a number.
fn auto<T: std::str::FromStr>(text: &str) -> Result<Choice<T>, String> {
    if text == "auto" {
        return Ok(Choice::Auto);
    }
    text.parse()
        .map(Choice::Fixed)
        .map_err(|_| format!("\"{text}\" is neither a number nor \"auto\""))
}

/// A least speed: `auto` or a number that can be one.
fn speed(text: &str) -> Result<Choice<f64>, String> {
    match auto::<f64>(text)? {
        Choice::Fixed(speed) if !(speed >= 0.0 && speed.is_finite()) => Err(format!(
            "{text} is no least speed; 0 keeps all rows, and a number above it leaves out slower ones"
        )),
        choice => Ok(choice),
    }
}

/// A lead that a description may have too.
fn lead(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(lead) if lead.abs() <= MOST_LEAD => Ok(lead),
        _ => Err(format!(
            "\"{text}\" is no lead; it must lie between -{MOST_LEAD} and {MOST_LEAD} s"
        )),
    }
}

/// Identifies the parameters of a robot from recordings.
///
/// Writes identified.toml (the description with the identified values), identification.json and report.html
/// into the folder given with --out, and identified.urdf where a full set of parameters was found: of a URDF the same file
/// with other values, of a TOML description a new one.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Recording to learn from, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Recording to judge by, not used in the fit; one or more
    #[arg(long, num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Which equations are fitted
    #[arg(long, value_enum, default_value = "differential")]
    model: Model,
    /// How they are fitted [default: weighted; for several joints consistent]
    #[arg(long, value_enum)]
    estimator: Option<Fit>,
    /// Compare estimators on stretches of time left out of the fit, and say which to trust
    #[arg(long, value_enum, default_value = "auto")]
    compare: Compare,
    /// How often each --data counts, in their order; 1 where not given
    #[arg(long, allow_negative_numbers = true)]
    weight: Vec<f64>,
    /// Relative uncertainty of the description's inertial values (0.1 = 10 %), for iv, output-error, ridge and consistent,
    /// and of several joints for the bodies that are written [default: ridge: what makes the data most likely; else 2]
    #[arg(long, allow_negative_numbers = true)]
    prior_uncertainty: Option<f64>,
    /// Take the description as it is: do not look for springs, ripple or a base that is not level
    #[arg(long)]
    as_described: bool,
    /// Cut-off of the zero-phase low-pass on the position, Hz, or "auto": chosen from the data
    #[arg(long, default_value = "auto", value_parser = auto::<f64>, allow_negative_numbers = true)]
    cutoff: Choice<f64>,
    /// Keep every n-th row after the parallel low-pass, or "auto"
    #[arg(long, default_value = "auto", value_parser = auto::<usize>)]
    decimation: Choice<usize>,
    /// Leave out rows slower than this, rad/s or m/s, where friction has no sign yet; 0 keeps all, or "auto"
    #[arg(long, default_value = "auto", value_parser = speed, allow_negative_numbers = true)]
    min_speed: Choice<f64>,
    /// Length of the windows, s [default: chosen from the motion] (integral)
    #[arg(long, allow_negative_numbers = true)]
    window: Option<f64>,
    /// How much later a recorded torque acts, s (half a sample for a command held until the next one)
    #[arg(long, default_value_t = 0.0, value_parser = lead, allow_negative_numbers = true)]
    torque_lead: f64,
    /// Use the recorded qd<k> (and qdd<k>) instead of deriving them from the filtered position
    #[arg(long)]
    measured_derivatives: bool,
    /// Seed of the random states from which the base parameters are found
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fit although columns of the recordings look wrong (sign, unit, ratio, clock, swapped); says what looks wrong
    #[arg(long)]
    even_if_wrong: bool,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Replace results that the folder holds
    #[arg(long)]
    force: bool,
}

impl Args {
    fn options(&self, robot: &Robot, bytes: u64) -> Options {
        Options {
            model: self.model.into(),
            estimator: self
                .estimator
                .map_or_else(|| Estimator::for_robot(robot), Into::into),
            loss: Loss::default(),
            prepare: PrepareOptions {
                cutoff: self.cutoff,
                decimation: self.decimation,
                speed_threshold: self.min_speed,
                torque_lead: self.torque_lead,
                measured_derivatives: self.measured_derivatives,
                ..PrepareOptions::default()
            },
            window: self.window,
            seed: self.seed,
            recording_weights: self.weight.clone(),
            prior_uncertainty: self.prior_uncertainty,
            compare: self.compare.list(bytes),
            look_beyond: !self.as_described,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence naming the file, line or value at fault.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let names = [
        "identified.toml",
        "identified.urdf",
        "identification.json",
        "report.html",
    ];
    can_take(&args.out, &names)?;
    refuse_folder(&args.out, &[], args.force)?;
    let description = args.robot.describe(ui)?;
    let robot = description.robot;
    let training = Inputs::read(&robot, &args.data)?;
    let holdout = Inputs::read(&robot, &args.holdout)?;
    for warning in training.warnings().chain(holdout.warnings()) {
        ui.remark(&warning);
    }
    refuse_shared(&args.data, &args.holdout)?;
    refuse_twice(
        &args.data,
        "give it once, with --weight where it is to count more",
    )?;
    if args.weight.len() > args.data.len() {
        return Err(CommandError::Sentence(format!(
            "--weight is given {} times and --data {} times; each weight belongs to the recording of its place.",
            args.weight.len(),
            args.data.len()
        )));
    }
    let mut wrong = Vec::new();
    let strange = training.strange_references(&robot)?;
    if matches!(args.estimator, Some(Fit::OutputError)) {
        wrong.extend(strange);
    } else {
        for sentence in strange {
            ui.remark(&format!(
                "{sentence} They are not used: --estimator iv and the comparison take the smoothed position instead, and only output-error needs them."
            ));
        }
    }
    if args.measured_derivatives {
        for inputs in [&training, &holdout] {
            wrong.extend(inputs.strange_rates(&robot)?);
        }
    }
    refuse_faults(
        &robot,
        &[&training, &holdout],
        wrong,
        args.even_if_wrong,
        ui,
    )?;
    // Three passes over the training data, two over the hold-out: see `identify`.
    let progress =
        RefCell::new(ui.progress("identifying", 3 * training.bytes() + 2 * holdout.bytes()));
    let mut identification = identify(
        &robot,
        &recordings(&training.watched(&progress)),
        &recordings(&holdout.watched(&progress)),
        &args.options(&robot, training.bytes()),
    )?;
    drop(progress);
    for inputs in [&training, &holdout] {
        identification.warnings.extend(inputs.heard());
        identification.warnings.extend(inputs.outside());
    }
    let (refused, doubtful) = impossible(&robot, &identification);
    if !args.even_if_wrong && !refused.is_empty() {
        return Err(CommandError::Implausible(format!(
            "{} Nothing was written; --even-if-wrong writes all the same.",
            refused.join(" ")
        )));
    }
    (identification.warnings).splice(0..0, refused.into_iter().chain(doubtful));
    folder(&args.out)?;
    let (identified, mut remarks) = identified_robot(&robot, &identification);
    let text = identified.to_toml()?;
    // A full set of parameters is a body each; combinations alone would not be.
    let (mut urdf, mut said) = (None, Vec::new());
    if identification.standard_parameters.is_some() || robot.joints.len() == 1 {
        let found = match &description.urdf {
            Some(original) => original.with_values(&identified),
            None => identified.to_urdf(),
        };
        match found {
            Ok(found) => {
                said = found.remarks;
                said.extend(chosen(&robot, &identification));
                urdf = Some(found.text);
            }
            Err(error) => remarks.push(format!("No identified.urdf was written: {error}")),
        }
    }
    remarks.extend(
        said.iter()
            .map(|sentence| format!("identified.urdf: {sentence}")),
    );
    let context = Context {
        command: command_line(),
        identified: Some(("identified.toml".into(), text.clone())),
        remarks,
        warnings: training.warnings().chain(holdout.warnings()).collect(),
    };
    let page = pages::identification(&robot, &identification, &context);

    let json = serde_json::to_string_pretty(&identification).map_err(|error| {
        CommandError::Sentence(format!("The result cannot be written as JSON: {error}."))
    })?;
    write_whole(&args.out.join("identified.toml"), text.as_bytes())?;
    if let Some(urdf) = urdf {
        write_whole(&args.out.join("identified.urdf"), urdf.as_bytes())?;
    }
    write_whole(
        &args.out.join("identification.json"),
        (json + "\n").as_bytes(),
    )?;
    rig_report::write(&args.out.join("report.html"), &page)?;
    printed::print(ui, &identification);
    if args.compare == Compare::Auto && training.bytes() > COMPARED_BYTES {
        ui.say(&format!(
            "No estimators were compared, so none is recommended: the recordings have {:.0} MiB, and beyond {} MiB that takes long; --compare all does it.",
            training.bytes() as f64 / f64::from(1 << 20),
            COMPARED_BYTES >> 20
        ));
    }
    for sentence in &said {
        ui.say(&format!("identified.urdf: {sentence}"));
    }
    ui.say(&format!(
        "report: {}",
        args.out.join("report.html").display()
    ));
    Ok(())
}

/// Drive inertias and constant torques that stand in the files and were identified in a sum only.
fn chosen(robot: &Robot, found: &Identification) -> Vec<String> {
    let in_a_sum = |place: usize| -> Option<String> {
        let set = found.standard_parameters.as_ref()?;
        let joints = robot.joints.iter().enumerate();
        let names: Vec<&str> = joints
            .filter(|(j, _)| {
                let own = set.parameters.get(j * COLUMNS + place);
                own.is_some_and(|own| !own.determined && own.value != 0.0)
            })
            .map(|(_, joint)| joint.name.as_str())
            .collect();
        (!names.is_empty()).then(|| names.join(", "))
    };
    let kinds = [
        (column::DRIVE_INERTIA, "drive inertias", "inertias of links"),
        (column::OFFSET, "constant torques", "weights of links"),
    ];
    let one = |(place, what, with)| {
        in_a_sum(place).map(|names| {
            format!(
                "The {what} of {names} are a choice: only their sums with {with} are identified, and the split nearest to the description was taken. Use them with the links of this file only."
            )
        })
    };
    kinds.into_iter().filter_map(one).collect()
}

/// One sentence for each friction or inertia that lies below zero by many of its standard deviations, which no robot has: those
/// that no result can stand beside, and those that may be said.
///
/// A base parameter that is a sum of masses, moments of inertia and friction with positive factors cannot lie below zero. Inertias of
/// an arm make up for each other: one below zero may be an error of the model that the others take back.
fn impossible(robot: &Robot, found: &Identification) -> (Vec<String>, Vec<String>) {
    let details = &found.details;
    let below_zero = |row: usize| {
        let [value, _, high] = details.free[row];
        value + CLEARLY * (high - value) < 0.0
    };
    let positive = [
        column::MASS,
        // Ixx, Iyy, Izz of Ixx Ixy Ixz Iyy Iyz Izz.
        column::INERTIA,
        column::INERTIA + 3,
        column::INERTIA + 5,
        column::DRIVE_INERTIA,
        column::VISCOUS,
        column::COULOMB,
    ];
    let is_sum = |row: usize| {
        let own = details.combination.row(row);
        let may = |(c, x): (usize, &f64)| {
            x.abs() < ROUNDING || (*x > 0.0 && positive.contains(&(c % COLUMNS)))
        };
        own.iter().enumerate().all(may)
    };
    let wrong: Vec<usize> = (0..details.free.len())
        .filter(|row| below_zero(*row) && is_sum(*row))
        .collect();
    let of = |j: usize, place: usize| {
        let column = j * COLUMNS + place;
        wrong.iter().any(|row| details.columns[*row] == column)
    };
    let driving: Vec<usize> = (0..robot.joints.len())
        .filter(|j| of(*j, column::VISCOUS) && of(*j, column::COULOMB))
        .collect();
    let driven: Vec<String> = (driving.iter())
        .map(|&j| {
            format!(
                "viscous and Coulomb friction of joint \"{}\" both come out below zero, so that friction would drive the motion: the sign of tau{n} or i{n}, of q{n}, or of gear_ratio is wrong.",
                robot.joints[j].name,
                n = j + 1
            )
        })
        .collect();
    let alone = |row: &&usize| {
        let column = details.columns[**row];
        let friction = [column::VISCOUS, column::COULOMB].contains(&(column % COLUMNS));
        !(friction && driving.contains(&(column / COLUMNS)))
    };
    let (mut refused, mut doubtful) = (Vec::new(), Vec::new());
    for row in wrong.iter().filter(alone) {
        let [value, _, high] = details.free[*row];
        let own = &found.base_parameters[*row];
        let column = details.columns[*row];
        let friction = [column::VISCOUS, column::COULOMB].contains(&(column % COLUMNS));
        let list = match friction || robot.joints.len() == 1 {
            true => &mut refused,
            false => &mut doubtful,
        };
        list.push(format!(
            "{} of joint \"{}\" at {} {}, by {} of its standard deviations",
            own.expression,
            robot.joints[column / COLUMNS].name,
            format_significant(value, 3),
            format_unit(&own.unit),
            format_significant(-value * WIDTH / (high - value), 2),
        ));
    }
    let said = |list: Vec<String>| match list.is_empty() {
        true => Vec::new(),
        false => vec![format!(
            "Below zero, which no robot has, come out: {}. Look at the columns (unit, sign, time, single rows), at the description and at the cut-off.",
            listed(&list)
        )],
    };
    (
        driven.into_iter().chain(said(refused)).collect(),
        said(doubtful),
    )
}
