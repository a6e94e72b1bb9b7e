//! Inputs that several commands share: a robot description and recordings, checked before any work begins.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::same_file::{is_copy, is_same};
use super::ui::{Progress, Ui};
use rig_data::prepare::{LongestPart, PrepareError, Recording};
use rig_data::{
    Block, EffortNeed, Implausible, JUDGED_ROWS, KEPT_WARNINGS, Mapping, Source, StrangeReference,
    Warning, implausible_positions, plausibility, strange_rates, strange_references,
};
use rig_diagnose::faults::faults_at_start;
use rig_model::robot::{Description, Joint, JointKind, Robot};
use rig_output::{Finding, format_significant, listed, one_a_kind, worst_first};

/// The robot description.
#[derive(Debug, ClapArgs)]
pub(crate) struct RobotArg {
    /// Robot description, TOML, URDF or MJCF (`rig init` writes one to start from)
    #[arg(long = "robot", value_name = "FILE")]
    path: PathBuf,
    #[command(flatten)]
    chain: ChainArg,
}

impl RobotArg {
    /// Returns the file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the chain that the options select.
    pub(crate) fn chain(&self) -> &ChainArg {
        &self.chain
    }

    /// Returns a remark if the robot is a URDF file and a TOML description of the same name exists beside it.
    pub(crate) fn fuller(&self) -> Option<String> {
        let urdf = self.path.extension().is_some_and(|end| end == "urdf");
        let beside = self.path.with_extension("toml");
        (urdf && beside.is_file()).then(|| {
            format!(
                "A URDF cannot hold drive inertias, constant torques or effects, so this prediction lacks them; {} has them.",
                beside.display()
            )
        })
    }

    /// Loads the robot.
    ///
    /// # Errors
    /// Names the error in the file and its line.
    pub(crate) fn load(&self, ui: &Ui) -> Result<Robot, CommandError> {
        Ok(self.describe(ui)?.robot)
    }

    /// Loads the robot whose values go into another URDF file, which the options on the chain concern: a TOML has one.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub(crate) fn describe_for_another(&self, ui: &Ui) -> Result<Description, CommandError> {
        let toml = self.path.extension().is_some_and(|end| end == "toml");
        let none = ChainArg::default();
        described(&self.path, if toml { &none } else { &self.chain }, ui)
    }

    /// Loads the robot together with the file that it was read from.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub(crate) fn describe(&self, ui: &Ui) -> Result<Description, CommandError> {
        described(&self.path, &self.chain, ui)
    }
}

/// Loads a description and prints its remarks.
///
/// # Errors
/// Names the error in the file and its line.
pub(crate) fn described(
    path: &Path,
    chain: &ChainArg,
    ui: &Ui,
) -> Result<Description, CommandError> {
    let description = Description::load_chain(path, &chain.choice())?;
    for remark in &description.remarks {
        match description.notes.contains(remark) {
            true => ui.note(remark),
            false => ui.warn(remark),
        }
    }
    Ok(description)
}

/// Faults found in the columns of recordings, one sentence each.
#[derive(Default)]
pub struct Faults {
    /// Certain faults: the columns cannot be right.
    pub wrong: Vec<String>,
    /// Certain faults of the description.
    pub described: Vec<String>,
    /// Possible faults: the description may be wrong instead, or the motion is too short to decide.
    pub doubtful: Vec<String>,
}

