//! Benchmark for developers: how often the diagnosis finds hidden effects.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use rig_bench::peer::{Frols, Stlsq};
use rig_bench::{
    ArmCase, BenchError, Case, Diagnose, Method, Plan, Score, arm_cases, arm_table, markdown,
    run as ask, run_arms,
};
use rig_output::{folder, write_whole};
use rig_output::{format_short, format_significant};
use rig_scenario::{Effect, Noise, Size, Truth};

/// Method that is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Judged {
    /// The project's own diagnosis.
    Diagnose,
    /// Sequentially thresholded least squares.
    Stlsq,
    /// Forward regression with orthogonal least squares and BIC.
    Frols,
    /// The model with the largest evidence.
    Evidence,
}

/// Hides effects in recordings of the emulated rig and counts how often they are found.
///
/// Prints the figures with 95 % Wilson intervals and writes benchmark.json and benchmark.md. The same seeds give the same
/// figures.
#[derive(Debug, Parser)]
#[command(name = "rig-bench", version)]
struct Args {
    /// Effects to hide, by name, separated by commas [default: all]
    #[arg(long, value_delimiter = ',')]
    effects: Vec<String>,
    /// Seeds of each effect
    #[arg(long, default_value_t = 10)]
    seeds: u64,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Recordings without hidden effects at each noise level
    #[arg(long, default_value_t = 20)]
    nothing: u64,
    /// Noise levels: low, medium, high
    #[arg(long, value_delimiter = ',', default_value = "medium")]
    noise: Vec<String>,
    /// Numbers of effects that are hidden together, for example 2,3
    #[arg(long, value_delimiter = ',')]
    combinations: Vec<usize>,
    /// Seeds for each number of combined effects
    #[arg(long, default_value_t = 20)]
    combined: u64,
    /// Hide each effect once more, with its name removed from the library
    #[arg(long)]
    leave_out: bool,
    /// Run the negative controls: wrong description, random residual, faint effect, poor motion, one disturbance, finer
    /// step
    #[arg(long)]
    controls: bool,
    /// If several names remain possible, record the proposed experiment on the same rig and diagnose again with it
    #[arg(long)]
    follow: bool,
    /// Record an encoder on the link, too
    #[arg(long)]
    second_encoder: bool,
    /// Seeds of arms with two and six joints, one of them faulty; only the project's own diagnosis is judged on them
    #[arg(long, default_value_t = 0)]
    arms: u64,
    /// Methods to judge
    #[arg(long, value_enum, value_delimiter = ',', default_value = "diagnose")]
    only: Vec<Judged>,
    /// Length of the training recording, s
    #[arg(long, default_value_t = 90.0)]
    train: f64,
    /// Length of the hold-out recording, s
    #[arg(long, default_value_t = 60.0)]
    holdout: f64,
    /// Threads [default: all of the machine]
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Folder for benchmark.json, benchmark.md and, with --keep, the recordings
    #[arg(long, default_value = "benchmark")]
    out: PathBuf,
    /// Write recordings, descriptions and truth.json, one folder for each case, and truth.md; judge no method
    #[arg(long)]
    keep: bool,
    /// Replace results that the folder already holds
    #[arg(long)]
    force: bool,
}

/// Results of a run.
const RESULTS: [&str; 2] = ["benchmark.json", "benchmark.md"];
/// Table of the hidden effects in each folder.
const TRUTHS: &str = "truth.md";

fn truth_head() -> String {
    "| folder | group | noise | seed | hidden | left of it by a refit, over the noise floor |\n| --- | --- | --- | --- | --- | --- |\n"
        .to_owned()
}

/// Table row of a case with one joint.
fn truth_row(folder: &str, case: &Case, truth: &Truth, sizes: &[Size]) -> String {
    let names = match truth.names() {
        none if none.is_empty() => "nothing".to_owned(),
        names => names.join(", "),
    };
    let ratios: Vec<String> = (sizes.iter())
        .map(|size| format_significant(size.excess_rms / size.floor_rms, 3))
        .collect();
    format!(
        "| {folder} | {:?} | {} | {} | {names} | {} |\n",
        case.group,
        case.level,
        truth.seed,
        ratios.join(", ")
    )
}

/// Writes recordings, descriptions and hidden effects, one folder for each case.
fn keep(out: &Path, cases: &[Case], arms: &[ArmCase]) -> Result<(), BenchError> {
    let count = cases.len() + arms.len();
    let progress = bar("recording", count);
    let mut table = truth_head();
    let mut kept = 0;
    let mut place = || {
        kept += 1;
        let name = format!("{kept:04}");
        let place = out.join(&name);
        folder(&place).map(|()| (name, place))
    };
    for case in cases {
        let (name, place) = place()?;
        let (made, sizes) = case.make()?;
        made.write(&place)?;
        let truth = serde_json::json!({
            "group": case.group, "level": case.level, "truth": made.truth, "sizes": sizes,
        });
        write_truth(&place, &truth)?;
        table.push_str(&truth_row(&name, case, &made.truth, &sizes));
        progress.inc(1);
    }
    for case in arms {
        let (name, place) = place()?;
        let made = case.scenario.make()?;
        made.write(&place)?;
        let (arm, seed) = (case.arm, case.scenario.seed);
        let hidden = case.scenario.fault.map(|(joint, fault)| {
            let joint = made.robot.joints[joint].name.clone();
            (fault.name(), joint, format!("{fault:?}"))
        });
        let truth = serde_json::json!({
            "arm": arm, "seed": seed,
            "hidden": hidden.as_ref().map(|(name, joint, values)| serde_json::json!({
                "effect": name, "joint": joint, "values": values,
            })),
        });
        write_truth(&place, &truth)?;
        let named = hidden.map_or_else(
            || "nothing".to_owned(),
            |(effect, joint, _)| format!("{effect} at {joint}"),
        );
        table.push_str(&format!("| {name} | {arm} | | {seed} | {named} | |\n"));
        progress.inc(1);
    }
    progress.finish_and_clear();
    write_whole(&out.join(TRUTHS), table.as_bytes())?;
    println!(
        "{}: {count} cases; {TRUTHS} has what is hidden in each.",
        out.display(),
    );
    Ok(())
}

