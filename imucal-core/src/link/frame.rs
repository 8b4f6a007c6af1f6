//! Messages to frames and back.

use cobs::{DecodeResult, DecoderState};
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use serde::{Deserialize, Serialize};

use super::{Asked, SEAL, Seal, VERSION};
use crate::record;

/// Version, id, flags and session.
const HEADER: usize = 1 + 4 + 1 + 4;
const CHECKSUM: usize = 4;
/// The longest message: a record, its variant and its length; all others are shorter.
const MAX_MESSAGE: usize = record::MAX_LEN + 8;
/// Room for a seal, where there are keys.
const SEAL_ROOM: usize = if cfg!(feature = "key") { SEAL } else { 0 };
/// The longest frame before COBS.
const MAX_PLAIN: usize = HEADER + MAX_MESSAGE + SEAL_ROOM + CHECKSUM;
/// The longest frame as it is sent, bytes: COBS adds one byte in 254 at the most, and a zero ends the frame.
pub const MAX_FRAME: usize = MAX_PLAIN + MAX_PLAIN.div_ceil(254) + 1;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Flag of a frame that comes from a device.
const FROM_DEVICE: u8 = 1;
/// Flag of a frame with a seal.
const SEALED: u8 = 2;

/// The version that all versions refuse another in.
const REFUSING: u8 = 1;
/// What the message of such a refusal begins with; the version that is spoken follows.
pub const VERSION_REFUSAL: [u8; 2] = [9, 2];

/// Why a frame was not read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// Longer than [`MAX_FRAME`].
    Oversized,
    /// Not COBS, too short, or its CRC is wrong.
    Damaged,
    /// A frame of another version.
    Version {
        /// The frame's.
        found: u8,
        /// Its id.
        id: u32,
    },
    /// The other end speaks another version, and refuses this one's frame. Not to be answered.
    Refused {
        /// What the other end speaks.
        supported: u8,
        /// Id of the frame that is refused.
        id: u32,
    },
    /// Intact, but no frame or message of this version.
    Malformed,
}

/// Who sends a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Origin {
    /// A host: the message is a request.
    Host,
    /// A device: the message is a reply.
    Device,
}

/// What stands before the message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Id of the request.
    pub id: u32,
    /// Who sends it.
    pub origin: Origin,
    /// Name of the session; 0 outside of any.
    pub session: u32,
}

impl Header {
    /// Of the answer to a request.
    pub fn answer(asked: &Asked) -> Self {
        Self { id: asked.id, origin: Origin::Device, session: asked.session }
    }
}

/// An intact frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What stands before the message.
    pub header: Header,
    /// The message's bytes.
    pub message: &'a [u8],
    /// The seal behind it, where there is one.
    pub seal: Option<&'a [u8; SEAL]>,
    /// Header and message: what a seal is over.
    covered: &'a [u8],
}

/// Writes a frame to the start of `buffer`; gives the bytes to send.
///
/// # Errors
///
/// [`FrameError::Oversized`] where the frame is longer than the buffer; one of [`MAX_FRAME`] bytes always suffices.
pub fn encode<'b>(
    header: &Header,
    message: &impl Serialize,
    seal: Option<Seal<'_>>,
    buffer: &'b mut [u8; MAX_FRAME],
) -> Result<&'b [u8], FrameError> {
    let mut plain = [0; MAX_PLAIN];
    let length = write(header, message, seal, &mut plain).ok_or(FrameError::Oversized)?;
    finish(&mut plain, length, buffer).ok_or(FrameError::Oversized)
}

/// Writes the refusal of a frame of another version: in the form that no version changes.
pub fn refuse_version(id: u32, buffer: &mut [u8; MAX_FRAME]) -> &[u8] {
    let mut plain = [0; MAX_PLAIN];
    let ([a, b, c, d], [x, y]) = (id.to_le_bytes(), VERSION_REFUSAL);
    let refusal = [REFUSING, a, b, c, d, x, y, VERSION];
    plain.iter_mut().zip(refusal).for_each(|(slot, byte)| *slot = byte);
    finish(&mut plain, refusal.len(), buffer).unwrap_or_default()
}

/// Header, message and seal before checksum and COBS; their length.
fn write(
    header: &Header,
    message: &impl Serialize,
    seal: Option<Seal<'_>>,
    plain: &mut [u8; MAX_PLAIN],
) -> Option<usize> {
    let [a, b, c, d] = header.id.to_le_bytes();
    let [s, t, u, v] = header.session.to_le_bytes();
    let from = if header.origin == Origin::Device { FROM_DEVICE } else { 0 };
    let flags = if seal.is_some() { from | SEALED } else { from };
    *plain.first_chunk_mut::<HEADER>()? = [VERSION, a, b, c, d, flags, s, t, u, v];
    let body = plain.get_mut(HEADER..HEADER + MAX_MESSAGE)?;
    let end = HEADER + postcard::to_slice(message, body).ok()?.len();
    let Some(seal) = seal else { return Some(end) };
    let seal = seal.of(plain.get(..end)?);
    plain.get_mut(end..end + SEAL)?.copy_from_slice(&seal);
    Some(end + SEAL)
}

