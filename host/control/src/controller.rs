//! A law with its gains and its state, for one robot.

use super::adaptation::Parameters;
use super::contact_task::ContactTask;
use super::design;
use super::effects::Compensated;
use super::error::ControlError;
use super::law_model::LawModel;
use super::loop_margin::{MARGIN, fastest};
use super::sensing::resolution;
use super::settings::{LawKind, Settings};
use rig_output::format_significant;
use rig_shared::control::arm::hybrid::{Axis, ForceGains};
use rig_shared::control::arm::impedance::Target;
use rig_shared::control::arm::pid::PidGains;
use rig_shared::control::arm::{ControlFault, Inputs, Law, Limited, Operational, PassiveRegressor};
use rig_shared::control::arm::{adaptive, computed_torque, hybrid, impedance, pid};
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::trajectory::Reference;

/// Dead zone of the adaptive law in encoder steps a second: some standard deviations of the observer's ripple.
const DEAD_ZONE: f64 = 100.0;

/// Gains and state of a law.
enum Inner {
    Pid {
        gains: Vec<PidGains<f64>>,
        state: pid::State<f64>,
    },
    ComputedTorque,
    Adaptive(Box<Adapting>),
    Hybrid {
        axes: Vec<Axis<f64>>,
        state: hybrid::State<f64>,
    },
    Impedance {
        targets: Vec<Target<f64>>,
    },
}

/// Gains and state of the adaptive law.
struct Adapting {
    parameters: Parameters,
    slope: Vec<f64>,
    derivative: Vec<f64>,
    dead_zone: Vec<f64>,
    theta: Vec<f64>,
    regressor: Vec<f64>,
    workspace: Vec<f64>,
}

/// A law at work.
pub(crate) struct Controller<'a> {
    model: &'a LawModel,
    settings: Settings,
    torque_limit: Vec<f64>,
    /// kp and kd of every joint at unit inertia.
    gains: [Vec<f64>; 2],
    task: Option<&'a ContactTask>,
    inner: Inner,
    effects: Compensated,
    /// Sentence on a bandwidth below the wanted one.
    slower: Option<String>,
    known: Vec<f64>,
    load: Vec<f64>,
    pub kind: LawKind,
}

/// Returns highest torque and speed of each joint. Where the description has none: the largest torque that the model
/// needs at some positions, and the largest speed of a motion.
pub(crate) fn limits(model: &LawModel, reference: &[Vec<Reference<f64>>]) -> Vec<[f64; 2]> {
    let joints = model.robot.joints.iter().zip(reference);
    joints
        .map(|(joint, series)| {
            let limits = joint.limits.as_ref();
            let fastest = series.iter().map(|r| r.velocity.abs()).fold(0.0, f64::max);
            let speed = limits.map_or(fastest, |l| l.velocity);
            [
                limits.and_then(|l| l.torque).unwrap_or(f64::INFINITY),
                if speed > 0.0 && speed.is_finite() {
                    speed
                } else {
                    1.0
                },
            ]
        })
        .collect()
}

/// Returns the settings with the bandwidth at which a law that tracks a motion keeps its gain margin, and a sentence if
/// it is lower than the wanted one.
fn slowed(
    kind: LawKind,
    model: &LawModel,
    inertias: Option<&design::Inertias>,
    settings: &Settings,
) -> (Settings, Option<String>) {
    if kind.is_contact() {
        return (*settings, None);
    }
    let bandwidth = fastest(kind, inertias.map_or(1.0, |own| own.lambda), settings);
    if bandwidth >= settings.bandwidth {
        return (*settings, None);
    }
    let late = match settings.delay {
        true => "one tick late",
        false => "held over a tick",
    };
    let cause = inertias.filter(|own| own.lambda > 1.0).map(|own| {
        let joints = &model.robot.joints;
        let bare: Vec<&str> = (joints.iter())
            .filter(|joint| joint.drive.as_ref().is_none_or(|drive| drive.rotor_inertia <= 0.0))
            .map(|joint| joint.name.as_str())
            .collect();
        let rotors = match bare.is_empty() {
            true => String::new(),
            false => format!(
                " No rotor inertia is described for {} ([joint.drive] rotor_inertia and gear_ratio), which would add to it.",
                bare.join(", ")
            ),
        };
        format!(
            " Its gains are for each joint's own inertia, and {} of it moves where the other joints give way (most of it joint \"{}\").{rotors}",
            share(1.0 / own.lambda),
            joints[own.lightest].name
        )
    });
    let note = format!(
        "the loop runs at {} Hz instead of {} Hz (--bandwidth): at {} ticks a second, with the torque {late}, a faster loop has less than a gain margin of {MARGIN}.{} With --rate {} it keeps the bandwidth.",
        format_significant(bandwidth, 3),
        format_significant(settings.bandwidth, 3),
        format_significant(settings.rate, 4),
        cause.unwrap_or_default(),
        // Everything scales with the ratio of both.
        (settings.rate * settings.bandwidth / bandwidth / 100.0).ceil() * 100.0
    );
    let slower = Settings {
        bandwidth,
        ..*settings
    };
    (slower, Some(note))
}

