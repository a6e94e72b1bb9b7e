//! Readings that stay the same although they cannot: a sensor, its line or its driver that is frozen for a while.
//!
//! In a motion a sound channel stays on one value by chance, or because it is coarse. Both end as the robot moves on, so the
//! movement of the joints during such a stay falls off exponentially, at least as fast as the second longest stay says. A
//! stay is no chance if this law does not give it among as many rows, and if every joint moves in it that moves at all: the
//! weight in a channel may not change while one joint turns.
//!
//! At rest, poses that hold the load differently read differently, by more than the sensor's resolution.
//!
//! Leaves out: a sensor that is frozen several times for as long, whose stays look like each other.

use nalgebra::Vector3;
use rig_data::{Block, WRENCH_COLUMNS};
use rig_output::{format_significant, listed};

use crate::pace::AT_REST;
use crate::statistics::Recorded;
use crate::wrench_row::{WEIGHED, WrenchRow};

/// Probability by chance, over all rows of a channel, below which a stay is a fault.
const BY_CHANCE: f64 = 1e-4;
/// Relative difference up to which mean readings are equal: rounding.
const ROUNDING: f64 = 1e-9;

/// How far the joints moved, in steps of [`AT_REST`] by joint: the noise of an encoder at rest makes none.
#[derive(Default)]
struct Travel {
    from: Vec<f64>,
    steps: Vec<u64>,
}

impl Travel {
    fn push(&mut self, row: usize, block: &Block) {
        if self.from.is_empty() {
            self.from = block.joints.iter().map(|joint| joint.q[row]).collect();
            self.steps = vec![0; self.from.len()];
        }
        let all = self.from.iter_mut().zip(&mut self.steps);
        for ((from, steps), joint) in all.zip(&block.joints) {
            let moved = ((joint.q[row] - *from) / AT_REST).trunc();
            if moved != 0.0 {
                *from += moved * AT_REST;
                *steps += moved.abs() as u64;
            }
        }
    }
}

/// Rows in which a channel reads one value.
#[derive(Clone, Debug, Default, PartialEq)]
struct Stay {
    value: f64,
    /// First and last line.
    lines: [u64; 2],
    /// Travel of the joints before it, then during it.
    steps: Vec<u64>,
}

impl Stay {
    fn length(&self) -> u64 {
        self.steps.iter().sum()
    }
}

/// The stays of a channel.
#[derive(Default)]
struct Stays {
    now: Stay,
    longest: Stay,
    /// Length of the second longest one.
    second: u64,
    /// True after the first row.
    begun: bool,
}

impl Stays {
    /// Ends the stay at a row that reads another value; the joints have moved to it.
    fn end(&mut self, travel: &Travel) {
        for (own, now) in self.now.steps.iter_mut().zip(&travel.steps) {
            *own = now - *own;
        }
        let length = self.now.length();
        if length > self.longest.length() {
            self.second = self.longest.length();
            self.longest.clone_from(&self.now);
        } else {
            self.second = self.second.max(length);
        }
    }

    fn push(&mut self, value: f64, line: u64, travel: &Travel) {
        let goes_on = self.begun && self.now.value == value;
        if !goes_on {
            if self.begun {
                self.end(travel);
            }
            self.begun = true;
            self.now.value = value;
            self.now.lines[0] = line;
            self.now.steps.clone_from(&travel.steps);
        }
        self.now.lines[1] = line;
    }

    /// Returns the longest stay if it is no chance.
    fn fault(&self, rows: u64, travel: &Travel) -> Option<&Stay> {
        let longest = &self.longest;
        let scale = self.second.max(1) as f64;
        let is_chance = (rows as f64).ln() - longest.length() as f64 / scale > BY_CHANCE.ln();
        let mut joints = longest.steps.iter().zip(&travel.steps);
        let all_move = joints.all(|(own, all)| *own > 0 || *all == 0);
        (!is_chance && all_move).then_some(longest)
    }
}

/// The stays of all channels of a motion.
#[derive(Default)]
pub(crate) struct Frozen {
    travel: Travel,
    channels: [Stays; 6],
    rows: u64,
}

impl Frozen {
    /// Takes the rows of a block.
    pub(crate) fn push(&mut self, block: &Block, readings: [&[f64]; 6]) {
        for row in 0..block.len() {
            self.travel.push(row, block);
            self.rows += 1;
            let line = block.line(row);
            for (channel, list) in self.channels.iter_mut().zip(readings) {
                channel.push(list[row], line, &self.travel);
            }
        }
    }

