//! What is written for other programs: `rig convert`, `rig header`, `rig table`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

/// A file that another program wrote (`tests/recordings/make.py`).
fn of_others(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/recordings")
        .join(name)
}

/// Columns of a CSV file, with their names.
fn columns(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<String> = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    let mut values = vec![Vec::new(); names.len()];
    for line in lines {
        for (column, field) in values.iter_mut().zip(line.split(',')) {
            column.push(field.parse().unwrap());
        }
    }
    (names, values)
}

fn convert(from: &Path, to: &Path) -> Command {
    let mut command = rig();
    command.arg("convert").arg(from).arg(to);
    command
}

#[test]
fn a_recording_is_the_same_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let own = |name: &str| folder.path().join(name);
    // The truth that the files hold: q = (0.5 sin 3t, 0.3 cos 2t), tau = (2 q1, -4 q2).
    let text = succeed(&mut convert(&of_others("bag_mcap"), &own("bag.csv")));
    // The joints in the file: gripper, elbow, shoulder.
    assert!(text.contains("200 rows of t, q1, q2, q3"), "{text}");
    let (names, bag) = columns(&own("bag.csv"));
    let at = |name: &str| names.iter().position(|own| own == name).unwrap();
    for row in [0, 57, 199] {
        let t = bag[0][row];
        assert!((t - 0.002 * row as f64).abs() < 1e-9);
        let (q, tau) = (bag[at("q2")][row], bag[at("tau2")][row]);
        assert!((q - 0.5 * (3.0 * t).sin()).abs() < 1e-9 && (tau - 2.0 * q).abs() < 1e-9);
    }
    // Through every other format and back.
    succeed(&mut convert(&own("bag.csv"), &own("bag.npz")));
    succeed(&mut convert(&own("bag.npz"), &own("bag.parquet")));
    succeed(&mut convert(&own("bag.parquet"), &own("bag.mcap")));
    let mut named = rig();
    named.arg("convert").arg(own("bag.mcap"));
    let none = refuse(&mut named);
    assert!(none.contains("OUT"), "{none}");
    succeed(named.arg("--out").arg(own("back.csv")));
    let (names_back, back) = columns(&own("back.csv"));
    assert_eq!(names_back.len(), names.len());
    for (k, name) in names.iter().enumerate() {
        let j = names_back.iter().position(|own| own == name).unwrap();
        assert_eq!(back[j], bag[k], "{name}");
    }
    let again = refuse(&mut convert(&own("bag.csv"), &own("bag.npz")));
    assert!(again.contains("--force"), "{again}");
    let unknown = refuse(&mut convert(&own("bag.csv"), &own("bag.hdf5")));
    assert!(unknown.contains(".npz or .parquet"), "{unknown}");
    // A motor current stays a current.
    let mixed = own("mixed.csv");
    fs::write(
        &mixed,
        "time [ms];q1 [deg];i1;note\n0;180;1,5;on\n4;90;2,5;on\n8;0;3,5;off\n",
    )
    .unwrap();
    let output = convert(&mixed, &own("mixed-si.csv")).output().unwrap();
    let remarks = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{remarks}");
    assert!(remarks.contains("column `note` is left out"), "{remarks}");
    let (names, values) = columns(&own("mixed-si.csv"));
    assert_eq!(names, ["t", "q1", "i1"]);
    assert_eq!(values[2], [1.5, 2.5, 3.5]);
    assert!((values[0][1] - 0.004).abs() < 1e-12);
    assert!((values[1][0] - std::f64::consts::PI).abs() < 1e-12);
}

/// The sensor of the recording (tests/recordings/clocks.py) stamps by a clock of its own; its force along x is 10 t.
#[test]
fn topics_with_clocks_of_their_own_are_named_and_read_by_the_clock_of_the_recorder() {
    let folder = tempfile::tempdir().unwrap();
    let own = |name: &str| folder.path().join(name);
    let mapped = |more: &[&str]| {
        let mut command = convert(&of_others("clocks.mcap"), &own("clocks.csv"));
        command.arg("--robot").arg(robot("edda.toml"));
        command.args(["--map", "q1=joint_states/position/shoulder"]);
        command.args(["--map", "q2=joint_states/position/elbow"]);
        command.args(["--map", "fx=ft_sensor/wrench/wrench/force/x"]);
        command.arg("--force").args(more);
        command
    };
    let apart = refuse(&mut mapped(&[]));
    for words in [
        "/ft_sensor/wrench",
        "from 5.001000000 to 5.391000000 s",
        "from 1700000000.000000000 to 1700000000.398000000 s",
        "--clock log",
    ] {
        assert!(apart.contains(words), "{words}: {apart}");
    }
    fs::write(own("clock.toml"), "clock = \"log\"\n").unwrap();
    let mapping = own("clock.toml").to_str().unwrap().to_owned();
    for more in [["--clock", "log"], ["--mapping", &mapping]] {
        succeed(&mut mapped(&more));
        let (names, values) = columns(&own("clocks.csv"));
        let at = |name: &str| names.iter().position(|own| own == name).unwrap();
        let (t, fx) = (&values[at("t")], &values[at("fx")]);
        assert_eq!(t.len(), 195);
        assert!(t.iter().zip(fx).all(|(t, fx)| (fx - 10.0 * t).abs() < 1e-9));
    }
    fs::write(own("clock.toml"), "clock = \"sensor\"\n").unwrap();
    let unknown = refuse(&mut mapped(&["--mapping", &mapping]));
    assert!(unknown.contains("is no clock"), "{unknown}");
}

