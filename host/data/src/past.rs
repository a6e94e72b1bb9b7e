//! Thermal history: motion of the joints in their session before a stretch of a recording.
//!
//! Heat changes slowly compared with the motion, so means over 0.1 s are sufficient.

use std::sync::Arc;

use rig_shared::effects::{Effect, Instant, Kind, Memory};

use super::runs::Run;

/// Longest pause within a session, s: a gear stays warm for some minutes.
const ONE_SESSION: f64 = 60.0;

/// Averaging time of the motion, s: a hundredth of the shortest time constant of the search.
const SPAN: f64 = 0.1;

/// Earlier stretches of the session in order of time, each with the pause after it, s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Past(Vec<(Arc<Spell>, f64)>);

/// Motion in a stretch: mean speed and mean square velocity over each span, per joint.
#[derive(Debug, PartialEq)]
struct Spell {
    /// Length of a span, s.
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
    /// Returns the state of an effect after this history, for a joint with the given viscous and Coulomb friction. Only
    /// thermal effects keep a state over a pause.
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
                // Friction that does, at this velocity, the same work as in the span.
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
            spell: Arc::new(Spell::of(run)),
        }
    }
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
