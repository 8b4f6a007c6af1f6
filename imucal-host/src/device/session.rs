//! Asking a device, and waiting for the answer.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use imucal_core::link::{
    Fault, FrameError, Identity, MAX_FRAME, Receiver, Reply, Request, Status, encode, split,
};

use super::{Address, DeviceError, line::Line};

/// An answer is there by then.
const PATIENCE: Duration = Duration::from_secs(3);
/// A record is in flash by then.
const FLASH_PATIENCE: Duration = Duration::from_secs(10);
/// A request is sent this often.
const TRIES: u32 = 3;

/// A conversation with a device. Lost and damaged answers are asked for again.
pub struct Session {
    address: String,
    line: Line,
    receiver: Receiver,
    next: u32,
    identity: Identity,
}

impl Session {
    /// Opens a line and asks who is there; `flash` is the file behind an emulated device's flash.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn open(address: &Address, flash: Option<&Path>) -> Result<Self, DeviceError> {
        let nobody = Identity {
            unit: Default::default(),
            firmware: (0, 0, 0),
            record_version: (0, 0),
            next_id: 1,
            capacity: imucal_core::link::Capacity { points: 0, poses: 0, turns: 0, blocks: 0, particles: 0 },
        };
        let line = Line::open(address, flash)?;
        let mut session = Self {
            address: address.to_string(),
            line,
            receiver: Receiver::default(),
            next: 1,
            identity: nobody,
        };
        // What was left on the line by whoever came before ends here.
        session.write(&[0])?;
        session.identity = session.ask(&Request::Identify, IDENTITY, |reply| match reply {
            Reply::Identity(identity) => Some(identity.clone()),
            _ => None,
        })?;
        session.next = session.identity.next_id.max(session.next);
        Ok(session)
    }

    /// Who is there.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// How the device is.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn status(&mut self) -> Result<Status, DeviceError> {
        self.ask(&Request::Status, "a status", |reply| match reply {
            Reply::Status(status) => Some(*status),
            _ => None,
        })
    }

    /// The stored record's bytes; `None` where none is stored.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn record(&mut self) -> Result<Option<Vec<u8>>, DeviceError> {
        let bytes = self.ask(&Request::GetRecord, "a record", |reply| match reply {
            Reply::Record(bytes) => Some(bytes.to_vec()),
            _ => None,
        });
        match bytes {
            Err(DeviceError::Refused { fault: Fault::NoRecord, .. }) => Ok(None),
            bytes => bytes.map(Some),
        }
    }

    /// Stores a record and uses it; its number.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn put_record(&mut self, record: &[u8], replace: bool) -> Result<u32, DeviceError> {
        self.store(&Request::PutRecord { record, replace })
    }

    /// Stores the record in use; its number.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn store_record(&mut self, replace: bool) -> Result<u32, DeviceError> {
        self.store(&Request::Store { replace })
    }

    fn store(&mut self, request: &Request<'_>) -> Result<u32, DeviceError> {
        self.ask_within(FLASH_PATIENCE, request, "that it is stored", |reply| match reply {
            Reply::Stored { sequence } => Some(*sequence),
            _ => None,
        })
    }

    /// Asks, and gives what `read` makes of the answer.
    pub(super) fn ask<R>(
        &mut self,
        request: &Request<'_>,
        expected: &'static str,
        read: impl Fn(&Reply<'_>) -> Option<R>,
    ) -> Result<R, DeviceError> {
        self.ask_within(PATIENCE, request, expected, read)
    }

    /// The same, where the answer takes a while.
    pub(super) fn ask_within<R>(
        &mut self,
        patience: Duration,
        request: &Request<'_>,
        expected: &'static str,
        read: impl Fn(&Reply<'_>) -> Option<R>,
    ) -> Result<R, DeviceError> {
        for _ in 0..TRIES {
            let id = self.send(request)?;
            if let Some(answer) = self.wait(id, patience, expected, &read)? {
                return Ok(answer);
            }
        }
        Err(DeviceError::Silent { address: self.address.clone(), patience, tries: TRIES })
    }

    fn send(&mut self, request: &Request<'_>) -> Result<u32, DeviceError> {
        let id = self.next;
        self.next += 1;
        let mut buffer = [0; MAX_FRAME];
        // The longest request fits, as the core tests.
        let frame = encode(id, request, &mut buffer).unwrap_or_default().to_vec();
        self.write(&frame)?;
        Ok(id)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.line.write(bytes).map_err(|cause| DeviceError::Broken { address: self.address.clone(), cause })
    }

    /// Waits for the answer to one request; `None` where it does not come, or the request was damaged on its way.
    fn wait<R>(
        &mut self,
        id: u32,
        patience: Duration,
        expected: &'static str,
        read: &impl Fn(&Reply<'_>) -> Option<R>,
    ) -> Result<Option<R>, DeviceError> {
        let end = Instant::now() + patience;
        let mut bytes = [0; 1024];
        while Instant::now() < end {
            let count = self
                .line
                .read(&mut bytes)
                .map_err(|cause| DeviceError::Broken { address: self.address.clone(), cause })?;
            for byte in &bytes[..count] {
                let Some(frame) = self.receiver.push(*byte) else { continue };
                match frame.and_then(split) {
                    Ok((header, message)) if header.id == id => {
                        return match header.read::<Reply<'_>>(message) {
                            Ok(Reply::Fault(fault)) => {
                                Err(DeviceError::Refused { address: self.address.clone(), fault })
                            }
                            Ok(reply) => read(&reply).map(Some).ok_or_else(|| DeviceError::Unexpected {
                                address: self.address.clone(),
                                found: format!("{reply:?}"),
                                expected,
                            }),
                            Err(FrameError::Version { found }) => Err(DeviceError::Unexpected {
                                address: self.address.clone(),
                                found: format!("in version {found} of the protocol"),
                                expected,
                            }),
                            Err(_) => Ok(None),
                        };
                    }
                    // Something could not be read there: most likely this request.
                    Ok((header, _)) if header.id == 0 && expected != IDENTITY => return Ok(None),
                    // An answer to what was given up, or damaged here.
                    _ => {}
                }
            }
        }
        Ok(None)
    }
}

/// What is expected of the first answer: the line may hold rests of another conversation before it.
const IDENTITY: &str = "an identity";
