//! Files to columns, columns to a recording.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | CSV (gzipped or not), Parquet, MAT-files, logs, IMU-TK text, EuRoC folders; a manifest | a recording in SI, or an error with file, line and column |

pub(crate) mod assembly;
pub(crate) mod clock;
pub(crate) mod column_guess;
pub(crate) mod columns;
pub(crate) mod csv;
mod csv_pieces;
pub(crate) mod csv_rows;
pub(crate) mod date;
pub mod euroc;
pub mod header_fault;
pub mod imu_tk;
mod inflated;
pub(crate) mod interval;
pub(crate) mod joined;
#[cfg(feature = "logs")]
pub(crate) mod logs;
pub(crate) mod matlab;
mod memory;
pub(crate) mod number;
#[cfg(feature = "parquet")]
pub(crate) mod parquet;
mod text;
pub(crate) mod z_up;
