//! Simulated recordings.

use super::*;

#[test]
fn base_parameters_group_as_papers_group_them() {
    let names = |robot: &Robot, model| {
        let base = Base::structural(robot, model, 1).unwrap();
        (0..base.len())
            .map(|k| base.expression(k))
            .collect::<Vec<_>>()
    };
    for model in [ModelKind::Differential, ModelKind::Integral] {
        assert_eq!(names(&slide(), model), ["m1 + Ia1", "fv1", "fc1", "off1"]);
        assert_eq!(
            names(&pendulum(), model),
            ["mx1", "my1", "Izz1 + Ia1", "fv1", "fc1", "off1"]
        );
        // Two parallel horizontal axes, links 0.5 m apart: m2 moves to the first link with a² and a.
        let mut second = joint(JointKind::Revolute, 0.0);
        second.a = 0.5;
        let arm = Robot::new(
            "arm",
            vec![
                joint(JointKind::Revolute, std::f64::consts::FRAC_PI_2),
                second,
            ],
        );
        let found = names(&arm, model);
        assert!(found.contains(&"mx1 + 0.5 m2".to_owned()), "{found:?}");
        assert!(
            found.contains(&"Izz1 + Ia1 + 0.25 m2".to_owned()),
            "{found:?}"
        );
        assert!(
            found.contains(&"Ia2".to_owned()) && found.contains(&"Izz2".to_owned()),
            "{found:?}"
        );
        assert_eq!(found.len(), 13, "{found:?}");
    }
}

/// True base parameters of the simulated pendulum, in order: mx my Izz+Ia fv fc off.
pub(super) const TRUTH: [f64; 6] = [0.30, 0.04, 0.35, 0.30, 0.40, 0.10];

/// A pendulum under PD control, integrated at twenty times the sample rate, with dry friction that holds it at rest.
/// Torque noise is coloured; the position is noisy and rounded to encoder steps. The simulation shares no code with the
/// fitted regressor.
pub(super) fn swing(seed: u64, seconds: f64, held: bool) -> InMemory {
    swing_along(seed, seconds, held, |t| t)
}

/// The same along a reference with the time `clock(t)` (second argument of the sines).
fn swing_along(seed: u64, seconds: f64, held: bool, clock: impl Fn(f64) -> f64) -> InMemory {
    let mut g = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut normal = move || (0..12).map(|_| g.random::<f64>()).sum::<f64>() - 6.0;
    let (rate, fine) = (500.0, 20);
    let h = 1.0 / (rate * fine as f64);
    let [mx, my, inertia, fv, fc, off] = TRUTH;
    let reference = |t: f64| {
        [(1.1, 1.3, 0.4), (0.6, 2.9, 1.0), (0.25, 5.3, 2.0)]
            .iter()
            .fold((0.2, 0.0), |(q, v), (a, w, p)| {
                (q + a * (w * t + p).sin(), v + a * w * (w * t + p).cos())
            })
    };
    let (mut q, mut v) = reference(0.0);
    let (mut coloured, mut last_torque) = (0.0, 0.0);
    let mut block = Block {
        joints: vec![JointColumns::default()],
        first_line: 2,
        ..Default::default()
    };
    let step = 2.0 * std::f64::consts::PI / 400_000.0;
    for k in 0..(seconds * rate) as usize {
        let t = k as f64 / rate;
        let measured = ((q + 5e-6 * normal()) / step).round() * step;
        let (r, rv) = reference(clock(t));
        let rv = rv * (clock(t + 1e-6) - clock(t)) / 1e-6;
        let torque = 60.0 * (r - measured) + 6.0 * (rv - v);
        // First order, 8 ms: correlated over several samples.
        coloured = 0.78 * coloured + 0.03 * normal();
        block.t.push(t);
        block.joints[0].q.push(measured);
        // Held, or recorded half a period late, as the mean of before and after.
        let centred = if held {
            torque
        } else {
            0.5 * (torque + last_torque)
        };
        last_torque = torque;
        block.joints[0]
            .tau
            .push(centred + coloured + 0.02 * normal());
        for _ in 0..fine {
            let drive = torque - 9.81 * (mx * q.cos() - my * q.sin()) - off;
            let free = v + h * (drive - fv * v) / inertia;
            // Dry friction reduces the speed but never reverses it.
            v = free.signum() * (free.abs() - h * fc / inertia).max(0.0);
            q += h * v;
        }
    }
    InMemory {
        label: "swing".into(),
        blocks: vec![block],
    }
}

