//! What the readings of the wrist sensor tell beside the load, and its sentences.

use nalgebra::{Isometry3, Matrix3, Rotation3, Vector3};
use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::PreprocessingPlan;
use rig_model::robot::{Origin, Reads, Robot, WristSensor};
use rig_output::{capital, format_significant, format_value, listed};

use crate::causes::{is_beyond_scatter, scatter};
use crate::curved_bias::{Curve, curve};
use crate::error::LoadError;
use crate::estimate::Estimate;
use crate::gain_error::GainError;
use crate::hanging::remedy;
use crate::mounting::Channels;
use crate::statistics::{Recorded, noise_floor};
use crate::system::{Fit, MOUNTED, Nuisance, Sensed};
use crate::units::{alternatives, by_lever};

/// Angle below which the axes of the sensor are those described, rad: rounding.
const LEAST_TURN: f64 = 1e-6;
/// Distance of the centre of mass from the sensor that no load has, m.
const FARTHEST: f64 = 3.0;

/// Readings of one recording beside the load's.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Bias {
    /// Name of the recording.
    pub recording: String,
    /// Bias of fx fy fz (N) mx my mz (N·m), as read.
    pub bias: [f64; 6],
    /// Change from the begin to the end of the recording, if the data show one.
    pub drift: Option<[f64; 6]>,
    /// Time of each jump, s after the begin, and the bias after it, in the order of time.
    pub jumps: Vec<(f64, [f64; 6])>,
    /// Smooth course that explains the readings better than the jumps, which approximate it.
    pub curve: Option<Curve>,
    /// Value of the column `temp` at which `bias` holds, in its unit, if the bias follows it.
    pub temperature: Option<f64>,
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
    /// Says how `reads` was found; `None` if the description states it.
    pub reads_found: Option<String>,
    /// Roll, pitch and yaw of the sensor in the flange frame, rad: estimated, or as described.
    pub rotation: [f64; 3],
    /// Angle between described and estimated axes, rad; `None` if the data show no difference.
    pub turned: Option<f64>,
    /// Gravity in the base frame, m/s², if the data show another direction than the described one.
    pub gravity: Option<[f64; 3]>,
    /// Delay of the readings against the positions, s, if the data show one.
    pub delay: Option<f64>,
    /// Origin of the sensor in the flange frame, m, if the data show another than the described one.
    pub position: Option<[f64; 3]>,
    /// RMS residual of the forces, N, and of the moments, N·m.
    pub residual: [f64; 2],
    /// Residual of forces and of moments as a share of what they read beside bias and drift.
    pub share: [f64; 2],
    /// RMS that noise of the forces, N, and of the moments, N·m, leaves in the band of the fit, inferred from the readings
    /// above the band; `None` for poses.
    pub noise: Option<[f64; 2]>,
    /// What gains of the channels that are off at random mean for the load.
    pub gain_error: GainError,
    /// Bias by recording.
    pub biases: Vec<Bias>,
    /// Change of the bias per unit of the column `temp`, if the data show one.
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

impl SensorFindings {
    /// Says what no recording of this kind checks of the sensor. `is_unweighed` if no known mass was compared.
    pub fn assumed(&self, is_unweighed: bool) -> String {
        let weigh = match is_unweighed {
            true => "; weigh the load: --mass checks the forces",
            false => "",
        };
        match self.prepared {
            Some(_) => format!(
                "assumed: forces in N; a factor of all six readings shows in no motion{weigh}"
            ),
            None => format!(
                "assumed: forces in N, moments in N·m and of the sign of the forces, about the described origin of the sensor; none of it shows at rest{weigh}, a motion the rest"
            ),
        }
    }
}

