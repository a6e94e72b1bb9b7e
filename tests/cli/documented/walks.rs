//! The commands of the pages run, block by block, and print what the page says. What is not run is listed with its reason.

use std::fs;
use std::ops::Range;
use std::path::Path;
use std::process::Command;

use rig_output::data_dir;

use super::{blocks, pages, root};
use crate::run::{rig, succeed};

/// Commands that no walk runs: the page, how the line begins, and why.
const NOT_RUN: &[(&str, &str, &str)] = &[
    (
        "docs/diagnosis.md",
        "rig diagnose",
        "takes a minute of processor; docs/tutorial.md and docs/exercise.md run the same steps",
    ),
    (
        "docs/diagnosis.md",
        "rig board upload --emulated",
        "needs the result of a line that is not run",
    ),
    (
        "docs/diagnosis.md",
        "rig record --emulated --run 5 ",
        "needs the result of a line that is not run",
    ),
    (
        "docs/diagnosis.md",
        "rig record --emulated --run 6 ",
        "needs the result of a line that is not run",
    ),
    (
        "docs/diagnosis.md",
        "rig record --emulated --run 7 ",
        "needs the result of a line that is not run",
    ),
    (
        "docs/diagnosis.md",
        "rig record --emulated --run 8 ",
        "needs the result of a line that is not run",
    ),
    (
        "docs/diagnosis.md",
        "rig validate",
        "needs the result of a line that is not run",
    ),
    (
        "README.md",
        "cargo run",
        "builds the program; docs/demo.md runs what it starts",
    ),
    ("README.md", "tests/run", "runs these tests"),
    (
        "CONTRIBUTING.md",
        "",
        "builds and runs the tools of a developer, for minutes; .ci/run runs those that check",
    ),
    (
        "docs/compare.md",
        "rig compare --simulated",
        "compare.rs runs it",
    ),
    (
        "docs/diagnosis/evidence.md",
        "cargo run",
        "a run of the bench, longer than all tests",
    ),
    (
        "docs/diagnosis/measured.md",
        "cargo run",
        "a run of the bench, longer than all tests",
    ),
    (
        "docs/diagnosis/measured.md",
        "tests/other_rig/ask.py",
        "a run of the bench, longer than all tests",
    ),
    (
        "docs/diagnosis/measured.md",
        "rig diagnose",
        "takes minutes, with recordings of others",
    ),
    (
        "docs/diagnosis/measured.md",
        "head -n",
        "cuts the recordings for a line that is not run",
    ),
    (
        "docs/diagnosis/measured.md",
        "(head -n",
        "cuts the recordings for a line that is not run",
    ),
    ("docs/diagnosis/method.md", "cargo run", "takes minutes"),
    (
        "docs/diagnosis/method.md",
        "rig diagnose --robot host/robots/xl330.toml",
        "leaves out the names of the files",
    ),
    (
        "docs/doctor.md",
        "",
        "the exit status depends on the computer; doctor.rs runs it with computers of its own",
    ),
    ("docs/effects.md", "python3", "takes minutes"),
    (
        "docs/live.md",
        "",
        "does not end by itself; live.rs runs it with each kind of client",
    ),
    (
        "docs/python.md",
        "pip install",
        "host/python/check installs the package, and tests it",
    ),
    ("docs/reference.md", "rig demo", "docs/demo.md runs it"),
    ("docs/reference.md", "rig run", "docs/run.md runs it"),
    ("docs/reference.md", "rig record --port", "needs a board"),
    (
        "docs/reference.md",
        "rig load",
        "docs/load.md runs it, with the files that it needs",
    ),
    (
        "docs/reference.md",
        "rig compare --simulated",
        "compare.rs runs it",
    ),
    (
        "docs/reference.md",
        "rig compliance",
        "docs/compliance.md runs it, with the files that it needs",
    ),
    (
        "docs/reference.md",
        "rig live",
        "does not end by itself; live.rs runs it",
    ),
    ("docs/reference.md", "rig board", "needs a board"),
    ("docs/reference.md", "rig flash", "needs a board"),
    (
        "docs/reference.md",
        "rig doctor",
        "the exit status depends on the computer; doctor.rs runs it",
    ),
    (
        "docs/tutorial.md",
        "rig doctor",
        "the exit status depends on the computer; doctor.rs runs it",
    ),
    ("docs/tutorial.md", "rig board", "needs a board"),
    ("docs/tutorial.md", "rig record --port", "needs a board"),
];

