//! DMA controller (RM0440 section 12.6): memory to peripheral and back, one item a request.
//!
//! A channel that is disabled before its end and enabled again needs a new count. To resume it with what is left "is not
//! supported by the DMA hardware" (RM0440 section 12.4, "Channel state and disabling a channel"), so it is refused here.
//! A circular channel begins again with the count that was last written.
//!
//! Left out: memory to memory, bus time, priorities between channels (requests are served as they come).

use super::{Refusal, told};
use crate::map::RAM;

const EN: u32 = 1;
const TCIE: u32 = 1 << 1;
const HTIE: u32 = 1 << 2;
const TEIE: u32 = 1 << 3;
const DIR: u32 = 1 << 4;
const CIRC: u32 = 1 << 5;
const PINC: u32 = 1 << 6;
const MINC: u32 = 1 << 7;
const MEM2MEM: u32 = 1 << 14;

#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    control: u32,
    count: u32,
    peripheral: u32,
    memory: u32,
    /// Items of a whole transfer, as last written, and number of finished items.
    length: u32,
    done: u32,
    /// True if the channel was disabled with items left, and its count was not written since.
    suspended: bool,
    flags: u32,
}

/// One item to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Address in memory.
    pub memory: u32,
    /// Address of the peripheral's register.
    pub peripheral: u32,
    /// Bytes in memory.
    pub size: u32,
    /// True from memory to the peripheral.
    pub to_peripheral: bool,
}

/// A controller of eight channels.
#[derive(Clone, Debug, Default)]
pub struct Dma([Channel; 8]);

impl Dma {
    /// Returns the direction (true towards the peripheral) if a channel waits for requests.
    pub fn armed(&self, channel: usize) -> Option<bool> {
        let channel = self.0.get(channel)?;
        (channel.control & EN != 0 && channel.count > 0).then_some(channel.control & DIR != 0)
    }

    /// Serves one request of a channel and returns the item to move.
    ///
    /// # Errors
    /// Addresses outside RAM.
    pub fn serve(&mut self, number: usize) -> Result<Option<Item>, Refusal> {
        let Some(channel) = self.0.get_mut(number) else {
            return Ok(None);
        };
        if channel.control & EN == 0 || channel.count == 0 {
            return Ok(None);
        }
        let size = 1 << (channel.control >> 10 & 3);
        let peripheral_size = 1 << (channel.control >> 8 & 3);
        let step = |on: u32, size: u32| if channel.control & on != 0 { size } else { 0 };
        let item = Item {
            memory: channel.memory + channel.done * step(MINC, size),
            peripheral: channel.peripheral + channel.done * step(PINC, peripheral_size),
            size,
            to_peripheral: channel.control & DIR != 0,
        };
        if !RAM.contains(&item.memory) || !RAM.contains(&(item.memory + size - 1)) {
            return told(format!(
                "DMA channel {} moves to or from {:#010x}, which is not RAM",
                number + 1,
                item.memory
            ));
        }
        channel.done += 1;
        channel.count -= 1;
        if channel.done == channel.length / 2 {
            channel.flags |= 4;
        }
        if channel.count == 0 {
            channel.flags |= 2;
            if channel.control & CIRC != 0 {
                channel.count = channel.length;
                channel.done = 0;
            }
        }
        Ok(Some(item))
    }

    /// Returns true if a channel requests an interrupt.
    pub fn requests(&self, number: usize) -> bool {
        self.0
            .get(number)
            .is_some_and(|c| c.flags & c.control & (TCIE | HTIE | TEIE) != 0)
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        if offset == 0 {
            return Ok(self.0.iter().enumerate().fold(0, |all, (k, c)| {
                let any = u32::from(c.flags != 0);
                all | (c.flags | any) << (4 * k)
            }));
        }
        if offset == 4 {
            return Ok(0);
        }
        let (number, register) = place(offset)?;
        let channel = self.0.get(number).ok_or(Refusal::NoRegister)?;
        Ok(match register {
            0 => channel.control,
            4 => channel.count,
            8 => channel.peripheral,
            _ => channel.memory,
        })
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        if offset == 4 {
            for (k, channel) in self.0.iter_mut().enumerate() {
                let clear = value >> (4 * k) & 0xF;
                // The global flag clears all.
                channel.flags &= if clear & 1 != 0 { 0 } else { !clear };
            }
            return Ok(());
        }
        let (number, register) = place(offset)?;
        let channel = self.0.get_mut(number).ok_or(Refusal::NoRegister)?;
        let running = channel.control & EN != 0;
        match register {
            0 => {
                if value & MEM2MEM != 0 || value >> 15 != 0 {
                    return told(format!(
                        "DMA_CCR{} has bits without a model: {value:#x}",
                        number + 1
                    ));
                }
                if running && value & EN == 0 {
                    channel.suspended = channel.count > 0;
                }
                if value & EN != 0 && !running {
                    if channel.suspended {
                        return told(format!(
                            "DMA channel {} was disabled with {} items left and is enabled again without a new count, which the hardware does not support",
                            number + 1,
                            channel.count
                        ));
                    }
                    channel.done = 0;
                }
                channel.control = value;
            }
            _ if running => {
                return told(format!(
                    "a register of DMA channel {} was written while it runs",
                    number + 1
                ));
            }
            4 => {
                channel.count = value & 0xFFFF;
                channel.length = channel.count;
                channel.suspended = false;
            }
            8 => channel.peripheral = value,
            _ => channel.memory = value,
        }
        Ok(())
    }
}

/// Returns the channel from 0, and the register within it.
fn place(offset: u32) -> Result<(usize, u32), Refusal> {
    let from = offset.checked_sub(8).ok_or(Refusal::NoRegister)?;
    let (number, register) = (from as usize / 20, from % 20);
    if number < 8 && register < 16 && register.is_multiple_of(4) {
        Ok((number, register))
    } else {
        Err(Refusal::NoRegister)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    #[test]
    fn a_circular_transfer_flags_its_half_and_its_end() {
        let mut dma = Dma::default();
        dma.write(0x0C, 4).unwrap();
        dma.write(0x10, 0x4000_8024).unwrap();
        dma.write(0x14, 0x2000_0100).unwrap();
        dma.write(0x08, EN | TCIE | HTIE | CIRC | MINC).unwrap();
        let mut seen = Vec::new();
        for _ in 0..5 {
            let item = dma.serve(0).unwrap().unwrap();
            seen.push((
                item.memory - 0x2000_0100,
                dma.read(0).unwrap(),
                dma.read(0x0C).unwrap(),
            ));
            dma.write(4, 0xF).unwrap();
        }
        assert_eq!(
            seen,
            [(0, 0, 3), (1, 5, 2), (2, 0, 1), (3, 3, 4), (0, 0, 3)]
        );
        assert!(dma.write(0x0C, 1).is_err(), "count while running");
    }
    #[test]
    fn a_channel_that_was_stopped_needs_a_new_count() {
        let on = EN | CIRC | MINC;
        let mut dma = Dma::default();
        dma.write(0x0C, 4).unwrap();
        dma.write(0x14, 0x2000_0100).unwrap();
        dma.write(0x08, on).unwrap();
        dma.serve(0).unwrap();
        dma.write(0x08, on & !EN).unwrap();
        assert!(dma.write(0x08, on).is_err(), "resumed with three left");
        dma.write(0x0C, 2).unwrap();
        dma.write(0x08, on).unwrap();
        let places: Vec<u32> = (0..3)
            .map(|_| dma.serve(0).unwrap().unwrap().memory - 0x2000_0100)
            .collect();
        assert_eq!(places, [0, 1, 0]);
    }
}
