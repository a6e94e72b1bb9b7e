//! The load from the wrist sensor, stage by stage.

use nalgebra::{Isometry3, Matrix3, Rotation3, SMatrix, Vector3};
use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::{PrepareOptions, PreprocessingPlan, Recording, as_recordings, surveyed};
use rig_model::robot::{Reads, Robot, WristSensor};
use rig_output::{format_significant, listed};
use rig_shared::multibody::{Chain, INERTIAL_PARAMETERS};

use crate::channels::{Judged, judge};
use crate::convention::{Compared, compare, other_unit, turned};
use crate::drift::{is_better, with_changes};
use crate::error::LoadError;
use crate::estimate::{CERTAIN, Estimate, Spread, estimate};
use crate::mounting::{Channels, Mounting};
use crate::rows::{FEWEST_ROWS, LEAST_ROWS, each_pose, each_row};
use crate::statistics::{Collector, Recorded};
use crate::system::{Fit, Sensed, Unknowns};
use crate::torqueless::Torqueless;
use crate::wrench_row::WrenchRow;

/// Angle below which the axes of the sensor are those described, rad: rounding.
const LEAST_TURN: f64 = 1e-6;
/// Share of the rows that may be left out because of saturation.
const MOST_SATURATED: f64 = 0.5;
/// Distance of the centre of mass from the sensor that no load has, m.
const FARTHEST: f64 = 3.0;

/// Recordings of the wrist sensor.
pub(crate) struct Sensing<'a> {
    pub robot: &'a Robot,
    pub chain: &'a Chain<f64>,
    /// Recordings with the load, then those without it.
    pub recordings: &'a [(&'a dyn Recording, bool)],
    pub to_joint: &'a SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>,
    pub prepare: &'a PrepareOptions,
    /// True if every row of every recording is a pose at rest.
    pub poses: bool,
    /// True to go on with the best explanation if the channels look wrong.
    pub even_if_wrong: bool,
}

/// Readings of one recording beside the load's.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Bias {
    /// Name of the recording.
    pub recording: String,
    /// Bias of fx fy fz (N) mx my mz (N·m), as read.
    pub bias: [f64; 6],
    /// Change from the begin to the end of the recording, if the data show one.
    pub drift: Option<[f64; 6]>,
    /// Time of a jump, s after the begin, and the bias after it.
    pub jump: Option<(f64, [f64; 6])>,
}

/// Readings of a recording over time, thinned for a figure, and what the fit gives for them.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Name of the recording.
    pub recording: String,
    /// s
    pub time: Vec<f64>,
    /// fx fy fz (N) mx my mz (N·m), in the band of the fit.
    pub read: [Vec<f64>; 6],
    /// The same by the fit.
    pub predicted: [Vec<f64>; 6],
}

/// What the sensor's readings tell beside the load.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SensorFindings {
    /// Which of the two opposite wrenches is read.
    pub reads: Reads,
    /// Roll, pitch and yaw of the sensor in the flange frame, rad: estimated, or as described.
    pub rotation: [f64; 3],
    /// Angle between described and estimated axes, rad; `None` if the data show no difference.
    pub turned: Option<f64>,
    /// RMS residual of the forces, N, and of the moments, N·m.
    pub residual: [f64; 2],
    /// Bias by recording.
    pub biases: Vec<Bias>,
    /// Change of the bias per °C, if the data show one.
    pub warming: Option<[f64; 6]>,
    /// Readings over time.
    #[serde(skip)]
    pub traces: Vec<Trace>,
    /// Rows or poses.
    pub rows: u64,
    /// Rows left out because a channel was cut.
    pub saturated: u64,
    /// Preparation of the recordings; `None` for poses.
    pub prepared: Option<PreprocessingPlan>,
}

