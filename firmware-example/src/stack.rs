//! How deep the stack has been: start-up paints it, and what has been used lost its paint.
#![allow(unsafe_code)] // Reads memory that no variable owns.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    /// Lowest word the stack may use.
    static _stack_end: u32;
    /// One past the highest.
    static _stack_start: u32;
}

/// Bytes of stack used at most since the start, and bytes there are. All of them may mean more than all of them.
pub fn deepest() -> (usize, usize) {
    let (end, start) = (&raw const _stack_end, &raw const _stack_start);
    let mut at = end;
    // SAFETY: the linker script places both symbols at the bounds of the stack's RAM, at multiples of four; nothing
    // else reads or writes below the stack pointer, and the loop ends at the latest in the frames above it.
    while at < start && unsafe { at.read_volatile() } == STACK_PAINT_VALUE {
        at = at.wrapping_add(1);
    }
    (start.addr() - at.addr(), start.addr() - end.addr())
}

/// Bytes left unpainted below whoever paints: his own frame and the painter's.
const MARGIN: usize = 128;

/// Paints what of the stack lies free; where the paint ends.
#[inline(never)]
pub fn paint() -> usize {
    let here = 0u32;
    let (mut at, top) = (&raw const _stack_end as *mut u32, (&raw const here).addr() - MARGIN);
    while at.addr() < top {
        // SAFETY: between the stack's end and the frames in use lies nothing; volatile, since no variable is there.
        unsafe { at.write_volatile(STACK_PAINT_VALUE) };
        at = at.wrapping_add(1);
    }
    top
}

/// Bytes below the end of the paint that have lost it.
pub fn used_below(top: usize) -> usize {
    let mut at = &raw const _stack_end;
    // SAFETY: as above.
    while at.addr() < top && unsafe { at.read_volatile() } == STACK_PAINT_VALUE {
        at = at.wrapping_add(1);
    }
    top - at.addr()
}
