//! What several commands take: a robot description and recordings, checked before any work begins.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::ui::{Progress, Ui};
use rig_data::prepare::{PrepareError, Recording};
use rig_data::{
    Block, EffortNeed, Implausible, JUDGED_ROWS, KEPT_WARNINGS, Source, StrangeReference, Warning,
    plausibility, strange_rates, strange_references,
};
use rig_diagnose::sanity::faults_at_start;
use rig_model::robot::{Description, Joint, JointKind, Robot};
use rig_output::{Finding, format_significant, one_a_kind, worst_first};

/// The robot description.
#[derive(Debug, ClapArgs)]
pub(crate) struct RobotArg {
    /// Robot description, TOML or URDF (`rig init` writes one to start from)
    #[arg(long = "robot", value_name = "FILE")]
    path: PathBuf,
}

impl RobotArg {
    /// Where a URDF was given and a description of what it has no place for stands beside it: a word of that.
    pub(crate) fn fuller(&self) -> Option<String> {
        let urdf = self.path.extension().is_some_and(|end| end == "urdf");
        let beside = self.path.with_extension("toml");
        (urdf && beside.is_file()).then(|| {
            format!(
                "A URDF has no place for inertia of drives, constant torques and effects, which are missing in this prediction; {} has them.",
                beside.display()
            )
        })
    }

    /// Loads it.
    ///
    /// # Errors
    /// What is wrong with the file, by line.
    pub(crate) fn load(&self, ui: &Ui) -> Result<Robot, CommandError> {
        Ok(self.describe(ui)?.robot)
    }

    /// Loads it with the file that it was read from.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub(crate) fn describe(&self, ui: &Ui) -> Result<Description, CommandError> {
        described(&self.path, ui)
    }
}

/// Loads a description and says what is strange about it.
///
/// # Errors
/// What is wrong with the file, by line.
pub(crate) fn described(path: &Path, ui: &Ui) -> Result<Description, CommandError> {
    let description = Description::load(path)?;
    for remark in &description.remarks {
        ui.remark(remark);
    }
    Ok(description)
}

/// What columns of recordings look like, one sentence each.
pub(crate) struct Faults {
    /// What they cannot be.
    pub(crate) wrong: Vec<String>,
    /// What they may be, or the description is far off, or the motion is too short to say.
    pub(crate) doubtful: Vec<String>,
}

/// Recordings that fit the robot.
pub(crate) struct Inputs {
    sources: Vec<Source>,
    /// What the rows of each were worth saying, in the pass that came furthest.
    heard: Vec<RefCell<Vec<Warning>>>,
    /// Position limits of each joint.
    ranges: Vec<Range>,
    /// What the pass that came furthest saw beyond them, for each recording.
    outside: Vec<RefCell<Outside>>,
}

/// Name of a joint, its position limits where it has any, and its unit.
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
    /// Per joint: rows beyond, and by how much at most.
    joints: Vec<(u64, f64)>,
}

/// Share of a range by which a position is beyond it through rounding alone.
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

/// What the first rows of a recording show of its columns.
fn at_start<T>(
    source: &Source,
    robot: &Robot,
    look: fn(&Block, &Robot) -> Vec<T>,
) -> Result<Vec<T>, CommandError> {
    match source.blocks(JUDGED_ROWS).next() {
        Some(block) => Ok(look(&block?, robot)),
        None => Ok(Vec::new()),
    }
}

/// What is wrong with a recording in one sentence.
fn sentence(source: &Source, wrong: &[Implausible]) -> String {
    let all: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    let text = source.in_its_names(&all.join("; "));
    format!("{}: {text}.", source.path().display())
}

impl Inputs {
    /// Opens recordings and checks their columns.
    ///
    /// # Errors
    /// What is wrong, by file and line.
    pub(crate) fn read(robot: &Robot, paths: &[PathBuf]) -> Result<Self, CommandError> {
        Self::read_with(robot, paths, EffortNeed::Required)
    }