/// Coverage of 95 % intervals: between 92 and 98 % for every parameter of both models (200 draws scatter by 1.5 %).
#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    let draws = 200;
    let robot = pendulum();
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let mut covered = [0u32; 6];
        let mut classical = [0u32; 6];
        let mut bias = [0.0; 6];
        for seed in 0..draws {
            let recording = swing(seed, 30.0, false);
            let options = Options {
                model,
                ..Default::default()
            };
            let found = identify(&robot, &[&recording], &[], &options).unwrap();
            if seed == 0 {
                show(&format!("swing {model:?}"), &found);
            }
            let e = &found.details.estimate;
            for k in 0..6 {
                covered[k] += u32::from(e.covers(k, TRUTH[k]));
                classical[k] +=
                    u32::from((e.values[k] - TRUTH[k]).abs() < 1.96 * e.classical_std[k]);
                bias[k] += (e.values[k] - TRUTH[k]) / e.std[k] / draws as f64;
            }
        }
        let share: Vec<f64> = covered
            .iter()
            .map(|c| f64::from(*c) / draws as f64)
            .collect();
        let white: Vec<f64> = classical
            .iter()
            .map(|c| f64::from(*c) / draws as f64)
            .collect();
        println!(
            "coverage {model:?}: {share:.3?}; residuals taken as white: {white:.3?}; mean error in std: {bias:.2?}"
        );
        let mean = share.iter().sum::<f64>() / 6.0;
        assert!((0.92..=0.98).contains(&mean), "{mean}");
        assert!(share.iter().all(|s| (0.92..=0.98).contains(s)), "{share:?}");
    }
}

/// A held command leads its effect by half a period; the given lead removes the bias.
#[test]
fn a_held_command_biases_viscous_friction_unless_its_lead_is_given() {
    let recording = swing(5, 30.0, true);
    let viscous = |lead: f64| {
        let options = Options {
            prepare: PrepareOptions {
                torque_lead: lead,
                ..Default::default()
            },
            ..Default::default()
        };
        let found = identify(&pendulum(), &[&recording], &[], &options).unwrap();
        (
            found.base_parameters[3].value,
            found.details.estimate.covers(3, TRUTH[3]),
        )
    };
    let (without, with) = (viscous(0.0), viscous(1e-3));
    println!(
        "viscous friction {without:?} without, {with:?} with the lead of half a period; truth {}",
        TRUTH[3]
    );
    assert!(!without.1 && with.1);
}

/// A recording of the rig, with wrong torques in rows that it marked as not settled: both models leave these rows out and say
/// so. Without the marks the torques count.
#[test]
fn torques_by_a_current_that_had_not_settled_are_left_out() {
    let mut marked = swing(8, 30.0, false);
    let block = &mut marked.blocks[0];
    let is_fast: Vec<bool> = (block.joints[0].q.windows(2))
        .map(|q| 500.0 * (q[1] - q[0]) > 2.2)
        .chain([false])
        .collect();
    for (tau, fast) in block.joints[0].tau.iter_mut().zip(&is_fast) {
        *tau += if *fast { 1.2 } else { 0.0 };
    }
    let limits = is_fast.iter().map(|fast| if *fast { 65.0 } else { 1.0 });
    block.extra = vec![
        ("limits".into(), limits.collect()),
        ("mode".into(), vec![3.0; is_fast.len()]),
    ];
    let mut unmarked = marked.clone();
    unmarked.blocks[0].extra.clear();
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let found = |recording: &InMemory| {
            let options = Options {
                model,
                ..Default::default()
            };
            let found = identify(&pendulum(), &[recording], &[], &options).unwrap();
            let errors = found.base_parameters.iter().zip(TRUTH);
            let worst = errors.map(|(b, t)| (b.value - t).abs() / b.std);
            let is_told = found
                .details
                .masked
                .iter()
                .any(|m| m.why.contains("had settled"));
            (worst.fold(0.0, f64::max), is_told)
        };
        let (with, without) = (found(&marked), found(&unmarked));
        println!(
            "{model:?}: largest error {:.1} std, {:.1} without marks",
            with.0, without.0
        );
        assert!(with.0 < 3.5 && with.1, "{with:?}");
        assert!(without.0 > 5.0 && !without.1, "{without:?}");
    }
}

