//! A port of sixteen pins (RM0440 section 9.4).

use super::{Bank, Refusal, Register};

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "MODER", 0xFFFF_FFFF, 0xFFFF_FFFF),
    Register(0x04, "OTYPER", 0, 0x0000_FFFF),
    Register(0x08, "OSPEEDR", 0, 0xFFFF_FFFF),
    Register(0x0C, "PUPDR", 0, 0xFFFF_FFFF),
    Register(0x10, "IDR", 0, 0),
    Register(0x14, "ODR", 0, 0x0000_FFFF),
    Register(0x18, "BSRR", 0, 0xFFFF_FFFF),
    Register(0x20, "AFRL", 0, 0xFFFF_FFFF),
    Register(0x24, "AFRH", 0, 0xFFFF_FFFF),
    Register(0x28, "BRR", 0, 0x0000_FFFF),
];

/// Function of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Digital input.
    Input,
    /// Digital output.
    Output,
    /// An alternate function by its number.
    Alternate(u8),
    /// Analogue, as after reset.
    Analogue,
}

/// A port.
#[derive(Clone, Debug)]
pub struct Gpio {
    bank: Bank,
    /// Levels from the board on the pins.
    outside: u16,
}

impl Gpio {
    /// Returns port `number` (0 for A) after reset.
    pub fn new(number: u8) -> Self {
        let mut bank = Bank::new(REGISTERS);
        match number {
            0 => {
                bank.put(0x00, 0xABFF_FFFF);
                bank.put(0x08, 0x0C00_0000);
                bank.put(0x0C, 0x6400_0000);
            }
            1 => {
                bank.put(0x00, 0xFFFF_FEBF);
                bank.put(0x08, 0x0000_00C0);
                bank.put(0x0C, 0x0000_0100);
            }
            _ => {}
        }
        Self { bank, outside: 0 }
    }

    /// Returns the function of a pin.
    pub fn function(&self, pin: u32) -> Function {
        match self.bank.get(0x00) >> (2 * pin) & 3 {
            0 => Function::Input,
            1 => Function::Output,
            2 => {
                let register = if pin < 8 { 0x20 } else { 0x24 };
                Function::Alternate((self.bank.get(register) >> (4 * (pin % 8)) & 0xF) as u8)
            }
            _ => Function::Analogue,
        }
    }

    /// Returns true if the pin is driven high as an output.
    pub fn drives_high(&self, pin: u32) -> bool {
        self.function(pin) == Function::Output && self.bank.get(0x14) & 1 << pin != 0
    }

    /// Sets the level from the board on a pin; returns true if it changed.
    pub fn set_outside(&mut self, pin: u32, high: bool) -> bool {
        let before = self.outside;
        self.outside = (before & !(1 << pin)) | u16::from(high) << pin;
        before != self.outside
    }

    /// Returns the level that the pin's own pull gives to an undriven wire; low without a pull.
    pub fn pulls_up(&self, pin: u32) -> bool {
        self.bank.get(0x0C) >> (2 * pin) & 3 == 1
    }

    /// Returns the level from the board on a pin.
    pub fn outside(&self, pin: u32) -> bool {
        self.outside & 1 << pin != 0
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        if offset != 0x10 {
            return self.bank.read(offset);
        }
        let mut levels = 0;
        for pin in 0..16 {
            let high = match self.function(pin) {
                Function::Output => self.bank.get(0x14) & 1 << pin != 0,
                Function::Analogue => false,
                _ => self.outside(pin),
            };
            levels |= u32::from(high) << pin;
        }
        Ok(levels)
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        let out = self.bank.get(0x14);
        match offset {
            0x18 => self
                .bank
                .put(0x14, (out & !(value >> 16)) | (value & 0xFFFF)),
            0x28 => self.bank.put(0x14, out & !value),
            _ => {
                self.bank.write(offset, value)?;
            }
        }
        Ok(())
    }
}