/// Identifies the load from the wrist sensor; adds sentences to `warnings`.
///
/// # Errors
/// [`LoadError`].
pub(crate) fn by_sensor(
    sensing: &Sensing,
    warnings: &mut Vec<String>,
) -> Result<(Estimate, SensorFindings), LoadError> {
    let robot = sensing.robot;
    let sensor = robot.wrist_sensor.clone().unwrap_or_default();
    let (recordings, prepared) = collected(sensing, &sensor, warnings)?;
    let sensed = Sensed {
        recordings: &recordings,
        to_joint: sensing.to_joint,
    };
    let unknowns = Unknowns {
        tool: recordings.iter().any(|r| !r.loaded),
        ..Unknowns::default()
    };
    let rows = sensed.used_rows(&unknowns);
    if (rows as usize) < LEAST_ROWS {
        return Err(LoadError::TooFew {
            rows: rows as usize,
            least: LEAST_ROWS,
        });
    }
    let pose = robot.last_link * sensor.pose();
    let described: Matrix3<f64> = pose.rotation.to_rotation_matrix().into_inner();
    let sign = sensor.reads.unwrap_or(Reads::Load).sign();
    let mounting = Mounting::of(&described, sign);
    let compared = compare(&sensed, &mounting, &unknowns, sensor.reads.is_some());
    if let Some(words) = other_unit(&sensed, &compared) {
        let text = format!(
            "A rigid load does not fit forces and moments: {words}. Forces must be in N and moments in N·m."
        );
        if !sensing.even_if_wrong {
            return Err(LoadError::Fault(text));
        }
        warnings.push(text);
    }
    let (fit, channels) = believed(&sensed, &mounting, compared, sensing, &sensor, warnings)?;
    let refit = |fit: &Fit, unknowns: &Unknowns| match unknowns.rotation {
        true => turned(&sensed, &fit.mounting, unknowns),
        false => sensed.fit(&fit.mounting, unknowns),
    };
    let fit = with_changes(&sensed, fit, &refit);
    let mass = sensed_mass(&fit);
    let segments = sensed.factors(&fit.mounting, &fit.unknowns, fit.noise);
    let spread = match recordings.iter().all(|r| r.poses) {
        true => Spread::Residuals(fit.freedom().max(1.0) as usize),
        false => Spread::Segments,
    };
    let found = estimate(&segments, mass, spread);
    let findings = Told {
        sensed: &sensed,
        fit: &fit,
        robot,
        described: &described,
        sensor: &sensor,
        channels,
    };
    warnings.extend(findings.implausible(&found, &pose, sensing.even_if_wrong)?);
    let findings = findings.findings(prepared, warnings);
    Ok((found, findings))
}

/// Returns the mass by a fit.
fn sensed_mass(fit: &Fit) -> f64 {
    fit.values.first().copied().unwrap_or(0.0)
}

