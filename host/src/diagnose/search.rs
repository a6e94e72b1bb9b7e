//! Which effect, one after the other: profile, evidence, gates; then joint refinement, removal and exchange.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rig_shared::effects::{Channel, Kind, SHAPES, Scale};

use super::DiagnoseError;
use super::columns::{Candidate, Source};
use super::fit::{Evidence, Fit};
use super::rows::Column;

/// Family-wise probability of a name although nothing is there.
pub(super) const SIGNIFICANT: f64 = 0.01;
/// Least share of the RMS that an effect must take away on folds it was not fitted to.
pub(super) const LEAST_GAIN: f64 = 0.02;
/// … and that many standard deviations of it.
pub(super) const LEAST_SIGMAS: f64 = 2.0;
/// Least gain of a gear's law, whose three or four shapes bend to much that is not a gear.
const LEAST_GAIN_OF_GEARS: f64 = 0.1;
/// A candidate that explains less than this share of the squares at every point of its grid cannot reach the least gain.
const HOPELESS: f64 = 0.5 * LEAST_GAIN;
/// … and a gear, from whose starting points the ridge is further away.
const HOPELESS_GEAR: f64 = 0.02;
/// An effect in the model stays while its own probability is below this.
const STAYS: f64 = 1e-3;
/// Most effects.
const MOST_EFFECTS: usize = 6;
/// Points of a grid per decade of a logarithmic range.
const PER_DECADE: f64 = 4.0;
/// Points of a linear range, most.
const MOST_POINTS: usize = 96;
/// Stiffness (N·m/rad) and damping (N·m·s/rad) of teeth that the search for play begins with.
const SOFT_TEETH: [f64; 2] = [1500.0, 15.0];
/// Starting points that are followed up.
const FOLLOWED: usize = 3;
/// Steps of the simplex.
const SIMPLEX_STEPS: usize = 80;
/// Golden-section steps of the refinement.
const REFINEMENTS: usize = 14;

/// Share explained, shapes, columns.
type Best = (f64, [f64; SHAPES], Arc<Vec<Column>>);

/// A candidate at its best shapes.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// Which.
    pub(super) candidate: Candidate,
    /// Its shapes.
    pub(super) shapes: [f64; SHAPES],
    /// Its columns.
    pub(super) columns: Arc<Vec<Column>>,
    /// What they do.
    pub(super) evidence: Evidence,
}

impl Profile {
    /// Why it is not taken at a p-value corrected for `tried` trials; none where it passes.
    pub(super) fn refused(&self, tried: usize) -> Option<String> {
        let e = &self.evidence;
        let p = self.corrected(tried);
        if p > SIGNIFICANT {
            Some(format!("p = {p:.2}, corrected for {tried} trials"))
        } else if e.joint_gain < self.least_gain() {
            Some(format!(
                "takes away {:.1} % of the residual, less than {:.0} %",
                100.0 * e.joint_gain,
                100.0 * self.least_gain()
            ))
        } else if e.gain_sigmas < LEAST_SIGMAS {
            Some(format!(
                "its gain is only {:.1} of its standard deviations",
                e.gain_sigmas
            ))
        } else {
            None
        }
    }

    fn least_gain(&self) -> f64 {
        if self.candidate.kind.about().channel == Channel::Transmission {
            LEAST_GAIN_OF_GEARS
        } else {
            LEAST_GAIN
        }
    }

    /// p-value corrected for `tried` trials.
    pub(super) fn corrected(&self, tried: usize) -> f64 {
        (self.evidence.p_value * tried as f64).min(1.0)
    }
}

/// The search over a library.
pub(super) struct Search<'a> {
    /// What columns are formed from.
    pub(super) source: Source<'a>,
    /// Candidates.
    pub(super) library: Vec<Candidate>,
    /// Threads.
    pub(super) threads: usize,
    cache: Mutex<HashMap<(usize, usize), Arc<Vec<Column>>>>,
}

