//! `rig compare`: results of one robot from several recordings.

mod simulated;

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args as ClapArgs};

use self::simulated::Simulated;
use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::identify::{Fit, Model, lead, speed};
use super::input::{Inputs, Use, Watched, described, recordings, refuse_faults, refuse_twice};
use super::map_arg::MapArg;
use super::overwrite::refuse_folder;
use super::report_arg::ReportArg;
use super::ui::Ui;
use crate::pages;
use crate::pages::Context;
use rig_compare::{CompareOptions, Comparison, Grade, RecordingSet, compare, pooled_robot};
use rig_data::EffortNeed;
use rig_data::prepare::{Choice, PrepareOptions};
use rig_identify::Options;
use rig_model::robot::Robot;
use rig_output::{can_take, folder, format_value, write_whole};

/// Files that the command writes.
const FILES: [&str; 3] = ["compare.json", "pooled.toml", "report.html"];

/// Compares what several recordings of one robot say: which values to trust, and why they differ.
///
/// Each --data is a set of its own; --set joins recordings of one day, specimen or controller gain. Each set is
/// identified on its own. The result has pooled values with their errors, tests of every parameter, pairs of parameters
/// that take over torque from each other, tested causes of the difference, the effect on the torque, and a grade.
///
/// Writes compare.json, pooled.toml (the description with the pooled values) and report.html into the folder given with
/// --out.
///
/// With --simulated it compares methods instead of recordings: the descriptions are the truth. Writes report.html, and a
/// folder with report.html and compare.json for each robot.
#[derive(Debug, ClapArgs)]
#[command(group(ArgGroup::new("recordings").args(["data", "set", "simulated"]).required(true).multiple(true)))]
pub(crate) struct Args {
    /// Robot description, TOML or URDF (`rig init` writes one to start from); several with --simulated
    #[arg(long, value_name = "FILE", num_args = 1.., required_unless_present = "simulated")]
    robot: Vec<PathBuf>,
    #[command(flatten)]
    chain: ChainArg,
    /// Recording that is a set of its own, CSV or MCAP; any number
    #[arg(long, value_name = "FILE", num_args = 1..)]
    data: Vec<PathBuf>,
    /// Named set of recordings, which are identified together; may be repeated
    #[arg(long, value_name = "NAME=FILE[,FILE...]", value_parser = named_set)]
    set: Vec<NamedSet>,
    /// Instead of recordings: simulate each robot (default: those of `rig init one-link`, `irp6` and `edda`) with noise
    /// and quantisation, identify it off-line and on-line by both models, and compare with the truth
    #[arg(long, conflicts_with_all = ["data", "set", "model", "estimator", "tolerance", "cutoff", "min_speed", "torque_lead", "even_if_wrong"])]
    simulated: bool,
    /// Equations that are fitted
    #[arg(long, value_enum, default_value = "differential")]
    model: Model,
    /// Estimator. Those with a prior draw all sets towards the description, which hides differences
    #[arg(long, value_enum, default_value = "weighted")]
    estimator: Fit,
    /// Share of a joint's torque RMS above which a difference of the parameters matters; 0.05 is 5 %
    #[arg(long, default_value_t = 0.05)]
    tolerance: f64,
    /// Cut-off of the zero-phase low-pass on the position, Hz [default: from each set]
    #[arg(long)]
    cutoff: Option<f64>,
    /// Leave out rows slower than this, rad/s or m/s, where the sign of friction is uncertain; 0 keeps all, or "auto"
    #[arg(long, default_value = "auto", value_parser = speed)]
    min_speed: Choice<f64>,
    /// Torque lead of all sets: time by which a recorded torque acts later, s (half a sample for a command held until the
    /// next one)
    #[arg(long, default_value_t = 0.0, value_parser = lead)]
    torque_lead: f64,
    /// Seed of the random states from which the base parameters are computed; with --simulated of motions and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Compare although columns of the recordings look wrong; prints the faults
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

/// A name with its recordings.
#[derive(Clone, Debug)]
struct NamedSet {
    name: String,
    files: Vec<PathBuf>,
}

/// Parses NAME=FILE[,FILE...].
fn named_set(text: &str) -> Result<NamedSet, String> {
    let form = || format!("\"{text}\" is not of the form NAME=FILE[,FILE...]");
    let (name, files) = text.split_once('=').ok_or_else(form)?;
    let files: Vec<PathBuf> = files.split(',').map(PathBuf::from).collect();
    if name.is_empty() || files.iter().any(|f| f.as_os_str().is_empty()) {
        return Err(form());
    }
    Ok(NamedSet {
        name: name.to_owned(),
        files,
    })
}

impl Args {
    /// Returns all sets: those of --set, and each --data with the name of its file.
    fn sets(&self) -> Vec<NamedSet> {
        let stem = |path: &Path| {
            let stem = path.file_stem();
            stem.map_or_else(
                || path.display().to_string(),
                |s| s.to_string_lossy().into(),
            )
        };
        let stems: Vec<String> = self.data.iter().map(|path| stem(path)).collect();
        let single = self.data.iter().zip(&stems).map(|(path, own)| {
            let again = stems.iter().filter(|s| *s == own).count() > 1;
            NamedSet {
                name: if again {
                    path.display().to_string()
                } else {
                    own.clone()
                },
                files: vec![path.clone()],
            }
        });
        self.set.iter().cloned().chain(single).collect()
    }

