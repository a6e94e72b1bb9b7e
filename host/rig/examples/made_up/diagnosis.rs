//! Diagnoses with made-up numbers, one of each verdict: for looking at their pages and for testing them.

use std::collections::BTreeMap;

use rig_diagnose::experiment::ExperimentKind;

use super::outcome::{
    About, Absorbed, Before, ByMotion, Curves, DataFault, Detectable, Diagnosis, FaultKind, Map,
    NextExperiment, NotTestable, Place, Remainder, Residual, Step, Tried, Twice, Value, Verdict,
    Waterfall,
};

/// Nothing in it yet but a name and a verdict.
fn empty(verdict: Verdict, words: &[&str]) -> Diagnosis {
    Diagnosis {
        schema: "rig-diagnosis/1".into(),
        robot: "one-link rig".into(),
        verdict,
        residual: Residual::Torque,
        words: words.iter().map(|w| (*w).into()).collect(),
        noise_floor_rms: Vec::new(),
        noise_floor_from: Vec::new(),
        left: Vec::new(),
        motion_how: String::new(),
        noise_floor_how: String::new(),
        treatment: None,
        torque_lead: Vec::new(),
        places: Vec::new(),
        described: Vec::new(),
        steps: Vec::new(),
        gap_closed: None,
        absorbed: Vec::new(),
        absorbed_before: Before::Described,
        by_motion: None,
        not_testable: Vec::new(),
        detectable: Vec::new(),
        next_experiment: None,
        remainder: None,
        data_faults: Vec::new(),
        waterfall: Vec::new(),
        tried: Vec::new(),
        maps: Vec::new(),
        curves: Vec::new(),
    }
}

fn value(value: f64, std: f64, unit: &str) -> Value {
    Value {
        value,
        std,
        unit: unit.into(),
    }
}

fn place(coordinate: &str, interval: [f64; 2], unit: &str, share: f64, text: &str) -> Place {
    Place {
        joint: "link".into(),
        coordinate: coordinate.into(),
        interval,
        unit: unit.into(),
        share,
        p_value: 1e-12,
        text: text.into(),
    }
}

fn tried(step: usize, effect: &str, gain: f64, sigmas: f64, p_value: f64, refused: &str) -> Tried {
    Tried {
        effect: effect.into(),
        joint: "link".into(),
        step,
        gain,
        gain_sigmas: sigmas,
        p_value,
        refused: refused.into(),
    }
}

fn waterfall(models: &[&str], train: &[f64], holdout: &[f64]) -> Waterfall {
    Waterfall {
        joint: "link".into(),
        unit: "N*m".into(),
        models: models.iter().map(|m| (*m).into()).collect(),
        train: train.into(),
        holdout: holdout.into(),
        floor: 0.051,
        holdout_floor: 0.051,
    }
}

fn ripple(k: usize) -> f64 {
    (1.7 * k as f64).sin() * (0.31 * k as f64).cos()
}

fn maps() -> Vec<Map> {
    let stribeck = |v: f64| v.signum() * (0.31 * (-(v / 0.08).powi(2)).exp() - 0.04);
    let cogging = |a: f64| 0.11 * (7.0 * a + 0.6).sin();
    let bins = |low: f64, high: f64, law: &dyn Fn(f64) -> f64, wobble: f64| {
        let n = 36;
        let at: Vec<f64> = (0..n)
            .map(|k| low + (high - low) * (k as f64 + 0.5) / n as f64)
            .collect();
        let before = at
            .iter()
            .enumerate()
            .map(|(k, x)| [law(*x) + wobble * ripple(k), 0.02]);
        let after = (0..n).map(|k| [wobble * ripple(k + 5), 0.018]);
        (at.clone(), before.collect(), after.collect())
    };
    let map =
        |coordinate: &str, unit: &str, step, (at, before, after): (Vec<f64>, _, _), law| Map {
            joint: "link".into(),
            coordinate: coordinate.into(),
            unit: unit.into(),
            residual_unit: "N*m".into(),
            at,
            before,
            after,
            law,
            step,
        };
    let velocity = bins(-0.4, 0.4, &stribeck, 0.02);
    let law = velocity.0.iter().map(|v| stribeck(*v)).collect();
    let angle = bins(0.0, core::f64::consts::TAU, &cogging, 0.015);
    let detent = angle.0.iter().map(|a| cogging(*a)).collect();
    vec![
        map("velocity", "rad/s", Some(0), velocity, law),
        map("motor angle", "rad", Some(1), angle, detent),
        map(
            "position",
            "rad",
            None,
            bins(-2.5, 2.5, &|q| 0.03 * q.sin(), 0.015),
            Vec::new(),
        ),
    ]
}

