//! Joints that move in one direction only: there dry friction and a constant torque are one constant, and the data tell their sum.
//!
//! Rows near rest would separate the two by the way in which the direction of friction is smoothed there, which is no measurement of
//! either. They do not count for such a joint, in an identification and in a diagnosis alike.

use rig_shared::multibody::{COLUMNS, column};

use super::model::{Plan, Rows, Tally, each_rows};
use super::{IdentifyError, ModelKind};
use rig_data::prepare::Recording;

/// Direction of dry friction from which on a joint slides in it: the rest is the smoothed change of direction about a rest.
pub const SLIDES: f64 = 0.99;
/// Time that a joint has to slide in each direction for its dry friction to be told from a constant torque, s: as long as a law of the
/// speed needs in slow motion (`diagnose::testable`).
const LEAST: f64 = 0.5;

/// Rows in which a joint slides ahead and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slides([usize; 2]);

impl Slides {
    /// Takes the direction of dry friction of a row that is used.
    pub fn take(&mut self, direction: f64) {
        self.0[0] += usize::from(direction > SLIDES);
        self.0[1] += usize::from(direction < -SLIDES);
    }

    /// The one direction that a joint moves in, 1 or −1; none where it moves both ways, or hardly at all. `period` is that of the
    /// rows, s.
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
    /// Which, from 0.
    joint: usize,
    /// Place of its dry friction among the columns.
    place: usize,
    /// 1 or −1.
    direction: f64,
}

impl OneWay {
    /// Leaves out rows of the joint about rests, and counts them. In the others it slides.
    pub(super) fn apply(&self, rows: &mut Rows, tally: &mut Tally) {
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

/// Joints of the training data that move one way only, of those whose dry friction and constant torque are both among the columns.
///
/// # Errors
/// What reading gives.
pub(super) fn one_way(
    training: &[&dyn Recording],
    plan: &Plan,
) -> Result<Vec<OneWay>, IdentifyError> {
    let place =
        |joint: usize, own: usize| (plan.columns.iter()).position(|c| *c == joint * COLUMNS + own);
    let joints = plan.chain.joint_count();
    let places: Vec<(usize, usize)> = (0..joints)
        .filter(|joint| place(*joint, column::OFFSET).is_some())
        .filter_map(|joint| Some((joint, place(joint, column::COULOMB)?)))
        .collect();
    let mut slides = vec![Slides::default(); places.len()];
    let width = plan.columns.len();
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for ((joint, place), slides) in places.iter().zip(&mut slides) {
                let equation = &rows.equations[*joint];
                for (row, keep) in equation.x.chunks(width).zip(&equation.keep) {
                    if *keep {
                        slides.take(row[*place]);
                    }
                }
            }
            Ok(())
        })?;
    }
    let period = plan.treatment.decimation.max(1) as f64 / plan.treatment.sample_rate;
    Ok((places.into_iter().zip(slides))
        .filter_map(|((joint, place), slides)| {
            Some(OneWay {
                joint,
                place,
                direction: slides.one_way(period)?,
            })
        })
        .collect())
}
