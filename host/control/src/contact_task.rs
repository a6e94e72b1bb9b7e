//! The task of a tool that presses on a surface: where the arm stands, what it presses, and along what it slides.

use nalgebra::{DMatrix, Matrix3, SymmetricEigen, Vector3};

use super::design::at_start;
use super::error::ControlError;
use super::law_model::LawModel;
use super::mobility::{jacobian, mobility};
use super::settings::{LawKind, Settings};
use super::surface::Surface;
use rig_shared::control::arm::Task;
use rig_shared::control::arm::impedance::Target;
use rig_shared::multibody::gravity_vector;
use rig_shared::trajectory::Reference;

/// Largest share of the torque limits that a default force takes in the start pose.
const FORCE_SHARE: f64 = 0.25;
/// Largest default force, N.
const FORCE: f64 = 20.0;
/// Largest default approach speed, m/s.
const APPROACH: f64 = 0.05;
/// Kinetic energy at contact over the elastic energy at the wanted force, square root. At a half the impact alone presses
/// with half of the wanted force. The surface's damping presses with the same share at most, before its spring does.
const IMPACT: f64 = 0.5;
/// Damping by the late force over that of the force loop, 1: k·τ/(Λ·kv). At one both are equal, and the force settles in
/// about twice the time. Without dry friction the one-link rig settled on 10⁵ N/m in 0.03 s at 0.63, in 0.16 s at 2.5 and in
/// 1.0 s at 10 (27 November 2026).
const LATE: f64 = 1.0;
/// Control ticks in a period of the force loop's bandwidth, 1. At 1000 ticks a second, with one tick of delay, a velocity of
/// 100 Hz and encoder steps of 1e-5 rad, 100 kept all robots quiet, also with the observer's gain doubled; 33 with this
/// doubled gain gave limit cycles of the force on IRp-6 and EDDA (27 November 2026).
const TICKS: f64 = 100.0;
/// Largest bandwidth of the force loop, in bandwidths of the position loops, 1. Those say how fast the arm's mechanics may be
/// moved. With 8 the encoder's steps gave limit cycles on IRp-6 at 4000 ticks a second (27 November 2026).
const FASTEST: f64 = 4.0;
/// Mobility along a direction, as a share of the largest, from which the tool can be moved along it. The square root is
/// the ratio of distances: a hundredth.
pub(crate) const MOBILE: f64 = 1e-4;
/// Time between contact, slide and end, s.
const SETTLE: f64 = 3.0;
/// Time for the force to settle on a soft surface after the way into it at the speed of the approach, s. The force loop needs
/// five times 1/(2π·10 Hz) and the measures half a second.
const RESTED: f64 = 1.5;
/// Time of the impedance's approach, as a share of that before the slide.
const IMPEDANCE_SHARE: f64 = 0.6;
/// Highest speed of a fifth-degree motion over its mean.
const QUINTIC_PEAK: f64 = 15.0 / 8.0;
/// Longest approach that is simulated, s.
const LONGEST: f64 = 600.0;

/// What to press, and where; `None` for a default that fits the robot.
#[derive(Clone, Debug, Default)]
pub struct ContactOptions {
    /// The surface.
    pub surface: Surface,
    /// Tool point in the frame of the last joint, m.
    pub tool: Option<[f64; 3]>,
    /// Start pose, rad or m.
    pub pose: Option<Vec<f64>>,
    /// Direction into the surface, in the base frame.
    pub normal: Option<[f64; 3]>,
    /// Wanted force, N.
    pub force: Option<f64>,
    /// Length of the slide along the surface, m.
    pub slide: f64,
    /// Stiffness of the impedance, N/m.
    pub stiffness: Option<f64>,
}

