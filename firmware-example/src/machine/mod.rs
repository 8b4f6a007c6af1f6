//! The emulated boards: their UART, their flash and their clock, behind the traits of [`crate::board`].
//!
//! | machine | core | UART | record's flash |
//! | --- | --- | --- | --- |
//! | `mps2-an386` | Cortex-M4F | CMSDK (Arm DDI 0479) | a window of the board's PSRAM under NOR rules, that a file backs |
//! | `mps2-an505` | Cortex-M33, secure side | CMSDK | as above |
//! | `microbit` | Cortex-M0, soft float | nRF51 | the nRF51's own, by its NVMC; lost when QEMU ends |
//!
//! What ends a run ([`reset`]) is kept over the reset. The watchdogs of the `mps2` are run by the tests; of that of the
//! `microbit` QEMU has no model.
#![allow(unsafe_code)] // Registers, and memory that no variable owns.

use core::mem::MaybeUninit;

use imucal_core::link::{Guard, Key, LastReset};

#[cfg(microbit)]
mod microbit;
#[cfg(mps2)]
mod mps2;
#[cfg(nordic)]
mod nordic;
#[cfg(all(mps2, nordic))]
pub mod nrf52840;
pub mod reset;
mod stopwatch;
#[cfg(mps2)]
mod ticks;

#[cfg(microbit)]
use microbit::boot_number;
#[cfg(microbit)]
pub use microbit::{Flash, Uart, Uptime, idle};
#[cfg(all(mps2, not(nordic)))]
pub use mps2::Watchdog;
#[cfg(mps2)]
use mps2::boot_number;
#[cfg(mps2)]
pub use mps2::{Flash, MemoryTape, Uart, Uptime, flash, idle};
#[cfg(nordic)]
pub use nordic::Watchdog;
pub use stopwatch::Stopwatch;
#[cfg(mps2)]
pub use ticks::Ticks;

use crate::{
    board::{Board, NoSensor},
    coprocessor::{Alone, Coprocessor},
    fitting::Memory,
};

/// The fits that there is memory for.
#[cfg(mps2)]
pub type MachineMemory = Memory<256, 64, 48, 2048, 40>;
/// The fits that there is memory for.
#[cfg(microbit)]
pub type MachineMemory = Memory<40, 10, 8, 48, 3>;

/// Sessions and watches that there is memory for.
#[cfg(mps2)]
pub type MachineAlone = Alone<1>;
/// Sessions and watches that there is memory for.
#[cfg(microbit)]
pub type MachineAlone = Alone<0>;

/// A run that does not feed the watchdog for so long is ended, ms: many times the longest slice of work, and the longest
/// that [`idle`] lasts.
pub const PATIENCE: u32 = 10_000;

/// The co-processor on this machine.
#[cfg(mps2)]
type Whole = Coprocessor<'static, Uart, Flash, Uptime, NoSensor, 256, 64, 48, 2048, 40, 1>;
/// See above.
#[cfg(microbit)]
type Whole = Coprocessor<'static, Uart, Flash, Uptime, NoSensor, 40, 10, 8, 48, 3, 0>;

/// Runs the co-processor on this machine, for ever.
pub fn run(name: &str, serial: &str, key: Option<&'static Key>) -> ! {
    let last = reset::last();
    let coprocessor = start(name, serial, Guard::new(key, boot_number()), last);
    let watchdog = Watchdog::start(PATIENCE);
    loop {
        watchdog.feed();
        if !coprocessor.poll() {
            idle();
        }
    }
}

/// Puts the co-processor where it stays: on the stack it would lie below all that follows.
#[inline(never)]
fn start(name: &str, serial: &str, guard: Guard<'static>, last_reset: LastReset) -> &'static mut Whole {
    static mut MEMORY: MachineMemory = MachineMemory::new();
    static mut ALONE: MachineAlone = MachineAlone::new();
    static mut WHOLE: MaybeUninit<Whole> = MaybeUninit::uninit();
    // SAFETY: `run` is called once, and nothing else knows the variables.
    let (memory, alone, whole) =
        unsafe { (&mut *(&raw mut MEMORY), &mut *(&raw mut ALONE), &mut *(&raw mut WHOLE)) };
    let unit = imucal_core::record::SensorIdentity {
        name: name.parse().unwrap_or_default(),
        serial: serial.parse().unwrap_or_default(),
    };
    let board = Board {
        link: Uart::start(),
        flash: Flash::new(),
        clock: Uptime::start(),
        sensors: NoSensor,
        stack: || u32::try_from(crate::stack::deepest().0).ok(),
        last_reset,
    };
    whole.write(Coprocessor::with_sessions(board, unit, guard, memory, alone))
}

/// A register.
#[derive(Clone, Copy, Debug)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: addresses are those of the machine's registers, which are read without harm.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: as above; what is written there is no memory of Rust's.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// Reads memory word by word, the flash's or what stands for it.
fn read_words(from: u32, bytes: &mut [u8]) {
    for (word, at) in bytes.chunks_exact_mut(4).zip((from as usize..).step_by(4)) {
        word.copy_from_slice(&Register(at).read().to_le_bytes());
    }
}

/// Interrupts stay masked: one that is pending ends the wait, and is cleared by hand. 32 lines a register.
const ENABLE: usize = 0xE000_E100;
const CLEAR_PENDING: usize = 0xE000_E280;

fn set_line(registers: usize, line: u32) {
    Register(registers + (line / 32 * 4) as usize).write(1 << (line % 32));
}

/// Lets an interrupt line end [`wait`].
fn wake_by(line: u32) {
    cortex_m::interrupt::disable();
    set_line(ENABLE, line);
}

/// A line is pending no more.
fn clear(line: u32) {
    set_line(CLEAR_PENDING, line);
}

/// Waits for an interrupt; not at all, if one is pending. Those of that line are then pending no more.
fn wait(line: u32) {
    cortex_m::asm::wfi();
    clear(line);
}
