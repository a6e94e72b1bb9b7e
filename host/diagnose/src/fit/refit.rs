//! Joint fit of nominal parameters and effects.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::DiagnoseError;
use crate::acceptance::coordinates::Coordinate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_gear;
use crate::description::parameter_prior::is_friction;
use crate::fit::least_squares::Fit;
use crate::fit::solution::{Solution, jackknifed, solve};
use crate::fit::systematic_uncertainty::inflated;
use crate::models::tilt::turn;
use crate::outcome::{Absorbed, Value};
use crate::recordings::context::DiagnosisContext;
use crate::recordings::noise_floor;
use crate::recordings::sampling::sampling_jitter;
use crate::rows::regression::{Column, Rows, combined};
use crate::rows::row_weights::counts;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::shapes::is_straight;

/// Relative standard deviation above which a log-scaled shape is not identifiable, such as the Stribeck velocity of
/// bristles whose friction does not fall.
const UNTOLD: f64 = 10.0;

/// Relative step of the difference quotient over a shape: far above rounding, far below the width of any law.
const DIFFERENCE: f64 = 0.01;
/// Displayed name of the gravity direction of a single link.
const GRAVITY: &str = "m*g*l (gravity's largest torque)";

/// The nominal model, refitted to the training data.
pub(crate) struct Refit<'r> {
    /// Columns of the free nominal directions.
    pub(crate) free: Vec<Column>,
    /// Fit without any column.
    pub(crate) plain: Fit<'r>,
    /// Fit with the free nominal columns.
    pub(crate) base: Fit<'r>,
    /// Both fits without row weights, if the fits above have row weights because of a gear.
    even: Option<[Fit<'r>; 2]>,
    /// Coefficients of the free nominal directions.
    pub(crate) before: Solution,
    joints: usize,
}

impl<'r> Refit<'r> {
    /// Refits the nominal model. The weight of a joint is the inverse residual RMS of a first fit without weights.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the nominal parameters are collinear along this motion.
    pub(crate) fn of(context: &DiagnosisContext, rows: &'r Rows) -> Result<Self, DiagnoseError> {
        let n = rows.joints();
        let free = context.anchor.columns(rows);
        let (plain, _) = weighed(rows, &free);
        let base = plain.clone().taking(&free);
        let before = solve(&plain, &free.iter().collect::<Vec<_>>(), &[]).ok_or_else(|| {
            DiagnoseError::Model(
                "its nominal parameters are not excited by this motion; record a livelier one."
                    .into(),
            )
        })?;
        Ok(Self {
            free,
            plain,
            base,
            even: None,
            before,
            joints: n,
        })
    }

    /// Adds row weights, from the residual with these effects, on the geared joints `loud`.
    pub(crate) fn reweighted(self, chosen: &[FittedCandidate], loud: &[usize]) -> Self {
        let left = with(&self.base, chosen, None);
        let counts = (0..self.joints)
            .map(|j| {
                let rows = left.rows();
                let own = || counts(&left.residual(j), &rows.keep[j], &rows.starts, rows.period);
                loud.contains(&j).then(|| Arc::new(own()))
            })
            .collect();
        let plain = self.plain.counting(counts);
        Self {
            base: plain.clone().taking(&self.free),
            plain,
            even: Some(self.even.unwrap_or([self.plain, self.base])),
            ..self
        }
    }

    /// Returns true if rows have weights because of a gear.
    pub(crate) fn is_quieted(&self) -> bool {
        self.even.is_some()
    }

    /// Returns the fits without row weights.
    pub(crate) fn evened(mut self) -> Self {
        if let Some([plain, base]) = self.even.take() {
            (self.plain, self.base) = (plain, base);
        }
        self
    }