/// Recordings that fit the robot.
pub struct Inputs {
    sources: Vec<Source>,
    /// Warnings about the rows of each recording, from the pass that read the most.
    heard: Vec<RefCell<Vec<Warning>>>,
    /// Position limits of each joint.
    ranges: Vec<Range>,
    /// For each recording: positions beyond these limits, from the pass that read the most rows.
    outside: Vec<RefCell<Outside>>,
    /// Sentences about rows that were not checked for faults.
    unchecked: RefCell<Vec<String>>,
    /// The units that the user gave, with their columns.
    units: Vec<(String, &'static str)>,
}

/// Name of a joint, its finite position limits (if any) and its unit.
struct Range {
    joint: String,
    limits: Option<[f64; 2]>,
    unit: &'static str,
}

impl Range {
    fn of(joint: &Joint) -> Self {
        let limits = joint.limits.as_ref().map(|limits| limits.position);
        Self {
            joint: joint.name.clone(),
            limits: limits.filter(|[low, high]| low.is_finite() && high.is_finite()),
            unit: match joint.kind {
                JointKind::Revolute => "rad",
                JointKind::Prismatic => "m",
            },
        }
    }
}

/// Positions beyond the limits.
#[derive(Clone, Debug, Default)]
struct Outside {
    rows: u64,
    /// For each joint: number of rows beyond the limits, and the largest excess.
    joints: Vec<(u64, f64)>,
}

/// Share of the position range by which rounding alone can put a position beyond its limit.
const ROUNDING: f64 = 1e-6;

impl Outside {
    fn take(&mut self, block: &Block, ranges: &[Range]) {
        self.rows += block.len() as u64;
        self.joints.resize(ranges.len(), (0, 0.0));
        for ((own, range), columns) in self.joints.iter_mut().zip(ranges).zip(&block.joints) {
            let Some([low, high]) = range.limits else {
                continue;
            };
            let least = ROUNDING * (high - low);
            for q in &columns.q {
                let beyond = (q - high).max(low - q);
                if beyond > least {
                    own.0 += 1;
                    own.1 = own.1.max(beyond);
                }
            }
        }
    }
}

/// Returns the longest part of the first rows of a recording.
fn first_part(source: &Source) -> Result<LongestPart, CommandError> {
    let mut found = LongestPart::among(JUDGED_ROWS);
    for block in source.blocks(JUDGED_ROWS) {
        if !found.push(&block?) {
            break;
        }
    }
    Ok(found)
}

/// Applies the check `look` to the first rows of a recording.
fn at_start<T>(
    source: &Source,
    robot: &Robot,
    look: fn(&Block, &Robot) -> Vec<T>,
) -> Result<Vec<T>, CommandError> {
    Ok(look(&first_part(source)?.rows(), robot))
}

/// Puts all faults of a recording into one sentence.
fn sentence(source: &Source, wrong: &[Implausible]) -> String {
    let placed = |own: &Implausible| own.clone().placed(&|row| source.place(row)).to_string();
    let all: Vec<String> = wrong.iter().map(placed).collect();
    let text = source.in_its_names(&all.join("; "));
    format!("{}: {text}.", source.path().display())
}

/// Puts the positions of a recording that look like degrees into one sentence with the option that converts them; `None` if
/// there are none.
fn degrees(source: &Source, robot: &Robot, wrong: &[Implausible]) -> Option<String> {
    let is_of = |own: &&Implausible| matches!(own, Implausible::Degrees { .. });
    let found: Vec<&Implausible> = wrong.iter().filter(is_of).collect();
    let columns: Vec<String> = found.iter().map(|own| own.column()).collect();
    let text = match found.as_slice() {
        [] => return None,
        [one] => one.to_string(),
        [first, ..] => format!(
            "{} look like degrees; give them in rad (for instance {first})",
            listed(&columns)
        ),
    };
    let turns = |joint: &Joint| joint.kind == JointKind::Revolute;
    let options = match columns.len() == robot.joints.len() && robot.joints.iter().all(turns) {
        true if columns.len() > 1 => "--unit q=deg".to_owned(),
        _ => {
            let options = columns.iter().map(|own| format!("--unit {own}=deg"));
            options.collect::<Vec<_>>().join(" ")
        }
    };
    let text = source.in_its_names(&text);
    Some(format!(
        "{}: {text}; {options} converts them.",
        source.path().display()
    ))
}

/// Returns true if the scale of a position or of an effort is wrong, whether or not the rows are a motion.
fn is_scale(problem: &Implausible) -> bool {
    matches!(
        problem,
        Implausible::Degrees { .. }
            | Implausible::Position { .. }
            | Implausible::EffortTooLarge { .. }
            | Implausible::EffortTooSmall { .. }
    )
}

impl Inputs {
    /// Opens recordings and checks their columns.
    ///
    /// # Errors
    /// Names the error, its file and its line.
    pub fn read(robot: &Robot, paths: &[PathBuf]) -> Result<Self, CommandError> {
        Self::read_with(robot, paths, EffortNeed::Required)
    }

