//! A joint that yields while another one is shaken: the equations of motion of a planar arm in closed form (Lagrange), with an
//! elastic elbow, friction on its motor and a position loop at both joints.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;
use rig_data::{Block, JointColumns};
use rig_model::robot::{EDDA_TEMPLATE, Robot};

use super::rig::recording;
use crate::{ComplianceError, ComplianceOptions, FrequencyResponse, identify_compliance};

const STIFFNESS: f64 = 600.0;
/// Numbers of the description: inertias about the axes, a·mx, and the rotors.
const SHOULDER: f64 = 1.0276 + 6.0 * 0.45 * 0.45;
const ELBOW: f64 = 0.2434;
const OFFSET: f64 = 0.45 * 1.02;
const ROTORS: [f64; 2] = [0.25, 0.04];
const ROWS: f64 = 1000.0;

/// Records a chirp of the elbow, with the frequency (Hz) of the shoulder's position loop and the friction of the elbow's motor
/// (N·m).
fn chirp(loop_frequency: f64, coulomb: f64, seed: u64) -> Block {
    let (h, steps, seconds) = (5e-5, 20, 26.0);
    let mut dice = Pcg64Mcg::seed_from_u64(seed);
    let mut normal =
        |std: f64| -> f64 { std * Distribution::<f64>::sample(&StandardNormal, &mut dice) };
    // Shoulder, link and motor of the elbow: positions and velocities.
    let (mut q, mut v) = ([0.0f64; 3], [0.0f64; 3]);
    let (mut phase, mut columns) = (0.0, vec![Vec::new(); 5]);
    let stiff = TAU * loop_frequency;
    for row in 0..(seconds * ROWS) as usize {
        let t = row as f64 / ROWS;
        let omega = TAU * 40f64.powf(t / seconds);
        phase += omega / ROWS;
        let ramp = (2.0 * t).min(2.0 * (seconds - 0.6 - t)).clamp(0.0, 1.0);
        let size = 1.2f64.min(5.0 / omega).min(64.0 / (omega * omega));
        let reference = ramp * size * phase.sin();
        let whole = SHOULDER + ELBOW + 2.0 * OFFSET + ROTORS[0];
        let hold = -whole * (stiff * stiff * q[0] + 1.4 * stiff * v[0]);
        let drive = 400.0 * (reference - q[2]) - 8.0 * v[2];
        let measured = drive + normal(0.05);
        let read = [
            q[0] + normal(1e-6),
            hold,
            q[2] + normal(1e-6),
            measured,
            reference,
        ];
        for (column, value) in columns.iter_mut().zip(read) {
            column.push(value);
        }
        for _ in 0..steps {
            let (sin, cos) = q[1].sin_cos();
            let spring = STIFFNESS * (q[2] - q[1]) + 0.2 * (v[2] - v[1]);
            let m11 = SHOULDER + ELBOW + 2.0 * OFFSET * cos + ROTORS[0];
            let m12 = ELBOW + OFFSET * cos;
            let first = hold - 0.4 * v[0] + OFFSET * sin * (2.0 * v[0] * v[1] + v[1] * v[1]);
            let second = spring - OFFSET * sin * v[0] * v[0];
            let determinant = m11 * ELBOW - m12 * m12;
            let accelerations = [
                (ELBOW * first - m12 * second) / determinant,
                (m11 * second - m12 * first) / determinant,
            ];
            // Dry friction stops the motor if it can (Moreau 1988).
            let free = v[2] + h * (drive - spring - 0.12 * v[2]) / ROTORS[1];
            let stop = (coulomb * h / ROTORS[1]).min(free.abs()) * free.signum();
            v = [
                v[0] + h * accelerations[0],
                v[1] + h * accelerations[1],
                free - stop,
            ];
            for (q, v) in q.iter_mut().zip(v) {
                *q += h * v;
            }
        }
    }
    let [q1, tau1, q2, tau2, reference] = columns.try_into().unwrap();
    let rows = q1.len();
    let joint = |q: Vec<f64>, tau: Vec<f64>, reference: Vec<f64>| JointColumns {
        q,
        tau,
        reference: Some(reference),
        ..JointColumns::default()
    };
    Block {
        t: (0..rows).map(|k| k as f64 / ROWS).collect(),
        joints: vec![joint(q1, tau1, vec![0.0; rows]), joint(q2, tau2, reference)],
        first_line: 2,
        ..Block::default()
    }
}

fn respond(robot: &Robot, block: Block) -> Result<FrequencyResponse, ComplianceError> {
    let options = ComplianceOptions {
        joint: 1,
        ..ComplianceOptions::default()
    };
    identify_compliance(robot, &[], &[&recording(block)], &options)
        .map(|found| found.frequency.unwrap())
}

/// The coupling inertia of the shoulder is three times the inertia of the forearm: without its torque 600 N·m/rad come out as 982,
/// and count as a lower bound.
#[test]
fn a_shoulder_that_yields_is_no_other_stiffness() {
    let robot = Robot::from_toml(EDDA_TEMPLATE, "edda.toml".as_ref()).unwrap();
    for (frequency, coulomb, bound) in [(6.0, 0.0, 0.01), (6.0, 0.8, 0.05), (12.0, 0.8, 0.05)] {
        let found = respond(&robot, chirp(frequency, coulomb, 1)).unwrap();
        let said = found.warnings.join(" ");
        println!(
            "shoulder held at {frequency} Hz, friction {coulomb} N·m: {:?} N·m/rad, link {:?}, motor {:?}; {said}",
            found.stiffness, found.link_inertia, found.motor_inertia
        );
        assert!(
            (found.stiffness.value / STIFFNESS - 1.0).abs() < bound,
            "{:?}",
            found.stiffness
        );
        assert!((found.link_inertia.value / ELBOW - 1.0).abs() < bound);
        assert!(
            !found.is_lower_bound && found.backlash.unwrap_or(0.0) < 1e-4,
            "{said}"
        );
        assert!(said.contains("is taken into account"), "{said}");
    }
}

#[test]
fn a_shoulder_that_yields_is_refused_if_its_torque_is_not_described() {
    let mut robot = Robot::from_toml(EDDA_TEMPLATE, "edda.toml".as_ref()).unwrap();
    robot.joints[1].inertial = None;
    let said = respond(&robot, chirp(6.0, 0.8, 1)).unwrap_err().to_string();
    assert!(
        said.contains("[joint.inertial]") && said.contains("clamp joint"),
        "{said}"
    );
}
