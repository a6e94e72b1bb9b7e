//! The rig on its board: a NUCLEO-G474RE. See `docs/firmware.md` for wiring and first start.
//!
//! ```text
//!  TIM1 ──update──► TIM4 ──► ADC1 ──end of sequence──► interrupt: step, duty ──► TIM1 (board::tick)
//!                     TIM2 (encoder) ────────────┘  ▲ requests      │ events
//!                                                   │               ▼
//!  LPUART1 ──DMA──► command task: decode, precheck ─┘    telemetry task: frames ──DMA──► LPUART1
//! ```
//!
//! The interrupt and the tasks share only queues without locks and a few atomic words.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
use board::start;

/// Refuses to run on the desktop: there is no board.
#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!(
        "rig-firmware: this is the image for the STM32G474 and does nothing on a desktop; build it with firmware/build, flash it with `rig flash`."
    );
    std::process::ExitCode::FAILURE
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    start::run()
}
