//! Rows of MCAP files: samples of one topic, with columns of other topics beside them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::block::WRENCH_COLUMNS;
use super::clock::Clock;
use super::columns::{Layout, shown};
use super::decoder::decoder;
use super::error::DataError;
use super::flat_message::FlatMessage;
use super::flat_rows::FlatRows;
use super::header::Header;
use super::mapping::Mapping;
use super::mcap_messages::{Event, Messages, cut_off};
use super::mcap_rows::{McapRows, TOPIC};
use super::place::Place;
use super::remark::Remark;
use super::side_rows::SideRows;

/// Number of messages of a file among which its topics are looked for.
const LOOKED_AT: u64 = 20_000;

/// Type of the messages of a wrist sensor.
const WRENCH: [&str; 2] = [
    "geometry_msgs/msg/WrenchStamped",
    "geometry_msgs/WrenchStamped",
];

/// Channels of a wrist sensor in its messages, in the order of [`WRENCH_COLUMNS`].
const AXES: [&str; 6] = [
    "wrench/force/x",
    "wrench/force/y",
    "wrench/force/z",
    "wrench/torque/x",
    "wrench/torque/y",
    "wrench/torque/z",
];

/// Topic of the rows.
enum Main {
    /// Samples that need no mapping.
    Plain(Box<McapRows>),
    /// Channels that are mapped.
    Mapped(Box<MappedRows>),
}

/// Reader of mapped channels of one topic.
struct MappedRows {
    rows: FlatRows,
    /// Place of the time among the channels; `None` if it is that of the messages.
    time: Option<usize>,
    /// Time of the first row, ns.
    origin: Option<i128>,
    /// Messages read, and time of the last one, s.
    given: (u64, f64),
}

/// Reader of the rows.
pub(super) struct JoinedRows {
    path: PathBuf,
    main: Main,
    sides: Vec<SideRows>,
    /// Assumptions at the start.
    remarks: Vec<Remark>,
    clock: Clock,
    /// True if a row had a value of every topic beside it.
    is_met: bool,
    /// Until then, times of the first and of the last row, ns.
    alone: Option<(i128, i128)>,
}

/// A topic of a file.
struct Found {
    name: String,
    of: String,
    /// Channels of its first message.
    channels: Vec<String>,
    /// The part of each name that may state a unit.
    stems: Vec<String>,
}

/// A topic with the columns that come from it.
#[derive(Default)]
struct Wanted {
    topic: String,
    channels: Vec<String>,
    /// The part of each name that may state a unit.
    stems: Vec<String>,
    columns: Vec<String>,
    /// True if a channel `t` is there that is not mapped.
    has_own_time: bool,
}

impl JoinedRows {
    /// Opens the files of a recording and determines the columns.
    pub(super) fn open(
        path: &Path,
        files: &[PathBuf],
        joints: &[String],
        mapping: &Mapping,
    ) -> Result<(Self, Header), DataError> {
        if !mapping.columns().is_empty() {
            return Self::open_mapped(path, files, mapping);
        }
        let (rows, mut header) = McapRows::open(path, files, joints, mapping.clock)?;
        let mut joined = Self {
            path: path.into(),
            main: Main::Plain(Box::new(rows)),
            sides: Vec::new(),
            remarks: Vec::new(),
            clock: mapping.clock,
            is_met: false,
            alone: None,
        };
        if mapping.wants_wrench && !header.names.iter().any(|name| name == WRENCH_COLUMNS[0]) {
            joined.add_wrench(files, &mut header)?;
        }
        Ok((joined, header))
    }

    /// Adds the columns of the one wrist sensor in the files.
    fn add_wrench(&mut self, files: &[PathBuf], header: &mut Header) -> Result<(), DataError> {
        let topics = topics(files)?;
        let sensors: Vec<&Found> = (topics.iter())
            .filter(|topic| WRENCH.contains(&topic.of.as_str()))
            .collect();
        let sensor = match sensors.as_slice() {
            [] => return Ok(()),
            [one] => one,
            several => {
                let names: Vec<&str> = several.iter().map(|s| s.name.as_str()).collect();
                return Err(DataError::Mapping {
                    message: format!(
                        "{}: topics {} are all of a wrist sensor; name the channels of one of them by --map fx={}/{} and so on, together with those of the joints",
                        self.path.display(),
                        names.join(" and "),
                        names[0].trim_start_matches('/'),
                        AXES[0]
                    ),
                });
            }
        };
        let wanted = Wanted {
            topic: sensor.name.clone(),
            channels: AXES.map(str::to_owned).to_vec(),
            stems: AXES.map(str::to_owned).to_vec(),
            columns: WRENCH_COLUMNS.map(str::to_owned).to_vec(),
            has_own_time: false,
        };
        self.add_side(files, wanted, header)
    }

