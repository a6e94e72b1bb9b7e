//! What programs read: `--json`, `--quiet`, exit statuses, completions; and models of MuJoCo as `--robot`.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::run::{rig, robot, succeed};

fn arm() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/mjcf/arm.xml")
}

/// Writes a recording of a link: 0.11 kg·m² with gravity and friction, positions times `factor`.
fn recording(path: &Path, factor: f64) {
    let mut text = String::from("t,q1,tau1\n");
    for k in 0..4000 {
        let t = 0.002 * f64::from(k);
        let q = 0.9 * (1.7 * t).sin() + 0.5 * (4.1 * t).sin();
        let qd = 0.9 * 1.7 * (1.7 * t).cos() + 0.5 * 4.1 * (4.1 * t).cos();
        let qdd = -0.9 * 1.7 * 1.7 * (1.7 * t).sin() - 0.5 * 4.1 * 4.1 * (4.1 * t).sin();
        let rest = 0.003 * (611.0 * t).sin() + 0.003 * (487.0 * t).cos();
        let tau = 0.11 * qdd + 2.5 * q.cos() + 0.4 * qd.signum() + 0.3 * qd + rest;
        writeln!(text, "{t:.3},{:.7},{tau:.5}", factor * q).unwrap();
    }
    fs::write(path, text).unwrap();
}

#[test]
fn json_on_the_standard_output_is_that_of_the_file_and_quiet_leaves_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("a.csv"), folder.path().join("out"));
    recording(&data, 1.0);
    let output = rig()
        .args([
            "identify",
            "--json",
            "--quiet",
            "--compare",
            "none",
            "--robot",
        ])
        .arg(robot("one-link.toml"))
        .arg("--data")
        .arg(&data)
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{output:?}"
    );
    let file = fs::read(out.join("identification.json")).unwrap();
    assert!(output.stdout == file);
    let again = rig()
        .args(["init", "edda", "--quiet", "--out"])
        .arg(folder.path().join("e.toml"))
        .output();
    let again = again.unwrap();
    assert!(again.status.success() && again.stdout.is_empty() && again.stderr.is_empty());
}

/// Each command without a result file of its own: the files of its summary exist, and its facts are of these files.
#[test]
fn a_summary_as_json_names_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    let summary = |words: &str| -> Value {
        let mut command = rig();
        command
            .current_dir(own)
            .args(words.split(' '))
            .arg("--json");
        let found: Value = serde_json::from_str(&succeed(&mut command)).unwrap();
        assert_eq!(found["schema"], "rig-summary/1", "{words}");
        assert_eq!(found["command"], format!("rig {words} --json"));
        for file in found["files"].as_array().unwrap() {
            assert!(
                own.join(file.as_str().unwrap()).is_file(),
                "{words}: {file}"
            );
        }
        found
    };
    let made = summary("init one-link --out rig.toml");
    assert_eq!(made["files"], serde_json::json!(["rig.toml"]));
    let motion = summary("excite --robot rig.toml --kind reversals --out motion.toml");
    let duration = motion["duration"].as_f64().unwrap();
    let run =
        summary("simulate --robot rig.toml --trajectory motion.toml --rate 500 --out run.csv");
    let samples = run["samples"].as_u64().unwrap();
    let rows = fs::read_to_string(own.join("run.csv"))
        .unwrap()
        .lines()
        .count()
        - 1;
    assert_eq!(samples as usize, rows);
    assert!(
        (samples as f64 - 500.0 * duration).abs() <= 2.0,
        "{samples} {duration}"
    );
    let kept = summary("convert run.csv run.npz");
    assert_eq!(kept["rows"], samples);
    assert_eq!(kept["columns"][0], "t");
    for words in [
        "mjcf --robot rig.toml --out joints.xml",
        "header --robot rig.toml --out friction.h",
        "urdf --robot rig.toml --out rig.urdf",
        "run --example",
        "man --out man1",
        "board --emulated disarm",
    ] {
        let found = summary(words);
        assert!(!found["answer"].as_array().unwrap().is_empty(), "{words}");
    }
    let script = summary("completions bash");
    assert!(script["script"].as_str().unwrap().contains("friction-map"));
}

