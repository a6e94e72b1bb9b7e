//! A recording as a stream of blocks that can be read repeatedly.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use super::block::{Block, JointColumns, append, stretch};
use super::bursts::{Changes, bursts};
use super::columns::{EffortNeed, Layout, Role};
use super::csv::CsvRows;
use super::error::{DataError, Warning};
use super::form::Form;
use super::header::Header;
use super::joined_rows::JoinedRows;
use super::layout::layout;
use super::mapping::Mapping;
use super::missing_rows::{BESIDE, MissingRows, filled, last_rows};
use super::motors::{MotorPass, MotorSide};
use super::parquet::ParquetRows;
use super::place::Place;
use super::quantity::Quantity;
use super::remark::Remark;
use super::rounded_time::RoundedTime;
use super::sampling::Sampling;
use super::table_rows::TableRows;
use rig_model::robot::Robot;
use rig_output::format_trimmed;

/// Number of rows that determine the sample period.
const PROBED_ROWS: usize = 1001;

/// Number of warnings kept per recording; more are only counted, so that memory does not grow.
pub const KEPT_WARNINGS: usize = 1000;

/// Number of rows by which a block may be longer before missing rows are interpolated, so that it does not end beside a
/// gap.
const BESIDE_A_GAP: usize = 64;

/// A recording whose header fits the robot.
#[derive(Clone, Debug)]
pub struct Source {
    path: PathBuf,
    /// Names of the robot's joints.
    joints: Vec<String>,
    pub(super) layout: Layout,
    sampling: Sampling,
    form: Form,
    mapping: Mapping,
    bytes: u64,
}

/// Reader of the rows of any format.
enum Reader {
    Csv(Box<CsvRows>),
    Messages(Box<JoinedRows>),
    Arrays(Box<TableRows>),
    Parquet(Box<ParquetRows>),
}

/// Rows of a recording of any format, without exact copies of the row before.
pub(super) struct Rows {
    reader: Reader,
    /// Values of the last row, in the units of the file.
    last: Vec<f64>,
    /// Number of copies so far.
    copies: u64,
    /// Place of the first copy.
    first_copy: Option<Place>,
}

impl Rows {
    fn open(
        path: &Path,
        form: &Form,
        joints: &[String],
        mapping: &Mapping,
    ) -> Result<(Self, Header), DataError> {
        let (reader, mut header) = match form {
            Form::Messages(files) => {
                let (rows, header) = JoinedRows::open(path, files, joints, mapping)?;
                (Reader::Messages(Box::new(rows)), header)
            }
            Form::Csv => {
                let (rows, mut header) = CsvRows::open(path)?;
                mapping.rename(path, &mut header)?;
                (Reader::Csv(Box::new(rows)), header)
            }
            Form::Arrays(form) => {
                let (rows, mut header) = TableRows::open(path, *form)?;
                let renamed = mapping.rename(path, &mut header);
                renamed.map_err(|error| error.explained(&rows.remarks()))?;
                (Reader::Arrays(Box::new(rows)), header)
            }
            Form::Parquet => {
                let (rows, mut header) = ParquetRows::open(path)?;
                let renamed = mapping.rename(path, &mut header);
                renamed.map_err(|error| error.explained(&rows.remarks()))?;
                (Reader::Parquet(Box::new(rows)), header)
            }
        };
        let rows = Self {
            reader,
            last: Vec::new(),
            copies: 0,
            first_copy: None,
        };
        let set = mapping.set_units(path, joints, &mut header);
        set.map_err(|error| error.explained(header.remarks.iter().chain(&rows.remarks())))?;
        Ok((rows, header))
    }

    /// Returns the assumptions and omissions so far.
    pub(super) fn remarks(&self) -> Vec<Remark> {
        let mut remarks = match &self.reader {
            Reader::Csv(r) => r.remarks(),
            Reader::Messages(r) => r.remarks(),
            Reader::Arrays(r) => r.remarks(),
            Reader::Parquet(r) => r.remarks(),
        };
        remarks.extend(self.first_copy.map(|first| Remark::Copies {
            rows: self.copies,
            first,
        }));
        remarks
    }

