//! Lack-of-fit test of the accepted effects: a free function of a coordinate, added to the model, is tested on blocks
//! outside its fit.
//!
//! A substitute for an effect outside the library follows it over most of the motion, but not over all of it. A tilted
//! base explains a constant except for the difference of cos q and 1. The rest is small against the sample noise, but
//! repeats with the coordinate.
//!
//! Limit: of functions of two coordinates, only an inertia that depends on the position is tested. Functions collinear
//! with the effect are not found.

use crate::columns::effect_columns::Source;
use crate::fit::least_squares::Fit;
use crate::levels::SIGNIFICANT;
use crate::recordings::noise_floor;
use crate::rows::regression::{Column, Rows};
use rig_data::runs::JointRun;

/// Degree of the polynomials.
const DEGREE: usize = 5;
/// Harmonics per motor turn.
const HARMONICS: usize = 4;
/// Least RMS share that a function without sign or acceleration factor must remove, except a function of the speed …
const LEAST: f64 = 0.0075;
/// … and any other: real friction is not exactly constant plus linear, and acceleration is less well known.
const LEAST_OF_OTHERS: f64 = 0.02;
/// … and the least ratio of that share to its standard deviation.
const LEAST_SIGMAS: f64 = 1.5;

/// The coordinate of friction.
const SPEED: &str = "speed";

/// A free function that explains residual of the accepted effects.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Misfit {
    /// Its coordinate.
    pub(crate) coordinate: &'static str,
    /// Its factor.
    pub(crate) times: Times,
    /// Share of the joint's RMS that it removes on blocks outside its fit.
    pub(crate) gain: f64,
}

impl Misfit {
    /// Returns the mean square that it removes from a residual of the RMS `rms`.
    pub(crate) fn taken(&self, rms: f64) -> f64 {
        rms * rms * (1.0 - (1.0 - self.gain).powi(2)).max(0.0)
    }
}

/// Returns the free function with the largest gain on the residual of `joint`; None if the right effects could leave as
/// much.
pub(crate) fn misfit(source: &Source, rows: &Rows, fit: &Fit, joint: usize) -> Option<Misfit> {
    // The effects removed the part with the longest correlation.
    let residuals: Vec<Vec<f64>> = (0..rows.joints()).map(|j| fit.residual(j)).collect();
    let fit = fit.blocked_anew(noise_floor::memory(rows, &residuals));
    let families = families(source, joint);
    let trials = families.len();
    (families.into_iter())
        .filter_map(|family| {
            let own = fit.span(&family.columns(source, joint));
            if own.is_empty() {
                return None;
            }
            let open = vec![[f64::NEG_INFINITY, f64::INFINITY]; own.len()];
            let evidence = fit.evidence(&own, &open)?;
            // A function of the speed is friction, with or without a sign factor.
            let least = match family.times {
                Times::One if family.coordinate != SPEED => LEAST,
                _ => LEAST_OF_OTHERS,
            };
            let stands = evidence.corrected(trials) < SIGNIFICANT
                && evidence.joint_gain >= least
                && evidence.gain_sigmas >= LEAST_SIGMAS;
            stands.then_some(Misfit {
                coordinate: family.coordinate,
                times: family.times,
                gain: evidence.joint_gain,
            })
        })
        .max_by(|a, b| a.gain.total_cmp(&b.gain))
}

/// Factor of a free function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Times {
    /// None: a torque.
    One,
    /// Sign of the velocity: dry friction.
    Direction,
    /// Acceleration: an inertia.
    Acceleration,
}

/// Free functions of one coordinate.
struct Family {
    coordinate: &'static str,
    /// At the full rate, run by run.
    values: Vec<Vec<f64>>,
    times: Times,
    /// True if they repeat with every turn.
    periodic: bool,
}

impl Family {
    /// Returns the low-passed and decimated columns.
    fn columns(&self, source: &Source, joint: usize) -> Vec<Column> {
        let all = || self.values.iter().flatten();
        let low = all().copied().fold(f64::INFINITY, f64::min);
        let high = all().copied().fold(f64::NEG_INFINITY, f64::max);
        let width = (high - low).max(f64::MIN_POSITIVE);
        let count = if self.periodic {
            2 * HARMONICS
        } else {
            DEGREE + 1
        };
        let mut thin = vec![Vec::new(); count];
        for (r, (run, values)) in source.runs.iter().zip(&self.values).enumerate() {
            let mut functions = vec![Vec::with_capacity(values.len()); count];
            let own = &run.joints[joint];
            for (k, value) in values.iter().enumerate() {
                let factor = match self.times {
                    Times::One => 1.0,
                    Times::Direction => own.qd[k].signum(),
                    Times::Acceleration => own.qdd[k],
                };
                let at = if self.periodic {
                    waves(*value)
                } else {
                    polynomials(2.0 * (value - low) / width - 1.0)
                };
                for (function, x) in functions.iter_mut().zip(at) {
                    function.push(factor * x);
                }
            }
            let left_out = vec![source.left_out[r][joint].as_slice(); count];
            let rows = source.thinning.thinned_raw(&functions, &left_out);
            for (to, signal) in thin.iter_mut().zip(rows) {
                to.extend(signal);
            }
        }
        (thin.into_iter())
            .map(|values| {
                let mut column: Column = vec![None; source.nominal.joints()];
                column[joint] = Some(values);
                column
            })
            .collect()
    }
}

fn families(source: &Source, joint: usize) -> Vec<Family> {
    let ratio = source.robot.joints[joint].gear_ratio();
    let of = |signal: &dyn Fn(usize, &JointRun) -> Vec<f64>| -> Vec<Vec<f64>> {
        (source.runs.iter().enumerate())
            .map(|(r, run)| signal(r, &run.joints[joint]))
            .collect()
    };
    let family = |coordinate, times, values| Family {
        coordinate,
        values,
        times,
        periodic: false,
    };
    let position = || of(&|_, run| run.q.clone());
    let torque = of(&|r, _| source.predicted[r].torque[joint].clone());
    let load = of(&|r, _| source.predicted[r].load[joint].clone());
    let speed = || of(&|_, run| run.qd.iter().map(|v| v.abs()).collect());
    let mut list = vec![
        family("position", Times::One, position()),
        family("torque of the drive", Times::One, torque),
        family(SPEED, Times::One, speed()),
        family("position", Times::Direction, position()),
        family("torque on the gear", Times::Direction, load),
        family(SPEED, Times::Direction, speed()),
        family("position", Times::Acceleration, position()),
    ];
    if ratio.abs() > 1.0 {
        list.push(Family {
            periodic: true,
            ..family(
                "motor angle",
                Times::One,
                of(&|_, run| run.q.iter().map(|q| ratio * q).collect()),
            )
        });
    }
    list
}

fn waves(angle: f64) -> Vec<f64> {
    (1..=HARMONICS)
        .flat_map(|k| <[f64; 2]>::from((k as f64 * angle).sin_cos()))
        .collect()
}

/// Returns the Legendre polynomials from degree 0, between −1 and 1.
fn polynomials(x: f64) -> Vec<f64> {
    let mut list = vec![1.0, x];
    for n in 1..DEGREE {
        let m = n as f64;
        list.push(((2.0 * m + 1.0) * x * list[n] - m * list[n - 1]) / (m + 1.0));
    }
    list
}
