//! One and two joints.

use std::path::Path;

use nalgebra::DMatrix;
use rig_shared::trajectory::{Fourier, Trajectory};

use super::*;
use crate::criterion::Smoothing;
use crate::frame::values_of;
use crate::optimise::{Objective, Round};
use crate::problem::Problem;
use crate::schedule::JointMotion;
use crate::search::random_start;
use rig_model::robot::EMPS;

#[test]
fn limits_hold_at_every_instant_and_are_used() {
    for (robot, options) in [
        (one_link(), quick(Criterion::Determinant)),
        (
            two_links(),
            Options {
                harmonics: 3,
                starts: 2,
                ..quick(Criterion::ConditionNumber)
            },
        ),
    ] {
        let found = designed(&robot, &options);
        let sampled = sampled_reach(&robot, &found.file);
        let mut fullest = 0.0_f64;
        for ((joint, s), proved) in robot.joints.iter().zip(&sampled).zip(&found.reach) {
            let limits = joint.limits.as_ref().unwrap();
            let torque = proved.torque.unwrap();
            // The samples lie within the proved bounds, and these within the limits.
            assert!(proved.position[0] <= s[0] && s[1] <= proved.position[1]);
            assert!(s[2] <= proved.velocity && s[3] <= proved.acceleration && s[4] <= torque);
            assert!(
                limits.position[0] <= proved.position[0]
                    && proved.position[1] <= limits.position[1]
            );
            assert!(proved.velocity <= limits.velocity);
            assert!(proved.acceleration <= limits.acceleration.unwrap());
            assert!(torque <= limits.torque.unwrap());
            // The proved bounds are tight.
            assert!(
                proved.velocity < 1.01 * s[2] && torque < 1.05 * s[4],
                "{proved:?} {s:?}"
            );
            fullest = fullest
                .max(s[2] / limits.velocity)
                .max(s[4] / limits.torque.unwrap());
        }
        assert!(fullest > 0.9, "a good motion touches a limit: {fullest}");
    }
}

#[test]
fn starts_and_stops_at_rest() {
    let found = designed(&one_link(), &quick(Criterion::ConditionNumber));
    let trajectory = &found.file.joints[0].trajectory;
    let end = trajectory.duration();
    assert!(found.file.duration() > 20.0);
    for t in [0.0, 1e-9, end - 1e-9, end, end + 1.0] {
        let at = trajectory.at(t);
        let size = at.position.abs() + at.velocity.abs() + at.acceleration.abs();
        assert!(size < 1e-5, "{t}: {at:?}");
    }
}

/// Returns the values of a motion of one joint, with the frame of a design.
fn judged(options: &Options, motions: &[JointMotion]) -> Values {
    let (frame, _, _) = frame_of(&one_link(), options).unwrap();
    values_of(&frame, motions, 1000).unwrap()
}

#[test]
fn better_than_chance_and_than_a_sine() {
    for criterion in [
        Criterion::ConditionNumber,
        Criterion::SmallestSingularValue,
        Criterion::Determinant,
    ] {
        let options = quick(criterion);
        let found = designed(&one_link(), &options);
        let (frame, _, _) = frame_of(&one_link(), &options).unwrap();
        let mut rivals = Vec::new();
        for index in 0..50 {
            let mut problem = Problem::new(&frame, 48, Smoothing(2));
            let x = random_start(&mut problem, &frame, 99, index);
            rivals.push(judged(&options, &problem.decode(&x)));
        }
        for harmonic in 0..3 {
            let mut coefficients = vec![0.0; 10];
            coefficients[harmonic] = 5.0 / (frame.schedule.omega() * (harmonic + 1) as f64);
            rivals.push(judged(
                &options,
                &[JointMotion {
                    base: 0.0,
                    coefficients,
                }],
            ));
        }
        for rival in rivals {
            let (ours, theirs) = (criterion.cost(&found.values), criterion.cost(&rival));
            assert!(
                ours < theirs || theirs.is_nan(),
                "{criterion:?}: {ours} {theirs}"
            );
        }
    }
}

#[test]
fn the_printed_condition_number_is_that_of_the_regressor() {
    let robot = one_link();
    let found = designed(&robot, &quick(Criterion::ConditionNumber));
    let trajectory = &found.file.joints[0].trajectory;
    let start = found.file.joints[0].start;
    let Trajectory::Fourier(Fourier {
        period_us, ramp_us, ..
    }) = trajectory
    else {
        panic!("not a Fourier series");
    };
    // An explicit model: gravity acts along −z, the joint axis lies along −y of the base.
    let count = 20_000;
    let mut rows = DMatrix::zeros(count, 6);
    for k in 0..count {
        let t = 1e-6 * (f64::from(*ramp_us) + f64::from(*period_us) * k as f64 / count as f64);
        let at = trajectory.at(t);
        let (s, c) = (start + at.position).sin_cos();
        let columns = [
            9.81 * c,
            -9.81 * s,
            at.acceleration,
            at.velocity,
            at.velocity.signum(),
            1.0,
        ];
        for (i, value) in columns.into_iter().enumerate() {
            rows[(k, i)] = value;
        }
    }
    let singular = rig_numerics::svd::Svd::of(rows.clone()).singular_values;
    let condition = singular.max() / singular.min();
    let printed = found.values.si_condition_number;
    assert!(
        (condition / printed - 1.0).abs() < 2e-3,
        "{condition} {printed}"
    );
    assert_eq!(
        found.base_parameters,
        ["mx1", "my1", "Izz1 + Ia1", "fv1", "fc1", "off1"]
    );
    // Scaling by explicit sizes of uniformly drawn states gives the other value.
    let fastest = 5.0 * core::f64::consts::TAU / (1e-6 * f64::from(*period_us)) * 6.0;
    let mean_cos2 = 0.5 + (6.2_f64).sin() / (4.0 * 3.1);
    let sizes = [
        9.81 * mean_cos2.sqrt(),
        9.81 * (1.0 - mean_cos2).sqrt(),
        fastest.min(60.0) / 3.0_f64.sqrt(),
        6.0 / 3.0_f64.sqrt(),
        1.0,
        1.0,
    ];
    for (i, size) in sizes.into_iter().enumerate() {
        rows.column_mut(i).scale_mut(1.0 / size);
    }
    let singular = rig_numerics::svd::Svd::of(rows.clone()).singular_values;
    let condition = singular.max() / singular.min();
    let printed = found.values.condition_number;
    assert!(
        (condition / printed - 1.0).abs() < 0.05,
        "{condition} {printed}"
    );
}

