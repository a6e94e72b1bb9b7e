//! The board's health report.

use std::time::Duration;

use rig_shared::wire::message::{
    Crash, CrashKind, Greeting, Health, Report, SettingsOrigin, StopSwitchState, WATCHED_PARTS,
};

use super::super::error::CommandError;
use rig_link::{Port, Session};

/// Longest wait for a health report, which the board sends once a second.
const HEALTH_PATIENCE: Duration = Duration::from_secs(3);

/// Waits for a health report.
pub(super) fn fetch<P: Port>(session: &mut Session<P>) -> Result<Health, CommandError> {
    let until = session.port().now() + HEALTH_PATIENCE;
    loop {
        let left = until.saturating_sub(session.port().now());
        match session.next_report(left)? {
            Some(Report::Health(health)) => return Ok(health),
            Some(_) => {}
            None => {
                return Err(CommandError::Sentence(format!(
                    "No health report came in {} s; only a board sends one, the emulated rig has none.",
                    HEALTH_PATIENCE.as_secs()
                )));
            }
        }
    }
}

/// Describes a health report in lines.
pub(super) fn describe(greeting: &Greeting, health: &Health) -> String {
    let settings = match health.settings {
        SettingsOrigin::Defaults => "the firmware's defaults; none were ever stored",
        SettingsOrigin::Stored => "as stored",
        SettingsOrigin::OlderCopy => {
            "one of two stored copies; the other is damaged, belongs to another firmware or cannot be used"
        }
        SettingsOrigin::Damaged => "the firmware's defaults; the stored settings are damaged",
        SettingsOrigin::Unusable => {
            "the firmware's defaults; the stored settings belong to another firmware or cannot be used"
        }
    };
    let period = f64::from(health.clock_hz) / f64::from(greeting.control_rate_hz);
    let share = |cycles: u32| 100.0 * f64::from(cycles) / period;
    format!(
        "firmware        {}\n\
         running for     {:.1} s\n\
         started by      {:?}\n\
         started with    {settings}\n\
         clock           {:.3} MHz, {}{}\n\
         control tick    {:.1} % of its time on average, {:.1} % at most in the last second\n\
         stack           {} bytes never used\n\
         line            {} damaged requests, {} line errors, {} telemetry samples without room\n\
         stop switch     {}",
        greeting.firmware,
        health.tick as f64 / f64::from(greeting.control_rate_hz),
        health.reset,
        f64::from(health.clock_hz) * 1e-6,
        if health.crystal {
            "from the crystal"
        } else {
            "from the chip's internal oscillator: times may be wrong by 1 %"
        },
        if health.boost {
            ""
        } else {
            "; THE CORE VOLTAGE IS TOO LOW FOR IT: do not drive, build and flash the firmware again"
        },
        share(health.tick_cycles_mean),
        share(health.tick_cycles_max),
        health.stack_free,
        health.bad_requests,
        health.line_errors,
        health.dropped,
        match health.stop_switch {
            StopSwitchState::NotFitted => "not fitted",
            StopSwitchState::Closed => "closed",
            StopSwitchState::Open => "OPEN, or its wire is broken: the rig is not armed",
        },
    ) + &health.crash.map_or(String::new(), |crash| {
        format!("\nlast failure    {}", describe_crash(&crash))
    })
}

/// Bit of the start of the program among [`WATCHED_PARTS`], the last of them.
const START: u8 = 1 << (WATCHED_PARTS.len() - 1);

/// Describes a reset by the watchdog.
fn describe_silence(silent: u8) -> String {
    if silent & START != 0 {
        return "the watchdog reset the chip: the start of the program did not end within 0.1 s; the converter or an oscillator did not become ready".to_owned();
    }
    let parts: Vec<&str> = WATCHED_PARTS
        .iter()
        .enumerate()
        .filter(|(bit, _)| silent & 1 << bit != 0)
        .map(|(_, part)| *part)
        .collect();
    if parts.is_empty() {
        "the watchdog reset the chip: the processor stopped, or an interrupt did not end".to_owned()
    } else {
        format!(
            "the watchdog reset the chip: {} had stopped reporting",
            parts.join(" and ")
        )
    }
}

/// Describes the failure of the program before the last start.
fn describe_crash(crash: &Crash) -> String {
    let what = match crash.kind {
        CrashKind::Panic if crash.line == 0 => "a panic".to_owned(),
        CrashKind::Panic if crash.file().is_empty() => {
            format!("a panic in line {} of its source file", crash.line)
        }
        CrashKind::Panic => format!("a panic at {}:{}", crash.file(), crash.line),
        CrashKind::ProcessorFault => "a processor fault".to_owned(),
        CrashKind::ClockStopped => "the crystal stopped".to_owned(),
        CrashKind::FlashError => "a word of the flash memory has two wrong bits".to_owned(),
        CrashKind::UnexpectedException => format!("exception {} came unexpectedly", crash.line),
        CrashKind::Watchdog => describe_silence(crash.silent),
        CrashKind::TickStopped => {
            "the control tick hung or did not come for 1.5 ms; the code that ran then".to_owned()
        }
    };
    let numbers = [
        ("pc", crash.pc),
        ("lr", crash.lr),
        ("CFSR", crash.status),
        ("address", crash.address),
    ];
    let known = numbers.iter().filter(|(_, value)| *value != 0);
    known.fold(what, |text, (name, value)| {
        format!("{text}, {name} {value:#010x}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rig_shared::wire::message::FILE_BYTES;

    #[test]
    fn failures_are_told_in_words() {
        let mut file = [0; FILE_BYTES];
        file[..15].copy_from_slice(b"board/storage.r");
        let known = Crash {
            kind: CrashKind::Panic,
            pc: 0,
            lr: 0,
            status: 0,
            address: 0,
            line: 87,
            file,
            silent: 0,
        };
        assert_eq!(describe_crash(&known), "a panic at board/storage.r:87");
        let fault = Crash {
            kind: CrashKind::ProcessorFault,
            pc: 0x0800_1234,
            status: 0x8200,
            ..known
        };
        assert_eq!(
            describe_crash(&fault),
            "a processor fault, pc 0x08001234, CFSR 0x00008200"
        );
        let silent = Crash {
            kind: CrashKind::Watchdog,
            silent: 0b10_010,
            ..known
        };
        assert_eq!(
            describe_crash(&silent),
            "the watchdog reset the chip: the telemetry and the precheck of requests had stopped reporting"
        );
        let start = Crash {
            silent: START,
            ..silent
        };
        assert!(describe_crash(&start).contains("the start of the program did not end"));
        let stopped = Crash {
            silent: 0,
            ..silent
        };
        assert_eq!(
            describe_crash(&stopped),
            "the watchdog reset the chip: the processor stopped, or an interrupt did not end"
        );
    }
}
