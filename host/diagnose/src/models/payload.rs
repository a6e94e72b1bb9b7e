//! Mass on the last link, from its effect on all joints.
//!
//! A point mass m at p in the last link's frame adds m·(1, p, −[p]×²) to the link's inertial parameters. It changes
//! base parameters of every joint that carries it, in ratios given by p: Khalil, Gautier & Lemoine 2007,
//! "Identification of the payload inertial parameters of industrial manipulators". Mass and place are fitted to the
//! residual of the description without a refit. If the residual shows that the payload is no point, its inertia about
//! its own centre of mass is fitted beside them: an arm that knows the mass by its inertia alone would take it for mass.
//!
//! Leaves out: other errors of the description.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector3};
use rig_shared::multibody::{COLUMNS, column};

use crate::fit::evidence::Evidence;
use crate::fit::least_squares::Fit;
use crate::fit::solution::Solution;
use crate::fit::systematic_uncertainty::LINK;
use crate::levels::SIGNIFICANT;
use crate::outcome::Value;
use crate::recordings::context::DiagnosisContext;
use crate::rows::regression::{Column, Rows, combined};
use rig_identify::independent_columns;
use rig_model::robot::{Inertial, JointKind};
use rig_numerics::statistics;
use rig_numerics::vector::dot;
use statrs::function::erf::erfc;

/// Least ratio of a change to its standard deviation.
pub(crate) const LEAST_SIGMAS: f64 = 4.0;
/// Most rounds of the fit; each starts at the last place, which converges in three or four.
const ROUNDS: usize = 12;
/// Change of the place, m, below which it has converged.
const SETTLED: f64 = 1e-6;
/// Share of a column that must be independent of the others for its parameter to be identifiable.
const TOLD: f64 = 1e-3;
/// Range of a payload's distance, m: a link's mass is within some metres of its axis, and adds no inertia on it.
const NEAREST: f64 = 0.01;
const FARTHEST: f64 = 3.0;
/// Names of a place's coordinates.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];

/// A point mass on the last link.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Load {
    /// kg
    pub(crate) mass: Value,
    /// m, in the last link's frame as in its file; `None` for a coordinate that is not identifiable.
    pub(crate) place: [Option<Value>; 3],
    /// RMS torque of the load, by joint.
    pub(crate) torque: Vec<f64>,
}

impl Load {
    /// Returns mass and place as parameters of an effect.
    pub(crate) fn parameters(&self) -> BTreeMap<String, Value> {
        let told = AXES.iter().zip(&self.place);
        told.filter_map(|(axis, value)| Some(((*axis).to_owned(), value.clone()?)))
            .chain([("mass".to_owned(), self.mass.clone())])
            .collect()
    }
}

fn value(value: f64, std: f64, unit: &str) -> Value {
    Value {
        value,
        std,
        unit: unit.into(),
    }
}

/// Returns inertial parameters of one kilogram at a place of the last link's own frame. Adds their derivatives by its
/// first moment along that frame's axes, kg·m. The parameters are in the frame of the last joint.
fn kilogram(place: Vector3<f64>, link: &Isometry3<f64>) -> [[f64; 10]; 4] {
    let p = (link * Point3::from(place)).coords;
    let point = |at: Vector3<f64>| Inertial::point(at.into()).parameters();
    let along = |axis: usize| {
        let unit = link.rotation * Vector3::ith(axis, 1.0);
        let [both, one, other] = [p + unit, p, unit].map(point);
        // Inertia is quadratic in the place: its slope is the value at the sum minus both single values.
        std::array::from_fn(|k| match k {
            0 => 0.0,
            1..=3 => unit[k - 1],
            _ => both[k] - one[k] - other[k],
        })
    };
    [point(p), along(0), along(1), along(2)]
}

/// Returns the torque of a change of the last link's inertial parameters.
fn column_of(context: &DiagnosisContext, rows: &Rows, change: &[f64; 10]) -> Column {
    let base = &context.nominal.base;
    let first = (context.robot.joints.len() - 1) * COLUMNS;
    let terms = (0..base.columns.len()).map(|b| {
        let own = change.iter().enumerate();
        let factor: f64 = own.map(|(c, x)| base.combination[(b, first + c)] * x).sum();
        (&rows.nominal[b], factor)
    });
    combined(rows.joints(), terms.filter(|(_, factor)| *factor != 0.0))
}

/// Fits mass and place of a payload on the last of several links to the description's residual `frozen`. Returns them
/// with their evidence; `None` if the mass is not identifiable.
pub(crate) fn on_last_link(
    context: &DiagnosisContext,
    rows: &Rows,
    frozen: &Fit,
) -> Option<(Load, Evidence)> {
    if context.robot.joints.len() < 2 {
        return None;
    }
    let (point, fitted) = settled(context, rows, frozen, false)?;
    let body = fitted
        .is_no_point(context, rows, frozen)
        .then(|| settled(context, rows, frozen, true))
        .flatten()
        .filter(|(_, body)| body.is_possible());
    Some(match body {
        Some((load, body)) => (load, body.evidence),
        None => (point, fitted.evidence),
    })
}