/// Where the search for a gear's shapes begins. With play the fit has a narrow ridge along gap and friction and many false
/// tops where contact chatters: teeth that are taken as soft and damped show the ridge alone.
fn starts(kind: Kind) -> Vec<[f64; SHAPES]> {
    let mut list = Vec::new();
    let shapes = kind.about().shapes;
    let [low, high] = shapes[0].range;
    const STEPS: usize = 11;
    for k in 0..=STEPS {
        let first = low * (high / low).powf(k as f64 / STEPS as f64);
        for share in [0.05, 0.25, 0.5, 0.9] {
            list.push(if kind == Kind::Backlash {
                [first, SOFT_TEETH[0], SOFT_TEETH[1], share]
            } else {
                // A few per cent of critical damping for a tenth of a kg·m².
                [first, 0.1 * (0.1 * first).sqrt(), share, 0.0]
            });
        }
    }
    list
}

/// Grid of shapes of an effect.
pub(super) fn grid(kind: Kind) -> Vec<[f64; SHAPES]> {
    if kind.about().channel == Channel::Transmission {
        return starts(kind);
    }
    let shapes = kind.about().shapes;
    let mut points = vec![[0.0; SHAPES]];
    for (place, shape) in shapes.iter().enumerate() {
        let [low, high] = shape.range;
        let values: Vec<f64> = match shape.scale {
            Scale::Logarithmic => {
                let n = ((high / low).log10() * PER_DECADE / shapes.len() as f64)
                    .ceil()
                    .max(1.0);
                (0..=n as usize)
                    .map(|k| low * (high / low).powf(k as f64 / n))
                    .collect()
            }
            Scale::Linear => {
                // Orders are whole; anything else linear is stepped through.
                let whole = (high - low).floor() as usize + 1;
                if whole <= MOST_POINTS && low.fract() == 0.0 {
                    (0..whole).map(|k| low + k as f64).collect()
                } else {
                    (0..=8)
                        .map(|k| low + (high - low) * f64::from(k) / 8.0)
                        .collect()
                }
            }
        };
        points = points
            .into_iter()
            .flat_map(|point| {
                values.iter().map(move |v| {
                    let mut point = point;
                    point[place] = *v;
                    point
                })
            })
            .collect();
    }
    points
}

impl<'a> Search<'a> {
    /// A search.
    pub(super) fn new(source: Source<'a>, library: Vec<Candidate>, threads: usize) -> Self {
        Self {
            source,
            library,
            threads,
            cache: Mutex::new(HashMap::new()),
        }
    }

    /// Takes a source with another model's predictions; columns that depend on them are forgotten.
    fn renewed(&mut self, source: Source<'a>) {
        self.source = source;
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        cache.retain(|(c, _), _| !depends_on_model(self.library[*c].kind));
    }

