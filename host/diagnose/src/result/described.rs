//! The described effects of a result.

use crate::description::described_effects::{DescribedEffects, Now};
use crate::outcome::Described;
use crate::result::sentences::described::fate;

impl DescribedEffects {
    /// Returns the entries of the result for the described effects, in order. `now` are law and parameters of those in
    /// the last model.
    pub(crate) fn told(&self, now: Vec<Option<Now>>) -> Vec<Described> {
        (self.fates(now).into_iter())
            .map(|own| {
                let (about, joint) = (own.kind.about(), &self.robot.joints[own.joint].name);
                Described {
                    effect: about.name.to_owned(),
                    law: about.law.map(str::to_owned),
                    joint: joint.clone(),
                    fate: own.cause.fate(),
                    text: fate(&own, joint),
                    parameters: own.parameters,
                }
            })
            .collect()
    }
}
