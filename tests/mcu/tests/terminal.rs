//! The program `rig` against the emulated board over a real pseudo-terminal, as against a board on the desk.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clap::Parser;
use rig::commands::Cli;
use rig_plant::PlantConfig;
use rig_tests::base_parameters_of;
use serde_json::Value;

/// A running board; it ends with the test.
struct Board {
    process: Child,
    port: String,
}

impl Board {
    /// The rig of the documentation, at the pace of real time.
    fn start() -> Self {
        let image = std::env::var_os("RIG_FIRMWARE_ELF").map_or_else(
            || {
                let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
                    || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../target"),
                    PathBuf::from,
                );
                target.join("thumbv7em-none-eabihf/chip/rig-firmware")
            },
            PathBuf::from,
        );
        let process = Command::new(env!("CARGO_BIN_EXE_rig-mcu"))
            .arg(image)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let port = String::new();
        // From here on it ends whatever happens.
        let mut board = Self { process, port };
        let mut said = String::new();
        let stdout = board.process.stdout.take().unwrap();
        for line in BufReader::new(stdout).lines() {
            let line = line.unwrap();
            if let Some(port) = line.strip_prefix("serial port ") {
                port.clone_into(&mut board.port);
                return board;
            }
            said += &line;
        }
        panic!("rig-mcu named no port: {said}");
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // It has ended by itself otherwise.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn rig(arguments: &[&str]) {
    let all = std::iter::once("rig").chain(arguments.iter().copied());
    if let Err(error) = Cli::parse_from(all).run() {
        panic!("rig {}: {error}", arguments.join(" "));
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn rig_record_and_rig_identify_work_against_the_board_s_serial_port() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (robot, motion) = (at("rig.toml"), at("motion.toml"));
    let (rest, run, found) = (at("rest.csv"), at("run.csv"), at("found"));
    rig(&["init", "one-link", "--out", text(&robot)]);
    rig(&[
        "excite",
        "--start",
        "-1.5707963",
        "--period",
        "4",
        "--periods",
        "2",
        "--starts",
        "2",
        "--robot",
        text(&robot),
        "--out",
        text(&motion),
    ]);
    let board = Board::start();
    // One host after another: first the rig at rest.
    rig(&[
        "record",
        "--port",
        &board.port,
        "--seconds",
        "0.5",
        "--out",
        text(&rest),
    ]);
    // Times of the samples, s: each a millisecond after the one before.
    let samples = |path: &Path| {
        let all = std::fs::read_to_string(path).unwrap();
        let times: Vec<f64> = all
            .lines()
            .filter_map(|line| line.split(',').next()?.parse().ok())
            .collect();
        let even = |pair: &[f64]| (pair[1] - pair[0] - 1e-3).abs() < 1e-6;
        assert!(times.windows(2).all(even), "{} has holes", path.display());
        times.len()
    };
    assert!(samples(&rest) >= 500, "{} samples", samples(&rest));
    rig(&[
        "record",
        "--port",
        &board.port,
        "--home",
        "-1.5707963",
        "--robot",
        text(&robot),
        "--trajectory",
        text(&motion),
        "--seconds",
        "0.2",
        "--out",
        text(&run),
    ]);
    assert!(samples(&run) > 8000, "{} samples", samples(&run));
    rig(&[
        "identify",
        "--robot",
        text(&robot),
        "--data",
        text(&run),
        "--out",
        text(&found),
    ]);

    let result = std::fs::read_to_string(found.join("identification.json")).unwrap();
    let result: Value = serde_json::from_str(&result).unwrap();
    let truth = base_parameters_of(&PlantConfig::default());
    let found = result["base_parameters"].as_array().unwrap();
    assert_eq!(found.len(), truth.len());
    let mut table = String::new();
    let mut fair = true;
    for (base, truth) in found.iter().zip(truth) {
        let number = |name: &str| base[name].as_f64().unwrap();
        let z = (number("value") - truth) / number("std");
        table += &format!(
            "{:<12} {:>9.5} truth {truth:>9.5} z {z:.2}\n",
            base["expression"],
            number("value")
        );
        fair &= z.abs() <= 4.0;
    }
    println!("{table}");
    assert!(fair, "\n{table}");
}

/// A description with an effect, sent and stored; the health; a burst of single ticks.
#[test]
fn rig_board_works_against_the_board_s_serial_port() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (robot, burst) = (at("model.toml"), at("burst.csv"));
    rig(&["init", "one-link", "--out", text(&robot)]);
    let mut description = std::fs::read_to_string(&robot).unwrap();
    description += "\n[[effect]]\nkind = \"cogging\"\ncosine = 0.1\nsine = -0.05\norder = 12.0\n";
    std::fs::write(&robot, &description).unwrap();
    let board = Board::start();
    let at_board = |rest: &[&str]| rig(&[&["board", "--port", &board.port], rest].concat());
    at_board(&["upload", "--model", text(&robot)]);
    at_board(&["store"]);
    at_board(&["health"]);
    at_board(&["capture", "--after", "200", "--out", text(&burst)]);
    let all = std::fs::read_to_string(&burst).unwrap();
    let times: Vec<f64> = all
        .lines()
        .filter_map(|line| line.split(',').next()?.parse().ok())
        .collect();
    assert!(times.len() > 1000, "{} ticks", times.len());
    let even = |pair: &[f64]| (pair[1] - pair[0] - 1e-4).abs() < 1e-9;
    assert!(times.windows(2).all(even), "a tick is missing");

    // What nothing compensates is refused by name.
    description += "\n[[effect]]\nkind = \"measurement_delay\"\ndelay = 0.001\n";
    std::fs::write(&robot, description).unwrap();
    let arguments = ["rig", "board", "--port", &board.port, "upload", "--model"];
    let refused = Cli::parse_from(arguments.iter().copied().chain([text(&robot)])).run();
    let sentence = refused.unwrap_err().to_string();
    assert!(sentence.contains("measurement_delay"), "{sentence}");
}
