//! Rows of the integral (energy) model; those of several joints are in [`super::momentum`].

use rig_shared::multibody::{COLUMNS, column, energy_regressor};
use rig_shared::scalar::Real;
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use super::equation::{Equation, Rows};
use super::momentum::{as_trapezia_see, momentum_rows};
use super::plan::{Belongs, Plan};
use super::tally::Tally;
use crate::error::failed;
use rig_data::prepare::{JointMotion, LowPass, Motion, PrepareError};

/// Computes the rows of one recording.
pub(crate) struct Integral<'a> {
    plan: &'a Plan<'a>,
    low_pass: LowPass,
}

impl<'a> Integral<'a> {
    pub(crate) fn new(plan: &'a Plan<'a>) -> Result<Self, PrepareError> {
        let low_pass = plan
            .treatment
            .position_filter()
            .ok_or_else(|| failed("The position filter cannot be built."))?;
        Ok(Self { plan, low_pass })
    }

    /// Computes the rows of one piece.
    pub(crate) fn rows(&self, motion: &Motion, tally: &mut Tally) -> Result<Rows, PrepareError> {
        if motion.joints.len() > 1 {
            return momentum_rows(motion, self.plan, &self.low_pass, tally);
        }
        integral_rows(motion, self.plan, &self.low_pass, tally)
    }
}

/// Computes rows in which work over a window equals change of energy plus the work of friction:
/// ∫ τᵀq̇ dt = H(end) − H(start) + Σ (fv·∫q̇² + fc·∫|q̇| + off·∫q̇).
///
/// Torque and sign of the velocity both pass the position filter, which then affects both sides equally. Each window is
/// divided by √(W·∫Σ(loudness·q̇)²). This makes the residuals of all windows equally uncertain (torque noise enters the
/// work multiplied by the velocity) and gives them the unit of a torque. The energy gets the same trapezoidal error as
/// the work ([`as_trapezia_see`]).
fn integral_rows(
    motion: &Motion,
    plan: &Plan,
    low_pass: &LowPass,
    tally: &mut Tally,
) -> Result<Rows, PrepareError> {
    let n = motion.joints.len();
    if motion.t.is_empty() {
        return Ok(Rows::default());
    }
    let integrals = Integrals::of(motion, plan, low_pass)?;
    let mut energies = Energies::new(motion, plan);
    let duration = plan.window as f64 * plan.treatment.dt();
    let mut result = Rows {
        equations: vec![Equation::default()],
        q: vec![Vec::new(); n],
        qd: vec![Vec::new(); n],
        ..Default::default()
    };
    // The row before a window and the row after it are also needed.
    for start in motion.usable.0.max(1)..motion.usable.1 {
        let end = start + plan.window;
        if !(motion.offset + start as u64).is_multiple_of(plan.stride as u64)
            || end + 1 >= motion.sound.1
        {
            continue;
        }
        let window = [start, end];
        energies.look(window)?;
        let moved = over(&integrals.activity, window);
        let scale = 1.0
            / (duration * (moved + integrals.least_activity))
                .sqrt()
                .max(f64::MIN_POSITIVE);
        let equation = &mut result.equations[0];
        for &c in plan.columns {
            let value = integrals.value(plan, c, window, &energies);
            equation.x.push(scale * value);
        }
        equation.y.push(scale * over(&integrals.work, window));
        let still = moved <= integrals.least_activity;
        equation.keep.push(used(motion, window, still, tally));
        result.t.push(motion.t[start]);
        for (j, joint) in motion.joints.iter().enumerate() {
            result.q[j].push(joint.q[start]);
            result.qd[j].push(joint.qd[start]);
        }
    }
    Ok(result)
}

/// Returns the integral over a window, given by its first and last row, from the running integral.
fn over(integral: &[f64], [start, end]: [usize; 2]) -> f64 {
    integral[end] - integral[start]
}

