//! The bytes of a text file: decompressed, without a byte-order mark.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::read_error::ReadError;

/// A file's bytes, decompressed and without a byte-order mark.
pub(crate) struct Content {
    bytes: Vec<u8>,
    mark: usize,
    /// The compressed stream ended early.
    pub(crate) truncated: bool,
}

impl Content {
    pub(crate) fn read(path: &Path) -> Result<Self, ReadError> {
        let unreadable =
            |cause: io::Error| ReadError::Unreadable { path: path.to_path_buf(), found: cause.to_string() };
        let mut bytes = fs::read(path).map_err(unreadable)?;
        let mut truncated = false;
        if bytes.starts_with(&[0x1f, 0x8b]) {
            (bytes, truncated) = inflate(path, &bytes)?;
        }
        if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
            return Err(ReadError::NotUtf8 { path: path.to_path_buf(), line: 1 });
        }
        let mark = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        if bytes[mark..].trim_ascii().is_empty() {
            return Err(ReadError::Empty { path: path.to_path_buf() });
        }
        Ok(Self { bytes, mark, truncated })
    }

    /// The text after the mark.
    pub(crate) fn text(&self) -> &[u8] {
        &self.bytes[self.mark..]
    }
}

fn inflate(path: &Path, packed: &[u8]) -> Result<(Vec<u8>, bool), ReadError> {
    let mut bytes = Vec::with_capacity(packed.len().saturating_mul(5));
    match MultiGzDecoder::new(packed).read_to_end(&mut bytes) {
        Ok(_) => Ok((bytes, false)),
        Err(cause) if cause.kind() == io::ErrorKind::UnexpectedEof => Ok((bytes, true)),
        Err(cause) => Err(ReadError::Damaged {
            path: path.to_path_buf(),
            found: cause.to_string(),
            expected: "an intact gzip stream",
        }),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::super::fixture::{Fixture, assert_says, csv};

    const HEADER: &str = "t,acc_x,acc_y,acc_z\n";

    fn rows(lines: &str) -> String {
        format!("{HEADER}{lines}")
    }

    fn packed(text: &str) -> Vec<u8> {
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
