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
use crate::voltage::plant::Plant;
use crate::voltage::stepper::{State, Stepper};

/// Longest initial step, s; halved until steps do not matter beside the residual. At 6 ms the XL330 recordings'
/// positions are off by 0.4 mrad (with friction under load by 2.7 mrad). Their residuals are 85 mrad (35 mrad),
/// November 2026.
const STEP: f64 = 6.0e-3;
/// Longest step as an angle of the closed loop's own oscillation, rad: explicit steps are stable up to 2.
const ANGLE: f64 = 0.2;
/// Position and velocity beyond which a simulation has no bounds, rad and rad/s (m and m/s).
const UNBOUNDED: f64 = 1.0e6;
/// Longest stretch of one simulation, s: a joint without weight drifts without bounds.
pub(crate) const LONGEST: f64 = 10.0;

impl Plant {
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