    fn options(&self) -> CompareOptions {
        CompareOptions {
            identify: Options {
                model: self.model.into(),
                estimator: self.estimator.into(),
                seed: self.seed,
                prepare: PrepareOptions {
                    cutoff: self.cutoff.map_or(Choice::Auto, Choice::Fixed),
                    speed_threshold: self.min_speed,
                    torque_lead: self.torque_lead,
                    ..PrepareOptions::default()
                },
                ..Options::default()
            },
            tolerance: self.tolerance,
        }
    }
}

impl Args {
    /// Returns the file that holds the result as JSON.
    pub(crate) fn json_file(&self) -> PathBuf {
        self.out.join(FILES[0])
    }
}

/// Runs the command.
///
/// # Errors
/// A sentence that names the wrong file, line or value.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    if args.simulated {
        let simulated = Simulated {
            robots: &args.robot,
            chain: &args.chain,
            seed: args.seed,
            out: &args.out,
            report: args.report,
            force: args.force,
        };
        return simulated.run(ui);
    }
    let [description] = args.robot.as_slice() else {
        return Err(CommandError::Sentence(format!(
            "--robot names {} descriptions; recordings are compared for one robot.",
            args.robot.len()
        )));
    };
    can_take(&args.out, &FILES)?;
    refuse_folder(&args.out, &[], args.force)?;
    let sets = args.sets();
    let files: Vec<PathBuf> = sets.iter().flat_map(|s| s.files.iter().cloned()).collect();
    refuse_twice(&files, "give every recording to one set")?;
    let robot = described(description, &args.chain, ui)?.robot;
    let mapping = args.columns.mapping()?;
    let read =
        |set: &NamedSet| Inputs::read_mapped(&robot, &set.files, EffortNeed::Required, &mapping);
    let inputs = (sets.iter()).map(read).collect::<Result<Vec<_>, _>>()?;
    let read: Vec<String> = inputs.iter().flat_map(Inputs::warnings).collect();
    for warning in &read {
        ui.warn(warning);
    }
    let all: Vec<&Inputs> = inputs.iter().collect();
    refuse_faults(&robot, &all, (Use::Fit, Vec::new()), args.even_if_wrong, ui)?;
    // Passes over each recording: one for its content, three of the identification, one of the rows.
    let bytes: u64 = inputs.iter().map(Inputs::bytes).sum();
    let progress = RefCell::new(ui.progress("comparing", 5 * bytes));
    let watched: Vec<Vec<Watched>> = inputs.iter().map(|i| i.watched(&progress)).collect();
    let named: Vec<RecordingSet> = (sets.iter().zip(&watched))
        .map(|(set, watched)| RecordingSet {
            name: set.name.clone(),
            recordings: recordings(watched),
        })
        .collect();
    let mut found = compare(&robot, &named, &args.options())?;
    drop(progress);
    let own: Vec<String> = (inputs.iter())
        .flat_map(|inputs| inputs.heard().into_iter().chain(inputs.outside()))
        .collect();
    for warning in found.brief_warnings.iter().chain(&own) {
        ui.warn(warning);
    }
    if !found.brief_warnings.is_empty() {
        ui.note(pages::SEE_IDENTIFY);
    }
    found.warnings.extend(own);
    write(args, &robot, &found, read, ui)?;
    for line in pooled(&found) {
        ui.say_of_many(found.parameters.len(), &line);
    }
    for line in reasons(&found) {
        ui.say(&line);
    }
    ui.answer(&grade(&found));
    args.report.tell(&args.out.join(FILES[2]), ui);
    Ok(())
}

