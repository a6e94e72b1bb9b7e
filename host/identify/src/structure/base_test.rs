//! Base parameters against published lists.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use super::Base;
use crate::ModelKind;
use rig_model::robot::{EDDA_TEMPLATE, IRP6_TEMPLATE, Robot, TX40};

/// Returns the terms of an expression, with this project's names.
pub(crate) fn terms(text: &str) -> BTreeMap<String, f64> {
    let mut found = BTreeMap::new();
    for part in text.replace(" - ", " + -").split(" + ") {
        let part = part.trim();
        let (sign, part) = part.strip_prefix('-').map_or((1.0, part), |p| (-1.0, p));
        let (factor, name) = match part.split_once(['*', ' ']) {
            Some((k, name)) => (k.trim().parse().unwrap(), name.trim()),
            None => (1.0, part),
        };
        let name = name.replace("fs", "fc");
        found.insert(name, sign * factor);
    }
    found
}

#[test]
fn the_tx40_has_the_published_sixty() {
    let Some(data) = rig_output::data_dir() else {
        println!("no real recordings here (set RIG_DATA): nothing compared");
        return;
    };
    let path = data.join("staubli_tx40/published_base_parameters.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let published: Vec<BTreeMap<String, f64>> = text
        .lines()
        .map(|l| terms(l.split(',').next().unwrap()))
        .collect();
    assert_eq!(published.len(), 60);
    let robot = Robot::from_toml(TX40, Path::new("tx40.toml")).unwrap();
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let base = Base::structural(&robot, model, 1).unwrap();
        let ours: Vec<BTreeMap<String, f64>> = (0..base.len())
            .map(|k| terms(&base.expression(k)))
            .collect();
        assert_eq!(ours.len(), 60, "{ours:#?}");
        for wanted in &published {
            let same = |mine: &BTreeMap<String, f64>| {
                mine.keys().eq(wanted.keys())
                    && mine
                        .values()
                        .zip(wanted.values())
                        .all(|(a, b)| (a - b).abs() < 1e-6)
            };
            assert!(ours.iter().any(same), "{wanted:?} is not among {ours:#?}");
        }
    }
}

#[test]
fn motor_columns_carry_their_names_and_units() {
    let robot = Robot::from_toml(IRP6_TEMPLATE, Path::new("irp6.toml")).unwrap();
    let base = Base::structural(&robot, ModelKind::Differential, 1).unwrap();
    let integral = Base::structural(&robot, ModelKind::Integral, 1).unwrap();
    assert_eq!(base.len(), integral.len());
    let named = |name: &str| {
        let c = (0..17 * 5).find(|c| base.column_name(*c) == name).unwrap();
        (c, base.column_unit(c))
    };
    assert_eq!(named("Iam2"), (14 * 5 + 3, "kg*m^2"));
    assert_eq!(named("fvm5"), (14 * 5 + 13, "N*m*s/rad"));
    assert_eq!(named("fcm3"), (14 * 5 + 8, "N*m"));
    for name in [
        "Iam2", "fvm2", "fcm2", "fcm3", "Iam4", "fvm4", "fcm4", "Iam5", "fvm5", "fcm5",
    ] {
        let (c, _) = named(name);
        let row: Vec<f64> = (0..base.len()).map(|k| base.combination[(k, c)]).collect();
        assert!(row.iter().any(|v| v.abs() > 1e-6), "{name} does nothing");
    }
    // A motor that moves only its own joint adds no columns of its own.
    for name in ["Iam1", "fvm1", "fcm1", "Ia5"] {
        let (c, _) = named(name);
        assert!(
            (0..base.len()).all(|k| base.combination[(k, c)] == 0.0),
            "{name}"
        );
    }
}

#[test]
fn an_angle_that_no_motion_decides_is_named() {
    let mut robot = Robot::from_toml(EDDA_TEMPLATE, Path::new("edda.toml")).unwrap();
    // Set directly: a file with this angle would be read as a half turn.
    robot.joints[1].alpha = 1e-8;
    let said = Base::structural(&robot, ModelKind::Differential, 1)
        .unwrap_err()
        .to_string();
    for part in ["EDDA", "2 of joint `", &robot.joints[1].name, "right angle"] {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
}
