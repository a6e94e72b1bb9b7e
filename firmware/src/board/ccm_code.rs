//! Copies the control tick's code into the CCM SRAM, before anything else happens.
//!
//! Before that, each cut of the memories is read once. The first access to one after a reset may be lost if it is a store
//! (errata ES0430, 2.2.7): the first word of the code, or of the stack. The cuts begin at 0x20000000, 0x20008000, 0x20010000
//! (SRAM1), 0x20014000 (SRAM2) and 0x10000000. Reading keeps what a crash has left behind. The option that checks the parity of
//! these memories must be off, as the factory leaves it (SRAM_PE = 1): what was never written has no parity.

use core::arch::global_asm;

// In assembly because it runs before any variable has its value. A copying loop in Rust may become a call of a function
// that is itself among the copied code. Section and lengths (whole words) come from build.rs.
#[allow(unsafe_code)]
mod pre_init {
    use super::global_asm;

    global_asm!(
        ".section .text.__pre_init, \"ax\"",
        ".global __pre_init",
        ".type __pre_init, %function",
        ".thumb_func",
        "__pre_init:",
        "ldr r0, =0x20000000",
        "ldr r1, [r0]",
        "ldr r0, =0x20008000",
        "ldr r1, [r0]",
        "ldr r0, =0x20010000",
        "ldr r1, [r0]",
        "ldr r0, =0x20014000",
        "ldr r1, [r0]",
        "ldr r0, =0x10000000",
        "ldr r1, [r0]",
        "dsb",
        "ldr r0, =__tick_start",
        "ldr r1, =__tick_end",
        "ldr r2, =__tick_load",
        "2: cmp r0, r1",
        "bhs 3f",
        "ldr r3, [r2], #4",
        "str r3, [r0], #4",
        "b 2b",
        "3: dsb",
        "isb",
        "bx lr",
    );
}
