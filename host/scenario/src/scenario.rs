//! Settings of a scenario, and its recordings.

use std::collections::BTreeMap;

use super::error::ScenarioError;
use super::hidden::{Effect, Hidden};
use super::made::{Made, Truth};
use super::record::{Intrusion, Manner, Nominal, record};
use super::reference::{self, Excitation};
use super::rig::{self, Noise, Rig};
use super::size::{Equation, Problem, Size, beyond};
use rig_data::Block;
use rig_data::prepare::InMemory;
use rig_model::robot::{Drive, Robot};
use rig_plant::PlantConfig;

/// Number of the run that repeats the hold-out. Training has 0 and 1, hold-out 2; experiments use the numbers between.
const HELD_AGAIN: u64 = 6;

/// Settings of the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Kind of rig.
    pub rig: Rig,
    /// Hidden effects; empty for a rig without hidden effects.
    pub hidden: Vec<Hidden>,
    /// Noise of sensors and disturbance torque.
    pub noise: Noise,
    /// Seed of rig, motion and noise.
    pub seed: u64,
    /// Kind of excitation.
    pub excitation: Excitation,
    /// Length of the training and of the hold-out recording, s.
    pub seconds: [f64; 2],
    /// True if the training motion is recorded twice.
    pub repeated: bool,
    /// True if the hold-out motion is recorded twice.
    pub held_twice: bool,
    /// Relative error of the parameters in the description.
    pub description_error: f64,
    /// Disturbance torque in the first run only.
    pub intrusion: Option<Intrusion>,
    /// Integration substeps of the rig per 0.1 ms; none for the default.
    pub substeps: Option<u32>,
    /// True if an encoder on the link is recorded beside that of the motor.
    pub second_encoder: bool,
}

impl Scenario {
    /// Returns the standard scenario: 90 s of training and 60 s of hold-out, both recorded twice, with medium noise.
    pub fn new(hidden: Vec<Hidden>, seed: u64) -> Self {
        Self {
            rig: Rig::OneLink,
            hidden,
            noise: Noise::MEDIUM,
            seed,
            excitation: Excitation::Full,
            seconds: [90.0, 60.0],
            repeated: true,
            held_twice: true,
            description_error: 0.0,
            intrusion: None,
            substeps: None,
            second_encoder: false,
        }
    }

    /// Draws the named effects with the seed and hides them in joint 0; none if a name is unknown.
    pub fn of(names: &[&str], seed: u64) -> Option<Self> {
        let hidden = names
            .iter()
            .map(|name| Effect::draw(name, 1.0, seed).map(|effect| Hidden { joint: 0, effect }));
        Some(Self::new(hidden.collect::<Option<_>>()?, seed))
    }

    /// Returns a short scenario: 30 s of training (twice) and 20 s of hold-out (once), with `effects` in joint 0.
    pub fn short(effects: impl IntoIterator<Item = Effect>, seed: u64) -> Self {
        let hidden = effects
            .into_iter()
            .map(|effect| Hidden { joint: 0, effect });
        Self {
            seconds: [30.0, 20.0],
            held_twice: false,
            ..Self::new(hidden.collect(), seed)
        }
    }

    /// Runs the rig.
    ///
    /// # Errors
    /// [`ScenarioError`] if a hidden effect names a joint that the rig does not have.
    pub fn make(&self) -> Result<Made, ScenarioError> {
        let Rig::OneLink = self.rig;
        if let Some(beyond) = self.hidden.iter().find(|h| h.joint > 0) {
            return Err(ScenarioError(format!(
                "{} is hidden in joint {}, but the rig has one joint; give 0",
                beyond.effect.name(),
                beyond.joint
            )));
        }
        let healthy = rig::healthy(self.seed, &self.noise);
        let robot = rig::description(&healthy, self.description_error, self.seed)?;
        let [seconds, later] = self.seconds;
        let motion = reference::reference(self.excitation, seconds, self.seed, 2);
        let other = reference::reference(self.excitation, later, self.seed, 3);
        let recording = |label: &str, motion: &[f64], run: u64| {
            self.run(&healthy, &robot, motion, run, Manner::Driven)
                .map(|block| InMemory {
                    label: label.into(),
                    blocks: vec![block],
                })
        };
        Ok(Made {
            train: recording("train", &motion, 0)?,
            repeat: if self.repeated {
                Some(recording("repeat", &motion, 1)?)
            } else {
                None
            },
            further: Vec::new(),
            unburdened: Vec::new(),
            drive_off: None,
            clamped: None,
            holdout: recording("holdout", &other, 2)?,
            held_again: if self.held_twice {
                Some(recording("holdout-again", &other, HELD_AGAIN)?)
            } else {
                None
            },
            truth: Truth {
                hidden: self.hidden.clone(),
                nominal: nominal_parameters(&healthy),
                seed: self.seed,
            },
            robot,
        })
    }