/// Each walk is a test: the page, its blocks of shell commands that run one after the other, and what makes the files of the
/// reader.
macro_rules! walks {
    ($($test:ident: $page:literal, $blocks:expr, $files:expr;)*) => {
        const WALKS: &[(&str, Range<usize>)] = &[$(($page, $blocks)),*];
        $(
            #[test]
            fn $test() {
                let folder = tempfile::tempdir().unwrap();
                match $files(folder.path()) {
                    Ok(()) => walk(folder.path(), $page, $blocks),
                    Err(why) => println!("SKIPPED: {}: {why}", $page),
                }
            }
        )*
    };
}

walks! {
    the_first_page_runs: "README.md", 1..3, arm_and_logs;
    four_days_are_compared: "docs/compare.md", 0..1, nothing;
    the_stiffness_is_found: "docs/compliance.md", 0..5, nothing;
    control_laws_run: "docs/control.md", 0..2, nothing;
    the_demonstration_runs: "docs/demo.md", 0..1, nothing;
    motions_of_the_whole_circle_are_recorded: "docs/diagnosis.md", 1..3, nothing;
    a_completed_model_is_used: "docs/diagnosis/method.md", 1..2, completed_model;
    a_real_axis_is_identified: "docs/emps.md", 0..1, axis_of_others;
    motions_are_designed: "docs/excitation.md", 0..4, nothing;
    the_exercise_runs: "docs/exercise.md", 0..5, nothing;
    other_programs_are_given_files: "docs/export.md", 0..3, logs_and_results;
    the_load_is_found: "docs/load.md", 0..5, nothing;
    a_log_is_read: "docs/logs.md", 0..1, foreign_logs;
    an_arm_with_grippers_is_read: "docs/robots.md", 0..1, grippers;
    a_project_file_runs: "docs/run.md", 0..1, other_project;
    an_arm_with_worn_gears_is_simulated: "docs/simulate.md", 0..3, nothing;
    the_tutorial_runs: "docs/tutorial.md", 0..6, nothing;
}

/// Says why a line of a page is not run.
fn why_not(page: &str, line: &str) -> Option<usize> {
    (NOT_RUN.iter()).position(|(own, start, _)| *own == page && line.trim().starts_with(start))
}

/// Returns the folder of the program before all others.
fn path() -> std::ffi::OsString {
    let program = Path::new(env!("CARGO_BIN_EXE_rig")).parent().unwrap();
    let others = std::env::var_os("PATH").unwrap();
    let all = std::iter::once(program.to_owned()).chain(std::env::split_paths(&others));
    std::env::join_paths(all).unwrap()
}

/// Runs the blocks `wanted` of shell commands of a page in a folder, one after the other. A block without a language
/// after them holds lines of the output; … stands for text that is left out.
fn walk(folder: &Path, page: &str, wanted: Range<usize>) {
    let mut said = String::new();
    let mut seen = 0;
    for (language, block) in blocks(&root().join(page)) {
        match language.as_str() {
            "sh" if seen == wanted.end => break,
            "sh" if seen < wanted.start => seen += 1,
            "sh" => {
                seen += 1;
                said = shell(folder, page, &block).unwrap_or_else(|wrong| panic!("{wrong}"));
            }
            "" if seen > wanted.start => {
                for line in block.lines() {
                    let is_printed = line.split('…').all(|part| said.contains(part));
                    assert!(is_printed, "{page} has:\n{line}\nprinted:\n{said}");
                }
            }
            _ => {}
        }
    }
    assert_eq!(seen, wanted.end, "{page}");
}

