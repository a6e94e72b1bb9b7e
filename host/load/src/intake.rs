//! The recordings of the wrist sensor: judged and surveyed once, and read as often as the equations need them.

use rig_data::Block;
use rig_data::prepare::{
    Changed, MaybeResampled, PrepareOptions, PreprocessingPlan, Recording, Survey, as_recordings,
};
use rig_model::robot::{Robot, WristSensor};
use rig_output::{format_significant, listed};
use rig_shared::multibody::Chain;

use crate::axes::SensorAxes;
use crate::channels::{Judged, judge};
use crate::clipping::Suspect;
use crate::error::LoadError;
use crate::motion_sample::MotionSample;
use crate::pace::Pace;
use crate::poses::poses;
use crate::rows::each_row;
use crate::settle::DECISIVE;
use crate::statistics::{Collector, Recorded};
use crate::torqueless::Torqueless;
use crate::wrench_row::WrenchRow;

/// Share of the rows that may be left out because of saturation.
pub(crate) const MOST_SATURATED: f64 = 0.5;

/// Most halvings of the cut-off of the positions.
const HALVINGS: i32 = 6;

/// Recordings of the wrist sensor.
pub(crate) struct Sensing<'a> {
    pub robot: &'a Robot,
    pub chain: &'a Chain<f64>,
    /// Recordings with the load, then those without it.
    pub recordings: &'a [(&'a dyn Recording, bool)],
    pub prepare: &'a PrepareOptions,
    /// True if every row of every recording is a pose at rest.
    pub poses: bool,
    /// True to go on with the best explanation if the channels look wrong.
    pub even_if_wrong: bool,
}

/// Judges the channels of all recordings.
///
/// # Errors
/// [`LoadError`] of the first one that cannot be used.
pub(crate) fn judged(sensing: &Sensing, sensor: &WristSensor) -> Result<Vec<Judged>, LoadError> {
    let judge = |(recording, _): &(&dyn Recording, bool)| {
        judge(*recording, sensing.robot, sensor, sensing.poses)
    };
    let judged: Vec<Judged> = (sensing.recordings.iter().map(judge)).collect::<Result<_, _>>()?;
    let mut faults = judged
        .iter()
        .flat_map(|own| own.spike.iter().chain(&own.frozen));
    let fault = faults.next().cloned();
    match fault {
        Some(text) if !sensing.even_if_wrong => Err(LoadError::Fault(text)),
        _ => Ok(judged),
    }
}

/// Returns the recordings of a motion.
pub(crate) fn moving<'a>(sensing: &Sensing<'a>, judged: &[Judged]) -> Vec<Torqueless<'a>> {
    (sensing.recordings.iter().zip(judged))
        .filter(|(_, judged)| !judged.poses)
        .map(|((recording, _), _)| Torqueless(*recording))
        .collect()
}

/// Recordings that are ready to be read.
pub(crate) struct Intake<'a> {
    sensing: &'a Sensing<'a>,
    sensor: &'a WristSensor,
    /// By recording.
    judged: Vec<Judged>,
    /// By recording of a motion.
    surveys: Vec<Survey>,
    usable: Vec<&'a dyn Recording>,
    /// Preparation of the recordings of a motion; `None` for poses.
    pub plan: Option<PreprocessingPlan>,
    /// Plan whose band the readings keep; `None` for that of `plan`.
    band: Option<PreprocessingPlan>,
}

