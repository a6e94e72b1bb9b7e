//! The effects of a model within one step.

use rig_shared::effects::{Direction, GAINS, Kind, Memory};
use rig_shared::scalar::Real as _;

use super::error::SimulateError;
use super::history::Since;
use crate::effects::{Effects, State, Turn, is_torque};

/// Share of its size by which friction may have the wrong sign, as rounding.
const SLACK: f64 = 1e-9;

/// Hidden states of a model's effects, and their torques in the present step.
pub(super) struct Acting<'a> {
    effects: &'a Effects,
    memory: Vec<Memory<f64>>,
    motor: Vec<f64>,
    time: f64,
    /// Torques that do not depend on the direction of motion, one a coordinate.
    pub torque: Vec<f64>,
    /// Such torques on links that are not at the coordinates of their joints, one a joint.
    pub of_links: Vec<f64>,
    /// Dry friction that effects add, for motion backwards and forwards, one a joint.
    dry: Vec<[f64; 2]>,
    /// Part of `dry` from presliding, whose hidden state replaces the direction.
    remembered: Vec<[f64; 2]>,
    /// Contact deflection of each joint with presliding.
    bent: Vec<Option<f64>>,
    /// Other friction that acts through such a contact, independent of the direction, one a joint.
    through: Vec<f64>,
    /// That friction over the joint's own, 1, one a joint. Presliding uses the value of the pass before.
    beside: Vec<f64>,
    /// Change of viscous friction by warming, one a joint.
    warmed: Vec<f64>,
}

impl<'a> Acting<'a> {
    /// Prepares the effects for `coordinates`, the first of which are those of the joints.
    pub(super) fn new(effects: &'a Effects, coordinates: usize, joints: usize) -> Self {
        Self {
            effects,
            memory: vec![Memory::default(); effects.placed().len()],
            motor: vec![0.0; joints],
            time: 0.0,
            torque: vec![0.0; coordinates],
            of_links: vec![0.0; joints],
            dry: vec![[0.0; 2]; joints],
            remembered: vec![[0.0; 2]; joints],
            bent: vec![None; joints],
            through: vec![0.0; joints],
            beside: vec![0.0; joints],
            warmed: vec![0.0; joints],
        }
    }

    /// Continues from a history.
    pub(super) fn go_on(&mut self, since: &Since) {
        self.time = since.time;
        for (own, before) in self.memory.iter_mut().zip(&since.memory) {
            *own = *before;
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.effects.is_empty()
    }

    /// Returns the inertia that couples a joint to another joint's acceleration: joint, other, kg·m².
    pub(super) fn couplings(&self) -> impl Iterator<Item = (usize, usize, f64)> + use<'a> {
        let of = |p: &&crate::robot::Placed| p.effect.kind == Kind::InertiaCoupling;
        self.effects
            .placed()
            .iter()
            .filter(of)
            .filter_map(|p| Some((p.joint, p.other?, p.effect.gains[0])))
    }

    /// Returns the inputs of effect `k`; `links`: positions and velocities of the links. The coupled acceleration is zero:
    /// its inertia is in the mass matrix.
    fn instant(
        &self,
        k: usize,
        [q, v, a, drive]: [&[f64]; 4],
        links: [&[f64]; 2],
        period: f64,
    ) -> rig_shared::effects::Instant<f64> {
        let place = self.effects.placed()[k];
        let mut instant = self.effects.instant(
            k,
            &State {
                q,
                qd: v,
                qdd: a,
                motor: &self.motor,
                drive,
                time: self.time + period,
                warming: &[],
                period,
            },
        );
        instant.other[2] = 0.0;
        if place.effect.kind.is_presliding() {
            instant.extra_friction_ratio = self.beside[place.joint];
        }
        if place.effect.kind.acts_on_link() {
            let [q, v] = links;
            (instant.position, instant.velocity) = (q[place.joint], v[place.joint]);
            if let Some(other) = place.other {
                (instant.other[0], instant.other[1]) = (q[other], v[other]);
            }
        }
        instant
    }