    /// Returns the fit with the free nominal columns and without row weights.
    pub(crate) fn even(&self) -> &Fit<'r> {
        self.even.as_ref().map_or(&self.base, |[_, base]| base)
    }

    /// Returns the two fits for a model with these effects: without any column, and with the free nominal columns.
    /// Without a gear they have no row weights.
    pub(crate) fn footing(&self, chosen: &[FittedCandidate]) -> [&Fit<'r>; 2] {
        match &self.even {
            Some([plain, base]) if !chosen.iter().any(|p| is_gear(p.candidate.kind)) => {
                [plain, base]
            }
            _ => [&self.plain, &self.base],
        }
    }

    /// Returns the columns of the free nominal directions, then of the effects.
    fn columns<'c>(&'c self, chosen: &'c [FittedCandidate]) -> Columns<'c> {
        let mut columns = Columns {
            fitted: self.free.iter().collect(),
            bounded: vec![false; self.free.len()],
            known: Vec::new(),
            places: Vec::new(),
        };
        for profile in chosen {
            for (gain, column) in profile.columns.iter().enumerate() {
                if profile.followed.is_some() {
                    columns
                        .places
                        .push(columns.fitted.len() + columns.known.len());
                    columns.known.push(column);
                } else {
                    columns.fitted.push(column);
                    columns.bounded.push(profile.may_be_zero(gain));
                }
            }
        }
        columns
    }

    /// Returns the coefficients of the free nominal directions and of the effects' columns.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the columns are collinear along this motion.
    pub(crate) fn solution(&self, chosen: &[FittedCandidate]) -> Result<Solution, DiagnoseError> {
        let columns = self.columns(chosen);
        let [plain, _] = self.footing(chosen);
        solve(&columns.beside(plain), &columns.fitted, &columns.bounded)
            .map(|solution| solution.with_known(&columns.places))
            .ok_or_else(|| {
                DiagnoseError::Model("its parameters with the effects are not all excited.".into())
            })
    }

    /// Fits nominal parameters, gains and shapes together. `pairs` are runs that repeat each other.
    ///
    /// The uncertainty uses the correlation time of the final residual, without the effects' torque. A residual that
    /// repeats with the motion counts once.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn joint(
        &self,
        source: &Source,
        chosen: &[FittedCandidate],
        pairs: &[(usize, usize)],
        coordinates: &[Vec<Coordinate>],
    ) -> Result<Joint, DiagnoseError> {
        let [plain, base] = self.footing(chosen);
        let mut beside = with(base, chosen, None);
        let residuals: Vec<Vec<f64>> = (0..self.joints).map(|j| beside.residual(j)).collect();
        let plain = plain.clustered(noise_floor::memory(plain.rows(), &residuals), pairs);
        let strata: Vec<Fit> = (coordinates.iter().enumerate())
            .filter(|(j, _)| self.joints == 1 || chosen.iter().any(|p| p.candidate.joint == *j))
            .flat_map(|(_, of_joint)| of_joint.iter().filter(|c| c.is_of_a_law()))
            .map(|coordinate| plain.stratified(&coordinate.values))
            .collect();
        let failed =
            || DiagnoseError::Model("its parameters with the effects are not all excited.".into());
        let columns = self.columns(chosen);
        let plain = columns.beside(&plain);
        let solved = |slopes: &[Column]| {
            let solution = jackknifed(&plain, &strata, &columns.fitted, &columns.bounded, slopes)?;
            Some(solution.with_known(&columns.places))
        };
        let solution = solved(&[]).ok_or_else(failed)?;
        let mut stds = vec![[0.0; SHAPES]; chosen.len()];
        let mut slopes = Vec::new();
        let mut places = Vec::new();
        let mut at = self.free.len();
        for (k, profile) in chosen.iter().enumerate() {
            let gains = &solution.values[at..at + profile.columns.len()];
            at += profile.columns.len();
            for (place, shape) in profile.candidate.kind.about().shapes.iter().enumerate() {
                if shape.scale == Scale::Whole {
                    continue;
                }
                let slope = slope(source, profile, place, shape, gains)?;
                // Infinite unless the shape has an influence that is not collinear with the others.
                stds[k][place] = f64::INFINITY;
                let straight = is_straight(shape, profile.shapes[place], source.running());
                if !straight && beside.push(&slope) {
                    slopes.push(slope);
                    places.push((k, place));
                }
            }
        }
        let Some(linearised) = solved(&slopes) else {
            return Ok(Joint { solution, stds });
        };
        for (s, (k, place)) in places.into_iter().enumerate() {
            if !is_of_contact(chosen[k].candidate.kind, place) {
                let std = linearised.std(solution.values.len() + s);
                let shape = &chosen[k].candidate.kind.about().shapes[place];
                let untold = shape.scale == Scale::Logarithmic
                    && std > UNTOLD * chosen[k].shapes[place].abs();
                if !untold {
                    stds[k][place] = std.hypot(between_ways(&chosen[k], place));
                }
            }
        }
        Ok(Joint {
            solution: linearised,
            stds,
        })
    }

    /// Returns the torque of the effects with their gains.
    pub(crate) fn explained(&self, chosen: &[FittedCandidate], after: &Solution) -> Column {
        let columns = chosen.iter().flat_map(|p| p.columns.iter());
        let gains = after.values[self.free.len()..].iter().copied();
        combined(self.joints, columns.zip(gains))
    }

    /// Returns the fit with all parameters as described. Friction that the description does not state is fitted.
    pub(crate) fn frozen(&self, context: &DiagnosisContext) -> Fit<'r> {
        let anchor = &context.anchor;
        let prior = anchor.prior_coefficients();
        let stated = combined(self.joints, self.free.iter().zip(prior));
        let mut frozen = self.plain.clone();
        frozen.subtract(&stated);
        let (base, joints) = (&context.nominal.base, context.robot.joints.len());
        let unknown = |k: &usize| {
            let friction = matches!(anchor.free[*k].as_slice(), [(b, _)] if is_friction(base.columns[*b], joints));
            friction && anchor.is_unstated(*k)
        };
        let unknown = (0..self.free.len()).filter(unknown);
        frozen.taking(unknown.map(|k| &self.free[k]))
    }

    /// Returns the changed nominal parameters, the most significant first. `before` holds their coefficients without
    /// the effects, or as described. NaN entries are skipped.
    pub(crate) fn absorbed(
        &self,
        context: &DiagnosisContext,
        before: &[f64],
        after: &Solution,
    ) -> Vec<Absorbed> {
        let mut list: Vec<Absorbed> = (of_directions(context).enumerate())
            .map(|(k, (parameter, unit, scale))| {
                let (before, now) = (scale * before[k], scale * after.values[k]);
                Absorbed {
                    parameter,
                    unit,
                    before,
                    after: now,
                    sigmas: (now - before).abs() / (scale * after.std(k)).max(f64::MIN_POSITIVE),
                }
            })
            .filter(|moved| moved.before.is_finite())
            .collect();
        list.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        list
    }
}

