//! Codes, noise and faults.

#![allow(clippy::unwrap_used)]

use rig_shared::safety::monitor::Breaks;
use rig_shared::units::AdcCode;

use super::{OFF, Plant, PlantConfig, drive, horizontal, run, shake};
use crate::effect::disturbance::Disturbance;
use crate::effect::encoder_eccentricity::EncoderEccentricity;

#[test]
fn counter_wraps_and_floors() {
    let mut config = horizontal(PlantConfig::default());
    config.mechanism.end_stops = None;
    let mut plant = Plant::new(config, 1);
    let mut wraps = 0;
    let mut last = 0_u16;
    for _ in 0..40_000 {
        let sample = plant.advance(drive(-0.3));
        let count = ((plant.truth().motor_position + 50.0 * core::f64::consts::FRAC_PI_2)
            / core::f64::consts::TAU
            * 8192.0)
            .floor() as i64;
        assert_eq!(i64::from(sample.encoder.0), count.rem_euclid(65536));
        wraps += u32::from(sample.encoder.0 > last && sample.encoder.0 - last > 32768);
        last = sample.encoder.0;
    }
    assert!(wraps > 5, "{wraps}");
}

#[test]
fn eccentric_encoder_errs_once_a_turn() {
    let mut config = horizontal(PlantConfig::default());
    config.sensors.encoder.eccentricity = Some(EncoderEccentricity {
        amplitude: 0.005,
        phase: 0.0,
    });
    config.initial_position = config.sensors.encoder.zero + core::f64::consts::FRAC_PI_2 / 50.0;
    let sample = Plant::new(config, 1).advance(OFF);
    // A quarter turn of the motor and 5 mrad.
    assert_eq!(
        sample.encoder.0,
        (2048.0 + 0.005 / core::f64::consts::TAU * 8192.0_f64).floor() as u16
    );
}

#[test]
fn current_channel_has_its_offset_and_noise() {
    let mut plant = Plant::new(PlantConfig::default(), 7);
    let scaling = plant.config().sensors.scaling;
    let count = 20_000;
    let readings: Vec<f64> = (0..count)
        .map(|_| {
            let code = plant.advance(OFF).current;
            (f64::from(code.0) - f64::from(scaling.current_zero))
                * f64::from(scaling.current_per_code)
        })
        .collect();
    let mean = readings.iter().sum::<f64>() / f64::from(count);
    let variance = readings.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(count);
    let lsb = f64::from(scaling.current_per_code);
    assert!((mean - 0.03).abs() < 1.0e-3, "{mean}");
    assert!(
        (variance.sqrt() - (0.02_f64.powi(2) + lsb * lsb / 12.0).sqrt()).abs() < 5.0e-4,
        "{}",
        variance.sqrt()
    );
}

#[test]
fn same_seed_same_samples_other_seed_other() {
    let samples = |seed| {
        let mut plant = Plant::new(PlantConfig::random(3), seed);
        (0..5000)
            .map(|k| plant.advance(drive(shake(f64::from(k) * 1.0e-4))))
            .collect::<Vec<_>>()
    };
    assert_eq!(samples(1), samples(1));
    assert_ne!(samples(1), samples(2));
    assert_ne!(PlantConfig::random(1), PlantConfig::random(2));
}

#[test]
fn one_noise_off_leaves_the_others() {
    let samples = |quiet: bool| {
        let mut config = PlantConfig::default();
        if quiet {
            config.sensors.current.noise = None;
            config.mechanism.disturbance = None;
        } else {
            config.mechanism.disturbance = Some(Disturbance {
                std: 1.0e-6,
                correlation_time: 0.05,
            });
        }
        let mut plant = Plant::new(config, 5);
        (0..2000)
            .map(|_| plant.advance(OFF))
            .map(|s| (s.supply, s.temperature))
            .collect::<Vec<_>>()
    };
    assert_eq!(samples(true), samples(false));
}

#[test]
fn sensor_delay_is_whole_ticks() {
    let mut config = PlantConfig::default();
    config.sensors.current.noise = None;
    let codes = |delay| {
        let mut plant = Plant::new(
            PlantConfig {
                sensors: crate::Sensors {
                    current_delay: delay,
                    ..config.sensors
                },
                ..config.clone()
            },
            1,
        );
        (0..300)
            .map(|k| plant.advance(drive(shake(f64::from(k) * 1.0e-4))).current)
            .collect::<Vec<_>>()
    };
    let (prompt, late) = (codes(None), codes(Some(20)));
    assert_eq!(prompt[..280], late[20..]);
}

