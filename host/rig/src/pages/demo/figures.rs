//! Everything that the page of the demonstration shows.

use rig_diagnose::Diagnosis;
use rig_identify::{FrictionMap, ResidualReport};
use rig_model::robot::Robot;

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// Estimate.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Returns true if the interval holds the true value.
    pub(super) fn covers(&self, truth: f64) -> bool {
        (self.low..=self.high).contains(&truth)
    }
}

/// One parameter, its true value and the three estimates of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DemoParameter {
    /// Short name: `J`.
    pub name: String,
    /// In words: `inertia`.
    pub meaning: String,
    /// Unit, ASCII (`kg*m^2`) or as printed.
    pub unit: String,
    /// Value in the emulated rig.
    pub truth: f64,
    /// Off-line estimate by the differential model (torque).
    pub differential: Interval,
    /// Off-line estimate by the integral model (energy).
    pub integral: Interval,
    /// The firmware's estimate at the end of the motion.
    pub online: Interval,
}

/// Estimates of the firmware during the motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OnlineEstimates {
    /// s
    pub t: Vec<f64>,
    /// One series for each parameter, in the order of [`DemoFigures::parameters`].
    pub values: Vec<Vec<f64>>,
    /// Standard deviations of `values`.
    pub std: Vec<Vec<f64>>,
}

/// Tracking error of one motion without and with precompensation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tracking {
    /// In words: `slow reversals`.
    pub motion: String,
    /// Unit of position and errors.
    pub unit: String,
    /// s
    pub t: Vec<f64>,
    /// Reference position.
    pub reference: Vec<f64>,
    /// Reference less position with feedback alone; NaN where there is no sample.
    pub error_without: Vec<f64>,
    /// Reference less position with friction and dynamics precompensated.
    pub error_with: Vec<f64>,
    /// RMS over all samples of the run.
    pub rms_without: f64,
    /// RMS over all samples of the run.
    pub rms_with: f64,
    /// A remark about the runs.
    pub note: String,
}

/// Samples on the wire.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wire {
    /// Samples received.
    pub received: u64,
    /// Samples lost.
    pub lost: u64,
    /// A sentence.
    pub text: String,
}

/// Everything the page shows.
#[derive(Clone, Debug, PartialEq)]
pub struct DemoFigures {
    /// The description that was identified.
    pub robot: Robot,
    /// The command line that repeats the demonstration.
    pub command: String,
    /// Length of all recordings together, s.
    pub seconds: f64,
    /// The six parameters of one link.
    pub parameters: Vec<DemoParameter>,
    /// On-line estimates over time.
    pub online: OnlineEstimates,
    /// Motions with and without precompensation.
    pub tracking: Vec<Tracking>,
    /// Friction map.
    pub friction: Option<FrictionMap>,
    /// The reason if there is no map.
    pub friction_text: String,
    /// The wire.
    pub wire: Wire,
    /// Residuals on the hold-out, one for each joint.
    pub holdout: Vec<ResidualReport>,
    /// Diagnosis of the identified model.
    pub diagnosis: Option<Diagnosis>,
    /// Effects of the emulated rig that the model does not have.
    pub beyond_model: Vec<String>,
    /// Sentences for the top of the page.
    pub warnings: Vec<String>,
    /// Files in the folder of the page, with the content of each.
    pub files: Vec<(String, String)>,
}