    /// As [`Self::read`]; `need` tells whether the torque may be missing.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_with(
        robot: &Robot,
        paths: &[PathBuf],
        need: EffortNeed,
    ) -> Result<Self, CommandError> {
        Self::read_mapped(robot, paths, need, &Mapping::default())
    }

    /// As [`Self::read_with`]; `mapping` says which channels are the columns.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_mapped(
        robot: &Robot,
        paths: &[PathBuf],
        need: EffortNeed,
        mapping: &Mapping,
    ) -> Result<Self, CommandError> {
        let sources = paths
            .iter()
            .map(|path| Source::open_mapped(path, robot, need, mapping))
            .collect::<Result<Vec<_>, _>>()?;
        let heard = sources.iter().map(|_| RefCell::default()).collect();
        let outside = sources.iter().map(|_| RefCell::default()).collect();
        Ok(Self {
            sources,
            heard,
            ranges: robot.joints.iter().map(Range::of).collect(),
            outside,
            unchecked: RefCell::default(),
            units: (mapping.units())
                .map(|(column, unit)| (column.to_owned(), unit))
                .collect(),
        })
    }

    /// Refuses columns whose units look wrong. Of recordings of fewer than `least` rows only the range of the positions is
    /// checked: rows of single poses are no motion.
    ///
    /// # Errors
    /// Names the error in a file and its line. One sentence lists all units that look wrong.
    pub(crate) fn refuse_units(&self, robot: &Robot, least: usize) -> Result<(), CommandError> {
        self.refuse_implausible(|block| match block.len() < least {
            true => implausible_positions(block, robot),
            false => {
                let mut found = plausibility(block, robot);
                found.retain(|problem| !problem.is_doubt());
                found
            }
        })
    }

    /// Refuses positions and efforts whose scale is wrong by the limits, also of recordings that are no motion: joints
    /// that are held, or that move little and slowly.
    ///
    /// # Errors
    /// As [`Self::refuse_units`].
    pub(crate) fn refuse_scales(&self, robot: &Robot) -> Result<(), CommandError> {
        self.refuse_implausible(|block| {
            let mut found = plausibility(block, robot);
            found.retain(is_scale);
            found
        })
    }

    /// Adds the units that the user gave to the columns that a sentence names: they are the first suspects.
    fn with_given_units(&self, text: String) -> String {
        let is_of = |word: &str, column: &str| {
            let number = word.strip_prefix(column);
            number.is_some_and(|rest| rest.bytes().all(|b| b.is_ascii_digit()))
        };
        // `t = 1.5 s` is a time, not the column.
        let searched = text.replace("t = ", "");
        let names = |column: &str| {
            let mut words = searched.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            words.any(|word| is_of(word, column))
        };
        let given: Vec<String> = (self.units.iter())
            .filter(|(column, _)| names(column))
            .map(|(column, unit)| format!("{column}={unit}"))
            .collect();
        match given.is_empty() {
            true => text,
            false => format!("{text} Check the given unit first: {}.", given.join(", ")),
        }
    }

    fn refuse_implausible(
        &self,
        judge: impl Fn(&Block) -> Vec<Implausible>,
    ) -> Result<(), CommandError> {
        for source in &self.sources {
            let wrong = judge(&first_part(source)?.rows());
            if !wrong.is_empty() {
                let text = self.with_given_units(sentence(source, &wrong));
                return Err(CommandError::Implausible(text));
            }
        }
        Ok(())
    }

    /// Returns one sentence for each recording whose columns look wrong. Units are checked first. If they are right,
    /// the motion is checked for wrong signs, ratios, clocks and swapped columns.
    ///
    /// # Errors
    /// Names the error in a file and its line.
    pub fn faults(&self, robot: &Robot) -> Result<Faults, CommandError> {
        let mut faults = Faults::default();
        let mut unchecked = Vec::new();
        for source in &self.sources {
            let first = first_part(source)?;
            if first.more() {
                unchecked.push(format!(
                    "{}: only the first {JUDGED_ROWS} rows were checked for faults of its columns.",
                    source.path().display()
                ));
            }
            let (doubts, wrong): (Vec<_>, Vec<_>) =
                (plausibility(&first.rows(), robot).into_iter()).partition(Implausible::is_doubt);
            if !doubts.is_empty() {
                faults.doubtful.push(sentence(source, &doubts));
            }
            // A comparison with the model names a wrong unit more precisely, if the columns allow the comparison.
            let spoilt = wrong.iter().any(Implausible::spoils);
            if robot.has_followers() {
                unchecked.push(format!("{}: signs, scales and the order of columns were not compared with the model before the fit, because one drive of this robot turns several axes.", source.path().display()));
            }
            let judged = match spoilt || !source.has_effort() || robot.has_followers() {
                true => Vec::new(),
                false => faults_at_start(robot, source, JUDGED_ROWS)?,
            };
            let is_degrees = |own: &Implausible| matches!(own, Implausible::Degrees { .. });
            let in_degrees = degrees(source, robot, &wrong);
            if !wrong.is_empty() && !judged.iter().any(|fault| fault.certain) {
                faults.wrong.extend(in_degrees);
                let rest: Vec<Implausible> =
                    wrong.into_iter().filter(|own| !is_degrees(own)).collect();
                if !rest.is_empty() {
                    faults.wrong.push(sentence(source, &rest));
                }
                continue;
            }
            // One sentence for all joints stands for those of each.
            let (told, judged): (Vec<_>, Vec<_>) = judged.into_iter().partition(|fault| {
                in_degrees.is_some() && fault.column.as_ref().is_some_and(is_degrees)
            });
            if !told.is_empty() {
                faults.wrong.extend(in_degrees);
            }
            let is_told = |own: &Implausible| doubts.iter().any(|doubt| doubt.is_like(own));
            for fault in judged {
                if fault.column.as_ref().is_some_and(is_told) {
                    continue;
                }
                let list = match (fault.certain, fault.of_description) {
                    (true, true) => &mut faults.described,
                    (true, false) => &mut faults.wrong,
                    (false, _) => &mut faults.doubtful,
                };
                let text = source.in_its_names(&fault.text);
                let text = format!("{}: {text}", source.path().display());
                if !list.contains(&text) {
                    list.push(text);
                }
            }
        }
        self.unchecked.replace(unchecked);
        for text in faults.wrong.iter_mut().chain(&mut faults.described) {
            *text = self.with_given_units(std::mem::take(text));
        }
        Ok(faults)
    }

    /// Replaces column names in a message about `recording` by the names that its file uses.
    pub fn in_its_names(&self, recording: &str, text: &mut String) {
        let of = |source: &&Source| source.label() == recording;
        if let Some(source) = self.sources.iter().find(of) {
            *text = source.in_its_names(text);
        }
    }

    /// Returns one sentence for each recording whose velocity or acceleration columns do not match its motion.
    /// Only commands that use these columns need it.
    ///
    /// # Errors
    /// Names the error in a file and its line.
    pub fn strange_rates(&self, robot: &Robot) -> Result<Vec<String>, CommandError> {
        let mut strange = Vec::new();
        for source in &self.sources {
            let found = at_start(source, robot, strange_rates)?;
            if !found.is_empty() {
                strange.push(sentence(source, &found));
            }
        }
        Ok(strange)
    }

    /// Returns one sentence for each recording whose references have another unit, sign, zero, clock or joint than its
    /// positions.
    ///
    /// # Errors
    /// Names the error in a file and its line.
    pub fn strange_references(&self, robot: &Robot) -> Result<Vec<String>, CommandError> {
        let mut strange = Vec::new();
        for source in &self.sources {
            let found = at_start(source, robot, strange_references)?;
            let mut found = found.iter();
            let Some(first) = found.next() else { continue };
            let rest: Vec<String> = found.map(StrangeReference::column).collect();
            let rest = match rest.as_slice() {
                [] => String::new(),
                _ => format!("; wrong as well: {}", rest.join(", ")),
            };
            let text = source.in_its_names(&format!("{first}{rest}"));
            strange.push(format!("{}: {text}.", source.path().display()));
        }
        Ok(strange)
    }

    /// Warnings from the headers of the recordings.
    pub fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.sources.iter().flat_map(|source| {
            source
                .warnings()
                .iter()
                .map(move |warning| format!("{}: {warning}", source.path().display()))
        })
    }

    /// Warnings about the rows: those that were not checked for faults, then for each recording and kind one line, with the
    /// worst row and the number of others.
    pub fn heard(&self) -> Vec<String> {
        self.heard_but(&|_| false)
    }

    /// The same without warnings of a kind.
    pub fn heard_but(&self, is_left_out: &dyn Fn(&Warning) -> bool) -> Vec<String> {
        let mut all = self.unchecked.borrow().clone();
        for (source, heard) in self.sources.iter().zip(&self.heard) {
            let (path, heard) = (source.path().display(), heard.borrow());
            let at_least = match heard.len() {
                KEPT_WARNINGS.. => "at least ",
                _ => "",
            };
            let own = heard.iter().filter(|warning| !is_left_out(warning));
            let mut kinds = worst_first(own, |warning| warning.rank());
            kinds.sort_by_key(|own| own[0].rank().0);
            for own in kinds {
                let (worst, more) = (own[0], own.len() - 1);
                all.push(match more {
                    0 => format!("{path}: {worst}"),
                    _ => format!("{path}: {worst}; {at_least}{more} more of this kind, none worse"),
                });
            }
        }
        all
    }

    /// Positions beyond `[joint.limits]` in the rows, first the recording and joint with the largest excess.
    pub fn outside(&self) -> Vec<String> {
        let mut all = Vec::new();
        for (source, outside) in self.sources.iter().zip(&self.outside) {
            let outside = outside.borrow();
            for (j, ((rows, most), range)) in outside.joints.iter().zip(&self.ranges).enumerate() {
                let (Some([low, high]), true) = (range.limits, *rows > 0) else {
                    continue;
                };
                let (path, unit, n) = (source.path().display(), range.unit, j + 1);
                let beyond = format!("{} {unit}", format_significant(*most, 3));
                all.push(Finding {
                    kind: "outside",
                    size: *most,
                    sentence: format!(
                        "{path}: q{n} is beyond the position limits of joint \"{}\" ({low} to {high} {unit}) in {rows} of {} rows, by up to {beyond}. If the joint touched a stop there, the stop's torque is in those rows and biases friction and gravity: record with more margin to the limits, or correct [joint.limits].",
                        range.joint, outside.rows,
                    ),
                    short: format!("q{n} of {path} ({rows} rows, {beyond})"),
                });
            }
        }
        one_a_kind(all)
    }

    /// Returns true if any recording has a torque or a current.
    pub fn any_effort(&self) -> bool {
        self.sources.iter().any(Source::has_effort)
    }

    /// Returns true if every recording has a torque or a current.
    pub(crate) fn all_effort(&self) -> bool {
        self.sources.iter().all(Source::has_effort)
    }

    /// Returns true if any recording has a motor voltage.
    pub(crate) fn any_voltage(&self) -> bool {
        self.sources.iter().any(Source::has_voltage)
    }

    /// Size of all files, bytes.
    pub fn bytes(&self) -> u64 {
        self.sources.iter().map(Source::bytes).sum()
    }

    /// The recordings; reading one collects the warnings about its rows.
    pub fn listened(&self) -> Vec<Watched<'_>> {
        self.with_progress(None)
    }

    /// As [`Self::listened`]; reading a recording also advances `progress`.
    pub(crate) fn watched<'a>(&'a self, progress: &'a RefCell<Progress>) -> Vec<Watched<'a>> {
        self.with_progress(Some(progress))
    }

    fn with_progress<'a>(&'a self, progress: Option<&'a RefCell<Progress>>) -> Vec<Watched<'a>> {
        (self.sources.iter().zip(&self.heard).zip(&self.outside))
            .map(|((source, heard), outside)| Watched {
                source,
                heard,
                progress,
                ranges: &self.ranges,
                outside,
            })
            .collect()
    }
}

