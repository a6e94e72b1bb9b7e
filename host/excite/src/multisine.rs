//! A periodic sum of many sines that moves one joint, for its frequency response.
//!
//! q(t) = Σ A_k·cos(2πk·t/T + φ_k) over odd harmonics k of the period T within a band, with random phases (Pintelon & Schoukens
//! 2012, ch. 4 and 5). Of every four odd harmonics one, drawn at random, is left out: distortion of odd order shows there,
//! distortion of even order at the even harmonics. A_k ∝ 1/√(k·(1 + (ω/ωv)² + (ω/ωa)⁴)), ωv = v/D, ωa² = a/D for the distance D,
//! the velocity v and the acceleration a: as much per octave as a logarithmic chirp. Of several draws of the phases that counts
//! which uses the limits least for its size, which lowers the crest factor.
//!
//! A rise from rest, a period in which the joint settles, whole periods, and a fall to rest.
//!
//! Leaves out: phases optimised beyond the draws; joints that move together.

use core::f64::consts::TAU;

use rand::RngExt as _;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use crate::instants::Instants;
use crate::stages::{ATTEMPTS, Prepared, SHARE, SLOWER, StagedOptions};
use crate::{ExciteError, SampledReference};
use rig_model::robot::Robot;
use rig_numerics::statistics::rms;

/// Draws of the phases.
const DRAWS: usize = 64;
/// Neighbouring odd harmonics of which one is left out.
const GROUP: usize = 4;
/// Points of the synthesis per period of the fastest harmonic, at least. Between N points per period a sum of sines is at
/// most 1/cos(π/N) times its largest point (Ehlich & Zeller 1964): 2 % for 16.
const POINTS: f64 = 16.0;
/// Periods of the slowest frequency in the default period.
const SLOWEST: f64 = 16.0;
/// Default length of rise and fall, periods of the slowest frequency.
const RAMP: f64 = 2.0;
/// Default number of whole periods after the one in which the joint settles.
const PERIODS: u16 = 4;
/// Fewest harmonics.
const FEWEST: usize = 8;
/// Most rows of a motion.
const MOST_ROWS: f64 = 2e7;

/// User options of a multisine; absent ones follow from the limits.
#[derive(Clone, Debug, PartialEq)]
pub struct MultisineOptions {
    /// The joint, its start, the limits and the band, as for other motions of one joint.
    pub staged: StagedOptions,
    /// Period, s: 16 periods of the lowest frequency if absent.
    pub period: Option<f64>,
    /// Whole periods after the one in which the joint settles.
    pub periods: Option<u16>,
    /// Length of rise and fall, s.
    pub ramp: Option<f64>,
    /// Seed of phases and of the harmonics that are left out.
    pub seed: u64,
    /// Rows per second.
    pub rate: f64,
}

/// A designed multisine.
#[derive(Clone, Debug, PartialEq)]
pub struct Multisine {
    /// The motion of all joints.
    pub reference: SampledReference,
    /// Period, s: a whole number of rows.
    pub period: f64,
    /// Whole periods, that of settling included.
    pub periods: u16,
    /// Lowest and highest harmonic, Hz.
    pub band: [f64; 2],
    /// Number of harmonics.
    pub harmonics: usize,
    /// Largest position, velocity and acceleration over the RMS value, in the periods.
    pub crest: [f64; 3],
    /// Largest share of the position range, of the velocity limit and of the acceleration limit, of the joint that moves.
    pub shares: [f64; 3],
    /// Remarks for the user.
    pub notes: Vec<String>,
}

impl Multisine {
    /// Length, s.
    pub fn duration(&self) -> f64 {
        let rows = self.reference.position.first().map_or(0, Vec::len);
        rows.saturating_sub(1) as f64 * self.reference.period
    }
}

/// Rows of a multisine.
#[derive(Clone, Copy, Debug)]
struct Layout {
    rate: f64,
    /// Rows of a period.
    period: usize,
    /// Rows of rise and fall.
    ramp: usize,
    /// Whole periods.
    periods: usize,
}

