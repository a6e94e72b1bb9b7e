//! Nominal parameters and effects fitted together.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::DiagnoseError;
use super::anchor::{Direction, is_friction};
use super::bench::Bench;
use super::columns::Source;
use super::fit::{Fit, axpy, dot};
use super::floor;
use super::lead::slack;
use super::locate::Coordinate;
use super::model::weights;
use super::outcome::{Absorbed, Value};
use super::profile::{Profile, is_straight};
use super::quiet::counts;
use super::rows::{Column, Rows, combined};
use super::search::{is_gear, with};
use super::solve::{Solution, jackknifed, solve};
use super::type_b::widened;
use rig_identify::contradicted;
use rig_model::robot::DESCRIBED;

/// Standard deviations, over the value of a shape of which ratios count, from which on the motion does not tell it: as the Stribeck
/// velocity of bristles whose friction does not fall.
const UNTOLD: f64 = 10.0;

/// Step of a difference quotient over a shape, by its size: far above rounding and within any law's own width.
const DIFFERENCE: f64 = 0.01;
/// Standard deviation that stands for no knowledge, SI.
const WIDE: f64 = 1e6;
/// What gravity's direction of a single link stands for, as a result names it.
const GRAVITY: &str = "m*g*l (gravity's largest torque)";
/// Share of the description's variance from which on data have added hardly anything.
const HARDLY_BETTER: f64 = 0.5;

/// The nominal model on the training data, its free parameters fitted anew.
pub(super) struct Refit<'r> {
    /// Columns of the free nominal directions.
    pub(super) free: Vec<Column>,
    /// Nothing taken in.
    pub(super) plain: Fit<'r>,
    /// The free nominal columns taken in.
    pub(super) base: Fit<'r>,
    /// Both with all rows alike, where those of the others count by what a gear leaves about them.
    even: Option<[Fit<'r>; 2]>,
    /// Coefficients of the free nominal directions.
    pub(super) before: Solution,
    joints: usize,
}

