//! Viscous friction that falls as friction heats the joint.

use super::about::{About, Channel, Direction, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use super::viscous_warmup_time::ViscousWarmupTime;
use crate::scalar::Real;

pub(super) struct ViscousWarmupHeat;

impl Law for ViscousWarmupHeat {
    const ABOUT: About = About {
        name: "viscous_warmup",
        law: Some("heat"),
        title: "viscous friction that falls as its own heat warms the joint",
        equation: "−drop · w · q̇, time_constant · dw/dt = friction · q̇ − w",
        source: "Bittencourt and Gunnarsson 2012; one thermal mass, heated by the joint's friction",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "drop",
            unit: "N*m*s/(rad*W)",
            bounds: [0.0, f64::INFINITY],
            range: [0.005, 1.0],
            scale: Scale::Logarithmic,
            meaning: "viscous friction cold less warm, per watt of friction that is kept up",
        }],
        shapes: &[Parameter {
            name: "time_constant",
            unit: "s",
            bounds: [f64::MIN_POSITIVE, f64::INFINITY],
            range: [10.0, 3600.0],
            scale: Scale::Logarithmic,
            meaning: "time after which 63 % of the fall has happened at an even speed",
        }],
        signature: "odd in velocity, growing with it, fading over minutes, faster where the joint moves faster",
        confused: ViscousWarmupTime::ABOUT.confused,
        needs: ViscousWarmupTime::ABOUT.needs,
        compensable: true,
        leaves_out: "heat of the motor and of other effects' friction, Coulomb friction that falls with temperature too, viscous friction that falls less the warmer it is, what the joint did before the recording and in its gaps, where it counts as cold and as at rest; that `friction` falls as well",
    };

    #[inline(always)]
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS] {
        // Implicit Euler: any step is stable. The increment below the last digit of a 24-bit number is kept for later
        // steps.
        let share = at.period / (shapes[0] + at.period);
        let [warm, rest, ..] = *memory;
        let more = (at.friction * at.velocity - warm) * share + rest;
        let next = warm + more;
        (memory[0], memory[1]) = (next, more - (next - warm));
        [-(at.velocity * next), T::ZERO, T::ZERO, T::ZERO]
    }

    fn after_pause<T: Real>(shapes: &[T; SHAPES], memory: &mut [T; MEMORY], seconds: T) {
        let [warm, rest, ..] = *memory;
        *memory = [T::ZERO; MEMORY];
        memory[0] = (warm + rest) * (-(seconds / shapes[0])).exp();
    }
}
