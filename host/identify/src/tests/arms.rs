//! Arms of several joints, recorded by a separate integration.

use super::*;
use rig_model::robot::{Controller, Inertial, JointFriction};
use rig_shared::multibody::{COLUMNS, forward_dynamics};

/// Uniform from −1 to 1.
pub(super) struct Chance(rand_pcg::Pcg64);

impl Chance {
    pub(super) fn new(seed: u64) -> Self {
        Self(rand_pcg::Pcg64::seed_from_u64(seed))
    }
    pub(super) fn even(&mut self) -> f64 {
        2.0 * self.0.random::<f64>() - 1.0
    }
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.0.random::<f64>()).sum::<f64>() - 6.0
    }
}

/// Ten parameters of six point masses: a possible body.
pub(super) fn body(chance: &mut Chance, mass: f64, size: f64) -> [f64; 10] {
    let mut p = [0.0; 10];
    for _ in 0..6 {
        let m = mass / 6.0 * (1.0 + 0.5 * chance.even());
        let [x, y, z] = [0; 3].map(|_| size * (0.3 + chance.even()));
        for (to, v) in p.iter_mut().zip([
            1.0,
            x,
            y,
            z,
            y * y + z * z,
            -x * y,
            -x * z,
            x * x + z * z,
            -y * z,
            x * x + y * y,
        ]) {
            *to += m * v;
        }
    }
    p
}

/// An arm of `n` revolute joints, alternating right angles between neighbours, complete for simulation.
pub(super) fn arm(n: usize, seed: u64) -> Robot {
    let mut chance = Chance::new(seed);
    let right = std::f64::consts::FRAC_PI_2;
    let joints = (0..n)
        .map(|i| {
            let mut j = joint(
                JointKind::Revolute,
                [right, -right, 0.0, right, -right, right, -right][i % 7],
            );
            j.name = format!("j{}", i + 1);
            j.a = if i > 0 {
                0.15 + 0.1 * chance.even()
            } else {
                0.0
            };
            j.d = 0.2 * chance.even();
            let size = 0.25 / (1.0 + 0.3 * i as f64);
            let p = body(&mut chance, 4.0 / (1.0 + i as f64), size);
            let mut inertial = Inertial {
                mass: p[0],
                first_moment: [p[1], p[2], p[3]],
                inertia: [0.0; 6],
            };
            inertial.inertia.copy_from_slice(&p[4..10]);
            j.inertial = Some(inertial);
            let scale = 1.0 / (1.0 + i as f64);
            j.friction = Some(JointFriction {
                coulomb: scale * (0.6 + 0.3 * chance.even()),
                viscous: scale * (0.8 + 0.4 * chance.even()),
                offset: 0.1 * scale * chance.even(),
            });
            j.drive = Some(rig_model::robot::Drive {
                gear_ratio: 50.0,
                rotor_inertia: scale * (1.0 + 0.5 * chance.even()) * 1e-4,
                torque_constant: 0.05,
                ..Default::default()
            });
            // Poles of the joint with its own drive and some of its load.
            let bandwidth = 40.0;
            j.controller = Some(Controller {
                position_gain: 0.5 * bandwidth,
                velocity_gain: 2.0 * bandwidth,
                torque_gain: scale,
            });
            j
        })
        .collect();
    Robot::new("arm", joints)
}

/// Noise of a recording.
#[derive(Clone, Copy, Default)]
pub(super) struct Noise {
    /// Position, rad, white.
    pub position: f64,
    /// Torque as a share of 1 N·m, white part.
    pub torque: f64,
    /// First-order autoregressive part of the torque: size and memory per sample.
    pub coloured: [f64; 2],
    /// Share of the coloured part that is common to all joints.
    pub common: f64,
}

