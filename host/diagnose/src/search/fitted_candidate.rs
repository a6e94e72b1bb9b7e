//! Fit of a candidate's shapes, and the tests for its acceptance.

mod shapes;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use crate::DiagnoseError;
use crate::columns::effect_columns::{Candidate, Source};
use crate::columns::transmission::ABREAST;
use crate::fit::least_squares::{Evidence, Fit, dot_self};
use crate::fit::simplex::{MOST_ANSWERS, Simplex};
use crate::recordings::torque_lead::sampling_jitter;
use crate::rows::regression::{Column, combined};
use crate::search::fitted_candidate::shapes::{
    at_bound, coordinate, is_distance, searched, spacing, value_at,
};
pub(crate) use crate::search::fitted_candidate::shapes::{
    falls_throughout, goes_straight, grid, grid_on, is_straight,
};
use crate::search::stepwise::{Search, is_gear};

/// Least share of the twist torque of mass and load that a gear must have. True gears of the emulated rig give 0.7 to
/// 1.1. A wide backlash with a third can replace a tilted base.
const LEAST_OF_A_TWIST: f64 = 0.5;
/// The same for an elastic gear: a soft one, whose swing the motor motion predicts only briefly, gave 0.49.
const LEAST_OF_A_SPRINGS_TWIST: f64 = 0.4;
/// Family-wise significance level of an effect.
pub(crate) const SIGNIFICANT: f64 = 0.01;
/// Least RMS share that an effect must remove on folds outside its fit (its gain).
pub(crate) const LEAST_GAIN: f64 = 0.02;
/// Least ratio of the gain to its standard deviation.
const LEAST_SIGMAS: f64 = 2.0;
/// Least gain beside a near-collinear effect. Both have one form only, so a model without it leaves less.
const LEAST_GAIN_BESIDE_ITS_DOUBLE: f64 = 0.0075;
/// Least ratio of such a small gain to its standard deviation.
const LEAST_SIGMAS_BESIDE_ITS_DOUBLE: f64 = 3.0;
/// Gain that is real even if it varies strongly between blocks. Noise alone gave a fifth: on an elastic link, for a
/// motion with dwells.
const MUCH: f64 = 0.3;
/// The same for an elastic gear, which may ring in few blocks. Not for backlash: it fits a single contact.
const MUCH_OF_A_SPRING: f64 = 0.5;
/// Least ratio of such a gain to its standard deviation: an effect at the highest torque shows in few blocks.
const LEAST_SIGMAS_OF_MUCH: f64 = 1.0;
/// Standard deviations of the sign test over blocks that suffice instead, as a few loud blocks hide the variation.
const SIGNS: f64 = 3.0;
/// Least gain of a gear: its three or four shapes fit much that is no gear.
const LEAST_GAIN_OF_GEARS: f64 = 0.1;
/// Least gain of a backlash that the observer supports.
const LEAST_GAIN_OF_HEARD: f64 = 0.05;
/// Least ratio of the gain to its standard deviation for trying the observer on it.
const CLEAR_SIGMAS: f64 = 4.0;
/// A candidate whose explained share of the squares is lower at every grid point cannot reach the least gain.
const HOPELESS: f64 = 0.5 * LEAST_GAIN;
/// The same for a gear, whose starting points are farther from the optimum.
const HOPELESS_GEAR: f64 = 0.02;
/// Damping ratio above which a gear is no spring: steel shafts and gears have some hundredths. An overdamped one is a
/// friction lag, easily confused with a spring and all friction on the link.
const MOST_DAMPED: f64 = 0.5;
/// Starting points that are refined in parallel.
const FOLLOWED: usize = ABREAST;
/// First step of a simplex in a shape's coordinate, and its evaluations: from a grid …
const FAR: (f64, usize) = (0.4, MOST_ANSWERS);
/// … and from the best shapes beside a similar model.
const NEAR: (f64, usize) = (0.2, 50);
/// Golden-section steps of the refinement.
const REFINEMENTS: usize = 14;

/// Share explained, shapes, columns.
type Best = (f64, [f64; SHAPES], Arc<Vec<Column>>);

