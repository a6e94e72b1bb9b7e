//! Start of the board, from reset to the first tick.

use embassy_executor::{Executor, InterruptExecutor};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_time::{Duration, Ticker};
use heapless::spsc;
use rig_firmware::capture::Capture;
use rig_firmware::config::{Config, Settings};
use rig_firmware::event::{BoardStart, Event};
use rig_firmware::nameplate;
use rig_firmware::prechecked_request::PrecheckedRequest;
use rig_firmware::state::State;
use rig_firmware::tick_session::TickSession;
use rig_firmware::urgent_request::UrgentRequest;
use rig_shared::estimation::OneLinkEstimator;
use rig_shared::wire::message::Request;
use static_cell::{ConstStaticCell, StaticCell};

use super::adc::Converter;
use super::clock::{self, CORE_HZ, LINK_PRIORITY, RECEIVE_PRIORITY, TASK_PRIORITY};
use super::encoder::EncoderTimer;
use super::health::HealthMonitor;
use super::pins::Pins;
use super::pwm::Bridge;
use super::queue::{Numbered, QueueReceiver, QueueSender};
use super::return_barrier::finish_stores;
use super::storage::Storage;
use super::tick::{EVENTS, RECEIVED, REQUESTS, Tick, URGENT};
use super::watchdog::{Task, Watchdog, check_in};
use super::wire_check::WireCheck;
use super::{crash, cycles, debugger, health, heat, link, probe, stack, tick, watchdog};
use embassy_stm32::gpio::Output;

static CONFIG: StaticCell<Config> = StaticCell::new();
static STATE: StaticCell<State> = StaticCell::new();
static CAPTURE: ConstStaticCell<Capture> = ConstStaticCell::new(Capture::new());
// A ring of n places holds n − 1.
static EVENT_QUEUE: StaticCell<spsc::Queue<Event, { EVENTS + 1 }>> = StaticCell::new();
static REQUEST_QUEUE: StaticCell<spsc::Queue<Numbered<PrecheckedRequest>, { REQUESTS + 1 }>> =
    StaticCell::new();
static RECEIVED_QUEUE: StaticCell<spsc::Queue<Numbered<Request>, { RECEIVED + 1 }>> =
    StaticCell::new();
static URGENT_QUEUE: StaticCell<spsc::Queue<UrgentRequest, { URGENT + 1 }>> = StaticCell::new();
/// The task that must not wait for any other.
static RECEIVE_EXECUTOR: InterruptExecutor = InterruptExecutor::new();
static STORE_QUEUE: StaticCell<spsc::Queue<Settings, 2>> = StaticCell::new();
/// Tasks that must not wait while a trajectory is prechecked, which takes about 0.1 s.
static HIGH_PRIORITY_EXECUTOR: InterruptExecutor = InterruptExecutor::new();
static THREAD_EXECUTOR: StaticCell<Executor> = StaticCell::new();

