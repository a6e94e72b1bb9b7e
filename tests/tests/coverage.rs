//! Off-line identification on the emulated rig: intervals that hold what they claim, with the options that a user
//! gets who names none, and the same parameters as on line.
//!
//! Current becomes torque with the plant's own torque constant: an error in it scales every parameter alike, and
//! no motion of the rig can show it. The error of the measured current offset is part of what is covered.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_identify::{ModelKind, Options, identify};
use rig_shared::wire::message::Estimate;
use rig_tests::{GRAVITY, base_parameters_of, bench, driven, excitation, in_parallel, robot};

/// Base parameters of the rig, in the order of the tables.
const NAMES: [&str; 6] = ["mx1", "my1", "Izz1 + Ia1", "fv1", "fc1", "off1"];

/// Rigs of the study.
const RIGS: u64 = 200;
/// The first of them are also compared with the on-line estimate.
const COMPARED: u64 = 40;

/// One base parameter on one rig.
#[derive(Clone, Copy)]
struct Found {
    error: f64,
    std: f64,
    half_width: f64,
}

/// Both models by rig, and the on-line estimate's distance from the differential one in units of the combined 95 %
/// half width.
struct Outcome {
    models: [[Found; 6]; 2],
    apart: Option<[f64; 6]>,
}

/// The on-line estimate J, gc, gs, fv, fc, off as base parameters: value and standard deviation.
fn online(estimate: &Estimate) -> [(f64, f64); 6] {
    let of = |k: usize, scale: f64| {
        (
            f64::from(estimate.value[k]) * scale,
            f64::from(estimate.std[k]) * scale.abs(),
        )
    };
    [
        of(1, 1.0 / GRAVITY),
        of(2, -1.0 / GRAVITY),
        of(0, 1.0),
        of(3, 1.0),
        of(4, 1.0),
        of(5, 1.0),
    ]
}

fn study(seed: u64) -> Outcome {
    let (mut line, plant) = bench(seed);
    let torque_per_ampere = plant.mechanism.ratio * plant.motor.torque_constant;
    let runs = [0, 1].map(|run| {
        let recording = driven(&mut line, vec![], excitation(2 * seed + run, 5, 4), 0.5);
        assert!(
            recording.faults.is_empty(),
            "rig {seed}: {:?}",
            recording.faults
        );
        recording
    });
    let [first, second] =
        [0, 1].map(|k| runs[k].in_memory(&format!("rig {seed}, run {k}"), torque_per_ampere));
    let truth = base_parameters_of(&plant);
    let results = [ModelKind::Differential, ModelKind::Integral].map(|model| {
        let options = Options {
            model,
            ..Options::default()
        };
        let found = identify(&robot(), &[&first, &second], &[], &options).unwrap();
        let names: Vec<_> = found
            .base_parameters
            .iter()
            .map(|b| b.expression.as_str())
            .collect();
        assert_eq!(names, NAMES);
        found.base_parameters
    });
    let apart = (seed < COMPARED).then(|| {
        let last = online(&runs[1].estimate());
        std::array::from_fn(|k| {
            let offline = &results[0][k];
            let half = 0.5 * (offline.interval[1] - offline.interval[0]);
            (last[k].0 - offline.value).abs() / half.hypot(1.96 * last[k].1)
        })
    });
    let models = results.map(|found| {
        std::array::from_fn(|k| Found {
            error: found[k].value - truth[k],
            std: found[k].std,
            half_width: 0.5 * (found[k].interval[1] - found[k].interval[0]),
        })
    });
    Outcome { models, apart }
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_claim() {
    let outcomes = in_parallel(RIGS, study);
    let n = RIGS as f64;
    let mut text =
        String::from("model         parameter    covered  mean z  rms z   mean std  mean error\n");
    let mut fair = true;
    for (m, model) in ["differential", "integral"].iter().enumerate() {
        for (k, name) in NAMES.iter().enumerate() {
            let found = || outcomes.iter().map(|o| o.models[m][k]);
            let covered = found().filter(|f| f.error.abs() <= f.half_width).count() as f64 / n;
            let mean = found().map(|f| f.error / f.std).sum::<f64>() / n;
            let rms = (found().map(|f| (f.error / f.std).powi(2)).sum::<f64>() / n).sqrt();
            let std = found().map(|f| f.std).sum::<f64>() / n;
            let error = found().map(|f| f.error).sum::<f64>() / n;
            text += &format!(
                "{model:<13} {name:<11} {:>6.1} % {mean:>7.2} {rms:>6.2} {std:>10.6} {error:>11.6}\n",
                100.0 * covered
            );
            fair &= (0.90..=0.985).contains(&covered);
        }
    }
    text += "\non line against off line: within the combined 95 % interval\n";
    for (k, name) in NAMES.iter().enumerate() {
        let apart = || outcomes.iter().filter_map(|o| o.apart.map(|a| a[k]));
        let agree = apart().filter(|a| *a <= 1.0).count() as f64 / COMPARED as f64;
        text += &format!("{name:<11} {:>6.1} % of {COMPARED} rigs\n", 100.0 * agree);
        fair &= agree >= 0.9;
    }
    println!("{text}");
    assert!(fair, "\n{text}");
}
