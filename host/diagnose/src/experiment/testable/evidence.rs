//! Content of recordings, in figures.

use rig_data::runs::{JointRun, Run};
use rig_numerics::statistics;
use rig_numerics::svd::Svd;

/// Length of the windows for speeds, s: a low-pass of 20 Hz resolves it well.
const WINDOW: f64 = 0.1;
/// Parts of a window that must agree, so that a reversal does not count as slow motion.
const PARTS: usize = 4;

/// Mean motion over one window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// rad/s or m/s
    pub(crate) velocity: f64,
    /// Highest speed of its parts.
    pub(crate) fastest: f64,
    /// Mean torque without friction.
    pub(crate) load: f64,
}

/// Content of the recordings for one joint.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evidence {
    pub(crate) windows: Vec<Window>,
    /// Reversals of direction beyond the noise.
    pub(crate) reversals: u32,
    /// Lowest and highest position.
    pub(crate) range: [f64; 2],
    /// Longest recording, s.
    pub(crate) duration: f64,
    /// True if the voltage was recorded throughout.
    pub(crate) voltage: bool,
    /// Rise of the temperature, K; `None` if it was not recorded.
    pub(crate) warming: Option<f64>,
    /// True if torque was recorded.
    pub(crate) torque: bool,
}

fn noise(joint: &JointRun) -> f64 {
    let apart = joint.q.iter().zip(&joint.q_raw);
    let squares = apart.map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    (squares / joint.q.len().max(1) as f64).sqrt()
}

/// Counts reversals that are more than `least` apart.
fn reversals(q: &[f64], least: f64) -> u32 {
    let Some(&first) = q.first() else {
        return 0;
    };
    let (mut low, mut high, mut direction, mut count) = (first, first, 0i8, 0);
    for &v in q {
        (low, high) = (low.min(v), high.max(v));
        let turned = match direction {
            1 => high - v > least,
            -1 => v - low > least,
            _ => high - low > least,
        };
        if turned {
            let now = if direction == 0 {
                if v > first { 1 } else { -1 }
            } else {
                count += 1;
                -direction
            };
            direction = now;
            (low, high) = (v, v);
        }
    }
    count
}

/// Returns viscous and Coulomb friction by least squares, fitted with inertia, gravity and a constant.
fn friction(runs: &[&Run], joint: usize) -> [f64; 2] {
    let own = || runs.iter().filter_map(|run| run.joints.get(joint));
    let rows: usize = own().map(|j| j.tau.len()).sum();
    let step = (rows / 5000).max(1);
    let (mut inner, mut right) = (nalgebra::DMatrix::zeros(6, 6), nalgebra::DVector::zeros(6));
    for j in own() {
        for k in (0..j.tau.len().min(j.q.len())).step_by(step) {
            let (sine, cosine) = j.q[k].sin_cos();
            let sign = if j.qd[k] == 0.0 {
                0.0
            } else {
                j.qd[k].signum()
            };
            let row = nalgebra::DVector::from_vec(vec![j.qd[k], sign, j.qdd[k], cosine, sine, 1.0]);
            inner += &row * row.transpose();
            right += j.tau[k] * row;
        }
    }
    // With little motion, gravity and constant are collinear: the least-norm solution keeps both small.
    let cut = 1e-9 * inner.diagonal().max();
    let x = Svd::of(inner).solve(&right, cut);
    [x[0], x[1]]
}

