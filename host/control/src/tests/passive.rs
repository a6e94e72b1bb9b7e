//! Passivity of the adaptive law, by energies.

use super::{MIMIC, slippery};
use crate::closed_loop::closed_loop;
use crate::controller::Controller;
use crate::{LawKind, LawModel, Settings, default_reference, references};
use rig_model::simulate::Model;
use rig_shared::multibody::{column, kinetic_energy};

/// Twice the kinetic energy that a robot would have at velocities `s`, by the energies of bodies, rotors and motors; no
/// inertia matrix is involved.
fn doubled_energy(model: &LawModel, q: &[f64], s: &[f64]) -> f64 {
    let n = q.len();
    let mut sum = 2.0 * kinetic_energy(&model.chain, &model.parameters, q, s).unwrap();
    // Rotors count here if the function leaves them out: compare with a chain that has only rotors.
    let mut rotors = vec![[0.0; 14]; model.parameters.len()];
    for (own, row) in rotors.iter_mut().zip(&model.parameters) {
        own[column::DRIVE_INERTIA] = row[column::DRIVE_INERTIA];
    }
    let counted = 2.0 * kinetic_energy(&model.chain, &rotors, q, s).unwrap();
    let all: f64 = (rotors.iter().zip(s))
        .map(|(row, s)| row[column::DRIVE_INERTIA] * s * s)
        .sum();
    sum += all - counted;
    if let Some(motors) = &model.motors {
        let mut row = vec![0.0; 3 * n];
        motors
            .transmission
            .motor_energy_columns(q, s, &mut row)
            .unwrap();
        let values = motors.parameters.as_flattened();
        sum += 2.0 * row.iter().zip(values).map(|(y, p)| y * p).sum::<f64>();
    }
    sum
}

#[test]
fn lyapunov_function_of_the_adaptive_law_does_not_rise() {
    // V = ½·sᵀ·A·s + ½·θ̃ᵀ·Γ⁻¹·θ̃ falls along every motion without velocity-weakening friction.
    for (name, rate) in [
        ("one-link.toml", 5000.0),
        ("edda.toml", 5000.0),
        ("irp6.toml", 4000.0),
        (MIMIC, 4000.0),
    ] {
        let robot = slippery(name);
        let truth = Model::from_robot(&robot).unwrap();
        let exact = LawModel::of(&robot).unwrap();
        let mut model = LawModel::of(&robot).unwrap();
        model.scale(0.8);
        let settings = Settings {
            rate,
            delay: false,
            resolution: 0.0,
            ..Settings::default()
        };
        let reference = references(&default_reference(&robot, rate, 4.0)).unwrap();
        let mut controller =
            Controller::design(LawKind::Adaptive, &model, &reference, None, &settings).unwrap();
        let trace = closed_loop(
            (&robot, &truth),
            &mut controller,
            &reference,
            None,
            &settings,
        );
        let trace = trace.unwrap();
        let parameters = controller.parameters().unwrap();
        let wanted = parameters.values(&exact);
        let slope = settings.omega() / 2.0;
        let values: Vec<f64> = (trace.theta.iter())
            .map(|(t, theta)| {
                let k = (t * rate).round() as usize;
                let q: Vec<f64> = trace.q.iter().map(|list| list[k]).collect();
                let s: Vec<f64> = (0..q.len())
                    .map(|j| {
                        trace.velocity[j][k] - reference[j][k].velocity
                            + slope * (q[j] - reference[j][k].position)
                    })
                    .collect();
                let learnt = theta.iter().zip(&wanted).zip(&parameters.rate);
                let learnt: f64 = learnt
                    .filter(|(_, rate)| **rate > 0.0)
                    .map(|((own, truth), rate)| (own - truth).powi(2) / rate)
                    .sum();
                0.5 * (doubled_energy(&exact, &q, &s) + learnt)
            })
            .collect();
        assert_eq!(trace.saturated.iter().sum::<usize>(), 0, "{name}");
        let rise = values
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(f64::MIN, f64::max);
        let (first, last) = (values[0], values[values.len() - 1]);
        // The parameters before a tick and the state after it differ by one tick: that much V may seem to rise.
        assert!(rise < 2e-3 * first, "{name}: V rose by {rise} of {first}");
        assert!(
            last < 0.97 * first,
            "{name}: V fell from {first} to {last} only"
        );
    }
}