/// A task that fits a robot.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ContactTask {
    /// The surface.
    pub surface: Surface,
    /// Tool point in the frame of the last joint, m.
    pub tool: [f64; 3],
    /// Start pose, rad or m.
    pub pose: Vec<f64>,
    /// Start of the tool in the base frame, m: the origin of the task.
    pub origin: [f64; 3],
    /// Directions in the base frame: into the surface first, then along it.
    pub directions: Vec<[f64; 3]>,
    /// Inertia of the tool along each direction, kg, while it does not move along the others.
    pub inertia: Vec<f64>,
    /// Wanted force, N.
    pub force: f64,
    /// Force that the torque limits allow in the start pose, N; infinite without limits.
    #[serde(skip)]
    pub largest_force: f64,
    /// Planned highest speed of the hybrid law's approach, m/s.
    pub approach: f64,
    /// Bandwidth of the force loop, Hz.
    pub force_bandwidth: f64,
    /// Length of the slide, m.
    pub slide: f64,
    /// Behaviour of the impedance along each direction.
    #[serde(skip)]
    pub targets: Vec<Target<f64>>,
    /// Time at which the slide begins, s.
    pub slide_start: f64,
    /// End of the motion, s.
    pub duration: f64,
    /// What was chosen, one sentence each.
    pub notes: Vec<String>,
}

/// Returns the directions: `normal` first, then those along the surface that the tool can be moved along.
fn directions(mobility: &Matrix3<f64>, normal: Vector3<f64>) -> Vec<Vector3<f64>> {
    let largest = mobility.diagonal().max();
    let mut chosen = vec![normal];
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let along = chosen.iter().fold(axis, |left, d| left - d * d.dot(&axis));
        if along.norm() < 0.1 {
            continue;
        }
        let along = along.normalize();
        let all: Vec<_> = chosen.iter().copied().chain([along]).collect();
        let sub = DMatrix::from_fn(all.len(), all.len(), |a, b| {
            all[a].dot(&(mobility * all[b]))
        });
        if SymmetricEigen::new(sub).eigenvalues.min() > MOBILE * largest {
            chosen.push(along);
        }
    }
    chosen
}

fn choose_normal(
    mobility: &Matrix3<f64>,
    given: Option<[f64; 3]>,
    notes: &mut Vec<String>,
) -> Result<Vector3<f64>, ControlError> {
    let largest = mobility.diagonal().max();
    let moves = |d: &Vector3<f64>| d.dot(&(mobility * d)) > 100.0 * MOBILE * largest;
    if let Some(given) = given {
        let normal = Vector3::from(given);
        if !(normal.norm() > 1e-6 && normal.norm().is_finite()) {
            return Err(ControlError::Unreachable(format!(
                "The normal {given:?} is not a direction: give three numbers that are not all 0."
            )));
        }
        let normal = normal.normalize();
        return match moves(&normal) {
            true => Ok(normal),
            false => Err(ControlError::Unreachable(format!(
                "The tool cannot press along {given:?} in the start pose: the arm does not move it there. Give another --normal or --pose."
            ))),
        };
    }
    let candidates = [-Vector3::z(), Vector3::x(), Vector3::y()];
    let normal = candidates.into_iter().find(moves).ok_or_else(|| {
        ControlError::Unreachable("The arm moves the tool along no axis of the base in the start pose; give --tool, --pose or --normal.".to_owned())
    })?;
    notes.push(format!(
        "No normal is given: the tool presses along {:?} of the base frame.",
        <[f64; 3]>::from(normal).map(|v| v + 0.0)
    ));
    Ok(normal)
}

/// Returns the inertia of the tool along each direction while it moves along all of them, kg.
fn inertias(
    mobility: &Matrix3<f64>,
    directions: &[Vector3<f64>],
) -> Result<Vec<f64>, ControlError> {
    let count = directions.len();
    let along = DMatrix::from_fn(count, count, |a, b| {
        directions[a].dot(&(mobility * directions[b]))
    });
    match along.try_inverse() {
        Some(inverse) => Ok(inverse.diagonal().as_slice().to_vec()),
        None => Err(ControlError::Unreachable(
            "The start pose is singular; give another --pose.".to_owned(),
        )),
    }
}

impl ContactTask {
    /// Returns the reference of the joints, joint by joint: the start pose at rest, over `ticks` control ticks.
    pub fn joint_reference(&self, ticks: usize) -> Vec<Vec<Reference<f64>>> {
        let at_rest = |q: &f64| {
            let at = Reference {
                position: *q,
                ..Reference::default()
            };
            vec![at; ticks]
        };
        self.pose.iter().map(at_rest).collect()
    }