    /// Columns of a point of a candidate's grid.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn cached(
        &self,
        c: usize,
        point: usize,
        shapes: &[f64; SHAPES],
    ) -> Result<Arc<Vec<Column>>, DiagnoseError> {
        let key = (c, point);
        let held = |cache: &Mutex<HashMap<(usize, usize), Arc<Vec<Column>>>>| {
            cache
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .get(&key)
                .cloned()
        };
        if let Some(columns) = held(&self.cache) {
            return Ok(columns);
        }
        let columns = Arc::new(self.source.columns(&self.library[c], shapes)?);
        self.cache
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .insert(key, columns.clone());
        Ok(columns)
    }

    /// Share of the residual that a candidate's columns explain.
    fn explained(&self, fit: &Fit, c: usize, columns: &[Column]) -> Option<f64> {
        let bounds = self.bounds(self.library[c].kind);
        let (share, _) = fit.explained(&fit.beside(columns)?, &bounds)?;
        Some(share)
    }

    /// A candidate at its best shapes; none where it is no column of its own or its signs are impossible.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn profile(
        &self,
        fit: &Fit,
        c: usize,
        start: Option<[f64; SHAPES]>,
    ) -> Result<Option<Profile>, DiagnoseError> {
        let kind = self.library[c].kind;
        let points = grid(kind);
        let mut best: Option<Best> = None;
        let gear = kind.about().channel == Channel::Transmission;
        let mut followed: Vec<Best> = Vec::new();
        if let Some(shapes) = start {
            let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
            if let Some(share) = self.explained(fit, c, &columns) {
                best = Some((share, shapes, columns));
            }
        } else {
            for (place, shapes) in points.iter().enumerate() {
                let columns = self.cached(c, place, shapes)?;
                let Some(share) = self.explained(fit, c, &columns) else {
                    continue;
                };
                if gear {
                    followed.push((share, *shapes, columns.clone()));
                    followed.sort_by(|a, b| b.0.total_cmp(&a.0));
                    followed.truncate(FOLLOWED);
                }
                if best.as_ref().is_none_or(|b| share > b.0) {
                    best = Some((share, *shapes, columns));
                }
            }
        }
        let Some(mut best) = best else {
            return Ok(None);
        };
        let about = kind.about();
        // One joint's share of the squares of all.
        let hopeless = if gear { HOPELESS_GEAR } else { HOPELESS };
        if best.0 * (self.source.nominal.joints() as f64) < hopeless {
            return Ok(None);
        }
        if gear {
            self.descend(fit, c, &mut best)?;
            for mut other in followed.into_iter().skip(1) {
                self.descend(fit, c, &mut other)?;
                if other.0 > best.0 {
                    best = other;
                }
            }
        }
        for _ in 0..if about.channel == Channel::Transmission {
            0
        } else if about.shapes.len() > 1 {
            2
        } else {
            1
        } {
            for (place, shape) in about.shapes.iter().enumerate() {
                if shape.scale == Scale::Linear {
                    // Whole orders: nothing between them.
                    continue;
                }
                self.refine(fit, c, place, &mut best)?;
            }
        }
        let Some(projected) = fit.distinct(&best.2) else {
            return Ok(None);
        };
        let Some(evidence) = fit.evidence(&projected, &self.bounds(kind)) else {
            return Ok(None);
        };
        Ok(Some(Profile {
            candidate: self.library[c],
            shapes: best.1,
            columns: best.2,
            evidence,
        }))
    }

    /// Nelder and Mead's simplex (1965) over the logarithms of all shapes at once: stiffness, damping and play pull on each
    /// other.
    fn descend(&self, fit: &Fit, c: usize, best: &mut Best) -> Result<(), DiagnoseError> {
        let scales = self.library[c].kind.about().shapes;
        let n = scales.len();
        let logarithmic = |k: usize| scales[k].scale == Scale::Logarithmic;
        let start: Vec<f64> = (best.1[..n].iter().enumerate())
            .map(|(k, s)| if logarithmic(k) { s.ln() } else { *s })
            .collect();
        let mut at = |x: &[f64]| -> Result<f64, DiagnoseError> {
            let mut shapes = [0.0; SHAPES];
            for (k, (to, x)) in shapes.iter_mut().zip(x).enumerate() {
                let [low, high] = scales[k].bounds;
                *to = if logarithmic(k) { x.exp() } else { *x }.clamp(low, high);
            }
            let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
            let Some(share) = self.explained(fit, c, &columns) else {
                return Ok(0.0);
            };
            if share > best.0 {
                *best = (share, shapes, columns);
            }
            Ok(-share)
        };
        let mut simplex = vec![(at(&start)?, start.clone())];
        for k in 0..n {
            let mut x = start.clone();
            // Away from a bound.
            x[k] += if !logarithmic(k) && x[k] > 0.5 {
                -0.4
            } else {
                0.4
            };
            simplex.push((at(&x)?, x));
        }
        for _ in 0..SIMPLEX_STEPS {
            simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
            if simplex[n].0 - simplex[0].0 < 1e-4 * simplex[0].0.abs() {
                break;
            }
            let middle: Vec<f64> = (0..n)
                .map(|k| simplex[..n].iter().map(|s| s.1[k]).sum::<f64>() / n as f64)
                .collect();
            let along = |t: f64, worst: &[f64]| -> Vec<f64> {
                middle
                    .iter()
                    .zip(worst)
                    .map(|(m, w)| m + t * (w - m))
                    .collect()
            };
            let worst = simplex[n].1.clone();
            let x = along(-1.0, &worst);
            let f = at(&x)?;
            if f < simplex[0].0 {
                let far = along(-2.0, &worst);
                let g = at(&far)?;
                simplex[n] = if g < f { (g, far) } else { (f, x) };
            } else if f < simplex[n - 1].0 {
                simplex[n] = (f, x);
            } else {
                let near = along(if f < simplex[n].0 { -0.5 } else { 0.5 }, &worst);
                let g = at(&near)?;
                if g < simplex[n].0.min(f) {
                    simplex[n] = (g, near);
                } else {
                    let top = simplex[0].1.clone();
                    for s in &mut simplex[1..] {
                        let x: Vec<f64> =
                            s.1.iter().zip(&top).map(|(x, t)| 0.5 * (x + t)).collect();
                        *s = (at(&x)?, x);
                    }
                }
            }
        }
        Ok(())
    }

    /// Golden section over one logarithmic shape about the best point.
    fn refine(
        &self,
        fit: &Fit,
        c: usize,
        place: usize,
        best: &mut Best,
    ) -> Result<(), DiagnoseError> {
        let shapes_count = self.library[c].kind.about().shapes.len() as f64;
        let step = shapes_count / PER_DECADE * std::f64::consts::LN_10;
        let middle = best.1[place].ln();
        let (mut low, mut high) = (middle - step, middle + step);
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let at = |x: f64, best: &mut Best| -> Result<f64, DiagnoseError> {
            let mut shapes = best.1;
            shapes[place] = x.exp();
            let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
            let Some(share) = self.explained(fit, c, &columns) else {
                return Ok(f64::NEG_INFINITY);
            };
            if share > best.0 {
                *best = (share, shapes, columns);
            }
            Ok(share)
        };
        let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
        let (mut fa, mut fb) = (at(a, best)?, at(b, best)?);
        for _ in 0..REFINEMENTS {
            if fa > fb {
                (high, b, fb) = (b, a, fa);
                a = high - golden * (high - low);
                fa = at(a, best)?;
            } else {
                (low, a, fa) = (a, b, fb);
                b = low + golden * (high - low);
                fb = at(b, best)?;
            }
            if high - low < 0.01 {
                break;
            }
        }
        Ok(())
    }

    /// All candidates at their best, best gain first.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn sweep(
        &self,
        fit: &Fit,
        without: &[Candidate],
    ) -> Result<Vec<Profile>, DiagnoseError> {
        let next = AtomicUsize::new(0);
        let work = || -> Result<Vec<Profile>, DiagnoseError> {
            let mut found = Vec::new();
            loop {
                let c = next.fetch_add(1, Ordering::Relaxed);
                let Some(candidate) = self.library.get(c) else {
                    return Ok(found);
                };
                // A second law under one name is no second effect.
                if !is_first_law(candidate.kind) {
                    continue;
                }
                let taken = without.iter().any(|w| rivals(w, candidate));
                if taken {
                    continue;
                }
                found.extend(self.profile(fit, c, None)?);
            }
        };
        let mut profiles = Vec::new();
        std::thread::scope(|scope| {
            let others: Vec<_> = (1..self.threads.max(1))
                .map(|_| scope.spawn(work))
                .collect();
            let mut all = work()?;
            for other in others {
                match other.join() {
                    Ok(found) => all.extend(found?),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            profiles = all;
            Ok::<(), DiagnoseError>(())
        })?;
        profiles.sort_by(|a, b| {
            b.evidence
                .gain
                .total_cmp(&a.evidence.gain)
                .then_with(|| a.candidate.kind.cmp(&b.candidate.kind))
        });
        Ok(profiles)
    }

    /// What physics allows the gains to be.
    fn bounds(&self, kind: Kind) -> Vec<[f64; 2]> {
        self.source.gains(kind).iter().map(|g| g.bounds).collect()
    }

    /// Number of trials of a sweep.
    pub(super) fn trials(&self) -> usize {
        (self.library.iter())
            .filter(|c| is_first_law(c.kind))
            .map(|c| grid(c.kind).len())
            .sum()
    }

    /// Finds effects one by one. `base` holds the nominal columns; `told` hears of every sweep and of the effects in the
    /// model at that time; `renew` gives what columns are formed from once they are in.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn run<'f>(
        &mut self,
        base: &Fit<'f>,
        renew: &dyn Fn(&[Profile]) -> Result<Source<'a>, DiagnoseError>,
        told: &mut dyn FnMut(usize, &[Profile], &Fit<'f>),
    ) -> Result<Vec<Profile>, DiagnoseError> {
        let trials = self.trials();
        let mut chosen: Vec<Profile> = Vec::new();
        while chosen.len() < MOST_EFFECTS {
            let fit = with(base, &chosen, None);
            let present: Vec<Candidate> = chosen.iter().map(|p| p.candidate).collect();
            let profiles = self.sweep(&fit, &present)?;
            told(chosen.len(), &profiles, &fit);
            let Some(best) = first_to_take(profiles, trials) else {
                break;
            };
            let before = chosen.clone();
            chosen.push(best);
            self.settle(base, &mut chosen, trials)?;
            for _ in 0..2 {
                // Load and inertia as they are with the effects in; the columns that rest on them follow.
                self.renewed(renew(&chosen)?);
                self.refine_all(base, &mut chosen)?;
            }
            if same(&before, &chosen) {
                break;
            }
        }
        self.other_laws(base, &mut chosen)?;
        Ok(chosen)
    }

    /// What would stand in the place of the `i`-th effect beside all others, best first; gears only where a gear or what is
    /// taken for one stands there.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn alternatives(
        &self,
        base: &Fit,
        chosen: &[Profile],
        i: usize,
    ) -> Result<Vec<Profile>, DiagnoseError> {
        let fit = with(base, chosen, Some(i));
        let mut others: Vec<Candidate> = (chosen.iter().enumerate())
            .filter(|(k, _)| *k != i)
            .map(|(_, p)| p.candidate)
            .collect();
        let own = chosen[i].candidate.kind.about();
        others.push(chosen[i].candidate);
        if own.channel != Channel::Transmission {
            let like = |name: &str| own.confused.iter().any(|c| c.with == name);
            for candidate in &self.library {
                let about = candidate.kind.about();
                if about.channel == Channel::Transmission && !like(about.name) {
                    others.push(*candidate);
                }
            }
        }
        self.sweep(&fit, &others)
    }

    /// Another law under the same name where it does clearly better: it has more parameters to bend.
    fn other_laws(&self, base: &Fit, chosen: &mut [Profile]) -> Result<(), DiagnoseError> {
        for i in 0..chosen.len() {
            let fit = with(base, chosen, Some(i));
            let present = chosen[i].candidate;
            for (c, candidate) in self.library.iter().enumerate() {
                if !rivals(candidate, &present) || candidate.kind == present.kind {
                    continue;
                }
                if let Some(rival) = self.profile(&fit, c, None)?
                    && rival.evidence.joint_gain > chosen[i].evidence.joint_gain + LEAST_GAIN
                {
                    chosen[i] = rival;
                }
            }
        }
        Ok(())
    }

    /// Refines all shapes together, drops what no longer stands by itself, exchanges what something else does better.
    fn settle(
        &self,
        base: &Fit,
        chosen: &mut Vec<Profile>,
        trials: usize,
    ) -> Result<(), DiagnoseError> {
        for _ in 0..2 {
            self.refine_all(base, chosen)?;
        }
        // Stand-ins go once the true effect is in.
        let mut i = 0;
        while chosen.len() > 1 && i < chosen.len() {
            let e = &chosen[i].evidence;
            if e.p_value > STAYS || e.joint_gain < LEAST_GAIN || e.gain_sigmas < LEAST_SIGMAS {
                chosen.remove(i);
                self.refine_all(base, chosen)?;
                i = 0;
            } else {
                i += 1;
            }
        }
        // Something else in the place of an effect that was taken before the last.
        if chosen.len() > 1 {
            for i in 0..chosen.len() - 1 {
                let fit = with(base, chosen, Some(i));
                let others: Vec<Candidate> = (chosen.iter().enumerate())
                    .filter(|(k, _)| *k != i)
                    .map(|(_, p)| p.candidate)
                    .collect();
                let rival = self
                    .sweep(&fit, &others)?
                    .into_iter()
                    .find(|p| p.refused(trials).is_none());
                if let Some(rival) = rival
                    && rival.candidate != chosen[i].candidate
                    && rival.evidence.gain > chosen[i].evidence.gain
                {
                    chosen[i] = rival;
                    self.refine_all(base, chosen)?;
                }
            }
        }
        Ok(())
    }

    /// Each effect's shapes beside all others; its evidence beside all others.
    fn refine_all(&self, base: &Fit, chosen: &mut [Profile]) -> Result<(), DiagnoseError> {
        for i in 0..chosen.len() {
            let fit = with(base, chosen, Some(i));
            let c = (self.library.iter()).position(|l| *l == chosen[i].candidate);
            let Some(c) = c else { continue };
            if let Some(better) = self.profile(&fit, c, Some(chosen[i].shapes))? {
                chosen[i] = better;
            } else {
                // No column of its own any more.
                chosen[i].evidence.gain = 0.0;
                chosen[i].evidence.joint_gain = 0.0;
                chosen[i].evidence.p_value = 1.0;
            }
        }
        Ok(())
    }
}