#[test]
fn robust_fit_withstands_rows_that_are_not_the_robots() {
    let mut recording = swing(7, 30.0, false);
    let clean = identify(&pendulum(), &[&recording], &[], &Options::default()).unwrap();
    // Someone leans on the link eight times for 0.15 s.
    for k in 0..8 {
        for tau in &mut recording.blocks[0].joints[0].tau[1500 * k + 700..1500 * k + 775] {
            *tau += 3.0;
        }
    }
    let worst = |estimator, loss| {
        let options = Options {
            estimator,
            loss,
            ..Default::default()
        };
        let found = identify(&pendulum(), &[&recording], &[], &options).unwrap();
        found
            .base_parameters
            .iter()
            .zip(TRUTH)
            .zip(&clean.base_parameters)
            .map(|((b, t), c)| (b.value - t).abs() / c.std)
            .fold(0.0f64, f64::max)
    };
    let ols = worst(Estimator::Ols, Loss::Huber);
    let huber = worst(Estimator::Robust, Loss::Huber);
    let bisquare = worst(Estimator::Robust, Loss::Bisquare);
    println!(
        "largest error in clean standard deviations: ols {ols:.1}, huber {huber:.1}, bisquare {bisquare:.1}"
    );
    assert!(
        huber < 0.5 * ols && bisquare < 5.0,
        "{ols} {huber} {bisquare}"
    );
}

#[test]
fn what_the_motion_does_not_excite_is_named_and_the_rest_is_right() {
    // Motion of two degrees: gravity is constant there and collinear with the offset.
    let mut recording = swing(3, 30.0, false);
    let block = &mut recording.blocks[0];
    let [mx, my, inertia, fv, fc, off] = TRUTH;
    for (k, t) in block.t.clone().into_iter().enumerate() {
        let w = 6.0;
        let amplitude = 0.02 * (1.0 + 0.5 * (0.9 * t).sin());
        let [q, qd, qdd] = [
            amplitude * (w * t).sin(),
            amplitude * w * (w * t).cos() + 0.02 * 0.45 * (0.9 * t).cos() * (w * t).sin(),
            0.0,
        ];
        block.joints[0].q[k] = q;
        let slope = 0.02 * 0.45 * (0.9 * t).cos();
        let bend = -0.02 * 0.405 * (0.9 * t).sin();
        let acceleration = qdd + bend * (w * t).sin() + 2.0 * slope * w * (w * t).cos()
            - amplitude * w * w * (w * t).sin();
        block.joints[0].tau[k] = inertia * acceleration
            + 9.81 * (mx * q.cos() - my * q.sin())
            + fv * qd
            + fc * qd.signum()
            + off;
    }
    let found = identify(&pendulum(), &[&recording], &[], &Options::default()).unwrap();
    show("two degrees", &found);
    println!("{:?}", found.not_excited);
    assert!(
        found
            .not_excited
            .iter()
            .any(|n| n.combination == "off1" && n.why.contains("mx1"))
    );
    let gravity = found
        .base_parameters
        .iter()
        .find(|b| b.expression.starts_with("mx1 + "))
        .unwrap();
    assert!(
        (gravity.value * 9.81 - (9.81 * mx + off)).abs() < 0.01 * 9.81 * mx,
        "{gravity:?}"
    );
    assert_eq!(found.rank + found.not_excited.len(), 6);
}

