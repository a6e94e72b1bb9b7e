//! The wrench between wrist sensor and load, by Newton's and Euler's laws for the load in the base frame.
//!
//! The identification of loads has the wrench as a regressor in the frame of the last joint. Here the chain's poses are
//! isometries and all vectors are in the base frame, so that the two share no equation beyond the laws themselves.

use nalgebra::{Isometry3, Vector3};

use super::link_motion::LinkMotion;
use crate::robot::{CentredBody, Joint, JointKind, Load, Reads, Robot};

/// A load behind the wrist sensor of a robot.
///
/// Leaves out: the elasticity and the mass of the sensor, and all that the robot carries on its own side of it (the last
/// link, payloads of the description).
#[derive(Clone, Debug)]
pub struct LoadWrench<'a> {
    robot: &'a Robot,
    /// The axes from the base outwards.
    axes: Vec<Axis>,
    gravity: Vector3<f64>,
    /// The load in the flange frame.
    load: CentredBody,
    /// Pose of the sensor's axes in the flange frame.
    sensor: Isometry3<f64>,
    /// 1 for the wrench of the robot on the load, −1 for its opposite.
    sign: f64,
}

/// An axis, and the joint that moves it: its position is ratio · q + offset.
#[derive(Clone, Debug)]
struct Axis {
    own: Joint,
    joint: usize,
    ratio: f64,
    offset: f64,
}

/// Returns the axes of a robot from the base outwards.
fn axes(robot: &Robot) -> Vec<Axis> {
    let axis = |link: usize| {
        let (joint, ratio, offset) = robot.link_motion(link)?;
        Some(Axis {
            own: robot.link_as_joint(link)?,
            joint,
            ratio,
            offset,
        })
    };
    (robot.links_outwards().into_iter())
        .filter_map(axis)
        .collect()
}

/// Motion of a frame: its pose in the base frame and, in the base's axes, the acceleration of its origin, angular
/// velocity and angular acceleration.
#[derive(Clone, Copy, Debug)]
struct FrameMotion {
    pose: Isometry3<f64>,
    acceleration: Vector3<f64>,
    omega: Vector3<f64>,
    omega_dot: Vector3<f64>,
}

impl FrameMotion {
    /// Returns the acceleration of the point at `arm` from the origin, which moves with the frame.
    fn acceleration_at(&self, arm: Vector3<f64>) -> Vector3<f64> {
        self.acceleration + self.omega_dot.cross(&arm) + self.omega.cross(&self.omega.cross(&arm))
    }
}

impl<'a> LoadWrench<'a> {
    /// Puts a load behind the sensor of `robot`; `None` if the robot has no sensor, or the load has a first moment
    /// without a mass. A sensor whose sense is not described reads the load's wrench on the robot.
    pub fn new(robot: &'a Robot, load: &Load) -> Option<Self> {
        let sensor = robot.wrist_sensor.as_ref()?;
        Some(Self {
            robot,
            axes: axes(robot),
            gravity: Vector3::from(robot.gravity),
            load: load.centred()?,
            sensor: sensor.pose(),
            sign: sensor.reads.unwrap_or(Reads::Load).sign(),
        })
    }

    /// Returns the motion of the last axis' frame (Siciliano et al. 2009, eqs. 7.93 to 7.99, in the base frame).
    fn last_frame(&self, links: &LinkMotion) -> FrameMotion {
        let mut motion = FrameMotion {
            pose: Isometry3::identity(),
            acceleration: Vector3::zeros(),
            omega: Vector3::zeros(),
            omega_dot: Vector3::zeros(),
        };
        for axis in &self.axes {
            let (k, ratio) = (axis.joint, axis.ratio);
            let q = ratio * links.q[k] + axis.offset;
            let [qd, qdd] = [links.qd[k], links.qdd[k]].map(|rate| ratio * rate);
            let joint = &axis.own;
            let pose = motion.pose * joint.pose(q);
            let arm = pose.translation.vector - motion.pose.translation.vector;
            let axis = pose.rotation * Vector3::z();
            let mut next = FrameMotion {
                pose,
                acceleration: motion.acceleration_at(arm),
                ..motion
            };
            match joint.kind {
                JointKind::Revolute => {
                    next.omega += axis * qd;
                    next.omega_dot += axis * qdd + motion.omega.cross(&axis) * qd;
                }
                JointKind::Prismatic => {
                    next.acceleration += axis * qdd + 2.0 * motion.omega.cross(&axis) * qd;
                }
            }
            motion = next;
        }
        motion
    }

