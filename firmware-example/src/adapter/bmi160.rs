//! A BMI160 (Bosch BST-BMI160-DS000, 2.11) at any bus of embedded-hal 1.0: blocking by the crate `bmi160`, over I²C or
//! SPI; async over I²C.
//!
//! Ranges and rates are those of its reset: ±2 g, ±2000 °/s, 100 samples a second. Samples are counts. Its temperature is
//! not read. A read takes 14 bytes on I²C, 0.35 ms at 400 kHz; the blocking driver waits for that long, and no longer.

use bmi160::{
    AccelerometerPowerMode, Bmi160, Data, Error, GyroscopePowerMode, Sensor3DData, SensorSelector,
    interface::{ReadData, WriteData},
};
use embedded_hal::delay::DelayNs;
use embedded_hal_async::{delay::DelayNs as AsyncDelayNs, i2c::I2c as AsyncI2c};
use imucal_core::record::RawUnit;

use crate::board::{Sample, SampleSource};

/// Register of the identity, and what it says.
const IDENTITY: u8 = 0x00;
/// See above.
const CHIP: u8 = 0xD1;
/// Register of commands, and those that wake the two sensors.
const COMMAND: u8 = 0x7E;
/// See above.
const WAKE_ACC: u8 = 0x11;
/// See above.
const WAKE_GYR: u8 = 0x15;
/// Until the accelerometer, and then the gyroscope, gives samples, ms: the longest times of table 1 and a little more.
const ACC_STARTS: u32 = 5;
/// See above.
const GYR_STARTS: u32 = 85;
/// The first register of the rates, which the specific forces follow.
pub const DATA: u8 = 0x0C;
/// Bytes of both.
pub const DATA_LEN: usize = 12;

/// In the order of [`Sample::raw`].
pub const UNITS: [Option<RawUnit>; 3] = [Some(RawUnit::Counts), Some(RawUnit::Counts), None];

/// The sample of the registers from [`DATA`] on.
pub fn sample(data: &[u8; DATA_LEN]) -> Sample {
    let (words, _) = data.as_chunks::<2>();
    let counts = |first: usize| {
        [0, 1, 2].map(|k| words.get(first + k).map_or(0.0, |word| f32::from(i16::from_le_bytes(*word))))
    };
    Sample { raw: [Some(counts(3)), Some(counts(0)), None], temperature: f32::NAN, time: None }
}

/// Why a BMI160 does not start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartError<E> {
    /// The bus failed, or nobody answered.
    Bus(E),
    /// Another chip answered, with this identity.
    Chip(u8),
}

/// Behind the driver `bmi160`. `due` says without a wait whether a sample is due: by a timer, or by the sensor's pin.
#[derive(Debug)]
pub struct BlockingImu<DI, R> {
    driver: Bmi160<DI>,
    due: R,
    errors: u32,
}

impl<DI, E, R: FnMut() -> bool> BlockingImu<DI, R>
where
    DI: ReadData<Error = Error<E>> + WriteData<Error = Error<E>>,
{
    /// Wakes the sensor, which takes 90 ms.
    ///
    /// # Errors
    ///
    /// [`StartError`], by the driver's error.
    pub fn start(
        mut driver: Bmi160<DI>,
        due: R,
        delay: &mut impl DelayNs,
    ) -> Result<Self, StartError<Error<E>>> {
        let chip = driver.chip_id().map_err(StartError::Bus)?;
        if chip != CHIP {
            return Err(StartError::Chip(chip));
        }
        driver.set_accel_power_mode(AccelerometerPowerMode::Normal).map_err(StartError::Bus)?;
        delay.delay_ms(ACC_STARTS);
        driver.set_gyro_power_mode(GyroscopePowerMode::Normal).map_err(StartError::Bus)?;
        delay.delay_ms(GYR_STARTS);
        Ok(Self { driver, due, errors: 0 })
    }

    /// The newest sample, due or not.
    ///
    /// # Errors
    ///
    /// The bus's.
    pub fn read(&mut self) -> Result<Sample, Error<E>> {
        let Data { accel, gyro, .. } = self.driver.data(SensorSelector::new().accel().gyro())?;
        let counts = |axes: Sensor3DData| [axes.x, axes.y, axes.z].map(f32::from);
        Ok(Sample { raw: [accel.map(counts), gyro.map(counts), None], temperature: f32::NAN, time: None })
    }

    /// Reads that failed, each of which is a sample left out; up to `u32::MAX`.
    pub const fn errors(&self) -> u32 {
        self.errors
    }
}

impl<DI, E, R: FnMut() -> bool> SampleSource for BlockingImu<DI, R>
where
    DI: ReadData<Error = Error<E>> + WriteData<Error = Error<E>>,
{
    fn sample(&mut self) -> Option<Sample> {
        if !(self.due)() {
            return None;
        }
        let sample = self.read().ok();
        self.errors = self.errors.saturating_add(u32::from(sample.is_none()));
        sample
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        UNITS
    }
}

/// On an async I²C, for a task that gives its samples to an [`super::exchange::Exchange`].
#[derive(Debug)]
pub struct AsyncImu<B> {
    bus: B,
    address: u8,
}

impl<B: AsyncI2c> AsyncImu<B> {
    /// Wakes the sensor at this address of 7 bits, which takes 90 ms.
    ///
    /// # Errors
    ///
    /// [`StartError`], by the bus's error.
    pub async fn start(
        mut bus: B,
        address: u8,
        delay: &mut impl AsyncDelayNs,
    ) -> Result<Self, StartError<B::Error>> {
        let mut chip = [0];
        bus.write_read(address, &[IDENTITY], &mut chip).await.map_err(StartError::Bus)?;
        if chip != [CHIP] {
            return Err(StartError::Chip(chip[0]));
        }
        bus.write(address, &[COMMAND, WAKE_ACC]).await.map_err(StartError::Bus)?;
        delay.delay_ms(ACC_STARTS).await;
        bus.write(address, &[COMMAND, WAKE_GYR]).await.map_err(StartError::Bus)?;
        delay.delay_ms(GYR_STARTS).await;
        Ok(Self { bus, address })
    }

    /// The newest sample.
    ///
    /// # Errors
    ///
    /// The bus's.
    pub async fn read(&mut self) -> Result<Sample, B::Error> {
        let mut data = [0; DATA_LEN];
        self.bus.write_read(self.address, &[DATA], &mut data).await?;
        Ok(sample(&data))
    }
}