/// A recording that collects warnings while it is read and may advance a progress bar.
pub struct Watched<'a> {
    source: &'a Source,
    heard: &'a RefCell<Vec<Warning>>,
    progress: Option<&'a RefCell<Progress>>,
    ranges: &'a [Range],
    outside: &'a RefCell<Outside>,
}

impl Watched<'_> {
    fn advance(&self, bytes: u64) {
        if let Some(progress) = self.progress {
            progress.borrow_mut().advance(bytes);
        }
    }
}

impl Recording for Watched<'_> {
    fn label(&self) -> String {
        self.source.label()
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        let mut blocks = self.source.blocks(rows);
        let mut before = 0;
        let mut outside = Outside::default();
        while let Some(block) = blocks.next() {
            let block = block.map_err(|error| PrepareError::Read(error.to_string()))?;
            outside.take(&block, self.ranges);
            take(block)?;
            let read = blocks.bytes_read();
            self.advance(read - before);
            before = read;
        }
        // Every pass gives the same warnings, up to the row where it ends.
        let mut heard = self.heard.borrow_mut();
        if blocks.warnings().len() > heard.len() {
            *heard = blocks.warnings().to_vec();
        }
        let mut kept = self.outside.borrow_mut();
        if outside.rows > kept.rows {
            *kept = outside;
        }
        Ok(())
    }

    fn passed(&self, share: f64) {
        self.advance((share * self.source.bytes() as f64) as u64);
    }
}

