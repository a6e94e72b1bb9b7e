//! Exceptions by their priorities, and SysTick.

use super::controller::*;
use crate::cpu::Masks;

fn with(priorities: &[(u32, u8)]) -> Nvic {
    let mut nvic = Nvic::default();
    for (irq, priority) in priorities {
        nvic.write(0, 24, 0x400 + irq, 1, u32::from(*priority))
            .unwrap();
        nvic.write(0, 24, 0x100 + 4 * (irq / 32), 4, 1 << (irq % 32))
            .unwrap();
    }
    nvic
}

fn line(irq: u32) -> [u32; WORDS] {
    let mut lines = [0; WORDS];
    lines[irq as usize / 32] = 1 << (irq % 32);
    lines
}

#[test]
fn the_more_urgent_preempts_and_an_equal_one_waits() {
    let mut nvic = with(&[(18, 0x20), (24, 0x10), (91, 0x20)]);
    nvic.set_lines(line(18));
    assert_eq!(nvic.next(Masks::default()), Some(34));
    nvic.enter(34);
    nvic.pend(16 + 91);
    assert_eq!(nvic.next(Masks::default()), None, "same priority");
    nvic.pend(16 + 24);
    assert_eq!(nvic.next(Masks::default()), Some(40));
    nvic.enter(40);
    assert_eq!(nvic.depth(), 2);
    assert_eq!(nvic.leave(), Some(40));
    nvic.set_lines([0; WORDS]);
    assert_eq!(nvic.leave(), Some(34));
    assert_eq!(nvic.next(Masks::default()), Some(107), "tail-chained");
}

#[test]
fn masks() {
    let mut nvic = with(&[(18, 0x20)]);
    nvic.pend(34);
    let primask = Masks {
        primask: true,
        ..Masks::default()
    };
    assert_eq!(nvic.next(primask), None);
    assert!(nvic.wakes(primask));
    let basepri = |value| Masks {
        basepri: value,
        ..Masks::default()
    };
    assert_eq!(nvic.next(basepri(0x20)), None);
    assert_eq!(nvic.next(basepri(0x30)), Some(34));
    nvic.pend(HARD_FAULT);
    assert_eq!(nvic.next(primask), Some(HARD_FAULT));
}

#[test]
fn a_line_that_stays_up_comes_again_and_one_that_fell_does_not() {
    let mut nvic = with(&[(18, 0x20)]);
    nvic.set_lines(line(18));
    nvic.enter(34);
    assert_eq!(nvic.next(Masks::default()), None);
    nvic.leave();
    assert_eq!(nvic.next(Masks::default()), Some(34));
    nvic.enter(34);
    nvic.set_lines([0; WORDS]);
    nvic.leave();
    assert_eq!(nvic.next(Masks::default()), None);
}

#[test]
fn systick_pends_at_its_period() {
    let mut nvic = Nvic::default();
    nvic.write(0, 24, 0x014, 4, 169_999).unwrap();
    nvic.write(0, 24, 0x010, 4, 7).unwrap();
    assert_eq!(nvic.due(), 170_000 * 24);
    nvic.advance(170_000 * 24);
    assert_eq!(nvic.next(Masks::default()), Some(SYS_TICK));
    assert_eq!(nvic.read(170_000 * 24, 0x010).unwrap() >> 16, 1);
}
