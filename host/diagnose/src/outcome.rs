//! Result of a diagnosis; serialises to `diagnosis.json`.

use std::collections::BTreeMap;

use rig_data::Implausible;
use serde::Serialize;

use crate::experiment::ExperimentKind;
use rig_output::{format_significant, format_unit, format_value};

/// Difference below which two shares of a gap are printed as equal.
const SAME_SHARE: f64 = 5e-4;

/// Least posterior probability of a certain name: the usual level of an interval.
const CERTAIN: f64 = 0.95;

/// Verdict of a diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The model already explains the data to the noise floor.
    NothingMissing,
    /// Named effects close all or nearly all of the gap to a noise floor that does not depend on a model.
    Explained,
    /// The structure holds; a nominal parameter has changed.
    ParameterChange,
    /// No known effect explains the residual.
    Remainder,
    /// The recording is physically impossible; nothing was fitted.
    DataFault,
}

/// The compared quantity. All residuals, floors and gaps refer to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Residual {
    /// The torque that the model predicts for the recorded motion, N·m or N.
    #[default]
    Torque,
    /// The position of a model with only the recorded voltage as input, rad or m.
    Position,
}

/// Source of a noise floor. None of these is a model of the torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FloorFrom {
    /// Two runs of one motion: the difference of their residuals.
    RepeatedRuns,
    /// Torque noise beyond the band of the motion, plus the torque error from encoder steps and white position noise. A
    /// lower limit: it does not contain noise that looks like motion.
    TorqueReading,
    /// No motion was repeated, and the torque noise is not distinguishable from the signal.
    Unknown,
}

/// Torque residual of the written model on one joint, on data outside its fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Left {
    /// Name of the joint.
    pub joint: String,
    /// ASCII, N*m or N.
    pub unit: String,
    /// True if the data are the hold-out; else they are blocks of the training data, left out of the fit in turn.
    pub on_holdout: bool,
    /// RMS of the residual with the refitted description.
    pub before: f64,
    /// RMS of the residual of the written model.
    pub after: f64,
    /// Noise floor of these data; NaN (null) if unknown.
    pub floor: f64,
    /// Source of the noise floor.
    pub floor_from: FloorFrom,
    /// RMS of the recorded torque.
    pub torque: f64,
    /// `after` in per cent of `torque`.
    pub percent_of_torque: f64,
    /// True if `after` is at the noise floor or nearly all of the gap is closed.
    pub explained: bool,
}

/// Dependence of the residual on a coordinate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Name of the joint.
    pub joint: String,
    /// The coordinate: `velocity`, `position`, `motor angle`, …
    pub coordinate: String,
    /// Interval of the coordinate with most of the excess.
    pub interval: [f64; 2],
    /// Unit of the interval.
    pub unit: String,
    /// Share of the excess over the noise floor that the coordinate alone explains.
    pub share: f64,
    /// p-value corrected for the number of coordinates.
    pub p_value: f64,
    /// Description, a sentence.
    pub text: String,
}

/// A fitted number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// Value, SI.
    pub value: f64,
    /// Standard deviation; 0 for an integer, infinite if not identifiable.
    pub std: f64,
    /// Unit, ASCII.
    pub unit: String,
}

impl Value {
    /// Returns the value with its standard deviation and `unit`, or "(not determined)".
    pub fn said(&self, unit: &str) -> String {
        if self.std.is_infinite() {
            format!(
                "{}{unit} (not determined)",
                format_significant(self.value, 4)
            )
        } else {
            format!("{}{unit}", format_value(self.value, self.std))
        }
    }
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Most probable name.
    pub effect: String,
    /// Law, if the name has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<String>,
    /// Name of the joint.
    pub joint: String,
    /// All names that these data support equally, including `effect`.
    pub set: Vec<String>,
    /// Its parameters.
    pub parameters: BTreeMap<String, Value>,
    /// p-value corrected for all trials.
    pub p_value: f64,
    /// Posterior probability of the name among all names tried in its place, from the residual on blocks outside the
    /// fit; NaN (null) if no search compared them.
    pub name_probability: f64,
    /// Best name outside the set.
    pub runner_up: Option<String>,
    /// Share of this step's gap that the runner-up would have closed.
    pub runner_up_gap_closed: Option<f64>,
    /// Unit of the residual that this step reduces, ASCII: that of [`Diagnosis::residual`], or V for an effect in the
    /// motor voltage alone.
    pub rms_unit: String,
    /// RMS of the joint's residual, before and after this step.
    pub train_rms: [f64; 2],
    /// The same on the hold-out; null without one.
    pub holdout_rms: Option<[f64; 2]>,
    /// RMS error of the simulated motion before and after this step, rad or m; null if it cannot be simulated.
    pub motion_rms: Option<[f64; 2]>,
    /// Share of the hold-out's (else the training) gap that this step closes, at most 1; NaN (null) if no noise floor
    /// is known or the RMS rose.
    pub gap_closed: f64,
    /// Reason to believe it, a sentence.
    pub why: String,
}