/// Returns a share in words.
fn share(value: f64) -> String {
    format!("{} %", format_significant(100.0 * value, 2))
}

impl<'a> Controller<'a> {
    /// Designs a law for the positions of a motion.
    pub(crate) fn design(
        kind: LawKind,
        model: &'a LawModel,
        reference: &[Vec<Reference<f64>>],
        task: Option<&'a ContactTask>,
        settings: &Settings,
    ) -> Result<Self, ControlError> {
        let n = reference.len();
        let samples = reference.first().map_or(0, Vec::len);
        let positions: Vec<Vec<f64>> = (0..samples)
            .step_by((samples / 50).max(1))
            .map(|k| reference.iter().map(|series| series[k].position).collect())
            .collect();
        let inertias = match kind {
            LawKind::Pid => Some(design::inertias(model, &positions, true)?),
            LawKind::Adaptive => Some(design::inertias(model, &positions, false)?),
            _ => None,
        };
        let (settings, slower) = slowed(kind, model, inertias.as_ref(), settings);
        let settings = &settings;
        let largest = inertias.map_or_else(Vec::new, |own| own.largest);
        let omega = settings.omega();
        let gains = [omega * omega, 2.0 * settings.damping * omega].map(|gain| vec![gain; n]);
        let inner = match (kind, task) {
            (LawKind::Pid, _) => Inner::Pid {
                gains: (largest.iter())
                    .map(|j| PidGains::design(*j, settings.bandwidth, settings.damping))
                    .collect(),
                state: pid::State::default(),
            },
            (LawKind::Adaptive, _) => {
                Inner::Adaptive(Box::new(adapting(model, reference, &largest, settings)?))
            }
            (LawKind::Hybrid, Some(task)) => Inner::Hybrid {
                axes: axes(task, settings),
                state: hybrid::State::default(),
            },
            (LawKind::Impedance, Some(task)) => Inner::Impedance {
                targets: task.targets.clone(),
            },
            _ => Inner::ComputedTorque,
        };
        Ok(Self {
            model,
            settings: *settings,
            torque_limit: limits(model, reference).iter().map(|[t, _]| *t).collect(),
            gains,
            task,
            inner,
            effects: Compensated::of(model, settings.friction(), settings.period()),
            slower,
            known: vec![0.0; n],
            load: vec![0.0; n],
            kind,
        })
    }

    /// Returns the bandwidth that the law was designed for, Hz.
    pub(crate) fn bandwidth(&self) -> f64 {
        self.settings.bandwidth
    }

    /// Returns a sentence if this bandwidth is lower than the wanted one.
    pub(crate) fn slower(&self) -> Option<&str> {
        self.slower.as_deref()
    }

    /// Returns sentences on what the law leaves out of its model.
    pub(crate) fn notes(&self) -> &[String] {
        &self.effects.notes
    }

    /// Returns the adapted parameters now; none of a law that adapts none.
    pub(crate) fn theta(&self) -> Option<&[f64]> {
        match &self.inner {
            Inner::Adaptive(own) => Some(&own.theta),
            _ => None,
        }
    }

    /// Returns the parameters of the adaptive law.
    pub(crate) fn parameters(&self) -> Option<&Parameters> {
        match &self.inner {
            Inner::Adaptive(own) => Some(&own.parameters),
            _ => None,
        }
    }

    /// Computes the torques of one tick.
    pub(crate) fn step(
        &mut self,
        input: &Inputs<'_, f64>,
        torque: &mut [f64],
    ) -> Result<Limited, ControlFault> {
        let model = self.model.view();
        if !self.effects.is_empty() {
            let planned = |pick: fn(&Reference<f64>) -> f64| -> Vec<f64> {
                input.reference.iter().map(pick).collect()
            };
            let (v, a) = (planned(|r| r.velocity), planned(|r| r.acceleration));
            model.rigid_torque(input.position, &v, &a, &mut self.load)?;
            self.effects.torque(
                [input.position, input.velocity, &self.load],
                input.reference,
                &mut self.known,
            );
        }
        let input = &Inputs {
            feedforward: &self.known,
            ..*input
        };
        let torque_limit = self.torque_limit.as_slice();
        let friction = self.settings.friction();
        let period = self.settings.period();
        let [proportional, derivative] = &self.gains;
        let posture = [proportional[0], derivative[0]];
        let operational = |task| Operational {
            model,
            task,
            posture,
            friction,
            torque_limit,
        };
        let task = self.task.map(ContactTask::task);
        match (&mut self.inner, task) {
            (Inner::Pid { gains, state }, _) => pid::Config {
                model,
                gains,
                friction,
                torque_limit,
                period,
            }
            .step(state, input, torque),
            (Inner::Adaptive(own), _) => {
                own.step(self.model, torque_limit, &self.settings, input, torque)
            }
            (Inner::Hybrid { axes, state }, Some(task)) => hybrid::Config {
                operational: Operational {
                    friction: pressing(friction),
                    ..operational(task)
                },
                axes,
                period,
            }
            .step(state, input, torque),
            (Inner::Impedance { targets }, Some(task)) => impedance::Config {
                operational: operational(task),
                targets,
            }
            .step(&mut (), input, torque),
            _ => computed_torque::Config {
                model,
                proportional,
                derivative,
                friction,
                torque_limit,
            }
            .step(&mut (), input, torque),
        }
    }
}

