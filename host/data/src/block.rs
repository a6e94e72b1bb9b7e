//! Rows of a recording in memory.

use rig_model::simulate::Motion;

/// Columns of one joint over a stretch of rows: equal length, SI units, joint side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointColumns {
    /// Position, rad or m (from `q<k>`, or from `qm<k>` of the motors through the drives).
    pub q: Vec<f64>,
    /// Joint torque or force, N·m or N (from `tau<k>`, or from `taum<k>` or `i<k>` of the motors through the drives).
    /// Empty if the recording has neither and was opened with [`crate::EffortNeed::Optional`].
    pub tau: Vec<f64>,
    /// Measured velocity, if recorded.
    pub qd: Option<Vec<f64>>,
    /// Measured acceleration, if recorded.
    pub qdd: Option<Vec<f64>>,
    /// Reference position, if recorded.
    pub reference: Option<Vec<f64>>,
    /// Motor voltage, if recorded (`u<k>`, or `duty<k>` times `supply`), V.
    pub voltage: Option<Vec<f64>>,
    /// Temperature, if recorded, °C.
    pub temperature: Option<Vec<f64>>,
    /// Reading of an encoder on the link side of the transmission, if recorded (`ql<k>`), rad or m; any zero.
    pub link: Option<Vec<f64>>,
    /// Torque of the described effects, N·m or N; not from a file but from [`crate::Compensated`].
    pub effects: Option<Vec<f64>>,
}

/// Columns of the wrist sensor: force, N, and moment, N·m, in the sensor's axes.
pub const WRENCH_COLUMNS: [&str; 6] = ["fx", "fy", "fz", "mx", "my", "mz"];

/// Column of [`Block::extra`] with the temperature of the wrist sensor, in any unit.
pub const WRENCH_TEMPERATURE: &str = "temp";

/// Column of [`Block::extra`] beside [`WRENCH_COLUMNS`] that were interpolated to the times of the rows: the number of the
/// sensor's message (1-based, plus ½) at the time of the row, a fraction further between two messages. The ½ tells whole
/// numbers from a column of states, which are not interpolated.
pub const WRENCH_MESSAGE: &str = "wrench_message";

/// A stretch of consecutive, evenly sampled rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    /// Time, s.
    pub t: Vec<f64>,
    /// One entry per joint of the robot.
    pub joints: Vec<JointColumns>,
    /// Columns without a meaning for the model, kept by name (for instance `pulses`).
    pub extra: Vec<(String, Vec<f64>)>,
    /// Line of the first row in the file (1-based; in MCAP the number of the message); if it was interpolated, that of
    /// the next row that was not.
    pub first_line: u64,
    /// Rows that the file does not have, in order: they were interpolated between those around them.
    pub interpolated: Vec<usize>,
    /// True if this block follows the previous one without a gap in time.
    pub continues: bool,
}

impl Block {
    /// Builds the block of a simulated motion: t, and per joint q, tau and, if given, ref.
    pub fn of_motion(motion: Motion, period: f64, reference: &[Vec<f64>]) -> Self {
        let rows = motion.q.first().map_or(0, Vec::len);
        let joints = motion.q.into_iter().zip(motion.tau).enumerate();
        Self {
            t: (0..rows).map(|k| k as f64 * period).collect(),
            joints: joints
                .map(|(j, (q, tau))| JointColumns {
                    q,
                    tau,
                    reference: reference.get(j).cloned(),
                    ..JointColumns::default()
                })
                .collect(),
            first_line: 2,
            ..Self::default()
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }
    /// Returns the line of a row in the file, as [`Self::first_line`].
    pub fn line(&self, row: usize) -> u64 {
        let before = self.interpolated.partition_point(|own| *own < row);
        self.first_line + (row - before) as u64
    }
    /// Returns true if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

/// Rows `start .. end` of a block.
pub fn stretch(block: &Block, start: usize, end: usize) -> Block {
    let of = |column: &Vec<f64>| column.get(start..end).unwrap_or_default().to_vec();
    Block {
        t: of(&block.t),
        joints: block
            .joints
            .iter()
            .map(|j| JointColumns {
                q: of(&j.q),
                tau: of(&j.tau),
                qd: j.qd.as_ref().map(of),
                qdd: j.qdd.as_ref().map(of),
                reference: j.reference.as_ref().map(of),
                voltage: j.voltage.as_ref().map(of),
                temperature: j.temperature.as_ref().map(of),
                link: j.link.as_ref().map(of),
                effects: j.effects.as_ref().map(of),
            })
            .collect(),
        extra: block
            .extra
            .iter()
            .map(|(name, column)| (name.clone(), of(column)))
            .collect(),
        first_line: block.line(start),
        interpolated: (block.interpolated.iter())
            .filter(|row| (start..end).contains(*row))
            .map(|row| row - start)
            .collect(),
        continues: start > 0 || block.continues,
    }
}

/// Appends the rows of a block to those before it.
pub(crate) fn append(block: &mut Block, mut more: Block) {
    if block.is_empty() {
        *block = more;
        return;
    }
    fn join(a: &mut Option<Vec<f64>>, b: Option<Vec<f64>>) {
        match (a.as_mut(), b) {
            (Some(a), Some(b)) => a.extend(b),
            _ => *a = None,
        }
    }
    let rows = block.len();
    let interpolated = more.interpolated.iter().map(|row| row + rows);
    block.interpolated.extend(interpolated);
    block.t.append(&mut more.t);
    for (a, b) in block.joints.iter_mut().zip(more.joints) {
        a.q.extend(b.q);
        a.tau.extend(b.tau);
        join(&mut a.qd, b.qd);
        join(&mut a.qdd, b.qdd);
        join(&mut a.reference, b.reference);
        join(&mut a.voltage, b.voltage);
        join(&mut a.temperature, b.temperature);
        join(&mut a.link, b.link);
        join(&mut a.effects, b.effects);
    }
    for ((_, a), (_, b)) in block.extra.iter_mut().zip(more.extra) {
        a.extend(b);
    }
}
