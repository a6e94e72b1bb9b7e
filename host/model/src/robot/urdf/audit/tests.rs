//! Faults put into a sound file, each of which one finding names.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use super::{Audit, audit};
use crate::robot::ChainChoice;

const SOUND: &str = "<robot name='r'>
<link name='base'/>
<link name='upper'>
<inertial><origin xyz='0 0 0.2'/><mass value='3'/><inertia ixx='0.05' ixy='0' ixz='0' iyy='0.05' iyz='0' izz='0.01'/></inertial>
<collision><origin xyz='0 0 0.2'/><geometry><cylinder radius='0.05' length='0.4'/></geometry></collision>
</link>
<link name='fore'>
<inertial><origin xyz='0.1 0 0'/><mass value='1.5'/><inertia ixx='0.002' ixy='0' ixz='0' iyy='0.011' iyz='0' izz='0.011'/></inertial>
<visual><origin xyz='0.15 0 0'/><geometry><box size='0.3 0.06 0.06'/></geometry></visual>
</link>
<joint name='one' type='revolute'><parent link='base'/><child link='upper'/><axis xyz='0 1 0'/>
<limit lower='-2' upper='2' velocity='3' effort='80'/></joint>
<joint name='two' type='continuous'><parent link='upper'/><child link='fore'/><origin xyz='0 0 0.4'/><axis xyz='0 1 0'/>
<limit velocity='3' effort='40'/></joint>
</robot>";

fn audited(text: &str) -> Audit {
    audit(text, Path::new("r.urdf"), &ChainChoice::default(), 1).unwrap()
}

#[test]
fn a_sound_file_has_no_finding() {
    let audit = audited(SOUND);
    assert_eq!((audit.findings, audit.unchecked), (Vec::new(), Vec::new()));
    assert!(
        audit.checks.iter().all(|check| check.count > 0),
        "{:?}",
        audit.checks
    );
}

#[test]
fn each_fault_is_found_at_its_line() {
    for (old, new, check, line, words) in [
        ("mass value='3'", "mass value='-3'", "mass", 4, "below zero"),
        (
            "mass value='3'",
            "mass value='3000'",
            "mass",
            4,
            "were this g, it would be 3",
        ),
        (
            "mass value='3'",
            "mass value='0.0003'",
            "mass",
            4,
            "placeholder",
        ),
        (
            "izz='0.01'/",
            "izz='0.2'/",
            "inertia",
            4,
            "above the sum of the others",
        ),
        (
            "ixx='0.05' ixy='0'",
            "ixx='0.05' ixy='0.06'",
            "inertia",
            4,
            "below zero",
        ),
        // Grams, and shapes in millimetres.
        (
            "mass value='1.5'",
            "mass value='1500'",
            "density",
            8,
            "were the mass in g",
        ),
        (
            "size='0.3 0.06 0.06'",
            "size='300 60 60'",
            "density",
            8,
            "were the shapes in mm",
        ),
        (
            "xyz='0.1 0 0'",
            "xyz='100 0 0'",
            "centre",
            8,
            "outside of its shapes",
        ),
        (
            "ixx='0.05' ixy='0' ixz='0' iyy='0.05' iyz='0' izz='0.01'",
            "ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'",
            "gyration",
            4,
            "larger than for any body",
        ),
        (
            "ixx='0.05' ixy='0' ixz='0' iyy='0.05' iyz='0' izz='0.01'",
            "ixx='1e-6' ixy='0' ixz='0' iyy='1e-6' iyz='0' izz='1e-6'",
            "gyration",
            4,
            "far smaller body",
        ),
        (
            "lower='-2' upper='2'",
            "lower='-120' upper='120'",
            "limit",
            12,
            "were these degrees",
        ),
        (
            "lower='-2' upper='2'",
            "lower='2' upper='-2'",
            "limit",
            12,
            "lower must be below upper",
        ),
        (
            "velocity='3' effort='80'",
            "velocity='0' effort='80'",
            "limit",
            12,
            "lets it not move",
        ),
        (
            "velocity='3' effort='40'",
            "velocity='3' effort='0'",
            "limit",
            14,
            "effort limit of 0",
        ),
        (
            "<link name='fore'>",
            "<link name='x'/><link name='fore'>",
            "no-mass",
            7,
            "has no mass",
        ),
    ] {
        let mut text = SOUND.replacen(old, new, 1);
        if check == "no-mass" {
            text = text.replace("</robot>", "<joint name='three' type='continuous'><parent link='fore'/><child link='x'/></joint></robot>");
        }
        assert_ne!(text, SOUND, "{old}");
        let found = audited(&text).findings;
        assert!(
            found.iter().any(|own| own.check == check
                && own.place.line == line
                && own.sentence.contains(words)),
            "{new}: {found:?}"
        );
    }
}

