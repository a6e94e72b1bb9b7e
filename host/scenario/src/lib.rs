//! Recordings with a known gap: the emulated rig with effects hidden in it, and the description of a user who does not
//! know of them.
//!
//! The rig ([`rig_plant`]) shares no equation with the library of effects: weakening is rational, not Gaussian,
//! presliding has four elements, warming is driven by heat, and so on; step, controller and sensors lie between the truth
//! and what is recorded. Equal scenarios give equal bytes.
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

/// Run of the hold-out's repeat, beside those of training (0, 1), hold-out (2) and experiments.
const HELD_AGAIN: u64 = 6;

/// Why a scenario cannot be made.
#[derive(Debug, thiserror::Error)]
#[error("The scenario cannot be made: {0}")]
pub struct ScenarioError(pub String);

/// Which rig is recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rig {
    /// A geared link in a vertical plane.
    #[default]
    OneLink,
}

/// What is to be recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// On what.
    pub rig: Rig,
    /// What is hidden; nothing where empty.
    pub hidden: Vec<Hidden>,
    /// Of sensors and surroundings.
    pub noise: Noise,
    /// Of rig, motion and noise.
    pub seed: u64,
    /// How much the motion shows.
    pub excitation: Excitation,
    /// Length of the training and of the hold-out recording, s.
    pub seconds: [f64; 2],
    /// Whether the training reference is run twice.
    pub repeated: bool,
    /// Whether the reference held back is run twice.
    pub held_twice: bool,
    /// Relative error of the parameters in the description.
    pub description_error: f64,
    /// A torque from outside that comes in the first run only.
    pub intrusion: Option<Intrusion>,
    /// Substeps of the rig per 0.1 ms; none for what suffices.
    pub substeps: Option<u32>,
    /// Whether an encoder on the link is recorded beside the motor's.
    pub second_encoder: bool,
}

impl Scenario {
    /// 90 s of training and 60 s of hold-out, each run twice, at the middle noise level.
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

    /// The named effects in joint 0, drawn by the seed; none where a name is unknown.
    pub fn of(names: &[&str], seed: u64) -> Option<Self> {
        let hidden = names
            .iter()
            .map(|name| Effect::draw(name, 1.0, seed).map(|effect| Hidden { joint: 0, effect }));
        Some(Self::new(hidden.collect::<Option<_>>()?, seed))
    }

    /// Runs the rig.
    ///
    /// # Errors
    /// [`ScenarioError`] where a hidden effect names a joint that the rig has not.
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

    /// How large each hidden effect is by itself against the noise floor, in the order of `hidden`. Takes two more runs of
    /// the training reference and one for each effect.
    ///
    /// # Errors
    /// A motion that does not excite the nominal model.
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
        // The controller is tuned to the rig as it was before anything was hidden in it.
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

    /// The rig with all that is hidden in it.
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

    /// Seeds of runs far apart from those of the rigs.
    fn seed_of(&self, run: u64) -> u64 {
        self.seed.wrapping_mul(8).wrapping_add(run)
    }
}

fn drive_of(robot: &Robot) -> Result<&Drive, ScenarioError> {
    let drive = robot.joints.first().and_then(|j| j.drive.as_ref());
    drive.ok_or_else(|| ScenarioError("the description has no drive".into()))
}

/// J, m·g·l, fv and fc of the rig before anything was hidden in it, and its joint-side torque constant.
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

/// What is true of a scenario's recordings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// What is hidden.
    pub hidden: Vec<Hidden>,
    /// The rig's nominal parameters, SI, joint-side.
    pub nominal: BTreeMap<&'static str, f64>,
    /// Of the scenario.
    pub seed: u64,
}

impl Truth {
    /// Names of what is hidden.
    pub fn names(&self) -> Vec<&'static str> {
        self.hidden.iter().map(|h| h.effect.name()).collect()
    }
}

/// How large a hidden effect is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Size {
    /// RMS that a refit of the nominal model leaves because of it.
    pub excess_rms: f64,
    /// The same with the nominal parameters as they were before.
    pub frozen_rms: f64,
    /// RMS that a refit leaves of a recording with noise and nothing hidden.
    pub floor_rms: f64,
    /// The same without noise: what filtering and reversals leave.
    pub base_rms: f64,
    /// ASCII; volts for what shows in the voltage alone.
    pub unit: &'static str,
    /// Whether what is hidden is a change of parameters, which a refit takes up.
    pub parameter_change: bool,
}

/// What an effect has to leave after a refit, in noise floors, for it to be expected to be found.
pub const ABOVE_FLOOR: f64 = 0.5;

impl Size {
    /// Whether the effect can be expected to be found: what it leaves is at least [`ABOVE_FLOOR`] of the noise floor. A change
    /// of parameters is judged with the parameters as they were.
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
    /// What the user knows.
    pub robot: Robot,
    /// To learn from.
    pub train: InMemory,
    /// The same reference again.
    pub repeat: Option<InMemory>,
    /// To learn from besides: what was recorded since.
    pub further: Vec<InMemory>,
    /// … with everything taken off that pulls on the rig from outside.
    pub unburdened: Vec<InMemory>,
    /// The rig with its drive off; none unless asked for.
    pub drive_off: Option<InMemory>,
    /// … and with the motor's shaft clamped.
    pub clamped: Option<InMemory>,
    /// Another reference.
    pub holdout: InMemory,
    /// The same other reference again, by which the noise of what is held back is known.
    pub held_again: Option<InMemory>,
    /// What is true.
    pub truth: Truth,
}

impl Scenario {
    /// 30 s of training run twice and 20 s of hold-out once, with these effects in joint 0.
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
    /// Gives `take` the recordings to learn from and those held out, with the repeats where there are any and what was recorded
    /// since.
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
    /// What the system says.
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