impl<'r> Refit<'r> {
    /// Weighs the joints by what a first fit without weights leaves of them.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] where the motion does not tell the nominal parameters apart.
    pub(super) fn of(bench: &Bench, rows: &'r Rows) -> Result<Self, DiagnoseError> {
        let n = rows.joints();
        let free = bench.anchor.columns(rows);
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

    /// The same with rows that count by what these effects leave about them, on the joints `loud`.
    pub(super) fn quieted(self, chosen: &[Profile], loud: &[usize]) -> Self {
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

    /// Whether rows count by what a gear leaves about them.
    pub(super) fn is_quieted(&self) -> bool {
        self.even.is_some()
    }

    /// The same with all rows alike.
    pub(super) fn evened(mut self) -> Self {
        if let Some([plain, base]) = self.even.take() {
            (self.plain, self.base) = (plain, base);
        }
        self
    }

    /// The free nominal columns taken in, all rows alike.
    pub(super) fn even(&self) -> &Fit<'r> {
        self.even.as_ref().map_or(&self.base, |[_, base]| base)
    }

    /// Rows as they count for a model of these effects: without a gear all alike. First nothing taken in, then the free nominal
    /// columns.
    pub(super) fn footing(&self, chosen: &[Profile]) -> [&Fit<'r>; 2] {
        match &self.even {
            Some([plain, base]) if !chosen.iter().any(|p| is_gear(p.candidate.kind)) => {
                [plain, base]
            }
            _ => [&self.plain, &self.base],
        }
    }

    /// Columns of the free nominal directions, then of the effects.
    fn columns<'c>(&'c self, chosen: &'c [Profile]) -> Columns<'c> {
        let mut columns = Columns {
            fitted: self.free.iter().collect(),
            known: Vec::new(),
            places: Vec::new(),
        };
        for profile in chosen {
            for column in profile.columns.iter() {
                if profile.followed.is_some() {
                    columns
                        .places
                        .push(columns.fitted.len() + columns.known.len());
                    columns.known.push(column);
                } else {
                    columns.fitted.push(column);
                }
            }
        }
        columns
    }

    /// Coefficients of the free nominal directions and of the effects' columns.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] where the motion does not tell them apart.
    pub(super) fn solution(&self, chosen: &[Profile]) -> Result<Solution, DiagnoseError> {
        let columns = self.columns(chosen);
        let [plain, _] = self.footing(chosen);
        solve(&columns.beside(plain), &columns.fitted, &[])
            .map(|solution| solution.with_known(&columns.places))
            .ok_or_else(|| {
                DiagnoseError::Model("its parameters with the effects are not all excited.".into())
            })
    }

    /// Nominal parameters, gains and shapes together; `pairs` are runs that repeat each other.
    ///
    /// Uncertain by what the last model leaves: its memory, not that of what the effects have taken away, and what repeats
    /// with the motion counts once.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn joint(
        &self,
        source: &Source,
        chosen: &[Profile],
        pairs: &[(usize, usize)],
        coordinates: &[Vec<Coordinate>],
    ) -> Result<Joint, DiagnoseError> {
        let [plain, base] = self.footing(chosen);
        let mut beside = with(base, chosen, None);
        let residuals: Vec<Vec<f64>> = (0..self.joints).map(|j| beside.residual(j)).collect();
        let plain = plain.clustered(floor::memory(plain.rows(), &residuals), pairs);
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
            let solution = jackknifed(&plain, &strata, &columns.fitted, slopes)?;
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
                // A shape that changes nothing, or what others change as well, is not known.
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

    /// Torque of the effects with their gains.
    pub(super) fn explained(&self, chosen: &[Profile], after: &Solution) -> Column {
        let columns = chosen.iter().flat_map(|p| p.columns.iter());
        let gains = after.values[self.free.len()..].iter().copied();
        combined(self.joints, columns.zip(gains))
    }

    /// What the description as it stands leaves; friction that it does not state is fitted beside it.
    pub(super) fn frozen(&self, bench: &Bench) -> Fit<'r> {
        let anchor = &bench.anchor;
        let prior = anchor.prior_coefficients();
        let stated = combined(self.joints, self.free.iter().zip(prior));
        let mut frozen = self.plain.clone();
        frozen.subtract(&stated);
        let (base, joints) = (&bench.nominal.base, bench.robot.joints.len());
        let unknown = |k: &usize| {
            let friction = matches!(anchor.free[*k].as_slice(), [(b, _)] if is_friction(base.columns[*b], joints));
            friction && anchor.is_unstated(*k)
        };
        let unknown = (0..self.free.len()).filter(unknown);
        frozen.taking(unknown.map(|k| &self.free[k]))
    }

    /// What moved among the nominal parameters, the surest first. `before` are their coefficients without the effects, or as
    /// described; those that are no number are left out.
    pub(super) fn absorbed(
        &self,
        bench: &Bench,
        before: &[f64],
        after: &Solution,
    ) -> Vec<Absorbed> {
        let mut list: Vec<Absorbed> = (of_directions(bench).enumerate())
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

/// Name and unit of each free nominal direction, and what its coefficient is to be multiplied by for that.
fn of_directions(bench: &Bench) -> impl Iterator<Item = (String, String, f64)> {
    let base = &bench.nominal.base;
    (bench.anchor.free.iter()).map(|direction| match direction.as_slice() {
        [(b, _)] => (bench.expression(*b), base.unit(*b).to_owned(), 1.0),
        // The one direction of several parameters is that of gravity, along the first moment as described.
        _ => (GRAVITY.to_owned(), "N*m".to_owned(), bench.nominal.pull()),
    })
}

/// The same of everything that is fitted together: nominal directions, the effects' gains, these of their shapes (effect and place).
pub(super) fn named(
    bench: &Bench,
    source: &Source,
    chosen: &[Profile],
    shapes: &[(usize, usize)],
) -> Vec<(String, String, f64)> {
    let of_effect = |profile: &Profile, parameter: &Parameter| {
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
    of_directions(bench).chain(gains).chain(shapes).collect()
}

/// Columns that are fitted, and those of a known torque.
struct Columns<'c> {
    fitted: Vec<&'c Column>,
    known: Vec<&'c Column>,
    /// Where the known ones are among all.
    places: Vec<usize>,
}

impl Columns<'_> {
    /// A fit of what the known ones leave.
    fn beside<'r>(&self, plain: &Fit<'r>) -> Fit<'r> {
        let mut plain = plain.clone();
        for column in &self.known {
            plain.subtract(column);
        }
        plain
    }
}

