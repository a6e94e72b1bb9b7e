//! The bench at a size that fits into the tests: what is hidden is found, nothing is found where nothing is hidden, and
//! the peer beside it shows that neither is easy.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::process::{Command, Output};

use serde_json::Value;

/// Effects of each kind: a law of friction, friction with memory, the motor, gravity, the gear.
const HIDDEN: [&str; 5] = [
    "stribeck",
    "presliding",
    "cogging",
    "gravity_tilt",
    "backlash",
];
/// Recordings with nothing hidden.
const NOTHING: u64 = 4;

fn bench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig-bench"))
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn what_is_hidden_is_found_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = bench(&[
        "--effects",
        &HIDDEN.join(","),
        "--seeds",
        "1",
        "--nothing",
        &NOTHING.to_string(),
        "--train",
        "30",
        "--holdout",
        "20",
        "--only",
        "diagnose,stlsq",
        "--out",
        out.to_str().unwrap(),
    ]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let table = fs::read_to_string(out.join("benchmark.md")).unwrap();
    assert!(said.contains(table.trim_end()), "{said}");
    let text = fs::read_to_string(out.join("benchmark.json")).unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["schema"], "rig-benchmark/1");
    let outcomes = |method: usize| found["outcomes"][method].as_array().unwrap();
    let names = |outcome: &Value| -> Vec<String> {
        let named = outcome["answer"]["named"].as_array().unwrap();
        let name = |n: &Value| n["effect"].as_str().unwrap().to_owned();
        named.iter().map(name).collect()
    };
    let of = |method: usize, group: &str| -> Vec<Value> {
        let all = outcomes(method).iter();
        all.filter(|o| o["group"] == group).cloned().collect()
    };
    let single = of(0, "single");
    assert_eq!(single.len(), HIDDEN.len());
    for outcome in &single {
        let hidden = outcome["hidden"][0]["effect"].as_object().unwrap();
        let wanted: Vec<String> = hidden.keys().cloned().collect();
        assert_eq!(names(outcome), wanted, "{outcome}");
        assert!(
            outcome["answer"]["gap_closed"].as_f64().unwrap() > 0.85,
            "{outcome}"
        );
    }
    let nothing = of(0, "nothing");
    assert_eq!(nothing.len() as u64, NOTHING);
    for outcome in &nothing {
        assert!(names(outcome).is_empty(), "{outcome}");
    }
    // Sparse regression over the same candidates names something in every recording in which nothing is hidden.
    let peers = of(1, "nothing");
    assert!(peers.iter().all(|o| !names(o).is_empty()), "{peers:?}");
    // 4 of 4: Wilson's interval at 95 % goes from 51.0 to 100 % (Wilson 1927).
    assert!(table.contains("4/4 = 100.0 % [51.0, 100.0]"), "{table}");
}

#[test]
fn sizes_that_mean_nothing_are_refused() {
    let said = |arguments: &[&str]| {
        let output = bench(arguments);
        assert!(!output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let noise = said(&["--noise", "loud"]);
    assert!(
        noise.contains("loud") && noise.contains("low, medium, high"),
        "{noise}"
    );
    let short = said(&["--train", "5"]);
    assert!(short.contains("--train is 5 s"), "{short}");
    let unknown = said(&["--effects", "stribek"]);
    assert!(unknown.contains("stribek"), "{unknown}");
}
