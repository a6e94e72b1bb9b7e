//! The torque of an elastic gear or of one with play, driven by the motor's measured motion.
//!
//! With the twist x = θm/ratio − q of joint j, and the load λ that the rigid gear would transmit for the motor's motion,
//! the link's equation linearised about the motor's position is M·ẍ = λ + f − K·x − τc(x, ẋ): M the joint's own inertia
//! without the drive, K the slope of gravity, f the share of the friction that acts on the link, which sticks (Moreau's
//! time stepping), τc what spring, damping and play transmit. The drive's torque then differs from the rigid model's by
//! τc − λ − f(θ̇m/ratio). Play only pushes: [`transmitted`] has the law.
//!
//! Leaves out: what the twist of one joint does to the others.

use rig_shared::effects::{Kind, SHAPES, transmitted};

use super::DiagnoseError;
use super::columns::Source;
use super::predicted::Predicted;
use super::rows::motion_of;
use super::runs::Run;

/// Steps a sample, at least: contact begins and ends within one.
const FEWEST_STEPS: usize = 4;
/// Most steps a sample, where stiffness asks for more the column is not formed.
const MOST_STEPS: usize = 64;
/// Step times natural frequency, at most.
const STEP: f64 = 0.2;
/// Most twist that the load may wind up, rad: beyond it the equation, linearised about the motor's position, says nothing,
/// and a gear so soft is none.
const MOST_TWIST: f64 = 0.2;
/// Error of the position at which the slope of gravity is taken, rad.
const NUDGE: f64 = 1e-4;

/// What the twist of a joint obeys over a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Driven {
    mass: Vec<f64>,
    slope: Vec<f64>,
}

impl Driven {
    /// Of joint `joint` over `run`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn of(source: &Source, joint: usize, run: &Run) -> Result<Self, DiagnoseError> {
        let n = source.nominal.joints();
        let rest = vec![vec![0.0; run.len()]; n];
        let motion = motion_of(run);
        let torque = |q: &[Vec<f64>], a: &[Vec<f64>]| source.inertial(joint, [q, &rest, a]);
        let still = torque(&motion[0], &rest)?;
        let mut unit = rest.clone();
        unit[joint].fill(1.0);
        let pushed = torque(&motion[0], &unit)?;
        let mut moved = motion[0].clone();
        moved[joint].iter_mut().for_each(|q| *q += NUDGE);
        let moved = torque(&moved, &rest)?;
        let own = source.drive_inertia(joint);
        Ok(Self {
            mass: (pushed.iter().zip(&still))
                .map(|(a, b)| a - b - own)
                .collect(),
            slope: (moved.iter().zip(&still))
                .map(|(a, b)| (a - b) / NUDGE)
                .collect(),
        })
    }

    /// What the drive's torque differs by from a rigid gear's; none where the link has no inertia of its own, the contact is
    /// too stiff for the steps or the gear softer than [`MOST_TWIST`] allows.
    pub(super) fn excess(
        &self,
        kind: Kind,
        shapes: &[f64; SHAPES],
        joint: usize,
        run: &Run,
        predicted: &Predicted,
        friction: [f64; 2],
    ) -> Option<Vec<f64>> {
        let [gap, stiffness, damping] = kind.transmission(shapes)?;
        let least = self.mass.iter().copied().fold(f64::INFINITY, f64::min);
        if least.is_nan() || least <= 0.0 {
            return None;
        }
        let period = 1.0 / run.rate;
        let fast = (stiffness / least).sqrt().max(damping / least);
        let steps = ((period * fast / STEP).ceil() as usize).max(FEWEST_STEPS);
        if steps > MOST_STEPS {
            return None;
        }
        let h = period / steps as f64;
        let share = kind.link_friction(shapes)?;
        let [viscous, coulomb] = friction.map(|f| share * f.max(0.0));
        let speed = &run.joints[joint].qd;
        let load = &predicted.load[joint];
        let first = load.first().copied()?;
        let most = load.iter().fold(0.0, |m: f64, l| m.max(l.abs()));
        if most > MOST_TWIST * stiffness {
            return None;
        }
        // At rest on the side that the load presses to.
        let mut x = 0.5 * gap * first.signum() + first / stiffness;
        let mut v = 0.0;
        let mut out = Vec::with_capacity(load.len());
        out.push(0.0);
        for k in 1..load.len() {
            let (from, to) = (load[k - 1], load[k]);
            let (mass, slope) = (self.mass[k], self.slope[k]);
            let mut sum = 0.0;
            for s in 0..steps {
                let part = (s as f64 + 0.5) / steps as f64;
                // Half a step of the twist, the torque in the middle, the other half: second order.
                let middle = x + 0.5 * h * v;
                let torque = transmitted(gap, stiffness, damping, middle, v);
                let pull = from + part * (to - from) - slope * middle - torque;
                // The link's own velocity after the step, before and after its friction.
                let motor = speed[k - 1] + part * (speed[k] - speed[k - 1]);
                let free = motor - v - h * pull / mass;
                let slid = free / (1.0 + h * viscous / mass);
                let dry = (mass * slid / h).clamp(-coulomb, coulomb);
                v = motor - slid + h * dry / mass;
                x = middle + 0.5 * h * v;
                sum += torque;
            }
            let rigid = viscous * speed[k] + coulomb * speed[k].signum();
            out.push(sum / steps as f64 - 0.5 * (from + to) - rigid);
        }
        out.iter().all(|t| t.is_finite()).then_some(out)
    }
}