/// Runs the lines of a block, but for those that are not to be run; returns what they print.
fn shell(folder: &Path, page: &str, block: &str) -> Result<String, String> {
    let mut lines = block.lines().collect::<Vec<_>>();
    lines.retain(|line| why_not(page, line).is_none());
    let output = Command::new("sh")
        .args(["-e", "-c", &lines.join("\n")])
        .env("PATH", path())
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    match output.status.success() {
        true => Ok(said),
        false => Err(format!("{page}: {block}\n{said}\n{errors}")),
    }
}

/// Every command of a page is run by a walk, or is listed with the reason.
#[test]
fn every_command_runs_or_has_a_reason() {
    let (mut left, mut used) = (Vec::new(), vec![false; NOT_RUN.len()]);
    for page in pages() {
        let name = page.strip_prefix(root()).unwrap().to_str().unwrap();
        let shell = blocks(&page).into_iter().filter(|(own, _)| own == "sh");
        let shell: Vec<String> = shell.map(|(_, block)| block).collect();
        let runs = |k: usize| {
            name == EXAMPLES
                || (WALKS.iter()).any(|(own, range)| *own == name && range.contains(&k))
        };
        let (run, others): (Vec<_>, Vec<_>) = (0..shell.len()).partition(|k| runs(*k));
        let run: String = run.into_iter().map(|k| shell[k].as_str()).collect();
        for line in run.lines() {
            why_not(name, line).into_iter().for_each(|k| used[k] = true);
        }
        for line in others.into_iter().flat_map(|k| shell[k].lines()) {
            match why_not(name, line) {
                Some(k) => used[k] = true,
                // A line that another block has as well is run once.
                None if line.trim().is_empty() || run.contains(line.trim()) => {}
                None => left.push(format!("{name}: {line}")),
            }
        }
    }
    assert!(
        left.is_empty(),
        "neither run nor listed:\n{}",
        left.join("\n")
    );
    for ((page, start, _), used) in NOT_RUN.iter().zip(used) {
        assert!(used, "{page} has no line `{start}`");
    }
}

/// The page with an example of every command, each with files of its own.
const EXAMPLES: &str = "docs/reference.md";

