//! Recordings of a load that is a set of mass points: force and moment by Newton's law for each point, whose acceleration
//! comes from differences of its position. No regressor and no recursion of the estimator is used.

use nalgebra::{Isometry3, Matrix3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns, WRENCH_COLUMNS, WRENCH_MESSAGE};
use rig_identify::chain_of;
use rig_model::robot::{Inertial, Robot};
use rig_shared::multibody::{Chain, point_position};

/// Mass points in the flange frame: kg, m.
pub(super) type Points = Vec<(f64, [f64; 3])>;

/// Returns the ten parameters of mass points.
pub(super) fn parameters(points: &Points) -> [f64; 10] {
    let mut sum = [0.0; 10];
    for (m, point) in points {
        for (to, value) in sum.iter_mut().zip(Inertial::point(*point).parameters()) {
            *to += m * value;
        }
    }
    sum
}

/// A bar of square section and a disc beside it: principal axes that are none of the flange's.
pub(super) fn tool() -> Points {
    let mut points: Points = (0..8)
        .map(|k| {
            let s = f64::from(k) / 7.0;
            (0.15, [0.02 + 0.12 * s, -0.03 * s, 0.05 + 0.1 * s])
        })
        .collect();
    points.extend((0..6).map(|k| {
        let a = f64::from(k) * std::f64::consts::FRAC_PI_3;
        (
            0.2,
            [0.05 * a.cos(), 0.05 * a.sin() - 0.02, 0.12 + 0.01 * a.sin()],
        )
    }));
    points
}

/// A robot that moves, and carries points.
pub(super) struct Moving {
    pub robot: Robot,
    chain: Chain<f64>,
    /// Amplitude and frequency (rad, Hz) of two sines a joint, about the middle of its range.
    sines: Vec<[[f64; 3]; 2]>,
    middle: Vec<f64>,
    /// Time of a movement and of the rest after it, s, if the robot goes from pose to pose.
    pub stops: Option<[f64; 2]>,
}

/// Step of the differences, s.
const STEP: f64 = 1e-3;

impl Moving {
    /// Builds a motion that uses `share` of the range of each joint and of its speed.
    pub(super) fn new(robot: Robot, share: f64, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let chain = chain_of(&robot).unwrap();
        let limits = robot.joints.iter().map(|j| j.limits.clone().unwrap());
        let mut sines = Vec::new();
        let mut middle = Vec::new();
        for (k, limits) in limits.enumerate() {
            let [low, high] = [limits.position[0].max(-3.0), limits.position[1].min(3.0)];
            let (span, speed) = (0.5 * share * (high - low), share * limits.velocity);
            let slow = 0.11 + 0.023 * k as f64;
            let fast = 0.53 + 0.071 * k as f64;
            let omega = std::f64::consts::TAU;
            let wide = (0.6 * span).min(0.5 * speed / (omega * slow));
            let quick = (0.4 * span).min(0.5 * speed / (omega * fast));
            sines.push([[wide, slow, draw()], [quick, fast, draw()]]);
            middle.push(0.5 * (low + high));
        }
        Self {
            robot,
            chain,
            sines,
            middle,
            stops: None,
        }
    }

    /// Returns the joint positions at a time.
    pub(super) fn position(&self, t: f64) -> Vec<f64> {
        let Some([moves, rests]) = self.stops else {
            return self.swung(t);
        };
        let number = (t / (moves + rests)).floor();
        let s = ((t - number * (moves + rests)) / moves).min(1.0);
        let share = s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
        let [from, to] = [number, number + 1.0].map(|k| self.swung(2.9 * k));
        let pairs = from.iter().zip(&to);
        pairs.map(|(a, b)| a + share * (b - a)).collect()
    }

    fn swung(&self, t: f64) -> Vec<f64> {
        (self.sines.iter().zip(&self.middle))
            .map(|(sines, middle)| {
                let sum: f64 = sines
                    .iter()
                    .map(|[a, f, phase]| a * (std::f64::consts::TAU * f * t + phase).sin())
                    .sum();
                middle + sum
            })
            .collect()
    }

    /// Returns the pose of a frame of the last link in the base at joint positions.
    fn pose(&self, q: &[f64], frame: &Isometry3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let last = self.chain.last_link();
        let at = |p: Vector3<f64>| {
            let mut unused = vec![[0.0; 3]; q.len()];
            Vector3::from(point_position(&self.chain, q, last, p.into(), &mut unused).unwrap())
        };
        let origin = at(frame.translation.vector);
        let axes: Vec<Vector3<f64>> = (0..3)
            .map(|k| {
                let mut unit = Vector3::zeros();
                unit[k] = 1.0;
                at(frame.translation.vector + frame.rotation * unit) - origin
            })
            .collect();
        (origin, Matrix3::from_columns(&[axes[0], axes[1], axes[2]]))
    }

