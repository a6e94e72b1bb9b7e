//! Bytes that come over LPUART1: a ring in memory that the DMA fills without end.
//!
//! Errors of the line (framing, noise, overrun) are counted and stop nothing: the DMA goes on with the next byte. The ring
//! of `embassy-stm32` 0.6 is not used, because it disables its DMA channel at an error and enables it again with the items
//! that are left. RM0440 calls that "not supported by the DMA hardware" (section 12.4, "Channel state and disabling a
//! channel").

use core::future::poll_fn;
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use core::task::Poll;

use embassy_stm32::interrupt::typelevel::{DMA1_CHANNEL2, Handler, LPUART1 as LineInterrupt};
use embassy_stm32::mode::Async;
use embassy_stm32::pac::{DMA1, DMAMUX1, LPUART1};
use embassy_stm32::usart::UartRx;
use embassy_sync::waitqueue::AtomicWaker;

use super::health::LINE_ERRORS;

/// Bytes of the ring: 11 ms of data while the receiving task is busy.
const RING_BYTES: u32 = 1024;
/// Channel 2 of DMA1, counted from 0; DMAMUX channels of DMA1 have the same numbers.
const CHANNEL: usize = 1;

/// The DMA writes it, so all its bytes may change at any time.
static RING: [AtomicU8; RING_BYTES as usize] = [const { AtomicU8::new(0) }; RING_BYTES as usize];
/// Times that the DMA has filled the whole ring.
static LAPS: AtomicU32 = AtomicU32::new(0);
/// The task that reads.
static READER: AtomicWaker = AtomicWaker::new();

/// The incoming half of the line.
pub(crate) struct Receiver {
    /// Keeps pin and clock of the port.
    _port: UartRx<'static, Async>,
    /// Bytes read so far, modulo 2³².
    read: u32,
}

impl Receiver {
    /// Starts to receive. `request` is the number of the port's DMA request.
    pub(crate) fn start(port: UartRx<'static, Async>, request: u8) -> Self {
        DMAMUX1.ccr(CHANNEL).write(|w| w.set_dmareq_id(request));
        let channel = DMA1.ch(CHANNEL);
        channel.par().write_value(LPUART1.rdr().as_ptr() as u32);
        channel.mar().write_value(RING.as_ptr() as u32);
        channel.ndtr().write(|w| w.set_ndt(RING_BYTES as u16));
        // Peripheral to memory, single bytes.
        channel.cr().write(|w| {
            w.set_minc(true);
            w.set_circ(true);
            w.set_htie(true);
            w.set_tcie(true);
            w.set_en(true);
        });
        LPUART1.cr3().modify(|w| {
            w.set_eie(true);
            w.set_dmar(true);
        });
        LPUART1.cr1().modify(|w| w.set_idleie(true));
        Self {
            _port: port,
            read: 0,
        }
    }

    /// Waits for bytes and returns their number. They are available when the line pauses for a byte, or half of the ring is
    /// full.
    pub(crate) async fn read(&mut self, bytes: &mut [u8]) -> usize {
        poll_fn(|context| {
            READER.register(context.waker());
            match self.take(bytes) {
                0 => Poll::Pending,
                count => Poll::Ready(count),
            }
        })
        .await
    }

    fn take(&mut self, bytes: &mut [u8]) -> usize {
        let first = self.read;
        let waiting = written().wrapping_sub(first);
        let count = bytes.len().min(waiting as usize);
        for (place, byte) in (first..).zip(bytes.iter_mut().take(count)) {
            let cell = RING.get((place % RING_BYTES) as usize);
            *byte = cell.map_or(0, |cell| cell.load(Ordering::Relaxed));
        }
        let written = written();
        if written.wrapping_sub(first) > RING_BYTES {
            // The DMA has overtaken the reader. The check sum finds the frames that are cut.
            LINE_ERRORS.fetch_add(1, Ordering::Relaxed);
            self.read = written;
            return 0;
        }
        self.read = first.wrapping_add(count as u32);
        count
    }
}

/// Returns the number of bytes that the DMA has written, modulo 2³².
fn written() -> u32 {
    loop {
        let laps = LAPS.load(Ordering::Relaxed);
        let left = u32::from(DMA1.ch(CHANNEL).ndtr().read().ndt());
        // A lap that ends meanwhile is counted by an interrupt, which preempts the task.
        if !DMA1.isr().read().tcif(CHANNEL) && laps == LAPS.load(Ordering::Relaxed) {
            return laps.wrapping_mul(RING_BYTES) + (RING_BYTES - left);
        }
    }
}

/// Handler of the port's interrupt, to be bound before the library's: counts errors, and wakes the reader in a pause of the
/// line.
pub(crate) struct LineEvents;

impl Handler<LineInterrupt> for LineEvents {
    #[allow(unsafe_code)]
    unsafe fn on_interrupt() {
        let flags = LPUART1.isr().read();
        LPUART1.icr().write(|w| {
            w.set_fe(flags.fe());
            w.set_ne(flags.ne());
            w.set_ore(flags.ore());
            w.set_idle(flags.idle());
        });
        if flags.fe() || flags.ne() || flags.ore() {
            LINE_ERRORS.fetch_add(1, Ordering::Relaxed);
        }
        if flags.idle() {
            READER.wake();
        }
    }
}

/// Handler of the DMA channel's interrupt, likewise: counts laps, and wakes the reader.
pub(crate) struct RingEvents;

impl Handler<DMA1_CHANNEL2> for RingEvents {
    #[allow(unsafe_code)]
    unsafe fn on_interrupt() {
        if DMA1.isr().read().tcif(CHANNEL) {
            LAPS.fetch_add(1, Ordering::Relaxed);
        }
        DMA1.ifcr().write(|w| {
            w.set_htif(CHANNEL, true);
            w.set_tcif(CHANNEL, true);
        });
        READER.wake();
    }
}
