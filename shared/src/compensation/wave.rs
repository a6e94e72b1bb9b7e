//! Periodic effects: turned with their angle in every second tick, along a parabola in the other, and set right by their own
//! formula once in a while.
//!
//! cosine·cos φ + sine·sin φ and what it is a quarter of a period on are two numbers that turn into each other by the order
//! times what the angle has moved: for less than what sine and cosine of the angle cost, and as right in whatever tick a
//! wave's turn to be set right comes. Between two turns the sums of all waves go on by their first and second derivatives.
//!
//! Where the phase moves by more than 1.5 rad from one turn to the next (order 84 over 50 : 1 above 1.8 rad/s) there is no wave: a
//! current loop of a twentieth of the tick's rate gives half of it at best, and at a jump of the angle nobody knows the phase.

use super::EFFECTS;
use super::compensated::Compensated;
use super::now::Now;
use super::role::Role;
use crate::effects::Periodic;
use crate::precompensation::finite;
use crate::scalar::{Real, Scalar};

/// Farthest that a phase may move from one turn to the next, rad.
const FARTHEST: f64 = 1.5;

/// What waves are summed up for: errors of the position by the motor's angle and by the joint's, and torques, on their own and
/// per torque of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Sort {
    #[default]
    Motor,
    Joint,
    Torque,
    OfDrive,
}

impl Sort {
    fn of<T>(one: &Compensated<T>) -> Option<Self> {
        Some(match (one.role, one.effect.kind.periodic()?) {
            (Role::Position, Periodic::Joint) => Self::Joint,
            (Role::Position, _) => Self::Motor,
            (_, Periodic::MotorTimesDrive) => Self::OfDrive,
            _ => Self::Torque,
        })
    }

    /// Its place.
    #[inline(always)]
    fn place(self) -> usize {
        self as usize & 3
    }
}

/// An effect that is a sinusoid of an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Wave<T> {
    /// Periods in a turn of the angle.
    order: T,
    cosine: T,
    sine: T,
    sort: Sort,
    /// The order is whole: the motor's angle within a turn says as much as the angle itself, and better.
    whole: bool,
}

/// What a wave is, and what it is a quarter of a period on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Phasor<T> {
    value: T,
    ahead: T,
}

/// Angles of the four sorts, or what is between two of them, rad. A torque's is that at which it acts when it is ordered now.
type Angles<T> = [T; 4];

/// Sum of waves of a sort.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sum<T> {
    pub(super) value: T,
    /// Its first and second derivative by the angle, 1/rad and 1/rad² of the value.
    pub(super) slope: T,
    bend: T,
}

impl<T: Real> Sum<T> {
    /// So far on.
    #[inline(always)]
    pub(super) fn after(self, angle: T) -> Self {
        let half = T::from_f64(0.5);
        Self {
            value: self.value + angle * (self.slope + half * angle * self.bend),
            slope: self.slope + angle * self.bend,
            bend: self.bend,
        }
    }
}

/// The periodic ones among effects.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Waves<T> {
    /// Sort by sort.
    waves: [Wave<T>; EFFECTS],
    count: u8,
    of_position: bool,
    of_torque: bool,
    highest_order: T,
}

/// Where waves stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stand<T> {
    phasors: [Phasor<T>; EFFECTS],
    at: Angles<T>,
    sums: [Sum<T>; 4],
    /// Highest order among those that are not too fast.
    highest_order: T,
    /// Which is set right next.
    next: u8,
}

impl<T: Scalar> Waves<T> {
    pub(super) fn new(effects: &[Option<Compensated<T>>; EFFECTS]) -> Self {
        let mut all = Self::default();
        // Sort by sort.
        for sort in [Sort::Motor, Sort::Joint, Sort::Torque, Sort::OfDrive] {
            for one in effects.iter().flatten() {
                let Some(wave) = all.waves.get_mut(usize::from(all.count)) else {
                    break;
                };
                if Sort::of(one) != Some(sort) {
                    continue;
                }
                let [cosine, sine, ..] = one.effect.gains;
                *wave = Wave {
                    order: one.effect.shapes[0],
                    cosine,
                    sine,
                    sort,
                    whole: one.whole,
                };
                all.count += 1;
                all.highest_order = all.highest_order.max(wave.order);
                if matches!(sort, Sort::Motor | Sort::Joint) {
                    all.of_position = true;
                } else {
                    all.of_torque = true;
                }
            }
        }
        all
    }

    /// Largest slope of what is read too much, motor and joint together: each wave's amplitude by its order.
    pub(super) fn position_slope(&self, gear_ratio: T) -> T {
        let waves = self.waves.iter().take(usize::from(self.count));
        waves.fold(T::ZERO, |sum, wave| {
            let amplitude = (wave.cosine * wave.cosine + wave.sine * wave.sine).sqrt();
            let slope = amplitude * wave.order.abs();
            sum + match wave.sort {
                Sort::Motor => slope * gear_ratio.abs(),
                Sort::Joint => slope,
                Sort::Torque | Sort::OfDrive => T::ZERO,
            }
        })
    }

    #[inline(always)]
    pub(super) fn any(&self) -> bool {
        self.count > 0
    }

    #[inline(always)]
    pub(super) fn of_position(&self) -> bool {
        self.of_position
    }

    #[inline(always)]
    pub(super) fn of_torque(&self) -> bool {
        self.of_torque
    }

