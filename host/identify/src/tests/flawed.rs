//! Recordings with position noise that is not white: the cut-off must follow the motion, not the noise.

use super::made::{TRUTH, swing};
use super::*;
use rig_data::prepare::{PreprocessingPlan, Survey};

/// A recorder flaw, applied to the position of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flaw {
    /// White noise of this standard deviation behind a low-pass of the drive: means over 10 rows, three times.
    Filtered(f64),
    /// Rows sampled up to 0.3 ms off their time stamps.
    Jitter,
    /// An encoder of this many counts a turn.
    Counts(f64),
    /// White noise of this standard deviation.
    White(f64),
}

/// Returns means over `reach` rows on both sides.
fn smooth(x: &[f64], reach: usize) -> Vec<f64> {
    (0..x.len())
        .map(|k| {
            let part = &x[k.saturating_sub(reach)..(k + reach + 1).min(x.len())];
            part.iter().sum::<f64>() / part.len() as f64
        })
        .collect()
}

fn flawed(flaw: Flaw, seed: u64) -> InMemory {
    let mut recording = swing(seed, 30.0, false);
    let mut g = rand_pcg::Pcg64::seed_from_u64(1000 + seed);
    let mut normal = move || (0..12).map(|_| g.random::<f64>()).sum::<f64>() - 6.0;
    let q = &mut recording.blocks[0].joints[0].q;
    match flaw {
        Flaw::Filtered(sigma) => {
            let white: Vec<f64> = q.iter().map(|_| sigma * normal()).collect();
            let noise = smooth(&smooth(&smooth(&white, 5), 5), 5);
            q.iter_mut().zip(noise).for_each(|(q, e)| *q += e);
        }
        Flaw::White(sigma) => q.iter_mut().for_each(|q| *q += sigma * normal()),
        Flaw::Counts(counts) => {
            let step = std::f64::consts::TAU / counts;
            q.iter_mut().for_each(|q| *q = (*q / step).round() * step);
        }
        Flaw::Jitter => {
            let speed: Vec<f64> = (0..q.len())
                .map(|k| {
                    let (a, b) = (k.saturating_sub(1), (k + 1).min(q.len() - 1));
                    (q[b] - q[a]) / (2e-3 * (b - a) as f64)
                })
                .collect();
            // The standard deviation of a uniform distribution between -0.3 and 0.3 ms.
            let late = 0.3e-3 / 3f64.sqrt();
            (q.iter_mut().zip(speed)).for_each(|(q, v)| *q += late * normal() * v);
        }
    }
    recording
}

#[test]
fn noise_that_is_not_white_is_not_taken_for_motion() {
    let robot = pendulum();
    for (flaw, seed) in [
        (Flaw::Filtered(2e-3), 1),
        (Flaw::Filtered(1e-2), 2),
        (Flaw::Jitter, 3),
        (Flaw::Counts(4096.0), 4),
        (Flaw::Counts(1024.0), 5),
    ] {
        let recording = flawed(flaw, seed);
        let found = identify(&robot, &[&recording], &[], &Options::default()).unwrap();
        show(&format!("{flaw:?}"), &found);
        let inertia = found.details.estimate.values[2];
        assert!(
            (inertia / TRUTH[2] - 1.0).abs() < 0.03,
            "{flaw:?}: inertia {inertia}"
        );
        // The reference has three sines, the fastest of 0.84 Hz.
        let motion = found.details.treatment.motion_frequency;
        assert!(motion < 5.0, "{flaw:?}: motion up to {motion} Hz");
        let slow = found.details.treatment.speed_threshold[0];
        assert!(slow < 0.9, "{flaw:?}: rows below {slow} rad/s left out");
    }
}

