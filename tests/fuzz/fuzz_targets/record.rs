//! Bytes as they lie in flash: whatever they are, a record is read or refused, and what is read can be written.
#![no_main]

use imucal_core::record::{MAX_LEN, decode, encode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(record) = decode(bytes) {
        assert!(encode(&record, &mut [0; MAX_LEN]).is_ok());
    }
});
