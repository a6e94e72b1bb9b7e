//! Random chains of 1 to 12 joints, revolute and prismatic, with coupled drives, rotor inertias, and a screw in some.
//! Their parameters are recovered: to rounding from exact rows, within their intervals from noisy recordings.
//!
//! The torque comes from the description: links by Newton and Euler without their drives, motors by their own motion
//! (Ψ̇, Ψ̈, τ = Jᵀ·τ_motor). No regressor is used for it.

use super::arms::{Chance, body};
use super::*;
use crate::estimators::linear::least_squares;
use crate::structure::independent::independent_columns;
use crate::structure::states::States;
use nalgebra::{DMatrix, DVector};
use rig_model::robot::{BallScrewCrank, Drive, Inertial, JointFriction};
use rig_shared::multibody::{Chain, inverse_dynamics};
use rig_shared::transmission::Transmission;

/// Middle of the range of the crank: far from both dead centres of this screw, rad.
const CRANK: f64 = -2.88;

fn screw(chance: &mut Chance, own: &str, other: &str) -> BallScrewCrank {
    let sign = |x: f64| x.signum();
    let mut angle = std::collections::BTreeMap::from([(own.to_owned(), sign(chance.even()))]);
    if chance.even() > 0.0 && own != other {
        angle.insert(other.to_owned(), sign(chance.even()));
    }
    BallScrewCrank {
        lead: 0.02 * sign(chance.even()),
        crank: 0.14,
        anchor: [-0.1575, 0.183],
        angle,
        offset: CRANK,
        range: Some([CRANK - 0.7, CRANK + 0.7]),
    }
}

/// A chain of `n` joints; angles and lengths are often zero or right angles, as in real arms.
fn chain(n: usize, seed: u64) -> Robot {
    let mut chance = Chance::new(seed);
    let right = std::f64::consts::FRAC_PI_2;
    let often = |chance: &mut Chance, list: &[f64], range: f64| {
        if chance.even() < 0.2 {
            list[((0.5 + 0.5 * chance.even()) * list.len() as f64) as usize % list.len()]
        } else {
            range * chance.even()
        }
    };
    let name = |k: usize| format!("joint_{}", k + 1);
    let any = |chance: &mut Chance| ((0.5 + 0.5 * chance.even()) * n as f64) as usize % n;
    let joints = (0..n)
        .map(|k| {
            let kind = if chance.even() < -0.4 {
                JointKind::Prismatic
            } else {
                JointKind::Revolute
            };
            let mut joint = joint(kind, often(&mut chance, &[0.0, right, -right], 1.5));
            joint.name = name(k);
            joint.a = often(&mut chance, &[0.0], 0.3);
            joint.theta = often(&mut chance, &[0.0, right], 3.0);
            joint.d = often(&mut chance, &[0.0], 0.3);
            let p = body(&mut chance, 3.0, 0.2);
            joint.inertial = Some(Inertial {
                mass: p[0],
                first_moment: [p[1], p[2], p[3]],
                inertia: [p[4], p[5], p[6], p[7], p[8], p[9]],
            });
            joint.friction = Some(JointFriction {
                coulomb: 0.8 + 0.4 * chance.even(),
                viscous: 0.7 + 0.3 * chance.even(),
                offset: 0.2 * chance.even(),
            });
            let ratio = 30.0 + 20.0 * chance.even();
            let mut drive = Drive {
                gear_ratio: ratio * chance.even().signum(),
                rotor_inertia: 1e-4 * (1.0 + 0.5 * chance.even()),
                viscous: 3e-4 * (1.0 + 0.5 * chance.even()),
                coulomb: 0.02 * (1.0 + 0.5 * chance.even()),
                ..Default::default()
            };
            match chance.even() {
                x if x < -0.75 => {
                    let other = name(any(&mut chance));
                    drive.screw = Some(screw(&mut chance, &joint.name, &other));
                    drive.gear_ratio = 0.0;
                }
                x if x < 0.0 => {
                    for _ in 0..2 {
                        // The ratio of its own joint is already set.
                        let other = any(&mut chance);
                        if other != k {
                            drive.couples.insert(name(other), ratio * chance.even());
                        }
                    }
                }
                _ => {}
            }
            joint.drive = Some(drive);
            joint
        })
        .collect();
    let mut robot = Robot::new("chain", joints);
    if chance.even() < -0.3 {
        robot.gravity = [3.0, -4.0, -8.4];
    }
    robot
}