    /// Returns the wrench of the robot on the points, in the axes of the sensor about its origin, while `q` moves.
    pub(super) fn wrench(&self, points: &Points, q: &dyn Fn(f64) -> Vec<f64>, t: f64) -> [f64; 6] {
        let robot = &self.robot;
        let sensor = robot.flange_pose() * robot.wrist_sensor.clone().unwrap_or_default().pose();
        let place = |t: f64, point: &[f64; 3]| {
            let in_joint = robot.flange_pose() * nalgebra::Point3::from(*point);
            let frame = Isometry3::translation(in_joint.x, in_joint.y, in_joint.z);
            self.pose(&q(t), &frame).0
        };
        let gravity = Vector3::from(self.chain.gravity());
        let (origin, axes) = self.pose(&q(t), &sensor);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for (m, point) in points {
            let at = |k: f64| place(t + k * STEP, point);
            let here = at(0.0);
            let acceleration = ((at(1.0) + at(-1.0)) * 16.0 - at(2.0) - at(-2.0) - here * 30.0)
                / (12.0 * STEP * STEP);
            let own = (acceleration - gravity) * *m;
            force += own;
            moment += (here - origin).cross(&own);
        }
        let (force, moment) = (axes.transpose() * force, axes.transpose() * moment);
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }

    /// Returns a recording with forces and moments in the axes of the base instead of those of the sensor.
    pub(super) fn in_base_axes(&self, recording: &InMemory) -> InMemory {
        let robot = &self.robot;
        let sensor = robot.flange_pose() * robot.wrist_sensor.clone().unwrap_or_default().pose();
        let mut turned = recording.clone();
        for block in &mut turned.blocks {
            for k in 0..block.t.len() {
                let q: Vec<f64> = block.joints.iter().map(|own| own.q[k]).collect();
                let axes = self.pose(&q, &sensor).1;
                for first in [0, 3] {
                    let read = Vector3::from_fn(|c, _| block.extra[first + c].1[k]);
                    let read = axes * read;
                    (0..3).for_each(|c| block.extra[first + c].1[k] = read[c]);
                }
            }
        }
        turned
    }

    /// Returns the torques of the joints that carry the points: the virtual work of each point (d'Alembert).
    pub(super) fn torques(&self, points: &Points, t: f64) -> Vec<f64> {
        let robot = &self.robot;
        let n = self.middle.len();
        let mut torques = vec![0.0; n];
        let gravity = Vector3::from(self.chain.gravity());
        for (m, point) in points {
            let in_joint = robot.flange_pose() * nalgebra::Point3::from(*point);
            let at = |k: f64, slopes: &mut Vec<[f64; 3]>| {
                let q = self.position(t + k * STEP);
                let last = self.chain.last_link();
                let p = point_position(&self.chain, &q, last, in_joint.coords.into(), slopes);
                Vector3::from(p.unwrap())
            };
            let mut unused = vec![[0.0; 3]; n];
            let near = at(1.0, &mut unused) + at(-1.0, &mut unused);
            let far = at(2.0, &mut unused) + at(-2.0, &mut unused);
            let mut slopes = vec![[0.0; 3]; n];
            let here = at(0.0, &mut slopes);
            let acceleration = (near * 16.0 - far - here * 30.0) / (12.0 * STEP * STEP);
            for (torque, slope) in torques.iter_mut().zip(&slopes) {
                *torque += m * (acceleration - gravity).dot(&Vector3::from(*slope));
            }
        }
        torques
    }
}

/// Noise and flaws of a sensor.
#[derive(Clone)]
pub(super) struct Sensor {
    /// Standard deviation of forces, N, and moments, N·m.
    pub noise: [f64; 2],
    /// Bias, as read.
    pub bias: [f64; 6],
    /// 1: the robot's wrench on the load; −1: its opposite.
    pub sign: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            noise: [0.1, 0.01],
            bias: [3.0, -5.0, 8.0, 0.3, -0.1, 0.2],
            sign: -1.0,
        }
    }
}

