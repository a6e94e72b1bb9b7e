//! Rows of the integral model for several joints: impulse equals change of momentum, one equation per joint.
//!
//! Lagrange's equations integrated over a window, ∫τ dt = P(end)·π − P(start)·π + ∫R dt·π. P is the momentum, R its
//! change without the torque ([`rig_shared::multibody::momentum_regressor`]). They are linear in the parameters of the
//! differential model and need no acceleration. The energy balance needs none either, but it is one equation for all
//! joints, and friction errors of a heavy joint hide the light ones. On the Stäubli TX40 windows of energy leave 14 to
//! 92 % of the torque, windows of momentum 5 to 11 %, as the differential model does.
//!
//! The torque and the signs of the velocities pass the position filter, as for the energy. Each row is divided by the
//! window's duration, which gives a mean torque.
//!
//! Torque and loss both use the trapezoidal rule, so that its errors at friction jumps cancel. For a smooth rate the
//! rule differs from the integral by dt²/12·(slope at the end − slope at the start) (Euler and Maclaurin).
//! [`as_trapezia_see`] gives the momentum the same error.

use std::collections::VecDeque;

use rig_shared::multibody::{COLUMNS, column, momentum_loss_regressor, momentum_regressor};
use rig_shared::scalar::Real;
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use super::equation::{Equation, Rows};
use super::motor_momentum::MotorMomentum;
use super::plan::{Belongs, Plan};
use super::slow::{HARDLY, slow_motors, stays};
use super::tally::Tally;
use crate::error::failed;
use rig_data::prepare::{LowPass, Motion, PrepareError};

/// Regressors at one instant: momentum P and loss R, each joint × wanted column.
struct Instant {
    momentum: Vec<f64>,
    loss: Vec<f64>,
}

/// Workspace that computes the regressors at an instant.
struct Maker<'a> {
    plan: &'a Plan<'a>,
    wide: Vec<f64>,
    motors: MotorMomentum,
    directions: Vec<f64>,
}

impl<'a> Maker<'a> {
    fn new(plan: &'a Plan<'a>, n: usize) -> Self {
        Self {
            plan,
            wide: vec![0.0; n * plan.chain.parameter_count()],
            motors: MotorMomentum::new(n),
            directions: vec![0.0; n * n],
        }
    }

    /// Computes the regressors; `signs` and `motor_signs` are the filtered signs of the joints' and motors' speeds.
    fn at(
        &mut self,
        q: &[f64],
        qd: &[f64],
        signs: &[f64],
        motor_signs: &[f64],
        out: &mut Instant,
    ) -> Result<(), PrepareError> {
        let (n, plan) = (q.len(), self.plan);
        let (p, width) = (plan.columns.len(), plan.chain.parameter_count());
        let coupled = !plan.transmission.is_simple();
        momentum_regressor(plan.chain, q, qd, &mut self.wide).map_err(failed)?;
        self.pick(n, width, p, &mut out.momentum);
        momentum_loss_regressor(plan.chain, q, qd, &mut self.wide).map_err(failed)?;
        self.pick(n, width, p, &mut out.loss);
        for (place, &c) in plan.columns.iter().enumerate() {
            if let Belongs::Joint(c) = plan.belongs(c)
                && c % COLUMNS == column::COULOMB
            {
                let j = c / COLUMNS;
                out.loss[j * p + place] = signs[j];
            }
        }
        if coupled {
            self.motors_at(q, qd, motor_signs, out)?;
        }
        Ok(())
    }

    fn pick(&self, n: usize, width: usize, p: usize, out: &mut [f64]) {
        for (place, &c) in self.plan.columns.iter().enumerate() {
            let from = match self.plan.belongs(c) {
                Belongs::Joint(c) => Some(c),
                Belongs::Motor(..) | Belongs::Nothing => None,
            };
            for j in 0..n {
                out[j * p + place] = from.map_or(0.0, |c| self.wide[j * width + c]);
            }
        }
    }

    /// Adds the motors' part, with the filtered signs of their speeds.
    fn motors_at(
        &mut self,
        q: &[f64],
        qd: &[f64],
        signs: &[f64],
        out: &mut Instant,
    ) -> Result<(), PrepareError> {
        let (n, plan, drives) = (q.len(), self.plan, self.plan.transmission);
        let (p, width) = (plan.columns.len(), n * MOTOR_COLUMNS);
        self.motors.at(drives, q, qd).map_err(failed)?;
        drives
            .motor_directions(q, &mut self.directions)
            .map_err(failed)?;
        for (place, &c) in plan.columns.iter().enumerate() {
            let Belongs::Motor(k, which) = plan.belongs(c) else {
                continue;
            };
            for j in 0..n {
                let entry = j * width + k * MOTOR_COLUMNS + which;
                let at = j * p + place;
                out.momentum[at] = self.motors.momentum[entry];
                out.loss[at] = match which {
                    motor_column::COULOMB => self.directions[k * n + j] * signs[k],
                    _ => self.motors.loss[entry],
                };
            }
        }
        Ok(())
    }
}

