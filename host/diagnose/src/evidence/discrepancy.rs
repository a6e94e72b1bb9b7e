//! Model discrepancy: torque that depends on the motion in a way that no effect of the library has.
//!
//! Kennedy, O'Hagan 2001, J. R. Stat. Soc. B 63:425: measurement = model + discrepancy(motion) + noise. Here the
//! discrepancy of a joint is a sum of functions, each of one coordinate, piecewise linear between knots at quantiles of
//! the coordinate. A function may change its sign with the direction of motion.
//!
//! Left out: functions of two coordinates, and memory longer than the travel since the last reversal.

use rig_data::prepare::central_difference;
use rig_data::runs::Run;
use rig_model::robot::Robot;
use rig_numerics::statistics::mean_square;

use crate::acceptance::coordinates::{
    ACCELERATION, DRIVE, DRIVE_CHANGE, POSITION, SINCE_START, VELOCITY, WAY, since_reversal,
};
use crate::rows::nominal_torque::Predicted;
use crate::rows::thinning::Thinning;

/// Knots of a smooth function.
const KNOTS: usize = 10;
/// Knots of a function that may be steep near zero.
const STEEP_KNOTS: usize = 14;
/// Linear range of a steep coordinate, as a share of its 90 % quantile. Beyond it knots are spaced logarithmically.
const STEEP: f64 = 0.02;
/// Knots in time about a reversal, as shares of [`ABOUT`]; zero at both ends.
const REVERSAL: [f64; 13] = [
    -1.0, -0.6, -0.4, -0.25, -0.15, -0.07, 0.0, 0.07, 0.15, 0.25, 0.4, 0.6, 1.0,
];
/// Time about a reversal in which dry friction and filters act together, s.
const ABOUT: f64 = 0.16;
/// Harmonics of the motor angle.
const HARMONICS: usize = 4;
/// Samples per quantile estimate, at most.
const FOR_QUANTILES: usize = 20_000;

/// Coordinate of a discrepancy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Along {
    /// Nothing: a constant.
    Constant,
    /// Velocity.
    Velocity,
    /// Position.
    Position,
    /// Position, with the sign of the velocity.
    PositionByDirection,
    /// Acceleration.
    Acceleration,
    /// Size of the torque through the gear, with the sign of the velocity.
    LoadByDirection,
    /// Torque through the gear along the motion, with the sign of the velocity.
    LoadAlongMotion,
    /// Torque of the drive.
    Drive,
    /// Change of the torque of the drive.
    DriveChange,
    /// Travel since the last reversal, with the sign of the velocity.
    Travel,
    /// Time about a reversal, with the direction after it.
    Reversal,
    /// The same, about the slowest third of the reversals.
    SlowReversal,
    /// The same, about the fastest third.
    FastReversal,
    /// Time about a reversal, with the sign of the drive's torque.
    ReversalUnderLoad,
    /// Time since the start.
    Time,
    /// Time since the start, with the sign of the velocity.
    TimeByDirection,
    /// Time since the start, times the velocity.
    TimeTimesVelocity,
    /// Angle of the motor.
    MotorAngle,
    /// Derivatives of torque and acceleration: errors of the filters.
    Filters,
}

impl Along {
    /// All coordinates.
    pub(crate) const ALL: [Self; 19] = [
        Self::Constant,
        Self::Velocity,
        Self::Position,
        Self::PositionByDirection,
        Self::Acceleration,
        Self::LoadByDirection,
        Self::LoadAlongMotion,
        Self::Drive,
        Self::DriveChange,
        Self::Travel,
        Self::Reversal,
        Self::SlowReversal,
        Self::FastReversal,
        Self::ReversalUnderLoad,
        Self::Time,
        Self::TimeByDirection,
        Self::TimeTimesVelocity,
        Self::MotorAngle,
        Self::Filters,
    ];

    /// Returns true for a discrepancy about reversals, where friction and filters always leave something.
    pub(crate) fn is_about_reversals(self) -> bool {
        matches!(
            self,
            Self::Reversal | Self::SlowReversal | Self::FastReversal | Self::ReversalUnderLoad
        )
    }

    /// Returns the coordinate in words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Constant => "nothing: a constant",
            Self::Velocity => VELOCITY,
            Self::Position => POSITION,
            Self::PositionByDirection => "position, by direction",
            Self::Acceleration => ACCELERATION,
            Self::LoadByDirection => "size of the torque on the gear, by direction",
            Self::LoadAlongMotion => "torque on the gear along the motion, by direction",
            Self::Drive => DRIVE,
            Self::DriveChange => DRIVE_CHANGE,
            Self::Travel => WAY,
            Self::Reversal => "time about a reversal",
            Self::SlowReversal => "time about a slow reversal",
            Self::FastReversal => "time about a fast reversal",
            Self::ReversalUnderLoad => "time about a reversal, by the drive's torque",
            Self::Time => "time since the start",
            Self::TimeByDirection => SINCE_START,
            Self::TimeTimesVelocity => "time since the start, times the velocity",
            Self::MotorAngle => "motor angle within a turn",
            Self::Filters => "derivatives of torque and acceleration",
        }
    }
}