impl Layout {
    fn of(options: &MultisineOptions, [low, high]: [f64; 2]) -> Result<Self, ExciteError> {
        let wrong = |name, value: f64, right: String| ExciteError::Option {
            name,
            value: format!("{value} s"),
            right,
        };
        let rate = options.rate;
        if !(1.0..=1e6).contains(&rate) {
            return Err(ExciteError::Option {
                name: "rate",
                value: format!("{rate} Hz"),
                right: "it must be between 1 and 1000000 Hz".into(),
            });
        }
        if 2.0 * high >= rate {
            return Err(ExciteError::Option {
                name: "band",
                value: format!("{low},{high} Hz"),
                right: format!("it needs more than {} samples a second", 2.0 * high),
            });
        }
        let seconds = options.period.unwrap_or(SLOWEST / low);
        let period = (seconds * rate).round();
        if !(period >= 2.0 && seconds * low >= 1.0) {
            return Err(wrong(
                "period",
                seconds,
                format!("it must hold at least one period of the lowest frequency, {low} Hz"),
            ));
        }
        if options.period.is_some() && (seconds * rate - period).abs() > 1e-6 {
            return Err(wrong(
                "period",
                seconds,
                format!(
                    "it must be a whole number of samples at {rate} samples a second, such as {} s",
                    period / rate
                ),
            ));
        }
        let ramp = options.ramp.unwrap_or(RAMP / low);
        if !(ramp > 0.0 && ramp.is_finite()) {
            return Err(wrong("ramp", ramp, "it must be above 0 s".into()));
        }
        let periods = options.periods.unwrap_or(PERIODS);
        if periods < 2 {
            return Err(ExciteError::Option {
                name: "number of periods",
                value: periods.to_string(),
                right: "two at least show the noise by their difference".into(),
            });
        }
        let ramp = (ramp * rate).round().max(1.0);
        if 2.0 * ramp + period * f64::from(periods + 1) > MOST_ROWS {
            return Err(wrong(
                "period",
                seconds,
                format!(
                    "the motion would have more than {MOST_ROWS:.0} samples; give a higher --band, a lower --rate or a shorter --period"
                ),
            ));
        }
        Ok(Self {
            rate,
            period: period as usize,
            ramp: ramp as usize,
            periods: usize::from(periods) + 1,
        })
    }

    fn rows(&self) -> usize {
        2 * self.ramp + self.periods * self.period + 1
    }

    /// Returns the row within a period.
    fn phase(&self, row: usize) -> usize {
        (row + self.period - self.ramp % self.period) % self.period
    }

    /// Returns the envelope and its first two derivatives by the time.
    fn envelope(&self, row: usize) -> [f64; 3] {
        let length = self.ramp as f64 / self.rate;
        let from_end = self.rows() - 1 - row;
        let (steps, sign) = match row <= from_end {
            true => (row, 1.0),
            false => (from_end, -1.0),
        };
        if steps >= self.ramp {
            return [1.0, 0.0, 0.0];
        }
        let s = steps as f64 / self.ramp as f64;
        [
            s.powi(3) * (10.0 + s * (6.0 * s - 15.0)),
            sign * 30.0 * s.powi(2) * (1.0 - s).powi(2) / length,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (length * length),
        ]
    }
}

/// One period: position, velocity and acceleration at each row.
type Period = [Vec<f64>; 3];

/// Returns the odd harmonics of the base frequency within a band, without those that are left out.
fn harmonics(base: f64, [low, high]: [f64; 2], random: &mut Pcg64) -> Vec<usize> {
    let first = (low / base * (1.0 - 1e-9)).ceil() as usize;
    let last = (high / base * (1.0 + 1e-9)).floor() as usize;
    let odd: Vec<usize> = (first..=last).filter(|k| k % 2 == 1).collect();
    let mut kept = Vec::new();
    for group in odd.chunks(GROUP) {
        let out = random.random_range(0..GROUP);
        // An incomplete group is kept whole.
        let all = group.len() < GROUP;
        kept.extend(
            (group.iter().enumerate())
                .filter(|(k, _)| all || *k != out)
                .map(|(_, h)| *h),
        );
    }
    kept
}