fn curves() -> Curves {
    let n = 4000;
    let t: Vec<f64> = (0..n).map(|k| 12.0 + k as f64 * 2e-3).collect();
    let q: Vec<f64> = t
        .iter()
        .map(|t| (0.9 * t).sin() + 0.2 * (2.3 * t).cos())
        .collect();
    let without: Vec<f64> = t
        .iter()
        .zip(&q)
        .map(|(t, q)| 2.4 * q.sin() + 0.5 * (0.9 * t).cos().signum())
        .collect();
    let with: Vec<f64> = t
        .iter()
        .zip(&without)
        .map(|(t, w)| {
            let v = 0.9 * (0.9 * t).cos();
            w + v.signum() * 0.3 * (-(v / 0.12).powi(2)).exp()
        })
        .collect();
    let measured = with
        .iter()
        .enumerate()
        .map(|(k, w)| w + 0.08 * ripple(k))
        .collect();
    let shifted = |by: f64| {
        t.iter()
            .zip(&q)
            .map(|(t, q)| q + by * (1.8 * t).sin())
            .collect::<Vec<_>>()
    };
    Curves {
        joint: "link".into(),
        recording: "holdout.csv".into(),
        torque: [measured, without, with],
        motion: [q.clone(), shifted(4e-3), shifted(6e-4)],
        t,
    }
}

fn steps() -> Vec<Step> {
    vec![
        Step {
            effect: "stribeck".into(),
            law: None,
            joint: "link".into(),
            set: vec!["stribeck".into()],
            parameters: BTreeMap::from([
                ("breakaway".into(), value(0.3127, 0.0093, "N*m")),
                ("velocity".into(), value(0.0812, 0.0031, "rad/s")),
            ]),
            p_value: 1e-30,
            name_probability: f64::NAN,
            runner_up: Some("presliding".into()),
            runner_up_gap_closed: Some(0.12),
            rms_unit: "N*m".into(),
            train_rms: [0.214, 0.096],
            holdout_rms: Some([0.224, 0.099]),
            motion_rms: Some([4.1e-3, 9.7e-4]),
            gap_closed: 0.722,
            why: "Its law, fitted on three quarters of the training data, takes 52 % off the residual of the rest, 14 standard deviations of that gain.".into(),
        },
        Step {
            effect: "cogging".into(),
            law: None,
            joint: "link".into(),
            set: vec!["cogging".into(), "torque_ripple".into()],
            parameters: BTreeMap::from([
                ("sine".into(), value(0.0641, 0.0052, "N*m")),
                ("cosine".into(), value(-0.0893, 0.0049, "N*m")),
            ]),
            p_value: 4e-9,
            name_probability: f64::NAN,
            runner_up: Some("gear_eccentricity".into()),
            runner_up_gap_closed: Some(0.31),
            rms_unit: "N*m".into(),
            train_rms: [0.096, 0.055],
            holdout_rms: Some([0.099, 0.056]),
            motion_rms: Some([9.7e-4, 6.1e-4]),
            gap_closed: 0.249,
            why: "The residual repeats with every seventh of a motor turn, at both speeds at which the motor was seen.".into(),
        },
    ]
}

