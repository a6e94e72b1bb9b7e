//! Thermal history: motion of the joints in their session before a stretch of a recording.

use std::sync::Arc;

use super::history::Spell;
use super::runs::Run;

pub use super::history::Past;

/// Longest pause within a session, s: a gear stays warm for some minutes.
const ONE_SESSION: f64 = 60.0;

/// A stretch that another stretch may continue.
struct Known {
    recording: Option<usize>,
    began: f64,
    end: f64,
    past: Past,
    spell: Arc<Spell>,
}

impl Known {
    fn of(run: &Run, recording: Option<usize>) -> Self {
        Self {
            recording,
            began: run.began,
            end: run.t.last().copied().unwrap_or(run.began),
            past: run.past.clone(),
            spell: spell_of(run),
        }
    }
}

fn spell_of(run: &Run) -> Arc<Spell> {
    let velocities = run.joints.iter().map(|joint| joint.qd.as_slice());
    Arc::new(Spell::of(run.rate, velocities))
}

/// Links each stretch of `runs` to the earlier stretches of its session, in `runs` or `before`. A recording continues
/// an earlier one if its clock continues after a pause of at most 60 s. Clocks that restart with each recording link
/// none.
pub fn in_sessions(runs: &mut [Run], before: &[Run]) {
    let mut known: Vec<Known> = before.iter().map(|run| Known::of(run, None)).collect();
    let start = |run: &Run| run.t.first().copied().unwrap_or(run.began);
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by(|a, b| start(&runs[*a]).total_cmp(&start(&runs[*b])));
    for r in order {
        let run = &mut runs[r];
        let (first, own) = (run.began, start(run));
        run.began = (known.iter())
            .filter(|k| k.began < first && (k.end..=k.end + ONE_SESSION).contains(&first))
            .map(|k| k.began)
            .fold(first, f64::min);
        // If two end at the same time, the one of the same recording is taken: a repetition may have the same clock.
        let latest = (known.iter())
            .filter(|k| k.began == run.began && k.end < own)
            .filter(|k| k.began < first || k.recording == Some(run.recording))
            .max_by(|a, b| {
                let same = |k: &Known| k.recording == Some(run.recording);
                (a.end.total_cmp(&b.end)).then(same(a).cmp(&same(b)))
            });
        if let Some(latest) = latest {
            let mut past = latest.past.clone();
            past.0.push((latest.spell.clone(), own - latest.end));
            run.past = past;
        }
        known.push(Known::of(run, Some(run.recording)));
    }
}

#[cfg(test)]
mod tests;
