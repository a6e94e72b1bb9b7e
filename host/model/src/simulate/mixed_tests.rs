//! Coupled drives of which some have elastic gears and others stiff ones.
#![allow(clippy::unwrap_used)]

use nalgebra::DMatrix;
use rig_shared::effects::{Effect, Kind};
use rig_shared::multibody::{kinetic_energy, potential_energy};

use super::elastic_tests::{
    energy, hold, links, peak, planar, response, smooth_irp6, twists, with,
};
use super::*;
use crate::robot::{IRP6_TEMPLATE, Robot, RobotEffect};

/// Joint, gap and stiffness of a spring at each coupled drive of the IRp-6: two screws, at the motor, and the wrist.
const SPRINGS: [(usize, f64, f64); 4] =
    [(1, 0.0, 0.8), (2, 0.0, 0.8), (3, 0.0, 2e3), (4, 0.0, 300.0)];

fn irp6() -> Robot {
    Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap()
}

/// The robot with springs of these stiffnesses (and dampings of this share of them, s) at these joints.
fn sprung(mut robot: Robot, springs: &[(usize, f64, f64)], damping: f64) -> Robot {
    for (joint, _, stiffness) in springs {
        let shapes = [*stiffness, damping * stiffness, 0.0];
        robot = with(robot, *joint, Kind::JointElasticity, &shapes);
    }
    robot
}

/// The springs whose bits are set in `set`.
fn subset(set: usize) -> Vec<(usize, f64, f64)> {
    let chosen = (0..SPRINGS.len()).filter(|k| set >> k & 1 == 1);
    chosen.map(|k| SPRINGS[k]).collect()
}

fn motor_angles(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let mut psi = vec![0.0; q.len()];
    let transmission = robot.transmission().unwrap();
    transmission.motor_position(q, &mut psi).unwrap();
    psi
}

/// Largest difference between the motor angles of the drives that `springs` leaves stiff, from the motors and from the
/// links.
fn slip(robot: &Robot, springs: &[(usize, f64, f64)], motors: &[f64], links: &[f64]) -> f64 {
    let [front, behind] = [motors, links].map(|q| motor_angles(robot, q));
    (0..motors.len())
        .filter(|k| springs.iter().all(|spring| spring.0 != *k))
        .map(|k| (front[k] - behind[k]).abs())
        .fold(0.0, f64::max)
}

