//! Settings of the identification of a load.

use rig_data::prepare::PrepareOptions;
use rig_model::robot::Load;
use serde::Serialize;

/// What the load is measured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// The wrist sensor.
    #[default]
    Sensor,
    /// The joint torques.
    Torque,
    /// Both, weighted by their uncertainty.
    Both,
}

/// A mass that is known otherwise, as by scales.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KnownMass {
    /// kg
    pub mass: f64,
    /// Its standard deviation, kg.
    pub std: f64,
}

/// Settings.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// What the load is measured by.
    pub by: By,
    /// True if every row of the recordings is a pose at rest.
    pub poses: bool,
    /// What is mounted beyond the sensor beside the load, in the flange frame: it is subtracted.
    pub tool: Option<Load>,
    /// Mass of the load as weighed; it is compared with the identified one, and enters no fit.
    pub known_mass: Option<KnownMass>,
    /// How the recordings are prepared.
    pub prepare: PrepareOptions,
    /// True to go on with the best explanation if the readings look wrong.
    pub even_if_wrong: bool,
}
