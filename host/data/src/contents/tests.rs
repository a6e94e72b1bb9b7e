//! What is found in files as people and other programs write them.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use super::{Contents, contents};
use crate::made_for_tests::{of_others, robot};

fn read(path: &Path, joints: &[&str]) -> Contents {
    let robot = (!joints.is_empty()).then(|| robot(joints));
    contents(path, robot.as_ref(), &mut |_| {}).unwrap()
}

fn of_text(text: &str) -> Contents {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    read(&path, &[])
}

/// Columns that are proposed, with channel and unit.
fn columns(found: &Contents) -> Vec<(String, String, Option<&'static str>)> {
    let of = found.proposal.columns.iter();
    of.map(|p| (p.column.clone(), p.full_name(), p.unit))
        .collect()
}

fn has(
    list: &[(String, String, Option<&'static str>)],
    column: &str,
    channel: &str,
    unit: Option<&str>,
) {
    let found = list.iter().find(|(own, ..)| own == column);
    let (_, own, of) = found.unwrap_or_else(|| panic!("no {column} in {list:?}"));
    assert_eq!((own.as_str(), *of), (channel, unit), "{column}");
}

#[test]
fn a_log_of_a_robot_controller_is_understood_by_its_names() {
    let mut text = String::from(
        "timestamp,actual_q_0,actual_q_1,target_q_0,actual_current_0,actual_current_1,mode\n",
    );
    for k in 0..3000 {
        let t = 1.7e9 + 0.002 * f64::from(k) + if k < 2000 { 0.0 } else { 0.5 };
        let q = (0.01 * f64::from(k)).sin();
        writeln!(text, "{t:.6},{q},{},{q},{},{},run", 0.5 * q, 2.0 * q, 1.5).unwrap();
    }
    let found = of_text(&text);
    let time = &found.topics[0].time;
    assert_eq!(found.topics[0].rows, 3000);
    assert!((time.period.unwrap() - 0.002).abs() < 1e-6, "{time:?}");
    let gap = time.longest_gap.unwrap();
    assert_eq!((time.gaps, gap.row), (1, 2001));
    assert!((gap.step - 0.502).abs() < 1e-6);
    let columns = columns(&found);
    has(&columns, "t", "timestamp", None);
    has(&columns, "q1", "actual_q_0", None);
    has(&columns, "q2", "actual_q_1", None);
    has(&columns, "ref1", "target_q_0", None);
    has(&columns, "i2", "actual_current_1", None);
    assert!(found.proposal.missing.is_empty() && !found.proposal.is_plain);
    assert!(
        found
            .proposal
            .options
            .contains(&"--map q2=actual_q_1".to_owned())
    );
    let mode = found.topics[0]
        .channels
        .iter()
        .find(|c| c.name == "mode")
        .unwrap();
    assert_eq!((mode.values, mode.missing), (0, 3000));
    let current = found.topics[0]
        .channels
        .iter()
        .find(|c| c.name == "actual_current_1")
        .unwrap();
    assert!(current.is_constant());
}

#[test]
fn units_come_from_names_and_the_time_from_its_steps() {
    let mut text = String::from("time [ms];Joint Angle 1 [deg];Joint Torque 1 [Nm]\n");
    for k in 0..100 {
        writeln!(text, "{};{},5;-1,25", 4 * k, k % 90).unwrap();
    }
    let found = of_text(&text);
    let named = columns(&found);
    has(&named, "t", "time [ms]", Some("ms"));
    has(&named, "q1", "Joint Angle 1 [deg]", Some("deg"));
    has(&named, "tau1", "Joint Torque 1 [Nm]", None);
    assert!(
        found
            .proposal
            .options
            .contains(&"--map 'q1=Joint Angle 1 [deg]'".to_owned())
    );
    let angle = &found.topics[0].channels[0];
    assert_eq!((angle.min, angle.max), (Some(0.5), Some(89.5)));
    // Nothing states a unit: steps of 4 cannot be seconds, and 80 rad are more than two turns.
    let bare = text
        .replace(" [ms]", "")
        .replace(" [deg]", "")
        .replace(" [Nm]", "");
    let found = of_text(&bare);
    has(&columns(&found), "t", "time", Some("ms"));
    assert!(
        found.proposal.doubts[0].contains("89.5"),
        "{:?}",
        found.proposal.doubts
    );
}

#[test]
fn a_file_that_is_refused_elsewhere_is_described() {
    // No header, a row that is too short, a time that jumps back, and a gap in the middle.
    let text = "0.0,1,2\n0.1,1,2\n0.2,1\n\n0.3,x,2\n0.25,1,2\n";
    let found = of_text(text);
    assert_eq!(found.topics[0].rows, 5);
    for words in ["no header", "line 3 with 2 fields", "empty lines"] {
        assert!(
            found.faults.iter().any(|f| f.contains(words)),
            "{words}: {:?}",
            found.faults
        );
    }
    // Without a name, the column that grows is not certain to be the time; it does not grow here.
    let missing = found.proposal.missing.join(" ");
    assert!(
        missing.contains("No column is named as a time"),
        "{missing}"
    );
    let named = of_text(&format!("zeitpunkt,a,b\n{}", "0,1,2\n1,1,2\n2,1,2\n"));
    let missing = named.proposal.missing.join(" ");
    assert!(missing.contains("may be the time: zeitpunkt"), "{missing}");
    let back = of_text(&format!("t,q1\n{text}").replace(",2\n", "\n"));
    let time = &back.topics[0].time;
    assert_eq!(
        (time.backwards, time.first_not_growing.unwrap().row),
        (1, 5)
    );
    let doubts = back.proposal.doubts.join(" ");
    for words in [
        "jumps back 1 times, first in row 5",
        "`q1` of the table has no number in 1 rows, the first is row 4",
    ] {
        assert!(doubts.contains(words), "{doubts}");
    }
}

#[test]
fn dates_are_times() {
    let found = of_text("time,q1,tau1\n2026-03-01T23:59:59.9Z,0,1\n2026-03-02T00:00:00.1Z,0,1\n");
    let time = &found.topics[0].time;
    assert!((time.period.unwrap() - 0.2).abs() < 1e-9, "{time:?}");
    assert!(found.remarks.iter().any(|r| r.contains("ISO 8601")));
}

#[test]
fn a_bag_shows_every_topic_with_its_rate_and_ranges() {
    for name in ["bag_mcap", "bag_split", "bag_sqlite", "bag_old"] {
        let found = read(&of_others(name), &["shoulder", "elbow"]);
        assert_eq!(found.topics.len(), 2, "{name}");
        let [joints, sensor] = &found.topics[..] else {
            panic!()
        };
        assert_eq!((joints.name.as_str(), joints.rows), ("/joint_states", 200));
        assert_eq!(
            (sensor.name.as_str(), sensor.rows),
            ("/ft_sensor/wrench", 40)
        );
        assert!((joints.time.period.unwrap() - 0.002).abs() < 1e-9);
        assert!((sensor.time.period.unwrap() - 0.01).abs() < 1e-9);
        assert_eq!((joints.time.gaps, joints.time.backwards), (0, 0));
        let channel = |name: &str| joints.channels.iter().find(|c| c.name == name).unwrap();
        // q = 0.3 cos(2t) of the shoulder, from 0.3 at t = 0 to 0.3 cos(0.796).
        let shoulder = channel("position/shoulder");
        assert_eq!(shoulder.max, Some(0.3));
        assert!((shoulder.min.unwrap() - 0.3 * 0.796_f64.cos()).abs() < 1e-12);
        let columns = columns(&found);
        // In the order of the robot, which is not that of the messages; the gripper is none of its joints.
        has(&columns, "q1", "joint_states/position/shoulder", None);
        has(&columns, "tau2", "joint_states/effort/elbow", None);
        has(&columns, "fx", "ft_sensor/wrench/wrench/force/x", None);
        has(&columns, "mz", "ft_sensor/wrench/wrench/torque/z", None);
        assert!(found.proposal.is_plain && columns.iter().all(|(own, ..)| own != "q3"));
        assert_eq!(found.proposal.refusal, None);
        assert_eq!(read(&of_others(name), &[]).proposal.refusal, None);
    }
}

#[test]
fn json_of_another_program_becomes_channels() {
    let found = read(&of_others("other.mcap"), &[]);
    let topic = &found.topics[0];
    assert_eq!((topic.name.as_str(), topic.rows), ("/arm/telemetry", 200));
    let named = columns(&found);
    has(
        &named,
        "q1",
        "arm/telemetry/joints/positionDeg/elbow",
        Some("deg"),
    );
    has(&named, "tau2", "arm/telemetry/joints/torque/shoulder", None);
    assert_eq!(found.proposal.refusal, None);
}

/// The picture has a bounded number of stretches and keeps a single spike.
#[test]
fn memory_does_not_grow_with_the_rows() {
    let mut picture = super::Picture::default();
    for k in 0..1_000_000 {
        let spike = if k == 654_321 { 7.0 } else { 0.0 };
        picture.add(f64::from(k), spike);
    }
    assert!(picture.t.len() <= 600 && picture.t.len() > 300);
    let largest = picture.high.iter().copied().fold(0.0, f64::max);
    let at = picture.high.iter().position(|v| *v == 7.0).unwrap();
    assert!(largest == 7.0 && (picture.t[at] - 654_321.0).abs() < 4096.0);
}

#[test]
fn arrays_are_described_like_columns() {
    for name in ["compressed.npz", "structure.mat"] {
        let found = read(&of_others(name), &[]);
        assert_eq!(found.topics[0].rows, 200, "{name}");
        assert!((found.topics[0].time.rate.unwrap() - 500.0).abs() < 1e-6);
        let columns = columns(&found);
        has(&columns, "q2", "q2", None);
        has(&columns, "tau1", "tau1", None);
        assert!(found.proposal.is_plain && found.proposal.missing.is_empty());
        assert_eq!(found.proposal.refusal, None);
    }
}

#[test]
fn only_what_the_other_commands_read_is_called_readable() {
    let rows = |make: &dyn Fn(usize) -> String| (0..50).map(make).collect::<String>();
    let plain = |k: usize| format!("{},{},1\n", 0.001 * k as f64, 0.1 * k as f64);
    let found = of_text(&format!("t,q1,tau1\n{}", rows(&plain)));
    assert!(found.proposal.is_plain && found.proposal.refusal.is_none());
    let index = rows(&|k| format!("{k},{}", plain(k)));
    let found = of_text(&format!(",t,q1,tau1\n{index}"));
    assert!(found.proposal.is_plain && found.proposal.refusal.is_none());
    // A trailing comma, a column without a name that counts nothing, text between the numbers, and an odd row near the end.
    let comma = rows(&|k| plain(k).replace('\n', ",\n"));
    let nameless = rows(&|k| format!("{},{}", 2 * k, plain(k)));
    let text = rows(&|k| plain(k).replace(",1\n", ",one\n"));
    let late = rows(&|k| {
        if k == 45 {
            "0.045,x,1\n".into()
        } else {
            plain(k)
        }
    });
    for (text, words) in [
        (format!("t,q1,tau1\n{comma}"), "fields"),
        (format!(",t,q1,tau1\n{nameless}"), "no name"),
        (format!("t,q1,tau1\n{text}"), "tau1"),
        (format!("t,q1,tau1\n{late}"), "csv:47"),
    ] {
        let refusal = of_text(&text).proposal.refusal;
        assert!(
            refusal.as_ref().is_some_and(|r| r.contains(words)),
            "{words}: {refusal:?}"
        );
    }
}

#[test]
fn joints_are_as_the_units_of_their_columns_say() {
    for head in [
        "t,q1 [mm],tau1 [N]",
        "t,q1,tau1 [N]",
        "t,q1 [deg],tau1 [mNm]",
    ] {
        let found = of_text(&format!("{head}\n0,1,2\n0.001,2,2\n0.002,3,2\n"));
        assert_eq!(found.proposal.refusal, None, "{head}");
    }
}

#[test]
fn columns_that_are_numbered_from_0_are_mapped() {
    let mut text = String::from("t,q0,q1,tau0,tau1\n");
    for k in 0..50 {
        writeln!(
            text,
            "{},{k},{},1,2",
            0.001 * f64::from(k),
            0.1 * f64::from(k)
        )
        .unwrap();
    }
    let found = of_text(&text);
    let columns = columns(&found);
    has(&columns, "q1", "q0", None);
    has(&columns, "q2", "q1", None);
    has(&columns, "tau2", "tau1", None);
    assert!(!found.proposal.is_plain);
    assert_eq!(found.proposal.refusal, None);
}

#[test]
fn columns_of_a_text_file_are_found_by_the_names_of_the_joints() {
    let joints = ["shoulder", "elbow", "wrist_turn"];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    for form in [
        "{}_pos,{}_torque_mNm",
        "position/{},torque/{} [mNm]",
        "{}.position,{}.effort_mNm",
    ] {
        let mut text = String::from("t");
        for joint in ["elbow", "wrist_turn", "shoulder"] {
            write!(text, ",{}", form.replace("{}", joint)).unwrap();
        }
        text.push('\n');
        for k in 0..50 {
            let q = 0.01 * f64::from(k);
            writeln!(text, "{},{q},1,{q},1,{q},1", 0.001 * f64::from(k)).unwrap();
        }
        std::fs::write(&path, &text).unwrap();
        let found = read(&path, &joints);
        let columns = columns(&found);
        for (k, joint) in joints.iter().enumerate() {
            let own = form.replace("{}", joint);
            let (position, torque) = own.split_once(',').unwrap();
            has(&columns, &format!("q{}", k + 1), position, None);
            has(&columns, &format!("tau{}", k + 1), torque, Some("mNm"));
        }
        assert_eq!(found.proposal.refusal, None, "{form}");
    }
    // A joint without a column is told.
    let found = read(&path, &["shoulder", "elbow", "gripper"]);
    let missing = &found.proposal.missing;
    assert!(
        missing.iter().any(|m| m.contains("\"gripper\" (`q3`)")),
        "{missing:?}"
    );
}

/// Writes a log of messages in JSON, one topic after the other at 500 Hz.
fn json_log(path: &Path, topics: &[(&str, &dyn Fn(f64) -> String)]) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut out = ::mcap::WriteOptions::new()
        .compression(None)
        .create(file)
        .unwrap();
    let schema = out.add_schema("Any", "jsonschema", b"{}").unwrap();
    for (topic, text) in topics {
        let none = std::collections::BTreeMap::new();
        let channel = out.add_channel(schema, topic, "json", &none).unwrap();
        for k in 0..200u32 {
            let time = 2_000_000 * u64::from(k);
            let header = ::mcap::records::MessageHeader {
                channel_id: channel,
                sequence: k,
                log_time: time,
                publish_time: time,
            };
            let data = text(0.002 * f64::from(k));
            out.write_to_known_channel(&header, data.as_bytes())
                .unwrap();
        }
    }
    out.finish().unwrap();
}

#[test]
fn torques_on_another_topic_are_proposed_by_the_joints_of_the_positions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let moved = |t: f64| format!("{{\"position\": {{\"elbow\": {t}, \"wrist\": {}}}}}", -t);
    // In another order.
    let torque = |t: f64| {
        format!(
            "{{\"torque\": {{\"wrist\": {}, \"elbow\": {}}}}}",
            2.0 * t,
            3.0 * t
        )
    };
    json_log(&path, &[("/joints", &moved), ("/drives", &torque)]);
    let found = read(&path, &[]);
    let named = columns(&found);
    has(&named, "q1", "joints/position/elbow", None);
    has(&named, "tau1", "drives/torque/elbow", None);
    has(&named, "tau2", "drives/torque/wrist", None);
    assert!(
        found.proposal.missing.is_empty(),
        "{:?}",
        found.proposal.missing
    );
    assert_eq!(found.proposal.refusal, None);
    let options = &found.proposal.options;
    assert!(
        options.contains(&"--map tau2=drives/torque/wrist".to_owned()),
        "{options:?}"
    );
    // In the order of the robot.
    let named = columns(&read(&path, &["wrist", "elbow"]));
    has(&named, "tau1", "drives/torque/wrist", None);
    // An array without names, on a topic that says of what.
    let torque = |t: f64| format!("{{\"data\": [{}, {}]}}", 2.0 * t, 3.0 * t);
    json_log(&path, &[("/joints", &moved), ("/joint_torques", &torque)]);
    let found = read(&path, &[]);
    has(&columns(&found), "tau2", "joint_torques/data/1", None);
    assert_eq!(found.proposal.refusal, None);
}

