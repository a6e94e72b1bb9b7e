//! Joints that move in one direction only: dry friction and a constant torque are collinear; the data give their sum.
//!
//! Rows near rest would separate the two only by the smoothed sign of friction there, which measures neither. They are
//! not used for such a joint, in an identification and in a diagnosis.

use super::equation::Rows;
use super::tally::Tally;

/// Smallest smoothed sign of dry friction at which a joint slides; below it the sign is changing near rest.
pub const SLIDES: f64 = 0.99;
/// Smallest sliding time in each direction that separates dry friction from a constant torque, s. A law of the speed
/// needs the same time in slow motion (`diagnose::testable`).
const LEAST: f64 = 0.5;

/// Counts of rows in which a joint slides forwards and backwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slides([usize; 2]);

impl Slides {
    /// Adds the sign of dry friction of a used row.
    pub fn take(&mut self, direction: f64) {
        self.0[0] += usize::from(direction > SLIDES);
        self.0[1] += usize::from(direction < -SLIDES);
    }

    /// Returns the only direction of a joint, 1 or −1; none if it moves both ways or hardly moves. `period` is that of
    /// the rows, s.
    pub fn one_way(self, period: f64) -> Option<f64> {
        let [ahead, back] = self.0.map(|rows| rows as f64 * period);
        (ahead.min(back) < LEAST && ahead.max(back) >= LEAST).then_some(if ahead > back {
            1.0
        } else {
            -1.0
        })
    }
}

/// A joint that moves in one direction only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneWay {
    /// Index of the joint, from 0.
    pub(crate) joint: usize,
    /// Place of its dry friction among the columns.
    pub(crate) place: usize,
    /// 1 or −1.
    pub(crate) direction: f64,
}

impl OneWay {
    /// Excludes and counts the joint's rows near rest, so that it slides in all others.
    pub(crate) fn apply(&self, rows: &mut Rows, tally: &mut Tally) {
        let Some(equation) = rows.equations.get_mut(self.joint) else {
            return;
        };
        let width = equation.x.len() / equation.y.len().max(1);
        for (row, keep) in equation.x.chunks_mut(width.max(1)).zip(&mut equation.keep) {
            let slides = self.direction * row[self.place] > SLIDES;
            if slides {
                row[self.place] = self.direction;
            } else if *keep {
                Tally::count(&mut tally.slow, self.joint);
            }
            *keep &= slides;
        }
    }
}
