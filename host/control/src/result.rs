//! Results of closed loops.

use super::contact_task::ContactTask;
use super::settings::{LawKind, Settings};
use rig_output::format_significant;
use serde::Serialize;

/// What came out of all closed loops of a robot.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// `rig-control/1`.
    pub schema: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Settings of the loops.
    pub settings: Settings,
    /// The task on the surface, if there is one.
    pub task: Option<ContactTask>,
    /// Laws that track a motion.
    pub tracking: Vec<Tracking>,
    /// Laws that press on a surface.
    pub contact: Vec<Contact>,
    /// Laws that did not finish their motion.
    pub failed: Vec<Failed>,
    /// What was assumed or left out, one sentence each.
    pub notes: Vec<String>,
}

impl Evaluation {
    /// Returns the warnings about all motions, each with law and model.
    pub fn warnings(&self) -> Vec<String> {
        let of = |law: LawKind, model: &str, list: &[String]| -> Vec<String> {
            let sentence = |text: &String| format!("{} with {model}: {text}", law.name());
            list.iter().map(sentence).collect()
        };
        let tracking = self.tracking.iter();
        let tracking = tracking.flat_map(|own| of(own.law, &own.model, &own.warnings));
        let contact = self.contact.iter();
        let contact = contact.flat_map(|own| of(own.law, &own.model, &own.warnings));
        let failed = self.failed.iter();
        let failed =
            failed.map(|own| format!("{} with {}: {}", own.law.name(), own.model, own.reason));
        failed.chain(tracking).chain(contact).collect()
    }

    /// Returns a sentence for each law that tracks better with a wrong model than with `right`, that of the simulated robot.
    pub fn better_when_wrong(&self, right: &str) -> Vec<String> {
        let with_right = self.tracking.iter().filter(|own| own.model == right);
        let pairs = with_right.flat_map(|own| {
            let of_law = self.tracking.iter().filter(|other| other.law == own.law);
            of_law.map(move |other| (own, other))
        });
        pairs
            .filter(|(own, other)| other.model != right && other.tool_rms < own.tool_rms)
            .map(|(own, other)| {
                let [wrong, right_rms] =
                    [other, own].map(|run| format_significant(1e3 * run.tool_rms, 3));
                format!(
                    "{} tracks better with {} than with {right}, the simulated robot itself ({wrong} and {right_rms} mm RMS of the tool). This does not make it the better model: at the same --bandwidth a model with too large an inertia has larger gains, and with them less margin of stability.",
                    own.law.name(),
                    other.model,
                )
            })
            .collect()
    }
}

/// A law that did not finish its motion.
#[derive(Clone, Debug, Serialize)]
pub struct Failed {
    /// The law.
    pub law: LawKind,
    /// The law's model.
    pub model: String,
    /// Reason and remedy, a whole sentence.
    pub reason: String,
}

/// One joint in a motion.
#[derive(Clone, Debug, Serialize)]
pub struct JointMeasures {
    /// Name of the joint.
    pub name: String,
    /// RMS tracking error, rad or m.
    pub rms: f64,
    /// Largest tracking error, rad or m.
    pub largest: f64,
    /// RMS torque, N·m or N.
    pub torque: f64,
    /// Share of the ticks at the torque limit, 0 to 1.
    pub saturated: f64,
}

/// A law that tracks a motion.
#[derive(Clone, Debug, Serialize)]
pub struct Tracking {
    /// The law.
    pub law: LawKind,
    /// The law's model.
    pub model: String,
    /// Bandwidth of its position loops, Hz: that of the settings, or a lower one that keeps the gain margin.
    pub bandwidth: f64,
    /// Measures of each joint.
    pub joints: Vec<JointMeasures>,
    /// RMS tracking error of the tool, m.
    pub tool_rms: f64,
    /// Largest tracking error of the tool, m.
    pub tool_largest: f64,
    /// With random wrong parameters.
    pub robustness: Option<Robustness>,
    /// What the adaptive law learnt.
    pub adaptation: Option<Adaptation>,
    /// Limits that the motion left or stayed at, and an adaptation that diverges; one sentence each.
    pub warnings: Vec<String>,
    /// Name of the file with the motion.
    pub motion: String,
    /// Time of the plotted samples, s.
    #[serde(skip)]
    pub time: Vec<f64>,
    /// Tracking errors of the joints at these times.
    #[serde(skip)]
    pub errors: Vec<Vec<f64>>,
    /// Torques of the joints at these times.
    #[serde(skip)]
    pub torques: Vec<Vec<f64>>,
}