/// Returns the integral of `rate` from the first of `rows` rows to each, by the trapezoidal rule.
fn cumulative(rows: usize, dt: f64, rate: &dyn Fn(usize) -> f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut last = rate(0);
    let mut all = Vec::with_capacity(rows);
    all.push(0.0);
    for k in 1..rows {
        let next = rate(k);
        sum += 0.5 * dt * (last + next);
        last = next;
        all.push(sum);
    }
    all
}

/// Decides if a window is used, and counts it.
fn used(motion: &Motion, [start, end]: [usize; 2], still: bool, tally: &mut Tally) -> bool {
    let any = |of: &dyn Fn(&JointMotion) -> &[bool]| {
        (motion.joints.iter()).any(|joint| of(joint)[start..=end].contains(&true))
    };
    let saturated = any(&|joint| &joint.saturated);
    let unsettled = any(&|joint| &joint.unsettled);
    tally.decide(0, [saturated, unsettled, still])
}

/// Running integrals from the first row of a piece.
struct Integrals {
    /// Work of the torques, J.
    work: Vec<f64>,
    /// ∫Σ(loudness·q̇)², with the largest loudness as 1.
    activity: Vec<f64>,
    /// The same over a window in which every joint moves at its speed threshold.
    least_activity: f64,
    /// Per joint: ∫q̇², ∫sgn(q̇)·q̇, ∫q̇.
    friction: Vec<[Vec<f64>; 3]>,
    /// Per motor, work of its friction for unit coefficients: viscous, Coulomb. Empty without coupled drives.
    motors: Vec<[Vec<f64>; 2]>,
}

impl Integrals {
    fn of(motion: &Motion, plan: &Plan, low_pass: &LowPass) -> Result<Self, PrepareError> {
        let (rows, dt) = (motion.t.len(), plan.treatment.dt());
        let cumulative = |rate: &dyn Fn(usize) -> f64| cumulative(rows, dt, rate);
        let loudest = plan.loudness.iter().fold(0.0f64, |m, x| m.max(*x));
        let loudness: Vec<f64> = plan.loudness.iter().map(|l| l / loudest).collect();
        let mut work = vec![0.0; rows];
        let mut activity = vec![0.0; rows];
        let mut least_activity = 0.0;
        let mut friction = Vec::with_capacity(motion.joints.len());
        for (j, joint) in motion.joints.iter().enumerate() {
            let qd = &joint.qd;
            let torque = low_pass.zero_phase(&joint.tau);
            let sign: Vec<f64> = qd.iter().map(|v| v.sgn()).collect();
            let sign = low_pass.zero_phase(&sign);
            let squares = cumulative(&|k| qd[k] * qd[k]);
            for (sum, part) in work.iter_mut().zip(cumulative(&|k| torque[k] * qd[k])) {
                *sum += part;
            }
            let share = loudness[j].powi(2);
            for (sum, part) in activity.iter_mut().zip(&squares) {
                *sum += share * part;
            }
            least_activity +=
                share * plan.treatment.speed_threshold[j].powi(2) * plan.window as f64 * dt;
            friction.push([
                squares,
                cumulative(&|k| sign[k] * qd[k]),
                cumulative(&|k| qd[k]),
            ]);
        }
        Ok(Self {
            work,
            activity,
            least_activity,
            friction,
            motors: motor_friction(motion, plan, low_pass)?,
        })
    }

    /// Returns the entry of column `c` in the row of a window.
    fn value(&self, plan: &Plan, c: usize, window: [usize; 2], energies: &Energies) -> f64 {
        let over = |f: &[f64]| over(f, window);
        match plan.belongs(c) {
            Belongs::Joint(c) => match c % COLUMNS {
                column::VISCOUS => over(&self.friction[c / COLUMNS][0]),
                column::COULOMB => over(&self.friction[c / COLUMNS][1]),
                column::OFFSET => over(&self.friction[c / COLUMNS][2]),
                _ => energies.change(c),
            },
            Belongs::Motor(k, motor_column::VISCOUS) => over(&self.motors[k][0]),
            Belongs::Motor(k, motor_column::COULOMB) => over(&self.motors[k][1]),
            Belongs::Motor(..) => energies.change(c),
            Belongs::Nothing => 0.0,
        }
    }
}