    /// Computes all torques in the middle of a step of `dt`. `motion`: positions, mean velocities and accelerations of
    /// all coordinates, torques of the drives. `links`: positions and velocities of the links. `separate`: of a joint,
    /// whether its link is elsewhere than its motor. `loads`: of the links on the gears.
    pub(super) fn evaluate(
        &mut self,
        motion: [&[f64]; 4],
        links: [&[f64]; 2],
        separate: impl Fn(usize) -> bool,
        loads: &[f64],
        dt: f64,
    ) -> Result<(), SimulateError> {
        self.torque.fill(0.0);
        self.of_links.fill(0.0);
        self.dry.fill([0.0; 2]);
        self.remembered.fill([0.0; 2]);
        let joints = self.motor.len();
        self.effects
            .motor_angles(&motion[0][..joints], &mut self.motor)?;
        let mut load = loads.to_vec();
        self.bent.fill(None);
        self.through.fill(0.0);
        self.warmed.fill(0.0);
        for turn in Turn::ALL {
            if turn == Turn::Others {
                self.beside.fill(0.0);
            }
            for (k, p) in self.effects.placed().iter().enumerate() {
                let kind = p.effect.kind;
                if !is_torque(kind) || Turn::of(kind) != turn {
                    continue;
                }
                let mut instant = self.instant(k, motion, links, 0.5 * dt);
                instant.load = load[p.joint];
                if kind.about().direction == Direction::Dry {
                    let beside = instant.extra_friction_ratio;
                    let mut towards = |direction: f64, bent: f64| {
                        instant.direction = direction;
                        instant.friction = (self.effects).friction(p.joint, instant.velocity, bent);
                        let mut memory = self.memory[k];
                        (p.effect.torque(&mut memory, &instant), memory)
                    };
                    let bent = self.bent[p.joint].filter(|_| kind.acts_through_contact());
                    if let Some(bent) = bent {
                        let (whole, _) = towards(1.0, bent);
                        self.through[p.joint] += whole * bent;
                        self.beside[p.joint] += self.effects.over_coulomb(p.joint, whole);
                        continue;
                    }
                    for (side, direction) in [-1.0, 1.0].into_iter().enumerate() {
                        let (torque, memory) = towards(direction, direction);
                        self.dry[p.joint][side] += torque;
                        if kind.is_presliding() {
                            self.remembered[p.joint][side] += torque;
                            self.bent[p.joint] = Some(p.effect.contact_deflection(&memory, beside));
                        }
                    }
                    continue;
                }
                let torque = p.effect.torque(&mut self.memory[k].clone(), &instant);
                if kind.is_viscous_warmup() && instant.velocity != 0.0 {
                    self.warmed[p.joint] += torque / instant.velocity;
                    self.refuse_driving(p.joint)?;
                }
                if !kind.acts_on_link() {
                    self.torque[p.joint] += torque;
                } else if separate(p.joint) {
                    // The load on the gears contains it already.
                    self.of_links[p.joint] += torque;
                } else {
                    self.torque[p.joint] += torque;
                    load[p.joint] += torque;
                }
            }
        }
        Ok(())
    }

    /// Refuses a joint whose viscous friction is negative after warming.
    fn refuse_driving(&self, joint: usize) -> Result<(), SimulateError> {
        let viscous = self.effects.friction(joint, 1.0, 0.0);
        let left = viscous + self.warmed[joint];
        if left < -SLACK * viscous {
            return Err(SimulateError::WarmedAway {
                joint: joint + 1,
                time: self.time,
                viscous,
                left,
            });
        }
        Ok(())
    }

    /// Returns the bounds of the friction of a joint with Coulomb friction `coulomb`, at a velocity. They are equal if
    /// presliding holds all friction. Presliding cannot hold more: it then holds its share of the friction.
    pub(super) fn bounds(
        &self,
        joint: usize,
        coulomb: f64,
        velocity: f64,
    ) -> Result<[f64; 2], SimulateError> {
        let [low, high] = self.dry[joint];
        let bounds = [low - coulomb, high + coulomb];
        let [back, forth] = self.remembered[joint];
        let slack = SLACK * (coulomb + low.abs() + high.abs());
        // After enough sliding the hidden state equals the direction. So the friction without it must dissipate too.
        let driving = |[low, high]: [f64; 2]| SimulateError::DrivingEffects {
            joint: joint + 1,
            velocity,
            low,
            high,
        };
        let through = self.through[joint];
        // A deflected contact pushes against its deflection.
        let held = self.bent[joint].map_or(0.0, |bent| (coulomb * bent + through) * bent.sgn());
        if held.is_nan() || held < -slack {
            return Err(driving([-held, held]));
        }
        let passive = bounds[0] - back <= slack && bounds[1] - forth >= -slack;
        if passive && bounds[0] <= bounds[1] {
            return Ok(bounds.map(|bound| bound + through));
        }
        if passive {
            return Ok([winding(bounds, [back, forth]) + through; 2]);
        }
        Err(driving(bounds))
    }

    /// Computes hidden states and time at the end of the step.
    pub(super) fn advance(&mut self, motion: [&[f64]; 4], links: [&[f64]; 2], dt: f64) {
        for k in 0..self.memory.len() {
            let instant = self.instant(k, motion, links, dt);
            let p = &self.effects.placed()[k].effect;
            let _: [f64; GAINS] = p.kind.terms(&p.shapes, &mut self.memory[k].0, &instant);
        }
        self.time += dt;
    }
}

/// Returns the friction that a hidden state holds if presliding is larger than the whole friction. At full deflection
/// it is the whole dry friction of that direction. So the difference between the directions stays a constant, as it
/// does for smaller presliding. `bounds` are the bounds of all friction.
fn winding(bounds: [f64; 2], [back, forth]: [f64; 2]) -> f64 {
    let whole = back - forth;
    if whole <= 0.0 {
        return 0.5 * (bounds[0] + bounds[1]);
    }
    // Deflection from −1 to 1.
    let way = (back + forth) / whole;
    let [backwards, forwards] = [bounds[0] - back, bounds[1] - forth];
    0.5 * (forwards + backwards + way * (forwards - backwards))
}
