//! The recursion of the firmware's estimator over the rows of a recording.
//!
//! Rows come from the same preparation as off-line, with its zero-phase filter. So this shows the convergence of the
//! recursion, and not the delay of the causal filter that runs on the rig.

use rig_data::prepare::Recording;
use rig_identify::{Base, Identification, IdentifyError, ModelKind, Rows};
use rig_model::robot::Robot;
use rig_shared::estimation::EstimatorKind;
use rig_shared::estimation::recursive::{Config, State, report, update};

use crate::rows::each_row;

/// Most places of the recursion.
pub(super) const PLACES: usize = 64;
/// Half the band of a parameter: torque of so many times the torque's RMS.
const BAND: f64 = 10.0;
/// Assumed noise, as a share of the RMS of an equation.
const ASSUMED_NOISE: f64 = 0.01;
/// Fewest and most instants in a residual block, longer than the correlation of the residual: decimated rows are nearly white,
/// and windows of the integral model overlap by three quarters. As long as the recording has enough blocks.
const RESIDUAL_BLOCK: [[f64; 2]; 2] = [[2.0, 5.0], [8.0, 20.0]];
/// Residual blocks per place that the recursion needs before it knows the noise (4), and a tenth more for odd blocks.
const BLOCKS: f64 = 4.4;
/// Points of the convergence curve.
const POINTS: u64 = 200;

/// The estimates during the recursion.
pub(super) struct Online {
    /// Times, s.
    pub t: Vec<f64>,
    /// Values at these times; the last are the result.
    pub values: Vec<Vec<f64>>,
    /// Standard deviations at the end; none before enough residuals were seen.
    pub std: Vec<Option<f64>>,
}

/// Sums of squares of an equation.
#[derive(Clone, Default)]
struct Sizes {
    y: f64,
    x: Vec<f64>,
    rows: f64,
}

/// Runs the recursion over the rows of `recording`, in their order, with the treatment of `found`. The robot has at most
/// [`PLACES`] base parameters. Fewer places need fewer residuals before standard deviations are known.
pub(super) fn online(
    robot: &Robot,
    base: &Base,
    recording: &dyn Recording,
    found: &Identification,
) -> Result<Online, IdentifyError> {
    match base.len() {
        0..=6 => run::<6>(robot, base, recording, found),
        7..=12 => run::<12>(robot, base, recording, found),
        13..=36 => run::<36>(robot, base, recording, found),
        37..=58 => run::<58>(robot, base, recording, found),
        _ => run::<PLACES>(robot, base, recording, found),
    }
}

/// Runs the recursion with `N` places.
fn run<const N: usize>(
    robot: &Robot,
    base: &Base,
    recording: &dyn Recording,
    found: &Identification,
) -> Result<Online, IdentifyError> {
    let p = base.len();
    let mut sizes: Vec<Sizes> = Vec::new();
    let mut total = 0;
    pass(robot, base, recording, found, &mut |rows| {
        sizes.resize(rows.equations.len(), Sizes::default());
        total += rows.t.len() as u64;
        for (own, equation) in sizes.iter_mut().zip(&rows.equations) {
            own.x.resize(p, 0.0);
            for k in (0..rows.t.len()).filter(|&k| equation.keep[k]) {
                own.rows += 1.0;
                own.y += equation.y[k].powi(2);
                for (sum, x) in own.x.iter_mut().zip(&equation.x[k * p..(k + 1) * p]) {
                    *sum += x * x;
                }
            }
        }
    })?;
    let [fewest, most] = RESIDUAL_BLOCK[usize::from(found.model == ModelKind::Integral)];
    let used = sizes.iter().map(|s| s.rows).sum::<f64>() / sizes.len().max(1) as f64;
    let instants = (used / (BLOCKS * N as f64)).clamp(fewest, most) as u32;
    let (config, half) = config::<N>(&sizes, p, instants);
    let scales: Vec<f64> = (sizes.iter())
        .map(|s| (s.rows.max(1.0) / s.y.max(f64::MIN_POSITIVE)).sqrt())
        .collect();
    let mut state = State::<f64, N, false>::of_constant_parameters();
    let mut found_so_far = Online {
        t: Vec::new(),
        values: Vec::new(),
        std: Vec::new(),
    };
    let every = total.div_ceil(POINTS).max(1);
    let mut index = 0;
    let mut row = [0.0; N];
    pass(robot, base, recording, found, &mut |rows| {
        for k in 0..rows.t.len() {
            for (equation, scale) in rows.equations.iter().zip(&scales) {
                if equation.keep[k] {
                    for (to, x) in row.iter_mut().zip(&equation.x[k * p..(k + 1) * p]) {
                        *to = x * scale;
                    }
                    update(&config, &mut state, &row, equation.y[k] * scale);
                }
            }
            index += 1;
            if index % every == 0 || index == total {
                found_so_far.t.push(rows.t[k]);
                let now = report(&config, &state);
                found_so_far.values.push(now.value[..p].to_vec());
            }
        }
    })?;
    let last = report(&config, &state);
    // The half-width of the band stands for a standard deviation that is not known yet.
    found_so_far.std = (last.std.iter().zip(&half))
        .map(|(std, half)| (std < half).then_some(*std))
        .take(p)
        .collect();
    Ok(found_so_far)
}

fn pass(
    robot: &Robot,
    base: &Base,
    recording: &dyn Recording,
    found: &Identification,
    take: &mut dyn FnMut(&Rows),
) -> Result<(), IdentifyError> {
    let model: ModelKind = found.model;
    each_row(robot, base, &[recording], found, model, take)
}

/// Returns the constants of the recursion and the half-widths of the bands. Nothing is forgotten, no residual is taken for a
/// change of the parameters, and every band is symmetric about zero.
fn config<const N: usize>(sizes: &[Sizes], p: usize, instants: u32) -> (Config<f64, N>, [f64; N]) {
    let (mut lower, mut upper) = ([0.0; N], [0.0; N]);
    for c in 0..p {
        // The equation in which the parameter is largest gives its band.
        let ratio = |s: &Sizes| (s.x[c] / s.y.max(f64::MIN_POSITIVE)).sqrt();
        let most = sizes.iter().map(ratio).fold(0.0, f64::max);
        if most > 0.0 {
            (lower[c], upper[c]) = (-BAND / most, BAND / most);
        }
    }
    let config = Config::new(
        EstimatorKind::LeastSquares,
        &lower,
        &upper,
        ASSUMED_NOISE,
        0.0,
        instants * sizes.len() as u32,
    );
    (config, upper)
}
