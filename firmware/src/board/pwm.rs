//! TIM1: the two bridge inputs and the break inputs, one of the bridge's fault line and one of the comparators. TIM4, started by TIM1: the trigger of every sample.
//!
//! Centre-aligned at 20 kHz. With d > 0 input 1 is high and input 2 low for the share d of a period; both are high for
//! the rest (drive and brake, called slow decay). The motor current continues through the bridge, the ripple is
//! smallest, and the mean voltage is d times the supply. With d < 0 the inputs change places.
//!
//! The repetition counter makes every fourth overflow or underflow an update, 10 000 a second, always at the underflow.
//! There the new duty takes effect. It is the middle of a braking interval, where the current equals its mean over the
//! period. Samples must be centred on it, as the amplifier shows it, so their trigger comes [`SAMPLING_LEAD`] before it. TIM4 counts the same
//! clock with the period of the updates. It starts with TIM1's counter (trigger mode, TIM1's enable as TRGO, ITR0;
//! RM0440, TIM2/TIM3/TIM4/TIM5, "Internal trigger connection"), ahead by this lead, and never loses or gains a count.
//!
//! The enable comes first and the outputs when the bridge is awake (`wake_ticks`): until then its fault line, which acts on
//! the break, may be low.

use embassy_stm32::gpio::Output;
use embassy_stm32::pac::timer::vals::{
    Bkinp, Bkp, CcmrOutputCcs, Cms, FilterValue, Mms, Ocm, Ossi, Ossr, Sms, Ts, Urs,
};
use embassy_stm32::pac::{PWR, RCC, SYSCFG, TIM1, TIM4};
use rig_firmware::nameplate;
use rig_firmware::sample::{Command, PWM_HZ};
use rig_shared::safety::monitor::Breaks;
use rig_shared::wire::message::SelfTest;

use super::adc::SAMPLING_LEAD;
use super::clock::CORE_HZ;
use super::pins::{BridgePins, disable_bridge};
use super::{comparator, self_test};

// A whole number of pulses between two ticks: every update is then an underflow.
const _: () = assert!(PWM_HZ.is_multiple_of(nameplate::RATES.control_hz));
/// Top of the ramp: up and down form one pulse.
const TOP: u16 = (CORE_HZ / PWM_HZ / 2) as u16;
/// Compare value above the top: never low.
const HIGH: u16 = TOP + 1;

/// PWR_CR2.PLS: the chip's supply has failed below 2.8 V (RM0440, PVD level 5). Its lowest allowed supply is 1.71 V.
const SUPPLY_LEVEL: u8 = 5;

/// COMP3 and COMP4, counted from 0.
const COMPARATORS: [usize; 2] = [2, 3];

/// TIM1_SR: the flags of the break inputs, BIF and B2IF, and that of a fault inside the chip, SBIF.
const BIF: u32 = 1 << 7;
const B2IF: u32 = 1 << 8;
const SBIF: u32 = 1 << 13;

/// Filter of the bridge's fault line: 32 · 8 cycles, 1.5 µs. A fault of the bridge holds the line for a millisecond or more;
/// spikes that it couples in are shorter.
const FAULT_FILTER: FilterValue = FilterValue::FDTS_DIV32_N8;
/// Filter of the comparators: 16 · 8 cycles, 0.75 µs. At 24 V the current of a 0.5 mH motor grows by 0.04 A meanwhile; the
/// edges of the amplifier after a step of the bridge are shorter (estimate for an INA240).
const OVER_CURRENT_FILTER: FilterValue = FilterValue::FDTS_DIV16_N8;

/// The bridge.
pub(crate) struct Bridge {
    enable: Output<'static>,
    /// Ticks from the enable to valid outputs and a valid fault line.
    wake_ticks: u32,
    /// Ticks of them that are left; 0 if the bridge sleeps or is awake.
    waking: u32,
    /// True if the bridge is awake and its outputs are on. Reading the enable's pin takes longer.
    awake: bool,
}

