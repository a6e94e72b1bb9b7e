//! Current loop: PI whose zero cancels the winding's pole, with back-EMF feed-forward.
//!
//! Designed in discrete time for a voltage held over a period T: the winding is i⁺ = a·i + (1−a)/R·u with a =
//! exp(−R·T/L). The controller's zero is at a, and its gain puts the remaining pole at exp(−ω·T). So the current
//! follows its reference as a first-order lag of the stated bandwidth, without steady error (Åström and Wittenmark
//! 1997, ch. 5, pole-zero cancellation). Back-calculation reduces the integrator by the voltage that the bridge could
//! not give (Åström and Rundqwist 1989).
//!
//! Leaves out: the delay of one PWM period between computing and applying a voltage. It takes 360°·f·T of phase, so
//! keep the bandwidth below a twentieth of the loop rate.

use super::Gains;
use crate::drive::Drive;
use crate::scalar::Real;

/// Constants of the loop while it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T> {
    /// Gain from current error to voltage, V/A.
    pub proportional: T,
    /// Gain from current error to the integrator's change in one period, V/A.
    pub integral: T,
    /// Largest share of the supply that the bridge may use, 0 to 1.
    pub duty_limit: T,
    /// Delay of the current behind its reference, s.
    pub lag: T,
    /// Share of its distance to the reference that the current covers in a period.
    pub closed: T,
}

impl<T: Real> Config<T> {
    /// Returns the loop for a drive, a bandwidth ([`Gains::current_bandwidth`], Hz) and a period (s). Resistance and
    /// inductance must be above zero.
    ///
    /// The lag is the inverse of the velocity gain of the loop, which is of type 1. A ramp, and nearly any slow change,
    /// is late by this time, for any delay between computing and applying a voltage (Franklin, Powell and Emami-Naeini
    /// 2015, sec. 4.2).
    pub fn design(drive: &Drive<T>, gains: &Gains<T>, period: T, duty_limit: T) -> Self {
        let omega = T::from_f64(core::f64::consts::TAU) * gains.current_bandwidth;
        let closed = one_minus_exp(omega * period);
        let open = one_minus_exp(period / drive.electrical_time_constant());
        Self {
            proportional: closed * drive.resistance / open,
            integral: closed * drive.resistance,
            duty_limit,
            lag: period / closed,
            closed,
        }
    }
}

/// Returns 1 − exp(−x) without cancellation for small x: 2t/(1 + t) with t = tanh(x/2).
fn one_minus_exp<T: Real>(x: T) -> T {
    let t = (T::from_f64(0.5) * x).tanh();
    (t + t) / (T::ONE + t)
}

/// State of the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    /// Voltage that the integrator holds, V.
    pub integral: T,
    /// Expected current at the end of the period, A.
    pub predicted: T,
}

/// Returns the expected current when the voltage for this reference acts, A: the reference delayed by the loop's lag.
/// It reverses when the current does, without its noise. Call it once in a period.
#[inline(always)]
pub fn predict<T: Real>(config: &Config<T>, state: &mut State<T>, reference: T) -> T {
    state.predicted += config.closed * (reference - state.predicted);
    state.predicted
}

/// Inputs of the loop in one period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input<T> {
    /// Wanted motor current, A.
    pub reference: T,
    /// Measured motor current, A.
    pub current: T,
    /// Back-EMF at the present speed, V: [`Drive::back_emf`].
    pub back_emf: T,
    /// Supply voltage, V.
    pub supply: T,
}

/// Output of the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output<T> {
    /// Voltage over the motor's terminals, V.
    pub voltage: T,
    /// Voltage as a share of the supply, −1 to 1.
    pub duty: T,
    /// True if the voltage limit has reduced the voltage.
    pub limited: bool,
}