    /// Says which channels are frozen, and where; `None` if none is. `reach` are the lowest and highest reading of each
    /// channel: one that stays there alone may be cut.
    pub(crate) fn words(mut self, label: &str, reach: &[[f64; 2]; 6]) -> Option<String> {
        let travel = &self.travel;
        self.channels.iter_mut().for_each(|own| own.end(travel));
        let found: Vec<(usize, &Stay)> = (self.channels.iter().enumerate())
            .filter_map(|(c, own)| Some((c, own.fault(self.rows, travel)?)))
            .collect();
        let all = found.len() == self.channels.len();
        let inside = |(c, stay): &&(usize, &Stay)| all || !reach[*c].contains(&stay.value);
        let (_, longest) = *found
            .iter()
            .filter(inside)
            .max_by_key(|own| own.1.length())?;
        let same: Vec<&(usize, &Stay)> = (found.iter().filter(inside))
            .filter(|own| own.1.lines == longest.lines)
            .collect();
        let what = match same[..] {
            [(c, stay)] => format!(
                "{} reads {} {} in each of them",
                WRENCH_COLUMNS[*c],
                format_significant(stay.value, 4),
                if *c < 3 { "N" } else { "N·m" }
            ),
            _ if same.len() == self.channels.len() => {
                "all six channels repeat one reading".to_owned()
            }
            _ => {
                let names = same.iter().map(|own| WRENCH_COLUMNS[own.0].to_owned());
                let names: Vec<String> = names.collect();
                format!("{} repeat one reading", listed(&names))
            }
        };
        let [first, last] = longest.lines;
        Some(format!(
            "{label}, lines {first} to {last}: {what} while all joints move: the sensor, its line or its driver was frozen there. Remove these rows, or record again."
        ))
    }
}

/// Says that several poses of a recording have identical readings though they hold the load differently; `None` if none do.
/// `gravity` is that of the base frame.
pub(crate) fn identical_poses(recorded: &Recorded, gravity: &Vector3<f64>) -> Option<String> {
    if !recorded.poses {
        return None;
    }
    let rows = &recorded.sample;
    let down: Vec<Vector3<f64>> = rows.iter().map(|row| weight_along(row, gravity)).collect();
    let is_same = |a: usize, b: usize| {
        (0..6).all(|c| {
            let [a, b] = [a, b].map(|k| rows[k].readings[c]);
            (a - b).abs() <= ROUNDING * (a.abs() + b.abs())
        })
    };
    let force = |k: usize| Vector3::from_column_slice(&rows[k].readings[..3]);
    let pairs = || (0..rows.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    // What the forces change by for a turn of the weight, and what they resolve.
    let change = |(a, b): (usize, usize)| (force(a) - force(b)).norm();
    let turn = |(a, b): (usize, usize)| (down[a] - down[b]).norm();
    let widest = pairs().max_by(|a, b| change(*a).total_cmp(&change(*b)))?;
    let slope = change(widest) / turn(widest).max(f64::MIN_POSITIVE);
    let step = |c: usize| {
        let all = pairs().map(|(a, b)| (rows[a].readings[c] - rows[b].readings[c]).abs());
        (all.filter(|step| *step > ROUNDING * change(widest))).fold(f64::INFINITY, f64::min)
    };
    let resolved = (0..3).map(|c| step(c).powi(2)).sum::<f64>().sqrt();
    let group = |a: usize| -> Vec<usize> { (0..rows.len()).filter(|b| is_same(a, *b)).collect() };
    let largest = (0..rows.len()).map(group).max_by_key(Vec::len)?;
    let turned = (largest.iter())
        .flat_map(|a| largest.iter().map(move |b| turn((*a, *b))))
        .fold(0.0, f64::max);
    (slope * turned > resolved).then(|| {
        let times: Vec<String> = (largest.iter())
            .map(|k| format_significant(rows[*k].time, 4))
            .collect();
        format!(
            "{}: the readings of {} poses are identical (t = {} s), though these poses hold the load differently: the sensor or its line was frozen there. Record these poses again.",
            recorded.label,
            largest.len(),
            listed(&times)
        )
    })
}

/// Returns the direction of gravity in the axes of a pose's sensor.
fn weight_along(row: &WrenchRow, gravity: &Vector3<f64>) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (entries, along) in row.weights.iter().zip(gravity.iter()) {
        sum -= Vector3::from_fn(|axis, _| entries[axis * WEIGHED]) * *along;
    }
    sum.try_normalize(0.0).unwrap_or(sum)
}
