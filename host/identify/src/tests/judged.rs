//! Estimators on the noise for which each is made, and their claims.

use super::arms::{Noise, arm, blank, record, truth};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::*;

/// One joint; the position is so noisy and so weakly filtered that half of the acceleration is noise.
fn noisy(seed: u64) -> (Robot, InMemory, Options) {
    let robot = arm(1, 3);
    let noise = Noise {
        position: 2e-4,
        torque: 0.05,
        ..Default::default()
    };
    let recording = record(&robot, 20.0, 200.0, noise, seed);
    let options = Options {
        prepare: PrepareOptions {
            cutoff: Choice::Fixed(30.0),
            decimation: Choice::Fixed(1),
            speed_threshold: Choice::Fixed(0.2),
            ..Default::default()
        },
        ..Default::default()
    };
    (robot, recording, options)
}

/// Index of the inertia at the joint.
fn inertia_of(found: &Identification) -> usize {
    found
        .base_parameters
        .iter()
        .position(|b| b.expression.starts_with("Izz1"))
        .unwrap()
}

#[test]
fn instruments_and_total_least_squares_undo_the_bias_of_noisy_positions() {
    let seeds = 40;
    let list = [Estimator::Weighted, Estimator::Iv, Estimator::Tls];
    let mut errors = vec![Vec::new(); list.len()];
    for seed in 0..seeds {
        let (robot, recording, options) = noisy(seed);
        for (errors, estimator) in errors.iter_mut().zip(list) {
            let found = identify(
                &blank(&robot),
                &[&recording],
                &[],
                &Options {
                    estimator,
                    ..options.clone()
                },
            )
            .unwrap();
            if seed == 0 {
                println!("{estimator:?} {:?} {:?}", found.procedure, found.warnings);
            }
            let k = inertia_of(&found);
            errors.push(found.base_parameters[k].value / truth(&robot, &found)[k] - 1.0);
        }
    }
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
    let error = |e: &[f64]| {
        let m = mean(e);
        (e.iter().map(|x| (x - m).powi(2)).sum::<f64>() / (e.len() - 1) as f64 / e.len() as f64)
            .sqrt()
    };
    for (estimator, e) in list.iter().zip(&errors) {
        println!(
            "{estimator:?}: inertia off by {:.3} % ± {:.3} %",
            100.0 * mean(e),
            100.0 * error(e)
        );
    }
    assert!(
        mean(&errors[0]) < -0.1,
        "least squares is biased towards zero"
    );
    assert!(mean(&errors[1]).abs() < 3.0 * error(&errors[1]) + 1e-3);
    assert!(mean(&errors[2]).abs() < 0.15 * mean(&errors[0]).abs());
}

#[test]
fn the_comparison_sees_the_bias_and_says_which_to_trust() {
    let (robot, recording, options) = noisy(100);
    let (_, holdout, _) = noisy(101);
    let found = identify(
        &blank(&robot),
        &[&recording],
        &[&holdout],
        &Options {
            compare: Estimator::ALL.to_vec(),
            ..options
        },
    )
    .unwrap();
    let comparison = found.comparison.as_ref().unwrap();
    for row in &comparison.estimators {
        println!("{row:?}");
    }
    println!("{} {:?}", comparison.recommendation, comparison.endogeneity);
    assert!(comparison.endogeneity.as_ref().unwrap().p_value < 0.01);
    assert_eq!(comparison.recommended, Estimator::Iv);
    assert_eq!(comparison.estimators.len(), 9);
    assert!(comparison.estimators.iter().all(|row| row.values.is_some()));
    // Without that noise no bias is detected.
    let quiet = record(
        &robot,
        20.0,
        200.0,
        Noise {
            position: 1e-6,
            torque: 0.05,
            ..Default::default()
        },
        7,
    );
    let found = identify(
        &blank(&robot),
        &[&quiet],
        &[],
        &Options {
            compare: vec![Estimator::Weighted, Estimator::Iv, Estimator::Consistent],
            ..Default::default()
        },
    )
    .unwrap();
    let comparison = found.comparison.unwrap();
    println!("{} {:?}", comparison.recommendation, comparison.endogeneity);
    assert!(comparison.endogeneity.unwrap().p_value > 0.01);
    assert_ne!(comparison.recommended, Estimator::Iv);
}

