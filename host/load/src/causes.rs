//! Why readings do not fit a rigid load as described: every cause that is known is fitted, and all are compared with what
//! the noise would leave.
//!
//! A cause is believed if it leaves about the noise, leaves decisively less than the description does, and no cause with
//! fewer unknowns leaves as little. An exchange of channels has no unknown, another unit or gain has one, a turned
//! sensor three.

use std::f64::consts::FRAC_PI_2;

use rig_identify::f_p_value;
use rig_model::robot::{Reads, WristSensor};

use crate::candidates::{exchanged, exchanged_and_scaled, scaled, turned};
use crate::error::LoadError;
use crate::mounting::{Channels, Mounting};
use crate::pose_noise::Scatter;
use crate::rows::LEAST_ROWS;
use crate::selection::{Selected, selected};
use crate::settle::{DECISIVE, settled};
use crate::statistics::noise_floor;
use crate::system::{Fit, Nuisance, Sensed, Unknowns};
use crate::units::named;

/// Residual-to-noise RMS ratio up to which a fit leaves about the noise: noise that is slower than white raises the
/// residual in the band. The estimators of wrong causes leave 4 to 100 times the noise.
const ABOUT: f64 = 2.0;
/// Residual as a share of what the readings change by, up to which a fit counts as exact: sensors resolve no less.
const EXACT: f64 = 1e-3;
/// The same for poses, unless they leave about their noise: a wrong cause leaves half of the readings or more.
const EXPLAINED: f64 = 0.22;
/// Ratio to the least residual of the forces beyond which a cause is not looked at further. Delays, leaning bases and jumps
/// change what all causes leave.
const HOPELESS: f64 = 10.0;
/// Share of the segments in which a cause must leave less than the description.
const NEARLY_ALL: f64 = 0.9;

/// Distance of the sensor's origin from the described one that is no error of a measurement, m: a wrist sensor with its
/// flanges is shorter.
const FARTHEST: f64 = 0.3;
/// Factor beside a scale that must be told from it.
const BESIDE: f64 = 1.1;

/// Probability by chance below which a gain of a channel of poses is looked at.
const BY_CHANCE: f64 = 1e-3;
/// Probability by chance below which the residual at rest is more than the noise of the rows of the poses.
const BEYOND_BY_CHANCE: f64 = 1e-4;

/// Why readings are not those of a load as described.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cause {
    /// They are, with properties of sensor and base that are small.
    Described,
    /// Channels are exchanged or reversed.
    Channels(Channels),
    /// The moments have another unit than the forces.
    Scale,
    /// The sensor is turned by any angle.
    Turned,
    /// Both.
    ScaleAndTurned,
    /// Channels are exchanged or reversed, and the moments have another unit.
    ScaleAndChannels(Channels),
    /// A channel reads its noise, and nothing of the load.
    Dead(usize),
    /// A channel reads the load with another gain.
    Gain(usize),
    /// Gravity points the other way: the robot hangs.
    Hanging,
}

impl Cause {
    /// Returns true if another cause is of the same kind, with another scale of the moments beside it.
    fn is_scaled_by(&self, other: &Self) -> bool {
        matches!(
            (self, other),
            (Self::Channels(_), Self::ScaleAndChannels(_)) | (Self::Turned, Self::ScaleAndTurned)
        )
    }
}

/// A cause that was fitted.
pub(crate) struct Tried {
    pub cause: Cause,
    /// The mounting as described, with channels put right.
    pub start: Mounting,
    /// Fit with everything that the readings show then.
    pub selected: Selected,
    /// Misfit with a penalty for each unknown; smaller is better.
    pub score: f64,
}

/// What was compared.
pub(crate) struct Compared {
    /// The readings as described.
    pub described: Tried,
    /// Causes that explain the readings, those with the fewest unknowns first. Empty if the description explains them, or
    /// nothing does.
    pub causes: Vec<Tried>,
    /// Delay by the fit that is nearest to the readings so far, s.
    pub delay: Option<f64>,
    /// Score of columns put right that explain poses; infinite if there are none.
    pub columns: f64,
}

