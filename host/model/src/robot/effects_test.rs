#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use super::*;
use crate::robot::{ONE_LINK_TEMPLATE, Robot};

fn with(effect: &str) -> Result<Robot, String> {
    let text = format!("{ONE_LINK_TEMPLATE}\n[[effect]]\n{effect}\n");
    Robot::from_toml(&text, Path::new("robot.toml")).map_err(|e| e.to_string())
}

/// An effect with every parameter at the low end of its searched range.
fn smallest(kind: Kind) -> RobotEffect {
    let about = kind.about();
    let of = |list: &[Parameter]| list.iter().map(|p| p.range[0]).collect::<Vec<f64>>();
    RobotEffect {
        joint: Some("a".into()),
        other: has_other(kind).then(|| "b".into()),
        effect: Effect::new(kind, &of(about.gains), &of(about.shapes)),
    }
}

fn two_joints(kind: JointKind) -> Robot {
    let mut robot = with("kind = 'torque_offset'\noffset = 1").unwrap();
    robot.effects.clear();
    let mut second = robot.joints[0].clone();
    robot.joints[0].name = "a".into();
    second.name = "b".into();
    robot.joints[0].kind = kind;
    robot.joints.push(second);
    robot
}

#[test]
fn the_names_are_those_of_the_library() {
    let mut names: Vec<&str> = Kind::ALL.iter().map(|k| k.about().name).collect();
    names.dedup();
    assert_eq!(names, EFFECT_NAMES);
}

#[test]
fn every_effect_survives_writing_with_its_units_beside_it() {
    for joint in [JointKind::Revolute, JointKind::Prismatic] {
        for &kind in Kind::ALL {
            let mut robot = two_joints(joint);
            robot.effects = vec![smallest(kind)];
            let text = robot.to_toml().unwrap();
            let back = Robot::from_toml(&text, Path::new("x.toml")).unwrap();
            assert_eq!(back, robot, "{text}");
            for p in parameters(kind) {
                let line = text
                    .lines()
                    .find(|l| l.starts_with(&format!("{} =", p.name)) && l.ends_with(p.meaning));
                let unit = format!("# {}, ", unit_of(p, joint));
                assert!(line.is_some_and(|l| l.contains(&unit)), "{text}");
            }
            let placed = back.placed_effects()[0];
            assert_eq!(
                (placed.joint, placed.other),
                (0, has_other(kind).then_some(1))
            );
            let json = serde_json::to_string(&robot.effects[0]).unwrap();
            let read: RobotEffect = serde_json::from_str(&json).unwrap();
            assert_eq!(read, robot.effects[0]);
        }
    }
    let offset = &Kind::TorqueSaturation.about().gains[0];
    assert_eq!(unit_of(offset, JointKind::Prismatic), "1/N^2");
}

#[test]
fn faults_name_line_value_and_mend() {
    let lines = ONE_LINK_TEMPLATE.lines().count();
    // After the template, an empty line and the header.
    let first = lines + 3;
    for (effect, line, words) in [
        ("kind = 'stribek'", 0, &["stribek", "stribeck"][..]),
        ("joint = 'link'", -1, &["kind", "missing"]),
        ("kind = 3", 0, &["3", "in quotes"]),
        (
            "kind = 'stribeck'\nbreakaway = 0.1",
            -1,
            &["velocity", "missing", "above 0 and at most 10000, in rad/s"],
        ),
        (
            "kind = 'stribeck'\nbreakaway = 0.1\nvelocity = 0.0",
            2,
            &["velocity", "is 0", "above 0"],
        ),
        (
            "kind = 'stribeck'\nbreakaway = -0.1\nvelocity = 0.1",
            1,
            &["-0.1", "at least 0 and at most 1000000, in N*m"],
        ),
        (
            "kind = 'stribeck'\nbreakaway = nan\nvelocity = 0.1",
            1,
            &["nan", "at least 0"],
        ),
        (
            "kind = 'stribeck'\nbreakaway = 'much'\nvelocity = 0.1",
            1,
            &["much", "at least 0"],
        ),
        (
            "kind = 'payload'\nmass = 1e6\ndistance = 0.3",
            1,
            &["mass of effect 1", "1000000", "at most 10000, in kg"],
        ),
        (
            "kind = 'torque_ripple'\ncosine = 0\nsine = -7.5\norder = 6",
            2,
            &["sine", "-7.5", "at least -1 and at most 1"],
        ),
        (
            "kind = 'cogging'\ncosine = 0.1\nsine = 0\norder = 1e9",
            3,
            &["order", "at least 2 and at most 10000"],
        ),
        (
            "kind = 'joint_elasticity'\nstiffness = -900\ndamping = 0\nlink_friction = 0",
            1,
            &["stiffness", "-900", "above 0"],
        ),
        (
            "kind = 'load_friction'\ncoefficient = 0.1\nlink_friction = 1.5",
            2,
            &["link_friction", "1.5", "at least 0 and at most 1"],
        ),
        (
            "kind = 'load_friction'\ncoefficient = 1.5",
            1,
            &["1.5", "at least 0 and at most 1"],
        ),
        (
            "kind = 'spring'\nstiffness = 1\npreload = 0\nrest = 0.1",
            3,
            &["`rest`", "stiffness, preload"],
        ),
        (
            "kind = 'presliding'\ncoulomb = 0.1\nstroke = 0.01",
            -1,
            &["law", "missing", "dahl, lugre, maxwell"],
        ),
        (
            "kind = 'spring'\nlaw = 'hooke'\nstiffness = 1\npreload = 0",
            1,
            &["hooke", "one law only"],
        ),
        (
            "kind = 'torque_offset'\noffset = 1\njoint = 'lnik'",
            2,
            &["lnik", "link"],
        ),
        (
            "kind = 'inertia_coupling'\ninertia = 1\ncentripetal = 0\nviscous = 0",
            -1,
            &["other", "another joint"],
        ),
        (
            "kind = 'joint_elasticity'\nstiffness = 1000\ndamping = 1\nlink_friction = 0\n[[effect]]\nkind = 'backlash'\ngap = 0.01\nstiffness = 900\ndamping = 1\nlink_friction = 0",
            5,
            &[
                "backlash",
                "effect 2",
                "another effect between motor and link",
            ],
        ),
        (
            "kind = 'presliding'\nlaw = 'dahl'\ncoulomb = 0.1\nstroke = 0.01\n[[effect]]\nkind = 'presliding'\nlaw = 'dahl'\ncoulomb = 0.1\nstroke = 0.02",
            5,
            &["presliding", "effect 2", "another presliding"],
        ),
    ] {
        let message = with(effect).unwrap_err();
        let place = format!("robot.toml:{}:", first as i64 + line);
        assert!(
            message.starts_with(&place),
            "{effect}: {message}, expected {place}"
        );
        for word in words {
            assert!(message.contains(word), "{effect}: {message}");
        }
    }
}