impl Evidence {
    pub(crate) fn of(runs: &[Run], joint: usize) -> Self {
        let runs: Vec<&Run> = runs.iter().collect();
        let own = || {
            runs.iter()
                .filter_map(|run| Some((run, run.joints.get(joint)?)))
        };
        let torque = own().count() > 0 && own().all(|(_, j)| j.tau.len() == j.q.len());
        let [viscous, coulomb] = if torque {
            friction(&runs, joint)
        } else {
            [0.0; 2]
        };
        let mut found = Self {
            torque,
            range: [f64::INFINITY, f64::NEG_INFINITY],
            voltage: own().count() > 0 && own().all(|(_, j)| j.voltage.is_some()),
            ..Self::default()
        };
        let mut temperature: Option<[f64; 2]> = None;
        for (run, j) in own() {
            let length = ((WINDOW * run.rate / PARTS as f64).round() as usize).max(1);
            let least = (6.0 * noise(j)).max(2e-5);
            found.reversals += reversals(&j.q, least);
            for v in &j.q {
                found.range = [found.range[0].min(*v), found.range[1].max(*v)];
            }
            let whole = PARTS * length;
            let time = length as f64 / run.rate;
            for from in (0..j.q.len().saturating_sub(whole)).step_by(whole) {
                let part =
                    |k: usize| (j.q[from + (k + 1) * length] - j.q[from + k * length]) / time;
                let velocity = (j.q[from + whole] - j.q[from]) / (time * PARTS as f64);
                let load = if torque {
                    let mean = statistics::mean(&j.tau[from..from + whole]);
                    mean - viscous * velocity - coulomb * velocity.signum()
                } else {
                    0.0
                };
                found.windows.push(Window {
                    velocity,
                    fastest: (0..PARTS).map(|k| part(k).abs()).fold(0.0, f64::max),
                    load,
                });
            }
            for v in j.temperature.iter().flatten() {
                let [low, high] = temperature.unwrap_or([*v, *v]);
                temperature = Some([low.min(*v), high.max(*v)]);
            }
        }
        found.warming = temperature.map(|[low, high]| high - low);
        let ends = |number: usize| {
            let own = runs.iter().filter(|run| run.recording == number);
            let first = own
                .clone()
                .filter_map(|r| r.t.first().copied())
                .reduce(f64::min);
            // The last sample also lasts one period.
            let last = own
                .filter_map(|r| Some(r.t.last()? + 1.0 / r.rate))
                .reduce(f64::max);
            first.zip(last).map_or(0.0, |(a, b)| b - a)
        };
        let recordings = runs.iter().map(|r| r.recording + 1).max().unwrap_or(0);
        found.duration = (0..recordings).map(ends).fold(0.0, f64::max);
        found
    }

    /// Returns the time in steady motion below `speed`, without standstill, s.
    pub(crate) fn slow(&self, speed: f64) -> f64 {
        let slow = |w: &&Window| w.velocity.abs() > 0.02 * speed && w.fastest < 1.2 * speed;
        WINDOW * self.windows.iter().filter(slow).count() as f64
    }

    /// Returns the time above `speed`, s.
    pub(crate) fn fast(&self, speed: f64) -> f64 {
        let fast = |w: &&Window| w.velocity.abs() > speed;
        WINDOW * self.windows.iter().filter(fast).count() as f64
    }

    /// Returns the typical (median) and highest (99th percentile) speed in motion.
    pub(crate) fn speeds(&self) -> [f64; 2] {
        let mut all: Vec<f64> = self.windows.iter().map(|w| w.velocity.abs()).collect();
        all.sort_by(f64::total_cmp);
        let top = statistics::percentile(&all, 0.99);
        all.retain(|v| *v > 0.01 * top);
        [statistics::percentile(&all, 0.5), top]
    }

    /// Returns the travel below `speed`, rad or m.
    pub(crate) fn slow_way(&self, speed: f64) -> f64 {
        let slow = self.windows.iter().filter(|w| w.fastest < speed);
        slow.fold(0.0, |way, w| way + w.velocity.abs() * WINDOW)
    }

    /// Returns the range of the transmitted torque (5th to 95th percentile), and the mean of its magnitude.
    pub(crate) fn loads(&self) -> [f64; 2] {
        let mut all: Vec<f64> = self.windows.iter().map(|w| w.load).collect();
        let mean = all.iter().map(|v| v.abs()).sum::<f64>() / all.len().max(1) as f64;
        all.sort_by(f64::total_cmp);
        [
            statistics::percentile(&all, 0.95) - statistics::percentile(&all, 0.05),
            mean,
        ]
    }

    /// Returns true if the joint moves.
    pub(crate) fn moves(&self) -> bool {
        self.range[1] - self.range[0] > 1e-3
    }
}
