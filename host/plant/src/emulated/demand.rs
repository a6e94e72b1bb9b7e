//! Compares the demand of a motion on the emulated rig's motor with the described motor and the rig's sensors.
//!
//! Link, friction and supply of the emulated rig do not depend on the description, so a described motor may be too
//! weak. The demand is computed from the reference motion, for a rigid rig without controller error.
//!
//! Not modelled: presliding, breakaway, disturbance, warming of the winding, inductance.

use rig_shared::trajectory::Trajectory;

use super::nameplate::Nameplate;
use crate::{Equivalent, PlantConfig};
use rig_model::robot::Robot;
use rig_output::format_significant;

/// Time step of the evaluation, s: a tenth of the fastest ramp of a trajectory.
const STEP: f64 = 1e-3;
/// Ratio of the described to the emulated link's weight or inertia above which they are different links. The emulated
/// rigs vary by factors of up to 2.2.
const OTHER_LINK: f64 = 3.0;
/// Angle between the described and the emulated weight above which the joint's zero is a different one, rad. The
/// emulated rigs' centres of mass are up to 0.3 rad off the link's axis.
const OTHER_ZERO: f64 = 0.6;

/// Largest motor values that a motion needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Demand {
    /// N·m at the joint.
    torque: f64,
    /// A.
    current: f64,
    /// Highest thermal mean (RMS) of the current, A.
    thermal: f64,
    /// V at the motor's terminals.
    voltage: f64,
}

impl Demand {
    /// Computes the demand of a motion about `start`, rad.
    fn of(plant: &PlantConfig, thermal_time: f64, motion: &Trajectory<f64>, start: f64) -> Self {
        let own = plant.equivalent();
        let constant = plant.motor.torque_constant * plant.mechanism.ratio;
        let steps = (motion.duration() / STEP).ceil() as u64;
        let (mut most, mut heat) = (Self::default(), 0.0);
        for k in 0..=steps {
            let now = motion.at(k as f64 * STEP);
            let torque = needed(&own, start + now.position, now.velocity, now.acceleration);
            let current = torque / constant;
            let voltage = plant.motor.resistance * current + constant * now.velocity;
            heat += (current * current - heat) * STEP / thermal_time;
            most.torque = most.torque.max(torque.abs());
            most.current = most.current.max(current.abs());
            most.thermal = most.thermal.max(heat.sqrt());
            most.voltage = most.voltage.max(voltage.abs());
        }
        most
    }
}

/// Returns the torque of the model with six parameters, N·m.
fn needed(own: &Equivalent, q: f64, qd: f64, qdd: f64) -> f64 {
    let dry = if qd == 0.0 { 0.0 } else { qd.signum() };
    own.inertia * qdd
        + own.gravity_cos * q.cos()
        + own.gravity_sin * q.sin()
        + own.viscous * qd
        + own.coulomb * dry
        + own.offset
}

/// Returns one sentence for each value of the motion that exceeds the described motor, the supply or the current sensor
/// of the emulated rig; empty if all suffice. The motion is relative to `start`, rad.
pub fn shortfalls(
    plant: &PlantConfig,
    nameplate: &Nameplate,
    motion: &Trajectory<f64>,
    start: f64,
) -> Vec<String> {
    let (config, limits) = (&nameplate.config, &nameplate.settings.limits);
    let need = Demand::of(plant, f64::from(config.monitor.thermal_time), motion, start);
    let number = |value: f64| format_significant(value, 3);
    let scaling = plant.sensors.scaling;
    let range = f64::from(scaling.current_zero * scaling.current_per_code);
    let mut said = Vec::new();
    let mut compare = |what: &str, value: f64, most: f64, unit: &str, limit: &str| {
        if value > most {
            said.push(format!(
                "The motion needs {what} of {} {unit}, but {limit} {} {unit}.",
                number(value),
                number(most)
            ));
        }
    };
    compare(
        "a torque",
        need.torque,
        f64::from(limits.torque),
        "N·m",
        "limits.torque of the description is",
    );
    compare(
        "a thermal mean current",
        need.thermal,
        f64::from(limits.continuous_current),
        "A",
        "the continuous rating, half of limits.torque / (gear_ratio × torque_constant), is",
    );
    compare(
        "a motor current",
        need.current,
        range,
        "A",
        "the current sensor of the emulated rig ends at",
    );
    compare(
        "a motor voltage",
        need.voltage,
        plant.bridge.supply,
        "V",
        "the supply of the emulated rig gives",
    );
    said
}