#[test]
fn maximum_likelihood_is_the_more_exact_one_on_the_noise_it_models() {
    let robot = arm(2, 5);
    let noise = Noise {
        position: 1e-6,
        torque: 0.01,
        coloured: [0.4, 0.9],
        common: 0.9,
    };
    let options = Options {
        prepare: PrepareOptions {
            decimation: Choice::Fixed(2),
            cutoff: Choice::Fixed(40.0),
            ..Default::default()
        },
        ..Default::default()
    };
    let seeds = 40;
    let mut squares = [0.0; 2];
    let mut inside = [0usize; 2];
    let mut count = 0;
    for seed in 0..seeds {
        let recording = record(&robot, 20.0, 200.0, noise, 1000 + seed);
        let mut unit: Option<Vec<f64>> = None;
        for (k, estimator) in [Estimator::Weighted, Estimator::Ml].into_iter().enumerate() {
            let found = identify(
                &blank(&robot),
                &[&recording],
                &[],
                &Options {
                    estimator,
                    ..options.clone()
                },
            )
            .unwrap();
            if seed == 0 {
                println!("{estimator:?} {:?} {:?}", found.procedure, found.warnings);
            }
            let truth = truth(&robot, &found);
            let e = &found.details.estimate;
            let unit = unit.get_or_insert_with(|| e.std.clone());
            for c in 0..truth.len() {
                squares[k] += ((e.values[c] - truth[c]) / unit[c]).powi(2);
                inside[k] += usize::from(e.covers(c, truth[c]));
                count += k;
            }
        }
    }
    let share = |k: usize| inside[k] as f64 / count as f64;
    println!(
        "mean square error against weighted: {:.3}; coverage {:.3} and {:.3}",
        squares[1] / squares[0],
        share(0),
        share(1)
    );
    assert!(squares[1] < 0.7 * squares[0]);
    assert!((0.9..=0.99).contains(&share(1)), "{}", share(1));
}

/// Coverage of 95 % intervals, a hundred recordings of one joint.
#[test]
fn every_estimators_intervals_cover_as_often_as_they_say() {
    let robot = arm(1, 4);
    let noise = Noise {
        position: 1e-6,
        torque: 0.1,
        coloured: [0.1, 0.8],
        common: 0.0,
    };
    let list = [
        Estimator::Iv,
        Estimator::Tls,
        Estimator::Ml,
        Estimator::Ridge,
        Estimator::Consistent,
    ];
    let mut inside = vec![0usize; list.len()];
    let mut count = 0;
    for seed in 0..100 {
        let recording = record(&robot, 30.0, 200.0, noise, 2000 + seed);
        for (k, estimator) in list.into_iter().enumerate() {
            let found = identify(
                &blank(&robot),
                &[&recording],
                &[],
                &Options {
                    estimator,
                    ..Default::default()
                },
            )
            .unwrap();
            let truth = truth(&robot, &found);
            for (c, t) in truth.iter().enumerate() {
                inside[k] += usize::from(found.details.estimate.covers(c, *t));
                count += usize::from(k == 0);
            }
        }
    }
    for (k, estimator) in list.iter().enumerate() {
        let share = inside[k] as f64 / count as f64;
        println!("{estimator:?} covers {share:.3} of {count}");
        assert!((0.91..=0.99).contains(&share), "{estimator:?} {share}");
    }
}

