//! Physics of the emulated rig.

mod electrical;
mod energy;
mod friction;
mod mechanics;
mod sensors;
mod speed;

use rig_firmware::sample::Command;
use rig_shared::units::Duty;

use super::{Friction, Plant, PlantConfig, Truth};

/// Returns the command for the bridge on at a mean terminal voltage of `duty` times the supply.
fn drive(duty: f64) -> Command {
    Command {
        duty: Duty(duty as f32),
        bridge: true,
    }
}

const OFF: Command = Command {
    duty: Duty(0.0),
    bridge: false,
};

/// Removes friction and noise.
fn frictionless(mut config: PlantConfig) -> PlantConfig {
    for friction in [&mut config.motor.friction, &mut config.mechanism.friction] {
        *friction = Friction {
            coulomb: 0.0,
            viscous: 0.0,
            asymmetry: 0.0,
            ..*friction
        };
    }
    config
}

/// Removes gravity from the axis, so that the link stays where friction holds it.
fn horizontal(mut config: PlantConfig) -> PlantConfig {
    config.mechanism.gravity = [0.0, -9.81, 0.0];
    config
}

/// Runs `seconds` with a voltage as a function of time and reports every tick.
fn run(plant: &mut Plant, seconds: f64, duty: impl Fn(f64) -> f64, mut each: impl FnMut(&Truth)) {
    let tick = plant.config().tick;
    for _ in 0..(seconds / tick).round() as usize {
        let time = plant.truth().time;
        plant.advance(drive(duty(time)));
        each(&plant.truth());
    }
}

/// Hard motion with many reversals, some of them slow.
fn shake(time: f64) -> f64 {
    0.25 * (2.0 * time).sin() + 0.2 * (9.1 * time).sin() + 0.1 * (31.0 * time).sin()
}