/// A candidate with fitted shapes.
#[derive(Clone, Debug)]
pub(crate) struct FittedCandidate {
    /// Which.
    pub(crate) candidate: Candidate,
    /// Its shapes.
    pub(crate) shapes: [f64; SHAPES],
    /// Its columns.
    pub(crate) columns: Arc<Vec<Column>>,
    /// Test results of the columns.
    pub(crate) evidence: Evidence,
    /// Name of the degenerate part: a shape at its lower search bound, a gain outside its bounds, or the stiffness of a
    /// spring that is a constant. For gears also an overdamped swing, or too small a share of the torque.
    pub(crate) at_bound: Option<&'static str>,
    /// True for a backlash that the observer supports.
    pub(crate) accepted_by_observer: bool,
    /// True if a near-collinear effect is in the model.
    pub(crate) near_collinear: bool,
    /// Set for an observer-based gear. Its columns are then a known torque, with gains of 1.
    pub(crate) followed: Option<Followed>,
    /// Shapes of a gear by the other of two methods, if both were used: open-loop and observer-based.
    pub(crate) otherwise: Option<[f64; SHAPES]>,
}

/// Settings of the observer of a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Followed {
    /// RMS of the torque noise on the rows, N·m.
    pub(crate) noise: f64,
}

impl FittedCandidate {
    /// Returns the reason for refusal at a p-value corrected for `tried` trials; None if the candidate passes.
    pub(crate) fn refused(&self, tried: usize) -> Option<String> {
        let e = &self.evidence;
        let p = self.corrected(tried);
        if let Some(shape) = self.at_bound {
            Some(format!(
                "its {shape} goes to the least that can be told from none"
            ))
        } else if p > SIGNIFICANT {
            Some(format!("p = {p:.2}, corrected for {tried} trials"))
        } else if e.joint_gain < self.least_gain() {
            Some(format!(
                "takes away {:.1} % of the residual, less than {:.0} %",
                100.0 * e.joint_gain,
                100.0 * self.least_gain()
            ))
        } else if self.in_too_few_blocks() {
            Some(format!(
                "its gain is only {:.1} of its standard deviations",
                e.gain_sigmas
            ))
        } else {
            None
        }
    }

    /// Returns true if the gain proves that something is missing, whatever its name.
    pub(crate) fn takes_much(&self, tried: usize) -> bool {
        let e = &self.evidence;
        self.corrected(tried) <= SIGNIFICANT
            && e.joint_gain >= MUCH
            && e.gain_sigmas >= LEAST_SIGMAS
    }

    /// Returns true if the gain is not clear of its variation between blocks. A gear fits many things. Any other effect
    /// may also pass by the number of blocks that it improves.
    pub(crate) fn in_too_few_blocks(&self) -> bool {
        let e = &self.evidence;
        let gear = is_gear(self.candidate.kind);
        let much = match self.candidate.kind {
            Kind::JointElasticity => e.joint_gain >= MUCH_OF_A_SPRING,
            _ => !gear && e.joint_gain >= MUCH,
        };
        let least = if much {
            LEAST_SIGMAS_OF_MUCH
        } else if self.near_collinear && e.joint_gain < LEAST_GAIN {
            LEAST_SIGMAS_BESIDE_ITS_DOUBLE
        } else {
            LEAST_SIGMAS
        };
        e.gain_sigmas < least && (gear || e.sign_sigmas() < SIGNS)
    }

    /// Returns true for a backlash that passes all tests except the least gain, because the link is open-loop.
    pub(crate) fn is_nearly_a_play(&self, tried: usize) -> bool {
        let e = &self.evidence;
        self.candidate.kind == Kind::Backlash
            && self.at_bound.is_none()
            && self.corrected(tried) <= SIGNIFICANT
            && (LEAST_GAIN_OF_HEARD..LEAST_GAIN_OF_GEARS).contains(&e.joint_gain)
            && e.gain_sigmas >= CLEAR_SIGMAS
    }

    pub(crate) fn least_gain(&self) -> f64 {
        if self.accepted_by_observer {
            LEAST_GAIN_OF_HEARD
        } else if self.near_collinear {
            LEAST_GAIN_BESIDE_ITS_DOUBLE
        } else if is_gear(self.candidate.kind) {
            LEAST_GAIN_OF_GEARS
        } else {
            LEAST_GAIN
        }
    }

