//! Fit of a candidate's shapes beside the other effects.

use std::sync::Arc;

use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_gear;
use crate::fit::evidence::Evidence;
use crate::fit::least_squares::Fit;
use crate::levels::LEAST_GAIN;
use crate::recordings::sampling::sampling_jitter;
use crate::rows::lanes::ABREAST;
use crate::rows::regression::Column;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::shapes::{at_bound, coordinate, is_distance, searched, spacing, value_at};
use crate::search::spring::stiff;
use crate::search::stepwise::Search;
use rig_numerics::optimise::golden_section::golden_section;
use rig_numerics::optimise::simplex::{DEFAULT_EVALUATIONS, Simplex};
use rig_numerics::vector::norm_squared;

/// Least share of the twist torque of mass and load that a gear must have. True gears of the emulated rig give 0.7 to
/// 1.1. A wide backlash with a third can replace a tilted base.
const LEAST_OF_A_TWIST: f64 = 0.5;
/// The same for an elastic gear: a soft one, whose swing the motor motion predicts only briefly, gave 0.49.
const LEAST_OF_A_SPRINGS_TWIST: f64 = 0.4;
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
const FAR: (f64, usize) = (0.4, DEFAULT_EVALUATIONS);
/// … and from the best shapes beside a similar model.
const NEAR: (f64, usize) = (0.2, 50);
/// Golden-section steps of the refinement.
const REFINEMENTS: usize = 14;
/// Share explained, shapes, columns.
type Best = (f64, [f64; SHAPES], Arc<Vec<Column>>);

