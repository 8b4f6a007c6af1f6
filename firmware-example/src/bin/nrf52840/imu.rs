//! A BMI160 on I²C, read by DMA without a wait (Bosch BST-BMI160-DS000, 2.11; nRF52840 Product Specification 1.11, TWIM).

use core::sync::atomic::{Ordering, compiler_fence};

use bmi160::{Bmi160, SlaveAddr};
use firmware_example::{
    adapter::bmi160::{self as registers, BlockingImu, DATA, DATA_LEN},
    board::{Sample, SampleSource},
};
use imucal_core::record::RawUnit;
use nrf52840_hal::{
    Timer, Twim,
    pac::{Peripherals, TIMER0, TWIM0},
    timer::Periodic,
};

/// Between samples, µs.
const INTERVAL: u32 = 10_000;

/// Memory of the DMA.
pub struct ImuMemory {
    register: [u8; 1],
    data: [u8; DATA_LEN],
}

impl ImuMemory {
    pub const fn new() -> Self {
        Self { register: [DATA], data: [0; DATA_LEN] }
    }
}

/// The sensor, its bus and when to read it.
pub struct Imu {
    bus: TWIM0,
    timer: Timer<TIMER0, Periodic>,
    /// Written by the DMA: read only as volatile.
    memory: *const ImuMemory,
    /// A read is on its way.
    reading: bool,
}

impl Imu {
    /// Wakes the sensor, which waits for the bus: before the first turn. One that does not answer gives no samples.
    pub fn start(bus: Twim<TWIM0>, timer: TIMER0, memory: &'static mut ImuMemory) -> Self {
        let mut timer = Timer::periodic(timer);
        let driver = Bmi160::new_with_i2c(bus, SlaveAddr::default());
        if BlockingImu::start(driver, || false, &mut timer).is_err() {
            defmt::warn!("the IMU does not answer");
        }
        // SAFETY: the driver above ends here, and its registers are this one's alone.
        let bus = unsafe { Peripherals::steal() }.TWIM0;
        let memory = &raw mut *memory;
        bus.shorts.write(|w| w.lasttx_startrx().enabled().lastrx_stop().enabled());
        // SAFETY: the memory lives for ever, and nothing but the DMA writes it.
        unsafe {
            bus.txd.ptr.write(|w| w.ptr().bits((&raw const (*memory).register).addr() as u32));
            bus.txd.maxcnt.write(|w| w.maxcnt().bits(1));
            bus.rxd.ptr.write(|w| w.ptr().bits((&raw const (*memory).data).addr() as u32));
            bus.rxd.maxcnt.write(|w| w.maxcnt().bits(DATA_LEN as u16));
        }
        timer.start(INTERVAL);
        Self { bus, timer, memory, reading: false }
    }

    /// Starts a read.
    fn read(&mut self) {
        // SAFETY: events are cleared by a zero, and tasks take a one.
        unsafe {
            self.bus.events_stopped.write(|w| w.bits(0));
            self.bus.events_error.write(|w| w.bits(0));
            self.bus.tasks_starttx.write(|w| w.bits(1));
        }
        self.reading = true;
    }

    /// Ends a read that the sensor does not acknowledge; its sample is left out.
    fn give_up(&mut self) {
        // SAFETY: as above.
        unsafe {
            self.bus.events_error.write(|w| w.bits(0));
            self.bus.tasks_stop.write(|w| w.bits(1));
        }
        self.reading = false;
    }
}

impl SampleSource for Imu {
    fn sample(&mut self) -> Option<Sample> {
        if self.reading && self.bus.events_error.read().bits() != 0 {
            self.give_up();
        }
        if !self.reading {
            if self.timer.reset_if_finished() {
                self.read();
            }
            return None;
        }
        if self.bus.events_stopped.read().bits() == 0 {
            return None;
        }
        self.reading = false;
        compiler_fence(Ordering::Acquire);
        // SAFETY: the DMA has stopped.
        let data = unsafe { (&raw const (*self.memory).data).read_volatile() };
        Some(registers::sample(&data))
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        registers::UNITS
    }
}