    /// Measures each hidden effect alone against the noise floor, in the order of `hidden`. Simulates the training
    /// motion twice and once more for each effect.
    ///
    /// # Errors
    /// The motion does not excite the nominal model.
    pub fn sizes(&self) -> Result<Vec<Size>, ScenarioError> {
        let healthy = rig::healthy(self.seed, &self.noise);
        let robot = rig::description(&healthy, 0.0, self.seed)?;
        let motion = reference::reference(self.excitation, self.seconds[0], self.seed, 2);
        let quiet = rig::healthy(self.seed, &Noise::NONE);
        let recorded = |hidden: &[Hidden], config: &PlantConfig| {
            let scenario = Self {
                hidden: hidden.to_vec(),
                intrusion: None,
                ..self.clone()
            };
            scenario.run(config, &robot, &motion, 0, Manner::Driven)
        };
        let noisy = recorded(&[], &healthy)?;
        let without = recorded(&[], &quiet)?;
        let size = |hidden: &Hidden| {
            let (equation, unit) = match hidden.effect {
                Effect::DriveDeadzone { .. } => (Equation::Voltage, "V"),
                _ => (Equation::Torque, "N*m"),
            };
            let noisy = Problem::of(&noisy, equation)?;
            let without = Problem::of(&without, equation)?;
            let with = Problem::of(&recorded(&[*hidden], &quiet)?, equation)?;
            let known = without.refit()?;
            let base = without.rms(&known);
            Ok(Size {
                excess_rms: beyond(with.rms(&with.refit()?), base),
                frozen_rms: beyond(with.rms(&known), base),
                floor_rms: noisy.rms(&noisy.refit()?),
                base_rms: base,
                unit,
                parameter_change: matches!(hidden.effect, Effect::Payload { .. }),
            })
        };
        self.hidden.iter().map(size).collect()
    }

    /// Records a motion on the rig with its hidden effects; `run` is the number of the run.
    pub(super) fn run(
        &self,
        healthy: &PlantConfig,
        robot: &Robot,
        motion: &[f64],
        run: u64,
        manner: Manner,
    ) -> Result<Block, ScenarioError> {
        // The controller is tuned to the rig without hidden effects.
        let equivalent = healthy.equivalent();
        let config = self.hiding(healthy);
        let nominal = Nominal {
            inertia: equivalent.inertia,
            gravity: equivalent.gravity_cos.hypot(equivalent.gravity_sin),
        };
        let intrusion = self.intrusion.filter(|_| run == 0);
        let seed = self.seed_of(run);
        Ok(record(
            config,
            drive_of(robot)?,
            nominal,
            motion,
            seed,
            intrusion,
            manner,
        ))
    }

    /// Returns the rig with its hidden effects.
    pub(super) fn hiding(&self, healthy: &PlantConfig) -> PlantConfig {
        let mut config = healthy.clone();
        if let Some(substeps) = self.substeps {
            config.substeps = substeps;
        }
        config.sensors.link_encoder = self.second_encoder.then_some(rig::LINK_ENCODER);
        for hidden in &self.hidden {
            hidden.effect.hide(&mut config);
        }
        config
    }

    /// Seed of a run.
    pub(super) fn seed_of(&self, run: u64) -> u64 {
        self.seed.wrapping_mul(8).wrapping_add(run)
    }
}

pub(super) fn drive_of(robot: &Robot) -> Result<&Drive, ScenarioError> {
    let drive = robot.joints.first().and_then(|j| j.drive.as_ref());
    drive.ok_or_else(|| ScenarioError("the description has no drive".into()))
}

/// J, m·g·l, fv and fc of the rig without hidden effects, and its joint-side torque constant.
fn nominal_parameters(config: &PlantConfig) -> BTreeMap<&'static str, f64> {
    let e = config.equivalent();
    BTreeMap::from([
        ("inertia", e.inertia),
        ("gravity", e.gravity_cos.hypot(e.gravity_sin)),
        ("viscous", e.viscous),
        ("coulomb", e.coulomb),
        (
            "torque_constant",
            config.motor.torque_constant * config.mechanism.ratio,
        ),
    ])
}
