//! What a device and its host say to each other, in one place for both.
//!
//! `imucal-host/docs/protocol.md` is the same for whoever writes a host in another language: byte tables, golden frames
//! and a client. A test holds the two together.
//!
//! # Frame
//!
//! ```text
//! 0         1         5       6              10             10+n       26+n     30+n
//! ├─────────┼─────────┼───────┼──────────────┼──────────────┼──────────┼────────┤
//! │ version │ id, u32 │ flags │ session, u32 │ message, n B │ seal, 16 │ CRC-32 │   by COBS, then one zero byte
//! └─────────┴─────────┴───────┴──────────────┴──────────────┴──────────┴────────┘
//! ```
//!
//! Numbers are little-endian; the message is postcard 1; the CRC is the record's (ISO-HDLC) over all before it. COBS
//! leaves no zero inside a frame (Cheshire & Baker 1999), so that a receiver finds the next frame after any damage.
//! Flag 1: the frame comes from a device. Flag 2: a seal stands behind the message; without it there is none.
//!
//! # Rules
//!
//! * Every [`Request`] has an id from 1 on, and every [`Reply`] has session and id of the request that it answers; the
//!   samples of a stream those of the request that started it.
//! * **Session.** [`Request::Identify`] brings a number that the host has drawn, [`Reply::Identity`] one that the device
//!   has drawn; the session is named by the CRC-32 of both ([`Nonces::session`]), and the answer's frame already has
//!   its name. It begins with the first request that bears it; until then the session before it goes on, so that a
//!   stray [`Request::Identify`] ends nothing. A request of another session is answered by [`Fault::Session`].
//! * **Window.** Within a session ids rise, by [`WINDOW`] at the most. Any other id is answered by [`Fault::Stale`],
//!   which names the last id taken, and does nothing. No id can lock a link: a host goes on above that id, or begins
//!   another session.
//! * **Echo.** A device drops what a device has sent, a host what a host has sent. What cannot be read is answered under
//!   the id 0, which no request may have, and once only until a frame is taken: no line can make a device talk to
//!   itself.
//! * **Seal.** Where the device has a key, a request that changes something ([`Request::changes`]) must have a seal:
//!   the first 16 bytes of HMAC-SHA-256 (RFC 2104) over both numbers of the session and the frame up to the seal. An
//!   answer is sealed if its request was, and a fault in a request's frame, session or seal never is.
//! * **Lock.** After [`Request::Lock`] whatever changes something is refused until the power goes, or until
//!   [`Request::Unlock`] comes with a seal.
//! * Observations say which one they are: sent again after a lost answer, they are answered with
//!   [`Fault::OutOfSequence`] and the index that is expected, and none is taken twice.
//!
//! # What protects against what
//!
//! | against | protects | does not protect |
//! | --- | --- | --- |
//! | noise, damage, cut or joined frames | CRC-32: one damaged frame in 4·10⁹ passes | |
//! | an echo, two devices on one line | the flag of direction | |
//! | a frame that comes again or from an earlier session, by accident or recorded | session and window, as long as the device's numbers do not come again ([`Guard::new`]) | |
//! | a mistaken program that speaks this protocol | [`Request::Lock`]; `replace` for another sensor's record | what it may do before the lock |
//! | a malicious line, its device without a key | [`Request::Lock`], until the power goes | anything else: whoever writes on the line is the host |
//! | a malicious line, its device with a key | the seal: no record, fit or lock is changed without the key, no sealed request is changed, repeated or moved to another session, no sealed answer is made up | reading (the record, samples), beginning a session, locking, streaming, faults and identities that are made up: it can always cut the line |
//! | whoever opens the case | nothing: a debug port reads the key and writes the flash. Lock the port by the chip's own means, and give each unit a key of its own | |
//!
//! # Stability policy
//!
//! Version, id and CRC keep their places in every version, and a frame of another version is refused by one that no
//! version changes: version 1, the id, and the message `09 02 v`, where v is the version that is spoken
//! ([`refuse_version`]). Within a version variants are appended, never inserted.
//!
//! | version | |
//! | --- | --- |
//! | 1 | no session, flags or seal: the message follows the id. A replay after a reset was taken |
//! | 2 | this |

mod capture;
mod fit;
mod frame;
mod guard;
mod key;
mod message;
mod session;
mod status;

pub use capture::{CaptureOutcome, CaptureSensor, CaptureState, CaptureTask, RawSample, RawSamples, SAMPLES};
pub use fit::{FitModel, FitProgress, FitReport, FitTask, MOST_COVARIANCE, MOST_PARAMETERS, Observation};
pub use frame::{
    Frame, FrameError, Header, MAX_FRAME, Origin, Receiver, VERSION_REFUSAL, encode, refuse_version, split,
};
pub use guard::{Asked, Guard};
pub use key::{Key, SEAL, Seal};
pub use message::{BATCH, Fault, Reply, Request, Values};
pub use session::{Nonces, WINDOW};
pub use status::{Capacity, Identity, LastReset, RecordState, ResetCause, Status};

/// Version of the messages that this library writes and reads.
pub const VERSION: u8 = 2;
