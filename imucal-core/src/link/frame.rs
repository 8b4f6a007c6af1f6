//! Messages to frames and back.

use cobs::{DecodeResult, DecoderState};
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use serde::{Deserialize, Serialize};

use super::VERSION;
use crate::record;

/// Version and id.
const HEADER: usize = 1 + 4;
const CHECKSUM: usize = 4;
/// The longest message: a record, its variant and its length; all others are shorter.
const MAX_MESSAGE: usize = record::MAX_LEN + 8;
/// The longest frame before COBS.
const MAX_PLAIN: usize = HEADER + MAX_MESSAGE + CHECKSUM;
/// The longest frame as it is sent, bytes: COBS adds one byte in 254 at the most, and a zero ends the frame.
pub const MAX_FRAME: usize = MAX_PLAIN + MAX_PLAIN.div_ceil(254) + 1;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why a frame was not read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// Longer than [`MAX_FRAME`].
    Oversized,
    /// Not COBS, too short, or its CRC is wrong.
    Damaged,
    /// A frame of another version; its id can be told nevertheless.
    Version {
        /// The frame's.
        found: u8,
    },
    /// Intact, but no message of this version.
    Malformed,
}

/// What stands before the message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Version of the message.
    pub version: u8,
    /// Id of the request.
    pub id: u32,
}

/// Writes a frame to the start of `buffer`; gives the bytes to send.
///
/// # Errors
///
/// [`FrameError::Oversized`] where the frame is longer than the buffer; one of [`MAX_FRAME`] bytes always suffices.
pub fn encode<'b>(
    id: u32,
    message: &impl Serialize,
    buffer: &'b mut [u8; MAX_FRAME],
) -> Result<&'b [u8], FrameError> {
    let mut plain = [0; MAX_PLAIN];
    let length = write(id, message, &mut plain).ok_or(FrameError::Oversized)?;
    let plain = plain.get(..length).ok_or(FrameError::Oversized)?;
    let encoded = cobs::try_encode(plain, buffer).map_err(|_| FrameError::Oversized)?;
    *buffer.get_mut(encoded).ok_or(FrameError::Oversized)? = 0;
    buffer.get(..=encoded).ok_or(FrameError::Oversized)
}

/// The frame before COBS; its length.
fn write(id: u32, message: &impl Serialize, plain: &mut [u8; MAX_PLAIN]) -> Option<usize> {
    let [a, b, c, d] = id.to_le_bytes();
    *plain.first_chunk_mut::<HEADER>()? = [VERSION, a, b, c, d];
    let body = plain.get_mut(HEADER..HEADER + MAX_MESSAGE)?;
    let end = HEADER + postcard::to_slice(message, body).ok()?.len();
    let checksum = CRC.checksum(plain.get(..end)?).to_le_bytes();
    plain.get_mut(end..end + CHECKSUM)?.copy_from_slice(&checksum);
    Some(end + CHECKSUM)
}

/// Splits a frame without COBS into its header and the message's bytes.
///
/// # Errors
///
/// [`FrameError::Damaged`].
pub fn split(plain: &[u8]) -> Result<(Header, &[u8]), FrameError> {
    let (checked, stored) = plain.split_last_chunk::<CHECKSUM>().ok_or(FrameError::Damaged)?;
    let (header, message) = checked.split_first_chunk::<HEADER>().ok_or(FrameError::Damaged)?;
    if CRC.checksum(checked) != u32::from_le_bytes(*stored) {
        return Err(FrameError::Damaged);
    }
    let [version, a, b, c, d] = *header;
    Ok((Header { version, id: u32::from_le_bytes([a, b, c, d]) }, message))
}

impl Header {
    /// Reads the message behind this header.
    ///
    /// # Errors
    ///
    /// [`FrameError::Version`] or [`FrameError::Malformed`].
    pub fn read<'a, M: Deserialize<'a>>(&self, message: &'a [u8]) -> Result<M, FrameError> {
        if self.version != VERSION {
            return Err(FrameError::Version { found: self.version });
        }
        match postcard::take_from_bytes(message) {
            Ok((message, [])) => Ok(message),
            _ => Err(FrameError::Malformed),
        }
    }
}

/// Gathers bytes to frames, whatever comes: a frame that is too long is passed over to its end.
#[derive(Debug)]
pub struct Receiver {
    bytes: [u8; MAX_PLAIN],
    length: usize,
    state: DecoderState,
    oversized: bool,
}