fn has_screw(robot: &Robot) -> bool {
    let screw = |j: &Joint| j.drive.as_ref().is_some_and(|d| d.screw.is_some());
    robot.joints.iter().any(screw)
}

/// The torque of the description.
struct Physics {
    chain: Chain<f64>,
    transmission: Transmission<f64>,
    links: Vec<[f64; 14]>,
    drives: Vec<Drive>,
}

impl Physics {
    fn of(robot: &Robot) -> Self {
        let mut bare = robot.clone();
        let drives = (bare.joints.iter_mut())
            .map(|j| j.drive.take().unwrap())
            .collect();
        Self {
            chain: chain_of(robot).unwrap(),
            transmission: transmission_of(robot).unwrap(),
            links: bare.standard_parameters(),
            drives,
        }
    }

    fn motor_speeds(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let mut speeds = vec![0.0; q.len()];
        self.transmission
            .motor_velocity(q, qd, &mut speeds)
            .unwrap();
        speeds
    }

    fn torque(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
        let n = q.len();
        let [mut tau, mut accelerations, mut at_joints] = [(); 3].map(|()| vec![0.0; n]);
        inverse_dynamics(&self.chain, &self.links, q, qd, qdd, &mut tau).unwrap();
        let speeds = self.motor_speeds(q, qd);
        self.transmission
            .motor_acceleration(q, qd, qdd, &mut accelerations)
            .unwrap();
        let motors: Vec<f64> = (self.drives.iter().zip(&speeds))
            .zip(&accelerations)
            .map(|((d, v), a)| d.rotor_inertia * a + d.viscous * v + d.coulomb * v.signum())
            .collect();
        self.transmission
            .joint_torque(q, &motors, &mut at_joints)
            .unwrap();
        tau.iter().zip(&at_joints).map(|(a, b)| a + b).collect()
    }
}

/// True values of combinations of the parameters.
fn values(robot: &Robot, combination: &DMatrix<f64>) -> DVector<f64> {
    let mut flat = robot.standard_parameters().concat();
    flat.extend(robot.motor_parameters().concat());
    flat.truncate(combination.ncols());
    combination * DVector::from_vec(flat)
}

/// A state of the chain; a screw's crank stays within its range.
fn state(robot: &Robot, chance: &mut Chance) -> [Vec<f64>; 3] {
    let reach = if has_screw(robot) { 0.3 } else { 3.0 };
    [reach, 2.0, 5.0].map(|s| (0..robot.joints.len()).map(|_| s * chance.even()).collect())
}

/// Rows of the base columns and their torques.
fn torque_rows(robot: &Robot, base: &Base, seed: u64) -> (DMatrix<f64>, DVector<f64>) {
    let (states, physics) = (States::of(robot).unwrap(), Physics::of(robot));
    let mut chance = Chance::new(seed);
    stacked(base, robot.joints.len(), || {
        let [q, qd, qdd] = state(robot, &mut chance);
        let rows = states.torque(&q, &qd, &qdd).unwrap();
        (rows, physics.torque(&q, &qd, &qdd))
    })
}

/// Nodes on (−1, 1) and weights of the quadrature of Gauss and Legendre with eight points.
const NODES: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_5],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_3],
];

