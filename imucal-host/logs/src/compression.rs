//! Chunks and messages, decompressed.

use std::io::Read;

/// Why a chunk gave less than it should.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ChunkFault {
    /// A method that is not known.
    Method,
    /// What came of it is in the buffer.
    Damaged(String),
}

/// Decompresses what shall be `size` bytes. What came before a fault is in `into`.
pub(crate) fn decompress(method: &str, data: &[u8], size: u64, into: &mut Vec<u8>) -> Result<(), ChunkFault> {
    into.clear();
    let read = match method {
        "" | "none" => data.take(size).read_to_end(into),
        "lz4" => lz4_flex::frame::FrameDecoder::new(data).take(size).read_to_end(into),
        "zstd" => zstd::stream::read::Decoder::with_buffer(data)
            .and_then(|decoder| decoder.take(size).read_to_end(into)),
        "bz2" => bzip2::read::BzDecoder::new(data).take(size).read_to_end(into),
        _ => return Err(ChunkFault::Method),
    };
    match read {
        Err(cause) => Err(ChunkFault::Damaged(format!("a damaged {method} stream ({cause})"))),
        Ok(_) if (into.len() as u64) < size => {
            Err(ChunkFault::Damaged(format!("a chunk of {} bytes instead of {size}", into.len())))
        }
        Ok(_) => Ok(()),
    }
}

/// The first bytes of a stream of zstd.
const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

/// Whether bytes begin as a stream of zstd does.
pub(crate) fn is_zstd(data: &[u8]) -> bool {
    data.starts_with(ZSTD)
}

/// Decompresses a stream of zstd of at most `limit` bytes; what was found where it is none.
pub(crate) fn decompress_message(data: &[u8], limit: u64) -> Result<Vec<u8>, String> {
    let mut message = Vec::new();
    let read = zstd::stream::read::Decoder::with_buffer(data)
        .and_then(|decoder| decoder.take(limit.saturating_add(1)).read_to_end(&mut message));
    match read {
        Err(cause) => Err(format!("a damaged zstd stream ({cause})")),
        Ok(read) if read as u64 > limit => Err(format!("a zstd stream of more than {limit} bytes")),
        Ok(_) => Ok(message),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chunk_is_as_long_as_it_says_or_damaged() {
        let mut chunk = Vec::new();
        assert_eq!(decompress("none", b"abcdef", 4, &mut chunk), Ok(()));
        assert_eq!(chunk, b"abcd");
        assert!(matches!(decompress("", b"abc", 4, &mut chunk), Err(ChunkFault::Damaged(_))));
        assert_eq!(decompress("brotli", b"abc", 3, &mut chunk), Err(ChunkFault::Method));
        for method in ["lz4", "zstd", "bz2"] {
            let found = decompress(method, b"no such stream", 4, &mut chunk);
            assert!(matches!(found, Err(ChunkFault::Damaged(_))), "{method}: {found:?}");
        }
    }

    #[test]
    fn what_came_before_the_cut_is_kept() {
        let text: Vec<u8> = (0..1_000_000u32).flat_map(u32::to_le_bytes).collect();
        let packed = zstd::stream::encode_all(text.as_slice(), 1).unwrap();
        let mut chunk = Vec::new();
        assert_eq!(decompress("zstd", &packed, text.len() as u64, &mut chunk), Ok(()));
        assert!(chunk == text);
        assert!(decompress("zstd", &packed[..packed.len() / 2], text.len() as u64, &mut chunk).is_err());
        assert!(!chunk.is_empty() && text.starts_with(&chunk), "{}", chunk.len());
    }
}
