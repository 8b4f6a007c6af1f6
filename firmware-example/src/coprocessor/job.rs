//! Work that takes many turns, and the answers that wait for it.

use imucal_core::{
    link::{Asked, Fault, RawSamples},
    record::Date,
};

use crate::storage::Writing;

/// What takes many slices, and the request it answers.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one, and no heap")]
pub(super) enum Job {
    /// Before the first turn.
    Booting,
    None,
    /// A record on its way into flash.
    Storing(Asked, Writing),
    /// The record before the stored one on its way back.
    Restoring(Asked),
    /// Slices of the fit that are left; `None`: to its end.
    Stepping(Asked, Option<u16>),
    /// A fit that has stopped, and the day.
    Judging(Asked, Date),
    /// Samples for the session or the watch, the last first.
    Sampling(Asked, RawSamples),
    /// The last fits of a session, and the day.
    Closing(Asked, Date),
}

/// An answer that waits until the link is free.
#[derive(Clone, Copy, Debug)]
pub(super) enum Due {
    Stored(u32),
    Progress,
    Report,
    Capture,
    Captured,
    Done,
    Fault(Fault),
}

/// A stream of corrected samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream {
    pub(super) asked: Asked,
    pub(super) every: u16,
    /// Samples until the next that is sent.
    pub(super) left: u16,
}
