//! Braking by the motor's own voltage after a fault, without the encoder.
//!
//! Both motor wires at one potential short-circuit the winding. Its current is then e/R, with the back-EMF e and the
//! resistance R: at full speed several times what the bridge bears. So a current controller asks for the braking current
//! −s·I with the limit I, where s is the sign of e, and may give a voltage between 0 and the supply in the direction s
//! only. While e exceeds R·I it gives the rest of e, and the current stays at the limit. Below, it would have to drive the
//! motor: its voltage stays at 0, which is the plain short circuit. That lets a link under gravity creep down at its torque
//! over (N·k)²/R.
//!
//! The controller has the gains of the current loop ([`rig_shared::control::current`]). It begins with the present voltage
//! as its integrator and the present current as its reference, so it needs neither e nor an exact R.
//!
//! A current reading that stays beyond the limit would raise the voltage above e and so drive the motor on. Three rules
//! prevent this:
//! * The voltage exceeds its own low-passed value by R·I at most, and this value rises slowly ([`RISE_TIME`]). As the
//!   voltage is e − R·I while the brake works, it stays below e.
//! * A reading that does not change is not believed: the bridge goes off (`converter_is_suspect`, in the caller).
//! * The bridge also goes off if the encoder, while it is sound, shows that the speed grows
//!   ([`MotorBrake::speed_has_grown`]).
//!
//! Leaves out: the heat of the winding and the rise of the supply by the energy that comes back, which the checks watch.

use rig_shared::drive::Drive;
use rig_shared::safety::SnapshotSample;

use crate::derived::Derived;

/// Integrator below which the direction may change, as a share of R·I: a tenth of the short circuit's largest voltage.
const EMPTY: f32 = 0.1;

/// Speed of the reference as a share of the current loop's. A step would let the full back-EMF act on the winding for the
/// loop's delay, which is 3 A a tick at 6 rad/s of the template's joint.
const SHARE: f32 = 0.25;

/// Shortest time in which the low-passed voltage may rise by the supply, s. With 24 V it is 120 V/s, the back-EMF of the
/// template's joint under 48 rad/s². Its peak torque of 8 N·m gives 47 rad/s².
const RISE_TIME: f32 = 0.2;

/// Growth of the speed that ends a brake which began above the hard limit, as a share of that limit's margin: 0.4 rad/s
/// with the template, many times the noise of the measured velocity.
const GROWTH_SHARE: f32 = 0.25;

/// State of the braking; the default begins it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MotorBrake {
    /// Sign of the back-EMF; 0 before the first tick.
    direction: f32,
    /// The controller's integrator, V.
    integral: f32,
    /// The present reference of the current, A.
    reference: f32,
    /// Low-passed size of the voltage, V.
    recent: f32,
    /// Lowest speed of the joint since the brake began, rad/s; `None` before the first tick.
    slowest: Option<f32>,
    /// The encoder has failed.
    encoder_failed: bool,
}

impl MotorBrake {
    /// Begins with the present voltage and current.
    fn begin(drive: &Drive<f32>, now: &SnapshotSample) -> Self {
        let voltage = now.duty * now.supply;
        let emf = voltage - drive.resistance * now.current;
        Self {
            direction: 1.0_f32.copysign(emf),
            integral: voltage,
            reference: now.current,
            // Until the voltage has settled it is not bounded: the fault may have found the current loop in a transient.
            recent: now.supply,
            ..Self::default()
        }
    }

    /// Stops using the speed of the encoder, which has failed.
    pub(crate) fn ignore_encoder(&mut self) {
        self.encoder_failed = true;
    }

    /// Returns true if the joint's speed, rad/s, has grown while the motor brakes: by the margin between its limit and hard
    /// limit (`limits`, rad/s), or beyond the hard limit. NaN counts as grown. False after [`MotorBrake::ignore_encoder`].
    pub(crate) fn speed_has_grown(&mut self, velocity: f32, [limit, hard_limit]: [f32; 2]) -> bool {
        let speed = velocity.abs();
        let slowest = self.slowest.map_or(speed, |slowest| slowest.min(speed));
        self.slowest = Some(slowest);
        let margin = hard_limit - limit;
        let allowed = (slowest + margin).min(hard_limit.max(slowest + GROWTH_SHARE * margin));
        !self.encoder_failed && !(speed <= allowed)
    }