/// Relative drift of the energy in 0.3 s without torques, and the slip of the stiff drives.
fn drift(robot: &Robot, springs: &[(usize, f64, f64)], start: [&[f64]; 2], dt: f64) -> [f64; 2] {
    let model = Model::from_robot(robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let [mut q, mut v] = start.map(<[f64]>::to_vec);
    let torque = vec![0.0; q.len()];
    stepper.put_links_at_rest(&q, &v).unwrap();
    let start = energy(robot, springs, &stepper, &q, &v);
    for _ in 0..(0.3 / dt).round() as usize {
        stepper.step(&mut q, &mut v, &torque, &[], dt).unwrap();
    }
    let at = &links(&stepper, &q, &v)[0];
    let gained = energy(robot, springs, &stepper, &q, &v) - start;
    [(gained / start).abs(), slip(robot, springs, &q, at)]
}

#[test]
fn every_mixture_of_elastic_and_stiff_drives_keeps_its_energy() {
    for set in 1..15 {
        let springs = subset(set);
        let robot = sprung(smooth_irp6(), &springs, 0.0);
        let q = robot.middle_position();
        let start = [&q[..], &[0.8, 1.0, -2.2, 2.5, 2.0]];
        let [coarse, fine] = [2e-4, 1e-4].map(|dt| drift(&robot, &springs, start, dt));
        println!("{set:04b}: {coarse:?} {fine:?}");
        assert!(
            coarse[0] < 1e-3 && fine[0] < coarse[0] / 3.0,
            "{coarse:?} {fine:?}"
        );
        assert!(coarse[1] < 1e-9 && fine[1] < 1e-9, "{coarse:?} {fine:?}");
    }
}

/// A planar arm whose motors turn by these ratios of its joints, times 100.
fn planar_with(ratios: &[&[f64]]) -> Robot {
    let mut robot = planar(ratios.len(), false);
    let names: Vec<String> = robot
        .joints
        .iter()
        .map(|joint| joint.name.clone())
        .collect();
    for (k, (joint, row)) in robot.joints.iter_mut().zip(ratios).enumerate() {
        let drive = joint.drive.as_mut().unwrap();
        drive.gear_ratio = 100.0 * row[k];
        for (other, ratio) in row.iter().enumerate() {
            if other != k && *ratio != 0.0 {
                drive.couples.insert(names[other].clone(), 100.0 * ratio);
            }
        }
    }
    robot
}

/// A differential, and drives of which two turn alike with the joints that have stiff gears: the link behind the spring
/// is then no coordinate beside their motors.
#[test]
fn differentials_with_one_spring_keep_their_energy() {
    let cases: [(&[&[f64]], usize); 4] = [
        (&[&[1.0, 1.0], &[1.0, -1.0]], 0),
        (&[&[1.0, 1.0], &[1.0, -1.0]], 1),
        (&[&[1.0, 1.0, 0.0], &[1.0, 1.0, 1.0], &[0.0, 1.0, 1.0]], 0),
        (&[&[1.0, 1.0, 0.0], &[1.0, 1.0, 1.0], &[0.0, 1.0, 1.0]], 2),
    ];
    for (ratios, joint) in cases {
        let springs = [(joint, 0.0, 600.0)];
        let robot = sprung(planar_with(ratios), &springs, 0.0);
        let (q, v) = ([0.4, -0.9, 0.7], [1.5, -2.0, 1.0]);
        let n = ratios.len();
        let start = [&q[..n], &v[..n]];
        let [coarse, fine] = [4e-4, 2e-4].map(|dt| drift(&robot, &springs, start, dt));
        println!("{ratios:?}, {joint}: {coarse:?} {fine:?}");
        assert!(
            coarse[0] < 1e-3 && fine[0] < coarse[0] / 3.0,
            "{coarse:?} {fine:?}"
        );
        assert!(fine[1] < 1e-9, "{fine:?}");
    }
}

/// Work of motors and of torques from outside, less what friction and damping take, is energy.
#[test]
fn work_on_mixed_drives_is_energy_gained_and_lost() {
    let springs = [(2, 0.0, 0.8), (4, 0.0, 300.0)];
    let damping = 2e-3;
    let robot = sprung(irp6(), &springs, damping);
    let model = Model::from_robot(&robot).unwrap();
    let transmission = robot.transmission().unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (robot.middle_position(), vec![0.0; 5]);
    stepper.put_links_at_rest(&q, &v).unwrap();
    let start = energy(&robot, &springs, &stepper, &q, &v);
    let mut gravity = vec![0.0; 5];
    let (mut work, mut lost, dt) = (0.0, 0.0, 1e-4);
    for k in 0..8000 {
        let t = f64::from(k) * dt;
        model
            .inverse_dynamics(&q, &[0.0; 5], &[0.0; 5], &mut gravity)
            .unwrap();
        let torque: Vec<f64> = (0..5)
            .map(|j| {
                let swing = ((7.0 + j as f64) * t).sin();
                gravity[j] + [60.0, 150.0, 90.0, 20.0, 9.0][j] * swing
            })
            .collect();
        let external: Vec<f64> = (0..5)
            .map(|j| [5.0, 20.0, -15.0, 4.0, 1.5][j] * (23.0 * t).cos())
            .collect();
        let before = [q.clone(), v.clone()];
        let links_before = links(&stepper, &q, &v);
        stepper
            .step(&mut q, &mut v, &torque, &external, dt)
            .unwrap();
        let links_after = links(&stepper, &q, &v);
        let middle = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect()
        };
        let motor_speed = |q: &[f64], v: &[f64]| {
            let mut psid = vec![0.0; 5];
            transmission.motor_velocity(q, v, &mut psid).unwrap();
            psid
        };
        let speed = middle(&before[1], &v);
        let link_speed = middle(&links_before[1], &links_after[1]);
        let psid = motor_speed(&middle(&before[0], &q), &speed);
        let output = motor_speed(&middle(&links_before[0], &links_after[0]), &link_speed);
        for (j, joint) in robot.joints.iter().enumerate() {
            let drive = joint.drive.as_ref().unwrap();
            let friction = joint.friction.as_ref().unwrap();
            work += dt * (torque[j] * speed[j] + external[j] * link_speed[j]);
            lost += dt * friction.viscous * speed[j].powi(2);
            lost += dt * (friction.coulomb * speed[j].abs() + friction.offset * speed[j]);
            lost += dt * (drive.viscous * psid[j].powi(2) + drive.coulomb * psid[j].abs());
        }
        for (j, _, stiffness) in springs {
            let turns = if j == 2 { 1.0 } else { -76.8 };
            lost += dt * damping * stiffness * ((psid[j] - output[j]) / turns).powi(2);
        }
    }
    let gained = energy(&robot, &springs, &stepper, &q, &v) - start;
    println!("work {work} J, gained {gained} J, lost {lost} J");
    assert!(work.abs() > 1.0 && lost > 1.0);
    assert!((work - gained - lost).abs() < 1e-4 * lost);
}

