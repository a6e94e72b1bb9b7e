//! Some rows of a recording of motion with the motion of the joints, by which errors of the columns are compared
//! without filtering the recording again.

use rig_data::prepare::{PrepareError, PreprocessingPlan, Recording, each_motion};
use rig_shared::multibody::{Chain, MultibodyError, wrench_regressor};

use crate::axes::SensorAxes;
use crate::error::LoadError;
use crate::rows::{Ends, Passed, base_axes, beyond, parallel_low_pass, readings};
use crate::statistics::{Collector, Recorded, SEGMENTS};
use crate::wrench_row::{ENTRIES, WrenchRow, about, weight};

/// Number of rows of a sample. A load, six biases and an angle are 17 unknowns, and six readings a row leave 1800 equations.
const ROWS: u64 = 300;

/// Position, velocity and acceleration of a joint, rad or m, and by s.
pub(crate) type JointState = [f64; 3];

/// The joints and the readings at one instant.
struct SampleRow {
    /// Time since the begin of the recording, s.
    time: f64,
    joints: Vec<JointState>,
    /// Readings in the band of the fit.
    readings: [f64; 6],
}

/// Rows that are spread evenly over a recording of motion.
pub(crate) struct MotionSample {
    rows: Vec<SampleRow>,
    length: f64,
}

impl MotionSample {
    /// Reads the sample of a recording that has `expected` rows after decimation. Rows with a reading outside of `ends` are
    /// left out.
    ///
    /// # Errors
    /// [`LoadError`]: a recording that cannot be read.
    pub(crate) fn read(
        recording: &dyn Recording,
        plan: &PreprocessingPlan,
        ends: &Ends,
        (expected, length): (u64, f64),
    ) -> Result<Self, LoadError> {
        let low_pass = parallel_low_pass(plan)?;
        let step = plan.decimation as u64 * expected.div_ceil(ROWS).max(1);
        let mut rows = Vec::new();
        let mut start = None;
        each_motion(recording, plan, 0, &mut |motion| {
            let begin = *start.get_or_insert(motion.t.first().copied().unwrap_or(0.0));
            let columns = readings(&motion.extra)
                .map_err(|column| PrepareError::Stopped(column.to_owned()))?;
            let (low, high) = motion.sound;
            let filtered = columns.map(|column| low_pass.zero_phase(&column[low..high]));
            for k in motion.usable.0.max(low)..motion.usable.1.min(high) {
                let now = columns.map(|column| column[k]);
                if (motion.offset + k as u64).is_multiple_of(step) && !beyond(&now, ends) {
                    let state = motion.joints.iter().map(|j| [j.q[k], j.qd[k], j.qdd[k]]);
                    rows.push(SampleRow {
                        time: motion.t[k] - begin,
                        joints: state.collect(),
                        readings: std::array::from_fn(|c| filtered[c][k - low]),
                    });
                }
            }
            Ok(())
        })?;
        Ok(Self { rows, length })
    }

    /// Returns the equations of the sample with the states of the joints and the readings changed by `change`.
    ///
    /// # Errors
    /// [`LoadError::Model`].
    pub(crate) fn recorded(
        &self,
        chain: &Chain<f64>,
        axes: &SensorAxes,
        (label, loaded): (String, bool),
        change: &dyn Fn(&mut [JointState], &mut [f64; 6]),
    ) -> Result<Recorded, LoadError> {
        // All rows in one segment: they are fitted together, and each segment costs as much as its merger.
        let expected = (self.rows.len() * SEGMENTS) as u64;
        let mut collector = Collector::new(expected, self.length);
        let mut joints = Vec::new();
        for row in &self.rows {
            joints.clone_from(&row.joints);
            let mut readings = row.readings;
            change(&mut joints, &mut readings);
            let own = wrench_row(chain, axes, (row.time, &joints), readings);
            collector.push(&own.map_err(|e| LoadError::Model(e.to_string()))?);
        }
        Ok(collector.finish(label, loaded, false, Passed::default()))
    }
}

/// Returns the equation of an instant.
fn wrench_row(
    chain: &Chain<f64>,
    axes: &SensorAxes,
    (time, joints): (f64, &[JointState]),
    readings: [f64; 6],
) -> Result<WrenchRow, MultibodyError> {
    let [q, qd, qdd] = [0, 1, 2].map(|k| joints.iter().map(|own| own[k]).collect::<Vec<f64>>());
    let mut regressor = [0.0; ENTRIES];
    wrench_regressor(chain, &q, &qd, &qdd, &mut regressor)?;
    axes.turn(&mut regressor);
    about(&axes.origin, &mut regressor);
    let base = base_axes(chain, &q)?;
    Ok(WrenchRow {
        time,
        temperature: 0.0,
        regressor,
        rate: [0.0; ENTRIES],
        weights: base.map(|axis| weight(&axes.seen(&axis), &axes.origin)),
        readings,
    })
}