/// Fate of a described effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fate {
    /// It stays, refitted together with everything else.
    FittedAgain,
    /// It stays with its described parameters.
    Held,
    /// The recordings contradict it: the new description does not have it.
    Dropped,
    /// It is part of its link.
    InTheLink,
}

/// A described effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Described {
    /// Its name.
    pub effect: String,
    /// Law, if the name has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<String>,
    /// Name of the joint.
    pub joint: String,
    /// Its fate.
    pub fate: Fate,
    /// Its parameters, if refitted.
    pub parameters: BTreeMap<String, Value>,
    /// Its fate, a sentence.
    pub text: String,
}

/// Source of [`Absorbed::before`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Before {
    /// Identified without the effects that were found.
    WithoutEffects,
    /// Described; no effect could have changed it.
    Described,
}

/// A nominal parameter that changed, by adding the effects or against the description.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absorbed {
    /// Name with the joint's number, or the expression of the base parameter.
    pub parameter: String,
    /// Unit, ASCII.
    pub unit: String,
    /// Value before, see [`Diagnosis::absorbed_before`].
    pub before: f64,
    /// Identified value, with the effects if there are any.
    pub after: f64,
    /// Difference over the standard deviation of `after`.
    pub sigmas: f64,
}

/// Refit of all parameters to the simulated motion of the training data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByMotion {
    /// Unit of the motion, ASCII.
    pub unit: String,
    /// RMS error of the simulated motion, with the parameters fitted to torque and to motion.
    pub motion_rms: [f64; 2],
    /// Unit of the torque, ASCII.
    pub torque_unit: String,
    /// RMS torque residual of both.
    pub torque_rms: [f64; 2],
    /// True if the parameters fitted to motion are used.
    pub adopted: bool,
    /// Both estimates of each parameter.
    pub parameters: Vec<Twice>,
    /// Summary in words.
    pub text: String,
}

/// A parameter fitted to torque and to motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Twice {
    /// Expression of the base parameter, or names of effect and parameter with a dot between.
    pub parameter: String,
    /// Unit, ASCII.
    pub unit: String,
    /// Estimate from the torque.
    pub torque: f64,
    /// Its standard deviation.
    pub torque_std: f64,
    /// Estimate from the simulated motion.
    pub motion: f64,
    /// Its standard deviation.
    pub motion_std: f64,
    /// Difference over the standard deviation of both.
    pub sigmas: f64,
}

/// An effect that these data cannot show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotTestable {
    /// Its name.
    pub effect: String,
    /// Name of the joint.
    pub joint: String,
    /// Information that the data lack.
    pub why: String,
    /// Experiment that would show it.
    pub experiment: String,
}

/// Smallest detectable size of an effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Detectable {
    /// Its name.
    pub effect: String,
    /// Name of the joint.
    pub joint: String,
    /// Parameter of the size.
    pub parameter: String,
    /// Size, SI: the median over the tested shapes of the effect's law; infinite (null in JSON) if no torque up to the
    /// joint's largest would show.
    pub size: f64,
    /// The same at the least detectable shape, such as a breakaway at a speed that the motion hardly reaches; none
    /// (absent in JSON) if the law has one shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_at_worst: Option<f64>,
    /// Unit, ASCII.
    pub unit: String,
}

/// Experiment that would separate the names of a set, or make an effect testable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextExperiment {
    /// Its kind.
    pub kind: ExperimentKind,
    /// Names that it separates, or the effect that it makes testable.
    pub separates: Vec<String>,
    /// Instructions, sentences.
    pub text: String,
    /// File for `rig` to run, beside `diagnosis.json`; none if there is no motion for it.
    pub file: Option<String>,
    /// Expected distance of the rivals' predictions in standard deviations of the noise.
    pub separation: Option<f64>,
    /// Duration, s.
    pub duration: Option<f64>,
    /// True if it needs more than running [`Self::file`]: a load, a turned base, another sensor.
    #[serde(skip)]
    pub hands: bool,
    /// Contents of [`Self::file`], TOML.
    #[serde(skip)]
    pub trajectory: Option<String>,
}

