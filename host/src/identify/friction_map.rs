//! Friction against speed, from a recording with stretches of constant speed.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, column, differential_regressor};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::base::chain_of;
use super::covariance::{Memory, t_quantile};
use super::{Identification, IdentifyError};
use crate::prepare::{PrepareError, Recording, each_motion};
use crate::robot::Robot;

/// How stretches of constant speed are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionMapOptions {
    /// Speed may leave its mean over the stretch by this share.
    pub tolerance: f64,
    /// Shortest stretch, s.
    pub shortest: f64,
    /// Start of a stretch that is left out, s: the controller settles.
    pub settle: f64,
}

impl Default for FrictionMapOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.05,
            shortest: 0.15,
            settle: 0.05,
        }
    }
}

/// Mean friction over one stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrictionPoint {
    /// rad/s or m/s
    pub speed: f64,
    /// Torque less gravity, inertia and offset as identified, N·m or N.
    pub friction: f64,
    /// Standard deviation of that mean, correlation in time allowed for.
    pub std: f64,
    /// Start, s.
    pub start: f64,
    /// s
    pub duration: f64,
}

/// A fitted law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrictionFit {
    /// N·m or N
    pub coulomb: f64,
    /// N·m·s/rad or N·s/m
    pub viscous: f64,
    /// Breakaway friction above Coulomb's, N·m or N; 0 without the Stribeck term.
    pub breakaway_excess: f64,
    /// Stribeck velocity, rad/s or m/s.
    pub stribeck_velocity: Option<f64>,
    /// 95 % half intervals in the order coulomb, viscous, breakaway excess.
    pub half_interval: Vec<f64>,
    /// Weighted sum of squares of what is left.
    pub squares: f64,
    /// RMS error on points that were left out of the fit one by one, N·m or N.
    pub leave_one_out_rms: f64,
}

/// Points, both laws and the choice between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrictionMap {
    /// Name of the joint.
    pub joint: String,
    /// One a stretch, by speed.
    pub points: Vec<FrictionPoint>,
    /// fc·sgn v + fv·v.
    pub simple: FrictionFit,
    /// The same and breakaway·exp(−(v/vs)²)·sgn v (Armstrong-Hélouvry, Dupont & Canudas de Wit 1994).
    pub stribeck: Option<FrictionFit>,
    /// Sum of squares over the Stribeck velocity: what the choice of vs rests on.
    pub profile: Vec<[f64; 2]>,
    /// p-value of the F-test of the Stribeck law against the simple one.
    pub p_value: Option<f64>,
    /// Whether the Stribeck term is warranted.
    pub warranted: bool,
    /// One sentence.
    pub text: String,
}

/// p-value below which the Stribeck term is taken in. Its velocity exists only if the term does, which makes
/// the F distribution too optimistic (Davies 1977); a thousandth leaves room for that.
const WARRANT: f64 = 1e-3;

struct Run {
    start: f64,
    rows: u64,
    speed: f64,
    friction: f64,
    squares: f64,
    memory: Memory,
}

