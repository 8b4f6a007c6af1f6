//! The co-processor on a real board: an nRF52840 development kit with a BMI160 on I²C. Built and linked in continuous
//! integration; **not run on silicon**.
//!
//! | what | where |
//! | --- | --- |
//! | UART to the host | the kit's USB serial port: TXD P0.06, RXD P0.08, 115 200 baud |
//! | I²C to the BMI160, address 0x68, 400 kHz | SDA P0.26, SCL P0.27 |
//! | record | the last four pages of flash |
//! | serial | the chip's device id |
//!
//! Samples are the sensor's counts, 100 a second. Nothing in the loop waits: bytes and samples come by DMA. A slice of a
//! fit takes up to 35 ms, and the erase of a page halts the core for 85 ms: of what comes in that time over the UART
//! nothing is lost ([`firmware_example::ring`], simulated in `tests/device/uart_ring.rs`), and of the samples one is
//! kept. Whoever may lose none of them reads the sensor's FIFO.
//!
//! The HAL keeps panic paths, so this image is none for the panic gate: a panic resets the chip, and the record is
//! in flash.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(target_os = "none", expect(unsafe_code, reason = "memory that no variable owns"))]

#[cfg(target_os = "none")]
mod imu;
#[cfg(target_os = "none")]
mod uart;

#[cfg(target_os = "none")]
mod board {
    use core::num::NonZeroU32;

    use firmware_example::{
        board::Board,
        coprocessor::{Alone, Coprocessor},
        fitting::Memory,
        log,
        machine::{PATIENCE, Ticks, Watchdog, nrf52840, reset},
        stack,
    };
    use imucal_core::link::Guard;
    use nrf52840_hal::{
        Clocks, Rng, Twim,
        gpio::{Level, p0},
        nvmc::Nvmc,
        pac::{NVMC, Peripherals},
        twim, uarte,
    };

    use crate::{
        imu::{Imu, ImuMemory},
        uart::{Serial, UartMemory},
    };

    /// The core's clock, ticks of a millisecond.
    const PER_MILLISECOND: NonZeroU32 = NonZeroU32::new(64_000).unwrap();

    pub fn run() -> ! {
        static mut MEMORY: nrf52840::BoardMemory = Memory::new();
        static mut ALONE: nrf52840::BoardAlone = Alone::new();
        static mut UART: UartMemory = UartMemory::new();
        static mut IMU: ImuMemory = ImuMemory::new();
        // SAFETY: the entry point calls this once, and nothing else knows the variables.
        let (memory, alone) = unsafe { (&mut *(&raw mut MEMORY), &mut *(&raw mut ALONE)) };
        // SAFETY: as above.
        let (uart_memory, imu_memory) = unsafe { (&mut *(&raw mut UART), &mut *(&raw mut IMU)) };
        let last_reset = reset::last();
        log::started(&last_reset);
        let Some(chip) = Peripherals::take() else { cortex_m::peripheral::SCB::sys_reset() };
        let _crystal = Clocks::new(chip.CLOCK).enable_ext_hfosc();
        let pins = p0::Parts::new(chip.P0);
        let uart_pins = uarte::Pins {
            txd: pins.p0_06.into_push_pull_output(Level::High).degrade(),
            rxd: pins.p0_08.into_floating_input().degrade(),
            cts: None,
            rts: None,
        };
        let link = Serial::start(chip.UARTE0, uart_pins, chip.TIMER1, &chip.PPI, uart_memory);
        let bus = twim::Pins {
            sda: pins.p0_26.into_floating_input().degrade(),
            scl: pins.p0_27.into_floating_input().degrade(),
        };
        let bus = Twim::new(chip.TWIM0, bus, twim::Frequency::K400);
        let sensors = Imu::start(bus, chip.TIMER0, imu_memory);
        // A number of this start alone.
        let guard = Guard::new(None, Rng::new(chip.RNG).random_u64());

        let unit = nrf52840::unit();
        let flash: Nvmc<NVMC> = Nvmc::new(chip.NVMC, nrf52840::region());
        let board = Board {
            link,
            flash,
            clock: Ticks::start(PER_MILLISECOND),
            sensors,
            stack: || u32::try_from(stack::deepest().0).ok(),
            last_reset,
        };
        let mut coprocessor = Coprocessor::with_sessions(board, unit, guard, memory, alone);
        let watchdog = Watchdog::start(PATIENCE);
        loop {
            watchdog.feed();
            coprocessor.poll();
        }
    }
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    board::run()
}

#[cfg(not(target_os = "none"))]
fn main() {}