/// Converts recordings to the list type that the library takes.
pub fn recordings<'a>(watched: &'a [Watched<'a>]) -> Vec<&'a dyn Recording> {
    watched
        .iter()
        .map(|recording| recording as &dyn Recording)
        .collect()
}

/// Use of recordings, which decides what a wrong description means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// Parameters are fitted: a wrong description is refused like a wrong recording.
    Fit,
    /// The description is compared with the recordings: a wrong description is a result, not a reason to refuse.
    Compare,
}

/// Checks the columns of recordings before their use: signs, units, ratios, clocks and swapped columns. Prints possible
/// faults. Refuses certain faults and the sentences in `more`; with `even_if_wrong` it prints them instead.
///
/// # Errors
/// Names the error in a file and its line; gives one sentence for each fault.
pub(crate) fn refuse_faults(
    robot: &Robot,
    inputs: &[&Inputs],
    (purpose, more): (Use, Vec<String>),
    even_if_wrong: bool,
    ui: &Ui,
) -> Result<(), CommandError> {
    let mut wrong = Vec::new();
    for recordings in inputs {
        let found = recordings.faults(robot)?;
        let (refused, told) = match purpose {
            Use::Fit => (found.described, Vec::new()),
            Use::Compare => (Vec::new(), found.described),
        };
        for sentence in told.iter().chain(&found.doubtful) {
            ui.warn(sentence);
        }
        wrong.extend(found.wrong.into_iter().chain(refused));
    }
    wrong.extend(more);
    if even_if_wrong {
        wrong.iter().for_each(|sentence| ui.warn(sentence));
        Ok(())
    } else if wrong.is_empty() {
        Ok(())
    } else {
        let what = match purpose {
            Use::Fit => "Nothing was fitted; give --even-if-wrong to fit in spite of this.",
            Use::Compare => {
                "Nothing was compared; give --even-if-wrong to compare in spite of this."
            }
        };
        Err(CommandError::Implausible(format!(
            "{} {what}",
            wrong.join(" ")
        )))
    }
}