fn write_truth(place: &Path, truth: &serde_json::Value) -> Result<(), BenchError> {
    let text = format!("{truth:#}\n");
    Ok(write_whole(&place.join("truth.json"), text.as_bytes())?)
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("rig-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

/// A progress bar on standard error; hidden without a terminal.
fn bar(what: &'static str, total: usize) -> ProgressBar {
    let bar = ProgressBar::new(total as u64).with_message(what);
    let style = ProgressStyle::with_template("{msg:>20} [{bar:40}] {percent:>3} % {eta} left");
    match style {
        Ok(style) => bar.with_style(style.progress_chars("=> ")),
        Err(_) => bar,
    }
}

/// Returns the noise levels that are asked for, with their names.
fn levels(args: &Args) -> Result<Vec<(&'static str, Noise)>, BenchError> {
    let levels = args.noise.iter().map(|name| {
        let known = Noise::LEVELS.into_iter().find(|(level, _)| level == name);
        known.ok_or_else(|| {
            BenchError::Option(format!(
                "no noise level is called \"{name}\"; choose from low, medium, high."
            ))
        })
    });
    levels.collect()
}

/// Returns the settings of the cases with one joint.
fn plan(args: &Args) -> Result<Plan, BenchError> {
    for (flag, seconds) in [("--train", args.train), ("--holdout", args.holdout)] {
        if !(20.0..=3600.0).contains(&seconds) {
            return Err(BenchError::Option(format!(
                "{flag} is {} s; give 20 to 3600 s, so that every kind of motion fits in.",
                format_short(seconds)
            )));
        }
    }
    let effects = if args.effects.is_empty() {
        Effect::names().map(str::to_owned).collect()
    } else {
        args.effects.clone()
    };
    Ok(Plan {
        effects,
        seeds: args.seeds,
        first_seed: args.first_seed,
        nothing: args.nothing,
        levels: levels(args)?,
        combinations: args.combinations.clone(),
        combined: args.combined,
        leave_out: args.leave_out,
        controls: args.controls,
        follow: args.follow,
        seconds: [args.train, args.holdout],
        second_encoder: args.second_encoder,
    })
}

fn run(args: &Args) -> Result<(), BenchError> {
    let results = [RESULTS.as_slice(), &[TRUTHS]].concat();
    if !args.force && results.iter().any(|name| args.out.join(name).exists()) {
        return Err(BenchError::Results(args.out.clone()));
    }
    let cases = plan(args)?.cases()?;
    if cases.is_empty() && args.arms == 0 {
        return Err(BenchError::Option(
            "these counts make no case; give at least one of --seeds, --nothing, --combinations, --leave-out or --arms.".into(),
        ));
    }
    let arms = arm_cases(args.first_seed, args.arms)?;
    folder(&args.out)?;
    if args.keep {
        return keep(&args.out, &cases, &arms);
    }
    judge(args, &cases, &arms)
}

/// Asks the methods about every case, prints their figures and writes them.
fn judge(args: &Args, cases: &[Case], arms: &[ArmCase]) -> Result<(), BenchError> {
    let methods: Vec<&dyn Method> = args
        .only
        .iter()
        .map(|method| -> &dyn Method {
            match method {
                Judged::Diagnose => &Diagnose,
                Judged::Stlsq => &Stlsq,
                Judged::Frols => &Frols,
                Judged::Evidence => &rig_bench::Evidence,
            }
        })
        .collect();
    let threads = rig_data::prepare::threads(args.threads);
    let count = cases.len() + arms.len();
    let progress = bar("hiding and seeking", count);
    let at = |done: usize| progress.set_position(done as u64);
    let outcomes = ask(cases, &methods, threads, &|done, _| at(done))?;
    let of_arms = run_arms(arms, threads, &|done, _| at(cases.len() + done))?;
    progress.finish_and_clear();
    let scores: Vec<Score> = methods
        .iter()
        .zip(&outcomes)
        .map(|(method, outcomes)| Score::of(method.name(), outcomes))
        .collect();
    let mut tables = Vec::new();
    if !cases.is_empty() {
        tables.push(markdown(&scores));
    }
    if !arms.is_empty() {
        tables.push(arm_table(&of_arms));
    }
    let table = tables.join("\n");
    let json = serde_json::json!({
        "schema": "rig-benchmark/1", "scores": scores, "outcomes": outcomes, "arms": of_arms,
    });
    write_whole(
        &args.out.join("benchmark.json"),
        format!("{json:#}\n").as_bytes(),
    )?;
    write_whole(&args.out.join("benchmark.md"), table.as_bytes())?;
    println!("{}", table.trim_end());
    println!("{}: {count} cases.", args.out.display());
    Ok(())
}
