//! A BMI160 that is simulated by the registers of its data sheet (Bosch BST-BMI160-DS000, 2.11), on buses of embedded-hal.

use std::{cell::RefCell, convert::Infallible, rc::Rc};

use bmi160::{Bmi160, Error, SlaveAddr};
use embassy_futures::block_on;
use embedded_hal::{
    delay::DelayNs,
    i2c::{self, ErrorKind, I2c, NoAcknowledgeSource, Operation},
    spi::{self, SpiDevice},
};
use firmware_example::{
    adapter::bmi160::{AsyncImu, BlockingImu, StartError, UNITS},
    board::{Sample, SampleSource},
};

const ADDRESS: u8 = 0x68;
const NOBODY: ErrorKind = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
/// Rates and specific forces, counts.
const GYR: [i16; 3] = [1, -2, 300];
const ACC: [i16; 3] = [-32_768, 32_767, 16_384];

/// The chip; time passes by the delays.
#[derive(Debug)]
struct Chip {
    identity: u8,
    answers: bool,
    now_ns: u64,
    /// When each of the two gives samples, accelerometer first.
    awake_at: [Option<u64>; 2],
}

impl Chip {
    fn register(&self, address: u8) -> u8 {
        let (axes, first, awake) = match address {
            0x00 => return self.identity,
            0x0C..0x12 => (GYR, 0x0C, self.awake_at[1]),
            0x12..0x18 => (ACC, 0x12, self.awake_at[0]),
            _ => return 0,
        };
        let at = usize::from(address - first);
        if awake.is_some_and(|at| at <= self.now_ns) { axes[at / 2].to_le_bytes()[at % 2] } else { 0 }
    }

    /// Start-up times: 3.8 ms and 80 ms at the most.
    fn write(&mut self, address: u8, value: u8) {
        match (address, value) {
            (0x7E, 0x11) => self.awake_at[0] = Some(self.now_ns + 3_800_000),
            (0x7E, 0x15) => self.awake_at[1] = Some(self.now_ns + 80_000_000),
            _ => panic!("{value:#x} is written to {address:#x}"),
        }
    }
}

#[derive(Clone, Debug)]
struct Bus(Rc<RefCell<Chip>>);

impl Bus {
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Chip { identity: 0xD1, answers: true, now_ns: 0, awake_at: [None; 2] })))
    }

    fn transfer(&self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let mut chip = self.0.borrow_mut();
        if !chip.answers || address != ADDRESS {
            return Err(NOBODY);
        }
        let mut at = 0;
        for operation in operations {
            match operation {
                Operation::Write([register]) => at = *register,
                Operation::Write([register, value]) => chip.write(*register, *value),
                Operation::Write(other) => panic!("{other:?} is written"),
                Operation::Read(bytes) => {
                    for (byte, register) in bytes.iter_mut().zip(at..) {
                        *byte = chip.register(register);
                    }
                }
            }
        }
        Ok(())
    }
}

impl i2c::ErrorType for Bus {
    type Error = ErrorKind;
}

impl I2c for Bus {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        self.transfer(address, operations)
    }
}

impl embedded_hal_async::i2c::I2c for Bus {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        embassy_futures::yield_now().await;
        self.transfer(address, operations)
    }
}

impl DelayNs for Bus {
    fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().now_ns += u64::from(ns);
    }
}

impl embedded_hal_async::delay::DelayNs for Bus {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().now_ns += u64::from(ns);
    }
}

/// The same chip on SPI: the highest bit of a register's address says that it is read.
struct Spi(Bus);

impl spi::ErrorType for Spi {
    type Error = Infallible;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut chip = self.0.0.borrow_mut();
        for operation in operations {
            match operation {
                spi::Operation::Write([register, value]) => chip.write(*register, *value),
                spi::Operation::TransferInPlace([first, bytes @ ..]) if *first & 0x80 != 0 => {
                    for (byte, register) in bytes.iter_mut().zip(*first & 0x7F..) {
                        *byte = chip.register(register);
                    }
                }
                other => panic!("{other:?}"),
            }
        }
        Ok(())
    }
}

/// Raw specific forces and rates, and a temperature that is not known.
fn is_expected(sample: &Sample) -> bool {
    let floats = |counts: [i16; 3]| Some(counts.map(f32::from));
    sample.raw == [floats(ACC), floats(GYR), None] && sample.temperature.is_nan()
}

#[test]
fn a_sensor_on_i2c_is_woken_and_gives_its_counts_when_they_are_due() {
    let bus = Bus::new();
    let mut turns = 0;
    let every_third = || {
        turns += 1;
        turns % 3 == 0
    };
    let driver = Bmi160::new_with_i2c(bus.clone(), SlaveAddr::default());
    let mut imu = BlockingImu::start(driver, every_third, &mut bus.clone()).expect("it answers");
    assert_eq!(imu.units(), UNITS);
    let samples: Vec<_> = (0..6).map(|_| imu.sample()).collect();
    assert_eq!(
        samples.iter().map(Option::is_some).collect::<Vec<_>>(),
        [false, false, true, false, false, true]
    );
    assert!(samples.iter().flatten().all(is_expected), "{samples:?}");

    bus.0.borrow_mut().answers = false;
    assert_eq!((0..6).filter_map(|_| imu.sample()).count(), 0);
    assert_eq!(imu.errors(), 2);
    bus.0.borrow_mut().answers = true;
    assert!((0..3).filter_map(|_| imu.sample()).all(|sample| is_expected(&sample)));
}

#[test]
fn a_sensor_on_spi_gives_the_same() {
    let bus = Bus::new();
    let driver = Bmi160::new_with_spi(Spi(bus.clone()));
    let mut imu = BlockingImu::start(driver, || true, &mut bus.clone()).expect("it answers");
    assert!(imu.sample().is_some_and(|sample| is_expected(&sample)));
}

#[test]
fn a_sensor_on_an_async_bus_gives_the_same() {
    let bus = Bus::new();
    block_on(async {
        let mut imu = AsyncImu::start(bus.clone(), ADDRESS, &mut bus.clone()).await.expect("it answers");
        assert!(imu.read().await.is_ok_and(|sample| is_expected(&sample)));
        bus.0.borrow_mut().answers = false;
        assert_eq!(imu.read().await.err(), Some(NOBODY));
    });
}

#[test]
fn a_sensor_that_is_missing_or_another_is_named() {
    let bus = Bus::new();
    let blocking = || {
        let driver = Bmi160::new_with_i2c(bus.clone(), SlaveAddr::default());
        BlockingImu::start(driver, || true, &mut bus.clone()).err()
    };
    let by_async = || block_on(AsyncImu::start(bus.clone(), ADDRESS, &mut bus.clone())).err();
    bus.0.borrow_mut().identity = 0x24;
    assert!(matches!(blocking(), Some(StartError::Chip(0x24))));
    assert_eq!(by_async(), Some(StartError::Chip(0x24)));
    bus.0.borrow_mut().answers = false;
    assert!(matches!(blocking(), Some(StartError::Bus(Error::Comm(NOBODY)))));
    assert_eq!(by_async(), Some(StartError::Bus(NOBODY)));
}