/// Reads the recordings.
fn collected(
    sensing: &Sensing,
    sensor: &WristSensor,
    warnings: &mut Vec<String>,
) -> Result<(Vec<Recorded>, Option<PreprocessingPlan>), LoadError> {
    let joints = sensing.robot.joints.len();
    let mut judged = Vec::new();
    for (recording, _) in sensing.recordings {
        judged.push(judge(*recording, sensor, sensing.poses)?);
    }
    let is_poses = |judged: &Judged| sensing.poses || judged.rows < FEWEST_ROWS as u64;
    let moving: Vec<Torqueless> = (sensing.recordings.iter().zip(&judged))
        .filter(|(_, judged)| !is_poses(judged))
        .map(|((recording, _), _)| Torqueless(*recording))
        .collect();
    let moving: Vec<&dyn Recording> = moving.iter().map(|r| r as &dyn Recording).collect();
    let (surveys, usable) = surveyed(&moving, joints)?;
    let plan = match surveys.is_empty() {
        true => None,
        false => Some(PreprocessingPlan::decide(
            &surveys,
            sensing.prepare,
            &vec![None; joints],
        )?),
    };
    warnings.extend(surveys.iter().filter_map(|s| s.note.clone()));
    let pose = sensing.robot.last_link * sensor.pose();
    let mut prepared = surveys.iter().zip(as_recordings(&usable));
    let mut recordings = Vec::new();
    for ((recording, loaded), judged) in sensing.recordings.iter().zip(&judged) {
        let label = recording.label();
        let poses = is_poses(judged);
        let next = if poses { None } else { prepared.next() };
        let rows = match (&plan, &next) {
            (Some(plan), Some((survey, _))) => survey.rows / plan.decimation as u64,
            _ => judged.rows,
        };
        let mut collector = Collector::new(rows, judged.length);
        let mut take = |row: &WrenchRow| collector.push(row);
        let saturated = match (&plan, next) {
            (Some(plan), Some((_, usable))) => {
                each_row(sensing.chain, &pose, usable, plan, &judged.ends, &mut take)?
            }
            _ => {
                if !sensing.poses {
                    warnings.push(format!(
                        "{label} has {} rows: each was taken as a pose at rest.",
                        judged.rows
                    ));
                }
                each_pose(sensing.chain, &pose, *recording, &judged.ends, &mut take)?
            }
        };
        let recorded = collector.finish(label, *loaded, poses, saturated);
        saturation(&recorded, judged, sensing.even_if_wrong, warnings)?;
        recordings.push(recorded);
    }
    Ok((recordings, plan))
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
    let left_out = recorded.saturated as f64 / (recorded.saturated + recorded.rows()).max(1) as f64;
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

/// Decides which channels and which mounting are believed.
fn believed(
    sensed: &Sensed,
    mounting: &Mounting,
    compared: Compared,
    sensing: &Sensing,
    sensor: &WristSensor,
    warnings: &mut Vec<String>,
) -> Result<(Fit, Channels), LoadError> {
    let Compared { stated, better } = compared;
    let mut fit = stated;
    let mut exchanged = Channels::as_recorded();
    if let Some((channels, own)) = better {
        // Which of the two opposite wrenches is read need not be stated: the sign of the mass tells.
        let may_be_opposite = sensor.reads.is_none() || is_opposite(&channels);
        let is_turned =
            channels.is_rotation() || may_be_opposite && channels.is_opposite_rotation();
        if !is_turned {
            let text = fault_of(&channels, &fit, &own);
            if !sensing.even_if_wrong {
                return Err(LoadError::Fault(text));
            }
            warnings.push(format!(
                "{text} The load was identified with them put right."
            ));
            exchanged = channels;
        }
        fit = own;
    } else {
        let plain = sensed.fit(
            mounting,
            &Unknowns {
                rotation: false,
                ..fit.unknowns.clone()
            },
        );
        if !is_better(&fit, &plain) {
            fit = plain;
        }
    }
    weighs(sensed, &fit)?;
    if sensed_mass(&fit) < 0.0 {
        let opposite = fit.mounting.opposite();
        let unknowns = fit.unknowns.clone();
        if let Some(stated) = sensor.reads {
            let [is, says] = match stated {
                Reads::Load => ["robot", "load"],
                Reads::Robot => ["load", "robot"],
            };
            let text = format!(
                "The load would weigh {} kg: the readings have the sign of reads = \"{is}\", but [wrist_sensor] says reads = \"{says}\". Correct it.",
                format_significant(sensed_mass(&fit), 4)
            );
            if !sensing.even_if_wrong {
                return Err(LoadError::Fault(text));
            }
            warnings.push(text);
        }
        fit = sensed.fit(&opposite, &unknowns);
    }
    Ok((fit, exchanged))
}

/// Refuses readings in which nothing weighs.
fn weighs(sensed: &Sensed, fit: &Fit) -> Result<(), LoadError> {
    let mass = sensed_mass(fit);
    let segments = sensed.factors(&fit.mounting, &fit.unknowns, fit.noise);
    let freedom = fit.freedom().max(1.0) as usize;
    let found = estimate(&segments, mass.abs(), Spread::Residuals(freedom));
    let std = found.std()[0];
    if mass.abs() > CERTAIN * std {
        return Ok(());
    }
    Err(LoadError::NoMass {
        why: format!(
            "it is {} ± {} kg; record poses in which gravity has other directions in the sensor, or a heavier load",
            format_significant(mass, 3),
            format_significant(std, 2)
        ),
    })
}

/// Returns true if all six channels are reversed and nothing else.
fn is_opposite(channels: &Channels) -> bool {
    channels.force == -Matrix3::identity() && channels.moment == -Matrix3::identity()
}

/// Says which channels are wrong, and how much better the readings fit without the fault.
fn fault_of(channels: &Channels, stated: &Fit, better: &Fit) -> String {
    let rms = |fit: &Fit| {
        format!(
            "{} N and {} N·m RMS",
            format_significant(fit.noise[0], 3),
            format_significant(fit.noise[1], 3)
        )
    };
    let or = match channels.is_opposite_rotation() {
        true => " (or the sensor is turned and `reads` has the other value)",
        false => "",
    };
    format!(
        "The sensor's channels look wrong: {}{or}. As recorded a rigid load leaves {}, put right {}. Correct the columns {}, or the wiring.",
        channels.words(),
        rms(stated),
        rms(better),
        WRENCH_COLUMNS.join(" ")
    )
}

/// A fit, with what is needed to tell it.
struct Told<'a> {
    sensed: &'a Sensed<'a>,
    fit: &'a Fit,
    robot: &'a Robot,
    described: &'a Matrix3<f64>,
    sensor: &'a WristSensor,
    /// Exchange of channels that was put right.
    channels: Channels,
}

