//! Processing of the recordings from which the values of a description were identified.

use serde::{Deserialize, Serialize};

use super::fault::{Fault, Step};

/// Largest torque lead, s. A torque that acts later than this belongs to another motion.
pub const MOST_LEAD: f64 = 1.0;

/// Band and rows in which the values of a description were identified. They are the default for judging the values,
/// because an error relative to the torque depends on both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdentifiedBand {
    /// Cut-off of the zero-phase low-pass on the position, Hz.
    pub cutoff: f64,
    /// Rows per second after the low-pass on torque and regressor.
    pub rate: f64,
    /// Per joint, speed below which rows do not count in that error, rad/s or m/s.
    pub min_speed: Vec<f64>,
    /// Torque lead: time from the recording of a torque to its action, s.
    #[serde(default)]
    pub torque_lead: f64,
}

impl IdentifiedBand {
    pub(super) fn check(&self, joints: usize) -> Result<(), Fault> {
        let fault = |key: &'static str, found: String, advice: &str| {
            Err(Fault {
                key_path: vec![Step::Key("identified"), Step::Key(key)],
                what: format!("`{key}` of the band of identification"),
                found,
                advice: advice.to_owned(),
            })
        };
        if !(self.cutoff.is_finite() && self.cutoff > 0.0) {
            return fault(
                "cutoff",
                self.cutoff.to_string(),
                "it must be above 0, in Hz",
            );
        }
        if !(self.rate.is_finite() && self.rate > 0.0) {
            return fault(
                "rate",
                self.rate.to_string(),
                "it must be above 0, in rows per second",
            );
        }
        if self.torque_lead.is_nan() || self.torque_lead.abs() > MOST_LEAD {
            return fault(
                "torque_lead",
                self.torque_lead.to_string(),
                "it must lie between -1 and 1 s",
            );
        }
        if self.min_speed.len() != joints {
            return fault(
                "min_speed",
                format!("a list of {}", self.min_speed.len()),
                &format!("it must hold one speed for each of the {joints} joints"),
            );
        }
        match self
            .min_speed
            .iter()
            .find(|v| !(v.is_finite() && **v >= 0.0))
        {
            Some(speed) => fault(
                "min_speed",
                speed.to_string(),
                "speeds must be numbers not below 0, in rad/s or m/s",
            ),
            None => Ok(()),
        }
    }
}
