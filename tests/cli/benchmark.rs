//! `rig benchmark` at a size that fits into the tests: what is hidden is found, nothing is found where nothing is hidden, and
//! the peer beside it shows that neither is easy.

use std::fs;

use serde_json::Value;

use crate::run::{refuse, rig, succeed};

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

#[test]
fn what_is_hidden_is_found_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let said = succeed(
        rig()
            .arg("benchmark")
            .args(["--effects", &HIDDEN.join(",")])
            .args(["--seeds", "1", "--nothing", &NOTHING.to_string()])
            .args(["--train", "30", "--holdout", "20"])
            .args(["--only", "diagnose,stlsq"])
            .arg("--out")
            .arg(&out),
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
    let said = |arguments: &[&str]| refuse(rig().arg("benchmark").args(arguments));
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
