//! Winding, inverter and current sensor, from the recorded voltage of a motor.
//!
//! u = R·(i − i₀) + L·di/dt + k·ω·(1 − b·i²) + c·dω/dt + volts · sgn(i). i is the current, from the torque and the
//! described torque constant. ω is the motor's speed and i₀ the sensor's reading without a current (Krause, Wasynczuk &
//! Sudhoff 2002, ch. 2; the last term, which fades at low current: Holtz 1992). L and c include, to first order,
//! different sampling instants of voltage, current and position. The equation has no torque: friction, load and gear do
//! not affect it. So its current zero separates a sensor error from a torque.
//!
//! Leaves out: a resistance that rises with temperature; ripple within a pulse; drives that move several joints; the
//! voltage drop of brushes, which looks like a dead zone.

mod analysis;
mod equation;
mod left;
mod remarks;
mod sentences;
mod settle;
mod tell;
#[cfg(test)]
mod tests;
mod winding;

pub(crate) use settle::{Word, settled, zeros};
pub(crate) use tell::{left_of_voltage, tell, windings};
pub(crate) use winding::{Winding, contradict, name_something};