/// A converged fit of a payload.
struct FittedLoad {
    /// The unknowns that are identifiable: 0 mass, 1 to 3 place, 4 to 9 inertia about the centre of mass.
    told: Vec<usize>,
    /// Their weighted columns, projected.
    columns: Vec<Vec<f64>>,
    evidence: Evidence,
}

impl FittedLoad {
    /// Returns true if an inertia about the centre of mass is significant beside a point.
    fn is_no_point(&self, context: &DiagnosisContext, rows: &Rows, frozen: &Fit) -> bool {
        let own = own_inertia(context, rows);
        let mut all: Vec<Vec<f64>> = self.columns.clone();
        all.extend((own.iter()).map(|c| frozen.projected(frozen.weighted(c))));
        let matrix = |list: &[Vec<f64>]| {
            let columns: Vec<DVector<f64>> = (list.iter())
                .map(|c| DVector::from_column_slice(c))
                .collect();
            DMatrix::from_columns(&columns)
        };
        let order: Vec<usize> = (0..all.len()).collect();
        let kept = independent_columns(&matrix(&all), &order, TOLD).kept;
        let picked: Vec<Vec<f64>> = kept.iter().map(|k| all[*k].clone()).collect();
        let open = vec![[f64::NEG_INFINITY, f64::INFINITY]; picked.len()];
        let Some(evidence) = frozen.evidence(&picked, &open) else {
            return false;
        };
        let tried = kept.iter().filter(|k| **k >= self.columns.len()).count();
        (kept.iter().enumerate())
            .filter(|(_, k)| **k >= self.columns.len())
            .any(|(place, _)| {
                let sigmas = evidence.gains[place] / evidence.stds[place];
                two_sided(sigmas) * tried as f64 <= SIGNIFICANT
            })
    }

    /// Returns true if no moment of inertia about the centre of mass is significantly negative.
    fn is_possible(&self) -> bool {
        (self.told.iter().enumerate())
            .filter(|(_, k)| [4, 7, 9].contains(*k))
            .all(|(place, _)| {
                self.evidence.gains[place] > -LEAST_SIGMAS * self.evidence.stds[place]
            })
    }
}

/// Returns the two-sided p-value of a normal deviate.
fn two_sided(sigmas: f64) -> f64 {
    erfc(sigmas.abs() / std::f64::consts::SQRT_2)
}

/// Returns the torques of a unit of each element of an inertia on the last link.
fn own_inertia(context: &DiagnosisContext, rows: &Rows) -> Vec<Column> {
    (4..10)
        .map(|k| {
            column_of(
                context,
                rows,
                &std::array::from_fn(|c| f64::from(u8::from(c == k))),
            )
        })
        .collect()
}

/// Fits a payload round by round, as a point or with inertia about its centre of mass.
fn settled(
    context: &DiagnosisContext,
    rows: &Rows,
    frozen: &Fit,
    extended: bool,
) -> Option<(Load, FittedLoad)> {
    let own = if extended {
        own_inertia(context, rows)
    } else {
        Vec::new()
    };
    let open = |k: usize| match k {
        0 => [0.0, f64::INFINITY],
        _ => [f64::NEG_INFINITY, f64::INFINITY],
    };
    let mut place = Vector3::zeros();
    for _ in 0..ROUNDS {
        let columns: Vec<Column> = kilogram(place, &context.robot.flange_pose())
            .iter()
            .map(|body| column_of(context, rows, body))
            .chain(own.iter().cloned())
            .collect();
        let weighted: Vec<Vec<f64>> = (columns.iter())
            .map(|c| frozen.projected(frozen.weighted(c)))
            .collect();
        let all: Vec<DVector<f64>> = (weighted.iter())
            .map(|c| DVector::from_column_slice(c))
            .collect();
        let order: Vec<usize> = (0..all.len()).collect();
        let told = independent_columns(&DMatrix::from_columns(&all), &order, TOLD).kept;
        if told.first() != Some(&0) {
            return None;
        }
        let picked: Vec<Vec<f64>> = told.iter().map(|k| weighted[*k].clone()).collect();
        let bounds: Vec<[f64; 2]> = told.iter().map(|k| open(*k)).collect();
        let evidence = frozen.evidence(&picked, &bounds)?;
        let mass = evidence.gains[0];
        if mass <= 0.0 {
            return None;
        }
        let mut moved: f64 = 0.0;
        let of_place = |(k, _): &(&usize, &f64)| (1..4).contains(*k);
        for (k, gain) in told.iter().zip(&evidence.gains).filter(of_place) {
            let by = (gain / mass).clamp(-FARTHEST, FARTHEST);
            place[k - 1] += by;
            moved = moved.max(by.abs());
        }
        if place.norm() > FARTHEST {
            return None;
        }
        if moved < SETTLED {
            let off = systematic(context, rows, frozen, &picked)?;
            let fitted = FittedLoad {
                told,
                columns: picked,
                evidence,
            };
            return Some((load(place, &fitted, &off, &columns[0]), fitted));
        }
    }
    None
}

