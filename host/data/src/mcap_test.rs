//! MCAP as recorders write it.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::io::Write as _;
use std::path::Path;

use super::contents::contents;
use super::made_for_tests::robot;
use super::{Block, EffortNeed, Mapping, Quantity, Source};
use rig_model::robot::Robot;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn record(code: u8, body: &[u8]) -> Vec<u8> {
    [&[code], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
}

fn text(s: &str) -> Vec<u8> {
    [&(s.len() as u32).to_le_bytes(), s.as_bytes()].concat()
}

fn schema(id: u16, name: &str, encoding: &str, definition: &str) -> Vec<u8> {
    let parts = [text(name), text(encoding), text(definition)].concat();
    record(3, &[&id.to_le_bytes(), parts.as_slice()].concat())
}

fn channel(id: u16, schema: u16, topic: &str, encoding: &str) -> Vec<u8> {
    let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
    let no_metadata = 0u32.to_le_bytes().to_vec();
    record(4, &[ids, text(topic), text(encoding), no_metadata].concat())
}

fn message(channel: u16, nanoseconds: u64, data: &[u8]) -> Vec<u8> {
    let mut body = channel.to_le_bytes().to_vec();
    body.extend(0u32.to_le_bytes());
    body.extend(nanoseconds.to_le_bytes());
    body.extend(nanoseconds.to_le_bytes());
    body.extend(data);
    record(5, &body)
}

/// A chunk of these records.
fn chunk(compression: &str, records: &[u8]) -> Vec<u8> {
    let packed = match compression {
        "zstd" => {
            ruzstd::encoding::compress_to_vec(records, ruzstd::encoding::CompressionLevel::Fastest)
        }
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(records).unwrap();
            encoder.finish().unwrap()
        }
        _ => records.to_vec(),
    };
    let mut body = [0u64, 1].map(u64::to_le_bytes).concat();
    body.extend((records.len() as u64).to_le_bytes());
    body.extend(crc32fast::hash(records).to_le_bytes());
    body.extend(text(compression));
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    record(6, &body)
}

fn start(records: &[u8]) -> Vec<u8> {
    let header = record(1, &[text(""), text("test")].concat());
    [MAGIC, &header, records].concat()
}

fn whole(records: &[u8]) -> Vec<u8> {
    let end = [record(15, &[0; 4]), record(2, &[0; 20])].concat();
    [&start(records), end.as_slice(), MAGIC].concat()
}

/// Channel 1 with JSON samples.
fn json_channel() -> Vec<u8> {
    channel(1, 0, "/joint/state", "json")
}

/// Samples of one joint, `count` of them from number `first`.
fn json(first: u64, count: u64) -> Vec<u8> {
    let sample = |k: u64| {
        let data = format!(
            "{{\"t\":{},\"q1\":{},\"tau1\":1.5}}",
            k as f64 * 0.001,
            k % 7
        );
        message(1, k * 1_000_000, data.as_bytes())
    };
    (first..first + count).flat_map(sample).collect()
}

fn read_with(bytes: &[u8], robot: &Robot) -> Result<(Vec<Block>, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    // Files are detected by their content.
    let path = folder.path().join("a.bag");
    std::fs::write(&path, bytes).unwrap();
    let source = Source::open(&path, robot).map_err(|e| e.to_string())?;
    let (blocks, warnings) = source.read_all().map_err(|e| e.to_string())?;
    Ok((blocks, warnings.iter().map(ToString::to_string).collect()))
}

fn read(bytes: &[u8]) -> Result<(Vec<Block>, Vec<String>), String> {
    read_with(bytes, &robot(&["link"]))
}