/// Writes all files of the result. `read`: warnings from the recordings.
///
/// # Errors
/// Values that cannot be written as a description, or a file that cannot be written.
fn write(
    args: &Args,
    robot: &Robot,
    found: &Comparison,
    read: Vec<String>,
    ui: &Ui,
) -> Result<(), CommandError> {
    let (pooled, remarks) = pooled_robot(robot, found);
    let text = pooled.to_toml()?;
    folder(&args.out)?;
    let json = serde_json::to_string_pretty(found).map_err(|error| {
        CommandError::Sentence(format!(
            "The comparison cannot be written as JSON: {error}."
        ))
    })?;
    write_whole(&args.out.join(FILES[0]), (json + "\n").as_bytes())?;
    write_whole(&args.out.join(FILES[1]), text.as_bytes())?;
    let context = Context {
        command: ui.command_line(),
        identified: Some((FILES[1].into(), text)),
        remarks,
        warnings: read,
    };
    let page = pages::compare(found, &context);
    (args.report).write_and_show(&args.out.join(FILES[2]), &page, ui)
}

/// Returns the answer in a sentence.
fn grade(found: &Comparison) -> String {
    match found.grade {
        Grade::Agree => "The sets agree.".into(),
        Grade::DifferWithoutEffect => pages::same_torque(found),
        Grade::DifferAndMatter => {
            "The sets differ, and the difference matters for the torque.".into()
        }
        Grade::Undecided if found.tests_differ() => {
            "Whether the sets differ is not decided: the errors of a set are not known.".into()
        }
        Grade::Undecided => {
            "The sets do not differ significantly, but their errors are too large to call them equal."
                .into()
        }
        Grade::NotComparable => "The sets are not comparable.".into(),
    }
}

/// Returns what is printed before the answer: the reasons for it, and what the sets do not show.
fn reasons(found: &Comparison) -> Vec<String> {
    let mut lines = found.reasons.clone();
    for set in &found.sets {
        if !set.not_shown.is_empty() {
            lines.push(format!(
                "Set {} does not show: {}.",
                set.name,
                set.not_shown.join(", ")
            ));
        }
    }
    lines
}

/// Returns the pooled values, one line each.
fn pooled(found: &Comparison) -> Vec<String> {
    let mut lines =
        vec!["Pooled values ± half the 95 % interval (spread within a set, between sets):".into()];
    for p in &found.parameters {
        lines.push(format!(
            "  {} {} {} (within {}, between {})",
            p.expression,
            format_value(p.value, p.half_interval),
            rig_output::format_unit(&p.unit),
            rig_output::format_significant(p.within, 2),
            rig_output::format_significant(p.between, 2)
        ));
    }
    lines
}