    /// Returns the place of a row as its user finds it.
    fn place(&self, row: u64) -> Place {
        match &self.reader {
            Reader::Csv(_) => Place::Line(row),
            Reader::Messages(_) => Place::Message(row),
            Reader::Arrays(_) | Reader::Parquet(_) => Place::Row(row),
        }
    }

    /// Checks that time grows from row to row.
    pub(super) fn check_growth(
        &self,
        path: &Path,
        row: u64,
        previous: Option<f64>,
        now: f64,
    ) -> Result<(), DataError> {
        let hint = match &self.reader {
            Reader::Messages(r) if previous.is_some_and(|before| now < before) => r.order_hint(),
            _ => "",
        };
        match previous {
            Some(previous) if now <= previous => Err(DataError::TimeNotGrowing {
                path: path.into(),
                place: self.place(row),
                previous,
                now,
                hint,
            }),
            _ => Ok(()),
        }
    }

    /// Reads the next row in SI units into `values`.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        let row = self.next_raw(layout, values);
        layout.convert(values);
        row
    }

    /// Reads the next row in the units of the file into `values`. Counts exact copies of the row before and leaves them out.
    fn next_raw(&mut self, layout: &Layout, values: &mut [f64]) -> Result<Option<u64>, DataError> {
        loop {
            let read = match &mut self.reader {
                Reader::Csv(r) => r.next_row(layout, values),
                Reader::Messages(r) => r.next_row(layout, values),
                Reader::Arrays(r) => r.next_row(layout, values),
                Reader::Parquet(r) => r.next_row(layout, values),
            };
            let Some(row) = read? else {
                return Ok(None);
            };
            // Text that is no number is NaN in both rows.
            let is_same = |(a, b): (&f64, &f64)| a == b || a.is_nan() && b.is_nan();
            let pairs = values.iter().zip(&self.last);
            if self.last.len() != values.len() || !pairs.into_iter().all(is_same) {
                self.last.clear();
                self.last.extend_from_slice(values);
                return Ok(Some(row));
            }
            self.copies += 1;
            self.first_copy = self.first_copy.or(Some(self.place(row)));
        }
    }

    pub(super) fn bytes_read(&self) -> u64 {
        match &self.reader {
            Reader::Csv(r) => r.bytes_read(),
            Reader::Messages(r) => r.bytes_read(),
            Reader::Arrays(r) => r.bytes_read(),
            Reader::Parquet(r) => r.bytes_read(),
        }
    }
}

impl Source {
    /// Opens a recording (CSV, MCAP or a folder of rosbag2, detected from its content) in which every joint has its torque.
    ///
    /// Reads the header and the first 1001 rows and reports their errors; [`Blocks`] reports later ones.
    pub fn open(path: &Path, robot: &Robot) -> Result<Self, DataError> {
        Self::open_with(path, robot, EffortNeed::Required)
    }

    /// Opens a recording like [`Source::open`]; `need` says whether the torque may be missing.
    pub fn open_with(path: &Path, robot: &Robot, need: EffortNeed) -> Result<Self, DataError> {
        Self::open_mapped(path, robot, need, &Mapping::default())
    }

