//! Friction against speed, from a recording with stretches of constant speed.
//!
//! Passes are found in the recorded reference of the joint, which has no noise, or else in the measured position. A
//! pass gives one point: its mean speed, its mean friction and the standard deviation of that mean. Noise makes a point
//! less certain but never removes it. Every dropped pass is listed with its reason.
//!
//! The sweep has its own sample rate, band, clipping and time stamps; only the parameters come from the identification.
//! [`FrictionMap::doubts`] tells whether the sweep and the identification are consistent.
//!
//! Limits: no friction that depends on position, load or temperature; all rows of a sweep are held in memory.

mod consistency;
mod law;
mod passes;

use rig_shared::multibody::{COLUMNS, column, differential_regressor};
use serde::Serialize;

use self::law::Decision;
use self::passes::{Signal, Stretch, slope};
use super::base::chain_of;
use super::covariance::Memory;
use super::{Identification, IdentifyError, treatment_for};
use rig_data::prepare::{
    PrepareError, PrepareOptions, Recording, Spooled, Survey, Treatment, each_motion, surveyed,
};
use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;

/// Settings for finding stretches of constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionMapOptions {
    /// Largest relative deviation of a measured position's speed from its mean over the stretch.
    pub tolerance: f64,
    /// Shortest usable stretch after its start is excluded, s.
    pub shortest: f64,
    /// Excluded start of a stretch, in which the controller settles, s.
    pub settle: f64,
    /// Smallest excluded share at the start of a stretch. Friction builds up over a distance after a reversal
    /// (presliding), and slow passes take long to cover it.
    pub settle_share: f64,
}

impl Default for FrictionMapOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.05,
            shortest: 0.1,
            settle: 0.05,
            settle_share: 0.1,
        }
    }
}

/// Mean friction over one stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrictionPoint {
    /// Mean measured speed, rad/s or m/s.
    pub speed: f64,
    /// Torque minus the identified gravity, inertia and offset, N·m or N.
    pub friction: f64,
    /// Standard deviation of that mean; allows for correlation in time.
    pub std: f64,
    /// Start, s.
    pub start: f64,
    /// Duration, s.
    pub duration: f64,
    /// First row used and one past the last.
    #[serde(skip)]
    pub rows: (usize, usize),
}

/// A stretch of constant speed that gave no point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DroppedPass {
    /// Speed, rad/s or m/s.
    pub speed: f64,
    /// Start, s.
    pub start: f64,
    /// Duration, s.
    pub duration: f64,
    /// Reason, a phrase.
    pub why: String,
}

/// A fitted law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrictionFit {
    /// Coulomb friction, N·m or N.
    pub coulomb: f64,
    /// Viscous coefficient, N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// Breakaway friction minus Coulomb friction, N·m or N; 0 without the Stribeck term.
    pub breakaway_excess: f64,
    /// Constant torque of the sweep minus the identified one, N·m or N.
    pub offset: f64,
    /// Stribeck velocity, rad/s or m/s.
    pub stribeck_velocity: Option<f64>,
    /// 95 % half intervals in the order coulomb, viscous, breakaway excess.
    pub half_interval: Vec<f64>,
    /// Weighted sum of squared residuals.
    pub squares: f64,
    /// RMS error on points that were left out of the fit one at a time, N·m or N.
    pub leave_one_out_rms: f64,
}

/// Points, fitted laws and the choice between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrictionMap {
    /// Name of the joint.
    pub joint: String,
    /// One point per stretch, sorted by speed.
    pub points: Vec<FrictionPoint>,
    /// Stretches of constant speed that gave no point, sorted by time.
    pub dropped: Vec<DroppedPass>,
    /// True if the stretches come from the recorded reference, false if from the measured position.
    pub from_reference: bool,
    /// Standard deviation between passes beyond that of the points themselves, N·m or N.
    pub scatter: f64,
    /// fc·sgn v + fv·v + a constant.
    pub simple: FrictionFit,
    /// The same plus breakaway·exp(−(v/vs)²)·sgn v (Armstrong-Hélouvry, Dupont & Canudas de Wit 1994), if the points
    /// warrant it.
    pub stribeck: Option<FrictionFit>,
    /// Sum of squares as a function of the Stribeck velocity vs, which decides the choice of vs.
    pub profile: Vec<[f64; 2]>,
    /// p-value of the F-test of the Stribeck law against the simple one.
    pub p_value: Option<f64>,
    /// RMS error of the Stribeck law on left-out points, N·m or N; given even if the law is not warranted.
    pub stribeck_left_out_rms: Option<f64>,
    /// True if the Stribeck term is warranted.
    pub warranted: bool,
    /// One or two sentences.
    pub text: String,
    /// Corrections to the sweep's time stamps, a sentence.
    pub note: Option<String>,
    /// Reasons not to trust the map, a sentence each: the torque has another clock or scale than the position or than
    /// the identification, or friction is negative. Empty for a sound sweep.
    pub doubts: Vec<String>,
}

