//! The device's end of a session: which frames are requests to be answered, and which are not.

use super::{Fault, Frame, Header, Key, Nonces, Origin, Request, Seal, session::Ids};

/// Whom an answer goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Asked {
    /// The session.
    pub session: u32,
    /// Id of the request.
    pub id: u32,
    /// It had a seal, and its answer has one.
    pub sealed: bool,
}

impl Asked {
    /// Nobody who could be read.
    pub const NOBODY: Self = Self { session: 0, id: 0, sealed: false };

    /// Who sent a frame that is refused: its answer has no seal.
    pub fn by(header: &Header) -> Self {
        Self { session: header.session, id: header.id, sealed: false }
    }
}

/// A session and what it is made of.
#[derive(Clone, Copy, Debug)]
struct Session {
    name: u32,
    nonces: Nonces,
}

impl Session {
    fn of(nonces: Nonces) -> Self {
        Self { name: nonces.session(), nonces }
    }
}

/// Sessions, ids, seals and the lock of one device; the rules are those of [`super`].
#[derive(Debug)]
pub struct Guard<'k> {
    key: Option<&'k Key>,
    boot: u64,
    /// Sessions offered since the start.
    offers: u32,
    current: Option<Session>,
    /// Identified, without a request yet.
    offered: Option<Session>,
    ids: Ids,
    locked: bool,
    /// What could not be read was answered, and no request has been taken since.
    complained: bool,
}

impl<'k> Guard<'k> {
    /// Of a device that has just started. `boot` never comes again: a random number, or a count of starts that is kept.
    /// Where it does come again, so may the requests of that session.
    pub fn new(key: Option<&'k Key>, boot: u64) -> Self {
        Self {
            key,
            boot,
            offers: 0,
            current: None,
            offered: None,
            ids: Ids::default(),
            locked: false,
            complained: false,
        }
    }

    /// Whether a frame may be a request; what a device has sent is an echo.
    pub fn is_for_us(&self, frame: &Frame<'_>) -> bool {
        frame.header.origin == Origin::Host
    }

    /// Whether a request is to be done, and whom its answer goes to.
    ///
    /// # Errors
    ///
    /// The fault that it is to be answered with.
    #[inline(never)]
    pub fn admit(&mut self, frame: &Frame<'_>, request: &Request<'_>) -> Result<Asked, Fault> {
        let id = frame.header.id;
        if id == 0 {
            return Err(Fault::Malformed);
        }
        if let Request::Identify { nonce } = request {
            return Ok(Asked { session: self.offer(*nonce), id, sealed: false });
        }
        let (session, ids) = self.session(frame.header.session).ok_or(Fault::Session)?;
        if !ids.takes(id) {
            return Err(Fault::Stale { last: ids.last });
        }
        let sealed = frame.seal.is_some();
        if sealed && !self.seal(&session).is_some_and(|seal| frame.is_sealed_by(&seal)) {
            return Err(Fault::WrongSeal);
        }
        if self.offered.is_some_and(|offered| offered.name == session.name) {
            self.offered = None;
        }
        (self.current, self.ids, self.complained) = (Some(session), Ids { last: id }, false);
        self.allow(request, sealed)?;
        Ok(Asked { session: session.name, id, sealed })
    }

    /// Whether what was taken may be done.
    fn allow(&mut self, request: &Request<'_>, sealed: bool) -> Result<(), Fault> {
        match request {
            Request::Unlock if sealed => self.locked = false,
            Request::Lock => self.locked = true,
            _ if !request.changes() => {}
            _ if self.key.is_some() && !sealed => return Err(Fault::KeyNeeded),
            _ if self.locked => return Err(Fault::Locked),
            _ => {}
        }
        Ok(())
    }

    /// The session of this name: the current one, or the one that is offered and begins now.
    fn session(&self, name: u32) -> Option<(Session, Ids)> {
        let current = self.current.map(|session| (session, self.ids));
        let offered = self.offered.map(|session| (session, Ids::default()));
        [current, offered].into_iter().flatten().find(|(session, _)| session.name == name)
    }

    fn offer(&mut self, host: u64) -> u32 {
        self.offers = self.offers.wrapping_add(1);
        let device = match self.key {
            Some(key) => key.nonce(self.boot, self.offers),
            None => mixed(self.boot, self.offers),
        };
        let session = Session::of(Nonces { host, device });
        (self.offered, self.complained) = (Some(session), false);
        session.name
    }

    /// The device's number of the session that is offered.
    pub fn nonce(&self) -> u64 {
        self.offered.map_or(0, |session| session.nonces.device)
    }

    fn seal(&self, session: &Session) -> Option<Seal<'k>> {
        Some(Seal { key: self.key?, nonces: session.nonces })
    }

    /// What seals an answer, if it is to have a seal.
    pub fn seal_for(&self, asked: &Asked) -> Option<Seal<'k>> {
        if !asked.sealed {
            return None;
        }
        self.seal(&self.current.filter(|session| session.name == asked.session)?)
    }

    /// Whether who asked is still in the session.
    pub fn is_current(&self, asked: &Asked) -> bool {
        self.current.is_some_and(|session| session.name == asked.session)
    }

    /// Whether to answer what could not be read.
    pub fn may_complain(&mut self) -> bool {
        !core::mem::replace(&mut self.complained, true)
    }

    /// Whether changes need the key's seal.
    pub fn is_keyed(&self) -> bool {
        self.key.is_some()
    }

    /// Whether changes are refused.
    pub fn is_locked(&self) -> bool {
        self.locked
    }
}

/// The `count`th number of SplitMix64 (Steele, Lea & Flood 2014) from a seed.
fn mixed(seed: u64, count: u32) -> u64 {
    let mut z = seed.wrapping_add(u64::from(count).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