/// Asserts that a file is refused with a one-line message that contains these words.
fn refused(result: Result<(Vec<Block>, Vec<String>), String>, words: &[&str]) {
    let message = match result {
        Err(message) => message,
        Ok((_, remarks)) => panic!("read, with {remarks:?}, instead of {words:?}"),
    };
    assert!(!message.contains('\n'), "{message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

#[test]
fn chunks_are_read_whatever_they_are_compressed_by() {
    let plain = [json_channel(), json(0, 3000)].concat();
    let want = read(&whole(&plain)).unwrap();
    assert_eq!(want.0[0].len(), 3000);
    assert!(want.1.is_empty());
    for compression in ["", "zstd", "lz4"] {
        let records = [
            chunk(compression, &[json_channel(), json(0, 1000)].concat()),
            chunk(compression, &json(1000, 1999)),
            chunk(compression, &json(2999, 1)),
            chunk(compression, &[]),
        ];
        assert_eq!(
            read(&whole(&records.concat())).unwrap(),
            want,
            "{compression}"
        );
    }
    refused(
        read(&whole(&chunk("br", &plain))),
        &["compressed by \"br\"", "zstd or lz4", "byte "],
    );
}

#[test]
fn a_damaged_chunk_is_named_by_its_byte() {
    for compression in ["", "zstd", "lz4"] {
        let first = chunk(compression, &[json_channel(), json(0, 500)].concat());
        let second = chunk(compression, &json(500, 500));
        let mut bytes = whole(&[first.as_slice(), &second].concat());
        let at = start(&first).len();
        bytes[at + second.len() / 2] ^= 0x40;
        refused(
            read(&bytes),
            &["a.bag", &format!(" at byte {at}: "), "chunk"],
        );
    }
    let mut bytes = whole(&chunk("", &[json_channel(), json(0, 500)].concat()));
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    refused(read(&bytes), &["the chunk's check sum is wrong at byte"]);
}

#[test]
fn a_file_that_breaks_off_is_read_up_to_there() {
    for compression in ["", "zstd", "lz4"] {
        let records = [
            chunk(compression, &[json_channel(), json(0, 1000)].concat()),
            chunk(compression, &json(1000, 1000)),
        ];
        let bytes = start(&records.concat());
        let one = start(&records[0]).len();
        // Cut at the end of a chunk, in the header of one, in its middle, after the last one, and followed by zeros.
        let cuts = [
            (bytes[..one].to_vec(), 1000..=1000),
            (bytes[..one + 20].to_vec(), 1000..=1000),
            (bytes[..(one + bytes.len()) / 2].to_vec(), 1000..=1999),
            (bytes.clone(), 2000..=2000),
            ([bytes.clone(), vec![0; 4096]].concat(), 2000..=2000),
        ];
        for (k, (cut, rows)) in cuts.into_iter().enumerate() {
            let (blocks, warnings) = read(&cut).unwrap();
            let found = blocks[0].len();
            assert!(rows.contains(&found), "{compression} {k}: {found}");
            let last = format!(
                "{found} messages are read, the last at t = {} s",
                (found - 1) as f64 / 1000.0
            );
            assert!(
                warnings.len() == 1
                    && warnings[0].contains(&last)
                    && warnings[0].contains("samples are lost"),
                "{compression} {k}: {warnings:?}"
            );
        }
    }
    // Nearly all data of an uncompressed chunk can be read.
    let records = chunk("", &[json_channel(), json(0, 1000)].concat());
    let bytes = start(&records);
    let (blocks, _) = read(&bytes[..bytes.len() - 100]).unwrap();
    assert!(blocks[0].len() >= 995);
    // Messages outside chunks too; if only the index is missing, the data are complete.
    let plain = [json_channel(), json(0, 50)].concat();
    let bytes = start(&plain);
    assert_eq!(read(&bytes[..bytes.len() - 5]).unwrap().0[0].len(), 49);
    let data_end = [bytes.clone(), record(15, &[0; 4])].concat();
    assert!(read(&data_end).unwrap().1[0].contains("only the index"));
    // An empty file, and a hole in a file with a proper end, are damage.
    refused(
        read(&start(&json_channel())),
        &["breaks off at byte", "first sample"],
    );
    let hole = [start(&plain), vec![0; 100], MAGIC.to_vec()].concat();
    refused(read(&hole), &["no record begins at byte"]);
}

#[test]
fn a_message_unlike_the_first_is_named() {
    let with = |data: &str| {
        let message = message(1, 100_000_000, data.as_bytes());
        read(&whole(&[json_channel(), json(0, 20), message].concat()))
    };
    for (data, words) in [
        (
            r#"{"t":0.1,"q1":NaN,"tau1":1}"#,
            ["message 21", "column `q1` holds NaN"],
        ),
        (
            r#"{"t":0.1,"q1":0,"tau1":-Infinity}"#,
            ["message 21", "`tau1` holds -Infinity"],
        ),
        (
            r#"{"t":0.1,"q1":0,"tau1":null}"#,
            ["message 21", "`tau1` holds null"],
        ),
        (
            r#"{"t":0.1,"q1":"0,5","tau1":1}"#,
            ["message 21", "`q1` holds \"0,5\""],
        ),
        (
            r#"{"t":0.1,"q1":0}"#,
            ["message 21 on /joint/state", "has no key `tau1`"],
        ),
        (
            r#"{"t":0.1,"q1":0,"tau1":1,"on":1}"#,
            ["message 21 on", "message 1 has not: `on`"],
        ),
        (
            r#"{"t":0.1,"q1":0,"tau"#,
            ["message 21 on", "is no JSON object"],
        ),
        (
            r#"{"t":0.1,"q1":1e13,"tau1":1}"#,
            ["message 21: column `q1`", "is no position"],
        ),
        (
            r#"{"t":0.01,"q1":0,"tau1":1}"#,
            ["message 21: column `t` jumps back", "0.019 to 0.01 s"],
        ),
    ] {
        refused(with(data), &words);
    }
    let first = message(1, 0, br#"{"t":NaN,"q1":0,"tau1":0}"#);
    refused(
        read(&whole(&[json_channel(), first].concat())),
        &["message 1: column `t` holds NaN"],
    );
    // If messages are out of order, the message says how to sort the file.
    let records = [json_channel(), json(10, 10), json(0, 10)].concat();
    refused(read(&whole(&records)), &["message 11", "mcap sort"]);
}

/// `sensor_msgs/msg/JointState` as rosbag2 stores it.
const DEFINITION: &str = "# A comment = with a sign\n\nstd_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
================================================================================\nMSG: std_msgs/Header\n# Two-integer timestamp\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

/// The definition with more fields than usual, in another order.
const WIDER: &str = "uint8 KIND=3 # constant\nstd_msgs/Header header\nuint8 mode 1\nextra_msgs/Note[] notes\nfloat32[3] bias\nfloat32[<=9] effort\nstring<=20[] name\nfloat64[] position\nfloat64[] velocity\n\
=====\nMSG: std_msgs/Header\nuint32 seq\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
=====\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
=====\nMSG: extra_msgs/Note\nbool on\nint16 level\nstring text\n";

/// Bytes of a message.
struct Cdr {
    bytes: Vec<u8>,
    is_big: bool,
    is_ros1: bool,
}

impl Cdr {
    fn new(is_big: bool) -> Self {
        Self {
            bytes: Vec::new(),
            is_big,
            is_ros1: false,
        }
    }

    fn put(&mut self, little_endian: &[u8]) {
        while !self.is_ros1 && !self.bytes.len().is_multiple_of(little_endian.len()) {
            self.bytes.push(0);
        }
        let start = self.bytes.len();
        self.bytes.extend(little_endian);
        if self.is_big {
            self.bytes[start..].reverse();
        }
    }

    fn count(&mut self, n: usize) {
        self.put(&(n as u32).to_le_bytes());
    }

    fn text(&mut self, s: &str) {
        self.count(s.len() + usize::from(!self.is_ros1));
        self.bytes.extend(s.as_bytes());
        if !self.is_ros1 {
            self.bytes.push(0);
        }
    }

    fn floats(&mut self, values: &[f64]) {
        self.count(values.len());
        for v in values {
            self.put(&v.to_le_bytes());
        }
    }

    fn names(&mut self, names: &[&str]) {
        self.count(names.len());
        for name in names {
            self.text(name);
        }
    }

    fn done(self) -> Vec<u8> {
        let head = if self.is_big {
            [0, 0, 0, 0]
        } else {
            [0, 1, 0, 0]
        };
        [&head, self.bytes.as_slice()].concat()
    }
}

/// A joint state at this time, ns, as [`DEFINITION`] has it.
fn state(is_big: bool, ns: u64, names: &[&str], lists: [&[f64]; 3]) -> Vec<u8> {
    let mut cdr = Cdr::new(is_big);
    cdr.count((ns / 1_000_000_000) as usize);
    cdr.count((ns % 1_000_000_000) as usize);
    cdr.text("base");
    cdr.names(names);
    for list in lists {
        cdr.floats(list);
    }
    cdr.done()
}

fn ros_channel(id: u16, topic: &str) -> Vec<u8> {
    [
        schema(id, "sensor_msgs/msg/JointState", "ros2msg", DEFINITION),
        channel(id, id, topic, "cdr"),
    ]
    .concat()
}

/// Time of sample k since 1970, ns.
fn ns(k: u64) -> u64 {
    1_700_000_000_123_456_789 + k * 2_000_000
}

const ARM: [&str; 2] = ["shoulder", "elbow"];

/// Ten states of the arm made by `make`, on channel 1.
fn arm_file(topic: &str, make: impl Fn(u64) -> Vec<u8>) -> Vec<u8> {
    let states = (0..10).flat_map(|k| message(1, ns(k), &make(k)));
    [ros_channel(1, topic), states.collect()].concat()
}

#[test]
fn joint_states_of_ros_2_are_read_by_the_names_of_the_joints() {
    let arm = robot(&ARM);
    for is_big in [false, true] {
        let make = |k: u64| {
            let x = k as f64;
            // The order of the joints changes, and one of them does not belong to the robot.
            if k.is_multiple_of(2) {
                let (q, qd, tau) = ([9.0, x, -x], [9.0, 1.0, 2.0], [9.0, 0.5, -0.25]);
                state(
                    is_big,
                    ns(k),
                    &["finger", "elbow", "shoulder"],
                    [&q, &qd, &tau],
                )
            } else {
                let (q, qd, tau) = ([-x, x, 9.0], [2.0, 1.0, 9.0], [-0.25, 0.5, 9.0]);
                state(
                    is_big,
                    ns(k),
                    &["shoulder", "elbow", "finger"],
                    [&q, &qd, &tau],
                )
            }
        };
        let (blocks, warnings) = read_with(&whole(&arm_file("/joint_states", make)), &arm).unwrap();
        let [shoulder, elbow] = blocks[0].joints.as_slice() else {
            panic!()
        };
        for (k, t) in blocks[0].t.iter().enumerate() {
            assert_eq!(*t, k as f64 * 2e6 * 1e-9);
            assert_eq!((shoulder.q[k], elbow.q[k]), (-(k as f64), k as f64));
        }
        assert_eq!(shoulder.qd, Some(vec![2.0; 10]));
        assert_eq!(
            (&shoulder.tau, &elbow.tau),
            (&vec![-0.25; 10], &vec![0.5; 10])
        );
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(
            warnings[0].contains("header stamp") && warnings[0].contains("1700000000.123456789 s")
        );
        assert!(
            warnings[1].contains("the robot has not are passed over: \"finger\""),
            "{warnings:?}"
        );
    }
}

#[test]
fn definitions_are_read_and_not_presumed() {
    let make = |k: u64| {
        let mut cdr = Cdr::new(false);
        cdr.count(7);
        cdr.count((ns(k) / 1_000_000_000) as usize);
        cdr.count((ns(k) % 1_000_000_000) as usize);
        cdr.text("base_link");
        cdr.put(&[1]);
        cdr.count(2);
        for note in ["a", "bcd"] {
            cdr.put(&[1]);
            cdr.put(&5i16.to_le_bytes());
            cdr.text(note);
        }
        for bias in [1.0f32, 2.0, 3.0] {
            cdr.put(&bias.to_le_bytes());
        }
        cdr.count(2);
        for effort in [0.5f32, -0.25] {
            cdr.put(&effort.to_le_bytes());
        }
        cdr.names(&ARM);
        cdr.floats(&[k as f64, 2.0]);
        cdr.floats(&[]);
        cdr.done()
    };
    let channels = [
        schema(1, "sensor_msgs/msg/JointState", "ros2msg", WIDER),
        channel(1, 1, "/joint_states", "cdr"),
    ];
    let states: Vec<u8> = (0..5).flat_map(|k| message(1, ns(k), &make(k))).collect();
    let bytes = whole(&[channels.concat(), states].concat());
    let (blocks, _) = read_with(&bytes, &robot(&ARM)).unwrap();
    assert_eq!(blocks[0].joints[0].q, [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(blocks[0].joints[1].tau, [-0.25; 5]);
    assert_eq!(blocks[0].joints[0].qd, None);
    // A definition without those of its types, one in another language, and ones that cannot be read.
    let usual = |definition: &str, encoding: &str| {
        let one = |k| {
            message(
                1,
                ns(k),
                &state(false, ns(k), &ARM, [&[0.0; 2], &[], &[0.0; 2]]),
            )
        };
        let channels = [
            schema(1, "sensor_msgs/msg/JointState", encoding, definition),
            channel(1, 1, "/joint_states", "cdr"),
        ];
        let states: Vec<u8> = (0..5).flat_map(one).collect();
        read_with(&whole(&[channels.concat(), states].concat()), &robot(&ARM))
    };
    let short = DEFINITION.split("====").next().unwrap();
    for (definition, encoding) in [
        (short, "ros2msg"),
        ("", "ros2msg"),
        ("module sensor_msgs {}", "ros2idl"),
    ] {
        assert_eq!(usual(definition, encoding).unwrap().0[0].len(), 5);
    }
    refused(
        usual("std_msgs/Header header\nstring[] name\n", "ros2msg"),
        &["no field `position`"],
    );
    refused(
        usual(
            "other/Thing x\nstring[] name\nfloat64[] position",
            "ros2msg",
        ),
        &["does not define `other/Thing`"],
    );
    refused(
        usual("JointState x\nstring[] name\nfloat64[] position", "ros2msg"),
        &["contains itself"],
    );
    refused(
        usual(
            &short.replace("string[] name", "float64 a\nstring[] name"),
            "ros2msg",
        ),
        &["message 1 on /joint_states"],
    );
}

/// As bridges to web tools record them; the parts of the time are named as in ROS 2, by Foxglove or as in ROS 1.
#[test]
fn joint_states_as_json_are_read_too() {
    let file = |parts: [&str; 2], rows: u64, last: &str| {
        let state = |k: u64| {
            let (sec, nsec) = (ns(k) / 1_000_000_000, ns(k) % 1_000_000_000);
            format!(
                r#"{{"header":{{"frame_id":"","stamp":{{"{}":{sec},"{}":{nsec}}}}},"name":["elbow","finger","shoulder"],"position":[{k},9,-{k}.5],"velocity":[],"effort":[0.5,null,-0.25]}}"#,
                parts[0], parts[1]
            )
        };
        let channels = [
            schema(1, "sensor_msgs/msg/JointState", "jsonschema", "{}"),
            channel(1, 1, "/joint_states", "json"),
        ];
        let states = (0..rows).flat_map(|k| message(1, ns(k), state(k).as_bytes()));
        let states: Vec<u8> = states
            .chain(message(1, ns(rows), last.as_bytes()))
            .collect();
        [channels.concat(), states].concat()
    };
    let arm = robot(&ARM);
    let last = r#"{"name":["shoulder","elbow"],"position":[1,2],"effort":[3,4]}"#;
    for parts in [["sec", "nanosec"], ["sec", "nsec"], ["secs", "nsecs"]] {
        let last = last.replace(
            "{\"name\"",
            &format!(
                r#"{{"header":{{"stamp":{{"{}":1700000000,"{}":143456789}}}},"name""#,
                parts[0], parts[1]
            ),
        );
        let (blocks, _) = read_with(&whole(&file(parts, 10, &last)), &arm).unwrap();
        let [shoulder, elbow] = blocks[0].joints.as_slice() else {
            panic!()
        };
        assert_eq!(
            blocks[0].t[..10],
            (0..10).map(|k| k as f64 * 2e6 * 1e-9).collect::<Vec<_>>()
        );
        assert_eq!(
            (shoulder.q[3], elbow.q[3], shoulder.q[10]),
            (-3.5, 3.0, 1.0)
        );
        assert_eq!((shoulder.tau[3], elbow.tau[10]), (-0.25, 4.0));
        assert_eq!(shoulder.qd, None);
    }
    let parts = ["sec", "nanosec"];
    refused(
        read_with(&whole(&file(parts, 10, "[1, 2]")), &arm),
        &["message 11 on /joint_states", "is no joint state in JSON"],
    );
    // A file that was not closed is read up to its break.
    let bytes = start(&file(parts, 400, last));
    let (blocks, warnings) = read_with(&bytes[..bytes.len() / 2], &arm).unwrap();
    assert!((150..250).contains(&blocks[0].len()));
    assert!(
        warnings.iter().any(|own| own.contains("messages are read")),
        "{warnings:?}"
    );
}

/// Samples on other topics are not the recording, but they are there: the advice is not to record again.
#[test]
fn a_broken_file_with_other_topics_is_told_with_what_it_has() {
    let other = [
        schema(1, "std_msgs/msg/Float64MultiArray", "jsonschema", "{}"),
        channel(1, 1, "/telemetry", "json"),
        (0..50)
            .flat_map(|k| message(1, ns(k), b"{\"data\":[1,2]}"))
            .collect(),
    ];
    let bytes = start(&other.concat());
    let error = read_with(&bytes[..bytes.len() - 9], &robot(&ARM)).unwrap_err();
    for words in [
        "its topics are /telemetry",
        "breaks off at byte",
        "`rig inspect` lists",
    ] {
        assert!(error.contains(words), "{error}");
    }
    assert!(!error.contains("record it again"), "{error}");
}

#[test]
fn joint_states_of_ros_1_are_read_too() {
    let definition = "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n=====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
    let make = |k: u64| {
        let mut bytes = Cdr::new(false);
        bytes.is_ros1 = true;
        bytes.count(k as usize);
        bytes.count((ns(k) / 1_000_000_000) as usize);
        bytes.count((ns(k) % 1_000_000_000) as usize);
        bytes.text("x");
        bytes.names(&["link"]);
        bytes.floats(&[k as f64]);
        bytes.floats(&[]);
        bytes.floats(&[1.5]);
        bytes.bytes
    };
    let channels = [
        schema(4, "sensor_msgs/JointState", "ros1msg", definition),
        channel(1, 4, "/joint_states", "ros1"),
    ];
    let states: Vec<u8> = (0..5).flat_map(|k| message(1, ns(k), &make(k))).collect();
    let (blocks, warnings) = read(&whole(&[channels.concat(), states].concat())).unwrap();
    assert_eq!(blocks[0].joints[0].q, [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert!(
        (blocks[0].t[4] - 0.008).abs() < 1e-12 && warnings.len() == 1,
        "{warnings:?}"
    );
}

#[test]
fn joints_are_matched_or_refused_by_name() {
    let file = |names: [&str; 2]| {
        whole(&arm_file("/joint_states", |k| {
            state(false, ns(k), &names, [&[1.0, 2.0], &[], &[3.0, 4.0]])
        }))
    };
    // A prefix that all names have.
    for names in [
        ["ur5/elbow", "ur5/shoulder"],
        ["left_elbow", "left_shoulder"],
        ["a::elbow", "a::shoulder"],
    ] {
        let (blocks, warnings) = read_with(&file(names), &robot(&ARM)).unwrap();
        assert_eq!(blocks[0].joints[0].q, [2.0; 10]);
        assert!(
            warnings.iter().any(|s| s.contains("behind the prefix")),
            "{warnings:?}"
        );
    }
    let ambiguous = ["a/shoulder", "b/shoulder"];
    refused(
        read_with(&file(ambiguous), &robot(&["shoulder"])),
        &["message 1", "several prefixes (\"a/\", \"b/\")"],
    );
    refused(
        read_with(&file(["elbow", "wrist"]), &robot(&ARM)),
        &[
            "message 1 on /joint_states has no joint \"shoulder\"",
            "\"elbow\", \"wrist\"",
            "type=\"fixed\"",
        ],
    );
    refused(
        read_with(&file(["x", "y"]), &robot(&ARM)),
        &[
            "no message has the joints of the robot (\"shoulder\", \"elbow\")",
            "message 1",
            "\"x\", \"y\"",
        ],
    );
    refused(
        read_with(&file(["elbow", "elbow"]), &robot(&["elbow"])),
        &["\"elbow\" twice"],
    );
    // A name that only ends like a joint is not the joint.
    refused(
        read_with(&file(["myelbow", "myshoulder"]), &robot(&ARM)),
        &["no message has the joints"],
    );
}

#[test]
fn publishers_that_share_a_topic_are_told_apart() {
    // Messages of a gripper contain no joint of the robot.
    let mixed = |k: u64| {
        if k.is_multiple_of(2) {
            state(false, ns(k), &ARM, [&[1.0, 2.0], &[], &[3.0, 4.0]])
        } else {
            state(false, ns(k), &["finger"], [&[9.0], &[], &[9.0]])
        }
    };
    let (blocks, warnings) =
        read_with(&whole(&arm_file("/joint_states", mixed)), &robot(&ARM)).unwrap();
    assert_eq!(blocks[0].len(), 5);
    let is_remark =
        |s: &String| s.contains("the first is message 2 on /joint_states, with \"finger\"");
    assert!(warnings.iter().any(is_remark), "{warnings:?}");
    // Messages that alternate between parts of the robot are refused.
    let parts = |k: u64| match k {
        0 => mixed(0),
        k => state(false, ns(k), &ARM[..1], [&[1.0], &[], &[3.0]]),
    };
    refused(
        read_with(&whole(&arm_file("/joint_states", parts)), &robot(&ARM)),
        &["message 2", "no joint \"elbow\"", "several publishers"],
    );
    // Two topics contain the robot's joints: it is unknown which one is the recording.
    let one = |channel: u16, k: u64| message(channel, ns(k), &mixed(0));
    let records = [
        ros_channel(1, "/joint_states"),
        ros_channel(2, "/joint_commands"),
        one(1, 0),
        one(2, 0),
    ];
    refused(
        read_with(&whole(&records.concat()), &robot(&ARM)),
        &["/joint_states and /joint_commands both", "mcap filter"],
    );
    // An unusual topic name is reported, and so is a topic with other joints.
    let finger = state(false, ns(0), &["finger"], [&[9.0], &[], &[9.0]]);
    let records = [
        ros_channel(2, "/gripper/joint_states"),
        message(2, ns(0), &finger),
        arm_file("/arm/joint_states", |k| {
            state(false, ns(k), &ARM, [&[1.0, 2.0], &[], &[3.0, 4.0]])
        }),
    ];
    let (_, warnings) = read_with(&whole(&records.concat()), &robot(&ARM)).unwrap();
    assert!(
        warnings
            .iter()
            .any(|s| s.contains("read from topic /arm/joint_states")),
        "{warnings:?}"
    );
    assert!(
        warnings
            .iter()
            .any(|s| s.contains("message 1 on /gripper/joint_states")),
        "{warnings:?}"
    );
}

#[test]
fn arrays_that_are_missing_or_no_numbers_are_named() {
    let arm = robot(&ARM);
    let file = |make: &dyn Fn(u64) -> [Vec<f64>; 3]| {
        whole(&arm_file("/joint_states", |k| {
            let [q, qd, tau] = make(k);
            state(false, ns(k), &ARM, [&q, &qd, &tau])
        }))
    };
    let two = vec![1.0, 2.0];
    let nan = vec![1.0, f64::NAN];
    let no_effort = file(&|_| [two.clone(), two.clone(), vec![]]);
    refused(
        read_with(&no_effort, &arm),
        &["message 1 on /joint_states has an empty `effort` array"],
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    std::fs::write(&path, &no_effort).unwrap();
    let source = Source::open_with(&path, &arm, EffortNeed::Optional).unwrap();
    assert!(!source.has_effort());
    assert_eq!(
        source.column_name(1, Quantity::Position),
        "position of joint \"elbow\""
    );
    assert_eq!(source.column_name(1, Quantity::Effort), "tau2");
    let late = file(&|k| {
        [
            two.clone(),
            vec![],
            if k < 4 { two.clone() } else { vec![] },
        ]
    });
    refused(
        read_with(&late, &arm),
        &["message 5", "2 names but 0 values of effort"],
    );
    let short = file(&|_| [vec![1.0], vec![], two.clone()]);
    refused(
        read_with(&short, &arm),
        &["message 1", "2 names but 1 values of position"],
    );
    let broken = file(&|k| {
        [
            two.clone(),
            vec![],
            if k < 4 { two.clone() } else { nan.clone() },
        ]
    });
    refused(
        read_with(&broken, &arm),
        &["message 5: column `effort of joint \"elbow\"` holds NaN"],
    );
    // Interfaces that a driver does not have are NaN from the first message on.
    let never = file(&|_| [two.clone(), nan.clone(), two.clone()]);
    let (blocks, warnings) = read_with(&never, &arm).unwrap();
    assert_eq!(blocks[0].joints[0].qd, None);
    assert!(
        warnings
            .iter()
            .any(|s| s.contains("velocity of joint \"elbow\" is NaN")),
        "{warnings:?}"
    );
    let huge = file(&|_| [vec![1e224, 0.0], vec![], two.clone()]);
    refused(
        read_with(&huge, &arm),
        &["`position of joint \"shoulder\"`", "1·10²²⁴ is no position"],
    );
    // Without stamps, the recorder's time is used.
    let unstamped = whole(&arm_file("/joint_states", |_| {
        state(false, 0, &ARM, [&two, &[], &two])
    }));
    let (blocks, warnings) = read_with(&unstamped, &arm).unwrap();
    assert!((blocks[0].t[9] - 0.018).abs() < 1e-12);
    assert!(
        warnings[0].contains("header stamp of message 1 is zero"),
        "{warnings:?}"
    );
}

/// Writes a file of 300 JSON messages on `topic` every 2 ms, and returns its path.
fn json_file(folder: &Path, topic: &str, make: impl Fn(u64) -> String) -> std::path::PathBuf {
    let mut records = channel(1, 0, topic, "json");
    for k in 0..300 {
        let ns = 1_700_000_000_000_000_000 + k * 2_000_000;
        records.extend(message(1, ns, make(k).as_bytes()));
    }
    let path = folder.join("a.mcap");
    std::fs::write(&path, whole(&records)).unwrap();
    path
}

fn mapped(path: &Path, robot: &Robot, columns: &[&str]) -> (Vec<Block>, Vec<String>) {
    let mut mapping = Mapping::default();
    for entry in columns {
        mapping.add_column(entry).unwrap();
    }
    let source = Source::open_mapped(path, robot, EffortNeed::Optional, &mapping).unwrap();
    let (blocks, warnings) = source.read_all().unwrap();
    (blocks, warnings.iter().map(ToString::to_string).collect())
}

#[test]
fn the_name_of_a_joint_is_no_unit() {
    let folder = tempfile::tempdir().unwrap();
    let names = [
        "wrist_turn",
        "wrist_rev",
        "lift_mm",
        "tilt_mrad",
        "elbow_deg",
    ];
    let path = json_file(folder.path(), "/joint_states", |k| {
        let q = 0.01 * k as f64;
        format!(
            "{{\"name\": {names:?}, \"position\": [{q}, {q}, {q}, {q}, {q}], \"raw_deg\": [{q}, {q}, {q}, {q}, {q}]}}"
        )
    });
    let robot = robot(&names);
    let entries: Vec<String> = (names.iter().enumerate())
        .map(|(k, name)| format!("q{}=joint_states/position/{name}", k + 1))
        .collect();
    let entries: Vec<&str> = entries.iter().map(String::as_str).collect();
    let (blocks, warnings) = mapped(&path, &robot, &entries);
    for joint in &blocks[0].joints {
        assert_eq!(joint.q[100], 1.0, "{warnings:?}");
    }
    assert!(
        warnings.iter().all(|w| !w.contains("converted")),
        "{warnings:?}"
    );
    // The name of the array states the unit of all elements.
    let in_degrees: Vec<String> = entries
        .iter()
        .map(|e| e.replace("position", "raw_deg"))
        .collect();
    let in_degrees: Vec<&str> = in_degrees.iter().map(String::as_str).collect();
    let (blocks, _) = mapped(&path, &robot, &in_degrees);
    assert_eq!(blocks[0].joints[0].q[100], 1f64.to_radians());
    for robot in [None, Some(&robot)] {
        let found = contents(&path, robot, &mut |_| {}).unwrap();
        let proposed = found.proposal.columns.iter();
        let own: Vec<_> = proposed.map(|p| (p.full_name(), p.unit)).collect();
        for name in names {
            let wanted = (format!("joint_states/position/{name}"), None);
            assert!(own.contains(&wanted), "{name} in {own:?}");
        }
    }
}

#[test]
fn a_sample_of_the_own_kind_keeps_its_time_when_mapped() {
    let folder = tempfile::tempdir().unwrap();
    let path = json_file(folder.path(), "/joint/state", |k| {
        let t = 0.001 * k as f64;
        format!("{{\"t\": {t}, \"angle\": {t}, \"clock\": {}}}", 3.0 * t)
    });
    let robot = robot(&["link"]);
    let (blocks, warnings) = mapped(&path, &robot, &["q1=joint/state/angle"]);
    assert_eq!(blocks[0].t[299], 0.001 * 299.0, "{warnings:?}");
    assert!(
        warnings.iter().all(|w| !w.contains("stamp")),
        "{warnings:?}"
    );
    let (blocks, _) = mapped(
        &path,
        &robot,
        &["q1=joint/state/angle", "t=joint/state/clock"],
    );
    assert_eq!(blocks[0].t[299], 3.0 * (0.001 * 299.0));
    let found = contents(&path, Some(&robot), &mut |_| {}).unwrap();
    assert!((found.topics[0].time.period.unwrap() - 0.001).abs() < 1e-9);
    // Another topic has the time of the log, and no stamp that could be zero.
    let path = json_file(folder.path(), "/arm", |k| {
        format!("{{\"angle\": {}}}", 0.1 * k as f64)
    });
    let (blocks, warnings) = mapped(&path, &robot, &["q1=arm/angle"]);
    assert!((blocks[0].t[299] - 0.598).abs() < 1e-9);
    assert!(
        warnings
            .iter()
            .any(|w| w.contains("stamp of message 1 is missing")),
        "{warnings:?}"
    );
}

#[test]
fn rows_before_the_first_message_with_a_channel_count_as_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = json_file(folder.path(), "/arm", |k| match k {
        3 => "{\"q1\": 1, \"extra\": 2}".to_owned(),
        _ => "{\"q1\": 1}".to_owned(),
    });
    let found = contents(&path, None, &mut |_| {}).unwrap();
    let extra = found.topics[0]
        .channels
        .iter()
        .find(|c| c.name == "extra")
        .unwrap();
    assert_eq!(
        (extra.values, extra.missing, extra.first_missing),
        (1, 299, Some(1))
    );
}
