//! Selection of the position law by [`ControlKind`].

pub use super::config::Config;

use super::{ControlKind, Measured, Torque, adaptive, computed_torque, pd};
use crate::scalar::Real;
use crate::trajectory::Reference;

/// State of the laws.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    /// Parameters of the adaptive law.
    pub adaptive: adaptive::State<T>,
}

/// Returns the joint torque for one tick by the selected law. `feedforward` is a known torque in addition to the model
/// ([`compensation`](crate::compensation)), N·m; the torque limit includes it.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    measured: Measured<T>,
    reference: Reference<T>,
    feedforward: T,
) -> Torque<T> {
    match config.kind {
        ControlKind::ProportionalDerivative => pd::step(config, measured, reference, feedforward),
        ControlKind::ComputedTorque => {
            computed_torque::step(config, measured, reference, feedforward)
        }
        ControlKind::Adaptive => adaptive::step(
            config,
            &mut state.adaptive,
            measured,
            reference,
            feedforward,
        ),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use super::*;
    use crate::control::Gains;
    use crate::control::adaptive::Adaptation;
    use crate::control::rig::{LINK, advance, reference};
    use crate::friction::Friction;
    use crate::link::LinkParameters;
    use crate::precompensation::PrecompensationSettings;

    const LOWER: [f64; 6] = [0.02, -6.0, -6.0, 0.0, 0.0, -1.0];
    const UPPER: [f64; 6] = [0.6, 6.0, 6.0, 1.5, 1.5, 1.0];

    fn config(kind: ControlKind) -> Config<f64> {
        let gains = Gains::design(LINK.inertia, 4.0, 1.0);
        Config {
            kind,
            gains,
            design_inertia: LINK.inertia,
            model: LINK,
            friction: Friction {
                coulomb: LINK.coulomb,
                viscous: LINK.viscous,
                ..Friction::default()
            },
            precompensation: PrecompensationSettings {
                enabled: true,
                gain: 0.98,
                gain_at_rest: 0.9,
                velocity_threshold: 0.02 / crate::precompensation::REFERENCE_SHARE * 0.5,
            },
            adaptation: Adaptation::design(gains.adaptation, LOWER, UPPER, 8.0, 6.0, 0.0),
            torque_limit: 20.0,
            period: 1e-4,
        }
    }

    /// Returns the RMS tracking error over the last of `seconds`, the final state, V's largest rise and final value.
    fn track(
        config: &Config<f64>,
        start: LinkParameters<f64>,
        seconds: u32,
    ) -> (f64, State<f64>, f64, f64) {
        let mut state = State {
            adaptive: adaptive::State::new(start),
        };
        let mut x = Measured::default();
        let (mut sum, mut rise) = (0.0, f64::MIN);
        let lyapunov = |state: &State<f64>, x: Measured<f64>, t: f64| {
            let r = reference(t);
            let slope = config.gains.proportional / config.gains.derivative;
            let s = x.velocity - r.velocity + slope * (x.position - r.position);
            let mut v = 0.5 * LINK.inertia * s * s;
            for k in 0..6 {
                let miss = state.adaptive.theta[k] - LINK.to_array()[k];
                v += 0.5 * miss * miss / config.adaptation.rate[k];
            }
            v
        };
        let first = lyapunov(&state, x, 0.0);
        let mut before = first;
        let rate = (1.0 / config.period) as u32;
        for tick in 0..seconds * rate {
            let t = f64::from(tick) * config.period;
            let torque = step(config, &mut state, x, reference(t), 0.0);
            assert!(!torque.limited);
            advance(&LINK, &mut x, torque.value, config.period);
            let after = lyapunov(&state, x, t + config.period);
            rise = rise.max(after - before);
            before = after;
            if tick >= (seconds - 1) * rate {
                sum += (x.position - reference(t + config.period).position).powi(2);
            }
        }
        (
            libm::sqrt(sum / f64::from(rate)),
            state,
            rise / first,
            before / first,
        )
    }

    #[test]
    fn model_based_laws_track_and_do_so_better_than_bare_feedback() {
        let mut bare = config(ControlKind::ProportionalDerivative);
        bare.model = LinkParameters::default();
        bare.precompensation.enabled = false;
        let (without, ..) = track(&bare, LINK, 10);
        for kind in [
            ControlKind::ProportionalDerivative,
            ControlKind::ComputedTorque,
        ] {
            let (with, ..) = track(&config(kind), LINK, 10);
            assert!(with < 0.05 * without, "{kind:?}: {with} against {without}");
        }
    }

    #[test]
    fn lyapunov_function_of_the_adaptive_law_does_not_rise_and_the_error_dies_out() {
        let start = LinkParameters::from_array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let config = config(ControlKind::Adaptive);
        let (early, ..) = track(&config, start, 1);
        let (late, state, rise, left) = track(&config, start, 60);
        // The proof is for continuous time. A step of 0.1 ms may raise V by a term of second order, so half the step
        // must leave about a quarter of the rise.
        assert!(rise < 5e-6, "V rose by {rise} of its start in one tick");
        let finer = Config {
            period: 5e-5,
            ..config
        };
        let (_, _, finer_rise, _) = track(&finer, start, 10);
        assert!(
            finer_rise < 0.35 * rise.max(1e-9),
            "{finer_rise} against {rise}"
        );
        assert!(left < 0.05, "V fell to {left} of its start only");
        assert!(late < 0.05 * early, "{late} against {early} at the start");
        let gravity = state.adaptive.theta[1];
        assert!(
            (gravity - LINK.gravity_cos).abs() < 0.1,
            "gravity {gravity}"
        );
    }

    #[test]
    fn adaptation_stays_in_its_band_and_rests_in_the_dead_zone() {
        let mut config = config(ControlKind::Adaptive);
        config.adaptation.upper[1] = 1.0;
        let (_, state, ..) = {
            config.torque_limit = 50.0;
            track(
                &config,
                LinkParameters::from_array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0]),
                10,
            )
        };
        for k in 0..6 {
            let theta = state.adaptive.theta[k];
            assert!(theta >= config.adaptation.lower[k] && theta <= config.adaptation.upper[k]);
        }
        config.adaptation.upper[1] = 6.0;
        config.adaptation.dead_zone = 0.1;
        let mut state = State {
            adaptive: adaptive::State::new(LINK),
        };
        let before = state;
        for k in 0..10_000 {
            let noise = if k % 3 == 0 { 0.09 } else { -0.05 };
            let measured = Measured {
                position: 0.0,
                velocity: noise,
            };
            let _ = step(&config, &mut state, measured, Reference::default(), 0.0);
        }
        assert_eq!(state, before);
    }

    #[test]
    fn single_precision_sums_what_is_below_its_rounding() {
        // Steps of 2·10⁻⁹ on a parameter of 2.9, a fiftieth of its unit in the last place.
        let mut config = Config::<f32> {
            kind: ControlKind::Adaptive,
            torque_limit: 100.0,
            period: 1e-4,
            ..Config::default()
        };
        config.gains = Gains {
            proportional: 10.0,
            derivative: 1.0,
            adaptation: 1.0,
            current_bandwidth: 1.0,
        };
        config.adaptation.rate = [0.0, 2e-5, 0.0, 0.0, 0.0, 0.0];
        config.adaptation.upper = [10.0; 6];
        let mut state = State {
            adaptive: adaptive::State::new(LINK.to_f32()),
        };
        let measured = Measured {
            position: 0.0,
            velocity: -1.0,
        };
        for _ in 0..1_000_000 {
            let _ = step(&config, &mut state, measured, Reference::default(), 0.0);
        }
        let gained = state.adaptive.theta[1] - 2.9;
        assert!((gained - 2e-3).abs() < 1e-6, "{gained}");
    }

    #[test]
    fn every_law_reports_its_limit_and_learns_nothing_behind_it() {
        for kind in [
            ControlKind::ProportionalDerivative,
            ControlKind::ComputedTorque,
            ControlKind::Adaptive,
        ] {
            let mut config = config(kind);
            config.torque_limit = 0.5;
            let mut state = State {
                adaptive: adaptive::State::new(LINK),
            };
            let before = state;
            let torque = step(
                &config,
                &mut state,
                Measured {
                    position: 2.0,
                    velocity: 0.0,
                },
                Reference::default(),
                0.0,
            );
            assert!(torque.limited && torque.value.abs() == 0.5);
            assert_eq!(state, before);
        }
    }
}