impl Bridge {
    /// Sets TIM1 up with idle outputs and a disabled bridge; `thresholds` are those of the comparators. Also returns the
    /// part that fails the self-test.
    pub(crate) fn new(
        pins: BridgePins,
        control_hz: u32,
        wake_ticks: u32,
        thresholds: [u16; 2],
    ) -> (Self, Option<SelfTest>) {
        RCC.apb2enr().modify(|w| {
            w.set_tim1en(true);
            w.set_syscfgen(true);
        });
        // Watches the chip's supply (RM0440, PWR_CR2). Set before PVDL, which locks these bits.
        PWR.cr2().modify(|w| {
            w.set_pls(SUPPLY_LEVEL);
            w.set_pvde(true);
        });
        // A processor lock-up, an uncorrectable flash word and a supply failure act on the break input too (RM0440,
        // SYSCFG_CFGR2: CLL, ECCL, PVDL; once set they stay until the next reset).
        SYSCFG.cfgr2().modify(|w| {
            w.set_cll(true);
            w.set_eccl(true);
            w.set_pvdl(true);
        });
        let timer = TIM1;
        timer.cr1().write(|w| {
            w.set_cms(Cms::CENTER_ALIGNED1);
            w.set_arpe(true);
            // Only the counter makes updates, and so triggers.
            w.set_urs(Urs::COUNTER_ONLY);
        });
        timer.psc().write_value(0);
        timer.arr().write(|w| w.set_arr(TOP));
        timer
            .rcr()
            .write(|w| w.set_rep((2 * PWM_HZ / control_hz - 1) as u16));
        timer.ccmr_output(0).write(|w| {
            for channel in 0..2 {
                w.set_ccs(channel, CcmrOutputCcs::OUTPUT);
                w.set_ocm(channel, Ocm::PWM_MODE1);
                w.set_ocpe(channel, true);
            }
        });
        // Idle outputs are low: both inputs low leave the motor open-circuit.
        brake();
        timer.ccer().write(|w| {
            w.set_cce(0, true);
            w.set_cce(1, true);
        });
        comparator::start(thresholds);
        set_up_breaks();
        timer.bdtr().modify(|w| {
            w.set_aoe(false);
            w.set_ossi(Ossi::IDLE_LEVEL);
            w.set_ossr(Ossr::IDLE_LEVEL);
        });
        enable_breaks();
        // Loads the preloaded registers.
        timer.egr().write(|w| w.set_ug(true));
        timer.sr().write_value(Default::default());
        start_sample_trigger(control_hz);
        let enable = pins.connect();
        let failed = self_test::run(thresholds);
        timer.af1().modify(|w| w.set_bkine(true));
        clear_breaks();
        let bridge = Self {
            enable,
            wake_ticks,
            waking: 0,
            awake: false,
        };
        (bridge, failed)
    }

    /// Starts the ramp and the sampling. The converter must be set up before, ready for every trigger. The outputs stay
    /// idle.
    pub(crate) fn run(&mut self) {
        TIM1.cr1().modify(|w| w.set_cen(true));
    }

    /// Returns what has switched the outputs off since the bridge was last switched on, or acts now. Each cause has its own
    /// flag.
    ///
    /// A bridge that sleeps or wakes may hold its fault line low, which then means nothing.
    #[inline(always)]
    pub(crate) fn breaks(&self) -> Breaks {
        let flags = TIM1.sr().read().0;
        if flags & (BIF | B2IF | SBIF) == 0 {
            return Breaks::default();
        }
        let mut breaks = Breaks::default();
        for (flag, cause, counts) in [
            (BIF, Breaks::DRIVER, self.awake),
            (B2IF, Breaks::OVER_CURRENT, true),
            (SBIF, Breaks::CHIP, true),
        ] {
            if counts && flags & flag != 0 {
                breaks = breaks.union(cause);
            }
        }
        breaks
    }

    /// Applies a command to the outputs, effective from the next update. Switching off acts at once.
    #[inline(always)]
    pub(crate) fn apply(&mut self, command: Command) {
        if !command.bridge {
            switch_off();
            // The update before the next command loads this: the bridge starts with duty 0, not with its last duty.
            brake();
            (self.waking, self.awake) = (0, false);
            clear_breaks();
            return;
        }
        let high = f32::from(TOP);
        // By 32 bits: the processor converts to them in one instruction, and to 16 bits in a dozen. Never above `TOP`.
        let braking = (high * (1.0 - command.duty.0.abs())) as u32 as u16;
        let (one, two) = if command.duty.0 >= 0.0 {
            (HIGH, braking)
        } else {
            (braking, HIGH)
        };
        compare(one, two);
        if !self.awake {
            self.wake();
        }
    }