/// Refuses a recording that is given both as training data and as hold-out.
///
/// # Errors
/// A sentence that names the recording.
pub fn refuse_shared(data: &[PathBuf], holdout: &[PathBuf]) -> Result<(), CommandError> {
    match holdout
        .iter()
        .find(|held| data.iter().any(|path| is_same(path, held)))
    {
        Some(path) => Err(CommandError::Sentence(format!(
            "{} is given both as training data and as --holdout; give a hold-out that is not used in the fit.",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// Refuses a recording that is given both for `option` (drive off, or joints clamped) and as a motion.
pub(crate) fn refuse_as_rest(
    [option, with]: [&str; 2],
    log: &Path,
    moved: &[PathBuf],
) -> Result<(), CommandError> {
    if moved.iter().any(|path| is_same(path, log)) {
        return Err(CommandError::Sentence(format!(
            "{} is given both as {option} and as a recording of motion; {option} takes a recording made with {with}.",
            log.display()
        )));
    }
    Ok(())
}

/// Refuses a recording that is given twice, by one name or as a copy: it would make every interval too narrow.
///
/// # Errors
/// A sentence that names the recording, and its copy.
pub fn refuse_twice(data: &[PathBuf], instead: &str) -> Result<(), CommandError> {
    for (k, path) in data.iter().enumerate() {
        if data[..k].iter().any(|before| is_same(before, path)) {
            return Err(CommandError::Sentence(format!(
                "{} is given twice, which would count its noise twice; {instead}.",
                path.display()
            )));
        }
        if let Some(before) = data[..k].iter().find(|before| is_copy(before, path)) {
            return Err(CommandError::Sentence(format!(
                "{} holds samples of {}: both files have the same bytes, which would count their noise twice; {instead}.",
                path.display(),
                before.display()
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;
    use rig_model::robot::ONE_LINK_TEMPLATE;

    /// Warnings about rows exist only after the rows were read; a later pass must not repeat them.
    #[test]
    fn gaps_are_heard_once_however_often_a_recording_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let rows: String = (0..3000)
            .filter(|k| !(100..150).contains(k))
            .filter(|k| *k <= 2800 || k % 10 < 3)
            .map(|k| format!("{},0,0\n", f64::from(k) * 1e-3))
            .collect();
        std::fs::write(&path, format!("t,q1,tau1\n{rows}")).unwrap();
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "r.toml".as_ref()).unwrap();
        let inputs = Inputs::read(&robot, &[path]).unwrap();
        assert!(inputs.heard().is_empty());
        for _ in 0..2 {
            for recording in recordings(&inputs.listened()) {
                recording.each_block(64, &mut |_| Ok(())).unwrap();
            }
            let heard = inputs.heard();
            let [gap] = &heard[..] else {
                panic!("one line a kind: {heard:?}")
            };
            // The longest gap, and the number of the others.
            assert!(
                gap.contains("line 102") && gap.contains("0.050000 s are missing"),
                "{gap}"
            );
            assert!(gap.contains("19 more of this kind"), "{gap}");
        }
    }

    #[test]
    fn positions_beyond_the_limits_are_counted_once_however_often_a_recording_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "r.toml".as_ref()).unwrap();
        let [low, high] = robot.joints[0].limits.as_ref().unwrap().position;
        // Seven rows beyond the upper end by up to 0.07 rad, two beyond the lower by 0.01 rad, one on the limit.
        let q = |k: u32| match k {
            100..107 => high + 0.01 * f64::from(k - 99),
            200..202 => low - 0.01,
            300 => high,
            _ => 0.5,
        };
        let rows: String = (0..1000)
            .map(|k| format!("{},{},0\n", f64::from(k) * 1e-3, q(k)))
            .collect();
        std::fs::write(&path, format!("t,q1,tau1\n{rows}")).unwrap();
        let inputs = Inputs::read(&robot, &[path]).unwrap();
        for _ in 0..2 {
            for recording in recordings(&inputs.listened()) {
                recording.each_block(64, &mut |_| Ok(())).unwrap();
            }
            let said = inputs.outside();
            assert_eq!(said.len(), 1, "{said:?}");
            assert!(said[0].contains("in 9 of 1000 rows") && said[0].contains("0.0700 rad"));
            assert!(said[0].contains("q1") && said[0].contains("joint \"link\""));
        }
    }
}