/// A fit, with what is needed to tell it.
pub(crate) struct Told<'a> {
    pub sensed: &'a Sensed<'a>,
    pub fit: &'a Fit,
    pub robot: &'a Robot,
    pub described: &'a Matrix3<f64>,
    pub sensor: &'a WristSensor,
    /// Exchange of channels that was put right.
    pub channels: Channels,
    /// Pairs of a property that was found, and another that explains the readings as well.
    pub alternatives: Vec<[Nuisance; 2]>,
    /// Scale of the moments that is one of these, and its standard deviation.
    pub scale: Option<[f64; 2]>,
    /// What the readings were shifted by, s.
    pub delay: f64,
    /// True if the fit leaves about the noise. Otherwise properties that it found may stand for something else.
    pub explains: bool,
    /// What errors of the gains mean.
    pub gain_error: GainError,
}

impl Told<'_> {
    /// Returns the estimated rotation of the sensor in the frame of the last joint, and the sign of its readings.
    fn rotation(&self) -> (Matrix3<f64>, Reads) {
        let [turn, _] = self
            .sensed
            .rotations(self.fit)
            .map(Rotation3::from_scaled_axis);
        let force = turn * self.fit.mounting.force * self.channels.force.transpose();
        let force = self.described * force;
        match force.determinant() > 0.0 {
            true => (force, Reads::Robot),
            false => (-force, Reads::Load),
        }
    }

    /// Returns what is told; adds sentences to `warnings`.
    pub(crate) fn findings(
        &self,
        prepared: Option<PreprocessingPlan>,
        warnings: &mut Vec<String>,
    ) -> SensorFindings {
        let (rotation, reads) = self.rotation();
        let against = Rotation3::from_matrix_unchecked(self.described.transpose() * rotation);
        let angle = against.angle();
        let flange = self
            .robot
            .flange_pose()
            .rotation
            .to_rotation_matrix()
            .inverse();
        let own = flange * Rotation3::from_matrix_unchecked(rotation);
        let (roll, pitch, yaw) = own.euler_angles();
        let is_turned = angle > LEAST_TURN;
        if is_turned {
            let axis = against
                .axis()
                .map_or(Vector3::z(), |axis| axis.into_inner());
            warnings.push(self.turned(angle, &axis, [roll, pitch, yaw]));
        }
        let gravity = self.gravity(warnings);
        let delay = self.delay(warnings);
        let position = self.position(warnings);
        warnings.extend(self.alternative_words());
        let reads_found = self.sensor.reads.is_none().then(|| {
            let [whose, key] = match reads {
                Reads::Load => ["load on the robot", "load"],
                Reads::Robot => ["robot on the load", "robot"],
            };
            let stated = match self.robot.origin {
                Origin::Urdf => format!("give --reads {key}"),
                Origin::Own => format!("write reads = \"{key}\" into [wrist_sensor]"),
            };
            // At rest a robot that hangs reads the opposite as well.
            let hangs = match (reads, self.sensed.recordings.iter().all(|own| own.poses)) {
                (Reads::Robot, true) => format!(" If the robot hangs, {} instead.", remedy(self.robot)),
                _ => String::new(),
            };
            format!(
                "The readings are the wrench of the {whose}, because the mass must be positive; {stated} to have this checked.{hangs}"
            )
        });
        let biases = self.biases();
        warnings.extend(self.bias_words(&biases));
        warnings.extend(self.warming_words());
        SensorFindings {
            reads,
            reads_found,
            rotation: match is_turned {
                true => [roll, pitch, yaw],
                false => self.sensor.rotation,
            },
            turned: is_turned.then_some(angle),
            gravity,
            delay,
            position,
            residual: self.fit.noise,
            share: self.sensed.share(self.fit),
            noise: noise_floor(self.sensed.recordings)
                .or_else(|| scatter(self.sensed).noise().map(|(noise, _)| noise)),
            gain_error: self.gain_error,
            biases,
            warming: self.sensed.warming(self.fit),
            traces: self.traces(),
            rows: self.sensed.used_rows(&self.fit.unknowns),
            saturated: self
                .sensed
                .recordings
                .iter()
                .map(|r| r.passed.saturated)
                .sum(),
            prepared,
        }
    }

    /// Says what explains the readings as well as what was found.
    fn alternative_words(&self) -> impl Iterator<Item = String> {
        self.alternatives.iter().map(|[found, other]| {
            let scale = self.scale.filter(|_| *other == Nuisance::Scale);
            let factor = scale.map_or_else(String::new, |[scale, std]| {
                format!(
                    " ({} times, ± one standard deviation)",
                    format_value(scale, std)
                )
            });
            let forces = scale.map_or_else(String::new, |[scale, _]| {
                format!(
                    " Forces that read {} times their true size look the same, and the mass is then wrong by this factor: weigh the load, and give --mass.",
                    format_significant(1.0 / scale, 3)
                )
            });
            format!(
                "{}{factor} explains the readings as well as {}: poses in more directions, or a livelier motion, tell them apart.{forces}",
                capital(words(*other)),
                words(*found)
            )
        })
    }

    fn turned(&self, angle: f64, axis: &Vector3<f64>, turn: [f64; 3]) -> String {
        let by = format!(
            "turned by {} degrees about [{:.2}, {:.2}, {:.2}]",
            format_significant(angle.to_degrees(), 3),
            axis.x,
            axis.y,
            axis.z
        );
        let (begin, beside) = match has_no_pose(self.robot) {
            false => (
                format!("The axes of the sensor are {by} against the description"),
                "",
            ),
            true => (
                format!(
                    "No pose of the sensor was given, so its axes were taken as those of the flange; they are {by}"
                ),
                " and its origin by --sensor-position X Y Z (m)",
            ),
        };
        let place = stated_by(self.robot, ("rotation", "--sensor-rotation"), &turn);
        format!(
            "{begin}; the load was identified with the estimated axes.{}",
            self.advice(&format!(
                "If the sensor is turned, {place}{beside}. A cable that pulls can look alike."
            ))
        )
    }

    /// Returns what to change, behind a space; nothing if more is left than noise, because the property may then stand for
    /// another cause.
    fn advice(&self, remedy: &str) -> String {
        match self.explains {
            true => format!(" {remedy}"),
            false => {
                " More than noise is left, so this may stand for another cause: find that first."
                    .to_owned()
            }
        }
    }

    /// Returns the direction of gravity if it is not the described one.
    fn gravity(&self, warnings: &mut Vec<String>) -> Option<[f64; 3]> {
        let [_, further] = self.sensed.rotations(self.fit);
        let turn = Rotation3::from_scaled_axis(further) * self.fit.mounting.gravity;
        if !self.fit.unknowns.has(Nuisance::Lean) {
            return None;
        }
        let gravity = turn * self.sensed.gravity;
        let [what, remedy] = match turn.angle() < MOUNTED {
            true => ["The base leans by", "Level the base, or write"],
            false => [
                "Gravity is turned by",
                "For a robot at a wall or a ceiling write",
            ],
        };
        let other = match (self.sensed.is_of_either_sign(self.fit), self.sensor.reads) {
            (true, None) => format!(
                " At rest gravity = [{:.4}, {:.4}, {:.4}] explains the readings as well, with the other sign of `reads`.",
                -gravity.x, -gravity.y, -gravity.z
            ),
            _ => String::new(),
        };
        warnings.push(format!(
            "{what} {} degrees against the description; the load was identified with the estimated gravity.{}{other}",
            format_significant(turn.angle().to_degrees(), 3),
            self.advice(&format!(
                "{remedy} gravity = [{:.4}, {:.4}, {:.4}] into {}. At rest a joint whose zero is off by this angle looks alike.",
                gravity.x,
                gravity.y,
                gravity.z,
                match self.robot.origin {
                    Origin::Urdf => "a TOML description (`rig init --from`)",
                    Origin::Own => "the description",
                }
            ))
        ));
        Some(gravity.into())
    }

    /// Returns the delay of the sensor against the encoders, s.
    fn delay(&self, warnings: &mut Vec<String>) -> Option<f64> {
        let delay = self.delay + self.sensed.delay(self.fit).unwrap_or(0.0);
        if delay == 0.0 {
            return None;
        }
        let sense = if delay > 0.0 { "late" } else { "early" };
        warnings.push(format!(
            "The readings are {} ms {sense} against the positions; the load was identified with this delay.{}",
            format_significant(1e3 * delay.abs(), 3),
            self.advice("Record both by one clock.")
        ));
        Some(delay)
    }

    /// Returns the estimated origin of the sensor in the flange frame if it is not the described one, m.
    fn position(&self, warnings: &mut Vec<String>) -> Option<[f64; 3]> {
        let origin = self.origin()?;
        let error = origin - Vector3::from(self.sensor.position);
        warnings.push(format!(
            "The sensor's origin lies {} mm from the described one; the load was identified with the estimated origin.{}",
            format_significant(1e3 * error.norm(), 3),
            self.advice(&format!(
                "Measure it, or {}.",
                stated_by(self.robot, ("position", "--sensor-position"), &origin.into())
            ))
        ));
        Some(origin.into())
    }

    /// Returns the estimated origin of the sensor in the flange frame, m.
    fn origin(&self) -> Option<Vector3<f64>> {
        let error = self.sensed.origin(self.fit)?;
        let flange = self.robot.flange_pose().rotation.inverse();
        Some(Vector3::from(self.sensor.position) + flange * (self.described * error))
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
        let recordings = self.sensed.recordings.iter().enumerate();
        recordings
            .map(|(r, recorded)| Bias {
                recording: recorded.label.clone(),
                bias: self.sensed.bias(self.fit, r),
                drift: self.sensed.drift(self.fit, r),
                jumps: self.jumps(r, recorded),
                curve: curve(self.sensed, self.fit, r),
                temperature: (self.sensed.warming(self.fit)).map(|_| recorded.reference),
            })
            .collect()
    }

    /// Says what to do about a bias that changes as that of a sensor that warms up.
    fn about_temperature(&self, recorded: &Recorded) -> &'static str {
        let follows = self.fit.unknowns.has(Nuisance::Warming);
        match (recorded.passed.has_temperature, recorded.warms, follows) {
            (false, ..) => {
                "Let the sensor warm up before the recording, or record its temperature as the column `temp`."
            }
            (true, false, _) => {
                "The column `temp` is constant, so it does not explain the bias: check what it holds, or let the sensor warm up before the recording."
            }
            (true, true, false) => {
                "The column `temp` does not explain the bias: check that it is the temperature of the sensor in all rows, or let the sensor warm up before the recording."
            }
            (true, true, true) => {
                "The column `temp` explains a part of the bias only: check that it is the temperature of the sensor in all rows, or let the sensor warm up before the recording."
            }
        }
    }

    /// Says how the bias of each recording changes.
    fn bias_words(&self, biases: &[Bias]) -> Vec<String> {
        let doubt = self.advice("");
        (biases.iter().zip(self.sensed.recordings))
            .flat_map(|(bias, recorded)| {
                match curve_words(bias, self.about_temperature(recorded)) {
                    Some(text) => [Some(text), None],
                    None => [jump_words(bias), drift_words(bias, self.fit.noise)],
                }
            })
            .flatten()
            .map(|text| text + doubt.trim_end())
            .collect()
    }

    /// Says how the bias follows the recorded temperature.
    fn warming_words(&self) -> Option<String> {
        let warming = self.sensed.warming(self.fit)?;
        let first = self.sensed.recordings.first()?.reference;
        Some(format!(
            "The bias of the sensor follows the column `temp` ({} per unit of temp); the load was identified beside it. The bias of a recording is that at its first value of temp ({} in the first one).",
            channel_words(&warming, &[0, 1, 2, 3, 4, 5]),
            format_significant(first, 4)
        ))
    }

    /// Returns time and bias after each jump of a recording, in the order of time.
    fn jumps(&self, recording: usize, recorded: &Recorded) -> Vec<(f64, [f64; 6])> {
        let all = self.fit.unknowns.jumps.iter().enumerate();
        let mut own: Vec<(usize, usize)> = all
            .filter(|(_, jump)| jump.recording == recording)
            .map(|(at, jump)| (jump.segment, at))
            .collect();
        own.sort_unstable();
        let told = |(segment, at): (usize, usize)| {
            let first = recorded.segments.get(segment);
            let begin = first.map_or(recorded.length, |segment| segment.begin);
            (begin, self.sensed.bias_after(self.fit, at))
        };
        own.into_iter().map(told).collect()
    }

    /// Says if more is left than noise: half of the residual's power is not explained by the noise above the band, or at rest
    /// by the noise of the rows of the poses. Refuses readings of which a rigid load leaves more than half of the power, and poses that nothing explains.
    ///
    /// # Errors
    /// [`LoadError::Fault`] with the residual, unless the user goes on.
    pub(crate) fn not_rigid(&self, even_if_wrong: bool) -> Result<Option<String>, LoadError> {
        let are_poses = self.sensed.recordings.iter().all(|own| own.poses);
        let is_unexplained = are_poses && !self.explains;
        let (noise, of) = match (
            noise_floor(self.sensed.recordings),
            scatter(self.sensed).noise(),
        ) {
            (Some(noise), _) => (Some(noise), "noise as that above the band"),
            (_, Some((noise, _))) if is_beyond_scatter(self.sensed, self.fit) => {
                (Some(noise), "noise by which the rows of a pose differ")
            }
            _ if is_unexplained => (None, ""),
            (None, Some(_)) => return Ok(None),
            (None, None) => return Ok(self.one_row_a_pose()),
        };
        let over = |kind: usize| match noise {
            Some(noise) => (self.fit.noise[kind] / noise[kind].max(f64::MIN_POSITIVE)).powi(2),
            None => f64::INFINITY,
        };
        if self.sensed.is_exact(self.fit) || over(0).max(over(1)) <= 2.0 {
            return Ok(None);
        }
        let would = noise.map_or_else(String::new, |noise| {
            format!(
                "; {of} would leave {} N and {} N·m",
                format_significant(noise[0], 3),
                format_significant(noise[1], 3)
            )
        });
        let share = self.sensed.share(self.fit);
        let text = format!(
            "A rigid load leaves {} N and {} N·m RMS ({} and {} % of what the sensor reads beside the bias){would}. Something else acts on the sensor (cables that pull, contact, elasticity, gain and crosstalk, another robot), or its noise is slow. {}",
            format_significant(self.fit.noise[0], 3),
            format_significant(self.fit.noise[1], 3),
            format_significant(100.0 * share[0], 2),
            format_significant(100.0 * share[1], 2),
            match self.explains {
                true => "",
                false => NO_CAUSE,
            }
        );
        let text = format!("{} {}", text.trim_end(), self.hit())
            .trim_end()
            .to_owned();
        let lost = |kind: usize| share[kind].powi(2) > 0.5 && over(kind) > 2.0;
        match (lost(0) || lost(1) || is_unexplained) && !even_if_wrong {
            true => Err(LoadError::Fault(text)),
            false => Ok(Some(text)),
        }
    }

    /// Says that nothing tells the noise of poses; nothing for a motion.
    fn one_row_a_pose(&self) -> Option<String> {
        let are_poses = self.sensed.recordings.iter().all(|own| own.poses);
        are_poses.then(|| {
            "One row a pose does not tell the noise of the sensor. If what is left unexplained is more than that noise, something else acts on the sensor: record some rows a pose to see it.".to_owned()
        })
    }

    /// Says where most of the residual lies; empty if it lies in no single segment.
    fn hit(&self) -> String {
        let worst = self.sensed.worst_segment(self.fit);
        let Some((recording, number, share)) = worst.filter(|own| own.2 > MOST) else {
            return String::new();
        };
        let recorded = &self.sensed.recordings[recording];
        if recorded.poses {
            // Such poses are left out with a sentence of their own.
            return String::new();
        }
        let count = recorded.segments.len() as f64;
        let [from, to] = [number, number + 1].map(|k| k as f64 / count * recorded.length);
        format!(
            "{:.0} % of the residual's power lies between {from:.1} and {to:.1} s after the begin of {}: look for a contact or a hit there.",
            100.0 * share,
            recorded.label
        )
    }

    /// Returns warnings about values that no load has.
    ///
    /// # Errors
    /// [`LoadError::Fault`] with such a value, unless the user goes on.
    pub(crate) fn implausible(
        &self,
        found: &Estimate,
        sensor: &Isometry3<f64>,
        even_if_wrong: bool,
    ) -> Result<Vec<String>, LoadError> {
        let mass = found.values[0];
        let moment = Vector3::new(found.values[1], found.values[2], found.values[3]);
        let in_flange = self.robot.flange_pose().inverse() * sensor;
        let described = in_flange.translation.vector;
        let origin = self.origin().unwrap_or(described);
        let lever = |mass: f64, moment: Vector3<f64>| (moment / mass - origin).norm();
        // Moments in a small unit have so much noise that the centre of mass counts as not shown.
        let raw = &self.fit.values;
        let fitted = lever(raw[0], Vector3::new(raw[1], raw[2], raw[3]));
        let lever = lever(mass, moment).max(fitted);
        if lever <= FARTHEST {
            return Ok(Vec::new());
        }
        let text = format!(
            "The centre of mass would be {} m from the sensor: {}.",
            format_significant(lever, 3),
            unit_by_lever(lever)
        );
        match even_if_wrong {
            true => Ok(vec![text]),
            false => Err(LoadError::Fault(text)),
        }
    }
}