    /// Returns the p-value corrected for `tried` trials.
    pub(crate) fn corrected(&self, tried: usize) -> f64 {
        self.evidence.corrected(tried)
    }
}

/// Returns the damping ratio of a link with this inertia on an elastic gear with the motor locked.
fn damping_ratio(shapes: &[f64; SHAPES], mass: f64) -> f64 {
    let [stiffness, damping, ..] = *shapes;
    0.5 * damping / (stiffness * mass).sqrt()
}

/// Returns true if a spring's stiffness is significant. Preload alone is a constant, with its own names.
pub(crate) fn stiff(fit: &Fit, columns: &[Column]) -> bool {
    let (Some(stiffness), Some(preload)) = (about_its_middle(fit, columns), columns.get(1..))
    else {
        return false;
    };
    let mut beside = fit.clone();
    for column in preload {
        beside.push(column);
    }
    let evidence = (beside.distinct(std::slice::from_ref(&stiffness)))
        .and_then(|own| beside.evidence(&own, &[[0.0, f64::INFINITY]]));
    evidence.is_some_and(|e| e.corrected(1) < SIGNIFICANT && e.gain_sigmas >= LEAST_SIGMAS)
}

/// Returns the stiffness column orthogonal to the preload, independent of the zero of the coordinate.
pub(crate) fn about_its_middle(fit: &Fit, columns: &[Column]) -> Option<Column> {
    let (stiffness, preload) = columns.split_first()?;
    let mut rest = stiffness.clone();
    for column in preload {
        let [along, own] = [&rest, column].map(|c| fit.product(c, column));
        let own = own.max(f64::MIN_POSITIVE);
        rest = combined(column.len(), [(&rest, 1.0), (column, -along / own)]);
    }
    Some(rest)
}