/// Columns of the energy at the ends of a window, with the trapezoidal error of the work.
struct Energies<'a> {
    motion: &'a Motion,
    plan: &'a Plan<'a>,
    /// At three rows around an end.
    around: [Vec<f64>; 3],
    /// At the first and the last row.
    ends: [Vec<f64>; 2],
}

impl<'a> Energies<'a> {
    fn new(motion: &'a Motion, plan: &'a Plan<'a>) -> Self {
        let width = plan.chain.parameter_count() + motion.joints.len() * MOTOR_COLUMNS;
        Self {
            motion,
            plan,
            around: [(); 3].map(|()| vec![0.0; width]),
            ends: [(); 2].map(|()| vec![0.0; width]),
        }
    }

    /// Computes the columns at both ends of a window.
    fn look(&mut self, window: [usize; 2]) -> Result<(), PrepareError> {
        for (k, out) in window.into_iter().zip(&mut self.ends) {
            for (row, into) in (k - 1..).zip(&mut self.around) {
                energy(self.motion, self.plan, row, into)?;
            }
            for (c, out) in out.iter_mut().enumerate() {
                let [before, now, after] = &self.around;
                *out = as_trapezia_see([before[c], now[c], after[c]]);
            }
        }
        Ok(())
    }

    /// Returns the change of column `c` over the window.
    fn change(&self, c: usize) -> f64 {
        self.ends[1][c] - self.ends[0][c]
    }
}

/// Computes the columns of the energy at row `k`: those of the links, then those of the motors.
fn energy(motion: &Motion, plan: &Plan, k: usize, out: &mut [f64]) -> Result<(), PrepareError> {
    let q: Vec<f64> = motion.joints.iter().map(|j| j.q[k]).collect();
    let qd: Vec<f64> = motion.joints.iter().map(|j| j.qd[k]).collect();
    let (links, motors) = out.split_at_mut(plan.chain.parameter_count());
    energy_regressor(plan.chain, &q, &qd, links).map_err(failed)?;
    if !plan.transmission.is_simple() {
        plan.transmission
            .motor_energy_columns(&q, &qd, motors)
            .map_err(failed)?;
    }
    Ok(())
}

/// Returns per motor the work of its friction from the first row, for unit coefficients: viscous, Coulomb (with the
/// filtered sign, as for the torque). Empty without coupled drives.
fn motor_friction(
    motion: &Motion,
    plan: &Plan,
    low_pass: &LowPass,
) -> Result<Vec<[Vec<f64>; 2]>, PrepareError> {
    if plan.transmission.is_simple() {
        return Ok(Vec::new());
    }
    let (n, rows) = (motion.joints.len(), motion.t.len());
    let mut speeds = vec![vec![0.0; rows]; n];
    let mut powers = vec![vec![0.0; rows]; n];
    let (mut q, mut qd, mut now) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut power = vec![0.0; n * MOTOR_COLUMNS];
    for row in 0..rows {
        for (j, joint) in motion.joints.iter().enumerate() {
            (q[j], qd[j]) = (joint.q[row], joint.qd[row]);
        }
        plan.transmission
            .motor_speeds(&q, &qd, &mut now)
            .map_err(failed)?;
        plan.transmission
            .motor_power_columns(&q, &qd, &mut power)
            .map_err(failed)?;
        for k in 0..n {
            speeds[k][row] = now[k];
            powers[k][row] = power[k * MOTOR_COLUMNS + motor_column::VISCOUS];
        }
    }
    let dt = plan.treatment.dt();
    let of = |(speed, power): (&Vec<f64>, &Vec<f64>)| {
        let sign: Vec<f64> = speed.iter().map(|v| v.sgn()).collect();
        let sign = low_pass.zero_phase(&sign);
        [
            cumulative(rows, dt, &|k| power[k]),
            cumulative(rows, dt, &|k| sign[k] * speed[k]),
        ]
    };
    Ok(speeds.iter().zip(&powers).map(of).collect())
}
