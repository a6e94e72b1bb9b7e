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