impl Compared {
    /// Returns the least score of all that was compared.
    pub(crate) fn least(&self) -> f64 {
        let all = self.causes.iter().chain([&self.described]);
        all.map(|own| own.score).fold(self.columns, f64::min)
    }
}

/// Fits the equations as described, and by every cause for which they may not fit.
///
/// # Errors
/// [`LoadError::TooFew`].
pub(crate) fn compared(sensed: &Sensed, sensor: &WristSensor) -> Result<Compared, LoadError> {
    let unknowns = Unknowns {
        tool: sensed.recordings.iter().any(|r| !r.loaded),
        ..Unknowns::default()
    };
    let rows = sensed.used_rows(&unknowns);
    if (rows as usize) < LEAST_ROWS {
        return Err(LoadError::TooFew {
            rows: rows as usize,
            least: LEAST_ROWS,
        });
    }
    let sign = sensor.reads.unwrap_or(Reads::Load).sign();
    let mounting = Mounting::of(sign);
    Ok(compare(
        sensed,
        &mounting,
        &unknowns,
        sensor.reads.is_some(),
    ))
}

/// Fits every cause and compares them.
fn compare(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    sign_stated: bool,
) -> Compared {
    let plain = sensed.fit(mounting, unknowns);
    let trial = Trial {
        sensed,
        mounting,
        plain: &plain,
    };
    let described = trial.taken_in(Cause::Described, mounting, plain.clone());
    if let Some(hangs) = trial.hanging_instead(&described, unknowns, sign_stated) {
        return Compared {
            delay: sensed.delay(&hangs.selected.fit),
            causes: vec![hangs],
            described,
            columns: f64::INFINITY,
        };
    }
    let fit = &described.selected.fit;
    // Jumps of the bias and a wrong position of the sensor can stand for other causes.
    let is_plain = fit.unknowns.jumps.is_empty() && !fit.unknowns.has(Nuisance::Origin);
    let is_certain = noise_floor(sensed.recordings).is_some() && is_plain;
    if sensed.is_exact(fit) || is_certain && explains(sensed, fit) {
        let delay = sensed.delay(fit);
        return Compared {
            described,
            causes: Vec::new(),
            delay,
            columns: f64::INFINITY,
        };
    }
    let mut all = trial.causes(unknowns, sign_stated);
    all.retain(|own| own.score.is_finite() && trial.is_no_chance(own));
    let nearest = all.iter().min_by(|a, b| a.score.total_cmp(&b.score));
    let nearest = nearest.filter(|own| own.score < described.score - DECISIVE);
    let delay = sensed.delay(&nearest.unwrap_or(&described).selected.fit);
    all.retain(|own| explains(sensed, &own.selected.fit));
    let is_described = explains(sensed, &described.selected.fit);
    let has_jumps = !described.selected.fit.unknowns.jumps.is_empty();
    if noise_floor(sensed.recordings).is_some() && is_described && !has_jumps {
        return displaced_or_scaled(sensed, described, all, delay);
    }
    let least = (all.iter().map(|own| own.score)).fold(f64::INFINITY, f64::min);
    all.retain(|own| own.score <= least + DECISIVE);
    if is_described && described.score <= least + DECISIVE {
        all.clear();
    }
    all.retain(|own| {
        own.score < described.score - DECISIVE
            && leaves_less(
                (sensed, &own.selected.fit),
                (sensed, &described.selected.fit),
            )
    });
    Compared {
        causes: without_special_cases(sensed, all),
        described,
        delay,
        columns: f64::INFINITY,
    }
}