/// Synthesises one period on `points` points from complex amplitudes of harmonics, and its first two derivatives.
fn synthesise(
    planner: &mut RealFftPlanner<f64>,
    points: usize,
    base: f64,
    amplitudes: &[(usize, Complex<f64>)],
) -> Period {
    let plan = planner.plan_fft_inverse(points);
    [0, 1, 2].map(|derivative| {
        let mut spectrum = plan.make_input_vec();
        for (k, amplitude) in amplitudes {
            let s = Complex::new(0.0, TAU * base * *k as f64);
            spectrum[*k] = 0.5 * amplitude * s.powi(derivative);
        }
        let mut values = plan.make_output_vec();
        // The lengths are those of the plan, and the first and last bins are zero: it cannot fail.
        let _ = plan.process(&mut spectrum, &mut values);
        values
    })
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

fn crest(values: &[f64]) -> f64 {
    largest(values) / rms(values)
}

/// Designs a multisine of one joint, with the others at rest, within 80 % of the limits or as the options require.
///
/// Position, velocity and acceleration keep their limits between the samples too. The torque is checked at the samples.
///
/// # Errors
/// [`ExciteError`]: no limits, no such joint, options out of range, or no room.
pub fn multisine(robot: &Robot, options: &MultisineOptions) -> Result<Multisine, ExciteError> {
    let mut ready = Prepared::new(robot, "multisine", &options.staged, |_| {
        options.staged.check_band()
    })?;
    let share = match options.staged.speed_share {
        Some(_) => 1.0,
        None => SHARE,
    };
    let limits = [
        ready.distance,
        share * ready.bounds[ready.moving].velocity,
        share * ready.acceleration(),
    ];
    let [distance, velocity, acceleration] = limits;
    let [low, high] = (options.staged.band)
        .unwrap_or_else(|| StagedOptions::default_band(distance, velocity, acceleration));
    let layout = Layout::of(options, [low, high])?;
    let base = layout.rate / layout.period as f64;
    let mut random = Pcg64::seed_from_u64(options.seed);
    let lines = harmonics(base, [low, high], &mut random);
    if lines.len() < FEWEST {
        return Err(ExciteError::Option {
            name: "band",
            value: format!("{low},{high} Hz"),
            right: format!(
                "a period of {} s has {} odd harmonics in it, and {FEWEST} are needed; give a wider band or a longer --period",
                1.0 / base,
                lines.len()
            ),
        });
    }
    let fine = (POINTS * high / layout.rate).ceil().max(1.0) as usize;
    let points = fine * layout.period;
    let between = 1.0 / (core::f64::consts::PI * high / (layout.rate * fine as f64)).cos();
    let mut planner = RealFftPlanner::new();
    let amplitudes = drawn(&mut planner, points, base, &lines, limits, &mut random);
    let period = synthesise(&mut planner, layout.period, base, &amplitudes);
    let finest = synthesise(&mut planner, points, base, &amplitudes);
    let within = whole_shares(&layout, fine, between, &finest, limits);
    let scale = 1.0 / within.iter().copied().fold(0.0, f64::max);
    let scale = scale * fitting(&ready, &layout, &period, scale)?;
    let whole = [
        ready.distance,
        ready.bounds[ready.moving].velocity,
        ready.bounds[ready.moving]
            .acceleration
            .unwrap_or(f64::INFINITY),
    ];
    let notes = std::mem::take(&mut ready.notes);
    Ok(Multisine {
        reference: sampled(&ready, &layout, &period, scale),
        period: 1.0 / base,
        periods: layout.periods as u16,
        band: [lines[0], lines[lines.len() - 1]].map(|k| k as f64 * base),
        harmonics: lines.len(),
        crest: finest.each_ref().map(|values| crest(values)),
        shares: [0, 1, 2].map(|k| scale * within[k] * limits[k] / whole[k]),
        notes,
    })
}

/// Returns the complex amplitudes of the draw that uses the limits least.
fn drawn(
    planner: &mut RealFftPlanner<f64>,
    points: usize,
    base: f64,
    lines: &[usize],
    limits: [f64; 3],
    random: &mut Pcg64,
) -> Vec<(usize, Complex<f64>)> {
    let [distance, velocity, acceleration] = limits;
    let size = |k: usize| {
        let omega = TAU * base * k as f64;
        let (v, a) = (
            omega * distance / velocity,
            omega * omega * distance / acceleration,
        );
        1.0 / ((1.0 + v * v + a * a) * k as f64).sqrt()
    };
    let mut best = (f64::INFINITY, Vec::new());
    for _ in 0..DRAWS {
        let amplitudes: Vec<_> = (lines.iter())
            .map(|k| {
                let phase = TAU * random.random::<f64>();
                (*k, Complex::from_polar(size(*k), phase))
            })
            .collect();
        let period = synthesise(planner, points, base, &amplitudes);
        let used = (period.iter().zip(limits))
            .map(|(values, limit)| largest(values) / limit)
            .fold(0.0, f64::max);
        if used < best.0 {
            best = (used, amplitudes);
        }
    }
    best.1
}

/// Returns the largest shares of the limits in the periods and in rise and fall.
fn whole_shares(
    layout: &Layout,
    fine: usize,
    between: f64,
    period: &Period,
    limits: [f64; 3],
) -> [f64; 3] {
    let finer = Layout {
        rate: layout.rate * fine as f64,
        period: layout.period * fine,
        ramp: layout.ramp * fine,
        periods: layout.periods,
    };
    let mut most = period.each_ref().map(|values| largest(values));
    let end = finer.rows();
    for row in (0..finer.ramp).chain(end - finer.ramp..end) {
        for (most, value) in most.iter_mut().zip(state(&finer, period, row)) {
            *most = most.max(value.abs());
        }
    }
    [0, 1, 2].map(|k| between * most[k] / limits[k])
}

/// Returns position, velocity and acceleration at a row, from the start.
fn state(layout: &Layout, period: &Period, row: usize) -> [f64; 3] {
    let [e, e1, e2] = layout.envelope(row);
    let at = layout.phase(row);
    let [q, v, a] = period.each_ref().map(|values| values[at]);
    [e * q, e * v + e1 * q, e * a + 2.0 * e1 * v + e2 * q]
}

/// Returns the factor by which the motion is made smaller until torques and motors fit.
fn fitting(
    ready: &Prepared<'_>,
    layout: &Layout,
    period: &Period,
    scale: f64,
) -> Result<f64, ExciteError> {
    // Rise, one period and fall: the other periods repeat it.
    let once = Layout {
        periods: 1,
        ..*layout
    };
    let mut factor = 1.0;
    let mut why = String::new();
    for _ in 0..ATTEMPTS {
        let motion = || {
            Instants::new(once.rows(), |row, j| match j == ready.moving {
                true => {
                    let [q, v, a] = state(&once, period, row).map(|x| factor * scale * x);
                    [ready.start[j] + q, v, a]
                }
                false => [ready.start[j], 0.0, 0.0],
            })
        };
        let Some(reason) = ready.overloaded(&motion(), &motion())? else {
            return Ok(factor);
        };
        why = reason;
        factor *= SLOWER;
    }
    Err(ready.no_room(why))
}

/// Samples the motion of all joints.
fn sampled(ready: &Prepared<'_>, layout: &Layout, period: &Period, scale: f64) -> SampledReference {
    let rows = layout.rows();
    let mut all = SampledReference {
        period: 1.0 / layout.rate,
        position: Vec::new(),
        velocity: Vec::new(),
        acceleration: Vec::new(),
    };
    for (j, start) in ready.start.iter().enumerate() {
        let column = |which: usize, from: f64| -> Vec<f64> {
            (0..rows)
                .map(|row| match j == ready.moving {
                    true => from + scale * state(layout, period, row)[which],
                    false => from,
                })
                .collect()
        };
        all.position.push(column(0, *start));
        all.velocity.push(column(1, 0.0));
        all.acceleration.push(column(2, 0.0));
    }
    all
}
