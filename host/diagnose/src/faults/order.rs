//! Joint columns in another order than the description's.

use crate::DiagnoseError;
use crate::faults::candidates::Before;
use crate::faults::judge::Judge;
use crate::faults::undo::{Columns, Side, Undo};

impl Judge<'_> {
    /// Returns the order in which these columns, measured on this side of the gears, explain the recording best, and the
    /// best exchange of two alone; nothing for the description's order.
    ///
    /// Starts from the description's order and exchanges joints while that explains convincingly more.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn orders(
        &self,
        (which, side): (Columns, Side),
        before: &Before,
    ) -> Result<Vec<Undo>, DiagnoseError> {
        let mut found: Vec<Undo> = Vec::new();
        let (mut gained, mut pair) = (0.0, (0.0, None));
        let mut order: Vec<usize> = (0..self.robot.joints.len()).collect();
        for _ in 1..before.moving.len() {
            let mut next = None;
            let mut enough = gained + before.enough;
            for places in exchanges(order.len(), &before.moving) {
                let tried: Vec<usize> = places.iter().map(|place| order[*place]).collect();
                let undo = Undo::Order(which, side, tried.clone());
                let gain = self.gain_without(&undo, before)?;
                let moved = (0..tried.len()).filter(|j| tried[*j] != *j).count();
                if moved == 2 && gain > pair.0 {
                    pair = (gain, Some(undo.clone()));
                }
                if gain > enough {
                    enough = gain;
                    next = Some((tried, undo));
                }
            }
            let Some((better, undo)) = next else {
                break;
            };
            (order, gained) = (better, enough);
            found = vec![undo];
        }
        found.extend(pair.1.filter(|pair| !found.contains(pair)));
        Ok(found)
    }
}

/// Returns orders with two or three of `joints` exchanged, all of them rotated, or all reversed.
fn exchanges(count: usize, joints: &[usize]) -> Vec<Vec<usize>> {
    let placed = |own: &[usize], others: &[usize]| {
        let mut places: Vec<usize> = (0..count).collect();
        for (j, other) in own.iter().zip(others) {
            places[*j] = *other;
        }
        places
    };
    let mut all = Vec::new();
    for (k, &a) in joints.iter().enumerate() {
        for (l, &b) in joints.iter().enumerate().skip(k + 1) {
            all.push(placed(&[a, b], &[b, a]));
            for &c in &joints[l + 1..] {
                all.push(placed(&[a, b, c], &[b, c, a]));
                all.push(placed(&[a, b, c], &[c, a, b]));
            }
        }
    }
    let mut others = joints.to_vec();
    for _ in 1..joints.len() {
        others.rotate_left(1);
        all.push(placed(joints, &others));
    }
    others = joints.iter().rev().copied().collect();
    all.push(placed(joints, &others));
    all
}