/// A coordinate of one run and the factor of its function.
struct Signal {
    coordinate: Vec<f64>,
    factor: Vec<f64>,
}

/// Signed time to the nearest reversal, direction after it, and acceleration at it.
struct Reversals {
    away: Vec<f64>,
    after: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Reversals {
    fn of(run: &Run, joint: usize) -> Self {
        let (v, a) = (&run.joints[joint].qd, &run.joints[joint].qdd);
        let n = v.len();
        let mut list: Vec<(f64, f64, f64)> = Vec::new();
        for k in 1..n {
            if v[k - 1] * v[k] < 0.0 {
                let at = k as f64 - 1.0 + v[k - 1] / (v[k - 1] - v[k]);
                list.push((at, v[k].signum(), a[k].abs().max(a[k - 1].abs())));
            }
        }
        let mut own = Self {
            away: vec![f64::INFINITY; n],
            after: vec![0.0; n],
            acceleration: vec![1.0; n],
        };
        let mut next = 0;
        for k in 0..n {
            let at = k as f64;
            while next + 1 < list.len() && (list[next + 1].0 - at).abs() < (list[next].0 - at).abs()
            {
                next += 1;
            }
            if let Some(&(when, sign, acceleration)) = list.get(next) {
                own.away[k] = (at - when) / run.rate;
                own.after[k] = sign;
                own.acceleration[k] = acceleration;
            }
        }
        own
    }

    /// Returns the direction after the reversals; zero about those that do not count along this coordinate.
    fn after_some(&self, along: Along) -> Vec<f64> {
        let mut all = self.acceleration.clone();
        all.dedup();
        all.sort_by(f64::total_cmp);
        let third = |k: usize| {
            all.get(k * all.len().saturating_sub(1) / 3)
                .copied()
                .unwrap_or(0.0)
        };
        let [low, high] = [1, 2].map(third);
        let counts = |a: f64| match along {
            Along::SlowReversal => a <= low,
            Along::FastReversal => a >= high,
            _ => true,
        };
        (self.after.iter().zip(&self.acceleration))
            .map(|(sign, a)| if counts(*a) { *sign } else { 0.0 })
            .collect()
    }
}

fn signal(along: Along, run: &Run, predicted: &Predicted, joint: usize, ratio: f64) -> Signal {
    let j = &run.joints[joint];
    let n = j.q.len();
    let ones = || vec![1.0; n];
    let direction = || j.qd.iter().map(|v| v.signum()).collect::<Vec<f64>>();
    let since = || run.t.iter().map(|t| t - run.began).collect::<Vec<f64>>();
    let load = &predicted.load[joint];
    let of = |coordinate: Vec<f64>, factor: Vec<f64>| Signal { coordinate, factor };
    match along {
        Along::Constant => of(ones(), ones()),
        Along::Velocity => of(j.qd.clone(), ones()),
        Along::Position => of(j.q.clone(), ones()),
        Along::PositionByDirection => of(j.q.clone(), direction()),
        Along::Acceleration => of(j.qdd.clone(), ones()),
        Along::LoadByDirection => of(load.iter().map(|l| l.abs()).collect(), direction()),
        Along::LoadAlongMotion => {
            let along = load.iter().zip(&j.qd).map(|(l, v)| l * v.signum());
            of(along.collect(), direction())
        }
        Along::Drive => of(predicted.torque[joint].clone(), ones()),
        Along::DriveChange => of(
            central_difference(&predicted.torque[joint], 1.0 / run.rate),
            ones(),
        ),
        Along::Travel => of(since_reversal(run, joint).0, ones()),
        Along::Reversal | Along::SlowReversal | Along::FastReversal => {
            let own = Reversals::of(run, joint);
            let factor = own.after_some(along);
            of(own.away, factor)
        }
        Along::ReversalUnderLoad => {
            let torque = predicted.torque[joint].iter().map(|t| t.signum());
            of(Reversals::of(run, joint).away, torque.collect())
        }
        Along::Time => of(since(), ones()),
        Along::TimeByDirection => of(since(), direction()),
        Along::TimeTimesVelocity => of(since(), j.qd.clone()),
        Along::Filters => of(Vec::new(), Vec::new()),
        Along::MotorAngle => of(j.q.iter().map(|q| ratio * q).collect(), ones()),
    }
}

/// Knots at quantiles of a coordinate.
fn knots(values: &mut [f64], count: usize) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let mut knots: Vec<f64> = (0..count)
        .map(|k| values[(k * last + (count - 1) / 2) / (count - 1).max(1)])
        .collect();
    knots.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * (a.abs() + b.abs()));
    knots
}

