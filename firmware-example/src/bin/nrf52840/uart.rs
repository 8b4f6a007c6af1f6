//! The UART of the nRF52840, without a wait and without an interrupt (Product Specification 1.11, UARTE, TIMER, PPI).
//!
//! What comes goes by DMA into a ring, round and round: the shortcut from a full buffer to its start has it begin again
//! by itself. A timer counts the bytes, by an event of the UART. Both go on while the core stands still.

use core::sync::atomic::{Ordering, compiler_fence};

use firmware_example::{board::ByteLink, ring::Ring};
use nrf52840_hal::{
    pac::{PPI, TIMER1, UARTE0},
    uarte::{Baudrate, Parity, Pins, Uarte},
};

/// Bytes of the ring: what comes in two erases of a page, and more than two of the longest frame.
const RING: usize = 2048;

/// Memory of the DMA.
pub struct UartMemory {
    ring: [u8; RING],
    out: u8,
}

impl UartMemory {
    pub const fn new() -> Self {
        Self { ring: [0; RING], out: 0 }
    }
}

/// The UART, its counter and its memory.
pub struct Serial {
    uart: UARTE0,
    counter: TIMER1,
    /// Written by the DMA: read only as volatile.
    memory: *mut UartMemory,
    read: Ring<RING>,
    sending: bool,
}

impl Serial {
    /// Switches it on, at 115 200 baud.
    pub fn start(
        uart: UARTE0,
        pins: Pins,
        counter: TIMER1,
        ppi: &PPI,
        memory: &'static mut UartMemory,
    ) -> Self {
        // Only to set pins and speed: what follows is the registers'.
        let _set = Uarte::new(uart, pins, Parity::EXCLUDED, Baudrate::BAUD115200);
        // SAFETY: the driver above is gone, and its registers are this one's alone.
        let uart = unsafe { nrf52840_hal::pac::Peripherals::steal() }.UARTE0;
        counter.mode.write(|w| w.mode().low_power_counter());
        counter.bitmode.write(|w| w.bitmode()._32bit());
        // SAFETY: tasks take a one, and the channel the addresses of an event and a task.
        unsafe {
            counter.tasks_clear.write(|w| w.bits(1));
            counter.tasks_start.write(|w| w.bits(1));
            ppi.ch[0].eep.write(|w| w.bits((&raw const uart.events_rxdrdy).addr() as u32));
            ppi.ch[0].tep.write(|w| w.bits((&raw const counter.tasks_count).addr() as u32));
            ppi.chenset.write(|w| w.bits(1));
        }
        let memory = &raw mut *memory;
        uart.shorts.write(|w| w.endrx_startrx().enabled());
        // SAFETY: the ring lives for ever, and nothing but the DMA writes it.
        unsafe {
            uart.rxd.ptr.write(|w| w.ptr().bits((&raw const (*memory).ring).addr() as u32));
            uart.rxd.maxcnt.write(|w| w.maxcnt().bits(RING as u16));
            uart.tasks_startrx.write(|w| w.bits(1));
        }
        Self { uart, counter, memory, read: Ring::new(), sending: false }
    }
}

impl ByteLink for Serial {
    fn receive(&mut self) -> Option<u8> {
        // SAFETY: a task takes a one.
        self.counter.tasks_capture[0].write(|w| unsafe { w.bits(1) });
        let place = self.read.next(self.counter.cc[0].read().bits())?;
        compiler_fence(Ordering::Acquire);
        // SAFETY: the place lies in the ring; the DMA is a ring's length ahead at the most.
        Some(unsafe { (&raw const (*self.memory).ring).cast::<u8>().add(place).read_volatile() })
    }

    fn send(&mut self, byte: u8) -> bool {
        if self.sending && self.uart.events_endtx.read().bits() == 0 {
            return false;
        }
        // SAFETY: the DMA has done with the byte; tasks take a one.
        unsafe {
            let out = &raw mut (*self.memory).out;
            out.write_volatile(byte);
            compiler_fence(Ordering::Release);
            self.uart.events_endtx.write(|w| w.bits(0));
            self.uart.txd.ptr.write(|w| w.ptr().bits(out.addr() as u32));
            self.uart.txd.maxcnt.write(|w| w.maxcnt().bits(1));
            self.uart.tasks_starttx.write(|w| w.bits(1));
        }
        self.sending = true;
        true
    }
}
