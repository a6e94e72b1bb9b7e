//! LPUART1 to the ST-LINK's serial port: input by a DMA ring, output by DMA.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, LPUART1};
use embassy_stm32::usart::{
    Config as UartConfig, ConfigError, InterruptHandler, RxDma, Uart, UartTx,
};
use embassy_stm32::{bind_interrupts, dma, mode};
use embassy_time::{Duration, Ticker, Timer, with_timeout};
use heapless::Vec;
use heapless::spsc::{Consumer, Producer};
use rig_firmware::config::Config;
use rig_firmware::event::{BoardStart, Event};
use rig_firmware::prechecked_request::{PrecheckedRequest, precheck};
use rig_firmware::report_sender::ReportSender;
use rig_firmware::urgent_request::UrgentRequest;
use rig_shared::safety::Mode;
use rig_shared::wire::message::{Request, RequestBody};
use rig_shared::wire::{DecodeError, MAX_FRAME, MessageDecoder};
use static_cell::ConstStaticCell;

use super::clock::LINK_PRIORITY;
use super::health::BAD_REQUESTS;
use super::pins::LinkPins;
use super::probe;
use super::queue::{Numbered, URGENT_WAITS};
use super::receiver::{LineEvents, Receiver, RingEvents};
use super::return_barrier::ReturnBarrier;
use super::watchdog::{Task, check_in};

/// Bit rate: batches and estimates need 0.4 Mbit/s (`docs/formats.md`).
const BAUD: u32 = 921_600;
/// Output buffer, bytes: two of the longest frames.
const SEND_BYTES: usize = 2 * MAX_FRAME;
/// Longest wait for bytes, so that the receiving task reports to the watchdog while no data arrive.
const READ_TIMEOUT: Duration = Duration::from_millis(20);

static SEND_BUFFER: ConstStaticCell<Vec<u8, SEND_BYTES>> = ConstStaticCell::new(Vec::new());

bind_interrupts!(struct Interrupts {
    LPUART1 => LineEvents, InterruptHandler<LPUART1>, ReturnBarrier;
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>, ReturnBarrier;
    DMA1_CHANNEL2 => RingEvents, dma::InterruptHandler<DMA1_CH2>, ReturnBarrier;
});

/// Outgoing half.
pub(crate) type Sender = UartTx<'static, mode::Async>;

/// Opens the line.
pub(crate) fn open(pins: LinkPins) -> Result<(Sender, Receiver), ConfigError> {
    let mut config = UartConfig::default();
    config.baudrate = BAUD;
    let request = RxDma::<LPUART1>::request(&*pins.rx_dma);
    let uart = Uart::new(
        pins.uart,
        pins.rx,
        pins.tx,
        pins.tx_dma,
        pins.rx_dma,
        Interrupts,
        config,
    )?;
    interrupt::LPUART1.set_priority(LINK_PRIORITY);
    let (sender, port) = uart.split();
    Ok((sender, Receiver::start(port, request)))
}

/// Takes events from the tick a thousand times a second, encodes them as frames and sends these.
#[embassy_executor::task]
pub(crate) async fn telemetry(
    config: &'static Config,
    start: BoardStart,
    mut line: Sender,
    mut probe: probe::Outgoing,
    mut events: Consumer<'static, Event>,
) -> ! {
    let mut report_sender = ReportSender::for_board(start);
    let bytes = SEND_BUFFER.take();
    let mut ticker = Ticker::every(Duration::from_millis(1));
    let mut mode = Mode::default();
    loop {
        ticker.next().await;
        check_in(Task::Telemetry);
        bytes.clear();
        while bytes.len() + MAX_FRAME <= SEND_BYTES
            && let Some(event) = events.dequeue()
        {
            log(&event, &mut mode);
            report_sender.send_event(config, &event, &mut |frame: &[u8]| {
                bytes.extend_from_slice(frame).is_ok()
            });
        }
        if bytes.is_empty() {
            continue;
        }
        // All or nothing: the buffer is longer than a frame, so frames stay whole.
        let _taken = probe.write(bytes);
        if line.write(bytes).await.is_err() {
            defmt::warn!("the serial line did not take {} bytes", bytes.len());
        }
    }
}

/// Logs faults and changes of the mode; `mode` is the last one. It runs in a task, because a log takes time.
fn log(event: &Event, mode: &mut Mode) {
    match event {
        Event::Fault(record) => defmt::error!(
            "fault {=str} at tick {=u64}: {=f32}",
            record.fault.name(),
            record.tick,
            record.value
        ),
        Event::Sample { sample, .. } if sample.mode != *mode => {
            defmt::info!("mode {=str}, was {=str}", sample.mode.name(), mode.name());
            *mode = sample.mode;
        }
        _ => {}
    }
}