/// Decides between another position of the sensor, by which the description leaves the noise, and another scale of the
/// moments. The scale is believed if it is that of a unit, and the readings tell it from others near by: another position
/// would be so by chance only. It is believed too if the position would lie further from the described one than a caliper
/// or drawing is wrong.
fn displaced_or_scaled(
    sensed: &Sensed,
    mut described: Tried,
    all: Vec<Tried>,
    delay: Option<f64>,
) -> Compared {
    let as_good = |own: &Tried| own.score <= described.score + DECISIVE;
    // An exchange or a sign that needs neither has no unknown at all.
    let is_plain = |own: &Tried| {
        let fit = &own.selected.fit.unknowns;
        matches!(own.cause, Cause::Channels(_))
            && !fit.has(Nuisance::Origin)
            && !fit.has(Nuisance::Rotation)
    };
    let mut all: Vec<Tried> = all.into_iter().filter(as_good).collect();
    if let Some(at) = all.iter().position(is_plain) {
        return Compared {
            causes: vec![all.remove(at)],
            described,
            delay,
            columns: f64::INFINITY,
        };
    }
    // A channel alone has one unknown, a position three. It stands for no other unit, as long as it needs no position that
    // is none.
    let is_channel = |own: &Tried| {
        matches!(own.cause, Cause::Dead(_) | Cause::Gain(_))
            && own.score < described.score - DECISIVE
            && !is_far(sensed, own)
    };
    if all.iter().any(is_channel) {
        all.retain(is_channel);
        all.sort_by(|a, b| a.score.total_cmp(&b.score));
        let only = without_special_cases(sensed, all);
        return Compared {
            causes: only,
            described,
            delay,
            columns: f64::INFINITY,
        };
    }
    // A turned sensor that is found from the described rotation is a property beside the description.
    let of = |cause: &Cause| all.iter().position(|own| own.cause == *cause);
    let place = of(&Cause::Scale).or_else(|| of(&Cause::ScaleAndTurned));
    let scale = place.map(|at| all.remove(at));
    let causes = match scale {
        Some(own) if is_far(sensed, &described) || is_unit(sensed, &own) => vec![own],
        Some(own) => {
            described.selected.add_scale(sensed, &own.selected.fit);
            Vec::new()
        }
        None => Vec::new(),
    };
    Compared {
        described,
        causes,
        delay,
        columns: f64::INFINITY,
    }
}

/// Returns true if the scale of the moments is that of a unit, and scales 10 % beside it leave decisively more.
fn is_unit(sensed: &Sensed, tried: &Tried) -> bool {
    let fit = &tried.selected.fit;
    let fixed = fit.unknowns.without(Nuisance::Scale);
    let is_worse = |factor: f64| {
        settled(sensed, &fit.mounting.scaled(factor), &fixed).misfit() > fit.misfit() + DECISIVE
    };
    [1.0 / BESIDE, BESIDE].into_iter().all(is_worse) && !named(sensed, fit).is_empty()
}

/// Decides, for each cause that needs another position of the sensor, between it and one of its kind with another scale of
/// the moments, as [`displaced_or_scaled`] does for the description.
fn decide_scales(sensed: &Sensed, all: &mut Vec<Tried>) {
    let mut at = 0;
    while at < all.len() {
        let own = &all[at];
        let scaled: Vec<&Tried> = (all.iter())
            .filter(|other| own.cause.is_scaled_by(&other.cause))
            .filter(|_| own.selected.fit.unknowns.has(Nuisance::Origin))
            .collect();
        let Some(best) = scaled
            .iter()
            .min_by(|a, b| a.score.total_cmp(&b.score))
            .map(|best| best.selected.fit.clone())
        else {
            at += 1;
            continue;
        };
        if is_far(sensed, own) || scaled.iter().any(|other| is_unit(sensed, other)) {
            all.remove(at);
        } else {
            all[at].selected.add_scale(sensed, &best);
            at += 1;
        }
    }
}

/// Returns true if a cause needs the sensor further from its described position than a caliper or drawing is wrong.
fn is_far(sensed: &Sensed, tried: &Tried) -> bool {
    let error = sensed.origin(&tried.selected.fit);
    error.is_some_and(|error| error.norm() > FARTHEST)
}

