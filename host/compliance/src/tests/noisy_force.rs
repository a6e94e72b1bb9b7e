//! The stiffness from a noisy force with the motor held, and loadings of few levels.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;
use rig_data::{Block, JointColumns};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};

use super::rig::recording;
use crate::{ComplianceOptions, Value, identify_compliance};

const STIFFNESS: f64 = 1500.0;
const ARM: f64 = 0.5;

/// A horizontal arm with a force (N) at its end, and the stiffness that is found.
fn found(
    force: &[f64],
    hysteresis: f64,
    noise: [f64; 2],
    seed: u64,
    scale: f64,
) -> Result<Value, String> {
    found_at([ARM, 0.0, 0.0], force, hysteresis, noise, seed, scale)
}

/// The same with another tool point in the options than the one at which the force acts.
fn found_at(
    tool: [f64; 3],
    force: &[f64],
    hysteresis: f64,
    noise: [f64; 2],
    seed: u64,
    scale: f64,
) -> Result<Value, String> {
    let mut dice = Pcg64Mcg::seed_from_u64(seed);
    let mut normal =
        |std: f64| -> f64 { std * Distribution::<f64>::sample(&StandardNormal, &mut dice) };
    let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "rig.toml".as_ref()).unwrap();
    // Dry friction in parallel with the spring: the torque of the spring follows within its band.
    let mut spring = ARM * force[0];
    let (mut read, mut gauge) = (Vec::new(), Vec::new());
    for f in force {
        spring = spring.clamp(ARM * f - hysteresis, ARM * f + hysteresis);
        read.push(scale * (f + normal(noise[0])));
        gauge.push(ARM * spring / STIFFNESS + normal(noise[1]));
    }
    let rows = force.len();
    let block = Block {
        t: (0..rows).map(|k| 0.1 * k as f64).collect(),
        joints: vec![JointColumns {
            q: vec![0.0; rows],
            ..JointColumns::default()
        }],
        extra: vec![
            ("fx".to_owned(), vec![0.0; rows]),
            ("fy".to_owned(), vec![0.0; rows]),
            ("fz".to_owned(), read),
            ("dz".to_owned(), gauge),
        ],
        first_line: 2,
        ..Block::default()
    };
    let options = ComplianceOptions {
        tool,
        ..ComplianceOptions::default()
    };
    identify_compliance(&robot, &[&recording(block)], &[], &options)
        .map(|own| own.drives[0].stiffness.unwrap())
        .map_err(|error| error.to_string())
}

/// A force that swings twice about `middle`.
fn swing(middle: f64, size: f64) -> Vec<f64> {
    (0..400)
        .map(|k| middle - size * (std::f64::consts::TAU * f64::from(k) / 200.0).cos())
        .collect()
}

/// A tool point that was not given is the origin of the flange frame, here on the axis: this was told as noise.
#[test]
fn a_tool_point_on_the_axis_is_named() {
    let said = found_at([0.0; 3], &swing(0.0, 20.0), 0.0, [0.05, 1e-5], 1, 1.0).unwrap_err();
    assert!(said.contains("--tool") && !said.contains("nois"), "{said}");
}

/// The first 40 rows of a loading show no turning point at a noise that the whole recording bears: the length is named.
#[test]
fn a_recording_that_is_too_short_is_named() {
    let whole = swing(0.0, 20.0);
    let short = |seed| found(&whole[40..80], 0.0, [1.0, 1e-5], seed, 1.0);
    let said: Vec<String> = (0..8).filter_map(|seed| short(seed).err()).collect();
    assert!(
        said.iter().any(|own| own.contains("of 40 rows")),
        "{said:?}"
    );
    assert!(found(&whole, 0.0, [1.0, 1e-5], 1, 1.0).is_ok());
}