/// Motion of the lower arm alone by `by`: the parallelogram carries the others parallel to themselves.
fn lower_arm_by(at: &[f64], by: f64) -> Vec<f64> {
    let mut moved = at.to_vec();
    (moved[1], moved[2]) = (moved[1] + by, moved[2] - by);
    moved
}

/// Potential energy of the links of a robot.
fn potential(robot: &Robot, at: &[f64]) -> f64 {
    let model = Model::from_robot(robot).unwrap();
    potential_energy(&model.chain, &model.parameters, at).unwrap()
}

/// All motors are held. The sag is that at which gravity and spring do opposite work; no other drive yields. Then the
/// arm swings about it by stiffness over inertia, both from energies along the one motion that is left.
#[test]
fn one_soft_screw_lets_its_arm_sag_and_swing_while_the_others_hold() {
    let springs = [(1, 0.0, 0.5)];
    let mut robot = sprung(smooth_irp6(), &springs, 0.0);
    for (joint, own) in robot.joints.iter_mut().zip(irp6().joints) {
        joint.friction = own.friction;
    }
    (0..5).for_each(|joint| hold(&mut robot, joint));
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (robot.middle_position(), vec![0.0; 5]);
    // Away from upright, where gravity has no lever.
    q[1] += 0.35;
    let motors = q.clone();
    stepper.put_links_at_rest(&q, &v).unwrap();
    let at = links(&stepper, &q, &v)[0].clone();
    assert!((at[1] - q[1]).abs() > 1e-3, "{at:?}");
    assert!(slip(&robot, &springs, &q, &at) < 1e-9, "{at:?}");
    let twist = |by: f64| twists(&robot, &motors, &lower_arm_by(&at, by))[1];
    let height = |by: f64| potential(&robot, &lower_arm_by(&at, by));
    let h = 1e-5;
    let gravity = height(h) - height(-h);
    let spring = -0.5 * twist(0.0) * (twist(h) - twist(-h));
    assert!((gravity / spring - 1.0).abs() < 1e-6, "{gravity} {spring}");

    // Stiffness and inertia of the motion that is left.
    let h = 1e-3;
    let stored = |by: f64| height(by) + 0.25 * twist(by).powi(2);
    let stiffness = (stored(h) - 2.0 * stored(0.0) + stored(-h)) / (h * h);
    let mut bare = robot.clone();
    bare.joints.iter_mut().for_each(|joint| joint.drive = None);
    let bare = Model::from_robot(&Robot {
        effects: Vec::new(),
        ..bare
    })
    .unwrap();
    let way = [0.0, 1.0, -1.0, 0.0, 0.0];
    let inertia = 2.0 * kinetic_energy(&bare.chain, &bare.parameters, &at, &way).unwrap();
    let omega = (stiffness / inertia).sqrt();
    // A short push on the link, and the times of its passages.
    let dt = 1e-4;
    let (mut passages, mut before) = (Vec::new(), 0.0);
    for k in 0..20_000 {
        let push = if k < 20 { 5.0 } else { 0.0 };
        stepper
            .step(&mut q, &mut v, &[0.0; 5], &[0.0, push, 0.0, 0.0, 0.0], dt)
            .unwrap();
        let now = stepper.link(1).unwrap()[0] - at[1];
        if k > 20 && before < 0.0 && now >= 0.0 {
            passages.push((f64::from(k) - now / (now - before)) * dt);
        }
        before = now;
        let at = &links(&stepper, &q, &v)[0];
        assert!(slip(&robot, &springs, &q, at) < 1e-9, "{at:?}");
    }
    let count = passages.len() - 1;
    let period = (passages[count] - passages[0]) / count as f64;
    let found = std::f64::consts::TAU / period;
    println!("{omega} rad/s, found {found} in {count} periods");
    assert_eq!(q, motors);
    assert!(
        count > 10 && (found / omega - 1.0).abs() < 1e-4,
        "{found} {omega}"
    );
}