    /// Returns the task from a start pose, with defaults where the options leave them open.
    ///
    /// # Errors
    /// [`ControlError`] if the tool cannot press there.
    pub(crate) fn at(
        model: &LawModel,
        options: &ContactOptions,
        settings: &Settings,
        (pose, tool): (Vec<f64>, [f64; 3]),
        mut notes: Vec<String>,
    ) -> Result<Self, ControlError> {
        let surface = options.surface;
        let (origin, matrix) = jacobian(model, &pose, tool)?;
        let mobility = mobility(model, &pose, &matrix)?;
        let normal = choose_normal(&mobility, options.normal, &mut notes)?;
        let directions = directions(&mobility, normal);
        let count = directions.len();
        let inertia = inertias(&mobility, &directions)?;
        let [force, largest_force] =
            force(model, &pose, &matrix, normal, options.force, &mut notes)?;
        if let Some(rate) = needed_rate(&surface, inertia[0], settings) {
            notes.push(format!(
                "The measured force is late on this stiff surface for a tool of {:.3} kg, and the force settles slowly: give --rate {rate:.0}, or a softer surface.",
                inertia[0]
            ));
        }
        let stiffest = IMPACT * force / (surface.stiffness * inertia[0]).sqrt();
        // Without damping it is infinite.
        let damped = IMPACT * force / surface.damping;
        let targets = targets(&inertia, options.stiffness, settings);
        let approach = stiffest.min(damped).min(APPROACH);
        let speed = planned_speed(approach, force, &surface, settings);
        let way = surface.gap + depth(force, &targets, &surface);
        // The approach's speed is a bound inside a soft surface, too.
        let into = force / (surface.stiffness * speed);
        let slide_start = (1.2 * surface.gap / speed + SETTLE.max(into + RESTED))
            .max(QUINTIC_PEAK * way / (IMPEDANCE_SHARE * damped));
        if !(slide_start < LONGEST) {
            return Err(ControlError::Unreachable(format!(
                "With {force} N on this surface the tool comes at {} m/s, so that the approach takes {slide_start:.0} s, of which {LONGEST:.0} are simulated. Give a larger --press, a smaller --gap, or a softer or less damped surface.",
                rig_output::format_significant(speed, 3)
            )));
        }
        let slides = count > 1 && options.slide > 0.0;
        if options.slide > 0.0 && !slides {
            notes.push("There is no slide: the arm moves the tool along no direction of the surface without leaving it.".to_owned());
        }
        Ok(Self {
            surface,
            tool,
            pose,
            origin,
            directions: directions.iter().map(|d| (*d).into()).collect(),
            targets,
            inertia,
            force,
            largest_force,
            approach,
            force_bandwidth: force_bandwidth(settings),
            slide: if slides { options.slide } else { 0.0 },
            slide_start,
            duration: slide_start + if slides { SETTLE + 1.0 } else { 1.0 },
            notes,
        })
    }

    /// Returns the task as the laws take it.
    pub fn task(&self) -> Task<'_, f64> {
        Task {
            tool: self.tool,
            origin: self.origin,
            directions: &self.directions,
        }
    }

    /// Returns the reference of the tool at time `t` along each direction. For impedance it goes into the surface until
    /// the two springs press with the wanted force.
    pub(crate) fn reference(&self, law: LawKind, t: f64) -> [Reference<f64>; 3] {
        let mut out = [Reference::default(); 3];
        if law == LawKind::Impedance {
            let way = self.surface.gap + depth(self.force, &self.targets, &self.surface);
            out[0] = quintic(way, IMPEDANCE_SHARE * self.slide_start, t);
        }
        let since = t - self.slide_start;
        if self.slide > 0.0 && (0.0..SETTLE).contains(&since) {
            // There and back. Without a step of the acceleration the friction changes its direction while the force loop can
            // still follow.
            let half = 0.5 * SETTLE;
            out[1] = match since < half {
                true => quintic(self.slide, half, since),
                false => reversed(quintic(self.slide, half, SETTLE - since)),
            };
        }
        out
    }
}

/// Returns a motion that runs backwards in time.
fn reversed(motion: Reference<f64>) -> Reference<f64> {
    Reference {
        velocity: -motion.velocity,
        ..motion
    }
}