/// Returns mass, place and torque of a fitted payload; `off` are the systematic errors of its unknowns.
fn load(place: Vector3<f64>, fitted: &FittedLoad, off: &[f64], kilogram: &Column) -> Load {
    let evidence = &fitted.evidence;
    let mass = evidence.gains[0];
    let std = |k: usize| evidence.stds[k].hypot(off[k]);
    let mut at = [None, None, None];
    for (k, axis) in (fitted.told.iter().enumerate()).filter(|(_, axis)| (1..4).contains(*axis)) {
        at[axis - 1] = Some(value(place[axis - 1], std(k) / mass, "m"));
    }
    let rms = |c: &Option<Vec<f64>>| mass * c.as_ref().map_or(0.0, |c| statistics::rms(c));
    Load {
        mass: value(mass, std(0), "kg"),
        place: at,
        torque: kilogram.iter().map(rms).collect(),
    }
}

/// Returns the error of these columns' coefficients if each joint's described torque is wrong by [`LINK`].
fn systematic(
    context: &DiagnosisContext,
    rows: &Rows,
    frozen: &Fit,
    columns: &[Vec<f64>],
) -> Option<Vec<f64>> {
    let size = columns.len();
    let gram = DMatrix::from_fn(size, size, |r, c| dot(&columns[r], &columns[c])).cholesky()?;
    let anchor = &context.anchor;
    let stated = combined(
        rows.joints(),
        rows.nominal.iter().zip(anchor.prior.iter().copied()),
    );
    let mut squares = vec![0.0; size];
    for j in 0..rows.joints() {
        let own = (0..rows.joints()).map(|k| stated[k].clone().filter(|_| k == j));
        let own = frozen.projected(frozen.weighted(&own.collect()));
        let right = DVector::from_iterator(size, columns.iter().map(|c| dot(c, &own)));
        for (sum, x) in squares.iter_mut().zip(gram.solve(&right).iter()) {
            *sum += (LINK * x).powi(2);
        }
    }
    Some(squares.into_iter().map(f64::sqrt).collect())
}

/// Returns mass and distance of a payload on a single link, and the free directions that it changes. `None` unless
/// gravity and inertia change by a share of `least` or more.
pub(crate) fn on_single_link(
    context: &DiagnosisContext,
    after: &Solution,
    prior: &[f64],
    least: f64,
) -> Option<(BTreeMap<String, Value>, [usize; 2])> {
    let (nominal, anchor) = (&context.nominal, &context.anchor);
    let [joint] = context.robot.joints.as_slice() else {
        return None;
    };
    if joint.kind != JointKind::Revolute {
        return None;
    }
    let inertia = anchor.free.iter().position(
        |d| matches!(d.as_slice(), [(b, _)] if nominal.base.columns[*b] == column::INERTIA + 5),
    )?;
    let moment = anchor.first_moment(nominal)?;
    // First moment and inertia of a point mass m at distance l: m·l and m·l².
    let (dm, dj) = (
        after.values[moment] - prior[moment],
        after.values[inertia] - prior[inertia],
    );
    let material = |change: f64, k: usize| {
        change > least * prior[k].abs() && change > LEAST_SIGMAS * after.std(k)
    };
    if !(material(dm, moment) && material(dj, inertia)) {
        return None;
    }
    let (distance, mass) = (dj / dm, dm * dm / dj);
    let (vm, vj, c) = (
        after.covariance[(moment, moment)] + (LINK * after.values[moment]).powi(2),
        after.covariance[(inertia, inertia)] + (LINK * after.values[inertia]).powi(2),
        after.covariance[(moment, inertia)],
    );
    let spread = |gm: f64, gj: f64| {
        (gm * gm * vm + gj * gj * vj + 2.0 * gm * gj * c)
            .max(0.0)
            .sqrt()
    };
    let parameters = BTreeMap::from([
        (
            "mass".to_owned(),
            value(mass, spread(2.0 * dm / dj, -dm * dm / (dj * dj)), "kg"),
        ),
        (
            "distance".to_owned(),
            value(distance, spread(-dj / (dm * dm), 1.0 / dm), "m"),
        ),
    ]);
    (NEAREST..FARTHEST)
        .contains(&distance)
        .then_some((parameters, [inertia, moment]))
}
