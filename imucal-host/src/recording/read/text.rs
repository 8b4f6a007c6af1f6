//! The text of a file: decompressed, without a byte-order mark, a chunk at a time and no more than the limits allow.

use std::{
    fs::File,
    io::{self, Cursor, Read},
    path::Path,
};

use super::inflated::Inflated;
use crate::{
    file::{Limits, limits::Size, metered::Metered},
    recording::read_error::ReadError,
};

/// Bytes of a chunk.
const CHUNK: usize = 1 << 19;
/// What gzip makes of samples, roughly.
const COMPRESSION: u64 = 5;

/// A text that is read once, from its beginning to its end.
pub(crate) struct Text<'a> {
    path: &'a Path,
    limit: u64,
    source: Box<dyn Read>,
    compressed: bool,
    chunk: Vec<u8>,
    /// The part of `chunk` that is not consumed yet.
    left: std::ops::Range<usize>,
    /// Bytes read so far, decompressed.
    total: u64,
    ended: bool,
    /// The last byte that was consumed.
    last: Option<u8>,
    /// How long the text probably is, where the file says.
    pub(crate) expected: u64,
    /// The compressed stream ended early.
    pub(crate) truncated: bool,
}

impl<'a> Text<'a> {
    pub(crate) fn open(path: &'a Path, limits: &Limits) -> Result<Self, ReadError> {
        let unreadable =
            |cause: io::Error| ReadError::Unreadable { path: path.to_path_buf(), found: cause.to_string() };
        let mut file = File::open(path).map_err(unreadable)?;
        let length = file.metadata().map_or(0, |found| found.len());
        let mut head = Vec::new();
        file.by_ref().take(2).read_to_end(&mut head).map_err(unreadable)?;
        let compressed = head == [0x1f, 0x8b];
        let whole = Cursor::new(head).chain(Metered(file));
        let source: Box<dyn Read> =
            if compressed { Box::new(Inflated::of(whole).map_err(unreadable)?) } else { Box::new(whole) };
        let mut text = Self {
            path,
            limit: limits.size,
            source,
            compressed,
            chunk: vec![0; CHUNK],
            left: 0..0,
            total: 0,
            ended: false,
            last: None,
            expected: length.saturating_mul(if compressed { COMPRESSION } else { 1 }).min(limits.size),
            truncated: false,
        };
        text.skip_mark()?;
        Ok(text)
    }

    /// What comes next, at least a byte; nothing at the end.
    pub(crate) fn next(&mut self) -> Result<&[u8], ReadError> {
        if self.left.is_empty() && !self.ended {
            self.left = 0..0;
            self.fill()?;
        }
        Ok(&self.chunk[self.left.clone()])
    }

    /// Goes on by so many bytes of [`Text::next`].
    pub(crate) fn consume(&mut self, count: usize) {
        self.left.start += count;
        if count > 0 {
            self.last = self.chunk[..self.left.start].last().copied();
        }
    }

    /// The bytes that were consumed last, so many of one [`Text::next`].
    pub(crate) fn consumed(&self, count: usize) -> &[u8] {
        &self.chunk[self.left.start - count..self.left.start]
    }

    /// The next line without its end, of a text in which nothing but a line feed ends one; false at the end.
    pub(crate) fn line_into(
        &mut self,
        line: &mut Vec<u8>,
        number: u64,
        limits: &Limits,
    ) -> Result<bool, ReadError> {
        line.clear();
        loop {
            let found = self.next()?;
            if found.is_empty() {
                return Ok(!line.is_empty());
            }
            let end = found.iter().position(|byte| *byte == b'\n');
            line.extend_from_slice(&found[..end.unwrap_or(found.len())]);
            self.consume(end.map_or(self.left.len(), |end| end + 1));
            if line.len() > limits.line() {
                let (path, limit) = (self.path.to_path_buf(), Size(limits.line() as u64));
                return Err(ReadError::LineTooLong { path, line: number, limit });
            }
            if end.is_some() {
                return Ok(true);
            }
        }
    }

    /// Whether what was consumed last ends a line.
    pub(crate) fn ends_line(&self) -> bool {
        matches!(self.last, Some(b'\n' | b'\r'))
    }

    /// Where a compressed stream is damaged, all that was found in its text is in doubt. Reads it to its end.
    pub(crate) fn damage(&mut self) -> Option<ReadError> {
        while self.compressed && !self.ended {
            self.left = 0..0;
            match self.fill() {
                Err(damaged @ ReadError::Damaged { .. }) => return Some(damaged),
                Err(_) => return None,
                Ok(()) => {}
            }
        }
        None
    }