    /// Error of the position by the motor's angle, and by the joint's.
    #[inline(always)]
    pub(super) fn position(&self, stand: &Stand<T>, now: &Now<T>) -> [Sum<T>; 2] {
        let [motor, joint, ..] = stand.at;
        let [of_motor, of_joint, ..] = stand.sums;
        [
            stand.after(of_motor, now.motor_angle - motor),
            stand.after(of_joint, now.position - joint),
        ]
    }

    /// Torque when what is ordered now acts, and the same per torque of the drive.
    #[inline(always)]
    pub(super) fn torque(&self, stand: &Stand<T>, now: &Now<T>) -> [Sum<T>; 2] {
        let [.., torque, of_drive] = stand.sums;
        let moved = later(now) - stand.at[2];
        [torque, of_drive].map(|sum| stand.after(sum, moved))
    }

    /// Turns all waves to where the link is, and where there is time sets one of them right.
    ///
    /// Not inlined: it needs registers of its own.
    #[inline(never)]
    pub(super) fn turn(&self, stand: &mut Stand<T>, now: &Now<T>) {
        let f = T::from_f64;
        let later = later(now);
        let at = [now.motor_angle, now.position, later, later];
        let [motor, joint, before, _] = core::mem::replace(&mut stand.at, at);
        let ahead = later - before;
        let mut moved = [at[0] - motor, at[1] - joint, ahead, ahead];
        if !now.busy {
            self.set(stand, now, &at, &moved);
        }
        let farthest = moved[0].abs().max(moved[1].abs()).max(moved[2].abs());
        // Not so for what is no number, either.
        if !(farthest * stand.highest_order).le(f(FARTHEST)) {
            self.drop_fast(stand, &mut moved);
        }
        // A sum is put down where the next sort begins; that of a sort without waves stays 0.
        let mut sort = Sort::default();
        let mut way = moved[sort.place()];
        let mut sum = Sum::default();
        let waves = self.waves.iter().take(usize::from(self.count));
        for (wave, phasor) in waves.zip(&mut stand.phasors) {
            if wave.sort != sort {
                stand.sums[sort.place()] = sum;
                sum = Sum::default();
                sort = wave.sort;
                way = moved[sort.place()];
            }
            let order = wave.order;
            let angle = order * way;
            // Taylor's series: right to 3·10⁻³ and 6·10⁻⁴ at 1.5 rad, to 2·10⁻⁴ and 3·10⁻⁵ at one.
            let square = angle * angle;
            let sine = angle * (T::ONE - square * (f(1.0 / 6.0) - square * f(1.0 / 120.0)));
            let cosine =
                T::ONE - square * (f(0.5) - square * (f(1.0 / 24.0) - square * f(1.0 / 720.0)));
            let (value, ahead) = (phasor.value, phasor.ahead);
            phasor.value = cosine * value + sine * ahead;
            phasor.ahead = cosine * ahead - sine * value;
            sum.value += phasor.value;
            sum.slope += order * phasor.ahead;
            sum.bend -= order * (order * phasor.value);
        }
        stand.sums[sort.place()] = sum;
    }

    /// Sets the next wave to what its formula says, as far before the tick's angles as it is then turned.
    #[inline(always)]
    fn set(&self, stand: &mut Stand<T>, now: &Now<T>, at: &Angles<T>, moved: &Angles<T>) {
        let place = stand.next;
        stand.next = if place + 1 < self.count { place + 1 } else { 0 };
        let place = usize::from(place);
        let (Some(wave), Some(phasor)) = (self.waves.get(place), stand.phasors.get_mut(place))
        else {
            return;
        };
        let k = wave.sort.place();
        let short = wave.whole && wave.sort != Sort::Joint;
        let angle = if short {
            now.angle_in_turn + (at[k] - now.motor_angle)
        } else {
            at[k]
        };
        let (sine, cosine) = (wave.order * (angle - moved[k])).sin_cos();
        *phasor = Phasor {
            value: wave.cosine * cosine + wave.sine * sine,
            ahead: wave.sine * cosine - wave.cosine * sine,
        };
        stand.highest_order = self.highest_order;
    }

    /// Drops waves whose phase has moved too far.
    #[cold]
    #[inline(never)]
    fn drop_fast(&self, stand: &mut Stand<T>, moved: &mut Angles<T>) {
        let farthest = T::from_f64(FARTHEST);
        stand.highest_order = T::ZERO;
        for (wave, phasor) in self.waves.iter().zip(&mut stand.phasors) {
            let angle = wave.order * moved[wave.sort.place()];
            if angle.abs().le(farthest) {
                stand.highest_order = stand.highest_order.max(wave.order);
            } else {
                *phasor = Phasor::default();
            }
        }
        // What turns nothing, but may be no number.
        for moved in moved {
            *moved = T::select(moved.abs().le(farthest), *moved, T::ZERO);
        }
    }
}

impl<T: Real<Mask = bool>> Stand<T> {
    /// A sum so far from where it was taken; none where that is too far.
    #[inline(always)]
    fn after(&self, sum: Sum<T>, moved: T) -> Sum<T> {
        let near = (moved * self.highest_order).abs().le(T::from_f64(FARTHEST));
        if near {
            sum.after(moved)
        } else {
            Sum::default()
        }
    }
}

/// The motor's angle when a torque that is ordered now acts, rad.
#[inline(always)]
fn later<T: Real>(now: &Now<T>) -> T {
    now.motor_angle + now.lead * finite(now.velocity) * now.gear_ratio
}

#[cfg(test)]
#[path = "wave_test.rs"]
mod tests;
