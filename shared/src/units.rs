//! Types for raw hardware codes, and their conversion to quantities.

/// The encoder timer's counter: 16 bits, wrapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderCount(pub u16);

/// A conversion result of the 12-bit analogue-to-digital converter, right-aligned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AdcCode(pub u16);

impl AdcCode {
    /// Largest code of the 12-bit converter.
    pub const FULL_SCALE: u16 = 4095;

    /// Returns true if the code is at either end of the converter's range, where it no longer measures.
    #[inline]
    pub const fn at_rail(self) -> bool {
        self.0 == 0 || self.0 >= Self::FULL_SCALE
    }
}

/// Signed bridge duty cycle, −1 to 1 of the supply voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Duty(pub f32);
