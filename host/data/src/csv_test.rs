//! CSV as spreadsheet programs and scripts write it.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use super::{Block, Quantity, Source};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};

fn rig() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// Returns the blocks of a file and the remarks; otherwise the error.
fn read(text: impl AsRef<[u8]>) -> Result<(Vec<Block>, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, text).unwrap();
    let source = Source::open(&path, &rig()).map_err(|e| e.to_string())?;
    let (blocks, warnings) = source.read_all().map_err(|e| e.to_string())?;
    Ok((blocks, warnings.iter().map(ToString::to_string).collect()))
}

/// Asserts that a file holds the rows (0, 0.5, −12.5), (0.001, 0.25, 3) in these lines, with these remarks.
fn holds(text: impl AsRef<[u8]>, first_line: u64, remarks: &[&str]) {
    let shown = String::from_utf8_lossy(text.as_ref()).into_owned();
    let (blocks, warnings) = read(text).unwrap_or_else(|e| panic!("{shown}: {e}"));
    let block = &blocks[0];
    assert_eq!(block.t, [0.0, 0.001], "{shown}");
    assert_eq!(block.joints[0].q, [0.5, 0.25], "{shown}");
    assert_eq!(block.joints[0].tau, [-12.5, 3.0], "{shown}");
    assert_eq!(block.first_line, first_line, "{shown}");
    assert_eq!(warnings.len(), remarks.len(), "{shown}: {warnings:?}");
    for (warning, remark) in warnings.iter().zip(remarks) {
        assert!(warning.contains(remark), "{shown}: {warning}");
    }
}

#[test]
fn quotes_are_those_of_csv() {
    holds(
        "\"t\",\"q1\",\"tau1\"\n\"0\",\"0.5\",\"-12.5\"\n\"0.001\",\"0.25\",\"3\"\n",
        2,
        &[],
    );
    // Only some fields are quoted; a text contains a separator, a doubled quotation mark and a line end.
    holds(
        "t,\"q1\",tau1\n0,\" 0.5 \",-12.5\n0.001,0.25,\"3\"\n",
        2,
        &[],
    );
    holds(
        "note,t,q1,tau1\n\"a, b\",0,0.5,-12.5\n\"say \"\"so\"\"\nand so\",0.001,0.25,3\n",
        2,
        &["line 2: column `note`"],
    );
    holds(
        "t,\"no, te\",q1,tau1\n0,1,0.5,-12.5\n0.001,2,0.25,3\n",
        2,
        &[],
    );
    let message = read("t,q1,tau1,note\n0,0,0,\n0.1,0,0,\"abc\n0.2,0,0,\n").unwrap_err();
    assert!(
        message.contains("a.csv:3:") && message.contains("not closed"),
        "{message}"
    );
    // The line of an error after a text of two lines.
    let message = read("note,t,q1,tau1\n\"a\nb\",0,0,0\n\"c\",1,\"x\",0\n").unwrap_err();
    assert!(
        message.contains("a.csv:4:") && message.contains("`q1` holds \"x\""),
        "{message}"
    );
}

