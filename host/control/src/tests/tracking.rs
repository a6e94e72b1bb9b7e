//! Tracking against closed forms of linear error dynamics.

use super::{MIMIC, robot, slippery};
use crate::{Bench, ControlError, LawKind, LawModel, Settings, default_reference, references};
use rig_model::robot::Robot;
use rig_model::simulate::Model;
use rig_shared::trajectory::Reference;

/// A loop that is almost continuous, with exact sensors.
fn continuous() -> Settings {
    Settings {
        rate: 20_000.0,
        delay: false,
        resolution: 0.0,
        ..Settings::default()
    }
}

/// Positions that are held, with a step of `step` at the second tick.
fn held(at: &[f64], step: f64, samples: usize) -> Vec<Vec<Reference<f64>>> {
    let joint = |q: &f64| {
        (0..samples)
            .map(|k| Reference {
                position: q + if k == 0 { 0.0 } else { step },
                ..Reference::default()
            })
            .collect()
    };
    at.iter().map(joint).collect()
}

fn bench<'a>(
    robot: &'a Robot,
    truth: &'a Model,
    reference: &'a [Vec<Reference<f64>>],
    settings: Settings,
) -> Bench<'a> {
    Bench {
        robot,
        truth,
        reference,
        tool: [0.1, 0.0, 0.0],
        settings,
        wrong: None,
    }
}

#[test]
fn computed_torque_gives_the_designed_error_dynamics() {
    // Double pole at −ω: a step of d leaves the error d·(1 + ω·t)·exp(−ω·t) in every joint, coupled drives or not.
    for name in ["one-link.toml", "edda.toml", "irp6.toml", MIMIC] {
        let robot = slippery(name);
        let truth = Model::from_robot(&robot).unwrap();
        let settings = continuous();
        let step = 0.002;
        let reference = held(&robot.middle_position(), step, 6000);
        let model = LawModel::of(&robot).unwrap();
        let run = bench(&robot, &truth, &reference, settings)
            .track(LawKind::ComputedTorque, &model, name)
            .unwrap();
        for (j, q) in run.trace.q.iter().enumerate() {
            assert_eq!(run.trace.saturated[j], 0);
            for k in (1..q.len()).step_by(50) {
                let t = (k - 1) as f64 * run.trace.period;
                let phase = settings.omega() * t;
                let expected = step * (1.0 + phase) * (-phase).exp();
                let found = reference[j][k].position - q[k];
                assert!(
                    (found - expected).abs() < 0.01 * step,
                    "{name} joint {j} at {t}: {found} for {expected}"
                );
            }
        }
    }
}

#[test]
fn a_wrong_weight_leaves_the_error_of_the_closed_form_and_an_integral_leaves_none() {
    // With a model of 0.7 times the robot: 0.7·(J·kp·e + g) = g at rest, so e = (0.3/0.7)·g/(J·kp).
    let robot = slippery("one-link.toml");
    let truth = Model::from_robot(&robot).unwrap();
    let mut model = LawModel::of(&robot).unwrap();
    model.scale(0.7);
    let settings = Settings {
        delay: false,
        resolution: 0.0,
        ..Settings::default()
    };
    let reference = held(&[0.0], 0.0, 8000);
    let bench = bench(&robot, &truth, &reference, settings);
    let last = |law| {
        let run = bench.track(law, &model, "0.7").unwrap();
        run.trace.q[0].last().map(|q| -q).unwrap()
    };
    // mx = 0.3 kg·m; J = 0.12 kg·m² of the link and 50²·2e-5 kg·m² of the rotor.
    let expected: f64 = 0.3 / 0.7 * 0.3 * 9.81 / (0.17 * settings.omega().powi(2));
    let found = last(LawKind::ComputedTorque);
    assert!(
        (found / expected - 1.0).abs() < 1e-3,
        "{found} for {expected}"
    );
    let found = last(LawKind::Pid);
    assert!(found.abs() < 1e-4 * expected, "{found}");
}

