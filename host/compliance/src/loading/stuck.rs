//! Columns that stand still while the load goes on: a sensor at the end of its range, or one that has stopped.
//!
//! A sensor that varies from row to row repeats a value in many neighbouring rows only if something holds it: its range
//! (saturation), or a connection that was lost. Held weights are no fault: force and deflection rest together.
//!
//! Leaves out: sensors that repeat most values anyway (coarse or slow ones), whose end of range looks like their other values.

use rig_data::WRENCH_COLUMNS;
use rig_output::format_significant;

use super::windows::{means, noise, range};
use super::wrench::DISPLACEMENT;
use crate::error::ComplianceError;
use crate::signals::Signals;

/// Share of the rows in which a column stands still, from which it is refused: that of saturated torques which is told.
const STILL: f64 = 0.01;
/// Fewest such rows.
const FEWEST: usize = 10;
/// Length of the longest run of one value over that of the usual run. By calculation, a sine in whole steps of a coarse gauge stays twice to three
/// times as long at its largest value as in between.
const LONGER: usize = 10;
/// Fewest different values beside the repeated one: fewer are those of a coarse gauge, or of weights.
const VALUES: usize = 20;
/// Share of the whole range of another column by which it moves on meanwhile. By judgement: creep under a held weight is less.
const MOVES: f64 = 0.02;
/// Standard deviations of a part's noise that are no movement: the extremes of five values are rarely 5 apart.
const NOISE_RANGE: f64 = 5.0;
/// Parts of a run whose means are compared.
const PARTS: usize = 5;

/// A column that stands still.
struct Stuck {
    value: f64,
    /// Runs of rows, first and behind the last.
    runs: Vec<[usize; 2]>,
    is_extreme: bool,
}

/// Refuses a force or a deflection that stands still while the other one goes on.
///
/// # Errors
/// [`ComplianceError::Recording`].
pub(super) fn refuse_stuck(signals: &Signals) -> Result<(), ComplianceError> {
    let named = |names: &[&str]| -> Vec<(String, Vec<f64>)> {
        (names.iter())
            .filter_map(|name| Some(((*name).to_owned(), signals.column(name)?.to_vec())))
            .collect()
    };
    let force = named(&WRENCH_COLUMNS);
    let mut deflection = named(&DISPLACEMENT);
    let links = (1..).zip(&signals.joints);
    deflection.extend(links.filter_map(|(k, joint)| Some((format!("ql{k}"), joint.link.clone()?))));
    for (own, others) in [(&force, &deflection), (&deflection, &force)] {
        for (name, values) in own {
            let stuck = candidates(values).into_iter().find_map(|stuck| {
                // An axis that is not loaded for a while reads 0.
                let all = stuck.value != 0.0 || stand(own, &stuck.runs);
                let mover = others
                    .iter()
                    .find(|(_, other)| goes_on(other, &stuck.runs))?;
                all.then_some((stuck, mover.0.clone()))
            });
            if let Some((stuck, mover)) = stuck {
                return Err(told(signals, name, values, &stuck, &mover));
            }
        }
    }
    Ok(())
}

/// Returns the values that a column repeats in long runs: its extremes, and that of the longest run.
fn candidates(values: &[f64]) -> Vec<Stuck> {
    let n = values.len();
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for row in 0..n {
        match runs.last_mut() {
            Some(last) if values[last[0]] == values[row] => last[1] = row + 1,
            _ => runs.push([row, row + 1]),
        }
    }
    let length = |run: &[usize; 2]| run[1] - run[0];
    let Some(longest) = runs.iter().max_by_key(|run| length(run)) else {
        return Vec::new();
    };
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut tried = vec![low, high];
    if longest[1] > longest[0] && values[longest[0]] != low && values[longest[0]] != high {
        tried.push(values[longest[0]]);
    }
    tried
        .into_iter()
        .filter_map(|value| {
            let (own, others): (Vec<[usize; 2]>, Vec<[usize; 2]>) =
                runs.iter().partition(|run| values[run[0]] == value);
            let own: Vec<[usize; 2]> = own.into_iter().filter(|run| length(run) > 1).collect();
            let rows: usize = own.iter().map(length).sum();
            let mut usual: Vec<usize> = others.iter().map(length).collect();
            usual.sort_unstable();
            let usual = *usual.get(usual.len() / 2)?;
            let most = own.iter().map(length).max()?;
            let mut different: Vec<f64> = others.iter().map(|run| values[run[0]]).collect();
            different.sort_by(f64::total_cmp);
            different.dedup();
            let is_still = rows as f64 > STILL * n as f64 && rows >= FEWEST;
            (is_still && most >= LONGER * usual && different.len() >= VALUES).then_some(Stuck {
                value,
                runs: own,
                is_extreme: value == low || value == high,
            })
        })
        .collect()
}