/// Returns a sentence if the described link differs from that of the emulated rig. Returns `None` if they are similar,
/// or if no link is described.
pub fn other_link(plant: &PlantConfig, nameplate: &Nameplate, robot: &Robot) -> Option<String> {
    robot.joints.first()?.inertial.as_ref()?;
    let own = plant.equivalent();
    let stated = &nameplate.settings.model;
    let of = |cos: f64, sin: f64| (cos.hypot(sin), sin.atan2(cos));
    let (weight, direction) = of(own.gravity_cos, own.gravity_sin);
    let (stated_weight, stated_direction) =
        of(f64::from(stated.gravity_cos), f64::from(stated.gravity_sin));
    let stated_inertia = f64::from(stated.inertia);
    let apart = |a: f64, b: f64| !(1.0 / OTHER_LINK..=OTHER_LINK).contains(&(a / b));
    let (s, c) = (stated_direction - direction).sin_cos();
    let other = apart(stated_weight, weight)
        || apart(stated_inertia, own.inertia)
        || s.atan2(c).abs() > OTHER_ZERO;
    let number = |value: f64| format_significant(value, 3);
    other.then(|| {
        format!(
            "The emulated rig keeps its own link, whatever the description states: its weight needs {} N·m at 0 rad and {} N·m at π/2 rad, its inertia with the rotor is {} kg·m². The description says {} N·m, {} N·m and {} kg·m².",
            number(own.gravity_cos),
            number(own.gravity_sin),
            number(own.inertia),
            number(f64::from(stated.gravity_cos)),
            number(f64::from(stated.gravity_sin)),
            number(stated_inertia)
        )
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use super::super::hardware_of;
    use super::*;
    use rig_model::robot::ONE_LINK_TEMPLATE;
    use rig_shared::trajectory::Fourier;

    fn described(change: impl Fn(&mut Robot)) -> (Robot, Nameplate, PlantConfig) {
        let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
        change(&mut robot);
        let nameplate = Nameplate::from_robot(&robot).unwrap();
        let plant = PlantConfig::laboratory_with(&hardware_of(&robot).unwrap(), 1);
        (robot, nameplate, plant)
    }

    fn swing(amplitude: f64) -> Trajectory<f64> {
        Trajectory::Fourier(Fourier {
            period_us: 3_500_000,
            periods: 5,
            ramp_us: 3_500_000,
            sine: [amplitude, 0.0, 0.0, 0.0, 0.0].into_iter().collect(),
            cosine: [0.0; 5].into_iter().collect(),
        })
    }

    #[test]
    fn the_templates_motor_is_enough_and_a_weak_one_is_told_with_numbers() {
        let start = -core::f64::consts::FRAC_PI_2;
        let (robot, nameplate, plant) = described(|_| ());
        assert_eq!(shortfalls(&plant, &nameplate, &swing(1.2), start), [""; 0]);
        assert_eq!(other_link(&plant, &nameplate, &robot), None);
        let said = |change: &dyn Fn(&mut Robot)| {
            let (_, nameplate, plant) = described(change);
            shortfalls(&plant, &nameplate, &swing(1.2), start).join(" ")
        };
        let weak = said(&|r| r.joints[0].limits.as_mut().unwrap().torque = Some(1.0));
        assert!(
            weak.contains("limits.torque of the description is 1.00 N·m"),
            "{weak}"
        );
        assert!(weak.contains("continuous rating"), "{weak}");
        let direct = said(&|r| r.joints[0].drive.as_mut().unwrap().gear_ratio = 1.0);
        assert!(
            direct.contains("current sensor of the emulated rig ends at 16.5 A"),
            "{direct}"
        );
        let slow = said(&|r| r.joints[0].drive.as_mut().unwrap().gear_ratio = 500.0);
        assert!(
            slow.contains("supply of the emulated rig gives 24.0 V"),
            "{slow}"
        );
    }

    #[test]
    fn a_link_that_cannot_be_the_emulated_one_is_said() {
        let said = |change: &dyn Fn(&mut Robot)| {
            let (robot, nameplate, plant) = described(change);
            other_link(&plant, &nameplate, &robot)
        };
        let heavy = said(&|r| {
            let own = r.joints[0].inertial.as_mut().unwrap();
            own.mass *= 10.0;
            own.first_moment[0] *= 10.0;
        });
        assert!(heavy.unwrap().contains("29.4 N·m"));
        let turned = said(&|r| {
            let own = r.joints[0].inertial.as_mut().unwrap();
            own.first_moment = [0.0, -0.3, 0.0];
        });
        assert!(turned.unwrap().contains("keeps its own link"));
        assert_eq!(said(&|r| r.joints[0].inertial = None), None);
        for seed in 0..40 {
            let (robot, nameplate, _) = described(|_| ());
            let plant = PlantConfig::laboratory(seed);
            assert_eq!(other_link(&plant, &nameplate, &robot), None, "{seed}");
        }
    }
}