/// Returns the behaviour of the impedance along each direction: critically damped at a fifth of the position loops'
/// bandwidth, with the given stiffness or that of this frequency.
fn targets(inertia: &[f64], stiffness: Option<f64>, settings: &Settings) -> Vec<Target<f64>> {
    let bandwidth = 0.2 * settings.bandwidth;
    let omega = core::f64::consts::TAU * bandwidth;
    let own = |mass: &f64| stiffness.unwrap_or(mass * omega * omega);
    (inertia.iter())
        .map(|mass| Target::design(own(mass), bandwidth, 1.0))
        .collect()
}

/// Returns how far behind the surface the reference of the impedance goes to press with `force`, m.
fn depth(force: f64, targets: &[Target<f64>], surface: &Surface) -> f64 {
    let arm = targets.first().map_or(0.0, |own| force / own.stiffness);
    arm + force / surface.stiffness
}

/// Returns the bandwidth of the force loop, Hz: as high as the rate allows, and at most [`FASTEST`] times that of the
/// position loops.
fn force_bandwidth(settings: &Settings) -> f64 {
    (settings.rate / TICKS).min(FASTEST * settings.bandwidth)
}

/// Returns the lowest rate at which the force loop is as fast as it becomes, Hz; `None` if the settings have it.
pub(crate) fn fastest_rate(settings: &Settings) -> Option<f64> {
    let rate = TICKS * FASTEST * settings.bandwidth;
    (settings.rate < rate).then_some(rate)
}

/// Returns the speed for which the time of the approach is planned, m/s: at most that of the hybrid law, kf·f. The force
/// of the impedance grows while its reference goes into the surface, so its approach takes the time that a force loop of half
/// the position loops' bandwidth would need, at any rate.
fn planned_speed(approach: f64, force: f64, surface: &Surface, settings: &Settings) -> f64 {
    let speed = |bandwidth: f64| core::f64::consts::TAU * bandwidth * force / surface.stiffness;
    let hybrid = speed(force_bandwidth(settings));
    approach.min(hybrid).min(speed(0.5 * settings.bandwidth))
}

/// Returns the rate that a surface needs, Hz; `None` if that of the settings is enough. The force that is taken off the arm
/// is late by the computing time and half a tick: the rest of it damps the tool with k·τ.
pub(crate) fn needed_rate(surface: &Surface, inertia: f64, settings: &Settings) -> Option<f64> {
    let ticks = settings.lateness() * settings.rate;
    // The rate times the bandwidth of the force loop.
    let needed = surface.stiffness * ticks / (2.0 * core::f64::consts::TAU * inertia * LATE);
    let rising = (needed * TICKS).sqrt();
    let rate = rising.max(needed / (FASTEST * settings.bandwidth));
    (rate > settings.rate).then(|| (1.01 * rate).ceil())
}

fn quintic(distance: f64, duration: f64, t: f64) -> Reference<f64> {
    let u = (t / duration).clamp(0.0, 1.0);
    Reference {
        position: distance * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u),
        velocity: distance / duration * 30.0 * u * u * (1.0 - u).powi(2),
        acceleration: distance / duration.powi(2) * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
    }
}

/// Chooses the force, and checks that the torque limits allow it in the start pose. Returns the largest one, too.
fn force(
    model: &LawModel,
    pose: &[f64],
    matrix: &DMatrix<f64>,
    normal: Vector3<f64>,
    given: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<[f64; 2], ControlError> {
    let mut gravity = vec![0.0; pose.len()];
    gravity_vector(&model.chain, &model.parameters, pose, &mut gravity)
        .map_err(|error| at_start(error.into()))?;
    let mut most = f64::INFINITY;
    for (j, joint) in model.robot.joints.iter().enumerate() {
        let torque = matrix.column(j).dot(&normal).abs();
        if let Some(limit) = joint.limits.as_ref().and_then(|l| l.torque)
            && torque > 1e-9
        {
            most = most.min((limit - gravity[j].abs()).max(0.0) / torque);
        }
    }
    let force = match given {
        Some(force) => force,
        None => {
            let force = FORCE.min(FORCE_SHARE * most);
            notes.push(format!(
                "No force is given: the tool presses with {force:.3} N."
            ));
            force
        }
    };
    if !(force > 0.0 && force < most) {
        return Err(ControlError::Unreachable(format!(
            "A force of {force} N is not possible: in the start pose the torque limits allow more than 0 and less than {most:.3} N; give another --press or --pose."
        )));
    }
    Ok([force, most])
}