#[test]
fn a_second_time_and_a_cut_row_are_told() {
    let text = of_text("stamp,time,q1,tau1\n0,0,0,0\n1,0.1,0,0\n2,0.2,0,0\n");
    assert!(text.proposal.doubts[0].contains("time is named as a time, too"));
    let cut = of_text("t,q1,tau1\n0,0,0\n0.1,0,0\n0.2,0,0.12");
    assert_eq!(cut.topics[0].rows, 3);
    assert!(cut.faults[0].contains("no line end"), "{:?}", cut.faults);
    // Times since 1970 need no option.
    let row = |k: u64| format!("{},0.5,1\n", 1_700_000_000_000_000_000 + 2_000_000 * k);
    let text: String = (0..50).map(row).collect();
    let found = of_text(&format!("t,q1,tau1\n{text}"));
    has(&columns(&found), "t", "t", Some("ns"));
    assert!(found.proposal.is_plain && found.proposal.refusal.is_none());
}

#[test]
fn units_rows_counts_and_copies_are_described() {
    let found = of_text(",t,q1,tau1\n0,0,0.5,1\n1,0,0.5,1\n2,0.001,0.25,1\n3,0.002,0.5,1\n");
    let topic = &found.topics[0];
    let names: Vec<&str> = topic.channels.iter().map(|own| own.name.as_str()).collect();
    assert_eq!(
        (names.as_slice(), topic.rows),
        (["q1", "tau1"].as_slice(), 4)
    );
    let time = &topic.time;
    assert_eq!(
        (time.repeated, time.copies, time.first_not_growing),
        (1, 1, None)
    );
    assert!(found.proposal.doubts.is_empty() && found.proposal.refusal.is_none());
    assert!(
        found
            .remarks
            .iter()
            .any(|own| own.contains("counts the rows"))
    );

    let found = of_text("t,q1,tau1\nms,deg,Nm\n0,10,1\n1,20,1\n2,30,1\n");
    assert_eq!(found.topics[0].rows, 3);
    assert!((found.topics[0].time.rate.unwrap() - 1000.0).abs() < 1e-9);
    assert!(found.proposal.refusal.is_none(), "{:?}", found.proposal);
    let columns = columns(&found);
    has(&columns, "q1", "q1", Some("deg"));
    has(&columns, "t", "t", Some("ms"));

    let found = of_text(
        "field.header.stamp,field.position0,field.effort0\n1732900000000000000,0.5,1\n1732900000002000128,0.25,1\n1732900000004000000,0.5,2\n",
    );
    assert_eq!(found.proposal.options[0], "--map t=field.header.stamp");
    assert!(found.proposal.refusal.is_none(), "{:?}", found.proposal);
}