/// The rows in units of what columns leave of each joint, and the time that this remembers, s.
pub(super) fn weighed<'r>(rows: &'r Rows, columns: &[Column]) -> (Fit<'r>, f64) {
    let n = rows.joints();
    let first = Fit::new(rows, vec![1.0; n], 0.1).taking(columns);
    let scale: Vec<f64> = (0..n)
        .map(|j| 1.0 / first.rms(j).max(f64::MIN_POSITIVE))
        .collect();
    let residuals: Vec<Vec<f64>> = (0..n).map(|j| first.residual(j)).collect();
    let memory = floor::memory(rows, &residuals);
    (Fit::new(rows, scale, memory), memory)
}

/// What becomes of what the description states of several joints.
#[derive(Default)]
pub(super) struct Open {
    /// Base parameters of which the motion tells less than the description: what data and description together know hardly better
    /// than the description alone.
    pub(super) held: Vec<usize>,
    /// Friction as described that the data contradict, by how many standard deviations.
    pub(super) contradicted: Vec<(usize, f64)>,
}

/// What the description is worth beside the data: right to [`DESCRIBED`], and unknown where it states nothing.
pub(super) fn open(bench: &Bench, rows: &Rows) -> Open {
    let anchor = &bench.anchor;
    if rows.joints() < 2 || !anchor.stated {
        return Open::default();
    }
    let free = anchor.columns(rows);
    let (fit, memory) = weighed(rows, &free);
    let columns: Vec<Vec<f64>> = free.iter().map(|column| fit.weighted(column)).collect();
    let torque = fit.weighted(&rows.torque.iter().cloned().map(Some).collect());
    let mut spread: Vec<f64> = (described_sizes(bench).into_iter())
        .map(|size| DESCRIBED * size)
        .collect();
    for (k, column) in columns.iter().enumerate() {
        let whole = (dot(&torque, &torque) / dot(column, column)).sqrt();
        // It makes all of the torque at most.
        if anchor.is_unstated(k) && whole.is_finite() {
            spread[k] = whole;
        }
    }
    let rows_in_one = (memory / rows.period).max(1.0);
    let size = columns.len();
    let mut gram = DMatrix::zeros(size, size);
    for a in 0..size {
        for b in 0..=a {
            gram[(a, b)] = dot(&columns[a], &columns[b]) / rows_in_one;
            gram[(b, a)] = gram[(a, b)];
        }
    }
    let mut left = torque;
    for (column, prior) in columns.iter().zip(anchor.prior_coefficients()) {
        axpy(-prior, column, &mut left);
    }
    let along = DVector::from_fn(size, |k, _| dot(&columns[k], &left) / rows_in_one);
    let contradicted = refuted(bench, gram.clone(), &along, &spread);
    for (k, _) in &contradicted {
        spread[*k] = f64::INFINITY;
    }
    let known = DMatrix::from_fn(size, size, |a, b| {
        let own = if a == b { 1.0 } else { 0.0 };
        let [a_wide, b_wide] = [a, b].map(|k| spread[k].min(WIDE));
        a_wide * b_wide * gram[(a, b)] + own
    });
    let Some(known) = known.cholesky() else {
        return Open::default();
    };
    let left = known.inverse();
    let alone = |direction: &Direction| match direction.as_slice() {
        [(b, _)] => Some(*b),
        _ => None,
    };
    let held = (anchor.free.iter().enumerate())
        // What nobody stated is fitted, but for the friction and the constant of a joint that stands throughout.
        .filter(|(k, _)| !anchor.is_unstated(*k) || dot(&columns[*k], &columns[*k]) <= 0.0)
        .filter(|(k, _)| spread[*k].is_finite() && left[(*k, *k)] > HARDLY_BETTER)
        .filter_map(|(_, direction)| alone(direction))
        .collect();
    let contradicted = (contradicted.into_iter())
        .filter_map(|(k, times)| Some((alone(&anchor.free[k])?, times)))
        .collect();
    Open { held, contradicted }
}

