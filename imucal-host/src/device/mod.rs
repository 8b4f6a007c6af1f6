//! A co-processor at the other end of a line: a serial port, a TCP connection, or QEMU that is started for it.
//!
//! The messages stand in [`imucal_core::link`]; here are the line, and who asks and waits for the answer.

mod address;
pub mod capture;
pub mod fit;
mod line;
mod qemu;
mod session;
pub mod stream;

pub use address::{Address, AddressError};
pub use session::Session;

use std::{io, time::Duration};

use imucal_core::link::{Fault, VERSION};

/// Why a device did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The line cannot be opened.
    #[error("{address}: cannot be opened: {cause}; {advice}")]
    Unreachable {
        /// Where to.
        address: String,
        /// Why not.
        cause: io::Error,
        /// What to do.
        advice: &'static str,
    },
    /// The line broke.
    #[error("{address}: the line broke: {cause}; check that the device is powered and connected")]
    Broken {
        /// Where to.
        address: String,
        /// Why.
        cause: io::Error,
    },
    /// No answer, however often it was asked.
    #[error(
        "{address}: no answer within {patience:?}, asked {tries} times; check the port, its speed and that the \
         co-processor's firmware runs"
    )]
    Silent {
        /// Who.
        address: String,
        /// How long it was waited for each answer.
        patience: Duration,
        /// How often it was asked.
        tries: u32,
    },
    /// The system gives no random number to begin a session with.
    #[error("no random number from the system: {0}")]
    NoRandomNumber(rand::rngs::SysError),
    /// It says no.
    #[error("{address}: refused: {}", of_fault(.fault))]
    Refused {
        /// Who.
        address: String,
        /// Why.
        fault: Fault,
    },
    /// It answers something else than was asked.
    #[error("{address}: answered {found}, expected {expected}; its firmware may be of another version")]
    Unexpected {
        /// Who.
        address: String,
        /// What came.
        found: String,
        /// What should have come.
        expected: &'static str,
    },
}

/// A refusal in words, with what to do.
fn of_fault(fault: &Fault) -> String {
    match fault {
        Fault::Version { supported } => {
            format!(
                "it speaks version {supported} of the protocol, and this program version {VERSION}; flash the \
                 firmware that goes with this program"
            )
        }
        Fault::NoRecord => {
            "no calibration is in use for this sensor; put a record, or calibrate on board".into()
        }
        Fault::BadRecord => "the record is damaged".into(),
        Fault::NewerFormat => "the record's format is newer than its firmware; update the firmware".into(),
        Fault::OtherSensor => "the record was made for a sensor of another serial".into(),
        Fault::Occupied => {
            "it keeps a record of another sensor or of a newer format; add --replace to overwrite that".into()
        }
        Fault::Full => "it has no room for so many observations; feed fewer".into(),
        Fault::Flash => "its flash did not take the record, and the last one is still there".into(),
        Fault::Busy => "it is still at work on another request; ask again".into(),
        Fault::NotReady => {
            "no fit or session is under way, or it has not come so far; after a start of the device begin again".into()
        }
        Fault::Unsuited => "it has no memory for that, or does not fit that model".into(),
        Fault::Session => {
            "it is in another session: it has started again, or another program talks to it; run the command again"
                .into()
        }
        Fault::KeyNeeded => "it changes nothing without its key; add --key with the key's file".into(),
        Fault::WrongSeal => "the key is not the device's, or the device has none; check --key".into(),
        Fault::Locked => {
            "it is locked; switch its power off and on, or unlock it with its key (`imucal device unlock`)".into()
        }
        Fault::Implausible(defect) => {
            format!("no sensor can have this calibration: {defect}; check its units, and calibrate again")
        }
        Fault::OtherUnit { sensor, expected } => format!(
            "the calibration is not for the unit that its board puts out: {} comes in {}",
            sensor.symbol(),
            expected.symbol()
        ),
        other => format!("{other:?}"),
    }
}