/// Starting points of a fit.
struct Starts {
    /// The best one.
    best: Best,
    /// The best ones of a gear's grid, the best first.
    followed: Vec<Best>,
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
        let candidate = &self.library[c];
        let fixed = self.fixed(candidate);
        let start = fixed.or(start);
        let Some(Starts { mut best, followed }) = self.starts(fit, c, start, but)? else {
            return Ok(None);
        };
        // Convert the share of one joint to the squares of all joints.
        let hopeless = if is_gear(candidate.kind) {
            HOPELESS_GEAR
        } else {
            HOPELESS
        };
        if best.0 * (self.source.nominal.joints() as f64) < hopeless {
            return Ok(None);
        }
        if fixed.is_none() {
            let far = if start.is_some() { NEAR } else { FAR };
            self.move_together(fit, c, followed, far, &mut best)?;
        }
        self.move_one_by_one(fit, c, &mut best)?;
        let Some(projected) = fit.distinct(&best.2) else {
            return Ok(None);
        };
        let Some(evidence) = fit.evidence(&projected, &self.bounds(candidate)) else {
            return Ok(None);
        };
        Ok(Some(FittedCandidate {
            candidate: candidate.shaped(&best.1),
            at_bound: self.degenerate(fit, c, &best, &evidence, fixed.is_some())?,
            shapes: best.1,
            columns: best.2,
            evidence,
            accepted_by_observer: self.accepted_by_observer.contains(candidate),
            near_collinear: false,
            followed: None,
            otherwise: None,
        }))
    }

    /// Returns the given start, or the best grid points. None if no point can explain anything.
    fn starts(
        &self,
        fit: &Fit,
        c: usize,
        start: Option<[f64; SHAPES]>,
        but: &[Candidate],
    ) -> Result<Option<Starts>, DiagnoseError> {
        let candidate = &self.library[c];
        let points = self.grid_within(candidate)?;
        let mut best: Option<Best> = None;
        let mut followed: Vec<Best> = Vec::new();
        if let Some(shapes) = start {
            let columns = Arc::new(self.source.columns(candidate, &shapes)?);
            if let Some(share) = self.explained(fit, c, &columns) {
                best = Some((share, shapes, columns));
            }
        } else if points.iter().any(|s| self.shows(candidate, s)) {
            for (shapes, columns) in points.iter().zip(self.cached(c, &points)?) {
                if !self.shows(candidate, shapes) || but.contains(&candidate.shaped(shapes)) {
                    continue;
                }
                let Some(share) = self.explained(fit, c, &columns) else {
                    continue;
                };
                if is_gear(candidate.kind) {
                    followed.push((share, *shapes, columns.clone()));
                    followed.sort_by(|a, b| b.0.total_cmp(&a.0));
                    followed.truncate(FOLLOWED);
                }
                if best.as_ref().is_none_or(|b| share > b.0) {
                    best = Some((share, *shapes, columns));
                }
            }
        }
        Ok(best.map(|best| Starts { best, followed }))
    }

    /// Moves several shapes of a gear or of bristles at once.
    fn move_together(
        &self,
        fit: &Fit,
        c: usize,
        mut followed: Vec<Best>,
        far: (f64, usize),
        best: &mut Best,
    ) -> Result<(), DiagnoseError> {
        let kind = self.library[c].kind;
        if is_gear(kind) {
            if followed.is_empty() {
                followed.push(best.clone());
            }
            self.descend(fit, c, &followed, far, best)?;
        }
        if kind == Kind::PreslidingLugre {
            self.without_fall(fit, c, best)?;
        }
        Ok(())
    }

    /// Refines one shape after the other.
    fn move_one_by_one(&self, fit: &Fit, c: usize, best: &mut Best) -> Result<(), DiagnoseError> {
        let kind = self.library[c].kind;
        let scales = kind.about().shapes;
        // The simplex has already moved all shapes together. A single shape needs no second round.
        let rounds = match scales {
            _ if is_gear(kind) => 0,
            [] | [_] => 1,
            _ => 2,
        };
        for _ in 0..rounds {
            for (place, shape) in scales.iter().enumerate() {
                if shape.scale != Scale::Whole {
                    self.refine(fit, c, place, best)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the name of the degenerate part of a fitted candidate, as in [`FittedCandidate::at_bound`].
    fn degenerate(
        &self,
        fit: &Fit,
        c: usize,
        (_, shapes, columns): &Best,
        evidence: &Evidence,
        is_fixed: bool,
    ) -> Result<Option<&'static str>, DiagnoseError> {
        let Candidate { kind, joint, .. } = self.library[c];
        let mut at_bound = at_bound(kind, shapes, self.least_told(kind, joint));
        if kind == Kind::JointElasticity && !is_fixed {
            let mass = self.source.mass(joint, 0)?;
            at_bound =
                at_bound.or_else(|| (damping_ratio(shapes, mass) > MOST_DAMPED).then_some("swing"));
        }
        let least_share = if kind == Kind::JointElasticity {
            LEAST_OF_A_SPRINGS_TWIST
        } else {
            LEAST_OF_A_TWIST
        };
        let share = evidence.gains.first();
        if is_gear(kind) && share.is_some_and(|share| *share < least_share) {
            at_bound = at_bound.or(Some("torque"));
        }
        if kind == Kind::Spring && !stiff(fit, columns) {
            at_bound = Some("stiffness");
        }
        Ok(at_bound)
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
                Simplex::new(&at, &steps).with_evaluations(answers)
            })
            .collect();
        loop {
            let asked: Vec<(usize, [f64; SHAPES])> = (simplices.iter().enumerate())
                .filter_map(|(k, simplex)| {
                    let x = simplex.next_point()?;
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
                simplices[k].report(-share);
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
        while let Some(x) = simplex.next_point() {
            let mut shapes = [0.0; SHAPES];
            for (place, (shape, x)) in scales.iter().zip(x).enumerate() {
                shapes[place] = value_at(shape, x).max(least[place]).min(most[place]);
            }
            let columns = source.columns_by(self.threads, candidate, &shapes)?;
            let squares = left_as_known(fit, &columns);
            simplex.report(squares);
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
        let high = (middle + step).min(most);
        let low = (middle - step).max(least).min(high);
        golden_section([low, high], REFINEMENTS, fine, |x| {
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
        })
    }

    /// Returns the physical bounds of the gains. A delay within the sampling jitter is no effect.
    pub(crate) fn bounds(&self, candidate: &Candidate) -> Vec<[f64; 2]> {
        if candidate.kind == Kind::MeasurementDelay {
            return vec![[sampling_jitter(self.source.runs), f64::INFINITY]];
        }
        let gains = self.source.gains(candidate);
        gains.iter().map(|g| g.bounds).collect()
    }
}

/// Returns the damping ratio of a link with this inertia on an elastic gear with the motor locked.
fn damping_ratio(shapes: &[f64; SHAPES], mass: f64) -> f64 {
    let [stiffness, damping, ..] = *shapes;
    0.5 * damping / (stiffness * mass).sqrt()
}

/// Returns the sum of squares that a fit leaves after these columns as known torques.
pub(crate) fn left_as_known(fit: &Fit, columns: &[Column]) -> f64 {
    let mut left = fit.clone();
    for column in columns {
        left.subtract(column);
    }
    norm_squared(left.left())
}
