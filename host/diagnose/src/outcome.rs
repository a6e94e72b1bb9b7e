//! What a diagnosis says; serialises to `diagnosis.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use rig_output::{format_significant, format_unit, format_value};

/// Shares of a gap that differ by less are written alike.
const SAME_SHARE: f64 = 5e-4;

/// Least posterior probability of a name that is called certain: the usual level of an interval.
const CERTAIN: f64 = 0.95;

/// What became of the gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The model explains the data to the noise floor as it is.
    NothingMissing,
    /// Named effects close the gap to a noise floor that no model made, or nearly all of it.
    Explained,
    /// The structure holds; a nominal parameter has changed.
    ParameterChange,
    /// Something is left that no known effect explains.
    Remainder,
    /// The recording cannot be what it says; nothing was fitted.
    DataFault,
}

/// What is compared, and all residuals, floors and gaps are of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Residual {
    /// The torque that the model predicts for the recorded motion, N·m or N.
    #[default]
    Torque,
    /// The position of the model that runs freely on the recorded voltage, rad or m.
    Position,
}

/// What a noise floor rests on. None of these is a model of the torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FloorFrom {
    /// Two runs of one motion: the difference of their residuals.
    RepeatedRuns,
    /// The torque's own noise beyond the band of the motion, with what the steps of the encoders and white noise of the positions leave
    /// in the torque. A lower limit: noise that is not told from the motion is not in it.
    TorqueReading,
    /// No motion was repeated, and the noise of the torque is not told from its signal.
    Unknown,
}

/// What the model that is written leaves of a joint's torque, on data that it was not fitted to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Left {
    /// Name of the joint.
    pub joint: String,
    /// ASCII, N*m or N.
    pub unit: String,
    /// Whether the data are the hold-out; else blocks of the training data, left out of the fit in turn.
    pub on_holdout: bool,
    /// RMS of the residual with the description's parameters fitted again.
    pub before: f64,
    /// RMS of the residual of the written model.
    pub after: f64,
    /// Noise floor of these data; NaN (null) where none is known.
    pub floor: f64,
    /// What it rests on.
    pub floor_from: FloorFrom,
    /// RMS of the recorded torque.
    pub torque: f64,
    /// `after` in per cent of `torque`.
    pub percent_of_torque: f64,
    /// Whether `after` is the noise floor or nearly all of the gap is closed.
    pub explained: bool,
}

/// Where part of the gap sits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Name of the joint.
    pub joint: String,
    /// What it depends on: `velocity`, `position`, `motor angle`, …
    pub coordinate: String,
    /// Interval of the coordinate that holds most of it.
    pub interval: [f64; 2],
    /// Unit of the interval.
    pub unit: String,
    /// Share of the excess over the noise floor that the coordinate alone explains.
    pub share: f64,
    /// Corrected for the number of coordinates.
    pub p_value: f64,
    /// One sentence.
    pub text: String,
}

/// A fitted number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// SI
    pub value: f64,
    /// Standard deviation; 0 of a whole number, infinite where the motion does not tell.
    pub std: f64,
    /// ASCII
    pub unit: String,
}

impl Value {
    /// With its standard deviation and `unit` behind it, or said not to be determined.
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

/// One effect that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Best name.
    pub effect: String,
    /// Which of several laws under that name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<String>,
    /// Name of the joint.
    pub joint: String,
    /// Every name that these data support equally, `effect` among them.
    pub set: Vec<String>,
    /// Its parameters.
    pub parameters: BTreeMap<String, Value>,
    /// Corrected for all that was tried.
    pub p_value: f64,
    /// Posterior probability of the name among all that were tried in its place, by what each leaves of blocks that it was not
    /// fitted to; NaN (null) where no search compared them.
    pub name_probability: f64,
    /// Best name outside the set.
    pub runner_up: Option<String>,
    /// Share of this step's gap that the runner-up would have closed.
    pub runner_up_gap_closed: Option<f64>,
    /// Unit of the residual that this step takes away, ASCII: that of [`Diagnosis::residual`], or V of what shows in the motor's
    /// voltage alone.
    pub rms_unit: String,
    /// RMS of the joint's residual, before and after this step.
    pub train_rms: [f64; 2],
    /// The same on the hold-out; null without one.
    pub holdout_rms: Option<[f64; 2]>,
    /// RMS of the simulated motion's error before and after this step, rad or m; null where it cannot be simulated.
    pub motion_rms: Option<[f64; 2]>,
    /// Share of the hold-out's (else the training) gap that this step closes, 1 at most; NaN (null) where no noise floor is known or
    /// the RMS has grown.
    pub gap_closed: f64,
    /// Why to believe it, one sentence.
    pub why: String,
}

