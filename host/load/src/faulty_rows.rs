//! Rows whose readings the load by all other rows contradicts: they are left out, and a sentence names them.

use rig_data::Block;
use rig_model::robot::WristSensor;

use crate::causes::{Compared, compared, explains, score};
use crate::clipping::{self, Suspect};
use crate::cut_channel::{CutChannel, cut_channel};
use crate::error::LoadError;
use crate::intake::{Intake, MOST_SATURATED};
use crate::odd_pose::{OddPoses, odd_poses};
use crate::settle::DECISIVE;
use crate::statistics::Recorded;
use crate::system::{Fit, Sensed};

/// Rows that were found to be faulty.
#[derive(Default)]
pub(crate) struct FaultyRows {
    cut: Vec<Cut>,
    /// True once readings that are cut have been looked for.
    is_searched: bool,
    /// Poses in the order in which they are left out.
    poses: Vec<FaultyPoses>,
    /// A channel that is cut in more than half of the poses.
    channel: Option<CutChannel>,
}

/// Poses of a recording that are left out.
enum FaultyPoses {
    /// A channel is cut there.
    Cut(CutChannel),
    /// The load by the others does not explain them.
    Odd(OddPoses),
}

impl FaultyPoses {
    /// Leaves the poses out.
    fn leave_out(&self, recordings: &mut [Recorded]) {
        let (recording, poses) = match self {
            Self::Cut(own) => (own.recording, &own.poses),
            Self::Odd(own) => (own.recording, &own.poses),
        };
        if let Some(recorded) = recordings.get_mut(recording) {
            *recorded = recorded.without_poses(poses);
        }
    }
}

impl FaultyRows {
    /// Reads the recordings without these rows, the readings `delay` seconds later than the positions.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn left_out(
        &self,
        intake: &Intake,
        delay: f64,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Recorded>, LoadError> {
        self.left_out_changed(intake, delay, warnings, &|_| {})
    }

    /// Reads the recordings as [`Self::left_out`] does, each block changed beforehand.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn left_out_changed(
        &self,
        intake: &Intake,
        delay: f64,
        warnings: &mut Vec<String>,
        change: &dyn Fn(&mut Block),
    ) -> Result<Vec<Recorded>, LoadError> {
        let mut recordings = intake.read_changed(delay, &places(&self.cut), warnings, change)?;
        for own in &self.poses {
            own.leave_out(&mut recordings);
        }
        Ok(recordings)
    }

    /// Looks for further rows in recordings that were compared; returns true if there are any.
    ///
    /// # Errors
    /// [`LoadError`].
    pub(crate) fn search(
        &mut self,
        intake: &Intake,
        sensed: &Sensed,
        compared: &Compared,
        (sensor, delay): (&WristSensor, f64),
    ) -> Result<bool, LoadError> {
        if !self.is_searched {
            self.is_searched = true;
            self.cut = clipped(intake, sensed, compared, (sensor, delay))?;
            if !self.cut.is_empty() {
                return Ok(true);
            }
        }
        let odd = odd_beside(sensed, compared, sensor)?;
        let cut = cut_channel(sensed, compared);
        let cut = cut.filter(|cut| odd.as_ref().is_none_or(|odd| cut.score < odd.1));
        let found = match (cut, odd) {
            (Some(cut), _)
                if sensed.recordings[cut.recording].rows() < 2 * cut.poses.len() as u64 =>
            {
                self.channel = Some(cut);
                return Ok(false);
            }
            (Some(cut), _) => FaultyPoses::Cut(cut),
            (None, Some((odd, _))) => FaultyPoses::Odd(odd),
            (None, None) => return Ok(false),
        };
        self.poses.push(found);
        Ok(true)
    }

    /// Returns the channel that is cut in more than half of the poses, and says where.
    pub(crate) fn channel(&self, sensed: &Sensed, sensor: &WristSensor) -> Option<(usize, String)> {
        let cut = self.channel.as_ref()?;
        let recorded = &sensed.recordings[cut.recording];
        let range = range(sensor, cut.channel);
        let text =
            clipping::poses_words(recorded, (cut.channel, cut.level), range, cut.poses.len());
        Some((cut.channel, text))
    }

    /// Says which rows were left out, and why.
    ///
    /// # Errors
    /// [`LoadError::Fault`] if a channel is cut in most rows, unless the user goes on.
    pub(crate) fn words(
        &self,
        sensed: &Sensed,
        sensor: &WristSensor,
        even_if_wrong: bool,
    ) -> Result<Vec<String>, LoadError> {
        let cut = |recording: usize, channel, level| {
            let recorded = &sensed.recordings[recording];
            cut_words(recorded, (channel, level), sensor, even_if_wrong)
        };
        let rows = self.cut.iter();
        let rows = rows.map(|own| cut(own.recording, own.suspect.channel, own.level));
        let poses = self.poses.iter().map(|own| match own {
            FaultyPoses::Cut(own) => cut(own.recording, own.channel, own.level),
            FaultyPoses::Odd(own) => Ok(own.text.clone()),
        });
        rows.chain(poses).collect()
    }
}