/// Runs one period of the current loop. Without a supply, or if an input is NaN, the duty is 0 and the state stays.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    input: Input<T>,
) -> Output<T> {
    let error = input.reference - input.current;
    let unlimited = config.proportional * error + state.integral + input.back_emf;
    let limit = config.duty_limit * input.supply;
    if !T::ZERO.lt(limit) || !unlimited.le(unlimited) {
        return Output {
            voltage: T::ZERO,
            duty: T::ZERO,
            limited: true,
        };
    }
    let voltage = unlimited.clamp_to(-limit, limit);
    // Back-calculation with the winding's time constant: the integrator ends as for the reference that the voltage can
    // just follow.
    state.integral += config.integral * (error + (voltage - unlimited) / config.proportional);
    Output {
        voltage,
        duty: voltage / input.supply,
        limited: limit.lt(unlimited.abs()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: Drive<f64> = Drive {
        gear_ratio: 50.0,
        rotor_inertia: 2e-5,
        torque_constant: 0.05,
        resistance: 0.6,
        inductance: 0.5e-3,
    };
    const PERIOD: f64 = 1e-4;

    fn config() -> Config<f64> {
        let gains = Gains {
            current_bandwidth: 400.0,
            ..Gains::default()
        };
        Config::design(&DRIVE, &gains, PERIOD, 0.95)
    }

    /// Advances the winding by one period: a hundred substeps of the voltage equation at a fixed joint speed.
    fn wind(current: &mut f64, voltage: f64, velocity: f64) {
        let h = PERIOD / 100.0;
        for _ in 0..100 {
            let middle = *current + h / 2.0 * DRIVE.current_rate(voltage, *current, velocity);
            *current += h * DRIVE.current_rate(voltage, middle, velocity);
        }
    }

    fn run(
        reference: f64,
        velocity: f64,
        supply: f64,
        ticks: usize,
    ) -> std::vec::Vec<(f64, Output<f64>)> {
        let (mut state, mut current) = (State::default(), 0.0);
        (0..ticks)
            .map(|_| {
                let input = Input {
                    reference,
                    current,
                    back_emf: DRIVE.back_emf(velocity),
                    supply,
                };
                let output = step(&config(), &mut state, input);
                wind(&mut current, output.voltage, velocity);
                (current, output)
            })
            .collect()
    }

    #[test]
    fn the_step_response_has_the_designed_bandwidth_at_any_speed() {
        for velocity in [0.0, 2.0, -2.0] {
            for (k, (current, output)) in run(1.0, velocity, 24.0, 60).iter().enumerate() {
                let t = (k + 1) as f64 * PERIOD;
                let predicted = 1.0 - libm::exp(-core::f64::consts::TAU * 400.0 * t);
                assert!(!output.limited);
                assert!(
                    (current - predicted).abs() < 1e-4,
                    "{t}: {current} {predicted}"
                );
            }
        }
    }

    /// A ramp, with and without the period between computing and applying a voltage that a board has.
    #[test]
    fn a_ramp_comes_late_by_the_lag() {
        let config = config();
        for delayed in [false, true] {
            let (mut state, mut current, mut held) = (State::default(), 0.0, 0.0);
            for tick in 0..400 {
                let reference = 10.0 * PERIOD * f64::from(tick);
                if tick > 300 {
                    let late = (reference - current) / 10.0;
                    assert!((late / config.lag - 1.0).abs() < 1e-6, "{late}");
                }
                let input = Input {
                    reference,
                    current,
                    back_emf: 0.0,
                    supply: 24.0,
                };
                let voltage = step(&config, &mut state, input).voltage;
                wind(&mut current, if delayed { held } else { voltage }, 0.0);
                held = voltage;
            }
        }
    }

    #[test]
    fn voltage_limit_is_kept_and_the_integrator_does_not_wind_up() {
        let (mut state, mut current) = (State::default(), 0.0);
        // 40 A need at least 24 V: unreachable at 12 V.
        for _ in 0..5_000 {
            let output = step(
                &config(),
                &mut state,
                Input {
                    reference: 40.0,
                    current,
                    back_emf: 0.0,
                    supply: 12.0,
                },
            );
            assert!(
                output.voltage.abs() <= 0.95 * 12.0 + 1e-12 && output.duty.abs() <= 0.95 + 1e-12
            );
            wind(&mut current, output.voltage, 0.0);
        }
        assert!((current - 11.4 / 0.6).abs() < 1e-6, "{current}");
        // After half a second in saturation the reference falls: the overshoot stays below the step's share.
        let mut lowest = current;
        let mut ticks = 0;
        while (current - 5.0).abs() > 0.05 && ticks < 200 {
            let output = step(
                &config(),
                &mut state,
                Input {
                    reference: 5.0,
                    current,
                    back_emf: 0.0,
                    supply: 12.0,
                },
            );
            wind(&mut current, output.voltage, 0.0);
            lowest = lowest.min(current);
            ticks += 1;
        }
        assert!(ticks < 40, "{ticks} ticks to settle");
        assert!(lowest > 4.9, "undershoot to {lowest}");
    }

    #[test]
    fn no_supply_or_no_number_gives_no_voltage() {
        let mut state = State {
            integral: 1.0,
            ..State::default()
        };
        for input in [
            Input {
                reference: 1.0,
                supply: 0.0,
                ..Input::default()
            },
            Input {
                reference: 1.0,
                supply: f64::NAN,
                ..Input::default()
            },
            Input {
                reference: f64::NAN,
                supply: 24.0,
                ..Input::default()
            },
        ] {
            let output = step(&config(), &mut state, input);
            assert_eq!((output.duty, output.limited), (0.0, true));
            assert_eq!(state.integral, 1.0);
        }
    }

    #[test]
    fn single_precision_designs_the_same_loop() {
        let drive = Drive {
            gear_ratio: 50.0_f32,
            rotor_inertia: 2e-5,
            torque_constant: 0.05,
            resistance: 0.6,
            inductance: 0.5e-3,
        };
        let gains = Gains {
            current_bandwidth: 400.0_f32,
            ..Gains::default()
        };
        let single = Config::design(&drive, &gains, 1e-4, 0.95);
        assert!((f64::from(single.proportional) / config().proportional - 1.0).abs() < 1e-6);
        assert!((f64::from(single.integral) / config().integral - 1.0).abs() < 1e-6);
    }
}
