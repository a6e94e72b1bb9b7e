//! The current offset, measured at the start. Separate from the control tick, whose code fills the chip's fast memory.

use rig_shared::safety::{Fault, Mode};
use rig_shared::units::AdcCode;

use crate::config::Config;
use crate::state::State;

/// Measures the current offset while the bridge is off. Returns a fault if it is implausible.
#[inline(never)]
pub(crate) fn calibrate(
    config: &Config,
    state: &mut State,
    code: AdcCode,
    temperature: f32,
) -> Option<(Fault, f32)> {
    let code = u64::from(code.0);
    state.calibration.ticks += 1;
    state.calibration.sum += code;
    state.calibration.squares += code * code;
    if state.calibration.ticks < config.calibration_ticks {
        return None;
    }
    let zero_code = state.calibration.sum as f32 / state.calibration.ticks as f32;
    let offset = (zero_code - config.scaling.current_zero) * config.scaling.current_per_code;
    if offset.abs() > config.largest_offset {
        return Some((Fault::CurrentOffset, offset));
    }
    state.calibration.zero_code = zero_code;
    state.calibration.std = state.calibration.std_of_mean() * config.scaling.current_per_code.abs();
    state.start_temperature = temperature;
    state.mode = Mode::Disarmed;
    None
}