    /// Opens a recording like [`Source::open_with`]; `mapping` says which channels of the file are its columns.
    pub fn open_mapped(
        path: &Path,
        robot: &Robot,
        need: EffortNeed,
        mapping: &Mapping,
    ) -> Result<Self, DataError> {
        let (form, bytes) = Form::of(path)?;
        let joints: Vec<String> = robot.joints.iter().map(|j| j.name.clone()).collect();
        let (mut rows, header) = Rows::open(path, &form, &joints, mapping)?;
        let mut layout = layout(path, &header, robot, (need, mapping.wants_wrench))
            .map_err(|error| error.explained(header.remarks.iter().chain(&rows.remarks())))?;
        layout.require_numbers(mapping.numbers());
        let mut values = vec![0.0; layout.columns.len()];
        let (mut times, mut changes) = (Vec::new(), Changes::of(&layout));
        while times.len() < PROBED_ROWS
            && let Some(line) = rows.next_raw(&layout, &mut values)?
        {
            if times.is_empty() {
                if header.units.get(layout.time).is_none_or(Option::is_none) {
                    layout.guess_unit_of_time(&values);
                }
                layout.count_from(&values);
            }
            layout.convert(&mut values);
            let now = values[layout.time];
            rows.check_growth(path, line, times.last().copied(), now)?;
            times.push(now);
            changes.push(&values);
        }
        if times.is_empty() {
            return Err(DataError::NoRows { path: path.into() });
        }
        if let Some(found) = bursts(&times, &changes.sizes) {
            return Err(DataError::Bursts {
                path: path.into(),
                rows: found.rows,
                rate: format_trimmed(found.rate, 4),
            });
        }
        let sampling = Sampling::of(&times);
        // What the end of the file shows is reported by the pass that reaches it.
        let rounded = (sampling.resolution > 0.0).then_some(Remark::RoundedStamps {
            resolution: sampling.resolution,
        });
        let remarks = header
            .remarks
            .iter()
            .cloned()
            .chain(rows.remarks())
            .chain(rounded);
        let is_late = |r: &Remark| {
            matches!(
                r,
                Remark::CutOff { .. }
                    | Remark::LeftOut { .. }
                    | Remark::CutRow { .. }
                    | Remark::OpenEnd { .. }
                    | Remark::Copies { .. }
                    | Remark::MissingRows { .. }
            )
        };
        let kept = remarks.filter(|remark| !is_late(remark));
        layout
            .warnings
            .extend(kept.map(|remark| Warning::Reading { remark }));
        Ok(Self {
            path: path.into(),
            joints,
            layout,
            sampling,
            form,
            mapping: mapping.clone(),
            bytes,
        })
    }

    /// Opens the rows for another pass.
    pub(super) fn rows(&self) -> Result<Rows, DataError> {
        Rows::open(&self.path, &self.form, &self.joints, &self.mapping).map(|(rows, _)| rows)
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the length of the file in bytes, for progress.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns the sampling of the recording.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// Returns true if the joints have a torque: their own, or from motor currents or torques.
    pub fn has_effort(&self) -> bool {
        let effort = |role| matches!(role, Role::Effort(..) | Role::MotorEffort(..));
        self.layout.columns.iter().any(|c| effort(c.role))
    }

    /// Returns true if the joints have a motor voltage: their own, or a duty cycle with its supply.
    pub fn has_voltage(&self) -> bool {
        let voltage = |role| matches!(role, Role::Voltage(_) | Role::Duty(..));
        self.layout.columns.iter().any(|c| voltage(c.role))
    }

    /// Returns the number of joints of the robot.
    pub fn joint_count(&self) -> usize {
        self.layout.joints
    }

    /// Returns the names of the file's columns in order.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.layout.columns.iter().map(|c| c.name.as_str())
    }

    /// Returns the file's name, without quotation marks, for the column that a joint's values come from. Examples: `i1`
    /// for a torque computed from a current, `qm2` for a motor position, `effort of joint "elbow"` in a ROS 2
    /// recording, and `tau2 (from i1, i2)` for several columns. Returns the standard name (`tau1`) if the file has no
    /// such column.
    ///
    /// `joint` counts from 0. Messages use this name so that the user finds the column in the file.
    pub fn column_name(&self, joint: usize, quantity: Quantity) -> String {
        self.layout.column_name(joint, quantity)
    }

    /// Returns the place of a row as its user finds it: line of a text file, message of an MCAP file.
    pub fn place(&self, row: u64) -> Place {
        match self.form {
            Form::Messages(_) => Place::Message(row),
            Form::Csv => Place::Line(row),
            Form::Arrays(_) | Form::Parquet => Place::Row(row),
        }
    }