/// Residual that no known effect explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remainder {
    /// Name of the joint.
    pub joint: String,
    /// RMS beyond the noise floor: √(RMS² − floor²).
    pub rms: f64,
    /// Its unit: of the residual, or V for a voltage residual.
    pub unit: String,
    /// Residual RMS over the noise floor.
    pub ratio: f64,
    /// Coordinates that it depends on.
    pub places: Vec<Place>,
    /// Description in words.
    pub text: String,
    /// True if it is not a residual beyond a known floor, but a reason to doubt a full explanation, given in the text.
    #[serde(skip)]
    pub doubt: bool,
}

impl Remainder {
    /// Returns true if it is a residual of the motor voltage. The torque may be explained.
    pub fn of_a_voltage(&self) -> bool {
        self.unit == "V"
    }
}

/// A physically impossible feature of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DataFault {
    /// What is wrong.
    pub kind: FaultKind,
    /// The affected columns.
    #[serde(skip)]
    pub about: About,
    /// The affected recording.
    pub recording: String,
    /// Name of the joint.
    pub joint: String,
    /// True if nothing else explains the data. An uncertain fault does not stop the diagnosis.
    pub certain: bool,
    /// True if it names an error of the description: gravity, an axis, a zero, a gear ratio, a rotor.
    #[serde(skip)]
    pub of_description: bool,
    /// The check of the column that found it, if one did.
    #[serde(skip)]
    pub column: Option<Implausible>,
    /// The fault and its correction, a sentence.
    pub text: String,
}

impl DataFault {
    /// Returns true if rows remain to fit. False if the recording cannot be prepared, is too short or does not move.
    pub fn leaves_rows(&self) -> bool {
        self.about != About::Preparation
            && ![FaultKind::TooShort, FaultKind::NotMoving].contains(&self.kind)
    }
}

/// Kind of a fault; serialises to [`Self::as_str`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "&'static str")]
pub enum FaultKind {
    /// A column or an axis with the wrong sense.
    Sign,
    /// A torque without its sign.
    Magnitude,
    /// A column in another unit.
    Unit,
    /// A column multiplied by a wrong gear ratio, or a wrong one in the description.
    Ratio,
    /// A time column that is broken, in another unit, or against which a torque is shifted.
    Clock,
    /// Columns in another order than the joints.
    Swap,
    /// A position from another zero.
    Zero,
    /// Another direction of gravity, or another mounting.
    Gravity,
    /// A torque at a limit.
    Saturation,
    /// A column with jumps.
    Jump,
    /// A column that repeats old values.
    Held,
    /// A signed column that was read as unsigned.
    Unsigned,
    /// A torque whose gain changes within the recording.
    Gain,
    /// Too few rows.
    TooShort,
    /// No motion.
    NotMoving,
}

impl FaultKind {
    /// Returns the name in results.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Sign => "sign",
            Self::Magnitude => "magnitude",
            Self::Unit => "unit",
            Self::Ratio => "ratio",
            Self::Clock => "clock",
            Self::Swap => "swap",
            Self::Zero => "zero",
            Self::Gravity => "gravity",
            Self::Saturation => "saturation",
            Self::Jump => "jump",
            Self::Held => "held",
            Self::Unsigned => "unsigned",
            Self::Gain => "gain",
            Self::TooShort => "too-short",
            Self::NotMoving => "not-moving",
        }
    }
}

impl From<FaultKind> for &'static str {
    fn from(kind: FaultKind) -> Self {
        kind.as_str()
    }
}

impl std::fmt::Display for FaultKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Part of a recording that a fault concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The whole recording, which cannot be prepared: it is broken or irregular.
    Preparation,
    /// Time, or the recording as a whole.
    Recording,
    /// A joint's position or velocity.
    Motion,
    /// A joint's torque.
    Torque,
}

