//! Collinear nominal parameters.
//!
//! A motion in one direction shows only the sum of Coulomb friction and constant torque; at a single speed viscous
//! friction is part of it too. Such a parameter is held at its described value, or at zero without one. The others take
//! the combination, which the motion does show. `rig identify` does the same, with the same criterion.
//!
//! Leaves out: several joints, where [`crate::fit::open_parameters::open`] holds what the description knows better; effects that are
//! collinear with a model parameter, which the search rejects one by one.

use rig_shared::multibody::{COLUMNS, column};

use crate::fit::refit::weighed;
use crate::recordings::context::DiagnosisContext;
use crate::rows::regression::Rows;
use rig_numerics::vector::dot;

/// Length share below which a column is collinear with the others. As in `rig identify`: its value would rest on a
/// thousandth of the torque.
const OF_ITS_OWN: f64 = 1.0e-3;

/// A base parameter that is collinear with others.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Alike {
    /// The held parameter.
    pub(crate) parameter: usize,
    /// Parameters whose values include it.
    pub(crate) with: Vec<usize>,
}

/// A column that is not collinear with others.
struct Kept {
    /// Index among the free directions.
    direction: usize,
    /// Length of the column.
    length: f64,
    /// Its part that is orthogonal to the columns kept before it, of length one.
    along: Vec<f64>,
    /// That part as a sum of the columns kept so far, itself the last.
    of: Vec<f64>,
}

/// Finds free base parameters of a single joint that are collinear with others in these rows. With them held, all
/// others can be fitted.
pub(crate) fn alike(context: &DiagnosisContext, rows: &Rows) -> Vec<Alike> {
    let anchor = &context.anchor;
    if rows.joints() > 1 {
        return Vec::new();
    }
    let free = anchor.columns(rows);
    let (fit, _) = weighed(rows, &free);
    let mut order: Vec<usize> = (0..free.len()).collect();
    // The least identifiable are held first: the constant, then friction, then drive and link.
    order.sort_by_key(|k| {
        let columns = anchor.free[*k]
            .iter()
            .map(|(b, _)| context.nominal.base.columns[*b] % COLUMNS);
        columns.map(rank).min().unwrap_or(0)
    });
    let mut kept: Vec<Kept> = Vec::new();
    let mut found = Vec::new();
    for k in order {
        let mut own = fit.weighted(&free[k]);
        let whole = dot(&own, &own).sqrt();
        // Share of each kept column in this one.
        let mut of = vec![0.0; kept.len()];
        for one in &kept {
            let share = dot(&own, &one.along);
            own.iter_mut()
                .zip(&one.along)
                .for_each(|(x, y)| *x -= share * y);
            of.iter_mut()
                .zip(&one.of)
                .for_each(|(all, own)| *all += share * own);
        }
        let left = dot(&own, &own).sqrt();
        if left > OF_ITS_OWN * whole {
            own.iter_mut().for_each(|x| *x /= left);
            let mut of: Vec<f64> = of.iter().map(|share| -share / left).collect();
            of.push(1.0 / left);
            kept.push(Kept {
                direction: k,
                length: whole,
                along: own,
                of,
            });
            continue;
        }
        // A direction of several parameters, such as gravity's of a single link, is not held by itself.
        if let [(parameter, _)] = anchor.free[k].as_slice() {
            let with = (kept.iter().zip(&of))
                .filter(|(one, share)| share.abs() * one.length > OF_ITS_OWN * whole)
                .filter_map(|(one, _)| Some(anchor.free[one.direction].first()?.0));
            found.push(Alike {
                parameter: *parameter,
                with: with.collect(),
            });
        }
    }
    found
}

/// Returns the rank of a column; the highest is held first.
fn rank(column: usize) -> usize {
    match column {
        column::OFFSET => 3,
        column::VISCOUS => 2,
        column::COULOMB => 1,
        _ => 0,
    }
}
