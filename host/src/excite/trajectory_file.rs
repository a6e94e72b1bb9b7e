//! Trajectories in files: their parameters as TOML, their samples as CSV.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use rig_shared::trajectory::{
    AMPLITUDES, Chirp, Fourier, FrictionSweep, HARMONICS, LEVELS, SPEEDS, SlowReversals, Staircase,
    Sweep, Trajectory,
};
use serde::Deserialize;
use toml::Spanned;

use super::{Criterion, ExciteError};
use crate::data::{Column, EffortNeed, RecordingWriter, Source};
use crate::files::write_whole;
use crate::robot::{JointKind, Place, Robot};

/// Largest trajectory file; a thousand joints would fit.
const MAX_BYTES: u64 = 1 << 20;

/// The motion of all joints of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryFile {
    /// Name of the robot it was made for.
    pub robot: String,
    /// How it was optimised, where it was.
    pub design: Option<DesignRecord>,
    /// One entry a joint, in the robot's order.
    pub joints: Vec<JointTrajectory>,
}

/// How a motion was optimised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignRecord {
    /// What was optimised.
    pub criterion: Criterion,
    /// The criterion's value.
    pub value: f64,
    /// Condition number of the regressor, columns divided by their sizes.
    pub condition_number: f64,
    /// Seed of the starts.
    pub seed: u64,
}

/// The motion of one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTrajectory {
    /// Name of the joint.
    pub name: String,
    /// Position at which it starts and ends, rad or m; the trajectory is relative to it.
    pub start: f64,
    /// The motion.
    pub trajectory: Trajectory<f64>,
}

/// Reference positions at evenly spaced instants.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledReference {
    /// Sample period, s.
    pub period: f64,
    /// Per joint, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Per joint, rad/s or m/s; empty where the file does not say.
    pub velocity: Vec<Vec<f64>>,
    /// Per joint, rad/s² or m/s²; empty where the file does not say.
    pub acceleration: Vec<Vec<f64>>,
}