/// Returns name, unit and display factor of each free nominal direction.
fn of_directions(context: &DiagnosisContext) -> impl Iterator<Item = (String, String, f64)> {
    let base = &context.nominal.base;
    (context.anchor.free.iter()).map(|direction| match direction.as_slice() {
        [(b, _)] => (context.expression(*b), base.unit(*b).to_owned(), 1.0),
        // Only gravity combines several parameters: it points along the described first moment.
        _ => (GRAVITY.to_owned(), "N*m".to_owned(), context.nominal.pull()),
    })
}

/// Returns the same for all fitted parameters: nominal directions, gains, and the given shapes (effect, index).
pub(crate) fn named(
    context: &DiagnosisContext,
    source: &Source,
    chosen: &[FittedCandidate],
    shapes: &[(usize, usize)],
) -> Vec<(String, String, f64)> {
    let of_effect = |profile: &FittedCandidate, parameter: &Parameter| {
        let name = profile.candidate.kind.about().name;
        let unit = source.unit(&profile.candidate, parameter);
        (format!("{name}.{}", parameter.name), unit, 1.0)
    };
    let gains = chosen.iter().flat_map(|profile| {
        (source.gains(&profile.candidate).into_iter()).map(move |gain| of_effect(profile, &gain))
    });
    let shapes = (shapes.iter()).map(|(k, place)| {
        let profile = &chosen[*k];
        of_effect(profile, &profile.candidate.kind.about().shapes[*place])
    });
    of_directions(context).chain(gains).chain(shapes).collect()
}

