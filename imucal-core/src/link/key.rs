//! The key of a device, and the seals that it makes.
//!
//! HMAC-SHA-256 (RFC 2104, FIPS 180-4) of the crates `hmac` and `sha2`, its first half. Without the feature `key` there
//! are no keys: the type has no values, and nothing of it reaches an image.

use super::Nonces;

/// Bytes of a seal.
pub const SEAL: usize = 16;

/// A key that device and host share, 32 bytes.
#[cfg(feature = "key")]
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; 32]);

/// A key; there are none without the feature `key`.
#[cfg(not(feature = "key"))]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Key {}

/// What seals a frame: a key, and the session that the frame belongs to.
#[derive(Clone, Copy, Debug)]
pub struct Seal<'k> {
    /// The key.
    pub key: &'k Key,
    /// The session's numbers.
    pub nonces: Nonces,
}

impl Seal<'_> {
    /// Seals bytes.
    pub fn of(&self, bytes: &[u8]) -> [u8; SEAL] {
        self.key.seal(&self.nonces, bytes)
    }

    /// Whether a seal is this one's of these bytes; in a time that does not depend on where it is wrong.
    pub fn is_of(&self, bytes: &[u8], seal: &[u8; SEAL]) -> bool {
        self.key.is_seal(&self.nonces, bytes, seal)
    }
}

#[cfg(feature = "key")]
mod keyed {
    use core::fmt;

    use hmac::{Hmac, KeyInit, Mac};
    use sha2::Sha256;

    use super::{Key, SEAL};
    use crate::link::Nonces;

    /// Of 16 hexadecimal digits' value.
    const fn digit(byte: u8) -> Option<u8> {
        match byte {
            b'0'..=b'9' => Some(byte - b'0'),
            b'a'..=b'f' => Some(byte - b'a' + 10),
            b'A'..=b'F' => Some(byte - b'A' + 10),
            _ => None,
        }
    }

    impl Key {
        /// Of its bytes.
        pub const fn new(bytes: [u8; 32]) -> Self {
            Self(bytes)
        }

        /// Of 64 hexadecimal digits; `None` where they are none.
        pub const fn from_hex(digits: &str) -> Option<Self> {
            let (mut pairs, []) = digits.as_bytes().as_chunks::<2>() else { return None };
            let mut key = [0; 32];
            let mut free: &mut [u8] = &mut key;
            while let ([first, rest @ ..], [slot, left @ ..]) = (pairs, free) {
                let (Some(high), Some(low)) = (digit(first[0]), digit(first[1])) else { return None };
                *slot = 16 * high + low;
                (pairs, free) = (rest, left);
            }
            if digits.len() == 64 { Some(Self(key)) } else { None }
        }

        fn mac(&self, parts: [&[u8]; 2]) -> Hmac<Sha256> {
            let mut block = hmac::digest::Key::<Hmac<Sha256>>::default();
            // A key shorter than a block is filled up with zeros (RFC 2104, 2).
            for (slot, byte) in block.iter_mut().zip(&self.0) {
                *slot = *byte;
            }
            let mut mac = Hmac::<Sha256>::new(&block);
            parts.iter().for_each(|part| mac.update(part));
            mac
        }

        #[inline(never)]
        pub(super) fn seal(&self, nonces: &Nonces, bytes: &[u8]) -> [u8; SEAL] {
            let whole = self.mac([&nonces.bytes(), bytes]).finalize().into_bytes();
            let mut seal = [0; SEAL];
            seal.iter_mut().zip(&whole).for_each(|(slot, byte)| *slot = *byte);
            seal
        }

        #[inline(never)]
        pub(super) fn is_seal(&self, nonces: &Nonces, bytes: &[u8], seal: &[u8; SEAL]) -> bool {
            self.mac([&nonces.bytes(), bytes]).verify_truncated_left(seal).is_ok()
        }

        /// A number that nobody foretells without the key: the `count`th since start `boot`. What it is made of is
        /// shorter than what any seal is made of.
        #[inline(never)]
        pub(in crate::link) fn nonce(&self, boot: u64, count: u32) -> u64 {
            let [a, b, c, d, e, f, g, h, ..] = <[u8; 32]>::from(
                self.mac([&boot.to_le_bytes(), &count.to_le_bytes()]).finalize().into_bytes(),
            );
            u64::from_le_bytes([a, b, c, d, e, f, g, h])
        }
    }

    /// Its bytes are not for logs.
    impl fmt::Debug for Key {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("Key")
        }
    }
}

#[cfg(not(feature = "key"))]
impl Key {
    fn seal(&self, _: &Nonces, _: &[u8]) -> [u8; SEAL] {
        match *self {}
    }

    fn is_seal(&self, _: &Nonces, _: &[u8], _: &[u8; SEAL]) -> bool {
        match *self {}
    }

    pub(super) fn nonce(&self, _: u64, _: u32) -> u64 {
        match *self {}
    }
}

#[cfg(all(test, feature = "key"))]
mod tests {
    use super::*;

    #[test]
    fn seals_and_nonces_are_those_of_another_implementation() {
        // Python's: hmac.new(bytes(range(32)), struct.pack("<QQ", ..) + b"imucal", "sha256"), and of pack("<QI", 5, 7).
        let key = Key::new(core::array::from_fn(|k| k as u8));
        let nonces = Nonces { host: 0x0102_0304_0506_0708, device: 0x1112_1314_1516_1718 };
        let seal = Seal { key: &key, nonces };
        let expected = 0x3aed_6d71_7819_1ff4_6d19_fc67_ea0e_387d_u128.to_be_bytes();
        assert_eq!(seal.of(b"imucal"), expected);
        assert!(seal.is_of(b"imucal", &expected) && !seal.is_of(b"imucal.", &expected));
        assert_eq!(key.nonce(5, 7), 0x875f_b818_cc5a_918e);
    }

    #[test]
    fn keys_are_64_hexadecimal_digits() {
        let digits = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F";
        assert_eq!(Key::from_hex(digits), Some(Key::new(core::array::from_fn(|k| k as u8))));
        for wrong in ["", &digits[1..], &digits[2..], &digits.replace('f', "g")] {
            assert_eq!(Key::from_hex(wrong), None, "{wrong}");
        }
        assert_eq!(Key::from_hex(&[digits, "00"].concat()), None);
    }
}