/// A torque without a little more than its viscous part gives a viscous friction just below zero. That is told, though
/// it is less than five standard deviations; a sound recording has no such warning.
#[test]
fn friction_just_below_zero_is_a_warning() {
    let told = |share: f64| {
        let mut recording = swing(3, 20.0, false);
        let joint = &mut recording.blocks[0].joints[0];
        let q = joint.q.clone();
        for (k, tau) in joint.tau.iter_mut().enumerate() {
            let [before, after] = [k.saturating_sub(5), (k + 5).min(q.len() - 1)];
            let speed = (q[after] - q[before]) / (2e-3 * (after - before) as f64);
            *tau -= share * TRUTH[3] * speed;
        }
        let found = identify(&pendulum(), &[&recording], &[], &Options::default()).unwrap();
        let own = &found.base_parameters[3];
        println!("{share}: {} ± {}", own.value, own.std);
        let below = own.value < 0.0;
        let warnings = found.warnings.into_iter();
        let told: Vec<_> = warnings
            .filter(|warning| matches!(warning, Warning::BelowZero(_)))
            .collect();
        (below, told)
    };
    assert_eq!(told(0.0), (false, Vec::new()));
    let (below, list) = told(1.02);
    assert!(below && list.len() == 1, "{list:?}");
    let said = list[0].to_string();
    assert!(said.contains("below zero: fv1 of joint"), "{said}");
}

/// The first of these recordings with the spectrum's cut-off: shows the need for the choice by torque.
#[test]
fn the_spectrum_alone_takes_filtered_noise_for_motion() {
    let recording = flawed(Flaw::Filtered(1e-2), 2);
    let survey = Survey::take(&recording, 1).unwrap();
    let by_spectrum =
        PreprocessingPlan::decide(&[survey], &PrepareOptions::default(), &[None]).unwrap();
    let found = identify(&pendulum(), &[&recording], &[], &Options::default()).unwrap();
    let treatment = &found.details.treatment;
    assert_eq!(treatment.spectral_cutoff, Some(by_spectrum.cutoff));
    assert!(
        treatment.cutoff < 0.5 * by_spectrum.cutoff,
        "{} for {}",
        treatment.cutoff,
        by_spectrum.cutoff
    );
    assert!(
        found.warnings[0]
            .to_string()
            .contains("chosen by the torque"),
        "{:?}",
        found.warnings
    );
}

#[test]
fn white_noise_leaves_the_cut_off_to_the_spectrum() {
    for (sigma, seed) in [(1e-5, 1), (1e-4, 2)] {
        let recording = flawed(Flaw::White(sigma), seed);
        let survey = Survey::take(&recording, 1).unwrap();
        let by_spectrum =
            PreprocessingPlan::decide(&[survey], &PrepareOptions::default(), &[None]).unwrap();
        let found = identify(&pendulum(), &[&recording], &[], &Options::default()).unwrap();
        let treatment = &found.details.treatment;
        assert_eq!(treatment.spectral_cutoff, None);
        assert_eq!(treatment.cutoff, by_spectrum.cutoff);
        assert!(treatment.trials.len() > 8);
    }
}

/// A decimation that grows never requires more rows than there are.
#[test]
fn no_decimation_refuses_its_own_recording() {
    let recording = |rows: usize| {
        let t: Vec<f64> = (0..rows).map(|k| k as f64 * 1e-3).collect();
        // Slow: ten times its frequency would keep one row in hundreds.
        let q: Vec<f64> = t.iter().map(|t| (0.6 * t).sin()).collect();
        let tau = t.iter().map(|t| 2.0 * (0.6 * t).cos().signum()).collect();
        let joint = JointColumns {
            q,
            tau,
            ..Default::default()
        };
        InMemory {
            label: "slow".into(),
            blocks: vec![Block {
                t,
                joints: vec![joint],
                first_line: 2,
                ..Default::default()
            }],
        }
    };
    for rows in [1000, 2000, 5000, 20_000] {
        let survey = Survey::take(&recording(rows), 1).unwrap();
        let decided = PreprocessingPlan::decide(&[survey], &PrepareOptions::default(), &[None]);
        let treatment = decided.unwrap_or_else(|e| panic!("{rows} rows: {e}"));
        assert!(50 * treatment.decimation + 2 * treatment.trimmed <= rows);
    }
}
