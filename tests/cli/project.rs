//! `rig run`: the steps of a project file.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::run::{refuse, rig, succeed};

/// A short project on the emulated rig.
const SHORT: &str = r#"robot = "rig.toml"
home = -1.5708

[rig]
command = "init"
kind = "one-link"

[slow]
command = "excite"
kind = "chirp"
start = -1.5708

[train]
command = "record"
emulated = true
trajectory = "slow.toml"

[found]
command = "identify"
data = "train.csv"
compare = "none"
cutoff = 60
"#;

fn run(folder: &Path, more: &[&str]) -> Command {
    let mut command = rig();
    command.arg("run").args(more).current_dir(folder);
    command
}

/// Names of the steps that a run did not skip.
fn worked(text: &str) -> Vec<String> {
    let step = |line: &str| {
        let (name, rest) = line.strip_prefix('[')?.split_once(']')?;
        (!rest.contains("unchanged")).then(|| name.to_owned())
    };
    text.lines().filter_map(step).collect()
}

fn state(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("lab.run.json")).unwrap()).unwrap()
}

#[test]
fn the_example_runs_from_the_description_to_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    succeed(&mut run(own, &["--example"]));
    let refused = refuse(&mut run(own, &["--example"]));
    assert!(refused.contains("--force"), "{refused}");
    let text = succeed(&mut run(own, &[]));
    let steps = [
        "rig",
        "motion",
        "other",
        "slow",
        "train",
        "again",
        "reversals",
        "holdout",
        "found",
        "lacking",
        "check",
        "repeat",
    ];
    assert_eq!(worked(&text), steps);
    for words in [
        "verdict: Explained",
        "presliding",
        "% of the torque",
        "lacking/report.html",
        "The sets agree.",
        "report: lab.html",
    ] {
        assert!(text.contains(words), "{words}:\n{text}");
    }
    let page = fs::read_to_string(own.join("lab.html")).unwrap();
    for link in ["href=\"found/report.html\"", "href=\"lacking/model.toml\""] {
        assert!(page.contains(link), "{link}");
    }
    // The report of a step says how to repeat that step.
    let report = fs::read_to_string(own.join("check/report.html")).unwrap();
    assert!(report.contains("rig validate --robot=lacking/model.toml"));
    let found = fs::read_to_string(own.join("lab.run.json")).unwrap();
    let again = succeed(&mut run(own, &[]));
    assert!(worked(&again).is_empty(), "{again}");
    assert!(again.contains("verdict: Explained"), "{again}");
    assert_eq!(fs::read_to_string(own.join("lab.run.json")).unwrap(), found);
}

#[test]
fn a_change_runs_the_steps_that_depend_on_it_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    let lab = own.join("lab.toml");
    fs::write(&lab, SHORT).unwrap();
    let text = succeed(&mut run(own, &[]));
    assert_eq!(worked(&text), ["rig", "slow", "train", "found"]);
    let first = state(own);
    assert_eq!(first["schema"], "rig-run/1");
    assert!(first["steps"][3]["inputs"]["train.csv"].is_string());
    // From another folder, by the same relative paths.
    let mut elsewhere = rig();
    let skipped = succeed(elsewhere.arg("run").arg(&lab));
    assert!(worked(&skipped).is_empty(), "{skipped}");
    // An option of one step: that step, and what reads its output if that differs.
    fs::write(&lab, SHORT.replace("cutoff = 60", "cutoff = 50")).unwrap();
    let text = succeed(&mut run(own, &[]));
    assert_eq!(worked(&text), ["found"]);
    assert!(text.contains("its options changed"), "{text}");
    // An output that is gone is made again; being the same, it changes nothing behind it.
    fs::remove_file(own.join("slow.toml")).unwrap();
    let text = succeed(&mut run(own, &[]));
    assert_eq!(worked(&text), ["slow"]);
    // An input that differs.
    fs::write(
        &lab,
        SHORT.replace("emulated = true", "emulated = true\nrun = 2"),
    )
    .unwrap();
    let text = succeed(&mut run(own, &[]));
    assert_eq!(worked(&text), ["train", "found"]);
    assert!(text.contains("train.csv changed") || text.contains("its options changed"));
    // Notes of the user in the folder of a step stay; an edited result is not overwritten.
    fs::write(own.join("found/notes.txt"), "mine").unwrap();
    let identified = own.join("found/identified.toml");
    let before = fs::read_to_string(&identified).unwrap();
    fs::write(&identified, format!("# mine\n{before}")).unwrap();
    let refused = refuse_last(&mut run(own, &[]));
    for words in [
        "lab.toml:19: [found]",
        "found/identified.toml was changed",
        "--force",
    ] {
        assert!(refused.contains(words), "{words}: {refused}");
    }
    let text = succeed(&mut run(own, &["--force"]));
    assert_eq!(worked(&text), ["found"]);
    assert_eq!(fs::read_to_string(&identified).unwrap(), before);
    assert_eq!(
        fs::read_to_string(own.join("found/notes.txt")).unwrap(),
        "mine"
    );
    let text = succeed(&mut run(own, &["--again", "--json"]));
    let printed: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(printed, state(own));
}