#[test]
fn description_of_the_identified_robot_has_the_identified_dynamics() {
    use rig_shared::multibody::{COLUMNS, differential_regressor};
    let recording = swing(2, 30.0, false);
    for (mass, rotor) in [
        (None, None),
        (Some(1.5), Some(2e-5)),
        (Some(0.1), Some(1.0)),
    ] {
        let mut prior = pendulum();
        prior.joints[0].inertial = mass.map(|mass| rig_model::robot::Inertial {
            mass,
            first_moment: [0.0; 3],
            inertia: [0.0; 6],
        });
        prior.joints[0].drive = rotor.map(|rotor_inertia| rig_model::robot::Drive {
            gear_ratio: 50.0,
            rotor_inertia,
            torque_constant: 0.05,
            ..Default::default()
        });
        let found = identify(&prior, &[&recording], &[], &Options::default()).unwrap();
        let (robot, remarks) = identified_robot(&prior, &found);
        println!("{remarks:?}");
        let link = robot.joints[0].inertial.as_ref().unwrap();
        let [xx, xy, _, yy, _, zz] = link.inertia;
        let moment = link.first_moment[0].hypot(link.first_moment[1]);
        assert!(link.mass > 0.0 && zz >= moment * moment / link.mass * (1.0 - 1e-12));
        // A possible body: the triangle inequality, and a positive second moment about the centre of mass.
        assert!(
            xx >= 0.0
                && yy >= 0.0
                && xx + yy >= zz * (1.0 - 1e-12)
                && xx * yy >= xy * xy * (1.0 - 1e-12)
        );
        let drive = robot.joints[0]
            .drive
            .as_ref()
            .map_or(0.0, |d| d.rotor_inertia * 2500.0);
        let friction = robot.joints[0].friction.as_ref().unwrap();
        let mut pi = [0.0; COLUMNS];
        pi[0] = link.mass;
        pi[1..4].copy_from_slice(&link.first_moment);
        pi[4..10].copy_from_slice(&link.inertia);
        (pi[10], pi[11], pi[12], pi[13]) =
            (drive, friction.viscous, friction.coulomb, friction.offset);
        let chain = chain_of(&robot).unwrap();
        let mut row = [0.0; COLUMNS];
        for (q, qd, qdd) in [(0.3, 1.0, -2.0), (2.0, -0.5, 4.0)] {
            differential_regressor(&chain, &[q], &[qd], &[qdd], &mut row).unwrap();
            let whole: f64 = row.iter().zip(pi).map(|(r, p)| r * p).sum();
            let base: f64 = found
                .details
                .columns
                .iter()
                .zip(&found.details.estimate.values)
                .map(|(c, v)| row[*c] * v)
                .sum();
            assert!((whole - base).abs() < 1e-9, "{whole} {base}");
        }
        let text = robot.to_toml().unwrap();
        assert_eq!(
            Robot::from_toml(&text, std::path::Path::new("identified.toml"))
                .unwrap()
                .joints[0]
                .inertial,
            robot.joints[0].inertial
        );
    }
}

/// A sweep: each speed in both directions, friction with or without a Stribeck term.
fn sweep(excess: f64) -> InMemory {
    let mut g = rand_pcg::Pcg64::seed_from_u64(11);
    let mut normal = move || (0..12).map(|_| g.random::<f64>()).sum::<f64>() - 6.0;
    let [mx, my, _, fv, fc, off] = TRUTH;
    let mut block = Block {
        joints: vec![JointColumns::default()],
        first_line: 2,
        ..Default::default()
    };
    let (mut q, mut t) = (-0.5, 0.0);
    for k in 0..20 {
        let v: f64 = 0.02 * 1.25f64.powi(k);
        for v in [v, -v] {
            for _ in 0..500 {
                let friction = fv * v + v.signum() * (fc + excess * (-(v / 0.15f64).powi(2)).exp());
                block.t.push(t);
                block.joints[0].q.push(q + 1e-6 * normal());
                block.joints[0]
                    .tau
                    .push(9.81 * (mx * q.cos() - my * q.sin()) + off + friction + 0.02 * normal());
                t += 2e-3;
                q += 2e-3 * v;
            }
        }
    }
    InMemory {
        label: "sweep".into(),
        blocks: vec![block],
    }
}

