//! The KUKA LWR4+ (data and source: README beside the recordings): a motion that excites little, and another one to
//! predict.

use super::*;

/// A run at an even 200 Hz: the recording's clock jitters by a few milliseconds, its torque is smooth (8 Hz).
fn run(number: usize) -> Option<(Robot, InMemory)> {
    let Some(folder) = crate::data::data_dir() else {
        println!("SKIPPED: the folder of real recordings is not there; set RIG_DATA to it.");
        return None;
    };
    let folder = folder.join("kuka_lwr4");
    let robot = Robot::load(&folder.join("kuka_lwr4.urdf")).unwrap();
    let source =
        crate::data::Source::open(&folder.join(format!("run{number}.csv")), &robot).unwrap();
    let (blocks, _) = source.read_all().unwrap();
    let t: Vec<f64> = blocks.iter().flat_map(|b| b.t.clone()).collect();
    let period = 5e-3;
    let rows = ((t[t.len() - 1] - t[0]) / period) as usize;
    let even = |of: &dyn Fn(&Block) -> Vec<f64>| -> Vec<f64> {
        let values: Vec<f64> = blocks.iter().flat_map(of).collect();
        let mut k = 0;
        (0..rows)
            .map(|i| {
                let at = t[0] + i as f64 * period;
                while k + 2 < t.len() && t[k + 1] < at {
                    k += 1;
                }
                let share = (at - t[k]) / (t[k + 1] - t[k]);
                values[k] * (1.0 - share) + values[k + 1] * share
            })
            .collect()
    };
    let block = Block {
        t: (0..rows).map(|i| i as f64 * period).collect(),
        joints: (0..7)
            .map(|j| JointColumns {
                q: even(&|b| b.joints[j].q.clone()),
                tau: even(&|b| b.joints[j].tau.clone()),
                ..Default::default()
            })
            .collect(),
        first_line: 2,
        ..Default::default()
    };
    Some((
        robot,
        InMemory {
            label: format!("run {number}"),
            blocks: vec![block],
        },
    ))
}

/// Run 1 hardly excites joints 1, 3 and 5 to 7: the plain fit gives links that no body can be and fails on run 3;
/// bodies predict it better on every joint, and the comparison says so without having seen run 3.
#[test]
fn bodies_predict_another_motion_where_least_squares_fails() {
    let (Some((robot, train)), Some((_, other))) = (run(1), run(3)) else {
        return;
    };
    let found = identify(
        &robot,
        &[&train],
        &[&other],
        &Options {
            compare: Estimator::ALL.to_vec(),
            ..Default::default()
        },
    )
    .unwrap();
    let comparison = found.comparison.as_ref().unwrap();
    for row in &comparison.estimators {
        println!(
            "{:12} cv {:.3?} run 3 {:.3?} {:?} {:?}",
            row.estimator.name(),
            row.cross_validated_relative_error,
            row.holdout_relative_error,
            row.distance_to_consistent,
            row.said,
        );
    }
    println!("{}", comparison.recommendation);
    let of = |e: Estimator| {
        comparison
            .estimators
            .iter()
            .find(|row| row.estimator == e)
            .unwrap()
    };
    let (plain, bodies) = (of(Estimator::Weighted), of(Estimator::Consistent));
    assert_eq!(plain.physically_consistent, Some(false));
    for (a, b) in plain
        .holdout_relative_error
        .as_ref()
        .unwrap()
        .iter()
        .zip(bodies.holdout_relative_error.as_ref().unwrap())
    {
        assert!(b < a, "{b} {a}");
    }
    assert_eq!(comparison.recommended, Estimator::Consistent);
    let set = found.standard_parameters.unwrap();
    assert!(set.least_eigenvalue.iter().all(|e| *e > 0.0));
}
