//! The emulated rig that replaces hardware: motor, bridge, gear, link, friction and sensors. It turns a
//! [`Command`](rig_firmware::sample::Command) per control tick into the raw [`Sample`](rig_firmware::sample::Sample) of
//! the next.
//!
//! It has a richer description than the identified model and shares no equation with it. It uses masses and centres of
//! mass instead of lumped parameters, and friction with memory and another form of velocity weakening. Its winding has
//! inductance, and its bridge can be open-circuit.
//!
//! On by default: winding R–L with back-EMF, mean-voltage bridge, free-wheeling diodes, one-period command delay of
//! preloaded PWM; generalised Maxwell-slip friction on rotor and link (Lampaert, Al-Bender & Swevers 2003) over a
//! rational weakening curve (Hess & Soom 1990); rigid bodies by the parallel-axis theorem; winding temperature; end
//! stops; wrapping encoder counter, 12-bit converters with noise and offset.
//!
//! Optional, one block of parameters each ([`effect`]): cogging, torque ripple, torque saturation, winding temperature
//! coefficients, dead time, supply resistance, joint elasticity with hardening (Spong 1987), backlash (Nordin & Gutman
//! 2002), gear eccentricity, asymmetric, load- and position-dependent friction, quadratic drag, friction warm-up
//! (Bittencourt & Gunnarsson 2012), cable spring, base tilt, torque offset, coloured disturbance, encoder eccentricity
//! and unequal lines, sensor lag and delay. [`Faults`] can be injected while it runs.
//!
//! Integration: leapfrog. Positions and asperity deflections are computed at the middle of a substep, speeds and
//! current at its ends. Winding, viscous friction and asperity damping are integrated together with the motion by the
//! implicit midpoint rule, so electrical, kinetic and frictional energies balance exactly. The remaining error is the
//! second-order error of the conservative torques (Hairer, Lubich & Wanner 2006, ch. I and VI).
//!
//! ```
//! use rig_firmware::sample::Command;
//! use rig_plant::{Plant, PlantConfig};
//!
//! let mut plant = Plant::new(PlantConfig::laboratory(1), 1);
//! let sample = plant.advance(Command::default());
//! println!("{sample:?}");
//! ```
//!
//! Not modelled: the three phases and their commutation (one equivalent winding), current ripple within a PWM period,
//! iron loss, strengthening of friction with dwell time, kinematic error of the gear, flexibility of link and base,
//! missed encoder counts, jitter of the sampling instant.

mod body;
mod config;
pub mod effect;
pub mod emulated;
mod fault;
mod friction;
mod integrate;
mod plant;
mod random;
mod sensors;
mod truth;

#[cfg(test)]
mod tests;

pub use body::Body;
pub use config::{
    Bridge, Channel, Encoder, Equivalent, Hardware, LinkEncoder, Mechanism, Motor, PlantConfig,
    Sensors,
};
pub use fault::Faults;
pub use friction::{Friction, Presliding, VelocityWeakening};
pub use plant::Plant;
pub use sensors::stream;
pub use truth::{Energy, Truth};
