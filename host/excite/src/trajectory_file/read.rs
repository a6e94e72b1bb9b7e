//! Reader of a trajectory's TOML text.

use std::path::Path;

use rig_shared::trajectory::{
    AMPLITUDES, Chirp, Fourier, FrictionSweep, HARMONICS, LEVELS, SPEEDS, SlowReversals, Staircase,
    Sweep, Trajectory,
};
use toml::Spanned;

use super::content::{DesignRecord, JointTrajectory, TrajectoryFile};
use super::foreign::{foreign, is_robot};
use super::text::{DesignText, FileText, JointText, MotionText};
use crate::{Criterion, ExciteError};
use rig_model::robot::Place;

/// Converts a time to whole microseconds, exactly.
fn micros(name: &str, seconds: f64) -> Result<u32, String> {
    let whole = (seconds * 1e6).round();
    if !(0.0..=f64::from(u32::MAX)).contains(&whole) {
        return Err(format!(
            "{name} is {seconds} s, but times lie between 0 and 4294 s"
        ));
    }
    // Rounding errors of the decimal number are far below a thousandth of a microsecond.
    if (seconds * 1e6 - whole).abs() > 1e-3 {
        return Err(format!(
            "{name} is {seconds} s, but the rig counts whole microseconds; round it to 6 decimals"
        ));
    }
    Ok(whole as u32)
}

fn at_most<T>(name: &str, list: &[T], most: usize) -> Result<(), String> {
    if list.len() <= most {
        Ok(())
    } else {
        Err(format!(
            "{name} has {} entries, but at most {most} are possible",
            list.len()
        ))
    }
}

/// Returns the whole microseconds of several times.
fn all_micros(name: &str, list: &[f64]) -> Result<Vec<u32>, String> {
    list.iter().map(|s| micros(name, *s)).collect()
}

/// Returns the sweep of a name.
fn sweep_of(name: &str) -> Result<Sweep, String> {
    match name {
        "linear" => Ok(Sweep::Linear),
        "logarithmic" => Ok(Sweep::Logarithmic),
        other => Err(format!(
            "sweep is \"{other}\", but it must be \"linear\" or \"logarithmic\""
        )),
    }
}

/// Returns a Fourier series; `period` and `ramp` in s.
fn fourier(
    period: f64,
    periods: u16,
    ramp: f64,
    sine: &[f64],
    cosine: &[f64],
) -> Result<Fourier<f64>, String> {
    at_most("sine", sine, HARMONICS)?;
    at_most("cosine", cosine, HARMONICS)?;
    Ok(Fourier {
        period_us: micros("period", period)?,
        periods,
        ramp_us: micros("ramp", ramp)?,
        sine: sine.iter().copied().collect(),
        cosine: cosine.iter().copied().collect(),
    })
}

/// Returns a friction sweep; all times in s.
fn friction_sweep(
    half_span: f64,
    cruise: &[f64],
    [ramp, dwell, lead]: [f64; 3],
) -> Result<FrictionSweep<f64>, String> {
    at_most("cruise", cruise, SPEEDS)?;
    Ok(FrictionSweep {
        half_span,
        cruise_us: all_micros("cruise", cruise)?.into_iter().collect(),
        ramp_us: micros("ramp", ramp)?,
        dwell_us: micros("dwell", dwell)?,
        lead_us: micros("lead", lead)?,
    })
}

impl MotionText {
    /// Returns the motion, checked.
    fn trajectory(&self) -> Result<Trajectory<f64>, String> {
        let trajectory = self.stated()?;
        trajectory.validate().map_err(|e| {
            format!(
                "{e}; times and amplitudes must be finite, above zero and fit each other (see `rig excite --help`)"
            )
        })?;
        Ok(trajectory)
    }