/// Fitted columns and columns of known torque.
struct Columns<'c> {
    fitted: Vec<&'c Column>,
    /// True for each fitted column whose coefficient cannot be negative.
    bounded: Vec<bool>,
    known: Vec<&'c Column>,
    /// Indices of the known columns among all columns.
    places: Vec<usize>,
}

impl Columns<'_> {
    /// Returns a fit without the known torque.
    fn beside<'r>(&self, plain: &Fit<'r>) -> Fit<'r> {
        let mut plain = plain.clone();
        for column in &self.known {
            plain.subtract(column);
        }
        plain
    }
}

/// Weights the joints by their inverse residual RMS. Also returns the residual's correlation time, s.
pub(crate) fn weighed<'r>(rows: &'r Rows, columns: &[Column]) -> (Fit<'r>, f64) {
    let n = rows.joints();
    let first = Fit::new(rows, vec![1.0; n], 0.1).taking(columns);
    let scale: Vec<f64> = (0..n)
        .map(|j| 1.0 / first.rms(j).max(f64::MIN_POSITIVE))
        .collect();
    let residuals: Vec<Vec<f64>> = (0..n).map(|j| first.residual(j)).collect();
    let memory = noise_floor::memory(rows, &residuals);
    (Fit::new(rows, scale, memory), memory)
}

/// Returns true if a shape describes tooth contact. The motor motion shows the backlash gap and that there is contact,
/// but no contact values. The fit needs such values, yet they are not measurements.
fn is_of_contact(kind: Kind, place: usize) -> bool {
    let name = kind.about().shapes[place].name;
    kind == Kind::Backlash && matches!(name, "stiffness" | "damping")
}

/// Returns the difference of a backlash gap between the open-loop and the observer-based fit. Each law has an error at
/// tooth contact, larger than blocks and strata show, and mostly in opposite directions.
fn between_ways(profile: &FittedCandidate, place: usize) -> f64 {
    let is_play = profile.candidate.kind == Kind::Backlash
        && profile.candidate.kind.about().shapes[place].name == "gap";
    let otherwise = profile.otherwise.filter(|_| is_play);
    otherwise.map_or(0.0, |shapes| shapes[place] - profile.shapes[place])
}

/// Returns the derivative of an effect's torque with respect to one shape, by a difference within the physical bounds.
fn slope(
    source: &Source,
    profile: &FittedCandidate,
    place: usize,
    shape: &Parameter,
    gains: &[f64],
) -> Result<Column, DiagnoseError> {
    let value = profile.shapes[place];
    let [low, high] = shape.bounds;
    let step = difference_step(shape, value);
    let [above, below] = [value + step, value - step].map(|x| x.clamp(low, high));
    let at = |x: f64| {
        let mut shapes = profile.shapes;
        shapes[place] = x;
        source.columns(&profile.candidate, &shapes)
    };
    let (up, down) = (at(above)?, at(below)?);
    let per_step = |gain: &f64| gain / (above - below);
    let terms = (up.iter().zip(gains).map(|(c, g)| (c, per_step(g))))
        .chain(down.iter().zip(gains).map(|(c, g)| (c, -per_step(g))));
    Ok(combined(source.nominal.joints(), terms))
}

/// Returns 1 % of the value. For a linear shape, 1 % of its range if that is larger.
fn difference_step(shape: &Parameter, value: f64) -> f64 {
    let size = match shape.scale {
        Scale::Linear => value.abs().max(shape.range[1] - shape.range[0]),
        Scale::Logarithmic | Scale::Whole => value.abs(),
    };
    DIFFERENCE * size
}

/// Estimates of the joint fit.
pub(crate) struct Joint {
    /// Coefficients of the free nominal directions, then of the columns. The covariance also contains the shapes.
    pub(crate) solution: Solution,
    /// Standard deviations of each effect's shapes: 0 for an integer, infinite if not identifiable.
    stds: Vec<[f64; SHAPES]>,
}

