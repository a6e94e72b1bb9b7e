//! Multisines: whole periods of the reference.

use std::f64::consts::TAU;

use rig_data::Block;
use rig_plant::effect::disturbance::Disturbance;

use super::rig::{RATE, Rig, recording};
use crate::{ComplianceOptions, FrequencyResponse, identify_compliance};

/// Rows of a period.
const PERIOD: usize = 8000;

/// A multisine of the odd harmonics of 1/8 Hz from 1 to 60 Hz, every eighth one left out, with Schroeder's phases (1970) and
/// even acceleration: a sum of its own, which shares no code with the design. It rises in 1 s.
fn multisine(periods: usize, size: f64) -> impl Fn(f64) -> f64 {
    let held: Vec<usize> = (9..480).filter(|k| k % 2 == 1 && k % 16 != 11).collect();
    let count = held.len() as f64;
    let length = periods as f64 * PERIOD as f64 / RATE;
    move |t: f64| {
        let ease = |s: f64| {
            let s = s.clamp(0.0, 1.0);
            s * s * s * (10.0 + s * (6.0 * s - 15.0))
        };
        let edge = ease(t).min(ease(length + 2.0 - t));
        // Whole rows: the periods repeat to the last bit.
        let row = ((t - 1.0) * RATE).rem_euclid(PERIOD as f64);
        let row = if (row - row.round()).abs() < 1e-6 {
            row.round()
        } else {
            row
        };
        let sum: f64 = (held.iter().enumerate())
            .map(|(n, k)| {
                let omega = TAU * *k as f64 * RATE / PERIOD as f64;
                let phase = std::f64::consts::PI * (n * n) as f64 / count;
                (omega * row / RATE - phase).cos() / (omega * omega)
            })
            .sum();
        size * edge * sum
    }
}

fn identified(rig: &Rig, cut: impl Fn(Block) -> Block) -> FrequencyResponse {
    let run = cut(rig.run(42.0, multisine(5, 3.0), |_| 0.0, 1));
    let run = recording(run);
    let found = identify_compliance(&rig.robot(), &[], &[&run], &ComplianceOptions::default());
    found.unwrap().frequency.unwrap()
}

#[test]
fn the_mean_over_whole_periods_shows_the_stiffness() {
    for (stiffness, damping) in [(600.0, 0.4), (1500.0, 0.8), (3000.0, 1.0)] {
        let rig = Rig::new(stiffness, damping);
        let found = identified(&rig, |run| run);
        let periodic = found.periodic.unwrap();
        assert_eq!(
            (periodic.period, periodic.periods),
            (8.0, 4),
            "{periodic:?}"
        );
        assert_eq!(periodic.harmonics, 206);
        let off = 100.0 * (found.stiffness.value / stiffness - 1.0);
        println!("multisine, {stiffness} N·m/rad: {off:.2} % off, {periodic:?}");
        for (own, truth) in [
            (found.stiffness, stiffness),
            (found.link_inertia, 0.12),
            (found.motor_inertia, 0.05),
        ] {
            assert!((own.value / truth - 1.0).abs() < 0.05, "{own:?}, {truth}");
        }
    }
}

/// Periods need no rest at the ends: a recording that begins and ends in motion gives the same.
#[test]
fn a_recording_cut_out_of_the_motion_gives_the_same() {
    let rig = Rig::new(1500.0, 0.8);
    let whole = identified(&rig, |run| run);
    let part = identified(&rig, |mut run| {
        let rows = 3_300..run.t.len() - 2_100;
        run.t = run.t[rows.clone()].to_vec();
        let joint = &mut run.joints[0];
        joint.q = joint.q[rows.clone()].to_vec();
        joint.tau = joint.tau[rows.clone()].to_vec();
        for list in [&mut joint.reference, &mut joint.link] {
            *list = list.as_ref().map(|own| own[rows.clone()].to_vec());
        }
        run
    });
    assert_eq!(part.periodic.unwrap().periods, 3);
    let ratio = part.stiffness.value / whole.stiffness.value;
    assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
}

/// Noise shows in the difference of the periods, friction at the harmonics that are left out.
#[test]
fn noise_and_distortion_are_told_apart() {
    let mut smooth = Rig::new(1500.0, 0.8).with_plain_friction();
    smooth.config.motor.friction.coulomb = 0.0;
    smooth.config.mechanism.friction.coulomb = 0.0;
    let rough = Rig::new(1500.0, 0.8).with_plain_friction();
    let mut noisy = smooth.clone();
    noisy.config.mechanism.disturbance = Some(Disturbance {
        std: 1.0,
        correlation_time: 0.004,
    });
    let [smooth, rough, noisy] =
        [smooth, rough, noisy].map(|rig| identified(&rig, |run| run).periodic.unwrap());
    println!("{smooth:?}\n{rough:?}\n{noisy:?}");
    assert!(rough.odd.unwrap() > 5.0 * smooth.odd.unwrap());
    assert!(rough.odd.unwrap() > 3.0 * rough.noise && rough.odd > rough.even);
    assert!(noisy.noise > 5.0 * smooth.noise);
    // Without distortion the other harmonics hold the noise alone.
    let ratio = noisy.odd.unwrap() / noisy.noise;
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
}

/// A gap that is large against the twist: the mean over the periods is that of a softer spring, but it repeats what no model of two
/// masses explains. With more motion the gap is found.
#[test]
fn a_gap_that_distorts_every_period_is_refused() {
    let with = |gap: f64, size: f64| {
        let mut rig = Rig::new(1200.0, 0.6).with_plain_friction().with_gap(gap);
        rig.config.motor.friction.coulomb *= 0.25;
        rig.config.mechanism.friction.coulomb *= 0.25;
        let run = recording(rig.run(42.0, multisine(5, size), |_| 0.0, 1));
        identify_compliance(&rig.robot(), &[], &[&run], &ComplianceOptions::default())
    };
    let said = with(2e-3, 1.0).unwrap_err().to_string();
    println!("{said}");
    assert!(
        said.contains("repeats in every period") && said.contains("chirp"),
        "{said}"
    );
    let found = with(1e-3, 3.0).unwrap().frequency.unwrap();
    let off = found.stiffness.value / 1200.0 - 1.0;
    assert!(off.abs() < 0.05, "{off}");
    let gap = found.backlash.unwrap();
    assert!((gap / 1e-3 - 1.0).abs() < 0.35, "{gap}");
}