/// What became of an effect that the description states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fate {
    /// It stays, its parameters fitted together with everything else.
    FittedAgain,
    /// It stays with the parameters that it was described with.
    Held,
    /// The recordings contradict it: the new description does not have it.
    Dropped,
    /// It counts as part of its link.
    InTheLink,
}

/// An effect that the description states.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Described {
    /// Its name.
    pub effect: String,
    /// Which of several laws under that name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<String>,
    /// Name of the joint.
    pub joint: String,
    /// What became of it.
    pub fate: Fate,
    /// Its parameters where they were fitted again.
    pub parameters: BTreeMap<String, Value>,
    /// The same in words, one sentence.
    pub text: String,
}

/// What [`Absorbed::before`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Before {
    /// Identified without the effects that were found.
    WithoutEffects,
    /// Stated by the description; there was no effect that could have bent it.
    Described,
}

/// A nominal parameter that moved: when the effects came in, or against the description.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absorbed {
    /// Name with the joint's number, or the base parameter's expression.
    pub parameter: String,
    /// ASCII
    pub unit: String,
    /// As [`Diagnosis::absorbed_before`] says.
    pub before: f64,
    /// Identified, with the effects where there are any.
    pub after: f64,
    /// Difference in standard deviations of the latter.
    pub sigmas: f64,
}

/// All parameters fitted once more, to the simulated motion of the training data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByMotion {
    /// Of the motion, ASCII.
    pub unit: String,
    /// What the simulated motion departs by with the torque's values, and with its own.
    pub motion_rms: [f64; 2],
    /// Of the torque, ASCII.
    pub torque_unit: String,
    /// What the two leave of the torque.
    pub torque_rms: [f64; 2],
    /// Whether the motion's values stand.
    pub adopted: bool,
    /// Each parameter by both.
    pub parameters: Vec<Twice>,
    /// In words.
    pub text: String,
}

/// A parameter by torque and by motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Twice {
    /// Base parameter's expression, or the effect's name and the parameter's with a dot between.
    pub parameter: String,
    /// ASCII
    pub unit: String,
    /// By the torque.
    pub torque: f64,
    /// Of that.
    pub torque_std: f64,
    /// By the simulated motion.
    pub motion: f64,
    /// Of that.
    pub motion_std: f64,
    /// Their difference in standard deviations of both.
    pub sigmas: f64,
}

/// An effect that these data cannot show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotTestable {
    /// Its name.
    pub effect: String,
    /// Name of the joint.
    pub joint: String,
    /// What the data lack.
    pub why: String,
    /// What would show it.
    pub experiment: String,
}

/// The smallest size of an effect that these data would have shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Detectable {
    /// Its name.
    pub effect: String,
    /// Name of the joint.
    pub joint: String,
    /// Which parameter the size is of.
    pub parameter: String,
    /// SI; the median over the shapes of the effect's law that were looked at.
    pub size: f64,
    /// The same at the shape that this motion shows least, such as a breakaway that is gone at a speed it hardly goes through; none
    /// where the law has one shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_at_worst: Option<f64>,
    /// ASCII
    pub unit: String,
}

/// What would separate a set, or make an effect testable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextExperiment {
    /// Which primitive.
    pub kind: String,
    /// Names that it separates, or the one it makes testable.
    pub separates: Vec<String>,
    /// What to do, sentences.
    pub text: String,
    /// File for `rig` to run, beside `diagnosis.json`; none where there is no motion for it.
    pub file: Option<String>,
    /// Distance of the rivals' predictions in standard deviations of the noise, expected.
    pub separation: Option<f64>,
    /// s
    pub duration: Option<f64>,
    /// Whether more than running [`Self::file`] is asked for: a load, the base turned, another sensor.
    #[serde(skip)]
    pub hands: bool,
    /// What [`Self::file`] has to hold, as TOML.
    #[serde(skip)]
    pub trajectory: Option<String>,
}

/// What no known effect explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remainder {
    /// Name of the joint.
    pub joint: String,
    /// RMS beyond the noise floor.
    pub rms: f64,
    /// Its unit: of the residual, or V of what a voltage alone shows.
    pub unit: String,
    /// RMS over the noise floor.
    pub ratio: f64,
    /// Where it sits.
    pub places: Vec<Place>,
    /// In words.
    pub text: String,
    /// Whether it is no number beyond a known floor but a reason not to believe that all is explained: the text says which.
    #[serde(skip)]
    pub doubt: bool,
}

