//! The chip's peripherals, one file each, from the reference manual RM0440 rev 8 and, for the core's own, from the
//! ARMv7-M Architecture Reference Manual (DDI 0403E).
//!
//! Everything not modelled is refused by name: an unlisted register, a reserved bit, or a bit without a modelled
//! effect. A refusal ends the run; nothing is accepted silently.

pub mod adc;
pub mod comp;
pub mod dac;
pub mod dma;
pub mod dmamux;
pub mod exti;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod lpuart;
pub mod pwr;
pub mod rcc;
pub mod syscfg;
pub mod tim;

use thiserror::Error;

/// Reason why an access is refused.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Refusal {
    /// No such register in the model.
    #[error("there is no register there in the model")]
    NoRegister,
    /// Bits that are reserved or not modelled.
    #[error("bits {bits:#x} of {register} are reserved or not modelled (written {value:#010x})")]
    Bits {
        /// Name of the register.
        register: &'static str,
        /// The bits.
        bits: u32,
        /// The whole written value.
        value: u32,
    },
    /// Another reason, as text.
    #[error("{0}")]
    Told(String),
}

/// Returns a refusal as text.
pub fn told<T>(text: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal::Told(text.into()))
}

/// A register: offset, name, value after reset, bits that software may set.
#[derive(Clone, Copy, Debug)]
pub struct Register(pub u16, pub &'static str, pub u32, pub u32);

/// Registers that mostly hold their written values.
#[derive(Clone, Debug)]
pub struct Bank {
    registers: &'static [Register],
    values: Vec<u32>,
    /// Place of the register at each word.
    index: Vec<u8>,
}

impl Bank {
    /// Registers with their values after reset.
    pub fn new(registers: &'static [Register]) -> Self {
        let words = registers.iter().map(|r| r.0 as usize / 4 + 1).max();
        let mut index = vec![u8::MAX; words.unwrap_or(0)];
        for (place, register) in registers.iter().enumerate() {
            if let Some(slot) = index.get_mut(register.0 as usize / 4) {
                *slot = place as u8;
            }
        }
        Self {
            registers,
            values: registers.iter().map(|r| r.2).collect(),
            index,
        }
    }

    fn place(&self, offset: u32) -> Option<usize> {
        let place = *self.index.get(offset as usize / 4)?;
        (place != u8::MAX && offset.is_multiple_of(4)).then_some(usize::from(place))
    }

    /// Returns the value of a register; 0 if there is none.
    pub fn get(&self, offset: u32) -> u32 {
        self.place(offset)
            .and_then(|place| self.values.get(place))
            .copied()
            .unwrap_or(0)
    }

    /// Sets a value, as hardware does.
    pub fn put(&mut self, offset: u32, value: u32) {
        if let Some(slot) = self.place(offset).and_then(|p| self.values.get_mut(p)) {
            *slot = value;
        }
    }

    /// A load by software.
    ///
    /// # Errors
    /// [`Refusal::NoRegister`].
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        match self.place(offset) {
            Some(_) => Ok(self.get(offset)),
            None => Err(Refusal::NoRegister),
        }
    }

    /// Stores a value as software does. Bits that software may not set keep the value of the hardware; writing back a
    /// bit as read is no error. Returns the value before.
    ///
    /// # Errors
    /// [`Refusal::NoRegister`], [`Refusal::Bits`].
    pub fn write(&mut self, offset: u32, value: u32) -> Result<u32, Refusal> {
        let place = self.place(offset).ok_or(Refusal::NoRegister)?;
        let (Some(register), Some(slot)) = (self.registers.get(place), self.values.get_mut(place))
        else {
            return Err(Refusal::NoRegister);
        };
        let before = *slot;
        let writable = register.3;
        let strange = value & !writable & !before;
        if strange != 0 {
            return Err(Refusal::Bits {
                register: register.1,
                bits: strange,
                value,
            });
        }
        *slot = (before & !writable) | (value & writable);
        Ok(before)
    }
}