    fn open_mapped(
        path: &Path,
        files: &[PathBuf],
        mapping: &Mapping,
    ) -> Result<(Self, Header), DataError> {
        let mut wanted = resolved(path, files, mapping)?;
        let is_main = |of: &Wanted| of.columns.iter().any(|c| c.starts_with('q'));
        let at = wanted.iter().position(is_main).unwrap_or(0);
        let mut main = wanted.remove(at);
        let time = main.columns.iter().position(|column| column == "t");
        if let (Some(_), Some(other)) = (time, wanted.first()) {
            return Err(DataError::Mapping {
                message: format!(
                    "`t` is mapped to a channel of {}, so channels of {} have no common time with it; leave out t, and the times of the messages are used",
                    main.topic, other.topic
                ),
            });
        }
        let time = time.or_else(|| main.add_own_time());
        let channels = main.channels.clone();
        let rows = FlatRows::open(path, files, &main.topic, channels, mapping.clock)?;
        let named = |list: &[String]| {
            let time = time.is_none().then(|| "t".to_owned());
            time.into_iter().chain(list.iter().cloned()).collect()
        };
        let full = |channel: &String| format!("{}/{channel}", main.topic.trim_start_matches('/'));
        let full: Vec<String> = main.channels.iter().map(full).collect();
        let mut header = Header::of(named(&main.columns));
        header.labels = named(&full);
        header.stems = named(&main.stems);
        let mut joined = Self {
            path: path.into(),
            main: Main::Mapped(Box::new(MappedRows {
                rows,
                time,
                origin: None,
                given: (0, 0.0),
            })),
            sides: Vec::new(),
            remarks: Vec::new(),
            clock: mapping.clock,
            is_met: false,
            alone: None,
        };
        for side in wanted {
            joined.add_side(files, side, &mut header)?;
        }
        Ok((joined, header))
    }

    fn add_side(
        &mut self,
        files: &[PathBuf],
        wanted: Wanted,
        header: &mut Header,
    ) -> Result<(), DataError> {
        let open = || {
            let channels = wanted.channels.clone();
            FlatRows::open(&self.path, files, &wanted.topic, channels, self.clock)
        };
        let (rows, probe) = (open()?, open()?);
        let topic = wanted.topic.trim_start_matches('/');
        // Columns before these, of joint states, state no units.
        header.stems.resize(header.names.len(), String::new());
        header.stems.extend(wanted.stems);
        let labels = wanted.channels.iter().map(|c| format!("{topic}/{c}"));
        header.labels.extend(labels);
        let side = SideRows::new(rows, probe, wanted.columns)?;
        header.names.extend(side.columns().iter().cloned());
        let further = side.columns().iter().skip(wanted.channels.len());
        header.labels.extend(further.cloned());
        self.remarks.push(side.interpolated());
        self.sides.push(side);
        Ok(())
    }

    pub(super) fn bytes_read(&self) -> u64 {
        match &self.main {
            Main::Plain(rows) => rows.bytes_read(),
            Main::Mapped(own) => own.rows.bytes_read(),
        }
    }

    /// Returns the assumptions and omissions so far; complete after the last row.
    pub(super) fn remarks(&self) -> Vec<Remark> {
        let mut remarks = match &self.main {
            Main::Plain(rows) => rows.remarks(),
            Main::Mapped(own) => {
                let mut remarks: Vec<Remark> = own.remark().into_iter().collect();
                remarks.extend(cut_off(&self.path, own.rows.broken(), own.given));
                remarks
            }
        };
        remarks.extend(self.remarks.iter().cloned());
        remarks.extend(self.sides.iter().filter_map(SideRows::left_out));
        remarks
    }