#[test]
fn separators_and_decimal_commas_are_read_where_they_are_unambiguous() {
    let semicolon = "columns are separated by `;`";
    holds("t;q1;tau1\n0;0,5;-12,5\n0,001;0,25;3\n", 2, &[semicolon]);
    holds(
        "t;q1;tau1\r\n0;0.5;-12.5\r\n0.001;0.25;3\r\n",
        2,
        &[semicolon],
    );
    holds(
        "\"t\";\"q1\";\"tau1\"\n\"0\";\"0,5\";\"-12,5\"\n\"0,001\";\"0,25\";\"3\"\n",
        2,
        &[semicolon],
    );
    holds(
        "t\tq1\ttau1\n0\t0,5\t-12,5\n0,001\t0,25\t3\n",
        2,
        &["separated by tabs"],
    );
    holds(
        "t q1 tau1\n 0.000 0.5   -12.5\n 0.001 0.25  3\n",
        2,
        &["separated by blanks"],
    );
    holds(
        "sep=;\nt;q1;tau1\n0;0,5;-12,5\n0,001;0,25;3\n",
        3,
        &["header stands in line 2", semicolon],
    );
    holds(
        "t,q1,tau1\n0,\"0,5\",\"-12,5\"\n\"0,001\",\"0,25\",3\n",
        2,
        &["line 2: a comma in a quoted number is a decimal comma"],
    );
    for (text, place, words) in [
        // A comma that is both separator and decimal comma.
        (
            "t,q1,tau1\n0,0,0,5,1,2\n",
            "a.csv:2:",
            "decimal comma makes two fields",
        ),
        (
            "t,q1,tau1\n0,0.5,1.5\n0,001,0.5,1.5\n",
            "a.csv:3:",
            "separate the columns by `;`",
        ),
        // Both decimal marks in one file, and in one number.
        (
            "t;q1;tau1\n0.0;0;0\n0,1;0;0\n",
            "a.csv:3:",
            "earlier numbers have a decimal point",
        ),
        (
            "t;q1;tau1\n0,0;0;0\n0,1;0.5;0\n",
            "a.csv:3:",
            "earlier numbers have a decimal comma",
        ),
        (
            "t,q1,tau1\n0,0,0.5\n1,0,\"0,5\"\n",
            "a.csv:3:",
            "`tau1` holds \"0,5\" with a decimal comma",
        ),
        (
            "t;q1;tau1\n0;1.234,5;0\n",
            "a.csv:2:",
            "`q1` holds \"1.234,5\"",
        ),
        (
            "t;q1;tau1\n0;1,234,5;0\n",
            "a.csv:2:",
            "`q1` holds \"1,234,5\"",
        ),
        (
            "t;q1;tau1\n0,0,0\n",
            "a.csv:2:",
            "separated by `;`, as in the header",
        ),
    ] {
        let message = read(text).unwrap_err();
        assert!(
            message.contains(place) && message.contains(words),
            "{text}: {message}"
        );
    }
}

#[test]
fn wide_text_is_read_by_its_byte_order_mark() {
    // As a spreadsheet program saves "Unicode text" where decimals have a comma.
    let text = "t\tq1\ttau1\r\n0\t0,5\t-12,5\r\n0,001\t0,25\t3\r\n";
    for big in [false, true] {
        let units = std::iter::once(0xfeff).chain(text.encode_utf16());
        let bytes: Vec<u8> = units
            .flat_map(|u: u16| {
                if big {
                    u.to_be_bytes()
                } else {
                    u.to_le_bytes()
                }
            })
            .collect();
        holds(&bytes, 2, &["tabs"]);
        let (blocks, warnings) = read(&bytes[..bytes.len() - 11]).unwrap();
        assert_eq!(blocks[0].t, [0.0]);
        assert!(warnings[1].contains("line 3, the last one"), "{warnings:?}");
    }
}

#[test]
fn what_stands_before_the_header_is_passed_over() {
    let rows = "0,0.5,-12.5\n0.001,0.25,3\n";
    holds(
        format!("\n\nt,q1,tau1\n{rows}"),
        4,
        &["header stands in line 3"],
    );
    holds(format!("\u{feff}\r\nt,q1,tau1\n{rows}"), 3, &["line 2"]);
    holds(
        format!("# recorded on rig 3\n%\n\nt,q1,tau1\n{rows}"),
        5,
        &["line 4"],
    );
    // As numpy and MATLAB scripts write it.
    holds(
        format!("# t,q1,tau1\n{rows}"),
        2,
        &["line 1 begins with `#`"],
    );
    holds(
        "% t q1 tau1\n0 0.5 -12.5\n0.001 0.25 3\n",
        2,
        &["line 1 begins with `%`", "blanks"],
    );
    let message = read("# nothing\n\n").unwrap_err();
    assert!(message.contains("is empty"), "{message}");
    let message = read("\n\nt,q1,tau1\n0,0,0\n0.1,x,0\n").unwrap_err();
    assert!(message.contains("a.csv:5:"), "{message}");
}

#[test]
fn carriage_returns_alone_end_lines() {
    holds("t,q1,tau1\r0,0.5,-12.5\r0.001,0.25,3\r", 2, &[]);
    holds("t;q1;tau1\r0;0,5;-12,5\r0,001;0,25;3\r", 2, &["`;`"]);
    holds(
        "\r\rt,q1,tau1\r0,0.5,-12.5\r0.001,0.25,3\r\r",
        4,
        &["line 3"],
    );
    let message = read("t,q1,tau1\r0,0,0\r0.1,x,0\r").unwrap_err();
    assert!(message.contains("a.csv:3:"), "{message}");
}