#[test]
fn the_share_that_a_gear_carries_may_be_left_out() {
    let robot = with("kind = 'load_friction'\ncoefficient = 0.1").unwrap();
    let effect = robot.effects[0].effect;
    assert_eq!(effect, Effect::new(Kind::LoadFriction, &[0.1], &[0.0]));
    for kind in Kind::ALL {
        let shapes = kind.about().shapes;
        for name in kind.optional() {
            assert!(shapes.iter().any(|s| s.name == *name), "{kind:?} {name}");
        }
    }
}

#[test]
fn what_is_refused_is_far_from_what_rigs_have() {
    for p in Kind::ALL.iter().flat_map(|kind| parameters(*kind)) {
        let [low, high] = plausible_range(p);
        assert!(low >= p.bounds[0] && high <= p.bounds[1], "{p:?}");
        let far = if p.bounds[1].is_finite() { 1.0 } else { 4.0 };
        assert!(high >= far * p.range[1], "{p:?}");
    }
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let mut robot = two_joints(JointKind::Revolute);
    robot.effects = vec![smallest(Kind::Cogging)];
    robot.effects[0].effect.gains[1] = f64::NAN;
    let message = robot.to_toml().unwrap_err().to_string();
    assert!(
        message.contains("sine of effect 1") && message.contains("nan"),
        "{message}"
    );
    robot.effects = vec![smallest(Kind::Cogging)];
    robot.effects[0].joint = None;
    let message = robot.to_toml().unwrap_err().to_string();
    assert!(
        message.contains("joint of effect 1") && message.contains("a, b"),
        "{message}"
    );
}

/// Returns the documentation's table, made from the library.
fn table() -> String {
    let mut out = String::from(
        "| `kind` (`law`) | what | equation | parameters |\n| --- | --- | --- | --- |\n",
    );
    for kind in Kind::ALL {
        let about = kind.about();
        let law = about.law.map_or(String::new(), |l| format!(" (`{l}`)"));
        let list: Vec<String> = parameters(*kind)
            .map(|p| {
                let optional = kind.optional().contains(&p.name);
                let missing = if optional { " (0 where missing)" } else { "" };
                format!("`{}` {}: {}{missing}", p.name, p.unit, p.meaning)
            })
            .collect();
        let cells = [about.title, about.equation, &list.join("; ")]
            .map(|cell| cell.replace('|', "\\|").replace('*', "\\*"));
        let [title, equation, list] = cells;
        let _ = writeln!(
            out,
            "| `{}`{law} | {title} | {equation} | {list} |",
            about.name
        );
    }
    out
}

/// Updates the page instead if `RIG_WRITE_DOCS` is set.
#[test]
fn the_page_on_formats_has_every_effect_as_the_library_has_it() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once("<!-- effects: ").unwrap();
    let (mark, rest) = rest.split_once("-->\n").unwrap();
    let (found, after) = rest.split_once("<!-- end of effects -->").unwrap();
    let expected = table();
    if std::env::var_os("RIG_WRITE_DOCS").is_some() {
        let page =
            format!("{before}<!-- effects: {mark}-->\n{expected}<!-- end of effects -->{after}");
        std::fs::write(&path, page).unwrap();
    } else {
        assert_eq!(found, expected, "run this test with RIG_WRITE_DOCS=1");
    }
}
