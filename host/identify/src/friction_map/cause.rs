//! What may be wrong with a sweep, compared by how well each explains its torque.
//!
//! Friction and inertia of the joint are known from the identification. A torque by another scale is a multiple of all of
//! them. A position by another scale changes viscous friction and inertia alike, and leaves dry friction. A torque that
//! lost its sign has their size. Friction itself changes with the temperature, inertia does not: a scale must show in
//! both, or be larger than friction changes.
//!
//! Leaves out: a position by another scale where gravity loads the joint, which gravity shows within the passes.

use nalgebra::{DMatrix, DVector};

use super::rows::Rows;
use rig_output::{format_significant, format_trimmed};

/// Share of the highest speed above which a row is used; below it the friction model is wrong.
const IN_MOTION: f64 = 0.05;
/// Most rows in a comparison; more only take more time.
const MOST: usize = 20_000;
/// Largest residual variance of a cause, as a share of that without a fault and of the torque's.
const BETTER: f64 = 0.2;
/// Least scale, as a factor of one or its inverse. The smallest mistake of a unit or a ratio is 1.3.
const LEAST: f64 = 1.25;
/// Scale beyond any change of friction by temperature or lubrication, as a factor of one or its inverse.
const BEYOND_FRICTION: f64 = 3.0;
/// Number of blocks that are left out in turn for the standard deviation of the inertia.
const BLOCKS: usize = 20;
/// Number of standard deviations by which a value must exceed its limit.
const CLEAR: f64 = 3.0;
/// Relative difference of two scales that are the same.
const SAME: f64 = 0.15;
/// Largest share of the torque on the other side of zero, if its sign was lost: noise about zero.
const OTHER_SIDE: f64 = 0.02;

/// What is wrong with a sweep.
enum What {
    /// A torque that is a multiple of the joint's.
    Torque(f64),
    /// A position that fits if multiplied by a factor.
    Position(f64),
    /// A torque without its sign.
    Magnitude,
}

/// An explanation of a sweep's torque.
pub(super) struct Cause {
    what: What,
    /// Share of the torque's variance that it leaves.
    pub(super) left: f64,
    /// The same as recorded.
    recorded: f64,
}

/// Torques of the joint in the rows in motion.
struct Parts {
    tau: Vec<f64>,
    sense: Vec<f64>,
    speed: Vec<f64>,
    /// Dry friction.
    dry: Vec<f64>,
    /// Viscous friction and inertia.
    moved: Vec<f64>,
    inertial: Vec<f64>,
    weight: Vec<f64>,
}

impl Parts {
    fn of(rows: &Rows, [viscous, coulomb]: [f64; 2]) -> Self {
        let fastest = rows.speed.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let used: Vec<usize> = (0..rows.tau.len())
            .filter(|k| rows.speed[*k].abs() > IN_MOTION * fastest && !rows.saturated[*k])
            .collect();
        let thin = used.len().div_ceil(MOST).max(1);
        let used: Vec<usize> = used.into_iter().step_by(thin).collect();
        let each = |of: &dyn Fn(usize) -> f64| used.iter().map(|k| of(*k)).collect::<Vec<f64>>();
        let inertial = |k: usize| rows.model[k] - rows.weight[k];
        Self {
            tau: each(&|k| rows.tau[k]),
            sense: each(&|k| rows.speed[k].signum()),
            speed: each(&|k| rows.speed[k]),
            dry: each(&|k| coulomb * rows.speed[k].signum()),
            moved: each(&|k| viscous * rows.speed[k] + inertial(k)),
            inertial: each(&inertial),
            weight: each(&|k| rows.weight[k]),
        }
    }

    fn len(&self) -> usize {
        self.tau.len()
    }

    fn whole(&self) -> Vec<f64> {
        (0..self.len())
            .map(|k| self.dry[k] + self.moved[k] + self.weight[k])
            .collect()
    }

    /// Returns the inertia over that of the identification, and its standard deviation, beside free friction; `None` if
    /// the sweep does not show it.
    fn inertia(&self) -> Option<[f64; 2]> {
        let columns = [&self.inertial, &self.sense, &self.speed, &self.weight];
        let width = columns.len() + 1;
        let fit = |without: Option<usize>| -> Option<f64> {
            let block = |k: usize| k * BLOCKS / self.len();
            let rows: Vec<usize> = (0..self.len())
                .filter(|k| without != Some(block(*k)))
                .collect();
            let x = DMatrix::from_fn(rows.len(), width, |r, c| {
                columns.get(c).map_or(1.0, |column| column[rows[r]])
            });
            let y = DVector::from_iterator(rows.len(), rows.iter().map(|k| self.tau[*k]));
            let mut normal = x.tr_mul(&x);
            // A joint without gravity has a weight that repeats the constant.
            let ridge = 1e-9 * normal.diagonal().max();
            for k in 0..width {
                normal[(k, k)] += ridge;
            }
            Some(normal.cholesky()?.solve(&x.tr_mul(&y))[0])
        };
        let value = fit(None)?;
        let all: Option<Vec<f64>> = (0..BLOCKS).map(|block| fit(Some(block))).collect();
        let squares: f64 = all?.iter().map(|own| (own - value).powi(2)).sum();
        let std = (squares * (BLOCKS as f64 - 1.0) / BLOCKS as f64).sqrt();
        Some([value, std]).filter(|[value, std]| value.is_finite() && std.is_finite())
    }
}

