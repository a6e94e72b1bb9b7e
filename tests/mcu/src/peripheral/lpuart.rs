//! Low-power UART (RM0440 section 38): frames of eight bits, stop bits always as one, with or without FIFO, DMA, framing
//! and noise errors. Left out: parity, flow control, addressing, wake-up.
//!
//! A byte with an error raises its flag. With DMA it is not passed on, as DDRE = 0 says (`LPUART_CR3`); DDRE = 1 is
//! refused.

use std::collections::VecDeque;

use super::{Bank, Refusal, Register, told};
use crate::time::{Instant, NEVER};

const CR1: u32 = 0x00;
const CR3: u32 = 0x08;
const BRR: u32 = 0x0C;
const UE: u32 = 1;
const RE: u32 = 1 << 2;
const TE: u32 = 1 << 3;
const IDLEIE: u32 = 1 << 4;
const RXNEIE: u32 = 1 << 5;
const TCIE: u32 = 1 << 6;
const TXEIE: u32 = 1 << 7;
const FIFOEN: u32 = 1 << 29;
const EIE: u32 = 1;
const DMAR: u32 = 1 << 6;
const DMAT: u32 = 1 << 7;

const FE: u32 = 1 << 1;
const NE: u32 = 1 << 2;
const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "LPUART_CR1", 0, 0x2000_01FD),
    Register(0x04, "LPUART_CR2", 0, 0x0000_3000),
    Register(0x08, "LPUART_CR3", 0, 0xEE00_10C9),
    Register(0x0C, "LPUART_BRR", 0, 0x000F_FFFF),
    Register(0x18, "LPUART_RQR", 0, 0x0000_0018),
    Register(0x2C, "LPUART_PRESC", 0, 0x0000_000F),
];

/// A fault of the line in one byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineError {
    /// The stop bit is low.
    Framing,
    /// The samples of the start bit differ.
    Noise,
}

/// The port and the line behind it.
#[derive(Clone, Debug)]
pub struct Lpuart {
    bank: Bank,
    flags: u32,
    /// Period of the kernel clock.
    clock: u64,
    received: VecDeque<u8>,
    to_send: VecDeque<u8>,
    /// Byte in the transmit shift register, and the end of its transmission.
    shifting: Option<(Instant, u8)>,
    /// Bytes on the way from the host.
    incoming: VecDeque<(u8, Option<LineError>)>,
    /// Arrival of the next of them.
    arrives: Instant,
    /// Time at which the line has been idle for a frame.
    idle_at: Instant,
    /// Bytes sent and not yet collected.
    pub sent: Vec<u8>,
    /// Bytes that came while the receiver was full or off.
    pub overruns: u64,
}

impl Default for Lpuart {
    fn default() -> Self {
        Self {
            bank: Bank::new(REGISTERS),
            flags: 0,
            clock: 255,
            received: VecDeque::new(),
            to_send: VecDeque::new(),
            shifting: None,
            incoming: VecDeque::new(),
            arrives: NEVER,
            idle_at: NEVER,
            sent: Vec::new(),
            overruns: 0,
        }
    }
}

impl Lpuart {
    /// Resets the port. Sent bytes can still be collected.
    pub fn reset(&mut self) {
        let sent = core::mem::take(&mut self.sent);
        *self = Self {
            sent,
            ..Self::default()
        };
    }

    /// Sets the period of the kernel clock.
    pub fn set_clock(&mut self, period: u64) {
        self.clock = period;
    }