    /// Returns the warnings about the header; [`Blocks::warnings`] adds those about the rows.
    pub fn warnings(&self) -> &[Warning] {
        &self.layout.warnings
    }

    /// Reads the recording once, in blocks of at most `rows_per_block` rows (at least 1). A block ends early before a
    /// gap or an uneven step in time. Up to four missing rows in a row of an even clock are interpolated, and a warning
    /// counts them. After an error there are no further blocks.
    pub fn blocks(&self, rows_per_block: usize) -> Blocks<'_> {
        Blocks {
            source: self,
            rows_per_block: rows_per_block.max(1),
            rows: None,
            values: vec![0.0; self.layout.columns.len()],
            pending: None,
            previous: None,
            ahead: None,
            pardoned: false,
            continues: false,
            finished: false,
            warnings: Vec::new(),
            gaps: 0,
            named_extras: vec![false; self.layout.columns.len()],
            motors: self.layout.motors.as_ref().map(MotorSide::pass),
            rounded: self.sampling.corrected(),
            missing: MissingRows::default(),
            since_gap: BESIDE,
            has_gaps: false,
            context: Block::default(),
            ready: VecDeque::new(),
        }
    }

    /// Reads the whole recording: one block per evenly sampled stretch, and the warnings.
    pub fn read_all(&self) -> Result<(Vec<Block>, Vec<Warning>), DataError> {
        let mut blocks = self.blocks(usize::MAX);
        let mut all = Vec::new();
        for block in blocks.by_ref() {
            all.push(block?);
        }
        let warnings = [self.warnings(), blocks.warnings()].concat();
        Ok((all, warnings))
    }
}

/// Returns the names of a recording's columns in order, without a robot: those of the header line, or of the first
/// message of an MCAP file. For a ROS 2 recording it is `t` alone, because its other columns are joints of a robot.
///
/// # Errors
/// [`DataError`]: a file that cannot be read or is not a recording.
pub fn column_names(path: &Path) -> Result<Vec<String>, DataError> {
    let (form, _) = Form::of(path)?;
    let (_, header) = Rows::open(path, &form, &[], &Mapping::default())?;
    Ok(header.names)
}

/// One pass over a recording; see [`Source::blocks`].
pub struct Blocks<'a> {
    source: &'a Source,
    rows_per_block: usize,
    rows: Option<Rows>,
    values: Vec<f64>,
    /// Line of the row in `values` that is not yet in a block.
    pending: Option<u64>,
    previous: Option<f64>,
    /// A row that was read to check the one before it.
    ahead: Option<(u64, Vec<f64>)>,
    /// True if the next interval compensates for a misplaced time stamp.
    pardoned: bool,
    continues: bool,
    finished: bool,
    warnings: Vec<Warning>,
    gaps: u64,
    named_extras: Vec<bool>,
    motors: Option<MotorPass>,
    /// Correction of rounded stamps.
    rounded: Option<RoundedTime>,
    /// Rows that are interpolated.
    missing: MissingRows,
    /// Number of rows since the last gap that is interpolated.
    since_gap: usize,
    /// True if rows of the next block, or in front of it, are missing.
    has_gaps: bool,
    /// The last rows of the block before.
    context: Block,
    /// Blocks that are complete.
    ready: VecDeque<Block>,
}

