//! Power on and reset of the chip.

use super::state::{Chip, TIMERS};
use crate::accelerator::Accelerator;
use crate::board::{Board, Bridge};
use crate::cpu::Work;
use crate::nvic::Nvic;
use crate::peripheral::adc::Adc;
use crate::peripheral::comp::Comp;
use crate::peripheral::dac::Dac;
use crate::peripheral::dmamux::Dmamux;
use crate::peripheral::exti::Exti;
use crate::peripheral::flash::Flash;
use crate::peripheral::gpio::Gpio;
use crate::peripheral::iwdg::Iwdg;
use crate::peripheral::lpuart::Lpuart;
use crate::peripheral::pwr::Pwr;
use crate::peripheral::rcc::{Cause, Rcc};
use crate::peripheral::syscfg::Syscfg;
use crate::peripheral::tim::Tim;
use crate::peripheral::wwdg::Wwdg;
use crate::time::UNITS_PER_SECOND;

impl Chip {
    /// Returns a chip at power on.
    pub fn new(board: Board) -> Self {
        let mut chip = Self {
            work: Work::default(),
            period: UNITS_PER_SECOND / 16_000_000,
            deadline: 0,
            limit: 0,
            held_until: 0,
            halt: None,
            expected: 0,
            block: 0,
            accelerator: Accelerator::default(),
            waits: false,
            event: false,
            failure: None,
            nvic: Nvic::default(),
            rcc: Rcc::new(Cause::PowerOn),
            pwr: Pwr::default(),
            flash: Flash::default(),
            syscfg: Syscfg::default(),
            comp: Comp::default(),
            comparators: Default::default(),
            dac: Dac::default(),
            exti: Exti::default(),
            gpio: core::array::from_fn(|n| Gpio::new(n as u8)),
            tim: TIMERS.map(|n| Tim::new(n, 255)),
            adc: Adc::default(),
            dma: Default::default(),
            dmamux: Dmamux::default(),
            lpuart: Lpuart::default(),
            iwdg: Iwdg::default(),
            wwdg: Wwdg::default(),
            cycle_counter: (false, 0),
            debug_unit: [0; 4],
            bitten: None,
            stores: Vec::new(),
            changed: Vec::new(),
            triggers: 0,
            board,
            readings: None,
        };
        chip.set_pins();
        chip
    }

    /// Resets the chip; board and time continue.
    pub fn reset(&mut self, cause: Cause) {
        self.board.set_bridge(self.work.now, Bridge::default());
        self.period = UNITS_PER_SECOND / 16_000_000;
        self.waits = false;
        self.event = false;
        self.bitten = None;
        self.nvic = Nvic::default();
        self.rcc = Rcc::new(cause);
        self.rcc.set_crystal(!self.board.faults.crystal_dead);
        self.pwr = Pwr::default();
        self.flash = Flash::default();
        self.syscfg = Syscfg::default();
        self.comp = Comp::default();
        self.comparators = Default::default();
        self.dac = Dac::default();
        self.exti = Exti::default();
        self.gpio = core::array::from_fn(|n| Gpio::new(n as u8));
        self.tim = TIMERS.map(|n| Tim::new(n, 255));
        self.adc = Adc::default();
        self.dma = Default::default();
        self.dmamux = Dmamux::default();
        self.lpuart.reset();
        self.iwdg = Iwdg::default();
        self.wwdg = Wwdg::default();
        self.cycle_counter = (false, 0);
        self.halt = None;
        self.stores.clear();
        self.deadline = 0;
        self.set_pins();
    }
}
