//! Many recordings at once: each is calibrated for itself, and all units are compared with one another.
//!
//! ```text
//!  folder, pattern, ──► source ──► shard ──► workers ──► task ──► entry ──┬──► outlier ──┬──► summary
//!  list                 paths,     every     N at a      read,    what    │    units     │    CSV, Parquet
//!                       names      n-th      time        fit,     is done │    that are  └──► report, page
//!                                                        write            │    unlike         text, JSON, HTML
//!                                                                         └──► physical
//! ```
//!
//! What is known of a recording is in its entry, a file that is put in place together with the recording's outputs. A batch that
//! was ended at any moment is resumed from the entries. Everything after `entry` is computed from entries alone, in the order of
//! names, so that it depends neither on the number of workers nor on shards nor on what was done in which run.

use imucal_core::record::Date;

use crate::{calibrate::request::Request, file::Limits, recording::Mapping};

pub mod entry;
mod list;
pub mod outlier;
pub mod page;
pub mod parameter;
pub mod report;
pub mod shard;
pub mod source;
pub mod summary;
pub mod task;
mod workers;

pub use self::{
    entry::{Entry, Standing},
    shard::Shard,
    source::{Source, SourceFault, find},
    task::{Done, Place, Task},
    workers::{Batch, BatchFault},
};

/// How recordings are read and calibrated.
#[derive(Clone, Debug)]
pub struct Method {
    /// Models, and what is accepted.
    pub request: Request,
    /// What the columns of another program's files are.
    pub mapping: Mapping,
    /// How much is read.
    pub limits: Limits,
    /// Day of the calibrations, UTC.
    pub date: Date,
}

impl Method {
    /// All that a calibration depends on apart from its recording and the program, as text; the day is no part of it.
    #[must_use]
    pub fn options(&self) -> String {
        let Self { request, mapping, limits, date: _ } = self;
        format!("{request:?} {mapping:?} {limits:?}")
    }
}
