//! What is asked of the decoders, whatever the bytes are: by the fuzzer, and by `tests/decoders.rs` with a seed.

use crc::{CRC_32_ISO_HDLC, Crc};
use imucal_core::link::{Frame, Header, MAX_FRAME, Origin, Receiver, Reply, Request, encode, split};
use imucal_core::record;

/// Bytes as they come over a line: frames and messages are read or refused, and nothing panics. Gives how many
/// messages were read.
pub fn frames(bytes: &[u8]) -> u32 {
    let mut receiver = Receiver::default();
    let mut count = 0;
    for byte in bytes {
        if let Some(Ok(frame)) = receiver.push(*byte)
            && let Ok(frame) = split(frame)
        {
            count += read(&frame);
        }
    }
    // Past the checksum, which a fuzzer hardly ever meets.
    let whole = checked(bytes);
    count + split(&whole).map_or(0, |frame| read(&frame))
}

/// Bytes behind the header of a request of this version, and before a checksum that fits them.
fn checked(bytes: &[u8]) -> Vec<u8> {
    let mut whole = [&[imucal_core::link::VERSION, 1, 0, 0, 0, 0, 0, 0, 0, 0], bytes].concat();
    whole.extend(Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&whole).to_le_bytes());
    whole
}

/// What is read comes back when it is written again.
fn read(frame: &Frame<'_>) -> u32 {
    let reply = frame.read::<Reply<'_>>().is_ok();
    let Ok(request) = frame.read::<Request<'_>>() else { return reply.into() };
    let mut buffer = [0; MAX_FRAME];
    let header = Header { origin: Origin::Host, ..frame.header };
    if encode(&header, &request, None, &mut buffer).is_ok() {
        let mut receiver = Receiver::default();
        let whole = buffer.iter().find_map(|byte| receiver.push(*byte).map(|frame| frame.is_ok()));
        assert_eq!(whole, Some(true));
    }
    1 + u32::from(reply)
}

/// Bytes as they lie in flash: a record is read or refused, and what is read comes back when it is written. Gives how
/// many records were read.
pub fn records(bytes: &[u8]) -> u32 {
    // As they are, and behind a header and before a checksum that fit them.
    u32::from(decoded(bytes)) + u32::from(decoded(&sealed(bytes)))
}

fn decoded(bytes: &[u8]) -> bool {
    let Ok(read) = record::decode(bytes) else { return false };
    let mut page = [0; record::MAX_LEN];
    let written = record::encode(&read, &mut page).expect("what was read can be written");
    assert_eq!(record::decode(written).as_ref(), Ok(&read));
    true
}

/// The payload of a record, as its whole.
fn sealed(payload: &[u8]) -> Vec<u8> {
    let payload = &payload[..payload.len().min(u16::MAX.into())];
    let (major, minor) = record::VERSION;
    let length = (payload.len() as u16).to_le_bytes();
    let mut whole = [b"IMUC", &[major, minor][..], &length, payload].concat();
    whole.extend(Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&whole).to_le_bytes());
    whole
}