/// Value of the hat function of a knot: 1 there, 0 at the others.
fn hat(knots: &[f64], k: usize, x: f64) -> f64 {
    let at = knots[k];
    if x < at {
        match k.checked_sub(1) {
            None => 1.0,
            Some(before) => ((x - knots[before]) / (at - knots[before])).max(0.0),
        }
    } else {
        match knots.get(k + 1) {
            None => 1.0,
            Some(after) => ((after - x) / (after - at)).max(0.0),
        }
    }
}

/// Functions of one coordinate.
enum Functions {
    /// A hat at each knot, constant beyond the ends.
    Hats(Vec<f64>),
    /// A hat at each knot but the ends, zero beyond them.
    Pulses(Vec<f64>),
    /// Cosine and sine of multiples of an angle.
    Harmonics(usize),
}

impl Functions {
    fn count(&self) -> usize {
        match self {
            Self::Hats(knots) => knots.len(),
            Self::Pulses(knots) => knots.len() - 2,
            Self::Harmonics(count) => 2 * count,
        }
    }

    fn value(&self, k: usize, x: f64) -> f64 {
        match self {
            Self::Hats(knots) => hat(knots, k, x),
            Self::Pulses(knots) if x > knots[0] && x < knots[knots.len() - 1] => {
                hat(knots, k + 1, x)
            }
            Self::Pulses(_) => 0.0,
            Self::Harmonics(_) => {
                let angle = (k / 2 + 1) as f64 * x;
                if k.is_multiple_of(2) {
                    angle.cos()
                } else {
                    angle.sin()
                }
            }
        }
    }
}

/// Bends a coordinate that may be steep near zero: linear up to [`STEEP`], logarithmic beyond.
fn bend(sample: &mut [f64], signals: &mut [Signal]) {
    let mut sizes: Vec<f64> = sample.iter().map(|x| x.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let scale = STEEP * sizes[sizes.len() * 9 / 10].max(f64::MIN_POSITIVE);
    let bent = |x: &mut f64| *x = x.signum() * (x.abs() / scale).ln_1p();
    sample.iter_mut().for_each(bent);
    (signals.iter_mut())
        .flat_map(|s| &mut s.coordinate)
        .for_each(bent);
}

/// Motion and predictions of a joint, from which a discrepancy is formed.
pub(crate) struct Motion<'m> {
    /// The recordings.
    pub(crate) runs: &'m [Run],
    /// Predictions of the nominal model, run by run.
    pub(crate) predicted: &'m [Predicted],
    /// The robot.
    pub(crate) robot: &'m Robot,
    /// Filter and decimation.
    pub(crate) thinning: &'m Thinning,
    /// Samples that the rows leave out, run by run and joint by joint.
    pub(crate) left_out: &'m [Vec<Vec<bool>>],
    /// The joint.
    pub(crate) joint: usize,
    /// True for used rows.
    pub(crate) keep: &'m [bool],
}