/// Returns x + dt²/12·ẍ, to which the trapezoidal rule sums the rate of a smooth quantity, from the values at the
/// previous, the current and the next row.
pub(crate) fn as_trapezia_see([before, now, after]: [f64; 3]) -> f64 {
    now + (after - 2.0 * now + before) / 12.0
}

/// A window that is not yet complete.
struct Open {
    start: usize,
    momentum: Vec<f64>,
    sum: Vec<f64>,
}

/// Computes the rows of one piece.
pub(crate) fn momentum_rows(
    motion: &Motion,
    plan: &Plan,
    low_pass: &LowPass,
    tally: &mut Tally,
) -> Result<Rows, PrepareError> {
    let n = motion.joints.len();
    let p = plan.columns.len();
    let dt = plan.treatment.dt();
    let mut result = Rows {
        equations: vec![Equation::default(); n],
        q: vec![Vec::new(); n],
        qd: vec![Vec::new(); n],
        ..Default::default()
    };
    // The row before the first and the row after the last are also needed.
    let (first, last) = (motion.usable.0.max(1), motion.sound.1.saturating_sub(1));
    if first >= motion.usable.1.min(last) {
        return Ok(result);
    }
    let mut instants = Instants::new(motion, plan, low_pass)?;
    let torque: Vec<Vec<f64>> = motion
        .joints
        .iter()
        .map(|j| running_integral(&low_pass.zero_phase(&j.tau), dt))
        .collect();
    let excluded = Excluded::of(motion, plan)?;
    let empty = || Instant {
        momentum: vec![0.0; n * p],
        loss: vec![0.0; n * p],
    };
    let (mut before, mut now, mut after) = (empty(), empty(), empty());
    let mut sum = vec![0.0; n * p];
    let mut open: VecDeque<Open> = VecDeque::new();
    instants.look(first - 1, &mut now)?;
    instants.look(first, &mut after)?;
    let duration = plan.window as f64 * dt;
    for k in first..last {
        std::mem::swap(&mut before, &mut now);
        std::mem::swap(&mut now, &mut after);
        instants.look(k + 1, &mut after)?;
        if k > first {
            for ((sum, a), b) in sum.iter_mut().zip(&before.loss).zip(&now.loss) {
                *sum += 0.5 * dt * (a + b);
            }
        }
        let momentum =
            |e: usize| as_trapezia_see([before.momentum[e], now.momentum[e], after.momentum[e]]);
        let due = open.front().is_some_and(|o| o.start + plan.window == k);
        if let Some(done) = if due { open.pop_front() } else { None } {
            for (j, equation) in result.equations.iter_mut().enumerate() {
                let of = j * p..(j + 1) * p;
                equation.x.extend(
                    of.map(|e| (momentum(e) - done.momentum[e] + sum[e] - done.sum[e]) / duration),
                );
                equation
                    .y
                    .push((torque[j][k] - torque[j][done.start]) / duration);
                let used = excluded.counted(j, [done.start, k], plan.window, tally);
                equation.keep.push(used);
            }
            result.t.push(motion.t[done.start]);
            for (j, joint) in motion.joints.iter().enumerate() {
                result.q[j].push(joint.q[done.start]);
                result.qd[j].push(joint.qd[done.start]);
            }
        }
        if k < motion.usable.1 && (motion.offset + k as u64).is_multiple_of(plan.stride as u64) {
            open.push_back(Open {
                start: k,
                momentum: (0..n * p).map(momentum).collect(),
                sum: sum.clone(),
            });
        }
    }
    Ok(result)
}

/// The regressors at the rows of a piece.
struct Instants<'a> {
    motion: &'a Motion,
    maker: Maker<'a>,
    /// Filtered signs of the joints' and motors' speeds, over the rows.
    signs: Vec<Vec<f64>>,
    motor_signs: Vec<Vec<f64>>,
    q: Vec<f64>,
    qd: Vec<f64>,
    sign: Vec<f64>,
    motor_sign: Vec<f64>,
}

impl<'a> Instants<'a> {
    fn new(
        motion: &'a Motion,
        plan: &'a Plan<'a>,
        low_pass: &LowPass,
    ) -> Result<Self, PrepareError> {
        let n = motion.joints.len();
        let filtered_sign = |speeds: &[f64]| {
            low_pass.zero_phase(&speeds.iter().map(|v| v.sgn()).collect::<Vec<_>>())
        };
        Ok(Self {
            motion,
            maker: Maker::new(plan, n),
            signs: (motion.joints.iter())
                .map(|j| filtered_sign(&j.qd))
                .collect(),
            motor_signs: motor_signs(motion, plan, low_pass)?,
            q: vec![0.0; n],
            qd: vec![0.0; n],
            sign: vec![0.0; n],
            motor_sign: vec![0.0; n],
        })
    }

