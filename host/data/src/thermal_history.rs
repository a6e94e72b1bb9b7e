//! Motion of the joints in earlier stretches, in means over 0.1 s: heat changes slowly compared with the motion.

use std::sync::Arc;

use rig_shared::effects::{Effect, Instant, Kind, Memory};

/// Averaging time of the motion, s: a hundredth of the shortest time constant of the search.
const SEGMENT_SECONDS: f64 = 0.1;

/// Earlier stretches of the session in order of time, each with the pause after it, s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ThermalHistory(pub(super) Vec<(Arc<Segment>, f64)>);

/// Motion in a stretch: mean speed and mean square velocity over each span, per joint.
#[derive(Debug, PartialEq)]
pub(super) struct Segment {
    /// Length of a span, s.
    period: f64,
    joints: Vec<Vec<[f64; 2]>>,
}

impl Segment {
    /// Takes the means of the joints' velocities, recorded at `rate` Hz.
    pub(super) fn of<'a>(rate: f64, velocities: impl Iterator<Item = &'a [f64]>) -> Self {
        let samples = ((SEGMENT_SECONDS * rate).round() as usize).max(1);
        let mean = |span: &[f64]| {
            let count = span.len() as f64;
            let speed: f64 = span.iter().map(|v| v.abs()).sum();
            let squares: f64 = span.iter().map(|v| v * v).sum();
            [speed / count, squares / count]
        };
        Self {
            period: samples as f64 / rate,
            joints: velocities
                .map(|qd| qd.chunks(samples).map(mean).collect())
                .collect(),
        }
    }
}

impl ThermalHistory {
    /// Returns the state of an effect after this history, for a joint with the given viscous and Coulomb friction. Only
    /// thermal effects keep a state over a pause.
    pub fn state_after(
        &self,
        effect: &Effect<f64>,
        joint: usize,
        [viscous, coulomb]: [f64; 2],
    ) -> Memory<f64> {
        let mut memory = Memory::default();
        if effect.kind != Kind::ViscousWarmupHeat {
            return memory;
        }
        for (segment, pause) in &self.0 {
            for [speed, square] in &segment.joints[joint] {
                // Friction that does, at this velocity, the same work as in the span.
                let velocity = square.sqrt();
                let work = coulomb * speed + viscous * square;
                let friction = if velocity > 0.0 { work / velocity } else { 0.0 };
                let at = Instant {
                    velocity,
                    friction,
                    period: segment.period,
                    ..Instant::default()
                };
                effect.torque(&mut memory, &at);
            }
            memory = effect.after_pause(memory, *pause);
        }
        memory
    }
}