/// Drops causes of which a special case explains as much, and sorts them by their unknowns. An exchange of channels with a
/// turned sensor is no special case of a turned sensor.
fn without_special_cases(sensed: &Sensed, mut all: Vec<Tried>) -> Vec<Tried> {
    let has = |all: &[Tried], cause: &Cause| all.iter().any(|own| own.cause == *cause);
    let is_opposite =
        |own: &Tried| matches!(&own.cause, Cause::Channels(c) if c.is_opposite_rotation());
    let is_scaled = has(&all, &Cause::Scale);
    decide_scales(sensed, &mut all);
    let is_turned = has(&all, &Cause::Turned);
    let is_mirrored = all.iter().any(is_opposite);
    let is_exchanged = (all.iter()).any(|own| matches!(own.cause, Cause::Channels(_)));
    let is_special =
        (all.iter()).any(|own| matches!(own.cause, Cause::Channels(_) | Cause::Dead(_)));
    all.retain(|own| match own.cause {
        Cause::ScaleAndTurned => !is_turned && !is_scaled,
        Cause::ScaleAndChannels(_) => !is_turned && !is_scaled && !is_exchanged,
        Cause::Turned => !is_mirrored,
        // Nothing and the opposite are gains, too.
        Cause::Gain(_) => !is_special,
        Cause::Channels(_) => !is_turned || !own.selected.fit.unknowns.has(Nuisance::Rotation),
        _ => true,
    });
    let order = |own: &Tried| match own.cause {
        Cause::Described => 0,
        // Neither has an unknown.
        Cause::Channels(_) | Cause::Hanging => 1,
        Cause::Scale => 2,
        Cause::Turned => 3,
        Cause::ScaleAndTurned => 4,
        Cause::ScaleAndChannels(_) => 5,
        Cause::Dead(_) => 6,
        Cause::Gain(_) => 7,
    };
    all.sort_by(|a, b| order(a).cmp(&order(b)).then(a.score.total_cmp(&b.score)));
    // Of exchanges that explain as much, the one nearest to the file is meant.
    let (mut is_first, mut is_first_scaled) = (true, true);
    all.retain(|own| match own.cause {
        Cause::Channels(_) => std::mem::take(&mut is_first),
        Cause::ScaleAndChannels(_) => std::mem::take(&mut is_first_scaled),
        _ => true,
    });
    all
}

/// Returns true if a fit leaves about the noise.
pub(crate) fn explains(sensed: &Sensed, fit: &Fit) -> bool {
    let share = sensed.share(fit);
    let residual = fit.noise;
    match noise_floor(sensed.recordings) {
        Some(noise) => (0..2).all(|k| residual[k] <= ABOUT * noise[k] || share[k] <= EXACT),
        None => explains_poses(sensed, fit, share),
    }
}

/// Returns true if a fit of poses leaves a small share of what the forces and what the moments read, or about their noise: a
/// load whose centre of mass is near the sensor has moments that are noise. The rows of the poses tell the noise; without
/// them forces and moments tell it of each other.
fn explains_poses(sensed: &Sensed, fit: &Fit, share: [f64; 2]) -> bool {
    let is_small = |kind: usize| share[kind] <= EXPLAINED;
    let by_other = |kind: usize| {
        let other = 1 - kind;
        let own = [1.0 / sensed.lever, sensed.lever][kind];
        is_small(other).then_some(fit.noise[other] * own)
    };
    let rows = scatter(sensed).noise();
    let is_noise = |kind: usize| {
        let noise = rows.map_or_else(|| by_other(kind), |(noise, _)| Some(noise[kind]));
        noise.is_some_and(|noise| fit.noise[kind] <= ABOUT * noise)
    };
    (0..2).all(|kind| is_small(kind) || is_noise(kind))
}

/// Returns −2·ln of the likelihood with the noise by degrees of freedom, each unknown counted as the information criterion of
/// Schwarz (1978) does; infinite without a degree of freedom.
pub(crate) fn score(sensed: &Sensed, fit: &Fit) -> f64 {
    let is_still = sensed.recordings.iter().all(|r| r.poses);
    let bodies = 1 + usize::from(fit.unknowns.tool);
    // At rest the six inertias of a body are no unknowns.
    let hidden = if is_still { 6 * bodies } else { 0 };
    let unknowns = fit.values.len().saturating_sub(hidden) as f64;
    let equations = fit.equations as f64;
    let freedom = equations - unknowns;
    if freedom < 1.0 {
        return f64::INFINITY;
    }
    let unbiased = equations * (equations / freedom).ln();
    // Jumps leave out segments, so fits of unlike many equations are compared.
    let all = 6.0 * sensed.used_rows(&Unknowns::default()) as f64;
    (fit.misfit() + unbiased + unknowns * equations.ln()) * all / equations
}