/// Names the units in which the centre of mass is near the sensor, and the options that convert them.
fn unit_by_lever(lever: f64) -> String {
    let units = by_lever(lever);
    match units.is_empty() {
        true => {
            "the moments look like another unit. They must be in N·m, the forces in N".to_owned()
        }
        false => {
            let [words, options] = alternatives(&units);
            format!("{words}. Give {options}, or moments in N·m and forces in N")
        }
    }
}

/// Share of the residual's power in one of twenty segments from which something happened in it.
const MOST: f64 = 0.5;

/// Returns true if a URDF describes the robot, and no pose of the sensor was given beside it.
fn has_no_pose(robot: &Robot) -> bool {
    let none = WristSensor::default();
    let is_none =
        |own: &WristSensor| own.position == none.position && own.rotation == none.rotation;
    robot.origin == Origin::Urdf && robot.wrist_sensor.as_ref().is_none_or(is_none)
}

/// Says where a key of the sensor is stated: a URDF has no table for it.
fn stated_by(robot: &Robot, (key, option): (&str, &str), values: &[f64; 3]) -> String {
    let list = |between: &str| values.map(|v| format!("{v:.4}")).join(between);
    match robot.origin {
        Origin::Urdf => format!("give {option} {}", list(" ")),
        Origin::Own => format!("write {key} = [{}] into [wrist_sensor]", list(", ")),
    }
}