/// All rows of a sweep, moving or not.
#[derive(Clone, Default)]
struct Rows {
    position: Signal,
    /// Filtered speed, rad/s or m/s.
    speed: Vec<f64>,
    /// Torque, N·m or N.
    tau: Vec<f64>,
    /// Torque of the identified model without the joint's own friction, N·m or N.
    model: Vec<f64>,
    /// The same with the joint's own friction.
    whole: Vec<f64>,
    /// Torque of the identified model at rest: gravity and the constant torque, N·m or N.
    weight: Vec<f64>,
    saturated: Vec<bool>,
}

/// Computes the friction map of joint `joint` (from 0) from `recording`, with gravity and inertia of `identification`.
/// The recording may have another sample rate than those of the identification.
///
/// # Errors
/// [`IdentifyError::FrictionMap`] if fewer than four stretches of constant speed are found or all have the same
/// direction; reading errors.
pub fn friction_map(
    robot: &Robot,
    identification: &Identification,
    recording: &dyn Recording,
    joint: usize,
    options: FrictionMapOptions,
) -> Result<FrictionMap, IdentifyError> {
    let described = robot.joints.get(joint).ok_or_else(|| {
        IdentifyError::FrictionMap(format!(
            "The robot has {} joints; there is no joint {}.",
            robot.joints.len(),
            joint + 1
        ))
    })?;
    let spooled = Spooled::new(recording);
    let (surveys, even) = surveyed(&[&spooled], robot.joints.len())?;
    let (Some(survey), Some(even)) = (surveys.first(), even.first()) else {
        return Err(IdentifyError::NoRecording);
    };
    let treatment = treatment_of(robot, &identification.details.treatment, survey, even)?;
    let rows = rows_of(robot, identification, even, joint, &treatment)?;
    let reference = reference_of(recording, joint)?;
    let planned = reference.passes_of_reference(&options);
    let from_reference = both_ways(planned.iter().map(|s| s.speed));
    let stretches = if from_reference {
        planned
    } else {
        rows.position.passes_of_position(&options)
    };
    let (points, dropped) = rows.points(&stretches, &options);
    if !both_ways(points.iter().map(|p| p.speed)) {
        return Err(too_few(&described.name, &points, &dropped));
    }
    let decision = law::decide(&points).ok_or_else(|| one_speed(&described.name))?;
    let check = Check {
        rows: &rows,
        stretches: &stretches,
        options: &options,
        sweep: &survey.label,
        joint: &described.name,
        noise: (identification.details.train.get(joint)).map_or(f64::INFINITY, |own| own.rms),
        number: joint + 1,
        kind: described.kind,
    };
    let doubts = check.doubts(&points, &decision);
    let text = text_of(&decision, &points, described.kind);
    let warranted = decision.warranted;
    Ok(FrictionMap {
        joint: described.name.clone(),
        points,
        dropped,
        from_reference,
        scatter: decision.scatter,
        simple: decision.simple,
        stribeck_left_out_rms: decision.stribeck.as_ref().map(|b| b.leave_one_out_rms),
        stribeck: decision.stribeck.filter(|_| warranted),
        profile: decision.profile,
        p_value: decision.p_value,
        warranted,
        text,
        note: survey.note.clone(),
        doubts,
    })
}

/// Returns the error for stretches without different speeds.
fn one_speed(joint: &str) -> IdentifyError {
    IdentifyError::FrictionMap(format!(
        "All stretches of joint {joint} have the same speed; a friction map needs several."
    ))
}

/// The input of a map's checks.
struct Check<'a> {
    rows: &'a Rows,
    stretches: &'a [Stretch],
    options: &'a FrictionMapOptions,
    sweep: &'a str,
    joint: &'a str,
    /// Residual of the joint's torque in the recordings of the fit, N·m or N rms.
    noise: f64,
    /// Number of the joint, from 1.
    number: usize,
    kind: JointKind,
}

