//! True state of the rig, for tests and plots; not available to a controller.

/// True state at the last sampling instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// s since start.
    pub time: f64,
    /// Link angle q, rad.
    pub position: f64,
    /// rad/s.
    pub velocity: f64,
    /// Link acceleration over the last substep, rad/s².
    pub acceleration: f64,
    /// Rotor angle, rad of the rotor; 0 where a rigid gear has the link at 0.
    pub motor_position: f64,
    /// rad/s of the rotor.
    pub motor_velocity: f64,
    /// A.
    pub current: f64,
    /// Mean terminal voltage over the last substep, V.
    pub voltage: f64,
    /// Supply voltage, V.
    pub supply: f64,
    /// Electromagnetic torque at the joint, N·m, over the last substep.
    pub drive_torque: f64,
    /// Friction of motor and link at the joint against positive motion, including viscous friction and drag, N·m.
    pub friction_torque: f64,
    /// Torque passed through the gear to the link, N·m.
    pub transmitted_torque: f64,
    /// Winding, °C.
    pub winding_temperature: f64,
    /// Gear and grease, °C.
    pub gear_temperature: f64,
    /// Energy balance.
    pub energy: Energy,
}

/// Energies in J. Flows are totals since the start; stores are current values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Flow out of the ideal supply (negative: fed back).
    pub supply: f64,
    /// Flow into the supply's internal resistance, the bridge and its diodes.
    pub bridge: f64,
    /// Flow into the winding's resistance.
    pub joule: f64,
    /// Flow into friction, including the energy stored in bent asperities.
    pub friction: f64,
    /// Flow into the damping of gear and end stops.
    pub contact: f64,
    /// Flow in from external, disturbing and constant torques and from an attached payload.
    pub external: f64,
    /// Store ½·L·i².
    pub magnetic: f64,
    /// Store of rotor and link.
    pub kinetic: f64,
    /// Store of gravity, spring, cogging and gear eccentricity.
    pub potential: f64,
    /// Store of gear and end stops.
    pub elastic: f64,
    /// Part of `friction` that is stored in bent asperities.
    pub asperities: f64,
}

impl Energy {
    /// Returns the sum of the stores, J (asperities are counted with friction).
    pub fn stored(&self) -> f64 {
        self.magnetic + self.kinetic + self.potential + self.elastic
    }

    /// Returns the energy that has no source since `start`, J: 0 except for the integration error.
    pub fn defect_since(&self, start: &Self) -> f64 {
        let came = |e: &Self| e.supply + e.external;
        let went = |e: &Self| e.bridge + e.joule + e.friction + e.contact;
        (self.stored() - start.stored()) + (went(self) - went(start)) - (came(self) - came(start))
    }
}