impl Adapting {
    fn step(
        &mut self,
        model: &LawModel,
        torque_limit: &[f64],
        settings: &Settings,
        input: &Inputs<'_, f64>,
        torque: &mut [f64],
    ) -> Result<Limited, ControlFault> {
        let config = adaptive::Config {
            regressor: regressor(model, settings),
            columns: &self.parameters.base.columns,
            slope: &self.slope,
            derivative: &self.derivative,
            rate: &self.parameters.rate,
            lower: &self.parameters.lower,
            upper: &self.parameters.upper,
            dead_zone: &self.dead_zone,
            torque_limit,
            period: settings.period(),
        };
        let mut state = adaptive::State {
            theta: &mut self.theta,
            regressor: &mut self.regressor,
            workspace: &mut self.workspace,
        };
        config.step(&mut state, input, torque)
    }
}

/// Returns the regressor of a model.
pub(crate) fn regressor<'a>(model: &'a LawModel, settings: &Settings) -> PassiveRegressor<'a, f64> {
    PassiveRegressor {
        chain: &model.chain,
        transmission: model.motors.as_ref().map(|motors| &motors.transmission),
        velocity_threshold: settings.velocity_threshold,
    }
}

fn adapting(
    model: &LawModel,
    reference: &[Vec<Reference<f64>>],
    inertias: &[f64],
    settings: &Settings,
) -> Result<Adapting, ControlError> {
    let n = inertias.len();
    let omega = settings.omega();
    // Without a limit, the torque that moves the joint's inertia to its speed within 1/ω.
    let mut limits = limits(model, reference);
    for ([torque, speed], inertia) in limits.iter_mut().zip(inertias) {
        if !torque.is_finite() {
            *torque = inertia * omega * *speed;
        }
    }
    let torques: Vec<f64> = limits.iter().map(|[torque, _]| *torque).collect();
    let derivative: Vec<f64> = (inertias.iter())
        .map(|j| 2.0 * settings.damping * omega * j)
        .collect();
    let view = regressor(model, settings);
    let parameters = Parameters::of(model, &view, reference, [&derivative, &torques], settings)?;
    let steps = (0..n).map(|j| DEAD_ZONE * resolution(&model.robot, j, settings.resolution));
    Ok(Adapting {
        slope: vec![omega / (2.0 * settings.damping); n],
        derivative: (inertias.iter().map(|j| 2.0 * settings.damping * omega * j)).collect(),
        dead_zone: steps.collect(),
        theta: parameters.values(model),
        regressor: vec![0.0; n * view.width()],
        workspace: vec![0.0; view.workspace_length()],
        parameters,
    })
}

/// Returns the compensation of friction while the tool presses: as much at rest as in motion. What it leaves at rest, the
/// disturbance observer adds there, and that is wrong as soon as the joints move. Together with a slide without a step of the
/// acceleration it reduced the overshoot of 5 N on 10⁴ N/m from 15.3 to 9.3 % (IRp-6, 1000 ticks a second; median of 6
/// motions); the slide alone to 12.5 %.
fn pressing(friction: PrecompensationSettings<f64>) -> PrecompensationSettings<f64> {
    PrecompensationSettings {
        gain_at_rest: friction.gain,
        ..friction
    }
}

/// Returns the selection: the normal presses, the other directions move.
fn axes(task: &ContactTask, settings: &Settings) -> Vec<Axis<f64>> {
    let omega = settings.omega();
    let gains = ForceGains {
        late: settings.lateness(),
        ..ForceGains::design(
            task.force,
            task.surface.stiffness,
            task.force_bandwidth,
            task.approach,
        )
    };
    (0..task.directions.len())
        .map(|d| match d {
            0 => Axis::Presses(gains),
            _ => Axis::Moves {
                proportional: omega * omega,
                derivative: 2.0 * settings.damping * omega,
            },
        })
        .collect()
}
