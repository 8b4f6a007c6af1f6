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
//! Samples are the sensor's counts, 100 a second. A read of them takes the bus for half a millisecond, a slice of a fit
//! up to 35 ms, and the erase of a page halts the core for 85 ms: what comes in that time over the UART is lost, and
//! asked for again by the host, and of the samples one is kept. Whoever may lose none reads the sensor's FIFO, and
//! takes bytes in an interrupt.
//!
//! The HAL keeps panic paths, so this image is none for the panic gate: a panic resets the chip, and the record is
//! in flash.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(target_os = "none", expect(unsafe_code, reason = "memory that no variable owns"))]

#[cfg(target_os = "none")]
mod board {
    use core::num::NonZeroU32;

    use bmi160::{
        AccelerometerPowerMode, Bmi160, GyroscopePowerMode, SensorSelector, SlaveAddr,
        interface::I2cInterface,
    };
    use embedded_hal_02::{
        serial::{Read, Write},
        timer::CountDown,
    };
    use firmware_example::{
        board::{Board, ByteLink, Sample, SampleSource},
        coprocessor::Coprocessor,
        fitting::Memory,
        machine::Ticks,
        stack,
    };
    use imucal_core::record::SensorIdentity;
    use nrf52840_hal::{
        Clocks, Timer, Twim,
        gpio::{Level, p0},
        nvmc::Nvmc,
        pac::{FICR, NVMC, Peripherals, TIMER0, TWIM0, UARTE0},
        timer::Periodic,
        twim,
        uarte::{self, Baudrate, Parity, Uarte, UarteRx, UarteTx},
    };

    /// The core's clock, ticks of a millisecond.
    const PER_MILLISECOND: NonZeroU32 = NonZeroU32::new(64_000).unwrap();
    /// Between samples, µs.
    const INTERVAL: u32 = 10_000;
    /// The record's region: it lies beyond what memory.x gives to code.
    const REGION: (usize, usize) = (0x000F_C000, 0x4000);
    type BoardMemory = Memory<256, 64, 48, 2048, 40>;

    struct Serial {
        tx: UarteTx<UARTE0>,
        rx: UarteRx<UARTE0>,
    }

    impl ByteLink for Serial {
        fn receive(&mut self) -> Option<u8> {
            self.rx.read().ok()
        }

        fn send(&mut self, byte: u8) -> bool {
            let taken = self.tx.write(byte).is_ok();
            // Starts the transfer; when it is over is asked with the next byte.
            let _started = self.tx.flush();
            taken
        }
    }

    struct Imu {
        sensor: Bmi160<I2cInterface<Twim<TWIM0>>>,
        timer: Timer<TIMER0, Periodic>,
    }

    impl SampleSource for Imu {
        fn sample(&mut self) -> Option<Sample> {
            self.timer.wait().ok()?;
            let data = self.sensor.data(SensorSelector::new().accel().gyro()).ok()?;
            let counts = |x, y, z| [f32::from(x), f32::from(y), f32::from(z)];
            let raw =
                [data.accel.map(|a| counts(a.x, a.y, a.z)), data.gyro.map(|g| counts(g.x, g.y, g.z)), None];
            Some(Sample { raw, temperature: f32::NAN })
        }
    }

    /// The chip's device id, 16 digits.
    fn serial(ficr: &FICR) -> heapless::String<32> {
        let digits =
            |word: u32| (0..8).rev().map(move |k| char::from_digit(word >> (4 * k) & 15, 16).unwrap_or('0'));
        digits(ficr.deviceid[1].read().bits()).chain(digits(ficr.deviceid[0].read().bits())).collect()
    }

    pub fn run() -> ! {
        static mut MEMORY: BoardMemory = BoardMemory::new();
        static mut TX: [u8; 1] = [0];
        static mut RX: [u8; 1] = [0];
        // SAFETY: the entry point calls this once, and nothing else knows the variables; the region is flash that the
        // linker leaves alone.
        let (memory, tx, rx, region) = unsafe {
            let region = core::slice::from_raw_parts_mut(REGION.0 as *mut u8, REGION.1);
            (&mut *(&raw mut MEMORY), &mut *(&raw mut TX), &mut *(&raw mut RX), region)
        };
        let Some(chip) = Peripherals::take() else { cortex_m::peripheral::SCB::sys_reset() };
        let _crystal = Clocks::new(chip.CLOCK).enable_ext_hfosc();
        let pins = p0::Parts::new(chip.P0);
        let uart_pins = uarte::Pins {
            txd: pins.p0_06.into_push_pull_output(Level::High).degrade(),
            rxd: pins.p0_08.into_floating_input().degrade(),
            cts: None,
            rts: None,
        };
        let uart = Uarte::new(chip.UARTE0, uart_pins, Parity::EXCLUDED, Baudrate::BAUD115200);
        let Ok((tx, rx)) = uart.split(tx, rx) else { cortex_m::peripheral::SCB::sys_reset() };
        let bus = twim::Pins {
            sda: pins.p0_26.into_floating_input().degrade(),
            scl: pins.p0_27.into_floating_input().degrade(),
        };
        let bus = Twim::new(chip.TWIM0, bus, twim::Frequency::K400);
        let mut sensor = Bmi160::new_with_i2c(bus, SlaveAddr::default());
        // A sensor that does not answer gives no samples, and the host sees none.
        let _awake = sensor.set_accel_power_mode(AccelerometerPowerMode::Normal);
        let _awake = sensor.set_gyro_power_mode(GyroscopePowerMode::Normal);
        let mut timer = Timer::periodic(chip.TIMER0);
        timer.start(INTERVAL);

        let unit = SensorIdentity {
            name: "nRF52840 BMI160".parse().unwrap_or_default(),
            serial: serial(&chip.FICR),
        };
        let flash: Nvmc<NVMC> = Nvmc::new(chip.NVMC, region);
        let board = Board {
            link: Serial { tx, rx },
            flash,
            clock: Ticks::start(PER_MILLISECOND),
            sensors: Imu { sensor, timer },
            stack: || u32::try_from(stack::deepest().0).ok(),
        };
        let mut coprocessor = Coprocessor::new(board, unit, memory);
        loop {
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