#[test]
fn friction_map_takes_a_stribeck_term_only_where_there_is_one() {
    let robot = pendulum();
    let known = identify(&robot, &[&swing(1, 30.0, false)], &[], &Options::default()).unwrap();
    let plain = friction_map(
        &robot,
        &known,
        &sweep(0.0),
        0,
        FrictionMapOptions::default(),
    )
    .unwrap();
    println!("{} {:?}", plain.text, plain.simple);
    assert!(plain.points.len() >= 38, "{}", plain.points.len());
    assert!(!plain.warranted);
    assert!(
        (plain.simple.coulomb - TRUTH[4]).abs() < 0.01
            && (plain.simple.viscous - TRUTH[3]).abs() < 0.01
    );
    let curved = friction_map(
        &robot,
        &known,
        &sweep(0.15),
        0,
        FrictionMapOptions::default(),
    )
    .unwrap();
    let law = curved.stribeck.as_ref().unwrap();
    println!("{} {law:?}", curved.text);
    assert!(curved.warranted);
    assert!(
        (law.coulomb - TRUTH[4]).abs() < 0.02 && (law.breakaway_excess - 0.15).abs() < 0.03,
        "{law:?}"
    );
    assert!((law.stribeck_velocity.unwrap() / 0.15 - 1.0).abs() < 0.2);
}

#[test]
fn faults_are_sentences() {
    let robot = pendulum();
    let good = swing(1, 10.0, false);
    let fails = |change: &dyn Fn(&mut Block)| {
        let mut bad = good.clone();
        change(&mut bad.blocks[0]);
        identify(&robot, &[&bad], &[], &Options::default())
            .unwrap_err()
            .to_string()
    };
    let short = fails(&|b| {
        b.t.truncate(100);
        b.joints[0].q.truncate(100);
        b.joints[0].tau.truncate(100);
    });
    assert!(short.contains("100 rows"), "{short}");
    let silent = fails(&|b| b.joints[0].tau.fill(0.0));
    assert!(silent.contains("joint 1 is zero throughout"), "{silent}");
    let none = identify(&robot, &[], &[], &Options::default())
        .unwrap_err()
        .to_string();
    assert!(none.contains("No training recording"), "{none}");
    let options = Options {
        prepare: PrepareOptions {
            cutoff: Choice::Fixed(300.0),
            ..Default::default()
        },
        ..Default::default()
    };
    let cutoff = identify(&robot, &[&good], &[], &options)
        .unwrap_err()
        .to_string();
    assert!(cutoff.contains("300 Hz is not possible"), "{cutoff}");
    let options = Options {
        model: ModelKind::Integral,
        window: Some(5.0),
        ..Default::default()
    };
    let window = identify(&robot, &[&good], &[], &options)
        .unwrap_err()
        .to_string();
    assert!(window.contains("window of 5 s"), "{window}");
}

#[test]
fn settings_that_would_change_nothing_are_refused() {
    let none: [&dyn rig_data::prepare::Recording; 0] = [];
    let said = |robot: &Robot, options: &Options| {
        identify(robot, &none, &none, options)
            .unwrap_err()
            .to_string()
    };
    let windowed = Options {
        window: Some(0.5),
        ..Default::default()
    };
    let text = said(&pendulum(), &windowed);
    assert!(
        text.contains("0.5 s") && text.contains("--model integral"),
        "{text}"
    );
    let two = Robot::new("two", vec![joint(JointKind::Revolute, 0.0); 2]);
    for estimator in Estimator::ALL {
        let options = Options {
            estimator,
            prior_uncertainty: Some(0.1),
            ..Default::default()
        };
        let text = said(&pendulum(), &options);
        let refused = text.contains(&format!("but {} of one joint", estimator.name()));
        assert_eq!(refused, !estimator.has_prior(), "{text}");
        let text = said(&two, &options);
        assert!(text.contains("No training recording"), "{text}");
    }
}

