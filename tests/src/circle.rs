//! The whole circle: a rig with something hidden in it, recorded, diagnosed, told what was found, and measured again.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use clap::Parser as _;
use rig::commands::Cli;
use rig_link::RecordedRun;
use rig_link::{Port, Session};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
use rig_plant::PlantConfig;
use rig_plant::effect::cogging::Cogging;
use rig_plant::emulated::upload::requests;
use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::{FrictionSweep, SlowReversals, Trajectory};
use rig_shared::wire::message::RequestBody;
use serde_json::Value;

use crate::excitation;

/// Cogging of 0.3 N·m at the joint, twelve periods a motor turn.
pub const HIDDEN: Cogging = Cogging {
    amplitude: 0.006,
    order: 12.0,
    phase: 0.7,
};

/// This rig with cogging and, so that it is all that a description lacks, friction of the standard model alone.
pub fn with_cogging(mut plant: PlantConfig) -> PlantConfig {
    let ratio = plant.mechanism.ratio;
    for (friction, scale) in [
        (&mut plant.motor.friction, ratio),
        (&mut plant.mechanism.friction, 1.0),
    ] {
        friction.weakening = None;
        friction.asymmetry = 0.0;
        // Below a count of the encoder.
        friction.presliding.stroke = 2e-5 * scale;
    }
    plant.motor.cogging = Some(HIDDEN);
    // The description's: an error in it scales every torque alike, and no motion shows it.
    plant.motor.torque_constant = 0.05;
    plant
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Circle {
    /// `diagnosis.json`.
    pub diagnosis: Value,
    /// The uploaded effects.
    pub effects: Vec<Effect<f32>>,
    /// RMS tracking error of slow reversals with the description, with its model found again but no effects, and with all
    /// that was found, rad; friction precompensated.
    pub tracking: [f64; 3],
}

impl Circle {
    /// The diagnosis has named the cogging and its size, and the rig follows better for it: with the description's own
    /// model 0.8 to 3.3 mrad were seen, as far as the rig is from it, with the model found again 0.6 to 0.9, with the
    /// effects 0.12 to 0.2.
    pub fn assert_closed(&self) {
        let [described, refitted, all] = self.tracking.map(|rms| 1e3 * rms);
        println!(
            "slow reversals: {described:.3} mrad RMS by the description, {refitted:.3} without the effects, {all:.3} with them"
        );
        let diagnosis = &self.diagnosis;
        // No motion was recorded twice: the floor is that of the torque's reading, above which some of the rig's friction stays.
        let verdict = diagnosis["verdict"].as_str().unwrap();
        assert!(["explained", "remainder"].contains(&verdict), "{diagnosis}");
        let closed = diagnosis["gap_closed"].as_f64().unwrap();
        assert!(closed > 0.85, "{closed}");
        let steps = diagnosis["steps"].as_array().unwrap();
        let cogging = steps.iter().find(|step| step["effect"] == "cogging");
        let parameters = &cogging.unwrap()["parameters"];
        let value = |name: &str| parameters[name]["value"].as_f64().unwrap();
        assert!((value("order") - HIDDEN.order).abs() < 0.01, "{parameters}");
        let amplitude = value("cosine").hypot(value("sine"));
        assert!(
            (amplitude - 50.0 * HIDDEN.amplitude).abs() < 0.03,
            "{parameters}"
        );
        let kinds: Vec<Kind> = self.effects.iter().map(|effect| effect.kind).collect();
        assert!(kinds.contains(&Kind::Cogging), "{kinds:?}");
        assert!(all < 0.5 * refitted && all < 0.5 * described);
    }
}

/// Goes round once on a rig that knows where its link hangs. Files go to `folder`.
pub fn go_round<P: Port>(line: &mut Session<P>, folder: &Path) -> Circle {
    let robot = folder.join("robot.toml");
    std::fs::write(&robot, ONE_LINK_TEMPLATE).unwrap();
    let sweep = FrictionSweep::new(&[0.1, 0.2, 0.5], 0.4, 0.1, 0.3, 1.0).unwrap();
    let slow = SlowReversals::new(0.1, 0.1, &[0.15, 0.1], 1).unwrap();
    let motions = [
        ("train-1.csv", excitation(60, 5, 2).to_f64()),
        ("train-2.csv", Trajectory::FrictionSweep(sweep)),
        ("holdout-1.csv", excitation(61, 5, 1).to_f64()),
        ("holdout-2.csv", Trajectory::SlowReversals(slow)),
    ];
    let paths: Vec<PathBuf> = motions
        .iter()
        .map(|(name, motion)| {
            let path = folder.join(name);
            RecordedRun::record(line, vec![], motion, 0.2, &path).unwrap();
            path
        })
        .collect();
    let found = folder.join("found");
    let mut arguments = vec!["rig".into(), "diagnose".into(), "--robot".into()];
    arguments.push(robot.clone().into_os_string());
    for (path, (name, _)) in paths.iter().zip(&motions) {
        let role = if name.starts_with("train") {
            "--data"
        } else {
            "--holdout"
        };
        arguments.extend([role.into(), path.clone().into_os_string()]);
    }
    arguments.extend(["--out".into(), found.clone().into_os_string()]);
    Cli::parse_from(arguments).run().unwrap();
    let diagnosis = std::fs::read_to_string(found.join("diagnosis.json")).unwrap();

    let reversals = Trajectory::SlowReversals(SlowReversals::new(0.05, 0.1, &[0.1], 1).unwrap());
    let mut tracking = |told: Vec<RequestBody>| {
        let path = folder.join("reversals.csv");
        RecordedRun::record(line, told, &reversals, 0.2, &path)
            .unwrap()
            .tracking_rms()
    };
    let model = Robot::load(&found.join("model.toml")).unwrap();
    let all = requests(&model, false).unwrap().requests;
    let bare: Vec<RequestBody> = all
        .iter()
        .filter(|body| !matches!(body, RequestBody::SetEffects(_)))
        .cloned()
        .collect();
    let effects = all.iter().find_map(|body| match body {
        RequestBody::SetEffects(effects) => Some(effects.to_vec()),
        _ => None,
    });
    let described = requests(&Robot::load(&robot).unwrap(), false)
        .unwrap()
        .requests;
    Circle {
        diagnosis: serde_json::from_str(&diagnosis).unwrap(),
        effects: effects.unwrap(),
        tracking: [described, bare, all].map(&mut tracking),
    }
}
