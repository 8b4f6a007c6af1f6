//! Sealing: what is hidden from a diagnosis is hashed before it runs, and opened after.

use rand::{
    TryRng,
    rngs::{SysError, SysRng},
};
use sha2::{Digest, Sha256};

/// A secret of which a whole set of cases follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nonce([u8; 32]);

impl Nonce {
    /// A fresh one from the system.
    ///
    /// # Errors
    ///
    /// [`SysError`], when the system gives no random numbers.
    pub fn fresh() -> Result<Self, SysError> {
        let mut bytes = [0; 32];
        SysRng.try_fill_bytes(&mut bytes)?;
        Ok(Self(bytes))
    }

    /// One of 64 hexadecimal digits, or of fewer, which then are its last.
    pub fn parse(text: &str) -> Option<Self> {
        let digits: Vec<u8> =
            text.chars().map(|digit| digit.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
        if digits.is_empty() || digits.len() > 64 {
            return None;
        }
        let mut bytes = [0; 32];
        for (place, digit) in digits.iter().rev().enumerate() {
            bytes[31 - place / 2] |= digit << (4 * (place % 2));
        }
        Some(Self(bytes))
    }

    /// Its hexadecimal digits.
    pub fn hex(&self) -> String {
        hex(&self.0)
    }

    /// What follows of it for a purpose, one way: it says nothing of the nonce, nor of what follows for another.
    pub fn derive(&self, purpose: &str) -> [u8; 32] {
        Sha256::new().chain_update(purpose).chain_update(self.0).finalize().into()
    }

    /// A seed for a purpose.
    pub fn seed(&self, purpose: &str) -> u64 {
        self.derive(purpose).iter().take(8).fold(0, |seed, byte| seed << 8 | u64::from(*byte))
    }
}

/// SHA-256 of a text, in hexadecimal digits.
pub fn digest(text: &str) -> String {
    hex(&Sha256::digest(text.as_bytes()))
}

/// Hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nonce_is_read_as_it_is_written() {
        let nonce = Nonce::fresh().unwrap();
        assert_eq!(Nonce::parse(&nonce.hex()), Some(nonce));
        assert_ne!(Nonce::fresh().unwrap(), nonce);
        assert_eq!(Nonce::parse("1f").unwrap().hex(), format!("{:0>64}", "1f"));
        for wrong in ["", "xyz", &"0".repeat(65)] {
            assert_eq!(Nonce::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn purposes_have_seeds_of_their_own() {
        let nonce = Nonce::parse("7").unwrap();
        assert_ne!(nonce.seed("one"), nonce.seed("other"));
        assert_ne!(nonce.seed("one"), Nonce::parse("8").unwrap().seed("one"));
    }

    #[test]
    fn the_digest_is_that_of_the_standard() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(digest("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