#[test]
fn exponents_of_fortran_are_exponents() {
    holds(
        "t,q1,tau1\n0.0D+00,5D-1,-1.25d01\n1.0D-03,0.25D0,3.D0\n",
        2,
        &[],
    );
    for bad in ["D", "1D", "D5", "1D5D", "0x1D", "5.2E-01D0"] {
        let message = read(format!("t,q1,tau1\n0,{bad},0\n")).unwrap_err();
        assert!(message.contains("column `q1` holds"), "{bad}: {message}");
    }
}

#[test]
fn what_no_measurement_has_is_named_in_few_digits() {
    for (text, place, words) in [
        (
            "t,q1,tau1\n0,1.04e224,0\n",
            "a.csv:2:",
            "column `q1` holds 1.04·10²²⁴, but 1.04·10²²⁴ is no position",
        ),
        (
            "t,q1,i1\n0,0,0\n1,0,-1e13\n",
            "a.csv:3:",
            "is no motor current",
        ),
        (
            "t,q1,tau1\n0,0,9007199254740991\n",
            "a.csv:2:",
            "9.0072·10¹⁵ is no torque or force",
        ),
        ("t,q1,tau1\n0,0,0\n1e300,0,0\n", "a.csv:3:", "is no time"),
    ] {
        let message = read(text).unwrap_err();
        assert!(
            message.contains(place) && message.contains(words),
            "{text}: {message}"
        );
        assert!(message.len() < 200, "{message}");
    }
    // Nanoseconds since 1970 have their own message; very small numbers are accepted.
    assert!(read("t,q1,tau1\n1700000000000000000,1e-321,0\n1700000000001000000,0,1e9\n").is_ok());
    let message = read("t,q1,tau1\n1700000000.25,0,0\n1700000000.1234567,0,0\n").unwrap_err();
    assert!(
        message.contains("jumps back from 1700000000.25 to 1700000000.123457 s"),
        "{message}"
    );
}

#[test]
fn files_of_other_programs_are_named_by_their_first_bytes() {
    let zip = |name: &str| [b"PK\x03\x04\x14\0\0\0".as_slice(), name.as_bytes()].concat();
    let matlab = [b"MATLAB 5.0 MAT-file".to_vec(), vec![0; 200]].concat();
    let wide: Vec<u8> = "t,q1,tau1\n0,0,0\n".bytes().flat_map(|b| [b, 0]).collect();
    for (bytes, words) in [
        (
            b"#ROSBAG V2.0\n\x45\0\0\0".to_vec(),
            "a ROS 1 bag; convert it",
        ),
        (
            b"SQLite format 3\0\x10\0".to_vec(),
            "SQLite database, as rosbag2",
        ),
        (
            [b"SQLite format 3\0".to_vec(), vec![0; 4000]].concat(),
            "is an SQLite database, as rosbag2 writes",
        ),
        (b"\x1f\x8b\x08\0\0\0".to_vec(), "compressed by gzip"),
        (zip("t.npy"), "NumPy"),
        (zip("[Content_Types].xml"), "workbook"),
        (zip("a.csv"), "zip archive"),
        (matlab, "MATLAB file"),
        (b"\x89HDF\r\n\x1a\n\0\0".to_vec(), "HDF5"),
        (b"PAR1\x15\x04".to_vec(), "Parquet file is cut off"),
        (b"\x80\x04\x95\x00".to_vec(), "pickle"),
        (
            wide,
            "UTF-16 (little-endian, without a byte order mark) text; save it as UTF-8",
        ),
        (b"\xff\xfe\0\0t\0\0\0".to_vec(), "UTF-32 text"),
        (b"[{\"t\":0,\"q1\":0}]".to_vec(), "JSON"),
        (b"<?xml version=\"1.0\"?><robot/>".to_vec(), "XML"),
    ] {
        let message = read(&bytes).unwrap_err();
        assert!(
            message.contains(words) && !message.contains('\n'),
            "{message}"
        );
    }
}