    /// Returns the likely cause of time that does not grow, after a semicolon; empty if none is known.
    pub(super) fn order_hint(&self) -> &'static str {
        match &self.main {
            Main::Plain(rows) => rows.order_hint(),
            Main::Mapped(_) => {
                "; if the messages are not in the order of their time, `mcap sort in.mcap -o out.mcap` sorts them"
            }
        }
    }

    /// Reads the next row into `values`, one per column; returns the number of its message, or `None` at the end.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        loop {
            let beside: usize = self.sides.iter().map(|side| side.columns().len()).sum();
            let own = values.len().saturating_sub(beside);
            let found = match &mut self.main {
                Main::Plain(rows) => rows.next_row(layout, &mut values[..own])?,
                Main::Mapped(rows) => rows.next_row(&mut values[..own])?,
            };
            let Some(number) = found else {
                return self.refuse_apart().map(|()| None);
            };
            if self.beside(number, &mut values[own..])? {
                self.check(layout, values, number)?;
                (self.is_met, self.alone) = (true, None);
                return Ok(Some(number));
            }
            if !self.is_met {
                let time = self.time().0;
                let first = self.alone.map_or(time, |(first, _)| first);
                self.alone = Some((first, time));
            }
        }
    }

    /// Returns the time of the last row, ns, and whether it is a header stamp.
    fn time(&self) -> (i128, bool) {
        match &self.main {
            Main::Plain(rows) => rows.time(),
            Main::Mapped(own) => (own.last(), own.rows.is_stamped),
        }
    }

    /// Refuses topics that have no time in common.
    fn refuse_apart(&mut self) -> Result<(), DataError> {
        let Some(rows) = self.alone else {
            return Ok(());
        };
        for side in &mut self.sides {
            let Some((from, to)) = side.range()?.filter(|own| own.0 > rows.1 || own.1 < rows.0)
            else {
                continue;
            };
            let (times, remedy) = match side.is_stamped() {
                true => (
                    "header stamps",
                    "; their clocks are not the same: give --clock log, which takes the times at which messages were logged (stamps of one clock are better where you can record again)",
                ),
                false => ("log times", "; record both at the same time"),
            };
            return Err(DataError::Mapping {
                message: format!(
                    "{}: no row has a value of {}, whose {times} run from {} to {} s, while those of the rows run from {} to {} s{remedy}",
                    self.path.display(),
                    side.topic(),
                    seconds(from),
                    seconds(to),
                    seconds(rows.0),
                    seconds(rows.1),
                ),
            });
        }
        Ok(())
    }

    /// Writes the columns of the other topics; returns false if one of them has none for this row.
    fn beside(&mut self, number: u64, values: &mut [f64]) -> Result<bool, DataError> {
        let (time, is_stamped) = self.time();
        let mut start = 0;
        let mut is_whole = true;
        for side in &mut self.sides {
            if side.is_stamped() != is_stamped {
                let of = |stamped: bool| {
                    if stamped {
                        "header stamps"
                    } else {
                        "log times only"
                    }
                };
                return Err(DataError::Mapping {
                    message: format!(
                        "{}: the messages on {} have {}, but the rows have {}, so their times cannot be compared; give --clock log, which takes the log times of both, or record both with stamps",
                        self.path.display(),
                        side.topic(),
                        of(side.is_stamped()),
                        of(is_stamped)
                    ),
                });
            }
            let end = start + side.columns().len();
            is_whole &= side.at(time, number, &mut values[start..end])?;
            start = end;
        }
        Ok(is_whole)
    }

    /// Checks the values of mapped columns.
    fn check(&self, layout: &Layout, values: &[f64], number: u64) -> Result<(), DataError> {
        match layout.refused(values) {
            Some((_, column, value)) => {
                Err(column.no_measurement(&self.path, Place::Message(number), value))
            }
            None => Ok(()),
        }
    }
}

impl Wanted {
    /// Takes the time of a sample of the own kind, unless another channel is mapped to it; returns its place.
    fn add_own_time(&mut self) -> Option<usize> {
        if self.topic != TOPIC || !self.has_own_time {
            return None;
        }
        self.channels.push("t".into());
        self.stems.push("t".into());
        self.columns.push("t".into());
        Some(self.channels.len() - 1)
    }
}

impl MappedRows {
    /// Returns the time of the last message, ns.
    fn last(&self) -> i128 {
        self.rows.time
    }

