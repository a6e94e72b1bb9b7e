#![allow(clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Matrix4};
use rig_shared::effects::{Effect, Kind};
use rig_shared::multibody::{kinetic_energy, potential_energy};

use super::*;
use crate::robot::{IRP6_TEMPLATE, Robot, RobotEffect};

/// Mass, distance of its centre from the axis, central inertia and rotor inertia at the joint of every link.
const LINK: [f64; 4] = [2.0, 0.25, 0.04, 0.3];
/// Length of every link, m.
const LENGTH: f64 = 0.5;

/// A planar arm of `n` equal links without friction, in the horizontal plane if `level`.
pub(super) fn planar(n: usize, level: bool) -> Robot {
    let [mass, centre, inertia, rotor] = LINK;
    let mut text = format!(
        "name = \"arm\"\ngravity = [0.0, {}, 0.0]\n",
        if level { 0.0 } else { -9.81 }
    );
    for k in 0..n {
        text += &format!(
            "[[joint]]\nname = \"j{k}\"\nkind = \"revolute\"\nalpha = 0.0\na = {:?}\ntheta = 0.0\nd = 0.0\n\
             [joint.inertial]\nmass = {mass:?}\nfirst_moment = [{:?}, 0.0, 0.0]\n\
             inertia = [0.01, 0.0, 0.0, {iz:?}, 0.0, {iz:?}]\n\
             [joint.drive]\ngear_ratio = 100.0\nrotor_inertia = {:?}\ntorque_constant = 0.1\n\
             [joint.friction]\ncoulomb = 0.0\nviscous = 0.0\noffset = 0.0\n",
            if k == 0 { 0.0 } else { LENGTH },
            mass * centre,
            rotor / 1e4,
            iz = inertia + mass * centre * centre,
        );
    }
    Robot::from_toml(&text, "arm.toml".as_ref()).unwrap()
}

/// A spatial arm: its second axis is across the first, and gravity acts.
fn spatial() -> Robot {
    let mut robot = planar(3, false);
    robot.gravity = [0.0, 0.0, -9.81];
    robot.joints[1].alpha = -FRAC_PI_2;
    robot
}

pub(super) fn with(mut robot: Robot, joint: usize, kind: Kind, shapes: &[f64]) -> Robot {
    robot.effects.push(RobotEffect {
        joint: Some(robot.joints[joint].name.clone()),
        other: None,
        effect: Effect::new(kind, &[], shapes),
    });
    robot
}

pub(super) fn hold(robot: &mut Robot, joint: usize) {
    robot.joints[joint].friction.as_mut().unwrap().coulomb = 1e6;
}

/// Position and velocity of every link.
pub(super) fn links(stepper: &Stepper<'_>, q: &[f64], v: &[f64]) -> [Vec<f64>; 2] {
    let state = |j: usize| stepper.link(j).unwrap_or([q[j], v[j]]);
    let all = || 0..q.len();
    [
        all().map(|j| state(j)[0]).collect(),
        all().map(|j| state(j)[1]).collect(),
    ]
}

/// Twist of every drive between its motor and the links at `links`: of the joint, or of the motor of a screw.
pub(super) fn twists(robot: &Robot, motors: &[f64], links: &[f64]) -> Vec<f64> {
    let transmission = robot.transmission().unwrap();
    let [front, behind] = [motors, links].map(|q| {
        let mut psi = vec![0.0; q.len()];
        transmission.motor_position(q, &mut psi).unwrap();
        psi
    });
    let scale = |joint: &crate::robot::Joint| {
        let drive = joint.drive.as_ref().unwrap();
        if drive.screw.is_some() {
            1.0
        } else {
            joint.gear_ratio()
        }
    };
    (front.iter().zip(&behind).zip(&robot.joints))
        .map(|((front, behind), joint)| (front - behind) / scale(joint))
        .collect()
}