/// Names a property in a sentence.
fn words(nuisance: Nuisance) -> &'static str {
    match nuisance {
        Nuisance::Rotation => "a turned sensor",
        Nuisance::Lean => "a base that leans",
        Nuisance::Delay => "a delay of the sensor",
        Nuisance::Origin => "another position of the sensor",
        Nuisance::Drift => "a drift of the bias",
        Nuisance::Warming => "a bias that follows the temperature",
        Nuisance::Scale => "another scale of the moments",
        Nuisance::Gain(_) => "another gain of one channel",
    }
}

/// Names what a rigid load was compared with in vain.
const NO_CAUSE: &str = "Exchanged or reversed channels, a dead channel or one with another gain, readings that are cut, another unit, a turned or displaced sensor, readings in the axes of the base, a delay, a base that leans, reversed gravity, position columns with another order, sign, zero or scale, a drift of the bias (also with the temperature) and jumps of it were tried: none of them explains it.";

/// Says that a bias drifts, with the change of each channel that is above its noise.
fn drift_words(bias: &Bias, noise: [f64; 2]) -> Option<String> {
    let drift = bias.drift?;
    let large: Vec<usize> = ((0..6).filter(|c| drift[*c].abs() > noise[*c / 3])).collect();
    let which = match large.is_empty() {
        true => "by less than the noise of a reading".to_owned(),
        false => channel_words(&drift, &large),
    };
    Some(format!(
        "{}: the bias of the sensor drifts over the recording ({which}); the load was identified beside it. Let the sensor warm up before the recording.",
        bias.recording
    ))
}