/// Returns true if all columns that vary stand still in the runs.
fn stand(columns: &[(String, Vec<f64>)], runs: &[[usize; 2]]) -> bool {
    let mut varying = columns.iter().filter(|(_, own)| range(own.iter()) > 0.0);
    let still = |own: &[f64], run: &[usize; 2]| range(own[run[0]..run[1]].iter()) == 0.0;
    varying.all(|(_, own)| runs.iter().all(|run| still(own, run)))
}

/// Returns true if a column moves on within a run, by more than its noise and by more than creep: by the means of parts of the run.
fn goes_on(values: &[f64], runs: &[[usize; 2]]) -> bool {
    let (whole, scatter) = (range(values.iter()), noise(values));
    runs.iter().any(|[first, end]| {
        let part = (end - first) / PARTS;
        if part == 0 {
            return false;
        }
        let parts = means(&values[*first..*end], part);
        range(parts.iter()) > MOVES * whole + NOISE_RANGE * scatter / (part as f64).sqrt()
    })
}

fn told(
    signals: &Signals,
    name: &str,
    values: &[f64],
    stuck: &Stuck,
    mover: &str,
) -> ComplianceError {
    let rows: usize = stuck.runs.iter().map(|run| run[1] - run[0]).sum();
    let unit = match name.as_bytes() {
        [b'f', ..] => "N",
        [b'm', ..] => "N·m",
        [b'd', ..] => "m",
        _ => "rad (m)",
    };
    let reason = match stuck.is_extreme {
        true => {
            "It is the extreme value of the column, so the sensor is at the end of its range (saturation). Load less, or take a sensor with a larger range."
        }
        false => {
            "The sensor or its connection stopped there. Record again, or leave these rows out."
        }
    };
    ComplianceError::Recording(format!(
        "{}: {name} stands at {} {unit} in {} % of the rows (first at t = {} s) while {mover} goes on, which makes the stiffness wrong. {reason}",
        signals.label,
        format_significant(stuck.value, 4),
        format_significant(100.0 * rows as f64 / values.len() as f64, 2),
        format_significant(signals.t[stuck.runs[0][0]], 4)
    ))
}

#[cfg(test)]
mod tests {
    use super::{candidates, goes_on};

    /// A force of ±80 N, 20 s to and fro at 50 Hz, and what a spring gives, each with noise.
    fn loaded(clip: f64) -> [Vec<f64>; 2] {
        let at = |k: usize| (0.1 * std::f64::consts::PI * 0.02 * k as f64).sin();
        let noise = |k: usize, seed: f64| (12.9898 * k as f64 + seed).sin() * 43758.5453;
        let noise = |k: usize, seed: f64| 2.0 * noise(k, seed).rem_euclid(1.0) - 1.0;
        let force = (0..2000).map(|k| (80.0 * at(k) + noise(k, 1.0)).clamp(-clip, clip));
        let moved = (0..2000).map(|k| 4e-4 * at(k) + 1e-5 * noise(k, 2.0));
        [force.collect(), moved.collect()]
    }

    #[test]
    fn a_clipped_force_is_told_from_one_that_is_held() {
        let stuck = |[force, moved]: &[Vec<f64>; 2]| {
            candidates(force)
                .iter()
                .any(|own| goes_on(moved, &own.runs))
        };
        for (clip, told) in [(60.0, true), (70.0, true), (100.0, false)] {
            assert_eq!(stuck(&loaded(clip)), told, "{clip}");
        }
        // A weight that hangs still: the deflection rests with it.
        let [force, moved] = loaded(100.0);
        let held = |k: usize| if (300..700).contains(&k) { 300 } else { k };
        let moved: Vec<f64> = (0..2000)
            .map(|k| moved[held(k)] + 1e-7 * (k % 7) as f64)
            .collect();
        let force: Vec<f64> = (0..2000).map(|k| force[held(k)]).collect();
        assert!(!stuck(&[force, moved]));
    }
}
