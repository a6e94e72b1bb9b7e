//! Rows of the differential model: torque and regressor are computed at the full rate, filtered by the parallel
//! low-pass, and decimated.
//!
//! A stretch of a few hundred rows passes from motion through regressor to low-pass while it is in the second-level
//! cache. Regressor columns at the full rate are never stored, and structurally zero columns are never computed.

use rig_shared::transmission::MOTOR_COLUMNS;

use super::equation::{Equation, Rows};
use super::plan::{Belongs, Plan};
use super::slow::{SlowMotor, slow_motors};
use super::tally::Tally;
use crate::error::failed;
use rig_data::prepare::{Decimator, JointMotion, Motion, PrepareError};
use rig_model::batch::{BLOCK, BatchError, ChainBatch, RegressorBlock};

/// Approximate number of rows computed together: with six joints 0.3 MB of regressor.
const STRETCH: usize = 192;

/// A signal for the low-pass.
enum Signal {
    /// Regressor column: joint of the torque, standard column, place in the row.
    Regressor(usize, usize, usize),
    /// Motor column: joint of the torque, column after the standard ones, place in the row.
    Motor(usize, usize, usize),
    /// Torque of a joint.
    Torque(usize),
}

/// Computes the rows of one recording.
pub(crate) struct Differential<'a> {
    plan: &'a Plan<'a>,
    batch: ChainBatch,
    decimator: Decimator,
    /// Length of the low-pass response, rows.
    settle: usize,
    signals: Vec<Signal>,
}

/// Buffers for a stretch of rows, reused for the next one.
struct Room {
    /// Position, velocity and acceleration, per joint.
    motion: [Vec<Vec<f64>>; 3],
    block: RegressorBlock,
}

impl<'a> Differential<'a> {
    pub(crate) fn new(plan: &'a Plan<'a>) -> Result<Self, PrepareError> {
        let n = plan.chain.joint_count();
        let low_pass = plan
            .treatment
            .parallel_low_pass()
            .ok_or_else(|| failed("The parallel low-pass cannot be built."))?;
        let batch = ChainBatch::new(plan.chain);
        let mut signals: Vec<Signal> = (0..n).map(Signal::Torque).collect();
        for j in 0..n {
            for (place, &c) in plan.columns.iter().enumerate() {
                match plan.belongs(c) {
                    Belongs::Joint(c) if !batch.is_zero(j, c) => {
                        signals.push(Signal::Regressor(j, c, place));
                    }
                    Belongs::Motor(..) => {
                        signals.push(Signal::Motor(j, c - plan.chain.parameter_count(), place))
                    }
                    Belongs::Joint(_) | Belongs::Nothing => {}
                }
            }
        }
        Ok(Self {
            plan,
            batch,
            decimator: Decimator::new(&low_pass, plan.treatment.decimation),
            settle: low_pass.settle_samples(),
            signals,
        })
    }

    /// Computes the signals of the given rows of `motion`, one after the other from `out[s·stride]`.
    fn signals_at(
        &self,
        motion: &Motion,
        rows: &[usize],
        stride: usize,
        out: &mut [f64],
        room: &mut Room,
    ) -> Result<(), PrepareError> {
        let of: [fn(&JointMotion) -> &[f64]; 3] = [|j| &j.q, |j| &j.qd, |j| &j.qdd];
        for (columns, of) in room.motion.iter_mut().zip(of) {
            for (column, joint) in columns.iter_mut().zip(&motion.joints) {
                let list = of(joint);
                column.clear();
                column.extend(rows.iter().map(|&k| list[k]));
            }
        }
        let [q, qd, qdd] = &room.motion;
        for (s, signal) in self.signals.iter().enumerate() {
            if let Signal::Torque(j) = signal {
                let tau = &motion.joints[*j].tau;
                for (to, &k) in out[s * stride..].iter_mut().zip(rows) {
                    *to = tau[k];
                }
            }
        }
        self.motors_at(q, qd, qdd, stride, out)?;
        self.batch
            .each_differential_block(q, qd, qdd, &mut room.block, |part| {
                for (s, signal) in self.signals.iter().enumerate() {
                    if let Signal::Regressor(j, c, _) = signal {
                        let start = s * stride + part.start();
                        out[start..start + part.len()].copy_from_slice(part.column(*j, *c));
                    }
                }
                Ok::<(), BatchError>(())
            })
            .map_err(failed)
    }

