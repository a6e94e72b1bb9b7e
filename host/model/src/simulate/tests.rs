#![allow(clippy::unwrap_used)]

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{column, kinetic_energy, potential_energy};

use super::*;
use crate::robot::{Controller, Robot};

/// A pendulum on a gear; `fc` and `fv` are its friction.
fn pendulum(fc: f64, fv: f64) -> Robot {
    toml::from_str(&format!(
        r#"
        name = "pendulum"
        gravity = [0.0, 0.0, -9.81]
        [[joint]]
        name = "link"
        kind = "revolute"
        alpha = 1.5707963267948966
        a = 0.0
        theta = 0.0
        d = 0.0
        [joint.inertial]
        mass = 1.0
        first_moment = [0.3, 0.0, 0.0]
        inertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.12]
        [joint.friction]
        coulomb = {fc:?}
        viscous = {fv:?}
        "#
    ))
    .unwrap()
}

/// Two links that swing against each other under gravity.
fn double_pendulum(fc: f64) -> Robot {
    let mut robot = pendulum(fc, 0.0);
    let mut second = robot.joints[0].clone();
    second.name = "second".into();
    second.alpha = 0.0;
    second.a = 0.5;
    robot.joints.push(second);
    robot
}

fn energy(model: &Model, q: &[f64], v: &[f64]) -> f64 {
    kinetic_energy(&model.chain, &model.parameters, q, v).unwrap()
        + potential_energy(&model.chain, &model.parameters, q).unwrap()
}

/// Swings freely and returns the final state and the energy that friction dissipated.
fn swing(robot: &Robot, dt: f64, seconds: f64) -> (Vec<f64>, Vec<f64>) {
    let model = Model::from_robot(robot).unwrap();
    let n = robot.joints.len();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v, none) = (vec![0.3; n], vec![0.0; n], vec![0.0; n]);
    for _ in 0..(seconds / dt).round() as usize {
        stepper.step(&mut q, &mut v, &none, &[], dt).unwrap();
    }
    (q, v)
}

#[test]
fn without_friction_energy_stays_and_the_error_falls_with_the_square_of_the_step() {
    let robot = double_pendulum(0.0);
    let model = Model::from_robot(&robot).unwrap();
    let before = energy(&model, &[0.3, 0.3], &[0.0, 0.0]);
    let drift = |dt| {
        let (q, v) = swing(&robot, dt, 2.0);
        (energy(&model, &q, &v) - before).abs()
    };
    let (coarse, fine) = (drift(1e-3), drift(5e-4));
    assert!(coarse < 1e-3, "{coarse}");
    assert!(fine < coarse / 3.0, "{coarse} {fine}");
}

#[test]
fn a_frictionless_swing_converges_to_the_fine_solution() {
    let robot = double_pendulum(0.0);
    let (reference, _) = swing(&robot, 1e-5, 1.0);
    let error = |dt| (swing(&robot, dt, 1.0).0[1] - reference[1]).abs();
    assert!(error(1e-3) < 1e-3);
    assert!(error(5e-4) < error(1e-3) / 3.0);
}

#[test]
fn coulomb_friction_takes_exactly_its_torque_times_the_way() {
    // Far from its rest position the pendulum swings to one side only: the travel is the change of angle.
    let robot = pendulum(0.4, 0.0);
    let frictionless = Model::from_robot(&pendulum(0.0, 0.0)).unwrap();
    let (q, v) = swing(&robot, 1e-5, 0.25);
    let lost = energy(&frictionless, &[0.3], &[0.0]) - energy(&frictionless, &q, &v);
    let way = (q[0] - 0.3).abs();
    assert!(way > 0.2);
    assert!((lost - 0.4 * way).abs() < 1e-6, "{lost} {way}");
}

