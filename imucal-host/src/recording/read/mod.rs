//! Files to columns, columns to a recording.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | CSV (gzipped or not), Parquet, IMU-TK text; a manifest | a recording in SI, or an error with file, line and column |

pub(crate) mod assembly;
pub(crate) mod clock;
pub(crate) mod column_guess;
pub(crate) mod columns;
pub(crate) mod csv;
pub(crate) mod csv_rows;
pub mod header_fault;
pub mod imu_tk;
pub(crate) mod interval;
pub(crate) mod number;
#[cfg(feature = "parquet")]
pub(crate) mod parquet;
mod text;
