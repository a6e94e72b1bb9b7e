//! Free simulation of a voltage-driven joint from a recorded start.
//!
//! J·q̈ + g(q) + viscous·q̇ + friction + offset = gain·(u − emf·q̇). The current has no delay (L neglected) and is zero
//! with the drive off. The voltage is the recorded one, or in the closed loop that of the recording's controller. Steps
//! after Moreau (1988), as in [`rig_model::simulate`]: within its bounds, dry friction takes the value that stops the
//! joint, so it really sticks. Terms proportional to the velocity use its mean over the step, voltages the velocity in
//! the middle. So the error falls with the square of the step between reversals.
//!
//! Leaves out: inductance, sag of the supply between rows, heating, backlash and elasticity of the gear.

use rig_shared::effects::Kind;

use crate::voltage::halt::Halt;
use crate::voltage::log::{Log, Segment};
use crate::voltage::stepper::{State, Stepper};
use rig_model::robot::Robot;

/// Longest initial step, s; halved until steps do not matter beside the residual. At 6 ms the XL330 recordings'
/// positions are off by 0.4 mrad (with friction under load by 2.7 mrad). Their residuals are 85 mrad (35 mrad),
/// November 2026.
const STEP: f64 = 6.0e-3;
/// Longest step as an angle of the closed loop's own oscillation, rad: explicit steps are stable up to 2.
const ANGLE: f64 = 0.2;
/// Position and velocity beyond which a simulation has no bounds, rad and rad/s (m and m/s).
const UNBOUNDED: f64 = 1.0e6;
/// Nominal parameters, in the order of [`NAMES`].
pub(crate) const NOMINAL: usize = 6;
/// Drive inertia seen at the joint; torque per volt; back-EMF; Coulomb and viscous friction; constant torque.
pub(crate) const NAMES: [(&str, &str); NOMINAL] = [
    ("Ia1", "kg*m^2"),
    ("torque per volt", "N*m/V"),
    ("back-EMF", "V*s/rad"),
    ("fc1", "N*m"),
    ("fv1", "N*m*s/rad"),
    ("off1", "N*m"),
];

/// Known values of the joint.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plant {
    /// Inertia of the link, kg·m² or kg.
    pub inertia: f64,
    /// Torque against gravity: with cos q, with sin q, constant, N·m or N.
    pub gravity: [f64; 3],
    /// The same per kg·m of first moment along x, m/s².
    pub per_moment: [f64; 3],
    /// Motor turns per joint turn.
    pub ratio: f64,
    /// Number of halvings of the longest step.
    pub halvings: i32,
}

impl Plant {
    /// Returns the nominal parameters of a description; `None` if any is missing.
    pub(crate) fn described(&self, robot: &Robot) -> Option<[f64; NOMINAL]> {
        let joint = robot.joints.first()?;
        let (drive, friction) = (joint.drive.as_ref()?, joint.friction.as_ref()?);
        let emf = drive.torque_constant * self.ratio.abs();
        let gain = emf / drive.resistance?;
        (gain.is_finite() && gain > 0.0).then_some([
            drive.joint_inertia + self.ratio * self.ratio * drive.rotor_inertia,
            gain,
            emf,
            friction.coulomb,
            friction.viscous,
            friction.offset,
        ])
    }

    /// Returns the torque against gravity, N·m or N.
    pub(crate) fn weight(&self, q: f64) -> f64 {
        let (sin, cos) = q.sin_cos();
        self.gravity[0] * cos + self.gravity[1] * sin + self.gravity[2]
    }

    /// Returns the same plant with half the step.
    pub(crate) fn finer(&self) -> Self {
        Self {
            halvings: self.halvings + 1,
            ..*self
        }
    }

    /// Appends the simulated positions at the rows of `segment` to `out`.
    ///
    /// # Errors
    /// [`Halt`]: friction that would drive the joint, or an unbounded motion, and its time.
    pub(crate) fn simulate(
        &self,
        effects: &[Kind],
        theta: &[f64],
        log: &Log,
        segment: &Segment,
        out: &mut Vec<f64>,
    ) -> Result<(), Halt> {
        self.run(effects, theta, log, segment, &mut |at| {
            out.push(at.position)
        })
    }

    /// Simulates the rows of `segment` and passes the state at each row to `visit`.
    ///
    /// # Errors
    /// As [`Self::simulate`].
    pub(crate) fn run(
        &self,
        effects: &[Kind],
        theta: &[f64],
        log: &Log,
        segment: &Segment,
        visit: &mut dyn FnMut(&State),
    ) -> Result<(), Halt> {
        let from = segment.from;
        let mut stepper = Stepper::new(self, effects, theta).ok_or(Halt::driving(log.t[from]))?;
        stepper.start(log, segment);
        let longest = STEP.min(ANGLE / stepper.fastest(log)) * 0.5_f64.powi(self.halvings);
        for k in from..segment.to {
            let next = (k + 1).min(segment.to - 1);
            let interval = log.t[next] - log.t[k];
            let steps = (interval / longest).ceil().max(1.0);
            let dt = interval / steps;
            visit(&stepper.state(log, k));
            if next == k {
                break;
            }
            for s in 0..steps as usize {
                stepper.step(log, k, log.t[k] + (s as f64 + 0.5) * dt, dt)?;
            }
            if !stepper.is_within(UNBOUNDED) {
                return Err(Halt::unbounded(log.t[next]));
            }
        }
        Ok(())
    }
}