/// Two effects found, the name of the second open.
pub(super) fn explained() -> Diagnosis {
    Diagnosis {
        noise_floor_rms: vec![0.051],
        noise_floor_how: "From the two runs of the same motion in train.csv: half the variance of their difference.".into(),
        places: vec![
            place("velocity", [-0.1, 0.1], "rad/s", 0.63, "63 % of the excess lies below 0.1 rad/s, odd in velocity, the same at every position and load."),
            place("motor angle", [0.0, core::f64::consts::TAU], "rad", 0.21, "21 % of the excess repeats seven times per motor turn."),
        ],
        steps: steps(),
        gap_closed: Some(0.971),
        absorbed: vec![
            Absorbed { parameter: "fv1".into(), unit: "N*m*s/rad".into(), before: 0.268, after: 0.3447, sigmas: 14.2 },
            Absorbed { parameter: "fc1".into(), unit: "N*m".into(), before: 0.4931, after: 0.4602, sigmas: -8.1 },
            Absorbed { parameter: "Izz1 + Ia1".into(), unit: "kg*m^2".into(), before: 0.11769, after: 0.11757, sigmas: -0.9 },
        ],
        absorbed_before: Before::WithoutEffects,
        by_motion: Some(ByMotion {
            unit: "rad".into(),
            motion_rms: [1.12e-4, 1.08e-4],
            torque_unit: "N*m".into(),
            torque_rms: [0.0981, 0.0983],
            adopted: false,
            parameters: vec![
                Twice { parameter: "Izz1 + Ia1".into(), unit: "kg*m^2".into(), torque: 0.11757, torque_std: 2.1e-4, motion: 0.11739, motion_std: 1.2e-4, sigmas: 0.7 },
                Twice { parameter: "stribeck.breakaway".into(), unit: "N*m".into(), torque: 0.312, torque_std: 0.011, motion: 0.321, motion_std: 0.006, sigmas: 0.7 },
            ],
            text: "Fitted once more, all 6 parameters together, to the simulated motion of the training data, the model departs from it by 0.108 mrad RMS instead of 0.112; the torque's values stand. The two agree within 0.70 of their standard deviations.".into(),
        }),
        not_testable: vec![
            NotTestable { effect: "load_friction".into(), joint: "link".into(), why: "one payload only, and gravity changes too little".into(), experiment: "the same motion with two payloads".into() },
            NotTestable { effect: "viscous_warmup".into(), joint: "link".into(), why: "48 s of running time and no temperature".into(), experiment: "the same motion for ten minutes, the first and the last minute recorded".into() },
        ],
        detectable: vec![
            Detectable { effect: "backlash".into(), joint: "link".into(), parameter: "width".into(), size: 2.1e-3, size_at_worst: None, unit: "rad".into() },
            Detectable { effect: "asymmetric_coulomb".into(), joint: "link".into(), parameter: "asymmetry".into(), size: 0.012, size_at_worst: Some(0.02), unit: "N*m".into() },
        ],
        next_experiment: Some(NextExperiment {
            kind: ExperimentKind::PayloadSwap,
            separates: vec!["cogging".into(), "torque_ripple".into()],
            text: "Turn slowly through the top and through the side, so that the motor passes the same angles at two currents: ripple grows with the current, cogging does not.".into(),
            file: Some("next_experiment.toml".into()),
            separation: Some(7.4),
            duration: Some(24.0),
            hands: false,
            trajectory: None,
        }),
        waterfall: vec![waterfall(
            &["frozen description", "refitted", "stribeck", "cogging"],
            &[0.402, 0.214, 0.096, 0.055],
            &[0.431, 0.224, 0.099, 0.056],
        )],
        tried: vec![
            tried(0, "stribeck", 0.521, 14.1, 1e-30, ""),
            tried(0, "presliding", 0.094, 5.2, 2e-5, "stribeck takes away more, by 9 standard deviations of the difference"),
            tried(0, "quadratic_drag", -0.002, -0.3, 1.0, "no gain on stretches it was not fitted to"),
            tried(1, "cogging", 0.412, 9.8, 4e-9, ""),
            tried(1, "torque_ripple", 0.408, 9.6, 6e-9, "explains the data as well as cogging; kept in the set"),
            tried(1, "gear_eccentricity", 0.127, 4.4, 8e-4, "cogging takes away more, by 6 standard deviations of the difference"),
            tried(2, "spring", 0.004, 1.1, 1.0, "chance explains it"),
        ],
        maps: maps(),
        curves: vec![curves()],
        ..empty(
            Verdict::Explained,
            &[
                "Stribeck friction and cogging at joint link close 97 % of the gap on the hold-out.",
                "Cogging and torque ripple cannot be told apart with these data; the next experiment would do it.",
            ],
        )
    }
}

