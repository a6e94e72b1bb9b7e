//! The image: computes the dynamics at all states, and notes results and cycles in RAM.
//!
//! It sets the clock to 170 MHz, counts cycles by the processor's own counter, and then waits for ever. `RESULTS` has
//! its layout in `measurement.rs`. A debugger reads it on a board; the tests read it in the emulated chip.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod clock;
#[cfg(target_os = "none")]
mod measurement;

/// Refuses to run on the desktop: the image measures the chip.
#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!(
        "rig-dynamics: this is an image for the STM32G474 and does nothing on a desktop; build it with `firmware/build dynamics`."
    );
    std::process::ExitCode::FAILURE
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let cycles = clock::start();
    measurement::run(&cycles);
    loop {
        cortex_m::asm::wfi();
    }
}

/// Stops: what was noted so far stays in RAM, and the mark of completion is missing.
#[cfg(target_os = "none")]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
