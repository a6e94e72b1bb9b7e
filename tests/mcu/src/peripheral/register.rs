//! Registers that mostly hold their written values.

use super::refusal::Refusal;

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