/// Puts the checksum behind a frame, and writes it by COBS with its end.
fn finish<'b>(
    plain: &mut [u8; MAX_PLAIN],
    length: usize,
    buffer: &'b mut [u8; MAX_FRAME],
) -> Option<&'b [u8]> {
    let checksum = CRC.checksum(plain.get(..length)?).to_le_bytes();
    plain.get_mut(length..length + CHECKSUM)?.copy_from_slice(&checksum);
    let encoded = cobs::try_encode(plain.get(..length + CHECKSUM)?, buffer).ok()?;
    *buffer.get_mut(encoded)? = 0;
    buffer.get(..=encoded)
}

/// Splits a frame without COBS into its parts.
///
/// # Errors
///
/// All but [`FrameError::Oversized`].
pub fn split(plain: &[u8]) -> Result<Frame<'_>, FrameError> {
    let (checked, stored) = plain.split_last_chunk::<CHECKSUM>().ok_or(FrameError::Damaged)?;
    if CRC.checksum(checked) != u32::from_le_bytes(*stored) {
        return Err(FrameError::Damaged);
    }
    let ([version, a, b, c, d], rest) = checked.split_first_chunk().ok_or(FrameError::Damaged)?;
    let id = u32::from_le_bytes([*a, *b, *c, *d]);
    match (*version, rest) {
        (VERSION, _) => {}
        (REFUSING, [x, y, supported]) if [*x, *y] == VERSION_REFUSAL => {
            return Err(FrameError::Refused { supported: *supported, id });
        }
        (found, _) => return Err(FrameError::Version { found, id }),
    }
    let ([flags, s, t, u, v], rest) = rest.split_first_chunk().ok_or(FrameError::Malformed)?;
    if flags & !(FROM_DEVICE | SEALED) != 0 {
        return Err(FrameError::Malformed);
    }
    let origin = if flags & FROM_DEVICE == 0 { Origin::Host } else { Origin::Device };
    let header = Header { id, origin, session: u32::from_le_bytes([*s, *t, *u, *v]) };
    if flags & SEALED == 0 {
        return Ok(Frame { header, message: rest, seal: None, covered: checked });
    }
    let (message, seal) = rest.split_last_chunk().ok_or(FrameError::Malformed)?;
    let covered = checked.get(..HEADER + message.len()).ok_or(FrameError::Malformed)?;
    Ok(Frame { header, message, seal: Some(seal), covered })
}

impl<'a> Frame<'a> {
    /// Reads the message.
    ///
    /// # Errors
    ///
    /// [`FrameError::Malformed`].
    pub fn read<M: Deserialize<'a>>(&self) -> Result<M, FrameError> {
        read(self.message)
    }

    /// Whether it has a seal, and that one's.
    pub fn is_sealed_by(&self, seal: &Seal<'_>) -> bool {
        self.seal.is_some_and(|found| seal.is_of(self.covered, found))
    }
}