impl Check<'_> {
    /// Returns the reasons not to trust the map. The clock comes first, because a late torque looks like a wrong scale.
    fn doubts(&self, points: &[FrictionPoint], decision: &Decision) -> Vec<String> {
        let units = match self.kind {
            JointKind::Revolute => ["N·m", "N·m·s/rad"],
            JointKind::Prismatic => ["N", "N·s/m"],
        };
        let chosen = |decision: &Decision, stribeck: bool| {
            let stribeck = decision.stribeck.clone().filter(|_| stribeck);
            stribeck.unwrap_or_else(|| decision.simple.clone())
        };
        let recorded = chosen(decision, decision.warranted);
        let clock = self.rows.late().and_then(|late| {
            let moved = self.rows.earlier(late.by)?;
            let (points, _) = moved.points(self.stretches, self.options);
            let moved = chosen(&law::decide(&points)?, decision.warranted);
            consistency::late_doubt(
                &late,
                [&recorded, &moved],
                self.sweep,
                self.number,
                units[1],
            )
        });
        let scale = || {
            (self.rows.gravity_shown(points)).doubt(self.noise, self.sweep, self.joint, self.number)
        };
        let impossible =
            consistency::impossible(&recorded, points.len(), self.joint, self.number, units);
        (clock.or_else(scale).into_iter().chain(impossible)).collect()
    }
}

/// Returns true if the speeds suffice for a map: at least four, in both directions.
fn both_ways(speeds: impl Iterator<Item = f64> + Clone) -> bool {
    let back = speeds.clone().filter(|v| *v < 0.0).count();
    let forth = speeds.filter(|v| *v > 0.0).count();
    back + forth >= 4 && back > 0 && forth > 0
}

fn too_few(joint: &str, points: &[FrictionPoint], dropped: &[DroppedPass]) -> IdentifyError {
    let back = points.iter().filter(|p| p.speed < 0.0).count();
    let why = dropped.first().map_or(String::new(), |first| {
        format!(
            " {} more gave no point, the first of them at {:.4} from {:.2} s on: {}.",
            dropped.len(),
            first.speed,
            first.start,
            first.why
        )
    });
    IdentifyError::FrictionMap(format!(
        "Joint {joint} moves at constant speed in {} stretches ({back} backwards, {} forwards); a friction map needs at least four and both directions.{why}",
        points.len(),
        points.len() - back
    ))
}

/// Decides the treatment of the sweep: the band of the identification, limited by the sweep's own rate and noise, and
/// the sweep's own clipping. There is no decimation, because means over passes are taken.
fn treatment_of(
    robot: &Robot,
    fitted: &Treatment,
    sweep: &Survey,
    recording: &dyn Recording,
) -> Result<Treatment, IdentifyError> {
    let rate = sweep.sample_rate;
    // A noisier position, or one with worse time stamps, must not be differentiated in the band of a better one.
    let (_, own) = treatment_for(
        robot,
        &[recording],
        vec![sweep.clone()],
        &PrepareOptions::default(),
    )?;
    let cutoff = fitted.cutoff.min(own.cutoff).min(0.4 * rate);
    let saturation = (fitted.saturation.iter().zip(&sweep.joints))
        .map(|([low, high], own)| {
            let tighter = |a: Option<f64>, b: Option<f64>, pick: fn(f64, f64) -> f64| {
                a.into_iter().chain(b).reduce(pick)
            };
            [
                tighter(*low, own.clipped[0], f64::max),
                tighter(*high, own.clipped[1], f64::min),
            ]
        })
        .collect();
    Ok(Treatment {
        sample_rate: rate,
        cutoff,
        decimation: 1,
        parallel_edge: cutoff,
        saturation,
        // One period of the filter, because a pass may end with the recording.
        trimmed: (rate / cutoff).ceil() as usize,
        ..fitted.clone()
    })
}

/// Returns the recorded reference of the joint; empty if there is none.
fn reference_of(recording: &dyn Recording, joint: usize) -> Result<Signal, IdentifyError> {
    let mut signal = Signal::default();
    recording.each_block(1 << 16, &mut |block| {
        let Some(reference) = block.joints.get(joint).and_then(|j| j.reference.as_ref()) else {
            return Ok(());
        };
        for (k, (t, x)) in block.t.iter().zip(reference).enumerate() {
            signal.push(*t, *x, k > 0 || block.continues);
        }
        Ok(())
    })?;
    Ok(signal)
}