/// The best that passes; of two transmissions the one without play unless play takes away clearly more.
fn first_to_take(profiles: Vec<Profile>, trials: usize) -> Option<Profile> {
    let mut passing = profiles.into_iter().filter(|p| p.refused(trials).is_none());
    let best = passing.next()?;
    if best.candidate.kind == Kind::Backlash {
        let simpler = passing.find(|p| {
            p.candidate.kind == Kind::JointElasticity && p.candidate.joint == best.candidate.joint
        });
        if let Some(simpler) = simpler
            && simpler.evidence.joint_gain + LEAST_GAIN > best.evidence.joint_gain
        {
            return Some(simpler);
        }
    }
    Some(best)
}

fn same(a: &[Profile], b: &[Profile]) -> bool {
    a.len() == b.len()
        && a.iter()
            .all(|p| b.iter().any(|q| q.candidate == p.candidate))
}

/// The nominal columns with those of the effects, but for one.
pub(super) fn with<'f>(base: &Fit<'f>, chosen: &[Profile], but: Option<usize>) -> Fit<'f> {
    let mut fit = base.clone();
    for (k, profile) in chosen.iter().enumerate() {
        if Some(k) == but {
            continue;
        }
        for column in profile.columns.iter() {
            fit.push(column);
        }
    }
    fit
}

/// Whether two candidates exclude each other: one name twice on a joint, or two transmissions.
pub(super) fn rivals(a: &Candidate, b: &Candidate) -> bool {
    let (x, y) = (a.kind.about(), b.kind.about());
    let one = x.name == y.name
        || x.channel == Channel::Transmission && y.channel == Channel::Transmission;
    one && a.joint == b.joint && a.other == b.other
}

/// Whether a kind is the law that its name is searched by; others take its place only where they do better.
pub(super) fn is_first_law(kind: Kind) -> bool {
    Kind::named(kind.about().name, None) == Some(kind)
        // Rings of motor and joint are at different places, not different laws.
        || kind == Kind::EncoderEccentricityJoint
        || kind == Kind::ViscousWarmupTemperature
}

/// Whether an effect's columns depend on what the model predicts.
fn depends_on_model(kind: Kind) -> bool {
    let about = kind.about();
    matches!(
        about.channel,
        Channel::Position | Channel::Effort | Channel::Transmission
    ) || matches!(
        about.name,
        "load_friction" | "torque_ripple" | "torque_saturation" | "gravity_tilt"
    )
}