#[test]
fn adaptive_law_learns_what_the_motion_excites_and_tracks_better_for_it() {
    let robot = robot("edda.toml");
    let truth = Model::from_robot(&robot).unwrap();
    let mut model = LawModel::of(&robot).unwrap();
    model.scale(0.7);
    let settings = Settings::default();
    let reference = references(&default_reference(&robot, settings.rate, 20.0)).unwrap();
    let bench = bench(&robot, &truth, &reference, settings);
    let fixed = bench
        .track(LawKind::ComputedTorque, &model, "0.7")
        .unwrap()
        .measures;
    let own = bench
        .track(LawKind::Adaptive, &model, "0.7")
        .unwrap()
        .measures;
    assert!(
        own.tool_rms < 0.5 * fixed.tool_rms,
        "{} {}",
        own.tool_rms,
        fixed.tool_rms
    );
    let learnt = own.adaptation.unwrap();
    assert!(learnt.excited > learnt.count / 2);
    assert!(
        learnt.error[1] < 0.4 * learnt.error[0],
        "{:?}",
        learnt.error
    );
    let torque = learnt.torque_error;
    assert!(torque[1] < 0.1 * torque[0], "{torque:?}");
    let shown = learnt.parameters.iter().filter(|one| one.excited > 0.99);
    let [before, after] = shown.fold([0.0, 0.0], |[a, b], one| {
        let size = one.truth.abs().max(0.02);
        [
            a + (one.start - one.truth).abs() / size,
            b + (one.end - one.truth).abs() / size,
        ]
    });
    assert!(
        after < 0.5 * before,
        "{after} {before}: {:?}",
        learnt.parameters
    );
    // A motion of the elbow alone excites less.
    let mut still = reference.clone();
    let middle = still[0][0].position;
    still[0].fill(Reference {
        position: middle,
        ..Reference::default()
    });
    let bench = Bench {
        reference: &still,
        ..bench
    };
    let own = bench
        .track(LawKind::Adaptive, &model, "0.7")
        .unwrap()
        .measures;
    let less = own.adaptation.unwrap();
    assert!(
        less.excited < learnt.excited,
        "{} {}",
        less.excited,
        learnt.excited
    );
}

