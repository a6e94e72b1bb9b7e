//! Arms with a fault drawn by a seed.
//!
//! Sizes are log-uniform over ranges seen in laboratories, relative to friction or drive inertia of the joint.

use super::arm::{Arm, ArmScenario, OF_LIMIT, limits_of};
use super::dice::Dice;
use super::error::ScenarioError;
use super::fault::Fault;

/// Purpose of the draws of the first fault; others follow.
const DRAW: u64 = 50;
/// Payload per torque limit of the last joint, kg/(N·m): the Stäubli TX40 carries 2 kg at its flange.
const CARRIES: f64 = 2.0 / 30.7;

/// Faults that a seed draws, by name.
const FAULTS: [&str; 9] = [
    "stribeck",
    "asymmetric_coulomb",
    "gear_eccentricity",
    "load_friction",
    "inertia_coupling",
    "viscous_coupling",
    "gravity_tilt",
    "payload",
    "joint_offset",
];

impl Arm {
    /// All arms with their names.
    pub const ALL: [(&'static str, Self); 3] = [
        ("planar", Self::Planar),
        ("upright", Self::Upright),
        ("six", Self::Six),
    ];

    /// Names of the faults that the recordings of the arm show.
    pub fn faults(self) -> Vec<&'static str> {
        let hidden: &[&str] = match self {
            // The arm has no gear, and gravity does not act in its plane.
            Self::Planar => &["gear_eccentricity", "load_friction", "joint_offset"],
            // A tilt of the base about a horizontal axis changes the torque only in second order.
            Self::Upright => &["gravity_tilt"],
            Self::Six => &[],
        };
        let shown = FAULTS.iter().filter(|fault| !hidden.contains(fault));
        shown.copied().collect()
    }
}

impl ArmScenario {
    /// Draws an arm with the named fault of [`Arm::faults`], or without a fault.
    ///
    /// # Errors
    /// [`ScenarioError`] if the arm shows no fault of that name.
    pub fn drawn(arm: Arm, fault: Option<&str>, seed: u64) -> Result<Self, ScenarioError> {
        let Some(name) = fault else {
            return Ok(Self::new(arm, None, seed));
        };
        let faults = arm.faults();
        let unknown = || {
            ScenarioError(format!(
                "this arm shows no fault called \"{name}\"; choose from {}",
                faults.join(", ")
            ))
        };
        let place = (faults.iter().position(|f| *f == name)).ok_or_else(unknown)?;
        let mut dice = Dice::new(seed, DRAW + place as u64);
        let limits = limits_of(arm)?;
        let n = limits.len();
        let any = dice.index(n);
        // A joint that has a preceding joint.
        let behind = 1 + dice.index(n - 1);
        let [coulomb, viscous, inertia] = OF_LIMIT;
        let coulomb = coulomb * limits[any];
        let (joint, fault) = match name {
            "stribeck" => {
                let torque = coulomb * dice.log_uniform([0.2, 1.5]);
                (
                    any,
                    Fault::Stribeck([torque, dice.log_uniform([0.03, 0.3])]),
                )
            }
            "asymmetric_coulomb" => {
                let more = coulomb * dice.log_uniform([0.1, 0.8]);
                (any, Fault::AsymmetricCoulomb(more))
            }
            "gear_eccentricity" => {
                let wave = coulomb * dice.log_uniform([0.1, 0.6]);
                (any, Fault::GearEccentricity([wave, dice.phase()]))
            }
            "load_friction" => (any, Fault::LoadFriction(dice.log_uniform([0.02, 0.15]))),
            "inertia_coupling" => {
                let share = dice.log_uniform([0.2, 2.0]);
                (
                    behind,
                    Fault::InertiaCoupling(share * inertia * limits[behind]),
                )
            }
            "viscous_coupling" => {
                let share = dice.log_uniform([0.2, 2.0]);
                (
                    behind,
                    Fault::ViscousCoupling(share * viscous * limits[behind]),
                )
            }
            "gravity_tilt" => {
                let mut angle = || dice.sign() * dice.log_uniform([0.01, 0.1]);
                (0, Fault::GravityTilt([angle(), angle()]))
            }
            "payload" => {
                let mass = CARRIES * limits[n - 1] * dice.log_uniform([0.05, 1.0]);
                (n - 1, Fault::Payload([mass, 0.02, 0.0, 0.05]))
            }
            "joint_offset" => {
                let error = dice.sign() * dice.log_uniform([0.005, 0.1]);
                (any, Fault::JointOffset(error))
            }
            _ => return Err(unknown()),
        };
        Ok(Self::new(arm, Some((joint, fault)), seed))
    }
}