/// Returns slope and residual squares of `y` over `x` with a free constant.
fn line(x: &[f64], y: &[f64]) -> [f64; 2] {
    let [mx, my] = [x, y].map(rig_numerics::statistics::mean);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        let (x, y) = (x - mx, y - my);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    let slope = xy / xx;
    [slope, (yy - slope * xy).max(0.0)]
}

/// Returns the distance of a scale from another, as a factor of at least one.
fn apart(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    match ratio > 0.0 {
        true => ratio.max(1.0 / ratio),
        false => f64::INFINITY,
    }
}

impl Rows {
    /// Returns the cause that explains the torque best, if one explains it far better than none. `friction` is the
    /// identified viscous and Coulomb friction; `loaded` is true if gravity can load the joint.
    pub(super) fn cause(&self, friction: [f64; 2], loaded: bool) -> Option<Cause> {
        let parts = Parts::of(self, friction);
        if parts.len() < 10 * BLOCKS {
            return None;
        }
        let whole = parts.whole();
        let variance = rig_numerics::statistics::squares_about_mean(&parts.tau);
        let rest: Vec<f64> = (whole.iter().zip(&parts.tau)).map(|(w, t)| t - w).collect();
        let recorded = rig_numerics::statistics::squares_about_mean(&rest);
        let inertia = parts.inertia();
        let shown = |scale: f64| {
            let by_inertia = inertia.is_some_and(|[value, std]| {
                (value - 1.0).abs() > CLEAR * std
                    && (value - scale).abs() < CLEAR * std + SAME * scale.abs()
            });
            apart(scale, 1.0) > LEAST && (by_inertia || apart(scale, 1.0) > BEYOND_FRICTION)
        };
        let mut all = Vec::new();
        let [scale, squares] = line(&whole, &parts.tau);
        if scale > 0.0 && shown(scale) {
            all.push((What::Torque(scale), squares));
        }
        if !loaded {
            let undamped: Vec<f64> = (parts.tau.iter().zip(&parts.dry))
                .map(|(tau, dry)| tau - dry)
                .collect();
            let [scale, squares] = line(&parts.moved, &undamped);
            if scale > 0.0 && shown(scale) {
                all.push((What::Position(scale), squares));
            }
        }
        if let Some(squares) = magnitude(&whole, &parts.tau) {
            all.push((What::Magnitude, squares));
        }
        let (what, squares) = all.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        (squares < BETTER * recorded.min(variance)).then(|| Cause {
            what,
            left: squares / variance,
            recorded: recorded / variance,
        })
    }
}

/// Returns the residual squares of the sizes of torques, if the torque has one sense where the model has two.
fn magnitude(whole: &[f64], tau: &[f64]) -> Option<f64> {
    let sides = |values: &[f64]| {
        let of = |sense: f64| values.iter().map(|v| (sense * v).max(0.0)).sum::<f64>();
        let (above, below) = (of(1.0), of(-1.0));
        above.min(below) / (above + below)
    };
    let lost = sides(tau) < OTHER_SIDE.min(0.3 * sides(whole));
    let squares = || {
        whole
            .iter()
            .zip(tau)
            .map(|(w, t)| (t.abs() - w.abs()).powi(2))
    };
    lost.then(|| squares().sum())
}

/// Returns the name of the nearest factor of a position, and what mends it.
fn name_of(factor: f64, ratio: f64) -> &'static str {
    const TWICE: &str =
        "it is twice what it should be; check the gear ratio and the counts of the encoder";
    const HALF: &str =
        "it is half what it should be; check the gear ratio and the counts of the encoder";
    const MOTOR: &str = "it looks like the angle of the motor; divide it by the gear ratio";
    let mut names = vec![
        (std::f64::consts::TAU, "it looks like turns; give it in rad"),
        (1.0 / 57.296, "it looks like degrees; give it in rad"),
        (0.5, TWICE),
        (2.0, HALF),
    ];
    if ratio > 1.0 {
        names.push((1.0 / ratio, MOTOR));
    }
    let nearest =
        (names.into_iter()).min_by(|a, b| apart(factor, a.0).total_cmp(&apart(factor, b.0)));
    match nearest {
        Some((named, name)) if apart(factor, named) < 1.0 + SAME => name,
        _ => "check its unit, the gear ratio and the counts of the encoder",
    }
}

