//! Numbers and texts of a message, in ROS 1's encoding and in CDR.
//!
//! Both are in the order of the definition. CDR (OMG, XCDR 1) begins with four bytes that say the order of bytes; a number then
//! stands at a multiple of its size, and a text has a zero at its end, which counts. XCDR 2 aligns to four bytes at the most.

/// What a message is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ros1,
    Cdr,
}

/// Bytes of a message, from one field to the next.
#[derive(Debug)]
pub(crate) struct Wire<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Numbers stand at multiples of their size, up to this.
    alignment: usize,
    big: bool,
    encoding: Encoding,
}

/// A message under way in CDR, its numbers little-endian.
#[derive(Debug)]
pub(crate) struct Cdr {
    bytes: Vec<u8>,
}

impl Cdr {
    const HEAD: [u8; 4] = [0, 1, 0, 0];

    pub(crate) fn new() -> Self {
        Self { bytes: Self::HEAD.to_vec() }
    }

    fn put<const N: usize>(&mut self, number: [u8; N]) {
        let body = self.bytes.len() - Self::HEAD.len();
        self.bytes.resize(Self::HEAD.len() + body.next_multiple_of(N), 0);
        self.bytes.extend(number);
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.put(value.to_le_bytes());
    }

    pub(crate) fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.put(value.to_le_bytes()));
    }

    /// A text shorter than 4 GiB.
    pub(crate) fn text(&mut self, text: &str) {
        self.u32(u32::try_from(text.len() + 1).unwrap_or(u32::MAX));
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    pub(crate) fn bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// What is wrong with a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct WireFault {
    pub(crate) found: String,
    pub(crate) expected: String,
}

impl WireFault {
    pub(crate) fn new(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { found: found.into(), expected: expected.into() }
    }
}

impl<'a> Wire<'a> {
    pub(crate) fn new(message: &'a [u8], encoding: Encoding) -> Result<Self, WireFault> {
        let plain = |bytes, alignment, big| Self { bytes, at: 0, alignment, big, encoding };
        if encoding == Encoding::Ros1 {
            return Ok(plain(message, 1, false));
        }
        let (head, body) = message.split_at_checked(4).ok_or_else(|| {
            WireFault::new(
                format!("a message of {} bytes", message.len()),
                "the four bytes that CDR begins with",
            )
        })?;
        match head {
            [0, 0, ..] => Ok(plain(body, 8, true)),
            [0, 1, ..] => Ok(plain(body, 8, false)),
            [0, 6, ..] => Ok(plain(body, 4, true)),
            [0, 7, ..] => Ok(plain(body, 4, false)),
            _ => Err(WireFault::new(
                format!(
                    "CDR of the kind {:02x}{:02x}",
                    head.first().unwrap_or(&0),
                    head.get(1).unwrap_or(&0)
                ),
                "plain CDR (0000, 0001, 0006 or 0007)",
            )),
        }
    }

    pub(crate) fn encoding(&self) -> Encoding {
        self.encoding
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], WireFault> {
        let to = self.alignment.min(N);
        let at = self.at.next_multiple_of(to);
        let bytes = self.bytes.get(at..).and_then(|rest| rest.first_chunk::<N>());
        let bytes = *bytes.ok_or_else(|| self.short())?;
        self.at = at + N;
        Ok(bytes)
    }

    fn short(&self) -> WireFault {
        WireFault::new(format!("an end after {} bytes", self.bytes.len()), "all fields of the definition")
    }

    pub(crate) fn u32(&mut self) -> Result<u32, WireFault> {
        let bytes = self.take()?;
        Ok(if self.big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    pub(crate) fn i32(&mut self) -> Result<i32, WireFault> {
        Ok(self.u32()?.cast_signed())
    }

    pub(crate) fn f64(&mut self) -> Result<f64, WireFault> {
        let bytes = self.take()?;
        Ok(if self.big { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
    }

    pub(crate) fn f64s<const N: usize>(&mut self) -> Result<[f64; N], WireFault> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    pub(crate) fn text(&mut self) -> Result<&'a str, WireFault> {
        let length = self.u32()? as usize;
        let bytes = self.bytes.get(self.at..).and_then(|rest| rest.get(..length));
        let bytes = bytes.ok_or_else(|| {
            WireFault::new(format!("a text of {length} bytes"), "one that ends within the message")
        })?;
        self.at += length;
        let bytes = match self.encoding {
            Encoding::Cdr => bytes.strip_suffix(&[0]).unwrap_or(bytes),
            Encoding::Ros1 => bytes,
        };
        std::str::from_utf8(bytes).map_err(|_| WireFault::new("a text that is not UTF-8", "UTF-8"))
    }

    /// Nothing but padding is left.
    pub(crate) fn end(&self) -> Result<(), WireFault> {
        let padding = match self.encoding {
            Encoding::Cdr => 7,
            Encoding::Ros1 => 0,
        };
        let left = self.bytes.len().saturating_sub(self.at);
        if left <= padding {
            return Ok(());
        }
        Err(WireFault::new(format!("{left} bytes behind the last field"), "as many as the definition has"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cdr_aligns_numbers_and_ends_texts_and_ros_1_does_not() {
        let cdr = [&[0, 1, 0, 0, 2, 0, 0, 0, b'a', 0, 9, 9][..], &1.5f64.to_le_bytes()].concat();
        // The text ends at 6, so that the number is at 8 of XCDR 1.
        let mut wire = Wire::new(&cdr, Encoding::Cdr).unwrap();
        assert_eq!((wire.text(), wire.f64(), wire.end()), (Ok("a"), Ok(1.5), Ok(())));
        let plain = [&[1, 0, 0, 0, b'a'][..], &1.5f64.to_le_bytes()].concat();
        let mut wire = Wire::new(&plain, Encoding::Ros1).unwrap();
        assert_eq!((wire.text(), wire.f64(), wire.end()), (Ok("a"), Ok(1.5), Ok(())));
    }

    #[test]
    fn the_order_of_bytes_and_the_alignment_are_as_the_head_says() {
        for (kind, number, pad) in [
            (0, 1.5f64.to_be_bytes(), 4),
            (1, 1.5f64.to_le_bytes(), 4),
            (6, 1.5f64.to_be_bytes(), 0),
            (7, 1.5f64.to_le_bytes(), 0),
        ] {
            let seven = if kind % 6 == 0 { 7u32.to_be_bytes() } else { 7u32.to_le_bytes() };
            let bytes = [&[0, kind, 0, 0][..], &seven, &vec![9; pad], &number].concat();
            let mut wire = Wire::new(&bytes, Encoding::Cdr).unwrap();
            assert_eq!((wire.u32(), wire.f64(), wire.end()), (Ok(7), Ok(1.5), Ok(())), "{kind}");
        }
        assert!(Wire::new(&[0, 3, 0, 0], Encoding::Cdr).is_err());
        assert!(Wire::new(&[0, 1], Encoding::Cdr).is_err());
    }

    #[test]
    fn a_message_that_is_too_short_or_too_long_is_a_fault() {
        let mut wire = Wire::new(&[5, 0, 0, 0, b'a'], Encoding::Ros1).unwrap();
        assert!(wire.text().is_err());
        let mut wire = Wire::new(&[0; 9], Encoding::Ros1).unwrap();
        assert_eq!(wire.f64(), Ok(0.0));
        assert!(wire.end().is_err() && wire.f64().is_err());
    }
}