    /// Returns the time of a frame of ten bits: a bit lasts BRR/256 clock periods (section 38.4.7).
    fn frame(&self) -> u64 {
        const DIVIDERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];
        let divider = DIVIDERS
            .get(self.bank.get(0x2C) as usize)
            .copied()
            .unwrap_or(256);
        (10 * u64::from(self.bank.get(BRR)) * self.clock * divider / 256).max(1)
    }

    /// Returns the set bits per second; `None` if not set.
    pub fn baud(&self) -> Option<f64> {
        (self.bank.get(BRR) != 0)
            .then(|| 10.0 * crate::time::UNITS_PER_SECOND as f64 / self.frame() as f64)
    }

    fn depth(&self) -> usize {
        if self.bank.get(CR1) & FIFOEN != 0 {
            8
        } else {
            1
        }
    }

    /// Takes bytes that the host sends at `now`.
    pub fn receive(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes {
            self.receive_byte(now, byte, None);
        }
    }

    /// Takes a byte that the host sends at `now`, with a fault of the line.
    pub fn receive_byte(&mut self, now: Instant, byte: u8, error: Option<LineError>) {
        if self.incoming.is_empty() {
            self.arrives = now + self.frame();
        }
        self.incoming.push_back((byte, error));
    }

    /// Returns the time of the next event.
    pub fn due(&self) -> Instant {
        let out = self.shifting.map_or(NEVER, |(at, _)| at);
        out.min(self.arrives).min(self.idle_at)
    }

    /// Handles the events due at `now`.
    pub fn advance(&mut self, now: Instant) {
        if let Some((at, byte)) = self.shifting
            && at <= now
        {
            self.sent.push(byte);
            self.shifting = None;
            self.shift(at);
            if self.shifting.is_none() {
                self.flags |= TC;
            }
        }
        if self.arrives <= now {
            let at = self.arrives;
            self.take(at);
        }
        if self.idle_at <= now {
            self.flags |= IDLE;
            self.idle_at = NEVER;
        }
    }

    fn take(&mut self, at: Instant) {
        let incoming = self.incoming.pop_front();
        self.arrives = if self.incoming.is_empty() {
            NEVER
        } else {
            at + self.frame()
        };
        let Some((byte, error)) = incoming else {
            return;
        };
        if self.bank.get(CR1) & (UE | RE) != UE | RE {
            self.overruns += 1;
            return;
        }
        self.flags |= match error {
            Some(LineError::Framing) => FE,
            Some(LineError::Noise) => NE,
            None => 0,
        };
        if error.is_some() && self.bank.get(CR3) & DMAR != 0 {
            // Not passed on.
        } else if self.received.len() >= self.depth() {
            self.flags |= ORE;
            self.overruns += 1;
        } else {
            self.received.push_back(byte);
        }
        self.idle_at = at + self.frame();
    }

    fn shift(&mut self, now: Instant) {
        if self.shifting.is_none()
            && let Some(byte) = self.to_send.pop_front()
        {
            self.shifting = Some((now + self.frame(), byte));
            self.flags &= !TC;
        }
    }

    /// Returns true if the transmitter asks the DMA for a byte.
    pub fn wants_byte(&self) -> bool {
        self.bank.get(CR3) & DMAT != 0
            && self.bank.get(CR1) & (UE | TE) == UE | TE
            && self.to_send.len() < self.depth()
    }

    /// Returns true if the receiver has a byte for the DMA.
    pub fn has_byte(&self) -> bool {
        self.bank.get(CR3) & DMAR != 0 && !self.received.is_empty()
    }

    /// Returns true if an interrupt is requested.
    pub fn requests(&self) -> bool {
        let (control, status) = (self.bank.get(CR1), self.status());
        control & UE != 0
            && (control & IDLEIE != 0 && status & IDLE != 0
                || control & RXNEIE != 0 && status & (RXNE | ORE) != 0
                || control & TCIE != 0 && status & TC != 0
                || control & TXEIE != 0 && status & TXE != 0
                || self.bank.get(CR3) & EIE != 0 && status & (FE | NE | ORE) != 0)
    }

    fn status(&self) -> u32 {
        let control = self.bank.get(CR1);
        let mut status = self.flags;
        if !self.received.is_empty() {
            status |= RXNE;
        }
        if self.to_send.len() < self.depth() {
            status |= TXE;
        }
        // TEACK and REACK follow their enables; TXFE while the FIFO is empty.
        if control & UE != 0 {
            status |= (control & TE) << 18 | (control & RE) << 20;
        }
        if control & FIFOEN != 0 && self.to_send.is_empty() {
            status |= 1 << 23;
        }
        status
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&mut self, offset: u32) -> Result<u32, Refusal> {
        match offset {
            0x1C => Ok(self.status()),
            0x20 => Ok(0),
            0x24 => Ok(u32::from(self.received.pop_front().unwrap_or(0))),
            0x28 => Ok(0),
            _ => self.bank.read(offset),
        }
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, now: Instant, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x20 => self.flags &= !(value & (FE | NE | ORE | IDLE | TC)),
            0x28 => {
                if self.to_send.len() >= self.depth() {
                    return told("LPUART_TDR was written while full: a byte would be lost");
                }
                if self.bank.get(CR1) & (UE | TE) != UE | TE {
                    return told("LPUART_TDR was written while the transmitter is off");
                }
                self.to_send.push_back(value as u8);
                self.flags &= !TC;
                self.shift(now);
            }
            0x18 => {
                if value & 8 != 0 {
                    self.received.clear();
                }
            }
            CR1 => {
                let before = self.bank.write(offset, value)?;
                if before & TE == 0 && value & TE != 0 {
                    self.flags |= TC;
                }
                if value & UE == 0 {
                    self.flags = 0;
                }
            }
            _ => {
                self.bank.write(offset, value)?;
            }
        }
        Ok(())
    }
}