/// RMS residual of one joint from model to model down to the floor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Waterfall {
    /// Name of the joint.
    pub joint: String,
    /// Unit, ASCII: N*m or N; rad or m if [`Diagnosis::residual`] is the position.
    pub unit: String,
    /// Names of the models: `frozen description`, `refitted`, then each effect.
    pub models: Vec<String>,
    /// RMS over the training recordings.
    pub train: Vec<f64>,
    /// RMS over the hold-out; empty without one.
    pub holdout: Vec<f64>,
    /// Noise floor; NaN (null) if unknown.
    pub floor: f64,
    /// Noise floor of the hold-out's rows. With a lower sample rate, each row is the mean of fewer samples.
    pub holdout_floor: f64,
}

/// Residual before and after against one coordinate, for a plot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Map {
    /// Name of the joint.
    pub joint: String,
    /// Coordinate on the abscissa.
    pub coordinate: String,
    /// Its unit, ASCII.
    pub unit: String,
    /// Unit of the residual, ASCII.
    pub residual_unit: String,
    /// Bin centres.
    pub at: Vec<f64>,
    /// Mean residual before, and half the width of its 95 % band.
    pub before: Vec<[f64; 2]>,
    /// Mean residual after, and half the width of its 95 % band.
    pub after: Vec<[f64; 2]>,
    /// The fitted law, without the part absorbed by the nominal model; empty without one.
    pub law: Vec<f64>,
    /// Its step, from 0; none for the final residual.
    pub step: Option<usize>,
}

/// Curves over time for a plot: a segment of the hold-out (else training) recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Curves {
    /// Name of the joint.
    pub joint: String,
    /// The recording.
    pub recording: String,
    /// Time, s.
    pub t: Vec<f64>,
    /// Measured torque, and predictions without and with the effects, N·m or N; empty if not recorded.
    pub torque: [Vec<f64>; 3],
    /// Measured position, and simulations without and with the effects, rad or m; empty if not simulated.
    pub motion: [Vec<f64>; 3],
}

/// A trial: one candidate in one sweep of the search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Its name (and law).
    pub effect: String,
    /// Name of the joint.
    pub joint: String,
    /// Its step, from 0.
    pub step: usize,
    /// Share of the residual's RMS that it removes on blocks outside its fit.
    pub gain: f64,
    /// The gain over its standard deviation.
    pub gain_sigmas: f64,
    /// p-value corrected for all trials.
    pub p_value: f64,
    /// Reason for refusal; empty for the accepted candidate.
    pub refused: String,
}

impl Step {
    /// Returns true if the effect does not reduce the residual of the hold-out: the RMS rises by more than 1 %, half the least
    /// gain of an effect on the training data.
    pub fn is_contradicted(&self) -> bool {
        const RISE: f64 = 1.01;
        (self.holdout_rms).is_some_and(|[before, after]| after > RISE * before)
    }

    /// Returns the RMS before and after, on the hold-out, else on the training data.
    pub fn judged(&self) -> [f64; 2] {
        self.holdout_rms.unwrap_or(self.train_rms)
    }

    /// Returns the closed share of the gap in per cent if it is between 0 and 1. Otherwise (floor unknown or RMS risen)
    /// returns the RMS before and after.
    pub fn fall(&self) -> String {
        match (0.0..=1.0).contains(&self.gap_closed) {
            true => format!("{} %", format_significant(100.0 * self.gap_closed, 3)),
            false => {
                let [before, after] = self.judged().map(|rms| format_significant(rms, 3));
                format!("{before} → {after} {}", format_unit(&self.rms_unit))
            }
        }
    }
}

impl Waterfall {
    /// Returns the noise floor of the data that judge the models.
    pub fn judged_floor(&self) -> f64 {
        if self.holdout.is_empty() {
            self.floor
        } else {
            self.holdout_floor
        }
    }

    /// Returns the models' RMS on the hold-out, else on the training data.
    pub fn judged(&self) -> &[f64] {
        if self.holdout.is_empty() {
            &self.train
        } else {
            &self.holdout
        }
    }
}

/// Treatment of the recordings before the comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Treated {
    /// Sample rate of the training recordings, Hz.
    pub sample_rate: f64,
    /// Cut-off of the low-pass on the position, Hz.
    pub position_cutoff: f64,
    /// Reason for this cut-off, a sentence.
    pub position_cutoff_why: String,
    /// Cut-off of the position for inertia and gravity, Hz; they then pass the low-pass above. Null if that low-pass
    /// has no loss in the band: then the filtered position is used.
    pub links_cutoff: Option<f64>,
    /// Upper end of the compared band, Hz.
    pub band: f64,
    /// Highest frequency of the motion, Hz.
    pub motion_frequency: f64,
    /// Rows per second.
    pub row_rate: f64,
    /// Rows, joint by joint.
    pub rows: Vec<Rows>,
}