/// Energy of rotors, links and springs; of the latter gap and stiffness are given by joint.
pub(super) fn energy(
    robot: &Robot,
    springs: &[(usize, f64, f64)],
    stepper: &Stepper<'_>,
    q: &[f64],
    v: &[f64],
) -> f64 {
    let mut bare = robot.clone();
    bare.effects.clear();
    for joint in &mut bare.joints {
        joint.drive = None;
    }
    let model = Model::from_robot(&bare).unwrap();
    let [at, speed] = links(stepper, q, v);
    let mut psid = vec![0.0; q.len()];
    let transmission = robot.transmission().unwrap();
    transmission.motor_velocity(q, v, &mut psid).unwrap();
    let rotors: f64 = psid
        .iter()
        .zip(&robot.joints)
        .map(|(w, j)| 0.5 * j.drive.as_ref().unwrap().rotor_inertia * w * w)
        .sum();
    let twists = twists(robot, q, &at);
    let bent: f64 = springs
        .iter()
        .map(|(j, gap, stiffness)| {
            let twist = twists[*j];
            0.5 * stiffness * (twist - twist.clamp(-0.5 * gap, 0.5 * gap)).powi(2)
        })
        .sum();
    rotors
        + bent
        + kinetic_energy(&model.chain, &model.parameters, &at, &speed).unwrap()
        + potential_energy(&model.chain, &model.parameters, &at).unwrap()
}

#[test]
fn work_of_the_motors_is_energy_gained_and_lost() {
    let [stiffness, damping, share] = [800.0, 0.6, 0.3];
    let mut robot = spatial();
    for joint in [0, 2] {
        robot = with(
            robot,
            joint,
            Kind::JointElasticity,
            &[stiffness, damping, share],
        );
    }
    for joint in &mut robot.joints {
        let friction = joint.friction.as_mut().unwrap();
        (friction.coulomb, friction.viscous) = (0.2, 0.3);
    }
    let springs = [(0, 0.0, stiffness), (2, 0.0, stiffness)];
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (vec![0.4, -0.8, 0.6], vec![0.0; 3]);
    stepper.put_links_at_rest(&q, &v).unwrap();
    let start = energy(&robot, &springs, &stepper, &q, &v);
    let (mut work, mut lost, dt) = (0.0, 0.0, 2e-5);
    for k in 0..50_000 {
        let t = f64::from(k) * dt;
        let torque = [
            6.0 * (9.0 * t).sin(),
            12.0 * (4.0 * t).cos(),
            5.0 * (13.0 * t).sin(),
        ];
        let before = (v.clone(), links(&stepper, &q, &v)[1].clone());
        stepper.step(&mut q, &mut v, &torque, &[], dt).unwrap();
        let after = links(&stepper, &q, &v)[1].clone();
        for j in 0..3 {
            let motor = 0.5 * (before.0[j] + v[j]);
            let link = 0.5 * (before.1[j] + after[j]);
            let side = if j == 1 { 0.0 } else { share };
            let friction = |w: f64| 0.3 * w * w + 0.2 * w.abs();
            work += dt * torque[j] * motor;
            lost += dt * ((1.0 - side) * friction(motor) + side * friction(link));
            if j != 1 {
                lost += dt * damping * (motor - link) * (motor - link);
            }
        }
    }
    let gained = energy(&robot, &springs, &stepper, &q, &v) - start;
    println!("work {work} J, gained {gained} J, lost {lost} J");
    assert!(work.abs() > 1.0 && lost > 1.0);
    assert!((work - gained - lost).abs() < 1e-5 * lost);
}

/// Acceleration of motor `joint` per torque on it at angular frequency `omega`, from its answer `speeds` to an impulse.
pub(super) fn response(speeds: &[f64], impulse: f64, dt: f64, omega: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (k, pair) in speeds.windows(2).enumerate() {
        let (sin, cos) = (omega * (k as f64 + 0.5) * dt).sin_cos();
        re += (pair[1] - pair[0]) * cos;
        im -= (pair[1] - pair[0]) * sin;
    }
    re.hypot(im) / impulse
}

