//! Asking a device, and waiting for the answer.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use imucal_core::link::{
    Fault, Frame, FrameError, Header, Identity, Key, LastReset, MAX_FRAME, Nonces, Origin, Receiver, Reply,
    Request, Seal, Status, encode, split,
};
use rand::{TryRng, rngs::SysRng};

use super::{Address, DeviceError, line::Line};

/// An answer is there by then.
const PATIENCE: Duration = Duration::from_secs(3);
/// A record is in flash by then.
const FLASH_PATIENCE: Duration = Duration::from_secs(10);
/// A request is sent this often.
const TRIES: u32 = 3;

/// A session with a device, by the rules of [`imucal_core::link`]. Lost and damaged answers are asked for again.
pub struct Session {
    address: String,
    line: Line,
    receiver: Receiver,
    next: u32,
    identity: Identity,
    nonces: Nonces,
    /// The session's name; 0 before there is one.
    name: u32,
    /// Seals each request, where the device has a key too.
    key: Option<Key>,
}

/// What one answer came to.
enum Heard<R> {
    /// The answer.
    Answer(R),
    /// None, or none that can be read: the request is sent again.
    Nothing,
}

impl Session {
    /// Opens a line and asks who is there; `flash` is the file behind an emulated device's flash.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn open(address: &Address, flash: Option<&Path>) -> Result<Self, DeviceError> {
        Self::open_with(address, flash, None)
    }

    /// The same with the device's key, without which one that has a key changes nothing.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn open_with(address: &Address, flash: Option<&Path>, key: Option<Key>) -> Result<Self, DeviceError> {
        let nobody = Identity {
            unit: Default::default(),
            firmware: (0, 0, 0),
            record_version: (0, 0),
            nonce: 0,
            keyed: false,
            capacity: imucal_core::link::Capacity { points: 0, poses: 0, turns: 0, blocks: 0, particles: 0 },
        };
        let host = SysRng.try_next_u64().map_err(DeviceError::NoRandomNumber)?;
        let line = Line::open(address, flash)?;
        let mut session = Self {
            address: address.to_string(),
            line,
            receiver: Receiver::default(),
            next: 1,
            identity: nobody,
            nonces: Nonces { host, device: 0 },
            name: 0,
            key,
        };
        // What was left on the line by whoever came before ends here.
        session.write(&[0])?;
        session.identity =
            session.ask(&Request::Identify { nonce: host }, IDENTITY, |reply| match reply {
                Reply::Identity(identity) => Some(identity.clone()),
                _ => None,
            })?;
        session.nonces.device = session.identity.nonce;
        (session.name, session.next) = (session.nonces.session(), 1);
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

    /// How the device's last run ended; `None` of firmware that does not say.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn last_reset(&mut self) -> Result<Option<LastReset>, DeviceError> {
        let last = self.ask(&Request::LastReset, "how its last run ended", |reply| match reply {
            Reply::LastReset(last) => Some(*last),
            _ => None,
        });
        match last {
            Err(DeviceError::Refused { fault: Fault::Malformed, .. }) => Ok(None),
            last => last.map(Some),
        }
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

    /// Has the device refuse whatever changes something, until its power goes or it is unlocked.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn lock(&mut self) -> Result<(), DeviceError> {
        self.done(&Request::Lock)
    }

    /// Ends that; only with the device's key.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn unlock(&mut self) -> Result<(), DeviceError> {
        self.done(&Request::Unlock)
    }

    pub(super) fn done(&mut self, request: &Request<'_>) -> Result<(), DeviceError> {
        self.ask(request, "that it is done", |reply| matches!(reply, Reply::Done).then_some(()))
    }

    pub(super) fn store(&mut self, request: &Request<'_>) -> Result<u32, DeviceError> {
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
            if let Heard::Answer(answer) = self.wait(id, patience, expected, &read)? {
                return Ok(answer);
            }
        }
        Err(DeviceError::Silent { address: self.address.clone(), patience, tries: TRIES })
    }

    fn send(&mut self, request: &Request<'_>) -> Result<u32, DeviceError> {
        let id = self.next;
        self.next += 1;
        let header = Header { id, origin: Origin::Host, session: self.name };
        let mut buffer = [0; MAX_FRAME];
        // The longest request fits, as the core tests.
        let frame = encode(&header, request, self.seal(), &mut buffer).unwrap_or_default().to_vec();
        self.write(&frame)?;
        Ok(id)
    }

    /// What seals this session's frames; nothing before there is one.
    fn seal(&self) -> Option<Seal<'_>> {
        let key = self.key.as_ref().filter(|_| self.identity.keyed)?;
        Some(Seal { key, nonces: self.nonces })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.line.write(bytes).map_err(|cause| DeviceError::Broken { address: self.address.clone(), cause })
    }

    /// Waits for the answer to one request.
    fn wait<R>(
        &mut self,
        id: u32,
        patience: Duration,
        expected: &'static str,
        read: &impl Fn(&Reply<'_>) -> Option<R>,
    ) -> Result<Heard<R>, DeviceError> {
        let end = Instant::now() + patience;
        let mut bytes = [0; 1024];
        while Instant::now() < end {
            let count = self
                .line
                .read(&mut bytes)
                .map_err(|cause| DeviceError::Broken { address: self.address.clone(), cause })?;
            for byte in &bytes[..count] {
                let Some(plain) = self.receiver.push(*byte) else { continue };
                let plain = plain.map(<[u8]>::to_vec);
                let frame = plain.as_deref().map_err(|error| *error).and_then(split);
                if let Some(heard) = self.hear(frame, id, expected, read)? {
                    return Ok(heard);
                }
            }
        }
        Ok(Heard::Nothing)
    }

    /// What a frame is to whoever waits for the answer to a request; `None` where it is none of his.
    fn hear<R>(
        &mut self,
        frame: Result<Frame<'_>, FrameError>,
        id: u32,
        expected: &'static str,
        read: &impl Fn(&Reply<'_>) -> Option<R>,
    ) -> Result<Option<Heard<R>>, DeviceError> {
        let address = || self.address.clone();
        let frame = match frame {
            Ok(frame) if frame.header.origin == Origin::Device => frame,
            Err(FrameError::Refused { supported, id: refused }) if refused == id => {
                return Err(DeviceError::Refused { address: address(), fault: Fault::Version { supported } });
            }
            Err(FrameError::Version { found, id: answered }) if answered == id => {
                let found = format!("in version {found} of the protocol");
                return Err(DeviceError::Unexpected { address: address(), found, expected });
            }
            // What was sent here, by an echo; or an answer that was damaged.
            _ => return Ok(None),
        };
        // Something could not be read there: most likely this request.
        if frame.header.id == 0 && self.name != 0 {
            return Ok(Some(Heard::Nothing));
        }
        if frame.header.id != id {
            return Ok(None);
        }
        match frame.read::<Reply<'_>>() {
            // The id is used up, by whomever: the next one is above that.
            Ok(Reply::Fault(Fault::Stale { last })) => {
                self.next = self.next.max(last.saturating_add(1));
                Ok(Some(Heard::Nothing))
            }
            Ok(Reply::Fault(fault)) => Err(DeviceError::Refused { address: address(), fault }),
            // Of another session, or made up.
            Ok(reply) if !self.is_answer(&frame, &reply) => Ok(None),
            Ok(reply) => read(&reply).map(|answer| Some(Heard::Answer(answer))).ok_or_else(|| {
                DeviceError::Unexpected { address: address(), found: format!("{reply:?}"), expected }
            }),
            Err(_) => Ok(Some(Heard::Nothing)),
        }
    }

    /// Whether it is of this session and has the seal that it must have; before the session, whether it names the one
    /// that it offers.
    fn is_answer(&self, frame: &Frame<'_>, reply: &Reply<'_>) -> bool {
        let name = match reply {
            Reply::Identity(identity) => Nonces { device: identity.nonce, ..self.nonces }.session(),
            _ => self.name,
        };
        frame.header.session == name && self.seal().is_none_or(|seal| frame.is_sealed_by(&seal))
    }
}

/// What is expected of the first answer: the line may hold rests of another conversation before it.
const IDENTITY: &str = "an identity";