#[test]
fn below_breakaway_nothing_creeps() {
    // Gravity of 2.94 N·m against 3 N·m of friction.
    let model = Model::from_robot(&pendulum(3.0, 0.1)).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (vec![0.0], vec![0.0]);
    for _ in 0..600_000 {
        stepper.step(&mut q, &mut v, &[0.0], &[], 1e-4).unwrap();
    }
    assert_eq!((q[0], v[0]), (0.0, 0.0));
}

#[test]
fn one_stuck_joint_carries_the_load_of_the_moving_one() {
    let mut robot = double_pendulum(0.0);
    robot.joints[0].friction.as_mut().unwrap().coulomb = 50.0;
    let (q, v) = swing(&robot, 1e-4, 1.0);
    assert_eq!((q[0], v[0]), (0.3, 0.0));
    // The second link then swings as a simple pendulum about a fixed pivot: its energy is its own.
    assert!((q[1] - 0.3).abs() > 0.5);
    let model = Model::from_robot(&robot).unwrap();
    let start = energy(&model, &[0.3, 0.3], &[0.0, 0.0]);
    assert!((energy(&model, &q, &v) - start).abs() < 1e-5);
}

#[test]
fn viscous_friction_decays_as_the_exponential() {
    let mut robot = pendulum(0.0, 0.6);
    robot.gravity = [0.0; 3];
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (vec![0.0], vec![2.0]);
    for _ in 0..2000 {
        stepper.step(&mut q, &mut v, &[0.0], &[], 1e-4).unwrap();
    }
    let exact = 2.0 * (-0.6_f64 / 0.12 * 0.2).exp();
    assert!((v[0] / exact - 1.0).abs() < 1e-6);
}

#[test]
fn the_stand_in_controller_tracks_a_slow_sine() {
    let robot = pendulum(0.0, 0.1);
    let model = Model::from_robot(&robot).unwrap();
    let reference: Vec<f64> = (0..4000)
        .map(|k| 0.5 * (0.001 * f64::from(k)).sin())
        .collect();
    let (controllers, stand_ins) = controllers(&robot, &model, &[0.0]).unwrap();
    assert_eq!(stand_ins, ["link"]);
    let inputs = Inputs {
        period: 1e-3,
        reference: &[reference],
        feed_forward: &[],
        added: &[],
        q: &[0.0],
        v: &[0.0],
        substeps: 4,
        held: true,
    };
    let motion = closed_loop(&robot, &model, &controllers, &inputs, |_| ()).unwrap();
    // Error of a cascade without feed-forward: gravity and viscous friction over the stiffness J·ω², and the lag of the
    // velocity over the position gain.
    let omega = core::f64::consts::TAU * STAND_IN_BANDWIDTH;
    let last = 3999;
    let speed = motion.qd[0][last];
    let load = 0.3 * 9.81 * motion.q[0][last].cos() + 0.1 * speed;
    let expected = -load / (0.12 * omega * omega) - speed / (0.5 * omega);
    let error = motion.q[0][last] - inputs.reference[0][last];
    assert!((error - expected).abs() < 5e-4, "{error} {expected}");
}

#[test]
fn friction_below_zero_is_refused_by_name() {
    let mut model = Model::from_robot(&pendulum(0.4, 0.1)).unwrap();
    model.parameters[0][column::VISCOUS] = -0.2;
    let error = Stepper::new(&model).err().unwrap().to_string();
    assert!(error.contains("fv1") && error.contains("-0.2"), "{error}");
}

/// The IRp-6 of the book without friction and without controllers.
fn frictionless_irp6() -> Robot {
    let path = std::path::Path::new("irp6.toml");
    let mut robot = Robot::from_toml(crate::robot::IRP6_TEMPLATE, path).unwrap();
    for joint in &mut robot.joints {
        joint.friction = None;
        let drive = joint.drive.as_mut().unwrap();
        (drive.coulomb, drive.viscous) = (0.0, 0.0);
    }
    robot
}

