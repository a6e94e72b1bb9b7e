//! Hybrid control of position and force: some directions of the task follow a motion, the others press.
//!
//! The selection is that of Raibert & Craig (1981), the decoupling that of the operational space (Khatib 1987). Along a
//! direction that moves, a = ẍ_r + kd·(ẋ_r − ẋ) + kp·(x_r − x). Along one that presses, the measured force is taken off
//! the arm, and the error of the force asks for a speed:
//!
//! a = kv·(w − ẋ) + d, w = kf·(f_r − f) within ±the approach speed.
//!
//! On a surface of stiffness k the force obeys f̈ + kv·ḟ + kv·kf·k·f = kv·kf·k·f_r: with kf = kv/(2k) a damping ratio of 1/√2
//! ([`ForceGains::design`]). In the air the same law moves towards the surface at min(kf·f_r, approach speed), so that there
//! is no switch between two laws at contact. From contact at kf·f_r this linear loop goes to
//! f_r·(1 − exp(−½·kv·t)·cos(½·kv·t)), an overshoot of 6.7 %; from slower contact less, from rest 4.3 %.
//!
//! The measured force is taken off the arm, so the surface itself does not hold the tool: a disturbance D along the
//! direction moves it by D/(Λ·kv·kf·k), and the force by k times that. This falls with kv², hence kv is as large as the
//! loop's delays allow.
//!
//! A disturbance observer takes away friction that the model lacks, in the air as in contact: d' = kd·(v_m − ẋ) is added to a,
//! where v_m' = kv·(w − v_m) − μ·τ·ḟ is the speed that the exact model would have. With the exact model d stays zero. Its
//! error obeys ë + kv·ė + kd·e = 0, with kd = ½·kv² also at a damping ratio of 1/√2. The second term is the force that was
//! not taken off, because the measured force is late by τ; μ = (J·A⁻¹·Jᵀ)_dd is the mobility of the tool. Without this term
//! the observer would take that force for a disturbance and overshoot on stiff surfaces.
//!
//! Leaves out: moments on the tool, the mass of the tool beyond the sensor (subtract it from the reading), and friction on
//! the surface, which the position loops overcome.

use super::fault::{ControlFault, check};
use super::input::{Inputs, Law, Limited};
use super::operational::Operational;
use super::task::AXES;
use crate::scalar::Real;

/// Gains of a direction that presses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceGains<T> {
    /// Wanted force of the tool on the surface, along the direction, N.
    pub force: T,
    /// kv, 1/s.
    pub velocity: T,
    /// kf, m/(N·s).
    pub admittance: T,
    /// kd, 1/s².
    pub disturbance: T,
    /// Highest speed of the approach, m/s.
    pub approach: T,
    /// τ, time from the measurement of a force until the torque acts, s. [`ForceGains::design`] sets zero.
    pub late: T,
}

impl<T: Real> ForceGains<T> {
    /// Returns gains with poles at ω·(−1 ± i), ω = 2π·`bandwidth` (Hz), on a surface of `stiffness` (N/m), for a wanted force
    /// (N), at an approach of at most `approach` (m/s). A disturbance is taken away with the same two poles.
    pub fn design(force: T, stiffness: T, bandwidth: T, approach: T) -> Self {
        let omega = T::from_f64(core::f64::consts::TAU) * bandwidth;
        let velocity = omega + omega;
        Self {
            force,
            velocity,
            admittance: velocity / (T::from_f64(2.0) * stiffness),
            disturbance: T::from_f64(2.0) * omega.squared(),
            approach,
            late: T::ZERO,
        }
    }
}

/// What a direction of the task does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axis<T> {
    /// It follows the reference, with kp in 1/s² and kd in 1/s.
    Moves {
        /// kp, 1/s².
        proportional: T,
        /// kd, 1/s.
        derivative: T,
    },
    /// It presses.
    Presses(ForceGains<T>),
}

/// Constants of the law.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a, T> {
    /// Arm, tool and directions.
    pub operational: Operational<'a, T>,
    /// The selection: what each direction does.
    pub axes: &'a [Axis<T>],
    /// Time between two steps, s.
    pub period: T,
}

/// State of a direction that presses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pressing<T> {
    /// v_m, m/s.
    model_velocity: T,
    /// d, m/s².
    disturbance: T,
    /// Force of the step before, N.
    force: T,
}

/// State of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    pressing: [Pressing<T>; AXES],
}

impl<T: Real> ForceGains<T> {
    /// Returns the speed to move at for a force of the tool on the surface.
    fn speed(&self, force: T) -> T {
        let wanted = self.admittance * (self.force - force);
        wanted.clamp_to(-self.approach, self.approach)
    }

    /// Advances the disturbance observer.
    fn observe(&self, state: &mut Pressing<T>, seen: &Seen<T>, period: T) {
        state.disturbance += period * self.disturbance * (state.model_velocity - seen.velocity);
        state.model_velocity += period * self.velocity * (seen.wanted - state.model_velocity)
            - seen.mobility * self.late * (seen.force - state.force);
    }
}

/// What the disturbance observer of a direction sees.
struct Seen<T> {
    /// w, m/s.
    wanted: T,
    /// ẋ, m/s.
    velocity: T,
    /// f, N.
    force: T,
    /// μ, m/(N·s²).
    mobility: T,
}

impl<T: Real<Mask = bool>> Law<T> for Config<'_, T> {
    type State = State<T>;

    fn step(
        &self,
        state: &mut State<T>,
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault> {
        let Operational { model, task, .. } = &self.operational;
        let count = task.directions.len();
        check("axes", count, self.axes.len())?;
        let motion = task.motion(model.chain, input.position, input.velocity)?;
        let mut wanted = [T::ZERO; AXES];
        let mut speed = [T::ZERO; AXES];
        let pressed = task.pressed(&input.force);
        for (d, axis) in self.axes.iter().enumerate() {
            let (x, v) = (motion.position[d], motion.velocity[d]);
            match axis {
                Axis::Moves {
                    proportional,
                    derivative,
                } => {
                    let reference = &input.task[d];
                    wanted[d] = reference.acceleration
                        + *proportional * (reference.position - x)
                        + *derivative * (reference.velocity - v);
                    speed[d] = reference.velocity;
                }
                Axis::Presses(gains) => {
                    speed[d] = gains.speed(pressed[d]);
                    wanted[d] = gains.velocity * (speed[d] - v) + state.pressing[d].disturbance;
                }
            }
        }
        let targets = [&wanted, &speed, &pressed];
        let computed = self.operational.torque(input, &motion, targets, torque)?;
        for (d, axis) in self.axes.iter().enumerate() {
            if let Axis::Presses(gains) = axis {
                let own = &mut state.pressing[d];
                let seen = Seen {
                    wanted: speed[d],
                    velocity: motion.velocity[d],
                    force: pressed[d],
                    mobility: computed.mobility[d],
                };
                // Nothing is observed behind a limit: the observer would take it for a disturbance.
                if !computed.limited.any() {
                    gains.observe(own, &seen, self.period);
                }
                own.force = pressed[d];
            }
        }
        Ok(computed.limited)
    }
}
