//! An experiment on the rig: settings up, armed, a trajectory run and recorded, off again.

use std::ops::ControlFlow;
use std::time::Duration;

use rig_shared::trajectory::Trajectory;
use rig_shared::wire::message::{Refusal, RequestBody};

use super::error::LinkError;
use super::port::Port;
use super::recorder::{Event, LossReport, RecordSettings, record};
use super::session::Session;

/// Longest wait for a rig that is still measuring its current offset.
const CALIBRATION_PATIENCE: Duration = Duration::from_secs(3);
/// Time for a controlled stop where the experiment states no limits: five times what the template's rig needs, from 6 rad/s at
/// 60 rad/s².
const STOP_PATIENCE: Duration = Duration::from_millis(500);
/// How much more of it than speed over deceleration: the link comes to rest after its reference.
const STOP_MARGIN: f32 = 1.5;
/// Pause between two attempts to arm.
const CALIBRATION_PAUSE: Duration = Duration::from_millis(50);

/// What to do on the rig.
#[derive(Clone, Debug, Default)]
pub struct Experiment {
    /// Requests carried out first, while the rig is disarmed.
    pub settings: Vec<RequestBody>,
    /// The motion; none to record a rig at rest, disarmed.
    pub trajectory: Option<Trajectory<f32>>,
    /// When to switch the bridge off in the middle of it, so that the joint coasts, s after its start.
    pub drive_off: Option<f64>,
    /// How long to record after the trajectory has ended or the bridge is off, or in all without one, s.
    pub rest: f64,
}

impl Experiment {
    /// How long a controlled stop takes at most.
    fn stop_time(&self) -> Duration {
        let limits = self.settings.iter().rev().find_map(|body| match body {
            RequestBody::SetLimits(limits) => Some(limits),
            _ => None,
        });
        let seconds = limits.map(|l| STOP_MARGIN * l.velocity / l.acceleration);
        seconds
            .and_then(|seconds| Duration::try_from_secs_f32(seconds).ok())
            .map_or(STOP_PATIENCE, |time| time.max(STOP_PATIENCE))
    }

    /// Telemetry samples that the experiment takes.
    pub fn samples(&self, sample_rate: f64) -> u64 {
        let whole = self
            .trajectory
            .as_ref()
            .map_or(0.0, |t| t.duration_micros() as f64 * 1e-6);
        let motion = self.drive_off.map_or(whole, |off| off.min(whole));
        ((motion + self.rest) * sample_rate).ceil() as u64
    }
}

/// Runs an experiment; every sample and every hole goes to `on_event`. The rig is disarmed afterwards, also
/// when the recording was broken off or failed: a motion under way is brought to rest before.
///
/// # Errors
/// What the link says: a refused request, a silent rig, a broken line.
pub fn run<P: Port>(
    session: &mut Session<P>,
    experiment: &Experiment,
    mut on_event: impl FnMut(Event<'_>) -> ControlFlow<()>,
) -> Result<LossReport, LinkError> {
    let greeting = session.greeting();
    let rate =
        f64::from(greeting.control_rate_hz) / f64::from(greeting.telemetry_decimation.max(1));
    let mut settings = RecordSettings {
        samples: Some(experiment.samples(rate)),
        ..RecordSettings::default()
    };
    when_calibrated(session, RequestBody::Disarm)?;
    for body in &experiment.settings {
        when_calibrated(session, body.clone())?;
    }
    if let Some(trajectory) = &experiment.trajectory {
        session.request(RequestBody::SetTrajectory(trajectory.clone()))?;
        when_calibrated(session, RequestBody::Arm)?;
        settings.at_start = vec![RequestBody::Start];
        // The host's clock is as good as needed: it coasts from wherever it is told to.
        settings.later =
            (experiment.drive_off).map(|after| ((after * rate).ceil() as u64, RequestBody::Disarm));
    }
    let mut broken_off = false;
    let recorded = record(session, &settings, |event| {
        let flow = on_event(event);
        broken_off |= flow.is_break();
        flow
    });
    let stops = (broken_off || recorded.is_err()) && session.request(RequestBody::Stop).is_ok();
    let rested = if stops {
        rest(session, experiment.stop_time())
    } else {
        Ok(())
    };
    // Off in any case; the recording's own error comes first, because it says more.
    let off = session.request(RequestBody::Disarm);
    let losses = recorded?;
    rested?;
    off?;
    Ok(losses)
}

/// Lets a stop that has been asked for come to its end.
fn rest<P: Port>(session: &mut Session<P>, time: Duration) -> Result<(), LinkError> {
    let until = session.port().now() + time;
    loop {
        let left = until.saturating_sub(session.port().now());
        if left.is_zero() {
            return Ok(());
        }
        session.next_report(left)?;
    }
}

/// A request that the rig refuses only because it is still calibrating.
///
/// # Errors
/// What the link says.
pub fn when_calibrated<P: Port>(
    session: &mut Session<P>,
    body: RequestBody,
) -> Result<(), LinkError> {
    let begin = session.port().now();
    loop {
        match session.request(body.clone()) {
            Err(LinkError::Refused {
                refusal: Refusal::WrongMode,
                ..
            }) if session.port().now().saturating_sub(begin) < CALIBRATION_PATIENCE => {
                session.next_report(CALIBRATION_PAUSE)?;
            }
            other => return other,
        }
    }
}