    /// Returns the duty cycle of the next tick; `peak` is the limit of the current, A.
    pub(crate) fn step(
        &mut self,
        drive: &Drive<f32>,
        derived: &Derived,
        peak: f32,
        now: &SnapshotSample,
    ) -> f32 {
        let gains = &derived.current;
        if self.direction == 0.0 {
            *self = Self {
                slowest: self.slowest,
                encoder_failed: self.encoder_failed,
                ..Self::begin(drive, now)
            };
        }
        let target = -self.direction * peak;
        self.reference += SHARE * gains.closed * (target - self.reference);
        let error = self.reference - now.current;
        let unlimited = gains.proportional * error + self.integral;
        let most = (gains.duty_limit * now.supply).min(self.recent + drive.resistance * peak);
        // Also 0 for NaN.
        let size = (self.direction * unlimited).max(0.0).min(most);
        let voltage = self.direction * size;
        let change = SHARE * gains.closed * (size - self.recent);
        self.recent += change.min(now.supply * derived.period / RISE_TIME);
        // Back-calculation, as in the current loop.
        self.integral += gains.integral * (error + (voltage - unlimited) / gains.proportional);
        if size > 0.0 {
            return voltage / now.supply;
        }
        // Short-circuited: the current tells the direction, once nothing of an earlier voltage is left.
        if self.integral.abs() < EMPTY * drive.resistance * peak {
            self.direction = 1.0_f32.copysign(-now.current);
            self.reference = -self.direction * peak;
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nameplate::one_link;

    /// A winding behind a spinning rotor, in steps of a tenth of a tick: whatever current the fault finds, and with a true
    /// resistance 40 % off, the current stays below the over-current limit of 4.8 A and ends as the short circuit's. Turned
    /// the other way afterwards, it does again.
    #[test]
    fn the_current_stays_at_its_limit_until_the_motor_is_slow() {
        let (config, settings) = one_link();
        let drive = config.drive;
        let derived = Derived::new(&config, &settings);
        let period = config.monitor.period;
        for (error, begin) in [(0.6, 3.2), (1.0, 3.2), (1.4, 3.2), (0.6, -3.2), (1.0, 0.0)] {
            let resistance = drive.resistance * error;
            // 6 rad/s of the joint that fall to none within 0.2 s, to −3 rad/s within another tenth, and to rest.
            let emf_at = |time: f32| {
                let turned_back = 30.0 * (time - 0.3).clamp(0.0, 0.1);
                drive.back_emf(6.0 - 30.0 * time.min(0.3) + turned_back)
            };
            let mut current = begin;
            let mut duty = (emf_at(0.0) + resistance * current) / 24.0;
            let mut brake = MotorBrake::default();
            let mut largest = [0.0_f32; 2];
            let mut shorted = false;
            for tick in 0..4200 {
                // A converter's noise of some codes, of both signs.
                let noise = 0.03 * ((tick * 7919 % 13) as f32 - 6.0) / 6.0;
                let now = SnapshotSample {
                    current: current + noise,
                    duty,
                    supply: 24.0,
                    ..SnapshotSample::default()
                };
                let next = brake.step(&drive, &derived, 3.2, &now);
                let time = tick as f32 * period;
                for _ in 0..10 {
                    let rate =
                        (duty * 24.0 - resistance * current - emf_at(time)) / drive.inductance;
                    current += 0.1 * period * rate;
                }
                largest[0] = largest[0].max(-current);
                largest[1] = largest[1].max(current);
                if (0.18..0.2).contains(&time) {
                    shorted |= duty == 0.0;
                    assert!(duty == 0.0 || time < 0.19, "{error}: {duty} at {time} s");
                }
                duty = next;
            }
            assert!(
                shorted && duty == 0.0 && current.abs() < 0.1,
                "{error} {begin}: {shorted} {duty} {current}"
            );
            assert!(
                largest.iter().all(|current| (2.9..4.8).contains(current)),
                "{error}: {largest:?} A"
            );
        }
    }
}
