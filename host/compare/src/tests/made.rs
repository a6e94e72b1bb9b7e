//! Recordings of a planar arm of two links, from its equations of motion in closed form.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_identify::Options;
use rig_model::robot::{Joint, JointKind, Robot};

use crate::{CompareOptions, Comparison, RecordingSet, compare};

const G: f64 = 9.81;
/// Length of the first link, m.
const A: f64 = 0.5;
/// Samples per second.
const RATE: f64 = 200.0;

/// True parameters of the arm.
#[derive(Clone, Debug)]
pub(super) struct Truth {
    /// Izz1 + Ia1 + a²·m2, mx1 + a·m2, my1.
    pub first: [f64; 3],
    /// Izz2, Ia2, mx2, my2.
    pub second: [f64; 4],
    /// fv, fc, off by joint.
    pub friction: [[f64; 3]; 2],
    /// Factor of all torques as recorded.
    pub scale: f64,
    /// Share by which the viscous friction of each joint is higher at the start, and its time constant, s.
    pub cold: [f64; 2],
}

impl Default for Truth {
    fn default() -> Self {
        Self {
            first: [1.1, 1.4, 0.05],
            second: [0.12, 0.2, 0.35, -0.02],
            friction: [[0.8, 1.2, 0.1], [0.4, 0.6, -0.05]],
            scale: 1.0,
            cold: [0.0, 8.0],
        }
    }
}

impl Truth {
    /// Adds a point mass on the second link.
    pub(super) fn with_payload(mut self, mass: f64, [x, y]: [f64; 2]) -> Self {
        self.first[0] += A * A * mass;
        self.first[1] += A * mass;
        self.second[0] += mass * (x * x + y * y);
        self.second[2] += mass * x;
        self.second[3] += mass * y;
        self
    }

    /// Returns the value of a base parameter by its column name.
    pub(super) fn value(&self, expression: &str) -> f64 {
        let name = expression.split(' ').next().unwrap();
        let [f1, f2] = self.friction;
        let value = match name {
            "Izz1" => self.first[0],
            "mx1" => self.first[1],
            "my1" => self.first[2],
            "Izz2" => self.second[0],
            "Ia2" => self.second[1],
            "mx2" => self.second[2],
            "my2" => self.second[3],
            "fv1" => f1[0],
            "fc1" => f1[1],
            "off1" => f1[2],
            "fv2" => f2[0],
            "fc2" => f2[1],
            "off2" => f2[2],
            _ => panic!("no such parameter: {expression}"),
        };
        value * self.scale
    }

    /// Returns the torques by Lagrange's equations.
    fn torque(&self, time: f64, [q, v, w]: [[f64; 2]; 3]) -> [f64; 2] {
        let cold = 1.0 + self.cold[0] * (-time / self.cold[1]).exp();
        let [inertia, mx1, my1] = self.first;
        let [izz2, ia2, mx2, my2] = self.second;
        let (s2, c2) = q[1].sin_cos();
        let (along, across) = (mx2 * c2 - my2 * s2, mx2 * s2 + my2 * c2);
        let sum = q[0] + q[1];
        let weight = G * (mx2 * sum.cos() - my2 * sum.sin());
        let second =
            izz2 * (w[0] + w[1]) + A * (along * w[0] + across * v[0] * v[0]) + weight + ia2 * w[1];
        let first = inertia * w[0]
            + izz2 * (w[0] + w[1])
            + A * (along * (2.0 * w[0] + w[1]) - across * (v[1] * v[1] + 2.0 * v[0] * v[1]))
            + G * (mx1 * q[0].cos() - my1 * q[0].sin())
            + weight;
        let rub = |j: usize| {
            let [fv, fc, off] = self.friction[j];
            cold * fv * v[j] + fc * v[j].signum() + off
        };
        [first + rub(0), second + rub(1)].map(|t| t * self.scale)
    }
}