impl Cause {
    /// Says what is wrong. `ratio` is the joint's gear ratio.
    pub(super) fn told(&self, sweep: &str, joint: &str, n: usize, ratio: f64) -> String {
        let share = |share: f64| format_significant(100.0 * share, 2);
        let compared = format!(
            "{} % of the variance of tau{n}, as recorded {} %",
            share(self.left),
            share(self.recorded)
        );
        match self.what {
            What::Torque(scale) => format!(
                "{sweep}: tau{n} is {} times what friction and inertia of joint {joint} that --data gives need (this leaves {compared}). One of both recordings has another unit or scale of tau{n}: check unit, gear ratio and torque constant.",
                format_significant(scale, 3)
            ),
            What::Position(factor) => format!(
                "{sweep}: q{n} fits friction and inertia of joint {joint} that --data gives if multiplied by {} (this leaves {compared}): {}.",
                format_trimmed(factor, 3),
                name_of(factor, ratio.abs())
            ),
            What::Magnitude => format!(
                "{sweep}: tau{n} is a magnitude whose sign was lost: its size is that of the torque of joint {joint} that --data gives (this leaves {compared}). Record the signed torque or current."
            ),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Passes of both directions with ramps between them, of a joint with this viscous and Coulomb friction and inertia.
    /// `warm` is a share of viscous friction; `change` is applied to the torque and its motion, by factors.
    fn sweep(
        [viscous, coulomb, inertia]: [f64; 3],
        [warm, torque, position]: [f64; 3],
        seed: u64,
    ) -> Rows {
        let mut g = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut noise = move || 0.01 * ((0..12).map(|_| g.random::<f64>()).sum::<f64>() - 6.0);
        let mut rows = Rows::default();
        for pass in 0..24 {
            let top = 2.0 * f64::from(pass / 2 + 1) / 12.0 * if pass % 2 == 0 { 1.0 } else { -1.0 };
            for k in 0..500 {
                let at = f64::from(k) / 500.0;
                let (speed, acceleration) = match at {
                    a if a < 0.1 => (top * 10.0 * a, 10.0 * top),
                    a if a > 0.9 => (top * 10.0 * (1.0 - a), -10.0 * top),
                    _ => (top, 0.0),
                };
                let dry = coulomb * speed.signum();
                let tau = warm * viscous * speed + dry + inertia * acceleration + noise();
                // The model sees the recorded motion.
                let (speed, acceleration) = (position * speed, position * acceleration);
                let model = inertia * acceleration;
                rows.speed.push(speed);
                rows.tau.push(torque * tau);
                rows.model.push(model);
                rows.whole.push(model + viscous * speed + dry);
                rows.weight.push(0.0);
                rows.saturated.push(false);
                rows.unsettled.push(false);
            }
        }
        rows
    }

    const JOINTS: [[f64; 3]; 3] = [[0.8, 1.0, 0.3], [6.0, 4.0, 1.2], [0.3, 0.5, 0.1]];

    fn said(rows: &Rows, [viscous, coulomb, _]: [f64; 3]) -> Option<String> {
        let cause = rows.cause([viscous, coulomb], false)?;
        Some(cause.told("sweep.csv", "pan", 1, 50.0))
    }

    #[test]
    fn a_sound_sweep_and_a_warm_joint_are_not_doubted() {
        for (seed, own) in (1..).zip(JOINTS) {
            for warm in [1.0, 0.6, 0.5, 1.6] {
                assert_eq!(
                    said(&sweep(own, [warm, 1.0, 1.0], seed), own),
                    None,
                    "{warm}"
                );
            }
        }
    }

    #[test]
    fn a_scale_of_torque_or_position_is_named_without_gravity() {
        for (seed, own) in (1..).zip(JOINTS) {
            for (torque, position, words) in [
                (0.5, 1.0, "tau1 is 0.5"),
                (1000.0, 1.0, "tau1 is 1000 times"),
                (1.0, 1.0 / std::f64::consts::TAU, "it looks like turns"),
                (1.0, 0.5, "it is half what it should be"),
                (1.0, 2.0, "it is twice what it should be"),
                (1.0, 50.0, "the angle of the motor"),
            ] {
                let told = said(&sweep(own, [1.0, torque, position], seed), own).unwrap();
                assert!(told.contains(words), "{words}: {told}");
            }
        }
    }

    #[test]
    fn a_lost_sign_is_named_without_gravity() {
        for (seed, own) in (1..).zip(JOINTS) {
            let mut rows = sweep(own, [1.0; 3], seed);
            rows.tau.iter_mut().for_each(|tau| *tau = tau.abs());
            let told = said(&rows, own).unwrap();
            assert!(told.contains("whose sign was lost"), "{told}");
        }
    }
}