/// Energy of links and rotors. The rotors' part uses the motor speeds.
fn energy_with_rotors(robot: &Robot, q: &[f64], v: &[f64]) -> f64 {
    let mut links = robot.clone();
    for joint in &mut links.joints {
        joint.drive = None;
    }
    let links = Model::from_robot(&links).unwrap();
    let mut psid = vec![0.0; q.len()];
    robot
        .transmission()
        .unwrap()
        .motor_velocity(q, v, &mut psid)
        .unwrap();
    let rotors: f64 = psid
        .iter()
        .zip(&robot.joints)
        .map(|(w, j)| 0.5 * j.drive.as_ref().unwrap().rotor_inertia * w * w)
        .sum();
    energy(&links, q, v) + rotors
}

/// Joint speeds at which no motor of the IRp-6 stands still or reverses for some tenths of a second.
const THROWN: [f64; 5] = [0.8, 1.0, -2.2, 2.5, 2.0];

/// A throw of the IRp-6 from the middle of its range: final state, and ∫ f(q, v) dt along it.
fn throw(
    robot: &Robot,
    dt: f64,
    seconds: f64,
    mut power: impl FnMut(&[f64], &[f64]) -> f64,
) -> (Vec<f64>, Vec<f64>, f64) {
    let model = Model::from_robot(robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (robot.middle_position(), THROWN.to_vec());
    let mut sum = 0.5 * power(&q, &v);
    let steps = (seconds / dt).round() as usize;
    for k in 0..steps {
        stepper.step(&mut q, &mut v, &[0.0; 5], &[], dt).unwrap();
        sum += if k + 1 == steps { 0.5 } else { 1.0 } * power(&q, &v);
    }
    (q, v, sum * dt)
}

#[test]
fn the_irp6_keeps_the_energy_of_its_links_and_rotors() {
    let robot = frictionless_irp6();
    let start = energy_with_rotors(&robot, &robot.middle_position(), &THROWN);
    let drift = |dt: f64| {
        let (q, v, _) = throw(&robot, dt, 0.3, |_, _| 0.0);
        (energy_with_rotors(&robot, &q, &v) - start).abs()
    };
    let (coarse, fine) = (drift(2e-3), drift(1e-3));
    assert!(coarse < 1e-3 * start.abs(), "{coarse} of {start}");
    assert!(fine < coarse / 3.0, "{coarse} {fine}");
}

#[test]
fn the_friction_of_the_motors_takes_its_power_at_the_motors() {
    let mut robot = frictionless_irp6();
    for joint in &mut robot.joints {
        let drive = joint.drive.as_mut().unwrap();
        (drive.coulomb, drive.viscous) = (0.01, 3e-4);
    }
    let start = energy_with_rotors(&robot, &robot.middle_position(), &THROWN);
    let transmission = robot.transmission().unwrap();
    // The rate of loss is continuous where a motor reverses, so the sum over steps is valid there too.
    let (mut fastest, mut slowest) = ([0.0_f64; 5], [f64::INFINITY; 5]);
    let (q, v, lost) = throw(&robot, 1e-4, 0.2, |q, v| {
        let mut psid = [0.0; 5];
        transmission.motor_velocity(q, v, &mut psid).unwrap();
        for (k, w) in psid.iter().enumerate() {
            fastest[k] = fastest[k].max(w.abs());
            slowest[k] = slowest[k].min(w.abs());
        }
        psid.iter().map(|w| 3e-4 * w * w + 0.01 * w.abs()).sum()
    });
    assert!(fastest.iter().all(|w| *w > 50.0), "{fastest:?}");
    // The screw of the forearm comes to rest and turns back.
    assert!(slowest[2] < 1.0, "{slowest:?}");
    let after = energy_with_rotors(&robot, &q, &v);
    assert!(lost > 1.0);
    assert!(
        (start - after - lost).abs() < 1e-4 * lost,
        "{start} {after} {lost}"
    );
}

#[test]
fn a_motor_that_sticks_holds_the_joints_it_moves() {
    // Friction of the screws' motors above the torque of gravity; the wrist's friction is at its joints.
    let mut robot = frictionless_irp6();
    for joint in &mut robot.joints {
        joint.drive.as_mut().unwrap().coulomb = 3.0;
    }
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let start = robot.middle_position();
    let (mut q, mut v) = (start.clone(), vec![0.0; 5]);
    for _ in 0..20_000 {
        stepper.step(&mut q, &mut v, &[0.0; 5], &[], 1e-3).unwrap();
    }
    assert_eq!(q, start);
}

#[test]
fn model_and_simulation_agree_on_the_irp6_with_all_its_friction() {
    let path = std::path::Path::new("irp6.toml");
    let robot = Robot::from_toml(crate::robot::IRP6_TEMPLATE, path).unwrap();
    let model = Model::from_robot(&robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (q, v) = (robot.middle_position(), [0.3, 0.25, -0.35, 0.4, -0.7]);
    let torque = [150.0, -220.0, 90.0, -40.0, 25.0];
    let dt = 1e-6;
    let (mut next_q, mut next_v) = (q.clone(), v.to_vec());
    stepper
        .step(&mut next_q, &mut next_v, &torque, &[], dt)
        .unwrap();
    let acceleration: Vec<f64> = next_v.iter().zip(v).map(|(a, b)| (a - b) / dt).collect();
    let mut tau = [0.0; 5];
    model
        .inverse_dynamics(&q, &v, &acceleration, &mut tau)
        .unwrap();
    for (a, b) in tau.iter().zip(torque) {
        assert!((a - b).abs() < 0.01, "{tau:?} {torque:?}");
    }
}

/// The rotors' kinetic energy is ½·J·ψ̇² with the motor speeds ψ̇ = R·q̇ of the published ratios, so they add Rᵀ·J·R to the
/// inertia matrix, in every pose.
#[test]
fn rotors_of_the_tx40_move_by_the_published_ratios() {
    let path = std::path::Path::new("tx40.toml");
    let robot = Robot::from_toml(crate::robot::TX40, path).unwrap();
    let mut bare = robot.clone();
    for joint in &mut bare.joints {
        joint.drive.as_mut().unwrap().rotor_inertia = 0.0;
    }
    let mut ratios = DMatrix::from_diagonal(&DVector::from_vec(vec![
        32.0, 32.0, 45.0, -48.0, 45.0, 32.0,
    ]));
    ratios[(5, 4)] = 32.0;
    let rotors = DVector::from_iterator(
        6,
        robot
            .joints
            .iter()
            .map(|joint| joint.drive.as_ref().unwrap().rotor_inertia),
    );
    let wanted = ratios.transpose() * DMatrix::from_diagonal(&rotors) * &ratios;
    let matrix = |robot: &Robot, q: &[f64]| {
        let mut out = vec![0.0; 36];
        let model = Model::from_robot(robot).unwrap();
        model.inertia_matrix(q, &mut out).unwrap();
        DMatrix::from_row_slice(6, 6, &out)
    };
    for k in 0..5 {
        let q: Vec<f64> = (0..6)
            .map(|j| (1.7 * f64::from(k) + 0.9 * f64::from(j)).sin())
            .collect();
        let all = matrix(&robot, &q);
        assert!((&all - matrix(&bare, &q) - &wanted).amax() < 1e-12);
        // Every direction has inertia: an integrator can step the arm.
        let least = all.symmetric_eigen().eigenvalues.min();
        assert!(least > 0.5 * rotors[5] * 32.0 * 32.0, "{least}");
    }
    Stepper::new(&Model::from_robot(&robot).unwrap()).unwrap();
}

#[test]
fn coupled_friction_that_would_drive_is_refused() {
    let path = std::path::Path::new("tx40.toml");
    let mut robot = Robot::from_toml(crate::robot::TX40, path).unwrap();
    for joint in &mut robot.joints {
        joint.friction = None;
        joint.drive.as_mut().unwrap().viscous = 0.0;
    }
    let mut model = Model::from_robot(&robot).unwrap();
    // Cross damping of the wrist without the diagonal terms that belong to it.
    model.motors.as_mut().unwrap().parameters[5][1] = 0.5;
    let error = Stepper::new(&model).err().unwrap().to_string();
    assert!(error.contains("-0.5"), "{error}");
}

/// The pendulum without gravity behind an elastic shaft, with `share` of its friction on the link's side.
fn elastic_joint(share: f64) -> Robot {
    let mut text = pendulum(1.0, 0.2).to_toml().unwrap();
    text += &format!(
        r#"
        [joint.drive]
        gear_ratio = 50.0
        rotor_inertia = 2.0e-5
        torque_constant = 0.05
        [[effect]]
        kind = "joint_elasticity"
        joint = "link"
        stiffness = 200.0
        damping = 2.0
        link_friction = {share:?}
        "#
    );
    let mut robot = Robot::from_toml(&text, std::path::Path::new("elastic.toml")).unwrap();
    robot.gravity = [0.0; 3];
    robot
}

/// Position and velocity of motor and link after a constant torque from rest.
fn pushed(robot: &Robot, torque: f64, seconds: f64) -> [[f64; 2]; 2] {
    let model = Model::from_robot(robot).unwrap();
    let mut stepper = Stepper::new(&model).unwrap();
    let (mut q, mut v) = (vec![0.0], vec![0.0]);
    for _ in 0..(seconds / 1e-3).round() as usize {
        stepper.step(&mut q, &mut v, &[torque], &[], 1e-3).unwrap();
    }
    [[q[0], v[0]], stepper.link(0).unwrap()]
}

#[test]
fn friction_behind_an_elastic_gear_holds_the_link_while_the_motor_winds_it_up() {
    // All friction on the link: nothing holds the motor, which stops where the spring balances the torque.
    let [motor, link] = pushed(&elastic_joint(1.0), 0.5, 3.0);
    assert_eq!(link, [0.0; 2]);
    assert!((motor[0] - 0.5 / 200.0).abs() < 1e-9, "{motor:?}");
    // All friction on the motor: nothing moves.
    assert_eq!(pushed(&elastic_joint(0.0), 0.5, 3.0), [[0.0; 2]; 2]);
    // Half: the motor breaks loose and winds until spring and its own friction hold it; the link never moves.
    let [motor, link] = pushed(&elastic_joint(0.5), 0.8, 3.0);
    assert_eq!(link, [0.0; 2]);
    assert_eq!(motor[1], 0.0);
    let spring = 200.0 * motor[0];
    assert!((0.3..0.5).contains(&spring), "{spring}");
}

#[test]
fn the_side_of_the_friction_changes_the_twist_but_not_the_steady_speed() {
    for share in [0.0, 0.4, 1.0] {
        let [motor, link] = pushed(&elastic_joint(share), 1.2, 20.0);
        // 1.2 = 1.0 + 0.2·v.
        assert!((motor[1] - 1.0).abs() < 1e-6, "{share}: {motor:?}");
        assert!((link[1] - 1.0).abs() < 1e-6, "{share}: {link:?}");
        // The gear transmits the friction behind it.
        let spring = 200.0 * (motor[0] - link[0]);
        assert!((spring - share * 1.2).abs() < 1e-6, "{share}: {spring}");
    }
}

#[test]
fn a_link_without_inertia_is_named_whatever_the_controllers() {
    let named = |robot: &Robot, q: &[f64]| {
        let model = Model::from_robot(robot).unwrap();
        controllers(robot, &model, q)
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    let mut robot = double_pendulum(0.1);
    assert_eq!(named(&robot, &[0.3, 0.2]), Ok(()));
    // A point on its own axis.
    let tip = robot.joints[1].inertial.as_mut().unwrap();
    (tip.first_moment, tip.inertia) = ([0.0; 3], [0.0; 6]);
    let controller = Controller {
        position_gain: 10.0,
        velocity_gain: 20.0,
        torque_gain: 0.1,
    };
    let message = named(&robot, &[0.3, 0.2]).unwrap_err();
    assert!(
        message.contains("joint \"second\" has no inertia to move"),
        "{message}"
    );
    for joint in &mut robot.joints {
        joint.controller = Some(controller.clone());
    }
    assert!(
        named(&robot, &[0.3, 0.2])
            .unwrap_err()
            .contains("\"second\"")
    );
    robot.joints[1].drive = Some(crate::robot::Drive {
        gear_ratio: 50.0,
        rotor_inertia: 1e-6,
        ..Default::default()
    });
    assert_eq!(named(&robot, &[0.3, 0.2]), Ok(()));
}

/// If presliding is close to the whole friction, the difference between the directions is the same constant.
#[test]
fn friction_that_differs_by_direction_is_a_constant_however_much_is_remembered() {
    let end = |coulomb: f64| {
        let mut robot = pendulum(coulomb, 0.2);
        robot.gravity = [0.0; 3];
        let placed = |text: &str| toml::from_str::<Robot>(text).unwrap().effects;
        let toml = toml::to_string(&robot).unwrap();
        robot.effects = placed(&format!(
            "{toml}\n[[effect]]\nkind = 'presliding'\nlaw = 'dahl'\njoint = 'link'\ncoulomb = 0.3\nstroke = 0.02\n[[effect]]\nkind = 'asymmetric_coulomb'\njoint = 'link'\nasymmetry = 0.1\n"
        ));
        let model = Model::from_robot(&robot).unwrap();
        let mut stepper = Stepper::new(&model).unwrap();
        let (mut q, mut v) = (vec![0.0], vec![0.0]);
        for k in 0..4000 {
            let torque = 0.35 * (2e-3 * f64::from(k)).sin();
            stepper.step(&mut q, &mut v, &[torque], &[], 1e-3).unwrap();
        }
        q[0]
    };
    let [less, more] = [end(0.2999), end(0.3001)];
    assert!((less - more).abs() < 5e-3 * less.abs(), "{less} {more}");
}

/// Inverse dynamics of the links' motion gives the recorded torque: accelerations and torques belong together.
#[test]
fn accelerations_of_the_links_fit_the_torques() {
    let robot = double_pendulum(0.0);
    let model = Model::from_robot(&robot).unwrap();
    let controller = Controller {
        position_gain: 20.0,
        velocity_gain: 2.0,
        torque_gain: 1.0,
    };
    let reference: Vec<f64> = (0..800)
        .map(|k| 0.6 * (f64::from(k) * 0.01).sin())
        .collect();
    let inputs = Inputs {
        period: 2e-3,
        reference: &[reference.clone(), reference],
        feed_forward: &[],
        added: &[],
        q: &[0.0; 2],
        v: &[0.0; 2],
        substeps: 8,
        held: false,
    };
    let mut needed = Vec::new();
    let motion = closed_loop_watched(
        &robot,
        &model,
        &[controller.clone(), controller],
        &inputs,
        &Since::default(),
        |k, links| {
            assert_eq!(k, needed.len());
            let mut tau = [0.0; 2];
            model
                .inverse_dynamics(&links.q, &links.qd, &links.qdd, &mut tau)
                .unwrap();
            needed.push(tau);
        },
    )
    .unwrap();
    for (k, needed) in needed.iter().enumerate().skip(1) {
        for (own, needed) in motion.tau.iter().zip(needed) {
            assert!((own[k] - needed).abs() < 2e-3, "{k}: {} {needed}", own[k]);
        }
    }
}
