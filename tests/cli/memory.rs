//! Memory does not grow with the recording.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::run::{rig, robot};

/// A recording of `rows` samples of the one-link rig.
fn write(path: &Path, rows: usize) {
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    writeln!(file, "t,q1,tau1").unwrap();
    for k in 0..rows {
        let t = k as f64 * 1e-3;
        let (s, c) = (3.0 * t).sin_cos();
        let (q, qd, qdd) = (
            1.2 * s + 0.5 * (7.1 * t).sin(),
            3.6 * c + 3.55 * (7.1 * t).cos(),
            -10.8 * s - 25.205 * (7.1 * t).sin(),
        );
        let tau = 0.17 * qdd + 2.943 * q.cos() + 0.3 * qd + 0.4 * qd.signum();
        writeln!(file, "{t:.3},{q:.7},{tau:.5}").unwrap();
    }
}

/// Returns an identification from a recording.
fn identification(data: &Path, out: &Path) -> Command {
    let mut command = rig();
    command
        .args(["identify", "--robot"])
        .arg(robot("one-link.toml"));
    command.arg("--data").arg(data).arg("--out").arg(out);
    command
}

/// Returns the largest resident memory of a command, KiB.
fn peak(mut command: Command) -> u64 {
    let mut child = command.stdout(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak = line
            .and_then(|l| l.split_whitespace().next())
            .and_then(|n| n.parse().ok())
            .unwrap_or(peak);
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    peak
}

#[test]
fn a_recording_eight_times_as_long_needs_no_more_memory() {
    let folder = tempfile::tempdir().unwrap();
    let (short, long) = (
        folder.path().join("short.csv"),
        folder.path().join("long.csv"),
    );
    write(&short, 400_000);
    write(&long, 3_200_000);
    let of = |data: &Path, out: &str| peak(identification(data, &folder.path().join(out)));
    let (small, large) = (of(&short, "small"), of(&long, "large"));
    println!("peak memory: {small} KiB for 0.4 million rows, {large} KiB for 3.2 million");
    assert!(large < small + small / 4, "{small} KiB grew to {large} KiB");
}

#[test]
fn a_look_into_a_file_eight_times_as_long_needs_no_more_memory() {
    let folder = tempfile::tempdir().unwrap();
    let [small, large] = [100_000, 800_000].map(|rows| {
        let path = folder.path().join(format!("{rows}.csv"));
        write(&path, rows);
        let mut command = rig();
        command.arg("inspect").arg(&path);
        peak(command)
    });
    println!("peak memory: {small} KiB for 0.1 million rows, {large} KiB for 0.8 million");
    assert!(large < small + small / 4, "{small} KiB grew to {large} KiB");
}

#[test]
fn parquet_is_written_and_read_in_groups_of_rows() {
    let folder = tempfile::tempdir().unwrap();
    // Groups of 131 072 rows: two and twelve of them.
    let [small, large] = [260_000, 1_560_000].map(|rows| {
        let [text, path] =
            ["csv", "parquet"].map(|own| folder.path().join(format!("{rows}.{own}")));
        write(&text, rows);
        let mut convert = rig();
        convert.arg("convert").arg(&text).arg(&path);
        let mut inspect = rig();
        inspect.arg("inspect").arg(&path);
        [peak(convert), peak(inspect)]
    });
    println!(
        "peak memory of convert and inspect: {small:?} KiB for 2 groups, {large:?} KiB for 12"
    );
    for (small, large) in small.into_iter().zip(large) {
        assert!(large < small + small / 4, "{small} KiB grew to {large} KiB");
    }
}