/// Impulses over short windows without a sign change of any speed, equal to change of momentum plus loss.
fn momentum_rows(robot: &Robot, base: &Base, seed: u64) -> (DMatrix<f64>, DVector<f64>) {
    let (states, physics) = (States::of(robot).unwrap(), Physics::of(robot));
    let (n, half) = (robot.joints.len(), 0.03);
    let mut chance = Chance::new(seed);
    stacked(base, n, || {
        let at = loop {
            let [q, qd, qdd] = state(robot, &mut chance);
            let at = move |t: f64| -> [Vec<f64>; 3] {
                let along = |a: &[f64], b: &[f64]| -> Vec<f64> {
                    a.iter().zip(b).map(|(a, b)| a + t * b).collect()
                };
                let mean: Vec<f64> = (qd.iter().zip(&qdd))
                    .map(|(v, a)| v + 0.5 * t * a)
                    .collect();
                [along(&q, &mean), along(&qd, &qdd), qdd.clone()]
            };
            let signs = |k: i32| {
                let [q, qd, _] = at(0.5 * half * f64::from(k));
                let motors = physics.motor_speeds(&q, &qd);
                let signs = qd.iter().chain(&motors).map(|v| *v > 0.0);
                signs.collect::<Vec<bool>>()
            };
            if (-1..=2).all(|k| signs(k) == signs(-2)) {
                break at;
            }
        };
        let momentum = |t: f64| {
            let [q, qd, _] = at(t);
            states.momentum(&q, &qd).unwrap()
        };
        let mut rows = momentum(half)[0].clone() - &momentum(-half)[0];
        let mut impulse = vec![0.0; n];
        for [node, weight] in NODES.into_iter().chain(NODES.map(|[x, w]| [-x, w])) {
            rows += &momentum(half * node)[1] * (half * weight);
            let [q, qd, qdd] = at(half * node);
            for (sum, tau) in impulse.iter_mut().zip(physics.torque(&q, &qd, &qdd)) {
                *sum += half * weight * tau;
            }
        }
        (rows, impulse)
    })
}

/// Base columns of twice as many equations as parameters.
fn stacked(
    base: &Base,
    n: usize,
    mut next: impl FnMut() -> (DMatrix<f64>, Vec<f64>),
) -> (DMatrix<f64>, DVector<f64>) {
    let instants = (2 * base.len()).div_ceil(n);
    let mut x = DMatrix::zeros(instants * n, base.len());
    let mut y = DVector::zeros(instants * n);
    for k in 0..instants {
        let (rows, torque) = next();
        x.rows_mut(k * n, n)
            .copy_from(&rows.select_columns(&base.columns));
        y.rows_mut(k * n, n).copy_from_slice(&torque);
    }
    (x, y)
}

#[test]
fn exact_rows_of_random_chains_give_their_parameters_to_rounding() {
    let (mut coupled, mut screws, mut slides) = (0, 0, 0);
    for n in 1..=12 {
        for draw in 0..4 {
            let seed = 1000 + 10 * n as u64 + draw;
            let robot = chain(n, seed);
            // The description can be read back.
            let text = robot.to_toml().unwrap();
            Robot::from_toml(&text, std::path::Path::new("chain.toml")).unwrap();
            coupled += usize::from(!transmission_of(&robot).unwrap().is_simple());
            screws += usize::from(has_screw(&robot));
            let slide = |j: &Joint| j.kind == JointKind::Prismatic;
            slides += usize::from(robot.joints.iter().any(slide));
            let of = |model| Base::structural(&robot, model, seed).unwrap();
            let (by_torque, by_momentum) = (of(ModelKind::Differential), of(ModelKind::Integral));
            assert_eq!(by_torque.columns, by_momentum.columns, "{n} {seed}");
            for (what, base, (x, y)) in [
                ("torque", &by_torque, torque_rows(&robot, &by_torque, seed)),
                (
                    "momentum",
                    &by_momentum,
                    momentum_rows(&robot, &by_momentum, seed),
                ),
            ] {
                let mut factor = TriangularFactor::new(base.len());
                for (row, y) in x.row_iter().zip(&y) {
                    factor.push(&row.iter().copied().collect::<Vec<_>>(), *y, 1.0);
                }
                let order: Vec<usize> = (0..base.len()).collect();
                let all = independent_columns(&factor.system().0, &order, 0.0);
                assert_eq!(all.kept, order);
                let found = DVector::from_vec(least_squares(&factor, &all, base).unwrap());
                let truth = values(&robot, &base.combination);
                // Each error by its effect on the torque, relative to the largest torque of all rows.
                let size = y.amax();
                let worst = (0..base.len())
                    .map(|k| (found[k] - truth[k]).abs() * x.column(k).amax() / size)
                    .fold(0.0, f64::max);
                println!("{n} joints, {what}: {} parameters, {worst:.1e}", base.len());
                assert!(worst < 1e-9, "{n} joints, seed {seed}, {what}: {worst:e}");
            }
        }
    }
    println!("of 48: {coupled} coupled, {screws} with a screw, {slides} with a slide");
    assert!(coupled > 30 && screws > 12 && slides > 24);
}

