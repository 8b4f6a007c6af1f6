//! A gzip stream that a thread of its own decompresses, a few chunks ahead of who reads it.

use std::{
    io::{self, Read},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
};

use flate2::read::MultiGzDecoder;

/// Bytes of a chunk.
const CHUNK: u64 = 1 << 16;
/// Chunks that wait to be read, at most.
const AHEAD: usize = 8;

/// A chunk, empty at the end of the stream.
type Chunk = io::Result<Vec<u8>>;

/// The text of a gzip stream of one or more members.
pub(super) struct Inflated {
    chunks: Receiver<Chunk>,
    chunk: io::Cursor<Vec<u8>>,
    /// What is wrong with the stream behind what was read.
    fault: Option<io::Error>,
    ended: bool,
}

impl Inflated {
    /// Begins to decompress. Fails where the system has no thread to give.
    pub(super) fn of(source: impl Read + Send + 'static) -> io::Result<Self> {
        let (sender, chunks) = sync_channel(AHEAD);
        thread::Builder::new().name("gzip".into()).spawn(move || inflate(source, &sender))?;
        Ok(Self { chunks, chunk: io::Cursor::default(), fault: None, ended: false })
    }

    /// Goes on to the next chunk; false at the end. Waits for one where `waits`; else a chunk that is not there yet is none, and a fault
    /// is kept for the next time.
    fn advance(&mut self, waits: bool) -> io::Result<bool> {
        if self.ended {
            return Ok(false);
        }
        let gone = |_| Err(io::Error::other("its thread has ended"));
        let next = match self.fault.take() {
            Some(fault) => Err(fault),
            None if waits => self.chunks.recv().unwrap_or_else(gone),
            None => match self.chunks.try_recv() {
                Ok(next) => next,
                Err(_) => return Ok(false),
            },
        };
        match next {
            Err(fault) if !waits => self.fault = Some(fault),
            next => self.chunk = io::Cursor::new(next?),
        }
        self.ended = self.fault.is_none() && self.chunk.get_ref().is_empty();
        Ok(self.fault.is_none() && !self.ended)
    }
}

/// Ends with the stream, with what is wrong with it, or once nobody reads on.
fn inflate(source: impl Read, chunks: &SyncSender<Chunk>) {
    let mut decoder = MultiGzDecoder::new(source);
    loop {
        let mut chunk = Vec::new();
        let fault = decoder.by_ref().take(CHUNK).read_to_end(&mut chunk).err();
        let ends = chunk.is_empty() || fault.is_some();
        // What was decompressed before a fault is read before it.
        let text = Some(chunk).filter(|chunk| fault.is_none() || !chunk.is_empty());
        let mut parts = text.map(Ok).into_iter().chain(fault.map(Err));
        if parts.any(|part| chunks.send(part).is_err()) || ends {
            return;
        }
    }
}

impl Read for Inflated {
    /// All that is there already: many lines are read on several cores.
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < to.len() {
            let count = self.chunk.read(&mut to[filled..])?;
            filled += count;
            if count == 0 && !self.advance(filled == 0)? {
                break;
            }
        }
        Ok(filled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::read::text::tests::packed;

    fn text() -> String {
        (0..200_000u32).map(|k| format!("{}\n", k.wrapping_mul(2_654_435_761))).collect()
    }

    #[test]
    fn members_of_many_chunks_are_one_text_and_its_end_is_an_end_again_and_again() {
        let (first, second) = (text(), "and more\n");
        let source = io::Cursor::new([packed(&first), packed(second)].concat());
        let mut read = String::new();
        let mut inflated = Inflated::of(source).unwrap();
        inflated.read_to_string(&mut read).unwrap();
        assert!(read == first + second);
        assert_eq!(inflated.read(&mut [0; 8]).unwrap(), 0);
    }

    #[test]
    fn a_cut_stream_gives_its_text_and_then_its_fault() {
        let (whole, bytes) = (text(), packed(&text()));
        let mut inflated = Inflated::of(io::Cursor::new(bytes[..bytes.len() / 2].to_vec())).unwrap();
        let mut read = Vec::new();
        let fault = inflated.read_to_end(&mut read).unwrap_err();
        assert_eq!(fault.kind(), io::ErrorKind::UnexpectedEof);
        assert!(read.len() > whole.len() / 3 && whole.as_bytes().starts_with(&read));
    }

    #[test]
    fn a_source_that_panics_is_no_end_of_the_text() {
        struct Panics;
        impl Read for Panics {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                panic!("on purpose")
            }
        }
        assert!(Inflated::of(Panics).unwrap().read(&mut [0; 8]).is_err());
    }
}
