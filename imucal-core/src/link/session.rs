//! What a session is named by, and which ids it takes.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// How far an id may be above the last one taken: a host that loses more requests in a row begins another session.
pub const WINDOW: u32 = 256;

/// The numbers that a session is made of. Each side draws its own, so that neither takes an old session for its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Nonces {
    /// The host's.
    pub host: u64,
    /// The device's.
    pub device: u64,
}

impl Nonces {
    /// The session's name in a frame: CRC-32 of the host's number and then the device's, both little-endian. Two
    /// sessions have the same by chance once in 4·10⁹; a seal is over the numbers themselves.
    pub fn session(&self) -> u32 {
        let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        digest.update(&self.bytes());
        digest.finalize()
    }

    /// As the seal takes them.
    pub(super) fn bytes(&self) -> [u8; 16] {
        (u128::from(self.host) | u128::from(self.device) << 64).to_le_bytes()
    }
}

/// Ids of one session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Ids {
    /// The last one taken.
    pub(super) last: u32,
}

impl Ids {
    /// Whether an id is above the last one, and not too far.
    pub(super) fn takes(self, id: u32) -> bool {
        id.checked_sub(self.last).is_some_and(|ahead| (1..=WINDOW).contains(&ahead))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_rise_by_a_window_at_the_most() {
        for last in [0, 7, 1_000_000] {
            let ids = Ids { last };
            assert!(!ids.takes(last) && !ids.takes(0) && !ids.takes(u32::MAX));
            assert!(ids.takes(last + 1) && ids.takes(last + WINDOW) && !ids.takes(last + WINDOW + 1));
        }
        let ids = Ids { last: u32::MAX - 1 };
        assert!(ids.takes(u32::MAX) && !ids.takes(0) && !ids.takes(1));
        assert!(!Ids { last: u32::MAX }.takes(u32::MAX));
    }

    #[test]
    fn a_session_is_named_by_both_numbers() {
        let nonces = Nonces { host: 1, device: 2 };
        let other =
            [Nonces { host: 1, device: 3 }, Nonces { host: 3, device: 2 }, Nonces { host: 2, device: 1 }];
        assert!(other.iter().all(|other| other.session() != nonces.session()));
    }
}
