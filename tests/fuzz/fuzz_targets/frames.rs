//! Bytes as they come over a line.
#![no_main]

#[path = "../bodies.rs"]
#[allow(dead_code, reason = "the other target's")]
mod bodies;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bodies::frames(bytes);
});
