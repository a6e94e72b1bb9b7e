//! Multisines of one joint.

use core::f64::consts::TAU;

use super::*;

fn options(robot: &Robot) -> MultisineOptions {
    MultisineOptions {
        staged: StagedOptions {
            start: Some(vec![-1.57; robot.joints.len()]),
            band: Some([1.0, 30.0]),
            ..StagedOptions::default()
        },
        period: Some(8.0),
        periods: Some(3),
        ramp: Some(1.5),
        seed: 1,
        rate: 250.0,
    }
}

/// Amplitude of a harmonic of one period by the sum that defines the transform.
fn harmonic(period: &[f64], k: usize) -> (f64, f64) {
    let turn = TAU * k as f64 / period.len() as f64;
    let (mut cos, mut sin) = (0.0, 0.0);
    for (row, value) in period.iter().enumerate() {
        cos += value * (turn * row as f64).cos();
        sin += value * (turn * row as f64).sin();
    }
    let scale = 2.0 / period.len() as f64;
    (scale * cos, scale * sin)
}

#[test]
fn it_repeats_whole_periods_of_odd_harmonics_between_rests() {
    let robot = one_link();
    let found = multisine(&robot, &options(&robot)).unwrap();
    assert_eq!((found.periods, found.period), (4, 8.0));
    let [q, v, a] = [
        &found.reference.position[0],
        &found.reference.velocity[0],
        &found.reference.acceleration[0],
    ];
    let (ramp, length) = (375, 2000);
    assert_eq!(q.len(), 2 * ramp + 4 * length + 1);
    for row in ramp..ramp + 3 * length {
        assert!(q[row] == q[row + length] && v[row] == v[row + length]);
    }
    for end in [0, q.len() - 1] {
        assert_eq!([q[end], v[end], a[end]], [-1.57, 0.0, 0.0]);
    }
    // Velocity and acceleration are the derivatives of the position, in the ramps too.
    let dt = found.reference.period;
    for row in 1..q.len() - 1 {
        // Simpson: exact up to the fourth power of the step; 30 Hz at 250 Hz.
        let moved = dt / 3.0 * (v[row - 1] + 4.0 * v[row] + v[row + 1]);
        assert!((q[row + 1] - q[row - 1] - moved).abs() < 2e-4, "{row}");
        let faster = dt / 3.0 * (a[row - 1] + 4.0 * a[row] + a[row + 1]);
        assert!((v[row + 1] - v[row - 1] - faster).abs() < 2e-2, "{row}");
    }
    let period = &q[ramp..ramp + length];
    let size = |k: usize| {
        let (c, s) = harmonic(period, k);
        c.hypot(s)
    };
    // 1 to 30 Hz are harmonics 8 to 240 of 0.125 Hz: 116 odd ones, a quarter of which is left out.
    let held: Vec<usize> = (1..300).filter(|k| size(*k) > 1e-8).collect();
    assert_eq!(held.len(), 87);
    assert_eq!(held.len(), found.harmonics);
    assert!(held.iter().all(|k| k % 2 == 1 && (8..=240).contains(k)));
    let other = multisine(
        &robot,
        &MultisineOptions {
            seed: 2,
            ..options(&robot)
        },
    )
    .unwrap();
    assert_ne!(other.reference.position, found.reference.position);
    assert_eq!(multisine(&robot, &options(&robot)).unwrap(), found);
}

/// Between the samples too, by the sum of its harmonics at many more instants.
#[test]
fn it_keeps_the_limits_between_the_samples_and_uses_them() {
    let robot = one_link();
    let limits = robot.joints[0].limits.clone().unwrap();
    let own = MultisineOptions {
        rate: 80.0,
        ..options(&robot)
    };
    let found = multisine(&robot, &own).unwrap();
    let (ramp, length) = (120, 640);
    let period = &found.reference.position[0][ramp..ramp + length];
    let held: Vec<_> = (8..=240).map(|k| (k, harmonic(period, k))).collect();
    let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
    for row in 0..16 * length {
        let t = row as f64 / (16.0 * length as f64);
        let (mut v, mut a) = (0.0, 0.0);
        for (k, (cos, sin)) in &held {
            let omega = TAU * *k as f64 / 8.0;
            let (s, c) = (TAU * *k as f64 * t).sin_cos();
            v += omega * (sin * c - cos * s);
            a -= omega * omega * (sin * s + cos * c);
        }
        (speed, acceleration) = (speed.max(v.abs()), acceleration.max(a.abs()));
    }
    let most = limits.acceleration.unwrap();
    assert!(speed <= 0.8 * limits.velocity && acceleration <= 0.8 * most);
    // The torque limit of 8 N·m bounds it here.
    let model = Model::from_robot(&robot).unwrap();
    let torque = |found: &Multisine| {
        let each = |column: &Vec<Vec<f64>>, row: usize| vec![column[0][row]];
        (0..found.reference.position[0].len())
            .map(|row| {
                let mut tau = [0.0];
                let [q, v, a] = [
                    each(&found.reference.position, row),
                    each(&found.reference.velocity, row),
                    each(&found.reference.acceleration, row),
                ];
                model.inverse_dynamics(&q, &v, &a, &mut tau).unwrap();
                tau[0].abs()
            })
            .fold(0.0, f64::max)
    };
    let used = [
        acceleration / (0.8 * most),
        torque(&found) / limits.torque.unwrap(),
    ];
    assert!(used[1] <= 1.0 && used[0].max(used[1]) > 0.8, "{used:?}");
    // Less torque: a smaller motion.
    let mut weak = robot.clone();
    weak.joints[0].limits.as_mut().unwrap().torque = Some(3.0);
    let small = multisine(&weak, &own).unwrap();
    assert!(torque(&small) <= 3.0 && torque(&small) > 2.0);
    assert!(small.shares[2] < 0.8 * found.shares[2]);
}

#[test]
fn impossible_multisines_are_refused_in_words() {
    let robot = one_link();
    let said = |change: &dyn Fn(&mut MultisineOptions)| {
        let mut own = options(&robot);
        change(&mut own);
        multisine(&robot, &own).unwrap_err().to_string()
    };
    let text = said(&|own| own.period = Some(8.0001));
    assert!(text.contains("whole number of samples"), "{text}");
    let text = said(&|own| own.periods = Some(1));
    assert!(text.contains("two at least"), "{text}");
    let text = said(&|own| own.rate = 50.0);
    assert!(text.contains("more than 60 samples"), "{text}");
    let text = said(&|own| own.period = Some(0.5));
    assert!(text.contains("lowest frequency"), "{text}");
    let text = said(&|own| own.staged.band = Some([1.0, 1.5]));
    assert!(text.contains("odd harmonics"), "{text}");
    let text = said(&|own| own.staged.start = Some(vec![3.1]));
    assert!(text.contains("no multisine fits"), "{text}");
}