#[test]
fn the_verdict_is_the_exit_status_if_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("degrees.csv");
    recording(&data, 57.3);
    for (asked, want) in [(false, 0), (true, 13)] {
        let mut command = rig();
        command
            .args(["diagnose", "--json", "--robot"])
            .arg(robot("one-link.toml"));
        command
            .arg("--data")
            .arg(&data)
            .arg("--out")
            .arg(folder.path().join(format!("{asked}")));
        if asked {
            command.arg("--exit-code");
        }
        let output = command.output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(want), "{text}");
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(found["verdict"], "data-fault");
    }
}

#[test]
fn a_model_of_mujoco_is_a_robot_and_gets_its_joints_back() {
    let folder = tempfile::tempdir().unwrap();
    let toml = folder.path().join("arm.toml");
    succeed(
        rig()
            .args(["init", "--from"])
            .arg(arm())
            .arg("--out")
            .arg(&toml),
    );
    let count = |path: &Path| {
        let text = succeed(rig().args(["base", "--json", "--robot"]).arg(path));
        let found: Value = serde_json::from_str(&text).unwrap();
        found["count"].as_u64().unwrap()
    };
    let of_xml = count(&arm());
    assert_eq!(of_xml, count(&toml));
    let joints = folder.path().join("joints.xml");
    succeed(
        rig()
            .args(["mjcf", "--robot"])
            .arg(&toml)
            .arg("--out")
            .arg(&joints),
    );
    let text = fs::read_to_string(&joints).unwrap();
    assert!(
        text.contains("<default class=\"lift\">") && text.contains("damping=\"1.5\""),
        "{text}"
    );
    // A chain that ends at another body, chosen as in a URDF, has fewer parameters.
    let short = succeed(
        rig()
            .args(["base", "--json", "--tip", "shoulder", "--robot"])
            .arg(arm()),
    );
    let short: Value = serde_json::from_str(&short).unwrap();
    assert!(short["count"].as_u64().unwrap() < of_xml);
}

