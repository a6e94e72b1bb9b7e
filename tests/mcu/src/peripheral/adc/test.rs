#![allow(clippy::unwrap_used)]

use super::converter::*;
use crate::peripheral::Refusal;
use crate::time::Instant;

fn code(channel: u32, _: Instant) -> Option<u16> {
    (channel < 10).then_some(100 * channel as u16)
}

fn write(adc: &mut Adc, now: Instant, offset: u32, value: u32) -> Result<(), Refusal> {
    adc.write(now, offset, value, 24, Ok(24), &code)
}

/// HCLK/4 = 42.5 MHz; three channels of 12.5 + 12.5 cycles.
#[test]
fn a_triggered_sequence_takes_its_time_and_flags_its_end() {
    let mut adc = Adc::default();
    write(&mut adc, 0, COMMON, 3 << 16).unwrap();
    write(&mut adc, 0, CR, 0).unwrap();
    write(&mut adc, 0, CR, ADVREGEN).unwrap();
    assert!(write(&mut adc, REGULATOR - 1, CR, ADVREGEN | ADEN).is_err());
    let t = REGULATOR;
    write(&mut adc, t, CR, ADVREGEN | ADCAL).unwrap();
    assert!(adc.read(t, CR).unwrap() & ADCAL != 0);
    assert!(adc.read(t + 116 * 96, CR).unwrap() & ADCAL == 0);
    write(&mut adc, t, DIFSEL, 0).unwrap();
    write(&mut adc, t, CR, ADVREGEN | ADEN).unwrap();
    assert!(write(&mut adc, t, DIFSEL, 0).is_err());
    write(&mut adc, t, SMPR1, 2 << 18 | 2 << 21 | 2 << 24).unwrap();
    write(
        &mut adc,
        t,
        JSQR,
        2 | 8 << 2 | 1 << 7 | 6 << 9 | 7 << 15 | 8 << 21,
    )
    .unwrap();
    write(&mut adc, t, CR, ADVREGEN | ADEN | JADSTART).unwrap();
    assert!(adc.listens_to(8) && !adc.listens_to(0));
    adc.start_injected(t, 24, Ok(24), &code).unwrap();
    let one = 25 * 96;
    let t = t + LATENCY / 2 * 96;
    assert_eq!(adc.due(), t + one);
    adc.advance(t + 3 * one - 1);
    assert_eq!(adc.read(t, ISR).unwrap() & (JEOC | JEOS), JEOC);
    adc.start_injected(t + 2 * one, 24, Ok(24), &code).unwrap();
    assert_eq!(adc.missed, 1);
    adc.advance(t + 3 * one);
    assert_eq!(adc.read(t, ISR).unwrap() & JEOS, JEOS);
    let results: Vec<u32> = (0..3).map(|k| adc.read(t, JDR1 + 4 * k).unwrap()).collect();
    assert_eq!(results, [600, 700, 800]);
    assert!(adc.listens_to(8), "armed for the next trigger");
}

/// 24.5 cycles of sampling, four samples: held at 24.5, 61.5, 98.5, 135.5 cycles after the latency of 2.
#[test]
fn oversampling_holds_each_sample_at_the_end_of_its_sampling_time() {
    let mut adc = Adc::default();
    write(&mut adc, 0, COMMON, 3 << 16).unwrap();
    for (offset, value) in [(SMPR1, 3 << 18), (CFGR2, 2 | 1 << 2), (JSQR, 6 << 9)] {
        write(&mut adc, 0, offset, value).unwrap();
    }
    // Sum of the half cycles at which the samples are held.
    let held = |_, at: Instant| Some((at / 48) as u16);
    adc.start_injected(0, 24, Ok(24), &held).unwrap();
    adc.advance(10_000_000);
    assert_eq!(adc.read(0, JDR1).unwrap(), 53 + 127 + 201 + 275);
}

#[test]
fn a_clock_too_fast_is_refused() {
    let mut adc = Adc::default();
    write(&mut adc, 0, COMMON, 2 << 16).unwrap();
    assert!(adc.clock(24, Ok(24)).is_err(), "85 MHz");
}
