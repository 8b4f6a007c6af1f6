//! What a device and its host say to each other, in one place for both.
//!
//! # Frame
//!
//! ```text
//! 0         1          5              5+n      9+n
//! ├─────────┼──────────┼──────────────┼────────┤
//! │ version │ id, u32  │ message, n B │ CRC-32 │   encoded by COBS, then one zero byte
//! └─────────┴──────────┴──────────────┴────────┘
//! ```
//!
//! Numbers are little-endian; the message is postcard 1; the CRC is the record's (ISO-HDLC) over all before it. COBS
//! leaves no zero inside a frame (Cheshire & Baker 1999), so that a receiver finds the next frame after any damage.
//!
//! # Rules
//!
//! * Every [`Request`] has an id, and every [`Reply`] bears the id of the request it answers; the samples of a stream
//!   that of the request that started it.
//! * Ids rise. A request whose id is not above the last one taken is a replay or came late: it is answered with
//!   [`Fault::Stale`], which names the last id, and does nothing. Ids may be left out. [`Request::Identify`] changes
//!   nothing and is answered whatever its id; its answer names the id to go on from.
//! * A frame that cannot be read is answered under the id 0, which no request may have.
//! * Observations say which one they are: sent again after a lost answer, they are answered with
//!   [`Fault::OutOfSequence`] and the index that is expected, and none is taken twice.
//!
//! # Stability policy
//!
//! Version, id and CRC keep their places in every version, so that a frame of another version can be refused by its
//! id. Within a version, variants are appended, never inserted.

mod fit;
mod frame;
mod message;

pub use fit::{FitModel, FitProgress, FitReport, FitTask, MOST_COVARIANCE, MOST_PARAMETERS, Observation};
pub use frame::{FrameError, Header, MAX_FRAME, Receiver, encode, split};
pub use message::{BATCH, Capacity, Fault, Identity, RecordState, Reply, Request, Status, Values};

/// Version of the messages that this library writes and reads.
pub const VERSION: u8 = 1;