#[test]
fn shells_complete_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = succeed(rig().args(["completions", shell]));
        for word in ["inspect", "identify", "friction-map", "--holdout"] {
            let word = if shell == "fish" {
                word.trim_start_matches('-')
            } else {
                word
            };
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn every_command_has_a_page_for_man() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("man1");
    let write = || {
        let mut command = rig();
        command.arg("man").arg("--out").arg(&out);
        command
    };
    succeed(&mut write());
    let page = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    // Roff writes a hyphen as \-.
    assert!(page("rig-identify.1").contains("\\-\\-holdout"));
    assert!(page("rig-board-upload.1").contains("\\-\\-leave\\-out"));
    let first = page("rig.1");
    let help = String::from_utf8(rig().arg("--help").output().unwrap().stdout).unwrap();
    let listed = (help.lines().skip_while(|line| !line.starts_with("Begin:")))
        .take_while(|line| !line.starts_with("Options:"))
        .filter(|line| line.starts_with("  "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help");
    let mut count = 0;
    for name in listed {
        count += 1;
        assert!(
            first.contains(&format!("rig\\-{}(1)", name.replace('-', "\\-"))),
            "{name}"
        );
        assert!(out.join(format!("rig-{name}.1")).exists(), "{name}");
    }
    assert!(count > 20, "only {count} commands were listed");
    let refused = write().output().unwrap();
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && said.contains("--force"),
        "{said}"
    );
    succeed(write().arg("--force"));
}

#[test]
fn details_are_printed_by_verbose_and_the_answer_is_last() {
    let folder = tempfile::tempdir().unwrap();
    let excite = |out: &str, more: &[&str]| {
        let mut command = rig();
        command.args(["excite", "--start", "-1.5708", "--starts", "1", "--robot"]);
        command.arg(robot("one-link.toml")).args(more);
        succeed(command.arg("--out").arg(folder.path().join(out)))
    };
    let (short, long) = (
        excite("a.toml", &[]),
        excite("b.toml", &["--verbose"]).replace("b.toml", "a.toml"),
    );
    for said in [&short, &long] {
        let last = said.lines().last().unwrap();
        assert!(last.contains("a.toml: the motion,"), "{said}");
    }
    // The times of the search differ.
    let mut same = short.lines().filter(|line| !line.starts_with("Search:"));
    assert!(same.all(|line| long.contains(line)), "{long}");
    assert!(short.contains("of processor time by"), "{short}");
    for detail in ["stays within position", "rig simulate"] {
        assert!(long.contains(detail) && !short.contains(detail), "{long}");
    }
    let output = rig().args(["doctor", "--verbose", "--quiet"]).output();
    assert_eq!(output.unwrap().status.code(), Some(2));
}

/// The 57 parameters of an arm fill several screens: the terminal has their number, `--verbose` and the files have all.
#[test]
fn a_long_list_of_parameters_is_a_detail() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut excite = rig();
    excite.args(["excite", "--starts", "1", "--robot"]);
    excite
        .arg(robot("irp6.toml"))
        .arg("--out")
        .arg(at("m.toml"));
    succeed(&mut excite);
    let mut simulate = rig();
    simulate.args(["simulate", "--rate", "100", "--robot"]);
    simulate.arg(robot("irp6.toml")).arg("--trajectory");
    simulate.arg(at("m.toml")).arg("--out").arg(at("d.csv"));
    succeed(&mut simulate);
    let identify = |out: &str, more: &[&str]| {
        let mut command = rig();
        command.args(["identify", "--compare", "none", "--robot"]);
        command
            .arg(robot("irp6.toml"))
            .arg("--data")
            .arg(at("d.csv"));
        succeed(command.args(more).arg("--out").arg(at(out)))
    };
    let (short, long) = (identify("short", &[]), identify("long", &["--verbose"]));
    let listed = |said: &str| said.matches("(95 %: ").count();
    assert_eq!((listed(&short), listed(&long)), (0, 57), "{short}");
    assert!(short.contains("57 base parameters: "), "{short}");
    let residuals = |said: &str| said.matches(": residual ").count();
    assert_eq!((residuals(&short), residuals(&long)), (5, 5));
}

/// The report as Markdown has the tables of the page and a picture for each of its figures; without `--markdown` a later run
/// leaves neither.
#[test]
fn the_report_is_written_as_markdown_too() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("a.csv"), folder.path().join("out"));
    recording(&data, 1.0);
    let identify = |more: &[&str]| {
        let mut command = rig();
        command.args(["identify", "--compare", "none", "--robot"]);
        command.arg(robot("one-link.toml")).arg("--data").arg(&data);
        succeed(command.args(more).arg("--out").arg(&out))
    };
    let count = |ending: &str| {
        let files = fs::read_dir(&out).unwrap().map(|file| file.unwrap().path());
        files
            .filter(|path| path.extension().unwrap() == ending)
            .count()
    };
    identify(&["--markdown"]);
    let text = fs::read_to_string(out.join("report.md")).unwrap();
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert_eq!(
        text.matches("\n**Table ").count(),
        page.matches("<caption>").count()
    );
    let pictures = text.matches("](report-figure-").count();
    assert_eq!(pictures, page.matches("class=\"static\"").count());
    assert!(pictures > 2 && pictures == count("svg"), "{text}");
    assert!(text.contains("Izz1 + Ia1") && text.contains("report-figure-1.svg"));
    identify(&["--force"]);
    assert_eq!((count("md"), count("svg")), (0, 0));
    let mut inspect = rig();
    let said = crate::run::refuse(inspect.arg("inspect").arg(&data).arg("--markdown"));
    assert!(said.contains("--out"), "{said}");
}