/// A noisy regressor and a choice of windows by its own noise both bias a slope; intervals tell.
#[test]
fn the_noise_of_the_force_biases_no_stiffness() {
    let seeds = 100;
    for (middle, size) in [(14.0, 6.0), (0.0, 20.0)] {
        for hysteresis in [0.0, 0.3] {
            for noise in [0.2, 0.6, 1.0] {
                let force = swing(middle, size);
                let (mut sum, mut covered, mut refused, mut worst) = (0.0, 0, 0, 0.0f64);
                for seed in 0..seeds {
                    match found(&force, hysteresis, [noise, 1e-5], seed, 1.0) {
                        Ok(value) => {
                            let z = (value.value - STIFFNESS) / value.std;
                            let [low, high] = value.interval();
                            sum += z;
                            covered += u64::from(low <= STIFFNESS && STIFFNESS <= high);
                            worst = worst.max((value.value / STIFFNESS - 1.0).abs());
                        }
                        Err(text) => {
                            refused += 1;
                            assert!(text.contains("too noisy"), "{text}");
                        }
                    }
                }
                let given = seeds - refused;
                let mean = sum / given.max(1) as f64;
                println!(
                    "force {middle} ± {size} N, hysteresis {hysteresis} N·m, noise {noise} N: {covered} of {given} intervals cover, {refused} refused, mean z {mean:.2}, at most {:.1} % off",
                    100.0 * worst
                );
                assert!(refused == 0 || noise > 0.6, "{refused}");
                assert!(given < 20 || mean.abs() < 0.35, "{mean}");
                // Fewer than 20 are too few to count.
                assert!(
                    given < 20 || 100 * covered >= 90 * given,
                    "{covered} of {given}"
                );
            }
        }
    }
}

/// Levels, each held for 40 rows.
fn levels(list: &[f64]) -> Vec<f64> {
    list.iter().flat_map(|level| vec![*level; 40]).collect()
}

#[test]
fn levels_at_the_turning_points_alone_are_told_from_a_missing_joint() {
    for list in [&[0.0, 20.0][..], &[-20.0, 20.0, -20.0, 20.0]] {
        for seed in 0..20 {
            let said = found(&levels(list), 0.3, [0.1, 5e-6], seed, 1.0).unwrap_err();
            assert!(
                said.contains("from its hysteresis") && !said.contains("others"),
                "{list:?} {said}"
            );
        }
    }
    for list in [
        &[0.0, 20.0, 0.0, -20.0, 0.0][..],
        &[0.0, 10.0, 20.0, 10.0, 0.0],
    ] {
        let mut sum = 0.0;
        for seed in 0..20 {
            let value = found(&levels(list), 0.3, [0.1, 5e-6], seed, 1.0).unwrap();
            assert!(
                (value.value / STIFFNESS - 1.0).abs() < 0.02,
                "{list:?} {value:?}"
            );
            sum += (value.value - STIFFNESS) / value.std / 20.0;
        }
        println!("levels {list:?}: mean z {sum:.2}");
    }
}

/// The weight of the described link, 2.943 N·m, would turn a joint of 1.5 N·m/rad by 1.96 rad.
#[test]
fn a_force_in_kilonewtons_makes_the_arm_hang_and_is_refused() {
    let said = found(&swing(0.0, 20.0), 0.3, [0.1, 5e-6], 1, 1e-3).unwrap_err();
    assert!(said.contains("1.96 rad") && said.contains("kN"), "{said}");
    assert!(found(&swing(0.0, 20.0), 0.3, [0.1, 5e-6], 1, 1.0).is_ok());
}

/// A screw turns its motor hundreds of times as far as its joint.
#[test]
fn a_given_stiffness_of_a_screw_at_its_joint_is_told() {
    let robot = Robot::from_toml(rig_model::robot::IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    let said = |stiffness: [f64; 5]| {
        let options = ComplianceOptions {
            stiffness: stiffness.to_vec(),
            poses: vec![vec![0.1, -1.5, -0.3, 0.1, 0.1]],
            ..ComplianceOptions::default()
        };
        let found = identify_compliance(&robot, &[], &[], &options).unwrap();
        found.warnings.join(" ")
    };
    let wrong = said([1e4, 2e4, 2e4, 4e3, 3e3]);
    println!("{wrong}");
    assert!(
        wrong.contains("\"lower_arm\"") && wrong.contains("at the motor of the screw"),
        "{wrong}"
    );
    let right = said([1e4, 0.3, 0.3, 4e3, 3e3]);
    assert!(!right.contains("at the motor of the screw"), "{right}");
}