/// The file as TOML has it; all times in seconds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileText {
    robot: String,
    #[serde(default)]
    design: Option<Spanned<DesignText>>,
    #[serde(rename = "joint")]
    joints: Vec<JointText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DesignText {
    criterion: String,
    value: f64,
    condition_number: f64,
    seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointText {
    name: String,
    start: Spanned<f64>,
    trajectory: Spanned<MotionText>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum MotionText {
    Hold {
        duration: f64,
    },
    Fourier {
        period: f64,
        periods: u16,
        ramp: f64,
        sine: Vec<f64>,
        cosine: Vec<f64>,
    },
    Chirp {
        start_hz: f64,
        end_hz: f64,
        sweep: String,
        duration: f64,
        ramp: f64,
        amplitude: f64,
        velocity: f64,
        acceleration: f64,
    },
    Staircase {
        levels: Vec<f64>,
        #[serde(rename = "move")]
        moving: f64,
        dwell: f64,
    },
    Reversals {
        speed: f64,
        half_turn: f64,
        quarter: Vec<f64>,
        cycles: u16,
    },
    Sweep {
        half_span: f64,
        cruise: Vec<f64>,
        ramp: f64,
        dwell: f64,
        lead: f64,
    },
}

/// Whole microseconds of a time in a file, exactly.
fn micros(name: &str, seconds: f64) -> Result<u32, String> {
    let whole = (seconds * 1e6).round();
    if !(0.0..=f64::from(u32::MAX)).contains(&whole) {
        return Err(format!(
            "{name} is {seconds} s, but times lie between 0 and 4294 s"
        ));
    }
    // Rounding of the decimal number itself is far below a thousandth of a microsecond.
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

impl MotionText {
    fn trajectory(&self) -> Result<Trajectory<f64>, String> {
        let all = |name: &str, list: &[f64]| {
            list.iter()
                .map(|s| micros(name, *s))
                .collect::<Result<Vec<u32>, String>>()
        };
        let trajectory = match self {
            Self::Hold { duration } => Trajectory::Hold(micros("duration", *duration)?),
            Self::Fourier {
                period,
                periods,
                ramp,
                sine,
                cosine,
            } => {
                at_most("sine", sine, HARMONICS)?;
                at_most("cosine", cosine, HARMONICS)?;
                Trajectory::Fourier(Fourier {
                    period_us: micros("period", *period)?,
                    periods: *periods,
                    ramp_us: micros("ramp", *ramp)?,
                    sine: sine.iter().copied().collect(),
                    cosine: cosine.iter().copied().collect(),
                })
            }
            Self::Chirp {
                start_hz,
                end_hz,
                sweep,
                duration,
                ramp,
                amplitude,
                velocity,
                acceleration,
            } => Trajectory::Chirp(Chirp {
                start_hz: *start_hz,
                end_hz: *end_hz,
                sweep: match sweep.as_str() {
                    "linear" => Sweep::Linear,
                    "logarithmic" => Sweep::Logarithmic,
                    other => {
                        return Err(format!(
                            "sweep is \"{other}\", but it must be \"linear\" or \"logarithmic\""
                        ));
                    }
                },
                duration_us: micros("duration", *duration)?,
                ramp_us: micros("ramp", *ramp)?,
                amplitude: *amplitude,
                velocity: *velocity,
                acceleration: *acceleration,
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
                    quarter_us: all("quarter", quarter)?.into_iter().collect(),
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
                at_most("cruise", cruise, SPEEDS)?;
                Trajectory::FrictionSweep(FrictionSweep {
                    half_span: *half_span,
                    cruise_us: all("cruise", cruise)?.into_iter().collect(),
                    ramp_us: micros("ramp", *ramp)?,
                    dwell_us: micros("dwell", *dwell)?,
                    lead_us: micros("lead", *lead)?,
                })
            }
        };
        trajectory.validate().map_err(|e| {
            format!(
                "{e}; times and amplitudes must be finite, above zero and fit each other (see `rig excite --help`)"
            )
        })?;
        Ok(trajectory)
    }
}

fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    let items: Vec<String> = values.iter().map(|v| number(*v)).collect();
    format!("[{}]", items.join(", "))
}

fn seconds(micros: u32) -> f64 {
    f64::from(micros) / 1e6
}

fn line(out: &mut String, key: &str, value: &str, comment: &str) {
    let assignment = format!("{key} = {value}");
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{assignment:<40} # {comment}");
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn write_motion(out: &mut String, trajectory: &Trajectory<f64>, unit: &str) {
    let all = |times: &[u32]| list(&times.iter().map(|t| seconds(*t)).collect::<Vec<_>>());
    let mut put = |key: &str, value: String, comment: &str| line(out, key, &value, comment);
    let each = |what: &str| format!("{unit}, {what}");
    match trajectory {
        Trajectory::Hold(duration) => {
            put("kind", quoted("hold"), "stands still");
            put("duration", number(seconds(*duration)), "s");
        }
        Trajectory::Fourier(m) => {
            put(
                "kind",
                quoted("fourier"),
                "E(t) * sum of a_k sin(k w t) + b_k cos(k w t)",
            );
            put(
                "period",
                number(seconds(m.period_us)),
                "s, of the fundamental: w = 2 pi / period",
            );
            put(
                "periods",
                m.periods.to_string(),
                "whole periods at full amplitude",
            );
            put(
                "ramp",
                number(seconds(m.ramp_us)),
                "s, rise and fall of the envelope E before and after them",
            );
            put(
                "sine",
                list(&m.sine),
                &each("a_k from the fundamental upwards"),
            );
            put("cosine", list(&m.cosine), &each("b_k"));
        }
        Trajectory::Chirp(m) => {
            let sweep = match m.sweep {
                Sweep::Linear => "linear",
                Sweep::Logarithmic => "logarithmic",
            };
            put("kind", quoted("chirp"), "swept sine");
            put("start_hz", number(m.start_hz), "Hz");
            put("end_hz", number(m.end_hz), "Hz");
            put("sweep", quoted(sweep), "linear or logarithmic in time");
            put(
                "duration",
                number(seconds(m.duration_us)),
                "s, with both ramps",
            );
            put(
                "ramp",
                number(seconds(m.ramp_us)),
                "s, rise and fall of the amplitude",
            );
            put("amplitude", number(m.amplitude), &each("largest amplitude"));
            put(
                "velocity",
                number(m.velocity),
                &format!("{unit}/s, bounds the amplitude at higher frequencies"),
            );
            put(
                "acceleration",
                number(m.acceleration),
                &format!("{unit}/s^2, likewise"),
            );
        }
        Trajectory::Staircase(m) => {
            put(
                "kind",
                quoted("staircase"),
                "moves to each level, back to the start at the end",
            );
            put("levels", list(&m.levels), &each("from the start"));
            put("move", number(seconds(m.move_us)), "s, length of a move");
            put(
                "dwell",
                number(seconds(m.dwell_us)),
                "s, rest after each move",
            );
        }
        Trajectory::SlowReversals(m) => {
            put(
                "kind",
                quoted("reversals"),
                "slow triangles with rounded turns",
            );
            put(
                "speed",
                number(m.speed),
                &format!("{unit}/s between the turns"),
            );
            put(
                "half_turn",
                number(seconds(m.half_turn_us)),
                "s, half the length of a turn",
            );
            put(
                "quarter",
                all(&m.quarter_us),
                "s from the centre to where the turn begins, one per amplitude",
            );
            put("cycles", m.cycles.to_string(), "triangles per amplitude");
        }
        Trajectory::FrictionSweep(m) => {
            put(
                "kind",
                quoted("sweep"),
                "forth and back at each of several constant speeds",
            );
            put(
                "half_span",
                number(m.half_span),
                &each("half the distance between the ends"),
            );
            put(
                "cruise",
                all(&m.cruise_us),
                "s at constant speed, one per speed",
            );
            put(
                "ramp",
                number(seconds(m.ramp_us)),
                "s to reach the speed, and to stop",
            );
            put(
                "dwell",
                number(seconds(m.dwell_us)),
                "s at rest after each pass",
            );
            put(
                "lead",
                number(seconds(m.lead_us)),
                "s from the start to the first end, and back",
            );
        }
    }
}

impl TrajectoryFile {
    /// Length of the longest joint's motion, s.
    pub fn duration(&self) -> f64 {
        self.joints
            .iter()
            .map(|j| j.trajectory.duration())
            .fold(0.0, f64::max)
    }

    /// Reads a `.toml` trajectory.
    ///
    /// # Errors
    /// [`ExciteError`] with line and column of what is wrong.
    pub fn load(path: &Path) -> Result<Self, ExciteError> {
        let failed = |source| ExciteError::Read {
            path: path.into(),
            source,
        };
        if std::fs::metadata(path).map_err(failed)?.len() > MAX_BYTES {
            return Err(ExciteError::TooLarge { path: path.into() });
        }
        let text = std::fs::read_to_string(path).map_err(failed)?;
        Self::from_toml(&text, path)
    }

    /// Reads TOML text; `path` only names the source in messages.
    ///
    /// # Errors
    /// [`ExciteError::Toml`].
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, ExciteError> {
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
        let design = match &file.design {
            None => None,
            Some(spanned) => {
                let d = spanned.get_ref();
                let criterion = Criterion::from_name(&d.criterion).ok_or_else(|| {
                    wrong(
                        spanned.span().start,
                        format!(
                            "criterion is \"{}\", but it must be cond, min-singular or d-optimal",
                            d.criterion
                        ),
                    )
                })?;
                Some(DesignRecord {
                    criterion,
                    value: d.value,
                    condition_number: d.condition_number,
                    seed: d.seed,
                })
            }
        };
        let mut joints = Vec::new();
        for joint in &file.joints {
            let start = *joint.start.get_ref();
            if !start.is_finite() {
                return Err(wrong(
                    joint.start.span().start,
                    format!("start is {start}, but it must be a finite number, in rad or m"),
                ));
            }
            let trajectory = joint.trajectory.get_ref().trajectory().map_err(|message| {
                wrong(
                    joint.trajectory.span().start,
                    format!("in the trajectory of joint \"{}\", {message}", joint.name),
                )
            })?;
            joints.push(JointTrajectory {
                name: joint.name.clone(),
                start,
                trajectory,
            });
        }
        Ok(Self {
            robot: file.robot,
            design,
            joints,
        })
    }

    /// As TOML with units in comments; [`TrajectoryFile::from_toml`] reads it back equal.
    pub fn to_toml(&self, robot: &Robot) -> String {
        let mut out = String::new();
        line(
            &mut out,
            "robot",
            &quoted(&self.robot),
            "for which it was made",
        );
        if let Some(d) = &self.design {
            out.push_str("\n[design]\n");
            line(
                &mut out,
                "criterion",
                &quoted(d.criterion.name()),
                "what was optimised",
            );
            line(&mut out, "value", &number(d.value), "of that criterion");
            line(
                &mut out,
                "condition_number",
                &number(d.condition_number),
                "of the regressor, columns divided by their sizes",
            );
            line(
                &mut out,
                "seed",
                &d.seed.to_string(),
                "of the optimiser's starts",
            );
        }
        for (k, joint) in self.joints.iter().enumerate() {
            let unit = match robot.joints.get(k).map(|j| j.kind) {
                Some(JointKind::Prismatic) => "m",
                _ => "rad",
            };
            out.push_str("\n[[joint]]\n");
            line(
                &mut out,
                "name",
                &quoted(&joint.name),
                "as in the robot description",
            );
            line(
                &mut out,
                "start",
                &number(joint.start),
                &format!("{unit}, where it stands before and after; the motion is relative to it"),
            );
            out.push_str("\n[joint.trajectory]\n");
            write_motion(&mut out, &joint.trajectory, unit);
        }
        out
    }

    /// The reference at evenly spaced instants, from the first to the last within the motion and one beyond, where
    /// all joints stand again.
    ///
    /// # Errors
    /// [`ExciteError::Option`] for a rate that is not between 1 Hz and 1 MHz.
    pub fn sampled(&self, rate: f64) -> Result<SampledReference, ExciteError> {
        if !(1.0..=1e6).contains(&rate) {
            return Err(ExciteError::Option {
                name: "rate",
                value: format!("{rate} Hz"),
                right: "it must be between 1 and 1000000 Hz".into(),
            });
        }
        // A duration that is a whole number of samples must not gain one by rounding.
        let last = (self.duration() * rate - 1e-6).ceil().max(0.0) as usize;
        let each = |pick: fn(&rig_shared::trajectory::Reference<f64>) -> f64, offset: bool| {
            self.joints
                .iter()
                .map(|j| {
                    let base = if offset { j.start } else { 0.0 };
                    (0..=last)
                        .map(|k| base + pick(&j.trajectory.at(k as f64 / rate)))
                        .collect()
                })
                .collect::<Vec<Vec<f64>>>()
        };
        Ok(SampledReference {
            period: 1.0 / rate,
            position: each(|r| r.position, true),
            velocity: each(|r| r.velocity, false),
            acceleration: each(|r| r.acceleration, false),
        })
    }

    /// Writes `.toml` (parameters) or `.csv` (samples at `rate`, Hz): columns t, and per joint q, qd, qdd and the
    /// same positions again as ref, so that it reads as a recording too. The file appears whole or not at all.
    ///
    /// # Errors
    /// [`ExciteError`]: another ending, or what the system says.
    pub fn save(&self, path: &Path, robot: &Robot, rate: f64) -> Result<(), ExciteError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("toml") => Ok(write_whole(path, self.to_toml(robot).as_bytes())?),
            Some("csv") => self.save_samples(path, robot, rate),
            _ => Err(ExciteError::UnknownFormat { path: path.into() }),
        }
    }

    fn save_samples(&self, path: &Path, robot: &Robot, rate: f64) -> Result<(), ExciteError> {
        let samples = self.sampled(rate)?;
        let mut columns = vec![Column::new("t", "s")];
        for k in 1..=self.joints.len() {
            let unit = match robot.joints.get(k - 1).map(|j| j.kind) {
                Some(JointKind::Prismatic) => "m",
                _ => "rad",
            };
            for (name, over) in [("q", ""), ("qd", "/s"), ("qdd", "/s^2"), ("ref", "")] {
                columns.push(Column::new(&format!("{name}{k}"), &format!("{unit}{over}")));
            }
        }
        let mut writer = RecordingWriter::create(path, &columns, &BTreeMap::new())?;
        for row in 0..samples.position.first().map_or(0, Vec::len) {
            let mut values = vec![row as f64 / rate];
            for j in 0..self.joints.len() {
                let q = samples.position[j][row];
                values.extend([q, samples.velocity[j][row], samples.acceleration[j][row], q]);
            }
            writer.push_row(&values)?;
        }
        Ok(writer.finish()?)
    }

    /// Whether the file's joints are the robot's, by name and in order.
    ///
    /// # Errors
    /// [`ExciteError::OtherRobot`]; `path` names the file in it.
    pub fn fits(&self, robot: &Robot, path: &Path) -> Result<(), ExciteError> {
        let found: Vec<&str> = self.joints.iter().map(|j| j.name.as_str()).collect();
        let expected: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
        if found == expected {
            return Ok(());
        }
        Err(ExciteError::OtherRobot {
            path: path.into(),
            robot: robot.name.clone(),
            found: format!("the joints {}", found.join(", ")),
            expected: expected.join(", "),
        })
    }
}

/// Reads a trajectory as samples: a `.toml` trajectory sampled at `rate` (Hz), or the `ref` columns of a sampled one
/// (its `q` columns where there are none) at the rate it has.
///
/// # Errors
/// [`ExciteError`] with the place of what is wrong.
pub fn load_reference(
    path: &Path,
    robot: &Robot,
    rate: f64,
) -> Result<SampledReference, ExciteError> {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase);
    if extension.as_deref() == Some("toml") {
        let file = TrajectoryFile::load(path)?;
        file.fits(robot, path)?;
        return file.sampled(rate);
    }
    let source = Source::open_with(path, robot, EffortNeed::Optional)?;
    let mut sampled = SampledReference {
        period: source.sampling().period,
        position: vec![Vec::new(); robot.joints.len()],
        velocity: Vec::new(),
        acceleration: Vec::new(),
    };
    let uneven = |row| ExciteError::Uneven {
        path: path.into(),
        row,
    };
    for (k, block) in source.read_all()?.0.iter().enumerate() {
        if source.sampling().irregular || k > 0 {
            return Err(uneven(block.first_line));
        }
        for (to, from) in sampled.position.iter_mut().zip(&block.joints) {
            to.extend(from.reference.as_ref().unwrap_or(&from.q));
        }
    }
    // One sample has no period.
    if sampled.period <= 0.0 {
        return Err(uneven(1));
    }
    Ok(sampled)
}