/// The model × 0.7 is that of a description in which friction and effects are 0.7 times as large.
#[test]
fn a_scaled_model_has_scaled_effects() {
    let with_effects = |share: f64| {
        let mut robot = robot("edda.toml");
        for joint in &mut robot.joints {
            let friction = joint.friction.as_mut().unwrap();
            friction.coulomb *= share;
            friction.viscous *= share;
        }
        let effects = format!(
            "[[effect]]\nkind = \"stribeck\"\njoint = \"shoulder\"\nbreakaway = {}\nvelocity = 0.2\n\n[[effect]]\nkind = \"cogging\"\njoint = \"elbow\"\ncosine = {}\nsine = {}\norder = 12.0\n",
            3.0 * share,
            2.0 * share,
            -share
        );
        let text = format!("{}\n{effects}", robot.to_toml().unwrap());
        Robot::from_toml(&text, "edda.toml".as_ref()).unwrap()
    };
    let robot = with_effects(1.0);
    let truth = Model::from_robot(&robot).unwrap();
    let settings = Settings::default();
    let reference = references(&default_reference(&robot, settings.rate, 4.0)).unwrap();
    let bench = bench(&robot, &truth, &reference, settings);
    let mut scaled = LawModel::of(&robot).unwrap();
    scaled.scale(0.7);
    let mut by_hand = LawModel::of(&with_effects(0.7)).unwrap();
    by_hand.parameters.clone_from(&scaled.parameters);
    let torque = |model: &LawModel| {
        let run = bench.track(LawKind::ComputedTorque, model, "0.7").unwrap();
        run.trace.torque
    };
    let mut exact = scaled.clone();
    exact.effects.fill(1.0);
    let [own, expected, other] = [&scaled, &by_hand, &exact].map(torque);
    let farthest = |list: &[Vec<f64>]| {
        let pairs = own.iter().flatten().zip(list.iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let [same, different] = [farthest(&expected), farthest(&other)];
    assert!(same < 1e-6 && different > 0.3, "{same} {different}");
}

/// At rest only the constant torques of the two joints make a torque: no gravity acts in EDDA's plane.
#[test]
fn a_robot_at_rest_excites_its_constant_torques_alone() {
    let robot = robot("edda.toml");
    let truth = Model::from_robot(&robot).unwrap();
    let model = LawModel::of(&robot).unwrap();
    let reference = held(&[0.3, 0.4], 0.0, 2000);
    let run = bench(&robot, &truth, &reference, Settings::default())
        .track(LawKind::Adaptive, &model, "own")
        .unwrap();
    let learnt = run.measures.adaptation.unwrap();
    assert!(learnt.excited <= 2, "{} directions", learnt.excited);
}

#[test]
fn an_unstable_loop_is_told_with_joint_and_time() {
    let mut robot = robot("edda.toml");
    for joint in &mut robot.joints {
        joint.limits.as_mut().unwrap().torque = None;
    }
    let truth = Model::from_robot(&robot).unwrap();
    let mut model = LawModel::of(&robot).unwrap();
    model.scale(10.0);
    let settings = Settings {
        bandwidth: 50.0,
        ..Settings::default()
    };
    let reference = references(&default_reference(&robot, settings.rate, 5.0)).unwrap();
    let found = bench(&robot, &truth, &reference, settings)
        .track(LawKind::ComputedTorque, &model, "10")
        .err()
        .unwrap();
    assert!(matches!(found, ControlError::Unstable { .. }), "{found}");
    let text = found.to_string();
    assert!(text.contains("joint \"") && text.contains(" s, "), "{text}");
}

#[test]
fn a_loop_at_its_torque_limits_and_a_growing_error_are_told() {
    let robot = robot("edda.toml");
    let truth = Model::from_robot(&robot).unwrap();
    let told = |scale: f64| {
        let mut model = LawModel::of(&robot).unwrap();
        model.scale(scale);
        let settings = Settings::default();
        let reference = references(&default_reference(&robot, settings.rate, 5.0)).unwrap();
        let run = bench(&robot, &truth, &reference, settings)
            .track(LawKind::Adaptive, &model, "own")
            .unwrap();
        run.measures.warnings.join(" ")
    };
    // Gains for three times the inertia.
    let said = told(3.0);
    for word in ["torque limit in", "adapted parameters grew", "--bandwidth"] {
        assert!(said.contains(word), "{said}");
    }
    assert_eq!(told(1.0), "");
}

#[test]
fn positions_beyond_the_limits_are_refused_or_told() {
    let robot = slippery("edda.toml");
    let truth = Model::from_robot(&robot).unwrap();
    let model = LawModel::of(&robot).unwrap();
    let settings = Settings::default();
    let mut pose = robot.middle_position();
    let high = robot.joints[1].limits.as_ref().unwrap().position[1];
    // Asked for: refused.
    pose[1] = high - 0.01;
    let reference = held(&pose, 0.02, 200);
    let said = bench(&robot, &truth, &reference, settings)
        .track(LawKind::ComputedTorque, &model, "own")
        .err()
        .unwrap()
        .to_string();
    assert!(
        said.contains("joint \"elbow\"") && said.contains("0.001 s"),
        "{said}"
    );
    // Not asked for, but passed by an underdamped loop: told.
    pose[1] = high - 0.11;
    let reference = held(&pose, 0.1, 1000);
    let loose = Settings {
        damping: 0.2,
        ..settings
    };
    let told = |settings: Settings| {
        let run = bench(&robot, &truth, &reference, settings)
            .track(LawKind::ComputedTorque, &model, "own")
            .unwrap();
        let beyond = run.trace.q[1].iter().any(|q| *q > high);
        (beyond, run.measures.warnings.join(" "))
    };
    let (beyond, said) = told(loose);
    assert!(
        beyond && said.contains("joint \"elbow\" left its limit"),
        "{said}"
    );
    assert_eq!(told(settings), (false, String::new()));
}

#[test]
fn models_of_other_robots_are_refused() {
    let robot = robot("edda.toml");
    let mut other = robot.clone();
    other.joints[1].name = "forearm".to_owned();
    let (_, note) = LawModel::of_same(&other, &robot, "other.toml").unwrap();
    assert!(note.unwrap().contains("forearm for elbow"));
    assert!(
        LawModel::of_same(&robot, &robot, "own")
            .unwrap()
            .1
            .is_none()
    );
    other.joints[1].kind = rig_model::robot::JointKind::Prismatic;
    let said = LawModel::of_same(&other, &robot, "other.toml")
        .err()
        .unwrap();
    assert!(said.to_string().contains("prismatic"), "{said}");
    assert!(matches!(said, ControlError::OtherKind { .. }));
}

/// Two links in a horizontal plane without rotors: a heavy arm, and a light hand far out on it. With the hand free to give
/// way the arm feels little inertia, so that gains for the arm's own inertia are too high.
fn bare_arm() -> Robot {
    let (mass, hand, own) = (1.0, 0.1, 0.02);
    let text = format!(
        "name = \"bare\"\ngravity = [0.0, 0.0, -9.81]\n\
         [[joint]]\nname = \"arm\"\nkind = \"revolute\"\nalpha = 0.0\na = 0.0\ntheta = 0.0\nd = 0.0\n\
         [joint.inertial]\nmass = 0.4\nfirst_moment = [0.1, 0.0, 0.0]\ninertia = [0.001, 0.0, 0.0, 0.03, 0.0, 0.03]\n\
         [joint.limits]\nposition = [-2.0, 2.0]\nvelocity = 3.0\nacceleration = 20.0\ntorque = 60.0\n\
         [[joint]]\nname = \"hand\"\nkind = \"revolute\"\nalpha = 0.0\na = 0.5\ntheta = 0.0\nd = 0.0\n\
         [joint.inertial]\nmass = {mass}\nfirst_moment = [{first}, 0.0, 0.0]\ninertia = [0.002, 0.0, 0.0, {second}, 0.0, {second}]\n\
         [joint.limits]\nposition = [-2.0, 2.0]\nvelocity = 3.0\nacceleration = 20.0\ntorque = 60.0\n",
        first = mass * hand,
        second = mass * hand * hand + own,
    );
    Robot::from_toml(&text, "bare.toml".as_ref()).unwrap()
}

#[test]
fn gains_for_the_own_inertia_fall_until_the_late_loop_has_its_margin() {
    let robot = bare_arm();
    let truth = Model::from_robot(&robot).unwrap();
    let model = LawModel::of(&robot).unwrap();
    for law in [LawKind::Pid, LawKind::Adaptive] {
        let track = |rate: f64| {
            let settings = Settings {
                rate,
                ..Settings::default()
            };
            let reference = references(&default_reference(&robot, rate, 6.0)).unwrap();
            let run = bench(&robot, &truth, &reference, settings)
                .track(law, &model, "bare")
                .unwrap();
            let told = run.measures.warnings.join(" ");
            (
                run.measures.bandwidth,
                run.measures.tool_rms,
                run.trace,
                told,
            )
        };
        let (slow, rms, trace, notes) = track(400.0);
        println!("{law:?}: {slow} Hz, {rms} m, {notes}");
        // It is stable: the torque does not go from limit to limit. With 5 Hz it does.
        assert!(slow < 4.0 && slow > 0.2, "{law:?} {slow}");
        assert!(trace.saturated.iter().all(|count| *count == 0));
        assert!(
            notes.contains("instead of 5.00 Hz") && notes.contains("rotor_inertia"),
            "{notes}"
        );
        // The rate that the note gives keeps the bandwidth.
        let rate: f64 = notes
            .split("--rate ")
            .nth(1)
            .and_then(|rest| rest.split(' ').next()?.parse().ok())
            .unwrap();
        let (fast, better, _, none) = track(rate);
        println!("{law:?} at {rate}: {fast} Hz, {better} m");
        assert!((fast - 5.0).abs() < 1e-9 && none.is_empty(), "{none}");
        assert!(better < rms);
    }
}

#[test]
fn the_shipped_robots_keep_their_bandwidth() {
    for name in ["one-link.toml", "edda.toml", "irp6.toml"] {
        let robot = robot(name);
        let truth = Model::from_robot(&robot).unwrap();
        let model = LawModel::of(&robot).unwrap();
        let settings = Settings::default();
        let reference = references(&default_reference(&robot, settings.rate, 1.0)).unwrap();
        for law in [LawKind::Pid, LawKind::ComputedTorque, LawKind::Adaptive] {
            let run = bench(&robot, &truth, &reference, settings)
                .track(law, &model, name)
                .unwrap();
            assert!(
                run.measures.bandwidth == 5.0,
                "{name} {law:?} {}",
                run.measures.bandwidth
            );
        }
    }
}

/// A motor that cannot do what the law asks is named with its value; one that can is not.
#[test]
fn motors_that_leave_their_limits_are_told() {
    let mut robot = robot("irp6.toml");
    let limits = |torque: f64, velocity: f64| {
        Some(rig_model::robot::MotorLimits {
            torque: Some(torque),
            velocity: Some(velocity),
            ..Default::default()
        })
    };
    let mut warned = |torque, velocity| {
        robot.joints[0].drive.as_mut().unwrap().limits = limits(torque, velocity);
        let settings = Settings::default();
        let truth = Model::from_robot(&robot).unwrap();
        let reference = references(&default_reference(&robot, settings.rate, 2.0)).unwrap();
        let bench = Bench {
            robot: &robot,
            truth: &truth,
            reference: &reference,
            tool: [0.0; 3],
            settings,
            wrong: None,
        };
        let model = LawModel::of(&robot).unwrap();
        let run = bench.track(LawKind::ComputedTorque, &model, "own").unwrap();
        let fastest = (run.trace.velocity[0].iter()).fold(0.0, |m: f64, v| m.max(v.abs()));
        let strongest = (run.trace.torque[0].iter()).fold(0.0, |m: f64, t| m.max(t.abs()));
        (run.measures.warnings.join(" "), fastest, strongest)
    };
    // The column's motor turns 158 times per turn of the joint, the other way round.
    let (none, fastest, strongest) = warned(1e3, 1e5);
    assert!(!none.contains("motors"), "{none}");
    let (both, ..) = warned(0.9 * strongest / 158.0, 0.9 * fastest * 158.0);
    assert!(
        both.contains("the torque of the motor of joint \"column\""),
        "{both}"
    );
    assert!(both.contains("the speed of the motor"), "{both}");
    let (kept, ..) = warned(1.1 * strongest / 158.0, 1.1 * fastest * 158.0);
    assert!(!kept.contains("motors"), "{kept}");
}