/// Runs a script with the files that `made` makes, if a Python with these modules is installed.
fn read_by_python(modules: &str, script: &str, made: impl FnOnce() -> Vec<PathBuf>) {
    let python = std::env::var("RIG_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let import = format!("import {modules}");
    let found = Command::new(&python).args(["-c", &import]).output();
    if !found.is_ok_and(|output| output.status.success()) {
        println!("SKIPPED: {python} has no {modules}; RIG_PYTHON names one that has.");
        return;
    }
    let mut run = Command::new(&python);
    let output = run.args(["-c", script]).args(made()).output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// NumPy itself, where it is installed.
#[test]
fn numpy_reads_what_is_converted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.npz");
    let script = "import sys, numpy\nf = numpy.load(sys.argv[1])\nassert f['q'].shape == (200, 3) and f['t'].shape == (200,), f['q'].shape\nt = f['t']\nassert abs(f['q'][:, 1] - 0.5 * numpy.sin(3 * t)).max() < 1e-9\nassert abs(f['tau'][:, 1] - 2 * f['q'][:, 1]).max() < 1e-9\n";
    read_by_python("numpy", script, || {
        succeed(&mut convert(&of_others("bag_mcap"), &path));
        vec![path]
    });
}

/// pyarrow itself, where it is installed.
#[test]
fn pyarrow_reads_what_is_converted() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["log.parquet", "log.csv"].map(|name| folder.path().join(name));
    let script = "import sys, json, numpy, pyarrow.parquet\nf = pyarrow.parquet.read_table(sys.argv[1])\nlines = open(sys.argv[2]).read().split()\nassert f.column_names == lines[0].split(','), f.column_names\nwant = numpy.array([line.split(',') for line in lines[1:]], dtype=float)\nown = numpy.array([c.to_numpy() for c in f.columns]).T\nassert own.shape == want.shape and (own == want).all()\nassert json.loads(f.schema.metadata[b'units'])['tau1'] == 'N*m'\n";
    read_by_python("numpy, pyarrow", script, || {
        for path in &files {
            succeed(&mut convert(&of_others("bag_mcap"), path));
        }
        files.to_vec()
    });
}

#[test]
fn friction_is_written_as_c_and_compiles() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("friction.h");
    let write = |name: &str| {
        let mut command = rig();
        command.arg("header").arg("--robot").arg(robot(name));
        command.arg("--out").arg(&out).arg("--force");
        succeed(&mut command)
    };
    for name in ["one-link.toml", "irp6.toml", "emps.toml"] {
        assert!(write(name).contains("friction.h"));
        let text = fs::read_to_string(&out).unwrap();
        assert!(text.contains("rig_joint1_torque"), "{text}");
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
        let mut build = Command::new(&compiler);
        build.args([
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-pedantic",
            "-Werror",
            "-fsyntax-only",
        ]);
        match build.args(["-x", "c"]).arg(&out).output() {
            Err(_) => println!("SKIPPED: there is no C compiler `{compiler}`; set CC to one."),
            Ok(output) => {
                let why = String::from_utf8_lossy(&output.stderr).into_owned();
                // A header on its own is not used.
                let real = why
                    .lines()
                    .any(|line| line.contains("error:") && !line.contains("pragma"));
                assert!(!real, "{name}: {why}");
            }
        }
    }
    let refused = refuse(
        rig()
            .arg("header")
            .arg("--robot")
            .arg(robot("one-link.toml"))
            .arg("--out")
            .arg(&out),
    );
    assert!(refused.contains("--force"), "{refused}");
}

#[test]
fn the_parameters_of_a_result_are_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let result = folder.path().join("identification.json");
    fs::write(
        &result,
        r#"{"schema": "rig-identification/1", "robot": "arm", "base_parameters": [
            {"expression": "Izz1 + Ia1", "value": 0.11751, "std": 0.00012, "unit": "kg*m^2"},
            {"expression": "fv1", "value": 0.345, "std": null, "unit": "N*m*s/rad"}]}"#,
    )
    .unwrap();
    let markdown = succeed(rig().arg("table").arg(folder.path()));
    for line in [
        "| parameter of arm | value ± standard deviation | unit |",
        "| Izz1 + Ia1 | 0.11751 ± 0.00012 | kg·m² |",
        "| fv1 | 0.3450 | N·m·s/rad |",
    ] {
        assert!(markdown.contains(line), "{line}:\n{markdown}");
    }
    let out = folder.path().join("table.tex");
    succeed(rig().arg("table").arg(&result).arg("--out").arg(&out));
    let latex = fs::read_to_string(&out).unwrap();
    for line in [
        "\\begin{tabular}{lrl}",
        "$I_{zz1} + I_{a1}$ & $0.11751 \\pm 0.00012$ & kg\\,m$^{2}$ \\\\",
        "$f_{v1}$ & $0.3450$ & N\\,m\\,s/rad \\\\",
    ] {
        assert!(latex.contains(line), "{line}:\n{latex}");
    }
    let refused = refuse(rig().arg("table").arg(robot("one-link.toml")));
    assert!(
        refused.contains("no result of an identification"),
        "{refused}"
    );
}