#[test]
fn ridge_goes_from_the_description_to_the_data() {
    let robot = arm(2, 8);
    let recording = record(
        &robot,
        20.0,
        200.0,
        Noise {
            position: 1e-6,
            torque: 0.05,
            ..Default::default()
        },
        1,
    );
    // A description that is wrong by a fifth.
    let mut wrong = robot.clone();
    for joint in &mut wrong.joints {
        let link = joint.inertial.as_mut().unwrap();
        link.mass *= 1.2;
        link.first_moment = link.first_moment.map(|x| 1.2 * x);
        link.inertia = link.inertia.map(|x| 1.2 * x);
        joint.friction = None;
    }
    let run = |estimator, uncertainty| {
        identify(
            &wrong,
            &[&recording],
            &[],
            &Options {
                estimator,
                prior_uncertainty: uncertainty,
                ..Default::default()
            },
        )
        .unwrap()
    };
    let weighted = run(Estimator::Weighted, None);
    let (bound, free, evident) = (
        run(Estimator::Ridge, Some(1e-6)),
        run(Estimator::Ridge, Some(1e4)),
        run(Estimator::Ridge, None),
    );
    let mut described = wrong.standard_parameters().concat();
    described.resize(weighted.details.combination.ncols(), 0.0);
    println!("{:?}", evident.procedure);
    let prior = &weighted.details.combination * nalgebra::DVector::from_vec(described);
    for (k, b) in weighted.base_parameters.iter().enumerate() {
        let near = |found: &Identification| found.base_parameters[k].value;
        // Friction is not in the description and is therefore free in all of them.
        if !b.expression.starts_with(['f', 'o']) {
            assert!(
                (near(&bound) - prior[k]).abs() < 1e-3 * (1e-3 + prior[k].abs()),
                "{b:?}"
            );
        }
        assert!(
            (near(&free) - b.value).abs() < 0.7 * b.std + 1e-6,
            "{b:?} {}",
            near(&free)
        );
        // Well-identified parameters follow the data.
        if b.relative_std_percent < 1.0 {
            assert!(
                (near(&evident) - b.value).abs() < 3.0 * b.std,
                "{b:?} {}",
                near(&evident)
            );
        }
    }
}

/// For weak and strong priors: near the boundary of physical consistency, rounding may make a positive definite Hessian
/// look indefinite.
#[test]
fn a_consistent_fit_ends_whatever_the_description_counts_for() {
    let robot = arm(3, 31);
    let recording = record(
        &robot,
        12.0,
        200.0,
        Noise {
            position: 1e-6,
            torque: 0.05,
            ..Default::default()
        },
        3,
    );
    let run = |uncertainty| {
        identify(
            &robot,
            &[&recording],
            &[],
            &Options {
                estimator: Estimator::Consistent,
                prior_uncertainty: Some(uncertainty),
                ..Default::default()
            },
        )
    };
    let usual = run(2.0).unwrap();
    for uncertainty in [1e-8, 1e-4, 30.0, 1e4] {
        let found = run(uncertainty);
        let found = found.unwrap_or_else(|error| panic!("{uncertainty}: {error}"));
        // The description is right here, so a strong prior does no harm.
        for (a, b) in found.base_parameters.iter().zip(&usual.base_parameters) {
            let apart = (a.value - b.value).abs();
            assert!(apart < 4.0 * b.std + 1e-9, "{uncertainty}: {a:?} {b:?}");
        }
    }
}

