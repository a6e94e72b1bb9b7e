//! Identified values that no robot can have.

use rig_shared::multibody::{COLUMNS, column};

use rig_identify::{Identification, LEAST_ERROR};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit, listed};

/// Half-widths of a 95 % interval (2.5: five standard deviations) by which a value must lie below zero to count as
/// impossible. In a recording of a few seconds friction and other parameters are nearly collinear. With many joints,
/// one friction value may then be below zero by chance.
const CLEARLY: f64 = 2.5;
/// Half-width of a 95 % interval in standard deviations, about.
const WIDTH: f64 = 2.0;

/// Sentences about friction and inertia that lie below zero by many standard deviations.
///
/// A base parameter that is a sum of masses, moments of inertia and friction with positive factors cannot be negative.
/// In an arm, inertias compensate each other: a negative one may be a model error that others cancel, so it is a
/// warning.
pub struct Impossible {
    /// Those that refuse the result.
    pub refused: Vec<String>,
    /// Those that are only warnings.
    pub doubtful: Vec<String>,
}

impl Impossible {
    /// Judges the values of an identification.
    pub fn of(robot: &Robot, found: &Identification) -> Self {
        let details = &found.details;
        // Half-width of the 95 % interval.
        let half = |row: usize| {
            let [value, _, high] = details.free[row];
            (high - value) * widened(robot, found, details.columns[row])
        };
        let below_zero = |row: usize| details.free[row][0] + CLEARLY * half(row) < 0.0;
        let wrong: Vec<usize> = (0..details.free.len())
            .filter(|row| below_zero(*row) && found.is_positive_sum(*row))
            .collect();
        let of = |j: usize, place: usize| {
            let column = j * COLUMNS + place;
            wrong.iter().any(|row| details.columns[*row] == column)
        };
        let driving: Vec<usize> = (0..robot.joints.len())
            .filter(|j| of(*j, column::VISCOUS) && of(*j, column::COULOMB))
            .collect();
        let driven: Vec<String> = (driving.iter())
            .map(|&j| {
                format!(
                    "viscous and Coulomb friction of joint \"{}\" are both below zero, so friction would drive the motion: the sign of tau{n} or i{n}, of q{n}, or of gear_ratio is wrong.",
                    robot.joints[j].name,
                    n = j + 1
                )
            })
            .collect();
        let alone = |row: &&usize| {
            let column = details.columns[**row];
            let friction = [column::VISCOUS, column::COULOMB].contains(&(column % COLUMNS));
            !(friction && driving.contains(&(column / COLUMNS)))
        };
        let (mut refused, mut doubtful) = (Vec::new(), Vec::new());
        for row in wrong.iter().filter(alone) {
            let value = details.free[*row][0];
            let own = &found.base_parameters[*row];
            let column = details.columns[*row];
            let friction = [column::VISCOUS, column::COULOMB].contains(&(column % COLUMNS));
            let list = match friction || robot.link_count() == 1 {
                true => &mut refused,
                false => &mut doubtful,
            };
            list.push(format!(
                "{} of joint \"{}\" is {} {}, below zero by {} of its standard deviations",
                own.expression,
                robot.link_name(column / COLUMNS),
                format_significant(value, 3),
                format_unit(&own.unit),
                format_significant(-value * WIDTH / half(*row), 2),
            ));
        }
        let said = |list: Vec<String>| match list.is_empty() {
            true => Vec::new(),
            false => vec![format!(
                "No robot can have these values: {}. Check the columns (unit, sign, time, single rows), the description and the cut-off.",
                listed(&list)
            )],
        };
        Self {
            refused: driven.into_iter().chain(said(refused)).collect(),
            doubtful: said(doubtful),
        }
    }
}

/// Returns the factor by which an interval is wider if no torque is known better than by [`LEAST_ERROR`]. Friction acts
/// on its own joint alone, a link on all joints before it too, and beside axes that follow on others.
fn widened(robot: &Robot, found: &Identification, column: usize) -> f64 {
    let joint = column / COLUMNS;
    let friction = column % COLUMNS >= column::VISCOUS;
    let first = if friction { joint } else { 0 };
    let last = match robot.has_followers() && !friction {
        true => found.joints.len(),
        false => joint + 1,
    };
    (found.joints.iter().take(last).skip(first))
        .map(|own| LEAST_ERROR / own.train_relative_error)
        .filter(|factor| factor.is_finite())
        .fold(1.0, f64::max)
}