    /// As [`Self::read`], saying whether the torque may be missing.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub(crate) fn read_with(
        robot: &Robot,
        paths: &[PathBuf],
        need: EffortNeed,
    ) -> Result<Self, CommandError> {
        let sources = paths
            .iter()
            .map(|path| Source::open_with(path, robot, need))
            .collect::<Result<Vec<_>, _>>()?;
        let heard = sources.iter().map(|_| RefCell::default()).collect();
        let outside = sources.iter().map(|_| RefCell::default()).collect();
        Ok(Self {
            sources,
            heard,
            ranges: robot.joints.iter().map(Range::of).collect(),
            outside,
        })
    }

    /// Opens recordings and checks their columns and units.
    ///
    /// # Errors
    /// What is wrong, by file and line; all units that look wrong in one sentence.
    pub(crate) fn open(robot: &Robot, paths: &[PathBuf]) -> Result<Self, CommandError> {
        Self::open_with(robot, paths, EffortNeed::Required)
    }

    /// As [`Self::open`], saying whether the torque may be missing.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn open_with(
        robot: &Robot,
        paths: &[PathBuf],
        need: EffortNeed,
    ) -> Result<Self, CommandError> {
        let inputs = Self::read_with(robot, paths, need)?;
        for source in &inputs.sources {
            let wrong: Vec<Implausible> = (at_start(source, robot, plausibility)?.into_iter())
                .filter(|problem| !problem.is_doubt())
                .collect();
            if !wrong.is_empty() {
                return Err(CommandError::Implausible(sentence(source, &wrong)));
            }
        }
        Ok(inputs)
    }

    /// One sentence for each recording whose columns cannot be what they say: units, and where those are right signs, ratios,
    /// clocks and columns in each other's place, of which the motion tells.
    ///
    /// # Errors
    /// What is wrong with a file, by line.
    pub(crate) fn faults(&self, robot: &Robot) -> Result<Faults, CommandError> {
        let mut faults = Faults {
            wrong: Vec::new(),
            doubtful: Vec::new(),
        };
        for source in &self.sources {
            let (doubts, wrong): (Vec<_>, Vec<_>) = (at_start(source, robot, plausibility)?
                .into_iter())
            .partition(Implausible::is_doubt);
            if !doubts.is_empty() {
                faults.doubtful.push(sentence(source, &doubts));
            }
            // The model tells more closely what a unit is, where there is something that it can be held against.
            let judged = match wrong.iter().any(Implausible::spoils) {
                true => Vec::new(),
                false => faults_at_start(robot, source, JUDGED_ROWS)?,
            };
            if !wrong.is_empty() && !judged.iter().any(|fault| fault.certain) {
                faults.wrong.push(sentence(source, &wrong));
                continue;
            }
            for fault in judged {
                let list = match fault.certain {
                    true => &mut faults.wrong,
                    false => &mut faults.doubtful,
                };
                let text = source.in_its_names(&fault.text);
                let text = format!("{}: {text}", source.path().display());
                if !list.contains(&text) {
                    list.push(text);
                }
            }
        }
        Ok(faults)
    }

    /// Gives a message about the recording of that name the file's own names of the columns; another one stays.
    pub(crate) fn in_its_names(&self, recording: &str, text: &mut String) {
        let of = |source: &&Source| source.label() == recording;
        if let Some(source) = self.sources.iter().find(of) {
            *text = source.in_its_names(text);
        }
    }

    /// One sentence for each recording whose measured velocities or accelerations are none, which concerns who uses them.
    ///
    /// # Errors
    /// What is wrong with a file, by line.
    pub(crate) fn strange_rates(&self, robot: &Robot) -> Result<Vec<String>, CommandError> {
        let mut strange = Vec::new();
        for source in &self.sources {
            let found = at_start(source, robot, strange_rates)?;
            if !found.is_empty() {
                strange.push(sentence(source, &found));
            }
        }
        Ok(strange)
    }

    /// One sentence for each recording whose references cannot be those of its positions: another unit, sense, zero, clock or joint.
    ///
    /// # Errors
    /// What is wrong with a file, by line.
    pub(crate) fn strange_references(&self, robot: &Robot) -> Result<Vec<String>, CommandError> {
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

    /// What their headers make worth saying.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.sources.iter().flat_map(|source| {
            source
                .warnings()
                .iter()
                .map(move |warning| format!("{}: {warning}", source.path().display()))
        })
    }

    /// What their rows made worth saying, once they were read: of each recording one line a kind, that of the worst row, and how
    /// many more there are of it.
    pub(crate) fn heard(&self) -> Vec<String> {
        let mut all = Vec::new();
        for (source, heard) in self.sources.iter().zip(&self.heard) {
            let (path, heard) = (source.path().display(), heard.borrow());
            let at_least = match heard.len() {
                KEPT_WARNINGS.. => "at least ",
                _ => "",
            };
            let mut kinds = worst_first(heard.iter(), |warning| warning.rank());
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

    /// Where their positions left `[joint.limits]`, once they were read: the recording and joint that went farthest, and the others.
    pub(crate) fn outside(&self) -> Vec<String> {
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
                        "{path}: q{n} is beyond the position limits of joint \"{}\" ({low} to {high} {unit}) in {rows} of {} rows, by up to {beyond}. If the joint touched a stop there, its torque is in those rows and biases friction and gravity: record with more margin to the limits, or correct [joint.limits].",
                        range.joint, outside.rows,
                    ),
                    short: format!("q{n} of {path} ({rows} rows, {beyond})"),
                });
            }
        }
        one_a_kind(all)
    }

    /// Whether any of them has a torque or a current.
    pub(crate) fn any_effort(&self) -> bool {
        self.sources.iter().any(Source::has_effort)
    }

    /// Whether every recording has torque or current.
    pub(crate) fn all_effort(&self) -> bool {
        self.sources.iter().all(Source::has_effort)
    }

    /// Whether any recording has a motor voltage.
    pub(crate) fn any_voltage(&self) -> bool {
        self.sources.iter().any(Source::has_voltage)
    }

    /// Bytes in all files.
    pub(crate) fn bytes(&self) -> u64 {
        self.sources.iter().map(Source::bytes).sum()
    }

    /// The recordings, each reporting what its rows make worth saying.
    pub(crate) fn listened(&self) -> Vec<Watched<'_>> {
        self.with_progress(None)
    }

    /// The same, each reporting to `progress` what was read.
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