/// Mass and stiffness matrices by differences of energies, in coordinates of their own: the links, and the outputs of the
/// motors with springs; and the twists of the springs by these coordinates.
fn matrices(robot: &Robot, springs: &[(usize, f64, f64)], q: &[f64]) -> [DMatrix<f64>; 3] {
    let (n, m) = (q.len(), springs.len());
    let mut bare = robot.clone();
    bare.effects.clear();
    bare.joints.iter_mut().for_each(|joint| joint.drive = None);
    let bare = Model::from_robot(&bare).unwrap();
    // Output of a motor in the unit of the twist, from the links.
    let outputs = |q: &[f64]| twists(robot, q, &vec![0.0; n]);
    let scale = |k: usize| {
        let drive = robot.joints[k].drive.as_ref().unwrap();
        drive.screw.as_ref().map_or(drive.gear_ratio, |_| 1.0)
    };
    let kinetic = |rates: &[f64]| {
        let links = kinetic_energy(&bare.chain, &bare.parameters, q, &rates[..n]).unwrap();
        let h = 1e-5;
        let at = |sign: f64| -> Vec<f64> {
            q.iter().zip(rates).map(|(q, v)| q + sign * h * v).collect()
        };
        let [up, down] = [at(1.0), at(-1.0)].map(|q| outputs(&q));
        let rotors = (0..n).map(|k| {
            let place = springs.iter().position(|spring| spring.0 == k);
            let speed = place.map_or((up[k] - down[k]) / (2.0 * h), |place| rates[n + place]);
            let rotor = robot.joints[k].drive.as_ref().unwrap().rotor_inertia;
            0.5 * rotor * (scale(k) * speed).powi(2)
        });
        links + rotors.sum::<f64>()
    };
    let rest = outputs(q);
    let twist = |place: usize, off: &[f64]| {
        let moved: Vec<f64> = q.iter().zip(off).map(|(q, by)| q + by).collect();
        let k = springs[place].0;
        rest[k] + off[n + place] - outputs(&moved)[k]
    };
    let stored = |off: &[f64]| {
        let bent = springs.iter().enumerate();
        bent.map(|(place, (.., c))| 0.5 * c * twist(place, off).powi(2))
            .sum::<f64>()
    };
    let size = n + m;
    let form = |of: &dyn Fn(&[f64]) -> f64, h: f64| {
        let at = |a: usize, b: usize, signs: [f64; 2]| {
            let mut x = vec![0.0; size];
            x[a] += signs[0] * h;
            x[b] += signs[1] * h;
            of(&x)
        };
        let corners = [1.0, -1.0].map(|s| [[s, s], [s, -s]]).concat();
        DMatrix::from_fn(size, size, |a, b| {
            let each = corners.iter().map(|s| s[0] * s[1] * at(a, b, *s));
            each.sum::<f64>() / (4.0 * h * h)
        })
    };
    let by = |place: usize, a: usize| {
        let h = 1e-5;
        let [up, down] = [h, -h].map(|h| {
            let mut x = vec![0.0; size];
            x[a] = h;
            twist(place, &x)
        });
        (up - down) / (2.0 * h)
    };
    let twists = DMatrix::from_fn(m, size, by);
    [form(&kinetic, 1.0), form(&stored, 1e-4), twists]
}