/// A measure over motions with random wrong parameters.
#[derive(Clone, Debug, Serialize)]
pub struct Robustness {
    /// Parameters are within 1 ± this share.
    pub share: f64,
    /// Number of motions.
    pub draws: usize,
    /// Motions that were unstable, in which the law gave no torque, or in which the tool did not reach the surface.
    pub failed: usize,
    /// Why the first of them failed.
    pub reason: Option<String>,
    /// Median of the motions that did not fail; RMS error of the tool (m), or overshoot of the force in the whole
    /// contact (1).
    pub median: f64,
    /// The worst of the motions that did not fail.
    pub worst: f64,
}

/// A base parameter of the adaptive law.
#[derive(Clone, Debug, Serialize)]
pub struct Adapted {
    /// The combination of standard parameters.
    pub expression: String,
    /// Unit, ASCII.
    pub unit: &'static str,
    /// Value of the true robot.
    pub truth: f64,
    /// Value at the start.
    pub start: f64,
    /// Value at the end.
    pub end: f64,
    /// Share of the parameter that the motion excites, 0 to 1.
    pub excited: f64,
}

/// What the adaptive law learnt.
#[derive(Clone, Debug, Serialize)]
pub struct Adaptation {
    /// Number of base parameters.
    pub count: usize,
    /// Number of their directions that the motion excites.
    pub excited: usize,
    /// Error of the parameters in these directions at the start and at the end, in sizes of parameters.
    pub error: [f64; 2],
    /// RMS torque that the error of all parameters makes along the motion, as a share of the torque limits: at the start
    /// and at the end.
    pub torque_error: [f64; 2],
    /// The parameters.
    pub parameters: Vec<Adapted>,
    /// Times of the plotted errors, s.
    #[serde(skip)]
    pub time: Vec<f64>,
    /// Errors at these times: in the excited directions, and as torque.
    #[serde(skip)]
    pub course: [Vec<f64>; 2],
}

impl Contact {
    /// Returns true unless the tool left the surface again and the force did not settle before the slide.
    pub fn is_steady(&self) -> bool {
        self.settling.is_some() || self.bounces == 0
    }
}

/// A law that presses on a surface.
#[derive(Clone, Debug, Serialize)]
pub struct Contact {
    /// The law.
    pub law: LawKind,
    /// The law's model.
    pub model: String,
    /// Wanted force, N; for impedance the force of the two springs in series.
    pub force: f64,
    /// Time of the first contact, s.
    pub touched: f64,
    /// Speed at which the tool met the surface, m/s.
    pub impact_speed: f64,
    /// Time from 10 % to 90 % of the wanted force, s; `None` if it was not reached.
    pub rise: Option<f64>,
    /// Largest force of the whole contact beyond the wanted one, as a share of it. The slide counts.
    pub overshoot: f64,
    /// The same before the slide.
    pub overshoot_before_slide: f64,
    /// Time from contact until the force stays within 5 %; `None` if it did not before the slide.
    pub settling: Option<f64>,
    /// Mean force error in the last half second before the slide, N.
    pub steady_error: f64,
    /// RMS force error during the slide, N; `None` without a slide.
    pub slide_force: Option<f64>,
    /// Largest force from the start of the slide to the end, N; `None` without a slide.
    pub slide_peak: Option<f64>,
    /// RMS position error along the surface during the slide, m.
    pub slide_error: Option<f64>,
    /// Number of times that the tool left the surface after the first contact.
    pub bounces: usize,
    /// Overshoot with random wrong parameters.
    pub robustness: Option<Robustness>,
    /// Limits that the motion left or stayed at, and an adaptation that diverges; one sentence each.
    pub warnings: Vec<String>,
    /// Name of the file with the motion.
    pub motion: String,
    /// Time of the plotted samples, s.
    #[serde(skip)]
    pub time: Vec<f64>,
    /// Force at these times, N.
    #[serde(skip)]
    pub forces: Vec<f64>,
    /// Position along the normal and the first direction along the surface, m.
    #[serde(skip)]
    pub positions: [Vec<f64>; 2],
}
