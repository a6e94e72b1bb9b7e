//! The control tick: the converter's interrupt.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::interrupt;
use rig_firmware::capture::Capture;
use rig_firmware::config::{Config, Settings};
use rig_firmware::event::Event;
use rig_firmware::nameplate::RATES;
use rig_firmware::prechecked_request::PrecheckedRequest;
use rig_firmware::sample::Sample;
use rig_firmware::state::State;
use rig_firmware::step::step;
use rig_firmware::tick_session::{EventSink as _, TickSession};
use rig_firmware::urgent_request::{UrgentRequest, is_revoked};
use rig_shared::wire::message::Refusal;

use super::adc::Converter;
use super::clock::CORE_HZ;
use super::cycles;
use super::encoder::EncoderTimer;
use super::health::HealthMonitor;
use super::heat;
use super::pins::StopInput;
use super::pwm::Bridge;
use super::queue::{Numbered, QueueReceiver, QueueSender, URGENT_WAITS};
use super::return_barrier::finish_stores;
use super::stack;
use super::tick_watch;
use super::watchdog::{Task, check_in};
use super::wire_check::WireCheck;

/// Notes that the queue to the telemetry task holds.
pub(crate) const EVENTS: usize = 64;
/// Prechecked requests that the queue to the tick holds: the tick takes one within two periods.
pub(crate) const REQUESTS: usize = 1;
/// Received requests that the queue to the prechecking task holds. A host that waits for each answer needs one.
pub(crate) const RECEIVED: usize = 5;
/// Urgent requests that the queue to the tick holds: the line brings one in a tick.
pub(crate) const URGENT: usize = 4;

/// Ticks between two refreshes of the watch over the tick, 0.4 ms at 10 kHz: it waits for 1.5 ms.
const REFRESH_TICKS: u32 = 4;
/// Ticks between two stores of the heat, 1.6 ms: a small part of the winding's thermal time of seconds.
const HEAT_TICKS: u32 = 16;
const _: () = assert!(HEAT_TICKS.is_multiple_of(REFRESH_TICKS));

/// Everything that the interrupt owns.
pub(crate) struct Tick {
    pub(crate) config: &'static Config,
    pub(crate) state: &'static mut State,
    pub(crate) capture: &'static mut Capture,
    pub(crate) tick_session: TickSession,
    pub(crate) requests: QueueReceiver<Numbered<PrecheckedRequest>>,
    pub(crate) urgent: QueueReceiver<UrgentRequest>,
    /// Urgent requests so far.
    pub(crate) urgent_count: u32,
    pub(crate) events: QueueSender<Event>,
    pub(crate) bridge: Bridge,
    pub(crate) converter: Converter,
    pub(crate) encoder: EncoderTimer,
    pub(crate) wire_check: WireCheck,
    pub(crate) stop_input: StopInput,
    pub(crate) entered: u32,
    pub(crate) next_waiting: bool,
    pub(crate) health_monitor: HealthMonitor,
    pub(crate) to_store: QueueSender<Settings>,
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
        let codes = self.converter.read();
        let motion = self.encoder.read();
        let late_ticks = self.late_ticks(entered.wrapping_sub(self.entered));
        self.entered = entered;
        if URGENT_WAITS.load(Ordering::Relaxed) {
            self.serve_urgent();
        }
        let sample = Sample {
            encoder: motion.count,
            edge_age: Some(motion.edge_age),
            current: codes.current,
            supply: codes.supply,
            temperature: codes.temperature,
            breaks: self.bridge.breaks(),
            late_ticks,
            encoder_wrong: motion.error,
            // Not in the tick of the estimator's update, an even one with a high load.
            encoder_open: self.wire_check.check(self.state.tick & 1 != 0),
            stop_switch_open: self.stop_input.is_open(),
            stack_left: stack::near_end(self.state.tick),
        };
        let output = step(self.config, self.state, sample);
        self.bridge.apply(output.command);
        self.tick_session
            .report(self.state, self.capture, &output, &mut self.events);
        self.serve();
        check_in(Task::Tick);
        let cycles = cycles::now().wrapping_sub(entered);
        let counts = (self.state.tick, self.tick_session.dropped_windows());
        let measured = (self.health_monitor).record_tick(cycles, counts, &self.stop_input);
        if let Some(measured) = measured {
            self.events.push(Event::Health(measured));
        }
        // One delay counts once: a tick that began late, and so was counted, often ends late too.
        self.next_waiting = late_ticks == 0 && self.converter.is_waiting();
        let tick = self.state.tick as u32;
        if tick.is_multiple_of(REFRESH_TICKS) {
            tick_watch::refresh();
            if tick.is_multiple_of(HEAT_TICKS) {
                heat::store(tick / HEAT_TICKS, self.state.heat());
            }
        }
    }
}