/// Twists of the springs, step by step, after an impulse on their motors.
fn ringing(
    robot: &Robot,
    springs: &[(usize, f64, f64)],
    q: &[f64],
    dt: f64,
    count: usize,
) -> Vec<Vec<f64>> {
    let model = Model::from_robot(robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (q.to_vec(), vec![0.0; q.len()]);
    let mut series = vec![vec![0.0]; springs.len()];
    let mut torque = vec![0.0; q.len()];
    for (joint, ..) in springs {
        torque[*joint] = 1e-3 / dt;
    }
    for _ in 0..count {
        stepper.step(&mut q, &mut v, &torque, &[], dt).unwrap();
        torque.fill(0.0);
        let twists = twists(robot, &q, &links(&stepper, &q, &v)[0]);
        for (own, (joint, ..)) in series.iter_mut().zip(springs) {
            own.push(twists[*joint]);
        }
    }
    series
}

#[test]
fn mixed_drives_vibrate_at_the_eigenfrequencies() {
    for set in [0b0001, 0b0010, 0b1000, 0b0101, 0b1110] {
        let springs = subset(set);
        let mut robot = smooth_irp6();
        // One to two hundredths of the critical damping.
        for (joint, damping) in [(1, 4e-4), (2, 4e-4), (3, 2e-4), (4, 8e-5)] {
            let own: Vec<_> = (springs.iter().copied())
                .filter(|own| own.0 == joint)
                .collect();
            robot = sprung(robot, &own, damping);
        }
        robot.gravity = [0.0; 3];
        let mut q = robot.middle_position();
        (q[1], q[2], q[3]) = (q[1] + 0.2, q[2] - 0.3, q[3] + 0.25);
        let [mass, stiffness, twisted] = matrices(&robot, &springs, &q);
        let root = mass.cholesky().unwrap().l().try_inverse().unwrap();
        let modes = (&root * stiffness * root.transpose()).symmetric_eigen();
        let mut order: Vec<usize> = (0..modes.eigenvalues.len()).collect();
        order.sort_by(|a, b| modes.eigenvalues[*a].total_cmp(&modes.eigenvalues[*b]));
        // The others are free turns of the motors with their links.
        let vibrating = order.split_off(q.len());
        let lowest = modes.eigenvalues[vibrating[0]];
        for free in order {
            assert!(modes.eigenvalues[free].abs() < 1e-4 * lowest, "{modes:?}");
        }
        // Free turns twist no spring, so as many twists as vibrations tell them apart.
        let shapes = twisted * root.transpose() * modes.eigenvectors.select_columns(&vibrating);
        let apart = shapes.try_inverse().unwrap();
        let dt = 2e-4;
        let series = ringing(&robot, &springs, &q, dt, 15_000);
        for (row, place) in vibrating.iter().enumerate() {
            let omega = modes.eigenvalues[*place].sqrt();
            let mode: Vec<f64> = (0..series[0].len())
                .map(|k| {
                    (0..series.len())
                        .map(|c| apart[(row, c)] * series[c][k])
                        .sum()
                })
                .collect();
            let found = peak(0.95 * omega, 1.05 * omega, |w| response(&mode, 1.0, dt, w));
            println!("{set:04b}: {omega} rad/s, found {found}");
            assert!((found / omega - 1.0).abs() < 2e-3, "{found} {omega}");
        }
    }
}

/// With friction, effects on links and motors, torques from outside, and a spring at one drive.
#[test]
fn stiff_gears_are_the_limit_of_springs() {
    let mut robot = irp6();
    // A screw that gravity twists has another ratio at the link: motors and links would not start alike.
    robot.gravity = [0.0; 3];
    let name = |joint: usize| robot.joints[joint].name.clone();
    let effects = [
        (2, None, Kind::Spring, &[30.0, 5.0][..], &[][..]),
        (1, Some(3), Kind::InertiaCoupling, &[0.05, 0.1, 0.2], &[]),
        (2, None, Kind::LoadFriction, &[0.05], &[]),
        (3, None, Kind::LoadFriction, &[0.08], &[]),
        (4, None, Kind::Stribeck, &[0.3], &[0.1]),
    ]
    .map(|(joint, other, kind, gains, shapes)| RobotEffect {
        joint: Some(name(joint)),
        other: other.map(name),
        effect: Effect::new(kind, gains, shapes),
    });
    robot.effects.extend(effects);
    let rigid = Model::from_robot(&Robot {
        effects: Vec::new(),
        ..robot.clone()
    })
    .unwrap();
    // No joint turns round: where friction changes its sign, the motors of springs, however stiff, tremble.
    let end = |robot: &Robot| {
        let model = Model::from_robot(robot).unwrap();
        let mut stepper = Stepper::new(&model).unwrap();
        let (mut q, mut v) = (robot.middle_position(), vec![0.4, 0.5, -0.8, 1.0, 1.5]);
        q[1] += 0.2;
        stepper.put_links_at_rest(&q, &v).unwrap();
        let mut torque = vec![0.0; 5];
        let (start, dt) = (v.clone(), 2e-4);
        for k in 0..1500 {
            let t = f64::from(k) * dt;
            let swing = (9.0 * t).sin();
            let wanted: Vec<f64> = start.iter().map(|v| 2.0 * v * swing).collect();
            rigid
                .inverse_dynamics(&q, &v, &wanted, &mut torque)
                .unwrap();
            let external = [0.0, 10.0 * t, 0.0, 5.0 * t, 2.0 * t];
            stepper
                .step(&mut q, &mut v, &torque, &external, dt)
                .unwrap();
            assert!(v.iter().zip(&start).all(|(a, b)| a * b > 0.0), "{v:?}");
        }
        [q.clone(), links(&stepper, &q, &v)[0].clone()].concat()
    };
    for (joint, stiffness) in [(1, 2.0), (3, 2e3)] {
        let soft = sprung(robot.clone(), &[(joint, 0.0, stiffness)], 2e-3);
        let mixed = end(&soft);
        let off = |factor: f64| {
            let stiff: Vec<_> = (SPRINGS.iter())
                .filter(|spring| spring.0 != joint)
                .map(|(joint, gap, own)| (*joint, *gap, factor * own))
                .collect();
            let found = end(&sprung(soft.clone(), &stiff, 2e-4));
            (mixed.iter().zip(found))
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
        };
        let [loose, tight] = [20.0, 320.0].map(off);
        println!("{joint}: {loose} rad, sixteen times as stiff {tight} rad");
        assert!(
            loose > 5e-5 && tight < 0.1 * loose,
            "{joint}: {loose} {tight}"
        );
    }
}

/// The tilt is loose, and all motors stand by friction. A torque that changes its sign swings the link through the gap,
/// and the stiff drive of the turn makes it follow by the bevel.
#[test]
fn a_loose_wrist_falls_through_its_gap_while_friction_holds_the_motors() {
    let (gap, stiffness) = (0.02, 500.0);
    let robot = with(irp6(), 3, Kind::Backlash, &[gap, stiffness, 5.0, 0.0]);
    let springs = [(3, gap, stiffness)];
    let robot = Robot {
        gravity: [0.0; 3],
        ..robot
    };
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (robot.middle_position(), vec![0.0; 5]);
    let motors = q.clone();
    stepper.put_links_at_rest(&q, &v).unwrap();
    // The blows on the teeth stay below the friction of the motors.
    let pull = 0.1;
    let mut ends = Vec::new();
    for sign in [1.0, -1.0] {
        let external = [0.0, 0.0, 0.0, sign * pull, 0.0];
        let work = |at: &[f64]| sign * pull * at[3];
        let mut last = f64::INFINITY;
        for _ in 0..12_000 {
            stepper
                .step(&mut q, &mut v, &[0.0; 5], &external, 5e-5)
                .unwrap();
            let at = &links(&stepper, &q, &v)[0];
            let now = energy(&robot, &springs, &stepper, &q, &v) - work(at);
            // Rounding of the step length at the end of a contact.
            assert!(now < last + 2e-5 * pull * gap, "{now} after {last}");
            last = now;
            assert!(slip(&robot, &springs, &q, at) < 1e-9, "{at:?}");
        }
        assert_eq!(q, motors);
        ends.push(links(&stepper, &q, &v)[0].clone());
    }
    let moved: Vec<f64> = ends[0].iter().zip(&ends[1]).map(|(a, b)| a - b).collect();
    let travel = gap + 2.0 * pull / stiffness;
    println!("{moved:?}, {travel} rad");
    assert!((moved[3] - travel).abs() < 1e-6, "{moved:?}");
    assert!(
        (moved[4] + 128.0 / 76.8 * moved[3]).abs() < 1e-9,
        "{moved:?}"
    );
    assert!(moved[..3].iter().all(|own| own.abs() < 1e-9), "{moved:?}");
}