    /// Enables the bridge and, in later ticks, waits until it is awake and switches the outputs on.
    fn wake(&mut self) {
        if self.waking == 0 {
            self.enable.set_high();
            self.waking = self.wake_ticks;
            return;
        }
        self.waking -= 1;
        if self.waking == 0 {
            self.awake = true;
            // The fault line is valid from now on; what it said before does not count.
            clear_breaks();
            TIM1.bdtr().modify(|w| w.set_moe(true));
        }
    }
}

/// Sets up the sources of the two break inputs, before they are enabled: the bridge's fault line, active low, and the
/// comparators, which are high at over-current (RM0440, TIM1_AF1 and TIM1_AF2). No pin is the second input's.
///
/// A filter needs the timer's clock ("an asynchronous operation is only guaranteed when the programmable filter is
/// disabled", RM0440, TIM1, "Using the break function"). If the crystal stops, the chip's own oscillator replaces it, and the
/// clock security system switches the outputs off without any filter.
fn set_up_breaks() {
    TIM1.af1().write(|w| {
        // Only after the self-test: the bridge sleeps, and may hold its fault line low.
        w.set_bkine(false);
        w.set_bkinp(Bkinp::NOT_INVERTED);
    });
    TIM1.af2().write(|w| {
        w.set_bk2ine(false);
        for comparator in COMPARATORS {
            w.set_bk2cmpe(comparator, true);
            w.set_bk2cmpp(comparator, Bkinp::NOT_INVERTED);
        }
    });
}

/// Enables both break inputs. The second one may only be used with OSSR = OSSI = 1 (RM0440, TIM1, "Using the break
/// function"), which must be set before; its outputs are inactive then, which is as low as their idle level.
fn enable_breaks() {
    TIM1.bdtr().modify(|w| {
        w.set_bkp(0, Bkp::ACTIVE_LOW);
        w.set_bkf(0, FAULT_FILTER);
        w.set_bke(0, true);
        w.set_bkp(1, Bkp::ACTIVE_HIGH);
        w.set_bkf(1, OVER_CURRENT_FILTER);
        w.set_bke(1, true);
    });
}

/// Clears the flags of the breaks. A fault that has ended is forgotten; one that still acts sets its flag again at once.
#[inline(always)]
pub(crate) fn clear_breaks() {
    TIM1.sr().write(|w| {
        // Writing zero clears a flag, writing one keeps it (rc_w0).
        *w = embassy_stm32::pac::timer::regs::SrAdv(!0);
        w.set_bif(0, false);
        w.set_bif(1, false);
        w.set_sbif(false);
    });
}

/// Sets the compare values of the outputs from the next update on.
#[inline(always)]
fn compare(one: u16, two: u16) {
    TIM1.ccr(0).write(|w| w.set_ccr(one));
    TIM1.ccr(1).write(|w| w.set_ccr(two));
}

/// Duty 0: both inputs high.
#[inline(always)]
fn brake() {
    compare(HIGH, HIGH);
}

/// Sets TIM4 up to start with TIM1 and to trigger the converter [`SAMPLING_LEAD`] before each of TIM1's updates.
fn start_sample_trigger(control_hz: u32) {
    RCC.apb1enr1().modify(|w| w.set_tim4en(true));
    let timer = TIM4;
    timer
        .arr()
        .write(|w| w.set_arr((CORE_HZ / control_hz - 1) as u16));
    timer.cnt().write(|w| w.set_cnt(SAMPLING_LEAD));
    timer.smcr().write(|w| {
        w.set_ts(Ts::ITR0);
        w.set_sms(Sms::TRIGGER_MODE);
    });
    timer.cr2().write(|w| w.set_mms(Mms::UPDATE));
    TIM1.cr2().write(|w| w.set_mms(Mms::ENABLE));
}

/// Switches the bridge off from anywhere, with only two stores.
#[inline(always)]
pub(crate) fn switch_off() {
    TIM1.bdtr().modify(|w| w.set_moe(false));
    disable_bridge();
}
