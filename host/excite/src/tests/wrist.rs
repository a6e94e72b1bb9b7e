//! Readings of the simulated wrist sensor.

use super::six_joints::arm;
use super::*;
use rig_data::{Source, WRENCH_COLUMNS};

fn moving(robot: &Robot) -> SampledReference {
    let mut options = quick(Criterion::Determinant);
    (options.starts, options.harmonics, options.periods) = (1, 2, 1);
    designed(robot, &options).file.sampled(200.0).unwrap()
}

fn noise() -> Noise {
    Noise {
        position: 1e-4,
        velocity: 1e-3,
        torque: 0.05,
    }
}

fn tool() -> Load {
    Load::of([1.5, 0.05, -0.1, 0.2, 0.06, 0.0, 0.01, 0.05, 0.02, 0.03])
}

/// A sensor changes no other column of the recording, and its noise does not depend on the load.
#[test]
fn sensor_leaves_the_joints_columns_as_they_are() {
    let robot = one_link();
    let reference = moving(&robot);
    let sensed = with_sensor(robot.clone());
    let carried = Carried {
        force_noise: 0.4,
        moment_noise: 0.01,
        bias: [1.0, 2.0, 3.0, 0.1, 0.2, 0.3],
        ..Carried::default()
    };
    let plain = replay(&robot, &reference, noise(), 3, |_, _| ()).unwrap();
    assert_eq!(plain.wrench, None);
    let run = replay_carrying(&sensed, &carried, &reference, noise(), 3, |_, _| ()).unwrap();
    assert_eq!(run.motion, plain.motion);
    let again = replay_carrying(&sensed, &carried, &reference, noise(), 3, |_, _| ()).unwrap();
    assert_eq!(again, run);
    // Without a load: bias and noise.
    let wrench = run.wrench.unwrap();
    for (axis, (list, bias)) in wrench.iter().zip(carried.bias).enumerate() {
        let count = list.len() as f64;
        let sigma = if axis < 3 { 0.4 } else { 0.01 };
        let mean = list.iter().sum::<f64>() / count;
        let spread = (list.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
        assert!((mean - bias).abs() < 4.0 * sigma / count.sqrt());
        assert!((spread / sigma - 1.0).abs() < 4.0 / (2.0 * count).sqrt());
    }
}

/// The moment about the axis of a single joint is the torque that the load adds to it. Without friction, as differences
/// of positions do not resolve a joint that starts or stops.
#[test]
fn readings_are_the_loads_share_of_the_torque() {
    let mut robot = one_link();
    robot.joints[0].friction = None;
    robot.wrist_sensor = Some(WristSensor {
        reads: Some(rig_model::robot::Reads::Robot),
        ..WristSensor::default()
    });
    let reference = moving(&robot);
    let carried = Carried {
        load: Some(tool()),
        ..Carried::default()
    };
    let run =
        replay_carrying(&robot, &carried, &reference, Noise::default(), 1, |_, _| ()).unwrap();
    let wrench = run.wrench.unwrap();
    let model = Model::from_robot(&robot).unwrap();
    let [gc, gs] = [tool().first_moment[0], tool().first_moment[1]];
    let dt = run.period;
    let q = &run.motion.q[0];
    let mut worst = 0.0_f64;
    for k in 2..q.len() - 2 {
        // Fourth-order differences of the positions.
        let near = q[k + 1] + q[k - 1];
        let far = q[k + 2] + q[k - 2];
        let qdd = (16.0 * near - far - 30.0 * q[k]) / (12.0 * dt * dt);
        let mut rest = vec![0.0];
        let carrying = Model::from_robot(&robot.with_load(&tool())).unwrap();
        let mut loaded = vec![0.0];
        let state = [&[q[k]][..], &[0.0], &[qdd]];
        model
            .inverse_dynamics(state[0], state[1], state[2], &mut rest)
            .unwrap();
        carrying
            .inverse_dynamics(state[0], state[1], state[2], &mut loaded)
            .unwrap();
        worst = worst.max((wrench[5][k] - (loaded[0] - rest[0])).abs());
    }
    println!("{worst} N·m beside {} N·m", 9.81 * gc.hypot(gs));
    assert!(worst < 2e-3 * 9.81 * gc.hypot(gs), "{worst}");
}

#[test]
fn readings_beyond_the_range_are_clipped_and_counted() {
    let mut robot = with_sensor(arm());
    robot.wrist_sensor.as_mut().unwrap().force_range = Some(12.0);
    let reference = moving(&robot);
    let carried = Carried {
        load: Some(tool()),
        ..Carried::default()
    };
    let run = replay_carrying(&robot, &carried, &reference, noise(), 1, |_, _| ()).unwrap();
    let wrench = run.wrench.as_ref().unwrap();
    let clipped = (0..wrench[0].len())
        .filter(|k| wrench[..3].iter().any(|axis| axis[*k].abs() == 12.0))
        .count();
    assert!(clipped > 0 && wrench[..3].iter().flatten().all(|v| v.abs() <= 12.0));
    let note = format!("in {clipped} of {} rows", wrench[0].len());
    assert!(
        run.notes.iter().any(|n| n.contains(&note)),
        "{:?}",
        run.notes
    );
    // The recording has the six columns behind the joints'.
    let folder = tempfile::tempdir().unwrap();
    for name in ["run.csv", "run.mcap"] {
        let path = folder.path().join(name);
        run.save(&path, &robot).unwrap();
        let (blocks, _) = Source::open(&path, &robot).unwrap().read_all().unwrap();
        for (axis, name) in WRENCH_COLUMNS.iter().enumerate() {
            let column = blocks[0].extra.iter().find(|(own, _)| own == name);
            assert_eq!(column.unwrap().1, wrench[axis]);
        }
    }
}

#[test]
fn impossible_noise_bias_and_loads_are_refused() {
    let robot = with_sensor(one_link());
    let reference = moving(&robot);
    let told = |carried: Carried| {
        replay_carrying(&robot, &carried, &reference, Noise::default(), 1, |_, _| ())
            .unwrap_err()
            .to_string()
    };
    let noisy = Carried {
        force_noise: -1.0,
        ..Carried::default()
    };
    assert!(told(noisy).contains("force noise is -1"));
    let biased = Carried {
        bias: [0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0],
        ..Carried::default()
    };
    assert!(told(biased).contains("sensor bias"));
    let weightless = Carried {
        load: Some(Load::of([0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])),
        ..Carried::default()
    };
    assert!(told(weightless).contains("centre of mass"));
}
