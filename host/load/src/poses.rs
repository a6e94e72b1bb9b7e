//! The poses at rest of a recording.

use rig_data::prepare::Recording;
use rig_shared::multibody::{Chain, wrench_regressor};

use crate::axes::SensorAxes;
use crate::error::LoadError;
use crate::pace::{AT_REST, Pace, Run};
use crate::pose_noise::{Batches, Scatter};
use crate::rows::{Ends, FEWEST_ROWS, Passed, base_axes, beyond, each_readings, temperature};
use crate::wrench_row::{ENTRIES, WrenchRow, about, weight};

/// Poses nearer than this multiple of [`AT_REST`] follow each other in a motion.
const NEAR: f64 = 3.0;
/// Shorter than this share of the longest pose, rows belong to the way between two.
const SHORT: f64 = 0.05;

/// Returns the poses of a recording: consecutive rows at one position are one pose, with their mean readings, because the
/// errors of one pose are not independent. Rows between poses are left out; of rows that follow each other in time those are
/// poses in which the robot rests. Beside them stands what the rows tell beside the fit.
///
/// # Errors
/// As [`each_readings`]; [`LoadError::Moves`] if the recording never rests.
pub(crate) fn poses(
    chain: &Chain<f64>,
    sensor: &SensorAxes,
    recording: &dyn Recording,
    (ends, pace): (&Ends, Pace),
) -> Result<(Vec<WrenchRow>, Passed), LoadError> {
    let mut poses: Vec<Pose> = Vec::new();
    let (mut left_out, mut rows, mut has_temperature) = (0, 0u64, false);
    each_readings(recording, &mut |block, readings| {
        has_temperature |= temperature(&block.extra).is_some();
        for k in 0..block.len() {
            let now: [f64; 6] = std::array::from_fn(|c| readings[c][k]);
            rows += 1;
            if beyond(&now, ends) {
                left_out += 1;
                continue;
            }
            let q: Vec<f64> = block.joints.iter().map(|joint| joint.q[k]).collect();
            let others = [
                block.t[k],
                temperature(&block.extra).map_or(0.0, |list| list[k]),
            ];
            match poses.last_mut().filter(|pose| pose.is_at(&q)) {
                Some(pose) => pose.add(&q, &now, others),
                None => poses.push(Pose::new(q, now, others)),
            }
        }
        Ok(())
    })?;
    if pace == Pace::Continuous {
        poses.retain(|pose| pose.run.rests());
    }
    let longest = poses.iter().map(|pose| pose.rows).max().unwrap_or(0);
    poses.retain(|pose| pose.rows as f64 >= SHORT * longest as f64);
    let near = poses
        .windows(2)
        .filter(|two| two[0].is_near(&two[1]))
        .count();
    if pace == Pace::Continuous && poses.is_empty() || poses.len() > 2 && 2 * near > poses.len() {
        return Err(never_rests(&recording.label(), rows));
    }
    let still = vec![0.0; chain.joint_count()];
    let mut found = Vec::with_capacity(poses.len());
    let mut scatter = Scatter::default();
    for pose in &poses {
        scatter.add(&pose.batches);
        let count = pose.rows as f64;
        let q: Vec<f64> = pose.q.iter().map(|sum| sum / count).collect();
        let mut regressor = [0.0; ENTRIES];
        wrench_regressor(chain, &q, &still, &still, &mut regressor)
            .map_err(|e| LoadError::Model(e.to_string()))?;
        sensor.turn(&mut regressor);
        about(&sensor.origin, &mut regressor);
        let axes = base_axes(chain, &q).map_err(|e| LoadError::Model(e.to_string()))?;
        found.push(WrenchRow {
            time: pose.others[0] / count,
            temperature: pose.others[1] / count,
            regressor,
            rate: [0.0; ENTRIES],
            weights: axes.map(|axis| weight(&sensor.seen(&axis), &sensor.origin)),
            readings: pose.readings.map(|sum| sum / count),
        });
    }
    let passed = Passed {
        saturated: left_out,
        scatter,
        has_temperature,
        ..Passed::default()
    };
    Ok((found, passed))
}

/// Says that the rows of a recording are no poses.
fn never_rests(label: &str, rows: u64) -> LoadError {
    let remedy = match rows >= FEWEST_ROWS as u64 {
        true => "leave out --poses".to_owned(),
        false => format!(
            "it has {rows} rows; record at least {FEWEST_ROWS} of the motion, or let the robot stand at each pose"
        ),
    };
    LoadError::Moves {
        label: label.to_owned(),
        remedy,
    }
}

/// Sums over the rows of one pose.
struct Pose {
    run: Run,
    rows: u64,
    q: Vec<f64>,
    readings: [f64; 6],
    batches: Batches,
    /// Time and temperature.
    others: [f64; 2],
}

impl Pose {
    fn new(q: Vec<f64>, readings: [f64; 6], others: [f64; 2]) -> Self {
        let mut batches = Batches::new();
        batches.add(&readings);
        Self {
            run: Run::of(others[0], q.clone()),
            rows: 1,
            q,
            readings,
            batches,
            others,
        }
    }

    fn is_at(&self, q: &[f64]) -> bool {
        self.run.distance(q) < AT_REST
    }

    fn is_near(&self, other: &Self) -> bool {
        self.run.distance(other.run.first()) < NEAR * AT_REST
    }

    fn add(&mut self, q: &[f64], readings: &[f64; 6], others: [f64; 2]) {
        self.rows += 1;
        self.run.push(others[0], q);
        self.batches.add(readings);
        let sums = self
            .q
            .iter_mut()
            .chain(&mut self.readings)
            .chain(&mut self.others);
        let values = q.iter().chain(readings).chain(&others);
        sums.zip(values).for_each(|(sum, value)| *sum += value);
    }
}
