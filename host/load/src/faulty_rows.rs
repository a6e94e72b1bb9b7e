//! Rows whose readings the load by all other rows contradicts: they are left out, and a sentence names them.

use rig_model::robot::WristSensor;

use crate::causes::{Compared, compared, explains};
use crate::clipping::{self, Suspect};
use crate::error::LoadError;
use crate::intake::{Intake, MOST_SATURATED};
use crate::odd_pose::{OddPoses, odd_poses};
use crate::settle::DECISIVE;
use crate::statistics::Recorded;
use crate::system::{Fit, Sensed, Unknowns};

/// Rows that were found to be faulty.
#[derive(Default)]
pub(crate) struct FaultyRows {
    cut: Vec<Cut>,
    /// True once readings that are cut have been looked for.
    is_searched: bool,
    /// Poses in the order in which they are left out.
    odd: Vec<OddPoses>,
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
        let mut recordings = intake.read(delay, &places(&self.cut), warnings)?;
        for own in &self.odd {
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
        let is_found = odd.is_some();
        self.odd.extend(odd);
        Ok(is_found)
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
        let poses = self.odd.iter().map(|own| match own.cut {
            Some((channel, level)) => cut(own.recording, channel, level),
            None => Ok(own.words().to_owned()),
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
    let range = match channel {
        0..3 => sensor.force_range,
        _ => sensor.moment_range,
    };
    let text = clipping::words(recorded, channel, level, range);
    match recorded.left_out() > MOST_SATURATED && !even_if_wrong {
        true => Err(LoadError::Fault(text)),
        false => Ok(text),
    }
}

/// Finds poses that the load by the others does not explain, and without which the description fits decisively better than
/// it or any cause does with them. Some of them bend what is found beside the load, so the plain description is looked at
/// first.
///
/// # Errors
/// [`LoadError`].
fn odd_beside(
    sensed: &Sensed,
    compared: &Compared,
    sensor: &WristSensor,
) -> Result<Option<OddPoses>, LoadError> {
    if sensed.recordings.iter().any(|recorded| !recorded.poses) {
        return Ok(None);
    }
    let described = &compared.described;
    let own = &described.selected.fit;
    let plain = Unknowns {
        tool: own.unknowns.tool,
        ..Unknowns::default()
    };
    let plain = sensed.fit(&described.start, &plain);
    let by_row = |sensed: &Sensed, score: f64| score / sensed.used_rows(&own.unknowns) as f64;
    let all = compared.causes.iter().chain([described]);
    let least = all.map(|own| own.score).fold(f64::INFINITY, f64::min);
    for fit in [&plain, own] {
        let Some(odd) = (!sensed.is_exact(fit))
            .then(|| odd_poses(sensed, fit))
            .flatten()
        else {
            continue;
        };
        let mut recordings = sensed.recordings.to_vec();
        odd.leave_out(&mut recordings);
        let without = Sensed {
            recordings: &recordings,
            ..*sensed
        };
        let score = by_row(&without, self::compared(&without, sensor)?.described.score);
        let rows = sensed.used_rows(&own.unknowns) as f64;
        if rows * (score - by_row(sensed, least)) < -DECISIVE {
            return Ok(Some(odd));
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
