//! Bytes as they come over a line: whatever they are, frames and messages are read or refused, and nothing panics.
#![no_main]

use imucal_core::link::{MAX_FRAME, Header, Receiver, Reply, Request, VERSION, encode, split};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut receiver = Receiver::default();
    for byte in bytes {
        if let Some(Ok(frame)) = receiver.push(*byte)
            && let Ok((header, message)) = split(frame)
        {
            read(&header, message);
        }
    }
    // Past the checksum, which a fuzzer hardly ever meets; what is read comes back when it is written again.
    read(&Header { version: VERSION, id: 1 }, bytes);
});

fn read(header: &Header, message: &[u8]) {
    let _reply = header.read::<Reply<'_>>(message);
    if let Ok(request) = header.read::<Request<'_>>(message) {
        let mut buffer = [0; MAX_FRAME];
        if encode(header.id, &request, &mut buffer).is_ok() {
            let mut receiver = Receiver::default();
            let whole = buffer.iter().find_map(|byte| receiver.push(*byte).map(|frame| frame.is_ok()));
            assert_eq!(whole, Some(true));
        }
    }
}