/// Velocities of motor `joint` after an impulse on it, until the vibration has decayed.
fn struck(robot: &Robot, q: &[f64], joint: usize, impulse: f64, dt: f64, count: usize) -> Vec<f64> {
    let model = Model::from_robot(robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (q.to_vec(), vec![0.0; q.len()]);
    let mut torque = vec![0.0; q.len()];
    torque[joint] = impulse / dt;
    let mut speeds = vec![0.0];
    for _ in 0..count {
        stepper.step(&mut q, &mut v, &torque, &[], dt).unwrap();
        torque[joint] = 0.0;
        speeds.push(v[joint]);
    }
    speeds
}

/// Returns the angular frequency between `from` and `to` at which `value` is greatest.
pub(super) fn peak(from: f64, to: f64, value: impl Fn(f64) -> f64) -> f64 {
    let place = |k: i32| from + (to - from) * f64::from(k) / 400.0;
    let best = (0..=400).max_by(|a, b| value(place(*a)).total_cmp(&value(place(*b))));
    let best = best.unwrap();
    assert!(
        0 < best && best < 400,
        "no extremum between {from} and {to}"
    );
    place(best)
}

#[test]
fn two_masses_at_a_joint_of_an_arm_answer_as_the_closed_form() {
    let stiffness = 900.0;
    let mut robot = with(
        planar(3, true),
        1,
        Kind::JointElasticity,
        &[stiffness, 0.25, 0.0],
    );
    hold(&mut robot, 0);
    hold(&mut robot, 2);
    // The third link is held at a right angle to the second, by its gear.
    let q = [0.7, -0.4, FRAC_PI_2];
    let [mass, centre, inertia, rotor] = LINK;
    let own = inertia + mass * centre * centre;
    let carried = inertia + mass * (LENGTH * LENGTH + centre * centre);
    // The held rotor of the third joint turns with the third link: the model counts a rotor's spin about its joint only.
    let link = own + carried;
    let dt = 2e-4;
    let speeds = struck(&robot, &q, 1, 1e-3, dt, 60_000);
    let [antiresonance, resonance] = [
        (stiffness / link).sqrt(),
        (stiffness * (1.0 / link + 1.0 / rotor)).sqrt(),
    ];
    let at = |omega| response(&speeds, 1e-3, dt, omega);
    let found = [
        peak(0.9 * antiresonance, 1.1 * antiresonance, |w| -at(w)),
        peak(0.9 * resonance, 1.1 * resonance, at),
    ];
    println!(
        "antiresonance {antiresonance} rad/s, found {}; resonance {resonance} rad/s, found {}",
        found[0], found[1]
    );
    assert!(
        (found[0] / antiresonance - 1.0).abs() < 0.01,
        "{found:?} {antiresonance}"
    );
    assert!(
        (found[1] / resonance - 1.0).abs() < 0.01,
        "{found:?} {resonance}"
    );
    // The whole curve: (Jl·s² + d·s + c)/(Jl·Jm·s² + (Jl + Jm)·(d·s + c)).
    for k in 1..20 {
        let w = 4.0 * resonance * f64::from(k) / 20.0;
        let over = (stiffness - link * w * w).hypot(0.25 * w);
        let sum = link + rotor;
        let under = (sum * stiffness - link * rotor * w * w).hypot(sum * 0.25 * w);
        assert!(
            (at(w) * under / over - 1.0).abs() < 0.02,
            "{w}: {} {}",
            at(w),
            over / under
        );
    }
}

#[test]
fn two_elastic_joints_vibrate_at_the_eigenfrequencies() {
    let stiffness = [1500.0, 600.0];
    let mut robot = planar(2, true);
    for (joint, c) in stiffness.into_iter().enumerate() {
        robot = with(robot, joint, Kind::JointElasticity, &[c, 0.08, 0.0]);
    }
    let q = [0.3, 1.1];
    // The textbook's planar arm of two links, and the motors.
    let [mass, centre, inertia, rotor] = LINK;
    let outer = inertia + mass * centre * centre;
    let coupled = mass * LENGTH * centre * f64::cos(q[1]);
    let links = Matrix2::new(
        2.0 * outer + mass * LENGTH * LENGTH + 2.0 * coupled,
        outer + coupled,
        outer + coupled,
        outer,
    );
    let (mut m, mut k) = (Matrix4::zeros(), Matrix4::zeros());
    m.fixed_view_mut::<2, 2>(0, 0).fill_diagonal(rotor);
    m.fixed_view_mut::<2, 2>(2, 2).copy_from(&links);
    for (j, c) in stiffness.into_iter().enumerate() {
        k[(j, j)] = c;
        k[(j + 2, j + 2)] = c;
        k[(j, j + 2)] = -c;
        k[(j + 2, j)] = -c;
    }
    let root = m.cholesky().unwrap().l().try_inverse().unwrap();
    let mut squares: Vec<f64> = (root * k * root.transpose())
        .symmetric_eigenvalues()
        .iter()
        .copied()
        .collect();
    squares.sort_by(f64::total_cmp);
    let dt = 2e-4;
    let speeds = struck(&robot, &q, 1, 1e-3, dt, 100_000);
    for square in &squares[2..] {
        let omega = square.sqrt();
        let found = peak(0.93 * omega, 1.07 * omega, |w| {
            response(&speeds, 1e-3, dt, w)
        });
        println!("{omega} rad/s, found {found}");
        assert!((found / omega - 1.0).abs() < 2e-3, "{found} {omega}");
    }
}

#[test]
fn a_stiffer_gear_comes_closer_to_the_rigid_one() {
    let end = |robot: &Robot| {
        let model = Model::from_robot(robot).unwrap();
        let mut stepper = Stepper::new(&model).unwrap();
        let (mut q, mut v) = (vec![0.4, -0.8, 0.6], vec![0.0; 3]);
        for k in 0..1000 {
            let torque = [5.0 * (f64::from(k) * 8e-3).sin(), 3.0, -2.0];
            stepper.step(&mut q, &mut v, &torque, &[], 5e-4).unwrap();
        }
        q
    };
    let rigid = end(&spatial());
    let off = |stiffness: f64| {
        let mut robot = spatial();
        for joint in 0..3 {
            let damping = 0.02 * stiffness.sqrt();
            robot = with(
                robot,
                joint,
                Kind::JointElasticity,
                &[stiffness, damping, 0.5],
            );
        }
        let found = end(&robot);
        rigid
            .iter()
            .zip(found)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    };
    let [soft, stiff] = [1e4, 1e6].map(off);
    println!("{soft} rad at 1e4 N·m/rad, {stiff} rad at 1e6");
    assert!(soft > 1e-4 && stiff < 0.03 * soft, "{soft} {stiff}");
}

#[test]
fn backlash_flies_and_strikes_without_a_gain_of_energy() {
    let gap = 0.05;
    for damping in [0.0, 2.0] {
        let robot = with(
            planar(2, true),
            1,
            Kind::Backlash,
            &[gap, 2e3, damping, 0.0],
        );
        let model = Model::from_robot(&robot).unwrap();
        let mut stepper = Stepper::new(&model).unwrap();
        let (mut q, mut v) = (vec![0.2, 0.5], vec![0.0, 0.0]);
        stepper.put_links_at_rest(&q, &v).unwrap();
        v = vec![0.4, -1.5];
        let springs = [(1, gap, 2e3)];
        let start = energy(&robot, &springs, &stepper, &q, &v);
        let (mut last, mut flying, mut touching, mut strikes) = (start, 0, 0, 0);
        let mut before = false;
        for _ in 0..20_000 {
            let speed = v[1];
            stepper.step(&mut q, &mut v, &[0.0; 2], &[], 1e-4).unwrap();
            let twist = q[1] - stepper.link(1).unwrap()[0];
            let touches = twist.abs() > 0.5 * gap;
            if touches {
                touching += 1;
            } else if !before {
                // Nothing pulls on a motor in flight: gravity is off.
                assert!((v[1] - speed).abs() < 1e-12);
                flying += 1;
            }
            strikes += usize::from(touches && !before);
            before = touches;
            let now = energy(&robot, &springs, &stepper, &q, &v);
            // Rounding of the step length at the end of a contact.
            assert!(now < last + 2e-5 * start, "{damping}: {now} after {last}");
            last = now;
        }
        println!(
            "{flying} steps in flight, {touching} in contact, {strikes} strikes, {start} J, then {last} J"
        );
        assert!(flying > 100 && touching > 100 && strikes > 3);
        assert_eq!(last < 0.99 * start, damping > 0.0, "{start} {last}");
    }
}

#[test]
fn links_start_at_rest_under_gravity() {
    let mut robot = spatial();
    for (joint, kind, shapes) in [
        (0, Kind::JointElasticity, &[500.0, 1.0, 0.0][..]),
        (1, Kind::Backlash, &[0.02, 700.0, 1.0, 0.0]),
        (2, Kind::JointElasticity, &[300.0, 1.0, 0.0]),
    ] {
        robot = with(robot, joint, kind, shapes);
        hold(&mut robot, joint);
    }
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (vec![0.4, -0.3, 0.6], vec![0.0; 3]);
    stepper.put_links_at_rest(&q, &v).unwrap();
    let start = links(&stepper, &q, &v)[0].clone();
    assert!(
        (start[1] - q[1]).abs() > 0.02 && (start[2] - q[2]).abs() > 0.01,
        "{start:?}"
    );
    for _ in 0..2000 {
        stepper.step(&mut q, &mut v, &[0.0; 3], &[], 1e-3).unwrap();
    }
    let end = links(&stepper, &q, &v)[0].clone();
    for (a, b) in start.iter().zip(&end) {
        assert!((a - b).abs() < 1e-10, "{start:?} {end:?}");
    }
}

#[test]
fn torques_from_outside_act_on_the_links() {
    // With stiff gears they add to the motors' torques.
    let robot = spatial();
    let model = Model::from_robot(&robot).unwrap();
    let end = |torque: [f64; 3], external: &[f64]| {
        let mut stepper = Stepper::new(&model).unwrap();
        let (mut q, mut v) = (vec![0.4, -0.3, 0.6], vec![0.0; 3]);
        for _ in 0..200 {
            stepper
                .step(&mut q, &mut v, &torque, external, 1e-3)
                .unwrap();
        }
        q
    };
    let [one, other] = [
        end([3.0, -1.0, 2.0], &[]),
        end([2.5, -1.0, 0.0], &[0.5, 0.0, 2.0]),
    ];
    for (a, b) in one.iter().zip(&other) {
        assert!((a - b).abs() < 1e-12, "{one:?} {other:?}");
    }
    // Behind an elastic gear whose motor is held they wind up the gear.
    let mut robot = with(
        planar(2, true),
        1,
        Kind::JointElasticity,
        &[400.0, 8.0, 0.0],
    );
    hold(&mut robot, 0);
    hold(&mut robot, 1);
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (vec![0.4, -0.3], vec![0.0; 2]);
    for _ in 0..5000 {
        stepper
            .step(&mut q, &mut v, &[0.0; 2], &[0.0, 3.0], 1e-3)
            .unwrap();
    }
    let [link, speed] = stepper.link(1).unwrap();
    assert_eq!(q, [0.4, -0.3]);
    assert!(
        (link - (q[1] + 3.0 / 400.0)).abs() < 1e-9 && speed.abs() < 1e-9,
        "{link} {speed}"
    );
    assert!(
        stepper
            .step(&mut q, &mut v, &[0.0; 2], &[1.0], 1e-3)
            .is_err()
    );
}

/// The IRp-6 without friction.
pub(super) fn smooth_irp6() -> Robot {
    let mut robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    for joint in &mut robot.joints {
        joint.friction = None;
        let drive = joint.drive.as_mut().unwrap();
        (drive.coulomb, drive.viscous) = (0.0, 0.0);
    }
    robot
}

/// The IRp-6 with coupled drives: the inertia of the motors is on the motors' side of every gear.
#[test]
fn the_irp6_with_elastic_gears_keeps_its_energy() {
    let mut robot = smooth_irp6();
    // Two screws, with the stiffness at the motor, and the coupled joints of the wrist.
    let springs = [(1, 0.0, 0.8), (2, 0.0, 0.8), (3, 0.0, 2e3), (4, 0.0, 300.0)];
    for (joint, _, stiffness) in springs {
        robot = with(robot, joint, Kind::JointElasticity, &[stiffness, 0.0, 0.0]);
    }
    let model = Model::from_robot(&robot).unwrap();
    let drift = |dt: f64| {
        let mut stepper = Stepper::new(&model).unwrap();
        let (mut q, mut v) = (robot.middle_position(), vec![0.8, 1.0, -2.2, 2.5, 2.0]);
        stepper.put_links_at_rest(&q, &v).unwrap();
        let start = energy(&robot, &springs, &stepper, &q, &v);
        for _ in 0..(0.3 / dt).round() as usize {
            stepper.step(&mut q, &mut v, &[0.0; 5], &[], dt).unwrap();
        }
        (energy(&robot, &springs, &stepper, &q, &v) - start).abs() / start.abs()
    };
    let [coarse, fine] = [2e-4, 1e-4].map(drift);
    println!("{coarse} {fine}");
    assert!(coarse < 1e-3 && fine < coarse / 3.0, "{coarse} {fine}");
}

/// The IRp-6 without dry friction, with a spring at each of its coupled drives.
fn elastic_irp6(stiffness: [f64; 4]) -> Robot {
    let mut robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    for (joint, stiffness) in (1..5).zip(stiffness) {
        robot = with(robot, joint, Kind::JointElasticity, &[stiffness, 0.0, 0.0]);
    }
    robot
}

#[test]
fn a_soft_drive_of_the_parallelogram_lets_its_arm_sag_and_does_not_tilt_the_next() {
    let robot = elastic_irp6([0.5, 1e9, 1e12, 1e12]);
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, v) = (robot.middle_position(), vec![0.0; 5]);
    // Away from upright, where gravity has no lever.
    q[1] += 0.35;
    stepper.put_links_at_rest(&q, &v).unwrap();
    let at = links(&stepper, &q, &v)[0].clone();
    assert!((at[1] - q[1]).abs() > 1e-3, "{at:?}");
    // The drives of upper arm and wrist hold their angles against the base.
    let mut absolute = 0.0;
    for j in 1..4 {
        absolute += at[j] - q[j];
        assert!(j == 1 || absolute.abs() < 1e-6, "joint {j}: {at:?} {q:?}");
    }
    // Virtual work: the spring's torque times its twist for a motion of the lower arm alone is that of gravity.
    let twist = twists(&robot, &q, &at);
    let height = |by: f64| {
        let mut moved = at.clone();
        (moved[1], moved[2]) = (moved[1] + by, moved[2] - by);
        let bare = Model::from_robot(&robot).unwrap();
        let potential = potential_energy(&bare.chain, &bare.parameters, &moved).unwrap();
        [potential, twists(&robot, &q, &moved)[1]]
    };
    let ([up, more], [down, less]) = (height(1e-5), height(-1e-5));
    let (gravity, spring) = (up - down, -0.5 * twist[1] * (more - less));
    assert!((gravity / spring - 1.0).abs() < 1e-4, "{gravity} {spring}");
}

