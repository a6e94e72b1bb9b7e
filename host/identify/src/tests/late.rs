//! Torques recorded after they acted, as behind a filter or a bus: friction and inertia make up for most of it, so only a
//! warning tells.

use super::bias::{Drive, driven, shipped};
use super::made::swing;
use super::*;

/// Delays a column by `rows`.
fn delay(column: &mut [f64], rows: usize) {
    let last = column.len() - rows;
    column.copy_within(..last, rows);
    let first = column[rows];
    column[..rows].fill(first);
}

/// Returns the leads that are told, s, and the joint of one that is not common.
fn told(robot: &Robot, recording: &InMemory) -> Vec<(Option<String>, f64)> {
    let options = Options {
        compare: Vec::new(),
        ..Default::default()
    };
    let found = identify(robot, &[recording], &[], &options).unwrap();
    (found.warnings.into_iter())
        .filter_map(|warning| match warning {
            Warning::TorqueLead { joint, lead, .. } => Some((joint, lead)),
            _ => None,
        })
        .collect()
}

#[test]
fn a_late_torque_or_position_of_one_link_is_told_with_its_time() {
    for (seed, rows, of_torque) in [(1, 4, true), (2, 7, true), (3, 10, true), (4, 8, false)] {
        let mut recording = swing(seed, 30.0, false);
        assert_eq!(told(&pendulum(), &recording), [], "{seed}");
        let joint = &mut recording.blocks[0].joints[0];
        let (column, sense) = match of_torque {
            true => (&mut joint.tau, -1.0),
            false => (&mut joint.q, 1.0),
        };
        delay(column, rows);
        let leads = told(&pendulum(), &recording);
        let true_lead = sense * 2e-3 * rows as f64;
        assert!(
            matches!(&leads[..], [(None, lead)] if (lead / true_lead - 1.0).abs() < 0.2),
            "{seed}: {leads:?} for {true_lead}"
        );
    }
}

#[test]
fn a_late_torque_of_one_joint_is_told_with_the_joint() {
    let drive = Drive {
        pace: 1.0,
        position: 1e-5,
        torque: 1e-3,
        held: false,
    };
    // What sticks at the reversals of the geared arm makes a delay look shorter.
    for (file, j, late, shortest) in [
        ("one-link.toml", 0, 7.5e-3, 0.8),
        ("one-link.toml", 0, 20e-3, 0.8),
        ("edda.toml", 0, 7.5e-3, 0.9),
        ("edda.toml", 0, 20e-3, 0.9),
        ("edda.toml", 1, 7.5e-3, 0.9),
        ("edda.toml", 1, 20e-3, 0.9),
        ("irp6.toml", 0, 20e-3, 0.6),
    ] {
        let (robot, mut recording) = driven(shipped(file), 0, &drive);
        assert_eq!(told(&robot, &recording), [], "{file}");
        let period = recording.blocks[0].t[1] - recording.blocks[0].t[0];
        let tau = &mut recording.blocks[0].joints[j].tau;
        delay(tau, (late / period).round() as usize);
        let leads = told(&robot, &recording);
        let name = (robot.joints.len() > 1).then(|| robot.joints[j].name.clone());
        let near = |lead: f64| (shortest..1.1).contains(&(-lead / late));
        assert!(
            matches!(&leads[..], [(own, lead)] if *own == name && near(*lead)),
            "{file} {j}: {leads:?} for {late}"
        );
    }
}