impl Remainder {
    /// Whether it is of a motor's voltage, and the torque may be explained.
    pub fn of_a_voltage(&self) -> bool {
        self.unit == "V"
    }
}

/// Something about a recording that no physics explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DataFault {
    /// `sign`, `magnitude`, `unit`, `ratio`, `clock`, `swap`, `gravity`, `saturation`, `jump`, `too-short`, `not-moving`.
    pub kind: String,
    /// Which columns.
    #[serde(skip)]
    pub about: About,
    /// Which recording.
    pub recording: String,
    /// Name of the joint.
    pub joint: String,
    /// Whether nothing else explains the data; what is not certain stops nothing.
    pub certain: bool,
    /// What is wrong and what would be right, a sentence.
    pub text: String,
}

impl DataFault {
    /// Whether rows are left to fit: not of a recording that cannot be prepared, is too short or does not move.
    pub fn leaves_rows(&self) -> bool {
        self.about != About::Preparation
            && !["too-short", "not-moving"].contains(&self.kind.as_str())
    }
}

/// What of a recording a fault is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The recording, which cannot be prepared: it is broken or irregular.
    Preparation,
    /// Time, or the recording as a whole.
    Recording,
    /// A joint's position or velocity.
    Motion,
    /// A joint's torque.
    Torque,
}

/// RMS of the residual from model to model down to the floor, one joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Waterfall {
    /// Name of the joint.
    pub joint: String,
    /// ASCII, N*m or N; rad or m where [`Diagnosis::residual`] is the position.
    pub unit: String,
    /// Names of the models: `frozen description`, `refitted`, then each effect.
    pub models: Vec<String>,
    /// RMS over the training recordings.
    pub train: Vec<f64>,
    /// RMS over the hold-out; empty without one.
    pub holdout: Vec<f64>,
    /// Noise floor; NaN (null) where none is known.
    pub floor: f64,
    /// … of the hold-out's rows, of which fewer samples are the mean where it was recorded more slowly.
    pub holdout_floor: f64,
}

/// Residual before and after against one coordinate, for a plot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Map {
    /// Name of the joint.
    pub joint: String,
    /// What is on the abscissa.
    pub coordinate: String,
    /// ASCII
    pub unit: String,
    /// ASCII, unit of the residual.
    pub residual_unit: String,
    /// Middles of the bins.
    pub at: Vec<f64>,
    /// Mean residual before, and half the width of its 95 % band.
    pub before: Vec<[f64; 2]>,
    /// Mean residual after, and half the width of its 95 % band.
    pub after: Vec<[f64; 2]>,
    /// The fitted law, without what the nominal model absorbs; empty where there is none.
    pub law: Vec<f64>,
    /// Which step it belongs to, from 0; none for what is left at the end.
    pub step: Option<usize>,
}

/// Curves over time for a plot: a stretch of the hold-out (else training) recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Curves {
    /// Name of the joint.
    pub joint: String,
    /// Which recording.
    pub recording: String,
    /// s
    pub t: Vec<f64>,
    /// Measured and what the models without and with the effects predict, N·m or N; empty where none was recorded.
    pub torque: [Vec<f64>; 3],
    /// Measured and simulated positions without and with the effects, rad or m; empty where not simulated.
    pub motion: [Vec<f64>; 3],
}

/// One candidate in the first round: what else was tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Its name (and law).
    pub effect: String,
    /// Name of the joint.
    pub joint: String,
    /// Which step, from 0.
    pub step: usize,
    /// Share of the residual's RMS that it takes away on blocks it was not fitted to.
    pub gain: f64,
    /// That gain over its standard deviation.
    pub gain_sigmas: f64,
    /// Corrected for all that was tried.
    pub p_value: f64,
    /// Why it was not taken; empty for the one that was.
    pub refused: String,
}

impl Step {
    /// RMS before and after, of the hold-out, else of the training data.
    pub fn judged(&self) -> [f64; 2] {
        self.holdout_rms.unwrap_or(self.train_rms)
    }

    /// How far the step closes its gap: a share from 0 to 1 in per cent, else the RMS before and after, as a share of a gap whose floor
    /// is not known, or that has grown, is no number.
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
    /// Noise floor of what the models are judged on.
    pub fn judged_floor(&self) -> f64 {
        if self.holdout.is_empty() {
            self.floor
        } else {
            self.holdout_floor
        }
    }

    /// The models' RMS on the recordings held back, else on those of the fit.
    pub fn judged(&self) -> &[f64] {
        if self.holdout.is_empty() {
            &self.train
        } else {
            &self.holdout
        }
    }
}

