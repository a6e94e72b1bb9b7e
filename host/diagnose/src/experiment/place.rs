//! Setup of a joint for experiments: limits, gravity, drive; the other joints stand.

use rig_shared::multibody::{COLUMNS, column};
use rig_shared::trajectory::Trajectory;

use crate::DiagnoseError;
use crate::experiment::family::Hands;
use crate::experiment::nominal::{Held, Nominal};
use rig_identify::chain_of;
use rig_model::batch::ModelBatch;
use rig_model::robot::{JointKind, JointLimits, Robot};
use rig_plant::emulated::Nameplate;

/// Usable share of the torque limit.
const TORQUE: f64 = 0.8;
/// Integration steps in half a period of a coasting joint.
const COAST_STEPS: u32 = 10;
/// Instants at which the torque is checked.
const LOOKS: usize = 2000;

/// One joint, with the others standing.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) torque: Option<f64>,
    /// Torque per position error of the rig's controller, if known; N·m/rad or N/m.
    pub(crate) stiffness: Option<f64>,
    /// True if the robot has no other joint.
    pub(crate) alone: bool,
    /// Positions of all standing joints.
    pub(crate) stand: Vec<f64>,
    /// Middle of the range.
    pub(crate) middle: f64,
    /// Position of the strongest gravity, with room on both sides.
    pub(crate) heavy: f64,
    pub(crate) revolute: bool,
    /// Motor turns per joint turn; 0 if not described.
    pub(crate) ratio: f64,
    /// Inertia of the drive at the joint.
    pub(crate) drive_inertia: f64,
    /// Torque of gravity per first moment along x: with cos q, with sin q, constant; m/s².
    pub(crate) pull: [f64; 3],
    pub(crate) nominal: Nominal,
    /// Nominal parameters that a refit keeps as described.
    pub(crate) held: Held,
}

impl Place {
    /// Returns the setup of a joint (from 0); `None` without limits of position and velocity, or for a prismatic joint without finite ones.
    pub(crate) fn of(
        robot: &Robot,
        joint: usize,
        nominal: Nominal,
        held: Held,
    ) -> Result<Option<Self>, DiagnoseError> {
        let Some(own) = robot.joints.get(joint) else {
            return Ok(None);
        };
        let known = |limits: &&JointLimits| limits.known_velocity().is_some();
        let Some(limits) = own.limits.as_ref().filter(known) else {
            return Ok(None);
        };
        let revolute = own.kind == JointKind::Revolute;
        // An endless joint moves over one turn.
        let [low, high] = match limits.for_motions() {
            [l, h] if l.is_finite() && h.is_finite() => [l, h],
            _ if revolute => [-core::f64::consts::PI, core::f64::consts::PI],
            _ => return Ok(None),
        };
        let stand: Vec<f64> = robot
            .joints
            .iter()
            .map(|j| match j.limits.as_ref().map(|l| l.position) {
                Some([l, h]) if l.is_finite() && h.is_finite() => 0.5 * (l + h),
                _ => 0.0,
            })
            .collect();
        let middle = 0.5 * (low + high);
        let drive = own.drive.as_ref();
        let ratio = drive.map_or(0.0, |d| d.gear_ratio);
        let mut place = Self {
            low,
            high,
            velocity: limits.velocity,
            acceleration: limits
                .acceleration
                .unwrap_or(10.0 * limits.velocity * limits.velocity / (high - low)),
            torque: limits.torque,
            stiffness: stiffness(robot, joint),
            alone: robot.joints.len() == 1,
            stand,
            middle,
            heavy: middle,
            revolute,
            ratio,
            drive_inertia: drive.map_or(0.0, |d| d.joint_inertia + d.rotor_inertia * ratio * ratio),
            pull: [0.0; 3],
            nominal,
            held,
        };
        place.pull = place.gravity_of(robot, joint)?;
        let quarter = 0.25 * (high - low);
        place.heavy = (0..=40)
            .map(|k| low + quarter + 0.05 * f64::from(k) * quarter)
            .max_by(|a, b| place.weight(*a).abs().total_cmp(&place.weight(*b).abs()))
            .unwrap_or(middle);
        Ok(Some(place))
    }

