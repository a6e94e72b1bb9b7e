#![allow(clippy::unwrap_used)]
use super::*;

/// Equal seeds give equal cases; other seeds give other faults.
#[test]
fn cases_are_of_their_seed() {
    let [once, again, other] =
        [(3, 1), (3, 1), (4, 1)].map(|(first, n)| arm_cases(first, n).unwrap());
    assert_eq!(once, again);
    let faults = |cases: &[ArmCase]| -> Vec<_> { cases.iter().map(|c| c.scenario.fault).collect() };
    assert_ne!(faults(&once), faults(&other));
    assert_eq!(
        once.iter().filter(|c| c.scenario.fault.is_none()).count(),
        3
    );
    assert!(ArmScenario::drawn(Arm::Planar, Some("gear_eccentricities"), 1).is_err());
}

#[test]
fn a_name_counts_on_its_own_joint_alone() {
    let said = |fault: &'static str, named: &[(&str, &str)], verdict, size: f64| ArmOutcome {
        arm: "six",
        seed: 1,
        hidden: Some((fault, "joint_2".into())),
        fault: String::new(),
        size: Some(size),
        named: (named.iter())
            .map(|(e, j)| ((*e).into(), (*j).into()))
            .collect(),
        verdict: Some(verdict),
        gap_closed: Some(0.9),
        motion: Some(0.5),
        failure: None,
        calls_for: Some(match fault {
            "viscous_coupling" => CallsFor::Remainder,
            "payload" => CallsFor::ParameterChange,
            _ => CallsFor::Name,
        }),
    };
    let explained = Verdict::Explained;
    let outcomes = [
        said("stribeck", &[("stribeck", "joint_2")], explained, 2.0),
        said("stribeck", &[("stribeck", "joint_3")], explained, 2.0),
        said("stribeck", &[], Verdict::NothingMissing, 0.2),
        said(
            "gravity_tilt",
            &[("gravity_tilt", "joint_1")],
            explained,
            3.0,
        ),
        said("viscous_coupling", &[], Verdict::Remainder, 3.0),
        said("viscous_coupling", &[("spring", "joint_2")], explained, 3.0),
        said(
            "payload",
            &[("payload", "joint_6")],
            Verdict::ParameterChange,
            3.0,
        ),
    ];
    let table = arm_table(&outcomes);
    let cell = |row: &str| -> String {
        let line = table.lines().find(|l| l.contains(row)).unwrap();
        line.split('|').nth(5).unwrap().trim().to_owned()
    };
    assert!(cell("right name and joint").starts_with("2/3"), "{table}");
    assert!(cell("exactly that name").starts_with("2/3"), "{table}");
    assert!(cell("a wrong name, below").starts_with("0/1"), "{table}");
    assert!(cell("wrong values").starts_with("1/1"), "{table}");
    assert!(
        cell("a name and no remainder").starts_with("1/2"),
        "{table}"
    );
    assert!(cell("library: a remainder").starts_with("1/2"), "{table}");
    assert_eq!(cell("gap closed"), "90.0 %");
    assert_eq!(cell("simulated motion"), "50.0 %");
    assert_eq!(cell("failed"), "0");
}
