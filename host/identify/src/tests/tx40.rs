//! The Stäubli TX40 (data and source: README beside the recording).

use super::*;

/// Names and coefficients of an expression in both notations: `1.0*Ia1`, `0.07 mz3`, `fs1` for `fc1`.
fn terms(expression: &str) -> Vec<(String, f64)> {
    let mut list = Vec::new();
    let (mut sign, mut size) = (1.0, 1.0);
    for word in expression.replace('*', " ").split_whitespace() {
        match (word, word.parse::<f64>()) {
            ("+", _) => sign = 1.0,
            ("-", _) => sign = -1.0,
            (_, Ok(number)) => size = number,
            _ => {
                list.push((word.replace("fs", "fc"), sign * size));
                (sign, size) = (1.0, 1.0);
            }
        }
    }
    list.sort_by(|a, b| a.0.cmp(&b.0));
    list
}

fn same(a: &str, b: &str) -> bool {
    let (a, b) = (terms(a), terms(b));
    let mut pairs = a.iter().zip(&b);
    a.len() == b.len() && pairs.all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-6)
}

/// The essential parameters include the 25 published as essential, of 60.
#[test]
fn the_published_essential_parameters_are_essential() {
    let Some(folder) = rig_output::data_dir() else {
        println!("SKIPPED: the folder of real recordings is not there; set RIG_DATA to it.");
        return;
    };
    let folder = folder.join("staubli_tx40");
    let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    let robot = Robot::load(&robots.join("tx40.toml")).unwrap();
    let source = rig_data::Source::open(&folder.join("motor_1kHz.csv"), &robot).unwrap();
    let published =
        std::fs::read_to_string(folder.join("published_essential_parameters.csv")).unwrap();
    for estimator in [Estimator::Weighted, Estimator::Consistent] {
        let options = Options {
            estimator,
            look_beyond: true,
            ..Default::default()
        };
        let found = identify(&robot, &[&source], &[], &options).unwrap();
        let set = found.essential.unwrap();
        println!(
            "{estimator:?}: {} essential of {}, residual up {:.2} %; {}",
            set.parameters.len(),
            found.rank,
            set.residual_increase_percent,
            set.ended
        );
        // A line: expression, then least squares and weighted least squares, each with its deviation.
        let expressions: Vec<&str> = published
            .lines()
            .map(|line| line.split(',').next().unwrap())
            .collect();
        assert_eq!(expressions.len(), 25);
        for wanted in expressions {
            assert!(
                (set.parameters.iter()).any(|own| same(&own.expression, wanted)),
                "{estimator:?}: {wanted} is not among them"
            );
        }
        assert!(set.parameters.len() < 40, "{}", set.parameters.len());
    }
}