/// True while a request is between the two queues of [`precheck_requests`].
static PRECHECKING: AtomicBool = AtomicBool::new(false);

/// Passes decoded requests on: urgent ones to the tick, the others to the task that prechecks them.
struct Distributor {
    urgent: Producer<'static, UrgentRequest>,
    requests: Producer<'static, Numbered<Request>>,
    urgent_count: u32,
    /// Number of the last request that was passed to the precheck.
    last_id: Option<u16>,
}

impl Distributor {
    /// Returns true for a repetition of a request that still waits for its precheck or is being prechecked. The host
    /// repeats a request after 0.1 s, and the longest precheck takes 0.12 s: a second precheck would give the same answer,
    /// later. The requests are prechecked in their order, so the last one waits as long as any does. A `Hello` may come
    /// from another host with a number that was used before.
    fn is_repeated(&self, request: &Request) -> bool {
        let waits = !self.requests.is_empty() || PRECHECKING.load(Ordering::Relaxed);
        waits && self.last_id == Some(request.id) && !matches!(request.body, RequestBody::Hello)
    }

    /// Passes one on. A request that finds no room is counted like a damaged one: the host gets no answer and repeats it.
    fn pass(&mut self, decoded: Option<Result<Request, DecodeError>>) {
        let accepted = match decoded {
            None => return,
            Some(Err(_)) => false,
            Some(Ok(request)) => match UrgentRequest::from_request(&request) {
                Some(urgent) => {
                    let accepted = self.urgent.enqueue(urgent).is_ok();
                    URGENT_WAITS.store(true, Ordering::Relaxed);
                    self.urgent_count = self.urgent_count.wrapping_add(u32::from(accepted));
                    accepted
                }
                None if self.is_repeated(&request) => return,
                None => {
                    let id = request.id;
                    let numbered = Numbered {
                        request,
                        urgent_before: self.urgent_count,
                    };
                    let accepted = self.requests.enqueue(numbered).is_ok();
                    if accepted {
                        self.last_id = Some(id);
                    }
                    accepted
                }
            },
        };
        if !accepted {
            BAD_REQUESTS.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Reads bytes from the host and decodes requests. It has a priority of its own above all other tasks, so that `Disarm` and
/// `Stop` wait for none of them.
#[embassy_executor::task]
pub(crate) async fn receive(
    mut line: Receiver,
    mut probe: probe::Incoming,
    urgent: Producer<'static, UrgentRequest>,
    requests: Producer<'static, Numbered<Request>>,
) -> ! {
    let mut line_decoder = MessageDecoder::<Request>::default();
    let mut probe_decoder = MessageDecoder::<Request>::default();
    let mut distributor = Distributor {
        urgent,
        requests,
        urgent_count: 0,
        last_id: None,
    };
    let mut bytes = [0; 64];
    loop {
        check_in(Task::Receive);
        let count = with_timeout(READ_TIMEOUT, line.read(&mut bytes))
            .await
            .unwrap_or(0);
        for &byte in bytes.iter().take(count) {
            distributor.pass(line_decoder.push(byte));
        }
        let count = probe.read(&mut bytes);
        for &byte in bytes.iter().take(count) {
            distributor.pass(probe_decoder.push(byte));
        }
    }
}

/// Prechecks requests, which may take a fifth of a second each, and passes them to the tick.
#[embassy_executor::task]
pub(crate) async fn precheck_requests(
    config: &'static Config,
    mut requests: Consumer<'static, Numbered<Request>>,
    mut to_tick: Producer<'static, Numbered<PrecheckedRequest>>,
) -> ! {
    loop {
        check_in(Task::Precheck);
        Timer::after_millis(1).await;
        while to_tick.ready() {
            // Before the queue is emptied, as the receiving task may interrupt this one anywhere.
            PRECHECKING.store(true, Ordering::Relaxed);
            let Some(numbered) = requests.dequeue() else {
                PRECHECKING.store(false, Ordering::Relaxed);
                break;
            };
            let prechecked = Numbered {
                request: precheck(config, numbered.request),
                urgent_before: numbered.urgent_before,
            };
            // Room was found before, and nobody else fills this queue.
            let _taken = to_tick.enqueue(prechecked).is_ok();
            PRECHECKING.store(false, Ordering::Relaxed);
            check_in(Task::Precheck);
            // Other tasks of this priority run between two requests.
            Timer::after_ticks(0).await;
        }
    }
}