/// Little motion and much noise: least squares gives impossible links, the consistent fit never does, and it predicts
/// other motions better.
#[test]
fn consistent_parameters_are_those_of_bodies_also_where_least_squares_is_not() {
    let (mut gained, mut impossible) = (0, 0);
    for seed in 0..5 {
        let robot = arm(3, 20 + seed);
        let noise = Noise {
            position: 1e-6,
            torque: 4.0,
            ..Default::default()
        };
        let recording = record(&robot, 8.0, 200.0, noise, seed);
        let other = record(&robot, 8.0, 200.0, noise, 50 + seed);
        let found = identify(
            &blank(&robot),
            &[&recording],
            &[&other],
            &Options {
                estimator: Estimator::Consistent,
                compare: vec![Estimator::Weighted, Estimator::Consistent],
                ..Default::default()
            },
        )
        .unwrap();
        let set = found.standard_parameters.as_ref().unwrap();
        assert!(set.least_eigenvalue.iter().all(|e| *e > 1e-9), "{set:?}");
        for p in set.parameters.iter().filter(|p| {
            ["Ia", "fv", "fc"]
                .iter()
                .any(|name| p.name.starts_with(name))
                || p.name.starts_with('m') && p.name.len() == 2
        }) {
            assert!(p.value > 0.0, "{p:?}");
        }
        let rows = &found.comparison.as_ref().unwrap().estimators;
        println!(
            "weighted {:.2} std from a body; hold-out {:.4?} against {:.4?}; {}",
            rows[0].distance_to_consistent.unwrap(),
            rows[0].holdout_relative_error.as_ref().unwrap(),
            rows[1].holdout_relative_error.as_ref().unwrap(),
            found.comparison.as_ref().unwrap().recommendation,
        );
        impossible += usize::from(rows[0].physically_consistent == Some(false));
        let total = |row: &Compared| -> f64 {
            row.holdout_relative_error
                .as_ref()
                .unwrap()
                .iter()
                .map(|e| e * e)
                .sum()
        };
        gained += usize::from(total(&rows[1]) < total(&rows[0]));
        // The description written from it can be simulated and read back.
        let (written, _) = identified_robot(&blank(&robot), &found);
        let text = written.to_toml().unwrap();
        let back = Robot::from_toml(&text, std::path::Path::new("identified.toml")).unwrap();
        let model = rig_model::simulate::Model::from_robot(&back).unwrap();
        for (a, b) in model.parameters.iter().flatten().zip(set.values()) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()));
        }
    }
    println!("{impossible} of 5 impossible, {gained} of 5 better predicted");
    assert!(impossible >= 3 && gained >= 3, "{impossible} {gained}");
}

#[test]
fn a_recordings_weight_is_how_often_it_counts() {
    let robot = arm(2, 6);
    let noise = Noise {
        position: 1e-6,
        torque: 0.2,
        ..Default::default()
    };
    let (first, second) = (
        record(&robot, 20.0, 200.0, noise, 1),
        record(&robot, 20.0, 200.0, noise, 2),
    );
    let run = |list: &[&dyn rig_data::prepare::Recording], weights: &[f64], estimator| {
        let options = Options {
            estimator,
            recording_weights: weights.to_vec(),
            prepare: PrepareOptions {
                cutoff: Choice::Fixed(30.0),
                decimation: Choice::Fixed(4),
                speed_threshold: Choice::Fixed(0.1),
                ..Default::default()
            },
            ..Default::default()
        };
        identify(&blank(&robot), list, &[], &options)
            .unwrap()
            .details
            .estimate
            .values
    };
    for estimator in Estimator::ALL {
        let doubled = run(&[&first, &second], &[2.0, 1.0], estimator);
        let twice = run(&[&first, &first, &second], &[], estimator);
        let alone = run(&[&first], &[], estimator);
        let almost = run(&[&first, &second], &[1e9, 1.0], estimator);
        let once = run(&[&first, &second], &[], estimator);
        let apart = |a: &[f64], b: &[f64]| {
            let each = a.iter().zip(b).zip(&alone);
            each.map(|((a, b), size)| (a - b).abs() / size.abs().max(0.1))
                .fold(0.0, f64::max)
        };
        let (weight, ignored) = (apart(&doubled, &twice), apart(&almost, &alone));
        let (counted, both) = (apart(&once, &twice), apart(&once, &alone));
        println!(
            "{estimator:?}: weight 2 against twice {weight:.1e}, against once {counted:.1e}; 1e9 against alone {ignored:.1e}, both against alone {both:.1e}"
        );
        // A loss and a prior also depend on the number of rows, which a weight does not change.
        let [most, most_ignored] = match estimator {
            Estimator::Ols => [1e-9, 1e-6],
            Estimator::Robust | Estimator::Ridge | Estimator::Consistent => [3e-3, 2e-2],
            // The order of the autoregression alone depends on the number of rows.
            Estimator::Ml => [3e-3, 1e-3],
            _ => [1e-4, 1e-3],
        };
        assert!(weight < most && weight < 0.1 * counted, "{estimator:?}");
        assert!(
            ignored < most_ignored && ignored < 0.2 * both,
            "{estimator:?}"
        );
    }
    let options = Options {
        recording_weights: vec![1.0, -2.0],
        ..Default::default()
    };
    let refused = identify(&blank(&robot), &[&first, &second], &[], &options).unwrap_err();
    assert!(refused.to_string().contains("weight is -2"), "{refused}");
}