/// How recordings were treated before anything was compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Treated {
    /// Of the training recordings, Hz.
    pub sample_rate: f64,
    /// Cut-off of the low-pass on the position, Hz.
    pub position_cutoff: f64,
    /// Why, a sentence.
    pub position_cutoff_why: String,
    /// Cut-off of the position that inertia and gravity are formed of before they pass the low-pass above, Hz; null where that takes
    /// nothing away in the band, so that they are formed of the filtered position.
    pub links_cutoff: Option<f64>,
    /// Upper end of the band that is compared, Hz.
    pub band: f64,
    /// Highest frequency of the motion, Hz.
    pub motion_frequency: f64,
    /// Rows a second.
    pub row_rate: f64,
    /// Joint by joint.
    pub rows: Vec<Rows>,
}

/// Rows of a joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rows {
    /// Its name.
    pub joint: String,
    /// Speed below which rows are left out.
    pub least_speed: f64,
    /// Of that, ASCII.
    pub unit: String,
    /// Used and all of the training recordings.
    pub train: [usize; 2],
    /// The same of the hold-out; null without one.
    pub holdout: Option<[usize; 2]>,
}

/// The result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// `rig-diagnosis/1`
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// What became of the gap.
    pub verdict: Verdict,
    /// What is compared.
    pub residual: Residual,
    /// The verdict in words, sentences.
    pub words: Vec<String>,
    /// Per joint, in the residual's unit; NaN (null) where none is known.
    pub noise_floor_rms: Vec<f64>,
    /// What each of them rests on; empty where the residual is no torque.
    pub noise_floor_from: Vec<FloorFrom>,
    /// What the written model leaves, joint by joint; empty where the residual is no torque.
    pub left: Vec<Left>,
    /// How it was estimated, a sentence.
    pub noise_floor_how: String,
    /// How the motion was simulated, or why not, a sentence.
    pub motion_how: String,
    /// How the recordings were treated; null where nothing was fitted, and of a model that a voltage drives.
    pub treatment: Option<Treated>,
    /// Per joint, how long before it acts (negative: after) a torque was recorded, s; taken out.
    pub torque_lead: Vec<f64>,
    /// Where the gap sits, most of it first; empty where it goes with no coordinate more than chance would have it.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// The description's own effects, in its order.
    pub described: Vec<Described>,
    /// What was found beside them, in that order.
    pub steps: Vec<Step>,
    /// Of the hold-out (else training) residual's excess over the noise floor; null where nothing was found. Of what fitting the
    /// description again leaves; of what it leaves as it stands where its own values are said to have changed.
    pub gap_closed: Option<f64>,
    /// Nominal parameters that had been lying; without effects, those of the description. Empty where it states none.
    pub absorbed: Vec<Absorbed>,
    /// What they are compared with.
    pub absorbed_before: Before,
    /// All of them by torque and by motion; none where that was not done.
    pub by_motion: Option<ByMotion>,
    /// Effects that these data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// The smallest size of each other effect that they would have shown.
    pub detectable: Vec<Detectable>,
    /// What to do next.
    pub next_experiment: Option<NextExperiment>,
    /// What is left.
    pub remainder: Option<Remainder>,
    /// What is wrong with the data.
    pub data_faults: Vec<DataFault>,
    /// RMS from model to model.
    pub waterfall: Vec<Waterfall>,
    /// Everything that was tried.
    pub tried: Vec<Tried>,
    /// Residual maps for plots.
    #[serde(skip)]
    pub maps: Vec<Map>,
    /// Curves for plots.
    #[serde(skip)]
    pub curves: Vec<Curves>,
}

impl Diagnosis {
    /// Whether a step's name is certain: no other name is in its set, the posterior probability of the name is at least 95 %, and
    /// what is left of its joint leaves nothing for another name to explain.
    pub fn is_certain(&self, step: &Step) -> bool {
        let own = self.left.iter().find(|left| left.joint == step.joint);
        let left =
            (self.remainder.as_ref()).is_some_and(|r| r.joint == step.joint && r.unit != "V");
        step.set.len() < 2
            && (step.name_probability.is_nan() || step.name_probability >= CERTAIN)
            && own.is_none_or(|own| own.explained)
            && !left
    }

    /// Share that the effects close of the gap which fitting the description's parameters again leaves, where [`Self::gap_closed`]
    /// counts that fitting in; none where it is of the effects alone.
    pub fn closed_by_effects(&self) -> Option<f64> {
        let (mut gap, mut closed) = (0.0, 0.0);
        for w in &self.waterfall {
            // A changed value that has an effect's name is a step, and no model of its own.
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