    fn next_row(&mut self, values: &mut [f64]) -> Result<Option<u64>, DataError> {
        let Some(time) = self.rows.next_time()? else {
            return Ok(None);
        };
        let origin = *self.origin.get_or_insert(time);
        // Differences below 2⁵³ ns, which is 104 days, are exact.
        let t = (time - origin) as f64 * 1e-9;
        let first = usize::from(self.time.is_none());
        if let (None, Some(place)) = (self.time, values.first_mut()) {
            *place = t;
        }
        for (place, value) in values.iter_mut().skip(first).zip(&self.rows.values) {
            *place = *value;
        }
        self.given = (self.given.0 + 1, t);
        Ok(Some(self.rows.number))
    }

    /// Returns where the time comes from.
    fn remark(&self) -> Option<Remark> {
        let origin = self.origin.filter(|_| self.time.is_none())?;
        let origin = seconds(origin);
        Some(match self.rows.is_stamped {
            true => Remark::Stamp { origin },
            false => Remark::LogTime {
                origin,
                stamp: self.rows.why_logged,
            },
        })
    }
}

/// Returns a time in nanoseconds as text in seconds, without loss of digits.
fn seconds(time: i128) -> String {
    let (whole, rest) = (time / 1_000_000_000, time % 1_000_000_000);
    format!("{whole}.{:09}", rest.abs())
}

/// Returns the topics of the first messages, with the channels of each.
fn topics(files: &[PathBuf]) -> Result<Vec<Found>, DataError> {
    let mut messages = Messages::open(files)?;
    let mut found: Vec<Found> = Vec::new();
    let mut waiting = BTreeMap::new();
    let mut count = 0;
    while count < LOOKED_AT
        && let Some(event) = messages.next_event()?
    {
        match event {
            Event::Channel(number, channel) => {
                if found.iter().all(|topic| topic.name != channel.topic) {
                    if let Ok(decoder) = decoder(channel) {
                        waiting.insert(number, (found.len(), decoder));
                    }
                    let of = channel.schema.as_ref().map(|s| s.name.clone());
                    found.push(Found {
                        name: channel.topic.clone(),
                        of: of.unwrap_or_default(),
                        channels: Vec::new(),
                        stems: Vec::new(),
                    });
                }
            }
            Event::Message { channel, data, .. } => {
                count += 1;
                if let Some((at, decoder)) = waiting.remove(&channel) {
                    let mut flat = FlatMessage::default();
                    if flat.read(data, &decoder).is_ok() {
                        found[at].channels = flat.names;
                        found[at].stems = flat.stems;
                    }
                }
            }
        }
    }
    Ok(found)
}

/// Finds the topics of mapped channels.
fn resolved(path: &Path, files: &[PathBuf], mapping: &Mapping) -> Result<Vec<Wanted>, DataError> {
    let topics = topics(files)?;
    let mut wanted: Vec<Wanted> = Vec::new();
    for (column, channel) in mapping.columns() {
        let bare = channel.trim_start_matches('/');
        let found = topics.iter().find_map(|topic| {
            let name = topic.name.trim_start_matches('/');
            let rest = bare.strip_prefix(name)?.strip_prefix('/')?;
            let k = topic.channels.iter().position(|own| own == rest)?;
            Some((topic, rest, topic.stems.get(k)?))
        });
        let Some((topic, rest, stem)) = found else {
            let names: Vec<String> = topics.iter().map(|topic| topic.name.clone()).collect();
            return Err(DataError::Mapping {
                message: format!(
                    "{} has no channel `{channel}`, which is to be `{column}`; its topics are {}, and `rig inspect {}` lists their channels",
                    path.display(),
                    shown(&names),
                    path.display()
                ),
            });
        };
        let known = wanted.iter().position(|own| own.topic == topic.name);
        let at = known.unwrap_or(wanted.len());
        if known.is_none() {
            wanted.push(Wanted {
                topic: topic.name.clone(),
                ..Wanted::default()
            });
        }
        wanted[at].channels.push(rest.to_owned());
        wanted[at].stems.push(stem.clone());
        wanted[at].columns.push(column.clone());
        wanted[at].has_own_time = topic.channels.iter().any(|own| own == "t");
    }
    for own in &mut wanted {
        own.has_own_time &= own.channels.iter().all(|channel| channel != "t");
    }
    Ok(wanted)
}