/// Rows of a joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rows {
    /// Name of the joint.
    pub joint: String,
    /// Speed below which rows are not used.
    pub least_speed: f64,
    /// Unit of the speed, ASCII.
    pub unit: String,
    /// Used and total rows of the training recordings.
    pub train: [usize; 2],
    /// The same of the hold-out; null without one.
    pub holdout: Option<[usize; 2]>,
}

/// The result of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// `rig-diagnosis/1`
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// Verdict.
    pub verdict: Verdict,
    /// The compared quantity.
    pub residual: Residual,
    /// The verdict in words, sentences.
    pub words: Vec<String>,
    /// Noise floor per joint, in the residual's unit; NaN (null) if unknown.
    pub noise_floor_rms: Vec<f64>,
    /// Source of each noise floor; empty if the residual is not a torque.
    pub noise_floor_from: Vec<FloorFrom>,
    /// Torque residual of the written model, joint by joint; empty if the residual is not a torque.
    pub left: Vec<Left>,
    /// Method of the noise floor, a sentence.
    pub noise_floor_how: String,
    /// Method of the motion simulation, or why there is none, a sentence.
    pub motion_how: String,
    /// Treatment of the recordings; null if nothing was fitted, and for a model with a voltage input.
    pub treatment: Option<Treated>,
    /// Torque lead per joint: time by which a torque was recorded before it acts (negative: after), s. It was removed.
    pub torque_lead: Vec<f64>,
    /// Dependence of the gap on coordinates, the largest share first; empty if no dependence is beyond chance.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// The described effects, in their order.
    pub described: Vec<Described>,
    /// The effects found, in their order.
    pub steps: Vec<Step>,
    /// Closed share of the hold-out (else training) residual's excess over the noise floor; null if nothing was found.
    /// It starts from the refitted description, or from the unchanged one if its values have changed.
    pub gap_closed: Option<f64>,
    /// Nominal parameters changed by the effects, or without effects against the description. Empty if it states none.
    pub absorbed: Vec<Absorbed>,
    /// Source of the values before.
    pub absorbed_before: Before,
    /// Estimates from torque and from motion; none if there was no fit to motion.
    pub by_motion: Option<ByMotion>,
    /// Effects that these data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// Smallest detectable size of each other effect.
    pub detectable: Vec<Detectable>,
    /// Next experiment.
    pub next_experiment: Option<NextExperiment>,
    /// The unexplained residual.
    pub remainder: Option<Remainder>,
    /// Faults of the data.
    pub data_faults: Vec<DataFault>,
    /// RMS from model to model.
    pub waterfall: Vec<Waterfall>,
    /// All trials.
    pub tried: Vec<Tried>,
    /// Residual maps for plots.
    #[serde(skip)]
    pub maps: Vec<Map>,
    /// Curves for plots.
    #[serde(skip)]
    pub curves: Vec<Curves>,
}

impl Diagnosis {
    /// Returns true if a step's name is certain. Its set has no other name, its posterior probability is at least 95 %,
    /// its joint has no residual for another name, and the hold-out does not contradict it.
    pub fn is_certain(&self, step: &Step) -> bool {
        let own = self.left.iter().find(|left| left.joint == step.joint);
        let left =
            (self.remainder.as_ref()).is_some_and(|r| r.joint == step.joint && r.unit != "V");
        step.set.len() < 2
            && !step.is_contradicted()
            && (step.name_probability.is_nan() || step.name_probability >= CERTAIN)
            && own.is_none_or(|own| own.explained)
            && !left
    }

    /// Returns the share of the refitted description's gap that the effects close, if [`Self::gap_closed`] includes the
    /// refit. None if it already refers to the effects alone.
    pub fn closed_by_effects(&self) -> Option<f64> {
        let (mut gap, mut closed) = (0.0, 0.0);
        for w in &self.waterfall {
            // A changed value with an effect's name is a step without a model of its own.
            if let [_, refitted, .., last] = w.judged()
                && self.residual == Residual::Torque
                && w.models.len() >= self.steps.len() + 2
            {
                gap += (refitted - w.judged_floor()) / w.floor;
                closed += (refitted - last) / w.floor;
            }
        }
        let own = (gap > 0.0).then(|| closed / gap)?;
        (self.gap_closed).and_then(|all| ((all - own).abs() > SAME_SHARE).then_some(own))
    }
}