#[test]
fn columns_are_called_what_the_file_calls_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let names = |header: &str| {
        let fields = header.split(',').count();
        let row = vec!["0"; fields].join(",");
        std::fs::write(&path, format!("{header}\n{row}\n")).unwrap();
        let source = Source::open(&path, &rig()).unwrap();
        [
            Quantity::Position,
            Quantity::Effort,
            Quantity::Voltage,
            Quantity::Reference,
        ]
        .map(|quantity| source.column_name(0, quantity))
    };
    assert_eq!(names("t,q1,tau1"), ["q1", "tau1", "u1", "ref1"]);
    assert_eq!(
        names("t,qm1,i1,duty1,supply"),
        ["qm1", "i1", "duty1", "ref1"]
    );
    assert_eq!(names("t,qm1,taum1,u1,i1"), ["qm1", "taum1", "u1", "ref1"]);
}

#[test]
fn names_with_blanks_before_their_units_are_split_at_the_other_separator() {
    let time = "taken from column `t ";
    for text in [
        "t [s],q1 [rad],tau1 [Nm]\n0,0.5,-12.5\n0.001,0.25,3\n",
        "t (s),q1 (rad),tau1 (Nm)\n0,0.5,-12.5\n0.001,0.25,3\n",
        "t [s], q1 [rad], tau1 [Nm]\n0, 0.5, -12.5\n0.001, 0.25, 3\n",
    ] {
        holds(text, 2, &[time]);
    }
    let by = |separator: &str| format!("columns are separated by {separator}");
    let text = "t [s];q1 [rad];tau1 [Nm]\n0;0,5;-12,5\n0,001;0,25;3\n";
    holds(text, 2, &[time, &by("`;`")]);
    let text = "t [s]\tq1 [rad]\ttau1 [Nm]\n0\t0.5\t-12.5\n0.001\t0.25\t3\n";
    holds(text, 2, &[time, &by("tabs")]);
    let text = "# t [s],q1 [rad],tau1 [Nm]\n0,0.5,-12.5\n0.001,0.25,3\n";
    holds(text, 2, &[time, "is read as the header"]);
    // Blanks separate where they fit the rows, also with decimal commas and a comma in a name.
    let text = "t q1 tau1 at(x,y)\n0 0,5 -12,5 1\n0,001 0,25 3 1\n";
    holds(text, 2, &[&by("blanks")]);
}

#[test]
fn the_last_row_of_a_file_that_is_cut_off_is_no_row() {
    let rows: String = (0..300).map(|k| format!("{k}e-3,0.25,3\n")).collect();
    let whole = format!("t,q1,tau1\n{rows}");
    let holds_rows = |text: &str, remarks: &[&str]| {
        let (blocks, warnings) = read(text).unwrap();
        assert_eq!(blocks[0].t.len(), 300, "{warnings:?}");
        assert_eq!(warnings.len(), remarks.len(), "{warnings:?}");
        for (warning, remark) in warnings.iter().zip(remarks) {
            assert!(warning.contains(remark), "{warning}");
        }
    };
    holds_rows(&whole, &[]);
    // Each is a row of its own with another torque, position or time, or too few fields.
    for cut in ["0.3,0.75,1.2", "0.3,0.75,1", "0.3,0.75,", "0.3,0.7", "0.3"] {
        for separator in [",", ";", "\t"] {
            let text = format!("{whole}{cut}").replace(',', separator);
            let said = "line 302, the last one, has no line end: the file may be";
            let remarks: &[&str] = match separator {
                "," => &[said],
                _ => &["columns are separated", said],
            };
            holds_rows(&text, remarks);
        }
    }
    // Blanks at the end are no row.
    holds_rows(&format!("{whole}  "), &[]);
}

/// In a file of few rows, each may be a pose: the last one is left out only if it lacks a field.
#[test]
fn the_last_of_few_rows_counts_without_a_line_end() {
    let whole = "t,q1,tau1\n0,0.5,-12.5\n0.001,0.25,3";
    holds(
        whole,
        2,
        &["line 3, the last one, has no line end: if the file was cut off"],
    );
    for cut in ["\n0.002,0.7", "\n0.002,0.7,", "\n0.00"] {
        let said = "line 4, the last one, has no line end: the file may be";
        holds(format!("{whole}{cut}"), 2, &[said]);
    }
}