/// Continuous control along sums of sines, fourth-order Runge–Kutta at a fraction of the sample; recorded every sample
/// with its reference.
pub(super) fn record(robot: &Robot, seconds: f64, rate: f64, noise: Noise, seed: u64) -> InMemory {
    let mut chance = Chance::new(seed);
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let pi = robot.standard_parameters();
    let terms: Vec<Vec<[f64; 3]>> = (0..n)
        .map(|_| {
            (0..5)
                .map(|k| {
                    let w = 0.9 * (k as f64 + 1.0) + 0.35 * chance.even();
                    [
                        (0.5 + 0.3 * chance.even()) / (1.0 + 0.4 * k as f64),
                        w,
                        3.0 * chance.even(),
                    ]
                })
                .collect()
        })
        .collect();
    let reference =
        |j: usize, t: f64| -> f64 { terms[j].iter().map(|[a, w, p]| a * (w * t + p).sin()).sum() };
    let torque = |t: f64, x: &[f64]| -> Vec<f64> {
        (0..n)
            .map(|j| {
                let c = robot.joints[j].controller.as_ref().unwrap();
                c.torque_gain
                    * c.velocity_gain
                    * (c.position_gain * (reference(j, t) - x[j]) - x[n + j])
            })
            .collect()
    };
    let slope = |t: f64, x: &[f64]| -> Vec<f64> {
        let tau = torque(t, x);
        let mut out = vec![0.0; 2 * n];
        let (velocity, acceleration) = out.split_at_mut(n);
        forward_dynamics(&chain, &pi, &x[..n], &x[n..], &tau, acceleration).unwrap();
        velocity.copy_from_slice(&x[n..]);
        out
    };
    let fine = 4;
    let h = 1.0 / (rate * f64::from(fine));
    let mut x: Vec<f64> = (0..n)
        .map(|j| reference(j, 0.0))
        .chain(vec![0.0; n])
        .collect();
    let mut block = Block {
        joints: vec![
            JointColumns {
                reference: Some(Vec::new()),
                ..Default::default()
            };
            n
        ],
        first_line: 2,
        ..Default::default()
    };
    let mut coloured = vec![0.0; n];
    for k in 0..(seconds * rate) as usize {
        let t = k as f64 / rate;
        block.t.push(t);
        let tau = torque(t, &x);
        let shared = chance.normal();
        for j in 0..n {
            let [size, memory] = noise.coloured;
            let drive =
                noise.common.sqrt() * shared + (1.0 - noise.common).sqrt() * chance.normal();
            coloured[j] = memory * coloured[j] + (1.0 - memory * memory).sqrt() * size * drive;
            let column = &mut block.joints[j];
            column.q.push(x[j] + noise.position * chance.normal());
            column
                .tau
                .push(tau[j] + coloured[j] + noise.torque * chance.normal());
            column.reference.as_mut().unwrap().push(reference(j, t));
        }
        for s in 0..fine {
            let t = t + f64::from(s) * h;
            let along = |x: &[f64], k: &[f64], h: f64| -> Vec<f64> {
                x.iter().zip(k).map(|(x, k)| x + h * k).collect()
            };
            let a = slope(t, &x);
            let b = slope(t + 0.5 * h, &along(&x, &a, 0.5 * h));
            let c = slope(t + 0.5 * h, &along(&x, &b, 0.5 * h));
            let d = slope(t + h, &along(&x, &c, h));
            for i in 0..2 * n {
                x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
        }
    }
    InMemory {
        label: format!("arm {seed}"),
        blocks: vec![block],
    }
}

/// Returns the true values of the identified parameters.
pub(super) fn truth(robot: &Robot, found: &Identification) -> Vec<f64> {
    let mut flat = robot.standard_parameters().concat();
    flat.resize(found.details.combination.ncols(), 0.0);
    (&found.details.combination * nalgebra::DVector::from_vec(flat))
        .as_slice()
        .to_vec()
}

/// Returns the arm with geometry and controllers only.
pub(super) fn blank(robot: &Robot) -> Robot {
    let mut known = robot.clone();
    for joint in &mut known.joints {
        joint.inertial = None;
        joint.friction = None;
    }
    known
}

#[test]
fn arms_of_two_to_seven_joints_by_every_estimator() {
    for n in 2..=7 {
        let robot = arm(n, 10 + n as u64);
        let noise = Noise {
            position: 2e-6,
            torque: 0.05,
            ..Default::default()
        };
        let recording = record(&robot, 40.0, 500.0, noise, n as u64);
        for estimator in Estimator::ALL {
            // The cheaper estimators at every size, all at two.
            let dear = matches!(
                estimator,
                Estimator::OutputError | Estimator::Tls | Estimator::Robust
            );
            if n > 3 && dear {
                continue;
            }
            let options = Options {
                estimator,
                ..Default::default()
            };
            let begin = std::time::Instant::now();
            let found = identify(&blank(&robot), &[&recording], &[], &options).unwrap();
            let took = begin.elapsed();
            let truth = truth(&robot, &found);
            let errors: Vec<f64> = found
                .base_parameters
                .iter()
                .zip(&truth)
                .map(|(b, t)| (b.value - t).abs() / b.std)
                .collect();
            let inside = found
                .base_parameters
                .iter()
                .zip(&truth)
                .filter(|(b, t)| b.interval[0] <= **t && **t <= b.interval[1])
                .count();
            let worst = errors.iter().copied().fold(0.0, f64::max);
            println!(
                "{n} joints, {estimator:?}: {inside} of {} inside, worst {worst:.1} std, left {:?}, {took:.2?} {:?} {:?}",
                truth.len(),
                found
                    .joints
                    .iter()
                    .map(|j| (1e4 * j.train_residual_rms).round() / 1e4)
                    .collect::<Vec<_>>(),
                found.procedure,
                found.warnings,
            );
            if estimator == Estimator::OutputError {
                // The simulated loop holds its torque over a sample, the recorded one does not.
                continue;
            }
            assert!(
                inside as f64 >= 0.85 * truth.len() as f64,
                "{n} {estimator:?} {inside} of {}",
                truth.len()
            );
            if let Some(set) = &found.standard_parameters {
                assert!(set.least_eigenvalue.iter().all(|e| *e > 0.0));
                for (c, p) in set.parameters.iter().enumerate() {
                    if (10..13).contains(&(c % COLUMNS)) {
                        assert!(p.value > 0.0, "{p:?}");
                    }
                }
            }
        }
    }
}

/// Random links.
pub(super) fn bodies(chance: &mut Chance, n: usize) -> Vec<[f64; 10]> {
    (0..n).map(|_| body(chance, 2.0, 0.2)).collect()
}

/// Weakly excited friction and drive inertia end at zero; their uncertainty must come from the data, not from the
/// barrier that keeps them positive.
#[test]
fn intervals_at_zero_are_those_of_the_data() {
    let (mut inside, mut all, mut at_zero) = (0, 0, 0);
    for seed in 0..10 {
        let robot = arm(3, 80 + seed);
        // More than the torque of friction and drives.
        let noise = Noise {
            position: 2e-6,
            torque: 5.0,
            ..Default::default()
        };
        let recording = record(&robot, 15.0, 200.0, noise, seed);
        let options = Options {
            estimator: Estimator::Consistent,
            ..Default::default()
        };
        let mut described = robot.clone();
        for joint in &mut described.joints {
            (joint.friction, joint.drive) = (None, None);
        }
        let found = identify(&described, &[&recording], &[], &options).unwrap();
        let truth = truth(&robot, &found);
        for ((b, t), c) in (found.base_parameters.iter())
            .zip(&truth)
            .zip(&found.details.columns)
        {
            if !(10..13).contains(&(c % COLUMNS)) {
                continue;
            }
            all += 1;
            at_zero += usize::from(b.value < 0.2 * b.std);
            inside += usize::from(b.interval[0] <= *t && *t <= b.interval[1]);
            assert!(b.interval[0] >= 0.0 || b.expression.contains(' '), "{b:?}");
        }
    }
    println!("{inside} of {all} inside, {at_zero} near zero");
    // The barrier's own curvature at a value x alone gives an interval of 3.2·x.
    assert!(at_zero >= 2, "{at_zero} of {all}: nothing was at its bound");
    assert!(inside as f64 >= 0.9 * all as f64, "{inside} of {all}");
}

/// A joint too slow for any usable row: reported, and not called a fit.
#[test]
fn a_joint_without_rows_is_not_called_explained() {
    let robot = arm(3, 90);
    let noise = Noise {
        position: 2e-6,
        torque: 0.05,
        ..Default::default()
    };
    let recording = record(&robot, 20.0, 200.0, noise, 1);
    let still = {
        let mut still = recording.clone();
        // A thousandth of the motion: slower than the rows that count.
        let q = &mut still.blocks[0].joints[1].q;
        let first = q[0];
        q.iter_mut().for_each(|x| *x = first + 1e-3 * (*x - first));
        still
    };
    let options = Options {
        estimator: Estimator::Consistent,
        ..Default::default()
    };
    let found = identify(&robot, &[&recording], &[&still], &options).unwrap();
    assert!(found.joints[1].holdout_relative_error.unwrap().is_nan());
    assert!(
        found
            .warnings
            .iter()
            .map(ToString::to_string)
            .any(|w| w.contains("j2") && w.contains("hold-out"))
    );
    assert!(found.joints[0].holdout_relative_error.unwrap() > 0.0);
}
