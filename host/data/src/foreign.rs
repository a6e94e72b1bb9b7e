//! Files of other programs, detected from their first bytes.

/// Number of bytes used for the detection.
pub(super) const HEAD: usize = 4096;

/// UTF-16 that nothing marks as such.
const BIG: &str = "UTF-16 (big-endian, without a byte order mark)";
const LITTLE: &str = "UTF-16 (little-endian, without a byte order mark)";

/// A format that is not supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ForeignFormat {
    /// `#ROSBAG`.
    #[error(
        "a ROS 1 bag; convert it with `mcap convert in.bag out.mcap` (or `rosbags-convert`) and give the .mcap file"
    )]
    RosBag,
    /// SQLite without the tables of rosbag2.
    #[error(
        "an SQLite database, as rosbag2 writes, but tables `topics` and `messages` cannot be found in it; copy it again, or let `ros2 bag convert` write it anew with storage_id mcap"
    )]
    Sqlite,
    /// A whole file compressed with gzip, xz, bzip2, zstd or lz4.
    #[error(
        "a file compressed by {0}; decompress it (`{command} FILE`) and give the file inside",
        command = decompressor(.0)
    )]
    Compressed(&'static str),
    /// Office workbook.
    #[error(
        "a workbook of a spreadsheet program; save the sheet as \"CSV UTF-8\" and give the .csv file"
    )]
    Workbook,
    /// A single NumPy array.
    #[error(
        "a NumPy file of one array, which has no names for its columns; write it with `numpy.savez(\"out.npz\", t=t, q=q, tau=tau)`"
    )]
    NumPy,
    /// A NumPy archive, which is read.
    #[error("a NumPy archive")]
    NumPyArchive,
    /// Any other zip archive.
    #[error("a zip archive; unpack it and give the .csv or .mcap file inside")]
    Zip,
    /// MATLAB of version 4, which begins with no name.
    #[error(
        "a MATLAB file of version 4; save it with `save('out.mat', 't', 'q', 'tau', '-v7')` (in Python: `scipy.io.savemat(\"out.mat\", {{\"t\": t, \"q\": q, \"tau\": tau}})`)"
    )]
    Matlab4,
    /// MATLAB of a version that is neither 5 to 7.2 nor 7.3.
    #[error(
        "a MATLAB file of an unknown version; save it with `save('out.mat', 't', 'q', 'tau', '-v7')`"
    )]
    Matlab,
    /// HDF5.
    #[error(
        "an HDF5 file; write its columns to CSV, for instance with `pandas.DataFrame.to_csv(\"out.csv\", index=False)`"
    )]
    Hdf5,
    /// Feather, Arrow.
    #[error(
        "a Feather file; write it as Parquet with `pandas.read_feather(\"in\").to_parquet(\"out.parquet\")`"
    )]
    Arrow,
    /// Pickle.
    #[error(
        "a Python pickle; write its columns to CSV, for instance with `pandas.DataFrame.to_csv(\"out.csv\", index=False)`"
    )]
    Pickle,
    /// PX4.
    #[error(
        "a PX4 ULog file; convert it with `ulog2csv` and give one .csv file with the columns t, q1, tau1"
    )]
    Ulog,
    /// Measurement data of vehicles and test benches.
    #[error("{0} file; export its channels on one time base as CSV")]
    Bench(&'static str),
    /// UTF-16 without a byte order mark, or UTF-32.
    #[error("{0} text; save it as UTF-8 (\"CSV UTF-8\" of spreadsheet programs)")]
    Wide(&'static str),
    /// JSON outside MCAP.
    #[error("JSON text; write one line per sample as CSV, with a header line such as `t,q1,tau1`")]
    Json,
    /// A robot description in TOML.
    #[error(
        "a robot description (TOML), but a recording of the robot is wanted here: a .csv or .mcap file; the description goes to --robot"
    )]
    Description,
    /// Parameters of a motion in TOML.
    #[error(
        "a trajectory (TOML), but a recording of the robot is wanted here: a .csv or .mcap file; `rig record` and `rig simulate` make one of a trajectory"
    )]
    Trajectory,
    /// XML or HTML.
    #[error(
        "XML or HTML text; give the recording itself (the robot's description goes to --robot)"
    )]
    Xml,
}

/// Returns the command that decompresses a file and keeps it.
fn decompressor(compression: &str) -> &'static str {
    match compression {
        "gzip" => "gzip -dk",
        "xz" => "xz -dk",
        "bzip2" => "bzip2 -dk",
        "lz4" => "lz4 -d",
        _ => "zstd -d",
    }
}

