//! Counts an encoder's edges and index, and captures their times (RM0440 sections 30.4.20 and 30.4.7).

use super::timer::{
    CC1OF, CCER, CCMR1, CCMR2, CCR1, CEN, CR1, CR2, ECR, IDXF, MMS, MMS_ENCODER_CLOCK, SMCR, SR,
    TERRF, TS, TS_ITR1, Tim,
};
use crate::time::Instant;

impl Tim {
    pub(super) fn is_encoder(&self) -> bool {
        let smcr = self.bank.get(SMCR);
        matches!(smcr & 7, 1..=3) && smcr & 1 << 16 == 0
    }

    /// Counts the encoder's edges.
    pub fn quadrature(&mut self, counts: i64) {
        if self.is_encoder() && self.bank.get(CR1) & CEN != 0 {
            let span = i64::from(self.active.reload) + 1;
            self.held = (i64::from(self.held) + counts).rem_euclid(span) as u32;
        }
    }

    /// Returns true if the clock of the encoder's counter is sent as TRGO.
    pub fn sends_encoder_clock(&self) -> bool {
        let on = self.is_encoder() && self.bank.get(CR1) & CEN != 0;
        on && self.bank.get(CR2) & MMS == MMS_ENCODER_CLOCK
    }

    /// Handles a change of both channels at once (TIM2_SR.TERRF).
    pub fn transition_error(&mut self) {
        if self.is_encoder() {
            self.flag(TERRF);
        }
    }

    /// Handles the encoder's index, passed `since` counts ago: it set the counter to 0 counting up, to its top counting
    /// down.
    pub fn index(&mut self, upwards: bool, since: u32) {
        let control = self.bank.get(ECR);
        // It is active while A and B are low; gated to another state (IPOS) it never comes.
        let gated = control >> 6 & 3 != 0;
        if !self.is_encoder() || control & 1 == 0 || gated || control & 0x20 != 0 && self.indexed {
            return;
        }
        self.indexed = true;
        self.held = if upwards {
            since
        } else {
            self.active.reload - since
        };
        self.flag(IDXF);
    }

    /// Handles an edge of internal trigger 1 at `at`: channels on TRC capture the count (RM0440 section 30.4.7, "Input
    /// capture mode").
    pub fn internal_trigger_1(&mut self, at: Instant) {
        if self.bank.get(SMCR) & TS != TS_ITR1 {
            return;
        }
        for k in 0..4 {
            if self.selection(k) == Some(3) {
                let count = self.count_before(at);
                self.bank.put(CCR1 + 4 * k as u32, count);
                let captured = 2 << k;
                let missed = self.bank.get(SR) & captured != 0;
                self.flag(captured | (u32::from(missed) * (CC1OF << k)));
            }
        }
    }

    /// Returns the count at an instant that may be before the present run.
    pub(super) fn count_before(&self, at: Instant) -> u32 {
        if self.counts_by_clock() && at < self.base && !self.is_centred() {
            let ticks = (self.base - at).div_ceil(self.tick());
            return (u64::from(self.active.reload) + 1).saturating_sub(ticks) as u32;
        }
        self.count(at)
    }

    /// Returns the selection of channel `k` (CCxS), if it is enabled.
    pub(super) fn selection(&self, k: usize) -> Option<u32> {
        let modes = self.bank.get(if k < 2 { CCMR1 } else { CCMR2 }) >> (8 * (k % 2));
        (self.bank.get(CCER) >> (4 * k) & 1 != 0).then_some(modes & 3)
    }

    /// Returns a requested capture feature that is not modelled.
    pub(super) fn unmodelled_capture(&self) -> Option<String> {
        (0..4).find_map(|k| {
            let name = format!("TIM{} channel {}", self.number, k + 1);
            match self.selection(k)? {
                0 => None,
                3 if self.number == 5 && self.bank.get(SMCR) & TS == TS_ITR1 => {
                    let modes = self.bank.get(if k < 2 { CCMR1 } else { CCMR2 }) >> (8 * (k % 2));
                    (modes & 0xFC != 0)
                        .then(|| format!("{name} captures with filter or prescaler, which is not modelled"))
                }
                3 => Some(format!(
                    "{name} captures on an internal trigger other than TIM2's at TIM5, which is not modelled"
                )),
                _ => Some(format!("{name} captures a pin, which is not modelled")),
            }
        })
    }
}