/// Initialises the board and runs it.
pub(crate) fn run() -> ! {
    // Before anything that could wait without end.
    watchdog::start();
    let (probe_out, probe_in) = probe::open();
    let reset = health::reset_cause();
    let crash = crash::take(reset);
    watchdog::record_start();
    let mut core = cortex_m::Peripherals::take().unwrap_or_else(|| unreachable!());
    let (peripherals, crystal) = clock::start();
    cycles::start(&mut core.DCB, &mut core.DWT);
    debugger::freeze_outputs_at_halts();
    interrupt::TIM3.set_priority(LINK_PRIORITY);
    let pins = Pins::new(peripherals);

    let (mut config, default_settings) = nameplate::one_link();
    let (converter, supply_ratio) = Converter::new(pins.analog);
    if !config.scaling.correct(supply_ratio) {
        defmt::warn!(
            "a supply of {=f32} times 3.3 V cannot be: codes are taken as at 3.3 V",
            supply_ratio
        );
    }
    let config: &'static Config = CONFIG.init(config);
    let (storage, selection) = Storage::open(config);
    let settings = selection.settings.unwrap_or(default_settings);
    let thresholds = config.current_thresholds();
    let (bridge, failed_test) = Bridge::new(
        pins.bridge,
        config.rates.control_hz,
        config.wake_ticks,
        thresholds,
    );
    let state = state(config, settings);
    state.note_self_test(failed_test);
    state.restore_heat(heat::load().unwrap_or_default());
    let (event_in, event_out) = EVENT_QUEUE.init(spsc::Queue::new()).split();
    let (to_store, settings_from_tick) = STORE_QUEUE.init(spsc::Queue::new()).split();
    let (request_in, request_out) = REQUEST_QUEUE.init(spsc::Queue::new()).split();
    let (received_in, received_out) = RECEIVED_QUEUE.init(spsc::Queue::new()).split();
    let (urgent_in, urgent_out) = URGENT_QUEUE.init(spsc::Queue::new()).split();
    let encoder = EncoderTimer::new(pins.encoder, &config.encoder);
    let Ok((sender, receiver)) = link::open(pins.link) else {
        unreachable!()
    };
    tick::start(Tick {
        config,
        state,
        capture: CAPTURE.take(),
        tick_session: TickSession::new(),
        requests: QueueReceiver(request_out),
        urgent: QueueReceiver(urgent_out),
        urgent_count: 0,
        events: QueueSender(event_in),
        bridge,
        converter,
        encoder,
        wire_check: WireCheck::new(),
        stop_input: pins.stop.connect(),
        entered: 0,
        next_waiting: false,
        health_monitor: HealthMonitor::new(config.rates.control_hz),
        to_store: QueueSender(to_store),
    });
    if let Some(crash) = crash {
        defmt::error!(
            "restarted after a failure: pc {=u32:#x}, lr {=u32:#x}, CFSR {=u32:#x}, address {=u32:#x}, {=str}:{=u32}, silent {=u8:#x}",
            crash.pc,
            crash.lr,
            crash.status,
            crash.address,
            crash.file(),
            crash.line,
            crash.silent
        );
    }
    defmt::info!("rig firmware {=str} is up", rig_firmware::VERSION);
    let start = BoardStart {
        reset,
        settings: selection.origin,
        clock_hz: CORE_HZ,
        crystal,
        crash,
    };
    // Each task is spawned once. Its memory is reserved at compile time.
    let tasks = (
        link::telemetry(config, start, sender, probe_out, event_out),
        indicator(Watchdog::new(), pins.led),
        link::receive(receiver, probe_in, urgent_in, received_in),
        link::precheck_requests(config, received_out, request_in),
        storage_task(storage, settings_from_tick),
    );
    let (Ok(telemetry), Ok(indicator), Ok(receive), Ok(precheck_requests), Ok(storage_task)) =
        tasks
    else {
        unreachable!()
    };
    interrupt::FMAC.set_priority(RECEIVE_PRIORITY);
    RECEIVE_EXECUTOR.start(interrupt::FMAC).spawn(receive);
    interrupt::CORDIC.set_priority(TASK_PRIORITY);
    let high_priority = HIGH_PRIORITY_EXECUTOR.start(interrupt::CORDIC);
    high_priority.spawn(telemetry);
    high_priority.spawn(indicator);
    THREAD_EXECUTOR.init(Executor::new()).run(|spawner| {
        spawner.spawn(precheck_requests);
        spawner.spawn(storage_task);
    })
}

/// Runs the high-priority tasks: the interrupt of an unused peripheral, raised by software.
#[interrupt]
fn CORDIC() {
    // The executor was started with this interrupt.
    #[allow(unsafe_code)]
    unsafe {
        HIGH_PRIORITY_EXECUTOR.on_interrupt();
    }
    finish_stores();
}

/// Runs the receiving task, likewise.
#[interrupt]
fn FMAC() {
    // The executor was started with this interrupt.
    #[allow(unsafe_code)]
    unsafe {
        RECEIVE_EXECUTOR.on_interrupt();
    }
    finish_stores();
}

/// Returns the state at power on, built in place: it is half as large as the stack.
#[inline(never)]
fn state(config: &Config, settings: Settings) -> &'static mut State {
    match OneLinkEstimator::new(&settings.estimator, config.rates.estimator_hz()) {
        Ok(estimator) => STATE.init_with(|| State::with_estimator(config, settings, estimator)),
        // Tests on the desktop check the firmware's own settings; stored settings were checked when they were read.
        Err(_) => unreachable!(),
    }
}

/// Feeds the watchdog and blinks. A light that stands still means that the program has stopped.
#[embassy_executor::task]
async fn indicator(mut watchdog: Watchdog, mut led: Output<'static>) -> ! {
    let mut ticker = Ticker::every(Duration::from_millis(10));
    let mut count = 0_u32;
    loop {
        ticker.next().await;
        watchdog.feed();
        debugger::tell_halts();
        count = count.wrapping_add(1);
        if count.is_multiple_of(50) {
            led.toggle();
        }
        // Also in the first pass: the first health report comes after one second.
        if count % 100 == 1 {
            stack::measure_free();
        }
    }
}

/// Writes settings to flash when the tick passes some on.
#[embassy_executor::task]
async fn storage_task(
    mut storage: Storage,
    mut settings_from_tick: spsc::Consumer<'static, Settings>,
) -> ! {
    let mut ticker = Ticker::every(Duration::from_millis(5));
    loop {
        ticker.next().await;
        check_in(Task::Storage);
        if let Some(settings) = settings_from_tick.dequeue() {
            let success = storage.store(&settings).await.is_ok();
            if !success {
                defmt::warn!("the flash did not take the settings");
            }
            tick::report_store(success);
        }
    }
}