    fn gravity_of(&self, robot: &Robot, joint: usize) -> Result<[f64; 3], DiagnoseError> {
        let model = |e: &dyn ToString| DiagnoseError::Model(e.to_string());
        let n = robot.joints.len();
        let chain = chain_of(robot).map_err(|e| model(&e))?;
        let mut parameters = vec![[0.0; COLUMNS]; n];
        parameters[joint][column::FIRST_MOMENT] = 1.0;
        let batch = ModelBatch::new(&chain, &parameters).map_err(|e| model(&e))?;
        let quarter = core::f64::consts::FRAC_PI_2;
        let q: Vec<Vec<f64>> = (0..n)
            .map(|j| {
                let at = [0.0, quarter, 2.0 * quarter];
                at.iter()
                    .map(|a| if j == joint { *a } else { self.stand[j] })
                    .collect()
            })
            .collect();
        let mut out = vec![0.0; 3 * n];
        batch.gravity(&q, &mut out).map_err(|e| model(&e))?;
        let [zero, up, half] = [out[3 * joint], out[3 * joint + 1], out[3 * joint + 2]];
        let constant = 0.5 * (zero + half);
        Ok([zero - constant, up - constant, constant])
    }

    /// Returns position, velocity and acceleration of the coasting joint in the middle of each of `count` periods (s).
    /// A share of its dry and viscous friction acts. It stops where friction holds its weight.
    pub(crate) fn coast(
        &self,
        [mut position, mut velocity]: [f64; 2],
        friction: f64,
        period: f64,
        count: usize,
    ) -> Vec<[f64; 3]> {
        let [inertia, _, _, viscous, coulomb, offset] = self.nominal;
        let step = period / f64::from(2 * COAST_STEPS);
        let mut tick = || {
            let pull = self.weight(position) + offset;
            let held = friction * coulomb.abs();
            let direction = if velocity != 0.0 {
                velocity.signum()
            } else if pull.abs() <= held {
                return [position, 0.0, 0.0];
            } else {
                -pull.signum()
            };
            let acceleration =
                -(pull + friction * viscous.abs() * velocity + held * direction) / inertia;
            let next = velocity + acceleration * step;
            // Dry friction reverses no motion.
            velocity = if next * direction < 0.0 { 0.0 } else { next };
            position += velocity * step;
            [position, velocity, acceleration]
        };
        let mut half = |count: u32| (0..count).map(|_| tick()).last().unwrap_or_default();
        (0..count)
            .map(|_| {
                let middle = half(COAST_STEPS);
                half(COAST_STEPS);
                middle
            })
            .collect()
    }

    /// Returns the torque of gravity per first moment along x.
    pub(crate) fn pull_at(&self, q: f64) -> f64 {
        let (sine, cosine) = q.sin_cos();
        self.pull[0] * cosine + self.pull[1] * sine + self.pull[2]
    }

    /// Returns the nominal torque of gravity.
    pub(crate) fn weight(&self, q: f64) -> f64 {
        let (sine, cosine) = q.sin_cos();
        if self.revolute {
            self.nominal[1] * cosine + self.nominal[2] * sine
        } else {
            0.0
        }
    }

    /// Returns true if the torque limit allows the motion in every pass, with full Coulomb friction.
    pub(crate) fn bears(&self, motion: &Trajectory<f64>, start: f64, hands: Hands) -> bool {
        let Some(limit) = self.torque else {
            return true;
        };
        let [inertia, _, _, viscous, coulomb, offset] = self.nominal;
        let duration = motion.duration();
        hands.passes().iter().all(|[mass, gravity]| {
            (0..=LOOKS).all(|k| {
                let at = motion.at(duration * k as f64 / LOOKS as f64);
                let needed = mass * inertia * at.acceleration
                    + gravity * self.weight(start + at.position)
                    + viscous * at.velocity
                    + offset;
                needed.abs() + coulomb.abs() <= TORQUE * limit
            })
        })
    }
}

/// Returns the controller's torque per position error: as `rig record` sets it on the rig, else as described.
fn stiffness(robot: &Robot, joint: usize) -> Option<f64> {
    let own = robot.joints.get(joint)?;
    let told = Nameplate::from_robot(robot)
        .map(|nameplate| f64::from(nameplate.settings.gains.proportional));
    let stated =
        (own.controller.as_ref()).map(|c| c.torque_gain * c.velocity_gain * c.position_gain);
    told.ok().or(stated).filter(|gain| *gain > 0.0)
}