    /// Computes the motors' part.
    fn motors_at(
        &self,
        q: &[Vec<f64>],
        qd: &[Vec<f64>],
        qdd: &[Vec<f64>],
        stride: usize,
        out: &mut [f64],
    ) -> Result<(), PrepareError> {
        if self.plan.transmission.is_simple() {
            return Ok(());
        }
        let n = q.len();
        let width = n * MOTOR_COLUMNS;
        let mut columns = vec![0.0; n * width];
        let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for row in 0..q.first().map_or(0, Vec::len) {
            for (now, lists) in state.iter_mut().zip([q, qd, qdd]) {
                now.iter_mut()
                    .zip(lists)
                    .for_each(|(to, list)| *to = list[row]);
            }
            self.plan
                .transmission
                .motor_columns(&state[0], &state[1], &state[2], &mut columns)
                .map_err(failed)?;
            for (s, signal) in self.signals.iter().enumerate() {
                if let Signal::Motor(j, c, _) = signal {
                    out[s * stride + row] = columns[j * width + c];
                }
            }
        }
        Ok(())
    }

    /// Returns the rows of a piece that decimation keeps.
    fn picked(&self, motion: &Motion) -> Vec<usize> {
        let step = self.decimator.step() as u64;
        (motion.usable.0..motion.usable.1)
            .filter(|k| (motion.offset + *k as u64).is_multiple_of(step))
            .collect()
    }

    /// Computes the rows of one piece.
    pub(crate) fn rows(&self, motion: &Motion, tally: &mut Tally) -> Result<Rows, PrepareError> {
        let picked = self.picked(motion);
        let p = self.plan.columns.len();
        let mut result = self.used(motion, tally)?;
        result.t = picked.iter().map(|&k| motion.t[k]).collect();
        result.q = picks(motion, &picked, |j| &j.q);
        result.qd = picks(motion, &picked, |j| &j.qd);
        for equation in &mut result.equations {
            equation.x = vec![0.0; picked.len() * p];
            equation.y = vec![0.0; picked.len()];
        }
        if let Some(&first) = picked.first() {
            self.filter(motion, first, &mut result)?;
        }
        Ok(result)
    }

    /// Decides which rows of the piece are used, without computing them.
    ///
    /// # Errors
    /// Lengths that do not match the drives.
    pub(crate) fn used(&self, motion: &Motion, tally: &mut Tally) -> Result<Rows, PrepareError> {
        let motors = slow_motors(motion, self.plan)?;
        let (picked, step) = (self.picked(motion), self.decimator.step());
        let treatment = self.plan.treatment;
        let margin = (treatment.reversal_margin * treatment.sample_rate).round() as usize;
        let equations = motion.joints.iter().enumerate().map(|(j, joint)| Equation {
            keep: kept(joint, &motors, &picked, [step, margin], j, tally),
            ..Default::default()
        });
        Ok(Rows {
            equations: equations.collect(),
            ..Default::default()
        })
    }

