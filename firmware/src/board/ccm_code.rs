//! Copies the control tick's code into the CCM SRAM, before anything else happens.

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
