//! Nominal parameters that a motion does not tell apart.
//!
//! A motion in one direction shows Coulomb friction and the constant torque as their sum, one at a single speed viscous friction as
//! well. Such a parameter is held where the description has it (at zero where it states none), and the others get the
//! combination, which the motion does show: as `rig identify` does, by the same measure.
//!
//! Leaves out: several joints, of which [`super::refit::open`] holds what the description knows better; effects that are like a
//! parameter of the model, which the search refuses one by one.

use rig_shared::multibody::{COLUMNS, column};

use super::bench::Bench;
use super::fit::dot;
use super::refit::weighed;
use super::rows::Rows;

/// A column that differs from a combination of the others by a smaller share of its length tells nothing of its own: the measure of
/// `rig identify`, where a value would rest on a thousandth of the torque.
const OF_ITS_OWN: f64 = 1.0e-3;

/// A base parameter that rows do not tell from others.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Alike {
    /// Which is held.
    pub(super) parameter: usize,
    /// Those whose values have the combination with it.
    with: Vec<usize>,
}

/// A column that tells something of its own.
struct Kept {
    /// Among the free directions.
    direction: usize,
    /// Of the column.
    length: f64,
    /// What it adds to the columns kept before it, of length one.
    along: Vec<f64>,
    /// That as a sum of the columns kept so far, itself the last.
    of: Vec<f64>,
}

/// Free base parameters of a single joint whose torque is a combination of that of others in these rows, so that all the others can be
/// fitted.
pub(super) fn alike(bench: &Bench, rows: &Rows) -> Vec<Alike> {
    let anchor = &bench.anchor;
    if rows.joints() > 1 {
        return Vec::new();
    }
    let free = anchor.columns(rows);
    let (fit, _) = weighed(rows, &free);
    let mut order: Vec<usize> = (0..free.len()).collect();
    // Those that a plain motion tells least are held first: the constant, then friction, then drive and link.
    order.sort_by_key(|k| {
        let columns = anchor.free[*k]
            .iter()
            .map(|(b, _)| bench.nominal.base.columns[*b] % COLUMNS);
        columns.map(rank).min().unwrap_or(0)
    });
    let mut kept: Vec<Kept> = Vec::new();
    let mut found = Vec::new();
    for k in order {
        let mut own = fit.weighted(&free[k]);
        let whole = dot(&own, &own).sqrt();
        // How much of each kept column is in this one.
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
        // A direction of several parameters, as gravity's of a single link, is not held by itself.
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

/// The later, the sooner held.
fn rank(column: usize) -> usize {
    match column {
        column::OFFSET => 3,
        column::VISCOUS => 2,
        column::COULOMB => 1,
        _ => 0,
    }
}

impl Alike {
    /// As a sentence.
    pub(super) fn said(&self, bench: &Bench) -> String {
        let name = |k: usize| bench.nominal.base.expression(k);
        let own = name(self.parameter);
        let value = bench.anchor.prior[self.parameter];
        if self.with.is_empty() {
            return format!(
                "The training motion does not show {own}: it stays at {value}, as described or as none is stated."
            );
        }
        let others: Vec<String> = self.with.iter().map(|k| name(*k)).collect();
        format!(
            "The training motion does not tell {own} from {}: {own} stays at {value}, as described or as none is stated, and {} the combination with it. A motion in both directions, at several speeds, would tell them apart.",
            others.join(", "),
            if others.len() == 1 {
                "that has"
            } else {
                "those have"
            }
        )
    }
}
