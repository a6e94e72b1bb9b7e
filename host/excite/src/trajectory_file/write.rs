//! Writer of a trajectory's TOML text.

use rig_shared::trajectory::{Sweep, Trajectory};
use toml::Spanned;
use toml_edit::{DocumentMut, Item};

use super::content::{JointTrajectory, TrajectoryFile};
use super::text::{DesignText, FileText, JointText, MotionText};
use rig_model::robot::{JointKind, Robot};
use rig_output::{comment_toml, toml_document, toml_tables};

/// Largest integer that the TOML library can hold; a larger seed is put into the text.
const LARGEST: u64 = i64::MAX.cast_unsigned();

fn seconds(micros: u32) -> f64 {
    f64::from(micros) / 1e6
}

fn times(micros: &[u32]) -> Vec<f64> {
    micros.iter().copied().map(seconds).collect()
}

/// Returns a value of a file that has not been read.
fn unread<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

impl From<&Trajectory<f64>> for MotionText {
    fn from(trajectory: &Trajectory<f64>) -> Self {
        match trajectory {
            Trajectory::Hold(duration) => Self::Hold {
                duration: seconds(*duration),
            },
            Trajectory::Fourier(m) => Self::Fourier {
                period: seconds(m.period_us),
                periods: m.periods,
                ramp: seconds(m.ramp_us),
                sine: m.sine.to_vec(),
                cosine: m.cosine.to_vec(),
            },
            Trajectory::Chirp(m) => Self::Chirp {
                start_hz: m.start_hz,
                end_hz: m.end_hz,
                sweep: match m.sweep {
                    Sweep::Linear => "linear".to_owned(),
                    Sweep::Logarithmic => "logarithmic".to_owned(),
                },
                duration: seconds(m.duration_us),
                ramp: seconds(m.ramp_us),
                amplitude: m.amplitude,
                velocity: m.velocity,
                acceleration: m.acceleration,
                again: m.again,
            },
            Trajectory::Staircase(m) => Self::Staircase {
                levels: m.levels.to_vec(),
                moving: seconds(m.move_us),
                dwell: seconds(m.dwell_us),
            },
            Trajectory::SlowReversals(m) => Self::Reversals {
                speed: m.speed,
                half_turn: seconds(m.half_turn_us),
                quarter: times(&m.quarter_us),
                cycles: m.cycles,
            },
            Trajectory::FrictionSweep(m) => Self::Sweep {
                half_span: m.half_span,
                cruise: times(&m.cruise_us),
                ramp: seconds(m.ramp_us),
                dwell: seconds(m.dwell_us),
                lead: seconds(m.lead_us),
            },
        }
    }
}

impl From<&TrajectoryFile> for FileText {
    fn from(file: &TrajectoryFile) -> Self {
        let joint = |joint: &JointTrajectory| JointText {
            name: joint.name.clone(),
            start: unread(joint.start),
            trajectory: unread(MotionText::from(&joint.trajectory)),
        };
        Self {
            robot: file.robot.clone(),
            design: file.design.map(|d| {
                unread(DesignText {
                    criterion: d.criterion.name().to_owned(),
                    value: d.value,
                    condition_number: d.condition_number,
                    seed: d.seed.min(LARGEST),
                })
            }),
            drive_off: file.drive_off.map(unread),
            joints: file.joints.iter().map(joint).collect(),
        }
    }
}

/// Returns the comments by table and key, for joints whose position has that unit.
fn comments(unit: &str) -> DocumentMut {
    let text = include_str!("comments.toml").replace("{unit}", unit);
    text.parse().unwrap_or_default()
}

impl TrajectoryFile {
    /// Writes TOML with units in comments; [`TrajectoryFile::from_toml`] reads back an equal file.
    pub fn to_toml(&self, robot: &Robot) -> String {
        // No value of the structure is without a form in TOML.
        let mut document = toml_document(&FileText::from(self), &[]).unwrap_or_default();
        comment_toml(&mut document, &comments(""));
        for (k, table) in toml_tables(&mut document, "joint").enumerate() {
            let mut comments = comments(match robot.joints.get(k).map(|j| j.kind) {
                Some(JointKind::Prismatic) => "m",
                _ => "rad",
            });
            let kind = table["trajectory"]["kind"].as_str().unwrap_or_default();
            comments["joint"]["trajectory"] = comments["motion"][kind].clone();
            if let Item::Table(comments) = &comments["joint"] {
                comment_toml(table, comments);
            }
        }
        let text = document.to_string();
        match &self.design {
            Some(d) if d.seed > LARGEST => text.replacen(
                &format!("seed = {LARGEST:<20}"),
                &format!("seed = {:<20}", d.seed),
                1,
            ),
            _ => text,
        }
    }
}