/// The model is right as it is.
pub(super) fn nothing_missing() -> Diagnosis {
    Diagnosis {
        noise_floor_rms: vec![0.051],
        noise_floor_how: "From the residual's own spectrum: there are no repeated runs.".into(),
        detectable: explained().detectable,
        waterfall: vec![waterfall(
            &["frozen description", "refitted"],
            &[0.058, 0.052],
            &[],
        )],
        tried: vec![tried(0, "stribeck", 0.003, 1.2, 0.9, "chance explains it")],
        ..empty(
            Verdict::NothingMissing,
            &["The residual of joint link is 1.02 times the noise floor."],
        )
    }
}

/// A payload that nobody mentioned.
pub(super) fn parameter_change() -> Diagnosis {
    let mut step = steps().remove(0);
    step.effect = "payload".into();
    step.gap_closed = 0.99;
    step.set = vec!["payload".into()];
    step.parameters = BTreeMap::from([("mass".into(), value(0.412, 0.006, "kg"))]);
    step.why =
        "Inertia and gravity have grown together, in the ratio of a mass at the link's end.".into();
    step.runner_up = None;
    step.runner_up_gap_closed = None;
    Diagnosis {
        noise_floor_rms: vec![0.051],
        steps: vec![step],
        gap_closed: Some(0.99),
        waterfall: vec![waterfall(
            &["frozen description", "refitted", "payload"],
            &[1.93, 0.053, 0.053],
            &[1.88, 0.054, 0.054],
        )],
        ..empty(
            Verdict::ParameterChange,
            &["A payload of 0.412 kg hangs on the link that the description does not have."],
        )
    }
}

/// One effect named, and something that nobody knows.
pub(super) fn remainder() -> Diagnosis {
    let mut found = explained();
    found.steps.truncate(1);
    found.maps.retain(|m| m.step != Some(1));
    found.next_experiment = Some(NextExperiment {
        kind: ExperimentKind::NotTestableYet,
        separates: vec!["gear_eccentricity".into()],
        text: "Turn the link on its spline by 90° and repeat the motion: what belongs to the gear moves with it.".into(),
        file: None,
        separation: None,
        duration: None,
        hands: true,
        trajectory: None,
    });
    Diagnosis {
        verdict: Verdict::Remainder,
        words: vec!["Stribeck friction closes 72 % of the gap; what is left repeats with the position and has no name here.".into()],
        gap_closed: Some(0.722),
        remainder: Some(Remainder {
            joint: "link".into(),
            unit: "N*m".into(),
            rms: 0.084,
            ratio: 1.94,
            places: vec![place("position", [0.9, 1.6], "rad", 0.58, "58 % of it lies between 0.9 and 1.6 rad, in both directions.")],
            text: "A torque that depends on the position alone and is sharper than any effect of the catalogue.".into(),
            doubt: false,
        }),
        waterfall: vec![waterfall(
            &["frozen description", "refitted", "stribeck"],
            &[0.402, 0.214, 0.096],
            &[0.431, 0.224, 0.099],
        )],
        ..found
    }
}

/// A recording with a sign error.
pub(super) fn data_fault() -> Diagnosis {
    Diagnosis {
        data_faults: vec![DataFault {
            kind: FaultKind::Sign,
            about: About::Torque,
            recording: "train.csv".into(),
            joint: "link".into(),
            certain: true,
        of_description: false,
        column: None,
            text: "Over the whole recording the motor takes energy from the link that nothing puts in; the sign of i1 or of q1 is turned round.".into(),
        }],
        ..empty(Verdict::DataFault, &["train.csv says that the motor brakes whenever it should drive."])
    }
}

/// Every verdict with a name for its page.
pub(super) fn all() -> [(&'static str, Diagnosis); 5] {
    [
        ("explained", explained()),
        ("nothing-missing", nothing_missing()),
        ("parameter-change", parameter_change()),
        ("remainder", remainder()),
        ("data-fault", data_fault()),
    ]
}
