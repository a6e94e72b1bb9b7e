//! Columns that the user names, and units, over files as other programs write them (`tests/recordings/make.py`).
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use super::made_for_tests::{of_others, robot};
use super::{Block, DataError, EffortNeed, Mapping, Source};
use rig_model::robot::{JointKind, Robot};

fn mapping(columns: &[&str], units: &[&str]) -> Mapping {
    let mut mapping = Mapping::default();
    columns
        .iter()
        .for_each(|entry| mapping.add_column(entry).unwrap());
    units
        .iter()
        .for_each(|entry| mapping.add_unit(entry).unwrap());
    mapping
}

fn read(
    path: &Path,
    robot: &Robot,
    mapping: &Mapping,
) -> Result<(Vec<Block>, Vec<String>), DataError> {
    let source = Source::open_mapped(path, robot, EffortNeed::Required, mapping)?;
    let (blocks, warnings) = source.read_all()?;
    Ok((blocks, warnings.iter().map(ToString::to_string).collect()))
}

fn of_text(text: &str, mapping: &Mapping) -> Result<(Vec<Block>, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    read(&path, &robot(&["link"]), mapping).map_err(|e| e.to_string())
}

/// Row `k` of the recordings: time, positions of elbow and shoulder.
fn truth(k: usize) -> (f64, [f64; 2]) {
    let t = 0.002 * k as f64;
    (t, [0.5 * (3.0 * t).sin(), 0.3 * (2.0 * t).cos()])
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-9, "{a} instead of {b}");
}

#[test]
fn the_same_motion_comes_out_of_names_units_and_clocks_of_other_loggers() {
    let mut plain = String::from("t,q1,tau1\n");
    let mut named = String::from("mode;Time [ms];Angle of joint [deg];Torque\n");
    let mut epoch = String::from("stamp,angle,q1,tau1\n");
    let mut dates = String::from("time,q1_deg,tau1\n");
    for k in 0..300u32 {
        let (t, [q, _]) = truth(k as usize);
        writeln!(plain, "{t},{q},{}", 2.0 * q).unwrap();
        let comma = |v: f64| v.to_string().replace('.', ",");
        writeln!(
            named,
            "1;{};{};{}",
            2 * k,
            comma(q.to_degrees()),
            comma(2000.0 * q)
        )
        .unwrap();
        let ns = 1_700_000_000_000_000_000 + 2_000_000 * u64::from(k);
        writeln!(epoch, "{ns},{q},17,{}", 2.0 * q).unwrap();
        writeln!(
            dates,
            "2026-03-01T23:59:{:06.3}Z,{},{}",
            59.0 + t.min(0.5),
            q.to_degrees(),
            2.0 * q
        )
        .unwrap();
    }
    let (want, _) = of_text(&plain, &Mapping::default()).unwrap();
    let logs = [
        (
            named,
            mapping(&["q1=Angle of joint [deg]", "tau1=Torque"], &["tau1=mNm"]),
            300,
            ["column `Time [ms]`", "converted from deg"],
        ),
        (
            epoch,
            mapping(&["q1=angle"], &["t=ns"]),
            300,
            ["column `stamp`", "counted from the first row"],
        ),
        (
            dates,
            Mapping::default(),
            251,
            ["column `q1_deg`", "ISO 8601"],
        ),
    ];
    for (text, mapping, rows, words) in logs {
        // The time of the last log stops growing after half a second.
        let text: String = text.split_inclusive('\n').take(rows + 1).collect();
        let (blocks, warnings) = of_text(&text, &mapping).unwrap();
        assert_eq!(blocks[0].len(), rows, "{warnings:?}");
        for word in words {
            assert!(
                warnings.iter().any(|w| w.contains(word)),
                "{word}: {warnings:?}"
            );
        }
        let start = blocks[0].t[0];
        for k in 0..rows {
            // Nanoseconds since 1970 are 256 ns apart as doubles.
            assert!((blocks[0].t[k] - start - want[0].t[k]).abs() < 3e-7);
            near(blocks[0].joints[0].q[k], want[0].joints[0].q[k]);
            near(blocks[0].joints[0].tau[k], want[0].joints[0].tau[k]);
        }
    }
}