    /// Returns what a perfect sensor reads: fx fy fz, N, mx my mz, N·m, in its axes, moments about its origin.
    pub fn at(&self, links: &LinkMotion) -> [f64; 6] {
        let last = self.last_frame(links);
        let flange = last.pose * self.robot.flange_pose();
        let sensor = flange * self.sensor;
        let CentredBody {
            mass,
            centre,
            inertia,
        } = self.load;
        let centre = flange * nalgebra::Point3::from(centre);
        let acceleration = last.acceleration_at(centre.coords - last.pose.translation.vector);
        let force = mass * (acceleration - self.gravity);
        let turn = flange.rotation.to_rotation_matrix();
        let inertia = turn * inertia * turn.transpose();
        let spin = inertia * last.omega_dot + last.omega.cross(&(inertia * last.omega));
        let moment = spin + (centre.coords - sensor.translation.vector).cross(&force);
        let [force, moment] = [force, moment].map(|v| self.sign * (sensor.rotation.inverse() * v));
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::SVector;
    use rand::{RngExt, SeedableRng};
    use rig_shared::multibody::wrench_regressor;

    use super::*;
    use crate::robot::{
        Controller, Flange, Follower, IRP6_TEMPLATE, ONE_LINK_TEMPLATE, WristSensor,
    };
    use crate::simulate::{Inputs, Model, Since, closed_loop_watched};

    const G: f64 = 9.81;

    /// A massless link of 0.4 m that turns about a horizontal axis, with 2 kg at its end. The sensor sits at the axis.
    fn pendulum() -> (Robot, Load) {
        let text = ONE_LINK_TEMPLATE;
        let mut robot = Robot::from_toml(text, "one-link.toml".as_ref()).unwrap();
        robot.gravity = [0.0, 0.0, -G];
        robot.effects.clear();
        let joint = &mut robot.joints[0];
        joint.alpha = core::f64::consts::FRAC_PI_2;
        (joint.a, joint.theta, joint.d) = (0.0, 0.0, 0.0);
        (joint.inertial, joint.friction, joint.drive) = (None, None, None);
        robot.wrist_sensor = Some(WristSensor::default());
        let load = Load::of([2.0, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.32, 0.0, 0.32]);
        (robot, load)
    }

    /// At rest and free, from the horizontal: F = m·(g·cos θ + l·ω²) along the link, θ from straight down, and ω² = 2·g/l·cos θ by
    /// conservation of energy.
    #[test]
    fn swinging_point_mass_pulls_as_in_the_textbook() {
        let (robot, load) = pendulum();
        let wrench = LoadWrench::new(&robot, &load).unwrap();
        let at_rest = |q: f64| {
            let [q, qd, qdd] = [vec![q], vec![0.0], vec![0.0]];
            wrench.at(&LinkMotion { q, qd, qdd })
        };
        let down = at_rest(-core::f64::consts::FRAC_PI_2);
        assert!((down[0] - 2.0 * G).abs() < 1e-12 && down[5].abs() < 1e-12);
        let level = at_rest(0.0);
        assert!((level[1] + 2.0 * G).abs() < 1e-12);
        assert!((level[5] + 0.4 * 2.0 * G).abs() < 1e-12);

        let carrying = robot.with_load(&load);
        let model = Model::from_robot(&carrying).unwrap();
        let none = Controller {
            position_gain: 0.0,
            velocity_gain: 0.0,
            torque_gain: 0.0,
        };
        let inputs = Inputs {
            period: 1e-3,
            reference: &[vec![0.0; 2000]],
            feed_forward: &[],
            added: &[],
            q: &[0.0],
            v: &[0.0],
            substeps: 4,
            held: false,
        };
        let (mut fastest, mut worst) = (0.0_f64, 0.0_f64);
        let since = Since::default();
        closed_loop_watched(&carrying, &model, &[none], &inputs, &since, |_, links| {
            let height = -links.q[0].sin();
            let read = wrench.at(links);
            fastest = fastest.max(links.qd[0].abs());
            worst = worst.max((read[0] - 2.0 * (G * height + 2.0 * G * height)).abs());
            // Only gravity turns it: no force across the link, no moment about the axis.
            worst = worst.max(read[1].abs()).max(read[5].abs());
        })
        .unwrap();
        println!("{worst} N of {} N at most", 6.0 * G);
        assert!(fastest > 6.9, "{fastest}");
        assert!(worst < 1e-4 * 6.0 * G, "{worst}");
    }

    /// Agreement with the linear form in the ten parameters, for chains of both kinds of joints.
    #[test]
    fn wrench_is_that_of_the_regressor() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut draw = |size: f64| size * (2.0 * random.random::<f64>() - 1.0);
        let irp6 = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
        for round in 0..40 {
            let mut robot = irp6.clone();
            robot.gravity = [draw(5.0), draw(5.0), draw(10.0)];
            for (k, joint) in robot.joints.iter_mut().enumerate() {
                [joint.alpha, joint.a, joint.theta, joint.d] = [(); 4].map(|()| draw(1.5));
                if (round + k) % 3 == 0 {
                    joint.kind = JointKind::Prismatic;
                }
            }
            if round % 4 == 1 {
                // Axes that follow a joint: behind the first joint, and at the end.
                let last = robot.joints.last().map(|own| own.name.clone());
                let first = robot.joints[0].name.clone();
                for (after, follows, kind) in [
                    (Some(first.clone()), first.clone(), JointKind::Revolute),
                    (last, robot.joints[1].name.clone(), JointKind::Prismatic),
                ] {
                    robot.followers.push(Follower {
                        name: format!("f{}", robot.followers.len()),
                        follows,
                        ratio: draw(2.0),
                        offset: draw(0.5),
                        after,
                        kind,
                        alpha: draw(1.5),
                        a: draw(0.5),
                        theta: draw(1.5),
                        d: draw(0.5),
                        inertial: None,
                    });
                }
            }
            robot.flange = Flange {
                position: [(); 3].map(|()| draw(0.2)),
                rotation: [draw(3.0), draw(1.5), draw(3.0)],
            };
            robot.wrist_sensor = Some(WristSensor {
                position: [(); 3].map(|()| draw(0.2)),
                rotation: [(); 3].map(|()| draw(1.5)),
                reads: (round % 2 == 0).then_some(Reads::Robot),
                ..WristSensor::default()
            });
            let load = Load::of([
                1.0 + draw(0.5),
                draw(0.2),
                draw(0.2),
                draw(0.2),
                0.3,
                draw(0.1),
                draw(0.1),
                0.3,
                draw(0.1),
                0.3,
            ]);
            let mut state = |size: f64| robot.joints.iter().map(|_| draw(size)).collect();
            let links = LinkMotion {
                q: state(2.0),
                qd: state(3.0),
                qdd: state(20.0),
            };
            let found = LoadWrench::new(&robot, &load).unwrap().at(&links);
            let chain = robot.chain::<f64>().unwrap();
            let mut w = [0.0; 60];
            wrench_regressor(&chain, &links.q, &links.qd, &links.qdd, &mut w).unwrap();
            let phi = load.seen_from(&robot.flange_pose()).parameters();
            let joint = SVector::<f64, 6>::from_fn(|row, _| {
                (0..10).map(|c| w[row * 10 + c] * phi[c]).sum()
            });
            let sensor = robot.wrist_sensor.as_ref().unwrap();
            let pose = robot.flange_pose() * sensor.pose();
            let force: Vector3<f64> = joint.fixed_rows::<3>(0).into();
            let moment: Vector3<f64> = joint.fixed_rows::<3>(3).into();
            let back = pose.rotation.inverse();
            let sign = sensor.reads.map_or(-1.0, Reads::sign);
            let force_there = sign * (back * force);
            let moment_there = sign * (back * (moment - pose.translation.vector.cross(&force)));
            let size = joint.amax();
            for k in 0..3 {
                assert!((found[k] - force_there[k]).abs() < 1e-11 * size);
                assert!((found[3 + k] - moment_there[k]).abs() < 1e-11 * size);
            }
        }
    }
}
