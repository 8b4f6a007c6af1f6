//! What the three images of the nRF52840 share: memory, the record's region, and who the unit is.

use imucal_core::record::SensorIdentity;

use super::Register;
use crate::{coprocessor::Alone, fitting::Memory};

/// The fits that there is memory for.
pub type BoardMemory = Memory<256, 64, 48, 2048, 40>;
/// One session, and one watch.
pub type BoardAlone = Alone<1>;

/// Start and length of the record's region, bytes: the last four pages, beyond what memory.x gives to code.
pub const REGION: (u32, u32) = (0x000F_C000, 0x4000);

/// The IMU's address on I²C.
pub const IMU_ADDRESS: u8 = 0x68;

/// The two words of the chip's device id (nRF52840 product specification, FICR).
const DEVICE_ID: [Register; 2] = [Register(0x1000_0060), Register(0x1000_0064)];

/// The region as memory, for a driver that wants it so; to be called once.
pub fn region() -> &'static mut [u8] {
    // SAFETY: flash that the linker leaves alone, and nobody else's by the rule above.
    unsafe { core::slice::from_raw_parts_mut(REGION.0 as usize as *mut u8, REGION.1 as usize) }
}

/// Who the unit is: its serial is the chip's device id, 16 digits, the higher word first.
pub fn unit() -> SensorIdentity {
    let [low, high] = DEVICE_ID.map(Register::read);
    let digits =
        |word: u32| (0..8).rev().map(move |k| char::from_digit(word >> (4 * k) & 15, 16).unwrap_or('0'));
    SensorIdentity {
        name: "nRF52840 BMI160".parse().unwrap_or_default(),
        serial: digits(high).chain(digits(low)).collect(),
    }
}
