//! The stiffness from the frequency response of the emulated rig.

use std::f64::consts::TAU;

use rig_data::prepare::Recording;

use rig_plant::effect::disturbance::Disturbance;

use super::rig::{Rig, chirp, recording};
use crate::frequency::{bands, spectra};
use crate::signals::read;
use crate::{Band, Compliance, ComplianceError, ComplianceOptions, identify_compliance};

fn identify(
    rig: &Rig,
    run: impl Fn(u64) -> rig_data::Block,
    seeds: &[u64],
    by_reference: Option<bool>,
) -> Result<Compliance, ComplianceError> {
    let runs: Vec<_> = seeds.iter().map(|seed| recording(run(*seed))).collect();
    let list: Vec<&dyn Recording> = runs.iter().map(|r| r as &dyn Recording).collect();
    let options = ComplianceOptions {
        by_reference,
        ..ComplianceOptions::default()
    };
    identify_compliance(&rig.robot(), &[], &list, &options)
}

/// Friction (with presliding and weakening), noise of the current and counts of the encoder are those of the documentation's
/// rig.
#[test]
fn a_chirp_shows_the_stiffness_within_five_per_cent() {
    for (stiffness, damping) in [(600.0, 0.4), (1500.0, 0.8), (3000.0, 1.0)] {
        let rig = Rig::new(stiffness, damping);
        let run = |seed| rig.run(30.0, chirp(30.0, [1.0, 60.0], 1.2, 0.0), |_| 0.0, seed);
        let found = identify(&rig, run, &[1], None).unwrap();
        let response = found.frequency.unwrap();
        assert!(response.whole && response.by_reference);
        let off = 100.0 * (response.stiffness.value / stiffness - 1.0);
        println!("chirp, {stiffness} N·m/rad: {off:.2} % off");
        for (own, truth) in [
            (response.stiffness, stiffness),
            (response.stiffness_by_description.unwrap(), stiffness),
            (response.link_inertia, 0.12),
            (response.motor_inertia, 0.05),
        ] {
            assert!((own.value / truth - 1.0).abs() < 0.05, "{own:?}, {truth}");
        }
    }
}

#[test]
fn plain_friction_is_split_between_motor_and_link_and_the_intervals_cover() {
    let (stiffness, seeds) = (1500.0, 60);
    let mut rig = Rig::new(stiffness, 0.8).with_plain_friction();
    rig.config.sensors.current.noise = Some(0.1);
    rig.config.sensors.encoder.counts_per_turn = 4096.0;
    rig.config.mechanism.disturbance = Some(Disturbance {
        std: 0.05,
        correlation_time: 0.05,
    });
    let (mut covered, mut sum) = (0, 0.0);
    for seed in 0..seeds {
        let run = |seed| rig.run(16.0, chirp(16.0, [2.0, 60.0], 1.5, 0.0), |_| 0.0, seed);
        let response = identify(&rig, run, &[seed], None)
            .unwrap()
            .frequency
            .unwrap();
        let [low, high] = response.stiffness.interval();
        covered += usize::from(low <= stiffness && stiffness <= high);
        sum += response.stiffness.value;
    }
    println!(
        "chirps: {covered} of {seeds} intervals cover; mean {:.2}",
        sum / seeds as f64
    );
    assert!(covered as f64 > 0.85 * seeds as f64, "{covered} of {seeds}");
}