/// Draws the friction map of joint `joint` (from 0) out of `recording`, with gravity and inertia as in
/// `identification`.
///
/// # Errors
/// [`IdentifyError::FrictionMap`] where fewer than four stretches of constant speed are found, or all lie in
/// one direction; what reading gives.
pub fn friction_map(
    robot: &Robot,
    identification: &Identification,
    recording: &dyn Recording,
    joint: usize,
    options: FrictionMapOptions,
) -> Result<FrictionMap, IdentifyError> {
    let name = robot
        .joints
        .get(joint)
        .map(|j| j.name.clone())
        .ok_or_else(|| {
            IdentifyError::FrictionMap(format!(
                "The robot has {} joints; there is no joint {}.",
                robot.joints.len(),
                joint + 1
            ))
        })?;
    let details = &identification.details;
    let chain = chain_of(robot)?;
    let n = robot.joints.len();
    let width = n * COLUMNS;
    let treatment = &details.treatment;
    let dt = treatment.dt();
    let settle = (options.settle / dt) as u64;
    let shortest = (options.shortest / dt) as u64;
    let friction_columns = [column::VISCOUS, column::COULOMB].map(|c| joint * COLUMNS + c);
    let rest: Vec<(usize, f64)> = details
        .columns
        .iter()
        .zip(&details.estimate.values)
        .filter(|(c, _)| !friction_columns.contains(c))
        .map(|(c, v)| (*c, *v))
        .collect();
    let mut points = Vec::new();
    let finish = |run: &mut Option<Run>, points: &mut Vec<FrictionPoint>| {
        if let Some(run) = run.take()
            && run.rows >= shortest + settle
        {
            let kept = (run.rows - settle) as f64;
            let mean = run.friction / kept;
            let variance = (run.squares / kept - mean * mean).max(0.0);
            points.push(FrictionPoint {
                speed: run.speed / run.rows as f64,
                friction: mean,
                std: (variance * run.memory.length() / kept).sqrt(),
                start: run.start,
                duration: run.rows as f64 * dt,
            });
        }
    };
    let mut run: Option<Run> = None;
    let mut segment = 0;
    let mut out = vec![0.0; n * width];
    each_motion(recording, treatment, 0, &mut |motion| {
        if motion.segment != segment {
            finish(&mut run, &mut points);
            segment = motion.segment;
        }
        for k in motion.usable.0..motion.usable.1 {
            let state = |f: &dyn Fn(&crate::prepare::JointMotion) -> f64| {
                motion.joints.iter().map(f).collect::<Vec<f64>>()
            };
            let (q, qd, qdd) = (
                state(&|j| j.q[k]),
                state(&|j| j.qd[k]),
                state(&|j| j.qdd[k]),
            );
            let v = qd[joint];
            let moving =
                v.abs() > treatment.speed_threshold[joint] && !motion.joints[joint].saturated[k];
            let fits = run.as_ref().is_some_and(|r| {
                let mean = r.speed / r.rows as f64;
                (v - mean).abs() <= options.tolerance * mean.abs()
            });
            if !moving || !fits {
                finish(&mut run, &mut points);
                if !moving {
                    continue;
                }
            }
            let run = run.get_or_insert_with(|| Run {
                start: motion.t[k],
                rows: 0,
                speed: 0.0,
                friction: 0.0,
                squares: 0.0,
                memory: Memory::default(),
            });
            run.rows += 1;
            run.speed += v;
            if run.rows > settle {
                differential_regressor(&chain, &q, &qd, &qdd, &mut out)
                    .map_err(|e| PrepareError::Stopped(e.to_string()))?;
                let row = &out[joint * width..(joint + 1) * width];
                let model: f64 = rest.iter().map(|(c, v)| row[*c] * v).sum();
                let friction = motion.joints[joint].tau[k] - model;
                let before = (run.rows - settle - 1).max(1) as f64;
                run.memory.push(friction - run.friction / before);
                run.friction += friction;
                run.squares += friction * friction;
            }
        }
        Ok(())
    })?;
    finish(&mut run, &mut points);
    points.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    decide(name, points)
}

