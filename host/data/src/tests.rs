//! Tests of reading, writing and the messages about faulty recordings.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};

use super::made_for_tests::robot;
use super::*;
use rig_model::robot::{
    EMPS, IRP6_TEMPLATE, JointKind, JointLimits, ONE_LINK_TEMPLATE, Origin, Robot,
};

fn rig() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// A robot of `n` joints without drives and limits.
fn arm(n: usize) -> Robot {
    let names: Vec<String> = (1..=n).map(|k| format!("joint {k}")).collect();
    robot(&names.iter().map(String::as_str).collect::<Vec<_>>())
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    fn file(&self, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path("a.csv");
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn read(path: &Path, robot: &Robot) -> Result<(Vec<Block>, Vec<Warning>), DataError> {
    Source::open(path, robot)?.read_all()
}

#[test]
fn columns_find_their_joints_and_units() {
    let folder = Folder::new();
    let path = folder.file(
        "\u{feff}t, q1,i1 ,duty1,supply,temp1,note,pulses\r\n0,0.5,2,0.5,12,30,run,1\r\n0.001,0.25,-4,-1,12,31,,2\r\n\r\n",
    );
    let source = Source::open(&path, &rig()).unwrap();
    let (blocks, warnings) = source.read_all().unwrap();
    let [block] = blocks.as_slice() else {
        panic!("one block expected")
    };
    let joint = &block.joints[0];
    // 50 motor turns per joint turn at 0.05 N·m/A.
    assert_eq!(
        (&joint.q, &joint.tau),
        (&vec![0.5, 0.25], &vec![5.0, -10.0])
    );
    assert_eq!(
        (&joint.voltage, &joint.temperature),
        (&Some(vec![6.0, -12.0]), &Some(vec![30.0, 31.0]))
    );
    assert_eq!((block.first_line, block.continues), (2, false));
    let names: Vec<&str> = block.extra.iter().map(|(n, _)| n.as_str()).collect();
    assert_eq!(names, ["duty1", "supply", "note", "pulses"]);
    assert!(block.extra[2].1.iter().all(|v| v.is_nan()));
    assert_eq!(
        warnings,
        [Warning::ExtraNotANumber {
            place: Place::Line(2),
            column: "note".into()
        }]
    );
}

#[test]
fn an_encoder_on_the_link_has_a_column_of_its_own() {
    let folder = Folder::new();
    let path = folder.file("t,q1,ql1,tau1\n0,0.5,-0.25,1\n0.001,0.25,-0.5,2\n");
    let (blocks, warnings) = read(&path, &rig()).unwrap();
    let joint = &blocks[0].joints[0];
    assert_eq!(joint.q, [0.5, 0.25]);
    assert_eq!(joint.link.as_deref(), Some([-0.25, -0.5].as_slice()));
    assert!(blocks[0].extra.is_empty() && warnings.is_empty());

    for (text, words) in [
        ("t,q1,ql1,tau1\n0,0,0,0\n0.1,0,nan,0\n", "a.csv:3:"),
        ("t,q1,ql1,tau1\n0,0,0,0\n0.1,0,far,0\n", "`ql1`"),
        (
            "t,q1,ql2,tau1\n0,0,0,0\n0.1,0,0,0\n",
            "`ql2` belongs to joint 2",
        ),
    ] {
        let error = read(&folder.file(text), &rig()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_joint_without_columns_beside_others_may_be_one_that_never_moves() {
    let folder = Folder::new();
    let path = folder.file("t,q1,tau1\n0,0.5,1\n0.001,0.25,2\n");
    let mut robot = rig();
    let mut finger = robot.joints[0].clone();
    finger.name = "finger".into();
    robot.joints.push(finger);
    let message = read(&path, &robot).unwrap_err().to_string();
    assert!(
        message.contains("no column `q2` (position of joint `finger`")
            && message.contains("where joint `finger` never moves, record its constant position")
            && !message.contains("URDF"),
        "{message}"
    );
    robot.origin = Origin::Urdf;
    let message = read(&path, &robot).unwrap_err().to_string();
    assert!(
        message.contains("where joint `finger` never moves, make it type=\"fixed\" in the URDF"),
        "{message}"
    );
}

/// A ball screw has no gear ratio: positions of its joint in degrees are named as such, without one.
#[test]
fn positions_in_degrees_at_a_ball_screw_are_no_gear_ratio() {
    let folder = Folder::new();
    let robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    let rows: String = (0..500)
        .map(|k| {
            let t = 0.01 * f64::from(k);
            let s = (3.0 * t).sin();
            let q = [0.1 * s, -90.0 + 20.0 * s, 5.0 * s, 0.1 * s, 0.1 * s].map(|q| q.to_string());
            format!("{t},{},1,{s},{s},{s},{s}\n", q.join(","))
        })
        .collect();
    let path = folder.file(format!("t,q1,q2,q3,q4,q5,tau1,tau2,tau3,tau4,tau5\n{rows}"));
    let (blocks, _) = Source::open_with(&path, &robot, EffortNeed::Required)
        .unwrap()
        .read_all()
        .unwrap();
    let said: Vec<String> = (blocks.iter())
        .flat_map(|block| implausible_positions(block, &robot))
        .map(|fault| fault.to_string())
        .collect();
    let of_screw = said.iter().find(|text| text.starts_with("q2 ")).unwrap();
    assert!(
        of_screw.contains("degrees")
            && !of_screw.contains("gear ratio")
            && !of_screw.contains("inf"),
        "{of_screw}"
    );
}

#[test]
fn wrong_recordings_are_named_by_line_and_column() {
    let folder = Folder::new();
    let rows = "0,0,0\n0.1,0,0\n";
    let cases: Vec<(String, &str, &[&str])> = vec![
        (String::new(), "a.csv", &["is empty"]),
        ("\n\n".into(), "a.csv", &["is empty"]),
        ("t,q1,tau1\n".into(), "a.csv", &["no rows"]),
        (
            format!("row,q1,tau1\n{rows}"),
            "a.csv:1:",
            &["no column `t`", "`row`"],
        ),
        (
            format!("t;q1;tau1\n{rows}"),
            "a.csv:2:",
            &["1 fields", "separated by `;`"],
        ),
        (rows.into(), "a.csv:1:", &["no column `t`"]),
        (
            format!("t,q2,tau1\n{rows}"),
            "a.csv:1:",
            &["`q2` belongs to joint 2", "1 only"],
        ),
        (
            format!("t,q0,tau1\n{rows}"),
            "a.csv:1:",
            &["`q0` belongs to joint 0"],
        ),
        (
            format!("t,p1,tau1\n{rows}"),
            "a.csv:1:",
            &["no column `q1`", "`link`"],
        ),
        (
            format!("t,q1,u1\n{rows}"),
            "a.csv:1:",
            &["neither `tau1`", "nor `i1`"],
        ),
        (
            format!("t,q1,q1\n{rows}"),
            "a.csv:1:",
            &["`q1` is there twice"],
        ),
        (
            format!("t,q1,\n{rows}"),
            "a.csv:1:",
            &["column 3 has no name"],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,nan,0\n".into(),
            "a.csv:3:",
            &["column `q1` holds \"nan\""],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,0,inf\n".into(),
            "a.csv:3:",
            &["column `tau1` holds \"inf\""],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,0,abc\n".into(),
            "a.csv:3:",
            &["column `tau1` holds \"abc\""],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,,0\n".into(),
            "a.csv:3:",
            &["column `q1` holds nothing"],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,0\n".into(),
            "a.csv:3:",
            &["2 fields", "3 columns", "`tau1`"],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,0,0,0\n".into(),
            "a.csv:3:",
            &["4 fields", "3 columns"],
        ),
        (
            "t,q1,tau1\n0,0,0\n\n0.1,0,0\n".into(),
            "a.csv:3:",
            &["0 fields"],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,0,0\n0.05,0,0\n".into(),
            "a.csv:4:",
            &["jumps back from 0.1 to 0.05 s"],
        ),
        (
            "t,q1,tau1\n0,0,0\n0.1,0,0\n0.1,0,0.5\n".into(),
            "a.csv:4:",
            &["stands still", "no copy of it", "keep one row of each time"],
        ),
    ];
    for (text, place, parts) in cases {
        let message = read(&folder.file(&text), &rig()).unwrap_err().to_string();
        assert!(
            message.contains(place) && !message.contains('\n'),
            "{text}: {message}"
        );
        for part in parts {
            assert!(message.contains(part), "{text}: {message}");
        }
    }
    let message = read(&folder.file(format!("t,q1,i1\n{rows}")), &arm(1))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("`i1` is a motor current") && message.contains("no [joint.drive]"),
        "{message}"
    );
    assert!(matches!(
        read(folder.0.path(), &rig()),
        Err(DataError::Directory { .. })
    ));
    #[cfg(unix)]
    assert!(matches!(
        read(Path::new("/dev/null"), &rig()),
        Err(DataError::NotAFile { .. })
    ));
    assert!(matches!(
        read(&folder.path("none.csv"), &rig()),
        Err(DataError::Read { .. })
    ));
    assert!(matches!(
        read(&folder.file(b"\x7fELF\x02\x00\x00\n\x00"), &rig()),
        Err(DataError::NotText { line: 1, .. })
    ));
}

#[test]
fn files_without_line_ends_are_refused_unread() {
    let folder = Folder::new();
    let zeros = folder.path("zeros.csv");
    std::fs::File::create(&zeros)
        .unwrap()
        .set_len(2 << 30)
        .unwrap();
    assert!(matches!(
        Source::open(&zeros, &rig()),
        Err(DataError::NotText { line: 1, .. })
    ));
    let long = folder.file([b"t,q1,tau1\n".to_vec(), vec![b'1'; 3 << 20]].concat());
    assert!(matches!(
        Source::open(&long, &rig()),
        Err(DataError::LineTooLong { line: 2, .. })
    ));
}

/// 1 kHz rows; `missing` are left out.
fn sweep(rows: usize, missing: &[usize]) -> String {
    let mut text = String::from("t,q1,tau1,qd1,mark\n");
    for i in (0..rows).filter(|i| !missing.contains(i)) {
        let t = i as f64 * 1e-3;
        text += &format!("{t},{},{},{},{i}\n", t.sin(), 3.0 * t.cos(), t.cos());
    }
    text
}

#[test]
fn blocks_of_any_size_hold_the_same_rows_and_gaps() {
    let folder = Folder::new();
    let path = folder.file(sweep(
        3000,
        &[
            1500, 1501, 1502, 1503, 1504, 2000, 2001, 2002, 2003, 2004, 2005,
        ],
    ));
    let source = Source::open(&path, &rig()).unwrap();
    assert!(!source.sampling().irregular);
    assert!((source.sampling().period - 1e-3).abs() < 1e-12);
    let (whole, warnings) = source.read_all().unwrap();
    assert_eq!(
        whole.iter().map(Block::len).collect::<Vec<_>>(),
        [1500, 495, 994]
    );
    let lost: Vec<(u64, f64)> = warnings
        .iter()
        .map(|w| match w {
            Warning::Gap {
                place: Place::Line(line),
                lost,
                ..
            } => (*line, (lost * 1e6).round() / 1e6),
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(lost, [(1502, 0.005), (1997, 0.006)]);
    for size in [1, 7, 500, 1500, 2989] {
        let mut blocks = source.blocks(size);
        let mut joined: Vec<Block> = Vec::new();
        for block in blocks.by_ref() {
            let block = block.unwrap();
            assert!(!block.is_empty() && block.len() <= size);
            match joined.last_mut() {
                Some(last) if block.continues => {
                    last.t.extend(&block.t);
                    last.joints[0].q.extend(&block.joints[0].q);
                    last.joints[0].tau.extend(&block.joints[0].tau);
                    last.joints[0]
                        .qd
                        .as_mut()
                        .unwrap()
                        .extend(block.joints[0].qd.as_ref().unwrap());
                    last.extra[0].1.extend(&block.extra[0].1);
                }
                _ => joined.push(block),
            }
        }
        assert_eq!(blocks.gaps(), 2);
        assert_eq!(blocks.bytes_read(), source.bytes());
        assert!(joined == whole, "blocks of {size}");
    }
}

#[test]
fn irregular_recordings_are_flagged_not_split() {
    let folder = Folder::new();
    let mut text = String::from("t,q1,tau1\n");
    let mut t = 0.0;
    for i in 0..500 {
        text += &format!("{t},0,0\n");
        t += if i % 3 == 0 { 0.006 } else { 0.0035 };
    }
    let source = Source::open(&folder.file(text), &rig()).unwrap();
    assert!(source.sampling().irregular);
    let (blocks, warnings) = source.read_all().unwrap();
    assert_eq!((blocks.len(), warnings.len()), (1, 0));
}

/// A joint that swings, with stamps in whole milliseconds of a loop with this step and jitter (uniform, s); the rows of
/// `lost` are missing.
fn stamped_in_ms(step: f64, jitter: f64, lost: std::ops::Range<usize>) -> String {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
    let (mut now, mut text) = (0.0, "t,q1,tau1\n".to_owned());
    for row in 0..8000 {
        now += step + jitter * (2.0 * rng.random::<f64>() - 1.0);
        if !lost.contains(&row) {
            let (q, tau) = ((3.0f64 * now).sin(), 2.0 * (3.0f64 * now).cos());
            text += &format!("{:.3},{q},{tau}\n", now);
        }
    }
    text
}

#[test]
fn stamps_in_whole_milliseconds_hold_no_lost_rows() {
    let folder = Folder::new();
    for (step, jitter) in [
        (2e-3, 0.09e-3),
        (2e-3, 0.17e-3),
        (2e-3, 0.35e-3),
        (2.02e-3, 0.0),
        (2.002e-3, 0.0),
        (3.33e-3, 0.1e-3),
    ] {
        let path = folder.file(stamped_in_ms(step, jitter, 0..0));
        let source = Source::open(&path, &rig()).unwrap();
        let (blocks, _) = source.read_all().unwrap();
        assert_eq!(blocks.len(), 1, "{step} {jitter}: {:?}", source.sampling());
        assert_eq!(plausibility(&blocks[0], &rig()), [], "{step} {jitter}");
        assert!(blocks[0].t.windows(2).all(|t| t[1] > t[0]));
        // The motion is that of the corrected times: rounding alone leaves 0.29 ms at 3 rad/s.
        let off = (blocks[0].t.iter().zip(&blocks[0].joints[0].q))
            .map(|(t, q)| (q - (3.0 * t).sin()).powi(2))
            .sum::<f64>();
        let off = (off / blocks[0].t.len() as f64).sqrt();
        println!("{step} {jitter}: {off}");
        assert!(off < 0.58e-3, "{step} {jitter}: {off}");
    }
}

#[test]
fn a_gap_between_rounded_stamps_stays_one() {
    let folder = Folder::new();
    let path = folder.file(stamped_in_ms(2e-3, 0.1e-3, 4000..4020));
    let (blocks, _) = Source::open(&path, &rig()).unwrap().read_all().unwrap();
    let lengths: Vec<usize> = blocks.iter().map(Block::len).collect();
    assert_eq!(lengths, [4000, 3980]);
    assert!((blocks[1].t[0] - blocks[0].t[3999] - 0.042).abs() < 2e-3);
    let source = Source::open(&path, &rig()).unwrap();
    let small: Result<Vec<Block>, DataError> = source.blocks(7).collect();
    let times: Vec<f64> = small.unwrap().iter().flat_map(|b| b.t.clone()).collect();
    let whole: Vec<f64> = blocks.iter().flat_map(|b| b.t.clone()).collect();
    assert_eq!(times, whole);
}

fn columns() -> Vec<Column> {
    [
        ("t", "s"),
        ("q1", "rad"),
        ("tau1", "N*m"),
        ("odd \u{e9}", "1"),
    ]
    .map(|(n, u)| Column::new(n, u))
    .to_vec()
}

fn write(path: &Path, rows: &[[f64; 4]]) {
    let metadata = BTreeMap::from([("robot".to_owned(), "one-link rig".to_owned())]);
    let mut writer = RecordingWriter::create(path, &columns(), &metadata).unwrap();
    for row in rows {
        writer.push_row(row).unwrap();
    }
    assert!(
        !path.exists(),
        "the file must not be there before it is complete"
    );
    writer.finish().unwrap();
}

fn awkward_rows() -> Vec<[f64; 4]> {
    let mut rows = Vec::new();
    for i in 0..20_000_u32 {
        let t = f64::from(i) * 1e-3;
        rows.push([
            t,
            (t * 1.7).sin() / 3.0,
            1e-310 * t + (t * 0.3).exp() * 1e9,
            -t.powi(7),
        ]);
    }
    rows
}

#[test]
fn recordings_read_back_bit_for_bit_and_are_deterministic() {
    let folder = Folder::new();
    let rows = awkward_rows();
    for ending in ["csv", "mcap", "parquet"] {
        let (first, second) = (
            folder.path(&format!("1.{ending}")),
            folder.path(&format!("2.{ending}")),
        );
        write(&first, &rows);
        write(&second, &rows);
        assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap());
        let (blocks, warnings) = read(&first, &rig()).unwrap();
        assert_eq!((blocks.len(), warnings.len()), (1, 0));
        let block = &blocks[0];
        for (i, row) in rows.iter().enumerate() {
            let back = [
                block.t[i],
                block.joints[0].q[i],
                block.joints[0].tau[i],
                block.extra[0].1[i],
            ];
            assert_eq!(
                back.map(f64::to_bits),
                row.map(f64::to_bits),
                "{ending} row {i}"
            );
        }
    }
    // No other file remained in the folder.
    assert_eq!(std::fs::read_dir(folder.0.path()).unwrap().count(), 6);
}

#[test]
fn mcap_files_carry_what_other_players_look_for() {
    let folder = Folder::new();
    let path = folder.path("a.mcap");
    write(&path, &awkward_rows()[..100]);
    let bytes = std::fs::read(&path).unwrap();
    let summary = ::mcap::Summary::read(&bytes).unwrap().unwrap();
    let statistics = summary.stats.unwrap();
    assert_eq!(
        (statistics.message_count, statistics.channel_count),
        (100, 1)
    );
    assert_eq!(
        (statistics.message_start_time, statistics.message_end_time),
        (0, 99_000_000)
    );
    let channel = summary.channels.values().next().unwrap();
    assert_eq!(
        (channel.topic.as_str(), channel.message_encoding.as_str()),
        ("/joint/state", "json")
    );
    let schema = channel.schema.as_ref().unwrap();
    assert_eq!(schema.encoding, "jsonschema");
    let schema: serde_json::Value = serde_json::from_slice(&schema.data).unwrap();
    assert_eq!(schema["properties"]["tau1"]["description"], "N*m");
    for message in ::mcap::MessageStream::new(&bytes).unwrap() {
        let sample: serde_json::Value = serde_json::from_slice(&message.unwrap().data).unwrap();
        assert!(sample["q1"].is_number());
    }
}

#[test]
fn damaged_mcap_gets_a_sentence() {
    let folder = Folder::new();
    let path = folder.path("a.mcap");
    write(&path, &awkward_rows()[..2000]);
    let good = std::fs::read(&path).unwrap();
    let whole = read(&path, &rig()).unwrap().0;
    let read_bytes = |bytes: &[u8]| {
        let damaged = folder.path("b.mcap");
        std::fs::write(&damaged, bytes).unwrap();
        read(&damaged, &rig())
    };
    for cut in [6, 9, 100, 300] {
        let message = read_bytes(&good[..cut]).unwrap_err().to_string();
        assert!(
            message.contains("b.mcap") && !message.contains('\n'),
            "{cut}: {message}"
        );
    }
    // The part before the break is read, and the break is reported.
    let all = &whole[0];
    for cut in [good.len() / 3, good.len() / 2, good.len() - 1] {
        let (blocks, warnings) = read_bytes(&good[..cut]).unwrap();
        let block = &blocks[0];
        let rows = block.len();
        assert!(blocks.len() == 1 && rows > 100);
        assert_eq!(block.joints[0].q, all.joints[0].q[..rows]);
        let told = |w: &Warning| matches!(w, Warning::Reading { remark: Remark::CutOff { messages, until, .. } } if *messages == rows as u64 && *until == block.t[rows - 1]);
        assert!(warnings.iter().any(told), "{cut}: {warnings:?}");
    }
    for at in (8..good.len()).step_by(good.len() / 150) {
        let mut bytes = good.clone();
        bytes[at] ^= 0x20;
        match read_bytes(&bytes) {
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
            // Indices, padding and metadata are not data: then every sample must be right.
            Ok((blocks, _)) => assert!(
                blocks == whole,
                "a flipped bit at byte {at} changed the data unseen"
            ),
        }
    }
}

#[test]
fn writers_refuse_what_readers_would() {
    let folder = Folder::new();
    let none = BTreeMap::new();
    let create = |name: &str, columns: &[Column]| {
        RecordingWriter::create(&folder.path(name), columns, &none)
    };
    assert!(matches!(
        create("a.xlsx", &columns()),
        Err(DataError::UnknownFormat { .. })
    ));
    assert!(matches!(
        create("a.csv", &columns()[1..]),
        Err(DataError::Header { .. })
    ));
    assert!(matches!(
        create("none/a.csv", &columns()),
        Err(DataError::Write { .. })
    ));
    for name in ["a.csv", "a.mcap", "a.parquet"] {
        let mut writer = create(name, &columns()).unwrap();
        let message = writer
            .push_row(&[0.0, 1.0, f64::NAN, 0.0])
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("row 1") && message.contains("`tau1` is NaN"),
            "{message}"
        );
        assert!(writer.push_row(&[0.0, 1.0]).is_err());
        drop(writer);
    }
    assert_eq!(std::fs::read_dir(folder.0.path()).unwrap().count(), 0);
}

#[test]
fn wrong_units_are_named_and_right_ones_are_not() {
    let folder = Folder::new();
    let block = read(&folder.file(sweep(3000, &[])), &rig())
        .unwrap()
        .0
        .remove(0);
    assert_eq!(plausibility(&block, &rig()), []);
    let scaled = |change: &dyn Fn(&mut Block)| {
        let mut b = block.clone();
        change(&mut b);
        plausibility(&b, &rig())
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(" | ")
    };
    let all = |v: &mut Vec<f64>, f: f64| v.iter_mut().for_each(|x| *x *= f);
    assert!(
        scaled(&|b| all(&mut b.joints[0].q, 57.296))
            .contains("q1 looks like degrees (range 0 to 57")
    );
    // One pose has no range.
    let mut pose = block.clone();
    pose.joints[0].q.fill(-142.4433);
    let said = implausible_positions(&pose, &rig());
    let said = said.first().map_or(String::new(), ToString::to_string);
    assert!(
        said.starts_with("q1 looks like degrees (it is −142.443, while"),
        "{said}"
    );
    assert!(scaled(&|b| all(&mut b.joints[0].q, 1000.0)).contains("far outside"));
    assert!(
        scaled(&|b| all(b.joints[0].qd.as_mut().unwrap(), 57.296))
            .contains("do not belong together")
    );
    assert!(scaled(&|b| all(&mut b.joints[0].tau, 1000.0)).contains("tau1 looks too large"));
    assert!(scaled(&|b| all(&mut b.joints[0].tau, 1e-3)).contains("tau1 looks too small"));
    let referred = |factor: f64| {
        let mut b = block.clone();
        let reference = b.joints[0].q.iter().map(|q| factor * q).collect();
        b.joints[0].reference = Some(reference);
        assert_eq!(plausibility(&b, &rig()), []);
        let found = strange_references(&b, &rig());
        found.first().map_or(String::new(), ToString::to_string)
    };
    assert_eq!(referred(1.1), "");
    assert!(
        referred(57.296)
            .contains("ref1 does not belong to q1: it moves 57.296 times as far, as degrees would")
    );
    assert!(referred(-1.0).contains("it moves −1 times as far, the other way"));
    // A placeholder limit says nothing about the torque.
    let mut open = rig();
    open.joints[0].friction = None;
    open.joints[0].inertial = None;
    for (limit, found) in [(900.0, 1), (1e3, 0), (1e4, 0), (99999.0, 0), (3e6, 0)] {
        open.joints[0].limits.as_mut().unwrap().torque = Some(limit);
        let mut b = block.clone();
        let peak = b.joints[0].tau.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        all(&mut b.joints[0].tau, 0.1 / peak);
        assert_eq!(plausibility(&b, &open).len(), found, "{limit}");
        // If the link is described, no limit is compared with the torque; the models are compared later.
        let mut described = open.clone();
        described.joints[0].inertial = rig().joints[0].inertial.clone();
        assert_eq!(plausibility(&b, &described), [], "{limit}");
    }
    for (factor, unit) in [
        (1e3, "milliseconds"),
        (1e6, "microseconds"),
        (1e9, "nanoseconds"),
    ] {
        let message = scaled(&|b| all(&mut b.t, factor));
        assert!(
            message.contains(&format!("t looks like {unit}")),
            "{message}"
        );
    }
    assert!(scaled(&|b| all(&mut b.t, 1e-3)).contains("more than ten times its limit"));
}

fn real(folder: &Path, robot: &Robot, need: EffortNeed, rows: usize, irregular: Option<bool>) {
    let source = Source::open_with(folder, robot, need).unwrap();
    if let Some(irregular) = irregular {
        assert_eq!(
            source.sampling().irregular,
            irregular,
            "{}",
            folder.display()
        );
    }
    let (blocks, warnings) = source.read_all().unwrap();
    assert_eq!(
        (blocks.iter())
            .map(|block| block.len() - block.interpolated.len())
            .sum::<usize>(),
        rows,
        "{}",
        folder.display()
    );
    println!(
        "{}: {:?}, {} blocks, {warnings:?}",
        folder.display(),
        source.sampling(),
        blocks.len()
    );
    for block in &blocks {
        assert_eq!(plausibility(block, robot), [], "{}", folder.display());
    }
}

#[test]
fn real_recordings_are_accepted_without_false_alarm() {
    let Some(data) = rig_output::data_dir() else {
        println!("no real recordings here (set RIG_DATA): nothing read");
        return;
    };
    let emps = Robot::from_toml(EMPS, Path::new("emps.toml")).unwrap();
    assert_eq!(emps.joints[0].kind, JointKind::Prismatic);
    for file in ["emps/train.csv", "emps/test_pulses.csv"] {
        real(
            &data.join(file),
            &emps,
            EffortNeed::Required,
            24841,
            Some(false),
        );
    }
    // Millimetres and millinewtons trigger it.
    for factor in [1000.0, 1e-3] {
        let mut block = read(&data.join("emps/train.csv"), &emps)
            .unwrap()
            .0
            .remove(0);
        block.joints[0].tau.iter_mut().for_each(|v| *v *= factor);
        assert_eq!(plausibility(&block, &emps).len(), 1);
    }
    let kuka = Robot::load(&data.join("kuka_lwr4/kuka_lwr4.urdf")).unwrap();
    for run in 1..=3 {
        real(
            &data.join(format!("kuka_lwr4/run{run}.csv")),
            &kuka,
            EffortNeed::Required,
            5027,
            Some(false),
        );
    }
    for (file, rows) in [("train", 2996), ("test", 2997)] {
        real(
            &data.join(format!("dfki_double_pendulum/{file}.csv")),
            &arm(2),
            EffortNeed::Required,
            rows,
            Some(false),
        );
    }
    let mut servo = arm(1);
    servo.joints[0].limits = Some(JointLimits {
        position: [-3.2, 3.2],
        soft_position: None,
        velocity: 11.0,
        acceleration: None,
        torque: Some(0.6),
    });
    let mut count = 0;
    for entry in std::fs::read_dir(data.join("rhoban_xl330")).unwrap() {
        let path = entry.unwrap().path();
        let rows = std::fs::read_to_string(&path).unwrap().lines().count() - 1;
        assert!(matches!(
            Source::open(&path, &servo),
            Err(DataError::Header { .. })
        ));
        real(&path, &servo, EffortNeed::Optional, rows, Some(true));
        count += 1;
    }
    assert!(count > 0);
    // Motor positions in columns of their own: no `q1`, and the message says so.
    let tx40 = Robot::load(&data.join("staubli_tx40/tx40.urdf")).unwrap();
    let message = Source::open(&data.join("staubli_tx40/motor_1kHz.csv"), &tx40)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("no column `q1`") && message.contains("`qm1`"),
        "{message}"
    );
}

/// Prints the reading speed: `cargo test --release -p rig-data --lib reading_speed -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement, not a test"]
fn reading_speed() {
    let folder = Folder::new();
    for (joints, rows) in [(1, 2_000_000_usize), (6, 400_000)] {
        for ending in ["csv", "mcap", "parquet"] {
            let path = folder.path(&format!("s{joints}.{ending}"));
            let mut columns = vec![Column::new("t", "s")];
            for k in 1..=joints {
                columns.push(Column::new(&format!("q{k}"), "rad"));
                columns.push(Column::new(&format!("tau{k}"), "N*m"));
            }
            let mut writer = RecordingWriter::create(&path, &columns, &BTreeMap::new()).unwrap();
            let mut row = vec![0.0; columns.len()];
            for i in 0..rows {
                for (c, v) in row.iter_mut().enumerate() {
                    // Nine digits, as recorders write them.
                    *v = ((i as f64 * 1e-3 * (c as f64 + 0.1)).sin() * 1e8).round() / 1e8;
                }
                row[0] = (i as f64) / 1000.0;
                writer.push_row(&row).unwrap();
            }
            writer.finish().unwrap();
            let source = Source::open(&path, &arm(joints)).unwrap();
            let start = std::time::Instant::now();
            let read: usize = source.blocks(4096).map(|b| b.unwrap().len()).sum();
            let seconds = start.elapsed().as_secs_f64();
            assert_eq!(read, rows);
            println!(
                "{joints} joints {ending}: {:.0} MB/s, {:.2} million rows/s",
                source.bytes() as f64 / 1e6 / seconds,
                rows as f64 / 1e6 / seconds
            );
        }
    }
}