/// What causes are tried on.
struct Trial<'a> {
    sensed: &'a Sensed<'a>,
    mounting: &'a Mounting,
    /// Fit as described, with nothing beside load and bias.
    plain: &'a Fit,
}

impl Trial<'_> {
    /// Takes in what the readings show beside a cause. `start` is the mounting without rotations.
    fn taken_in(&self, cause: Cause, start: &Mounting, fit: Fit) -> Tried {
        let selected = selected(self.sensed, fit, start);
        Tried {
            cause,
            start: start.clone(),
            score: score(self.sensed, &selected.fit),
            selected,
        }
    }

    /// Tries all causes beside the description that leave decisively less than it does with nothing else.
    fn causes(&self, unknowns: &Unknowns, sign_stated: bool) -> Vec<Tried> {
        let mut all = self.plain_causes(unknowns, sign_stated);
        all.retain(|(_, _, fit)| fit.misfit() < self.plain.misfit() - DECISIVE);
        // Neither another position of the sensor nor another unit of the moments changes what the forces leave.
        let forces = |fit: &Fit| fit.noise[0];
        let least = all.iter().map(|(_, _, fit)| forces(fit));
        let least = least.fold(forces(self.plain), f64::min);
        all.retain(|(_, _, fit)| forces(fit) <= HOPELESS * least);
        all.into_iter()
            .map(|(cause, start, fit)| self.taken_in(cause, &start, fit))
            .collect()
    }

    /// Fits all causes beside the description with load and bias alone.
    fn plain_causes(&self, unknowns: &Unknowns, sign_stated: bool) -> Vec<(Cause, Mounting, Fit)> {
        let (sensed, mounting) = (self.sensed, self.mounting);
        let mut all = Vec::new();
        for channels in exchanged(sensed, mounting, unknowns, sign_stated) {
            let start = mounting.after(&channels);
            let fit = sensed.fit(&start, unknowns);
            all.push((Cause::Channels(channels), start, fit));
        }
        all.extend(self.hanging(unknowns, sign_stated));
        let can_scale = sensed.recordings.iter().any(|r| !r.poses);
        let scaling = unknowns.with(Nuisance::Scale);
        if can_scale {
            let start = scaled(sensed, mounting, unknowns);
            let fit = settled(sensed, &start, &scaling);
            all.push((Cause::Scale, start, fit));
        }
        let pairs = match can_scale {
            true => exchanged_and_scaled(sensed, mounting, unknowns, sign_stated),
            false => Vec::new(),
        };
        for (channels, start) in pairs {
            let fit = settled(sensed, &start, &scaling);
            let start = mounting.after(&channels).scaled(start.scale);
            all.push((Cause::ScaleAndChannels(channels), start, fit));
        }
        for channel in 0..6 {
            let dead = mounting.with_gain(channel, 0.0);
            let fit = sensed.fit(&dead, unknowns);
            all.push((Cause::Dead(channel), dead.clone(), fit));
            // The other channels give the load, and the load the gain.
            let fit = settled(sensed, &dead, &unknowns.with(Nuisance::Gain(channel)));
            all.push((Cause::Gain(channel), dead, fit));
        }
        for start in turned(sensed, mounting) {
            let turning = unknowns.with(Nuisance::Rotation);
            let fit = settled(sensed, &start, &turning);
            all.push((Cause::Turned, mounting.clone(), fit));
            if can_scale {
                let start = scaled(sensed, &start, unknowns);
                let fit = settled(sensed, &start, &scaling.with(Nuisance::Rotation));
                all.push((Cause::ScaleAndTurned, mounting.scaled(start.scale), fit));
            }
        }
        all
    }

    /// Fits reversed gravity; `None` if the load would then have a negative mass by readings of a stated sign.
    fn hanging(&self, unknowns: &Unknowns, sign_stated: bool) -> Option<(Cause, Mounting, Fit)> {
        let mut start = self.sensed.reversed_gravity(self.mounting)?;
        let mut fit = self.sensed.fit(&start, unknowns);
        if fit.values.first().is_some_and(|mass| *mass < 0.0) {
            if sign_stated {
                return None;
            }
            start = start.opposite();
            fit = self.sensed.fit(&start, unknowns);
        }
        Some((Cause::Hanging, start, fit))
    }

    /// Returns reversed gravity if the description explains the readings only with a base that leans by more than a right angle,
    /// and reversed gravity does as well without a lean: a robot that hangs, which has no unknown.
    fn hanging_instead(
        &self,
        described: &Tried,
        unknowns: &Unknowns,
        sign_stated: bool,
    ) -> Option<Tried> {
        if described.selected.fit.mounting.gravity.angle() < FRAC_PI_2 {
            return None;
        }
        let (cause, start, fit) = self.hanging(unknowns, sign_stated)?;
        let own = self.taken_in(cause, &start, fit);
        let fit = &own.selected.fit;
        let is_as_good = own.score <= described.score + DECISIVE && explains(self.sensed, fit);
        (is_as_good && !fit.unknowns.has(Nuisance::Lean)).then_some(own)
    }

    /// Returns true unless a gain of a channel of poses leaves less by chance (F test for the channels of its kind, all six
    /// channels together). Few poses leave few degrees of freedom, and an exact fit none.
    fn is_no_chance(&self, tried: &Tried) -> bool {
        let (Cause::Dead(channel) | Cause::Gain(channel)) = tried.cause else {
            return true;
        };
        if self.sensed.recordings.iter().any(|r| !r.poses) {
            return true;
        }
        let fit = &tried.selected.fit;
        let kind = channel / 3;
        let bodies = 1.0 + f64::from(u8::from(fit.unknowns.tool));
        // The forces show the mass, the moments the three first moments.
        let own = [1.0, 3.0][kind] * bodies + 3.0 * self.sensed.recordings.len() as f64;
        let freedom = 0.5 * fit.equations as f64 - own - 1.0;
        let [before, after] = [self.plain, fit].map(|fit| fit.squares[kind]);
        let ratio = (before - after) * freedom / after.max(f64::MIN_POSITIVE);
        f_p_value(ratio, [1.0, freedom]).is_some_and(|p| 6.0 * p < BY_CHANCE)
    }
}

