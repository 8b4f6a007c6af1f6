//! Who a device is, how it is, and how its last run ended.

use serde::{Deserialize, Serialize};

use super::FitProgress;
use crate::record::SensorIdentity;

/// Who a device is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// The unit; its serial is what records are compared with.
    pub unit: SensorIdentity,
    /// Version of the firmware.
    pub firmware: (u8, u8, u8),
    /// Major and minor version of the records it reads.
    pub record_version: (u8, u8),
    /// The device's number of the session that is offered.
    pub nonce: u64,
    /// What changes something needs the seal of its key.
    pub keyed: bool,
    /// What it has room for.
    pub capacity: Capacity,
}

/// What a device has room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capacity {
    /// Points of a fit.
    pub points: u16,
    /// Poses of a fit on a rig.
    pub poses: u16,
    /// Turns of a gyroscope's fit.
    pub turns: u16,
    /// Blocks of all turns together.
    pub blocks: u16,
    /// Particles of a swarm; 0: it does not search.
    pub particles: u16,
}

/// What became of the stored record at the start, or since. The order of the variants is the format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RecordState {
    /// None is stored.
    Empty,
    /// It is in use.
    InUse,
    /// It is in use, though record or unit has no serial.
    Unconfirmed,
    /// It was made for another unit, and is kept without being used.
    OtherSensor,
    /// Its format is newer than this firmware, and it is kept without being used.
    NewerFormat,
    /// It was stored whole, but cannot be used.
    Unusable,
    /// The one stored last has lost bits since; the one before it is in use.
    Previous,
    /// The one stored last has lost bits since, and there is none before it.
    Lost,
}

/// How the run before this one ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LastReset {
    /// By what.
    pub cause: ResetCause,
    /// Address of the instruction that it ended at, as far as it is known; otherwise 0.
    pub address: u32,
    /// Resets since the power came on.
    pub resets: u32,
}

/// What ends a run. The order of the variants is the format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ResetCause {
    /// The power was off: nothing is known.
    PowerOn,
    /// A reset that nothing in the device announced: by a pin or a debugger.
    Unannounced,
    /// An access to memory that is not there, or an instruction that is none.
    Fault,
    /// The stack was full.
    StackOverflow,
    /// The watchdog was not fed.
    Watchdog,
}

impl ResetCause {
    /// All, in the order of the format.
    pub const ALL: [Self; 5] =
        [Self::PowerOn, Self::Unannounced, Self::Fault, Self::StackOverflow, Self::Watchdog];
}

/// How a device is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// Time since the start, ms.
    pub uptime: u32,
    /// The stored record.
    pub record: RecordState,
    /// Its number; 0 where none is stored.
    pub sequence: u32,
    /// The record in use differs from the stored one.
    pub unsaved: bool,
    /// What changes something is refused.
    pub locked: bool,
    /// Samples corrected since the start.
    pub corrected: u32,
    /// Frames refused since the start.
    pub refused: u32,
    /// Stack used at most since the start, bytes; `None` where the device does not look.
    pub stack: Option<u32>,
    /// The fit under way.
    pub fit: Option<FitProgress>,
}