impl Joint {
    /// Returns the p-value that the first `count` gains of the `k`-th effect are zero (Wald 1943), from the covariance
    /// that also gives their intervals.
    pub(crate) fn of_nothing(
        &self,
        chosen: &[FittedCandidate],
        free: usize,
        k: usize,
        count: usize,
    ) -> f64 {
        let gains = self.gains(chosen, free, k);
        let gains = &gains[..count.min(gains.len())];
        wald(gains, &self.solution.covariance, place(chosen, free, k)).unwrap_or(1.0)
    }

    /// Returns the gains of the `k`-th effect.
    pub(crate) fn gains(&self, chosen: &[FittedCandidate], free: usize, k: usize) -> &[f64] {
        let at = place(chosen, free, k);
        &self.solution.values[at..at + chosen[k].columns.len()]
    }

    /// Returns a gain of the `k`-th effect with its standard deviation.
    pub(crate) fn gain(
        &self,
        chosen: &[FittedCandidate],
        free: usize,
        k: usize,
        gain: usize,
    ) -> [f64; 2] {
        let at = place(chosen, free, k) + gain;
        [self.solution.values[at], self.solution.std(at)]
    }

    /// Returns effect and index of each identifiable shape, with value and standard deviation.
    pub(crate) fn shapes(&self, chosen: &[FittedCandidate]) -> Vec<((usize, usize), [f64; 2])> {
        let of_effect = |(k, profile): (usize, &FittedCandidate)| {
            let stds = self.stds[k];
            let places = 0..profile.candidate.kind.about().shapes.len();
            (places.filter(move |s| stds[*s] > 0.0 && stds[*s].is_finite()))
                .map(|s| ((k, s), [profile.shapes[s], stds[s]]))
                .collect::<Vec<_>>()
        };
        chosen.iter().enumerate().flat_map(of_effect).collect()
    }

    /// Returns the gains and shapes of the `k`-th effect with their standard deviations.
    pub(crate) fn parameters(
        &self,
        source: &Source,
        chosen: &[FittedCandidate],
        free: usize,
        k: usize,
    ) -> BTreeMap<String, Value> {
        let profile = &chosen[k];
        let kind = profile.candidate.kind;
        let at = place(chosen, free, k);
        let fitted = (source.gains(&profile.candidate).into_iter().enumerate())
            .filter(|_| profile.followed.is_none());
        let whole = profile.columns.len();
        let turn = match kind {
            Kind::GravityTilt => turn(&self.solution.values.as_slice()[at..at + whole]),
            _ => 1.0,
        };
        let gains = fitted.map(|(g, gain)| {
            let (value, std) = (self.solution.values[at + g], self.solution.std(at + g));
            (gain, turn * value, turn * std)
        });
        let shapes = (kind.about().shapes.iter().enumerate())
            .map(|(s, shape)| (*shape, profile.shapes[s], self.stds[k][s]));
        let sampling_jitter = sampling_jitter(source.runs);
        (gains.chain(shapes))
            .map(|(parameter, value, std)| {
                let value = Value {
                    value,
                    std: inflated(kind, &parameter, value, std, sampling_jitter),
                    unit: source.unit(&profile.candidate, &parameter),
                };
                (parameter.name.to_owned(), value)
            })
            .collect()
    }
}

/// Returns the p-value of `values` being zero (Wald 1943), from the rows of their `covariance` that begin with `at`;
/// `None` if it is not positive definite.
pub(crate) fn wald(values: &[f64], covariance: &DMatrix<f64>, at: usize) -> Option<f64> {
    let values = DVector::from_column_slice(values);
    let count = values.len();
    let own = covariance.view((at, at), (count, count)).into_owned();
    let wald = values.dot(&own.cholesky()?.solve(&values));
    let law = ChiSquared::new(count as f64).ok()?;
    wald.is_finite().then(|| law.sf(wald))
}

/// Returns the index of the first coefficient of the `k`-th effect, after the `free` nominal directions.
fn place(chosen: &[FittedCandidate], free: usize, k: usize) -> usize {
    free + chosen[..k].iter().map(|p| p.columns.len()).sum::<usize>()
}

#[cfg(test)]
mod tests;