/// A disturbance on the link, which the position loop answers with torque: torque and velocity are then related by the
/// controller too, and the plain estimate S_τv/S_ττ takes that for the robot. The truth is the solution of both equations of
/// motion with the numbers of the rig.
#[test]
fn the_reference_as_instrument_avoids_the_bias_of_feedback() {
    let mut rig = Rig::new(1500.0, 0.8).with_plain_friction();
    rig.bandwidth = 20.0;
    // Linear: a disturbance that shakes the joint changes what Coulomb friction does on average.
    rig.config.motor.friction.coulomb = 0.0;
    rig.config.mechanism.friction.coulomb = 0.0;
    let bands_of = |rig: &Rig, by_reference: bool| -> Vec<Band> {
        let run = |seed| {
            let chirp = chirp(40.0, [2.0, 60.0], 1.0, 0.0);
            recording(rig.run(40.0, chirp, |_| 0.0, seed))
        };
        let runs: Vec<_> = (1..=4).map(run).collect();
        let list: Vec<&dyn Recording> = runs.iter().map(|r| r as &dyn Recording).collect();
        let found = spectra(&read(&list).unwrap(), 0, "link", Some(by_reference)).unwrap();
        bands(&found).into_iter().map(|b| b.band).collect()
    };
    let truth = |frequency: f64| {
        let s = nalgebra::Complex::new(0.0, TAU * frequency);
        let spring = s * 0.8 + 1500.0;
        let motor = s * s * 0.05 + s * 0.1 + spring;
        let link = s * s * 0.12 + s * 0.2 + spring + 2.943;
        s * link / (motor * link - spring * spring)
    };
    rig.config.mechanism.disturbance = Some(Disturbance {
        std: 1.5,
        correlation_time: 0.004,
    });
    let outside = |by_reference| {
        let polar = |b: &Band| nalgebra::Complex::from_polar(b.magnitude, b.phase);
        let found = bands_of(&rig, by_reference);
        let used: Vec<&Band> = (found.iter())
            .filter(|b| b.used && (3.0..50.0).contains(&b.frequency))
            .collect();
        let off = |b: &&&Band| (polar(b) - truth(b.frequency)).norm() > b.radius;
        used.iter().filter(off).count() as f64 / used.len() as f64
    };
    let (fair, biased) = (outside(true), outside(false));
    println!(
        "feedback: truth outside of the 95 % circle in {fair:.2} of the bands by the reference, {biased:.2} by the torque"
    );
    assert!(fair < 0.2 && biased > 0.5, "{fair}, {biased}");
}

#[test]
fn what_a_recording_does_not_show_is_refused_in_words() {
    let rig = Rig::new(1500.0, 0.8);
    let said = |rig: &Rig, run: &dyn Fn(u64) -> rig_data::Block| {
        identify(rig, run, &[1], None).unwrap_err().to_string()
    };
    // Held still: the encoder may change by a count, and noise is not coherent.
    let still = said(&rig, &|seed| rig.run(10.0, |t| 1e-6 * t, |_| 0.0, seed));
    assert!(still.contains("does not move"), "{still}");
    let slow = said(&rig, &|seed| {
        rig.run(20.0, chirp(20.0, [0.5, 5.0], 1.0, 0.0), |_| 0.0, seed)
    });
    assert!(slow.contains("no antiresonance"), "{slow}");
    let mut rigid = rig.clone();
    rigid.config.mechanism.elasticity = None;
    let stiff = said(&rigid, &|seed| {
        rigid.run(20.0, chirp(20.0, [1.0, 40.0], 1.0, 0.0), |_| 0.0, seed)
    });
    assert!(
        stiff.contains("no antiresonance") || stiff.contains("No model"),
        "{stiff}"
    );
    let torqueless = said(&rig, &|seed| {
        let mut block = rig.run(5.0, chirp(5.0, [1.0, 40.0], 1.0, 0.0), |_| 0.0, seed);
        block.joints[0].tau.clear();
        block
    });
    assert!(torqueless.contains("no torque"), "{torqueless}");
}

