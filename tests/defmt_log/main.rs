//! Prints what an image logged, a line each: its level and its text.
//!
//! ```text
//! imucal-defmt-log IMAGE < FRAMES
//! ```
//!
//! Fails where the image has no table of defmt, and where a frame is malformed.

use std::error::Error;
use std::io::{Read, stdin};

use defmt_decoder::{DecodeError, Table};

fn main() -> Result<(), Box<dyn Error>> {
    let image = std::env::args_os().nth(1).ok_or("usage: imucal-defmt-log IMAGE < FRAMES")?;
    let table = Table::parse(&std::fs::read(image)?)?.ok_or("the image has no table of defmt")?;
    let mut frames = Vec::new();
    stdin().read_to_end(&mut frames)?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(&frames);
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map_or("print", |level| level.as_str());
                println!("{level} {}", frame.display_message());
            }
            Err(DecodeError::UnexpectedEof) => return Ok(()),
            Err(DecodeError::Malformed) => return Err("a frame is malformed".into()),
        }
    }
}