impl Tick {
    /// Returns the ticks that were missed or late, `elapsed` cycles after the last one began.
    #[inline(always)]
    fn late_ticks(&self, elapsed: u32) -> u8 {
        const PERIOD: u32 = Tick::period(RATES.control_hz);
        const LATE: u32 = PERIOD + PERIOD / 2;
        const MISSED: u32 = 2 * PERIOD + PERIOD / 2;
        // A tick and a half since the last one: an interrupt was late or missing.
        if !self.next_waiting && elapsed <= LATE {
            return 0;
        }
        1 + u8::from(elapsed > MISSED)
    }

    /// Serves urgent requests before the control step, so that they act in this tick. Not inlined because it is rare.
    #[inline(never)]
    fn serve_urgent(&mut self) {
        // Before the queue is read: a request that comes meanwhile sets it again.
        URGENT_WAITS.store(false, Ordering::Relaxed);
        while let Some(request) = self.urgent.oldest() {
            self.tick_session
                .serve_urgent(self.state, *request, &mut self.events);
            self.urgent.release();
            self.urgent_count = self.urgent_count.wrapping_add(1);
        }
    }

    /// Serves at most one request, in a tick that has time.
    #[inline(always)]
    fn serve(&mut self) {
        let result = match STORE_RESULT.load(Ordering::Acquire) {
            STORE_PENDING => None,
            STORED_OK => Some(Ok(())),
            _ => Some(Err(Refusal::StorageFailed)),
        };
        if let Some(result) = result {
            STORE_RESULT.store(STORE_PENDING, Ordering::Relaxed);
            self.tick_session
                .finish_store(self.state, result, &mut self.events);
        }
        if !self.state.accepts_request() || !self.events.has_room() {
            return;
        }
        let Some(Numbered {
            request: prechecked,
            urgent_before,
        }) = self.requests.oldest()
        else {
            return;
        };
        if *urgent_before != self.urgent_count && is_revoked(&prechecked.request.body) {
            let id = prechecked.request.id;
            self.tick_session
                .refuse(id, Refusal::Overtaken, &mut self.events);
            self.requests.release();
            return;
        }
        let to_store = self.tick_session.serve(
            self.config,
            self.state,
            self.capture,
            prechecked,
            &mut self.events,
        );
        self.requests.release();
        if let Some(settings) = to_store
            && !self.to_store.push(settings)
        {
            let result = Err(Refusal::StorageFailed);
            self.tick_session
                .finish_store(self.state, result, &mut self.events);
        }
    }
}

/// Result of storing, from the storage task to the tick.
static STORE_RESULT: AtomicU8 = AtomicU8::new(STORE_PENDING);
const STORE_PENDING: u8 = 0;
const STORED_OK: u8 = 1;
const STORE_FAILED: u8 = 2;

/// Reports the result of storing.
pub(crate) fn report_store(success: bool) {
    STORE_RESULT.store(
        if success { STORED_OK } else { STORE_FAILED },
        Ordering::Release,
    );
}

/// The one [`Tick`], passed to the interrupt before it is enabled.
struct TickCell(UnsafeCell<MaybeUninit<Tick>>);

// Only the interrupt uses it once it is enabled, and it does not interrupt itself.
#[allow(unsafe_code)]
unsafe impl Sync for TickCell {}

static TICK: TickCell = TickCell(UnsafeCell::new(MaybeUninit::uninit()));

/// Passes everything to the interrupt and starts the sampling.
pub(crate) fn start(mut tick: Tick) {
    tick.entered = cycles::now();
    // The interrupt is still disabled, so nothing else uses it.
    #[allow(unsafe_code)]
    let tick = unsafe { (*TICK.0.get()).write(tick) };
    tick.converter.enable_interrupt();
    tick.bridge.run();
    tick_watch::start();
}

#[interrupt]
fn ADC1_2() {
    // `start` wrote it before it enabled this interrupt.
    #[allow(unsafe_code)]
    let tick = unsafe { (*TICK.0.get()).assume_init_mut() };
    tick.run();
    finish_stores();
}
