//! The closed loop of a law and the true robot, tick by tick.

use super::contact_task::ContactTask;
use super::controller::Controller;
use super::error::ControlError;
use super::force_sensing::ForceSensor;
use super::law_model::LawModel;
use super::mobility::free_inertia;
use super::plant::{Contact, Plant};
use super::sensing::Encoders;
use super::settings::Settings;
use rig_model::robot::{JointKind, JointLimits, Robot};
use rig_model::simulate::Model;
use rig_shared::control::arm::Inputs;
use rig_shared::trajectory::Reference;

/// Speed over its limit at which the loop counts as unstable.
const UNSTABLE: f64 = 20.0;
/// Number of instants at which adapted parameters are kept.
const SNAPSHOTS: usize = 200;

/// A motion in the closed loop; one value a tick.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Time between two ticks, s.
    pub period: f64,
    /// True positions of each joint.
    pub q: Vec<Vec<f64>>,
    /// Measured positions.
    pub measured: Vec<Vec<f64>>,
    /// Measured velocities.
    pub velocity: Vec<Vec<f64>>,
    /// Torques at work after each tick.
    pub torque: Vec<Vec<f64>>,
    /// For each joint the number of ticks at the torque limit.
    pub saturated: Vec<usize>,
    /// True force of the tool on the surface along the normal, N; empty without a surface.
    pub force: Vec<f64>,
    /// Number of ticks in which the wrist sensor had a force and a moment beyond its range.
    pub beyond_range: [usize; 2],
    /// True position of the tool along each direction of the task, m; empty without a surface.
    pub tool: [Vec<f64>; 3],
    /// Adapted parameters at some instants: time, values.
    pub theta: Vec<(f64, Vec<f64>)>,
}

/// Runs a law on the true robot. `reference` has one series a joint.
pub(crate) fn closed_loop(
    truth: (&Robot, &Model),
    controller: &mut Controller<'_>,
    reference: &[Vec<Reference<f64>>],
    task: Option<&ContactTask>,
    settings: &Settings,
) -> Result<Trace, ControlError> {
    let (robot, model) = truth;
    let n = reference.len();
    let samples = reference.first().map_or(0, Vec::len);
    let start: Vec<f64> = reference.iter().map(|series| series[0].position).collect();
    let contact = task.map(|task| contact(robot, task)).transpose()?;
    let mut plant = Plant::new(model, contact, &start)?;
    let mut encoders = Encoders::new(robot, settings.rate, settings.resolution);
    let mut sensor = ForceSensor::of(robot, settings);
    let mut trace = empty(n, samples, settings.period());
    let (mut torque, mut next) = (vec![0.0; n], vec![0.0; n]);
    let mut wanted = vec![Reference::default(); n];
    for k in 0..samples {
        let t = k as f64 * settings.period();
        encoders.read(&plant.q, &plant.v);
        let force = plant.force()?;
        let read = match task {
            Some(_) => {
                let positions = [plant.link_q.as_slice(), &encoders.q];
                sensor.read(&model.chain, positions, plant.tool, force)?
            }
            None => [0.0; 3],
        };
        for (own, series) in wanted.iter_mut().zip(reference) {
            *own = series[k];
        }
        let input = Inputs {
            position: &encoders.q,
            velocity: &encoders.qd,
            reference: &wanted,
            task: task.map_or_else(Default::default, |task| task.reference(controller.kind, t)),
            force: read,
            feedforward: &[],
        };
        let limited = controller
            .step(&input, &mut next)
            .map_err(|fault| ControlError::Law {
                law: controller.kind.name(),
                time: t,
                fault,
            })?;
        // The first torque holds the arm at once: brakes open when the law runs.
        if k == 0 || !settings.delay {
            torque.copy_from_slice(&next);
        }
        for j in 0..n {
            trace.q[j].push(plant.link_q[j]);
            trace.measured[j].push(encoders.q[j]);
            trace.velocity[j].push(encoders.qd[j]);
            trace.torque[j].push(torque[j]);
            trace.saturated[j] += usize::from(limited.joint(j));
        }
        if let Some(task) = task {
            note_contact(&mut trace, task, model, &plant, force)?;
        }
        if let Some(theta) = controller.theta()
            && (k.is_multiple_of((samples / SNAPSHOTS).max(1)) || k + 1 == samples)
        {
            trace.theta.push((t, theta.to_vec()));
        }
        plant.advance(&torque, settings.period())?;
        torque.copy_from_slice(&next);
        stable(robot, &plant, controller, t)?;
    }
    trace.beyond_range = sensor.beyond;
    Ok(trace)
}

/// Returns the surface with the tool of the true robot on it.
fn contact<'a>(robot: &Robot, task: &'a ContactTask) -> Result<Contact<'a>, ControlError> {
    let truth = LawModel::of(robot)?;
    Ok(Contact {
        surface: task.surface,
        task: task.task(),
        inertia: free_inertia(&truth, &task.pose, task.tool, task.directions[0])?,
    })
}

fn empty(n: usize, samples: usize, period: f64) -> Trace {
    let series = || vec![Vec::with_capacity(samples); n];
    Trace {
        period,
        q: series(),
        measured: series(),
        velocity: series(),
        torque: series(),
        saturated: vec![0; n],
        ..Trace::default()
    }
}

fn note_contact(
    trace: &mut Trace,
    task: &ContactTask,
    model: &Model,
    plant: &Plant<'_>,
    force: [f64; 3],
) -> Result<(), ControlError> {
    let motion = (task
        .task()
        .motion(&model.chain, &plant.link_q, &plant.link_v))
    .map_err(super::design::at_start)?;
    let normal = task.directions[0];
    trace
        .force
        .push(-normal.iter().zip(force).map(|(n, f)| n * f).sum::<f64>() + 0.0);
    for (list, position) in trace
        .tool
        .iter_mut()
        .zip(motion.position)
        .take(task.directions.len())
    {
        list.push(position);
    }
    Ok(())
}

/// Refuses a motion that leaves all bounds.
fn stable(
    robot: &Robot,
    plant: &Plant<'_>,
    controller: &Controller<'_>,
    time: f64,
) -> Result<(), ControlError> {
    for (joint, &speed) in robot.joints.iter().zip(&plant.v) {
        let limit = joint.limits.as_ref().and_then(JointLimits::known_velocity);
        let limit = limit.unwrap_or(50.0);
        let factor = speed.abs() / limit;
        if !(factor <= UNSTABLE) {
            return Err(ControlError::Unstable {
                law: controller.kind.name(),
                joint: joint.name.clone(),
                speed,
                unit: match joint.kind {
                    JointKind::Revolute => "rad/s",
                    JointKind::Prismatic => "m/s",
                },
                time,
                factor,
            });
        }
    }
    Ok(())
}