    /// Returns the motion as the file states it.
    fn stated(&self) -> Result<Trajectory<f64>, String> {
        Ok(match self {
            Self::Hold { duration } => Trajectory::Hold(micros("duration", *duration)?),
            Self::Fourier {
                period,
                periods,
                ramp,
                sine,
                cosine,
            } => Trajectory::Fourier(fourier(*period, *periods, *ramp, sine, cosine)?),
            Self::Chirp {
                start_hz,
                end_hz,
                sweep,
                duration,
                ramp,
                amplitude,
                velocity,
                acceleration,
                again,
            } => Trajectory::Chirp(Chirp {
                start_hz: *start_hz,
                end_hz: *end_hz,
                sweep: sweep_of(sweep)?,
                duration_us: micros("duration", *duration)?,
                ramp_us: micros("ramp", *ramp)?,
                amplitude: *amplitude,
                velocity: *velocity,
                acceleration: *acceleration,
                again: *again,
            }),
            Self::Staircase {
                levels,
                moving,
                dwell,
            } => {
                at_most("levels", levels, LEVELS)?;
                Trajectory::Staircase(Staircase {
                    levels: levels.iter().copied().collect(),
                    move_us: micros("move", *moving)?,
                    dwell_us: micros("dwell", *dwell)?,
                })
            }
            Self::Reversals {
                speed,
                half_turn,
                quarter,
                cycles,
            } => {
                at_most("quarter", quarter, AMPLITUDES)?;
                Trajectory::SlowReversals(SlowReversals {
                    speed: *speed,
                    half_turn_us: micros("half_turn", *half_turn)?,
                    quarter_us: all_micros("quarter", quarter)?.into_iter().collect(),
                    cycles: *cycles,
                })
            }
            Self::Sweep {
                half_span,
                cruise,
                ramp,
                dwell,
                lead,
            } => {
                let times = [*ramp, *dwell, *lead];
                Trajectory::FrictionSweep(friction_sweep(*half_span, cruise, times)?)
            }
        })
    }
}

/// Returns the record of a design; the error has the position in the text.
fn design_of(text: &Spanned<DesignText>) -> Result<DesignRecord, (usize, String)> {
    let d = text.get_ref();
    let criterion = Criterion::from_name(&d.criterion).ok_or_else(|| {
        (
            text.span().start,
            format!(
                "criterion is \"{}\", but it must be cond, min-singular or d-optimal",
                d.criterion
            ),
        )
    })?;
    Ok(DesignRecord {
        criterion,
        value: d.value,
        condition_number: d.condition_number,
        seed: d.seed,
    })
}

/// Returns the motion of one joint; the error has the position in the text.
fn joint_of(joint: &JointText) -> Result<JointTrajectory, (usize, String)> {
    let start = *joint.start.get_ref();
    if !start.is_finite() {
        return Err((
            joint.start.span().start,
            format!("start is {start}, but it must be a finite number, in rad or m"),
        ));
    }
    let trajectory = joint.trajectory.get_ref().trajectory().map_err(|message| {
        (
            joint.trajectory.span().start,
            format!("in the trajectory of joint \"{}\", {message}", joint.name),
        )
    })?;
    Ok(JointTrajectory {
        name: joint.name.clone(),
        start,
        trajectory,
    })
}

impl TrajectoryFile {
    /// Reads TOML text; `path` only names the source in messages.
    ///
    /// # Errors
    /// [`ExciteError::Toml`], [`ExciteError::NoParameters`].
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, ExciteError> {
        let robot = || is_robot(text).then_some("a robot description");
        if let Some(found) = foreign(text.as_bytes()).or_else(robot) {
            return Err(ExciteError::NoParameters {
                path: path.into(),
                found,
            });
        }
        let wrong = |offset: usize, message: String| ExciteError::Toml {
            path: path.into(),
            place: Place::of(text, offset),
            message,
        };
        let file: FileText = toml::from_str(text).map_err(|e| {
            let said = e.message().lines().collect::<Vec<_>>().join(", ");
            wrong(
                e.span().map_or(0, |s| s.start),
                format!(
                    "{}; `rig excite` writes an example of a trajectory file",
                    said.replace("expected f64", "expected a number")
                ),
            )
        })?;
        if file.joints.is_empty() {
            return Err(wrong(
                0,
                "there is no [[joint]]; a trajectory moves at least one".into(),
            ));
        }
        let at = |(offset, message)| wrong(offset, message);
        let design = match &file.design {
            None => None,
            Some(spanned) => Some(design_of(spanned).map_err(at)?),
        };
        let joints = file
            .joints
            .iter()
            .map(|joint| joint_of(joint).map_err(at))
            .collect::<Result<Vec<_>, _>>()?;
        let found = Self {
            robot: file.robot,
            design,
            drive_off: file.drive_off.as_ref().map(|off| *off.get_ref()),
            joints,
        };
        if let Some(off) = &file.drive_off {
            let (value, end) = (*off.get_ref(), found.duration());
            if !(value > 0.0 && value < end) {
                return Err(wrong(
                    off.span().start,
                    format!(
                        "drive_off is {value} s, but it must lie within the motion, between 0 and {end} s"
                    ),
                ));
            }
        }
        Ok(found)
    }
}