    fn filter(&self, motion: &Motion, first: usize, result: &mut Rows) -> Result<(), PrepareError> {
        let p = self.plan.columns.len();
        let (step, settle) = (self.decimator.step() as i64, self.settle as i64);
        // The position filter distorts the ends of the segment, and the low-pass would spread this far inwards. So
        // torque and columns are cut where they are sound and mirrored there.
        let (low, high) = (motion.sound.0 as i64, motion.sound.1 as i64);
        let pads = (motion.at_ends).map(|end| if end { settle.min(high - low - 1) } else { 0 });
        let outer = low - pads[0]..high + pads[1];
        let begin = outer.start.max(motion.usable.0 as i64 - settle);
        let end = outer.end.min(motion.usable.1 as i64 + settle);
        // Whole blocks, each ending at a kept row.
        let first = first as i64 + 1;
        let start = first - quotient_up(first - begin, step) * step;
        let blocks = quotient_up(end - start, step) as usize;
        let mirrored = |k: i64| {
            let k = k.clamp(outer.start, outer.end - 1);
            (if k < low {
                2 * low - k
            } else if k < high {
                k
            } else {
                2 * (high - 1) - k
            }) as usize
        };
        let together = (STRETCH / step as usize).max(1);
        let stride = together * step as usize;
        let mut room = Room {
            motion: [(); 3].map(|()| vec![Vec::new(); motion.joints.len()]),
            block: self.batch.block(BLOCK),
        };
        let mut chunk = vec![0.0; self.signals.len() * stride];
        let skipped = ((first - start) / step - 1) as usize;
        let wanted = result.t.len();
        let mut take = |from: usize, s: usize, values: &[f64]| {
            for (b, value) in (from..).zip(values) {
                let Some(row) = b.checked_sub(skipped).filter(|row| *row < wanted) else {
                    continue;
                };
                match self.signals[s] {
                    Signal::Torque(j) => result.equations[j].y[row] = *value,
                    Signal::Regressor(j, _, place) | Signal::Motor(j, _, place) => {
                        result.equations[j].x[row * p + place] = *value;
                    }
                }
            }
        };
        let mut stream = self.decimator.stream(self.signals.len());
        let mut indices = Vec::with_capacity(stride);
        for from in (0..blocks).step_by(together) {
            let count = together.min(blocks - from);
            let here = start + from as i64 * step;
            indices.clear();
            indices.extend((here..here + count as i64 * step).map(mirrored));
            self.signals_at(motion, &indices, stride, &mut chunk, &mut room)?;
            stream.push(&chunk, stride, count, &mut take);
        }
        stream.finish(&mut take);
        Ok(())
    }
}

/// Returns the quotient rounded up; `by` > 0.
fn quotient_up(a: i64, by: i64) -> i64 {
    -(-a).div_euclid(by)
}

fn picks(motion: &Motion, picked: &[usize], of: fn(&JointMotion) -> &[f64]) -> Vec<Vec<f64>> {
    let pick = |joint| {
        let list = of(joint);
        picked.iter().map(|&k| list[k]).collect()
    };
    motion.joints.iter().map(pick).collect()
}

/// Returns the number of true entries before each place; `None` if there is none at all.
fn marks(list: &[bool]) -> Option<Vec<u32>> {
    list.contains(&true).then(|| running_count(list))
}

/// Returns the number of true entries before each place.
fn running_count(list: &[bool]) -> Vec<u32> {
    std::iter::once(0)
        .chain(list.iter().scan(0, |sum, flag| {
            *sum += u32::from(*flag);
            Some(*sum)
        }))
        .collect()
}

/// Rows on each side of a marked one that the low-pass before the decimation spreads it over, in kept rows.
pub(crate) const RESPONSE: usize = 3;

/// Decides for each kept row of joint `j` if it is used.
fn kept(
    joint: &JointMotion,
    motors: &[SlowMotor],
    picked: &[usize],
    [step, margin]: [usize; 2],
    j: usize,
    tally: &mut Tally,
) -> Vec<bool> {
    let rows = joint.slow.len();
    // The joint's own slow rows, then those of the motors whose friction is in its torque.
    let slow: Vec<(&[bool], Vec<u32>)> = std::iter::once(joint.slow.as_slice())
        .chain(motors.iter().filter(|m| m.moves[j]).map(|m| &*m.slow))
        .map(|list| (list, running_count(list)))
        .collect();
    let saturated_before = marks(&joint.saturated);
    let unsettled_before = marks(&joint.unsettled);
    // Number of marked rows within `reach` of k, and number of rows there.
    let around = |before: &[u32], k: usize, reach: usize| {
        let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(rows));
        ((before[to] - before[from]) as usize, to - from)
    };
    picked
        .iter()
        .map(|&k| {
            // The model covers a short reversal. If the joint is slow for longer than the low-pass response, its
            // neighbours also contain the torque at standstill.
            let slow = slow.iter().any(|(list, before)| {
                let (near, all) = around(before, k, step);
                let dwells = near == all || around(before, k, 2 * step).0 > 3 * step.max(2);
                list[k] || dwells || around(before, k, margin).0 > 0
            });
            let any = |before: &Option<Vec<u32>>, reach: usize| {
                (before.as_ref()).is_some_and(|before| around(before, k, reach).0 > 0)
            };
            let saturated = any(&saturated_before, step);
            // The low-pass spreads a wrong torque over its response.
            let unsettled = any(&unsettled_before, RESPONSE * step);
            tally.decide(j, [saturated, unsettled, slow])
        })
        .collect()
}