impl Default for Receiver {
    fn default() -> Self {
        Self { bytes: [0; MAX_PLAIN], length: 0, state: DecoderState::Idle, oversized: false }
    }
}

impl Receiver {
    /// Takes one byte; a frame without COBS, or why there is none, once its end has come. Zeros between frames are
    /// passed over.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                (self.length, self.oversized) = (0, false);
                None
            }
            Ok(DecodeResult::DataContinue(decoded)) => {
                match self.bytes.get_mut(self.length) {
                    Some(slot) => {
                        *slot = decoded;
                        self.length += 1;
                    }
                    None => self.oversized = true,
                }
                None
            }
            Ok(DecodeResult::DataComplete) => Some(self.bytes.get(..self.length).ok_or(FrameError::Damaged)),
            Err(_) => Some(Err(FrameError::Damaged)),
        }
        .map(|frame| if self.oversized { Err(FrameError::Oversized) } else { frame })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Reply, Request};
    use proptest::prelude::*;
    use std::vec::Vec;

    fn frames(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
        bytes.iter().filter_map(|byte| receiver.push(*byte).map(|frame| frame.map(<[u8]>::to_vec))).collect()
    }

    proptest! {
        #[test]
        fn a_record_of_any_bytes_comes_back(id in 1u32.., record in prop::collection::vec(any::<u8>(), 0..=record::MAX_LEN)) {
            let mut buffer = [0; MAX_FRAME];
            let sent = encode(id, &Request::PutRecord { record: &record, replace: true }, &mut buffer).unwrap();
            prop_assert_eq!(sent.iter().position(|byte| *byte == 0), Some(sent.len() - 1));
            let got = frames(&mut Receiver::default(), sent);
            let (header, message) = split(got[0].as_ref().unwrap()).unwrap();
            prop_assert_eq!(header.id, id);
            prop_assert_eq!(header.read(message), Ok(Request::PutRecord { record: &record, replace: true }));
        }

        #[test]
        fn whatever_comes_no_byte_is_read_as_a_message_and_the_next_frame_is(
            noise in prop::collection::vec(any::<u8>(), 0..2000),
        ) {
            let mut receiver = Receiver::default();
            for frame in frames(&mut receiver, &noise).into_iter().flatten() {
                prop_assert!(split(&frame).is_err());
            }
            receiver.push(0);
            let mut buffer = [0; MAX_FRAME];
            let sent = encode(7, &Reply::Done, &mut buffer).unwrap();
            prop_assert_eq!(frames(&mut receiver, sent).len(), 1);
        }

        #[test]
        fn one_flipped_bit_is_damage(bit in 0usize..80) {
            let mut buffer = [0; MAX_FRAME];
            let length = encode(0x0102_0304, &Request::Status, &mut buffer).unwrap().len();
            let bit = bit % (8 * (length - 1));
            buffer[bit / 8] ^= 1 << (bit % 8);
            for frame in frames(&mut Receiver::default(), &buffer[..length]).into_iter().flatten() {
                prop_assert_eq!(split(&frame), Err(FrameError::Damaged));
            }
        }
    }

    #[test]
    fn a_frame_too_long_is_passed_over_to_its_end() {
        let mut receiver = Receiver::default();
        let long = [&[1; MAX_FRAME + 1][..], &[0]].concat();
        assert_eq!(frames(&mut receiver, &long), [Err(FrameError::Oversized)]);
        let mut buffer = [0; MAX_FRAME];
        let sent = encode(7, &Request::Status, &mut buffer).unwrap();
        assert!(frames(&mut receiver, sent)[0].is_ok());
    }

    #[test]
    fn another_version_is_told_by_its_id() {
        let header = Header { version: VERSION + 1, id: 9 };
        assert_eq!(header.read::<Request<'_>>(&[0]), Err(FrameError::Version { found: VERSION + 1 }));
    }

    #[test]
    fn what_stands_behind_a_message_makes_it_malformed() {
        let header = Header { version: VERSION, id: 9 };
        assert_eq!(header.read::<Request<'_>>(&[0, 0]), Err(FrameError::Malformed));
        assert_eq!(header.read::<Request<'_>>(&[0]), Ok(Request::Identify));
    }
}