    /// Puts more behind what is left of the chunk.
    fn fill(&mut self) -> Result<(), ReadError> {
        let count = loop {
            match self.source.read(&mut self.chunk[self.left.end..]) {
                Ok(count) => break count,
                Err(cause) if cause.kind() == io::ErrorKind::Interrupted => {}
                Err(cause) => {
                    self.ended = true;
                    return self.broken(&cause);
                }
            }
        };
        self.ended = count == 0;
        self.left.end += count;
        self.total += count as u64;
        if self.total > self.limit {
            return Err(ReadError::TooLong { path: self.path.to_path_buf(), limit: Size(self.limit) });
        }
        Ok(())
    }

    fn broken(&mut self, cause: &io::Error) -> Result<(), ReadError> {
        let (path, found) = (self.path.to_path_buf(), cause.to_string());
        if !self.compressed {
            return Err(ReadError::Unreadable { path, found });
        }
        if cause.kind() == io::ErrorKind::UnexpectedEof {
            self.truncated = true;
            return Ok(());
        }
        Err(ReadError::Damaged { path, found, expected: "an intact gzip stream" })
    }

    fn skip_mark(&mut self) -> Result<(), ReadError> {
        while self.left.end < 3 && !self.ended {
            self.fill()?;
        }
        let head = &self.chunk[..self.left.end];
        if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
            return Err(ReadError::NotUtf8 { path: self.path.to_path_buf(), line: 1 });
        }
        if head.starts_with(b"\xef\xbb\xbf") {
            self.consume(3);
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::Write;

    use flate2::{Compression, write::GzEncoder};

    use crate::recording::fixture::{Fixture, assert_says, csv};

    const HEADER: &str = "t,acc_x,acc_y,acc_z\n";

    fn rows(lines: &str) -> String {
        format!("{HEADER}{lines}")
    }

    pub(crate) fn packed(text: &str) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text.as_bytes()).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn a_gzipped_file_is_read_also_in_several_members() {
        let mut bytes = packed(&rows("0,0,0,9.8\n"));
        bytes.extend(packed("1,0,0,9.8\n"));
        let recording = Fixture::new("run.csv.gz", "", bytes).read();
        assert_eq!((recording.rows(), recording.name.as_str()), (2, "run.csv.gz"));
    }

    #[test]
    fn a_truncated_gzip_stream_keeps_its_whole_rows_with_a_warning() {
        let lines: String =
            (0..3000u32).map(|i| format!("{i},0.{},0,9.8\n", i.wrapping_mul(40503) % 977)).collect();
        let bytes = packed(&rows(&lines));
        let fixture = Fixture::new("run.csv.gz", "", &bytes[..bytes.len() / 2]);
        let kept = fixture.read().rows();
        assert!((500..2999).contains(&kept), "{kept}");
        let warnings = fixture.warnings().join("\n");
        let count = format!("{kept} whole rows were kept");
        assert_says(&warnings, &["run.csv.gz: the gzip stream ends early", &count, "copy the file again"]);
    }

    #[test]
    fn a_corrupt_gzip_stream_is_refused() {
        let mut bytes = packed(&rows("0,0,0,9.8\n1,0,0,9.8\n"));
        let middle = bytes.len() - 6;
        bytes[middle] ^= 0xff;
        let message = Fixture::new("run.csv.gz", "", bytes).error();
        assert_says(&message, &["run.csv.gz", "damaged", "expected an intact gzip stream", "copy"]);
    }

    #[test]
    fn files_without_samples_are_refused() {
        assert_says(&csv("").error(), &["run.csv", "empty file", "expected a header row", "again"]);
        assert_says(&csv("\n\n").error(), &["empty file"]);
        assert_says(&csv(HEADER).error(), &["run.csv", "header and no sample", "at least one row"]);
        assert_says(&csv("t,acc_x,acc_y,acc_z").error(), &["header and no sample"]);
    }

    #[test]
    fn other_encodings_are_refused() {
        let wide: Vec<u8> =
            std::iter::once(0xfeff).chain(HEADER.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        assert_says(&csv(wide).error(), &["run.csv, line 1", "not UTF-8", "save the file as UTF-8"]);
        assert_says(&csv(b"t,acc_x,acc_y,acc_z,\xb5\n0,0,0,9.8,1\n").error(), &["line 1", "not UTF-8"]);
    }
}
