//! Structure of a trajectory's TOML text.

use serde::{Deserialize, Serialize};
use toml::Spanned;

/// The file's TOML structure; all times in seconds.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileText {
    pub robot: String,
    #[serde(default)]
    pub design: Option<Spanned<DesignText>>,
    #[serde(default)]
    pub drive_off: Option<Spanned<f64>>,
    #[serde(rename = "joint")]
    pub joints: Vec<JointText>,
}

/// The record of a design.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DesignText {
    pub criterion: String,
    pub value: f64,
    pub condition_number: f64,
    pub seed: u64,
}

/// One joint and its motion.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointText {
    pub name: String,
    pub start: Spanned<f64>,
    pub trajectory: Spanned<MotionText>,
}

/// The parameters of a motion.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum MotionText {
    Hold {
        duration: f64,
    },
    Fourier {
        period: f64,
        periods: u16,
        ramp: f64,
        sine: Vec<f64>,
        cosine: Vec<f64>,
    },
    Chirp {
        start_hz: f64,
        end_hz: f64,
        sweep: String,
        duration: f64,
        ramp: f64,
        amplitude: f64,
        velocity: f64,
        acceleration: f64,
        #[serde(default, skip_serializing_if = "is_zero")]
        again: f64,
    },
    Staircase {
        levels: Vec<f64>,
        #[serde(rename = "move")]
        moving: f64,
        dwell: f64,
    },
    Reversals {
        speed: f64,
        half_turn: f64,
        quarter: Vec<f64>,
        cycles: u16,
    },
    Sweep {
        half_span: f64,
        cruise: Vec<f64>,
        ramp: f64,
        dwell: f64,
        lead: f64,
    },
}

/// Returns true for a share that an absent key means.
fn is_zero(share: &f64) -> bool {
    *share == 0.0
}
