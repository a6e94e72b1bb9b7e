//! DMA request multiplexer (RM0440 section 13.6): assigns requests to channels. Synchronisation and request generators
//! are not modelled.

use super::{Refusal, told};

/// The multiplexer: sixteen channels, eight per controller.
#[derive(Clone, Debug, Default)]
pub struct Dmamux([u32; 16]);

impl Dmamux {
    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        match offset {
            // Without synchronisation there is no overrun of it.
            0x80 => Ok(0),
            _ => self
                .0
                .get(offset as usize / 4)
                .copied()
                .ok_or(Refusal::NoRegister),
        }
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        if offset == 0x84 {
            return Ok(());
        }
        // Events (EGE) go to the request generators, which are not modelled; SOIE, NBREQ and SPOL have no effect
        // without synchronisation.
        if value & 0x0001_0000 != 0 {
            return told(format!(
                "synchronised requests are not modelled (written {value:#x})"
            ));
        }
        let slot = self
            .0
            .get_mut(offset as usize / 4)
            .ok_or(Refusal::NoRegister)?;
        *slot = value;
        Ok(())
    }

    /// Returns the channel that a request drives: controller 1 or 2, and channel from 0.
    pub fn channel_of(&self, request: u32) -> Option<(u8, usize)> {
        let place = self.0.iter().position(|c| c & 0x7F == request)?;
        Some((1 + (place / 8) as u8, place % 8))
    }
}