impl ForeignFormat {
    /// Returns the format of a file with these first bytes, if it is a known format other than a recording.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        let is = |magic: &[u8]| head.starts_with(magic);
        let holds = |part: &[u8]| head.windows(part.len()).any(|w| w == part);
        const MAGICS: [(&[u8], ForeignFormat); 24] = [
            (b"#ROSBAG", ForeignFormat::RosBag),
            (b"\x1f\x8b", ForeignFormat::Compressed("gzip")),
            (b"\xfd7zXZ\0", ForeignFormat::Compressed("xz")),
            (b"BZh", ForeignFormat::Compressed("bzip2")),
            (b"\x28\xb5\x2f\xfd", ForeignFormat::Compressed("zstd")),
            (b"\x04\x22\x4d\x18", ForeignFormat::Compressed("lz4")),
            (b"7z\xbc\xaf\x27\x1c", ForeignFormat::Compressed("7-Zip")),
            (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ForeignFormat::Workbook),
            (b"\x93NUMPY", ForeignFormat::NumPy),
            (b"MATLAB ", ForeignFormat::Matlab),
            (b"\x89HDF\r\n\x1a\n", ForeignFormat::Hdf5),
            (b"ARROW1", ForeignFormat::Arrow),
            (b"FEA1", ForeignFormat::Arrow),
            (b"\x80\x02", ForeignFormat::Pickle),
            (b"\x80\x03", ForeignFormat::Pickle),
            (b"\x80\x04", ForeignFormat::Pickle),
            (b"\x80\x05", ForeignFormat::Pickle),
            (b"ULog\x01\x12\x35", ForeignFormat::Ulog),
            (b"TDSm", ForeignFormat::Bench("a TDMS")),
            (b"MDF     ", ForeignFormat::Bench("an MDF4")),
            (b"LOGG", ForeignFormat::Bench("a BLF")),
            (b"\xff\xfe\0\0", ForeignFormat::Wide("UTF-32")),
            (b"\0\0\xfe\xff", ForeignFormat::Wide("UTF-32")),
            (b"<", ForeignFormat::Xml),
        ];
        if is(b"PK\x03\x04") {
            return Some(if holds(b".npy") {
                Self::NumPyArchive
            } else if holds(b"[Content_Types].xml") || holds(b"opendocument.spreadsheet") {
                Self::Workbook
            } else {
                Self::Zip
            });
        }
        let known = MAGICS.iter().find(|(magic, _)| is(magic));
        let text = head.trim_ascii_start();
        let begins_json = || {
            let inner = text.get(1..).map(<[u8]>::trim_ascii_start);
            let first = inner.and_then(<[u8]>::first);
            matches!(text.first(), Some(b'{' | b'['))
                && matches!(
                    first,
                    Some(b'"' | b'{' | b'[' | b'}' | b']' | b'-' | b'0'..=b'9')
                )
        };
        // Text without a byte order mark in which every second byte is zero.
        let wide = |at: usize| {
            let pairs = head.get(..16).map(|h| h.chunks_exact(2));
            pairs
                .is_some_and(|mut p| p.all(|pair| pair[at] == 0 && pair[1 - at].is_ascii_graphic()))
        };
        known
            .map(|(_, format)| *format)
            .or_else(|| is_matlab_4(head).then_some(Self::Matlab4))
            .or_else(|| begins_json().then_some(Self::Json))
            .or_else(|| own_toml(head))
            .or_else(|| wide(0).then_some(Self::Wide(BIG)))
            .or_else(|| wide(1).then_some(Self::Wide(LITTLE)))
    }
}

/// Returns which TOML file of this program begins with these bytes.
fn own_toml(head: &[u8]) -> Option<ForeignFormat> {
    let text = String::from_utf8_lossy(head);
    let lines = || text.lines().map(str::trim);
    let has_key = |key: &str| {
        let mut rests = lines().filter_map(|line| line.strip_prefix(key));
        rests.any(|rest| rest.trim_start().starts_with('='))
    };
    lines().any(|line| line.starts_with("[[joint]]")).then(|| {
        match (has_key("gravity"), has_key("robot")) {
            (true, _) => Some(ForeignFormat::Description),
            (false, true) => Some(ForeignFormat::Trajectory),
            (false, false) => None,
        }
    })?
}

/// Returns true for the header of a matrix in a MATLAB file of version 4 ("MAT-File Format", MathWorks R2019b, appendix): five
/// whole numbers (type, rows, columns, imaginary part, length of the name) and the name, which ends with a zero byte.
fn is_matlab_4(head: &[u8]) -> bool {
    let number = |at: usize, is_big: bool| {
        let bytes = *head.get(4 * at..)?.first_chunk()?;
        Some(match is_big {
            true => u32::from_be_bytes(bytes),
            false => u32::from_le_bytes(bytes),
        })
    };
    let fits = |is_big: bool| {
        let numbers = [0, 1, 2, 3, 4].map(|at| number(at, is_big));
        let [
            Some(kind),
            Some(rows),
            Some(columns),
            Some(imaginary),
            Some(length),
        ] = numbers
        else {
            return false;
        };
        // Thousands: byte order; tens: precision; ones: full, text or sparse.
        let is_kind = kind / 1000 == u32::from(is_big) && kind % 1000 < 60 && kind % 10 < 3;
        let name = head.get(20..20 + (length as usize).min(HEAD));
        let is_name = name
            .and_then(<[u8]>::split_last)
            .is_some_and(|(end, name)| {
                let is_letter = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
                *end == 0 && !name.is_empty() && name.iter().all(is_letter)
            });
        is_kind && is_name && imaginary < 2 && rows > 0 && columns > 0
    };
    fits(false) || fits(true)
}