impl Told<'_> {
    /// Returns the estimated rotation of the sensor in the frame of the last joint, and the sign of its readings.
    fn rotation(&self) -> (Matrix3<f64>, Reads) {
        let force = self.fit.mounting.force * self.channels.force.transpose();
        match force.determinant() > 0.0 {
            true => (force, Reads::Robot),
            false => (-force, Reads::Load),
        }
    }

    fn findings(
        &self,
        prepared: Option<PreprocessingPlan>,
        warnings: &mut Vec<String>,
    ) -> SensorFindings {
        let (rotation, reads) = self.rotation();
        let against = Rotation3::from_matrix_unchecked(self.described.transpose() * rotation);
        let angle = against.angle();
        let flange = self.robot.last_link.rotation.to_rotation_matrix().inverse();
        let own = flange * Rotation3::from_matrix_unchecked(rotation);
        let (roll, pitch, yaw) = own.euler_angles();
        let is_turned = angle > LEAST_TURN;
        if is_turned {
            let axis = against
                .axis()
                .map_or(Vector3::z(), |axis| axis.into_inner());
            warnings.push(self.turned(angle, &axis, [roll, pitch, yaw]));
        }
        if self.sensor.reads.is_none() {
            let [whose, key] = match reads {
                Reads::Load => ["load on the robot", "load"],
                Reads::Robot => ["robot on the load", "robot"],
            };
            warnings.push(format!(
                "The readings are the wrench of the {whose}, because the mass must be positive; write reads = \"{key}\" into [wrist_sensor] to have this checked."
            ));
        }
        let biases = self.biases();
        for bias in &biases {
            warnings.extend(jump_words(bias));
        }
        SensorFindings {
            reads,
            rotation: match is_turned {
                true => [roll, pitch, yaw],
                false => self.sensor.rotation,
            },
            turned: is_turned.then_some(angle),
            residual: self.fit.noise,
            biases,
            warming: self.sensed.warming(self.fit),
            traces: self.traces(),
            rows: self.sensed.used_rows(&self.fit.unknowns),
            saturated: self.sensed.recordings.iter().map(|r| r.saturated).sum(),
            prepared,
        }
    }

    fn turned(&self, angle: f64, axis: &Vector3<f64>, [roll, pitch, yaw]: [f64; 3]) -> String {
        format!(
            "The axes of the sensor are turned by {} degrees about [{:.2}, {:.2}, {:.2}] against the description; the load was identified with the estimated axes. A base that is not level, a wrong sensor position, cables that pull, or sensor and encoders recorded at unlike times look alike: look for these first. If the sensor is turned, write rotation = [{:.4}, {:.4}, {:.4}] into [wrist_sensor].",
            format_significant(angle.to_degrees(), 3),
            axis.x,
            axis.y,
            axis.z,
            roll,
            pitch,
            yaw
        )
    }

    fn traces(&self) -> Vec<Trace> {
        let recordings = self.sensed.recordings.iter().enumerate();
        recordings
            .map(|(r, recorded)| {
                let rows = &recorded.sample;
                let predicted: Vec<[f64; 6]> = (rows.iter())
                    .map(|row| self.sensed.predicted(self.fit, r, row))
                    .collect();
                Trace {
                    recording: recorded.label.clone(),
                    time: rows.iter().map(|row| row.time).collect(),
                    read: std::array::from_fn(|c| rows.iter().map(|row| row.readings[c]).collect()),
                    predicted: std::array::from_fn(|c| predicted.iter().map(|p| p[c]).collect()),
                }
            })
            .collect()
    }

    fn biases(&self) -> Vec<Bias> {
        let jumps = &self.fit.unknowns.jumps;
        let recordings = self.sensed.recordings.iter().enumerate();
        recordings
            .map(|(r, recorded)| Bias {
                recording: recorded.label.clone(),
                bias: self.sensed.bias(self.fit, r),
                drift: self.sensed.drift(self.fit, r),
                jump: jumps.iter().position(|jump| jump.recording == r).map(|at| {
                    let share = jumps[at].segment as f64 / recorded.segments.len() as f64;
                    (
                        share * recorded.length,
                        self.sensed.bias_after(self.fit, at),
                    )
                }),
            })
            .collect()
    }

    /// Returns warnings about values that no load has.
    fn implausible(
        &self,
        found: &Estimate,
        sensor: &Isometry3<f64>,
        even_if_wrong: bool,
    ) -> Result<Vec<String>, LoadError> {
        let mass = found.values[0];
        let moment = Vector3::new(found.values[1], found.values[2], found.values[3]);
        let in_flange = self.robot.last_link.inverse() * sensor;
        let lever = (moment / mass - in_flange.translation.vector).norm();
        if lever <= FARTHEST {
            return Ok(Vec::new());
        }
        let text = format!(
            "The centre of mass would be {} m from the sensor: the moments look like another unit (N·mm are 1000 times N·m). They must be in N·m, the forces in N.",
            format_significant(lever, 3)
        );
        match even_if_wrong {
            true => Ok(vec![text]),
            false => Err(LoadError::Fault(text)),
        }
    }
}

/// Says that a bias jumps.
fn jump_words(bias: &Bias) -> Option<String> {
    let (time, after) = bias.jump?;
    let change: Vec<String> = (WRENCH_COLUMNS.iter().zip(after).zip(bias.bias))
        .map(|((name, after), before)| {
            let unit = if name.starts_with('f') { "N" } else { "N·m" };
            format!("{name} {} {unit}", format_significant(after - before, 2))
        })
        .collect();
    Some(format!(
        "{}: the bias of the sensor jumps near {time:.1} s ({}). It was estimated before and after, and a tenth of the recording around it was left out.",
        bias.recording,
        change.join(", ")
    ))
}