#[test]
fn the_examples_of_the_help_run() {
    let made = tempfile::tempdir().unwrap();
    example_files(made.path());
    let mut wrong = Vec::new();
    let examples = blocks(&root().join(EXAMPLES)).into_iter();
    for (_, block) in examples.filter(|(language, _)| language == "sh") {
        for line in block.lines() {
            let folder = tempfile::tempdir().unwrap();
            copy(made.path(), folder.path());
            // Files of other examples have the names of its results.
            if let Some(out) = line.split("--out ").nth(1) {
                let place = folder.path().join(out);
                let _ = fs::remove_file(&place).or_else(|_| fs::remove_dir_all(&place));
            }
            wrong.extend(shell(folder.path(), EXAMPLES, line).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let place = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => {
                fs::create_dir(&place).unwrap();
                copy(&entry.path(), &place);
            }
            false => {
                fs::copy(entry.path(), place).unwrap();
            }
        }
    }
}

/// Runs `rig` in a folder, once for each line of words.
fn prepare(folder: &Path, lines: &[&str]) {
    for line in lines {
        succeed(rig().args(line.split_whitespace()).current_dir(folder));
    }
}

/// Records a motion of a robot by simulation, with a noise of its own.
fn simulated(folder: &Path, robot: &str, motion: &str, out: &str, seed: usize) {
    let line = format!(
        "simulate --robot {robot} --trajectory {motion} --rate 250 --noise-torque 0.02 --noise-position 1e-5 --seed {seed} --out {out}"
    );
    prepare(folder, &[line.as_str()]);
}

type Made = Result<(), String>;

fn nothing(_: &Path) -> Made {
    Ok(())
}

/// A robot as URDF, and recordings of two motions.
fn arm_and_logs(folder: &Path) -> Made {
    prepare(
        folder,
        &[
            "init one-link --out arm.toml",
            "urdf --robot arm.toml --out arm.urdf",
            "excite --robot arm.toml --start -1.5708 --out motion.toml",
            "excite --robot arm.toml --start -1.5708 --seed 2 --out new.toml",
        ],
    );
    for (seed, name) in ["log", "train", "again"].iter().enumerate() {
        simulated(
            folder,
            "arm.toml",
            "motion.toml",
            &format!("{name}.csv"),
            seed,
        );
    }
    simulated(folder, "arm.toml", "new.toml", "other.csv", 7);
    Ok(())
}

/// The files of the examples of the help.
fn example_files(folder: &Path) {
    arm_and_logs(folder).unwrap();
    let place = |name: &str| folder.join(name);
    for (seed, name) in ["one", "two", "monday", "friday"].iter().enumerate() {
        simulated(
            folder,
            "arm.toml",
            "motion.toml",
            &format!("{name}.csv"),
            10 + seed,
        );
    }
    simulated(folder, "arm.toml", "new.toml", "three.csv", 20);
    prepare(
        folder,
        &[
            "init one-link --out rig.toml",
            "excite --robot rig.toml --kind sweep --start -1.5708 --amplitude 0.4 --speed 0.1,2 --speeds 6 --out sweep.toml",
            "identify --robot arm.toml --data one.csv --out found",
        ],
    );
    simulated(folder, "rig.toml", "sweep.toml", "sweep.csv", 30);
    let log = fs::read_to_string(place("log.csv")).unwrap();
    fs::write(place("foreign.csv"), log.replacen(",q1,", ",angle,", 1)).unwrap();
    fs::create_dir(place("bag")).unwrap();
    bag(&place("bag"));
}

/// Copies a bag of rosbag2 into a folder.
fn bag(folder: &Path) {
    copy(&root().join("tests/recordings/bag_mcap"), folder);
}

/// A completed model, and a recording of another motion.
fn completed_model(folder: &Path) -> Made {
    arm_and_logs(folder)?;
    fs::create_dir(folder.join("found")).unwrap();
    fs::copy(folder.join("arm.toml"), folder.join("found/model.toml")).unwrap();
    fs::rename(folder.join("other.csv"), folder.join("new.csv")).unwrap();
    Ok(())
}

/// The recordings of EMPS.
fn axis_of_others(folder: &Path) -> Made {
    let from = data_dir()
        .map(|own| own.join("emps"))
        .filter(|own| own.is_dir());
    let from =
        from.ok_or("no recordings `emps` here; RIG_DATA names the folder that holds them")?;
    for name in ["train.csv", "test_pulses.csv"] {
        fs::copy(from.join(name), folder.join(name)).unwrap();
    }
    Ok(())
}

/// Logs of other programs, an arm with the joints of the bag, and results.
fn logs_and_results(folder: &Path) -> Made {
    let place = |name: &str| folder.join(name);
    fs::create_dir(place("bag_folder")).unwrap();
    bag(&place("bag_folder"));
    fs::copy(place("bag_folder/bag_mcap.mcap"), place("log.mcap")).unwrap();
    fs::write(place("log.csv"), "t,q1,tau1\n0,10,1\n4,11,1.5\n8,12,2\n").unwrap();
    prepare(
        folder,
        &[
            "init edda --out arm.toml",
            "excite --robot arm.toml --starts 1 --out motion.toml",
        ],
    );
    simulated(folder, "arm.toml", "motion.toml", "run.csv", 1);
    prepare(
        folder,
        &["identify --robot arm.toml --data run.csv --out found"],
    );
    fs::create_dir(place("lacking")).unwrap();
    fs::copy(place("arm.toml"), place("lacking/model.toml")).unwrap();
    Ok(())
}

/// An arm with a gripper, and one with two arms.
fn grippers(folder: &Path) -> Made {
    let arm = |prefix: &str, tip: &str| {
        let names = [1, 2, 3].map(|k| format!("{prefix}link{k}"));
        let names = [names[0].as_str(), &names[1], tip];
        let mut text = String::new();
        for (k, name) in names.iter().enumerate() {
            let parent = if k == 0 { "base" } else { names[k - 1] };
            text += &format!(
                "<link name='{name}'><inertial><origin xyz='0.02 0.01 0.1'/><mass value='2'/><inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.01'/></inertial></link>
<joint name='{name}_joint' type='revolute'><parent link='{parent}'/><child link='{name}'/><origin xyz='0 0 0.2'/><axis xyz='{} 0'/><limit lower='-2' upper='2' velocity='2' effort='60'/></joint>\n",
                ["1 0", "0 1", "1 0"][k]
            );
        }
        text
    };
    let finger = "<link name='pad'><inertial><mass value='0.05'/><inertia ixx='1e-5' ixy='0' ixz='0' iyy='1e-5' iyz='0' izz='1e-5'/></inertial></link>
<joint name='finger' type='prismatic'><parent link='wrist'/><child link='pad'/><axis xyz='0 1 0'/><limit lower='0' upper='0.04' velocity='0.1' effort='20'/></joint>
<link name='pad2'><inertial><mass value='0.05'/><inertia ixx='1e-5' ixy='0' ixz='0' iyy='1e-5' iyz='0' izz='1e-5'/></inertial></link>
<joint name='finger2' type='prismatic'><parent link='wrist'/><child link='pad2'/><axis xyz='0 -1 0'/><limit lower='0' upper='0.04' velocity='0.1' effort='20'/><mimic joint='finger'/></joint>";
    let written = |name: &str, body: String| {
        let text = format!("<robot name='r'>\n<link name='base'/>\n{body}</robot>\n");
        fs::write(folder.join(name), text).unwrap();
    };
    written("arm.urdf", arm("", "wrist") + finger);
    written(
        "dual.urdf",
        arm("left_", "left_wrist") + &arm("right_", "right_wrist"),
    );
    Ok(())
}

/// A second project file.
fn other_project(folder: &Path) -> Made {
    fs::create_dir(folder.join("labs")).unwrap();
    fs::write(
        folder.join("labs/arm.toml"),
        "[rig]\ncommand = \"init\"\nkind = \"edda\"\n",
    )
    .unwrap();
    Ok(())
}

/// Logs as other programs write them, and the arm that they are of.
fn foreign_logs(folder: &Path) -> Made {
    let place = |name: &str| folder.join(name);
    fs::copy(
        root().join("tests/recordings/other.mcap"),
        place("log.mcap"),
    )
    .unwrap();
    fs::create_dir(place("bag_folder")).unwrap();
    bag(&place("bag_folder"));
    prepare(
        folder,
        &[
            "init edda --out edda.toml",
            "urdf --robot edda.toml --out arm.urdf",
            "excite --robot edda.toml --starts 2 --out motion.toml",
            "simulate --robot edda.toml --trajectory motion.toml --noise-torque 0.1 --noise-position 1e-5 --out run.csv",
        ],
    );
    // As another program writes it: positions in degrees, that of the first joint under a name of its own.
    let made = fs::read_to_string(place("run.csv")).unwrap();
    let mut lines = made.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| header.iter().position(|own| *own == name).unwrap();
    let columns = ["t", "q1", "q2", "tau1", "tau2"].map(at);
    let mut log = "t,angle,q2,tau1,tau2\n".to_owned();
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|own| own.parse().unwrap()).collect();
        let [t, q1, q2, tau1, tau2] = columns.map(|k| row[k]);
        let [q1, q2] = [q1, q2].map(f64::to_degrees);
        log += &format!("{t},{q1},{q2},{tau1},{tau2}\n");
    }
    fs::write(place("log.csv"), log).unwrap();
    Ok(())
}
