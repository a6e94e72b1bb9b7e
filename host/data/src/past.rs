//! What joints did in their session before a stretch of a recording: what has warmed up is warm.
//!
//! Heat is slow beside a motion, so that its mean over a tenth of a second is enough of it.

use std::sync::Arc;

use rig_shared::effects::{Effect, Instant, Kind, Memory};

use super::runs::Run;

/// Longest pause within a session, s: a gear keeps its warmth for some minutes.
const ONE_SESSION: f64 = 60.0;

/// Time over which motion is taken together, s: a hundredth of the shortest time constant that is looked for.
const SPAN: f64 = 0.1;

/// Stretches that a session began with, the first first, each with the pause after it, s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Past(Vec<(Arc<Spell>, f64)>);

/// What happened in a stretch: mean speed and mean square of the velocity over each span, joint by joint.
#[derive(Debug, PartialEq)]
struct Spell {
    /// Of a span, s.
    period: f64,
    joints: Vec<Vec<[f64; 2]>>,
}

impl Spell {
    fn of(run: &Run) -> Self {
        let samples = ((SPAN * run.rate).round() as usize).max(1);
        let mean = |span: &[f64]| {
            let count = span.len() as f64;
            let speed: f64 = span.iter().map(|v| v.abs()).sum();
            let squares: f64 = span.iter().map(|v| v * v).sum();
            [speed / count, squares / count]
        };
        Self {
            period: samples as f64 / run.rate,
            joints: (run.joints.iter())
                .map(|joint| joint.qd.chunks(samples).map(mean).collect())
                .collect(),
        }
    }
}

impl Past {
    /// What an effect remembers after it, with a joint's viscous and Coulomb friction: of all effects only heat outlasts a pause.
    pub fn remembered(
        &self,
        effect: &Effect<f64>,
        joint: usize,
        [viscous, coulomb]: [f64; 2],
    ) -> Memory<f64> {
        let mut memory = Memory::default();
        if effect.kind != Kind::ViscousWarmupHeat {
            return memory;
        }
        for (spell, pause) in &self.0 {
            for [speed, square] in &spell.joints[joint] {
                // The friction whose work at this velocity is what was done over the span.
                let velocity = square.sqrt();
                let work = coulomb * speed + viscous * square;
                let friction = if velocity > 0.0 { work / velocity } else { 0.0 };
                let at = Instant {
                    velocity,
                    friction,
                    period: spell.period,
                    ..Instant::default()
                };
                effect.torque(&mut memory, &at);
            }
            memory = effect.rested(memory, *pause);
        }
        memory
    }
}

/// A stretch that another may go on from.
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
            spell: Arc::new(Spell::of(run)),
        }
    }
}

/// Lets recordings go on from those of `runs` and `before` that they were made after, by one clock and within
/// 60 s, and stretches from those before them. Clocks that begin anew with each recording say nothing of that.
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
        // Of two that end as late that of the same recording, where a repeat has the same clock.
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
