//! Tests of the recordings.
#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;
use crate::size::{Equation, Problem};
use rig_data::Block;
use rig_model::robot::Robot;

#[test]
#[ignore = "prints a measurement"]
fn sizes_of_the_effects() {
    let start = std::time::Instant::now();
    Scenario::of(&[], 1).unwrap().make().unwrap();
    println!("240 s recorded in {:.2} s", start.elapsed().as_secs_f64());
    for name in Effect::names() {
        for seed in 1..=3 {
            let scenario = Scenario::of(&[name], seed).unwrap();
            let size = scenario.sizes().unwrap()[0];
            println!(
                "{name:22} {:.4} {:.4} floor {:.4} base {:.4} {} {:?}",
                size.excess_rms,
                size.frozen_rms,
                size.floor_rms,
                size.base_rms,
                size.above_floor(),
                scenario.hidden[0].effect
            );
        }
    }
}

fn short(hidden: &[&str], seed: u64) -> Scenario {
    Scenario {
        seconds: [30.0, 20.0],
        ..Scenario::of(hidden, seed).unwrap()
    }
}

#[test]
fn equal_scenarios_give_equal_recordings_and_runs_differ_by_noise_alone() {
    let [a, b] = [0, 1].map(|_| short(&["stribeck"], 4).make().unwrap());
    assert_eq!(a.train.blocks, b.train.blocks);
    assert_eq!(a.robot, b.robot);
    let (first, again) = (&a.train.blocks[0], &a.repeat.unwrap().blocks[0]);
    assert_eq!(first.joints[0].reference, again.joints[0].reference);
    assert_ne!(first.joints[0].tau, again.joints[0].tau);
    assert_ne!(
        a.holdout.blocks[0].joints[0].reference,
        first.joints[0].reference
    );
}

#[test]
fn the_loop_follows_and_the_description_explains_a_healthy_rig() {
    for seed in 1..=5 {
        let made = short(&[], seed).make().unwrap();
        let joint = &made.train.blocks[0].joints[0];
        let reference = joint.reference.as_ref().unwrap();
        let off = joint.q.iter().zip(reference).map(|(q, r)| (q - r).powi(2));
        let rms = (off.sum::<f64>() / joint.q.len() as f64).sqrt();
        assert!(rms < 0.01, "seed {seed}: {rms} rad");
        // A refit of the nominal model must recover the rig's parameters.
        let found = Problem::of(&made.train.blocks[0], Equation::Torque)
            .unwrap()
            .refit()
            .unwrap();
        let truth = ["inertia", "gravity", "viscous", "coulomb"].map(|n| made.truth.nominal[n]);
        for (k, truth) in truth.iter().enumerate() {
            let error = (found[k] - truth).abs() / truth;
            assert!(
                error < 0.05,
                "seed {seed}, parameter {k}: {} for {truth}",
                found[k]
            );
        }
    }
}

#[test]
fn every_effect_leaves_its_mark_and_two_substeps_suffice() {
    // Strong effects, so that each one must be visible in the recording.
    for name in Effect::names() {
        let effect = Effect::draw(name, 2.0, 9).unwrap();
        let with = |substeps| Scenario {
            substeps: Some(substeps),
            ..Scenario {
                hidden: vec![Hidden { joint: 0, effect }],
                ..short(&[], 9)
            }
        };
        let [coarse, fine] = [2, 10].map(|s| with(s).sizes().unwrap()[0]);
        let mark = |size: &Size| size.excess_rms.max(size.frozen_rms);
        assert!(mark(&coarse) > 0.003, "{name}: {coarse:?}");
        // Impacts differ between step sizes, but their size agrees.
        let allowed = 0.05 * mark(&fine) + 0.1 * fine.floor_rms;
        assert!(
            (mark(&coarse) - mark(&fine)).abs() < allowed,
            "{name}: {coarse:?} {fine:?}"
        );
    }
}

#[test]
fn an_unknown_name_and_a_missing_joint_are_refused() {
    assert!(Scenario::of(&["rust"], 1).is_none());
    let mut scenario = short(&["spring"], 1);
    scenario.hidden[0].joint = 1;
    let error = scenario.make().unwrap_err().to_string();
    assert!(
        error.contains("spring") && error.contains("joint 1"),
        "{error}"
    );
}

#[test]
fn what_is_written_reads_back() {
    let made = Scenario {
        seconds: [20.0, 20.0],
        ..short(&["cogging"], 2)
    }
    .make()
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    made.write(folder.path()).unwrap();
    let robot = Robot::load(&folder.path().join("robot.toml")).unwrap();
    assert_eq!(robot, made.robot);
    let source = rig_data::Source::open(&folder.path().join("train.csv"), &robot).unwrap();
    let blocks: Vec<Block> = source.blocks(1 << 20).map(Result::unwrap).collect();
    assert_eq!(blocks.len(), 1);
    assert_eq!(blocks[0].joints, made.train.blocks[0].joints);
}

#[test]
fn random_phases_keep_the_spectrum_and_lose_the_motion() {
    let scenario = short(&["gear_eccentricity"], 5);
    let made = scenario.make().unwrap();
    let left = |block: &Block| {
        let problem = Problem::of(block, Equation::Torque).unwrap();
        let model = problem.explained(block).unwrap();
        let tau = &block.joints[0].tau;
        tau.iter()
            .zip(model)
            .map(|(t, m)| t - m)
            .collect::<Vec<f64>>()
    };
    let before = left(&made.train.blocks[0]);
    let surrogate = made.phase_randomised(5).unwrap();
    let after = left(&surrogate.train.blocks[0]);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (power, kept) = (dot(&before, &before), dot(&after, &after));
    assert!((kept / power - 1.0).abs() < 0.02, "{}", kept / power);
    let likeness = dot(&before, &after) / (power * kept).sqrt();
    assert!(likeness.abs() < 0.1, "{likeness}");
    assert!(surrogate.truth.hidden.is_empty());
}

#[test]
fn a_second_encoder_changes_nothing_but_what_is_recorded() {
    let plain = short(&["joint_elasticity"], 6);
    let seen = Scenario {
        second_encoder: true,
        ..plain.clone()
    };
    let (plain, mut seen) = (plain.make().unwrap(), seen.make().unwrap());
    let folder = tempfile::tempdir().unwrap();
    seen.write(folder.path()).unwrap();
    let read = rig_data::Source::open(&folder.path().join("train.csv"), &seen.robot).unwrap();
    let (blocks, _) = read.read_all().unwrap();
    let own = seen.train.blocks[0].joints[0].link.take().unwrap();
    assert_eq!(blocks[0].joints[0].link.as_ref(), Some(&own));
    assert_eq!(plain.train.blocks, seen.train.blocks);
    // 17-bit counts with another zero; the shaft twists by some milliradians.
    let count = core::f64::consts::TAU / 131_072.0;
    let off = (own.iter()).fold(0.0f64, |m, x| {
        m.max(
            (x / count - 0.5)
                .rem_euclid(1.0)
                .min(1.0 - (x / count - 0.5).rem_euclid(1.0)),
        )
    });
    assert!(off < 1e-6, "{off}");
    let q = &seen.train.blocks[0].joints[0].q;
    let apart: Vec<f64> = q.iter().zip(&own).map(|(q, l)| q - l).collect();
    let mean = apart.iter().sum::<f64>() / apart.len() as f64;
    let most = apart.iter().fold(0.0f64, |m, x| m.max((x - mean).abs()));
    assert!(
        (0.19..0.21).contains(&mean) && most > 1e-3 && most < 0.05,
        "{mean} {most}"
    );
}