/// Sums of sines within the chain's reach, and their torque with noise of `share` of its RMS.
fn noisy(robot: &Robot, seconds: f64, share: f64, seed: u64) -> InMemory {
    let (rate, n) = (200.0, robot.joints.len());
    let physics = Physics::of(robot);
    let mut chance = Chance::new(seed);
    let reach = if has_screw(robot) { 0.3 } else { 1.4 };
    let terms: Vec<[[f64; 3]; 4]> = (0..n)
        .map(|_| {
            [0.4, 0.3, 0.2, 0.1].map(|share| {
                let speed = 4.0 + 3.0 * chance.even();
                [reach * share, speed, 3.0 * chance.even()]
            })
        })
        .collect();
    let mut block = Block {
        joints: vec![JointColumns::default(); n],
        first_line: 2,
        ..Default::default()
    };
    for k in 0..(seconds * rate) as usize {
        let t = k as f64 / rate;
        let mut at = [(); 3].map(|()| vec![0.0; n]);
        for (j, terms) in terms.iter().enumerate() {
            for [size, w, phase] in terms {
                let (s, c) = (w * t + phase).sin_cos();
                at[0][j] += size * s;
                at[1][j] += size * w * c;
                at[2][j] -= size * w * w * s;
            }
        }
        let tau = physics.torque(&at[0], &at[1], &at[2]);
        block.t.push(t);
        for (j, joint) in block.joints.iter_mut().enumerate() {
            joint.q.push(at[0][j]);
            joint.tau.push(tau[j]);
        }
    }
    for joint in &mut block.joints {
        let squares: f64 = joint.tau.iter().map(|x| x * x).sum();
        let noise = share * (squares / joint.tau.len() as f64).sqrt();
        joint
            .tau
            .iter_mut()
            .for_each(|x| *x += noise * chance.normal());
    }
    InMemory {
        label: "chain".into(),
        blocks: vec![block],
    }
}

/// Coverage of 95 % intervals. Parameters of one recording err together, so recordings are the unit: their mean
/// coverage may be below 95 % by three standard deviations of such a mean. It may be somewhat above, because leaving
/// out groups gives wide intervals (MacKinnon, Nielsen & Webb 2023, of CV₃).
#[test]
fn intervals_of_random_chains_hold_the_truth_as_often_as_they_say() {
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let mut shares = Vec::new();
        let (mut inside, mut all) = (0, 0);
        for draw in 0..96u64 {
            // Every size twice; small chains more often, because they are cheap.
            let n = 1 + draw as usize / 4 % if draw % 4 == 0 { 12 } else { 4 };
            let robot = chain(n, 5000 + draw);
            let recording = noisy(&robot, 20.0, 0.05, draw);
            let options = Options {
                model,
                ..Default::default()
            };
            let begin = std::time::Instant::now();
            let found =
                identify(&super::arms::blank(&robot), &[&recording], &[], &options).unwrap();
            let truth = values(&robot, &found.details.combination);
            let hit = (found.base_parameters.iter().zip(&truth))
                .filter(|(b, t)| b.interval[0] <= **t && **t <= b.interval[1])
                .count();
            println!(
                "{model:?} {draw}: {n} joints, {hit} of {}, {:.1?}, {:?}",
                truth.len(),
                begin.elapsed(),
                found
                    .not_excited
                    .iter()
                    .map(|n| &n.combination)
                    .collect::<Vec<_>>()
            );
            (inside, all) = (inside + hit, all + truth.len());
            shares.push(hit as f64 / truth.len() as f64);
        }
        let count = shares.len() as f64;
        let mean = shares.iter().sum::<f64>() / count;
        let squares: f64 = shares.iter().map(|s| (s - mean).powi(2)).sum();
        let std = (squares / (count - 1.0) / count).sqrt();
        println!("{model:?}: {inside} of {all}; by recording {mean:.4} ± {std:.4}");
        let range = 0.95 - 3.0 * std..0.98;
        assert!(range.contains(&mean), "{model:?}: {mean} ± {std}");
        assert!(std < 0.015, "too few recordings: {std}");
    }
}
