//! What the two encoders of a joint read apart, in figures.

use rig_shared::effects::Kind;

use crate::fit::systematic_uncertainty::inflated;
use crate::link_encoder::analysis::{Fitted, Solved, Term, TransmissionAnalysis};
use crate::link_encoder::gear::Gear;
use crate::link_encoder::law::Law;

/// Least reported scale difference of the encoders: in standard deviations, and relative.
const SURE: f64 = 5.0;
const SCALE_OFF: f64 = 1e-3;

/// What the two encoders of a joint read apart, rad or m.
#[derive(Clone, Debug)]
pub(crate) struct Reading {
    /// RMS without the laws and with them.
    pub(crate) rms: [f64; 2],
    pub(crate) floor: f64,
    pub(crate) gear: Option<GearReading>,
    /// Motion of the link per motion of the joint's encoder minus one, if the scales differ.
    pub(crate) scale: Option<f64>,
    /// Amplitudes of the waves over the joint's turn, and waves per turn.
    pub(crate) waves: Vec<[f64; 2]>,
}

/// A gear that was found.
#[derive(Clone, Debug)]
pub(crate) struct GearReading {
    pub(crate) kind: Kind,
    /// Its shapes with their standard deviations.
    pub(crate) values: Vec<[f64; 2]>,
    /// True if something gives beside closed teeth.
    pub(crate) gives: bool,
}

impl TransmissionAnalysis<'_, '_> {
    /// Returns the figures of the joint, whether or not a law was found.
    pub(crate) fn reading(&self, fitted: &Fitted, gear: Option<&Gear>) -> Reading {
        let laws = fitted.laws.found.iter();
        let waves = laws.filter_map(|found| match found.law {
            Law::Wave(k) => self.joint_wave(fitted.solved, k),
            _ => None,
        });
        Reading {
            rms: [fitted.base.rms(0), fitted.last.rms(0)],
            floor: fitted.floor,
            gear: gear.map(|gear| GearReading {
                kind: gear.kind,
                values: (gear.kind.about().shapes.iter().zip(gear.values()))
                    .map(|(shape, [value, std])| {
                        [value, inflated(gear.kind, shape, value, std, 0.0)]
                    })
                    .collect(),
                gives: gear.gives.is_some(),
            }),
            scale: self.scale(fitted.solved),
            waves: waves.collect(),
        }
    }

    /// Returns the difference of the encoders' scales if there is one.
    fn scale(&self, solved: &Solved) -> Option<f64> {
        let at = self.training.constants;
        let (scale, std) = (solved.solution.values[at], solved.solution.std(at));
        (scale.abs() > SCALE_OFF.max(SURE * std)).then_some(scale)
    }

    /// Returns amplitude and order of the `k`-th wave if it is one over the joint's turn.
    fn joint_wave(&self, solved: &Solved, k: usize) -> Option<[f64; 2]> {
        let equation = self.training;
        let wave = &equation.waves[k];
        (wave.kind == Kind::EncoderEccentricityJoint).then(|| {
            let part = |side| {
                solved
                    .of(equation, &|t| *t == Term::Wave(k, side))
                    .map_or(0.0, |[value, _]| value)
            };
            [part(0).hypot(part(1)), wave.order]
        })
    }
}