#[test]
fn a_mapping_that_does_not_fit_is_refused_with_what_is_there() {
    let text = "t,a,b\n0,1,2\n1,1,2\n";
    for (columns, units, words) in [
        (
            vec!["q1=c"],
            vec![],
            "has no column `c`, which is to be `q1`; its columns are `t`, `a`, `b`",
        ),
        (
            vec!["q1=a", "tau1=b"],
            vec!["i=A"],
            "has no column `i`, whose unit is given",
        ),
    ] {
        let error = of_text(text, &mapping(&columns, &units)).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
    let mut own = Mapping::default();
    for (entry, words) in [
        ("q1", "is not of the form"),
        ("p1=a", "`p1` is no column"),
        ("q0=a", "`q0` is no column"),
    ] {
        let error = own.add_column(entry).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
    own.add_column("q1=a").unwrap();
    assert!(own.add_column("q1=b").unwrap_err().contains("mapped twice"));
    assert!(
        own.add_column("q2=a")
            .unwrap_err()
            .contains("to `q1` and to `q2`")
    );
    for (entry, words) in [
        ("q=ms", "cannot be in ms, which is a unit of time"),
        ("q=grad", "`grad` is no unit"),
        ("speed=rpm", "is no column"),
    ] {
        let error = own.add_unit(entry).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_file_holds_a_mapping_and_errors_name_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    std::fs::write(
        &path,
        "[columns]\nq1 = \"a\"\ntau1 = \"b\"\n\n[units]\nq = \"deg\"\n",
    )
    .unwrap();
    let mut own = Mapping::default();
    own.add_file(&path).unwrap();
    assert_eq!(own, mapping(&["q1=a", "tau1=b"], &["q=deg"]));
    for (text, words) in [
        ("[columns]\nq1 = \n", "line 2: "),
        ("[colums]\nq1 = \"a\"\n", "unknown field `colums`"),
        (
            "[columns]\nq1 = 1\n",
            "`q1` must be text in quotation marks",
        ),
        ("[units]\nq = \"grad\"\n", "`grad` is no unit"),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = Mapping::default().add_file(&path).unwrap_err().to_string();
        assert!(
            error.contains(words) && error.contains("map.toml"),
            "{error}"
        );
    }
}

#[test]
fn bags_of_rosbag2_are_read_whole_or_in_parts() {
    let robot = robot(&["shoulder", "elbow"]);
    for name in [
        "bag_mcap",
        "bag_split",
        "bag_sqlite",
        "bag_old",
        "bag_old/bag_old.db3",
    ] {
        let (blocks, warnings) = read(&of_others(name), &robot, &Mapping::default()).unwrap();
        // Bags of older versions hold no definitions.
        let is_assumed = warnings.iter().any(|w| w.contains("the standard one"));
        assert_eq!(is_assumed, name.contains("old"), "{name}: {warnings:?}");
        assert_eq!(blocks.len(), 1, "{name}: {warnings:?}");
        assert_eq!(blocks[0].len(), 200);
        for k in 0..200 {
            let (t, [elbow, shoulder]) = truth(k);
            near(blocks[0].t[k], t);
            near(blocks[0].joints[0].q[k], shoulder);
            near(blocks[0].joints[1].q[k], elbow);
        }
        assert!(blocks[0].extra.is_empty());
    }
    let folder = tempfile::tempdir().unwrap();
    let error = read(folder.path(), &robot, &Mapping::default()).unwrap_err();
    assert!(
        error.to_string().contains("without metadata.yaml"),
        "{error}"
    );
    std::fs::write(
        folder.path().join("metadata.yaml"),
        "relative_file_paths:\n  - a.mcap\n",
    )
    .unwrap();
    let error = read(folder.path(), &robot, &Mapping::default()).unwrap_err();
    assert!(error.to_string().contains("lists a.mcap"), "{error}");
}

/// The wrist sensor has a rate and a clock of its own: 100 Hz, 1 ms later. Its force along x is 10 t, its moment about z 5 t.
#[test]
fn a_wrist_sensor_is_interpolated_to_the_times_of_the_joints() {
    let robot = robot(&["shoulder", "elbow"]);
    let by_type = Mapping::default().with_wrench();
    let by_name = mapping(
        &[
            "q1=joint_states/position/shoulder",
            "q2=/joint_states/position/elbow",
            "tau1=joint_states/effort/shoulder",
            "tau2=joint_states/effort/elbow",
            "fx=ft_sensor/wrench/wrench/force/x",
            "mz=ft_sensor/wrench/wrench/torque/z",
        ],
        &[],
    );
    for (mapping, name) in [
        (&by_type, "bag_mcap"),
        (&by_type, "bag_split"),
        (&by_type, "bag_sqlite"),
        (&by_type, "bag_old"),
        (&by_name, "bag_mcap"),
    ] {
        let (blocks, warnings) = read(&of_others(name), &robot, mapping).unwrap();
        let words = [
            "from topic /ft_sensor/wrench (100 Hz)",
            "5 rows are left out",
        ];
        for word in words {
            assert!(
                warnings.iter().any(|w| w.contains(word)),
                "{word}: {warnings:?}"
            );
        }
        let rows: usize = blocks.iter().map(Block::len).sum();
        // The sensor begins 1 ms behind row 0 and ends 1 ms behind row 195, so that row 0 and 196 to 199 lie outside.
        assert_eq!(rows, 195);
        for block in &blocks {
            let column = |name: &str| {
                let found = block.extra.iter().find(|(own, _)| own == name);
                &found.unwrap_or_else(|| panic!("no {name}")).1
            };
            for k in 0..block.len() {
                near(column("fx")[k], 10.0 * (block.t[k]));
                near(column("mz")[k], 5.0 * (block.t[k]));
                let message = (block.t[k] - 0.001) / 0.01 + 1.5;
                near(column("wrench_message")[k], message);
                let row = (block.t[k] / 0.002).round() as usize;
                near(block.joints[0].q[k], truth(row).1[1]);
            }
        }
    }
}

#[test]
fn json_of_another_program_is_mapped_by_channel() {
    let own = mapping(
        &[
            "q1=arm/telemetry/joints/positionDeg/elbow",
            "tau1=arm/telemetry/joints/torque/elbow",
        ],
        &["q=deg"],
    );
    let (blocks, warnings) = read(&of_others("other.mcap"), &robot(&["link"]), &own).unwrap();
    assert_eq!(blocks[0].len(), 200, "{warnings:?}");
    for k in 0..200 {
        let (t, [elbow, _]) = truth(k);
        near(blocks[0].t[k], t);
        near(blocks[0].joints[0].q[k], elbow);
        near(blocks[0].joints[0].tau[k], 2.0 * elbow);
    }
    let own = mapping(&["q1=arm/telemetry/joints/position/elbow"], &[]);
    let error = read(&of_others("other.mcap"), &robot(&["link"]), &own).unwrap_err();
    let error = error.to_string();
    assert!(
        error.contains("rig inspect") && error.contains("/arm/telemetry"),
        "{error}"
    );
}

#[test]
fn chunks_in_another_order_are_sorted_by_their_time() {
    let path = of_others("shuffled.mcap");
    let (blocks, warnings) = read(&path, &robot(&["link"]), &Mapping::default()).unwrap();
    assert_eq!((blocks.len(), blocks[0].len()), (1, 200), "{warnings:?}");
    for k in 0..200 {
        let (t, [elbow, _]) = truth(k);
        near(blocks[0].t[k], t);
        near(blocks[0].joints[0].q[k], elbow);
    }
}

/// NumPy and SciPy wrote `t` (200), `q` (200 × 2) and `tau` (200 × 2, single precision).
#[test]
fn arrays_of_numpy_and_matlab_are_columns() {
    let robot = robot(&["elbow", "shoulder"]);
    for name in [
        "arrays.npz",
        "compressed.npz",
        "arrays.mat",
        "arrays_73.mat",
    ] {
        let (blocks, warnings) = read(&of_others(name), &robot, &Mapping::default()).unwrap();
        assert_eq!(
            (blocks.len(), blocks[0].len()),
            (1, 200),
            "{name}: {warnings:?}"
        );
        for k in 0..200 {
            let (t, [elbow, shoulder]) = truth(k);
            near(blocks[0].t[k], t);
            near(blocks[0].joints[0].q[k], elbow);
            near(blocks[0].joints[1].q[k], shoulder);
            assert!((blocks[0].joints[1].tau[k] + 4.0 * shoulder).abs() < 1e-6);
        }
    }
    // In a structure and lying; a scalar beside it is no column. Cut off it is named.
    for name in ["structure.mat", "structure_73.mat"] {
        let (blocks, warnings) = read(&of_others(name), &robot, &Mapping::default()).unwrap();
        assert_eq!(blocks[0].len(), 200);
        near(blocks[0].joints[1].q[199], truth(199).1[1]);
        assert!(
            warnings
                .iter()
                .any(|w| w.contains("rate (1 × 1)") && w.contains("note")),
            "{warnings:?}"
        );
    }
    // They are named as well where a column is missing.
    let three = crate::made_for_tests::robot(&["elbow", "shoulder", "wrist"]);
    for (robot, mapping) in [
        (&three, Mapping::default()),
        (&robot, mapping(&["tau1=x"], &[])),
    ] {
        let error = read(&of_others("structure.mat"), robot, &mapping).unwrap_err();
        assert!(
            error.to_string().contains("no columns: rate (1 × 1)"),
            "{error}"
        );
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["arrays.npz", "arrays.mat", "arrays_73.mat"] {
        let path = folder.path().join(name);
        let bytes = std::fs::read(of_others(name)).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 700]).unwrap();
        let error = read(&path, &robot, &Mapping::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("cut off or damaged"), "{error}");
    }
}

/// hdf5storage wrote the file. A damage is an error, or numbers that still are columns; no cut leaves numbers out silently.
#[test]
fn damaged_files_of_matlab_73_are_errors() {
    let robot = robot(&["elbow", "shoulder"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mat");
    let bytes = std::fs::read(of_others("arrays_73.mat")).unwrap();
    let read_back = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        read(&path, &robot, &Mapping::default())
    };
    for length in (0..bytes.len()).step_by(101) {
        match read_back(&bytes[..length]) {
            Ok((blocks, _)) => near(blocks[0].joints[1].q[199], truth(199).1[1]),
            Err(error) => assert!(
                length < 20 || error.to_string().contains("log.mat"),
                "{error}"
            ),
        }
    }
    let mut refused = 0;
    for at in (512..bytes.len()).step_by(13) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        if let Err(error) = read_back(&damaged) {
            assert!(error.to_string().contains("log.mat"), "{error}");
            refused += 1;
        }
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn a_unit_must_be_one_of_the_joints_motion() {
    let text = "t,q1,qd1,tau1\n0,1,2,3\n0.001,1,2,3\n0.002,1,2,3\n";
    for (unit, fitting) in [
        ("q=mm", "rad, mrad"),
        ("qd1=mm/s", "rpm"),
        ("tau=kN", "mNm"),
    ] {
        let error = of_text(text, &mapping(&[], &[unit])).unwrap_err();
        assert!(
            error.contains("is revolute") && error.contains(fitting),
            "{error}"
        );
    }
    for unit in ["q=deg", "qd1=rpm", "tau=mNm"] {
        assert!(of_text(text, &mapping(&[], &[unit])).is_ok(), "{unit}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    let mut sliding = robot(&["carriage"]);
    sliding.joints[0].kind = JointKind::Prismatic;
    assert!(read(&path, &sliding, &mapping(&[], &["q=mm"])).is_ok());
    let error = read(&path, &sliding, &mapping(&[], &["q=deg"])).unwrap_err();
    assert!(error.to_string().contains("is prismatic"), "{error}");
}

#[test]
fn units_before_the_number_of_a_column_count_and_names_of_joints_do_not() {
    let text = "t,q_deg1,tau_mNm_1\n0,180,3000\n0.001,90,2000\n0.002,0,1000\n";
    let (blocks, _) = of_text(text, &mapping(&["q1=q_deg1", "tau1=tau_mNm_1"], &[])).unwrap();
    near(blocks[0].joints[0].q[0], std::f64::consts::PI);
    near(blocks[0].joints[0].tau[0], 3.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, "t,wrist_turn,torque\n0,1,2\n0.001,2,2\n0.002,3,2\n").unwrap();
    let columns = mapping(&["q1=wrist_turn", "tau1=torque"], &[]);
    let (blocks, warnings) = read(&path, &robot(&["wrist_turn"]), &columns).unwrap();
    assert_eq!(blocks[0].joints[0].q, [1.0, 2.0, 3.0], "{warnings:?}");
}

/// A column of no joint that must hold numbers, and a recording without a column of time whose rows may be poses.
#[test]
fn a_wanted_number_is_refused_by_its_line_and_poses_need_no_clock() {
    let text = "t,q1,tau1,temp\n0,0.1,1,25\n0.1,0.2,1,nan\n";
    assert!(of_text(text, &Mapping::default()).is_ok());
    let wants = Mapping::default().with_wrench().with_numbers("temp");
    let said = of_text(text, &wants).unwrap_err();
    assert!(
        said.contains("log.csv:3: column `temp` holds \"nan\""),
        "{said}"
    );
    let said = of_text("q1,tau1\n0.1,1\n", &wants).unwrap_err();
    assert!(
        said.contains("no column `t`") && said.contains("any number that rises"),
        "{said}"
    );
    let said = of_text("q1,tau1\n0.1,1\n", &Mapping::default()).unwrap_err();
    assert!(!said.contains("any number that rises"), "{said}");
}
