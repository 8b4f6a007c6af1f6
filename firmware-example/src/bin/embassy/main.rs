//! The board of the image `nrf52840`, by the tasks of embassy. Built and linked in continuous integration; **not run on
//! silicon**.
//!
//! | task | awaits |
//! | --- | --- |
//! | `line_in` | bytes of the UART |
//! | `line_out` | bytes for it, and the room they need |
//! | `imu` | each hundredth of a second, and the I²C bus |
//! | `main` | news of the others; polls the co-processor, feeds the watchdog |
//!
//! Pins, record and serial are those of the image `nrf52840`. All tasks are one executor's: while a slice of a fit holds
//! the processor, 35 ms, the UART's driver keeps what comes by its own interrupt and DMA, and of the samples one is read
//! late and up to three are not read. An `InterruptExecutor` for `imu` reads them all; the [`Exchange`] keeps eight.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(target_os = "none", expect(unsafe_code, reason = "memory that no variable owns"))]

#[cfg(target_os = "none")]
mod tasks {
    use embassy_executor::Spawner;
    use embassy_nrf::{
        bind_interrupts,
        buffered_uarte::{self, BufferedUarte, BufferedUarteRx, BufferedUarteTx},
        config::{Config, HfclkSource},
        nvmc::Nvmc,
        peripherals, rng, twim, uarte,
    };
    use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
    use embassy_time::{Delay, Duration, Instant, Timer};
    use firmware_example::{
        adapter::{
            bmi160::{AsyncImu, UNITS},
            exchange::Exchange,
            region::Region,
        },
        board::{Board, Clock, Sample},
        coprocessor::{Alone, Coprocessor},
        fitting::Memory,
        log,
        machine::{PATIENCE, Watchdog, nrf52840, reset},
        stack,
    };
    use imucal_core::link::Guard;

    bind_interrupts!(struct Interrupts {
        UARTE0 => buffered_uarte::InterruptHandler<peripherals::UARTE0>;
        TWISPI0 => twim::InterruptHandler<peripherals::TWISPI0>;
    });

    /// A mutex of critical sections, so that a task may move to an executor of another priority.
    static EXCHANGE: Exchange<CriticalSectionRawMutex, 1024, 512, 8> = Exchange::new();

    /// Between samples.
    const INTERVAL: Duration = Duration::from_millis(10);

    /// Milliseconds since the start.
    struct Uptime;

    impl Clock for Uptime {
        fn uptime(&mut self) -> u32 {
            Instant::now().as_millis() as u32
        }
    }

    #[embassy_executor::task]
    async fn line_in(line: BufferedUarteRx<'static>) {
        EXCHANGE.receive(line).await;
    }

    #[embassy_executor::task]
    async fn line_out(line: BufferedUarteTx<'static>) {
        EXCHANGE.transmit(line).await;
    }

    /// A sensor that does not answer is tried again each second; a read that fails is a sample left out.
    #[embassy_executor::task]
    async fn imu(mut bus: twim::Twim<'static>) {
        let mut sensor = loop {
            match AsyncImu::start(&mut bus, nrf52840::IMU_ADDRESS, &mut Delay).await {
                Ok(sensor) => break sensor,
                Err(_) => {
                    defmt::warn!("the IMU does not answer");
                    Timer::after_secs(1).await;
                }
            }
        };
        let mut due = Instant::now();
        loop {
            due += INTERVAL;
            // Reads that were due while a slice of a fit held the processor would give one sample several times.
            if due < Instant::now() {
                due = Instant::now() + INTERVAL;
            }
            Timer::at(due).await;
            if let Ok(sample) = sensor.read().await {
                EXCHANGE.offer(Sample { time: Some(Instant::now().as_micros()), ..sample });
            }
        }
    }

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        static mut MEMORY: nrf52840::BoardMemory = Memory::new();
        static mut ALONE: nrf52840::BoardAlone = Alone::new();
        static mut UART: [[u8; 1024]; 2] = [[0; 1024]; 2];
        static mut BUS: [u8; 16] = [0; 16];
        // SAFETY: this runs once, and nothing else knows the variables.
        let (memory, alone) = unsafe { (&mut *(&raw mut MEMORY), &mut *(&raw mut ALONE)) };
        // SAFETY: as above.
        let ([uart_in, uart_out], bus_memory) = unsafe { (&mut *(&raw mut UART), &mut *(&raw mut BUS)) };
        let last_reset = reset::last();
        log::started(&last_reset);
        let mut config = Config::default();
        config.hfclk_source = HfclkSource::ExternalXtal;
        let chip = embassy_nrf::init(config);

        let mut uart_config = uarte::Config::default();
        uart_config.baudrate = uarte::Baudrate::Baud115200;
        let uart = BufferedUarte::new(
            chip.UARTE0,
            chip.TIMER1,
            chip.PPI_CH0,
            chip.PPI_CH1,
            chip.PPI_GROUP0,
            chip.P0_08,
            chip.P0_06,
            Interrupts,
            uart_config,
            uart_in,
            uart_out,
        );
        let (rx, tx) = uart.split();
        let mut bus_config = twim::Config::default();
        bus_config.frequency = twim::Frequency::K400;
        let bus = twim::Twim::new(chip.TWISPI0, Interrupts, chip.P0_26, chip.P0_27, bus_config, bus_memory);
        // A number of this start alone.
        let mut number = [0; 8];
        rng::Rng::new_blocking(chip.RNG).blocking_fill_bytes(&mut number);
        let guard = Guard::new(None, u64::from_le_bytes(number));
        // Each task has room for one of its kind, and this is the only one.
        let (Ok(line_in), Ok(line_out), Ok(imu)) = (line_in(rx), line_out(tx), imu(bus)) else {
            cortex_m::peripheral::SCB::sys_reset()
        };
        spawner.spawn(line_in);
        spawner.spawn(line_out);
        spawner.spawn(imu);

        let (start, length) = nrf52840::REGION;
        let Ok(flash) = Region::new(Nvmc::new(chip.NVMC), start, length) else {
            cortex_m::peripheral::SCB::sys_reset()
        };
        let board = Board {
            link: EXCHANGE.link(),
            flash,
            clock: Uptime,
            sensors: EXCHANGE.sensors(UNITS),
            stack: || u32::try_from(stack::deepest().0).ok(),
            last_reset,
        };
        let mut coprocessor = Coprocessor::with_sessions(board, nrf52840::unit(), guard, memory, alone);
        let watchdog = Watchdog::start(PATIENCE);
        let poll = || {
            watchdog.feed();
            coprocessor.poll()
        };
        EXCHANGE.work(poll, async || Timer::after_secs(2).await).await;
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