impl<'a> Intake<'a> {
    /// Decides how the recordings are prepared; `surveys` and `usable` are those of [`moving`].
    ///
    /// # Errors
    /// [`LoadError::Prepare`].
    pub(crate) fn of(
        sensing: &'a Sensing<'a>,
        sensor: &'a WristSensor,
        judged: Vec<Judged>,
        surveys: Vec<Survey>,
        usable: &'a [MaybeResampled<'a>],
    ) -> Result<Self, LoadError> {
        let plan = match surveys.is_empty() {
            true => None,
            false => Some(PreprocessingPlan::decide(
                &surveys,
                sensing.prepare,
                &vec![None; sensing.robot.joints.len()],
            )?),
        };
        Ok(Self {
            sensing,
            sensor,
            judged,
            surveys,
            usable: as_recordings(usable),
            plan,
            band: None,
        })
    }

    /// Lowers the cut-off of the positions as long as load and bias leave less, if that is decisively less in the end and about
    /// the noise. The spectrum of a robot that hardly moves is that of noise, which gives a high cut-off, and accelerations of
    /// noise would be taken for what moves the load. The readings stay in their band, so all cut-offs are compared on the same
    /// readings. `fit` returns the misfit, and true if no more than about the noise is left: positions that are wrong fit better
    /// the less they move, and explain nothing. Returns the cut-off if it was lowered, Hz.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn lower_cutoff(
        &mut self,
        fit: &dyn Fn(&[Recorded]) -> (f64, bool),
    ) -> Result<Option<f64>, LoadError> {
        let Some(first) = self.plan.clone() else {
            return Ok(None);
        };
        let of = |own: &Self| Ok::<_, LoadError>(fit(&own.read(0.0, &[], &mut Vec::new())?));
        let (as_decided, mut explained) = of(self)?;
        let mut least = as_decided;
        self.band = Some(first.clone());
        let mut kept = first.clone();
        for halving in 1..=HALVINGS {
            let plan = PreprocessingPlan {
                cutoff: first.cutoff / f64::from(1 << halving),
                ..first.clone()
            };
            self.plan = Some(plan.clone());
            let (own, explains) = of(self)?;
            if own > least {
                break;
            }
            (least, explained, kept) = (own, explains, plan);
        }
        let is_lower = explained && least < as_decided - DECISIVE;
        let plan = if is_lower { kept } else { first };
        let lowered = is_lower.then_some(plan.cutoff);
        self.plan = Some(plan);
        Ok(lowered)
    }

    /// Returns what is to be said of the recordings before they are read.
    pub(crate) fn notes(&self) -> impl Iterator<Item = String> {
        self.surveys.iter().filter_map(|s| s.note.clone())
    }

    /// Returns the sides of channels whose readings may be cut within the described range, by recording of a motion.
    pub(crate) fn suspects(&self) -> Vec<(usize, Suspect)> {
        let all = self.judged.iter().enumerate();
        let moving = all.filter(|(_, judged)| !judged.poses);
        moving
            .flat_map(|(r, judged)| judged.suspects.iter().map(move |own| (r, *own)))
            .collect()
    }

    /// Reads the recordings, the readings `delay` seconds later than the positions. Rows of the channels `cut` are left out.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn read(
        &self,
        delay: f64,
        cut: &[(usize, Suspect)],
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Recorded>, LoadError> {
        self.read_changed(delay, cut, warnings, &|_| {})
    }

    /// Reads the recordings as [`Self::read`] does, each block changed beforehand.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn read_changed(
        &self,
        delay: f64,
        cut: &[(usize, Suspect)],
        warnings: &mut Vec<String>,
        change: &dyn Fn(&mut Block),
    ) -> Result<Vec<Recorded>, LoadError> {
        let sensing = self.sensing;
        let axes = self.axes();
        let mut prepared = self.surveys.iter().zip(&self.usable);
        let mut recordings = Vec::new();
        let all = sensing.recordings.iter().zip(&self.judged).enumerate();
        for (r, ((recording, loaded), judged)) in all {
            let label = recording.label();
            let mut ends = judged.ends;
            let own = cut.iter().filter(|(recording, _)| *recording == r);
            own.for_each(|(_, suspect)| suspect.narrow(&mut ends));
            let poses = judged.poses;
            let next = if poses { None } else { prepared.next() };
            let (collector, passed) = match (&self.plan, next) {
                (Some(plan), Some((survey, usable))) => {
                    let rows = survey.rows / plan.decimation as u64;
                    let mut collector = Collector::new(rows, judged.length);
                    let mut take = |row: &WrenchRow| collector.push(row);
                    let read = (&ends, delay);
                    let inner = *usable;
                    let usable = Changed { inner, change };
                    let plans = [plan, self.band.as_ref().unwrap_or(plan)];
                    let passed = each_row(sensing.chain, &axes, &usable, plans, read, &mut take)?;
                    (collector, passed)
                }
                _ => {
                    let read = (&ends, judged.pace);
                    let inner = *recording;
                    let recording = Changed { inner, change };
                    let (rows, passed) = self::poses(sensing.chain, &axes, &recording, read)?;
                    let mut collector = Collector::new(rows.len() as u64, judged.length);
                    rows.iter().for_each(|row| collector.push(row));
                    if !sensing.poses {
                        warnings.push(taken_as_poses(&label, judged, collector.rows()));
                    }
                    (collector, passed)
                }
            };
            let recorded = collector.finish(label, *loaded, poses, passed);
            warnings.extend(judged.spike.iter().chain(&judged.frozen).cloned());
            saturation(&recorded, judged, sensing.even_if_wrong, warnings)?;
            recordings.push(recorded);
        }
        Ok(recordings)
    }

    /// Returns the model of the robot.
    pub(crate) fn chain(&self) -> &Chain<f64> {
        self.sensing.chain
    }

    /// Returns the robot.
    pub(crate) fn robot(&self) -> &Robot {
        self.sensing.robot
    }

    /// Returns the described axes of the sensor.
    pub(crate) fn axes(&self) -> SensorAxes {
        SensorAxes::of(&(self.sensing.robot.flange_pose() * self.sensor.pose()))
    }

    /// Reads a sample of each recording, with its name and whether the load is mounted; `None` if one of them is of poses.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn samples(&self) -> Result<Option<Vec<Sampled>>, LoadError> {
        let Some(plan) = self
            .plan
            .as_ref()
            .filter(|_| self.judged.iter().all(|judged| !judged.poses))
        else {
            return Ok(None);
        };
        let prepared = self.surveys.iter().zip(&self.usable);
        let all = self
            .sensing
            .recordings
            .iter()
            .zip(&self.judged)
            .zip(prepared);
        let samples = all.map(|(((recording, loaded), judged), (survey, usable))| {
            let size = (survey.rows / plan.decimation as u64, judged.length);
            let sample = MotionSample::read(*usable, plan, &judged.ends, size)?;
            Ok((sample, recording.label(), *loaded))
        });
        samples.collect::<Result<_, _>>().map(Some)
    }
}

