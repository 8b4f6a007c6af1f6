//! One frame on its way out.

use imucal_core::link::{Asked, Header, MAX_FRAME, Reply, Seal, encode, refuse_version};

use crate::board::ByteLink;

#[derive(Clone, Debug)]
pub(super) struct Outgoing {
    bytes: [u8; MAX_FRAME],
    sent: usize,
    length: usize,
}

impl Outgoing {
    pub(super) const fn new() -> Self {
        Self { bytes: [0; MAX_FRAME], sent: 0, length: 0 }
    }

    /// Nothing is on its way.
    pub(super) fn is_free(&self) -> bool {
        self.sent >= self.length
    }

    /// Puts a reply on its way; only while [`is_free`](Self::is_free).
    #[inline(never)]
    pub(super) fn send(&mut self, asked: &Asked, seal: Option<Seal<'_>>, reply: &Reply<'_>) {
        // Every reply fits: `link` tests the longest.
        self.length = encode(&Header::answer(asked), reply, seal, &mut self.bytes).map_or(0, <[u8]>::len);
        self.sent = 0;
    }

    /// Puts the refusal of a frame of another version on its way.
    #[inline(never)]
    pub(super) fn refuse_version(&mut self, id: u32) {
        self.length = refuse_version(id, &mut self.bytes).len();
        self.sent = 0;
    }

    /// Sends what the link takes now.
    pub(super) fn flush(&mut self, link: &mut impl ByteLink) {
        while let Some(byte) = self.bytes.get(self.sent).filter(|_| self.sent < self.length) {
            if !link.send(*byte) {
                break;
            }
            self.sent += 1;
        }
    }
}