    /// Computes the regressors at row `k`.
    fn look(&mut self, k: usize, out: &mut Instant) -> Result<(), PrepareError> {
        for (j, joint) in self.motion.joints.iter().enumerate() {
            (self.q[j], self.qd[j]) = (joint.q[k], joint.qd[k]);
            self.sign[j] = self.signs[j][k];
            self.motor_sign[j] = self.motor_signs.get(j).map_or(0.0, |s| s[k]);
        }
        self.maker
            .at(&self.q, &self.qd, &self.sign, &self.motor_sign, out)
    }
}

/// Numbers of rows of each kind before each row of a piece.
struct Excluded {
    /// Per joint, rows in which it is slow, and in which it hardly moves.
    slow: Vec<[Vec<u32>; 2]>,
    /// The same per motor of a coupled drive, with the joints that it moves.
    motors: Vec<(Vec<bool>, [Vec<u32>; 2])>,
    /// Per joint, rows at the torque limit.
    saturated: Vec<Vec<u32>>,
    /// Per joint, rows with a current that had not settled.
    unsettled: Vec<Vec<u32>>,
}

impl Excluded {
    fn of(motion: &Motion, plan: &Plan) -> Result<Self, PrepareError> {
        let count = |flags: &dyn Fn(usize) -> bool| {
            let mut sum = 0u32;
            let mut all = vec![0];
            all.extend((0..motion.t.len()).map(|k| {
                sum += u32::from(flags(k));
                sum
            }));
            all
        };
        Ok(Self {
            slow: (motion.joints.iter().zip(&plan.treatment.speed_threshold))
                .map(|(j, threshold)| {
                    let hardly = |k: usize| j.qd[k].abs() < HARDLY * threshold;
                    [count(&|k| j.slow[k]), count(&hardly)]
                })
                .collect(),
            motors: slow_motors(motion, plan)?
                .into_iter()
                .map(|m| (m.moves, [count(&|k| m.slow[k]), count(&|k| m.hardly[k])]))
                .collect(),
            saturated: motion
                .joints
                .iter()
                .map(|j| count(&|k| j.saturated[k]))
                .collect(),
            unsettled: (motion.joints.iter())
                .map(|j| count(&|k| j.unsettled[k]))
                .collect(),
        })
    }

    /// Decides if a window of joint `j` is used, from its first and last row, and counts it.
    fn counted(
        &self,
        j: usize,
        [start, end]: [usize; 2],
        window: usize,
        tally: &mut Tally,
    ) -> bool {
        let over = |c: &[u32]| c[end + 1] - c[start];
        // Half a window without a sign of the velocity says little about friction.
        let most = |[slow, hardly]: &[Vec<u32>; 2]| {
            let rows = over(slow) as usize;
            2 * rows > window || stays(rows, over(hardly) as usize, window)
        };
        let mut motors = self.motors.iter();
        let still = most(&self.slow[j]) || motors.any(|(moves, c)| moves[j] && most(c));
        let saturated = over(&self.saturated[j]) > 0;
        let unsettled = over(&self.unsettled[j]) > 0;
        tally.decide(j, [saturated, unsettled, still])
    }
}

/// Returns the filtered signs of the motors' speeds, for coupled drives.
fn motor_signs(
    motion: &Motion,
    plan: &Plan,
    low_pass: &LowPass,
) -> Result<Vec<Vec<f64>>, PrepareError> {
    if plan.transmission.is_simple() {
        return Ok(Vec::new());
    }
    let n = motion.joints.len();
    let mut signs = vec![vec![0.0; motion.t.len()]; n];
    let (mut q, mut qd, mut speeds) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 0..motion.t.len() {
        for (j, joint) in motion.joints.iter().enumerate() {
            (q[j], qd[j]) = (joint.q[k], joint.qd[k]);
        }
        plan.transmission
            .motor_speeds(&q, &qd, &mut speeds)
            .map_err(failed)?;
        for (list, speed) in signs.iter_mut().zip(&speeds) {
            list[k] = speed.sgn();
        }
    }
    Ok(signs.iter().map(|s| low_pass.zero_phase(s)).collect())
}

/// Returns the integral from the first row by the trapezoidal rule.
fn running_integral(signal: &[f64], dt: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut all = Vec::with_capacity(signal.len());
    let mut last = None;
    for &x in signal {
        sum += last.map_or(0.0, |l: f64| 0.5 * dt * (l + x));
        last = Some(x);
        all.push(sum);
    }
    all
}
