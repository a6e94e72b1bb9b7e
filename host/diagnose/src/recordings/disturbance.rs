//! Disturbances in only one of two runs of a motion: contact, an impact, a moved zero.
//!
//! The difference of two runs is noise for any model. A few short stretches with most of it are an event and would hide
//! all else. They are excluded from both runs and reported.
//!
//! Leaves out: events in both runs at the same place of the motion, which belong to the rig; lasting events; contact in
//! a commanded dwell, where friction may hold the joint.

use std::ops::Range;

use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::recordings::outlier_segment::{Burst, burst};
use crate::rows::regression::Rows;
use rig_data::runs::Run;

/// Time that is excluded on either side of a disturbance, s: the reach of a filter.
const BESIDE: f64 = 0.25;

/// Least duration of a standstill, s; a reversal is shorter.
const LASTING: f64 = 0.3;

/// A disturbance in one of two runs of a motion.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Touch {
    /// Its joint, from 0.
    pub(crate) joint: usize,
    /// Start and end of its largest stretch, s after the start of the first run.
    pub(crate) time: [f64; 2],
    /// Labels of the disturbed and of the other run.
    pub(crate) labels: [String; 2],
    /// RMS of its largest stretch over that elsewhere.
    pub(crate) times: f64,
    /// Number of its stretches of half a second.
    pub(crate) count: usize,
}

/// Marks rows in which a joint stands: unused for at least [`LASTING`].
fn lasting(keep: &[bool], period: f64) -> Vec<bool> {
    keep.chunk_by(|a, b| a == b)
        .flat_map(|part| {
            let stands = !part[0] && part.len() as f64 * period >= LASTING;
            std::iter::repeat_n(stands, part.len())
        })
        .collect()
}

/// Marks a run's first `length` rows in which its reference moves; all without a reference.
fn asked(run: &Run, joint: usize, rows: &Rows, length: usize) -> Vec<bool> {
    let period = rows.period;
    let own = run.joints[joint].reference.as_ref();
    (0..length)
        .map(|k| {
            let at = (rows.thinning.trimmed(run) + k as f64 * period) * run.rate;
            let sample = |row: f64| (at + row * period * run.rate).max(0.0).round() as usize;
            own.is_none_or(|r| match (r.get(sample(-0.5)), r.get(sample(0.5))) {
                (Some(before), Some(after)) => before != after,
                _ => false,
            })
        })
        .collect()
}

/// A run, and rows counted from its first.
type Part = (usize, Range<usize>);

/// Two runs of one motion.
struct Pair {
    /// Both runs.
    runs: [usize; 2],
    /// First row of each.
    starts: [usize; 2],
    /// Number of rows that both have.
    length: usize,
}

impl Pair {
    fn of((a, b): (usize, usize), rows: &Rows) -> Self {
        let starts = [a, b].map(|run| rows.starts[run]);
        Self {
            runs: [a, b],
            starts,
            length: (rows.starts[a + 1] - starts[0]).min(rows.starts[b + 1] - starts[1]),
        }
    }

    /// Returns the stretches with most of the difference of a joint's residual. Rows that are `out` already are known.
    fn differs(
        &self,
        prepared: &PreparedData,
        joint: usize,
        residual: &[f64],
        out: &[Part],
    ) -> Option<Burst> {
        let rows = &prepared.rows;
        let Self {
            runs: [a, b],
            starts,
            length,
        } = *self;
        let mut apart = vec![0.0; rows.count];
        let mut keep = vec![false; rows.count];
        let known = |run: usize, row: usize| {
            let mut rows = (out.iter()).filter(|(known, _)| *known == run);
            rows.any(|(_, part)| part.contains(&row))
        };
        // Runs that come to rest at slightly different times differ without a disturbance.
        let resting =
            starts.map(|start| lasting(&rows.keep[joint][start..start + length], rows.period));
        let asked = asked(&prepared.runs[a], joint, rows, length);
        let commanded = lasting(&asked, rows.period);
        let reach = (BESIDE / rows.period).ceil() as usize;
        let near = |k: usize| k.saturating_sub(reach)..(k + reach + 1).min(length);
        for k in 0..length {
            let [x, y] = starts.map(|start| start + k);
            let rests = resting.iter().all(|rests| rests[near(k)].contains(&true));
            // In a commanded dwell, each run may stop on another side of its friction.
            let at_rest = rests || commanded[near(k)].contains(&true);
            let known = known(a, k) || known(b, k);
            keep[x] = rows.keep[joint][x] && rows.keep[joint][y] && !at_rest && !known;
            apart[x] = residual[x] - residual[y];
        }
        burst(&apart, &keep, &rows.starts, rows.period, &prepared.runs)
    }

    /// Returns such stretches as a disturbance of the run with the larger residual there.
    fn touch(&self, runs: &[Run], joint: usize, residual: &[f64], burst: &Burst) -> Touch {
        let Self {
            runs: [a, b],
            starts,
            ..
        } = *self;
        let squares = |start: usize| -> f64 {
            (burst.rows.iter())
                .flat_map(|part| part.clone())
                .map(|x| residual[x - starts[0] + start].powi(2))
                .sum()
        };
        let (own, other) = if squares(starts[0]) > squares(starts[1]) {
            (a, b)
        } else {
            (b, a)
        };
        Touch {
            joint,
            time: burst.time.map(|t| t - runs[a].t.first().unwrap_or(&0.0)),
            labels: [own, other].map(|run| runs[run].label.clone()),
            times: burst.times,
            count: burst.count,
        }
    }
}

/// Excludes disturbances from runs of one motion and returns them. `residuals` are those of the refitted
/// model, joint by joint.
pub(crate) fn touched(residuals: &[Vec<f64>], prepared: &mut PreparedData) -> Vec<Touch> {
    let mut found = Vec::new();
    let mut out: Vec<Part> = Vec::new();
    for repeat in noise_floor::repeats(&prepared.runs) {
        let pair = Pair::of(repeat, &prepared.rows);
        for (j, residual) in residuals.iter().enumerate() {
            let Some(burst) = pair.differs(prepared, j, residual, &out) else {
                continue;
            };
            found.push(pair.touch(&prepared.runs, j, residual, &burst));
            for part in &burst.rows {
                let own = part.start - pair.starts[0]..part.end - pair.starts[0];
                out.extend(pair.runs.map(|run| (run, own.clone())));
            }
        }
    }
    leave_out(prepared, out);
    found
}

/// Leaves these rows out of their runs.
fn leave_out(prepared: &mut PreparedData, out: Vec<Part>) {
    let (period, thinning) = (prepared.rows.period, &prepared.rows.thinning);
    for (run, part) in out {
        let run: &mut Run = &mut prepared.runs[run];
        let trimmed = thinning.trimmed(run);
        let [from, to] = [part.start, part.end].map(|row| row as f64 * period + trimmed);
        let sample = |t: f64| ((t * run.rate).max(0.0).round() as usize).min(run.t.len());
        let part = sample(from - BESIDE)..sample(to + BESIDE);
        run.left_out.push(part);
    }
}
