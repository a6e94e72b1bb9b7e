//! The control tick: the converter's interrupt.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::interrupt;
use rig_firmware::capture::Capture;
use rig_firmware::clerk::{Clerk, Notes as _};
use rig_firmware::config::{Config, Settings};
use rig_firmware::examined::Examined;
use rig_firmware::note::Note;
use rig_firmware::sample::Sample;
use rig_firmware::state::State;
use rig_firmware::step::step;
use rig_shared::wire::message::Refusal;

use super::adc::Converter;
use super::clock::CORE_HZ;
use super::cycles;
use super::encoder::EncoderTimer;
use super::health::Checkup;
use super::heat;
use super::pwm::{Break, Bridge};
use super::queue::{Inlet, Outlet};
use super::stack;
use super::watchdog::{Part, report};
use super::wires::Wires;

/// Notes that the queue to the telemetry task holds.
pub(crate) const NOTES: usize = 64;
/// Requests that the queue from the command task holds.
pub(crate) const REQUESTS: usize = 4;

/// Everything that the interrupt owns.
pub(crate) struct Tick {
    pub(crate) config: &'static Config,
    pub(crate) state: &'static mut State,
    pub(crate) capture: &'static mut Capture,
    pub(crate) clerk: Clerk,
    pub(crate) requests: Outlet<Examined>,
    pub(crate) notes: Inlet<Note>,
    pub(crate) bridge: Bridge,
    pub(crate) converter: Converter,
    pub(crate) encoder: EncoderTimer,
    pub(crate) wires: Wires,
    pub(crate) period_cycles: u32,
    pub(crate) entered: u32,
    pub(crate) late: bool,
    pub(crate) checkup: Checkup,
    pub(crate) to_store: Inlet<Settings>,
}

impl Tick {
    /// Cycles between two ticks at `control_hz`.
    pub(crate) const fn period(control_hz: u32) -> u32 {
        CORE_HZ / control_hz
    }

    /// One tick.
    #[inline(always)]
    fn run(&mut self) {
        let entered = cycles::now();
        let codes = self.converter.take();
        let motion = self.encoder.read();
        // A tick and a half since the last one: an interrupt was late or missing.
        let apart = entered.wrapping_sub(self.entered);
        let overrun = self.late || apart > self.period_cycles + self.period_cycles / 2;
        self.entered = entered;
        let broken = self.bridge.broken();
        let sample = Sample {
            encoder: motion.count,
            edge_age: Some(motion.edge_age),
            current: codes.current,
            supply: codes.supply,
            temperature: codes.temperature,
            driver_fault: broken == Some(Break::Driver),
            overrun,
            comparator: broken == Some(Break::Comparator),
            encoder_wrong: motion.wrong,
            // Not in the tick of the estimator's update, an even one with a high load.
            encoder_open: self.wires.look(self.state.tick & 1 != 0),
            stack_left: stack::near_end(),
        };
        let output = step(self.config, self.state, sample);
        self.bridge.apply(output.command);
        heat::keep(self.state.tick, self.state.heat());
        self.clerk
            .report(self.state, self.capture, &output, &mut self.notes);
        self.serve();
        report(Part::Tick);
        let cycles = cycles::now().wrapping_sub(entered);
        let (tick, dropped) = (self.state.tick, self.clerk.dropped());
        if let Some(health) = self.checkup.count(cycles, tick, dropped) {
            self.notes.put(Note::Health(health));
        }
        self.late = self.converter.is_waiting();
    }
}

impl Tick {
    /// Serves at most one request, in a tick that has time.
    #[inline(always)]
    fn serve(&mut self) {
        let outcome = match STORED.load(Ordering::Acquire) {
            NOT_YET => None,
            DONE => Some(Ok(())),
            _ => Some(Err(Refusal::StorageFailed)),
        };
        if let Some(outcome) = outcome {
            STORED.store(NOT_YET, Ordering::Relaxed);
            self.clerk.stored(self.state, outcome, &mut self.notes);
        }
        if !self.state.has_time() || !self.notes.roomy() {
            return;
        }
        let Some(examined) = self.requests.oldest() else {
            return;
        };
        let to_store = self.clerk.serve(
            self.config,
            self.state,
            self.capture,
            examined,
            &mut self.notes,
        );
        self.requests.release();
        if let Some(settings) = to_store
            && !self.to_store.put(settings)
        {
            let outcome = Err(Refusal::StorageFailed);
            self.clerk.stored(self.state, outcome, &mut self.notes);
        }
    }
}

/// Result of storing, from the storage task to the tick.
static STORED: AtomicU8 = AtomicU8::new(NOT_YET);
const NOT_YET: u8 = 0;
const DONE: u8 = 1;
const FAILED: u8 = 2;

/// Reports the result of storing.
pub(crate) fn stored(done: bool) {
    STORED.store(if done { DONE } else { FAILED }, Ordering::Release);
}

/// The one [`Tick`], passed to the interrupt before it is enabled.
struct Owned(UnsafeCell<MaybeUninit<Tick>>);

// Only the interrupt uses it once it is enabled, and it does not interrupt itself.
#[allow(unsafe_code)]
unsafe impl Sync for Owned {}

static TICK: Owned = Owned(UnsafeCell::new(MaybeUninit::uninit()));

/// Passes everything to the interrupt and starts the sampling.
pub(crate) fn start(mut tick: Tick) {
    tick.entered = cycles::now();
    // The interrupt is still disabled, so nothing else uses it.
    #[allow(unsafe_code)]
    let tick = unsafe { (*TICK.0.get()).write(tick) };
    tick.converter.listen();
    tick.bridge.run();
}

#[interrupt]
fn ADC1_2() {
    // `start` wrote it before it enabled this interrupt.
    #[allow(unsafe_code)]
    let tick = unsafe { (*TICK.0.get()).assume_init_mut() };
    tick.run();
}
