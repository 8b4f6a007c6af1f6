//! What ends a run: faults, an overflow of the stack, the watchdog. Each leaves a note for the next run, and resets.
//!
//! The stack lies at the very start of RAM (`build.rs`), so that it overflows into nothing, which is a fault, and not
//! into variables. A fault of which the stack pointer has left the stack is an overflow: the address is then unknown,
//! since the core could not store it.

use core::{arch::global_asm, mem::MaybeUninit};

use cortex_m::peripheral::SCB;
use imucal_core::link::{LastReset, ResetCause};

use crate::restart::{self, Words};

/// Start-up clears `.bss` and fills `.data`, and leaves this alone.
#[unsafe(link_section = ".uninit.KEPT")]
static mut KEPT: MaybeUninit<Words> = MaybeUninit::uninit();

unsafe extern "C" {
    /// Lowest word the stack may use.
    static _stack_end: u32;
}

fn with_kept<R>(change: impl FnOnce(&mut Words) -> R) -> R {
    // SAFETY: the handlers never return to whoever they interrupt here. Any bits are words; volatile, since what is
    // there was written by an earlier run.
    let mut words = unsafe { (&raw const KEPT).cast::<Words>().read_volatile() };
    let result = change(&mut words);
    unsafe { (&raw mut KEPT).cast::<Words>().write_volatile(words) };
    result
}

/// How the run before ended; to be asked once, at the start, for it also guards the stack.
pub fn last() -> LastReset {
    #[cfg(all(an386, not(nordic)))]
    super::mps2::close_below_stack();
    let last = with_kept(restart::begin);
    #[cfg(nordic)]
    let last = super::nordic::by_watchdog(last);
    last
}

// Both handlers: the address where it happened, if the frame that has it lies in the stack; then the whole stack again,
// since there may be nothing left of it.
global_asm!(
    ".section .text.imucal_handlers, \"ax\", %progbits",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "    movs r2, #0",
    "    b 1f",
    ".global NonMaskableInt",
    ".type NonMaskableInt, %function",
    ".thumb_func",
    "NonMaskableInt:",
    "    movs r2, #1",
    "1:  mrs r0, MSP",
    "    movs r1, #0",
    "    ldr r3, =_stack_end",
    "    cmp r0, r3",
    "    blo 2f",
    "    ldr r1, [r0, #24]",
    "2:  ldr r3, =_stack_start",
    "    msr MSP, r3",
    "    bl {ended}",
    "    .pool",
    ended = sym ended,
);

/// `stack`: the stack pointer; `address`: the program counter, 0 where it is not known.
extern "C" fn ended(stack: usize, address: u32, by_watchdog: u32) -> ! {
    let cause = match by_watchdog {
        0 if stack < (&raw const _stack_end).addr() => ResetCause::StackOverflow,
        0 => ResetCause::Fault,
        _ => ResetCause::Watchdog,
    };
    with_kept(|words| restart::end(words, cause, address));
    SCB::sys_reset()
}