/// Pieces far shorter than the recording, with arbitrary cuts: the same result as in one piece, for both models.
#[test]
fn streaming_gives_the_same_parameters() {
    let whole = swing(4, 60.0, false);
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let run = |piece_rows| {
            let options = Options {
                model,
                prepare: PrepareOptions {
                    decimation: Choice::Fixed(4),
                    piece_rows,
                    ..Default::default()
                },
                ..Default::default()
            };
            identify(&pendulum(), &[&whole], &[], &options).unwrap()
        };
        let (one, many) = (run(1 << 17), run(1000));
        for (a, b) in one.base_parameters.iter().zip(&many.base_parameters) {
            assert!(
                (a.value - b.value).abs() < 1e-9 * a.value.abs().max(0.1),
                "{a:?} {b:?}"
            );
            assert!((a.std / b.std - 1.0).abs() < 1e-6, "{a:?} {b:?}");
        }
    }
}

/// Two links in a vertical plane, torques by inverse dynamics, the second joint's sensor ten times as noisy: both
/// models find every base parameter.
#[test]
fn two_links_are_identified_by_both_models() {
    use rig_shared::multibody::{COLUMNS, inverse_dynamics};
    let mut second = joint(JointKind::Revolute, 0.0);
    second.a = 0.5;
    second.name = "second".into();
    let arm = Robot::new(
        "arm",
        vec![
            joint(JointKind::Revolute, std::f64::consts::FRAC_PI_2),
            second,
        ],
    );
    let mut pi = [[0.0; COLUMNS]; 2];
    for (row, values) in pi.iter_mut().zip([
        [3.0, 0.7, 0.1, 0.05, 0.02, 0.2, 0.4, 0.3, 0.15, 0.1],
        [1.5, 0.3, -0.05, 0.02, 0.01, 0.08, 0.05, 0.2, 0.1, -0.05],
    ]) {
        // m mx my Ixx Iyy Izz Ia fv fc off
        for (c, v) in [0, 1, 2, 4, 7, 9, 10, 11, 12, 13].into_iter().zip(values) {
            row[c] = v;
        }
    }
    let chain = chain_of(&arm).unwrap();
    let mut g = rand_pcg::Pcg64::seed_from_u64(9);
    let mut normal = move || (0..12).map(|_| g.random::<f64>()).sum::<f64>() - 6.0;
    let mut block = Block {
        joints: vec![JointColumns::default(); 2],
        first_line: 2,
        ..Default::default()
    };
    for k in 0..30_000 {
        let t = k as f64 * 1e-3;
        let mut state = [[0.0; 2]; 3];
        for (j, terms) in [
            [(0.9, 1.7, 0.3), (0.3, 4.1, 1.1), (0.1, 7.3, 0.2)],
            [(1.1, 2.3, 2.0), (0.4, 3.3, 0.5), (0.1, 8.9, 1.7)],
        ]
        .iter()
        .enumerate()
        {
            for (a, w, p) in terms {
                let (s, c) = (w * t + p).sin_cos();
                state[0][j] += a * s;
                state[1][j] += a * w * c;
                state[2][j] -= a * w * w * s;
            }
        }
        let mut tau = [0.0; 2];
        inverse_dynamics(&chain, &pi, &state[0], &state[1], &state[2], &mut tau).unwrap();
        block.t.push(t);
        for j in 0..2 {
            block.joints[j].q.push(state[0][j] + 1e-6 * normal());
            block.joints[j].tau.push(tau[j] + [0.02, 0.2][j] * normal());
        }
    }
    let recording = InMemory {
        label: "arm".into(),
        blocks: vec![block],
    };
    let flat: Vec<f64> = pi.iter().flatten().copied().collect();
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let options = Options {
            model,
            ..Default::default()
        };
        let found = identify(&arm, &[&recording], &[], &options).unwrap();
        show(&format!("two links {model:?}"), &found);
        assert_eq!(found.rank, 13);
        assert!(found.not_excited.is_empty());
        for (k, b) in found.base_parameters.iter().enumerate() {
            let row = found.details.combination.row(k);
            let truth: f64 = row.iter().zip(&flat).map(|(k, p)| k * p).sum();
            assert!(
                (b.value - truth).abs() < 4.0 * b.std,
                "{b:?}, truth {truth}"
            );
            assert!(b.std < 0.05, "{b:?}");
        }
    }
}