/// Fits both laws to the points and decides between them.
fn decide(joint: String, points: Vec<FrictionPoint>) -> Result<FrictionMap, IdentifyError> {
    let (back, forth) = (
        points.iter().filter(|p| p.speed < 0.0).count(),
        points.iter().filter(|p| p.speed > 0.0).count(),
    );
    if points.len() < 4 || back == 0 || forth == 0 {
        return Err(IdentifyError::FrictionMap(format!(
            "Joint {joint} moves at constant speed in {} stretches ({back} backwards, {forth} forwards); a friction map needs at least four and both directions.",
            points.len()
        )));
    }
    let mut stds: Vec<f64> = points.iter().map(|p| p.std).collect();
    stds.sort_by(f64::total_cmp);
    // No point counts more than the median one four times over: its own spread is an estimate too.
    let floor = (0.5 * stds[stds.len() / 2]).max(f64::MIN_POSITIVE);
    let weights: Vec<f64> = points.iter().map(|p| 1.0 / p.std.max(floor)).collect();
    let simple = fit(&points, &weights, None).ok_or_else(|| {
        IdentifyError::FrictionMap(format!(
            "All stretches of joint {joint} have the same speed; a friction map needs several."
        ))
    })?;
    let speeds = points.iter().map(|p| p.speed.abs());
    let (slow, fast) = speeds.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let grid = 60;
    let mut profile = Vec::new();
    let mut best: Option<FrictionFit> = None;
    if points.len() >= 6 {
        for k in 0..=grid {
            let vs = slow * (fast / slow).powf(k as f64 / grid as f64);
            if let Some(candidate) = fit(&points, &weights, Some(vs)) {
                profile.push([vs, candidate.squares]);
                if best.as_ref().is_none_or(|b| candidate.squares < b.squares) {
                    best = Some(candidate);
                }
            }
        }
    }
    let freedom = points.len() as f64 - 4.0;
    let p_value = best.as_ref().and_then(|b| {
        let f = ((simple.squares - b.squares) / 2.0) / (b.squares / freedom).max(f64::MIN_POSITIVE);
        Some(FisherSnedecor::new(2.0, freedom).ok()?.sf(f.max(0.0)))
    });
    let warranted = match (&best, p_value) {
        (Some(b), Some(p)) => {
            p < WARRANT
                && b.leave_one_out_rms < simple.leave_one_out_rms
                && b.breakaway_excess > 0.0
        }
        _ => false,
    };
    let text = match (&best, p_value) {
        (Some(b), Some(p)) if warranted => format!(
            "A Stribeck term is warranted (p = {p:.1e}): {:.4} above Coulomb friction at standstill, gone beyond {:.4}; points left out are predicted to {:.4} instead of {:.4}.",
            b.breakaway_excess,
            b.stribeck_velocity.unwrap_or(0.0),
            b.leave_one_out_rms,
            simple.leave_one_out_rms
        ),
        (Some(_), Some(p)) => format!(
            "These {} points do not warrant a Stribeck term beside Coulomb and viscous friction (p = {p:.2}). That does not say that there is none: more speeds, slow ones above all, would tell.",
            points.len()
        ),
        _ => "Too few stretches to judge a Stribeck term; six are needed.".to_owned(),
    };
    Ok(FrictionMap {
        joint,
        points,
        simple,
        stribeck: best,
        profile,
        p_value,
        warranted,
        text,
    })
}

fn fit(points: &[FrictionPoint], weights: &[f64], vs: Option<f64>) -> Option<FrictionFit> {
    let columns = if vs.is_some() { 3 } else { 2 };
    let law = |v: f64, c: usize| match c {
        0 => v.signum(),
        1 => v,
        _ => v.signum() * vs.map_or(0.0, |vs| (-(v / vs).powi(2)).exp()),
    };
    let n = points.len();
    let a = DMatrix::from_fn(n, columns, |i, c| weights[i] * law(points[i].speed, c));
    let y = DVector::from_fn(n, |i, _| weights[i] * points[i].friction);
    let qr = a.clone().qr();
    let inverse = qr.r().try_inverse()?;
    if !inverse.iter().all(|v| v.is_finite()) {
        return None;
    }
    let x = &inverse * (qr.q().transpose() * &y);
    let residual = &y - &a * &x;
    let squares = residual.norm_squared();
    // Leaving one out by the leverage: e/(1 − h).
    let q = qr.q();
    let left_out: f64 = (0..n)
        .map(|i| {
            let h = q.row(i).norm_squared().min(1.0 - 1e-9);
            (residual[i] / ((1.0 - h) * weights[i])).powi(2)
        })
        .sum();
    let freedom = n.saturating_sub(columns + usize::from(vs.is_some())).max(1);
    // Never below what the points' own spread says.
    let sigma = (squares / freedom as f64).max(1.0).sqrt();
    let quantile = t_quantile(freedom);
    Some(FrictionFit {
        coulomb: x[0],
        viscous: x[1],
        breakaway_excess: if columns == 3 { x[2] } else { 0.0 },
        stribeck_velocity: vs,
        half_interval: (0..columns)
            .map(|c| quantile * sigma * inverse.row(c).norm())
            .collect(),
        squares,
        leave_one_out_rms: (left_out / n as f64).sqrt(),
    })
}