#[test]
fn disturbance_has_its_size_and_colour() {
    let block = Disturbance {
        std: 0.03,
        correlation_time: 0.05,
    };
    let mut config = horizontal(super::frictionless(PlantConfig::default()));
    config.mechanism.disturbance = Some(block);
    config.mechanism.end_stops = None;
    let mut plant = Plant::new(config, 11);
    let mut torques = Vec::new();
    for _ in 0..400_000 {
        plant.advance(OFF);
        torques.push(plant.truth().acceleration * 0.17);
    }
    let power = torques.iter().map(|t| t * t).sum::<f64>() / torques.len() as f64;
    let lagged =
        torques.windows(501).map(|w| w[0] * w[500]).sum::<f64>() / (torques.len() - 500) as f64;
    assert!((power.sqrt() / 0.03 - 1.0).abs() < 0.1, "{}", power.sqrt());
    assert!(
        (lagged / power - (-1.0_f64).exp()).abs() < 0.1,
        "{}",
        lagged / power
    );
}

#[test]
fn faults_do_what_they_say() {
    let mut plant = Plant::new(PlantConfig::default(), 1);
    run(&mut plant, 0.2, |_| 0.1, |_| {});
    let before = plant.advance(drive(0.1));
    plant.faults_mut().encoder_cut = true;
    for _ in 0..500 {
        assert_eq!(plant.advance(drive(0.1)).encoder, before.encoder);
    }
    plant.faults_mut().encoder_cut = false;
    let honest = plant.clone().advance(drive(0.1)).encoder.0;
    assert_ne!(honest, before.encoder.0, "it had moved all the while");
    plant.faults_mut().encoder_jump = -300;
    assert_eq!(
        plant.clone().advance(drive(0.1)).encoder.0,
        honest.wrapping_sub(300)
    );
    plant.faults_mut().current_stuck = Some(4095);
    plant.faults_mut().supply = Some(9.0);
    plant.faults_mut().driver = true;
    let sample = plant.advance(drive(0.1));
    assert!(sample.breaks == Breaks::DRIVER && sample.current == AdcCode(4095));
    let supply =
        f64::from(sample.supply.0) * f64::from(plant.config().sensors.scaling.supply_per_code);
    assert!((supply - 9.0).abs() < 0.1, "{supply}");
    for _ in 0..20 {
        plant.advance(drive(0.1));
    }
    assert_eq!(
        plant.truth().current,
        0.0,
        "the driver's outputs are off whatever is ordered"
    );
}

/// The link encoder reads only the link, in counts from its own zero, and changes no other signal.
#[test]
fn an_encoder_on_the_link_reads_the_link() {
    let mut config = PlantConfig::default();
    config.mechanism.backlash = Some(crate::effect::transmission::Backlash {
        gap: 0.01,
        stiffness: 3000.0,
        damping: 2.0,
    });
    let step = core::f64::consts::TAU / 4096.0;
    let with = |noise| {
        let mut config = config.clone();
        config.sensors.link_encoder = Some(crate::LinkEncoder {
            counts_per_turn: 4096.0,
            zero: 0.5,
            noise,
            eccentricity: None,
        });
        config
    };
    let (mut plain, mut read) = (Plant::new(config.clone(), 1), Plant::new(with(None), 1));
    let mut noisy = Plant::new(with(Some(5.0 * step)), 1);
    assert_eq!(plain.link_angle(), None);
    let (mut apart, mut off) = (0.0f64, 0.0f64);
    for k in 0..3000 {
        let command = drive(shake(f64::from(k) * 1.0e-4));
        let sample = plain.advance(command);
        assert_eq!(sample, read.advance(command));
        noisy.advance(command);
        let truth = read.truth();
        let angle = read.link_angle().unwrap();
        assert!((angle + 0.5 - truth.position).abs() <= 0.5001 * step);
        apart = apart.max((truth.motor_position / 50.0 - truth.position).abs());
        off = off.max((noisy.link_angle().unwrap() + 0.5 - truth.position).abs());
    }
    assert!(apart > 0.004, "{apart}");
    assert!(off > 5.0 * step && off < 30.0 * step, "{off}");
}