/// Half of the time the link dwells, held by dry friction anywhere inside its band: Coulomb's law does not apply.
/// Masked, these rows leave the estimate unchanged; unmasked, they bias it.
#[test]
fn standing_still_does_not_bias_friction() {
    let clock = |t: f64| (t / 4.0).floor() * 2.0 + (t % 4.0).min(2.0);
    let recording = swing_along(6, 60.0, false, clock);
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let run = |threshold| {
            let options = Options {
                model,
                prepare: PrepareOptions {
                    speed_threshold: threshold,
                    ..Default::default()
                },
                ..Default::default()
            };
            identify(&pendulum(), &[&recording], &[], &options).unwrap()
        };
        let found = run(Choice::Auto);
        show(&format!("half at rest {model:?}"), &found);
        for (b, truth) in found.base_parameters.iter().zip(TRUTH) {
            assert!(
                (b.value - truth).abs() < 4.0 * b.std,
                "{b:?}, truth {truth}"
            );
        }
        assert!(found.details.masked.iter().any(|m| m.why.contains("speed")));
    }
    let careless = {
        let options = Options {
            prepare: PrepareOptions {
                speed_threshold: Choice::Fixed(0.0),
                ..Default::default()
            },
            ..Default::default()
        };
        identify(&pendulum(), &[&recording], &[], &options).unwrap()
    };
    show("half at rest, unmasked", &careless);
    assert!((careless.base_parameters[4].value / TRUTH[4] - 1.0).abs() > 0.1);
}

/// A pendulum's recording that is never stored: every pass computes it again and notes the largest requested block.
struct Endless {
    rows: usize,
    largest: std::cell::Cell<usize>,
}

impl rig_data::prepare::Recording for Endless {
    fn label(&self) -> String {
        "endless".into()
    }
    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), rig_data::prepare::PrepareError>,
    ) -> Result<(), rig_data::prepare::PrepareError> {
        let mut g = rand_pcg::Pcg64::seed_from_u64(21);
        let [mx, my, inertia, fv, fc, off] = TRUTH;
        self.largest.set(self.largest.get().max(rows));
        for start in (0..self.rows).step_by(rows) {
            let mut block = Block {
                joints: vec![JointColumns::default()],
                first_line: start as u64 + 2,
                continues: start > 0,
                ..Default::default()
            };
            for k in start..(start + rows).min(self.rows) {
                let t = k as f64 * 1e-3;
                let (mut q, mut qd, mut qdd) = (0.2, 0.0, 0.0);
                for (a, w, p) in [(1.1, 1.3, 0.4), (0.6, 2.9, 1.0), (0.25, 5.3, 2.0)] {
                    let (s, c): (f64, f64) = f64::sin_cos(w * t + p);
                    (q, qd, qdd) = (q + a * s, qd + a * w * c, qdd - a * w * w * s);
                }
                let tau = inertia * qdd
                    + 9.81 * (mx * q.cos() - my * q.sin())
                    + fv * qd
                    + fc * qd.signum()
                    + off;
                block.t.push(t);
                block.joints[0].q.push(q + 1e-5 * (g.random::<f64>() - 0.5));
                block.joints[0]
                    .tau
                    .push(tau + 0.2 * (g.random::<f64>() - 0.5));
            }
            take(block)?;
        }
        Ok(())
    }
}

/// A million rows in blocks: the memory does not depend on their number.
#[test]
fn a_recording_larger_than_what_is_held_at_once() {
    let recording = Endless {
        rows: 1_000_000,
        largest: std::cell::Cell::new(0),
    };
    let mut held = 0;
    rig_data::prepare::each_piece(&recording, 1 << 15, 1000, &mut |piece| {
        held = held.max(piece.rows.len());
        Ok(())
    })
    .unwrap();
    assert!(held <= (1 << 15) + 2 * 1000, "{held}");
    let begin = std::time::Instant::now();
    let found = identify(&pendulum(), &[&recording], &[], &Options::default()).unwrap();
    println!("a million rows: {:?}", begin.elapsed());
    show("a million rows", &found);
    assert!(recording.largest.get() <= 1 << 16);
    for (b, truth) in found.base_parameters.iter().zip(TRUTH) {
        assert!((b.value / truth - 1.0).abs() < 0.01, "{b:?}");
    }
}
