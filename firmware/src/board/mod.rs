//! All code that depends on the chip. `unsafe` is used only where hardware needs it, with the reason beside it.

mod adc;
mod ccm_code;
mod clock;
mod comparator;
mod crash;
mod cycles;
mod debugger;
mod encoder;
mod fault;
mod health;
mod heat;
mod link;
mod pins;
mod probe;
mod pwm;
mod queue;
mod receiver;
mod return_barrier;
mod self_test;
mod stack;
pub(crate) mod start;
mod storage;
mod tick;
mod tick_watch;
mod watchdog;
mod wire_check;