/// Readings of a recording that are cut within the described range of the sensor.
struct Cut {
    recording: usize,
    suspect: Suspect,
    /// Mean of these readings.
    level: f64,
}

/// Says where a channel is cut.
///
/// # Errors
/// [`LoadError::Fault`] if most rows are lost, unless the user goes on.
fn cut_words(
    recorded: &Recorded,
    (channel, level): (usize, f64),
    sensor: &WristSensor,
    even_if_wrong: bool,
) -> Result<String, LoadError> {
    let text = clipping::words(recorded, channel, level, range(sensor, channel));
    match recorded.left_out() > MOST_SATURATED && !even_if_wrong {
        true => Err(LoadError::Fault(text)),
        false => Ok(text),
    }
}

/// Returns the described range of a channel.
fn range(sensor: &WristSensor, channel: usize) -> Option<f64> {
    match channel {
        0..3 => sensor.force_range,
        _ => sensor.moment_range,
    }
}

/// Finds poses that the load by the others does not explain, if an error of each of their readings explains all readings
/// decisively better than the description or any cause does. Beside them stands the score of this explanation. Some causes bend
/// what is found beside the load, so the plain description is looked at first.
///
/// # Errors
/// [`LoadError`].
fn odd_beside(
    sensed: &Sensed,
    compared: &Compared,
    sensor: &WristSensor,
) -> Result<Option<(OddPoses, f64)>, LoadError> {
    if sensed.recordings.iter().any(|recorded| !recorded.poses) {
        return Ok(None);
    }
    let described = &compared.described;
    let own = &described.selected.fit;
    let plain = sensed.fit(&described.start, &own.unknowns.plain());
    let least = compared.least();
    for fit in [&plain, own] {
        let Some(odd) = (!sensed.is_exact(fit))
            .then(|| odd_poses(sensed, fit))
            .flatten()
        else {
            continue;
        };
        let mut recordings = sensed.recordings.to_vec();
        if let Some(own) = recordings.get_mut(odd.recording) {
            *own = own.without_poses(&odd.poses);
        }
        let without = Sensed {
            recordings: &recordings,
            ..*sensed
        };
        // The errors are further unknowns, and nothing is left in these poses.
        let mut explained = self::compared(&without, sensor)?.described.selected.fit;
        let errors = 6 * odd.poses.len();
        explained.values.extend(vec![0.0; errors]);
        explained.equations += errors as u64;
        let score = score(sensed, &explained);
        if score < least - DECISIVE {
            return Ok(Some((odd, score)));
        }
    }
    Ok(None)
}

/// Returns the channels that are cut, and in which recording.
fn places(cut: &[Cut]) -> Vec<(usize, Suspect)> {
    cut.iter().map(|own| (own.recording, own.suspect)).collect()
}

/// Finds readings that are cut within the described range, if nothing else leaves the noise, or only beside jumps of the
/// bias. All suspected rows are left out, and the load by the others tells which of them were cut. Without these, about the
/// noise must be left, and fewer jumps. Too few rows that are left tell nothing: noise alone lies near its extreme values in
/// most segments.
///
/// # Errors
/// [`LoadError`].
fn clipped(
    intake: &Intake,
    sensed: &Sensed,
    compared: &Compared,
    (sensor, delay): (&WristSensor, f64),
) -> Result<Vec<Cut>, LoadError> {
    let fits = compared.causes.iter().chain([&compared.described]);
    let fits = fits.map(|own| &own.selected.fit);
    let jumps = fits.filter(|fit| explains(sensed, fit)).map(jumps).min();
    let suspects = intake.suspects();
    if suspects.is_empty() || jumps == Some(0) {
        return Ok(Vec::new());
    }
    let recordings = intake.read(delay, &suspects, &mut Vec::new())?;
    let without = Sensed {
        recordings: &recordings,
        ..*sensed
    };
    let known = match self::compared(&without, sensor) {
        Err(LoadError::TooFew { .. }) => return Ok(Vec::new()),
        other => other?,
    };
    let fit = &known.described.selected.fit;
    let cut = |(recording, suspect): (usize, Suspect)| {
        let all = (recording, &sensed.recordings[recording]);
        let level = clipping::cut_at(&suspect, all, &without, fit)?;
        Some(Cut {
            recording,
            suspect,
            level,
        })
    };
    let found: Vec<Cut> = suspects.into_iter().filter_map(cut).collect();
    if found.is_empty() {
        return Ok(found);
    }
    // Something else than a limit may act at extreme readings, too.
    let recordings = intake.read(delay, &places(&found), &mut Vec::new())?;
    let without = Sensed {
        recordings: &recordings,
        ..without
    };
    let fit = self::compared(&without, sensor)?.described.selected.fit;
    let is_simpler = jumps.is_none_or(|jumps| self::jumps(&fit) < jumps);
    Ok(match explains(&without, &fit) && is_simpler {
        true => found,
        false => Vec::new(),
    })
}

/// Returns the number of jumps of the bias in a fit.
fn jumps(fit: &Fit) -> usize {
    fit.unknowns.jumps.len()
}
