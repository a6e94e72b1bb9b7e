//! What the axes that follow a joint mean for this joint: its range, its speed and its friction.

use super::chain::Body;
use super::reader::Reader;
use crate::robot::error::RobotError;
use crate::robot::joint::{JointFriction, JointLimits};
use rig_output::{format_significant, listed};

impl Reader<'_> {
    /// Gives the joints that others follow the limits and the friction of their followers. Returns the note on what follows.
    ///
    /// # Errors
    /// A follower has a motor with a rotor, or its limits leave its joint no range.
    pub(super) fn geared(&self, bodies: &mut [Body]) -> Result<Option<String>, RobotError> {
        let mut told = Vec::new();
        for k in 0..bodies.len() {
            let Some(mimic) = &bodies[k].mimic else {
                continue;
            };
            let (ratio, offset) = (mimic.ratio, mimic.offset);
            let Some(master) = bodies.iter().position(|own| own.joint == mimic.joint) else {
                continue;
            };
            if bodies[k].rotor_inertia.is_some_and(|inertia| inertia > 0.0) {
                let (name, joint) = (&bodies[k].joint, &mimic.joint);
                return Err(self.error_at(bodies[k].place, format!("joint `{name}` mimics joint `{joint}`, so the motor of `{joint}` moves it, but a transmission gives it a rotor of its own; remove <mimic> if it has a motor, or the rotor")));
            }
            told.push(told_of(&bodies[k], ratio, offset));
            let limits = limited(bodies, master, k, ratio, offset);
            if let Some(limits) = &limits
                && limits.position[0] >= limits.position[1]
            {
                let (name, joint) = (&bodies[k].joint, &bodies[master].joint);
                return Err(self.error_at(bodies[k].place, format!("the limits of joint `{name}`, which mimics joint `{joint}`, and those of `{joint}` leave `{joint}` no range; correct one of them")));
            }
            if limits != bodies[master].limits {
                bodies[master].limits = limits;
                self.narrowed(&bodies[master], &bodies[k]);
            }
            if let Some(own) = bodies[k].friction.clone() {
                let friction = bodies[master].friction.get_or_insert_default();
                friction.viscous += ratio * ratio * own.viscous;
                friction.coulomb += ratio.abs() * own.coulomb;
                self.moved_friction(&bodies[master], &bodies[k], &own);
            }
        }
        if told.is_empty() {
            return Ok(None);
        }
        let note = format!(
            "{}: an axis of the chain that mimics a joint has no motor: torques, limits, friction and columns of recordings are those of the joint. Here {}.",
            self.path.display(),
            listed(&told)
        );
        self.remarks.borrow_mut().push(note.clone());
        Ok(Some(note))
    }

    /// Tells which limits of a joint are those of its follower.
    fn narrowed(&self, master: &Body, follower: &Body) {
        self.remarks.borrow_mut().push(format!(
            "{}:{}: joint `{}` mimics `{}`, whose limits are narrowed so that both stay within theirs.",
            self.path.display(),
            follower.place,
            follower.joint,
            master.joint
        ));
    }

    /// Tells where the friction of a follower is.
    fn moved_friction(&self, master: &Body, follower: &Body, own: &JointFriction) {
        self.remarks.borrow_mut().push(format!(
            "{}:{}: the friction of joint `{}` (damping {}, friction {}) acts like friction of `{}`, which it mimics, and is added there.",
            self.path.display(),
            follower.place,
            follower.joint,
            format_significant(own.viscous, 4),
            format_significant(own.coulomb, 4),
            master.joint
        ));
    }
}

/// Returns a follower as the user is told.
fn told_of(body: &Body, ratio: f64, offset: f64) -> String {
    let joint = body.mimic.as_ref().map_or("", |own| own.joint.as_str());
    let shift = match offset {
        0.0 => String::new(),
        _ if offset < 0.0 => format!(" - {}", -offset),
        _ => format!(" + {offset}"),
    };
    format!("`{}` = {ratio}·`{joint}`{shift}", body.joint)
}

/// Returns the limits of a joint, narrowed to those of an axis that follows it.
fn limited(
    bodies: &[Body],
    master: usize,
    follower: usize,
    ratio: f64,
    offset: f64,
) -> Option<JointLimits> {
    let own = bodies[master].limits.clone()?;
    let Some(other) = &bodies[follower].limits else {
        return Some(own);
    };
    let narrowed = |[low, high]: [f64; 2], [a, b]: [f64; 2]| {
        let [a, b] = [(a - offset) / ratio, (b - offset) / ratio];
        [low.max(a.min(b)), high.min(a.max(b))]
    };
    let position = narrowed(own.position, other.position);
    let soft_position = match (own.soft_position, other.soft_position) {
        (None, None) => None,
        _ => Some(narrowed(own.for_motions(), other.for_motions())),
    };
    Some(JointLimits {
        position,
        soft_position,
        velocity: own.velocity.min(other.velocity / ratio.abs()),
        ..own
    })
}
