//! What the controller reads of the force on the tool: by the described wrist sensor, if there is one.

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::contact_task::ContactTask;
use super::design::at_start;
use super::error::ControlError;
use super::settings::Settings;
use rig_excite::drawn;
use rig_model::robot::Robot;
use rig_output::format_significant;
use rig_shared::multibody::{Chain, MAX_JOINTS, Pose, frame_pose};

/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A wrist sensor in the frame of the last joint.
struct Mounted {
    pose: Pose<f64>,
    /// Largest reading of a force and of a moment.
    range: [f64; 2],
}

impl Mounted {
    fn of(robot: &Robot) -> Option<Self> {
        let sensor = robot.wrist_sensor.as_ref()?;
        let at = robot.flange_pose() * sensor.pose();
        let rotation = at.rotation.to_rotation_matrix();
        let range = [sensor.force_range, sensor.moment_range];
        Some(Self {
            pose: Pose {
                position: at.translation.vector.into(),
                rotation: core::array::from_fn(|r| core::array::from_fn(|c| rotation[(r, c)])),
            },
            range: range.map(|range| range.unwrap_or(f64::INFINITY)),
        })
    }

    /// Returns origin and axes (columns) in the base frame.
    fn placed(&self, chain: &Chain<f64>, q: &[f64]) -> Result<Pose<f64>, ControlError> {
        let mut jacobian = [[0.0; 6]; MAX_JOINTS];
        let jacobian = &mut jacobian[..q.len().min(MAX_JOINTS)];
        frame_pose(chain, q, chain.last_link(), &self.pose, jacobian)
            .map_err(|e| at_start(e.into()))
    }

    /// Returns force and moment about the origin in the sensor's axes, of a force at a point of the base frame.
    fn wrench(pose: &Pose<f64>, point: [f64; 3], force: [f64; 3]) -> [[f64; 3]; 2] {
        let arm: [f64; 3] = core::array::from_fn(|k| point[k] - pose.position[k]);
        let moment = core::array::from_fn(|k| {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            arm[a] * force[b] - arm[b] * force[a]
        });
        let along = |v: [f64; 3]| {
            core::array::from_fn(|axis| (0..3).map(|k| pose.rotation[k][axis] * v[k]).sum())
        };
        [along(force), along(moment)]
    }
}

/// The sensor of the force, with its noise.
pub(crate) struct ForceSensor {
    mounted: Option<Mounted>,
    noise: f64,
    random: Pcg64,
    /// Number of readings in which a force and a moment were beyond the range.
    pub beyond: [usize; 2],
}

impl ForceSensor {
    pub(crate) fn of(robot: &Robot, settings: &Settings) -> Self {
        Self {
            mounted: Mounted::of(robot),
            noise: settings.force_noise,
            random: Pcg64::seed_from_u64(settings.seed),
            beyond: [0; 2],
        }
    }

    /// Returns the force that the controller has, in the base frame. The force acts at `point` while the links are at `q`;
    /// the controller turns the readings into the base frame by the `measured` positions.
    pub(crate) fn read(
        &mut self,
        chain: &Chain<f64>,
        [q, measured]: [&[f64]; 2],
        point: [f64; 3],
        force: [f64; 3],
    ) -> Result<[f64; 3], ControlError> {
        let noise: [f64; 3] = core::array::from_fn(|_| drawn(&mut self.random, self.noise));
        let Some(mounted) = &self.mounted else {
            return Ok(core::array::from_fn(|k| force[k] + noise[k]));
        };
        let [mut read, moment] = Mounted::wrench(&mounted.placed(chain, q)?, point, force);
        let [force_range, moment_range] = mounted.range;
        let mut beyond = [false, moment.iter().any(|m| m.abs() > moment_range)];
        for (own, noise) in read.iter_mut().zip(noise) {
            let whole = *own + noise;
            *own = whole.clamp(-force_range, force_range);
            beyond[0] |= *own != whole;
        }
        for (count, own) in self.beyond.iter_mut().zip(beyond) {
            *count += usize::from(own);
        }
        let axes = mounted.placed(chain, measured)?.rotation;
        Ok(core::array::from_fn(|k| {
            (0..3).map(|axis| axes[k][axis] * read[axis]).sum()
        }))
    }
}

/// Returns a sentence on the sensor that reads the force of a task; `None` if none is described.
///
/// # Errors
/// [`ControlError::Unreachable`]: the wanted force is beyond its range.
pub(crate) fn check(
    robot: &Robot,
    chain: &Chain<f64>,
    task: &ContactTask,
) -> Result<Option<String>, ControlError> {
    let Some(mounted) = Mounted::of(robot) else {
        return Ok(None);
    };
    let placed = mounted.placed(chain, &task.pose)?;
    let force = task.directions[0].map(|n| -task.force * n);
    let [read, _] = Mounted::wrench(&placed, task.origin, force);
    let (axis, most) = (0..3)
        .map(|k| (k, read[k].abs()))
        .fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
    let range = mounted.range[0];
    if most > range {
        return Err(ControlError::Unreachable(format!(
            "The wanted force of {} N reads {} N along {} of the wrist sensor at the start pose, and its range is {} N (`force_range` in [wrist_sensor]): the law would press ever harder. Give a smaller --press, or another --pose or --normal.",
            format_significant(task.force, 3),
            format_significant(most, 3),
            AXES[axis],
            format_significant(range, 3)
        )));
    }
    let ranges = match range.is_finite() {
        true => format!("within {} N", format_significant(range, 3)),
        false => "without a described range".to_owned(),
    };
    Ok(Some(format!(
        "The force is read by the described [wrist_sensor], in its axes and {ranges}, and turned into the base frame by the measured positions."
    )))
}

/// Returns a sentence if the readings of a motion were beyond the range; `ticks` is the number of ticks with a force.
pub(crate) fn beyond_range(
    robot: &Robot,
    [force, moment]: [usize; 2],
    ticks: usize,
) -> Option<String> {
    let sensor = robot.wrist_sensor.as_ref()?;
    let share = |count: usize| {
        let percent = 100.0 * count as f64 / ticks.max(1) as f64;
        format!("{} %", format_significant(percent, 2))
    };
    let mut parts = Vec::new();
    if let (Some(range), true) = (sensor.force_range, force > 0) {
        parts.push(format!(
            "a force beyond its {} N in {} of the ticks in contact, so that the law saw less force than there was",
            format_significant(range, 3),
            share(force)
        ));
    }
    if let (Some(range), true) = (sensor.moment_range, moment > 0) {
        parts.push(format!(
            "a moment beyond its {} N·m in {}, which the law does not use but a real sensor may not bear",
            format_significant(range, 3),
            share(moment)
        ));
    }
    (!parts.is_empty()).then(|| {
        format!(
            "the wrist sensor had {}. Give a smaller --press, another --pose or --tool, or a sensor with a larger range.",
            parts.join("; and ")
        )
    })
}