/// A sample of a recording, its name, and true if the load was mounted.
pub(crate) type Sampled = (MotionSample, String, bool);

/// Says that a recording was taken as poses at rest.
fn taken_as_poses(label: &str, judged: &Judged, poses: u64) -> String {
    let rows = judged.rows;
    match judged.pace {
        Pace::Listed if poses == rows => {
            format!("{label} has {rows} rows: each was taken as a pose at rest.")
        }
        Pace::Listed => {
            format!("{label} has {rows} rows: they were taken as {poses} poses at rest.")
        }
        Pace::Continuous => format!(
            "{label} has {rows} rows, too few for a motion: the {poses} poses at which the robot stands were taken."
        ),
    }
}

/// Says which channels were cut, and refuses a recording that mostly was.
fn saturation(
    recorded: &Recorded,
    judged: &Judged,
    even_if_wrong: bool,
    warnings: &mut Vec<String>,
) -> Result<(), LoadError> {
    if judged.cut.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = (judged.cut.iter())
        .map(|(column, value)| {
            let unit = if column.starts_with('f') { "N" } else { "N·m" };
            format!("{column} at {} {unit}", format_significant(*value, 4))
        })
        .collect();
    let left_out = recorded.left_out();
    let text = format!(
        "{}: the sensor was saturated ({}); {:.1} % of the rows were left out.",
        recorded.label,
        listed(&list),
        100.0 * left_out
    );
    if left_out > MOST_SATURATED && !even_if_wrong {
        return Err(LoadError::Fault(format!(
            "{text} Take a sensor with a larger range, a slower motion, or poses with a smaller lever."
        )));
    }
    warnings.push(text);
    Ok(())
}
