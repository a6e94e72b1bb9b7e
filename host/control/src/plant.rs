//! The true robot: the simulation of the description, with a tool on a surface.

use super::error::ControlError;
use super::surface::Surface;
use super::tool::tool_pose;
use rig_model::simulate::{Model, Stepper};
use rig_shared::control::arm::Task;

/// Longest step of the simulation, s.
const STEP: f64 = 0.25e-3;
/// Largest phase of the tool on the surface within one step, rad.
const PHASE: f64 = 0.05;

/// A tool and the surface that it may touch.
#[derive(Clone, Copy)]
pub(crate) struct Contact<'a> {
    pub surface: Surface,
    pub task: Task<'a, f64>,
    /// Inertia of the tool along the normal in the start pose while it is free to move along the surface, kg: the smallest
    /// one, which bounds the step of the simulation.
    pub inertia: f64,
}

impl Contact<'_> {
    /// Computes position (m) of the tool and force (N) on it in the base frame at positions and velocities of the links, and
    /// its torques on them.
    fn act(
        &self,
        model: &Model,
        [q, v]: [&[f64]; 2],
        external: &mut [f64],
    ) -> Result<[[f64; 3]; 2], ControlError> {
        let mut jacobian = vec![[0.0; 6]; q.len()];
        let position = tool_pose(&model.chain, q, self.task.tool, &mut jacobian)?;
        let velocity: [f64; 3] = core::array::from_fn(|k| {
            jacobian
                .iter()
                .zip(v)
                .map(|(column, v)| column[k] * v)
                .sum()
        });
        let normal = self.task.directions[0];
        let along: f64 = (0..3)
            .map(|k| normal[k] * (position[k] - self.task.origin[k]))
            .sum();
        let force = self
            .surface
            .force(normal, along - self.surface.gap, velocity);
        for (own, column) in external.iter_mut().zip(&jacobian) {
            *own = (0..3).map(|k| column[k] * force[k]).sum::<f64>();
        }
        Ok([position, force])
    }
}

/// The true robot. Sensors and torques of a joint with an elastic gear or backlash are the motor's.
pub(crate) struct Plant<'a> {
    model: &'a Model,
    stepper: Stepper<'a>,
    contact: Option<Contact<'a>>,
    /// Positions as the encoders have them, rad or m.
    pub q: Vec<f64>,
    /// Velocities as the encoders have them.
    pub v: Vec<f64>,
    /// Positions of the links.
    pub link_q: Vec<f64>,
    /// Velocities of the links.
    pub link_v: Vec<f64>,
    /// Position of the tool in the base frame at the last [`force`](Self::force), m.
    pub tool: [f64; 3],
    middle: Vec<f64>,
    external: Vec<f64>,
}

impl<'a> Plant<'a> {
    /// Puts the robot at rest at `q`.
    pub(crate) fn new(
        model: &'a Model,
        contact: Option<Contact<'a>>,
        q: &[f64],
    ) -> Result<Self, ControlError> {
        let still = vec![0.0; q.len()];
        let mut stepper = Stepper::new(model)?;
        stepper.put_links_at_rest(q, &still)?;
        let mut plant = Self {
            model,
            stepper,
            q: q.to_vec(),
            v: still.clone(),
            link_q: q.to_vec(),
            link_v: still.clone(),
            tool: [0.0; 3],
            middle: q.to_vec(),
            external: if contact.is_some() { still } else { Vec::new() },
            contact,
        };
        plant.note_links();
        Ok(plant)
    }

    /// Reads where the links are.
    fn note_links(&mut self) {
        for j in 0..self.q.len() {
            let [q, v] = self.stepper.link(j).unwrap_or([self.q[j], self.v[j]]);
            (self.link_q[j], self.link_v[j]) = (q, v);
        }
    }

    /// Returns the force on the tool now, in the base frame, N.
    pub(crate) fn force(&mut self) -> Result<[f64; 3], ControlError> {
        match &self.contact {
            Some(contact) => {
                let links = [self.link_q.as_slice(), &self.link_v];
                let [tool, force] = contact.act(self.model, links, &mut self.external)?;
                self.tool = tool;
                Ok(force)
            }
            None => Ok([0.0; 3]),
        }
    }

    /// Advances by `dt` under joint torques that are held.
    pub(crate) fn advance(&mut self, torque: &[f64], dt: f64) -> Result<(), ControlError> {
        let longest = self.contact.map_or(STEP, |contact| {
            let rate = (contact.surface.stiffness / contact.inertia).sqrt()
                + contact.surface.damping / contact.inertia;
            STEP.min(PHASE / rate)
        });
        let steps = (dt / longest - 1e-9).ceil().max(1.0);
        let step = dt / steps;
        for _ in 0..steps as usize {
            if let Some(contact) = &self.contact {
                // In the middle of the step, as all other torques.
                for (i, middle) in self.middle.iter_mut().enumerate() {
                    *middle = self.link_q[i] + 0.5 * step * self.link_v[i];
                }
                let links = [self.middle.as_slice(), &self.link_v];
                contact.act(self.model, links, &mut self.external)?;
            }
            let (q, v) = (&mut self.q, &mut self.v);
            self.stepper.step(q, v, torque, &self.external, step)?;
            self.note_links();
        }
        Ok(())
    }
}