impl Blocks<'_> {
    /// Returns the warnings about the rows so far; at most 1000 are kept.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Returns the number of gaps and uneven steps so far.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Returns the number of bytes read so far, for progress.
    pub fn bytes_read(&self) -> u64 {
        self.rows.as_ref().map_or(0, Rows::bytes_read)
    }

    fn warn(&mut self, warning: Warning) {
        if self.warnings.len() < KEPT_WARNINGS {
            self.warnings.push(warning);
        }
    }

    /// Adds the warnings that concern the whole file.
    fn hear_the_rows(&mut self) {
        let mut remarks = self.rows.as_ref().map(Rows::remarks).unwrap_or_default();
        remarks.extend(self.missing.first.map(|first| Remark::MissingRows {
            rows: self.missing.rows,
            places: self.missing.places,
            most: self.missing.most,
            first,
        }));
        for remark in remarks {
            let warning = Warning::Reading { remark };
            if !self.source.warnings().contains(&warning) {
                self.warn(warning);
            }
        }
    }

    fn empty_block(&self, first_line: u64) -> Block {
        let layout = &self.source.layout;
        let room = self.rows_per_block.min(1 << 16);
        let column = || Vec::with_capacity(room);
        let mut block = Block {
            t: column(),
            joints: vec![JointColumns::default(); layout.joints],
            extra: Vec::with_capacity(layout.extras),
            first_line,
            interpolated: Vec::new(),
            continues: self.continues,
        };
        for c in &layout.columns {
            if c.extra.is_some() {
                block.extra.push((c.name.clone(), column()));
            }
            let Some(joint) = joint_of(c.role).and_then(|k| block.joints.get_mut(k)) else {
                continue;
            };
            match c.role {
                Role::Position(_) | Role::MotorPosition(_) => joint.q = column(),
                Role::Effort(..) => joint.tau = column(),
                Role::Velocity(_) => joint.qd = Some(column()),
                Role::Acceleration(_) => joint.qdd = Some(column()),
                Role::Reference(_) => joint.reference = Some(column()),
                Role::Voltage(_) | Role::Duty(..) => joint.voltage = Some(column()),
                Role::Temperature(_) => joint.temperature = Some(column()),
                Role::LinkPosition(_) => joint.link = Some(column()),
                Role::Time | Role::None | Role::MotorEffort(..) => {}
            }
        }
        if let Some(motors) = &layout.motors {
            for (joint, turned) in block.joints.iter_mut().zip(&motors.torques) {
                if *turned {
                    joint.tau = column();
                }
            }
        }
        block
    }

    fn push_row(&mut self, block: &mut Block, line: u64) -> Result<(), DataError> {
        let source = self.source;
        let layout = &source.layout;
        for (i, (c, &value)) in layout.columns.iter().zip(&self.values).enumerate() {
            if let Some((_, column)) = c.extra.and_then(|e| block.extra.get_mut(e)) {
                column.push(value);
                if value.is_nan() && !self.named_extras[i] {
                    self.named_extras[i] = true;
                    // At most one per column, so no limit is needed.
                    self.warnings.push(Warning::ExtraNotANumber {
                        place: source.place(line),
                        column: c.name.clone(),
                    });
                }
            }
            if c.role == Role::Time {
                block.t.push(value);
            }
            let Some(joint) = joint_of(c.role).and_then(|k| block.joints.get_mut(k)) else {
                continue;
            };
            let (column, value) = match c.role {
                Role::Position(_) => (Some(&mut joint.q), value),
                Role::Effort(_, factor) => (Some(&mut joint.tau), value * factor),
                Role::Velocity(_) => (joint.qd.as_mut(), value),
                Role::Acceleration(_) => (joint.qdd.as_mut(), value),
                Role::Reference(_) => (joint.reference.as_mut(), value),
                Role::Voltage(_) => (joint.voltage.as_mut(), value),
                Role::Duty(_, supply, scale) => {
                    let share = signed_register(value) * scale;
                    (joint.voltage.as_mut(), share * self.values[supply])
                }
                Role::Temperature(_) => (joint.temperature.as_mut(), value),
                Role::LinkPosition(_) => (joint.link.as_mut(), value),
                Role::MotorPosition(k) => {
                    set(self.motors.as_mut().map(|m| &mut m.psi), k, value);
                    (None, value)
                }
                Role::MotorEffort(k, factor) => {
                    let torque = value * factor;
                    set(self.motors.as_mut().map(|m| &mut m.tau_motor), k, torque);
                    (None, value)
                }
                Role::Time | Role::None => (None, value),
            };
            if let (Role::Position(k), Some(motors)) = (c.role, self.motors.as_mut()) {
                set(Some(&mut motors.q), k, value);
            }
            if let Some(column) = column {
                column.push(value);
            }
        }
        let (Some(side), Some(motors)) = (&layout.motors, self.motors.as_mut()) else {
            return Ok(());
        };
        motors.turn(side).map_err(|error| DataError::Motors {
            path: source.path.clone(),
            place: source.place(line),
            message: error.to_string(),
        })?;
        for (k, joint) in block.joints.iter_mut().enumerate() {
            if side.positions {
                joint.q.push(motors.q[k]);
            }
            if side.torques[k] {
                joint.tau.push(motors.tau[k]);
            }
        }
        Ok(())
    }

    /// Reads the next row into `values` and returns its line.
    fn fetch(&mut self) -> Result<Option<u64>, DataError> {
        if let Some((line, values)) = self.ahead.take() {
            self.values = values;
            return Ok(Some(line));
        }
        if let (None, Some(rows)) = (&self.rounded, self.rows.as_mut()) {
            return rows.next_row(&self.source.layout, &mut self.values);
        }
        let Some((line, values)) = self.next_row()? else {
            return Ok(None);
        };
        self.values = values;
        Ok(Some(line))
    }

    /// Reads the next row: its line and its values, the time among them corrected if the stamps are rounded.
    fn next_row(&mut self) -> Result<Option<(u64, Vec<f64>)>, DataError> {
        let source = self.source;
        let Some(rows) = self.rows.as_mut() else {
            return Ok(None);
        };
        let time = source.layout.time;
        loop {
            let mut values = vec![0.0; self.values.len()];
            let full = self.rounded.as_ref().is_some_and(RoundedTime::is_full);
            let read = match full {
                true => None,
                false => rows.next_row(&source.layout, &mut values)?,
            };
            let Some(rounded) = self.rounded.as_mut() else {
                return Ok(read.map(|line| (line, values)));
            };
            let Some(line) = read else {
                return Ok(rounded.pop().map(|(line, now, mut values)| {
                    values[time] = now;
                    (line, values)
                }));
            };
            rows.check_growth(&source.path, line, rounded.last_stamp(), values[time])?;
            rounded.push(line, values[time], values);
        }
    }

    /// Returns true if only the last time stamp is off the even grid: the next row is on it again. A clock that is read
    /// late causes this; no row is missing or doubled.
    fn misplaced(&mut self, line: u64, from: f64, now: f64) -> Result<bool, DataError> {
        let sampling = self.source.sampling;
        if sampling.irregular {
            return Ok(false);
        }
        let Some((next, values)) = self.next_row()? else {
            return Ok(false);
        };
        let then = values[self.source.layout.time];
        self.ahead = Some((next, values));
        self.pardoned = sampling.fits_twice(then - from);
        if self.pardoned {
            self.warn(Warning::Misplaced {
                place: self.source.place(line),
                off: now - from - sampling.period,
            });
        }
        Ok(self.pardoned)
    }

    /// Ends the stretch before the row at `now`.
    fn part(&mut self, line: u64, from: f64, now: f64) {
        self.gaps += 1;
        self.warn((self.source.sampling).parting(self.source.place(line), from, now));
        self.continues = false;
        self.since_gap = BESIDE;
    }

    /// Counts the rows that are missing before the row at `now`, to be interpolated.
    fn count_missing(&mut self, line: u64, from: f64, now: f64) {
        let rows = self.source.sampling.missing(now - from);
        if rows > 0 {
            self.missing.count(rows, self.source.place(line));
            (self.since_gap, self.has_gaps) = (0, true);
        }
    }

    /// Returns the next block with its missing rows.
    fn next_block(&mut self) -> Result<Option<Block>, DataError> {
        if let Some(block) = self.ready.pop_front() {
            return Ok(Some(block));
        }
        let Some(block) = self.next_recorded()? else {
            return Ok(None);
        };
        if !block.continues {
            self.context = Block::default();
        }
        if !std::mem::take(&mut self.has_gaps) {
            let mut rows = std::mem::take(&mut self.context);
            append(&mut rows, last_rows(&block));
            self.context = last_rows(&rows);
            return Ok(Some(block));
        }
        let all = filled(&mut self.context, block, &self.source.sampling);
        let starts = (0..all.len()).step_by(self.rows_per_block);
        let parts = starts.map(|from| {
            let end = from.saturating_add(self.rows_per_block);
            stretch(&all, from, end.min(all.len()))
        });
        self.ready = parts.collect();
        Ok(self.ready.pop_front())
    }

    /// Returns true if a block may end here.
    fn is_full(&self, block: &Block) -> bool {
        let most = self.rows_per_block.saturating_add(BESIDE_A_GAP);
        block.len() >= most || block.len() >= self.rows_per_block && self.since_gap >= BESIDE
    }

    fn next_recorded(&mut self) -> Result<Option<Block>, DataError> {
        let source = self.source;
        if self.rows.is_none() {
            self.rows = Some(source.rows()?);
        }
        let mut block: Option<Block> = None;
        loop {
            if block.as_ref().is_some_and(|block| self.is_full(block)) {
                self.continues = true;
                return Ok(block);
            }
            let line = match self.pending.take() {
                Some(line) => line,
                None => {
                    let Some(line) = self.fetch()? else {
                        self.finished = true;
                        self.hear_the_rows();
                        return Ok(block);
                    };
                    let now = self.values[source.layout.time];
                    if let Some(rows) = &self.rows {
                        rows.check_growth(&source.path, line, self.previous, now)?;
                    }
                    let before = self.previous.replace(now);
                    let pardoned = std::mem::take(&mut self.pardoned);
                    self.since_gap = self.since_gap.saturating_add(1);
                    if let Some(from) = before
                        && !pardoned
                        && source.sampling.is_uneven(now - from)
                        && !self.misplaced(line, from, now)?
                    {
                        if !source.sampling.parts(now - from) {
                            self.count_missing(line, from, now);
                        } else {
                            self.part(line, from, now);
                            if block.is_some() {
                                self.pending = Some(line);
                                return Ok(block);
                            }
                        }
                    }
                    line
                }
            };
            let mut current = match block.take() {
                Some(current) => current,
                None => self.empty_block(line),
            };
            self.push_row(&mut current, line)?;
            block = Some(current);
        }
    }
}