#[test]
fn times_since_1970_need_no_unit() {
    for (unit, factor) in [("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
        // 4 ms, which nanoseconds since 1970 resolve to 256 ns as doubles.
        let time = |k: u64| (1_700_000_000 * factor as u64) + k * (4 * factor as u64 / 1000);
        let rows = |k: u64| format!("{},{k},0\n", time(k));
        let rows: String = (0..50).map(rows).collect();
        let (blocks, warnings) = read(format!("t,q1,tau1\n{rows}")).unwrap();
        assert_eq!(blocks.len(), 1, "{warnings:?}");
        let end = blocks[0].t[49];
        assert!(
            blocks[0].t[0] == 0.0 && (end - 0.196).abs() < 1e-6,
            "{unit}: {end}"
        );
        let words = format!("are read as {unit}, because");
        assert!(warnings.iter().any(|w| w.contains(&words)), "{warnings:?}");
        assert!(warnings.iter().any(|w| w.contains("since 1970")));
    }
}

#[test]
fn a_unit_that_is_not_known_is_named_with_those_that_are() {
    let message = read("t,q1,tau1 [oz-in]\n0,0,0\n1,0,0\n").unwrap_err();
    for words in ["`tau1 [oz-in]`", "its unit `oz-in` is not known", "mNm"] {
        assert!(message.contains(words), "{message}");
    }
    // Where the column is not needed, it is said as well.
    let (_, warnings) = read("t,q1,tau1,qd1 [grad/s]\n0,0,0,0\n1,0,0,0\n").unwrap();
    assert!(
        warnings[0].contains("`grad/s` is not known"),
        "{warnings:?}"
    );
    let (blocks, _) = read("t,q1,tau1 [Nmm]\n0,0,500\n1,0,0\n").unwrap();
    assert_eq!(blocks[0].joints[0].tau[0], 0.5);
}

#[test]
fn several_columns_of_time_are_named() {
    let message = read("time,timestamp,q1,tau1\n0,0,0,0\n1,1,0,0\n").unwrap_err();
    for words in [
        "time and timestamp are all named as a time",
        "--map 't=time'",
    ] {
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_file_of_matlab_4_is_named() {
    for is_big in [false, true] {
        let number = |n: u32| match is_big {
            true => n.to_be_bytes(),
            false => n.to_le_bytes(),
        };
        // A column of three doubles with the name `t`.
        let kind = if is_big { 1000 } else { 0 };
        let mut bytes: Vec<u8> = [kind, 3, 1, 0, 2].into_iter().flat_map(number).collect();
        bytes.extend(b"t\0");
        bytes.extend([0; 24]);
        let message = read(&bytes).unwrap_err();
        assert!(
            message.contains("MATLAB file of version 4") && message.contains("-v7"),
            "{message}"
        );
    }
}

#[test]
fn exact_copies_of_rows_are_left_out_and_counted() {
    let twice = "t,q1,tau1,note\n0,0.5,-12.5,a\n0,0.5,-12.5,a\n0.001,0.25,3,b\n0.001,0.25,3,b\n0.001,0.25,3,b\n";
    let said = "3 rows are exact copies of the row before them (same time, same values) and are left out; the first is line 3";
    holds(twice, 2, &["column `note` holds", said]);
    let once = "t,q1,tau1\n0,0.5,-12.5\n0.001,0.25,3\n0.001,0.25,3\n";
    holds(once, 2, &["1 row is an exact copy of the row before it"]);
    // A value that differs in its last digit makes another measurement of the same time.
    let other = "t,q1,tau1\n0,0.5,-12.5\n0.001,0.25,3\n0.001,0.25,3.0000000000000004\n";
    let message = read(other).unwrap_err();
    assert!(
        message.contains("a.csv:4: column `t` stands still at 0.001 s"),
        "{message}"
    );
    assert!(message.contains("keep one row of each time"), "{message}");
    // The same values at a later time are a measurement.
    let rest = "t,q1,tau1\n0,0.5,-12.5\n0.001,0.5,-12.5\n0.002,0.5,-12.5\n";
    let (blocks, warnings) = read(rest).unwrap();
    assert_eq!((blocks[0].len(), warnings.len()), (3, 0));
}

#[test]
fn a_row_of_units_is_read_as_units() {
    let rows = "0,0.5,-12.5\n0.001,0.25,3\n";
    let said = "line 2 holds the units of the columns";
    holds(format!("t,q1,tau1\ns,rad,N·m\n{rows}"), 3, &[said]);
    // Every unit is converted, also behind `;` and under a header in a comment.
    let (q, half) = (0.5f64.to_degrees(), 0.25f64.to_degrees());
    let text = format!("# t;q1;tau1\nms;deg;mNm\n0;{q:?};-12500\n1;{half:?};3000\n");
    let (blocks, warnings) = read(&text).unwrap();
    let joint = &blocks[0].joints[0];
    assert_eq!(blocks[0].t, [0.0, 0.001]);
    for (value, truth) in joint.q.iter().zip([0.5, 0.25]) {
        assert!((value - truth).abs() < 1e-15);
    }
    for (value, truth) in joint.tau.iter().zip([-12.5, 3.0]) {
        assert!((value - truth).abs() < 1e-12);
    }
    assert!(
        warnings
            .iter()
            .any(|own| own == "column `q1` is converted from deg, as the row of units states"),
        "{warnings:?}"
    );
    // One cell that is no unit: the row is a row.
    let message = read(format!("t,q1,tau1\ns,rad,grad\n{rows}")).unwrap_err();
    assert!(
        message.contains("a.csv:2: column `t` holds \"s\""),
        "{message}"
    );
    let message = read(format!("t,q1,tau1\ns,A,Nm\n{rows}")).unwrap_err();
    assert!(
        message.contains("states A for column `q1`, which is a unit of current"),
        "{message}"
    );
}

#[test]
fn a_first_column_that_counts_the_rows_is_left_out() {
    let said = "column 1 has no name and counts the rows";
    for (text, copies) in [
        (",t,q1,tau1\n0,0,0.5,-12.5\n1,0.001,0.25,3\n", 0),
        ("\"\",t,q1,tau1\n7,0,0.5,-12.5\n8,0.001,0.25,3\n", 0),
        // A row that was written twice is a copy, whatever its number.
        (
            ",t,q1,tau1\n0,0,0.5,-12.5\n1,0,0.5,-12.5\n2,0.001,0.25,3\n",
            1,
        ),
    ] {
        let (blocks, warnings) = read(text).unwrap();
        assert_eq!(blocks[0].t, [0.0, 0.001], "{text}");
        assert_eq!(blocks[0].joints[0].q, [0.5, 0.25], "{text}");
        assert!(blocks[0].extra.is_empty(), "{text}");
        assert!(warnings[0].contains(said), "{warnings:?}");
        assert_eq!(warnings.len(), 1 + copies, "{warnings:?}");
    }
    let tabs = "\tt\tq1\ttau1\n0\t0\t0.5\t-12.5\n1\t0.001\t0.25\t3\n";
    holds(tabs, 2, &["columns are separated by tabs", said]);
    // Values, and no count.
    let message = read(",t,q1,tau1\n0.3,0,0.5,-12.5\n0.1,0.001,0.25,3\n").unwrap_err();
    assert!(message.contains("column 1 has no name"), "{message}");
    let message = read(",t,q1,tau1\n3,0,0.5,-12.5\n5,0.001,0.25,3\n").unwrap_err();
    assert!(message.contains("column 1 has no name"), "{message}");
}

#[test]
fn columns_of_another_robot_are_refused_with_the_command_that_names_them() {
    for header in ["time,elbow_position,elbow_effort", "a,b,c", "t,q1,u1"] {
        let message = read(format!("{header}\n0,0.5,1\n0.001,0.25,1\n")).unwrap_err();
        assert!(
            message.contains("a.csv` proposes the options that name them (--map, --unit)"),
            "{message}"
        );
    }
}

#[test]
fn the_header_stamp_of_rostopic_is_the_time() {
    let rows = "1732900000000000000,0.5,-12.5\n1732900000001000000,0.25,3\n";
    let (blocks, warnings) = read(format!("field.header.stamp,q1,tau1\n{rows}")).unwrap();
    // Doubles resolve 256 ns in nanoseconds since 1970.
    assert!((blocks[0].t[1] - blocks[0].t[0] - 1e-3).abs() < 3e-7);
    assert!(
        warnings
            .iter()
            .any(|own| own.contains("`field.header.stamp`")),
        "{warnings:?}"
    );
    // Beside another time it is a column like any other, as `rostopic echo -p` writes it.
    let both = "%time,field.header.stamp,q1,tau1\n0,7,0.5,-12.5\n0.001,8,0.25,3\n";
    let (blocks, _) = read(both).unwrap();
    assert_eq!(blocks[0].t, [0.0, 0.001]);
}
