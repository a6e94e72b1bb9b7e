//! Joint columns in another order than the description's.

use crate::DiagnoseError;
use crate::faults::candidates::{Before, Found};
use crate::faults::judge::Judge;
use crate::faults::undo::{Columns, Undo};
use crate::outcome::{About, DataFault, FaultKind};
use rig_output::listed;

impl Judge<'_> {
    /// Returns the order in which these columns explain the recording best, and the best exchange of two alone; nothing
    /// for the description's order.
    ///
    /// Starts from the description's order and exchanges joints while that explains convincingly more.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn orders(
        &self,
        which: Columns,
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
                let undo = Undo::Order(which, tried.clone());
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

    /// Returns another order as a fault of the recording.
    pub(crate) fn order_said(&self, which: Columns, order: &[usize], found: &Found) -> DataFault {
        let moved: Vec<usize> = (0..order.len()).filter(|j| order[*j] != *j).collect();
        let first = moved.first().copied().unwrap_or(0);
        let names = |column: &str, joints: &[usize]| {
            let all: Vec<String> = joints
                .iter()
                .map(|j| format!("{column}{}", j + 1))
                .collect();
            listed(&all)
        };
        let stand: Vec<usize> = moved.iter().map(|j| order[*j]).collect();
        let two = moved.len() == 2;
        let (about, column, other) = match which {
            Columns::Torques => (About::Torque, "tau", "q"),
            Columns::Positions | Columns::Joints => (About::Motion, "q", "tau"),
        };
        let or = match found.has_twin() {
            true => format!(" (or {})", names(other, &moved)),
            false => String::new(),
        };
        let text = match which {
            Columns::Joints if two => format!(
                "The columns of joint {} ({}) and joint {} ({}) stand in each other's place, all of them: exchanged, {}; number them in the order of the description.",
                moved[0] + 1,
                self.name(moved[0]),
                moved[1] + 1,
                self.name(moved[1]),
                found.compared()
            ),
            Columns::Joints => format!(
                "The joints stand in another order than in the description: what belongs to joints {} stands in the columns of joints {}. In the right order {}; number them in the order of the description.",
                names("", &moved),
                names("", &stand),
                found.compared()
            ),
            _ if two => format!(
                "{}{or} stand in each other's columns: swapped, {}; give each its own.",
                names(column, &moved),
                found.compared()
            ),
            _ => format!(
                "{}{or} stand in another order than the joints: what belongs there stands in {}. In the right order {}; give each its own.",
                names(column, &moved),
                names(column, &stand),
                found.compared()
            ),
        };
        self.say(FaultKind::Swap, about, first, text)
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