impl Sensor {
    /// Returns the readings of a wrench.
    pub(super) fn read(&self, wrench: [f64; 6], random: &mut Pcg64) -> [f64; 6] {
        std::array::from_fn(|c| {
            let noise: f64 = StandardNormal.sample(random);
            self.sign * wrench[c] + self.bias[c] + self.noise[c / 3] * noise
        })
    }
}

/// Returns a recording of `seconds` at `rate` Hz, its readings changed by `flaw` (row time, readings).
pub(super) fn recorded(
    moving: &Moving,
    points: &Points,
    sensor: &Sensor,
    [seconds, rate]: [f64; 2],
    seed: u64,
    flaw: &dyn Fn(f64, [f64; 6]) -> [f64; 6],
) -> InMemory {
    let mut random = Pcg64::seed_from_u64(seed);
    let rows = (seconds * rate) as usize;
    let t: Vec<f64> = (0..rows).map(|k| k as f64 / rate).collect();
    let read: Vec<[f64; 6]> = t
        .iter()
        .map(|t| {
            let wrench = moving.wrench(points, &|t| moving.position(t), *t);
            flaw(*t, sensor.read(wrench, &mut random))
        })
        .collect();
    let q: Vec<Vec<f64>> = t.iter().map(|t| moving.position(*t)).collect();
    block(format!("made {seed}"), t, q, &read)
}

/// Returns a recording of 30 s whose rows have 1 kHz, with a sensor of `rate` Hz that begins `late` s after the first row, and
/// whose readings are interpolated to the rows as those of another topic are.
pub(super) fn interpolated(
    moving: &Moving,
    points: &Points,
    sensor: &Sensor,
    [rate, late]: [f64; 2],
    seed: u64,
    flaw: &dyn Fn(f64, [f64; 6]) -> [f64; 6],
) -> InMemory {
    let mut random = Pcg64::seed_from_u64(seed);
    let messages: Vec<[f64; 6]> = (0..(30.0 * rate) as usize)
        .map(|k| {
            let t = late + k as f64 / rate;
            let wrench = moving.wrench(points, &|t| moving.position(t), t);
            flaw(t, sensor.read(wrench, &mut random))
        })
        .collect();
    let places = (0..30_000).map(|k| (k, (f64::from(k) * 1e-3 - late) * rate));
    let places: Vec<(i32, f64)> = places
        .filter(|(_, place)| *place >= 0.0 && *place < messages.len() as f64 - 1.0)
        .collect();
    let t: Vec<f64> = places.iter().map(|(k, _)| f64::from(*k) * 1e-3).collect();
    let q = t.iter().map(|t| moving.position(*t)).collect();
    let read: Vec<[f64; 6]> = (places.iter())
        .map(|(_, place)| {
            let (before, share) = (*place as usize, place.fract());
            let [a, b] = [messages[before], messages[before + 1]];
            std::array::from_fn(|c| a[c] + share * (b[c] - a[c]))
        })
        .collect();
    let mut made = block(format!("interpolated {seed}"), t, q, &read);
    let numbers = places.iter().map(|(_, place)| place + 1.5).collect();
    made.blocks[0]
        .extra
        .push((WRENCH_MESSAGE.to_owned(), numbers));
    made
}

/// Returns a recording of poses, one row each.
pub(super) fn poses(
    moving: &Moving,
    points: &Points,
    sensor: &Sensor,
    list: &[Vec<f64>],
    seed: u64,
) -> InMemory {
    let mut random = Pcg64::seed_from_u64(seed);
    let read: Vec<[f64; 6]> = list
        .iter()
        .map(|q| sensor.read(moving.wrench(points, &|_| q.clone(), 0.0), &mut random))
        .collect();
    let t = (0..list.len()).map(|k| k as f64).collect();
    block(format!("poses {seed}"), t, list.to_vec(), &read)
}

fn block(label: String, t: Vec<f64>, q: Vec<Vec<f64>>, read: &[[f64; 6]]) -> InMemory {
    let joints = q.first().map_or(0, Vec::len);
    let joints = (0..joints).map(|j| JointColumns {
        q: q.iter().map(|row| row[j]).collect(),
        ..JointColumns::default()
    });
    let extra = WRENCH_COLUMNS.iter().enumerate();
    InMemory {
        label,
        blocks: vec![Block {
            joints: joints.collect(),
            extra: extra
                .map(|(c, name)| ((*name).to_owned(), read.iter().map(|row| row[c]).collect()))
                .collect(),
            t,
            first_line: 2,
            ..Block::default()
        }],
    }
}