/// Returns the joint that a role belongs to.
fn joint_of(role: Role) -> Option<usize> {
    match role {
        Role::Time | Role::None => None,
        Role::Position(k)
        | Role::Effort(k, _)
        | Role::Velocity(k)
        | Role::Acceleration(k)
        | Role::Reference(k)
        | Role::Voltage(k)
        | Role::Duty(k, ..)
        | Role::MotorPosition(k)
        | Role::MotorEffort(k, _)
        | Role::Temperature(k)
        | Role::LinkPosition(k) => Some(k),
    }
}

/// Restores the sign of a duty cycle from a 16-bit register (two's complement). No real duty cycle is in the upper half
/// of its range.
fn signed_register(value: f64) -> f64 {
    if value > f64::from(i16::MAX) && value <= f64::from(u16::MAX) {
        value - 65_536.0
    } else {
        value
    }
}

fn set(list: Option<&mut Vec<f64>>, k: usize, value: f64) {
    if let Some(entry) = list.and_then(|l| l.get_mut(k)) {
        *entry = value;
    }
}

impl Iterator for Blocks<'_> {
    type Item = Result<Block, DataError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.finished {
            return None;
        }
        let block = self.next_block().transpose();
        if !matches!(block, Some(Ok(_))) {
            self.finished = true;
        }
        block
    }
}
