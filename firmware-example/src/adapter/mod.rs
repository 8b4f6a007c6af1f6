//! A board's drivers, by the common traits of embedded Rust, behind the traits of [`crate::board`].
//!
//! | the driver has | it becomes | here |
//! | --- | --- | --- |
//! | embedded-io 0.7: `Read`, `ReadReady`, `Write`, `WriteReady` | a `ByteLink` that never waits | [`byte_io`] |
//! | embedded-io-async 0.7: `Read`, `Write`, in two tasks | a `ByteLink` and a `SampleSource` between tasks | [`exchange`] |
//! | embedded-hal 1.0, blocking or async: I²C, SPI, `DelayNs` | samples of a BMI160 | [`bmi160`] |
//! | embedded-storage 0.3: `NorFlash` of the whole chip | the region of the record | [`region`] |
//!
//! There is no trait of a clock in embedded-hal: a board's counter becomes a [`crate::board::Clock`] by
//! [`crate::elapsed`]. `tests/device/adapter` runs whole sessions over drivers that are slow, short and faulty.

pub mod bmi160;
pub mod byte_io;
pub mod exchange;
pub mod region;