#[test]
fn the_gradient_is_that_of_central_differences() {
    for (robot, criterion) in [
        (one_link(), Criterion::ConditionNumber),
        (two_links(), Criterion::Determinant),
        (two_links(), Criterion::SmallestSingularValue),
    ] {
        let options = Options {
            harmonics: 2,
            ..quick(criterion)
        };
        let (frame, _, _) = frame_of(&robot, &options).unwrap();
        let mut problem = Problem::new(&frame, 48, Smoothing(4));
        let x = random_start(&mut problem, &frame, 3, 0);
        problem.update(&x, &round(10.0));
        problem.press(0.3);
        gradient_is_that_of_differences(&mut problem, &x, 1e-5);
    }
}

#[test]
fn the_seed_alone_decides() {
    let with = |threads, seed| {
        let options = Options {
            threads: Some(threads),
            seed,
            ..quick(Criterion::ConditionNumber)
        };
        designed(&one_link(), &options)
    };
    assert_eq!(with(1, 5), with(3, 5));
    assert_ne!(with(1, 5).file, with(1, 6).file);
}

#[test]
fn a_given_start_is_kept_and_progress_ends_complete() {
    let options = Options {
        start: Some(vec![-1.2]),
        ..quick(Criterion::ConditionNumber)
    };
    let mut last = (0, 1);
    let found = design(&one_link(), &options, |done, total| {
        assert!(done > last.0);
        last = (done, total);
    })
    .unwrap();
    assert_eq!(found.file.joints[0].start, -1.2);
    assert_eq!(last.0, last.1);
}

#[test]
fn what_cannot_be_designed_is_said() {
    let text = |robot: &Robot, options: &Options| {
        design(robot, options, |_, _| ()).unwrap_err().to_string()
    };
    let mut robot = one_link();
    robot.joints[0].limits.as_mut().unwrap().torque = Some(0.2);
    let said = text(&robot, &quick(Criterion::ConditionNumber));
    assert!(said.contains("torque") && said.contains("link"), "{said}");
    robot.joints[0].limits = None;
    let said = text(&robot, &Options::default());
    assert!(said.contains("joint \"link\" has no limits"), "{said}");
    assert!(
        said.contains("[joint.limits]") && said.contains("<limit"),
        "{said}"
    );
    let path = std::path::Path::new("irp6.toml");
    let mut arm = Robot::from_toml(rig_model::robot::IRP6_TEMPLATE, path).unwrap();
    arm.joints[1].limits = None;
    arm.joints[3].limits = None;
    let said = text(&arm, &Options::default());
    let names = format!(
        "joints \"{}\", \"{}\" have",
        arm.joints[1].name, arm.joints[3].name
    );
    assert!(said.contains(&names), "{said}");
    let wrong = Options {
        harmonics: 9,
        ..Options::default()
    };
    assert!(text(&one_link(), &wrong).contains('9'));
    let wrong = Options {
        start: Some(vec![4.0]),
        ..Options::default()
    };
    assert!(text(&one_link(), &wrong).contains("3.1"));
}

#[test]
fn a_prismatic_joint_without_prior_is_designed_and_says_what_was_not_checked() {
    let robot = Robot::from_toml(EMPS, Path::new("emps.toml")).unwrap();
    let found = designed(&robot, &quick(Criterion::ConditionNumber));
    assert!(
        found
            .notes
            .iter()
            .any(|n| n.contains("torque limit was not checked")),
        "{:?}",
        found.notes
    );
    assert_eq!(found.base_parameters.len(), 4);
    assert!(found.reach[0].velocity <= 0.13 && found.reach[0].torque.is_none());
    assert!(found.values.condition_number < 3.0);
}

/// Returns an optimiser round with that weight.
fn round(weight: f64) -> Round {
    Round {
        weight,
        smoothing: Smoothing(4),
        steps: 1,
    }
}

/// In other projects' descriptions huge numbers mean "no limit". A motion is then sized by what a joint can do within
/// its range.
#[test]
fn limits_that_nothing_reaches_do_not_size_a_motion() {
    let known = designed(&one_link(), &quick(Criterion::ConditionNumber));
    let mut robot = one_link();
    {
        let limits = robot.joints[0].limits.as_mut().unwrap();
        limits.velocity = 1e200;
        limits.torque = Some(1e308);
    }
    let found = designed(&robot, &quick(Criterion::ConditionNumber));
    assert!(found.values.condition_number < 2.0 * known.values.condition_number);
    let said = found.notes.join("\n");
    assert!(said.contains("cannot reach its velocity limit"), "{said}");
    assert!(said.contains("No torque limit"), "{said}");

    robot.joints[0].limits.as_mut().unwrap().acceleration = Some(1e300);
    let refused = design(&robot, &quick(Criterion::ConditionNumber), |_, _| ()).unwrap_err();
    assert!(
        matches!(&refused, ExciteError::Boundless { joint, .. } if *joint == robot.joints[0].name),
        "{refused}"
    );
}