/// Computes the joint's torque and the identified model's torque with and without the joint's friction.
fn rows_of(
    robot: &Robot,
    identification: &Identification,
    recording: &dyn Recording,
    joint: usize,
    treatment: &Treatment,
) -> Result<Rows, IdentifyError> {
    let details = &identification.details;
    let chain = chain_of(robot)?;
    let n = robot.joints.len();
    let width = n * COLUMNS;
    let friction_columns = [column::VISCOUS, column::COULOMB].map(|c| joint * COLUMNS + c);
    let (own, rest): (Vec<(usize, f64)>, Vec<(usize, f64)>) =
        (details.columns.iter().zip(&details.estimate.values))
            .map(|(c, v)| (*c, *v))
            .partition(|(c, _)| friction_columns.contains(c));
    let (mut out, mut still) = (vec![0.0; n * width], vec![0.0; n * width]);
    let at_rest = vec![0.0; n];
    let mut rows = Rows::default();
    let mut last = None;
    each_motion(recording, treatment, 0, &mut |motion| {
        for k in motion.usable.0..motion.usable.1 {
            let state = |f: &dyn Fn(&rig_data::prepare::JointMotion) -> f64| {
                motion.joints.iter().map(f).collect::<Vec<f64>>()
            };
            let (q, qd, qdd) = (
                state(&|j| j.q[k]),
                state(&|j| j.qd[k]),
                state(&|j| j.qdd[k]),
            );
            differential_regressor(&chain, &q, &qd, &qdd, &mut out)
                .and_then(|()| differential_regressor(&chain, &q, &at_rest, &at_rest, &mut still))
                .map_err(|e| PrepareError::Stopped(e.to_string()))?;
            let of = |columns: &[f64], values: &[(usize, f64)]| {
                let row = &columns[joint * width..(joint + 1) * width];
                values.iter().map(|(c, v)| row[*c] * v).sum::<f64>()
            };
            let model = of(&out, &rest);
            rows.position
                .push(motion.t[k], q[joint], last == Some(motion.segment));
            last = Some(motion.segment);
            rows.speed.push(qd[joint]);
            rows.tau.push(motion.joints[joint].tau[k]);
            rows.model.push(model);
            rows.whole.push(model + of(&out, &own));
            rows.weight.push(of(&still, &rest));
            rows.saturated.push(motion.joints[joint].saturated[k]);
        }
        Ok(())
    })?;
    Ok(rows)
}

/// Number of parts of a pass; the joint must advance in each.
const PARTS: usize = 10;

impl Rows {
    /// Returns the points of all passes, sorted by speed, and the dropped passes.
    fn points(
        &self,
        stretches: &[Stretch],
        options: &FrictionMapOptions,
    ) -> (Vec<FrictionPoint>, Vec<DroppedPass>) {
        let (mut points, mut dropped) = (Vec::new(), Vec::new());
        for stretch in stretches {
            match self.point(stretch, options) {
                Ok(point) => points.push(point),
                Err(why) => dropped.push(DroppedPass {
                    speed: stretch.speed,
                    start: stretch.from,
                    duration: stretch.to - stretch.from,
                    why,
                }),
            }
        }
        points.sort_by(|a, b| a.speed.total_cmp(&b.speed));
        (points, dropped)
    }

    /// Returns the mean of a pass, or the reason why it has none.
    fn point(&self, pass: &Stretch, options: &FrictionMapOptions) -> Result<FrictionPoint, String> {
        let t = &self.position.t;
        let duration = pass.to - pass.from;
        let settle = options.settle.max(options.settle_share * duration);
        let first = t.partition_point(|t| *t < pass.from + settle);
        // The position filter also spreads the motion after a pass into its end.
        let end = t.partition_point(|t| *t <= pass.to - options.settle);
        let rows = first..end.max(first);
        let left = match rows.clone().next_back() {
            Some(last) => t[last] - t[first],
            None => 0.0,
        };
        // Rows at 100 Hz cover up to a tenth less than the time between the ends.
        if rows.len() < PARTS {
            return Err(format!(
                "{} rows are left after {settle:.3} s of settling and at the ends of the recording, less than {PARTS}",
                rows.len()
            ));
        }
        if left < 0.85 * options.shortest {
            return Err(format!(
                "{left:.3} s are left after {settle:.3} s of settling and at the ends of the recording, less than {:.3} s",
                options.shortest
            ));
        }
        let limited = self.saturated[rows.clone()].iter().filter(|s| **s).count();
        if limited > 0 {
            return Err(format!(
                "the torque is at its limit in {limited} of {} rows",
                rows.len()
            ));
        }
        let x = &self.position.x;
        let speed = slope(&t[rows.clone()], &x[rows.clone()])
            .ok_or_else(|| "its rows have one time".to_owned())?;
        // Ten rows have nine intervals.
        let parts = PARTS.min(rows.len() - 1);
        let edge = |part: usize| first + part * (rows.len() - 1) / parts;
        let stopped = (0..parts)
            .filter(|part| (x[edge(part + 1)] - x[edge(*part)]) * pass.speed <= 0.0)
            .count();
        if stopped > 0 {
            return Err(format!(
                "the joint stands or turns back in {stopped} of its {parts} parts (it sticks and slips, or does not follow)"
            ));
        }
        let friction: Vec<f64> = (self.tau[rows.clone()].iter())
            .zip(&self.model[rows.clone()])
            .map(|(tau, model)| tau - model)
            .collect();
        let (mean, std) = mean_of(&friction);
        Ok(FrictionPoint {
            speed,
            friction: mean,
            std,
            start: pass.from,
            duration,
            rows: (rows.start, rows.end),
        })
    }
}