/// A planar arm of two links: 3 kg at 0.2 m and 1.5 kg at 0.5 m of the stretched arm.
#[test]
fn gravity_beyond_the_effort_limit_is_found() {
    let torque = 9.81 * (3.0 * 0.2 + 1.5 * 0.5);
    let needs = |limit: f64| {
        let text = SOUND
            .replacen("effort='80'", &format!("effort='{limit}'"), 1)
            .replacen("xyz='0.1 0 0'", "xyz='0 0 0.1'", 1);
        let found = audited(&text).findings.into_iter();
        found
            .filter(|own| own.check == "gravity")
            .collect::<Vec<_>>()
    };
    // The poses come within 1 % of the stretched arm, and never beyond it.
    assert_eq!(needs(torque), []);
    let found = needs(0.99 * torque);
    assert!(found.len() == 1 && found[0].name == "one", "{found:?}");
    assert_eq!(found[0].place.line, 11);
    assert!(
        found[0].sentence.contains("joint `one` needs up to 13.")
            && found[0].sentence.contains("N·m against gravity"),
        "{found:?}"
    );
}

/// A link of 1500 kg whose centre of mass lies 100 m away on joints that are 0.4 m apart; nothing of it is drawn.
#[test]
fn a_wrong_scale_is_found_without_shapes() {
    let bare = SOUND.replacen(
        "<visual><origin xyz='0.15 0 0'/><geometry><box size='0.3 0.06 0.06'/></geometry></visual>",
        "",
        1,
    );
    let found = |text: &str, check: &str| {
        let found = audited(text).findings.into_iter();
        let found = found.filter(|own| own.check == check && own.place.line == 8);
        found.map(|own| own.sentence).collect::<Vec<_>>()
    };
    assert_eq!(audited(&bare).findings, []);
    let far = bare.replacen("xyz='0.1 0 0'", "xyz='100 0 0'", 1);
    let told = found(&far, "scale");
    assert!(
        told.len() == 1
            && told[0].contains("centre of mass lies 100 m from its frame")
            && told[0].contains("were this mm, it would be 0.1"),
        "{told:?}"
    );
    let wide = bare.replacen(
        "ixx='0.002' ixy='0' ixz='0' iyy='0.011' iyz='0' izz='0.011'",
        "ixx='1e4' ixy='0' ixz='0' iyy='1e4' iyz='0' izz='1e4'",
        1,
    );
    let told = found(&wide, "scale");
    assert!(
        told.len() == 1 && told[0].contains("radius of gyration is 100 m"),
        "{told:?}"
    );
    let heavy = bare.replacen("mass value='1.5'", "mass value='1500'", 1);
    let told = audited(&heavy).findings;
    let joints: Vec<&str> = (told.iter().filter(|own| own.check == "gravity"))
        .map(|own| own.name.as_str())
        .collect();
    assert_eq!(joints, ["one", "two"], "{told:?}");
}

/// A body below zero behind a sound one: the matrix fails, and the joint is named.
#[test]
fn an_inertia_matrix_that_moves_nothing_is_found() {
    let text = SOUND.replacen("iyy='0.011'", "iyy='-0.5'", 1);
    let found = audited(&text).findings;
    let own = found
        .iter()
        .find(|own| own.check == "inertia-matrix")
        .unwrap();
    assert!(
        own.name == "two" && own.sentence.contains("200 of 200 poses"),
        "{own:?}"
    );
}

#[test]
fn placeholders_that_several_links_share_are_found() {
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>"
        )
    };
    let text = SOUND.replace("</robot>", &(link("p") + &link("q") + "<joint name='x' type='fixed'><parent link='base'/><child link='p'/></joint><joint name='y' type='fixed'><parent link='base'/><child link='q'/></joint></robot>"));
    let found = audited(&text).findings;
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0]
            .sentence
            .contains("links `p` and `q` have the same mass")
    );
}
