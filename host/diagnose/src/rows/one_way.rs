//! Joints that move in one direction only. Their dry friction and constant torque are collinear: the data show the sum.
//!
//! Uses the rule of an identification ([`rig_identify::Slides`]).

use rig_shared::multibody::{COLUMNS, column};

use crate::rows::nominal::Nominal;
use crate::rows::regression::Rows;
use rig_identify::{SLIDES, Slides};
use rig_output::format_significant;

/// A joint that moves in one direction only.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OneWay {
    /// Index, from 0.
    pub(crate) joint: usize,
    /// Base parameters of its dry friction and its constant torque.
    parameters: [usize; 2],
    /// Direction of motion, 1 or −1.
    direction: f64,
}

impl OneWay {
    /// Returns the base parameter of its constant torque, which is held.
    pub(crate) fn constant(&self) -> usize {
        self.parameters[1]
    }

    /// Returns the base parameter of its dry friction, which includes the constant.
    pub(crate) fn friction(&self) -> usize {
        self.parameters[0]
    }

    /// Returns the direction of motion, 1 or −1.
    pub(crate) fn direction(&self) -> f64 {
        self.direction
    }

    /// Returns the name of the dry friction, with the constant `held` in it or beside it.
    pub(crate) fn named(&self, held: f64) -> String {
        let number = self.joint + 1;
        let sign = if self.direction < 0.0 { '-' } else { '+' };
        if held == 0.0 {
            format!("fc{number} {sign} off{number}")
        } else {
            format!(
                "fc{number} with off{number} = {}",
                format_significant(held, 4)
            )
        }
    }
}

impl OneWay {
    /// Excludes rows of the joint near rests, where the direction of friction is smoothed.
    pub(crate) fn leave_out_rests(&self, rows: &mut Rows) {
        let Some(directions) = &rows.nominal[self.friction()][self.joint] else {
            return;
        };
        for (keep, direction) in rows.keep[self.joint].iter_mut().zip(directions) {
            *keep &= direction.abs() > SLIDES;
        }
    }
}

/// Returns joints that move in one direction only, if dry friction and constant torque are separate base parameters.
pub(crate) fn one_way(nominal: &Nominal, rows: &Rows) -> Vec<OneWay> {
    let place = |joint: usize, own: usize| {
        let column = joint * COLUMNS + own;
        nominal.base.columns.iter().position(|c| *c == column)
    };
    (0..rows.joints())
        .filter_map(|joint| {
            let friction = place(joint, column::COULOMB)?;
            let constant = place(joint, column::OFFSET)?;
            let directions = rows.nominal[friction][joint].as_ref()?;
            let mut slides = Slides::default();
            let used = directions.iter().zip(&rows.keep[joint]);
            used.filter(|(_, keep)| **keep)
                .for_each(|(direction, _)| slides.take(*direction));
            Some(OneWay {
                joint,
                parameters: [friction, constant],
                direction: slides.one_way(rows.period)?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests;
