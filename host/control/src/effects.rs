//! Compensation of the effects of a diagnosed model, by the firmware's own laws, joint by joint.

use super::law_model::LawModel;
use rig_model::robot::title_of;
use rig_shared::compensation::{Compensation, EFFECTS, Effects, Inputs, Role, State};
use rig_shared::effects::Kind;
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::trajectory::Reference;

/// The effects of one joint.
struct Joint {
    index: usize,
    gear_ratio: f64,
    friction: [f64; 2],
    /// Share of the effects that the model has.
    share: f64,
    compensation: Compensation<f64>,
    state: State<f64>,
    count: usize,
}

/// The effects of all joints.
pub(crate) struct Compensated {
    joints: Vec<Joint>,
    settings: PrecompensationSettings<f64>,
    period: f64,
    time: f64,
    /// Sentences on effects that are not compensated.
    pub notes: Vec<String>,
}

impl Compensated {
    pub(crate) fn of(
        model: &LawModel,
        settings: PrecompensationSettings<f64>,
        period: f64,
    ) -> Self {
        let mut lists: Vec<Vec<_>> = model.robot.joints.iter().map(|_| Vec::new()).collect();
        let mut notes = Vec::new();
        for placed in model.robot.placed_effects() {
            let kind = placed.effect.kind;
            let joint = &model.robot.joints[placed.joint].name;
            let why = match Role::refusal(kind) {
                _ if kind == Kind::Payload => continue,
                Some(reason) => reason.to_string(),
                None if placed.other.is_some() => "its torque depends on a second joint".to_owned(),
                None if lists[placed.joint].len() == EFFECTS => {
                    format!("at most {EFFECTS} effects of a joint are")
                }
                None => {
                    lists[placed.joint].push(placed.effect);
                    continue;
                }
            };
            notes.push(format!(
                "The law's model has the effect {} of joint {joint}, which is not compensated: {why}.",
                title_of(kind)
            ));
        }
        let mut joints = Vec::new();
        for (index, list) in lists
            .iter()
            .enumerate()
            .filter(|(_, list)| !list.is_empty())
        {
            let mut effects = Effects::default();
            for (place, effect) in effects.iter_mut().zip(list) {
                *place = Some(*effect);
            }
            match Compensation::new(&effects) {
                Ok(compensation) => joints.push(Joint {
                    index,
                    gear_ratio: model.robot.joints[index].gear_ratio(),
                    friction: model.friction[index],
                    share: model.effects[index],
                    compensation,
                    state: State::default(),
                    count: list.len(),
                }),
                Err(fault) => notes.push(format!(
                    "The effects of joint {} are not compensated: {fault}.",
                    model.robot.joints[index].name
                )),
            }
        }
        Self {
            joints,
            settings,
            period,
            time: 0.0,
            notes,
        }
    }

    /// Computes the torques to add in one tick. `load` is the torque without friction and effects.
    pub(crate) fn torque(
        &mut self,
        [q, qd, load]: [&[f64]; 3],
        reference: &[Reference<f64>],
        out: &mut [f64],
    ) {
        self.time += self.period;
        out.fill(0.0);
        for joint in &mut self.joints {
            let j = joint.index;
            let angle = joint.gear_ratio * q[j];
            let inputs = Inputs {
                reference: reference[j],
                position: q[j],
                velocity: qd[j],
                gear_ratio: joint.gear_ratio,
                motor_angle: angle,
                angle_in_turn: angle.rem_euclid(core::f64::consts::TAU),
                position_known: true,
                busy: false,
                rotates_waves: true,
                drive_torque: load[j],
                load: load[j],
                coulomb: joint.friction[0],
                viscous: joint.friction[1],
                time: self.time,
                period: self.period,
                torque_delay: self.period,
                ..Inputs::default()
            };
            joint.compensation.turn(&mut joint.state, &inputs);
            // The board evaluates one law a tick; here all of them have time. A law's two motions are two turns.
            let mut torque = 0.0;
            for _ in 0..2 * joint.count.max(1) {
                let given = joint
                    .compensation
                    .torque(&self.settings, &mut joint.state, &inputs);
                torque = given.feedforward;
            }
            out[j] = joint.share * torque;
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }
}