/// Description of the arm; its values are far from the truth.
pub(super) fn robot() -> Robot {
    let joint = |name: &str, alpha: f64, a: f64| {
        Joint::new(name, JointKind::Revolute, [alpha, a, 0.0, 0.0])
    };
    Robot::new(
        "arm",
        vec![
            joint("first", std::f64::consts::FRAC_PI_2, 0.0),
            joint("second", 0.0, A),
        ],
    )
}

/// How a recording is made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Made {
    /// Seed of motion and noise.
    pub seed: u64,
    /// Duration, s.
    pub seconds: f64,
    /// Size of the motion, 1 for a lively one.
    pub size: [f64; 2],
    /// True for a single sine a joint.
    pub pure: bool,
    /// Standard deviation of the torque noise, N·m; correlated over 25 ms.
    pub noise: f64,
    /// What each joint's recorded position is too large by, rad.
    pub zero: [f64; 2],
    /// What each joint's recorded torque is multiplied by.
    pub reads: [f64; 2],
}

impl Made {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            seed,
            seconds: 20.0,
            size: [1.0; 2],
            pure: false,
            noise: 0.05,
            zero: [0.0; 2],
            reads: [1.0; 2],
        }
    }

    /// Makes the recording.
    pub(super) fn recording(&self, truth: &Truth) -> InMemory {
        let mut random = Pcg64::seed_from_u64(self.seed);
        let sines: Vec<[[f64; 3]; 3]> = (0..2)
            .map(|j| {
                let others = if self.pure { 0.0 } else { 1.0 };
                [(0.7, 1.1), (others * 0.4, 2.7), (others * 0.15, 6.1)].map(|(a, w)| {
                    let w = w * (0.85 + 0.3 * random.random::<f64>()) * (1.0 + 0.13 * j as f64);
                    [
                        self.size[j] * a,
                        w,
                        std::f64::consts::TAU * random.random::<f64>(),
                    ]
                })
            })
            .collect();
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        let rows = (self.seconds * RATE) as usize;
        let mut joints = vec![JointColumns::default(); 2];
        let mut coloured = [0.0; 2];
        let mut t = Vec::with_capacity(rows);
        let rho: f64 = 0.8;
        for k in 0..rows {
            let time = k as f64 / RATE;
            let [mut q, mut v, mut w] = [[0.0; 2]; 3];
            for j in 0..2 {
                q[j] = [-0.3, 0.2][j];
                for [a, omega, phase] in &sines[j] {
                    let (s, c) = (omega * time + phase).sin_cos();
                    q[j] += a * s;
                    v[j] += a * omega * c;
                    w[j] -= a * omega * omega * s;
                }
            }
            let tau = truth.torque(time, [q, v, w]);
            for j in 0..2 {
                coloured[j] = rho * coloured[j] + (1.0 - rho * rho).sqrt() * self.noise * normal();
                joints[j].q.push(q[j] + self.zero[j] + 1e-5 * normal());
                joints[j].tau.push(self.reads[j] * (tau[j] + coloured[j]));
            }
            t.push(time);
        }
        InMemory {
            label: format!("made {}", self.seed),
            blocks: vec![Block {
                t,
                joints,
                first_line: 2,
                ..Block::default()
            }],
        }
    }
}

/// Compares one recording of each truth.
pub(super) fn compared(list: &[(Made, Truth)]) -> Comparison {
    let robot = robot();
    let recordings: Vec<InMemory> = list
        .iter()
        .map(|(made, truth)| made.recording(truth))
        .collect();
    let sets: Vec<RecordingSet> = (recordings.iter().enumerate())
        .map(|(k, recording)| RecordingSet {
            name: format!("set {k}"),
            recordings: vec![recording],
        })
        .collect();
    let options = CompareOptions {
        identify: Options {
            estimator: rig_identify::Estimator::Weighted,
            ..Options::default()
        },
        ..CompareOptions::default()
    };
    compare(&robot, &sets, &options).unwrap()
}