/// The last line of a run that must fail, after remarks of the steps before.
fn refuse_last(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{command:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    text.lines().last().unwrap().to_owned()
}

#[test]
fn the_first_step_that_fails_ends_the_run_with_its_table_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    let text = SHORT.replace("trajectory = \"slow.toml\"", "trajectory = \"none.toml\"");
    fs::write(own.join("lab.toml"), text).unwrap();
    let refused = refuse_last(&mut run(own, &[]));
    for words in ["lab.toml:13: [train]", "none.toml"] {
        assert!(refused.contains(words), "{words}: {refused}");
    }
    assert!(own.join("slow.toml").exists());
    assert!(!own.join("found").exists() && !own.join("lab.html").exists());
    // The steps before it are not lost.
    fs::write(own.join("lab.toml"), SHORT).unwrap();
    let text = succeed(&mut run(own, &[]));
    assert_eq!(worked(&text), ["train", "found"]);
}

#[test]
fn a_wrong_project_file_is_refused_by_line_before_any_step_runs() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    let wrong = |from: &str, to: &str, words: &[&str]| {
        assert!(SHORT.contains(from));
        fs::write(own.join("lab.toml"), SHORT.replace(from, to)).unwrap();
        let refused = refuse(&mut run(own, &[]));
        for word in words {
            assert!(refused.contains(word), "{word}: {refused}");
        }
        assert!(!own.join("rig.toml").exists(), "{refused}");
    };
    wrong(
        "start =",
        "strat =",
        &["lab.toml:11: [slow]", "`strat`", "did you mean `start`"],
    );
    wrong("home =", "hoem =", &["lab.toml:2:", "`hoem`", "no step"]);
    wrong(
        "command = \"excite\"\n",
        "",
        &["lab.toml:8: [slow]", "`command`"],
    );
    wrong(
        "\"excite\"",
        "\"exite\"",
        &["lab.toml:9: [slow]", "`exite`", "excite"],
    );
    wrong(
        "\"chirp\"",
        "\"chirb\"",
        &["lab.toml:8: [slow]", "'chirb'", "(line 10)"],
    );
    wrong(
        "= true",
        "= \"yes\"",
        &["lab.toml:15: [train]", "`emulated`", "true or false"],
    );
    wrong(
        "cutoff",
        "force = true\ncutoff",
        &["[found]", "`force`", "rig run --force"],
    );
    wrong(
        "cutoff",
        "json = true\ncutoff",
        &["[found]", "`json`", "rig run --json"],
    );
    wrong(
        "data = \"train.csv\"\n",
        "",
        &["lab.toml:18: [found]", "--data"],
    );
    wrong(
        "compare",
        "out = \"train.csv\"\ncompare",
        &["[found]", "as [train] does"],
    );
    wrong("[slow]", "[slow", &["lab.toml:8:", "not TOML"]);
    // A step that reads what a later one writes.
    let (early, late) = SHORT.split_at(SHORT.find("[slow]").unwrap());
    let (slow, late) = late.split_at(late.find("[train]").unwrap());
    fs::write(own.join("lab.toml"), format!("{early}{late}{slow}")).unwrap();
    let refused = refuse(&mut run(own, &[]));
    for word in ["lab.toml:11: [train]", "`trajectory`", "[slow]", "move"] {
        assert!(refused.contains(word), "{word}: {refused}");
    }
}