/// Returns values of some channels with names and units.
fn channel_words(values: &[f64; 6], channels: &[usize]) -> String {
    let each: Vec<String> = (channels.iter())
        .map(|c| {
            let unit = if *c < 3 { "N" } else { "N·m" };
            format!(
                "{} {} {unit}",
                WRENCH_COLUMNS[*c],
                format_significant(values[*c], 2)
            )
        })
        .collect();
    each.join(", ")
}

/// Says that a bias changes smoothly, what stands for it in the fit, and what to do.
fn curve_words(bias: &Bias, advice: &str) -> Option<String> {
    let curve = bias.curve?;
    let course = match curve.time_constant {
        Some(constant) => format!(
            "settles with a time constant of about {} s",
            format_significant(constant, 2)
        ),
        None => "changes smoothly along a curve".to_owned(),
    };
    let stands = match (bias.jumps.len(), bias.drift) {
        (1, None) => "one jump stands".to_owned(),
        (count, None) => format!("{count} jumps stand"),
        (1, Some(_)) => "one jump and a linear drift stand".to_owned(),
        (count, Some(_)) => format!("{count} jumps and a linear drift stand"),
    };
    Some(format!(
        "{}: the bias of the sensor {course} ({} over the recording), as that of a sensor that warms up; {stands} for it in the fit, and a tenth of the recording around each jump was left out. {}",
        bias.recording,
        channel_words(&curve.change, &[0, 1, 2, 3, 4, 5]),
        advice
    ))
}

/// Says that a bias jumps, and by how much.
fn jump_words(bias: &Bias) -> Option<String> {
    let befores = [bias.bias]
        .into_iter()
        .chain(bias.jumps.iter().map(|own| own.1));
    let each: Vec<String> = (bias.jumps.iter().zip(befores))
        .map(|((time, after), before)| {
            let change: Vec<String> = (WRENCH_COLUMNS.iter().zip(after).zip(before))
                .map(|((name, after), before)| {
                    let unit = if name.starts_with('f') { "N" } else { "N·m" };
                    format!("{name} {} {unit}", format_significant(after - before, 2))
                })
                .collect();
            format!("near {time:.1} s ({})", change.join(", "))
        })
        .collect();
    let left_out = match each.len() {
        0 => return None,
        1 => {
            "It was estimated before and after, and a tenth of the recording around it was left out."
        }
        _ => {
            "It was estimated between them, and a tenth of the recording around each was left out."
        }
    };
    Some(format!(
        "{}: the bias of the sensor jumps {}. {left_out}",
        bias.recording,
        listed(&each)
    ))
}
