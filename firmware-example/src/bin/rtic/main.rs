//! The board of the image `nrf52840`, by the tasks of RTIC. Built and linked in continuous integration; **not run on
//! silicon**.
//!
//! | task | priority | does |
//! | --- | --- | --- |
//! | `imu` | 2 | reads the sensor each hundredth of a second, by a driver of embedded-hal |
//! | `idle` | 0 | polls the co-processor, feeds the watchdog |
//!
//! Pins, record and serial are those of the image `nrf52840`, and the UART is its driver: a ring that the DMA fills. `imu`
//! interrupts a slice of a fit, so that no sample is lost to it: the [`Exchange`] keeps eight, and a slice takes 35 ms.
//! While a page of the flash is erased, 85 ms, nothing runs.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(
    target_os = "none",
    allow(unsafe_code, reason = "memory that no variable owns, and what RTIC writes")
)]

#[cfg(target_os = "none")]
#[path = "../nrf52840/uart.rs"]
mod uart;

#[cfg(target_os = "none")]
use rtic_monotonics::nrf::rtc::prelude::*;

#[cfg(target_os = "none")]
nrf_rtc0_monotonic!(Mono);

#[cfg(target_os = "none")]
#[rtic::app(device = nrf52840_hal::pac, dispatchers = [SWI0_EGU0])]
mod app {
    use core::num::NonZeroU32;

    use bmi160::{Bmi160, SlaveAddr, interface::I2cInterface};
    use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
    use firmware_example::{
        adapter::{
            bmi160::{BlockingImu, UNITS},
            exchange::{Exchange, ExchangeSensors},
        },
        board::{Board, Sample},
        coprocessor::{Alone, Coprocessor},
        fitting::Memory,
        log,
        machine::{PATIENCE, Ticks, Watchdog, nrf52840, reset},
        stack,
    };
    use imucal_core::link::Guard;
    use nrf52840_hal::{
        Clocks, Rng, Timer, Twim,
        gpio::{Level, p0},
        nvmc::Nvmc,
        pac::{NVMC, TWIM0},
        twim, uarte,
    };

    use crate::{
        Mono,
        uart::{Serial, UartMemory},
    };
    use rtic_monotonics::nrf::rtc::prelude::*;

    type Samples = Exchange<CriticalSectionRawMutex, 1, 1, 8>;
    type Sensors = ExchangeSensors<'static, CriticalSectionRawMutex, 1, 1, 8>;
    type Whole = Coprocessor<'static, Serial, Nvmc<NVMC>, Ticks, Sensors, 256, 64, 48, 2048, 40, 1>;
    type Imu = BlockingImu<I2cInterface<Twim<TWIM0>>, fn() -> bool>;

    /// From `imu` to `idle`.
    static SAMPLES: Samples = Exchange::new();

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        coprocessor: Whole,
        sensor: Option<Imu>,
    }

    #[init(local = [
        memory: nrf52840::BoardMemory = Memory::new(),
        alone: nrf52840::BoardAlone = Alone::new(),
        uart: UartMemory = UartMemory::new()
    ])]
    fn init(context: init::Context) -> (Shared, Local) {
        let last_reset = reset::last();
        log::started(&last_reset);
        let chip = context.device;
        let _crystals = Clocks::new(chip.CLOCK).enable_ext_hfosc().start_lfclk();
        Mono::start(chip.RTC0, Priority::rtic_default());
        let pins = p0::Parts::new(chip.P0);
        let uart_pins = uarte::Pins {
            txd: pins.p0_06.into_push_pull_output(Level::High).degrade(),
            rxd: pins.p0_08.into_floating_input().degrade(),
            cts: None,
            rts: None,
        };
        let link = Serial::start(chip.UARTE0, uart_pins, chip.TIMER1, &chip.PPI, context.local.uart);
        let bus = twim::Pins {
            sda: pins.p0_26.into_floating_input().degrade(),
            scl: pins.p0_27.into_floating_input().degrade(),
        };
        let bus = Twim::new(chip.TWIM0, bus, twim::Frequency::K400);
        let driver = Bmi160::new_with_i2c(bus, SlaveAddr::default());
        let always: fn() -> bool = || true;
        let sensor = BlockingImu::start(driver, always, &mut Timer::new(chip.TIMER0)).ok();
        if sensor.is_none() {
            defmt::warn!("the IMU does not answer");
        }

        let board = Board {
            link,
            flash: Nvmc::new(chip.NVMC, nrf52840::region()),
            clock: Ticks::start(const { NonZeroU32::new(64_000).unwrap() }),
            sensors: SAMPLES.sensors(UNITS),
            stack: || u32::try_from(stack::deepest().0).ok(),
            last_reset,
        };
        // A number of this start alone.
        let guard = Guard::new(None, Rng::new(chip.RNG).random_u64());
        let (memory, alone) = (context.local.memory, context.local.alone);
        let coprocessor = Coprocessor::with_sessions(board, nrf52840::unit(), guard, memory, alone);
        let _first = imu::spawn();
        (Shared {}, Local { coprocessor, sensor })
    }

    #[task(priority = 2, local = [sensor])]
    async fn imu(context: imu::Context) {
        let Some(sensor) = context.local.sensor else { return };
        let mut due = Mono::now();
        loop {
            due += 10.millis();
            // Reads that were due while the flash was erased would give one sample several times.
            if due < Mono::now() {
                due = Mono::now() + 10.millis();
            }
            Mono::delay_until(due).await;
            if let Ok(sample) = sensor.read() {
                let time = Some(Mono::now().duration_since_epoch().as_micros());
                SAMPLES.offer(Sample { time, ..sample });
            }
        }
    }

    #[idle(local = [coprocessor])]
    fn idle(context: idle::Context) -> ! {
        let watchdog = Watchdog::start(PATIENCE);
        loop {
            watchdog.feed();
            context.local.coprocessor.poll();
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