/// Natural size of each free direction by the description: of its parameters, each at least a share of the largest of its kind.
pub(super) fn described_sizes(bench: &Bench) -> Vec<f64> {
    let combination = &bench.nominal.base.combination;
    let sizes = weights(bench.robot, combination.ncols());
    (bench.anchor.free.iter())
        .map(|direction| {
            let squares = (0..sizes.len()).map(|c| {
                let along: f64 = direction
                    .iter()
                    .map(|&(k, f)| f * combination[(k, c)])
                    .sum();
                (along * sizes[c]).powi(2)
            });
            squares.sum::<f64>().sqrt()
        })
        .collect()
}

/// Directions of stated friction that data contradict; `gram` and `along` are of columns with the noise as unit.
fn refuted(
    bench: &Bench,
    gram: DMatrix<f64>,
    along: &DVector<f64>,
    spread: &[f64],
) -> Vec<(usize, f64)> {
    let (anchor, base) = (&bench.anchor, &bench.nominal.base);
    let joints = bench.robot.joints.len();
    let of_friction = |k: &usize| {
        matches!(anchor.free[*k].as_slice(), [(b, _)] if is_friction(base.columns[*b], joints))
            && !anchor.is_unstated(*k)
    };
    let stated: Vec<usize> = (0..spread.len()).filter(of_friction).collect();
    let SymmetricEigen {
        eigenvalues,
        eigenvectors,
    } = gram.symmetric_eigen();
    let least = eigenvalues.max() * f64::EPSILON;
    let root = eigenvalues.map(|e| if e > least { e.sqrt() } else { 0.0 });
    let data = DMatrix::from_diagonal(&root) * eigenvectors.transpose();
    let turned = eigenvectors.tr_mul(along);
    let right = DVector::from_fn(root.len(), |k, _| {
        if root[k] > 0.0 {
            turned[k] / root[k]
        } else {
            0.0
        }
    });
    contradicted(&data, &right, spread, &stated)
}

/// Whether a shape is of teeth while they touch: the motor's motion shows their play, and of the contact itself no more than
/// that it is there. The fit needs values, which are no measurements.
fn is_of_contact(kind: Kind, place: usize) -> bool {
    let name = kind.about().shapes[place].name;
    kind == Kind::Backlash && matches!(name, "stiffness" | "damping")
}

/// What play comes out differently by, seen by the motor's motion alone and by following the link. Either law errs where teeth
/// touch, by more than stretches and strata show, and mostly to opposite sides.
fn between_ways(profile: &Profile, place: usize) -> f64 {
    let is_play = profile.candidate.kind == Kind::Backlash
        && profile.candidate.kind.about().shapes[place].name == "gap";
    let otherwise = profile.otherwise.filter(|_| is_play);
    otherwise.map_or(0.0, |shapes| shapes[place] - profile.shapes[place])
}

