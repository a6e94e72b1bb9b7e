//! An experiment on the rig: send settings, arm, run and record a trajectory, disarm.

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
/// Time for a controlled stop if the experiment has no limits: five times the need of the template's rig, from 6 rad/s
/// at 60 rad/s².
const STOP_PATIENCE: Duration = Duration::from_millis(500);
/// Ratio of the stop time to speed over deceleration: the link comes to rest after its reference.
const STOP_MARGIN: f32 = 1.5;
/// Pause between two attempts to arm.
const CALIBRATION_PAUSE: Duration = Duration::from_millis(50);

/// Description of an experiment.
#[derive(Clone, Debug, Default)]
pub struct Experiment {
    /// Requests sent first, while the rig is disarmed.
    pub settings: Vec<RequestBody>,
    /// The motion; `None` records a disarmed rig at rest.
    pub trajectory: Option<Trajectory<f32>>,
    /// Time to switch the bridge off during the motion, so that the joint coasts, s after its start.
    pub drive_off: Option<f64>,
    /// Recording time after the end of the trajectory or after the bridge is off, s; without a trajectory the total
    /// time.
    pub rest: f64,
}

/// Returns the maximum time of a controlled stop after these settings.
pub fn stop_time(settings: &[RequestBody]) -> Duration {
    let limits = settings.iter().rev().find_map(|body| match body {
        RequestBody::SetLimits(limits) => Some(limits),
        _ => None,
    });
    let seconds = limits.map(|l| STOP_MARGIN * l.velocity / l.acceleration);
    seconds
        .and_then(|seconds| Duration::try_from_secs_f32(seconds).ok())
        .map_or(STOP_PATIENCE, |time| time.max(STOP_PATIENCE))
}

impl Experiment {
    /// Returns the number of telemetry samples of the experiment.
    pub fn samples(&self, sample_rate: f64) -> u64 {
        let whole = self
            .trajectory
            .as_ref()
            .map_or(0.0, |t| t.duration_micros() as f64 * 1e-6);
        let motion = self.drive_off.map_or(whole, |off| off.min(whole));
        ((motion + self.rest) * sample_rate).ceil() as u64
    }
}

/// Runs an experiment; every sample and every gap goes to `on_event`. Afterwards the rig is disarmed, also after an
/// aborted or failed recording: a running motion is first brought to rest.
///
/// # Errors
/// Errors of the link: a refused request, a silent rig, a failed line.
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
        // The accuracy of the host's clock suffices: the joint coasts from any position.
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
        rest(session, stop_time(&experiment.settings))
    } else {
        Ok(())
    };
    // Disarm in any case; an error of the recording is returned first, because it is more specific.
    let off = session.request(RequestBody::Disarm);
    let losses = recorded?;
    rested?;
    off?;
    Ok(losses)
}

/// Waits for the end of a requested stop.
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

/// Repeats a request while the rig refuses it because of its calibration.
///
/// # Errors
/// Errors of the link.
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