#[test]
fn friction_of_a_coupled_drive_stays_with_its_motor() {
    let rubbing = elastic_irp6([0.8, 0.8, 2e3, 300.0]);
    let rubbing = Robot {
        effects: (rubbing.effects.iter().cloned())
            .map(|mut own| {
                own.effect.shapes[2] = 0.5;
                own
            })
            .collect(),
        ..rubbing
    };
    let refused = Stepper::new(&Model::from_robot(&rubbing).unwrap())
        .err()
        .unwrap();
    assert!(
        refused.to_string().contains("link_friction = 0"),
        "{refused}"
    );
}

/// A step would have millions of parts: the gear is refused at the first one, with what would be right.
#[test]
fn a_gear_that_is_too_fast_for_the_steps_is_refused_at_once() {
    let said = |robot: &Robot| {
        let model = Model::from_robot(robot).unwrap();
        let n = robot.joints.len();
        let (mut q, mut v) = (vec![0.1; n], vec![0.0; n]);
        match Stepper::new(&model) {
            Err(error) => Some(error.to_string()),
            Ok(mut stepper) => (stepper.step(&mut q, &mut v, &vec![0.0; n], &[], 1e-3))
                .err()
                .map(|error| error.to_string()),
        }
    };
    let light = |n: usize| {
        let mut robot = planar(n, false);
        robot.joints[0].drive.as_mut().unwrap().rotor_inertia = 1e-12;
        robot
    };
    for (n, kind, shapes, by) in [
        (1, Kind::JointElasticity, &[2e6, 0.0, 0.0][..], "stiffness"),
        (1, Kind::Backlash, &[1e-3, 5e3, 900.0, 0.0], "damping"),
        (2, Kind::JointElasticity, &[2e6, 0.0, 0.0], "stiffness"),
    ] {
        let text = said(&with(light(n), 0, kind, shapes)).unwrap();
        assert!(
            text.contains("joint j0")
                && text.contains("Hz")
                && text.contains("rotor_inertia")
                && text.contains(&format!("a smaller {by}")),
            "{text}"
        );
    }
    // A link without much inertia behind a heavy motor.
    let mut robot = planar(1, false);
    let body = robot.joints[0].inertial.as_mut().unwrap();
    (body.mass, body.first_moment) = (1e-9, [0.0; 3]);
    body.inertia = [1e-9, 0.0, 0.0, 1e-9, 0.0, 1e-9];
    let text = said(&with(robot, 0, Kind::JointElasticity, &[1e3, 0.0, 0.0])).unwrap();
    assert!(text.contains("[joint.inertial]"), "{text}");
    // A small motor and a stiff gear of a real arm, 1.6 kHz.
    let mut robot = planar(1, false);
    robot.joints[0].drive.as_mut().unwrap().rotor_inertia = 1e-8;
    assert_eq!(
        said(&with(robot, 0, Kind::JointElasticity, &[1e4, 0.0, 0.0])),
        None
    );
}

/// Final positions and velocities of the IRp-6 with stiff gears, as the simulation without elastic gears of chains gave
/// them (commit 321a398).
#[test]
fn stiff_gears_move_bit_for_bit_as_before_there_were_elastic_ones() {
    let robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (robot.middle_position(), vec![0.2; 5]);
    for k in 0..500 {
        let torque: Vec<f64> = (0..5)
            .map(|j| (((k * (j + 3)) % 40) as f64 - 15.0) * [10.0, 10.0, 5.0, 1.0, 0.5][j])
            .collect();
        stepper.step(&mut q, &mut v, &torque, &[], 1e-3).unwrap();
    }
    let hash = q
        .iter()
        .chain(&v)
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, value| {
            (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3)
        });
    assert_eq!(hash, 0x68ce_1294_7dda_5526, "{q:?} {v:?}");
}