impl Search<'_> {
    /// Returns the share of the residual's squares that a candidate's columns explain.
    fn explained(&self, fit: &Fit, c: usize, columns: &[Column]) -> Option<f64> {
        let bounds = self.bounds(&self.library[c]);
        let (share, _) = fit.explained(&fit.beside(columns)?, &bounds)?;
        Some(share)
    }

    /// Fits the shapes of a candidate. The result is at least as good as `start`. None if its columns are collinear,
    /// its signs are impossible, or the motion does not span its waves.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn profile(
        &self,
        fit: &Fit,
        c: usize,
        start: Option<[f64; SHAPES]>,
    ) -> Result<Option<FittedCandidate>, DiagnoseError> {
        self.profile_but(fit, c, start, &[])
    }

    /// The same for a wave whose order is not in `but`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn profile_but(
        &self,
        fit: &Fit,
        c: usize,
        start: Option<[f64; SHAPES]>,
        but: &[Candidate],
    ) -> Result<Option<FittedCandidate>, DiagnoseError> {
        let kind = self.library[c].kind;
        let fixed = self.fixed(&self.library[c]);
        let start = fixed.or(start);
        let points = self.grid_within(&self.library[c])?;
        let mut best: Option<Best> = None;
        let gear = is_gear(kind);
        let mut followed: Vec<Best> = Vec::new();
        if let Some(shapes) = start {
            let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
            if let Some(share) = self.explained(fit, c, &columns) {
                best = Some((share, shapes, columns));
            }
        } else if points.iter().any(|s| self.shows(&self.library[c], s)) {
            for (shapes, columns) in points.iter().zip(self.cached(c, &points)?) {
                if !self.shows(&self.library[c], shapes)
                    || but.contains(&self.library[c].shaped(shapes))
                {
                    continue;
                }
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
        // Convert the share of one joint to the squares of all joints.
        let hopeless = if gear { HOPELESS_GEAR } else { HOPELESS };
        if best.0 * (self.source.nominal.joints() as f64) < hopeless {
            return Ok(None);
        }
        if gear && fixed.is_none() {
            if followed.is_empty() {
                followed.push(best.clone());
            }
            let far = if start.is_some() { NEAR } else { FAR };
            self.descend(fit, c, &followed, far, &mut best)?;
        }
        if kind == Kind::PreslidingLugre && fixed.is_none() {
            self.without_fall(fit, c, &mut best)?;
        }
        // The simplex has already moved all shapes together. A single shape needs no second round.
        let rounds = match about.shapes {
            _ if gear => 0,
            [] | [_] => 1,
            _ => 2,
        };
        for _ in 0..rounds {
            for (place, shape) in about.shapes.iter().enumerate() {
                if shape.scale != Scale::Whole {
                    self.refine(fit, c, place, &mut best)?;
                }
            }
        }
        let Some(projected) = fit.distinct(&best.2) else {
            return Ok(None);
        };
        let Some(evidence) = fit.evidence(&projected, &self.bounds(&self.library[c])) else {
            return Ok(None);
        };
        let joint = self.library[c].joint;
        let mut at_bound = at_bound(kind, &best.1, self.least_told(kind, joint));
        if kind == Kind::JointElasticity && fixed.is_none() {
            let mass = self.source.mass(joint, 0)?;
            at_bound = at_bound
                .or_else(|| (damping_ratio(&best.1, mass) > MOST_DAMPED).then_some("swing"));
        }
        let least_share = if kind == Kind::JointElasticity {
            LEAST_OF_A_SPRINGS_TWIST
        } else {
            LEAST_OF_A_TWIST
        };
        let share = evidence.gains.first();
        if gear && share.is_some_and(|share| *share < least_share) {
            at_bound = at_bound.or(Some("torque"));
        }
        if kind == Kind::Spring && !stiff(fit, &best.2) {
            at_bound = Some("stiffness");
        }
        Ok(Some(FittedCandidate {
            candidate: self.library[c].shaped(&best.1),
            shapes: best.1,
            columns: best.2,
            evidence,
            at_bound,
            accepted_by_observer: self.accepted_by_observer.contains(&self.library[c]),
            near_collinear: false,
            followed: None,
            otherwise: None,
        }))
    }

    /// Tries equally stiff bristles without friction fall, and keeps them if they explain more. No change of a single
    /// shape reaches them.
    fn without_fall(&self, fit: &Fit, c: usize, best: &mut Best) -> Result<(), DiagnoseError> {
        let [stroke, breakaway, velocity, ..] = best.1;
        let mut shapes = best.1;
        shapes[..3].copy_from_slice(&[stroke * (1.0 + breakaway), 0.0, velocity]);
        let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
        if let Some(share) = self.explained(fit, c, &columns) {
            let mut plain = (share, shapes, columns);
            self.refine(fit, c, 0, &mut plain)?;
            if plain.0 > best.0 {
                *best = plain;
            }
        }
        Ok(())
    }

    /// Runs simplex searches from all starts in parallel, over all shapes at once: stiffness, damping and gap interact.
    /// `far` is the first step, `answers` the number of evaluations.
    fn descend(
        &self,
        fit: &Fit,
        c: usize,
        starts: &[Best],
        (far, answers): (f64, usize),
        best: &mut Best,
    ) -> Result<(), DiagnoseError> {
        let scales = self.library[c].kind.about().shapes;
        let [least, most] = self.ends(&self.library[c])?;
        let mut simplices: Vec<Simplex> = (starts.iter())
            .map(|(_, shapes, _)| {
                // Inside the bounds, so that it can move.
                let inside = |place: usize| shapes[place].max(2.0 * least[place]).min(most[place]);
                let at: Vec<f64> = (scales.iter().zip(0..))
                    .map(|(shape, place)| coordinate(shape, inside(place)))
                    .collect();
                // Away from a bound.
                let away = |shape: &Parameter, x: f64| {
                    if shape.scale == Scale::Linear && x > 0.5 {
                        -far
                    } else {
                        far
                    }
                };
                let steps: Vec<f64> = (scales.iter().zip(&at)).map(|(s, x)| away(s, *x)).collect();
                Simplex::new(&at, &steps).of_most(answers)
            })
            .collect();
        loop {
            let asked: Vec<(usize, [f64; SHAPES])> = (simplices.iter().enumerate())
                .filter_map(|(k, simplex)| {
                    let x = simplex.asks()?;
                    let mut shapes = [0.0; SHAPES];
                    for (place, (shape, x)) in scales.iter().zip(x).enumerate() {
                        shapes[place] = value_at(shape, x).max(least[place]).min(most[place]);
                    }
                    Some((k, shapes))
                })
                .collect();
            if asked.is_empty() {
                return Ok(());
            }
            let shapes: Vec<[f64; SHAPES]> = asked.iter().map(|(_, shapes)| *shapes).collect();
            let columns = self
                .source
                .columns_of(self.threads, &self.library[c], &shapes)?;
            for ((k, shapes), columns) in asked.into_iter().zip(columns) {
                let share = self.explained(fit, c, &columns).unwrap_or(0.0);
                simplices[k].told(-share);
                if share > best.0 {
                    *best = (share, shapes, Arc::new(columns));
                }
            }
        }
    }

    /// Fits shapes of a known torque (gains fixed) beside the other columns, from a start. Returns shapes and columns.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn fitted_as_known(
        &self,
        source: &Source,
        fit: &Fit,
        candidate: &Candidate,
        start: &[f64; SHAPES],
    ) -> Result<([f64; SHAPES], Vec<Column>), DiagnoseError> {
        let scales = candidate.kind.about().shapes;
        let [least, most] = self.ends(candidate)?;
        let at: Vec<f64> = (scales.iter().zip(start))
            .map(|(shape, value)| coordinate(shape, *value))
            .collect();
        let steps: Vec<f64> = (scales.iter())
            .map(|shape| match shape.scale {
                Scale::Logarithmic if is_distance(shape) => 0.03,
                Scale::Logarithmic => 0.2,
                Scale::Linear | Scale::Whole => 0.05,
            })
            .collect();
        let mut simplex = Simplex::new(&at, &steps);
        let mut best: Option<(f64, [f64; SHAPES], Vec<Column>)> = None;
        while let Some(x) = simplex.asks() {
            let mut shapes = [0.0; SHAPES];
            for (place, (shape, x)) in scales.iter().zip(x).enumerate() {
                shapes[place] = value_at(shape, x).max(least[place]).min(most[place]);
            }
            let columns = source.columns_by(self.threads, candidate, &shapes)?;
            let mut left = fit.clone();
            for column in &columns {
                left.subtract(column);
            }
            let squares = dot_self(left.left());
            simplex.told(squares);
            if best.as_ref().is_none_or(|b| squares < b.0) {
                best = Some((squares, shapes, columns));
            }
        }
        best.map(|(_, shapes, columns)| (shapes, columns))
            .ok_or_else(|| DiagnoseError::Model("its gear has no shape to begin with.".into()))
    }

    /// Refines one shape by golden section around the best point.
    fn refine(
        &self,
        fit: &Fit,
        c: usize,
        place: usize,
        best: &mut Best,
    ) -> Result<(), DiagnoseError> {
        let scales = self.library[c].kind.about().shapes;
        let shape = &scales[place];
        let [step, fine] = spacing(shape, scales.len());
        let middle = coordinate(shape, best.1[place]);
        let told = self.least_told(self.library[c].kind, self.library[c].joint);
        let reached = [
            self.source.running(),
            self.source.fastest(self.library[c].joint),
        ];
        let [least, most] = searched(shape, told, reached).map(|bound| coordinate(shape, bound));
        // A described value may lie outside the range that these recordings resolve.
        let mut high = (middle + step).min(most);
        let mut low = (middle - step).max(least).min(high);
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let at = |x: f64, best: &mut Best| -> Result<f64, DiagnoseError> {
            let mut shapes = best.1;
            shapes[place] = value_at(shape, x);
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
            if high - low < fine {
                break;
            }
        }
        Ok(())
    }

    /// Returns the physical bounds of the gains. A delay within the sampling jitter is no effect.
    fn bounds(&self, candidate: &Candidate) -> Vec<[f64; 2]> {
        if candidate.kind == Kind::MeasurementDelay {
            return vec![[sampling_jitter(self.source.runs), f64::INFINITY]];
        }
        let gains = self.source.gains(candidate);
        gains.iter().map(|g| g.bounds).collect()
    }
}
