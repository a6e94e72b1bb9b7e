//! Emulated time in units that every clock of the chip divides.
//!
//! 4080 MHz is the least common multiple of 16 MHz (HSI), 24 MHz (the board's crystal), 48 MHz, 170 MHz and the 32 kHz
//! LSI. 64 bits hold 143 years.

/// Units per second.
pub const UNITS_PER_SECOND: u64 = 4_080_000_000;
/// Units per microsecond.
pub const UNITS_PER_MICROSECOND: u64 = UNITS_PER_SECOND / 1_000_000;

/// A point of time since power on, in units.
pub type Instant = u64;

/// Never.
pub const NEVER: Instant = Instant::MAX;

/// Converts seconds to units, to the nearest one.
pub fn from_seconds(seconds: f64) -> u64 {
    (seconds * UNITS_PER_SECOND as f64).round() as u64
}

/// Converts units to seconds.
pub fn to_seconds(units: u64) -> f64 {
    units as f64 / UNITS_PER_SECOND as f64
}
