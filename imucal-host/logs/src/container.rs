//! What all containers are: connections and their messages, in a file.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
    path::Path,
};

use crate::{
    bag_file, compression::is_zstd, error::LogError, mcap_file, place::Place, sqlite_file,
    warning::LogWarning,
};

/// What a log is kept in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Container {
    Mcap,
    Bag,
    Sqlite,
}

/// Who publishes what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Connection {
    pub(crate) id: u32,
    pub(crate) topic: String,
    pub(crate) type_name: String,
    /// Of the messages: `cdr`, `ros1` or another.
    pub(crate) encoding: String,
    /// Of the definition: `ros1msg`, `ros2msg` or another; empty if there is none.
    pub(crate) language: String,
    pub(crate) definition: String,
    /// Of the definition, where the container has it.
    pub(crate) md5: Option<String>,
}

/// A message as it stands in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawMessage<'a> {
    pub(crate) connection: u32,
    /// When it was recorded, ns.
    pub(crate) log_ns: i64,
    /// Of the message, or of its chunk.
    pub(crate) place: Place,
    pub(crate) data: &'a [u8],
}

/// Who looks at a file's content, in the file's order.
pub(crate) trait Visitor {
    /// A connection; the same one may come again. Whether its messages are of interest: the others need not be shown.
    fn connection(&mut self, connection: Connection) -> bool;
    fn message(&mut self, message: RawMessage<'_>) -> Result<(), LogError>;
    fn warn(&mut self, warning: LogWarning);
}

/// Connections and how many messages each has.
pub(crate) type Listing = Vec<(Connection, u64)>;

impl Container {
    /// By the first bytes of a file.
    pub(crate) fn of(path: &Path) -> Result<Self, LogError> {
        let mut source = Source::open(path)?;
        let mut begin = Vec::new();
        source.fill(16, &mut begin)?;
        if begin.starts_with(mcap::MAGIC) {
            Ok(Self::Mcap)
        } else if begin.starts_with(bag_file::MAGIC) {
            Ok(Self::Bag)
        } else if begin.starts_with(sqlite_file::MAGIC) {
            Ok(Self::Sqlite)
        } else if is_zstd(&begin) {
            Err(LogError::Packed { path: path.to_path_buf() })
        } else {
            let found = begin.escape_ascii().to_string();
            Err(LogError::Container { path: path.to_path_buf(), found })
        }
    }

    /// Looks at all of a file; no record and no chunk may be larger than `size`.
    pub(crate) fn scan(self, path: &Path, size: u64, visitor: &mut dyn Visitor) -> Result<(), LogError> {
        match self {
            Self::Mcap => mcap_file::scan(path, size, visitor),
            Self::Bag => bag_file::scan(path, size, visitor),
            Self::Sqlite => sqlite_file::scan(path, size, visitor),
        }
    }

    /// What the file's own index says; `None` where it has none.
    pub(crate) fn listing(self, path: &Path, size: u64) -> Result<Option<Listing>, LogError> {
        match self {
            Self::Mcap => mcap_file::listing(path, size),
            Self::Bag => bag_file::listing(path, size),
            Self::Sqlite => sqlite_file::listing(path),
        }
    }
}

/// A file that is read from one place to the next.
pub(crate) struct Source<'a> {
    path: &'a Path,
    file: BufReader<File>,
    at: u64,
    length: u64,
}

impl<'a> Source<'a> {
    pub(crate) fn open(path: &'a Path) -> Result<Self, LogError> {
        let unreadable = |cause: std::io::Error| unreadable(path, &cause);
        let mut file = File::open(path).map_err(unreadable)?;
        let length = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
        file.rewind().map_err(unreadable)?;
        Ok(Self { path, file: BufReader::new(file), at: 0, length })
    }

    /// Bytes from the beginning.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// Bytes to the end.
    pub(crate) fn left(&self) -> u64 {
        self.length.saturating_sub(self.at)
    }

    /// Reads so many bytes, or as many as there are.
    pub(crate) fn fill(&mut self, bytes: u64, into: &mut Vec<u8>) -> Result<(), LogError> {
        into.clear();
        let read = self.file.by_ref().take(bytes).read_to_end(into);
        self.at += read.map_err(|cause| unreadable(self.path, &cause))? as u64;
        Ok(())
    }

    /// Goes on behind so many bytes, or at the end.
    pub(crate) fn skip(&mut self, bytes: u64) -> Result<(), LogError> {
        let bytes = bytes.min(self.left());
        let near = self.file.fill_buf().map_err(|cause| unreadable(self.path, &cause))?.len() as u64;
        if bytes <= near {
            self.file.consume(bytes as usize);
            self.at += bytes;
            return Ok(());
        }
        self.seek(self.at + bytes)
    }

    /// Goes on at a place.
    pub(crate) fn seek(&mut self, to: u64) -> Result<(), LogError> {
        self.file.seek(SeekFrom::Start(to)).map_err(|cause| unreadable(self.path, &cause))?;
        self.at = to;
        Ok(())
    }

    /// So many bytes of a record as large as it says, but not more than `size`.
    pub(crate) fn record(&mut self, bytes: u64, size: u64, into: &mut Vec<u8>) -> Result<(), LogError> {
        if bytes > size {
            let path = self.path.to_path_buf();
            return Err(LogError::TooLarge { path, place: Place::Byte(self.at), found: bytes, limit: size });
        }
        self.fill(bytes, into)
    }

    /// That the bytes at a place are not what they should be.
    pub(crate) fn damaged(&self, offset: u64, found: impl Into<String>, expected: &'static str) -> LogError {
        LogError::Damaged {
            path: self.path.to_path_buf(),
            place: Place::Byte(offset),
            found: found.into(),
            expected,
        }
    }

    pub(crate) fn path(&self) -> &'a Path {
        self.path
    }
}

fn unreadable(path: &Path, cause: &std::io::Error) -> LogError {
    LogError::Unreadable { path: path.to_path_buf(), found: cause.to_string() }
}
