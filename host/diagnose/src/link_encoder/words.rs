//! Sentences on one joint's transmission.

use rig_shared::effects::Kind;

use crate::fit::systematic_uncertainty::inflated;
use crate::link_encoder::analysis::{Fitted, Solved, Term, TransmissionAnalysis};
use crate::link_encoder::gear::Gear;
use crate::link_encoder::law::{Found, Law};
use rig_model::robot::JointKind;
use rig_output::{format_significant, format_unit, format_value};

/// Least reported scale difference of the encoders: in standard deviations, and relative.
const SURE: f64 = 5.0;
const SCALE_OFF: f64 = 1e-3;

impl TransmissionAnalysis<'_, '_> {
    /// Returns the reason to believe a law, one sentence.
    pub(crate) fn why(
        &self,
        found: &Found,
        train: [f64; 2],
        unseen: Option<[f64; 2]>,
        floor: f64,
    ) -> String {
        let [before, after] = unseen.unwrap_or(train).map(|x| self.length(x));
        let how = match found.law {
            Law::Twist => "goes with the torque on the gear",
            Law::Play(_) => {
                "changes from one value to another with the sign of the torque on the gear"
            }
            Law::Wave(_) => "repeats with the motor's angle",
        };
        format!(
            "What the encoder on the link reads apart from the joint's own {how}: beside everything else the law takes it from {before} to {after} RMS {}, at a floor of {}. No friction of the motor can do that.",
            if unseen.is_some() {
                "on the hold-out"
            } else {
                "on the training data"
            },
            self.length(floor)
        )
    }

    /// Returns sentences on the joint, whether or not a law was found.
    pub(crate) fn words(&self, fitted: &Fitted, gear: Option<&Gear>) -> Vec<String> {
        let mut words = vec![match gear {
            None => self.rigid(fitted),
            Some(gear) => self.elastic(fitted, gear),
        }];
        words.extend(self.scale(fitted.solved));
        let waves = fitted
            .laws
            .found
            .iter()
            .filter_map(|found| match found.law {
                Law::Wave(k) => self.joint_wave(fitted.solved, k),
                _ => None,
            });
        words.extend(waves);
        words
    }

    /// Returns a sentence on a transmission that shows neither twist nor play.
    fn rigid(&self, fitted: &Fitted) -> String {
        format!(
            "The encoder on the link of joint {} shows neither twist nor play of the transmission: beside constant, scale and instant it reads {} RMS apart from the joint's own, at a floor of {}. What the torque shows at reversals is friction.",
            self.source.robot.joints[self.joint].name,
            self.length(fitted.last.rms(0)),
            self.length(fitted.floor)
        )
    }

    /// Returns a sentence on the gear that was found.
    fn elastic(&self, fitted: &Fitted, gear: &Gear) -> String {
        let joint = &self.source.robot.joints[self.joint];
        let (p, f) = joint.kind.units();
        let shapes = gear.kind.about().shapes;
        let value = |k: usize, unit: &str| {
            let std = inflated(gear.kind, &shapes[k], gear.shapes[k], gear.stds[k], 0.0);
            let value = if std.is_finite() {
                format_value(gear.shapes[k], std)
            } else {
                format!("more than {}", format_significant(gear.shapes[k], 2))
            };
            format!("{value} {unit}")
        };
        let per = format_unit(&format!("{f}/{p}"));
        let what = match gear.kind {
            Kind::Backlash => format!(
                "a play of {} behind a stiffness of {}",
                value(0, p),
                value(1, &per)
            ),
            _ => format!("a stiffness of {} without play", value(0, &per)),
        };
        format!(
            "The encoder on the link of joint {} shows {what}: what it reads apart from the joint's own falls from {} to {} RMS, at a floor of {}.{}",
            joint.name,
            self.length(fitted.base.rms(0)),
            self.length(fitted.last.rms(0)),
            self.length(fitted.floor),
            match (gear.kind, gear.gives) {
                (Kind::Backlash, Some(_)) =>
                    " Closed teeth are stiffer than that: something gives beside them, and the stiffness is that of both.",
                _ => "",
            }
        )
    }

    /// Returns a sentence if the scales of both encoders differ.
    fn scale(&self, solved: &Solved) -> Option<String> {
        let at = self.training.constants;
        let (scale, std) = (solved.solution.values[at], solved.solution.std(at));
        (scale.abs() > SCALE_OFF.max(SURE * std)).then(|| {
            format!(
                "By it the joint moves {} times as far as q{} says; check gear ratio and counts.",
                format_significant(1.0 / (1.0 + scale), 5),
                self.joint + 1
            )
        })
    }

    /// Returns a sentence on the `k`-th wave if it is one over the joint's turn.
    fn joint_wave(&self, solved: &Solved, k: usize) -> Option<String> {
        let equation = self.training;
        let wave = &equation.waves[k];
        (wave.kind == Kind::EncoderEccentricityJoint).then(|| {
            let part = |side| {
                solved
                    .of(equation, &|t| *t == Term::Wave(k, side))
                    .map_or(0.0, |[value, _]| value)
            };
            format!(
                "What the two encoders of joint {} read apart has a wave of {}, {} to a turn of the joint: one of them, or the gear's last stage, is off its axis; nothing tells which.",
                self.source.robot.joints[self.joint].name,
                self.length(part(0).hypot(part(1))),
                wave.order
            )
        })
    }

    /// Formats a small length or angle.
    fn length(&self, x: f64) -> String {
        let unit = match self.source.robot.joints[self.joint].kind {
            JointKind::Revolute => "mrad",
            JointKind::Prismatic => "mm",
        };
        format!("{} {unit}", format_significant(1e3 * x, 3))
    }
}
