//! Recordings with a known gap: an emulated rig with hidden effects and a description without them.
//!
//! The rig ([`rig_plant`]) shares no equation with the library of effects: velocity weakening is rational instead of
//! Gaussian, presliding has four elements, heat drives the warm-up, and so on. The recordings also contain the
//! influence of integration step, controller and sensors. Equal scenarios give equal bytes.
//!
//! ```no_run
//! use rig_scenario::Scenario;
//!
//! let made = Scenario::of(&["stribeck"], 1).unwrap().make().unwrap();
//! made.write("recordings".as_ref()).unwrap();
//! ```

mod arm;
mod catalogue;
mod dice;
mod drawn;
mod fault;
mod hidden;
mod proposed;
mod record;
mod reference;
mod rig;
mod size;
mod surrogate;
#[cfg(test)]
mod tests;
mod written;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

pub use arm::{Arm, ArmRecordings, ArmScenario};
pub use fault::{CallsFor, Fault};
pub use hidden::payload;
pub use hidden::{Effect, Hidden};
pub use record::Intrusion;
pub use reference::Excitation;
pub use rig::Noise;

use record::{Manner, Nominal, record};
use rig_data::Block;
use rig_data::prepare::{InMemory, Recording, Unburdened};
use rig_model::robot::{Drive, Robot};
use rig_plant::PlantConfig;
use size::{Equation, Problem, beyond};
use written::write_all;

/// Number of the run that repeats the hold-out. Training has 0 and 1, hold-out 2; experiments use the numbers between.
const HELD_AGAIN: u64 = 6;

/// Reason why a scenario cannot be made.
#[derive(Debug, thiserror::Error)]
#[error("The scenario cannot be made: {0}")]
pub struct ScenarioError(pub String);

/// Kind of rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rig {
    /// A geared link in a vertical plane.
    #[default]
    OneLink,
}

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

    fn run(
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
    fn hiding(&self, healthy: &PlantConfig) -> PlantConfig {
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
    fn seed_of(&self, run: u64) -> u64 {
        self.seed.wrapping_mul(8).wrapping_add(run)
    }
}

fn drive_of(robot: &Robot) -> Result<&Drive, ScenarioError> {
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

/// Ground truth of a scenario's recordings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// Hidden effects.
    pub hidden: Vec<Hidden>,
    /// Nominal parameters of the rig, SI units, joint side.
    pub nominal: BTreeMap<&'static str, f64>,
    /// Seed of the scenario.
    pub seed: u64,
}

impl Truth {
    /// Names of the hidden effects.
    pub fn names(&self) -> Vec<&'static str> {
        self.hidden.iter().map(|h| h.effect.name()).collect()
    }
}

/// Size of a hidden effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Size {
    /// RMS of the part of the residual that the effect causes after a refit of the nominal model.
    pub excess_rms: f64,
    /// As `excess_rms`, with the nominal parameters from before instead of a refit.
    pub frozen_rms: f64,
    /// Noise floor: residual RMS after a refit, with noise and without the hidden effect.
    pub floor_rms: f64,
    /// As `floor_rms`, but without noise: the residual from filtering and reversals.
    pub base_rms: f64,
    /// Unit of the RMS values, ASCII; V for an effect that shows only in the voltage.
    pub unit: &'static str,
    /// True if the effect is a change of parameters, which a refit removes.
    pub parameter_change: bool,
}

/// Ratio of an effect's residual after a refit to the noise floor from which on a diagnosis should find it.
pub const ABOVE_FLOOR: f64 = 0.5;

impl Size {
    /// Returns true if a diagnosis should find the effect: its residual is at least [`ABOVE_FLOOR`] times the noise
    /// floor. For a change of parameters this is the residual without a refit.
    pub fn above_floor(&self) -> bool {
        let rms = if self.parameter_change {
            self.frozen_rms
        } else {
            self.excess_rms
        };
        rms >= ABOVE_FLOOR * self.floor_rms
    }
}

/// A scenario's recordings.
#[derive(Clone, Debug)]
pub struct Made {
    /// Description that the user has.
    pub robot: Robot,
    /// Training recording.
    pub train: InMemory,
    /// Second recording of the training motion.
    pub repeat: Option<InMemory>,
    /// Further training recordings, made later.
    pub further: Vec<InMemory>,
    /// Training recordings made after all external loads were removed.
    pub unburdened: Vec<InMemory>,
    /// Recording with the drive off; none unless requested.
    pub drive_off: Option<InMemory>,
    /// Recording with the motor's shaft clamped; none unless requested.
    pub clamped: Option<InMemory>,
    /// Hold-out recording of another motion.
    pub holdout: InMemory,
    /// Second recording of the hold-out motion, which gives its noise floor.
    pub held_again: Option<InMemory>,
    /// Ground truth.
    pub truth: Truth,
}

impl Scenario {
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
}

impl Made {
    /// Calls `take` with the training and the hold-out recordings, including repeats and later recordings.
    pub fn with_recordings<T>(
        &self,
        take: impl FnOnce(&[&dyn Recording], &[&dyn Recording]) -> T,
    ) -> T {
        let free: Vec<Unburdened> = self.unburdened.iter().map(|r| Unburdened(r)).collect();
        let training: Vec<&dyn Recording> = core::iter::once(&self.train)
            .chain(&self.repeat)
            .chain(&self.further)
            .map(|recording| recording as &dyn Recording)
            .chain(free.iter().map(|recording| recording as &dyn Recording))
            .collect();
        let held: Vec<&dyn Recording> = core::iter::once(&self.holdout)
            .chain(&self.held_again)
            .map(|recording| recording as &dyn Recording)
            .collect();
        take(&training, &held)
    }

    /// Writes `robot.toml`, `train.csv`, `repeat.csv`, `holdout.csv` and `holdout-again.csv` into a folder that exists.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ScenarioError> {
        let recordings = [
            ("train.csv", Some(&self.train)),
            ("repeat.csv", self.repeat.as_ref()),
            ("holdout.csv", Some(&self.holdout)),
            ("holdout-again.csv", self.held_again.as_ref()),
        ];
        write_all(folder, &self.robot, &recordings)
    }
}