/// Returns true if a fit leaves less than another in nearly all segments of a motion that both use. Each stands beside the
/// recordings that it was made of.
pub(crate) fn leaves_less(
    (sensed, fit): (&Sensed, &Fit),
    (others, other): (&Sensed, &Fit),
) -> bool {
    if sensed.recordings.iter().any(|r| r.poses) {
        return true;
    }
    let [own, others] = [(sensed, fit), (others, other)].map(|(s, f)| s.squares_by_segment(f));
    let over = |s: &[f64; 2]| s[0] / fit.noise[0].powi(2) + s[1] / fit.noise[1].powi(2);
    let pairs = own.iter().filter_map(|(at, a)| Some((a, others.get(at)?)));
    let is_less: Vec<bool> = pairs.map(|(a, b)| over(a) < over(b)).collect();
    let less = is_less.iter().filter(|is_less| **is_less).count();
    less as f64 >= NEARLY_ALL * is_less.len() as f64
}

/// Returns how the rows of the poses of all recordings differ.
pub(crate) fn scatter(sensed: &Sensed) -> Scatter {
    let recordings = sensed.recordings.iter();
    recordings.fold(Scatter::default(), |sum, own| sum.and(own.passed.scatter))
}

/// Returns true if the rows of the poses tell their noise, and the residual is no such noise of the mean readings by chance
/// (F test).
pub(crate) fn is_beyond_scatter(sensed: &Sensed, fit: &Fit) -> bool {
    let Some((noise, freedom)) = scatter(sensed).noise() else {
        return false;
    };
    let own = (0.5 * fit.freedom()).max(1.0);
    let is_more = |kind: usize| {
        let ratio = (fit.noise[kind] / noise[kind].max(f64::MIN_POSITIVE)).powi(2);
        f_p_value(ratio, [own, freedom]).is_some_and(|p| 2.0 * p < BEYOND_BY_CHANCE)
    };
    is_more(0) || is_more(1)
}