impl Motion<'_> {
    /// Returns the columns of the discrepancy along one coordinate, on the rows. Their squares have mean sum one over
    /// the used rows. Empty if the joint has no such coordinate, or no used row shows it: all samples about the slowest
    /// reversals may be left out.
    pub(crate) fn columns(&self, along: Along) -> Vec<Vec<f64>> {
        let ratio = self.robot.joints[self.joint].gear_ratio();
        if along == Along::MotorAngle && ratio.abs() <= 1.0 {
            return Vec::new();
        }
        let full =
            |run: &Run, predicted: &Predicted| signal(along, run, predicted, self.joint, ratio);
        let mut columns = match along {
            Along::Filters => {
                self.thinned(4, &mut |run, predicted| self.of_filters(run, predicted))
            }
            _ => {
                let pairs = self.runs.iter().zip(self.predicted);
                let mut signals: Vec<Signal> = pairs.map(|(r, p)| full(r, p)).collect();
                let Some(functions) = functions(along, &mut signals) else {
                    return Vec::new();
                };
                let mut next = signals.iter();
                self.thinned(functions.count(), &mut |_, _| {
                    let signal = next.next().into_iter();
                    signal
                        .flat_map(|signal| along_signal(signal, &functions))
                        .collect()
                })
            }
        };
        let used = self.keep.iter().filter(|k| **k).count().max(1) as f64;
        let squares: f64 = columns.iter().map(|c| squares_of_kept(c, self.keep)).sum();
        let scale = (used / squares).sqrt();
        if !scale.is_finite() {
            return Vec::new();
        }
        columns.iter_mut().flatten().for_each(|x| *x *= scale);
        columns
    }

    /// Returns the rows of `count` signals of each run.
    fn thinned(
        &self,
        count: usize,
        signals: &mut dyn FnMut(&Run, &Predicted) -> Vec<Vec<f64>>,
    ) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::new(); count];
        let runs = self.runs.iter().zip(self.predicted).zip(self.left_out);
        for ((run, predicted), left_out) in runs {
            let left_out = vec![left_out[self.joint].as_slice(); count];
            let rows = (self.thinning).thinned_raw(&signals(run, predicted), &left_out);
            columns
                .iter_mut()
                .zip(rows)
                .for_each(|(to, rows)| to.extend(rows));
        }
        columns
    }

    /// Returns the second and third derivatives of torque and acceleration, each of unit size over a run.
    fn of_filters(&self, run: &Run, predicted: &Predicted) -> Vec<Vec<f64>> {
        let step = 1.0 / run.rate;
        let mut full = Vec::new();
        for signal in [&predicted.torque[self.joint], &run.joints[self.joint].qdd] {
            let second = central_difference(&central_difference(signal, step), step);
            let third = central_difference(&second, step);
            full.extend([second, third]);
        }
        for signal in &mut full {
            // The low-pass takes most of a derivative: the size that counts is the one behind it.
            let left = self.thinning.smooth(signal);
            let size = mean_square(&left).sqrt().max(f64::MIN_POSITIVE);
            signal.iter_mut().for_each(|x| *x /= size);
        }
        full
    }
}

fn squares_of_kept(column: &[f64], keep: &[bool]) -> f64 {
    (column.iter().zip(keep))
        .filter(|(_, keep)| **keep)
        .map(|(x, _)| x * x)
        .sum()
}

/// Returns each function along a signal.
fn along_signal(signal: &Signal, functions: &Functions) -> Vec<Vec<f64>> {
    (0..functions.count())
        .map(|k| {
            (signal.coordinate.iter().zip(&signal.factor))
                .map(|(x, factor)| functions.value(k, *x) * factor)
                .collect()
        })
        .collect()
}

/// Returns the functions of a coordinate. Bends a steep one. None if it has no finite value.
fn functions(along: Along, signals: &mut [Signal]) -> Option<Functions> {
    if along == Along::MotorAngle {
        return Some(Functions::Harmonics(HARMONICS));
    }
    if along.is_about_reversals() {
        return Some(Functions::Pulses(
            REVERSAL.iter().map(|k| k * ABOUT).collect(),
        ));
    }
    let count: usize = signals.iter().map(|s| s.coordinate.len()).sum();
    let mut sample: Vec<f64> = (signals.iter().flat_map(|s| &s.coordinate))
        .step_by(count / FOR_QUANTILES + 1)
        .copied()
        .filter(|x| x.is_finite())
        .collect();
    if sample.is_empty() {
        return None;
    }
    if matches!(along, Along::Velocity | Along::Travel) {
        bend(&mut sample, signals);
        return Some(Functions::Hats(knots(&mut sample, STEEP_KNOTS)));
    }
    Some(Functions::Hats(knots(&mut sample, KNOTS)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hat_functions_sum_to_one_and_reproduce_straight_lines() {
        let knots = [-2.0, -0.5, 0.0, 1.0, 4.0];
        for x in [-2.0, -1.3, -0.2, 0.0, 0.7, 3.9, 4.0] {
            let hats: Vec<f64> = (0..knots.len()).map(|k| hat(&knots, k, x)).collect();
            assert!((hats.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{x}");
            let line: f64 = hats.iter().zip(knots).map(|(h, k)| h * k).sum();
            assert!((line - x).abs() < 1e-12, "{x}");
        }
        // Constant beyond the ends.
        assert_eq!(hat(&knots, 0, -9.0), 1.0);
        assert_eq!(hat(&knots, 4, 9.0), 1.0);
    }

    #[test]
    fn knots_are_quantiles_without_equal_ones() {
        let mut values: Vec<f64> = (0..1000).map(|k| f64::from(k % 10 / 5)).collect();
        assert_eq!(knots(&mut values, KNOTS), [0.0, 1.0]);
        let mut values: Vec<f64> = (0..=90).map(f64::from).collect();
        assert_eq!(
            knots(&mut values, 10),
            (0..10).map(|k| 10.0 * f64::from(k)).collect::<Vec<_>>()
        );
    }
}