/// Returns the means over tenths.
fn tenths(values: &[f64]) -> [f64; PARTS] {
    std::array::from_fn(|part| {
        let edge = |part: usize| part * values.len() / PARTS;
        let own = &values[edge(part)..edge(part + 1)];
        own.iter().sum::<f64>() / own.len().max(1) as f64
    })
}

/// Returns the mean and its standard deviation: the larger of the one from the correlation of rows and the one from the
/// means of the tenths. The second detects slow changes over the pass.
fn mean_of(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let mut memory = Memory::default();
    let mut squares = 0.0;
    for value in values {
        memory.push(value - mean);
        squares += (value - mean).powi(2);
    }
    let by_rows = (squares / n * memory.length() / n).sqrt();
    let tenths = tenths(values);
    let about = tenths.iter().sum::<f64>() / PARTS as f64;
    let spread: f64 = tenths.iter().map(|m| (m - about).powi(2)).sum();
    let by_tenths = (spread / (PARTS * (PARTS - 1)) as f64).sqrt();
    (mean, by_rows.max(by_tenths))
}

/// Describes the decision in words.
fn text_of(decision: &Decision, points: &[FrictionPoint], kind: JointKind) -> String {
    let (velocity, torque) = match kind {
        JointKind::Revolute => ("rad/s", "N·m"),
        JointKind::Prismatic => ("m/s", "N"),
    };
    let slow = points
        .iter()
        .map(|p| p.speed.abs())
        .fold(f64::INFINITY, f64::min);
    let (Some(b), Some(p)) = (&decision.stribeck, decision.p_value) else {
        return format!(
            "{} stretches are too few to judge a Stribeck term; seven at clearly different speeds are needed.",
            points.len()
        );
    };
    let simple = &decision.simple;
    if decision.warranted {
        return format!(
            "A Stribeck term is warranted (p = {p:.1e}): friction is {:.4} {torque} above Coulomb friction at standstill and falls with a Stribeck velocity of {:.4} {velocity}; points left out are predicted to {:.4} instead of {:.4} {torque}.",
            b.breakaway_excess,
            b.stribeck_velocity.unwrap_or(0.0),
            b.leave_one_out_rms,
            simple.leave_one_out_rms
        );
    }
    let tested = format!(
        "These {} points, from {slow:.4} {velocity} on,",
        points.len()
    );
    if b.breakaway_excess < 0.0 && p < 0.05 {
        return format!(
            "{tested} do not warrant a Stribeck term: friction is lower at low speed than Coulomb and viscous friction say (p = {p:.1e}), which no Stribeck law does; look at the torque's limits and at the motion's clock."
        );
    }
    let untold = "a Stribeck velocity below the slowest speed would not show";
    let less = if p >= law::WARRANT {
        format!("(p = {})", format_significant(p, 2))
    } else {
        // The F-test alone accepts the term, so the text names the failed criterion.
        format!(
            "(p = {p:.1e}, but its size is less certain than it is large, or points left out are predicted no better: {} against {} {torque})",
            format_significant(b.leave_one_out_rms, 3),
            format_significant(simple.leave_one_out_rms, 3)
        )
    };
    format!(
        "{tested} do not warrant a Stribeck term beside Coulomb and viscous friction {less}; {untold}."
    )
}
