//! Simulated comparisons of the described robots.

use rig_model::robot::{EDDA_TEMPLATE, IRP6_TEMPLATE, ONE_LINK_TEMPLATE, Robot};

use crate::{SimulateOptions, SimulatedRobot, simulated};

fn run(text: &str, seed: u64) -> SimulatedRobot {
    let robot = Robot::from_toml(text, "robot.toml".as_ref()).unwrap();
    let options = SimulateOptions {
        seed,
        ..SimulateOptions::default()
    };
    simulated(&robot, &options, |_| ()).unwrap()
}

/// All four identifications find the simulated robot: their torque is nearer to the true one than the noise of 1 %, and
/// their intervals cover.
#[test]
fn four_identifications_find_the_simulated_robot() {
    for text in [ONE_LINK_TEMPLATE, EDDA_TEMPLATE] {
        for seed in 1..4 {
            let found = run(text, seed);
            assert_eq!(found.estimates.len(), 4);
            for e in &found.estimates {
                assert!(
                    e.torque_error < 1e-3,
                    "{} {}: {}",
                    e.way,
                    e.model,
                    e.torque_error
                );
                let known = || e.values.iter().flatten().filter_map(|v| v.covers);
                println!(
                    "{} seed {seed} ({:.1} s, {:.1} Hz, {:.0} rows/s) {} {}: {} of {}, torque error {:.2e}",
                    found.robot,
                    found.seconds,
                    found.cutoff,
                    found.rows_per_second,
                    e.way,
                    e.model,
                    known().filter(|c| *c).count(),
                    known().count(),
                    e.torque_error
                );
                assert!(known().filter(|c| !*c).count() <= 3);
                assert_eq!(e.values.len(), found.parameters.len());
                // The recursion begins far off and ends at its result.
                if let [Some(first), Some(last)] =
                    [e.convergence[1].first(), e.convergence[1].last()]
                {
                    assert!(*last < 0.1 * first && (last - e.torque_error).abs() < 1e-12);
                }
            }
            for h in &found.holdout {
                for error in &h.relative_error {
                    assert!(*error < 1.2 * h.relative_error_of_truth + 1e-4, "{error}");
                }
            }
        }
    }
}

#[test]
fn a_seed_gives_the_same_result_and_a_missing_encoder_is_said() {
    let found = run(ONE_LINK_TEMPLATE, 7);
    assert_eq!(found, run(ONE_LINK_TEMPLATE, 7));
    assert_ne!(found.estimates, run(ONE_LINK_TEMPLATE, 8).estimates);
    let missing = |found: &SimulatedRobot| {
        let of_step = |n: &String| n.contains("rounded to steps of 0.00001 rad");
        found.notes.iter().any(of_step)
    };
    assert!(!missing(&found));
    assert!(missing(&run(EDDA_TEMPLATE, 7)));
}

/// Many parameters, and joints that stick at reversals: the 95 % intervals of all four identifications hold the truth
/// nearly as often as they claim.
#[test]
fn intervals_of_many_parameters_hold_the_truth() {
    let number = |name: &str| std::env::var(name).map_or(1, |n| n.parse().unwrap());
    let (first, count): (u64, u64) = (number("RIG_FIRST"), number("RIG_SEEDS"));
    let mut inside = [[0usize; 2]; 4];
    for seed in first..first + count {
        let found = run(IRP6_TEMPLATE, seed);
        assert!(found.seconds * found.rows_per_second > 10.0 * found.parameters.len() as f64);
        for (e, sum) in found.estimates.iter().zip(&mut inside) {
            let known: Vec<bool> = e.values.iter().flatten().filter_map(|v| v.covers).collect();
            let held = known.iter().filter(|c| **c).count();
            println!(
                "seed {seed} {} {}: {held} of {}, torque error {:.2e}",
                e.way,
                e.model,
                known.len(),
                e.torque_error
            );
            *sum = [sum[0] + held, sum[1] + known.len()];
            assert!(
                e.torque_error < 1e-3,
                "{} {}: {}",
                e.way,
                e.model,
                e.torque_error
            );
        }
    }
    for [held, all] in inside {
        println!("{held} of {all}");
        // Over 16 motions the shares were 0.910 to 0.970. Before the rows' band ended below the cut-off, 0.892 off-line.
        let share = if count < 5 { 0.8 } else { 0.9 };
        assert!(
            held as f64 >= share * all as f64 && all >= 57 * count as usize / 2,
            "{held} of {all}"
        );
    }
}
