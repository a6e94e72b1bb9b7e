//! Thermal history: motion of the joints in their session before a stretch of a recording.

use std::sync::Arc;

use super::runs::Run;
use super::thermal_history::Segment;

pub use super::thermal_history::ThermalHistory;

/// Longest pause within a session, s: a gear stays warm for some minutes.
const MAX_SESSION_PAUSE: f64 = 60.0;

/// A stretch that another stretch may continue.
struct EarlierRun {
    recording: Option<usize>,
    began: f64,
    end: f64,
    thermal_history: ThermalHistory,
    segment: Arc<Segment>,
}

impl EarlierRun {
    fn of(run: &Run, recording: Option<usize>) -> Self {
        Self {
            recording,
            began: run.began,
            end: run.t.last().copied().unwrap_or(run.began),
            thermal_history: run.thermal_history.clone(),
            segment: segment_of(run),
        }
    }
}

fn segment_of(run: &Run) -> Arc<Segment> {
    let velocities = run.joints.iter().map(|joint| joint.qd.as_slice());
    Arc::new(Segment::of(run.rate, velocities))
}

/// Links each stretch of `runs` to the earlier stretches of its session, in `runs` or `before`. A recording continues
/// an earlier one if its clock continues after a pause of at most 60 s. Clocks that restart with each recording link
/// none.
pub fn join_sessions(runs: &mut [Run], before: &[Run]) {
    let mut earlier: Vec<EarlierRun> = before.iter().map(|run| EarlierRun::of(run, None)).collect();
    let start = |run: &Run| run.t.first().copied().unwrap_or(run.began);
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by(|a, b| start(&runs[*a]).total_cmp(&start(&runs[*b])));
    for r in order {
        let run = &mut runs[r];
        let (first, own) = (run.began, start(run));
        run.began = (earlier.iter())
            .filter(|k| k.began < first && (k.end..=k.end + MAX_SESSION_PAUSE).contains(&first))
            .map(|k| k.began)
            .fold(first, f64::min);
        // If two end at the same time, the one of the same recording is taken: a repetition may have the same clock.
        let latest = (earlier.iter())
            .filter(|k| k.began == run.began && k.end < own)
            .filter(|k| k.began < first || k.recording == Some(run.recording))
            .max_by(|a, b| {
                let same = |k: &EarlierRun| k.recording == Some(run.recording);
                (a.end.total_cmp(&b.end)).then(same(a).cmp(&same(b)))
            });
        if let Some(latest) = latest {
            let mut thermal_history = latest.thermal_history.clone();
            thermal_history
                .0
                .push((latest.segment.clone(), own - latest.end));
            run.thermal_history = thermal_history;
        }
        earlier.push(EarlierRun::of(run, Some(run.recording)));
    }
}

#[cfg(test)]
mod tests;