/// Derivative of an effect's torque with respect to one of its shapes, by a difference that stays within what physics
/// allows.
fn slope(
    source: &Source,
    profile: &Profile,
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

/// 1 % of the value; of the range where a linear one is nearer to zero than that is wide.
fn difference_step(shape: &Parameter, value: f64) -> f64 {
    let size = match shape.scale {
        Scale::Linear => value.abs().max(shape.range[1] - shape.range[0]),
        Scale::Logarithmic | Scale::Whole => value.abs(),
    };
    DIFFERENCE * size
}

/// Everything fitted together.
pub(super) struct Joint {
    /// Coefficients of the free nominal directions, then of the effects' columns; the covariance goes on with the shapes.
    pub(super) solution: Solution,
    /// Standard deviations of each effect's shapes: 0 of a whole number, infinite where the motion does not tell.
    stds: Vec<[f64; SHAPES]>,
}

impl Joint {
    /// Probability that the first `count` gains of the `k`-th effect are nothing but error (Wald 1943), by the covariance that
    /// its intervals are of.
    pub(super) fn of_nothing(
        &self,
        chosen: &[Profile],
        free: usize,
        k: usize,
        count: usize,
    ) -> f64 {
        let gains = self.gains(chosen, free, k);
        let gains = DVector::from_column_slice(&gains[..count.min(gains.len())]);
        let (at, count) = (place(chosen, free, k), gains.len());
        let own = (self.solution.covariance.view((at, at), (count, count))).into_owned();
        let wald = own.cholesky().map(|c| gains.dot(&c.solve(&gains)));
        (wald.zip(ChiSquared::new(count as f64).ok())).map_or(1.0, |(wald, law)| law.sf(wald))
    }

    /// Gains of the `k`-th effect beside all others.
    pub(super) fn gains(&self, chosen: &[Profile], free: usize, k: usize) -> &[f64] {
        let at = place(chosen, free, k);
        &self.solution.values[at..at + chosen[k].columns.len()]
    }

    /// A gain of the `k`-th effect with its standard deviation.
    pub(super) fn gain(&self, chosen: &[Profile], free: usize, k: usize, gain: usize) -> [f64; 2] {
        let at = place(chosen, free, k) + gain;
        [self.solution.values[at], self.solution.std(at)]
    }

    /// Effect and place of each shape that the motion tells, with value and standard deviation.
    pub(super) fn shapes(&self, chosen: &[Profile]) -> Vec<((usize, usize), [f64; 2])> {
        let of_effect = |(k, profile): (usize, &Profile)| {
            let stds = self.stds[k];
            let places = 0..profile.candidate.kind.about().shapes.len();
            (places.filter(move |s| stds[*s] > 0.0 && stds[*s].is_finite()))
                .map(|s| ((k, s), [profile.shapes[s], stds[s]]))
                .collect::<Vec<_>>()
        };
        chosen.iter().enumerate().flat_map(of_effect).collect()
    }

    /// Gains and shapes of the `k`-th effect with their standard deviations.
    pub(super) fn parameters(
        &self,
        source: &Source,
        chosen: &[Profile],
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
        let slack = slack(source.runs);
        (gains.chain(shapes))
            .map(|(parameter, value, std)| {
                let value = Value {
                    value,
                    std: widened(kind, &parameter, value, std, slack),
                    unit: source.unit(&profile.candidate, &parameter),
                };
                (parameter.name.to_owned(), value)
            })
            .collect()
    }
}

/// Angle over slope of a tilted base: what is fitted is gravity across, of which the angle's tangent is a share.
pub(super) fn turn(slopes: &[f64]) -> f64 {
    let slope = slopes.iter().fold(0.0, |norm: f64, s| norm.hypot(*s));
    if slope == 0.0 {
        1.0
    } else {
        slope.atan() / slope
    }
}

/// Where the coefficients of the `k`-th effect begin, behind the `free` nominal directions.
fn place(chosen: &[Profile], free: usize, k: usize) -> usize {
    free + chosen[..k].iter().map(|p| p.columns.len()).sum::<usize>()
}

#[cfg(test)]
mod tests;