/// Reads a message, and nothing behind it.
fn read<'a, M: Deserialize<'a>>(message: &'a [u8]) -> Result<M, FrameError> {
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Malformed),
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
    use std::{vec, vec::Vec};

    const HOST: Header = Header { id: 7, origin: Origin::Host, session: 0x0102_0304 };
    const STATUS: Request<'_> = Request::Status;

    fn frames(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
        bytes.iter().filter_map(|byte| receiver.push(*byte).map(|frame| frame.map(<[u8]>::to_vec))).collect()
    }

    /// A frame without COBS, whatever stands in it.
    fn plain(bytes: &[u8]) -> Vec<u8> {
        [bytes, &CRC.checksum(bytes).to_le_bytes()].concat()
    }

    proptest! {
        #[test]
        fn a_record_of_any_bytes_comes_back(
            id in 1u32.., session: u32, record in prop::collection::vec(any::<u8>(), 0..=record::MAX_LEN),
        ) {
            let mut buffer = [0; MAX_FRAME];
            let header = Header { id, session, ..HOST };
            let request = Request::PutRecord { record: &record, replace: true };
            let sent = encode(&header, &request, None, &mut buffer).unwrap();
            prop_assert_eq!(sent.iter().position(|byte| *byte == 0), Some(sent.len() - 1));
            let got = frames(&mut Receiver::default(), sent);
            let frame = split(got[0].as_ref().unwrap()).unwrap();
            prop_assert_eq!((frame.header, frame.seal), (header, None));
            prop_assert_eq!(frame.read(), Ok(request));
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
            let sent = encode(&HOST, &Reply::Done, None, &mut buffer).unwrap();
            prop_assert_eq!(frames(&mut receiver, sent).len(), 1);
        }

        #[test]
        fn one_flipped_bit_is_damage(bit in 0usize..120) {
            let mut buffer = [0; MAX_FRAME];
            let length = encode(&HOST, &STATUS, None, &mut buffer).unwrap().len();
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
        let sent = encode(&HOST, &STATUS, None, &mut buffer).unwrap();
        assert!(frames(&mut receiver, sent)[0].is_ok());
    }

    #[test]
    fn a_frame_of_another_version_is_named_by_its_id() {
        // Version 1 and 3, with what stood behind the id in version 1 and with nothing.
        assert_eq!(split(&plain(&[1, 9, 0, 0, 0, 1])), Err(FrameError::Version { found: 1, id: 9 }));
        assert_eq!(split(&plain(&[3, 9, 1, 0, 0])), Err(FrameError::Version { found: 3, id: 265 }));
    }

    #[test]
    fn the_refusal_of_a_version_is_that_of_version_1() {
        let mut buffer = [0; MAX_FRAME];
        let refusal = frames(&mut Receiver::default(), refuse_version(9, &mut buffer));
        assert_eq!(refusal, [Ok(plain(&[1, 9, 0, 0, 0, 9, 2, 2]))]);
        // What a device of version 1 answers, and what this one does.
        for supported in [1, 2] {
            let refused = Err(FrameError::Refused { supported, id: 9 });
            assert_eq!(split(&plain(&[1, 9, 0, 0, 0, 9, 2, supported])), refused);
        }
    }

    #[test]
    fn what_stands_behind_a_message_makes_it_malformed() {
        let status = [2, 9, 0, 0, 0, 0, 4, 3, 2, 1, 1];
        let whole = plain(&status);
        assert_eq!(split(&whole).and_then(|frame| frame.read()), Ok(STATUS));
        let longer = plain(&[&status[..], &[0]].concat());
        assert_eq!(split(&longer).and_then(|frame| frame.read::<Request<'_>>()), Err(FrameError::Malformed));
    }

    #[test]
    fn a_cut_header_an_unknown_flag_and_a_cut_seal_are_malformed() {
        for bytes in [&[2, 9, 0, 0, 0][..], &[2, 9, 0, 0, 0, 0, 4, 3, 2], &[2, 9, 0, 0, 0, 4, 4, 3, 2, 1, 1]]
        {
            assert_eq!(split(&plain(bytes)), Err(FrameError::Malformed), "{bytes:?}");
        }
        let sealed = |seal: usize| [&[2, 9, 0, 0, 0, 2, 4, 3, 2, 1][..], &vec![0; seal]].concat();
        assert_eq!(split(&plain(&sealed(SEAL - 1))), Err(FrameError::Malformed));
        assert!(split(&plain(&sealed(SEAL))).is_ok_and(|frame| frame.seal == Some(&[0; SEAL])));
    }

    #[cfg(feature = "key")]
    #[test]
    fn a_seal_is_over_session_direction_id_and_message() {
        use crate::link::{Key, Nonces};
        let (key, nonces) = (Key::new([7; 32]), Nonces { host: 1, device: 2 });
        let seal = Seal { key: &key, nonces };
        let mut buffer = [0; MAX_FRAME];
        let sent = encode(&HOST, &STATUS, Some(seal), &mut buffer).unwrap();
        let whole = frames(&mut Receiver::default(), sent)[0].clone().unwrap();
        assert!(split(&whole).unwrap().is_sealed_by(&seal));
        let covered = whole.len() - CHECKSUM - SEAL;
        for at in 1..covered {
            let mut other = whole[..whole.len() - CHECKSUM].to_vec();
            other[at] ^= 1;
            if let Ok(frame) = split(&plain(&other)) {
                assert!(!frame.is_sealed_by(&seal), "byte {at}");
            }
        }
        let others = [
            Seal { key: &Key::new([8; 32]), ..seal },
            Seal { nonces: Nonces { host: 2, device: 2 }, ..seal },
            Seal { nonces: Nonces { host: 1, device: 3 }, ..seal },
        ];
        assert!(others.iter().all(|other| !split(&whole).unwrap().is_sealed_by(other)));
    }
}