#[test]
fn a_saturated_torque_is_told() {
    let rig = Rig::new(1500.0, 0.8).with_plain_friction();
    let cut = |share: f64| {
        let run = |seed| {
            let mut block = rig.run(20.0, chirp(20.0, [2.0, 60.0], 1.5, 0.0), |_| 0.0, seed);
            let tau = &mut block.joints[0].tau;
            let mut sizes: Vec<f64> = tau.iter().map(|t| t.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            let most = sizes[((1.0 - share) * sizes.len() as f64) as usize];
            tau.iter_mut().for_each(|t| *t = t.clamp(-most, most));
            block
        };
        identify(&rig, run, &[1], None)
    };
    let warnings = cut(0.03).unwrap().warnings;
    assert!(
        warnings.iter().any(|w| w.contains("saturates")),
        "{warnings:?}"
    );
    let refused = cut(0.3).unwrap_err().to_string();
    assert!(refused.contains("saturates"), "{refused}");
}

/// A loading and a response of different gears have no mean.
#[test]
fn measurements_that_contradict_each_other_are_not_averaged() {
    let (soft, stiff) = (Rig::new(1500.0, 0.8), Rig::new(2500.0, 0.8));
    let slow = recording(soft.run(30.0, |t| 1.4 * (0.6 * t).sin(), |_| 0.0, 1));
    let chirp = chirp(30.0, [1.0, 60.0], 1.2, 0.0);
    let lively = recording(stiff.run(30.0, chirp, |_| 0.0, 2));
    let options = ComplianceOptions::default();
    let found = identify_compliance(&soft.robot(), &[&slow], &[&lively], &options).unwrap();
    let kept = found.drives[0].stiffness.unwrap();
    assert!((kept.value / 1500.0 - 1.0).abs() < 0.05, "{kept:?}");
    assert!(found.warnings.iter().any(|w| w.contains("contradict")));
    let again = recording(soft.run(
        30.0,
        super::rig::chirp(30.0, [1.0, 60.0], 1.2, 0.0),
        |_| 0.0,
        3,
    ));
    let found = identify_compliance(&soft.robot(), &[&slow], &[&again], &options).unwrap();
    assert_eq!(found.drives[0].source, crate::Source::Both);
    assert!(!found.warnings.iter().any(|w| w.contains("contradict")));
}

/// A chirp as [`sampled`] gives it, at 1 kHz, of a torque that is held from row to row.
fn two_masses(end: f64, size: f64, seed: u64) -> rig_data::prepare::InMemory {
    sampled([end, size], seed, 10, true)
}

/// A chirp from 1 to `end` Hz of a position loop on two masses, by steps of 0.1 ms: an integration of its own. The
/// antiresonance is √(900/0.12)/2π = 13.8 Hz. A row is recorded in every `every`-th step; the torque is `held` from row to
/// row, or changes with every step.
fn sampled(
    [end, size]: [f64; 2],
    seed: u64,
    every: usize,
    held: bool,
) -> rig_data::prepare::InMemory {
    use core::f64::consts::{FRAC_PI_2, PI, TAU};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::rand_core::SeedableRng;
    let mut dice = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let mut normal = move |std: f64| {
        let value: f64 = StandardNormal.sample(&mut dice);
        std * value
    };
    let (stiffness, damping, link, motor) = (900.0, 0.4, 0.12, 0.05);
    let (step, length) = (1e-4, 30.0);
    let loop_speed = TAU * 6.0;
    let (kp, kd) = (
        loop_speed * loop_speed * (link + motor),
        1.6 * loop_speed * (link + motor),
    );
    let weight = 0.3 * 9.81;
    let (mut qm, mut ql, mut vm, mut vl) = (-FRAC_PI_2, -FRAC_PI_2, 0.0_f64, 0.0_f64);
    let (mut phase, mut torque) = (0.0_f64, 0.0);
    let mut block = rig_data::Block {
        joints: vec![rig_data::JointColumns::default()],
        first_line: 2,
        ..rig_data::Block::default()
    };
    let joint = &mut block.joints[0];
    for k in 0..((length + 2.0) / step) as usize {
        let t = k as f64 * step;
        let share = ((t - 1.0) / length).clamp(0.0, 1.0);
        if t > 1.0 && t < length + 1.0 {
            phase += TAU * end.powf(share) * step;
        }
        let ease = (PI * (10.0 * share).min(10.0 * (1.0 - share)).min(0.5)).sin();
        let reference = -FRAC_PI_2 + size * ease * phase.sin();
        if k % every == 0 || !held {
            torque = kp * (reference - qm) - kd * vm + weight * reference.cos();
        }
        if k % every == 0 {
            block.t.push(t);
            joint.q.push(qm + normal(1e-5));
            joint.tau.push(torque + normal(0.05));
            joint.reference.get_or_insert_default().push(reference);
        }
        let spring = stiffness * (qm - ql) + damping * (vm - vl);
        vm += step * (torque - spring - 0.1 * (vm / 1e-3).tanh() - 0.15 * vm) / motor;
        vl += step * (spring - weight * ql.cos() - 0.02 * (vl / 1e-3).tanh() - 0.05 * vl) / link;
        qm += step * vm;
        ql += step * vl;
    }
    rig_data::prepare::InMemory {
        label: "chirp".into(),
        blocks: vec![block],
    }
}

/// A controller of 125 or 250 Hz holds its torque for a ninth or an eighteenth of a period of the antiresonance.
#[test]
fn a_torque_that_is_held_from_row_to_row_is_told_from_one_of_each_instant() {
    let robot = rig_model::robot::Robot::from_toml(
        rig_model::robot::ONE_LINK_TEMPLATE,
        "one-link.toml".as_ref(),
    )
    .unwrap();
    for (every, held) in [(80, true), (40, true), (40, false), (10, true)] {
        let run = sampled([45.0, 0.02], 1, every, held);
        let found =
            crate::identify_compliance(&robot, &[], &[&run], &crate::ComplianceOptions::default());
        let response = found.unwrap().frequency.unwrap();
        println!(
            "{every} {held}: {:?} {:?}",
            response.stiffness, response.motor_inertia
        );
        if every > 10 {
            assert_eq!(response.held, held, "{every}");
        }
        for (own, truth) in [
            (response.stiffness, 900.0),
            (response.link_inertia, 0.12),
            (response.motor_inertia, 0.05),
        ] {
            let off = own.value / truth - 1.0;
            assert!(off.abs() < 0.01, "{every} {held}: {own:?}, {truth}");
        }
    }
}

/// Bands near the resonance are coherent by noise alone; they do not show an antiresonance below them.
#[test]
fn a_band_that_ends_below_the_antiresonance_is_refused() {
    let robot = rig_model::robot::Robot::from_toml(
        rig_model::robot::ONE_LINK_TEMPLATE,
        "one-link.toml".as_ref(),
    )
    .unwrap();
    let identified = |end: f64, size: f64, seed: u64| {
        let run = two_masses(end, size, seed);
        crate::identify_compliance(&robot, &[], &[&run], &crate::ComplianceOptions::default())
    };
    for seed in 0..4 {
        for end in [8.0, 10.0] {
            let said = match identified(end, 0.02, seed) {
                Err(error) => error.to_string(),
                Ok(found) => panic!("{end} Hz, {seed}: {:?}", found.drives),
            };
            assert!(said.contains("shows no antiresonance"), "{said}");
        }
    }
    let found = identified(45.0, 0.02, 1).unwrap().drives[0]
        .stiffness
        .unwrap();
    assert!((found.value / 900.0 - 1.0).abs() < 0.01, "{found:?}");
}

/// Without a gap no backlash is told, and with a wrong scale of the torque neither.
#[test]
fn a_wrong_scale_of_the_torque_is_no_backlash() {
    let rig = Rig::new(1500.0, 0.8);
    for (scale, told) in [(1.0, false), (0.7, true)] {
        let own = |seed| {
            let mut block = rig.run(30.0, chirp(30.0, [1.0, 60.0], 1.2, 0.0), |_| 0.0, seed);
            block.joints[0].tau.iter_mut().for_each(|tau| *tau *= scale);
            block
        };
        let found = identify(&rig, own, &[1], None).unwrap();
        let warnings = found.warnings.join(" ");
        let told_gap = ["shows backlash", "Backlash"].map(|words| warnings.contains(words));
        assert_eq!(told_gap, [false; 2], "{warnings}");
        assert_eq!(warnings.contains("scale"), told, "{warnings}");
    }
}

/// A gap softens the response, so that a linear fit is 15 to 60 % too soft here. The contact of the emulated rig is
/// integrated with steps of its own.
#[test]
fn a_gap_is_found_beside_the_stiffness_or_makes_it_a_lower_bound() {
    let stiffness = 1500.0;
    for gap in [3e-4, 1e-3, 5e-3] {
        let rig = Rig::new(stiffness, 0.8).with_plain_friction().with_gap(gap);
        let run = |seed| rig.run(30.0, chirp(30.0, [1.0, 60.0], 1.2, 0.0), |_| 0.0, seed);
        let found = identify(&rig, run, &[1], None).unwrap();
        let response = found.frequency.unwrap();
        let off = 100.0 * (response.stiffness.value / stiffness - 1.0);
        println!(
            "gap of {gap}: stiffness {off:.1} % off, gap {:?}, lower bound: {}, {:?}",
            response.backlash, response.is_lower_bound, response.warnings
        );
        let told = found.warnings.iter().any(|w| w.contains("shows backlash"));
        assert!(told, "{:?}", found.warnings);
        match response.backlash {
            Some(own) => {
                assert!(off.abs() < 5.0, "{off}");
                assert!((own / gap - 1.0).abs() < 0.25, "{own}");
            }
            None => assert!(off < 0.0, "{off}"),
        }
    }
}