#[test]
fn output_error_says_what_it_lacks() {
    let robot = arm(1, 6);
    let mut recording = record(&robot, 20.0, 200.0, Noise::default(), 1);
    for block in &mut recording.blocks {
        block.joints[0].reference = None;
    }
    let options = Options {
        estimator: Estimator::OutputError,
        ..Default::default()
    };
    let error = identify(&blank(&robot), &[&recording], &[], &options).unwrap_err();
    assert!(error.to_string().contains("ref<k>"), "{error}");
}

/// The removed parameters were not needed: the residual stays, and no parameter known to a per cent is removed.
#[test]
fn essential_parameters_are_few_and_enough() {
    let robot = arm(3, 9);
    let noise = Noise {
        position: 1e-6,
        torque: 0.5,
        ..Default::default()
    };
    let recording = record(&robot, 20.0, 200.0, noise, 4);
    let found = identify(&blank(&robot), &[&recording], &[], &Options::default()).unwrap();
    let set = found.essential.as_ref().unwrap();
    println!("{} of {}: {set:?}", set.parameters.len(), found.rank);
    assert_eq!(set.parameters.len() + set.left_out.len(), found.rank);
    assert!(!set.left_out.is_empty());
    // Squares grow by chance, even if no parameter was needed: by F(q, n − p) times the noise of q parameters, with n
    // independent rows. With fewer rows in the band of the fit the growth is larger.
    let estimate = &found.details.estimate;
    let (gone, rows) = (set.left_out.len() as f64, estimate.effective_rows);
    let freedom = rows - found.rank as f64;
    let f = FisherSnedecor::new(gone, freedom)
        .unwrap()
        .inverse_cdf(0.95);
    let by_chance = 100.0 * ((1.0 + gone * f / freedom).sqrt() - 1.0);
    println!("{rows:.0} rows: by chance up to {by_chance:.3} %");
    assert!(set.residual_increase_percent < by_chance);
    // Parameters that differ significantly from zero in the full fit are not removed.
    for b in &found.base_parameters {
        assert!(
            b.value.abs() < 5.0 * b.std || !set.left_out.contains(&b.expression),
            "{b:?}"
        );
    }
    for b in found
        .base_parameters
        .iter()
        .filter(|b| b.relative_std_percent < 1.0)
    {
        assert!(
            set.parameters.iter().any(|e| e.expression == b.expression),
            "{b:?}"
        );
    }
    let ratio = |list: &[f64]| {
        list.iter().copied().fold(0.0, f64::max)
            / list.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let before: Vec<f64> = found
        .base_parameters
        .iter()
        .map(|b| b.classical_relative_std_percent)
        .collect();
    let after: Vec<f64> = set
        .parameters
        .iter()
        .map(|e| e.relative_std_percent)
        .collect();
    assert!(ratio(&after) < ratio(&before));
}