/// A recording that is listened to while it is read, and may move a progress bar.
pub(crate) struct Watched<'a> {
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
        // Every pass hears the same, as far as it goes.
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

/// The list that the library takes.
pub(crate) fn recordings<'a>(watched: &'a [Watched<'a>]) -> Vec<&'a dyn Recording> {
    watched
        .iter()
        .map(|recording| recording as &dyn Recording)
        .collect()
}

/// Judges the columns of recordings as every command that fits something does: signs, units, ratios, clocks and columns in
/// each other's place. What is doubtful is said; what is wrong is refused, with `more` sentences of the caller, or said where
/// the user wants the fit all the same.
///
/// # Errors
/// What is wrong with a file, by line; all that looks wrong in one sentence each.
pub(crate) fn refuse_faults(
    robot: &Robot,
    inputs: &[&Inputs],
    more: Vec<String>,
    even_if_wrong: bool,
    ui: &Ui,
) -> Result<(), CommandError> {
    let mut wrong = Vec::new();
    for recordings in inputs {
        let found = recordings.faults(robot)?;
        for sentence in &found.doubtful {
            ui.remark(sentence);
        }
        wrong.extend(found.wrong);
    }
    wrong.extend(more);
    if even_if_wrong {
        wrong.iter().for_each(|sentence| ui.remark(sentence));
        Ok(())
    } else if wrong.is_empty() {
        Ok(())
    } else {
        Err(CommandError::Implausible(format!(
            "{} Nothing was fitted; --even-if-wrong fits all the same.",
            wrong.join(" ")
        )))
    }
}

/// The same of two names of one file; a file that is not there is told of by whoever reads it.
pub(crate) fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// A recording that was learnt from says nothing as a judge.
///
/// # Errors
/// A sentence naming a recording that is given as both.
pub(crate) fn refuse_shared(data: &[PathBuf], holdout: &[PathBuf]) -> Result<(), CommandError> {
    match holdout
        .iter()
        .find(|held| data.iter().any(|path| real(path) == real(held)))
    {
        Some(path) => Err(CommandError::Sentence(format!(
            "{} is given to learn from and as --holdout; judge by a recording that was not learnt from.",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// A motion under torque says nothing of what a sensor reads without one, or a motor at rest.
pub(crate) fn refuse_as_rest(
    [option, with]: [&str; 2],
    log: &Path,
    moved: &[PathBuf],
) -> Result<(), CommandError> {
    if moved.iter().any(|path| real(path) == real(log)) {
        return Err(CommandError::Sentence(format!(
            "{} is given as {option} and as a recording of motion; {option} takes one made with {with}.",
            log.display()
        )));
    }
    Ok(())
}

/// A recording that is learnt from twice makes every interval too narrow.
pub(crate) fn refuse_twice(data: &[PathBuf], instead: &str) -> Result<(), CommandError> {
    for (k, path) in data.iter().enumerate() {
        if data[..k].iter().any(|before| real(before) == real(path)) {
            return Err(CommandError::Sentence(format!(
                "{} is given twice to learn from, which would count its noise as two recordings'; {instead}.",
                path.display()
            )));
        }
    }
    Ok(())
}

/// The command line as typed, for the report's "how to repeat this".
pub(crate) fn command_line() -> String {
    let mut words = vec!["rig".to_string()];
    words.extend(std::env::args().skip(1).map(|word| {
        if word
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "-_./=:,".contains(c))
            && !word.is_empty()
        {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    }));
    words.join(" ")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;
    use rig_model::robot::ONE_LINK_TEMPLATE;

    /// What is wrong with rows is known only once they were read; every later pass hears the same again.
    #[test]
    fn gaps_are_heard_once_however_often_a_recording_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let rows: String = (0..3000)
            .filter(|k| !(100..150).contains(k))
            .filter(|k| *k <= 2800 || k % 2 == 0)
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
            // The longest of them, and the others.
            assert!(
                gap.contains("line 102") && gap.contains("0.050000 s are missing"),
                "{gap}"
            );
            assert!(gap.contains("99 more of this kind"), "{gap}");
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
